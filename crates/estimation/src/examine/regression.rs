//! Least squares over the samples of a record, with standard errors that allow for the residual's colour.

use super::rigid::SAMPLES;
use crate::identify::long_run::Scores;
use crate::identify::lsq::{Solution, triangularise};

/// The fit of one series by `N` others.
pub(super) struct Regression<const N: usize> {
    /// The coefficients.
    pub(super) values: [f64; N],
    /// Root mean square of what is left of the series, in its unit.
    pub(super) left: f64,
    samples: Vec<usize>,
    solution: Solution,
}

impl<const N: usize> Regression<N> {
    /// Of samples 1 to `n - 2`, at most [`SAMPLES`] of them; `row` gives the regressors and the target of one. None where they do not determine
    /// the coefficients.
    pub(super) fn of(n: usize, row: impl Fn(usize) -> ([f64; N], f64) + Sync) -> Option<Self> {
        let samples: Vec<usize> = (1..n - 1).step_by((n / SAMPLES).max(1)).collect();
        let triangle = triangularise(samples.len(), N, 1, |i, out| {
            let (regressors, target) = row(samples[i]);
            out[..N].copy_from_slice(&regressors);
            out[N] = target;
        });
        let solution = triangle.solve().ok()?;
        let values = std::array::from_fn(|i| solution.phi[(i, 0)]);
        let left = (solution.residual[(0, 0)] / samples.len() as f64).sqrt();
        left.is_finite().then_some(Self { values, left, samples, solution })
    }

    /// The standard errors of the coefficients with the residual's own colour; `row` as in [`Regression::of`].
    pub(super) fn errors(&self, row: impl Fn(usize) -> ([f64; N], f64)) -> [f64; N] {
        let mut scores = Scores::new(self.samples.len(), N);
        for (k, sample) in self.samples.iter().enumerate() {
            let (regressors, target) = row(*sample);
            let left = target - self.values.iter().zip(&regressors).map(|(v, r)| v * r).sum::<f64>();
            regressors.iter().enumerate().for_each(|(i, r)| scores.add(k, i, left * r));
        }
        let covariance = &self.solution.inverse * scores.omega() * &self.solution.inverse;
        std::array::from_fn(|i| covariance[(i, i)].sqrt())
    }
}
