//! Wall time of `eixo validate` on this package's own FMU: `cargo bench --bench validate`.
//!
//! Aims: static rules under 10 ms, the full run under 0.6 s, the Reference-FMU VanDerPol under 1 s (for comparison, FMPy's
//! static check takes 182 ms, VDMCheck 1227 ms). What the sandbox costs is the difference to the run that is not fenced.

use std::path::Path;
use std::process::Command;

#[path = "common/program.rs"]
mod program;

fn main() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let fmu = folder.path().join("axis.fmu");
    let export = Command::new(env!("CARGO_BIN_EXE_eixo")).arg("export").arg(&fmu).output().expect("eixo export");
    assert!(export.status.success(), "{}", String::from_utf8_lossy(&export.stderr));
    row("static rules", 30, &fmu, &["--static"]);
    row("full run", 5, &fmu, &[]);
    row("not fenced", 5, &fmu, &["--no-sandbox"]);
    let three = folder.path().join("axis3.fmu");
    let export = Command::new(env!("CARGO_BIN_EXE_eixo")).args(["export", "--fmi", "3"]).arg(&three).output();
    assert!(export.expect("eixo export").status.success());
    row("FMI 3.0, full", 5, &three, &[]);
    let fmus = std::env::var_os("EIXO_FMUS").map_or_else(|| "../shared/fmus".into(), std::path::PathBuf::from);
    for (name, file) in [("VanDerPol", "fmi2/VanDerPol.fmu"), ("VanDerPol 3.0", "fmi3/VanDerPol.fmu")] {
        let foreign = fmus.join(file);
        if foreign.is_file() {
            row(name, 5, &foreign, &[]);
        } else {
            eprintln!("SKIPPED: no {} (EIXO_FMUS)", foreign.display());
        }
    }
}

fn row(name: &str, runs: usize, fmu: &Path, args: &[&str]) {
    let fmu = fmu.display().to_string();
    program::row(name, runs, &[&["validate", "--strict", &fmu], args].concat());
}
