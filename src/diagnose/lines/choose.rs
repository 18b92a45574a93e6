//! Which linear cause closes the gap at the lines: evidence, materiality, what is alike.

use rayon::prelude::*;

use super::data::{Lines, is_linear};
use super::fit::{Hypothesis, cost_of_noise, fit, standard_errors, together};
use crate::axis::{Parameters, Structure};
use crate::diagnose::decide::DECISIVE;
use crate::diagnose::model::{BaseParameter, Free, Model};
use crate::effects::Effect;

/// Linearisations of a first look at a start, and of a fit that counts.
const GLANCE: usize = 12;
const FULL: usize = 80;
/// Starts that are taken to the end.
const FINALISTS: usize = 2;
/// Share of the gap within which two causes close alike: what a model leaves on a real machine is no noise of a known
/// law, and a tenth of the gap one way or the other is no evidence.
const ALIKE: f64 = 0.1;
/// Share of the gap at the lines that a cause must close to be named.
const CLOSES: f64 = 0.5;
/// Relative error of the re-identified model at the lines below which there is no gap to speak of.
const MATERIAL: f64 = 0.1;
/// The re-identified model must cost this many times what the scatter from period to period costs.
const CLEAR: f64 = 4.0;
/// Most causes named at the lines.
const MOST: usize = 2;
/// Starts of a delay or a lag, in sampling intervals.
const TIMES: [f64; 3] = [1.0, 4.0, 12.0];
/// Starts of a third inertia: its share of the inertia that it is split from,
const SHARES: [f64; 2] = [0.1, 0.5];
/// and its frequency, as many over the band.
const FREQUENCIES: usize = 6;

/// What was found at the lines.
#[derive(Debug, Clone)]
pub struct Choice {
    /// The nominal model as given.
    pub given: Hypothesis,
    /// Its parameters fitted to the lines.
    pub base: Hypothesis,
    /// Base with the causes named.
    pub chosen: Hypothesis,
    /// Every hypothesis with its BIC and probability, best first.
    pub ranking: Vec<(Hypothesis, f64, f64)>,
    /// Share of the gap of each cause.
    pub shares: Vec<f64>,
    /// Pairs that close alike: the cause named, the other, difference of BIC, share of the gap that the other closes.
    pub alike: Vec<(Effect, Effect, f64, f64)>,
    /// Share of the gap at the lines that closes, from the re-identified model.
    pub closure: f64,
}

/// Linear effects that may be named; friction takes part in the comparison, but is named by the decision in time alone:
/// at the lines any loss looks like it.
const fn nameable(effect: Effect) -> bool {
    !matches!(effect, Effect::ViscousMotor | Effect::ViscousTable)
}

fn applies(effect: Effect, lines: &Lines, nominal: &Model) -> bool {
    let rigid = nominal.structure == Structure::Rigid;
    let fits = match effect {
        Effect::SensorDelay => !rigid && lines.channels.len() == 2,
        Effect::ViscousTable => !rigid,
        _ => true,
    };
    is_linear(effect) && fits && !nominal.effects.is_on(effect)
}

/// Looks for a linear cause; `None` when there is no gap at the lines or nothing that may be named closes it.
#[must_use]
pub fn choose(lines: &Lines, nominal: &Model, suspects: &[Effect]) -> Option<Choice> {
    let free: Vec<Free> = BaseParameter::of(nominal.structure).iter().map(|p| Free::Base(*p)).collect();
    let given = Hypothesis::fixed(lines, nominal);
    let mut starts = vec![*nominal];
    starts.extend(guessed(lines, nominal));
    let base = best(lines, &starts, &free, &[])?;
    let noise = cost_of_noise(lines, &base.model);
    if lines.relative_error(&base.model) < MATERIAL || base.cost < CLEAR * noise {
        return None;
    }
    let mut all = vec![given.clone(), base.clone()];
    let mut chain = vec![base.clone()];
    let mut alike: Vec<Vec<(Hypothesis, f64)>> = Vec::new();
    while chain.len() <= MOST {
        let before = &chain[chain.len() - 1];
        let round = one_more(lines, nominal, before, &free, &starts, suspects);
        let closed = |h: &Hypothesis| closure(before.cost, h.cost, noise);
        let most = round.first().map_or(0.0, &closed);
        let near: Vec<&Hypothesis> = round.iter().filter(|h| most - closed(h) < ALIKE).collect();
        // Of those that close alike the one with the fewest numbers, then the one that closes most.
        let by_size = |a: &&&Hypothesis, b: &&&Hypothesis| {
            a.coordinates.len().cmp(&b.coordinates.len()).then(a.cost.total_cmp(&b.cost))
        };
        let Some(next) = near.iter().min_by(by_size).map(|h| (*h).clone()) else { break };
        let found = nameable(newest(&next)) && closed(&next) >= CLOSES;
        if found {
            let others = near.iter().filter(|h| newest(h) != newest(&next));
            alike.push(others.map(|h| ((*h).clone(), closed(h))).collect());
        }
        all.extend(round);
        if !found {
            break;
        }
        chain.push(next);
    }
    // The noise is what the last of them leaves; each must be decisive against it.
    let last = &chain[chain.len() - 1];
    let values = values(lines, &last.model);
    let floor = all.iter().map(|h| h.cost).fold(last.cost, f64::min).max(noise);
    let score = |h: &Hypothesis| bic(h, floor, values);
    let decisive = chain.windows(2).take_while(|w| score(&w[0]) - score(&w[1]) > DECISIVE).count();
    let mut chosen = chain[decisive].clone();
    if decisive == 0 {
        return None;
    }
    let alike = chain[1..=decisive]
        .iter()
        .zip(&alike)
        .flat_map(|(named, others)| {
            let score = &score;
            others.iter().map(move |(h, closed)| (newest(named), newest(h), score(h) - score(named), *closed))
        })
        .collect();
    let count = together(lines, &chosen.model);
    standard_errors(lines, &mut chosen, count);
    all.retain(|h| h.effects.len() < 2 || h.effects == chosen.effects);
    let shares = shares(lines, &chosen, &base, &all);
    let closure = closure(base.cost, chosen.cost, noise);
    Some(Choice { given, base, chosen, ranking: rank(all, floor, values), shares, alike, closure })
}

/// The effect that a hypothesis added last.
fn newest(h: &Hypothesis) -> Effect {
    h.effects.last().copied().unwrap_or(Effect::ViscousMotor)
}

/// Share of a cost above the noise's that is gone.
fn closure(from: f64, to: f64, noise: f64) -> f64 {
    1.0 - (to - noise).max(0.0) / (from - noise).max(f64::MIN_POSITIVE)
}

/// Number of values that count as independent: two parts of each complex error.
fn values(lines: &Lines, model: &Model) -> f64 {
    (2.0 * (lines.len() * lines.channels.len()) as f64 / together(lines, model)).max(2.0)
}

fn bic(h: &Hypothesis, floor: f64, values: f64) -> f64 {
    values * h.cost / floor + h.coordinates.len() as f64 * values.ln()
}

/// Parameters that the response suggests, and those with the nominal effects.
fn guessed(lines: &Lines, nominal: &Model) -> Option<Model> {
    let two = nominal.structure == Structure::TwoInertia;
    lines.guess.filter(|_| two).map(|parameters| Model { parameters, ..*nominal })
}

/// The best fit over the starts: a first look at each, the best taken to the end.
fn best(lines: &Lines, starts: &[Model], free: &[Free], effects: &[Effect]) -> Option<Hypothesis> {
    let mut looks: Vec<Hypothesis> = starts.iter().map(|s| fit(lines, s, free, effects, GLANCE)).collect();
    looks.retain(|h| h.cost.is_finite());
    looks.sort_by(|a, b| a.cost.total_cmp(&b.cost));
    looks.truncate(FINALISTS);
    looks
        .iter()
        .map(|h| fit(lines, &h.model, free, effects, FULL))
        .filter(|h| h.cost.is_finite())
        .min_by(|a, b| a.cost.total_cmp(&b.cost))
}

/// Every linear effect beside those found, best first.
fn one_more(
    lines: &Lines,
    nominal: &Model,
    beside: &Hypothesis,
    base: &[Free],
    origins: &[Model],
    suspects: &[Effect],
) -> Vec<Hypothesis> {
    let candidates: Vec<Effect> =
        suspects.iter().copied().filter(|e| applies(*e, lines, nominal) && !beside.effects.contains(e)).collect();
    let mut found: Vec<Hypothesis> = candidates
        .par_iter()
        .filter_map(|&effect| {
            let effects: Vec<Effect> = beside.effects.iter().copied().chain([effect]).collect();
            let mut free = base.to_vec();
            free.extend(effects.iter().flat_map(|e| {
                (0..e.info().variants[0].free.len()).map(|i| Free::Effect(*e, e.info().variants[0].free[i]))
            }));
            // What the parameters were refitted to without the effect leans against it.
            let origins = origins
                .iter()
                .map(|o| Model { effects: beside.model.effects, ..*o })
                .filter(|_| beside.effects.is_empty());
            let starts: Vec<Model> =
                std::iter::once(beside.model).chain(origins).flat_map(|m| starts(lines, &m, effect)).collect();
            best(lines, &starts, &free, &effects)
        })
        .collect();
    found.sort_by(|a, b| a.cost.total_cmp(&b.cost));
    found
}

/// Starts of an effect on a model.
fn starts(lines: &Lines, model: &Model, effect: Effect) -> Vec<Model> {
    let with = |values: &[f64], parameters: Parameters| {
        let mut m = Model { parameters, ..*model };
        m.effects.of_mut(effect)[..values.len()].copy_from_slice(values);
        m
    };
    let p = model.parameters;
    match effect {
        Effect::FlexibleMode => {
            let rigid = model.structure == Structure::Rigid;
            let whole = if rigid { p.i1 } else { p.i2 };
            let [low, high] = lines.band();
            let frequency = |i: usize| low * (high / low).powf((i as f64 + 0.5) / FREQUENCIES as f64);
            let place = |share: f64, i: usize| {
                let (inertia, left) = (share * whole, (1.0 - share) * whole);
                let together = inertia * left / (inertia + left);
                let w = std::f64::consts::TAU * frequency(i);
                let stiffness = together * w * w;
                let parameters = if rigid { Parameters { i1: left, ..p } } else { Parameters { i2: left, ..p } };
                // Three per cent of the critical damping.
                with(&[inertia, stiffness, 0.06 * together * w], parameters)
            };
            SHARES.iter().flat_map(|s| (0..FREQUENCIES).map(move |i| (*s, i))).map(|(s, i)| place(s, i)).collect()
        }
        Effect::ViscousMotor | Effect::ViscousTable => {
            let [low, high] = lines.band();
            // As much as the inertia in the middle of the band.
            vec![with(&[0.1 * (p.i1 + p.i2) * std::f64::consts::TAU * (low * high).sqrt()], p)]
        }
        _ => TIMES.iter().map(|t| with(&[t * lines.dt], p)).collect(),
    }
}

/// How much of the gap comes back without each cause.
fn shares(lines: &Lines, chosen: &Hypothesis, base: &Hypothesis, all: &[Hypothesis]) -> Vec<f64> {
    if chosen.effects.len() < 2 {
        return vec![1.0; chosen.effects.len()];
    }
    let back: Vec<f64> = chosen
        .effects
        .iter()
        .map(|effect| {
            let keep: Vec<Effect> = chosen.effects.iter().copied().filter(|e| e != effect).collect();
            let mut start = chosen.model;
            start.effects.of_mut(*effect).copy_from_slice(base.model.effects.of(*effect));
            let free: Vec<Free> = chosen
                .coordinates
                .iter()
                .map(|c| c.free)
                .filter(|f| !matches!(f, Free::Effect(e, _) if e == effect))
                .collect();
            let again = fit(lines, &start, &free, &keep, FULL).cost;
            let known = all.iter().filter(|h| h.effects == keep).map(|h| h.cost).fold(f64::INFINITY, f64::min);
            (again.min(known) - chosen.cost).max(0.0)
        })
        .collect();
    let sum: f64 = back.iter().sum::<f64>().max(f64::MIN_POSITIVE);
    back.iter().map(|b| b / sum).collect()
}

fn rank(all: Vec<Hypothesis>, floor: f64, values: f64) -> Vec<(Hypothesis, f64, f64)> {
    let scores: Vec<f64> = all.iter().map(|h| bic(h, floor, values)).collect();
    let best = scores.iter().copied().fold(f64::INFINITY, f64::min);
    let sum: f64 = scores.iter().map(|s| (-0.5 * (s - best)).exp()).sum();
    let mut ranking: Vec<_> =
        all.into_iter().zip(scores).map(|(h, s)| (h, s, (-0.5 * (s - best)).exp() / sum)).collect();
    ranking.sort_by(|a, b| a.1.total_cmp(&b.1));
    ranking
}
