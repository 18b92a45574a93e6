//! The exported XY table in importers that share no code with eixo (`scripts/table.py`), and its drive under the validator.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::path::Path;
use std::process::Command;

#[path = "program/run.rs"]
mod run;
#[path = "program/skip.rs"]
mod skip;

use run::{eixo, fine};

const AXIS: &str = "[parameters]\nI1 = 2.37e-4\nI2 = 6.07e-6\nB = 5.4e-4\nK = 1.76e-2\nrho = 3.18e-4\n";

#[test]
fn other_tools_draw_the_circle_of_eixo_circle_with_the_exported_table() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let Some(python) = skip::python("fmpy") else { return };
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).into_os_string().into_string().unwrap();
    let (x, y) = (path("x.toml"), path("y.toml"));
    std::fs::write(&x, format!("{AXIS}[effects.coulomb_motor]\nlevel = 0.004\n")).unwrap();
    let loose = "[effects.coulomb_table]\nlevel = 0.0002\n[effects.backlash]\nhalf_gap = 0.02\n";
    std::fs::write(&y, format!("{AXIS}{loose}")).unwrap();
    let (table, bare, circle) = (path("table.ssp"), path("bare.ssp"), path("path.csv"));
    for drives in [&["--carried", "3"][..], &["--table-scale", "--bandwidth", "40", "--kp", "4", "--limit", "0.1"]] {
        let axes = ["--y", &y];
        fine(&[&["export", &table, "--axis", &x][..], &axes, drives].concat());
        fine(&[&["export", &bare, "--bare", "--axis", &x][..], &axes, drives].concat());
        fine(&[&["circle", &x, "--radius", "0.01", "--feed", "2", "-o", &circle][..], &axes, drives].concat());
        let done = Command::new(&python)
            .arg(root.join("scripts/table.py"))
            .args([&table, &bare, &circle, "0.01", "2", "0.001"])
            .output()
            .unwrap();
        let printed = String::from_utf8_lossy(&done.stdout);
        eprintln!("{printed}");
        assert!(done.status.success(), "{printed}{}", String::from_utf8_lossy(&done.stderr));
        skip::passed_on(&printed);
    }
}

#[test]
fn the_drive_passes_its_own_validation() {
    let folder = tempfile::tempdir().unwrap();
    let fmu = folder.path().join("drive.fmu").into_os_string().into_string().unwrap();
    fine(&["export", &fmu, "--drive", "--limit", "0.5"]);
    let printed = fine(&["validate", &fmu]);
    assert!(printed.contains("0 errors, 0 warnings") && printed.contains("0 not tested"), "{printed}");
    assert!(fine(&["info", &fmu]).contains("velocity_forward"));
}

#[test]
fn options_that_do_not_belong_together_are_refused() {
    for (args, says) in [
        (&["export", "a.fmu", "--y", "y.toml"][..], "give a.fmu the end .ssp"),
        (&["export", "a.ssp", "--drive"], "give a.ssp the end .fmu"),
        (&["export", "a.ssp", "--carried", "nan"], "--carried"),
        (&["circle", "--bandwidth", "0"], "greater than zero"),
    ] {
        let done = eixo(args);
        let error = String::from_utf8_lossy(&done.stderr);
        assert!(done.status.code() == Some(2) && error.contains(says), "{args:?}: {error}");
        assert!(!Path::new(args[1]).exists());
    }
}

#[test]
fn a_diagnosis_an_improved_fmu_and_an_axis_file_turn_the_same_circle() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).into_os_string().into_string().unwrap();
    let (axis, found, fmu, json) = (path("axis.toml"), path("found.toml"), path("found.fmu"), path("found.json"));
    std::fs::write(&axis, AXIS).unwrap();
    std::fs::write(&found, format!("{}[effects.coulomb_motor]\nlevel = 0.004\n", AXIS.replace("2.37e-4", "2.5e-4")))
        .unwrap();
    fine(&["export", &fmu, "--axis", &found]);
    let diagnosis = r#"{"schema": "eixo.diagnosis/1", "verdict": "effect", "parameters": {"I1": {"fitted": 2.5e-4}},
        "causes": [{"id": "coulomb_motor", "parameters": {"level": {"value": 0.004}}}]}"#;
    std::fs::write(&json, diagnosis).unwrap();
    let report = path("circle.html");
    let printed: Vec<String> = [&found, &fmu, &json]
        .map(|file| fine(&["circle", &axis, "--diagnosed", file, "--radius", "0.02", "--report", &report]))
        .into();
    assert!(printed[0] == printed[1] && printed[0] == printed[2], "{printed:#?}");
    assert!(
        printed[0].contains("coulomb_motor on X and Y") && printed[0].contains("fitted parameters"),
        "{}",
        printed[0]
    );
    let page = std::fs::read_to_string(&report).unwrap();
    assert!(page.contains("Diagnosed model without coulomb_motor") && page.contains("magnified"));
    for (text, says) in [
        ("{}", "it is no diagnosis"),
        (&diagnosis.replace("0.004", "-1"), "coulomb_motor.level is -1"),
        (&diagnosis.replace("coulomb_motor", "magic"), "there is no effect \"magic\""),
    ] {
        std::fs::write(&json, text).unwrap();
        let done = eixo(&["circle", &axis, "--diagnosed", &json]);
        let error = String::from_utf8_lossy(&done.stderr);
        assert!(done.status.code() == Some(2) && error.contains(says), "{error}");
    }
}
