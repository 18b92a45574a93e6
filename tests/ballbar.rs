//! `eixo circle --measured` as a user runs it, on a machine whose errors are known: scripts/oracles/ballbar.py.

use std::path::Path;
use std::process::{Command, Output};

use serde_json::Value;

const CCW: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/ballbar_ccw.txt");
const CW: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/ballbar_cw.txt");

fn eixo(folder: &Path, args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_eixo")).args(args).current_dir(folder).output().expect("eixo runs")
}

fn json(folder: &Path, name: &str) -> Value {
    serde_json::from_slice(&std::fs::read(folder.join(name)).expect("a file")).expect("JSON")
}

fn effect<'a>(trace: &'a Value, id: &str) -> &'a Value {
    trace["ranking"].as_array().expect("a ranking").iter().find(|e| e["id"] == id).unwrap_or_else(|| panic!("no {id}"))
}

#[test]
fn each_error_of_the_machine_is_told_in_its_size() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    let output = eixo(at, &["circle", "--measured", CCW, CW, "--json", "b.json", "--report", "b.html"]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let found = json(at, "b.json");
    assert_eq!((&found["schema"], &found["kind"]), (&"eixo.circle/1".into(), &"measured".into()));
    assert!((found["radius_mm"].as_f64().unwrap() - 100.0).abs() < 1e-9);
    assert!((found["feed_mm_min"].as_f64().unwrap() - 1000.0).abs() < 1e-6);
    // The values of the script, um and um/m.
    for (id, size, within) in [
        ("backlash_x", 6.0, 0.15),
        ("backlash_y", 2.5, 0.15),
        ("squareness", 35.0, 0.5),
        ("scaling_mismatch", 24.0, 0.5),
        ("lateral_play_y", 2.0, 0.15),
        ("lateral_play_x", 0.0, 0.15),
        ("straightness_x", 3.0, 0.15),
        ("straightness_y", 0.0, 0.15),
        ("cyclic_error_x", 1.5, 0.1),
        ("reversal_spikes_x", 9.0, 0.4),
        ("reversal_spikes_y", 5.0, 0.4),
        ("remainder", 0.15, 0.03),
    ] {
        let told = effect(&found["trace"], id)["size"].as_f64().expect("a size");
        assert!((told - size).abs() < within, "{id}: {told} against {size}");
    }
    let late = effect(&found["trace"], "servo_mismatch")["x_later_by_ms"].as_f64().unwrap();
    assert!((late - 0.3).abs() < 0.01, "{late}");
    let pitch = effect(&found["trace"], "cyclic_error_x")["pitch_mm"].as_f64().unwrap();
    assert!((pitch - 10.0).abs() < 0.02, "{pitch}");
    let weight = |e: &Value| {
        let both = e["takes_with_other_axis_um"].as_f64().unwrap_or(f64::NEG_INFINITY);
        e["takes_um"].as_f64().unwrap().max(0.5 * both)
    };
    let shares: Vec<f64> = found["trace"]["ranking"].as_array().unwrap().iter().map(weight).collect();
    assert!(shares.is_sorted_by(|a, b| a >= b) && shares[0] > 0.0, "{shares:?}");
    let page = std::fs::read_to_string(at.join("b.html")).expect("a page");
    assert!(page.contains("MD32450") && page.contains("What the trace shows"));
    assert!(!page.contains("NaN"));
}

#[test]
fn a_measured_play_and_pitch_become_parameters_and_stand_beside_the_model() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    // A screw of 10 mm: rho = 10 mm / 2 pi.
    let axis = "name = \"X\"\n[parameters]\nI1 = 2.37e-4\nI2 = 6.07e-5\nB = 5.4e-3\nK = 1.76\nrho = 1.5915494e-3\n\
                [effects.coulomb_motor]\nlevel = 0.004\n";
    std::fs::write(at.join("x.toml"), axis).expect("a file");
    let output = eixo(at, &["circle", "x.toml", "--measured", CCW, CW, "--json", "b.json"]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let found = json(at, "b.json");
    let told = found["as_parameters"].to_string();
    // 3 um over 1.59 mm/rad, and one to the turn.
    assert!(told.contains("half_gap = 1.8") && told.contains("order = 1.00"), "{told}");
    assert!(effect(&found["model"], "reversal_spikes_x")["size"].as_f64().unwrap() > 0.0);
}

#[test]
fn a_play_in_the_model_comes_back_from_its_circle_in_micrometres() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    // Friction holds the table at one side of the play; the coupling is stiff, so that its wind-up is small.
    let axis = "name = \"X\"\n[parameters]\nI1 = 2.37e-4\nI2 = 6.07e-5\nB = 5.4e-3\nK = 17.6\nrho = 1.5915494e-3\n\
                [effects.coulomb_table]\nlevel = 0.01\n[effects.backlash]\nhalf_gap = 1.885e-3\n";
    std::fs::write(at.join("x.toml"), axis).expect("a file");
    let output = eixo(at, &["circle", "x.toml", "--json", "c.json", "--report", "c.html"]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(said.contains("backlash on X and Y (6.000 µm)") && said.contains("What each takes"), "{said}");
    let found = json(at, "c.json");
    // Twice the wind-up of the coupling comes on top: 2*0.01/17.6*1.59e-3 m = 1.8 um.
    for id in ["backlash_x", "backlash_y"] {
        let play = effect(&found["trace"], id)["size"].as_f64().unwrap();
        assert!((play - 7.8).abs() < 0.5, "{id}: {play}");
    }
    // X and Y are alike: what the spikes take is seen only of both together.
    let both = effect(&found["trace"], "reversal_spikes_x")["takes_with_other_axis_um"].as_f64().unwrap();
    assert!(
        both > 10.0 && found["trace"]["ranking"][0]["id"].as_str().unwrap().starts_with("reversal_spikes"),
        "{both}"
    );
    // Left out of all it is not nothing, as it would be alone without the friction that holds the table.
    let without = found["without"].as_array().unwrap().iter().find(|r| r["name"] == "without backlash").expect("a run");
    let (with, less) = (found["runs"][1]["g_b_um"].as_f64().unwrap(), without["g_b_um"].as_f64().unwrap());
    assert!(with - less > 2.0, "{with} {less}");
}

#[test]
fn of_axes_without_effects_no_rounding_is_ranked() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    let output = eixo(at, &["circle", "--json", "c.json", "--report", "c.html"]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(said.contains("The circular deviation is 0 µm.") && !said.contains("not explained"), "{said}");
    assert_eq!(json(at, "c.json")["trace"], Value::Null);
    let page = std::fs::read_to_string(at.join("c.html")).expect("the page");
    assert!(!page.contains("10⁻¹⁸") && !page.contains("10⁻¹⁵"), "a plot of rounding");
}

#[test]
fn what_cannot_be_read_is_said_and_inputs_are_not_written_over() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    std::fs::write(at.join("log.csv"), "time [s],T [N.m]\n0,1\n1,2\n").expect("a file");
    let output = eixo(at, &["circle", "--measured", "log.csv"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&output.stderr).contains("log.csv: no column for the angle"));
    let output = eixo(at, &["circle", "--measured", "log.csv", "--report", "log.csv"]);
    assert!(String::from_utf8_lossy(&output.stderr).contains("is the input log.csv"));
    for of_a_measured_one in [["--directions", "ccw"], ["--from", "1"], ["--to", "1"]] {
        let output = eixo(at, &["circle", of_a_measured_one[0], of_a_measured_one[1]]);
        assert_eq!(output.status.code(), Some(2), "{of_a_measured_one:?}");
    }
    let output = eixo(at, &["circle", "--measured", CCW, "--from", "1"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&output.stderr).contains("no column of time"));
}
