//! Fourier sums over uneven angles: `|sum_k a_k*exp(i*n*phi_k)|^2` for every whole n, by spreading each sample over an even
//! grid as a Gaussian, a fast transform, and the Gaussian's own transform taken out (Greengard, Lee, SIAM Review 46(3),
//! 2004, eq. 9 to 12).

use std::f64::consts::{PI, TAU};

use rustfft::FftPlanner;
use rustfft::num_complex::Complex;

/// Grid points a mode: oversampled twice, modes of both signs.
const POINTS: usize = 4;
/// Grid points to either side that a sample is spread over: twelve digits.
const SPREAD: usize = 12;

/// Squared magnitudes of the sums for n from 1 to `count`; `angle` in rad, `value` of the same length.
#[must_use]
pub fn power(count: usize, angle: impl Iterator<Item = f64>, value: &[f64]) -> Vec<f64> {
    let modes = (2 * count + 1) as f64;
    let size = (POINTS * count).next_power_of_two().max(4 * SPREAD);
    let ratio = size as f64 / modes;
    let tau = PI * SPREAD as f64 / (modes * modes * ratio * (ratio - 0.5));
    let spacing = TAU / size as f64;
    let mut grid = vec![Complex::new(0.0, 0.0); size];
    for (phi, a) in angle.zip(value) {
        let phi = phi.rem_euclid(TAU);
        let nearest = (phi / spacing).floor();
        for offset in 0..2 * SPREAD {
            let point = nearest + offset as f64 - (SPREAD - 1) as f64;
            let distance = phi - point * spacing;
            grid[point.rem_euclid(size as f64) as usize % size].re += a * (-distance * distance / (4.0 * tau)).exp();
        }
    }
    FftPlanner::new().plan_fft_forward(size).process(&mut grid);
    let scale = PI / (tau * (size * size) as f64);
    (1..=count).map(|n| grid[n].norm_sqr() * scale * (2.0 * tau * (n * n) as f64).exp()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Against the sums as they are written.
    #[test]
    fn every_sum_is_the_sum() {
        let angle: Vec<f64> = (0..200).map(|k| (k as f64 * 0.11).sin() * 9.0 - 2.0).collect();
        let value: Vec<f64> = (0..200).map(|k| (k as f64 * 0.7).cos()).collect();
        for count in [1, 7, 700] {
            for (n, p) in (1..).zip(power(count, angle.iter().copied(), &value)) {
                let n = f64::from(n);
                let s: f64 = angle.iter().zip(&value).map(|(x, a)| a * (n * x).sin()).sum();
                let c: f64 = angle.iter().zip(&value).map(|(x, a)| a * (n * x).cos()).sum();
                assert!((p - (s * s + c * c)).abs() < 1e-8 * (1.0 + p), "{n} of {count}: {p} {}", s * s + c * c);
            }
        }
    }
}
