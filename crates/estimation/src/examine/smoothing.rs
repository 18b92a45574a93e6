//! Means over a few samples, which torque and motion pass alike: an equation between them holds between what is left.

/// Samples below which there is nothing to transform.
pub(super) const SHORTEST: usize = 64;

/// Widths of the smoothing that are tried of a record of `n` samples.
pub(super) fn widths(n: usize) -> impl Iterator<Item = usize> {
    [0, 1, 2, 4, 8, 16, 32, 64].into_iter().filter(move |w| SHORTEST + 8 * w <= n)
}

/// A mean over `2*width + 1` samples, twice; the ends are left out.
pub(super) fn smoothed(values: &[f64], width: usize) -> Vec<f64> {
    let once = |v: &[f64]| -> Vec<f64> {
        let length = 2 * width + 1;
        let middle = v[v.len() / 2];
        let sums: Vec<f64> = std::iter::once(0.0)
            .chain(v.iter().scan(0.0, |sum, v| {
                *sum += v - middle;
                Some(*sum)
            }))
            .collect();
        sums.windows(length + 1).map(|w| middle + (w[length] - w[0]) / length as f64).collect()
    };
    once(&once(values))
}
