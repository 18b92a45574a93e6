//! Interpolation of samples from those before and after them by an autoregressive model (Janssen, Veldhuis, Vries, Adaptive
//! interpolation of discrete-time signals that can be modeled as autoregressive processes, IEEE Trans. ASSP 34(2), 1986).
//!
//! A polynomial through the neighbours interpolates a motion that is slow compared with the sampling; this model interpolates any motion
//! whose spectrum is at the noise floor in a part of the band, however near its frequencies are to Nyquist's.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use crate::numerics::dot;

/// Order of the model.
const ORDER: usize = 32;
/// Samples of a segment, each with a model of its own, since the spectrum of the motion changes along a record.
const SEGMENT: usize = 4096;
/// Least number of rows for each coefficient.
const VALUES: usize = 8;
/// Rms residual over the rms signal below which the residual is rounding.
const ROUNDING: f64 = 1e-13;
/// Share of a regressor's power that those before it must leave, and of the target's that all of them must, for the normal equations to be
/// as good as an orthogonal factorisation: their rounding is 1e-15 of a regressor's power.
const INDEPENDENT: f64 = 1e-12;
const RESIDUAL: f64 = 1e-9;
/// Most samples that a noise floor is estimated from.
const NOISE_SAMPLES: usize = 4 * SEGMENT;
/// Frequencies at which a spectrum is evaluated.
const FREQUENCIES: usize = 512;

/// A sample interpolated from the others, in the signal's unit.
pub struct Expected {
    /// Its index.
    pub at: usize,
    /// Interpolated value.
    pub value: f64,
    /// Its standard error.
    pub error: f64,
}

/// Interpolates the samples `lost` (indices, in rising order) of a signal; their own values are not used. Samples with too few others about
/// them are left out.
pub fn expected(y: &[f64], lost: &[usize]) -> Vec<Expected> {
    let within = |range: &Range<usize>| {
        let [from, to] = [range.start, range.end].map(|end| lost.partition_point(|k| *k < end));
        &lost[from..to]
    };
    // The last segment is longer by the remainder.
    let segments = (y.len() / SEGMENT).max(1);
    let of = |number: usize| -> Vec<Expected> {
        let end = if number + 1 == segments { y.len() } else { (number + 1) * SEGMENT };
        let segment = number * SEGMENT..end;
        let own = within(&segment);
        if own.is_empty() {
            return Vec::new();
        }
        // The model is fitted to some samples of the neighbouring segments, too: a sample at the edge has few to one side.
        let whole = segment.start.saturating_sub(ORDER)..(end + ORDER).min(y.len());
        of_segment(y, within(&whole), own, whole)
    };
    let all: Vec<Vec<Expected>> = (0..segments).into_par_iter().map(of).collect();
    all.into_iter().flatten().collect()
}

/// Standard deviation of the noise of a signal, in its unit: the 5 % quantile of the model's spectrum, as a white noise. It is overestimated
/// where the motion fills more than 95 % of the band. `None` for too short a signal.
#[must_use]
pub fn floor(y: &[f64]) -> Option<f64> {
    let y = &y[..y.len().min(NOISE_SAMPLES)];
    let mean = y.iter().sum::<f64>() / y.len() as f64;
    let model = Model::of(&y.iter().map(|v| v - mean).collect::<Vec<f64>>(), &[])?;
    let mut levels: Vec<f64> = (0..FREQUENCIES)
        .map(|m| {
            let turn = std::f64::consts::PI * (m as f64 + 0.5) / FREQUENCIES as f64;
            let part = |of: fn(f64) -> f64| -> f64 {
                model.coefficients.iter().enumerate().map(|(i, c)| c * of(turn * i as f64)).sum()
            };
            model.residual / part(f64::cos).hypot(part(f64::sin))
        })
        .collect();
    Some(*levels.select_nth_unstable_by(FREQUENCIES / 20, f64::total_cmp).1)
}

fn of_segment(y: &[f64], lost: &[usize], own: &[usize], whole: Range<usize>) -> Vec<Expected> {
    let sound = whole.clone().filter(|k| lost.binary_search(k).is_err());
    let (sum, count) = sound.fold((0.0, 0.0), |(sum, count), k| (sum + y[k], count + 1.0));
    let mean = sum / count;
    let series: Vec<f64> = y[whole.clone()].iter().map(|v| v - mean).collect();
    let inside = |k: &usize| k.checked_sub(whole.start).filter(|k| *k < series.len());
    let lost: Vec<usize> = lost.iter().filter_map(inside).collect();
    let own: Vec<usize> = own.iter().filter_map(inside).collect();
    let Some(model) = Model::of(&series, &lost) else { return Vec::new() };
    // Lost samples within one order of each other are interpolated together.
    let group = |k: usize| -> Vec<usize> { lost.iter().copied().filter(|l| l.abs_diff(k) <= ORDER).collect() };
    own.iter()
        .filter_map(|&k| {
            let (value, error) = model.interpolate(&series, k, &group(k))?;
            Some(Expected { at: whole.start + k, value: value + mean, error })
        })
        .collect()
}

/// Prediction error `e(k) = sum of coefficients[i]*y(k - i)`, of which the first coefficient is 1.
struct Model {
    coefficients: Vec<f64>,
    /// Standard deviation of the prediction error, in the signal's unit.
    residual: f64,
}

impl Model {
    /// The model of least residual of a series, fitted by the covariance method to the rows that touch no sample of `lost` (rising order).
    /// `None` of too few rows.
    fn of(y: &[f64], lost: &[usize]) -> Option<Self> {
        let runs = sound_runs(y.len(), lost);
        let rows: usize = runs.iter().map(ExactSizeIterator::len).sum();
        if rows < VALUES * ORDER {
            return None;
        }
        let power = runs.iter().flat_map(Clone::clone).map(|k| y[k] * y[k]).sum::<f64>();
        let rounding = ROUNDING * power.sqrt();
        let coefficients = normal_equations(y, &runs).or_else(|| orthogonal_triangle(y, &runs, rounding))?;
        let backwards: Vec<f64> = coefficients.iter().rev().copied().collect();
        let residual = |k: usize| dot(&backwards, &y[k - ORDER..=k]);
        let squares: f64 = runs.iter().flat_map(Clone::clone).map(|k| residual(k).powi(2)).sum();
        let deviation = (squares.max(rounding * rounding) / (rows - ORDER) as f64).sqrt();
        Some(Self { coefficients, residual: deviation })
    }

    /// Sample `k` of a group of lost samples and its standard error: the values that minimise the prediction errors, forwards in time and
    /// backwards.
    fn interpolate(&self, y: &[f64], k: usize, group: &[usize]) -> Option<(f64, f64)> {
        let n = group.len();
        let mut a = DMatrix::<f64>::zeros(n, n);
        let mut b = DVector::<f64>::zeros(n);
        let mut add = |sample: &dyn Fn(usize) -> usize| {
            let mut own = vec![0.0; n];
            let mut known = 0.0;
            for (i, c) in self.coefficients.iter().enumerate() {
                let at = sample(i);
                match group.binary_search(&at) {
                    Ok(g) => own[g] = *c,
                    Err(_) => known += c * y[at],
                }
            }
            for p in 0..n {
                b[p] -= own[p] * known;
                for q in 0..n {
                    a[(p, q)] += own[p] * own[q];
                }
            }
        };
        for j in k.max(ORDER)..(k + ORDER + 1).min(y.len()) {
            add(&|i| j - i);
        }
        for j in k.saturating_sub(ORDER)..=k.min(y.len() - 1 - ORDER) {
            add(&|i| j + i);
        }
        let inverse = a.cholesky()?.inverse();
        let at = group.binary_search(&k).ok()?;
        // Forward and backward prediction errors are of one noise: they count once.
        Some(((&inverse * b)[at], self.residual * (2.0 * inverse[(at, at)]).sqrt()))
    }
}

/// Runs of the rows, the samples from [`ORDER`] on with those before them, that touch no lost sample (rising order).
fn sound_runs(samples: usize, lost: &[usize]) -> Vec<Range<usize>> {
    let mut runs = Vec::new();
    let mut start = ORDER;
    for &k in lost {
        runs.push(start..k.min(samples));
        start = start.max(k + ORDER + 1);
    }
    runs.push(start..samples);
    runs.retain(|r| r.start < r.end);
    runs
}

/// The coefficients by the normal equations, `None` where these are too ill-conditioned for it.
///
/// The regressors are `y(k-1)`, its difference `d(k-1)` and the second differences `e(k-1) .. e(k-30)`, which span the same space as
/// `y(k-1) .. y(k-32)`; the target is `e(k)`. A motion that is slow beside the sampling is nearly all in the first two, so that the
/// others are well conditioned. The Gram matrix of the second differences is one of shifts of one series: its first row is summed over the
/// samples, and every other entry is that of one shift less, corrected at both ends of each run.
fn normal_equations(y: &[f64], runs: &[Range<usize>]) -> Option<Vec<f64>> {
    /// The second differences, the target `e(k)` the first.
    const SHIFTS: usize = ORDER - 1;
    let d: Vec<f64> = std::iter::once(0.0).chain(y.windows(2).map(|w| w[1] - w[0])).collect();
    let e: Vec<f64> = std::iter::once(0.0).chain(d.windows(2).map(|w| w[1] - w[0])).collect();
    // Index 0 is y(k-1), 1 is d(k-1), and SHIFTS + 1 - i is e(k-i): the target comes last.
    let mut gram = DMatrix::<f64>::zeros(ORDER + 1, ORDER + 1);
    let mut shifted = vec![[0.0; SHIFTS]; SHIFTS];
    for run in runs {
        let (a, b) = (run.start, run.end);
        for i in 0..SHIFTS {
            shifted[0][i] = dot(&e[a..b], &e[a - i..b - i]);
        }
        for i in 1..SHIFTS {
            for j in i..SHIFTS {
                shifted[i][j] = shifted[i - 1][j - 1] + e[a - i] * e[a - j] - e[b - i] * e[b - j];
            }
        }
        let (before, rate) = (&y[a - 1..b - 1], &d[a - 1..b - 1]);
        gram[(0, 0)] += dot(before, before);
        gram[(1, 0)] += dot(rate, before);
        gram[(1, 1)] += dot(rate, rate);
        for i in 0..SHIFTS {
            let row = ORDER - i;
            gram[(row, 0)] += dot(&e[a - i..b - i], before);
            gram[(row, 1)] += dot(&e[a - i..b - i], rate);
            for j in i..SHIFTS {
                gram[(row, ORDER - j)] += shifted[i][j];
            }
        }
    }
    // Regressors of unit size; the factorisation reads the lower triangle alone.
    let size: Vec<f64> = (0..=ORDER).map(|i| gram[(i, i)].sqrt()).collect();
    if size.iter().any(|s| !s.is_normal()) {
        return None;
    }
    for i in 0..=ORDER {
        for j in 0..=i {
            gram[(i, j)] /= size[i] * size[j];
        }
    }
    let l = gram.cholesky()?.unpack();
    let pivots = (0..=ORDER).map(|i| l[(i, i)] * l[(i, i)]).enumerate();
    if !pivots.into_iter().all(|(i, p)| p > if i == ORDER { RESIDUAL } else { INDEPENDENT }) {
        return None;
    }
    let target = l.row(ORDER).columns(0, ORDER).transpose();
    let w = l.view((0, 0), (ORDER, ORDER)).tr_solve_lower_triangular(&target)?;
    let w = |i: usize| w[i] * size[ORDER] / size[i];
    // Back to the samples themselves: e(k) less what the regressors make of it.
    let mut coefficients = vec![0.0; ORDER + 1];
    let mut add = |lag: usize, weights: &[f64], factor: f64| {
        weights.iter().enumerate().for_each(|(i, weight)| coefficients[lag + i] += factor * weight);
    };
    add(0, &[1.0, -2.0, 1.0], 1.0);
    add(1, &[1.0], -w(0));
    add(1, &[1.0, -1.0], -w(1));
    for i in 1..SHIFTS {
        add(i, &[1.0, -2.0, 1.0], -w(ORDER - i));
    }
    Some(coefficients)
}

/// The coefficients by a QR factorisation of the regressors. `rounding` (unit of the signal) keeps them small where fewer regressors
/// explain all there is.
fn orthogonal_triangle(y: &[f64], runs: &[Range<usize>], rounding: f64) -> Option<Vec<f64>> {
    let rows: Vec<usize> = runs.iter().flat_map(Clone::clone).collect();
    let triangle = DMatrix::from_fn(rows.len() + ORDER, ORDER + 1, |r, i| match rows.get(r) {
        // The samples before, the farthest first, and the target.
        Some(k) => y[k - ORDER + i],
        None if r - rows.len() == i => rounding,
        None => 0.0,
    })
    .qr()
    .r();
    let target = triangle.column(ORDER).rows(0, ORDER).into_owned();
    let w = triangle.view((0, 0), (ORDER, ORDER)).solve_upper_triangular(&target)?;
    Some(std::iter::once(1.0).chain(w.iter().rev().map(|w| -w)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    /// Two lines, the higher at 0.6 of Nyquist's frequency, in white noise.
    fn signal(noise: f64) -> Vec<f64> {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let of = |k: usize| (0.11 * k as f64).sin() + 0.3 * (1.885 * k as f64).sin();
        (0..6000)
            .map(|k| of(k) + noise * <StandardNormal as Distribution<f64>>::sample(&StandardNormal, &mut rng))
            .collect()
    }

    #[test]
    fn lost_samples_are_told_to_the_noise_and_the_error_says_so() {
        let noise = 1e-3;
        let sound = signal(noise);
        // At the edges, in a row, two near one another, and where two stretches meet.
        let lost = [1, 3, 700, 701, 2000, 2009, 4095, 4096, 5990];
        let mut y = sound.clone();
        lost.iter().for_each(|k| y[*k] = f64::MAX.sqrt());
        let estimate = expected(&y, &lost);
        assert_eq!(estimate.iter().map(|e| e.at).collect::<Vec<_>>(), lost);
        let off: Vec<f64> = estimate.iter().map(|e| (e.value - sound[e.at]) / e.error).collect();
        assert!(off.iter().all(|z| z.abs() < 3.5), "{off:?}");
        let inside = |e: &&Expected| (ORDER..sound.len() - ORDER).contains(&e.at);
        let errors: Vec<f64> = estimate.iter().filter(inside).map(|e| e.error / noise).collect();
        assert!(errors.iter().all(|e| *e < 5.0), "{errors:?}");
    }

    #[test]
    fn the_noise_under_a_motion_near_nyquists_frequency_is_told() {
        let estimate = floor(&signal(1e-3)).expect("long enough");
        assert!((estimate / 1e-3 - 1.0).abs() < 0.2, "{estimate}");
        assert!(floor(&signal(1e-3)[..200]).is_none());
    }

    #[test]
    fn the_normal_equations_leave_as_little_as_an_orthogonal_factorisation() {
        let noise = 1e-3;
        // A fast motion upon a way of thousands, as of an axis that runs on.
        let y: Vec<f64> = signal(noise).iter().enumerate().map(|(k, v)| v + 1e-4 * (k as f64).powi(2)).collect();
        let runs = sound_runs(y.len(), &[5, 700, 701, 2000, 5999]);
        assert_eq!(runs, [38..700, 734..2000, 2033..5999]);
        let squares = |c: &[f64]| -> f64 {
            let residual = |k: usize| -> f64 { (0..=ORDER).map(|i| c[i] * y[k - i]).sum() };
            runs.iter().flat_map(Clone::clone).map(|k| residual(k).powi(2)).sum()
        };
        let (normal, orthogonal) = (
            normal_equations(&y, &runs).expect("well conditioned"),
            orthogonal_triangle(&y, &runs, 0.0).expect("sound"),
        );
        let (normal, orthogonal) = (squares(&normal), squares(&orthogonal));
        assert!((normal / orthogonal - 1.0).abs() < 1e-6, "{normal} {orthogonal}");
        // Without noise every sample follows from those before it: nothing is left for the normal equations.
        let runs = sound_runs(y.len(), &[]);
        assert!(normal_equations(&signal(0.0), &runs).is_none());
    }

    #[test]
    fn of_a_short_or_spoilt_stretch_nothing_is_told() {
        assert!(expected(&signal(1e-3)[..200], &[100]).is_empty());
        let every_tenth: Vec<usize> = (0..600).map(|k| 10 * k).collect();
        assert!(expected(&signal(1e-3), &every_tenth).is_empty());
    }
}
