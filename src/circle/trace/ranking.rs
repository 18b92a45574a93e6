//! The deviations of a trace, each in its size and by what the circularity loses without it.

use std::collections::{BTreeMap, BTreeSet};
use std::f64::consts::TAU;

use super::deviation::{Effect, Kind};
use super::fit::Fit;
use super::reversals::{self, Reversal};
use super::shapes::{Axis, Shape, known};
use super::tones::{Scan, Tone};
use super::{Point, Turn, points, remainder, wrapped};
use crate::circle::Path;
use crate::circle::roundness::SHOWN;
use crate::circle::roundness::{Roundness, bidirectional};

/// Most points of a turn that are worked on; a longer trace is averaged over groups of neighbours.
const MOST: usize = 7200;
/// Most cyclic errors along one axis, and most vibrations.
const TONES: usize = 2;
/// A tone below this share of the circularity is left to the remainder.
const MATERIAL: f64 = 0.01;

/// What a trace shows.
#[derive(Debug, Clone, PartialEq)]
pub struct Analysis {
    /// The deviations, that of the largest weight first; the remainder among them.
    pub effects: Vec<Effect>,
    /// The circularity they are shares of, m: bi-directional with two directions.
    pub circularity: f64,
    /// Standard deviation of what is left, m.
    pub left: f64,
    /// Mean radial deviation, m.
    pub mean: f64,
    /// The turns as they were worked on.
    pub turns: Vec<Turn>,
    /// The sum of all deviations but the remainder, at the points of the turns, m.
    pub model: Vec<Vec<f64>>,
}

/// Takes a trace apart. `feed` in m/s gives times and frequencies. None where there are too few points to determine the
/// shapes.
#[must_use]
pub fn analyse(turns: &[Turn], radius: f64, feed: Option<f64>) -> Option<Analysis> {
    let turns: Vec<Turn> = turns.iter().map(thinned).collect();
    let both = turns.iter().any(|t| t.clockwise) && turns.iter().any(|t| !t.clockwise);
    let all = points(&turns);
    let start = known(both);
    if all.len() < 8 * start.len() {
        return None;
    }
    let whole = circularity(&turns, radius, &vec![0.0; all.len()])?;
    let mut stretches = reversals::find(&all, turns.len());
    let mut fit = Fit::of(&all, &reversals::outside(&all, &stretches), start.clone())?;
    // A stretch that has grown changes the fit, which may make another grow.
    for _ in 0..4 {
        if !reversals::extend(&all, &fit.residual(&all), &mut stretches) {
            break;
        }
        fit = Fit::of(&all, &reversals::outside(&all, &stretches), start.clone())?;
    }
    let keep = reversals::outside(&all, &stretches);
    let mut tones: Vec<Tone> = Vec::new();
    while tones.len() < 3 * TONES {
        let residual = fit.residual(&all);
        let Some(tone) = Scan::new(&all, &keep, &residual).strongest(&tones) else { break };
        let alike = |t: &Tone| match (*t, tone) {
            (Tone::Cyclic(a, _), Tone::Cyclic(b, _)) => a == b,
            (Tone::Line(_), Tone::Line(_)) => true,
            _ => false,
        };
        if tones.iter().filter(|t| alike(t)).count() >= TONES {
            break;
        }
        let shapes = fit.shapes.iter().copied().chain(tone.shapes(turns.len())).collect();
        let Some(with) = Fit::of(&all, &keep, shapes) else { break };
        if amplitude(&with, tone, turns.len()).0 < SHOWN.max(MATERIAL * whole) {
            break;
        }
        fit = with;
        tones.push(tone);
        refine_tones(&all, &keep, &mut fit, &mut tones, &start, turns.len());
    }
    let trace = Trace { all, turns, radius, feed, fit, stretches, keep, whole };
    Some(trace.apart(&tones))
}

/// Rounds in which the frequencies are refined with the known shapes in the fit, which had taken a part of each tone.
const ROUNDS: usize = 3;

/// Moves each tone to where it fits best together with all other shapes.
fn refine_tones(all: &[Point], keep: &[bool], fit: &mut Fit, tones: &mut [Tone], start: &[Shape], turns: usize) {
    for _ in 0..ROUNDS {
        for k in 0..tones.len() {
            let own = tones[k].shapes(turns);
            let rest: Vec<f64> = all.iter().map(|p| p.deviation - fit.at(p, |s| !own.contains(&s))).collect();
            tones[k] = Scan::new(all, keep, &rest).at_maximum(tones[k]);
            let shapes = start.iter().copied().chain(tones.iter().flat_map(|t| t.shapes(turns))).collect();
            if let Some(moved) = Fit::of(all, keep, shapes) {
                *fit = moved;
            }
        }
    }
}

/// Averages groups of neighbours where a turn has more points than are needed.
fn thinned(turn: &Turn) -> Turn {
    let group = turn.angle.len().div_ceil(MOST).max(1);
    if group == 1 {
        return turn.clone();
    }
    let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len() as f64;
    let angle = turn
        .angle
        .chunks(group)
        .map(|c| wrapped(c[0] + mean(&c.iter().map(|a| wrapped(a - c[0])).collect::<Vec<_>>())));
    Turn {
        clockwise: turn.clockwise,
        angle: angle.collect(),
        deviation: turn.deviation.chunks(group).map(mean).collect(),
    }
}

/// The circularity of the turns less what is taken out of each point.
fn circularity(turns: &[Turn], radius: f64, out: &[f64]) -> Option<f64> {
    let mut rest = out;
    let mut paths: Vec<Path> = Vec::with_capacity(turns.len());
    for turn in turns {
        let (mine, others) = rest.split_at(turn.angle.len());
        rest = others;
        let deviation = turn.deviation.iter().zip(mine).map(|(d, o)| d - o).collect();
        paths.push(Turn { deviation, ..turn.clone() }.path(radius));
    }
    match <[Path; 2]>::try_from(paths) {
        Ok(two) => bidirectional(&two),
        Err(one) => Roundness::of(one.first()?, radius).map(|r| r.deviation),
    }
}

/// Amplitude of a tone and its standard error: of a line the root of the mean square over the turns.
fn amplitude(fit: &Fit, tone: Tone, turns: usize) -> (f64, f64) {
    let parts: Vec<(f64, f64)> = tone.shapes(turns).into_iter().map(|s| fit.of_shape(s)).collect();
    let pairs = (parts.len() / 2).max(1) as f64;
    let size = (parts.iter().map(|(c, _)| c * c).sum::<f64>() / pairs).sqrt();
    let error = (parts.iter().map(|(_, e)| e * e).sum::<f64>() / parts.len().max(1) as f64 / pairs).sqrt();
    (size, error)
}

/// A trace with its fit.
struct Trace {
    all: Vec<Point>,
    turns: Vec<Turn>,
    radius: f64,
    feed: Option<f64>,
    fit: Fit,
    stretches: Vec<Reversal>,
    keep: Vec<bool>,
    whole: f64,
}

impl Trace {
    /// The deviation that some shapes cause at each point, m.
    fn made(&self, wanted: impl Fn(Shape) -> bool + Copy) -> Vec<f64> {
        self.all.iter().map(|p| self.fit.at(p, wanted)).collect()
    }

    /// An effect that is these values at the points.
    fn effect(&self, kind: Kind, (size, error): (f64, f64), made: &[f64]) -> Effect {
        let without = circularity(&self.turns, self.radius, made).unwrap_or(self.whole);
        Effect {
            kind,
            size,
            error: Some(error),
            without,
            contribution: self.whole - without,
            pair: None,
            ends: None,
            heights: Vec::new(),
            pitch: None,
            per_turn: None,
            frequency: None,
            late: None,
        }
    }

    fn apart(self, tones: &[Tone]) -> Analysis {
        let n = self.all.len();
        let of = |shape: Shape| self.fit.of_shape(shape);
        let scaled = |(c, e): (f64, f64), by: f64| (c * by, e * by.abs());
        let both = self.fit.shapes.contains(&Shape::Servo);
        let mut effects = Vec::new();
        // The sum of all deviations at each point.
        let mut model = vec![0.0; n];
        let mut pairs: BTreeMap<&'static str, Vec<f64>> = BTreeMap::new();
        let mut add = |effects: &mut Vec<Effect>, effect: Effect, made: &[f64]| {
            model.iter_mut().zip(made).for_each(|(m, v)| *m += v);
            if let Some(both) = effect.kind.of_both() {
                let sum = pairs.entry(both).or_insert_with(|| vec![0.0; n]);
                sum.iter_mut().zip(made).for_each(|(m, v)| *m += v);
            }
            effects.push(effect);
        };

        let parts: Vec<_> = self.stretches.iter().map(|r| (r, reversals::parts(&self.all, &self.fit, r))).collect();
        for axis in Axis::ALL {
            let mut made = self.made(|s| matches!(s, Shape::Backlash(a, _) if a == axis));
            let mut spikes = vec![0.0; n];
            let mut heights = vec![[0.0; 4]; self.turns.len()];
            for (r, part) in parts.iter().filter(|(r, _)| r.axis() == axis) {
                heights[r.turn][r.quarter] = part.height;
                for (((i, _), play), spike) in r.members.iter().zip(&part.play).zip(&part.spike) {
                    made[*i] = *play;
                    spikes[*i] = *spike;
                }
            }
            let [plus, minus] = [true, false].map(|end| of(Shape::Backlash(axis, end)));
            let mean = (0.5 * (plus.0 + minus.0), 0.5 * plus.1.hypot(minus.1));
            let effect = Effect { ends: Some([plus.0, minus.0]), ..self.effect(Kind::Backlash(axis), mean, &made) };
            add(&mut effects, effect, &made);
            let largest = heights.iter().flatten().fold(0.0_f64, |h, v| if v.abs() > h.abs() { *v } else { h });
            let effect = Effect { heights, error: None, ..self.effect(Kind::Spikes(axis), (largest, 0.0), &spikes) };
            add(&mut effects, effect, &spikes);
        }

        let made = self.made(|s| s == Shape::Squareness);
        let effect = if both {
            // d = phi*R/2*sin(2a) for axes that enclose pi/2 - phi.
            self.effect(Kind::Squareness, scaled(of(Shape::Squareness), -2.0 / self.radius), &made)
        } else {
            self.effect(Kind::Diagonal, of(Shape::Squareness), &made)
        };
        add(&mut effects, effect, &made);
        let made = self.made(|s| s == Shape::Scaling);
        let effect = self.effect(Kind::Scaling, scaled(of(Shape::Scaling), 2.0 / self.radius), &made);
        add(&mut effects, effect, &made);
        if both {
            let made = self.made(|s| s == Shape::Servo);
            let late = self.feed.map(|v| 2.0 * of(Shape::Servo).0 / v);
            let effect = Effect { late, ..self.effect(Kind::Servo, of(Shape::Servo), &made) };
            add(&mut effects, effect, &made);
        }
        for axis in Axis::ALL {
            if both {
                let made = self.made(|s| s == Shape::Lateral(axis));
                let effect = self.effect(Kind::Lateral(axis), of(Shape::Lateral(axis)), &made);
                add(&mut effects, effect, &made);
            }
            let made = self.made(|s| s == Shape::Straightness(axis));
            let effect = self.effect(Kind::Straightness(axis), of(Shape::Straightness(axis)), &made);
            add(&mut effects, effect, &made);
        }
        for tone in tones {
            let shapes = tone.shapes(self.turns.len());
            let made: Vec<f64> = self.all.iter().map(|p| self.fit.at(p, |s| shapes.contains(&s))).collect();
            let size = amplitude(&self.fit, *tone, self.turns.len());
            let effect = match *tone {
                Tone::Cyclic(axis, f) => {
                    Effect { pitch: Some(self.radius / f), ..self.effect(Kind::Cyclic(axis), size, &made) }
                }
                Tone::Line(f) => Effect {
                    per_turn: Some(f),
                    frequency: self.feed.map(|v| f * v / (TAU * self.radius)),
                    ..self.effect(Kind::Vibration, size, &made)
                },
            };
            add(&mut effects, effect, &made);
        }

        let frame = self.made(|s| matches!(s, Shape::Mean | Shape::Centre(_)));
        let mut left: Vec<f64> = (0..n).map(|i| self.all[i].deviation - frame[i] - model[i]).collect();
        for (axis, (rms, made)) in Axis::ALL.into_iter().zip(remainder::stick_slip(&self.all, &self.keep, &left)) {
            let effect = Effect { error: None, ..self.effect(Kind::StickSlip(axis), (rms, 0.0), &made) };
            left.iter_mut().zip(&made).for_each(|(l, v)| *l -= v);
            effects.push(effect);
        }
        let rms = (left.iter().map(|l| l * l).sum::<f64>() / n as f64).sqrt();
        effects.push(Effect { error: None, ..self.effect(Kind::Remainder, (rms, 0.0), &left) });
        for (both, sum) in &pairs {
            let seen =
                |e: &&Effect| e.kind.of_both() == Some(*both) && e.size.abs() > SHOWN.max(2.0 * e.error.unwrap_or(0.0));
            let axes: BTreeSet<&str> = effects.iter().filter(seen).map(|e| e.kind.id()).collect();
            if axes.len() == 2 {
                let taken = self.whole - circularity(&self.turns, self.radius, sum).unwrap_or(self.whole);
                effects.iter_mut().filter(|e| e.kind.of_both() == Some(both)).for_each(|e| e.pair = Some(taken));
            }
        }
        effects.sort_by(|a, b| b.weight().total_cmp(&a.weight()));

        let mut from = 0;
        let cut = |turn: &Turn| {
            let part = from..from + turn.angle.len();
            from = part.end;
            part.map(|i| model[i] + frame[i]).collect()
        };
        Analysis {
            circularity: self.whole,
            left: rms,
            mean: of(Shape::Mean).0,
            model: self.turns.iter().map(cut).collect(),
            turns: self.turns,
            effects,
        }
    }
}
