//! A new effect is one new file and one new line: here one is added to a copy of the project, which then compiles, the FMU's library
//! (by `build.rs`) and the program's. Nothing outside may have to name it.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::path::{Path, PathBuf};
use std::process::Command;

/// Drag that grows with the cube of the speed.
const FILE: &str = r#"//! Drag with the cube of the speed: `f = coefficient*v^3`.

use super::family::Family;
use super::info::{EffectInfo, ParameterInfo, Place, Variant};
use super::shapes::{Base, Force, Internal, Moment, Reaction};
use crate::scalar::Scalar;

/// Cubic drag of the table.
pub struct CubicDrag;

impl Force for CubicDrag {
    const INFO: EffectInfo = EffectInfo {
        id: "cubic_drag",
        place: Place::Table,
        family: Family::ViscousFriction,
        title: "Drag with the cube of the speed",
        equation: "f = coefficient*v^3",
        signature: "r2 as the cube of omega2; odd lines",
        reference: "a test's own",
        parameters: &[ParameterInfo::size("coefficient", "N.m.s3/rad3", 0.0, 1e6, "Drag per cube of the speed")],
        memory: 0,
        named: true,
        textbook: false,
        odds: 1.0,
        bounds: |_, _| true,
        example: &[1e-6],
        variants: &[Variant { name: "", free: &[0] }],
    };

    fn torque<S: Scalar>(p: &[S], _base: &Base<S>, m: &Moment<S>, _memory: &mut [Internal<S>]) -> Reaction<S> {
        let v = m.end.v;
        let torque = p[0] * v * v * v;
        let damping = 3.0 * p[0].re() * v.re() * v.re();
        Reaction { torque, stiffness: 0.0, damping, curvature: f64::INFINITY }
    }
}
"#;
const LINE: &str = "    force CubicDrag = cubic_drag::CubicDrag, mod cubic_drag;\n";

/// Copies a file, or a folder with all in it.
fn copy(from: &Path, to: &Path) {
    if !from.is_dir() {
        std::fs::copy(from, to).unwrap_or_else(|e| panic!("{}: {e}", from.display()));
        return;
    }
    std::fs::create_dir_all(to).unwrap();
    for entry in std::fs::read_dir(from).unwrap() {
        let entry = entry.unwrap();
        copy(&entry.path(), &to.join(entry.file_name()));
    }
}

/// The copy without what an earlier run left, always at one place of the target folder: cargo knows it again there, and its
/// dependencies are those that other checks have compiled.
fn copied(target: &Path) -> PathBuf {
    let copied = target.join("new-effect");
    if copied.exists() {
        std::fs::remove_dir_all(&copied).unwrap();
    }
    std::fs::create_dir_all(&copied).unwrap();
    for name in ["Cargo.toml", "Cargo.lock", "build.rs", "crates", "src", "benches", "modelDescription", "LICENSE"] {
        copy(&Path::new(env!("CARGO_MANIFEST_DIR")).join(name), &copied.join(name));
    }
    copied
}

#[test]
fn a_new_effect_is_one_file_and_one_line() {
    // .../debug/deps/new_effect-0123456789abcdef
    let program = std::env::current_exe().unwrap();
    let target = program.ancestors().nth(3).unwrap();
    let copied = copied(target);
    std::fs::write(copied.join("crates/model/src/effects/cubic_drag.rs"), FILE).unwrap();
    let list = copied.join("crates/model/src/effects/mod.rs");
    let text = std::fs::read_to_string(&list).unwrap();
    assert!(text.ends_with(";\n}\n") && text.contains("\neffects! {\n"), "the list ends the file");
    std::fs::write(&list, format!("{}{LINE}}}\n", &text[..text.len() - "}\n".len()])).unwrap();

    let check = |package: &str| {
        let mut cargo = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
        cargo.args(["check", "--quiet", "--lib", "--locked", "--offline", "--package", package]);
        let done = cargo.current_dir(&copied).env("CARGO_TARGET_DIR", target).output().unwrap();
        (done.status.success(), String::from_utf8_lossy(&done.stderr).into_owned())
    };
    let (fine, said) = check("eixo");
    assert!(fine, "{said}");
    assert!(!said.contains("cubic_drag"), "not even a warning: {said}");
    // And the copy with its new line is what was compiled: without the file it is no program.
    std::fs::remove_file(copied.join("crates/model/src/effects/cubic_drag.rs")).unwrap();
    let (fine, said) = check("eixo-model");
    assert!(!fine && said.contains("cubic_drag"), "{said}");
    std::fs::remove_dir_all(&copied).unwrap();
}
