//! Means over a few samples, which torque and motion pass alike: an equation between them holds between what is left.

/// Samples below which there is nothing to transform.
pub(super) const SHORTEST: usize = 64;

/// Widths of the smoothing that are tried of a record of `n` samples.
pub(super) fn widths(n: usize) -> impl Iterator<Item = usize> {
    [0, 1, 2, 4, 8, 16, 32, 64].into_iter().filter(move |w| SHORTEST + 8 * w <= n)
}

/// A mean over `2*width + 1` samples, twice; `2*width` samples at either end are left out.
pub(super) fn smoothed(values: &[f64], width: usize) -> Vec<f64> {
    let length = 2 * width + 1;
    if width == 0 || values.len() < 2 * length {
        return if width == 0 { values.to_vec() } else { Vec::new() };
    }
    let middle = values[values.len() / 2];
    let share = 1.0 / length as f64;
    // One column of memory: running sums of the samples, of their means, and those means' means follow one another in it.
    let mut sums = Vec::with_capacity(values.len() + 1);
    let mut sum = 0.0;
    sums.push(sum);
    sums.extend(values.iter().map(|v| {
        sum += v - middle;
        sum
    }));
    let once = values.len() + 1 - length;
    sum = 0.0;
    for k in 0..once {
        let mean = (sums[k + length] - sums[k]) * share;
        sums[k] = sum;
        sum += mean;
    }
    sums[once] = sum;
    let twice = once + 1 - length;
    for k in 0..twice {
        sums[k] = middle + (sums[k + length] - sums[k]) * share;
    }
    sums.truncate(twice);
    sums
}

/// Standard deviation that a white noise has in the second difference over `dt`, s, of what is smoothed so: the weights' own is that of three
/// samples `2*width + 1` apart, in the noise's unit a second squared.
pub(super) fn noise_of_acceleration(noise: f64, width: usize, dt: f64) -> f64 {
    6.0_f64.sqrt() * noise / ((2 * width + 1) as f64 * dt).powi(2)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_is_as_large_in_an_acceleration_as_its_weights_are() {
        for width in [0, 1, 4] {
            let mut one = vec![0.0; 101];
            one[50] = 3.0;
            let all = smoothed(&one, width);
            let squares: f64 = all.windows(3).map(|w| ((w[2] - 2.0 * w[1] + w[0]) / 1e-4).powi(2)).sum();
            let told = noise_of_acceleration(3.0, width, 1e-2);
            assert!((told / squares.sqrt() - 1.0).abs() < 1e-9, "{width}: {told}, {}", squares.sqrt());
        }
    }

    #[test]
    fn a_mean_twice_is_one_with_the_weights_of_a_triangle() {
        let values: Vec<f64> = (0..100).map(|k| 3.0 + f64::from(k * k % 17)).collect();
        assert_eq!(smoothed(&values, 0), values);
        let by_weights = |k: usize| -> f64 { (0..9).map(|i| values[k + i] * (5 - i.abs_diff(4)) as f64 / 25.0).sum() };
        let all = smoothed(&values, 2);
        assert_eq!(all.len(), 92);
        assert!(all.iter().enumerate().all(|(k, v)| (v - by_weights(k)).abs() < 1e-12));
    }
}
