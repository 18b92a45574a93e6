//! Least squares with coefficients within bounds, and their standard errors.

use nalgebra::DMatrix;

/// Least squares with coefficients of at least zero: see [`bounded`].
pub(super) fn non_negative(gram: &[Vec<f64>], right: &[f64]) -> (Vec<f64>, f64) {
    let p = right.len();
    bounded(gram, right, &vec![0.0; p], &vec![f64::INFINITY; p])
}

/// Least squares with coefficients from `low` to `high`: `gram*x = right`, of columns of about one size; gives x and the energy explained,
/// `2*x.right - x.gram.x`, which is below zero where the bounds force more than there is.
pub(super) fn bounded(gram: &[Vec<f64>], right: &[f64], low: &[f64], high: &[f64]) -> (Vec<f64>, f64) {
    let p = right.len();
    let mut x: Vec<f64> = low.iter().zip(high).map(|(l, h)| 0.0_f64.clamp(*l, *h)).collect();
    for _ in 0..400 {
        let mut moved = 0.0_f64;
        for i in 0..p {
            if gram[i][i] <= 0.0 {
                continue;
            }
            let rest: f64 = (0..p).filter(|j| *j != i).map(|j| gram[i][j] * x[j]).sum();
            let new = ((right[i] - rest) / gram[i][i]).clamp(low[i], high[i]);
            moved = moved.max((new - x[i]).abs() * gram[i][i].sqrt());
            x[i] = new;
        }
        let size = right
            .iter()
            .zip(gram)
            .map(|(r, g)| r.abs() / g.iter().fold(0.0_f64, |m, v| m.max(*v)).sqrt())
            .fold(0.0, f64::max);
        if moved <= 1e-9 * size {
            break;
        }
    }
    let explained = (0..p).map(|i| x[i] * (2.0 * right[i] - (0..p).map(|j| gram[i][j] * x[j]).sum::<f64>())).sum();
    (x, explained)
}

/// Standard error of the sum of the coefficients `of`, where those of `free` are not at a bound and the residual has any colour:
///
/// ```text
/// covariance = G^-1 * Omega * G^-1,     Omega = covariance of the scores (column times residual)
/// ```
///
/// (H. White, Econometrica 48, 1980). Infinite where the columns do not determine the coefficients.
pub(super) fn standard_error(gram: &[Vec<f64>], omega: &[Vec<f64>], free: &[usize], of: &[usize]) -> f64 {
    // Columns of unit size, so that one bound of rank serves all.
    let size: Vec<f64> = free.iter().map(|i| gram[*i][*i].sqrt().max(f64::MIN_POSITIVE)).collect();
    let part =
        |m: &[Vec<f64>]| DMatrix::from_fn(free.len(), free.len(), |i, k| m[free[i]][free[k]] / size[i] / size[k]);
    let Some(inverse) = part(gram).cholesky().map(|c| c.inverse()) else { return f64::INFINITY };
    let covariance = &inverse * part(omega) * &inverse;
    let at = || (0..free.len()).filter(|i| of.contains(&free[*i]));
    let variance: f64 = at().map(|i| at().map(|k| covariance[(i, k)] / size[i] / size[k]).sum::<f64>()).sum();
    if variance >= 0.0 { variance.sqrt() } else { f64::INFINITY }
}

/// A straight line through pairs, by least squares.
pub(super) struct Line {
    pub(super) slope: f64,
    /// Sum of the squares that the line leaves of the second values.
    pub(super) left: f64,
    /// How many pairs there are, their means, and the sums of squares about those.
    pub(super) count: f64,
    pub(super) means: [f64; 2],
    pub(super) squares: [f64; 2],
}

impl Line {
    /// The line through the pairs that `pairs` gives, which is asked for them twice; its slope is no number where the first values are all
    /// one. What it leaves is known to 1e-15 of the second values' sum of squares.
    pub(super) fn through<P: Iterator<Item = (f64, f64)>>(pairs: impl Fn() -> P) -> Self {
        let (mut count, mut mx, mut my) = (0.0, 0.0, 0.0);
        for (x, y) in pairs() {
            count += 1.0;
            mx += x;
            my += y;
        }
        (mx, my) = (mx / count, my / count);
        let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
        for (x, y) in pairs() {
            let (x, y) = (x - mx, y - my);
            xx += x * x;
            xy += x * y;
            yy += y * y;
        }
        let slope = xy / xx;
        Self { slope, left: (yy - slope * xy).max(0.0), count, means: [mx, my], squares: [xx, yy] }
    }
}
