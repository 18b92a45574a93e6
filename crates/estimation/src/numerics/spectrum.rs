//! Discrete Fourier transform of real columns.

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
