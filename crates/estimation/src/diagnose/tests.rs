//! Rigid axes under control, made by the axis' own step: what a drive's log looks like.

use super::assess::{Case, Outcome};
use super::diagnose;
use super::diagnosis::{ClosureOf, Site};
use super::prepared::prepared;
use super::search::{decide, decide_further};
use super::verdict::Verdict;
use crate::axis::{Axis, AxisKind, Hold, Parameters, Scheme, Structure};
use crate::conditioning::{NoiseEstimate, Record, estimate_noise};
use crate::effects::{EFFECTS, Effect, Ramp, Settings};
use crate::hypothesis::band::Reach;
use crate::hypothesis::fit::{Fit, Problem};
use crate::hypothesis::likelihood::{C, TorqueResidual};
use crate::hypothesis::model::Model;
use crate::hypothesis::tracking::{Resolution, track, track_step_by_step};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const INERTIA: f64 = 2.0;
const DT: f64 = 2e-3;

fn parameters(i1: f64) -> Parameters {
    Parameters { i1, i2: 0.0, b: 0.0, k: 0.0, rho: 1.0 }
}

fn noise(rng: &mut ChaCha8Rng, size: f64) -> f64 {
    size * (0..12).map(|_| rng.random_range(-0.5..0.5)).sum::<f64>()
}

/// A record of one encoder with a noise of 1e-6 rad.
fn of_one_encoder(start: f64, torque: Vec<f64>, theta: Vec<f64>) -> Record {
    Record {
        start,
        dt: DT,
        hold: Hold::Zoh,
        torque,
        between: None,
        channels: [Some(theta), None, None, None],
        noise: [1e-6; 4],
        corner: [0.0; 2],
        common_noise: 0.0,
        settling: 0.0,
        idle: Vec::new(),
    }
}

/// A record of moves to and fro under a position controller; `foreign` is a torque that no model knows of.
fn logged(effects: Settings, amplitude: f64, torque_noise: f64, foreign: impl Fn(f64) -> f64, seed: u64) -> Record {
    let wanted = |t: f64| amplitude * ((0.9 * t).sin() + 0.35 * (2.3 * t).sin() * (1.0 - (-t).exp()));
    led(wanted, effects, torque_noise, foreign, seed)
}

/// The same along any way.
fn led(
    wanted: impl Fn(f64) -> f64,
    effects: Settings,
    torque_noise: f64,
    foreign: impl Fn(f64) -> f64,
    seed: u64,
) -> Record {
    let n = 6000;
    let axis = Axis::new(parameters(INERTIA), Structure::Rigid, effects, Scheme::Exact, DT);
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut noise = |size: f64| noise(&mut rng, size);
    let mut state = axis.state(0.0, 0.0, 0.0, 0.0, 0.0);
    let (mut torque, mut theta) = (Vec::new(), Vec::new());
    for k in 0..n {
        let t = f64::from(k) * DT;
        let seen = state.theta1() + noise(1e-6);
        let command = INERTIA * (900.0 * (wanted(t) - seen) - 42.0 * state.omega1());
        theta.push(seen);
        torque.push(command + noise(torque_noise));
        let acts = command + foreign(t);
        state = axis.advance(&state, Ramp { start: acts, end: acts }, t);
    }
    of_one_encoder(0.0, torque, theta)
}

/// A record to be diagnosed without held-out data, any effect suspected.
fn case<'a>(record: &'a Record, nominal: Model, noise: &'a NoiseEstimate) -> Case<'a> {
    Case {
        machine: "axis".to_owned(),
        nominal,
        motion: AxisKind::Rotary,
        train: record,
        noise,
        holdout: None,
        suspects: EFFECTS.to_vec(),
    }
}

fn diagnosed_as(record: &Record, structure: Structure, nominal: Parameters) -> Outcome {
    let channels = [0, 1, 2, 3].map(|c: usize| record.channels[c].as_deref());
    let noise = estimate_noise(&record.torque, &channels, None);
    let case = case(record, Model::new(nominal, structure, Settings::default()), &noise);
    let o = diagnose(&case, &|_| ());
    // What stays open is not named as a cause.
    if let Some(open) = &o.diagnosis.undecided {
        let is_named = o.diagnosis.causes.iter().any(|c| open.effects.contains(&c.effect));
        assert!(!open.effects.is_empty() && !is_named, "{:?} beside {:?}", open.effects, named(&o));
    }
    o
}

fn diagnosed(record: &Record, inertia: f64) -> Outcome {
    diagnosed_as(record, Structure::Rigid, parameters(inertia))
}

fn named(o: &Outcome) -> Vec<&'static str> {
    let mut ids: Vec<&str> = o.decision.chosen.terms.iter().map(|(e, _)| e.info().family.as_str()).collect();
    ids.sort_unstable();
    ids
}

#[test]
fn what_a_parameter_changes_along_the_motion_is_what_it_changes_in_a_simulation() {
    let mut effects = Settings::default();
    let on: [(Effect, &[f64]); 6] = [
        (Effect::CoulombMotor, &[3.0, 0.4, 0.3, 0.1, 0.0]),
        (Effect::ViscousMotor, &[1.5, 0.0]),
        (Effect::PreslidingMotor, &[2.0, 0.01, 0.0]),
        (Effect::Gravity, &[4.0, 0.5]),
        (Effect::Saturation, &[6.0]),
        (Effect::Delay, &[3e-3]),
    ];
    for (effect, values) in on {
        effects.of_mut(effect)[..values.len()].copy_from_slice(values);
    }
    let record = logged(effects, 1.0, 0.0, |_| 0.0, 5);
    let model = Model::new(parameters(INERTIA), Structure::Rigid, effects);
    let bandwidth = [0.2 / DT; 2];
    let simulated = |m: &Model| track(m, &record, bandwidth, Resolution::Full).expect("a run").torque;
    let own = simulated(&model);
    let (_, trajectory) = track_step_by_step(&model, &record, bandwidth, Resolution::Full).expect("a run");
    for (effect, i) in on.iter().flat_map(|(e, values)| (0..values.len()).map(|i| (*e, i))) {
        let mut other = model;
        let value = &mut other.effects.of_mut(effect)[i];
        *value += 0.02 * value.abs().max(effect.info().parameters[i].nominal);
        let [with, without] = [&other, &model].map(|m| trajectory.resisted(m, [effect]));
        let along = |k: usize| with[0][k] + with[1][k] - without[0][k] - without[1][k];
        // As a hat over some samples sees both: where friction turns they differ by a sample.
        let smooth = |y: &dyn Fn(usize) -> f64| -> Vec<f64> {
            (50..record.len() - 50).step_by(10).map(|k| (k - 20..k + 20).map(y).sum::<f64>() / 40.0).collect()
        };
        let moved = simulated(&other);
        let (a, b) = (smooth(&along), smooth(&|k| moved[0][k] - own[0][k]));
        let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let (size, alike) =
            (product(&a, &b) / product(&b, &b), product(&a, &b) / (product(&a, &a) * product(&b, &b)).sqrt());
        assert!((size - 1.0).abs() < 0.05 && alike > 0.99, "{effect:?} {i}: {size} {alike}");
    }
}

/// What is off, in power over what a change of a model makes, where it is told along the motion of a run of the model and not simulated.
fn off_along_the_motion(record: &Record, model: Model, other: &Model) -> f64 {
    let (searched, _) = prepared(record, &model, Reach::Ruled);
    let problem = Problem::of(&searched.record, &searched.band, model, searched.peak);
    let given = problem.given(&model).expect("a run");
    let along = problem.along_the_motion_of(&given);
    let rows = |p: &Problem<'_>| p.rows(other, given.bandwidth, Some(given.discrepancy)).expect("a run").rows;
    let steps = problem.steps();
    let told = rows(&along);
    assert_eq!(problem.steps(), steps, "nothing is simulated");
    let own = rows(&problem);
    let power = |a: &[Vec<C>; 2], b: &[Vec<C>; 2]| -> f64 {
        a.iter().flatten().zip(b.iter().flatten()).map(|(a, b)| (a - b).norm_sqr()).sum()
    };
    power(&told, &own) / power(&own, &given.rows.rows)
}

#[test]
fn what_another_model_lacks_along_the_motion_of_one_is_what_its_own_simulation_lacks() {
    let effects = with(&[(Effect::CoulombMotor, 0, 3.0), (Effect::ViscousMotor, 0, 1.5)]);
    let record = logged(effects, 1.0, 0.0, |_| 0.0, 5);
    let bare = Model::new(parameters(INERTIA), Structure::Rigid, Settings::default());
    // Inertia, effects, and the share of what changes, in power, that may be off.
    type Values = &'static [(Effect, usize, f64)];
    let others: [(f64, Values, f64); 5] = [
        (1.4, &[], 1e-9),
        (1.0, &[(Effect::ActuatorLag, 0, 0.02)], 1e-4),
        (
            1.2,
            &[
                (Effect::MotorMode, 0, 0.3 * INERTIA),
                (Effect::MotorMode, 1, 300.0 * INERTIA),
                (Effect::MotorMode, 2, INERTIA),
            ],
            1e-4,
        ),
        // A simulation comes to rest at the reversals.
        (0.8, &[(Effect::CoulombMotor, 0, 2.0)], 1e-2),
        (1.1, &[(Effect::PreslidingMotor, 0, 3.0), (Effect::PreslidingMotor, 1, 0.02)], 1e-2),
    ];
    for (i, (inertia, effects, share)) in others.into_iter().enumerate() {
        let other = Model { parameters: parameters(inertia * INERTIA), effects: with(effects), ..bare };
        let off = off_along_the_motion(&record, bare, &other);
        assert!(off <= share, "{i}: {off}");
    }
}

#[test]
fn a_cause_that_acts_beyond_the_part_searched_joins_the_verdict() {
    let effects = with(&[(Effect::CoulombMotor, 0, 3.0), (Effect::EndStop, 0, 200.0), (Effect::EndStop, 1, 1.4)]);
    // The way reaches the stop in its second half.
    let way = |t: f64| (0.9 * t).sin() * if t < 6.0 { 0.8 } else { 1.5 };
    for (effects, late) in [(effects, true), (with(&[(Effect::CoulombMotor, 0, 3.0)]), false)] {
        let record = led(way, effects, 0.0, |_| 0.0, 5);
        let channels = [0, 1, 2, 3].map(|c: usize| record.channels[c].as_deref());
        let noise = estimate_noise(&record.torque, &channels, None);
        let nominal = Model::new(parameters(INERTIA), Structure::Rigid, Settings::default());
        let case = case(&record, nominal, &noise);
        let (searched, _) = prepared(&record.part(0..2800), &nominal, Reach::Ruled);
        let found = decide(searched.search(&case, EFFECTS.to_vec(), &|_| ()), None).chosen;
        assert_eq!(found.effects(), [Effect::CoulombMotor]);
        let (part, lacks) = searched.worst_beyond(&record, &case, &found.model).expect("a further part");
        let search = part.search(&case, EFFECTS.to_vec(), &|_| ());
        assert!(!late || search.leaves_materially_less(&lacks, &found));
        let all = decide_further(search, &found).map(|d| d.chosen.effects());
        assert_eq!(all, late.then(|| vec![Effect::CoulombMotor, Effect::EndStop]));
    }
}

/// What was tried, for a test that fails.
fn ranking(o: &Outcome) -> Vec<(String, f64, Vec<Vec<f64>>)> {
    let line = |w: &super::conclusion::Weighed| {
        let values = w.fit.terms.iter().map(|(e, _)| w.fit.model.effects.of(*e).to_vec()).collect();
        (w.fit.hypothesis().to_string(), w.evidence, values)
    };
    o.decision.ranking.iter().take(12).map(line).collect()
}

fn with(values: &[(Effect, usize, f64)]) -> Settings {
    let mut s = Settings::default();
    for (e, i, v) in values {
        s.of_mut(*e)[*i] = *v;
    }
    s
}

/// A soft belt that a slow controller moves on and on, its motor's encoder alone read.
fn of_a_belt(belt: Parameters, seed: u64) -> Record {
    let axis = Axis::new(belt, Structure::TwoInertia, Settings::default(), Scheme::Exact, DT);
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut state = axis.state(0.0, 0.0, 0.0, 0.0, 0.0);
    let (mut torque, mut theta) = (Vec::new(), Vec::new());
    for k in 0..3000 {
        let t = f64::from(k) * DT;
        let wanted = 2.0 * t - 1.8 * (0.9 * t).sin() + 0.2 * (7.0 * t).sin();
        theta.push(state.theta1() + noise(&mut rng, 1e-6));
        torque.push((belt.i1 + belt.i2) * (100.0 * (wanted - state.theta1()) - 14.0 * state.omega1()));
        state = axis.advance(&state, Ramp { start: torque[k as usize], end: torque[k as usize] }, t);
    }
    of_one_encoder(0.0, torque, theta)
}

const BELT: Parameters = Parameters { i1: 1.26e-3, i2: 9.3e-4, b: 5.8e-4, k: 1.52, rho: 1.0 };

#[test]
fn an_encoder_on_the_motor_alone_tells_a_coupling_that_is_not_the_nominal_one() {
    for (seed, nominal) in
        [Parameters { i1: 1.13e-3, b: 6.8e-4, k: 1.91, ..BELT }, Parameters { i1: 1.4e-3, i2: 1.1e-3, k: 1.0, ..BELT }]
            .into_iter()
            .enumerate()
    {
        let o = diagnosed_as(&of_a_belt(BELT, seed as u64), Structure::TwoInertia, nominal);
        let p = &o.models[1].parameters;
        assert_eq!(o.decision.verdict, Verdict::Parameters, "{seed}: {:?}", named(&o));
        assert!(
            (p.k / BELT.k).ln().abs() < 0.03 && (p.i2 / BELT.i2).ln().abs() < 0.03,
            "{seed}: {p:?} {}",
            o.diagnosis.remainder.noise_multiple
        );
    }
}

/// What an axis without any effect lacks of a record of it, its parameters the true ones: its mean square in the noise's.
fn of_the_truth(record: &Record, model: &Model, reach: Reach) -> f64 {
    let (p, own) = prepared(record, model, reach);
    assert!(own.is_none());
    let given = Problem::of(&p.record, &p.band, *model, p.peak).given(model).expect("runs");
    p.band.noise_multiple(&given.rows).powi(2)
}

#[test]
fn an_axis_as_it_is_lacks_nothing_but_the_noise_of_its_encoder() {
    // The record begins and ends in the midst of a motion, the torque at one end is not the one at the other.
    let way = |t: f64| 0.5 * (1.1 * t).sin() + 0.2 * (2.3 * t).sin() + 0.02 * t * t;
    let rigid = |seed| {
        let record = led(way, Settings::default(), 0.0, |_| 0.0, seed).part(400..5900);
        of_the_truth(&record, &Model::new(parameters(INERTIA), Structure::Rigid, Settings::default()), Reach::Ruled)
    };
    let coupled = |seed| {
        let model = Model::new(BELT, Structure::TwoInertia, Settings::default());
        of_the_truth(&of_a_belt(BELT, seed).part(300..3000), &model, Reach::Shown)
    };
    // In the mean of as many records as there are, of some thirty values each: one, and not a half or two.
    for (name, of) in [("rigid", &rigid as &dyn Fn(u64) -> f64), ("coupled", &coupled)] {
        let found: Vec<f64> = (0..8).map(of).collect();
        let mean = found.iter().sum::<f64>() / 8.0;
        assert!((0.5..2.0).contains(&mean), "{name}: {found:?}");
    }
}

#[test]
fn a_coupling_that_one_encoder_hardly_shows_is_as_likely_as_it_is() {
    // Below its resonance the motor shows I1 + I2 and I2^2/K: along that valley no stiffness may be told as far likelier than the true one.
    for seed in 0..4 {
        let record = of_a_belt(Parameters { k: 20.0, ..BELT }, seed).part(300..3000);
        let model = Model::new(Parameters { k: 20.0, ..BELT }, Structure::TwoInertia, Settings::default());
        let (p, _) = prepared(&record, &model, Reach::Shown);
        let problem = Problem::of(&p.record, &p.band, model, p.peak);
        let of = |f: &Fit| f.log_likelihood + f.log_prior;
        let truth = of(&problem.given(&model).expect("runs"));
        for fit in [1.06, 1.0 / 1.06].iter().flat_map(|r| problem.held_stiffnesses(*r, [f64::MAX; 2])) {
            let gained = of(&fit) - truth;
            assert!(gained < 5.0, "{seed}: {} {gained}", fit.model.parameters.k);
        }
    }
}

/// A log of a constant torque, by a load or by friction, along a way on and on, beside a torque that wanders slowly and is small beside it.
fn onwards(effect: Effect, wander: f64) -> Record {
    let way = |t: f64| 2.0 * t - 1.8 * (0.9 * t).sin();
    // Without its start from rest, where friction holds and a load does not.
    led(way, with(&[(effect, 0, 0.5)]), 1e-4, |t| wander * (1.3 * t).sin(), 5).part(500..6000)
}

#[test]
fn a_friction_and_a_load_are_not_told_apart_where_the_axis_never_goes_back() {
    for effect in [Effect::LoadMotor, Effect::CoulombMotor] {
        let o = diagnosed(&onwards(effect, 0.03), INERTIA);
        let families: Vec<[&str; 2]> =
            o.decision.confusable.iter().map(|c| [c.named, c.other].map(|e| e.info().family.as_str())).collect();
        assert_eq!(families, [["dry_friction", "load_torque"]], "{:?} {:?}", named(&o), ranking(&o));
        // Every axis has friction, few carry a weight, as the effects' own odds have it.
        assert!(o.decision.probabilities.iter().all(|p| (0.5..0.8).contains(p)), "{:?}", o.decision.probabilities);
    }
}

#[test]
fn what_follows_a_wandering_torque_is_no_cause() {
    for effect in [Effect::LoadMotor, Effect::CoulombMotor] {
        let o = diagnosed(&onwards(effect, 0.05), INERTIA);
        let causes: Vec<Effect> = o.diagnosis.causes.iter().map(|c| c.effect).collect();
        assert!(
            [vec![Effect::CoulombMotor], vec![Effect::LoadMotor]].contains(&causes),
            "{causes:?} {:?}",
            ranking(&o)
        );
        let pair = |c: &super::conclusion::Confusable| [c.named, c.other] == [Effect::CoulombMotor, Effect::LoadMotor];
        assert!(o.decision.confusable.iter().any(pair), "{:?}", ranking(&o));
    }
}

#[test]
fn a_stage_with_nothing_hidden_has_no_cause_whatever_the_noise_of_its_torque() {
    for (noise, nominal) in [(1e-9, INERTIA), (0.2, INERTIA), (0.05, 1.2 * INERTIA)] {
        let o = diagnosed(&logged(Settings::default(), 1.0, noise, |_| 0.0, 1), nominal);
        assert!(matches!(o.decision.verdict, Verdict::NoGap | Verdict::Parameters), "{noise}: {:?}", named(&o));
        assert!((o.models[1].parameters.i1 / INERTIA - 1.0).abs() < 0.02, "{:?}", o.models[1].parameters);
    }
}

#[test]
fn friction_and_a_bias_are_named_with_their_sizes_at_the_axis() {
    let hidden = [(Effect::CoulombMotor, 0, 1.5), (Effect::ViscousMotor, 0, 2.0), (Effect::LoadMotor, 0, 0.8)];
    let o = diagnosed(&logged(with(&hidden), 1.0, 0.02, |t| 0.02 * (0.31 * t * t).sin(), 2), 1.1 * INERTIA);
    assert_eq!(named(&o), ["dry_friction", "load_torque", "viscous_friction"], "{:#?}", ranking(&o));
    for (effect, i, value) in hidden {
        let got = o.improved.effects.of(effect)[i];
        assert!((got / value - 1.0).abs() < 0.03, "{effect:?} {got}");
    }
    assert!(o.diagnosis.causes.iter().all(|c| c.site == Site::Axis), "{:?}", o.diagnosis.causes);
    let remainder = o.diagnosis.remainder;
    assert!(remainder.share < 0.05 && remainder.site == Site::Axis, "{remainder:?}");
}

#[test]
fn gravity_is_told_from_a_spring_where_the_hinge_turns_far_enough() {
    let hidden = [(Effect::Gravity, 0, 6.0), (Effect::CoulombMotor, 0, 0.5)];
    let o = diagnosed(&logged(with(&hidden), 1.2, 0.02, |_| 0.0, 3), INERTIA);
    assert_eq!(named(&o), ["dry_friction", "gravity"]);
    assert!((o.improved.effects.of(Effect::Gravity)[0] / 6.0 - 1.0).abs() < 0.02);
}

#[test]
fn a_torque_that_the_library_has_no_law_for_is_not_named() {
    // Wanders with the square root of the position's absolute value, of no sign of its own in time.
    let o = diagnosed(
        &logged(Settings::default(), 1.0, 0.01, |t| 2.0 * ((0.31 * t * t).sin() * (1.7 * t).sin()).cbrt(), 4),
        INERTIA,
    );
    assert!(
        o.decision.verdict == Verdict::Unexplained || o.diagnosis.causes.iter().all(|c| c.probability < 0.9),
        "{:?}",
        o.diagnosis.causes
    );
}

#[test]
fn a_third_inertia_on_a_spring_is_found_at_its_frequency() {
    let hidden = [(Effect::MotorMode, 0, 0.8), (Effect::MotorMode, 1, 12.8), (Effect::MotorMode, 2, 0.16)];
    let o = diagnosed(&logged(with(&hidden), 1.0, 0.01, |_| 0.0, 5), INERTIA);
    assert_eq!(named(&o), ["flexible_mode"], "{:#?}", ranking(&o));
    let [inertia, stiffness, _] = *o.improved.effects.of(Effect::MotorMode) else { unreachable!() };
    assert!(((stiffness / inertia).sqrt() / 4.0 - 1.0).abs() < 0.02, "{inertia} {stiffness}");
    // The held-out third begins while it swings: that is no torque that the model lacks.
    let ways = o.diagnosis.gap.ways;
    assert!(ways[2].of == ClosureOf::Torque && ways[2].closure > 0.99, "{ways:?}");
}

#[test]
fn a_ripple_faster_than_the_motion_is_found_beyond_its_band() {
    // Up to 50 rad/s, under a motion of 0.9 and 2.3.
    let hidden = [(Effect::TorqueRipple, 0, 0.06), (Effect::TorqueRipple, 1, 30.0), (Effect::TorqueRipple, 2, 0.5)];
    let o = diagnosed(&logged(with(&hidden), 1.0, 1e-9, |_| 0.0, 6), INERTIA);
    assert_eq!(named(&o), ["torque_ripple"], "{:#?}", ranking(&o));
    assert!((o.improved.effects.of(Effect::TorqueRipple)[1] / 30.0 - 1.0).abs() < 1e-3);
}

#[test]
fn a_small_cause_that_explains_next_to_all_that_a_large_one_leaves_is_named_beside_it() {
    let hidden = [
        (Effect::CoulombMotor, 0, 30.0),
        (Effect::TorqueRipple, 0, 0.8),
        (Effect::TorqueRipple, 1, 11.0),
        (Effect::TorqueRipple, 2, 0.4),
    ];
    let o = diagnosed(&logged(with(&hidden), 1.0, 1e-3, |_| 0.0, 9), INERTIA);
    assert_eq!(named(&o), ["dry_friction", "torque_ripple"], "{:#?}", ranking(&o));
    // A fiftieth of what the friction makes.
    assert!((o.improved.effects.of(Effect::TorqueRipple)[0] / 0.8 - 1.0).abs() < 0.05);
}

#[test]
fn beside_the_data_sheet_a_friction_and_a_delay_are_found_that_run_off_with_free_parameters() {
    let paper = Parameters::PAPER;
    let acts =
        |t: f64| [(2.1, 0.3), (9.7, 4.1), (31.1, 5.3), (61.0, 1.1)].iter().map(|(w, p)| 0.05 * (w * t + p).sin()).sum();
    let mut record = moved(paper, with(&[(Effect::CoulombMotor, 0, 0.03)]), &acts, 0);
    // The drive's torque comes three samples after its command.
    record.torque = (0..record.torque.len()).map(|k| acts((k as f64 + 3.0) * record.dt)).collect();
    let nominal = Model::new(paper, Structure::TwoInertia, Settings::default());
    let case = Case {
        machine: "axis".to_owned(),
        nominal,
        motion: AxisKind::Rotary,
        train: &record,
        noise: &estimate_noise(&record.torque, &[0, 1, 2, 3].map(|c: usize| record.channels[c].as_deref()), None),
        holdout: None,
        suspects: EFFECTS.to_vec(),
    };
    let (searched, _) = prepared(&record, &nominal, Reach::Shown);
    let suspects =
        EFFECTS.iter().copied().filter(|e| e.may_be_named(Structure::TwoInertia, AxisKind::Rotary)).collect();
    let mut search = searched.search(&case, suspects, &|_| ());
    let fit = search.only_with_nominal_parameters().expect("causes");
    assert_eq!(fit.effects(), [Effect::CoulombMotor, Effect::Delay], "{:?}", fit.terms);
    assert!((fit.model.effects.of(Effect::Delay)[0] / (3.0 * record.dt) - 1.0).abs() < 0.02);
    assert!((fit.model.effects.of(Effect::CoulombMotor)[0] / 0.03 - 1.0).abs() < 0.02);
    // Its parameters are free in the end.
    assert!(fit.coordinates.iter().any(|c| c.is_base()) && (fit.model.parameters.i1 / paper.i1 - 1.0).abs() < 0.02);
}

/// An open-loop record of two inertias under a few tones, the table's encoder read `late` half samples late.
fn of_two_inertias(parameters: Parameters, effects: Settings, amplitude: f64, late: usize) -> Record {
    let acts = |t: f64| {
        let tones = [(2.1, 0.3), (5.3, 1.7), (9.7, 4.1), (17.3, 2.9), (31.1, 5.3)];
        amplitude * tones.iter().map(|(w, p)| (w * t + p).sin()).sum::<f64>()
    };
    moved(parameters, effects, &acts, late)
}

/// Samples of an axis, and their interval, s.
const SAMPLED: (i32, f64) = (3000, 2e-3);

/// The same under a torque over time, which is held from sample to sample.
fn moved(parameters: Parameters, effects: Settings, acts: &dyn Fn(f64) -> f64, late: usize) -> Record {
    let (n, dt) = SAMPLED;
    // Fine enough for all that the effects do.
    let fine = 16;
    let h = dt / f64::from(fine);
    let axis = Axis::new(parameters, Structure::TwoInertia, effects, Scheme::Exact, h);
    let mut state = axis.state(0.0, 0.0, 0.0, 0.0, 0.0);
    let late = late * fine as usize / 2;
    let mut past = vec![0.0; late + 1];
    let (mut torque, mut motor, mut table) = (Vec::new(), Vec::new(), Vec::new());
    for k in 0..fine * n {
        let t = h * f64::from(k);
        past.push(state.theta2());
        if k % fine == 0 {
            torque.push(acts(t));
            motor.push(state.theta1());
            table.push(past[past.len() - 1 - late]);
        }
        let held = acts(t - h * f64::from(k % fine));
        state = axis.advance(&state, Ramp { start: held, end: held }, t);
    }
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    for theta in motor.iter_mut().chain(&mut table) {
        *theta += noise(&mut rng, 1e-5);
    }
    let channels = [Some(motor), None, Some(table), None];
    Record {
        start: 0.0,
        dt,
        hold: Hold::Zoh,
        torque,
        between: None,
        channels,
        noise: [1e-5; 4],
        corner: [0.0; 2],
        common_noise: 0.0,
        settling: 0.0,
        idle: Vec::new(),
    }
}

#[test]
fn of_an_axis_that_swings_too_fast_to_be_held_to_the_stiffness_is_found_from_afar() {
    let (n, dt) = SAMPLED;
    // A fifth of a turn a sample, hardly damped; from half of its stiffness the nearest hollow is an eighth off.
    let wn = 1.25 / dt;
    let p = Parameters::PAPER;
    let k = wn * wn * p.i1 * p.i2 / (p.i1 + p.i2);
    let fast = Parameters { k, b: 0.006 * k / wn, ..p };
    let mut rng = ChaCha8Rng::seed_from_u64(31);
    let torque: Vec<f64> = (0..n).map(|_| noise(&mut rng, 20.0 * p.i1 / dt)).collect();
    let record = moved(fast, Settings::default(), &|t| torque[((t / dt).round() as usize).min(torque.len() - 1)], 0);
    let o = diagnosed_as(&record, Structure::TwoInertia, Parameters { k: 0.5 * k, ..fast });
    assert_eq!(o.decision.verdict, Verdict::Parameters, "{:#?}", ranking(&o));
    let found = o.improved.parameters.k;
    assert!((found / k - 1.0).abs() < 1e-3, "{found} {k}");
}

#[test]
fn a_late_encoder_of_a_light_table_is_no_softer_coupling() {
    // The twist is little more than the table's speed times the delay: free, the stiffness takes that and leaves the delay nothing.
    let light = Parameters { i1: 2.4e-4, i2: 6e-6, b: 5e-4, k: 0.018, rho: 1.0 };
    let friction = with(&[(Effect::CoulombMotor, 0, 2e-3)]);
    let o = diagnosed_as(&of_two_inertias(light, friction, 8e-3, 3), Structure::TwoInertia, light);
    assert_eq!(named(&o), ["dry_friction", "sensor"], "{:#?}", ranking(&o));
    let delay = o.improved.effects.of(Effect::SensorDelay)[0];
    assert!((delay / 3e-3 - 1.0).abs() < 0.05, "{delay}");
}

#[test]
fn a_model_that_reads_late_follows_at_a_bandwidth_at_which_it_is_stable() {
    let (_, dt) = SAMPLED;
    // A quarter of a radian a sample, hardly damped, the table read three samples late.
    let wn = 0.25 / dt;
    let p = Parameters::PAPER;
    let k = wn * wn * p.i1 * p.i2 / (p.i1 + p.i2);
    let swings = Parameters { k, b: 0.02 * k / wn, ..p };
    let record = of_two_inertias(swings, Settings::default(), 0.02, 6);
    let nominal = Model::new(swings, Structure::TwoInertia, Settings::default());
    let late = Model { effects: with(&[(Effect::SensorDelay, 0, 3.0 * dt)]), ..nominal };
    let (searched, _) = prepared(&record, &nominal, Reach::Shown);
    let problem = Problem::of(&searched.record, &searched.band, nominal, searched.peak);
    let tight = problem.bandwidth([f64::MAX; 2]);
    // Held as tightly as one that reads in time the loop swings up.
    let left = |rows: &TorqueResidual| searched.band.noise_multiple(rows);
    assert!(problem.rows(&late, tight, None).is_none_or(|rows| left(&rows) > 100.0));
    let at = problem.along(&late, tight).expect("a bandwidth");
    assert!(at.bandwidth[0] < tight[0] && left(&at.rows) < 1.5, "{:?} {}", at.bandwidth, left(&at.rows));
}

#[test]
fn samples_taken_late_hide_neither_the_coupling_nor_the_friction_on_its_sides() {
    let stiff = Parameters { i1: 0.03, i2: 1.5e-3, b: 0.11, k: 1100.0, rho: 1.0 };
    let friction = with(&[(Effect::CoulombMotor, 0, 4.0), (Effect::CoulombTable, 0, 4.0)]);
    let mut record = of_two_inertias(stiff, friction, 20.0, 0);
    let mut rng = ChaCha8Rng::seed_from_u64(11);
    let [Some(motor), _, Some(table), _] = &mut record.channels else { unreachable!() };
    for k in (1..motor.len()).rev() {
        let late = noise(&mut rng, 0.05);
        motor[k] -= late * (motor[k] - motor[k - 1]);
        table[k] -= late * (table[k] - table[k - 1]);
    }
    let channels = [0, 1, 2, 3].map(|c: usize| record.channels[c].as_deref());
    let read = estimate_noise(&record.torque, &channels, None);
    // A thousand times what the encoders have of their own.
    assert!(read.std[0] > 1e-2, "{read:?}");
    (record.noise, record.common_noise) = (read.std, read.common);
    record.corner = read.corner.map(|c| c / record.dt);
    let o = diagnosed_as(&record, Structure::TwoInertia, Parameters { k: 1500.0, ..stiff });
    let mut effects: Vec<Effect> = o.decision.chosen.terms.iter().map(|t| t.0).collect();
    effects.sort_unstable();
    assert_eq!(effects, [Effect::CoulombMotor, Effect::CoulombTable], "{:#?}", ranking(&o));
    let k = o.improved.parameters.k;
    assert!((k / stiff.k - 1.0).abs() < 0.01, "{k}");
}

#[test]
fn noise_of_1_over_f_on_an_axis_that_hardly_moves_is_no_gap() {
    let paper = Parameters::PAPER;
    let mut record = of_two_inertias(paper, Settings::default(), 2e-3, 0);
    let mut rng = ChaCha8Rng::seed_from_u64(12);
    for c in [0, 2] {
        // Octaves of a random walk that forgets: their sum falls with the frequency.
        let mut octaves = [0.0; 8];
        for y in record.channels[c].iter_mut().flatten() {
            for (i, octave) in octaves.iter_mut().enumerate() {
                let forgets = 0.5_f64.powi(i as i32);
                *octave += forgets.sqrt() * noise(&mut rng, 1e-3) - forgets * *octave;
            }
            *y += octaves.iter().sum::<f64>();
        }
    }
    let channels = [0, 1, 2, 3].map(|c: usize| record.channels[c].as_deref());
    let read = estimate_noise(&record.torque, &channels, None);
    (record.noise, record.common_noise) = (read.std, read.common);
    record.corner = read.corner.map(|c| c / record.dt);
    let o = diagnosed_as(&record, Structure::TwoInertia, paper);
    assert!(matches!(o.decision.verdict, Verdict::NoGap | Verdict::Parameters), "{:?}", o.decision.verdict);
    // What is left is the noise, of its colour.
    let left = o.diagnosis.remainder.noise_multiple;
    assert!((0.8..1.3).contains(&left), "{left}");
}

#[test]
fn of_two_large_causes_both_are_found() {
    let hidden = [
        (Effect::ExternalSpring, 0, 0.02),
        (Effect::ExternalSpring, 1, -1.0),
        (Effect::TorqueRipple, 0, 0.05),
        (Effect::TorqueRipple, 1, 4.0),
        (Effect::TorqueRipple, 2, 0.6),
    ];
    let paper = Parameters::PAPER;
    let o = diagnosed_as(&of_two_inertias(paper, with(&hidden), 0.05, 0), Structure::TwoInertia, paper);
    assert_eq!(named(&o), ["external_spring", "torque_ripple"], "{:#?}", ranking(&o));
}

#[test]
fn inertias_whose_sum_alone_slow_motion_shows_are_told_apart_by_the_little_that_it_shows_of_each() {
    let screw = Parameters { i1: 1.63e-3, i2: 9.4e-4, b: 0.038, k: 449.0, rho: 1.0 };
    let nominal = Parameters { i1: 0.72 * screw.i1, i2: 1.1 * screw.i2, k: 0.87 * screw.k, ..screw };
    let o = diagnosed_as(&of_two_inertias(screw, Settings::default(), 0.7, 0), Structure::TwoInertia, nominal);
    assert_eq!(o.decision.verdict, Verdict::Parameters, "{:#?}", ranking(&o));
    let found = o.models[1].parameters;
    let off = [found.i1 / screw.i1, found.i2 / screw.i2, found.k / screw.k].map(|r| (r - 1.0).abs());
    assert!(off.iter().all(|o| *o < 0.03), "{off:?}");
    // The mean of some 150 squares is 1 within two of its standard deviations, sqrt(2/150).
    assert!(o.diagnosis.remainder.noise_multiple.powi(2) < 1.23, "{:?}", o.diagnosis.remainder);
}

#[test]
fn the_common_factor_of_all_at_the_table_is_found_beside_its_friction() {
    // The table's equation knows no torque but by this factor, and itself a hundred times better than the motor's knows the factor.
    let screw = Parameters { i1: 1.63e-3, i2: 9.4e-4, b: 0.038, k: 449.0, rho: 1.0 };
    let nominal = Parameters { i2: 0.8 * screw.i2, b: 0.8 * screw.b, k: 0.8 * screw.k, ..screw };
    let friction = with(&[(Effect::CoulombTable, 0, 0.15), (Effect::ViscousMotor, 0, 0.01)]);
    let o = diagnosed_as(&of_two_inertias(screw, friction, 0.7, 0), Structure::TwoInertia, nominal);
    assert_eq!(named(&o), ["dry_friction", "viscous_friction"], "{:#?}", ranking(&o));
    let found = o.improved.parameters;
    let level = o.improved.effects.of(Effect::CoulombTable)[0] / 0.15;
    let off = [found.i2 / screw.i2, found.k / screw.k, level].map(|r| (r - 1.0).abs());
    assert!(off.iter().all(|o| *o < 3e-3), "{off:?}");
}

/// A motor with a third inertia on a spring, which swings from the record's first sample on where it is `plucked`.
fn with_a_mode(plucked: bool) -> Record {
    let mode = with(&[(Effect::MotorMode, 0, 0.7), (Effect::MotorMode, 1, 0.7 * 4900.0), (Effect::MotorMode, 2, 1.0)]);
    let axis = Axis::new(parameters(INERTIA), Structure::Rigid, mode, Scheme::Exact, DT);
    let mut state = axis.state(0.0, 0.0, 0.0, 0.0, 0.0);
    let mut rng = ChaCha8Rng::seed_from_u64(13);
    let acts = |t: f64| 3.0 * (4.0 * t).sin() + 2.0 * (9.0 * t + 1.0).cos() + 2.0 * (23.0 * t).sin() + (60.0 * t).cos();
    let before = if plucked { 140 } else { 0 };
    let (mut torque, mut theta) = (Vec::new(), Vec::new());
    for k in 0..before + 500 {
        let t = DT * f64::from(k);
        // A blow just before the record begins.
        let held = if k < before { if k + 12 > before { 40.0 } else { 0.0 } } else { acts(t) };
        if k >= before {
            torque.push(held);
            theta.push(state.theta1() + noise(&mut rng, 1e-6));
        }
        state = axis.advance(&state, Ramp { start: held, end: held }, t);
    }
    of_one_encoder(DT * f64::from(before), torque, theta)
}

#[test]
fn a_mode_that_swings_when_a_short_record_begins_is_no_sine_beside_it() {
    for plucked in [false, true] {
        let o = diagnosed(&with_a_mode(plucked), INERTIA);
        assert_eq!(named(&o), ["flexible_mode"], "{plucked} {:#?}", ranking(&o));
        let mode = o.improved.effects.of(Effect::MotorMode);
        let frequency = (mode[1] / mode[0]).sqrt();
        assert!((frequency / 70.0 - 1.0).abs() < 0.02, "{plucked} {frequency}");
    }
}

#[test]
fn a_log_read_early_is_followed_with_the_torque_to_come() {
    // Read 1.3 samples after its stamp: coasting there is off by half the acceleration times the square of that time.
    let (early, n) = (1.3 * DT, 400);
    let torque = |k: usize| [1.0, -2.0, 0.5, 3.0][k / 7 % 4];
    let axis = |h: f64| Axis::new(parameters(INERTIA), Structure::Rigid, Settings::default(), Scheme::Exact, h);
    let (to_reading, on) = (axis(early - DT), axis(2.0 * DT - early));
    let held = |k: usize| Ramp { start: torque(k), end: torque(k) };
    // A sample is read within the interval after the next one.
    let mut state = axis(DT).advance(&axis(DT).state(0.0, 0.0, 0.0, 0.0, 0.0), held(0), 0.0);
    let mut theta = Vec::new();
    for k in 0..n {
        let read = to_reading.advance(&state, held(k + 1), 0.0);
        theta.push(read.theta1());
        state = on.advance(&read, held(k + 1), 0.0);
    }
    let record = Record {
        start: 0.0,
        dt: DT,
        hold: Hold::Zoh,
        torque: (0..n).map(torque).collect(),
        between: None,
        channels: [Some(theta), None, None, None],
        noise: [1e-9; 4],
        corner: [0.0; 2],
        common_noise: 0.0,
        settling: 0.0,
        idle: Vec::new(),
    };
    let lacks = |delay: f64| {
        let latch = with(&[(Effect::Latch, 0, delay)]);
        let model = Model::new(parameters(INERTIA), Structure::Rigid, latch);
        let tracked = track(&model, &record, [2.0; 2], Resolution::Full).expect("finite");
        tracked.torque[0][50..n - 50].iter().fold(0.0, |m: f64, t| m.max(t.abs()))
    };
    // What is left is the error of the speed at the record's begin, which the feedback takes out.
    assert!(lacks(-early) < 1e-3, "{}", lacks(-early));
    assert!(lacks(-early + 0.1 * DT) > 0.1, "{}", lacks(-early + 0.1 * DT));
}
