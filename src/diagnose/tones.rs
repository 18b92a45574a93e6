//! Orders and frequencies worth a regression: a periodogram of the residual, seen through the axis.
//!
//! A torque `sin(n*phi)` along the motion does `G*sin(n*phi)` to the readings. How much of the residual `r` it takes away is
//! `<G*sin, r>^2/|G*sin|^2`; the product is `<sin, G'*r>`, so one run of the adjoint axis serves every line, and the
//! length is taken for a smooth function of the line and interpolated. A long travel with few reversals makes it rough,
//! and lines far apart alike: there the curvature of the residual, which is the torque itself but for a filter, tells
//! them apart, every sample counting as much. What comes of it names lines to be tried, not sizes.

use rayon::prelude::*;

use super::nonuniform;

/// Lines at which the length of a column is computed.
const KNOTS: usize = 24;
/// Steps of the golden section that takes a line off its grid.
const SHARPENINGS: usize = 10;

/// Evenly spaced orders or frequencies: `step, 2*step, ..., count*step`.
#[derive(Debug, Clone, Copy)]
pub struct Lines {
    /// Their distance.
    pub step: f64,
    /// How many.
    pub count: usize,
}

/// Most lines that are looked at.
const MOST: usize = 20_000;

impl Lines {
    /// Lines up to a highest one.
    #[must_use]
    pub fn up_to(most: f64, step: f64) -> Self {
        Self { step, count: ((most / step).floor().max(1.0) as usize).min(MOST) }
    }

    /// The lines at which a sine would take most of the residual away, best first, at most `most`: local maxima of the
    /// periodogram.
    ///
    /// `angle`: what one unit of order (rad) or frequency (rad.s) is multiplied by at each sample; `adjoint`: the
    /// residual brought back to the place where the sine acts, of the same length; `length2(line)`: squared length of
    /// the column of a sine of unit amplitude at a line.
    #[must_use]
    pub fn strongest(
        &self,
        angle: &[f64],
        adjoint: &[f64],
        length2: &(dyn Fn(f64) -> f64 + Sync),
        most: usize,
    ) -> Vec<f64> {
        let knots = self.knots(length2);
        let power = self.power(angle, adjoint);
        let score: Vec<f64> = power.iter().zip(1..).map(|(p, n)| p / interpolated(&knots, f64::from(n))).collect();
        self.sharpened(self.peaks(&score, most), angle, adjoint)
    }

    /// The lines at which a series itself holds most of a sine along `angle`, best first, at most `most`.
    #[must_use]
    pub fn loudest(&self, angle: &[f64], series: &[f64], most: usize) -> Vec<f64> {
        self.sharpened(self.peaks(&self.power(angle, series), most), angle, series)
    }

    fn peaks(&self, score: &[f64], most: usize) -> Vec<f64> {
        let at = |i: usize| score.get(i).copied().unwrap_or(0.0);
        let mut peaks: Vec<usize> =
            (0..score.len()).filter(|&i| at(i) > at(i.wrapping_sub(1)) && at(i) >= at(i + 1)).collect();
        peaks.sort_by(|a, b| score[*b].total_cmp(&score[*a]));
        peaks.iter().take(most).map(|&i| (i + 1) as f64 * self.step).collect()
    }

    /// Peaks off the grid, where their power is greatest: half a step is a quarter turn over the record.
    fn sharpened(&self, peaks: Vec<f64>, angle: &[f64], series: &[f64]) -> Vec<f64> {
        let quiet = |line: f64| {
            let (mut s, mut c) = (0.0, 0.0);
            for (angle, value) in angle.iter().zip(series) {
                let (sin, cos) = (line * angle).sin_cos();
                s += value * sin;
                c += value * cos;
            }
            -(s * s + c * c)
        };
        peaks.into_par_iter().map(|line| golden(line - 0.75 * self.step, line + 0.75 * self.step, quiet)).collect()
    }

    /// `|sum_k adjoint_k*exp(i*line*angle_k)|^2` at every line.
    fn power(&self, angle: &[f64], adjoint: &[f64]) -> Vec<f64> {
        nonuniform::power(self.count, angle.iter().map(|a| self.step * a), adjoint)
    }

    /// Squared lengths at some lines, by their numbers.
    fn knots(&self, length2: &(dyn Fn(f64) -> f64 + Sync)) -> Vec<(f64, f64)> {
        let last = self.count as f64;
        let mut numbers: Vec<f64> = (0..KNOTS).map(|i| last.powf(i as f64 / (KNOTS - 1) as f64).round()).collect();
        numbers.dedup();
        numbers.into_par_iter().map(|n| (n, length2(n * self.step).max(f64::MIN_POSITIVE))).collect()
    }
}

/// Where a function of one minimum between two bounds is least, by golden section: [`SHARPENINGS`] evaluations and two.
#[must_use]
pub fn golden(low: f64, high: f64, f: impl Fn(f64) -> f64) -> f64 {
    let share = 0.5 * (5.0_f64.sqrt() - 1.0);
    let (mut low, mut high) = (low, high);
    let (mut left, mut right) = (high - share * (high - low), low + share * (high - low));
    let (mut at_left, mut at_right) = (f(left), f(right));
    for _ in 0..SHARPENINGS {
        if at_left < at_right {
            (high, right, at_right) = (right, left, at_left);
            left = high - share * (high - low);
            at_left = f(left);
        } else {
            (low, left, at_left) = (left, right, at_right);
            right = low + share * (high - low);
            at_right = f(right);
        }
    }
    if at_left < at_right { left } else { right }
}

/// Second derivative of a series in samples, by the local parabola over `2*half + 1` of them; zero at its ends.
#[must_use]
pub fn curvature(series: &[f64], half: usize) -> Vec<f64> {
    let j2 = |i: usize| (i as f64 - half as f64).powi(2);
    let count = 2 * half + 1;
    let (s0, s2) = (count as f64, (0..count).map(j2).sum::<f64>());
    let s4: f64 = (0..count).map(|i| j2(i).powi(2)).sum();
    let weights: Vec<f64> = (0..count).map(|i| 2.0 * (s0 * j2(i) - s2) / (s0 * s4 - s2 * s2)).collect();
    let mut curvature = vec![0.0; series.len()];
    for (k, part) in series.windows(count).enumerate() {
        curvature[k + half] = part.iter().zip(&weights).map(|(y, w)| y * w).sum();
    }
    curvature
}

/// Log-log interpolation between knots.
fn interpolated(knots: &[(f64, f64)], n: f64) -> f64 {
    let after = knots.partition_point(|k| k.0 < n);
    let (high, low) = (knots[after.min(knots.len() - 1)], knots[after.saturating_sub(1)]);
    if high.0 <= low.0 {
        return low.1;
    }
    let part = (n / low.0).ln() / (high.0 / low.0).ln();
    low.1 * (high.1 / low.1).powf(part)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A sine along an uneven motion, in noise of a fixed pattern, is named first and to half a step.
    #[test]
    fn the_order_that_is_in_the_residual_is_named_first() {
        let angle: Vec<f64> = (0..3000).map(|k| 40.0 * (k as f64 * 2e-3).sin() + 1e-3 * k as f64).collect();
        let order = 17.3;
        let noise = |k: usize| ((k * k) as f64 * 0.37).sin();
        let residual: Vec<f64> = angle.iter().enumerate().map(|(k, a)| (order * a + 0.4).cos() + noise(k)).collect();
        let lines = Lines::up_to(60.0, 0.02);
        let named = lines.loudest(&angle, &residual, 8);
        assert!((named[0] - order).abs() <= 0.5 * lines.step, "{named:?}");
    }

    #[test]
    fn curvature_of_a_parabola_is_exact_whatever_the_width() {
        let series: Vec<f64> = (0..40).map(|k| 3.0 - 0.5 * k as f64 + 0.7 * (k as f64).powi(2)).collect();
        for half in [1, 3, 6] {
            let found = curvature(&series, half);
            assert!(found[half..40 - half].iter().all(|c| (c - 1.4).abs() < 1e-10), "{half}: {found:?}");
            assert!(found[..half].iter().all(|c| *c == 0.0));
        }
    }

    /// Against the sine taken anew at each line.
    #[test]
    fn power_is_the_transform_at_every_line() {
        let angle: Vec<f64> = (0..200).map(|k| (k as f64 * 0.11).sin() * 9.0).collect();
        let adjoint: Vec<f64> = (0..200).map(|k| (k as f64 * 0.7).cos()).collect();
        let lines = Lines { step: 0.05, count: 700 };
        for (i, p) in lines.power(&angle, &adjoint).iter().enumerate() {
            let line = (i + 1) as f64 * lines.step;
            let s: f64 = angle.iter().zip(&adjoint).map(|(x, a)| a * (line * x).sin()).sum();
            let c: f64 = angle.iter().zip(&adjoint).map(|(x, a)| a * (line * x).cos()).sum();
            assert!((p - (s * s + c * c)).abs() < 1e-8 * (1.0 + p), "{line}: {p}");
        }
    }
}
