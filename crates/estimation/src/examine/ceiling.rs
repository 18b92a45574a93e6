//! A torque that ends at one value: whether the drive gave no more, or the log held no more.
//!
//! ```text
//! T = M1*a1 + M2*a2 + c*v + F*sign(v) + k*x + b        where T is off its ends, by least squares
//! ```
//!
//! The equation is fitted where T is within its range and evaluated where T is at an end of it. If the drive limits the torque, the axis moves
//! as under that limit; if the log limits the column, as under more. Torque and motion pass the same smoothing, so that the equation holds
//! between them. Remaining encoder noise biases the inertia low, and so favours the drive's limit. A torque that is held between samples acts
//! on a second difference as the mean of two samples.

use super::Input;
use super::finding::runs;
use super::motion::{Direction, acceleration, speed};
use super::rigid::{MAX_RESIDUAL, SAMPLES};
use super::smoothing::{SHORTEST, smoothed};
use crate::identify::lsq::triangularise;

/// Widths of the smoothing that are tried, samples to either side.
const WIDTHS: [usize; 7] = [0, 1, 2, 4, 8, 16, 32];
/// Least number of rows for each coefficient.
const ROWS: usize = 10;
/// Stretches at an end from which their spread is known to a quarter.
const STRETCHES: usize = 8;
/// Mean excess of the computed torque over the logged limit, in its standard errors, from which the axis was driven by more than was logged;
/// the rms residual of the fit is the standard error of one stretch. Chance makes three; unmodelled friction, play and ripple made less than
/// that in sound records.
const SURE: f64 = 6.0;

/// What the axis felt while its torque stood at an end.
pub(super) enum AppliedTorque {
    /// That torque.
    AsLogged,
    /// More, by that share of the end.
    Larger(f64),
    /// Undetermined: too few samples are within the range, or the equation does not explain the torque.
    Unknown,
}

/// What the axis felt while its torque stood at an end.
pub(super) fn applied_torque(input: &Input<'_>, torque: &[f64]) -> AppliedTorque {
    let mut best: Option<(f64, Option<f64>)> = None;
    for width in WIDTHS.into_iter().filter(|w| SHORTEST + 8 * w <= torque.len()) {
        for held in [true, false] {
            if let Some((left, excess)) = at_width(input, torque, width, held)
                && left < MAX_RESIDUAL
                && best.is_none_or(|(least, _)| left < 0.98 * least)
            {
                best = Some((left, excess));
            }
        }
    }
    match best {
        None => AppliedTorque::Unknown,
        Some((_, None)) => AppliedTorque::AsLogged,
        Some((_, Some(share))) => AppliedTorque::Larger(share),
    }
}

/// Residual share of the torque's variance within its range, and the relative excess of the computed torque at its ends where that is
/// significant. `width`: of the smoothing, samples to either side; `held`: the torque is held between samples.
fn at_width(input: &Input<'_>, torque: &[f64], width: usize, held: bool) -> Option<(f64, Option<f64>)> {
    let dt = input.dt;
    let positions: Vec<Vec<f64>> =
        [input.theta1, input.theta2].into_iter().flatten().map(|x| smoothed(x, width)).collect();
    let mut t = smoothed(torque, width);
    if held {
        for k in (1..t.len()).rev() {
            t[k] = 0.5 * (t[k - 1] + t[k]);
        }
    }
    let (q, last) = (positions.first()?, t.len() - 1);
    let (low, high) = torque.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(*v), b.max(*v)));
    // A value that is smoothed twice depends on 2*width samples to either side; a difference on one more.
    let support = 2 * width;
    let at_end = |k: usize| torque[k] == low || torque[k] == high;
    let mut before = vec![0_usize; torque.len() + 1];
    for k in 0..torque.len() {
        before[k + 1] = before[k] + usize::from(at_end(k));
    }
    let touched = |k: usize| before[(k + 2 * support + 1).min(torque.len())] > before[k - 1];
    let free: Vec<usize> = (1..last).filter(|k| !touched(*k)).collect();
    let columns = positions.len() + 4;
    if free.len() < ROWS * columns {
        return None;
    }
    let rows: Vec<usize> = free.iter().copied().step_by((free.len() / SAMPLES).max(1)).collect();
    let direction = Direction::of_angle(q, dt);
    let middle = q[q.len() / 2];
    let fill = |k: usize, out: &mut [f64]| {
        for (o, x) in out.iter_mut().zip(&positions) {
            *o = acceleration(x, k, dt);
        }
        let v = speed(q, k, dt);
        out[positions.len()..columns].copy_from_slice(&[v, direction.at(v), q[k] - middle, 1.0]);
    };
    let solution = triangularise(rows.len(), columns, 1, |i, out| {
        fill(rows[i], out);
        out[columns] = t[rows[i]];
    })
    .solve()
    .ok()?;
    let mean = rows.iter().map(|k| t[*k]).sum::<f64>() / rows.len() as f64;
    let total: f64 = rows.iter().map(|k| (t[*k] - mean).powi(2)).sum();
    let left = solution.residual[(0, 0)] / total;
    if !left.is_finite() {
        return None;
    }
    // Stretches nearer to each other than the smoothing's support are one observation.
    let mut regressors = vec![0.0; columns];
    let mut more = Vec::new();
    for (end, side) in [(high, 1.0), (low, -1.0)] {
        let (mut sum, mut count, mut since) = (0.0, 0.0, 0);
        for k in 1..last {
            if torque[k + support] == end && (!held || torque[k + support - 1] == end) {
                fill(k, &mut regressors);
                let computed: f64 = regressors.iter().enumerate().map(|(i, r)| solution.phi[(i, 0)] * r).sum();
                sum += side * (computed - t[k]);
                count += 1.0;
                since = 0;
            } else {
                since += 1;
                if since > support && count > 0.0 {
                    more.push(sum / count);
                    (sum, count) = (0.0, 0.0);
                }
            }
        }
        if count > 0.0 {
            more.push(sum / count);
        }
    }
    if more.len() < STRETCHES {
        return Some((left, None));
    }
    let n = more.len() as f64;
    let excess = more.iter().sum::<f64>() / n;
    let error = (solution.residual[(0, 0)] / rows.len() as f64 / n).sqrt();
    Some((left, (excess > SURE * error).then(|| excess / high.abs().max(low.abs()))))
}

/// Stretches of at least three samples in which a column is at the smallest or largest value of its range, where there are several of them and
/// the column takes many values between: a column of a few levels has such stretches by nature.
pub(super) fn limited_stretches(x: &[f64]) -> Vec<std::ops::Range<usize>> {
    let n = x.len();
    let (low, high) = x.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(*v), b.max(*v)));
    let at_end: Vec<std::ops::Range<usize>> =
        [low, high].into_iter().flat_map(|end| runs(n, |k| x[k] == end)).filter(|r| r.len() >= 3).collect();
    let count: usize = at_end.iter().map(std::ops::Range::len).sum();
    if at_end.len() < 3 || count * 200 < n || levels(x, low, high) { Vec::new() } else { at_end }
}

/// Distinct values within the range below which a column is one of a few levels.
const VALUES: usize = 16;

/// Whether a column takes few distinct values between its ends, `low` and `high`, or keeps each for some samples.
fn levels(x: &[f64], low: f64, high: f64) -> bool {
    let inside = |v: &f64| *v > low && *v < high;
    let within = x.windows(2).filter(|w| w.iter().all(inside)).count();
    let changes = x.windows(2).filter(|w| w.iter().all(inside) && w[0] != w[1]).count();
    let mut values: Vec<f64> = x.iter().copied().filter(inside).collect();
    values.sort_by(f64::total_cmp);
    values.dedup();
    changes * 2 < within || values.len() < VALUES
}
