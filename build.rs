//! Builds the FMU's shared library for the command line to carry.
//!
//! `eixo export` must work wherever the program is installed, `cargo install` included, which installs no library. So
//! the lean library (the crate without its `cli` feature) is compiled here and embedded in the program. It has no
//! dependencies, which lets one direct call of the compiler do: no nested cargo, no lock, no network, no recursion
//! (the call has no `cli`, and runs no build script). It is always optimised, in a debug build too, and gets none of
//! the user's `RUSTFLAGS`: an FMU leaves the machine it was built on.

use std::env;
use std::path::{Path, PathBuf};
use std::process::{Command, exit};

/// What the lean library is made of.
const SOURCES: [&str; 6] = ["src/lib.rs", "src/scalar.rs", "src/axis", "src/effects", "src/fmi2", "src/variables"];

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    for source in SOURCES {
        println!("cargo::rerun-if-changed={source}");
    }
    if env::var_os("CARGO_FEATURE_CLI").is_none() {
        return;
    }
    let variable = |name: &str| env::var(name).unwrap_or_else(|_| fail(&format!("cargo sets no {name}")));
    let out = PathBuf::from(variable("OUT_DIR"));
    let root = variable("CARGO_MANIFEST_DIR");
    let target = variable("TARGET");
    let library = out.join("eixo_fmu_library");
    let mut rustc = Command::new(variable("RUSTC"));
    rustc
        .arg(Path::new(&root).join("src/lib.rs"))
        .args(["--crate-name", "eixo", "--edition", "2024", "--crate-type", "cdylib", "--cap-lints", "allow"])
        .args(["-C", "opt-level=3", "-C", "codegen-units=1", "-C", "panic=unwind", "-C", "strip=symbols"])
        // The same bytes wherever it is built, and no path of this machine in them.
        .arg(format!("--remap-path-prefix={root}=eixo"))
        .arg("-o")
        .arg(&library);
    if variable("PROFILE") == "release" {
        rustc.args(["-C", "lto=fat"]);
    }
    if target != variable("HOST") {
        rustc.args(["--target", &target]);
    }
    if let Some(linker) = env::var_os("RUSTC_LINKER") {
        rustc.arg("-C").arg(format!("linker={}", linker.to_string_lossy()));
    }
    match rustc.output() {
        Ok(done) if done.status.success() => {}
        Ok(done) => fail(&format!("the FMU's library does not compile:\n{}", String::from_utf8_lossy(&done.stderr))),
        Err(error) => fail(&format!("the compiler cannot be run: {error}")),
    }
}

fn fail(message: &str) -> ! {
    eprintln!("{message}");
    exit(1)
}
