use std::f64::consts::TAU;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::data::{Lines, late_speeds, response};
use super::{choose::choose, examine};
use crate::axis::{Hold, Motion, Parameters, Scheme, SimulateOptions, Structure, simulate};
use crate::diagnose::{Case, Model, Record, estimate_noise};
use crate::effects::{EFFECTS, Effect, Settings};
use crate::identify::frequency::measure;
use crate::trace::{Signal, Trace};

const DT: f64 = 5e-4;
const PERIOD: usize = 1000;
const NOISE: f64 = 1e-6;
/// Two inertias with a mode at 71 Hz.
const AXIS: Parameters = Parameters { i1: 5e-3, i2: 5e-3, b: 0.04, k: 500.0, rho: 1e-3 };

/// Lines 4 to 100 Hz of a period of half a second, Schroeder phases, ten periods, 1 N.m rms.
fn torque() -> Vec<f64> {
    let lines: Vec<usize> = (2..=80).collect();
    let n = lines.len() as f64;
    (0..10 * PERIOD)
        .map(|k| {
            lines
                .iter()
                .enumerate()
                .map(|(i, h)| {
                    let i = i as f64;
                    (2.0 / n).sqrt() * (TAU * (h * k) as f64 / PERIOD as f64 - std::f64::consts::PI * i * i / n).cos()
                })
                .sum()
        })
        .collect()
}

/// Both encoders of the axis with the effects under the torque, which a foreign, slowly wandering torque is added to;
/// `command` is what the log says.
fn record(effects: &Settings, wander: f64, seed: u64) -> Record {
    let command = torque();
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
    let mut foreign = 0.0;
    let driven: Vec<f64> = command
        .iter()
        .map(|t| {
            foreign += wander * normal() - 0.01 * foreign;
            t + foreign
        })
        .collect();
    let options = SimulateOptions { start: 0.0, dt: DT, hold: Hold::Zoh, scheme: Scheme::Exact, substeps: 8 };
    let run = simulate(&AXIS, Structure::TwoInertia, effects, [0.0; 4], &driven, &options);
    let theta1: Vec<f64> = run.readings.iter().take(driven.len()).map(|r| r.theta1 + NOISE * normal()).collect();
    let theta2: Vec<f64> = run.readings.iter().take(driven.len()).map(|r| r.theta2 + NOISE * normal()).collect();
    let channels = [Some(theta1), None, Some(theta2), None];
    Record { start: 0.0, dt: DT, hold: Hold::Zoh, torque: command, channels, noise: [NOISE; 4] }
}

/// Friction that the model leaves out, and, if asked for, a lag of the drive.
fn machine(lag: f64) -> Settings {
    let mut effects = Settings::default();
    effects.of_mut(Effect::CoulombMotor)[0] = 0.15;
    effects.of_mut(Effect::ActuatorLag)[0] = lag;
    effects
}

fn found(record: &Record, structure: Structure, without: &[Effect]) -> Option<super::Found> {
    let channels = [0, 1, 2, 3].map(|c: usize| record.channels[c].as_deref());
    let noise = estimate_noise(&record.torque, &channels, None);
    assert_eq!(noise.period, Some(PERIOD));
    // A nominal model that is off by ten per cent.
    let parameters = match structure {
        Structure::TwoInertia => Parameters { i1: 4.5e-3, i2: 5.5e-3, b: 0.03, k: 450.0, ..AXIS },
        Structure::Rigid => Parameters { i1: 11e-3, i2: 0.0, b: 0.0, k: 0.0, ..AXIS },
    };
    let case = Case {
        machine: "simulated".to_owned(),
        nominal: Model::new(parameters, structure, Settings::default()),
        motion: Motion::Rotary,
        train: record,
        noise: &noise,
        holdout: None,
        suspects: EFFECTS.iter().copied().filter(|e| !without.contains(e)).collect(),
    };
    examine(&case, &record.part(0..7 * PERIOD), &record.part(7 * PERIOD..10 * PERIOD))
}

#[test]
fn a_lag_is_named_with_its_length_under_friction_and_a_wandering_torque() {
    let record = record(&machine(1e-3), 1e-3, 1);
    let found = found(&record, Structure::TwoInertia, &[]).expect("the lag shows at the lines");
    let h = &found.choice.chosen;
    assert!(matches!(h.effects[0], Effect::ActuatorLag | Effect::Delay), "{:?}", h.effects);
    let at = h.coordinates.len() - 1;
    let time = h.coordinates[at].value(&h.model);
    assert!((time / 1e-3 - 1.0).abs() < 0.15, "{time}");
    // Its twin stands beside it, or the record tells them apart.
    let closes = found.closes(&found.choice.base.model, &h.model);
    assert!(closes > 0.5, "{closes}");
}

#[test]
fn without_a_lag_the_same_friction_and_wandering_torque_name_none() {
    let record = record(&machine(0.0), 1e-3, 2);
    let found = found(&record, Structure::TwoInertia, &[]);
    assert!(found.is_none(), "{:?}", found.map(|f| f.choice.chosen.effects));
}

#[test]
fn what_the_library_lacks_is_not_named() {
    let record = record(&machine(1e-3), 1e-3, 3);
    let without = [Effect::ActuatorLag, Effect::Delay];
    let found = found(&record, Structure::TwoInertia, &without);
    assert!(found.as_ref().is_none_or(|f| !f.choice.chosen.effects.iter().any(|e| without.contains(e))));
}

#[test]
fn on_a_rigid_model_the_missing_mode_is_named() {
    let mut record = record(&machine(0.0), 1e-3, 4);
    record.channels[2] = None;
    let found = found(&record, Structure::Rigid, &[]).expect("the mode shows");
    let h = &found.choice.chosen;
    assert_eq!(h.effects, [Effect::FlexibleMode]);
    let [inertia, stiffness, _] = h.model.effects.of(Effect::FlexibleMode) else { panic!("three parameters") };
    // To the model of one inertia the second one, on the coupling, is the mode.
    assert!((inertia / AXIS.i2 - 1.0).abs() < 0.2, "{inertia}");
    assert!((stiffness / AXIS.k - 1.0).abs() < 0.2, "{stiffness}");
}

#[test]
fn a_machine_that_repeats_to_its_noise_is_left_to_the_decision_in_time() {
    let mut effects = Settings::default();
    effects.of_mut(Effect::ActuatorLag)[0] = 1e-3;
    let record = record(&effects, 0.0, 5);
    assert!(found(&record, Structure::TwoInertia, &[]).is_none());
}

#[test]
fn the_response_of_the_model_is_that_of_the_sampled_axis() {
    let record = record(&Settings::default(), 0.0, 6);
    let trace = Trace::new(0.0, DT, Hold::Zoh)
        .with(Signal::T, record.torque.clone())
        .and_then(|t| t.with(Signal::Theta1, record.channels[0].clone().unwrap_or_default()))
        .and_then(|t| t.with(Signal::Theta2, record.channels[2].clone().unwrap_or_default()))
        .expect("signals of one length");
    let mut measured = measure(&trace, PERIOD).expect("ten periods");
    for (signal, response, variance) in &mut measured.outputs {
        *response = measured_model(&trace, *signal);
        variance.fill(0.0);
    }
    // The sampled axis' own response in the place of the measured one: nothing must be left but the images that are cut.
    let lines = Lines::new(&measured, AXIS.rho);
    let model = Model::new(AXIS, Structure::TwoInertia, Settings::default());
    assert!(lines.relative_error(&model) < 1e-4, "{}", lines.relative_error(&model));
}

fn measured_model(trace: &Trace, signal: Signal) -> Vec<super::data::C> {
    let measured = measure(trace, PERIOD).expect("ten periods");
    measured.model(&AXIS, Structure::TwoInertia, Scheme::Exact, signal).expect("the axis has a response")
}

#[test]
fn a_filtered_speed_is_named_with_its_delay() {
    let mut record = record(&Settings::default(), 0.0, 7);
    let angle = record.channels[0].clone().expect("theta1");
    // The backward difference is half a sample late.
    let late: Vec<f64> = (0..angle.len()).map(|k| (angle[k] - angle[k.max(1) - 1]) / DT).collect();
    let true_speed: Vec<f64> =
        (0..angle.len()).map(|k| (angle[(k + 1).min(angle.len() - 1)] - angle[k.max(1) - 1]) / (2.0 * DT)).collect();
    record.channels[1] = Some(late);
    let said = late_speeds(&response(&record, PERIOD).expect("ten periods"));
    assert!(said.len() == 1 && said[0].starts_with("omega1 runs 0.25 ms behind"), "{said:?}");
    record.channels[1] = Some(true_speed);
    assert!(late_speeds(&response(&record, PERIOD).expect("ten periods")).is_empty());
}

#[test]
fn a_speed_behind_a_low_pass_is_named_with_its_time() {
    let mut record = record(&Settings::default(), 0.0, 9);
    let angle = record.channels[0].clone().expect("theta1");
    // Central differences through 1/(1 + 8 ms*s), trapezoidal rule.
    let (a, mut state, mut before) = (8e-3 / DT, 0.0, 0.0);
    let filtered: Vec<f64> = (0..angle.len())
        .map(|k| {
            let speed = (angle[(k + 1).min(angle.len() - 1)] - angle[k.max(1) - 1]) / (2.0 * DT);
            state = ((a - 0.5) * state + 0.5 * (speed + before)) / (a + 0.5);
            before = speed;
            state
        })
        .collect();
    record.channels[1] = Some(filtered);
    let said = late_speeds(&response(&record, PERIOD).expect("ten periods"));
    assert!(said.len() == 1 && said[0].contains("behind a low pass of 8.0"), "{said:?}");
}

#[test]
fn a_perfect_model_leaves_no_gap_at_the_lines() {
    let record = record(&Settings::default(), 0.0, 8);
    let lines = Lines::new(&response(&record, PERIOD).expect("ten periods"), AXIS.rho);
    let model = Model::new(AXIS, Structure::TwoInertia, Settings::default());
    assert!(choose(&lines, &model, EFFECTS).is_none());
}
