//! Whiteness of residuals, tail of the chi-squared distribution, noise of a record, spectra.

use rustfft::FftPlanner;
use rustfft::num_complex::Complex;

use super::result::{Series, Whiteness};

/// Level of the whiteness test.
const LEVEL: f64 = 0.01;

/// Probability that chi-squared with `dof` degrees of freedom exceeds `x`.
#[must_use]
pub fn chi_squared_tail(x: f64, dof: f64) -> f64 {
    gamma_q(0.5 * dof, 0.5 * x)
}

/// Regularised upper incomplete gamma function Q(a, x): series below a + 1, continued fraction above (Press et al.,
/// Numerical Recipes, 3rd ed., 6.2).
fn gamma_q(a: f64, x: f64) -> f64 {
    if x.is_nan() || a.is_nan() {
        return f64::NAN;
    }
    if x <= 0.0 {
        return 1.0;
    }
    let front = (a * x.ln() - x - ln_gamma(a)).exp();
    if x < a + 1.0 {
        let (mut term, mut sum, mut n) = (1.0 / a, 1.0 / a, a);
        while f64::abs(term) > f64::abs(sum) * 1e-16 {
            n += 1.0;
            term *= x / n;
            sum += term;
        }
        1.0 - front * sum
    } else {
        // Lentz's method.
        let tiny = 1e-300;
        let mut b = x + 1.0 - a;
        let mut c = 1.0 / tiny;
        let mut d = 1.0 / b;
        let mut h = d;
        for i in 1..10_000 {
            let an = -f64::from(i) * (f64::from(i) - a);
            b += 2.0;
            d = an * d + b;
            d = 1.0 / if d.abs() < tiny { tiny } else { d };
            c = b + an / c;
            c = if c.abs() < tiny { tiny } else { c };
            let factor = d * c;
            h *= factor;
            if (factor - 1.0).abs() < 1e-15 {
                break;
            }
        }
        front * h
    }
}

/// Logarithm of the gamma function for positive arguments (Lanczos, g = 7, n = 9; Godfrey's coefficients).
fn ln_gamma(x: f64) -> f64 {
    const C: [f64; 9] = [
        0.999_999_999_999_809_9,
        676.520_368_121_885_1,
        -1_259.139_216_722_402_8,
        771.323_428_777_653_1,
        -176.615_029_162_140_6,
        12.507_343_278_686_905,
        -0.138_571_095_265_720_12,
        9.984_369_578_019_572e-6,
        1.505_632_735_149_311_6e-7,
    ];
    if x < 0.5 {
        return (std::f64::consts::PI / (std::f64::consts::PI * x).sin()).ln() - ln_gamma(1.0 - x);
    }
    let x = x - 1.0;
    let t = x + 7.5;
    let sum = C[0] + C[1..].iter().enumerate().map(|(i, c)| c / (x + i as f64 + 1.0)).sum::<f64>();
    0.5 * (2.0 * std::f64::consts::PI).ln() + (x + 0.5) * t.ln() - t + sum.ln()
}

/// Ljung-Box test over 25 lags (fewer for a short record): `Q = n*(n + 2)*sum_l rho_l^2/(n - l)`, chi-squared with as
/// many degrees of freedom (G. M. Ljung, G. E. P. Box, Biometrika 65, 1978).
#[must_use]
pub fn whiteness(residual: &[f64]) -> Whiteness {
    let n = residual.len();
    let lags = 25.min(n / 4).max(1);
    let mean = residual.iter().sum::<f64>() / n.max(1) as f64;
    let centred: Vec<f64> = residual.iter().map(|v| v - mean).collect();
    let energy: f64 = centred.iter().map(|v| v * v).sum();
    if energy <= 0.0 || n < 2 {
        return Whiteness { q: 0.0, lags, p_value: 1.0, white: true };
    }
    let size = n as f64;
    let q = size
        * (size + 2.0)
        * (1..=lags)
            .map(|lag| {
                let rho = centred[lag..].iter().zip(&centred).map(|(a, b)| a * b).sum::<f64>() / energy;
                rho * rho / (size - lag as f64)
            })
            .sum::<f64>();
    let p_value = chi_squared_tail(q, lags as f64);
    Whiteness { q, lags, p_value, white: p_value >= LEVEL }
}

/// Standard deviation of the white noise on a smooth record, from its sixth differences: `var = sum(d6^2)/(n*924)`,
/// 924 = C(12, 6) the squared norm of the difference's weights.
#[must_use]
pub fn noise_level(values: &[f64]) -> f64 {
    const WEIGHTS: [f64; 7] = [1.0, -6.0, 15.0, -20.0, 15.0, -6.0, 1.0];
    if values.len() < 7 {
        return 0.0;
    }
    let sum: f64 = values.windows(7).map(|w| w.iter().zip(WEIGHTS).map(|(v, c)| v * c).sum::<f64>().powi(2)).sum();
    (sum / ((values.len() - 6) as f64 * 924.0)).sqrt()
}

/// Root mean square.
#[must_use]
pub fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|v| v * v).sum::<f64>() / values.len().max(1) as f64).sqrt()
}

/// Root mean square about the mean.
#[must_use]
pub fn deviation(values: &[f64]) -> f64 {
    let mean = values.iter().sum::<f64>() / values.len().max(1) as f64;
    (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / values.len().max(1) as f64).sqrt()
}

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

/// Amplitude spectrum as a curve, at most 4096 lines from zero on.
#[must_use]
pub fn spectrum(name: impl Into<String>, unit: &'static str, dt: f64, values: &[f64]) -> Series {
    let lines = dft(values);
    // Longer records have more lines than a plot can show: keep the largest of each bucket.
    let bucket = lines.len().div_ceil(4096).max(1);
    let resolution = 1.0 / (values.len().max(1) as f64 * dt);
    let (mut x, mut y) = (Vec::new(), Vec::new());
    for (b, group) in lines.chunks(bucket).enumerate() {
        let (i, amplitude) = group
            .iter()
            .map(|c| c.norm())
            .enumerate()
            .fold((0, 0.0), |best, new| if new.1 > best.1 { new } else { best });
        x.push((b * bucket + i) as f64 * resolution);
        y.push(amplitude);
    }
    Series { name: name.into(), x_unit: "Hz", y_unit: unit, x, y }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};

    fn noise(n: usize, seed: u64) -> Vec<f64> {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
        (0..n).map(|_| StandardNormal.sample(&mut rng)).collect()
    }

    #[test]
    fn the_chi_squared_tail_has_the_values_of_scipy() {
        // scripts/oracles/identify.py: scipy.stats.chi2.sf
        for (x, dof, expected) in [
            (18.307_038_053_275_143, 10.0, 0.05),
            (44.314_104_896_219_15, 25.0, 0.01),
            (5.0, 25.0, 0.999_994_468_182_781_1),
            (200.0, 25.0, 3.067_349_163_473_132_7e-29),
        ] {
            let found: f64 = chi_squared_tail(x, dof);
            assert!((found / expected - 1.0).abs() < 1e-12, "{x} {dof}: {found:e}");
        }
    }

    #[test]
    fn white_noise_passes_and_a_moving_average_fails() {
        let e = noise(5000, 11);
        assert!(whiteness(&e).white, "{:?}", whiteness(&e));
        let coloured: Vec<f64> = e.windows(2).map(|w| w[1] + 0.3 * w[0]).collect();
        assert!(!whiteness(&coloured).white);
    }

    #[test]
    fn the_noise_under_a_smooth_signal_is_measured() {
        let values: Vec<f64> =
            noise(20_000, 12).iter().enumerate().map(|(k, e)| 3.0 * (k as f64 * 0.02).sin() + 1e-3 * e).collect();
        assert!((noise_level(&values) / 1e-3 - 1.0).abs() < 0.03);
    }

    #[test]
    fn a_line_of_the_spectrum_is_the_amplitude_of_its_cosine() {
        let values: Vec<f64> =
            (0..200).map(|k| 0.5 + 2.0 * (std::f64::consts::TAU * 7.0 * f64::from(k) / 200.0 + 0.3).cos()).collect();
        let lines = dft(&values);
        assert!((lines[7].norm() - 2.0).abs() < 1e-12 && (lines[7].arg() - 0.3).abs() < 1e-12);
        assert!((lines[0].re - 0.5).abs() < 1e-12 && lines[8].norm() < 1e-12);
        let curve = spectrum("T", "N.m", 0.01, &values);
        assert!((curve.x[7] - 3.5).abs() < 1e-12);
    }
}
