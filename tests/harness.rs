//! The harness on the exported FMU, against the model itself and against refusals.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::path::PathBuf;

use eixo::axis::{self, Hold, Parameters, Scheme, SimulateOptions, Structure};
use eixo::effects::{Effect, Settings};
use eixo::fmu::host::Fmu;
use eixo::fmu::package::Package;
use eixo::fmu::simulate::{Inputs, Options, Record, Rows, Setting, SimulateError, simulate};
use eixo::trace::{Machine, Signal, Trace};

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

fn run(fmu: &Fmu, torque: &[f64], hold: Hold, settings: Vec<Setting>) -> Record {
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
