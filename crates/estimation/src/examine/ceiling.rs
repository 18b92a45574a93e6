//! A torque that ends at one value: whether the drive gave no more, or the log held no more.
//!
//! ```text
//! T = M1*a1 + M2*a2 + c*v + F*sign(v) + k*x + b        where T is off its ends, by least squares
//! ```
//!
//! and there against the motion while T stands at an end. Behind a limit of the drive the axis is moved by that limit; behind one of the log
//! by more. Torque and motion pass the same smoothing, so that the equation holds between them; noise of the encoder that is left takes from
//! the inertia, and so speaks for the drive. A torque that is held from sample to sample moves a difference of the second order by the mean of
//! two.

use super::Input;
use super::finding::runs;
use super::rigid::{MOST_LEFT, SAMPLES};
use super::robust::quantile;
use super::smoothing::{SHORTEST, smoothed};
use crate::identify::lsq::triangularise;

/// Widths of the smoothing that are tried.
const WIDTHS: [usize; 7] = [0, 1, 2, 4, 8, 16, 32];
/// Rows for each coefficient from which it says something.
const ROWS: usize = 10;
/// Stretches at an end from which their spread is known to a quarter.
const STRETCHES: usize = 8;
/// Errors of the mean of what the axis felt beyond an end, from which it felt more than was logged; the equation's rms error off the ends is
/// that of one stretch. Chance makes three; what the equation leaves out, in sound records with friction, play and ripple, made less than that.
const SURE: f64 = 6.0;

/// What the axis felt while its torque stood at an end.
pub(super) enum Actual {
    /// That torque.
    AsLogged,
    /// More, by that share of the end.
    Larger(f64),
    /// It cannot be told: too little of the record is off the ends, or no equation explains it.
    Unknown,
}

/// What the axis felt while its torque stood at an end.
pub(super) fn actual_torque(input: &Input<'_>, torque: &[f64]) -> Actual {
    let mut best: Option<(f64, Option<f64>)> = None;
    for width in WIDTHS.into_iter().filter(|w| SHORTEST + 8 * w <= torque.len()) {
        for held in [true, false] {
            if let Some((left, excess)) = at_width(input, torque, width, held)
                && left < MOST_LEFT
                && best.is_none_or(|(least, _)| left < 0.98 * least)
            {
                best = Some((left, excess));
            }
        }
    }
    match best {
        None => Actual::Unknown,
        Some((_, None)) => Actual::AsLogged,
        Some((_, Some(share))) => Actual::Larger(share),
    }
}

/// Share of the torque's power that is left off its ends, and how much more the axis felt at them where that is sure.
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
    // Smoothed twice, a value reaches 2*width samples to either side; a difference one more.
    let reach = 2 * width;
    let at_end = |k: usize| torque[k] == low || torque[k] == high;
    let mut before = vec![0_usize; torque.len() + 1];
    for k in 0..torque.len() {
        before[k + 1] = before[k] + usize::from(at_end(k));
    }
    let touched = |k: usize| before[(k + 2 * reach + 1).min(torque.len())] > before[k - 1];
    let free: Vec<usize> = (1..last).filter(|k| !touched(*k)).collect();
    let columns = positions.len() + 4;
    if free.len() < ROWS * columns {
        return None;
    }
    let rows: Vec<usize> = free.iter().copied().step_by((free.len() / SAMPLES).max(1)).collect();
    let speed = |k: usize| (q[k + 1] - q[k - 1]) / (2.0 * dt);
    let quiet = 0.02 * quantile((1..last).map(speed), 0.9);
    let middle = q[q.len() / 2];
    let fill = |k: usize, out: &mut [f64]| {
        for (o, x) in out.iter_mut().zip(&positions) {
            *o = (x[k + 1] - 2.0 * x[k] + x[k - 1]) / (dt * dt);
        }
        let v = speed(k);
        let sign = if v.abs() <= quiet { 0.0 } else { v.signum() };
        out[positions.len()..columns].copy_from_slice(&[v, sign, q[k] - middle, 1.0]);
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
    // Stretches that the smoothing joins are one observation.
    let mut regressors = vec![0.0; columns];
    let mut more = Vec::new();
    for (end, side) in [(high, 1.0), (low, -1.0)] {
        let (mut sum, mut count, mut since) = (0.0, 0.0, 0);
        for k in 1..last {
            if torque[k + reach] == end && (!held || torque[k + reach - 1] == end) {
                fill(k, &mut regressors);
                let felt: f64 = regressors.iter().enumerate().map(|(i, r)| solution.phi[(i, 0)] * r).sum();
                sum += side * (felt - t[k]);
                count += 1.0;
                since = 0;
            } else {
                since += 1;
                if since > reach && count > 0.0 {
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

/// Stretches in which a column stands at its ends time and again, between which it takes many values: a column of a few levels ends at one by
/// nature.
pub(super) fn stands(x: &[f64]) -> Vec<std::ops::Range<usize>> {
    let n = x.len();
    let (low, high) = x.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(*v), b.max(*v)));
    let at_end: Vec<std::ops::Range<usize>> =
        [low, high].into_iter().flat_map(|end| runs(n, |k| x[k] == end)).filter(|r| r.len() >= 3).collect();
    let count: usize = at_end.iter().map(std::ops::Range::len).sum();
    if at_end.len() < 3 || count * 200 < n || levels(x, low, high) { Vec::new() } else { at_end }
}

/// Values between the ends from which they are told from some levels.
const VALUES: usize = 16;

/// Whether a column takes a few values, or keeps each for some samples, and does not pass all that are between its ends: however little of it
/// is there.
fn levels(x: &[f64], low: f64, high: f64) -> bool {
    let inside = |v: &f64| *v > low && *v < high;
    let within = x.windows(2).filter(|w| w.iter().all(inside)).count();
    let changes = x.windows(2).filter(|w| w.iter().all(inside) && w[0] != w[1]).count();
    let mut values: Vec<f64> = x.iter().copied().filter(inside).collect();
    values.sort_by(f64::total_cmp);
    values.dedup();
    changes * 2 < within || values.len() < VALUES
}
