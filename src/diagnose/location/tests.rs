//! Effects planted in the axis of the paper, seen by its encoders with noise: the place, the residual and the words.

use std::f64::consts::TAU;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::{Location, locate, smooth_states};
use crate::axis::{Hold, Parameters, Scheme, SimulateOptions, Structure, simulate};
use crate::diagnose::Record;
use crate::effects::{Effect, Place, Settings};

const P: Parameters = Parameters::PAPER;
const DT: f64 = 1.125e-3;
const NOISE: f64 = 5e-5;

/// Odd lines of a period of 1024 samples up to 15 Hz (the mode lies at 8.7 Hz), four periods, 0.03 N.m rms.
fn torque() -> Vec<f64> {
    let lines: Vec<f64> = (0..9).map(|i| f64::from(2 * i + 1)).collect();
    let amplitude = 0.03 * (2.0 / lines.len() as f64).sqrt();
    (0..4096)
        .map(|k| lines.iter().map(|h| amplitude * (TAU * h * f64::from(k) / 1024.0 - 0.3 * h * h).cos()).sum())
        .collect()
}

fn record(effect: Option<(Effect, &[f64])>, table: bool) -> (Record, Vec<[f64; 4]>) {
    let mut effects = Settings::default();
    if let Some((effect, values)) = effect {
        effects.of_mut(effect)[..values.len()].copy_from_slice(values);
    }
    let torque = torque();
    let options = SimulateOptions { start: 0.0, dt: DT, hold: Hold::Zoh, scheme: Scheme::Exact, substeps: 8 };
    let response = simulate(&P, Structure::TwoInertia, &effects, [0.1, 1.0, 0.1, 1.0], &torque, &options);
    let mut rng = ChaCha8Rng::seed_from_u64(17);
    let mut noise = || {
        let v: f64 = StandardNormal.sample(&mut rng);
        NOISE * v
    };
    let theta1 = response.readings.iter().map(|r| r.theta1 + noise()).collect();
    let theta2 = response.readings.iter().map(|r| r.theta2 + noise()).collect();
    let record = Record {
        start: 0.0,
        dt: DT,
        hold: Hold::Zoh,
        torque,
        channels: [Some(theta1), None, table.then_some(theta2), None],
        noise: [NOISE, 0.0, NOISE, 0.0],
    };
    (record, response.readings.iter().map(|r| [r.theta1, r.omega1, r.theta2, r.omega2]).collect())
}

/// The parameters given are off by some per cent, as an identification's would be.
fn near() -> Parameters {
    Parameters { i1: 1.03 * P.i1, i2: 0.97 * P.i2, b: 0.96 * P.b, k: 0.98 * P.k, rho: P.rho }
}

fn located(effect: Effect, values: &[f64]) -> Location {
    locate(&record(Some((effect, values)), true).0, &near(), Structure::TwoInertia)
}

#[test]
fn without_an_effect_the_gap_is_nowhere_whatever_the_parameters() {
    let found = locate(&record(None, true).0, &near(), Structure::TwoInertia);
    assert_eq!(found.place, None, "{}", found.summary);
    assert!(found.by_place[0].share > 0.9 && found.by_place[0].place.is_none());
    // The parameters come back on the way: I1 to a tenth of a per cent.
    assert!((found.by_place[0].fitted.parameters.i1 / P.i1 - 1.0).abs() < 1e-3);
}

#[test]
fn friction_of_the_motor_lies_on_the_motor_flat_against_the_sign_of_its_speed() {
    let found = located(Effect::CoulombMotor, &[3e-3]);
    assert_eq!(found.place, Some(Place::Motor), "{}", found.summary);
    assert!(found.summary.contains("flat against the sign of omega1"), "{}", found.summary);
    // The residual torque is the friction's: its rms is the level but for the moments of reversal.
    let rms = super::plant::rms(&found.residual.r1);
    assert!((rms / 3e-3 - 1.0).abs() < 0.1, "{rms}");
    let sum: f64 = found.by_place.iter().map(|e| e.share).sum();
    assert!((sum - 1.0).abs() < 1e-12);
}

#[test]
fn a_disturbance_of_the_table_lies_on_the_table_at_its_frequency() {
    let found = located(Effect::Disturbance, &[6e-3, 23.0]);
    assert_eq!(found.place, Some(Place::Table), "{}", found.summary);
    let foreign = found.by_frequency.iter().find(|p| p.residual == "r2" && p.kind == "foreign").expect("periods");
    assert!((foreign.peak - 23.0).abs() < 1.0 / (3.0 * 1024.0 * DT), "{foreign:?}");
    assert!(found.summary.contains("on the table") && found.summary.contains("Hz"), "{}", found.summary);
}

#[test]
fn play_in_the_coupling_lies_in_the_coupling() {
    let found = located(Effect::Backlash, &[5e-3]);
    assert_eq!(found.place, Some(Place::Coupling), "{}", found.summary);
}

#[test]
fn a_wrong_pitch_of_the_tables_encoder_is_no_torque() {
    let found = located(Effect::LeadError, &[2e-3]);
    assert_eq!(found.place, Some(Place::Sensor), "{}", found.summary);
    let sensor = found.by_place.iter().find(|e| e.place == Some(Place::Sensor)).expect("both encoders");
    assert!((sensor.fitted.sensor[0] / 2e-3 - 1.0).abs() < 0.01, "{:?}", sensor.fitted);
}

#[test]
fn a_late_reading_of_the_tables_encoder_is_found_with_its_delay() {
    let found = located(Effect::SensorDelay, &[0.7 * DT]);
    assert_eq!(found.place, Some(Place::Sensor), "{}", found.summary);
    let sensor = found.by_place.iter().find(|e| e.place == Some(Place::Sensor)).expect("both encoders");
    assert!((sensor.fitted.sensor[1] / 0.7 - 1.0).abs() < 0.02, "{:?}", sensor.fitted);
}

#[test]
fn one_encoder_gives_a_weak_place_and_says_so() {
    let found = locate(&record(Some((Effect::CoulombMotor, &[3e-3])), false).0, &near(), Structure::TwoInertia);
    assert!(found.place.is_some());
    let weak = found.weak.expect("one encoder is weak");
    assert!(weak.contains("only the motor is measured"), "{weak}");
    assert!(found.by_place.iter().all(|e| e.place != Some(Place::Sensor)));
}

#[test]
fn a_rigid_axis_has_one_residual_torque() {
    let found = locate(&record(Some((Effect::CoulombMotor, &[3e-3])), false).0, &near(), Structure::Rigid);
    assert!(found.residual.r2.is_empty() && found.by_time.iter().all(|s| s.r2.is_none()));
    assert_eq!(found.place, Some(Place::Motor));
    assert!(found.weak.expect("rigid").contains("rigid"));
}

#[test]
fn smoothed_states_are_within_their_own_uncertainty_under_an_effect_that_they_do_not_know() {
    let (record, truth) = record(Some((Effect::CoulombMotor, &[3e-3])), true);
    let motion = smooth_states(&record, &P, Structure::TwoInertia);
    for j in 0..4 {
        let z = (0..truth.len()).map(|k| ((motion.states[k][j] - truth[k][j]) / motion.state_std[k][j]).powi(2));
        let rms = (z.sum::<f64>() / truth.len() as f64).sqrt();
        // 1 by chance for a torque that walks at random; friction that jumps is rarer and larger.
        assert!((0.4..1.6).contains(&rms), "state {j}: {rms}");
    }
    // The encoder's noise is smoothed away.
    let error: Vec<f64> = (0..truth.len()).map(|k| motion.states[k][0] - truth[k][0]).collect();
    assert!(super::plant::rms(&error) < 0.7 * NOISE);
}

#[test]
fn encoders_with_their_own_zeros_change_nothing() {
    let (mut record, _) = record(Some((Effect::CoulombMotor, &[3e-3])), true);
    for v in record.channels[2].iter_mut().flatten() {
        *v += 700.0;
    }
    let found = locate(&record, &near(), Structure::TwoInertia);
    assert_eq!(found.place, Some(Place::Motor), "{}", found.summary);
}

#[test]
fn an_error_of_the_command_is_told_from_a_torque_on_the_motor_by_what_it_follows() {
    for (effect, values) in
        [(Effect::Delay, &[2.4 * DT][..]), (Effect::ActuatorLag, &[4e-3]), (Effect::Saturation, &[0.045])]
    {
        let found = located(effect, values);
        assert_eq!(found.place, Some(Place::Input), "{effect:?}: {}", found.summary);
        assert!(found.summary.contains("between the command and the motor"), "{}", found.summary);
    }
    for (effect, values) in
        [(Effect::ViscousMotor, &[2e-4][..]), (Effect::TorqueRipple, &[2e-3, 3.0]), (Effect::LoadMotor, &[2e-3])]
    {
        let found = located(effect, values);
        assert_eq!(found.place, Some(Place::Motor), "{effect:?}: {}", found.summary);
    }
}

#[test]
fn the_same_record_gives_the_same_answer_to_the_bit_on_any_number_of_threads() {
    let (record, _) = record(Some((Effect::CoulombTable, &[1e-3])), true);
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| serde_json::to_string(&locate(&record, &near(), Structure::TwoInertia)).expect("plain data"))
    };
    assert_eq!(on(1), on(3));
}

#[test]
fn a_record_longer_than_a_section_is_smoothed_as_one() {
    let torque: Vec<f64> = torque().into_iter().cycle().take(super::SECTION + 4000).collect();
    let mut effects = Settings::default();
    effects.of_mut(Effect::CoulombMotor)[0] = 3e-3;
    let options = SimulateOptions { start: 0.0, dt: DT, hold: Hold::Zoh, scheme: Scheme::Exact, substeps: 1 };
    let response = simulate(&P, Structure::TwoInertia, &effects, [0.0, 1.0, 0.0, 1.0], &torque, &options);
    let mut rng = ChaCha8Rng::seed_from_u64(18);
    let mut read = |f: &dyn Fn(usize) -> f64| -> Vec<f64> {
        let noise: Vec<f64> = (0..torque.len()).map(|_| StandardNormal.sample(&mut rng)).collect();
        noise.iter().enumerate().map(|(k, e)| f(k) + NOISE * e).collect()
    };
    let channels =
        [Some(read(&|k| response.readings[k].theta1)), None, Some(read(&|k| response.readings[k].theta2)), None];
    let record = Record {
        start: 0.0,
        dt: DT,
        hold: Hold::Zoh,
        torque: torque.clone(),
        channels,
        noise: [NOISE, 0.0, NOISE, 0.0],
    };
    let motion = smooth_states(&record, &P, Structure::TwoInertia);
    assert_eq!(motion.states.len(), torque.len());
    // Where two sections meet the state is as good as elsewhere.
    let meet = torque.len() / 2;
    for k in meet - 5..meet + 5 {
        let error = (motion.states[k][0] - response.readings[k].theta1).abs();
        assert!(error < 5.0 * motion.state_std[k][0] && motion.state_std[k][0] < NOISE, "{k}: {error}");
    }
}

/// EMPS, closed loop, one encoder (A. Janot, M. Gautier, M. Brunot, 2019): by its authors' reference model friction rules.
#[test]
fn on_a_real_axis_in_closed_loop_friction_is_not_taken_for_an_error_of_the_command() {
    let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
    let data = std::env::var_os("EIXO_DATA").map_or_else(|| root.join("../shared/data"), Into::into);
    let path = data.join("emps/train.csv");
    let Ok(text) = std::fs::read_to_string(&path) else {
        eprintln!("skipped: {} is not there; set EIXO_DATA to the folder of measured data", path.display());
        return;
    };
    let mut lines = text.lines();
    let header: Vec<&str> = lines.next().expect("a header").split(',').collect();
    let [q, force] = ["q_meas_m", "force_cmd_N"].map(|n| header.iter().position(|h| *h == n).expect("column"));
    let rows: Vec<Vec<f64>> = lines.map(|l| l.split(',').map(|v| v.parse().expect("number")).collect()).collect();
    let column = |i: usize| rows.iter().map(|r| r[i]).collect::<Vec<f64>>();
    let channels = [Some(column(q)), None, None, None];
    let torque = column(force);
    let noise = crate::diagnose::estimate_noise(&torque, &channels.each_ref().map(|c| c.as_deref()), None).std;
    let record = Record { start: 0.0, dt: 1e-3, hold: Hold::Zoh, torque, channels, noise };
    let given = Parameters { i1: 90.0, i2: 0.0, b: 0.0, k: 0.0, rho: 1.0 };
    let found = locate(&record, &given, Structure::Rigid);
    assert_eq!(found.place, Some(Place::Motor), "{}", found.summary);
    assert!(found.summary.contains("flat against the sign of omega1"), "{}", found.summary);
    assert!(found.weak.expect("one encoder, rigid").contains("rigid"));
}
