//! Discrete Fourier transform of real columns, and what is made by it.

use rustfft::FftPlanner;
use rustfft::num_complex::Complex;

/// One-sided discrete Fourier transform: line h of n samples is at `h/(n*dt)` Hz; amplitude of a cosine is `|X|`.
#[must_use]
pub fn dft(values: &[f64]) -> Vec<Complex<f64>> {
    let n = values.len();
    let mut spectrum: Vec<Complex<f64>> = values.iter().map(|v| Complex::new(*v, 0.0)).collect();
    FftPlanner::new().plan_fft_forward(n).process(&mut spectrum);
    spectrum.truncate(n / 2 + 1);
    for (h, x) in spectrum.iter_mut().enumerate() {
        *x *= if h == 0 || 2 * h == n { 1.0 } else { 2.0 } / n as f64;
    }
    spectrum
}

/// Sum of the products of a series with itself, one a lag from zero to `last`: through a transform that is so much longer than the series.
#[must_use]
pub fn autocorrelation(values: &[f64], last: usize) -> Vec<f64> {
    let size = fast_length(values.len() + last);
    let mut planner = FftPlanner::new();
    let mut z: Vec<Complex<f64>> = values.iter().map(|v| Complex::new(*v, 0.0)).collect();
    z.resize(size, Complex::default());
    planner.plan_fft_forward(size).process(&mut z);
    z.iter_mut().for_each(|v| *v = Complex::new(v.norm_sqr(), 0.0));
    planner.plan_fft_inverse(size).process(&mut z);
    z.iter().take(last + 1).map(|v| v.re / size as f64).collect()
}

/// The shortest length of no other factors than two and three that is at least this.
fn fast_length(at_least: usize) -> usize {
    let threes = std::iter::successors(Some(1_usize), |t| t.checked_mul(3)).take_while(|t| *t < 3 * at_least.max(1));
    let of = |threes: usize| threes * at_least.div_ceil(threes).next_power_of_two();
    threes.map(of).min().unwrap_or(1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn products_at_every_lag_are_those_that_are_summed_one_by_one() {
        let values: Vec<f64> = (0..50).map(|k| (f64::from(k) * 0.7).sin() + 0.1 * f64::from(k % 7)).collect();
        let found = autocorrelation(&values, 26);
        assert_eq!(found.len(), 27);
        for (lag, found) in found.iter().enumerate() {
            let summed: f64 = values.iter().zip(&values[lag..]).map(|(a, b)| a * b).sum();
            assert!((found - summed).abs() < 1e-12, "{lag}: {found} {summed}");
        }
    }

    /// A number without a factor.
    fn without(n: usize, factor: usize) -> usize {
        if n.is_multiple_of(factor) { without(n / factor, factor) } else { n }
    }

    #[test]
    fn a_fast_length_is_the_shortest_of_twos_and_threes() {
        for at_least in 1..2000 {
            let is_fast = |n: &usize| [2, 3].iter().fold(*n, |n, p| without(n, *p)) == 1;
            assert_eq!(Some(fast_length(at_least)), (at_least..).find(is_fast));
        }
    }
}
