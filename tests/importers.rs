//! The exported FMU through importers that share no code with eixo: `scripts/importers.py` and its table.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::path::Path;
use std::process::Command;

#[path = "program/run.rs"]
mod run;
#[path = "program/skip.rs"]
mod skip;

use run::fine;

#[test]
fn other_importers_give_the_harnesss_trace() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let Some(python) = skip::python("fmpy") else { return };
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).into_os_string().into_string().unwrap();
    let (fmu, input) = (path("axis.fmu"), path("u.csv"));
    fine(&["export", &fmu]);
    // Half a millisecond: a whole number of libcosim's nanoseconds.
    fine(&["excite", "-o", &input, "--samples", "2000", "--dt", "0.0005"]);
    for settings in [&[][..], &["coulomb_motor.level=0.008", "backlash.half_gap=0.01", "delay.time=0.0012"]] {
        let trace = path("trace.csv");
        let sets: Vec<&str> = settings.iter().flat_map(|s| ["--set", s]).collect();
        fine(&[&["simulate", &fmu, "-i", &input, "-o", &trace, "--step-end"][..], &sets].concat());
        let done = Command::new(&python)
            .arg(root.join("scripts/importers.py"))
            .args([&fmu, &trace])
            .args(settings)
            .output()
            .unwrap();
        let table = String::from_utf8_lossy(&done.stdout);
        eprintln!("{table}");
        assert!(done.status.success(), "{table}{}", String::from_utf8_lossy(&done.stderr));
        assert!(table.contains("FMPy simulate_fmu"), "{table}");
        skip::passed_on(&table);
    }
}
