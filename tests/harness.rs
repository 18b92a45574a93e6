//! The harness on the exported FMU, against the model itself and against refusals.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::path::PathBuf;

use eixo::axis::{self, Hold, Parameters, Scheme, SimulateOptions, Structure};
use eixo::effects::{Effect, Settings};
use eixo::fmu::host::Fmu;
use eixo::fmu::package::Package;
use eixo::fmu::simulate::{Inputs, Options, Rows, Setting, SimulateError, SimulationResult, simulate};
use eixo::trace::{Machine, Signal, Trace};

#[path = "program/run.rs"]
mod program;

const DT: f64 = 5.626e-4;

/// The exported FMU, and the folder it lies in.
fn exported(package: &Package) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("axis.fmu");
    package.write(&file).unwrap();
    (folder, file)
}

fn torque(n: usize) -> Vec<f64> {
    (0..n).map(|k| 0.03 * (0.05 * k as f64).sin() + 0.02 * (0.31 * k as f64).cos()).collect()
}

fn inputs(torque: &[f64]) -> Inputs {
    Inputs::of(&Trace::new(0.0, DT, Hold::Zoh).with(Signal::T, torque.to_vec()).unwrap()).unwrap()
}

fn set(name: &str, value: &str) -> Setting {
    Setting { name: name.to_owned(), value: value.to_owned() }
}

fn run(fmu: &Fmu, torque: &[f64], hold: Hold, settings: Vec<Setting>) -> SimulationResult {
    simulate(fmu, &inputs(torque), &Options { hold, settings, ..Options::default() }).unwrap()
}

#[track_caller]
fn assert_close(what: &str, got: &[f64], want: impl Iterator<Item = f64>) {
    let want: Vec<f64> = want.collect();
    assert_eq!(got.len(), want.len());
    let scale = want.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    for (k, (a, b)) in got.iter().zip(&want).enumerate() {
        assert!((a - b).abs() <= 1e-12 * scale, "{what}[{k}]: {a} {b}");
    }
}

#[test]
fn the_fmu_gives_the_models_own_trace_under_both_holds_with_and_without_effects() {
    let (_folder, file) = exported(&Package::default());
    let fmu = Fmu::open(&file).unwrap();
    let torque = torque(600);
    let cases: [&[(Effect, usize, f64)]; 5] = [
        &[],
        &[(Effect::CoulombMotor, 0, 0.008), (Effect::Backlash, 0, 0.01)],
        &[(Effect::Delay, 0, 1.7 * DT), (Effect::ActuatorLag, 0, 2e-3), (Effect::Saturation, 0, 0.04)],
        &[(Effect::FlexibleMode, 0, 2e-6), (Effect::FlexibleMode, 1, 0.05), (Effect::PreslidingTable, 0, 0.003)],
        &[(Effect::SensorDelay, 0, 2.3 * DT), (Effect::LeadError, 1, 0.01)],
    ];
    for case in cases {
        for hold in [Hold::Zoh, Hold::Linear] {
            let mut effects = Settings::default();
            let mut settings = Vec::new();
            for &(effect, j, value) in case {
                effects.of_mut(effect)[j] = value;
                let info = effect.info();
                settings.push(set(&format!("{}.{}", info.id, info.parameters[j].name), &value.to_string()));
            }
            let options = SimulateOptions { start: 0.0, dt: DT, hold, scheme: Scheme::NEWMARK, substeps: 1 };
            let want = axis::simulate(&Parameters::PAPER, Structure::TwoInertia, &effects, [0.0; 4], &torque, &options);
            let got = run(&fmu, &torque, hold, settings);
            let close = |name: &str, f: &dyn Fn(usize) -> f64| {
                assert_close(&format!("{name} {case:?} {hold:?}"), got.get(name).unwrap(), (0..torque.len()).map(f));
            };
            close("theta1", &|k| want.readings[k].theta1);
            close("omega1", &|k| want.readings[k].omega1);
            close("theta2", &|k| want.readings[k].theta2);
            close("omega2", &|k| want.readings[k].omega2);
            close("x2", &|k| want.readings[k].theta2 * Parameters::PAPER.rho);
            // The last sample has no step after it, so its ramp is a guess on either side; and a lag or a delay shows
            // the model's mean ramp, the FMU the torque of the instant.
            if case.iter().all(|(e, ..)| !e.is_input()) {
                close("alpha1", &|k| want.accelerations[k][0]);
                close("alpha2", &|k| want.accelerations[k][1]);
            }
        }
    }
}

#[test]
fn rows_before_and_after_the_input_differ_in_the_accelerations_only() {
    let (_folder, file) = exported(&Package::default());
    let fmu = Fmu::open(&file).unwrap();
    let torque = torque(50);
    let rows = |rows| simulate(&fmu, &inputs(&torque), &Options { rows, ..Options::default() }).unwrap();
    let (set, end) = (rows(Rows::InputsSet), rows(Rows::StepEnd));
    assert_eq!(set.get("theta2"), end.get("theta2"));
    assert_ne!(set.get("alpha1"), end.get("alpha1"));
}

#[test]
fn a_machines_values_are_baked_into_description_and_binary() {
    let mut machine = Machine::default();
    machine.parameters = Parameters { i1: 3e-4, k: 0.05, ..machine.parameters };
    machine.effects.of_mut(Effect::CoulombMotor)[0] = 0.004;
    let (_folder, file) = exported(&Package::of(&machine).unwrap());
    let (_other, plain) = exported(&Package::default());
    let (fmu, plain) = (Fmu::open(&file).unwrap(), Fmu::open(&plain).unwrap());
    assert_ne!(fmu.description.guid, plain.description.guid);
    let torque = torque(200);
    let settings = vec![set("I1", "3e-4"), set("K", "0.05"), set("coulomb_motor.level", "0.004")];
    assert_eq!(run(&fmu, &torque, Hold::Zoh, vec![]).columns, run(&plain, &torque, Hold::Zoh, settings).columns);
    // A description and a binary of different exports do not go together.
    let options = eixo::fmu::host::InstanceOptions {
        name: "x".to_owned(),
        guid: plain.description.guid.clone(),
        ..Default::default()
    };
    let error = fmu.instantiate_with(&options).unwrap_err().to_string();
    assert!(error.contains("GUID"), "{error}");
}

#[test]
fn what_the_fmu_or_its_user_refuses_is_said_with_names() {
    let (_folder, file) = exported(&Package::default());
    let fmu = Fmu::open(&file).unwrap();
    let fails = |settings: Vec<Setting>, outputs: Vec<String>| -> String {
        let options = Options { settings, outputs, ..Options::default() };
        let error = simulate(&fmu, &inputs(&torque(20)), &options).unwrap_err();
        assert!(!matches!(error, SimulateError::Trace(_)));
        error.to_string()
    };
    assert!(fails(vec![set("coulomb_motor.levl", "1")], vec![]).contains("did you mean \"coulomb_motor.level\"?"));
    assert!(fails(vec![set("I1", "-1")], vec![]).contains("I1 = -1"));
    assert!(fails(vec![set("I1", "much")], vec![]).contains("number"));
    assert!(fails(vec![set("structure", "soft")], vec![]).contains("two_inertia, rigid"));
    assert!(fails(vec![], vec!["theta3".to_owned()]).contains("theta3"));
    assert!(fails(vec![set("delay.time", "9")], vec![]).contains("delay.time = 9"));
    assert!(fails(vec![set("I2", "0")], vec![]).contains("I2"));
}

/// Runs the program; gives exit code and what it said on standard error.
fn eixo(folder: &std::path::Path, args: &[&str]) -> (i32, String) {
    let done = program::eixo_in(folder, args);
    (done.status.code().unwrap_or(-1), String::from_utf8_lossy(&done.stderr).into_owned())
}

#[test]
fn bad_input_ends_with_two_a_reason_and_no_file() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    assert_eq!(eixo(dir, &["export", "axis.fmu"]).0, 0);
    let write = |name: &str, text: &str| std::fs::write(dir.join(name), text).unwrap();
    write("u.csv", "time [s],T [N.m]\n0,0\n0.001,0.01\n0.002,0.02\n0.003,0.01\n");
    write("gap.csv", "time,T\n0,0\n0.001,0.01\n0.002,x\n");
    write("back.csv", "time,T\n0,0\n0.002,0.01\n0.001,0\n");
    write("unit.csv", "time,T [deg]\n0,0\n0.001,0.01\n0.002,0\n");
    write("other.csv", "time,torque\n0,0\n0.001,0.01\n0.002,0\n");
    write("notime.csv", "T\n0\n1\n2\n");
    write("bad.toml", "[parameters]\nI1 = 2e-4\n");
    write("bad.fmu", "no archive");
    let run = ["simulate", "axis.fmu", "-o", "out.csv", "-i"];
    let with = |more: &[&'static str]| [&run[..], more].concat();
    let cases: [(Vec<&str>, &str); 13] = [
        (with(&["gap.csv"]), "row 4, column T"),
        (with(&["back.csv"]), "row 4"),
        (with(&["unit.csv"]), "[deg]"),
        (with(&["other.csv"]), "torque"),
        (with(&["notime.csv"]), "time"),
        (with(&["missing.csv"]), "missing.csv"),
        (with(&["u.csv", "--set", "I1=0"]), "I1 = 0"),
        (with(&["u.csv", "--noise", "theta9=1"]), "theta9"),
        (with(&["u.csv", "--step", "0"]), "step"),
        (vec!["simulate", "bad.fmu", "-o", "out.csv"], "bad.fmu"),
        (vec!["simulate", "axis.fmu", "-o", "no/such/out.csv", "-i", "u.csv"], "cannot write"),
        (vec!["export", "out.fmu", "--axis", "bad.toml"], "bad.toml"),
        (vec!["export", "no/such/axis.fmu"], "cannot write"),
    ];
    let files = || std::fs::read_dir(dir).unwrap().count();
    let before = files();
    for (args, reason) in cases {
        let (code, said) = eixo(dir, &args);
        assert!(code == 2 && said.contains(reason), "{args:?}: {code} {said}");
        assert_eq!(files(), before, "{args:?} left a file behind");
    }
    assert_eq!(eixo(dir, &with(&["u.csv"])), (0, String::new()));
}

#[test]
fn the_same_seed_gives_the_same_noise_and_a_columns_noise_is_its_own() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    assert_eq!(eixo(dir, &["export", "axis.fmu"]).0, 0);
    assert_eq!(eixo(dir, &["excite", "-o", "u.csv", "--samples", "4096"]).0, 0);
    let run = |out: &str, more: &[&str]| {
        let args = [&["simulate", "axis.fmu", "-i", "u.csv", "-o", out][..], more].concat();
        assert_eq!(eixo(dir, &args), (0, String::new()));
        eixo::trace::load(&dir.join(out), &eixo::trace::Mapping::default()).unwrap().trace
    };
    let clean = run("a.csv", &[]);
    let noisy = run("b.csv", &["--noise", "theta1=1e-4", "--seed", "7"]);
    assert_eq!(noisy, run("c.csv", &["--noise", "theta1=1e-4", "--seed", "7"]));
    assert_ne!(noisy, run("d.csv", &["--noise", "theta1=1e-4", "--seed", "8"]));
    let both = run("e.csv", &["--noise", "theta1=1e-4,omega2=0.1", "--seed", "7"]);
    assert_eq!(noisy.get(Signal::Theta1), both.get(Signal::Theta1));
    assert_eq!(noisy.get(Signal::T), clean.get(Signal::T));
    let rms =
        |a: &[f64], b: &[f64]| (a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum::<f64>() / a.len() as f64).sqrt();
    let (a, b) = (clean.get(Signal::Theta1).unwrap(), noisy.get(Signal::Theta1).unwrap());
    // The standard error of a standard deviation over n samples is 1/sqrt(2*n) of it.
    assert!((rms(a, b) / 1e-4 - 1.0).abs() < 4.0 / (2.0 * a.len() as f64).sqrt());
    let ratio = run("f.csv", &["--noise", "40dB"]);
    let (a, b) = (clean.get(Signal::Omega1).unwrap(), ratio.get(Signal::Omega1).unwrap());
    let zero = vec![0.0; a.len()];
    let decibel = 20.0 * (rms(a, &zero) / rms(a, b)).log10();
    assert!((decibel - 40.0).abs() < 0.5, "{decibel}");
}

#[test]
fn an_axis_file_runs_as_the_fmu_it_exports_linear_and_rigid_ones_too() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    let text = "structure = \"rigid\"\n[parameters]\nI1 = 90.0\n[units]\nmotion = \"linear\"\n[effects.viscous_motor]\n\
                coefficient = 200.0\n";
    std::fs::write(dir.join("axis.toml"), text).unwrap();
    let rows: String = (0..20).map(|k| format!("{},{}\n", f64::from(k) * 1e-3, 5 * k)).collect();
    std::fs::write(dir.join("u.csv"), format!("time [s],T [N]\n{rows}")).unwrap();
    assert_eq!(eixo(dir, &["simulate", "axis.toml", "-i", "u.csv", "-o", "a.csv"]).0, 0);
    assert_eq!(eixo(dir, &["export", "axis.fmu", "--axis", "axis.toml"]).0, 0);
    assert_eq!(eixo(dir, &["simulate", "axis.fmu", "-i", "u.csv", "-o", "b.csv"]).0, 0);
    let read = |name: &str| std::fs::read_to_string(dir.join(name)).unwrap();
    assert_eq!(read("a.csv"), read("b.csv"));
    assert!(read("a.csv").starts_with("time [s],T [N],theta1 [m],"), "{}", read("a.csv"));
    assert_eq!(eixo(dir, &["validate", "axis.fmu"]).0, 0);
}
