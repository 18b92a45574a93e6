//! The noise floor of a record, from the record itself.
//!
//! The `n`-th difference of a smooth signal vanishes while that of white noise keeps the variance
//! `C(2n, n)*sigma^2`; so `sigma` is the level at which the scaled differences of rising order settle (difference
//! table of Hamming, Numerical Methods for Scientists and Engineers, 1973, ch. 10; More & Wild, Estimating computational
//! noise, SIAM J. Sci. Comput. 33, 2011). Levels are medians over blocks: a jump of friction or contact affects its own
//! block alone. Where the excitation repeats, the difference of two periods is free of the repeated motion from the
//! start, and serves as one more candidate. What stays of the signal can only raise a level.
//!
//! Assumed: the noise is white at the sampling rate, or grows below a corner ([`super::colour`]). Where the levels never settle, the
//! lowest part of the spectrum is it. What grows with the speed ([`super::jitter`]) counts with its mean over the record.

use rayon::prelude::*;

use super::colour::corner;
use super::jitter::growth;
use crate::numerics::spectrum::autocorrelation;
use crate::trace::floor;

/// Highest order of difference.
const ORDERS: usize = 12;
/// Lowest order that counts as free of the signal.
const LOWEST: usize = 3;
/// Samples in a block.
const BLOCK: usize = 128;
/// Two levels agree when they differ by no more than this factor: three standard errors of a level from 40 blocks.
const AGREE: f64 = 1.1;

/// Mean of `1/f` over the frequencies that third differences see, `sin^6(pi f)`, in samples a cycle.
const SEEN: f64 = 2.58;

/// Where the noise level of a channel comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum NoiseMethod {
    /// Not measured.
    Absent,
    /// Differences of the channel converged at this order.
    Differences {
        /// The order.
        order: usize,
    },
    /// Differences between periods converged at this order.
    Periods {
        /// The order.
        order: usize,
    },
    /// The resolution of the channel, which is coarser than its noise.
    Resolution,
    /// No level of the differences settled: the motion reaches up to the noise's own frequencies. The lowest part of the spectrum
    /// of an autoregressive model.
    Spectrum,
    /// Nothing tells it: the noise is not white, or the signal fills the whole band. The lowest level of the differences, or the
    /// scatter from period to period.
    Unsettled,
}

/// The noise of a record.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct NoiseEstimate {
    /// Standard deviation of each channel's noise, its resolution included; zero where the channel is absent.
    pub std: [f64; 4],
    /// Frequency below which the noise of theta1 and of theta2 grows as 1/f, cycles a sample; zero where it is white. The standard
    /// deviation is then that of the white part.
    pub corner: [f64; 2],
    /// Covariance of the noises of theta1 and theta2, which are read at one time: what a jitter of the samples makes in both, rad^2.
    pub common: f64,
    /// Standard deviation of the time by which samples of a position are taken early or late, in samples, where that rules its noise.
    pub jitter: Option<f64>,
    /// How each was found.
    pub method: [NoiseMethod; 4],
    /// Step of the values of a channel, where it is coarse enough to matter against the noise.
    pub quantum: [Option<f64>; 4],
    /// Scatter from period to period about a straight line in each period, divided by sqrt(2); it holds all that does
    /// not repeat with the excitation: a drift, a foreign frequency, a ripple of the turn. `None` without periods.
    pub scatter: [Option<f64>; 4],
    /// Period of the excitation, samples.
    pub period: Option<usize>,
}

/// The noise of the channels, each as long as the torque.
///
/// `period` is that of the excitation in samples; without it the torque is searched for one.
#[must_use]
pub fn estimate_noise(torque: &[f64], channels: &[Option<&[f64]>; 4], period: Option<usize>) -> NoiseEstimate {
    let period = period.filter(|p| *p > 0 && *p < torque.len()).or_else(|| find_period(torque));
    let mut estimate = NoiseEstimate {
        std: [0.0; 4],
        corner: [0.0; 2],
        common: 0.0,
        jitter: None,
        method: [NoiseMethod::Absent; 4],
        quantum: [None; 4],
        scatter: [None; 4],
        period,
    };
    let of_each: Vec<Option<OfChannel>> =
        (0..4).into_par_iter().map(|c| Some(OfChannel::estimate(channels[c]?, c.is_multiple_of(2), period))).collect();
    for (c, found) in of_each.into_iter().enumerate() {
        let Some(found) = found else { continue };
        (estimate.std[c], estimate.method[c]) = (found.std, found.method);
        (estimate.quantum[c], estimate.scatter[c]) = (found.quantum, found.scatter);
        estimate.jitter = [estimate.jitter, found.jitter].into_iter().flatten().reduce(f64::max);
    }
    for side in 0..2 {
        let Some(corner) = channels[2 * side].and_then(corner) else { continue };
        estimate.corner[side] = corner;
        estimate.std[2 * side] /= (1.0 + SEEN * corner).sqrt();
    }
    if let (
        [Some(a), _, Some(b), _],
        [NoiseMethod::Differences { order: m }, _, NoiseMethod::Differences { order: n }, _],
    ) = (channels, estimate.method)
        && let Some((common, own)) = common_variance(a, b, m.max(n))
    {
        estimate.common = common;
        (estimate.std[0], estimate.std[2]) = ((common + own[0]).sqrt(), (common + own[1]).sqrt());
    }
    estimate
}

/// The noise of one channel; the fields are those of a [`NoiseEstimate`].
struct OfChannel {
    std: f64,
    method: NoiseMethod,
    jitter: Option<f64>,
    quantum: Option<f64>,
    scatter: Option<f64>,
}

impl OfChannel {
    /// Of a speed the samples' times are not told.
    fn estimate(y: &[f64], is_position: bool, period: Option<usize>) -> Self {
        let (level, method) = level_of(y, period);
        let quantum = quantum(y).filter(|q| *q > 0.2 * level);
        let resolution = quantum.map_or(0.0, |q| q / 12.0_f64.sqrt());
        let scatter = period.and_then(|p| scatter(y, p));
        let (std, method) = match method {
            _ if resolution > level => (resolution, NoiseMethod::Resolution),
            NoiseMethod::Unsettled => (scatter.map_or(level, |s| s.max(level)), method),
            _ => (level, method),
        };
        let jitter = match method {
            NoiseMethod::Differences { order } if is_position => jitter(y, order),
            _ => None,
        };
        Self { std, method, jitter, quantum, scatter }
    }
}

/// The variance that the noises of two positions have in common, by their differences of an order, and that of each alone: of samples
/// taken late both show the same, and the twist none of it.
fn common_variance(a: &[f64], b: &[f64], order: usize) -> Option<(f64, [f64; 2])> {
    let power = |d: &[f64]| block_median(d, order) / binomial(2 * order);
    let [first, second] = [at_rest(a, a, order)?, at_rest(b, b, order)?];
    let rest = [power(&first.0), power(&second.0)];
    let twist: Vec<f64> = a.iter().zip(b).map(|(a, b)| a - b).collect();
    let twist_power = power(&differences(&twist, order));
    let all = (rest[0] * first.1 * rest[1] * second.1).sqrt();
    let common = all - 0.5 * twist_power;
    (common > 0.0).then(|| (common, rest.map(|r| twist_power * r / (rest[0] + rest[1]).max(f64::MIN_POSITIVE))))
}

/// The level at which differences settle, of the channel or of its periods, whichever is lower.
fn level_of(y: &[f64], period: Option<usize>) -> (f64, NoiseMethod) {
    let plain = converged_level(y).map(|(level, order)| (with_speed(y, y, order).unwrap_or(level), order));
    let periodic = period.filter(|p| y.len() >= p + 2 * BLOCK).map(|p| {
        let difference: Vec<f64> = (p..y.len()).map(|k| (y[k] - y[k - p]) / 2.0_f64.sqrt()).collect();
        converged_level(&difference)
            .map(|(level, order)| (with_speed(&difference, &y[..y.len() - p], order).unwrap_or(level), order))
    });
    let unsettled = |level: f64| {
        let found = floor(y).filter(|found| *found < level);
        found.map_or((level, NoiseMethod::Unsettled), |found| (found, NoiseMethod::Spectrum))
    };
    match (plain, periodic) {
        (Ok((a, order)), Some(Ok((b, lower)))) if b * AGREE < a || (b < a * AGREE && lower < order) => {
            (b, NoiseMethod::Periods { order: lower })
        }
        (Ok((level, order)), _) => (level, NoiseMethod::Differences { order }),
        (Err(_), Some(Ok((level, order)))) => (level, NoiseMethod::Periods { order }),
        (Err(a), Some(Err(b))) => unsettled(a.min(b)),
        (Err(level), None) => unsettled(level),
    }
}

/// The level of the noise in a series, over the record, where it grows with the speed of a position.
fn with_speed(series: &[f64], position: &[f64], order: usize) -> Option<f64> {
    let (differences, grown) = at_rest(series, position, order)?;
    Some((block_median(&differences, order) / binomial(2 * order) * grown).sqrt())
}

/// Standard deviation of the time by which the samples of a position are early or late, in samples, by its differences of an order; `None`
/// where that is not the larger part of its noise.
fn jitter(y: &[f64], order: usize) -> Option<f64> {
    let (differences, grown) = at_rest(y, y, order)?;
    let by_speed = block_median(&differences, order) / binomial(2 * order) * (grown - 1.0);
    let speed = y.windows(2).map(|w| (w[1] - w[0]).powi(2)).sum::<f64>() / (y.len() - 1) as f64;
    (grown > 2.0).then(|| (by_speed / speed).sqrt())
}

/// Differences of a series with the noise that they have where the axis stands, and how much the variance grows over the record.
fn at_rest(series: &[f64], position: &[f64], order: usize) -> Option<(Vec<f64>, f64)> {
    let d = differences(series, order);
    let grown = growth(position, &d)?;
    Some((d.iter().zip(&grown.factor).map(|(d, f)| d / f.sqrt()).collect(), grown.mean))
}

/// Differences of an order.
fn differences(y: &[f64], order: usize) -> Vec<f64> {
    let mut d = y.to_vec();
    (0..order).for_each(|_| differ(&mut d));
    d
}

/// Each value less the one before it.
fn differ(d: &mut Vec<f64>) {
    for k in 1..d.len() {
        d[k - 1] = d[k] - d[k - 1];
    }
    d.pop();
}

/// The level at which three orders in a row agree, and the lowest of them; else the lowest level.
fn converged_level(y: &[f64]) -> Result<(f64, usize), f64> {
    let levels = levels(y);
    for n in LOWEST..levels.len().saturating_sub(1) {
        let (low, high) = levels[n - 1..=n + 1].iter().fold((f64::MAX, 0.0_f64), |(l, h), v| (l.min(*v), h.max(*v)));
        if high <= low * AGREE {
            // The lowest order has the most independent samples.
            return Ok((levels[n - 1], n));
        }
    }
    Err(levels.iter().copied().fold(f64::MAX, f64::min).min(f64::MAX))
}

/// Levels of the noise by differences of order 1, 2, ...: robust standard deviation, scaled to that of white noise.
fn levels(y: &[f64]) -> Vec<f64> {
    let mut d = y.to_vec();
    let mut gain = 1.0;
    let mut levels = Vec::with_capacity(ORDERS);
    for n in 1..=ORDERS {
        if d.len() < 2 {
            break;
        }
        differ(&mut d);
        // C(2n, n) = C(2n-2, n-1)*(2n)*(2n-1)/n^2.
        let m = n as f64;
        gain *= 2.0 * m * (2.0 * m - 1.0) / (m * m);
        levels.push((block_median(&d, n) / gain).sqrt());
    }
    levels
}

/// Median over blocks of the mean square of `n`-th differences, corrected for the skew of a chi-square.
fn block_median(d: &[f64], n: usize) -> f64 {
    let block = BLOCK.min(d.len());
    let mut powers: Vec<f64> =
        d.chunks_exact(block).map(|b| b.iter().map(|v| v * v).sum::<f64>() / block as f64).collect();
    powers.sort_by(f64::total_cmp);
    let m = powers.len();
    let median = 0.5 * (powers[(m - 1) / 2] + powers[m / 2]);
    // Differences of white noise are correlated: sum of the squared correlations is C(4n, 2n)/C(2n, n)^2. With v degrees
    // of freedom the median of chi2/v is (1 - 2/(9v))^3 (Wilson & Hilferty 1931).
    let freedom = block as f64 * binomial(2 * n).powi(2) / binomial(4 * n);
    median / (1.0 - 2.0 / (9.0 * freedom)).powi(3)
}

/// The central binomial coefficient `C(m, m/2)` of an even `m`.
fn binomial(m: usize) -> f64 {
    (1..=m / 2).map(|k| (m / 2 + k) as f64 / k as f64).product()
}

/// Scatter from period to period, each difference of two periods about its own straight line, over sqrt(2).
fn scatter(y: &[f64], period: usize) -> Option<f64> {
    let whole = y.len() / period;
    // The first period holds the transient where there are others.
    let first = usize::from(whole > 2);
    let mut sum = 0.0;
    let mut count = 0.0;
    for m in first..whole.saturating_sub(1) {
        let d: Vec<f64> = (m * period..(m + 1) * period).map(|k| y[k + period] - y[k]).collect();
        let centre = 0.5 * (period as f64 - 1.0);
        let mean = d.iter().sum::<f64>() / period as f64;
        let (mut sx, mut sxy) = (0.0, 0.0);
        for (k, v) in d.iter().enumerate() {
            let x = k as f64 - centre;
            sx += x * x;
            sxy += x * (v - mean);
        }
        let slope = if sx > 0.0 { sxy / sx } else { 0.0 };
        sum += d.iter().enumerate().map(|(k, v)| (v - mean - slope * (k as f64 - centre)).powi(2)).sum::<f64>();
        count += period as f64 - 2.0;
    }
    (count > 0.0).then(|| (0.5 * sum / count).sqrt())
}

/// The shortest period of a torque that repeats: at least two periods, and a remainder below a twentieth of its rms
/// from one to the next, so that a measured current's noise is forgiven. `None` when it does not repeat.
#[must_use]
pub fn find_period(torque: &[f64]) -> Option<usize> {
    let n = torque.len();
    if n < 16 {
        return None;
    }
    let mean = torque.iter().sum::<f64>() / n as f64;
    let power = torque.iter().map(|t| (t - mean).powi(2)).sum::<f64>() / n as f64;
    if power <= 0.0 {
        return None;
    }
    // A period is a peak of the unbiased autocorrelation.
    let centred: Vec<f64> = torque.iter().map(|t| t - mean).collect();
    let products = autocorrelation(&centred, n / 2 + 1);
    let correlation = |lag: usize| products[lag] / ((n - lag) as f64 * power);
    let repeats = |lag: usize| {
        let d = (lag..n).map(|k| (torque[k] - torque[k - lag]).powi(2)).sum::<f64>() / (n - lag) as f64;
        d < 0.05_f64.powi(2) * power
    };
    (4..=n / 2).find(|&lag| {
        correlation(lag) > 0.9
            && correlation(lag) >= correlation(lag - 1)
            && correlation(lag) >= correlation(lag + 1)
            && repeats(lag)
    })
}

/// The step of values that lie on a lattice: gaps between neighbouring values are all whole multiples of it.
///
/// Needs at least eight different values; of a lattice so fine that the values' own rounding hides it nothing is said.
pub(super) fn quantum(y: &[f64]) -> Option<f64> {
    let mut values: Vec<f64> = y.iter().copied().filter(|v| v.is_finite()).collect();
    values.sort_by(f64::total_cmp);
    let scale = values.first()?.abs().max(values.last()?.abs());
    // Values that differ by their rounding (twelve digits in a log) are the same.
    let rounding = 1e-11 * scale;
    values.dedup_by(|b, a| *b - *a <= rounding);
    if values.len() < 8 {
        return None;
    }
    let mut gaps: Vec<f64> = values.windows(2).map(|w| w[1] - w[0]).collect();
    // Small gaps first: each refines the step enough to count the next.
    gaps.sort_by(f64::total_cmp);
    let mut step = gaps[0];
    // Euclid's algorithm on values with rounding: a gap that is no multiple leaves a remainder that is a smaller step.
    for _ in 0..8 {
        if step < 20.0 * rounding {
            return None;
        }
        match whole_multiples(&gaps, step) {
            Ok(refined) => return Some(refined),
            Err(remainder) => step = remainder,
        }
    }
    None
}

/// The step of which all gaps are whole multiples, refined from a first guess; else the first remainder.
fn whole_multiples(gaps: &[f64], guess: f64) -> Result<f64, f64> {
    let (mut length, mut count, mut step) = (0.0, 0.0, guess);
    for gap in gaps {
        let whole = (gap / step).round();
        let remainder = (gap - whole * step).abs();
        if remainder > 0.05 * step {
            return Err(remainder);
        }
        length += gap;
        count += whole;
        step = length / count;
    }
    Ok(step)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    use super::*;

    fn white(n: usize, std: f64, seed: u64) -> Vec<f64> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        (0..n)
            .map(|_| {
                let v: f64 = StandardNormal.sample(&mut rng);
                v * std
            })
            .collect()
    }

    /// Lines up to a tenth of the sampling rate, amplitude falling with the square of the frequency, on a ramp.
    fn motion(n: usize, period: usize) -> Vec<f64> {
        (0..n)
            .map(|k| {
                (1..=period / 10)
                    .map(|h| ((TAU * (h * k) as f64 / period as f64) + (h * h) as f64).sin() / (h * h) as f64)
                    .sum::<f64>()
                    + 0.01 * k as f64
            })
            .collect()
    }

    #[test]
    fn noise_under_a_motion_a_hundred_thousand_times_larger_is_found_to_a_few_per_cent() {
        for std in [1e-6, 1e-4, 1e-2] {
            let y: Vec<f64> = motion(8192, 4096).iter().zip(white(8192, std, 3)).map(|(m, e)| m + e).collect();
            let torque = white(8192, 1.0, 4);
            let estimate = estimate_noise(&torque, &[Some(&y), None, None, None], None);
            assert_eq!(estimate.period, None);
            // Standard error of a level: about 2 % with 64 blocks of 35 degrees of freedom.
            assert!((estimate.std[0] / std - 1.0).abs() < 0.06, "{std}: {estimate:?}");
        }
    }

    #[test]
    fn a_jump_of_acceleration_now_and_then_does_not_raise_the_floor() {
        let mut y = white(8192, 1e-6, 5);
        // Every 700 samples the acceleration changes by 1e-3 per sample^2.
        for (k, v) in y.iter_mut().enumerate() {
            let t = (k % 1400) as f64 - 700.0;
            *v += 0.5e-3 * t * t.abs();
        }
        let estimate = estimate_noise(&white(8192, 1.0, 6), &[Some(&y), None, None, None], None);
        assert!((estimate.std[0] / 1e-6 - 1.0).abs() < 0.06, "{estimate:?}");
    }

    #[test]
    fn samples_taken_late_count_with_their_mean_and_in_both_encoders_alike() {
        let (own, jitter) = ([2e-5, 5e-5], 0.03);
        let m = motion(8192, 4096);
        let late = white(8192, jitter, 21);
        let read = |own: f64, seed: u64| -> Vec<f64> {
            let e = white(8192, own, seed);
            (0..8192).map(|k| m[k] + late[k] * (m[k] - m[k.max(1) - 1]) + e[k]).collect()
        };
        let [a, b] = [read(own[0], 22), read(own[1], 23)];
        let estimate = estimate_noise(&white(8192, 1.0, 24), &[Some(&a), None, Some(&b), None], None);
        let common_variance = m.windows(2).map(|w| (jitter * (w[1] - w[0])).powi(2)).sum::<f64>() / 8191.0;
        for (c, own) in [(0, own[0]), (2, own[1])] {
            let all = (common_variance + own * own).sqrt();
            assert!((estimate.std[c] / all - 1.0).abs() < 0.1, "{estimate:?} {all}");
        }
        assert!((estimate.common / common_variance - 1.0).abs() < 0.2, "{estimate:?} {common_variance}");
        let found = estimate.jitter.expect("it rules the noise");
        assert!((found / jitter - 1.0).abs() < 0.1, "{found}");
    }

    #[test]
    fn the_shortest_period_is_found_and_white_noise_has_none() {
        let one = white(1024, 1.0, 7);
        let torque: Vec<f64> = (0..8192).map(|k| one[k % 1024]).collect();
        assert_eq!(find_period(&torque), Some(1024));
        let measured: Vec<f64> = torque.iter().zip(white(8192, 0.02, 8)).map(|(t, e)| t + e).collect();
        assert_eq!(find_period(&measured), Some(1024));
        assert_eq!(find_period(&white(8192, 1.0, 9)), None);
    }

    #[test]
    fn where_the_signal_fills_the_band_the_periods_give_the_floor() {
        // White motion, repeated: differences of any order see the motion.
        let one = white(1024, 1.0, 10);
        let y: Vec<f64> = white(8192, 1e-3, 11).iter().enumerate().map(|(k, e)| one[k % 1024] + e).collect();
        let estimate = estimate_noise(&y, &[Some(&y), None, None, None], None);
        assert_eq!(estimate.period, Some(1024));
        assert!((estimate.std[0] / 1e-3 - 1.0).abs() < 0.06, "{estimate:?}");
        let scatter = estimate.scatter[0].expect("there are periods");
        // 6 pairs of 1024 samples: relative standard error 1/sqrt(2*6144), three times that and the pairs' overlap.
        assert!((scatter / 1e-3 - 1.0).abs() < 0.05, "{scatter}");
    }

    #[test]
    fn a_quantised_channel_is_found_with_its_step_and_a_finer_step_than_the_noise_is_not_named() {
        let step = TAU / 2500.0;
        let quantised = |std: f64| -> Vec<f64> {
            motion(4096, 4096).iter().zip(white(4096, std, 12)).map(|(m, e)| ((m + e) / step).round() * step).collect()
        };
        let coarse = estimate_noise(&white(4096, 1.0, 13), &[Some(&quantised(1e-5)), None, None, None], None);
        let found = coarse.quantum[0].expect("the lattice is coarse");
        assert!((found / step - 1.0).abs() < 1e-9, "{found} {step}");
        assert!(coarse.std[0] >= 0.999 * step / 12.0_f64.sqrt(), "{coarse:?}");
        let fine = estimate_noise(&white(4096, 1.0, 13), &[Some(&quantised(10.0 * step)), None, None, None], None);
        assert_eq!(fine.quantum[0], None);
        assert!((fine.std[0] / (10.0 * step) - 1.0).abs() < 0.08, "{fine:?}");
    }
}
