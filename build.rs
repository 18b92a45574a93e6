//! Builds the FMU's shared library for the command line to carry.
//!
//! `eixo export` must work wherever the program is installed, `cargo install` included, which installs no library. So
//! the library is compiled here, of `crates/fmu` over `crates/model`, and embedded in the program. Those two have no other
//! dependency, which lets two direct calls of the compiler do: no nested cargo, no lock, no network. It is optimised in the same way
//! in a debug build as in a release, and gets none of the user's `RUSTFLAGS`: an FMU leaves the machine it was built on.
//!
//! `EIXO_PLATFORMS=win64` in the environment embeds the library for more platforms than the program's own, each named as
//! FMI names its folder and needing its target of rustup and a linker; `EIXO_LINKER_LINUX64=...` names another linker for
//! one of them. `scripts/platforms.py` sets both.

use std::env;
use std::ffi::OsString;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, exit};

/// The crates that the library is made of, each after those it imports: folder under `crates/`, name.
const CRATES: [(&str, &str); 2] = [("model", "eixo_model"), ("fmu", "eixo_fmu")];

/// Platforms that can be asked for: folder of FMI 2.0, target, extension.
const PLATFORMS: [(&str, &str, &str); 2] =
    [("linux64", "x86_64-unknown-linux-gnu", "so"), ("win64", "x86_64-pc-windows-gnu", "dll")];

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rerun-if-env-changed=EIXO_PLATFORMS");
    for (folder, _) in CRATES {
        println!("cargo::rerun-if-changed=crates/{folder}/src");
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

/// Compiles the library for a target: every crate but the last for the next one, the last as the shared library.
fn compile(target: &str, folder: &str, library: &Path) {
    let named = format!("EIXO_LINKER_{}", folder.to_uppercase());
    println!("cargo::rerun-if-env-changed={named}");
    let foreign = target != variable("TARGET");
    let linker = env::var_os(named).or_else(|| env::var_os("RUSTC_LINKER").filter(|_| !foreign));
    let [below @ .., last] = &CRATES;
    let mut imports = Vec::new();
    for one in below {
        let import = library.with_file_name(format!("lib{}_{folder}.rlib", one.1));
        // With machine code beside what link-time optimisation reads: a linker of another LLVM, as zig's, looks at it and stops at
        // code that only this compiler's LLVM knows.
        run(rustc(target, one, &imports).args(["--crate-type", "rlib", "-o"]).arg(&import), folder);
        imports.push((one.1, import));
    }
    let mut shared = rustc(target, last, &imports);
    // Link-time optimisation over all of them and the standard library. Without it a DLL asks for libraries that only code never
    // called needs, and that some systems lack.
    shared.args(["--crate-type", "cdylib", "-C", "lto=fat", "-C", "strip=symbols", "-o"]).arg(library);
    if let Some(linker) = linker {
        shared.arg("-C").arg(format!("linker={}", linker.to_string_lossy()));
    }
    run(&mut shared, folder);
}

/// The compiler's call for one of the crates, with those it imports.
fn rustc(target: &str, (folder, name): &(&str, &str), imports: &[(&str, PathBuf)]) -> Command {
    let root = variable("CARGO_MANIFEST_DIR");
    let mut rustc = Command::new(variable("RUSTC"));
    rustc
        .arg(Path::new(&root).join("crates").join(folder).join("src/lib.rs"))
        .args(["--crate-name", name, "--edition", "2024", "--cap-lints", "allow"])
        .args(["-C", "opt-level=3", "-C", "codegen-units=1", "-C", "panic=unwind"])
        // The same bytes wherever it is built, and no path of this machine in them.
        .arg(format!("--remap-path-prefix={root}=eixo"));
    if target != variable("HOST") {
        rustc.args(["--target", target]);
    }
    for (name, import) in imports {
        let mut pair = OsString::from(format!("{name}="));
        pair.push(import);
        rustc.arg("--extern").arg(pair);
    }
    rustc
}

/// Runs the compiler, which must succeed.
fn run(rustc: &mut Command, folder: &str) {
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
