//! Noise that grows with the speed: samples taken early or late by a time that no stamp shows.
//!
//! A position read `e` too late is off by `e*omega`, so the variance of a channel's noise is `s0^2 + st^2*omega^2`: where the axis stands
//! it is the encoder's alone. Both are estimated from how the differences that are free of the motion vary with the speed from stretch to
//! stretch, each stretch by the logarithm of its power, so that an impact or a jump of friction affects its own stretch alone.

/// Samples in a stretch: short beside a move, with some ten degrees of freedom in its differences.
const STRETCH: usize = 32;
/// The growths that are tried, as variances over that at rest, are powers of this: a step of about the accuracy that a record of some
/// stretches gives.
const STEP: f64 = 1.4;
const POWERS: std::ops::RangeInclusive<i32> = -20..=30;
/// Largest deviation of a stretch that counts, as the logarithm of its power over that of the law: an impact counts as no more.
const OUTLIER: f64 = 1.0;
/// Sum of the logarithms by which the stretches must lie nearer to the law than to one level, and the same for each of them. Without
/// jitter it came to three at most over some hundred records, with jitter that matters to ten and more, a tenth for each.
const SIGNIFICANT: f64 = 5.0;
const SIGNIFICANT_EACH: f64 = 0.05;

/// How a channel's noise grows with its speed.
#[derive(Debug, Clone, PartialEq)]
pub struct Growth {
    /// Variance of each difference's noise over that at rest.
    pub factor: Vec<f64>,
    /// The same over the whole record.
    pub mean: f64,
}

/// The growth of the noise in `differences` of some order of a position `y`, whole stretches of them; `None` where there is none.
pub fn growth(y: &[f64], differences: &[f64]) -> Option<Growth> {
    let order = y.len().checked_sub(differences.len())?;
    let of = |chunk: &[f64]| chunk.iter().map(|v| v * v).sum::<f64>() / STRETCH as f64;
    let powers: Vec<f64> = differences.chunks_exact(STRETCH).map(|c| of(c).max(f64::MIN_POSITIVE).ln()).collect();
    let steps: Vec<f64> = y[order / 2..].windows(2).map(|w| w[1] - w[0]).collect();
    let mut speeds: Vec<f64> = steps.chunks_exact(STRETCH).take(powers.len()).map(of).collect();
    let mean = speeds.iter().sum::<f64>() / speeds.len() as f64;
    if powers.len() != speeds.len() || mean.is_nan() || mean <= 0.0 {
        return None;
    }
    speeds.iter_mut().for_each(|v| *v /= mean);
    // The least sum of absolute deviations of the logarithms, the level at rest at its best: their median.
    let deviation = |by: f64| -> f64 {
        let mut over: Vec<f64> = powers.iter().zip(&speeds).map(|(p, v)| p - (1.0 + by * v).ln()).collect();
        let middle = over.len() / 2;
        let median = *over.select_nth_unstable_by(middle, f64::total_cmp).1;
        over.iter().map(|v| (v - median).abs().min(OUTLIER)).sum()
    };
    let (by, least) = POWERS.map(|i| STEP.powi(i)).map(|by| (by, deviation(by))).min_by(|a, b| a.1.total_cmp(&b.1))?;
    (deviation(0.0) - least >= SIGNIFICANT.max(SIGNIFICANT_EACH * powers.len() as f64)).then(|| Growth {
        factor: speeds.iter().flat_map(|v| std::iter::repeat_n(1.0 + by * v, STRETCH)).collect(),
        mean: 1.0 + by,
    })
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    use super::*;

    /// Third differences of a motion to and fro of amplitude one, 0.01 rad a sample, with an encoder's noise and a jitter of the samples.
    fn position(noise: f64, jitter: f64) -> (Vec<f64>, Vec<f64>) {
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
        let y: Vec<f64> = (0..8192).map(|k| (0.01 * (k as f64 + jitter * normal())).sin() + noise * normal()).collect();
        let mut d = y.clone();
        for _ in 0..3 {
            d = d.windows(2).map(|w| w[1] - w[0]).collect();
        }
        (y, d)
    }

    #[test]
    fn a_jitter_is_told_with_how_much_the_encoder_adds_to_it() {
        // The rms speed is 0.01/sqrt(2) a sample, so that a jitter of 0.05 makes 3.5e-4.
        for noise in [1e-5, 1e-4, 3e-4] {
            let (y, d) = position(noise, 0.05);
            let estimate = growth(&y, &d).expect("a jitter");
            let by = (0.05 * 0.01 / noise).powi(2) / 2.0;
            assert!(
                ((estimate.mean - 1.0) / by).ln().abs() < 1.6 || by > 100.0 && estimate.mean > 100.0,
                "{noise}: {} {by}",
                estimate.mean
            );
        }
    }

    #[test]
    fn noise_that_is_the_same_at_every_speed_and_an_axis_that_stands_tell_of_no_jitter() {
        let (y, d) = position(1e-4, 0.0);
        assert_eq!(growth(&y, &d), None);
        let (still, d) = (vec![0.5; 4096], vec![0.0; 4093]);
        assert_eq!(growth(&still, &d), None);
    }

    #[test]
    fn impacts_are_no_jitter() {
        let (y, mut d) = position(1e-4, 0.0);
        for k in (100..8000).step_by(400) {
            d[k] += 0.1;
        }
        assert_eq!(growth(&y, &d), None);
    }
}
