//! Robust measures of columns, in the column's unit: outliers have little influence on them.

/// Largest less smallest.
pub(super) fn span(values: &[f64]) -> f64 {
    let (low, high) = values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(*v), b.max(*v)));
    if high > low { high - low } else { 0.0 }
}

/// Most values that enter a quantile; a longer column is decimated.
const SAMPLED: usize = 100_000;

/// Quantile `share` (0 to 1) of the magnitudes of at most [`SAMPLED`] values; 0 of none.
pub(super) fn quantile(values: impl ExactSizeIterator<Item = f64>, share: f64) -> f64 {
    let step = (values.len() / SAMPLED).max(1);
    let mut sizes: Vec<f64> = values.step_by(step).map(f64::abs).collect();
    if sizes.is_empty() {
        return 0.0;
    }
    let index = ((sizes.len() - 1) as f64 * share).round() as usize;
    *sizes.select_nth_unstable_by(index, f64::total_cmp).1
}

/// Median of the magnitudes of a normal noise over its standard deviation.
const MEDIAN: f64 = 0.6745;

/// Standard deviation of the white noise on a smooth column: second differences hold six times its variance, and next to nothing of a motion.
pub(super) fn noise(values: &[f64]) -> f64 {
    quantile(values.windows(3).map(|w| w[2] - 2.0 * w[1] + w[0]), 0.5) / (MEDIAN * 6.0_f64.sqrt())
}

/// Quantisation step of a column: the smallest difference of neighbouring samples that is neither zero nor rounding.
pub(super) fn step(values: &[f64]) -> f64 {
    let large = values.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    let n = values.len().min(SAMPLED);
    values[..n]
        .windows(2)
        .map(|w| (w[1] - w[0]).abs())
        .filter(|d| *d > 1e-12 * large)
        .fold(f64::INFINITY, f64::min)
        .min(large.max(f64::MIN_POSITIVE))
}
