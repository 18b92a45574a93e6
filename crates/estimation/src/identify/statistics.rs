//! Whiteness of residuals, noise of a record, amplitude spectra as curves.

use super::result::{Series, Whiteness};
use crate::numerics::distribution::chi_squared_tail;
use crate::numerics::spectrum::dft;
use crate::trace::numerics::dot;

/// Level of the whiteness test.
const LEVEL: f64 = 0.01;

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
                let rho = dot(&centred[lag..], &centred[..n - lag]) / energy;
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
    use crate::numerics::level::noise;

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
