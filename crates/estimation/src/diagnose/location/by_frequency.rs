//! The residual in frequency: at the lines of the excitation and beside them.
//!
//! Under a periodic excitation a linear error answers at the excited lines only; a nonlinear one also at others, an even
//! one at even lines, an odd one at odd lines (Pintelon & Schoukens, System Identification: A Frequency Domain Approach,
//! 2012, ch. 4.3). What does not repeat with the period is foreign: a disturbance, a ripple of the turn, a drift.

use std::f64::consts::TAU;

use rustfft::{FftPlanner, num_complex::Complex};

use super::{CELLS, Side};

/// Part of a residual in a class of lines, or in a band.
#[derive(Debug, Clone, PartialEq)]
pub struct FrequencyPart {
    /// The residual.
    pub residual: Side,
    /// What the part is.
    pub of: PartOf,
    /// Lowest frequency, Hz.
    pub from: f64,
    /// Highest frequency, Hz.
    pub to: f64,
    /// Rms of the part, in the residual's unit.
    pub rms: f64,
    /// Its share of the residual's energy, the mean included; parts of the turn overlap the others.
    pub share: f64,
    /// Frequency of the largest line of the part, Hz.
    pub peak: f64,
    /// Rms of that line with its two neighbours: a frequency between two lines shows in both.
    pub peak_rms: f64,
}

/// What a part of a spectrum is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PartOf {
    /// The constant.
    Mean,
    /// Lines of the excitation.
    Excited,
    /// Even lines beside them.
    Even,
    /// Odd lines beside them.
    Odd,
    /// What does not repeat with the excitation.
    Foreign,
    /// So many periods in a turn of the motor.
    Turn(usize),
    /// A band of a spectrum without lines.
    Band,
}

/// A line is excited when it has this share of the amplitude of the largest.
const EXCITED: f64 = 1e-2;

/// Parts of the residual by frequency: classes of lines under a periodic torque, else bands; and orders of the turn.
#[must_use]
pub fn by_frequency(
    side: Side,
    residual: &[f64],
    torque: &[f64],
    theta1: &[f64],
    dt: f64,
    period: Option<usize>,
) -> Vec<FrequencyPart> {
    let mut parts = match period.filter(|p| residual.len() >= *p) {
        Some(p) => by_lines(side, residual, torque, dt, p),
        None => by_bands(side, residual, dt),
    };
    parts.extend(by_orders(side, residual, theta1, dt));
    parts
}

/// Energy (mean square) of each bin of a one-sided spectrum.
fn spectrum(y: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut a: Vec<Complex<f64>> = y.map(|v| Complex::new(v, 0.0)).collect();
    let n = a.len();
    FftPlanner::new().plan_fft_forward(n).process(&mut a);
    let scale = 1.0 / (n as f64 * n as f64);
    (0..=n / 2)
        .map(|k| if k == 0 || 2 * k == n { a[k].norm_sqr() * scale } else { 2.0 * a[k].norm_sqr() * scale })
        .collect()
}

fn part(
    side: Side,
    of: PartOf,
    lines: impl Iterator<Item = usize>,
    energy: &[f64],
    resolution: f64,
    total: f64,
) -> Option<FrequencyPart> {
    let (mut sum, mut low, mut high, mut peak) = (0.0, usize::MAX, 0, 0);
    for k in lines {
        sum += energy[k];
        if low == usize::MAX || energy[k] > energy[peak] {
            peak = k;
        }
        low = low.min(k);
        high = high.max(k);
    }
    (low != usize::MAX && total > 0.0).then(|| FrequencyPart {
        residual: side,
        of,
        from: low as f64 * resolution,
        to: high as f64 * resolution,
        rms: sum.sqrt(),
        share: sum / total,
        peak: peak as f64 * resolution,
        peak_rms: energy[peak.saturating_sub(1)..energy.len().min(peak + 2)].iter().sum::<f64>().sqrt(),
    })
}

/// Classes of lines over the last whole periods (the first holds the transient, where there is another).
fn by_lines(side: Side, residual: &[f64], torque: &[f64], dt: f64, period: usize) -> Vec<FrequencyPart> {
    let whole = residual.len() / period;
    let used = if whole > 2 { whole - 1 } else { whole } * period;
    let from = residual.len() - used;
    let energy = spectrum(residual[from..].iter().copied());
    let excitation = spectrum(torque[torque.len() - used..].iter().copied());
    let periods = used / period;
    let resolution = 1.0 / (used as f64 * dt);
    let total: f64 = energy.iter().sum();
    let largest = excitation.iter().skip(1).copied().fold(0.0, f64::max);
    let excited = |k: usize| excitation[k] > EXCITED * EXCITED * largest;
    let top = (1..energy.len()).filter(|k| excited(*k)).max().unwrap_or(0);
    let class = |k: usize| {
        if k == 0 {
            PartOf::Mean
        } else if !k.is_multiple_of(periods) {
            PartOf::Foreign
        } else if excited(k) {
            PartOf::Excited
        } else if (k / periods).is_multiple_of(2) {
            PartOf::Even
        } else {
            PartOf::Odd
        }
    };
    // Beyond twice the excited band a smoothed residual holds nothing but the smoother's own roll-off.
    let last = (2 * top).clamp(1, energy.len() - 1);
    [PartOf::Mean, PartOf::Excited, PartOf::Even, PartOf::Odd, PartOf::Foreign]
        .into_iter()
        .filter_map(|of| part(side, of, (0..=last).filter(|k| class(*k) == of), &energy, resolution, total))
        .collect()
}

/// Bands of equal width in the logarithm of the frequency.
fn by_bands(side: Side, residual: &[f64], dt: f64) -> Vec<FrequencyPart> {
    let n = residual.len();
    let mean = residual.iter().sum::<f64>() / n.max(1) as f64;
    // Hann's window, its gain in energy 3/8.
    let energy: Vec<f64> = spectrum(
        residual
            .iter()
            .enumerate()
            .map(|(k, v)| (v - mean) * (0.5 - 0.5 * (TAU * k as f64 / n as f64).cos()) / 0.375_f64.sqrt()),
    );
    let total = energy.iter().sum::<f64>() + mean * mean;
    let resolution = 1.0 / (n as f64 * dt);
    let edge = |i: usize| (energy.len() as f64).powf(i as f64 / CELLS as f64).floor() as usize;
    let mut parts = Vec::with_capacity(CELLS + 1);
    parts.extend(part(side, PartOf::Mean, std::iter::once(0), &[mean * mean], resolution, total));
    for i in 0..CELLS {
        parts.extend(part(
            side,
            PartOf::Band,
            edge(i).max(1)..edge(i + 1).min(energy.len()),
            &energy,
            resolution,
            total,
        ));
    }
    parts
}

/// Orders of the motor's turn: least squares on sine and cosine of `n*theta1`, `n` whole, each alone.
fn by_orders(side: Side, residual: &[f64], theta1: &[f64], dt: f64) -> Vec<FrequencyPart> {
    let n = residual.len().min(theta1.len());
    let (low, high) = theta1.iter().fold((f64::MAX, f64::MIN), |(l, h), v| (l.min(*v), h.max(*v)));
    // An order means something only when the axis went through two of its periods.
    let turns = (high - low) / TAU;
    let total = residual.iter().map(|v| v * v).sum::<f64>() / n.max(1) as f64;
    if n == 0 || total <= 0.0 {
        return Vec::new();
    }
    let mean = residual.iter().sum::<f64>() / n as f64;
    let rate = (high - low) / (n as f64 * dt * TAU);
    (1..=CELLS)
        .filter(|h| *h as f64 * turns >= 2.0)
        .filter_map(|h| {
            // Normal equations of [1, cos, sin].
            let mut m = nalgebra::Matrix3::<f64>::zeros();
            let mut b = nalgebra::Vector3::<f64>::zeros();
            for (r, angle) in residual.iter().zip(theta1) {
                let (s, c) = (h as f64 * angle).sin_cos();
                let v = nalgebra::Vector3::new(1.0, c, s);
                m += v * v.transpose();
                b += v * *r;
            }
            let x = m.cholesky()?.solve(&b);
            let energy = (x.dot(&b) / n as f64 - mean * mean).max(0.0);
            Some(FrequencyPart {
                residual: side,
                of: PartOf::Turn(h),
                from: h as f64 * rate,
                to: h as f64 * rate,
                rms: energy.sqrt(),
                share: energy / total,
                peak: h as f64 * rate,
                peak_rms: energy.sqrt(),
            })
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn share(parts: &[FrequencyPart], of: PartOf) -> f64 {
        parts.iter().filter(|p| p.of == of).map(|p| p.share).sum()
    }

    /// Odd lines 1, 3, ..., 15 of a period of 512 samples, four periods.
    fn torque() -> Vec<f64> {
        (0..2048)
            .map(|k| (0..8).map(|i| (TAU * f64::from((2 * i + 1) * k) / 512.0 + f64::from(i * i)).cos()).sum::<f64>())
            .collect()
    }

    #[test]
    fn a_square_lights_even_lines_a_cube_odd_ones_and_a_linear_filter_neither() {
        let t = torque();
        let theta = vec![0.0; t.len()];
        let of = |f: &dyn Fn(f64) -> f64| {
            let r: Vec<f64> = t.iter().map(|t| f(*t)).collect();
            by_frequency(Side::Motor, &r, &t, &theta, 1e-3, Some(512))
        };
        let linear = of(&|t| 0.3 * t);
        assert!(share(&linear, PartOf::Excited) > 1.0 - 1e-12);
        let square = of(&|t| t * t);
        assert!(share(&square, PartOf::Even) + share(&square, PartOf::Mean) > 1.0 - 1e-12);
        let cube = of(&|t| t.powi(3));
        // Intermodulation falls on odd lines: excited ones, and those between 16 and 30; beyond is not counted.
        assert!(share(&cube, PartOf::Even) < 1e-12 && share(&cube, PartOf::Odd) > 0.05);
    }

    #[test]
    fn a_foreign_tone_is_found_at_its_frequency() {
        let t = torque();
        // 10.25 periods in 512 samples of 1 ms: 20.02 Hz, a bin of the four periods together.
        let r: Vec<f64> = (0..2048).map(|k| (TAU * 10.25 * f64::from(k) / 512.0).sin()).collect();
        let parts = by_frequency(Side::Table, &r, &t, &r, 1e-3, Some(512));
        let foreign = parts.iter().find(|p| p.of == PartOf::Foreign).unwrap();
        // Three periods hold 30.75 of its periods: 1 - sinc(0.75)^2 - sinc(2.25)^2 - ... of it falls beside their lines.
        assert!(foreign.share > 0.85, "{foreign:?}");
        assert!((foreign.peak - 10.25 / 0.512).abs() < 1.0 / 1.5, "{foreign:?}");
    }

    #[test]
    fn a_ripple_is_tracked_to_its_order() {
        let theta: Vec<f64> = (0..4096).map(|k| 1e-6 * f64::from(k) * f64::from(k)).collect();
        let r: Vec<f64> = theta.iter().map(|a| (3.0 * a + 1.0).sin()).collect();
        let parts = by_frequency(Side::Motor, &r, &vec![0.0; 4096], &theta, 1e-3, None);
        assert!(share(&parts, PartOf::Turn(3)) > 0.95, "{parts:?}");
        assert!(share(&parts, PartOf::Turn(2)) < 0.1);
    }
}
