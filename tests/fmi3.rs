//! FMI 3.0: `eixo simulate` on the Reference FMUs beside FMPy, and the axis exported as FMI 3.0 beside the one of 2.0.

#![cfg(unix)]
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::path::Path;
use std::process::Command;

use eixo::fmu::description::Fmi;
use eixo::fmu::host::Fmu;
use eixo::fmu::package::Package;

#[path = "program/skip.rs"]
mod skip;

fn eixo(args: &[&str]) -> String {
    let output = Command::new(env!("CARGO_BIN_EXE_eixo")).args(args).output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "eixo {args:?}: {}{said}", String::from_utf8_lossy(&output.stdout));
    said
}

/// Header (without units) and rows of a CSV.
fn table(path: &Path) -> (Vec<String>, Vec<Vec<f64>>) {
    let text = std::fs::read_to_string(path).unwrap();
    let mut lines = text.lines();
    // A name may hold a comma in quotes.
    let split = |line: &str| {
        let (mut cells, mut quoted) = (vec![String::new()], false);
        for c in line.chars() {
            match c {
                '"' => quoted = !quoted,
                ',' if !quoted => cells.push(String::new()),
                c => cells.last_mut().unwrap().push(c),
            }
        }
        cells
    };
    let header = split(lines.next().unwrap()).iter().map(|h| h.split(" [").next().unwrap().to_owned()).collect();
    (header, lines.map(|line| split(line).iter().map(|cell| cell.parse().unwrap()).collect()).collect())
}

/// Runs an FMU in both and compares all outputs: equal to the last bits of the step's sums.
fn beside_fmpy(name: &str, step: &str, input: Option<&str>, more: &[&str], theirs_alone: &[&str]) {
    let (Some(fmus), Some(python)) = (skip::reference_fmus("fmi3"), skip::python("fmpy")) else { return };
    let folder = tempfile::tempdir().unwrap();
    let path = |file: &str| folder.path().join(file).to_str().unwrap().to_owned();
    let fmu = fmus.join(format!("{name}.fmu")).to_str().unwrap().to_owned();
    let (ours, theirs, inputs) = (path("ours.csv"), path("theirs.csv"), path("in.csv"));
    let mut own = vec!["simulate", &fmu, "-o", &ours, "--step-end", "--step", step];
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("scripts/fmi3_reference.py");
    let mut other = Command::new(python);
    other.arg(script).args([&fmu, &theirs, "--step", step]).args(more).args(theirs_alone);
    own.extend(more);
    if let Some(text) = input {
        std::fs::write(&inputs, text).unwrap();
        own.extend(["--input", &inputs, "--hold", "linear"]);
        other.args(["--input", &inputs]);
    }
    eixo(&own);
    let output = other.output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let ((header, ours), (names, theirs)) = (table(Path::new(&ours)), table(Path::new(&theirs)));
    let mut compared = 0;
    for (at, name_of) in names.iter().enumerate().skip(1) {
        let own =
            header.iter().position(|h| h == name_of).unwrap_or_else(|| panic!("{name}: no {name_of} in {header:?}"));
        let swing = theirs.iter().map(|row| row[at].abs()).fold(0.0, f64::max);
        for row in &theirs {
            // The run may end of itself; the grids are the same.
            let Some(mine) = ours.iter().find(|mine| (mine[0] - row[0]).abs() < 1e-9) else { continue };
            let difference = (mine[own] - row[at]).abs();
            assert!(difference <= 1e-12 * swing, "{name} {name_of} at {}: {} and {}", row[0], mine[own], row[at]);
            compared += 1;
        }
    }
    assert!(compared >= 20, "{name}: {compared} values");
}

#[test]
fn reference_fmus_without_inputs_go_as_in_fmpy() {
    for (name, step) in [("BouncingBall", "0.01"), ("Dahlquist", "0.1"), ("Stair", "0.2"), ("VanDerPol", "0.01")] {
        beside_fmpy(name, step, None, &[], &[]);
    }
}

#[test]
fn events_are_handled_and_early_returns_gone_on_from_as_in_fmpy() {
    beside_fmpy("Stair", "0.2", None, &["--event-mode"], &[]);
    beside_fmpy("Stair", "0.2", None, &["--event-mode", "--early-return"], &[]);
    beside_fmpy("BouncingBall", "0.01", None, &["--event-mode", "--early-return"], &[]);
}

#[test]
fn inputs_of_all_numeric_types_come_through_as_in_fmpy() {
    let mut text =
        "time,Float32_continuous_input,Float64_continuous_input,Float64_discrete_input,Int8_input,UInt8_input,\
                    Int16_input,UInt16_input,Int32_input,UInt32_input,Int64_input,UInt64_input,Boolean_input,\
                    Enumeration_input\n"
            .to_owned();
    for k in 0..=20 {
        let (t, late) = (0.1 * f64::from(k), i64::from(k >= 10_i32));
        text += &format!(
            "{t},{},{},{},{},{},{},{},{},{},{},{},{},{}\n",
            0.25 * f64::from(k),
            (2.0 * t).sin(),
            late * 3,
            late * -128,
            late * 255,
            late * -32768,
            late * 65535,
            late * -2_147_483_648_i64,
            late * 4_294_967_295,
            late * -4_503_599_627_370_496_i64,
            late * 9_007_199_254_740_992,
            late,
            1 + late,
        );
    }
    beside_fmpy("Feedthrough", "0.1", Some(&text), &[], &[]);
    // FMPy tells the time of an event twice: before the inputs change, as a row here is, and after.
    beside_fmpy("Feedthrough", "0.1", Some(&text), &["--event-mode"], &["--first"]);
}

#[test]
fn arrays_come_through_as_in_fmpy() {
    let mut text = "time,u(1),u(2),u(3)\n".to_owned();
    for k in 0..=10 {
        let t = f64::from(k);
        text += &format!("{t},{},{},{}\n", t.sin(), 0.1 * t, 2.0 - t);
    }
    beside_fmpy("StateSpace", "1", Some(&text), &[], &[]);
}

/// The axis with effects switched on, by both ABIs.
fn both(folder: &Path) -> [String; 2] {
    let axis = folder.join("axis.toml");
    let text = "name = \"both\"\n[parameters]\nI1 = 2.37e-4\nI2 = 6.07e-6\nB = 5.4e-4\nK = 0.0176\nrho = 3.18e-4\n\
                [effects.coulomb_motor]\nlevel = 0.004\n[effects.backlash]\nhalf_gap = 1e-4\n";
    std::fs::write(&axis, text).unwrap();
    ["2", "3"].map(|version| {
        let fmu = folder.join(format!("axis{version}.fmu")).to_str().unwrap().to_owned();
        eixo(&["export", &fmu, "--fmi", version, "--axis", axis.to_str().unwrap()]);
        fmu
    })
}

#[test]
fn the_axis_of_fmi_3_gives_the_traces_of_that_of_2_to_the_last_bit() {
    let folder = tempfile::tempdir().unwrap();
    let excitation = folder.path().join("u.csv").to_str().unwrap().to_owned();
    eixo(&["excite", "-o", &excitation]);
    for [two, three] in [both(folder.path()), {
        let plain = ["2", "3"].map(|v| folder.path().join(format!("plain{v}.fmu")).to_str().unwrap().to_owned());
        for (version, fmu) in ["2", "3"].iter().zip(&plain) {
            eixo(&["export", fmu, "--fmi", version]);
        }
        plain
    }] {
        let traces = [&two, &three].map(|fmu| {
            let out = format!("{fmu}.csv");
            eixo(&["simulate", fmu, "--input", &excitation, "-o", &out]);
            std::fs::read(&out).unwrap()
        });
        assert!(traces[0].len() > 100_000);
        assert!(traces[0] == traces[1], "{two} and {three} differ");
    }
}

#[test]
fn an_fmu_of_fmi_3_is_stepped_back_to_the_bit_and_refuses_what_is_out_of_place() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("axis.fmu");
    Package { fmi: Fmi::Three, ..Package::default() }.write(&path).unwrap();
    let fmu = Fmu::open(&path).unwrap();
    let mut i = fmu.instantiate("one").unwrap();
    let (torque, outputs, dt) = ([0], [1, 2, 3, 4, 5, 6, 7], 5.626e-4);
    assert!(i.do_step(0.0, dt).is_err());
    i.initialize(0.0, Some(1.0)).unwrap();
    i.set_real(&torque, &[0.02]).unwrap();
    let step = |i: &mut eixo::fmu::host::Instance, k: usize| i.do_step(k as f64 * dt, dt);
    for k in 0..50 {
        step(&mut i, k).unwrap();
    }
    let state = i.get_state().unwrap();
    let bytes = i.serialize_state(&state).unwrap();
    let run = |i: &mut eixo::fmu::host::Instance| -> Vec<Vec<f64>> {
        (50..100).map(|k| step(i, k).map(|()| i.get_real(&outputs).unwrap()).unwrap()).collect()
    };
    let expected = run(&mut i);
    i.set_state(&state).unwrap();
    assert_eq!(run(&mut i), expected);
    let mut other = fmu.instantiate("two").unwrap();
    let copy = other.deserialize_state(&bytes).unwrap();
    other.set_state(&copy).unwrap();
    assert_eq!(run(&mut other), expected);
    // The independent variable.
    let now = other.get_real(&[eixo::fmi3::TIME_REFERENCE]).unwrap()[0];
    assert!((now - 100.0 * dt).abs() < 1e-12, "{now}");
    assert!(other.set_real(&[eixo::fmi3::TIME_REFERENCE], &[0.0]).is_err());
    assert!(other.set_real(&torque, &[f64::NAN]).is_err());
    assert!(other.get_boolean(&[1]).is_err());
}

#[test]
fn fmpy_imports_validates_and_simulates_the_axis_of_fmi_3() {
    let Some(python) = skip::python("fmpy") else { return };
    let folder = tempfile::tempdir().unwrap();
    let [_, three] = both(folder.path());
    let script = "
import sys
from fmpy import simulate_fmu
from fmpy.validation import validate_fmu
problems = validate_fmu(sys.argv[1])
assert not problems, problems
result = simulate_fmu(sys.argv[1], output=['theta2', 'time'], start_values={'T': 0.02}, stop_time=0.1, output_interval=1e-3)
print(len(result), result['theta2'][-1])
";
    let output = Command::new(python).args(["-c", script, &three]).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let said = String::from_utf8(output.stdout).unwrap();
    let mut words = said.split_whitespace();
    assert_eq!(words.next(), Some("101"));
    let theirs: f64 = words.next().unwrap().parse().unwrap();
    let ours = folder.path().join("ours.csv");
    let own =
        ["--set", "T=0.02", "--start", "0", "--stop", "0.1", "--step", "1e-3", "--outputs", "theta2", "--step-end"];
    eixo(&[&["simulate", &three, "-o", ours.to_str().unwrap()][..], &own[..]].concat());
    let (_, rows) = table(&ours);
    // FMPy adds its steps up: the lengths differ in the last bit.
    assert!((rows.last().unwrap()[1] - theirs).abs() < 1e-12 * theirs.abs(), "{rows:?} {theirs}");
}

#[test]
fn the_axis_and_the_drive_of_fmi_3_pass_the_validation_strictly() {
    let folder = tempfile::tempdir().unwrap();
    for (name, more) in [("axis", None), ("drive", Some("--drive"))] {
        let fmu = folder.path().join(format!("{name}.fmu")).to_str().unwrap().to_owned();
        let mut args = vec!["export", &fmu, "--fmi", "3"];
        args.extend(more);
        eixo(&args);
        eixo(&["validate", "--strict", &fmu]);
    }
}
