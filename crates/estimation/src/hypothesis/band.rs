//! The band of the motion, and the samples that count.

use super::likelihood::Sight;
use crate::axis::Structure;
use crate::conditioning::Record;
use rustfft::{FftPlanner, num_complex::Complex};

/// Share of the acceleration's power that the band of the motion holds, and how far beyond it goes.
const POWER: f64 = 0.995;
const BEYOND: f64 = 1.5;
/// Power of the acceleration over that of the encoders' noise with which the motion shows.
const SHOWS: f64 = 4.0;
/// The same with which it rules: under control feedback ties torque and noise together (Gautier & Khalil's practice).
const RULES: f64 = 400.0;

/// Bins that a band has at least, where the motion may show and not rule: a few causes follow fewer, whatever these are of.
const FEWEST: usize = 8;

/// How far a band goes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reach {
    /// As far as the motion is, where it rules.
    Ruled,
    /// As far as the motion is, where it shows.
    Shown,
    /// As far as anything of the motion shows.
    Whole,
}

/// Share of the record over which the window rises at either end. The noise that the window spreads stands in the lowest bins alike, in the
/// more of them the shorter it rises; the longer, the less of the record counts.
const EDGE: f64 = 0.05;
/// The same where a hidden inertia's beginning is taken out of those bins: it would follow what is alike in them.
const EDGE_OF_HIDDEN: f64 = 0.1;
/// Samples over which the window falls to an idle stretch.
const SOFT: usize = 24;

/// Window with soft ends, and none of it over idle stretches.
pub fn mask(record: &Record, structure: Structure) -> Vec<f64> {
    let n = record.len();
    let rise = |d: f64, edge: f64| {
        if d >= edge { 1.0 } else { 0.5 * (1.0 - (std::f64::consts::PI * (d + 0.5) / edge).cos()) }
    };
    let hidden = Sight::of(record, structure).is_of_one_side();
    let edge = (if hidden { EDGE_OF_HIDDEN } else { EDGE } * n as f64).max(8.0);
    let settling = (record.settling / record.dt).min(0.125 * n as f64);
    let outside = |k: usize| k.min(n - 1 - k) as f64 - settling;
    let mut mask: Vec<f64> = (0..n).map(|k| if outside(k) < 0.0 { 0.0 } else { rise(outside(k), edge) }).collect();
    for idle in &record.idle {
        for (k, w) in mask.iter_mut().enumerate().take(idle.end + SOFT).skip(idle.start.saturating_sub(SOFT)) {
            let distance = idle.start.saturating_sub(k + 1).max(k.saturating_sub(idle.end));
            *w *= if idle.contains(&k) { 0.0 } else { rise(distance as f64, SOFT as f64) };
        }
    }
    mask
}

/// Smoothed spectra of the acceleration of a side and of its noise.
fn acceleration(record: &Record, side: usize, mask: &[f64]) -> Option<(Vec<f64>, Vec<f64>)> {
    let n = record.len();
    let dt = record.dt;
    let (series, kind): (Vec<f64>, usize) = if let Some(y) = &record.channels[2 * side] {
        (
            (0..n)
                .map(|k| if k == 0 || k + 1 == n { 0.0 } else { (y[k + 1] - 2.0 * y[k] + y[k - 1]) / (dt * dt) })
                .collect(),
            2,
        )
    } else {
        let v = record.channels[2 * side + 1].as_ref()?;
        ((0..n).map(|k| if k + 1 == n { 0.0 } else { (v[k + 1] - v[k]) / dt }).collect(), 1)
    };
    let mut z: Vec<Complex<f64>> = series.iter().zip(mask).map(|(a, w)| Complex::new(a * w, 0.0)).collect();
    FftPlanner::new().plan_fft_forward(n).process(&mut z);
    let power = mask.iter().map(|w| w * w).sum::<f64>();
    let p: Vec<f64> = z[..n / 2].iter().map(|z| z.norm_sqr() / power).collect();
    let noise = (0..n / 2)
        .map(|m| {
            let w = std::f64::consts::TAU * m as f64 / n as f64;
            let c = 2.0 * (1.0 - w.cos()) / (dt * dt);
            let frequency = m.max(1) as f64 / (n as f64 * dt);
            if kind == 2 {
                record.position_noise(side, frequency) * c * c
            } else {
                record.noise[2 * side + 1].powi(2) * c
            }
        })
        .collect();
    let half = (n / 400).max(2);
    let mut sum = vec![0.0; p.len() + 1];
    for (i, v) in p.iter().enumerate() {
        sum[i + 1] = sum[i] + v;
    }
    let smooth = (0..p.len())
        .map(|i| {
            let (a, b) = (i.saturating_sub(half), (i + half + 1).min(p.len()));
            (sum[b] - sum[a]) / (b - a) as f64
        })
        .collect();
    Some((smooth, noise))
}

/// Upper end of the band, Hz.
pub fn limit(record: &Record, mask: &[f64], reach: Reach) -> f64 {
    let snr = if reach == Reach::Ruled { RULES } else { SHOWS };
    let (power, beyond) = if reach == Reach::Whole { (1.0, 1.0) } else { (POWER, BEYOND) };
    let n = record.len();
    let step = 1.0 / (n as f64 * record.dt);
    let mut best = 0.0_f64;
    for side in 0..2 {
        let Some((p, noise)) = acceleration(record, side, mask) else { continue };
        let stands = |m: usize| p[m] > snr * noise[m];
        let top = (0..p.len()).rev().find(|m| stands(*m)).unwrap_or(p.len() / 10);
        let signal: Vec<f64> = (0..=top).map(|m| (p[m] - noise[m]).max(0.0)).collect();
        let all: f64 = signal.iter().sum();
        let mut sum = 0.0;
        let at = signal
            .iter()
            .position(|s| {
                sum += s;
                sum >= power * all
            })
            .unwrap_or(top);
        let f = ((beyond * at as f64) as usize).min(top).max(FEWEST) as f64 * step;
        best = best.max(f);
    }
    best.min(0.4 / record.dt)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::axis::Hold;

    #[test]
    fn the_band_of_a_slow_motion_has_bins_enough_and_that_of_a_fast_one_ends_half_as_far_beyond_it() {
        // Two periods and sixty over four seconds, whose window spreads them over a bin or two.
        for (periods, least, most) in [(2.0, 8, 8), (60.0, 90, 100)] {
            let (n, dt) = (400, 1e-2);
            let way = |k: i32| (std::f64::consts::TAU * periods * f64::from(k) / f64::from(n)).sin();
            let theta = (0..n).map(way).collect();
            let mut record = Record::new(dt, Hold::Linear, vec![0.0; n as usize], [Some(theta), None, None, None]);
            record.noise[0] = 1e-9;
            let bins = limit(&record, &mask(&record, Structure::Rigid), Reach::Ruled) * f64::from(n) * dt;
            assert!((f64::from(least) - 0.5..f64::from(most) + 0.5).contains(&bins), "{periods}: {bins}");
        }
    }
}
