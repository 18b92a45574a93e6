//! Builds the FMU's shared library for the command line to carry.
//!
//! `eixo export` must work wherever the program is installed, `cargo install` included, which installs no library. So
//! the lean library (the crate without its `cli` feature) is compiled here and embedded in the program. It has no
//! dependencies, which lets one direct call of the compiler do: no nested cargo, no lock, no network, no recursion
//! (the call has no `cli`, and runs no build script). It is always optimised, in a debug build too, and gets none of
//! the user's `RUSTFLAGS`: an FMU leaves the machine it was built on.
//!
//! `EIXO_PLATFORMS=win64` in the environment embeds the library for more platforms than the program's own, each named as
//! FMI names its folder and needing its target of rustup and a linker; `EIXO_LINKER_LINUX64=...` names another linker for
//! one of them. `scripts/platforms.py` sets both.

use std::env;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, exit};

/// What the lean library is made of.
const SOURCES: [&str; 8] =
    ["src/lib.rs", "src/scalar.rs", "src/axis", "src/drive", "src/effects", "src/fmi2", "src/fmi3", "src/variables"];

/// Platforms that can be asked for: folder of FMI 2.0, target, extension.
const PLATFORMS: [(&str, &str, &str); 2] =
    [("linux64", "x86_64-unknown-linux-gnu", "so"), ("win64", "x86_64-pc-windows-gnu", "dll")];

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rerun-if-env-changed=EIXO_PLATFORMS");
    for source in SOURCES {
        println!("cargo::rerun-if-changed={source}");
    }
    if env::var_os("CARGO_FEATURE_CLI").is_none() {
        return;
    }
    let (own, extension) = own_platform();
    let target = variable("TARGET");
    let mut libraries = vec![(own.clone(), target, extension)];
    for wanted in env::var("EIXO_PLATFORMS").unwrap_or_default().split([',', ' ']).filter(|p| !p.is_empty()) {
        let Some((folder, target, extension)) = PLATFORMS.into_iter().find(|p| p.0 == wanted) else {
            let known = PLATFORMS.map(|p| p.0).join(", ");
            fail(&format!("EIXO_PLATFORMS: \"{wanted}\" is no platform; there are {known}"))
        };
        if folder != own {
            libraries.push((folder.to_owned(), target.to_owned(), extension));
        }
    }
    let mut list = "[\n".to_owned();
    for (folder, target, extension) in &libraries {
        let library = PathBuf::from(variable("OUT_DIR")).join(format!("eixo_{folder}.{extension}"));
        compile(target, folder, &library);
        // Writing into a string cannot fail.
        let _ = writeln!(
            list,
            "    Library {{ platform: {folder:?}, extension: {extension:?}, bytes: include_bytes!({library:?}) }},"
        );
    }
    list.push_str("]\n");
    let file = PathBuf::from(variable("OUT_DIR")).join("libraries.rs");
    if let Err(error) = std::fs::write(&file, list) {
        fail(&format!("{}: {error}", file.display()));
    }
}

/// Folder and extension of the platform that the program is built for (FMI 2.0.4, section 2.3).
fn own_platform() -> (String, &'static str) {
    let (system, extension) = match variable("CARGO_CFG_TARGET_OS").as_str() {
        "windows" => ("win", "dll"),
        "macos" => ("darwin", "dylib"),
        _ => ("linux", "so"),
    };
    (format!("{system}{}", variable("CARGO_CFG_TARGET_POINTER_WIDTH")), extension)
}

/// Compiles the lean library for a target.
fn compile(target: &str, folder: &str, library: &Path) {
    let root = variable("CARGO_MANIFEST_DIR");
    let foreign = target != variable("TARGET");
    let mut rustc = Command::new(variable("RUSTC"));
    rustc
        .arg(Path::new(&root).join("src/lib.rs"))
        .args(["--crate-name", "eixo", "--edition", "2024", "--crate-type", "cdylib", "--cap-lints", "allow"])
        .args(["-C", "opt-level=3", "-C", "codegen-units=1", "-C", "panic=unwind", "-C", "strip=symbols"])
        // The same bytes wherever it is built, and no path of this machine in them.
        .arg(format!("--remap-path-prefix={root}=eixo"))
        .arg("-o")
        .arg(library);
    // Without it a DLL asks for libraries that only code never called needs, and that some systems lack.
    if foreign || variable("PROFILE") == "release" {
        rustc.args(["-C", "lto=fat"]);
    }
    if target != variable("HOST") {
        rustc.args(["--target", target]);
    }
    let named = format!("EIXO_LINKER_{}", folder.to_uppercase());
    println!("cargo::rerun-if-env-changed={named}");
    let linker = env::var_os(named).or_else(|| env::var_os("RUSTC_LINKER").filter(|_| !foreign));
    if let Some(linker) = linker {
        rustc.arg("-C").arg(format!("linker={}", linker.to_string_lossy()));
    }
    match rustc.output() {
        Ok(done) if done.status.success() => {}
        Ok(done) => fail(&format!(
            "the FMU's library for {folder} does not compile:\n{}",
            String::from_utf8_lossy(&done.stderr)
        )),
        Err(error) => fail(&format!("the compiler cannot be run: {error}")),
    }
}

fn variable(name: &str) -> String {
    env::var(name).unwrap_or_else(|_| fail(&format!("cargo sets no {name}")))
}

fn fail(message: &str) -> ! {
    eprintln!("{message}");
    exit(1)
}
