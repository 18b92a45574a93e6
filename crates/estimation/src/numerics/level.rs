//! Levels of a column of samples.

/// Root mean square; zero of no values.
#[must_use]
pub fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|v| v * v).sum::<f64>() / values.len().max(1) as f64).sqrt()
}

/// Root mean square about the mean; zero of no values.
#[must_use]
pub fn deviation(values: &[f64]) -> f64 {
    let n = values.len().max(1) as f64;
    let mean = values.iter().sum::<f64>() / n;
    (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / n).sqrt()
}

/// Seeded white noise of variance one, for tests.
#[cfg(test)]
pub(crate) fn noise(n: usize, seed: u64) -> Vec<f64> {
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
    (0..n).map(|_| StandardNormal.sample(&mut rng)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_level_of_a_shifted_square_wave_is_its_amplitude_about_its_mean() {
        let values: Vec<f64> = (0..100).map(|k| if k % 2 == 0 { 7.0 } else { 1.0 }).collect();
        assert!((deviation(&values) - 3.0).abs() < 1e-15 && (rms(&values) - 5.0).abs() < 1e-15);
        assert_eq!((rms(&[]), deviation(&[])), (0.0, 0.0));
    }
}
