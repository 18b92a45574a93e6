//! The gap in figures, three ways: by the model's own free run, in windows, and in torque.
//!
//! A *free run* starts once, at the state of the record's beginning, and follows the torque alone to the end, as the FMU would. In
//! *windows* the model starts anew every half thousand samples, from states fitted to each window. In *torque* it is held to the
//! measured motion, and what it lacks is counted ([`crate::hypothesis::tracking`]). All three models have the same freedom in each. The headline is
//! the first of the three by which the best model follows the record.

use std::ops::Range;

use nalgebra::{DMatrix, DVector, Vector4};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use rustfft::FftPlanner;

use super::diagnosis::{ClosureOf, Figures, Levels, Way};
use super::prepared::Prepared;
use crate::conditioning::{CHANNELS, Record};
use crate::hypothesis::fit::Fit;
use crate::hypothesis::hidden::any_vibrations;
use crate::hypothesis::likelihood::Sight;
use crate::hypothesis::model::Model;
use crate::hypothesis::tracking::{FreeRun, start_states};
use crate::numerics::level::deviation;

/// Samples in a window.
const WINDOW: usize = 512;
/// Windows at most: a longer record is sampled by so many, spread evenly. As many parts has the residual torque, for its interval.
const MOST: usize = 32;
/// Resamplings of the block bootstrap.
const RESAMPLINGS: usize = 400;
/// Error of a free run, as a share of the signal, up to which it says more than how fast a model drifts away.
const TRACKING: f64 = 0.5;

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
    /// The models' readings, as given and at its best; in torque what the equations of motor and table lack, windowed.
    pub runs: [Vec<[f64; 4]>; 2],
    /// Samples that the runs cover.
    pub covered: Vec<Range<usize>>,
    /// State of the best model at the record's first sample.
    pub initial: [f64; 4],
    /// Mean square of what the model as given leaves, over that of the signals.
    given: f64,
}

/// Runs of a model over pieces of the record, each from a state fitted to it.
struct Pieces {
    ranges: Vec<Range<usize>>,
    readings: Vec<Vec<[f64; 4]>>,
    errors: Vec<Errors>,
    initial: [f64; 4],
}

/// The gap on one record by each way of measuring it.
#[derive(Debug, Clone)]
pub struct Gaps {
    free_run: Gap,
    windows: Gap,
    torque: Gap,
}

impl Gaps {
    /// Measures the gap that three fits, the model as given, re-identified and improved, leave on a record.
    #[must_use]
    pub fn measure(record: &Record, seen: &Prepared, fits: [&Fit; 3]) -> Self {
        let models = fits.map(|f| f.model);
        Self {
            free_run: along_runs(record, &models, ClosureOf::FreeRun),
            windows: along_runs(record, &models, ClosureOf::Windows),
            torque: in_torque(seen, fits),
        }
    }

    /// Every way, the one that asks most of a model first.
    #[must_use]
    pub fn all(&self) -> [&Gap; 3] {
        [&self.free_run, &self.windows, &self.torque]
    }

    /// The way that asks most of the best model and is met by it: of one that drifts away a run says only how fast.
    #[must_use]
    pub fn headline(&self) -> &Gap {
        self.all().into_iter().find(|g| g.is_followed()).unwrap_or(&self.torque)
    }

    /// One way.
    #[must_use]
    pub fn by(&self, of: ClosureOf) -> &Gap {
        self.all()[of as usize]
    }

    /// The runs that a plot shows: those of the headline, where that is of runs.
    #[must_use]
    pub fn shown(&self) -> &Gap {
        if self.free_run.is_followed() { &self.free_run } else { &self.windows }
    }
}

impl Gap {
    fn is_followed(&self) -> bool {
        self.figures.combined.after < TRACKING
    }

    /// Its figures alone.
    #[must_use]
    pub fn way(&self) -> Way {
        Way {
            of: self.of,
            levels: self.figures.combined,
            closure: self.closure,
            closure_of_effect: self.closure_of_effect,
            interval: self.interval,
        }
    }
}

/// Closure of the gap from the model as given by one way alone, of the last of three fits, where that of another is `known`.
#[must_use]
pub fn closure_by(known: &Gap, record: &Record, seen: &Prepared, fits: [&Fit; 3]) -> f64 {
    if known.of == ClosureOf::Torque {
        return in_torque(seen, fits).closure;
    }
    let signals = Signals::of(record);
    let left = signals.mean(&pieces(record, &fits[2].model, &stretches(record, known.of)));
    closure(known.given, signals.weighed(&left), signals.floor)
}

/// The gap along runs of the models.
fn along_runs(record: &Record, models: &[Model; 3], of: ClosureOf) -> Gap {
    let ranges = stretches(record, of);
    let runs: Vec<Pieces> = models.par_iter().map(|m| pieces(record, m, &ranges)).collect();
    gap(record, &runs, of)
}

/// Stretches of a record that models run over, each from a state of its own.
fn stretches(record: &Record, of: ClosureOf) -> Vec<Range<usize>> {
    if of == ClosureOf::Windows { windows(record.len()) } else { std::iter::once(0..record.len()).collect() }
}

/// The measured signals as errors are told of them.
struct Signals {
    /// Channels that there are.
    present: Vec<usize>,
    /// Rms of each, rad and rad/s.
    rms: [f64; 4],
    /// Mean square of the noise, over that of the signals.
    floor: f64,
}

impl Signals {
    fn of(record: &Record) -> Self {
        let present: Vec<usize> = (0..4).filter(|c| record.channels[*c].is_some()).collect();
        let rms = [0, 1, 2, 3].map(|c| signal_rms(record, c).max(f64::MIN_POSITIVE));
        let floor = present.iter().map(|&c| (record.noise[c] / rms[c]).powi(2)).sum();
        Self { present, rms, floor }
    }

    /// Mean squared error of runs, by channel.
    fn mean(&self, runs: &Pieces) -> Errors {
        let samples: usize = runs.ranges.iter().map(Range::len).sum();
        runs.errors.iter().fold(Errors::zeros(), |a, b| a + b) / samples as f64
    }

    /// The same of all channels, over the signals' squares.
    fn weighed(&self, e: &Errors) -> f64 {
        self.present.iter().map(|&c| e[c] / self.rms[c].powi(2)).sum()
    }
}

/// What each fit lacks of the torque, in the band of the motion, in parts of the record.
fn in_torque(seen: &Prepared, fits: [&Fit; 3]) -> Gap {
    let (record, band) = (&seen.record, &seen.band);
    let n = record.len();
    let parts = MOST.min(n);
    let ranges: Vec<Range<usize>> = (0..parts).map(|p| p * n / parts..(p + 1) * n / parts).collect();
    let weights = band.weights(&fits[2].model);
    let (errors, residuals): (Vec<Vec<Errors>>, Vec<Vec<[f64; 4]>>) = fits
        .par_iter()
        .map(|fit| {
            let Some(tracked) = seen.problem(fit.model).lacked(&fit.model, fit.bandwidth) else {
                return (vec![Errors::from_element(f64::INFINITY); parts], vec![[f64::NAN; 4]; n]);
            };
            let planner = &mut FftPlanner::new();
            let mut rows =
                band.torque_residual(&fit.model, &tracked.torque, &tracked.motion, Some(fit.discrepancy), planner).rows;
            for vibration in any_vibrations(band, &fits[2].model, planner) {
                vibration.take_out(band, &weights, fits[2].discrepancy, &mut rows);
            }
            let series = [0, 1].map(|i| band.in_time(&rows[i]));
            let power = |i: usize, r: &Range<usize>| -> f64 {
                series[i].get(r.clone()).map_or(0.0, |s| s.iter().map(|v| v * v).sum())
            };
            let errors = ranges.iter().map(|r| Errors::new(power(0, r), power(1, r), 0.0, 0.0)).collect();
            // Of one encoder's equation, which weighs both sides, the torque that its own side needs.
            let shown = match band.sight {
                Sight::Rigid | Sight::Both => series,
                Sight::Motor => [band.filtered(&tracked.torque[0]), Vec::new()],
                Sight::Table => [Vec::new(), band.filtered(&tracked.torque[1])],
            };
            let at = |i: usize, k: usize| shown[i].get(k).copied().unwrap_or(0.0);
            (errors, (0..n).map(|k| [at(0, k), at(1, k), 0.0, 0.0]).collect())
        })
        .unzip();
    let signal = seen.torque_rms.max(f64::MIN_POSITIVE);
    let floor = band.noise_rms().powi(2);
    let weigh = |e: &Errors| e.sum();
    let total = [0, 1, 2].map(|m: usize| weigh(&errors[m].iter().fold(Errors::zeros(), |a, b| a + b)) / n as f64);
    let closure_of = |from: &Errors, to: &Errors| closure(weigh(from), weigh(to), floor);
    let relative = |v: f64| finite(v.max(0.0).sqrt() / signal);
    let [before, reidentified, after] = total.map(relative);
    let combined = Levels { before, reidentified, after, noise_floor: relative(floor) };
    Gap {
        of: ClosureOf::Torque,
        figures: Figures {
            combined,
            signals: vec![("T", combined)],
            multiples: total.map(|t| finite((t / floor.max(f64::MIN_POSITIVE)).sqrt())),
        },
        closure: closure(total[0], total[2], floor),
        closure_of_effect: closure(total[1], total[2], floor),
        interval: bootstrap(&ranges, [&errors[0], &errors[2]], &closure_of),
        runs: [residuals[0].clone(), residuals[2].clone()],
        covered: ranges,
        initial: [0.0; 4],
        given: total[0],
    }
}

/// Windows of the record, at most [`MOST`].
fn windows(n: usize) -> Vec<Range<usize>> {
    let count = (n / WINDOW).max(1);
    let all = |w: usize| w * n / count..(w + 1) * n / count;
    if count <= MOST { (0..count).map(all).collect() } else { (0..MOST).map(|i| all(i * count / MOST)).collect() }
}

fn pieces(record: &Record, model: &Model, ranges: &[Range<usize>]) -> Pieces {
    let begins: Vec<usize> = ranges.iter().map(|r| r.start).collect();
    let starts = start_states(model, record, &begins);
    let done: Vec<(Vec<[f64; 4]>, [f64; 4])> =
        ranges.par_iter().zip(&starts).map(|(range, start)| with_fitted_start(record, model, range, start)).collect();
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
fn with_fitted_start(
    record: &Record,
    model: &Model,
    range: &Range<usize>,
    start: &FreeRun,
) -> (Vec<[f64; 4]>, [f64; 4]) {
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
    let scale = Signals::of(record);
    let total: Vec<Errors> = pieces.iter().map(|p| scale.mean(p)).collect();
    let relative = |v: f64, c: usize| finite(v.max(0.0).sqrt() / scale.rms[c]);
    let signals = scale
        .present
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
    let combine = |e: f64| finite((e / scale.present.len() as f64).sqrt());
    let floor = scale.floor;
    let closure_of = |from: &Errors, to: &Errors| closure(scale.weighed(from), scale.weighed(to), floor);
    let weighed = [0, 1, 2].map(|m: usize| scale.weighed(&total[m]));
    let [before, reidentified, after] = weighed.map(combine);
    let interval = bootstrap(ranges, [&pieces[0].errors, &pieces[2].errors], &closure_of);
    let flat = |p: &Pieces| p.readings.iter().flatten().copied().collect();
    Gap {
        of,
        figures: Figures {
            combined: Levels { before, reidentified, after, noise_floor: combine(floor) },
            signals,
            multiples: weighed.map(|e| finite((e / floor).sqrt())),
        },
        closure: closure_of(&total[0], &total[2]),
        closure_of_effect: closure_of(&total[1], &total[2]),
        interval,
        runs: [flat(&pieces[0]), flat(&pieces[2])],
        covered: ranges.clone(),
        initial: pieces[2].initial,
        given: weighed[0],
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
    ranges: &[Range<usize>],
    errors: [&[Errors]; 2],
    closure_of: &dyn Fn(&Errors, &Errors) -> f64,
) -> [f64; 2] {
    let n = ranges.len();
    // The interval is the same from run to run.
    let mut rng = ChaCha8Rng::seed_from_u64(0);
    let mut values: Vec<f64> = (0..RESAMPLINGS)
        .map(|_| {
            let (mut from, mut to, mut count) = (Errors::zeros(), Errors::zeros(), 0.0);
            for _ in 0..n {
                let w = rng.random_range(0..n);
                from += errors[0][w];
                to += errors[1][w];
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
    record.channels[c].as_deref().map_or(0.0, deviation)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(of: ClosureOf, reidentified: f64, after: f64) -> Gap {
        let combined = Levels { before: 3.0, reidentified, after, noise_floor: 1e-4 };
        Gap {
            of,
            figures: Figures { combined, signals: Vec::new(), multiples: [1.0; 3] },
            closure: 0.5,
            closure_of_effect: 0.5,
            interval: [0.4, 0.6],
            runs: [Vec::new(), Vec::new()],
            covered: Vec::new(),
            initial: [0.0; 4],
            given: 1.0,
        }
    }

    #[test]
    fn the_headline_is_the_strictest_way_by_which_a_model_follows() {
        use ClosureOf::{FreeRun, Torque, Windows};
        let headline = |free: [f64; 2], windows: [f64; 2]| {
            let gaps = Gaps {
                free_run: of(FreeRun, free[0], free[1]),
                windows: of(Windows, windows[0], windows[1]),
                torque: of(Torque, 0.9, 0.8),
            };
            (gaps.headline().of, gaps.shown().of)
        };
        assert_eq!(headline([0.9, 0.1], [0.2, 0.1]), (FreeRun, FreeRun));
        // A ripple makes a motion that runs on from the smallest error: true to the noise in windows, it may end anywhere.
        assert_eq!(headline([0.1, 0.9], [0.2, 0.1]), (Windows, Windows));
        assert_eq!(headline([2.0, 0.9], [0.2, 0.1]), (Windows, Windows));
        assert_eq!(headline([2.0, 0.9], [1.2, f64::NAN]), (Torque, Windows));
    }

    #[test]
    fn closure_counts_what_stands_above_the_noise() {
        assert!((closure(1.01, 0.11, 0.01) - 0.9).abs() < 1e-12);
        assert_eq!(closure(1.01, 0.005, 0.01), 1.0);
        assert_eq!([closure(0.01, 0.01, 0.01), closure(0.01, 0.02, 0.01)], [1.0, 0.0]);
        assert_eq!([closure(f64::INFINITY, 1.0, 0.0), closure(1.0, f64::NAN, 0.0)], [1.0, 0.0]);
        assert!(closure(1.0, 2.0, 0.0) < 0.0);
    }
}
