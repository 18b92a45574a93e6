//! Records made by the axis' own step, rigid ones under control: what a drive's log looks like.

mod along_motion;
mod coupled;
mod rigid;

use super::assess::{Case, Outcome};
use super::diagnose;
use super::diagnosis::{ClosureOf, Site};
use super::pool::Pool;
use super::prepared::prepared;
use super::search::{Search, decide, decide_further};
use super::verdict::Verdict;
use crate::axis::{Axis, AxisKind, Hold, Parameters, Scheme, Structure};
use crate::conditioning::{NoiseEstimate, Record, estimate_noise};
use crate::effects::{EFFECTS, Effect, Family, Ramp, Settings};
use crate::hypothesis::band::Reach;
use crate::hypothesis::fit::{Fit, STEPS, Term};
use crate::hypothesis::likelihood::{C, TorqueResidual};
use crate::hypothesis::model::{Free, Model};
use crate::hypothesis::problem::{Problem, Work};
use crate::hypothesis::scales::Scales;
use crate::hypothesis::tracking::{steps_per_sample, track, track_step_by_step};
use crate::numerics::level::rms;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const INERTIA: f64 = 2.0;
const DT: f64 = 2e-3;
/// Samples of a log.
const SAMPLES: u32 = 6000;

fn parameters(i1: f64) -> Parameters {
    Parameters { i1, i2: 0.0, b: 0.0, k: 0.0, rho: 1.0 }
}

fn noise(rng: &mut ChaCha8Rng, size: f64) -> f64 {
    size * (0..12).map(|_| rng.random_range(-0.5..0.5)).sum::<f64>()
}

/// A record of one encoder with a noise of 1e-6 rad.
fn of_one_encoder(start: f64, torque: Vec<f64>, theta: Vec<f64>) -> Record {
    Record { start, noise: [1e-6; 4], ..Record::new(DT, Hold::Zoh, torque, [Some(theta), None, None, None]) }
}

/// A record of moves to and fro under a position controller; `foreign` is a torque that no model knows of.
fn logged(effects: Settings, amplitude: f64, torque_noise: f64, foreign: impl Fn(f64) -> f64, seed: u64) -> Record {
    let wanted = |t: f64| amplitude * ((0.9 * t).sin() + 0.35 * (2.3 * t).sin() * (1.0 - (-t).exp()));
    led(SAMPLES, wanted, effects, torque_noise, foreign, seed)
}

/// The same of `n` samples along any way.
fn led(
    n: u32,
    wanted: impl Fn(f64) -> f64,
    effects: Settings,
    torque_noise: f64,
    foreign: impl Fn(f64) -> f64,
    seed: u64,
) -> Record {
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

/// The diagnosis by the library without the effects of these families.
fn diagnosed_without(families: &[Family], record: &Record, structure: Structure, nominal: Parameters) -> Outcome {
    let channels = [0, 1, 2, 3].map(|c: usize| record.channels[c].as_deref());
    let noise = estimate_noise(&record.torque, &channels, None);
    let mut case = case(record, Model::new(nominal, structure, Settings::default()), &noise);
    case.suspects.retain(|e| !families.contains(&e.info().family));
    let o = diagnose(&case, &|_| ());
    // What stays open is not named as a cause.
    if let Some(open) = &o.diagnosis.undecided {
        let is_named = o.diagnosis.causes.iter().any(|c| open.effects.contains(&c.effect));
        assert!(!open.effects.is_empty() && !is_named, "{:?} beside {:?}", open.effects, named(&o));
    }
    o
}

fn diagnosed_as(record: &Record, structure: Structure, nominal: Parameters) -> Outcome {
    diagnosed_without(&[], record, structure, nominal)
}

fn diagnosed(record: &Record, inertia: f64) -> Outcome {
    diagnosed_as(record, Structure::Rigid, parameters(inertia))
}

fn named(o: &Outcome) -> Vec<&'static str> {
    let mut ids: Vec<&str> = o.decision.chosen.terms.iter().map(|(e, _)| e.info().family.as_str()).collect();
    ids.sort_unstable();
    ids
}

/// What was tried, for a test that fails.
fn ranking(o: &Outcome) -> Vec<(String, f64, Vec<Vec<f64>>)> {
    let line = |w: &super::weighing::Weighed| {
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
