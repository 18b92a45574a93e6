//! The gap in figures, three ways: by the model's own free run, in windows, and in torque.
//!
//! A *free run* starts once, at the state of the record's beginning, and follows the torque alone to the end, as the FMU would. In
//! *windows* the model starts anew every half thousand samples, from states fitted to each window. In *torque* it is held to the
//! measured motion, and what it lacks is counted ([`super::tracking`]). All three models have the same freedom in each.

use nalgebra::{DMatrix, DVector, Vector4};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use super::super::diagnosis::{ClosureOf, Figures, Levels};
use super::super::model::Model;
use super::super::record::{CHANNELS, Record};
use super::tracking::{Run, start_states};

/// Samples in a window.
const WINDOW: usize = 512;
/// Windows at most: a longer record is sampled by so many, spread evenly.
const MOST: usize = 32;
/// Resamplings of the block bootstrap.
const RESAMPLINGS: usize = 400;
/// Its seed: the interval is the same from run to run.
const SEED: u64 = 20_060_718;
/// Error of a free run, as a share of the signal, up to which it says more than how fast a model drifts away.
const FOLLOWS: f64 = 0.5;

/// Squared errors by channel, summed over some samples.
type Errors = Vector4<f64>;

/// The three models' errors on one record.
#[derive(Debug, Clone)]
pub struct Gap {
    /// What the figures are of.
    pub of: ClosureOf,
    /// Figures for people.
    pub figures: Figures,
    /// Closure of the gap from the model as given.
    pub closure: f64,
    /// Closure from the re-identified model.
    pub closure_of_effect: f64,
    /// 95 % interval of `closure`.
    pub interval: [f64; 2],
    /// The models' readings: as given, and at its best.
    pub runs: [Vec<[f64; 4]>; 2],
    /// Samples that the runs cover.
    pub covered: Vec<std::ops::Range<usize>>,
    /// State of the best model at the record's first sample.
    pub initial: [f64; 4],
}

/// Runs of a model over pieces of the record, each from a state fitted to it.
struct Pieces {
    ranges: Vec<std::ops::Range<usize>>,
    readings: Vec<Vec<[f64; 4]>>,
    errors: Vec<Errors>,
    initial: [f64; 4],
}

/// Measures the gap of the model as given, re-identified and improved: by the free run where that follows, else in windows.
#[must_use]
pub fn measure(record: &Record, models: &[Model; 3]) -> Gap {
    let whole = std::iter::once(0..record.len()).collect::<Vec<_>>();
    let free: Vec<Pieces> = models.par_iter().map(|m| pieces(record, m, &whole)).collect();
    let of_free = gap(record, &free, ClosureOf::FreeRun);
    if of_free.figures.combined.after < FOLLOWS {
        // The interval needs more than one piece: errors of the free run by window.
        return of_free;
    }
    let cut = windows(record.len());
    let shot: Vec<Pieces> = models.par_iter().map(|m| pieces(record, m, &cut)).collect();
    gap(record, &shot, ClosureOf::Windows)
}

/// Windows of the record, at most [`MOST`].
fn windows(n: usize) -> Vec<std::ops::Range<usize>> {
    let count = (n / WINDOW).max(1);
    let all = |w: usize| w * n / count..(w + 1) * n / count;
    if count <= MOST { (0..count).map(all).collect() } else { (0..MOST).map(|i| all(i * count / MOST)).collect() }
}

fn pieces(record: &Record, model: &Model, ranges: &[std::ops::Range<usize>]) -> Pieces {
    let begins: Vec<usize> = ranges.iter().map(|r| r.start).collect();
    let starts = start_states(model, record, &begins);
    let done: Vec<(Vec<[f64; 4]>, [f64; 4])> =
        ranges.par_iter().zip(&starts).map(|(range, start)| settled(record, model, range, start)).collect();
    let mut errors = Vec::new();
    let mut of = Vec::new();
    for (range, (readings, _)) in ranges.iter().zip(&done) {
        // A long piece is counted in parts, for the interval.
        let parts = (range.len() / WINDOW).max(1);
        for p in 0..parts {
            let part = p * range.len() / parts..(p + 1) * range.len() / parts;
            let mut e = Errors::zeros();
            for k in part.clone() {
                for (c, channel) in record.channels.iter().enumerate() {
                    if let Some(channel) = channel {
                        e[c] += (readings[k][c] - channel[range.start + k]).powi(2);
                    }
                }
            }
            errors.push(e);
            of.push(range.start + part.start..range.start + part.end);
        }
    }
    let initial = done.first().map_or([0.0; 4], |d| d.1);
    Pieces { ranges: of, readings: done.into_iter().map(|d| d.0).collect(), errors, initial }
}

/// Steps of Gauss and Newton's method on an initial state: a linear axis needs one.
const SETTLING: usize = 3;

/// The model over a piece, its initial state where the squared error is least.
fn settled(record: &Record, model: &Model, range: &std::ops::Range<usize>, start: &Run) -> (Vec<[f64; 4]>, [f64; 4]) {
    let weight = record.noise.map(|s| 1.0 / s.max(f64::MIN_POSITIVE));
    let present: Vec<usize> = (0..4).filter(|c| record.channels[*c].is_some()).collect();
    let cost = |r: &[[f64; 4]]| -> f64 {
        r.iter()
            .enumerate()
            .map(|(k, r)| {
                present
                    .iter()
                    .map(|&c| {
                        ((record.channels[c].as_ref().map_or(0.0, |y| y[range.start + k]) - r[c]) * weight[c]).powi(2)
                    })
                    .sum::<f64>()
            })
            .sum()
    };
    let rigid = model.structure == crate::axis::Structure::Rigid;
    let free: &[usize] = if rigid { &[0, 1] } else { &[0, 1, 2, 3] };
    let length = range.len() as f64 * record.dt;
    let mut state = start.motion;
    let mut own = start.from(model, record, range, state);
    let mut value = cost(&own);
    for _ in 0..SETTLING {
        let scale = |i: usize| {
            let s = record.noise[i & 2].max(1e-12);
            if i.is_multiple_of(2) { 100.0 * s } else { 100.0 * s / length.min(0.1) }
        };
        let columns: Vec<Vec<[f64; 4]>> = free
            .iter()
            .map(|&i| {
                let mut moved = state;
                moved[i] += scale(i);
                if rigid {
                    moved[2] = moved[0];
                    moved[3] = moved[1];
                }
                start.from(model, record, range, moved)
            })
            .collect();
        let m = free.len();
        let (mut a, mut g) = (DMatrix::<f64>::zeros(m, m), DVector::<f64>::zeros(m));
        for k in 0..own.len() {
            for &c in &present {
                let r = (record.channels[c].as_ref().map_or(0.0, |y| y[range.start + k]) - own[k][c]) * weight[c];
                let row: Vec<f64> = (0..m).map(|i| (columns[i][k][c] - own[k][c]) * weight[c]).collect();
                for i in 0..m {
                    g[i] += row[i] * r;
                    for j in 0..m {
                        a[(i, j)] += row[i] * row[j];
                    }
                }
            }
        }
        let diagonal: Vec<f64> = (0..m).map(|i| a[(i, i)].max(f64::MIN_POSITIVE).sqrt()).collect();
        let scaled =
            DMatrix::from_fn(m, m, |i, j| a[(i, j)] / (diagonal[i] * diagonal[j]) + if i == j { 1e-10 } else { 0.0 });
        let Some(solver) = scaled.cholesky() else { break };
        let step = solver.solve(&DVector::from_fn(m, |i, _| g[i] / diagonal[i]));
        let mut next = state;
        for (p, &i) in free.iter().enumerate() {
            next[i] += step[p] / diagonal[p] * scale(i);
        }
        if rigid {
            next[2] = next[0];
            next[3] = next[1];
        }
        let readings = start.from(model, record, range, next);
        let better = cost(&readings);
        if better.is_nan() || better >= value {
            break;
        }
        let done = value - better < 1e-3 * better;
        (state, own, value) = (next, readings, better);
        if done {
            break;
        }
    }
    (own, state)
}

fn gap(record: &Record, pieces: &[Pieces], of: ClosureOf) -> Gap {
    let ranges = &pieces[0].ranges;
    let counts: f64 = ranges.iter().map(|r| r.len() as f64).sum();
    let present: Vec<usize> = (0..4).filter(|c| record.channels[*c].is_some()).collect();
    let scale: Vec<f64> = (0..4).map(|c| signal_rms(record, c)).collect();
    let total: Vec<Errors> =
        pieces.iter().map(|p| p.errors.iter().fold(Errors::zeros(), |a, b| a + b) / counts).collect();
    let relative = |v: f64, c: usize| finite(v.max(0.0).sqrt() / scale[c].max(f64::MIN_POSITIVE));
    let signals = present
        .iter()
        .map(|&c| {
            let noise_floor = relative(record.noise[c].powi(2), c);
            let levels = Levels {
                before: relative(total[0][c], c),
                reidentified: relative(total[1][c], c),
                after: relative(total[2][c], c),
                noise_floor,
            };
            (CHANNELS[c], levels)
        })
        .collect();
    let weigh = |e: &Errors| present.iter().map(|&c| e[c] / scale[c].max(f64::MIN_POSITIVE).powi(2)).sum::<f64>();
    let combine = |e: f64| finite((e / present.len() as f64).sqrt());
    let floor: f64 = present.iter().map(|&c| record.noise[c].powi(2) / scale[c].max(f64::MIN_POSITIVE).powi(2)).sum();
    let closure_of = |from: &Errors, to: &Errors| closure(weigh(from), weigh(to), floor);
    let [before, reidentified, after] = [0, 1, 2].map(|m| combine(weigh(&total[m])));
    let interval = bootstrap(ranges, pieces, &closure_of);
    let flat = |p: &Pieces| p.readings.iter().flatten().copied().collect();
    Gap {
        of,
        figures: Figures {
            combined: Levels { before, reidentified, after, noise_floor: combine(floor) },
            signals,
            multiples: [0, 1, 2].map(|m| finite((weigh(&total[m]) / floor).sqrt())),
        },
        closure: closure_of(&total[0], &total[2]),
        closure_of_effect: closure_of(&total[1], &total[2]),
        interval,
        runs: [flat(&pieces[0]), flat(&pieces[2])],
        covered: ranges.clone(),
        initial: pieces[2].initial,
    }
}

/// What a page can show: a run that left every bound is a million times off.
fn finite(v: f64) -> f64 {
    if v.is_finite() { v.min(1e6) } else { 1e6 }
}

/// `1 - (after - floor)/(before - floor)` of mean squares; one when there is no gap to close and none is left. A run that leaves every
/// bound closes nothing.
fn closure(before: f64, after: f64, floor: f64) -> f64 {
    if !before.is_finite() || !after.is_finite() {
        return f64::from(u8::from(after.is_finite()));
    }
    let gap = before - floor;
    if gap <= 1e-3 * floor {
        return f64::from(u8::from(after <= before));
    }
    (1.0 - (after - floor).max(0.0) / gap).max(-1e6)
}

/// Block bootstrap (Kunsch, Ann. Statist. 17(3), 1989): 95 % interval of the closure.
fn bootstrap(
    ranges: &[std::ops::Range<usize>],
    pieces: &[Pieces],
    closure_of: &dyn Fn(&Errors, &Errors) -> f64,
) -> [f64; 2] {
    let n = ranges.len();
    let mut rng = ChaCha8Rng::seed_from_u64(SEED);
    let mut values: Vec<f64> = (0..RESAMPLINGS)
        .map(|_| {
            let (mut from, mut to, mut count) = (Errors::zeros(), Errors::zeros(), 0.0);
            for _ in 0..n {
                let w = rng.random_range(0..n);
                from += pieces[0].errors[w];
                to += pieces[2].errors[w];
                count += ranges[w].len() as f64;
            }
            closure_of(&(from / count), &(to / count))
        })
        .collect();
    values.sort_by(f64::total_cmp);
    let at = |q: f64| values[((values.len() - 1) as f64 * q).round() as usize];
    [at(0.025), at(0.975)]
}

fn signal_rms(record: &Record, c: usize) -> f64 {
    let Some(channel) = &record.channels[c] else { return 0.0 };
    let n = channel.len() as f64;
    let mean = channel.iter().sum::<f64>() / n;
    (channel.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / n).sqrt()
}
