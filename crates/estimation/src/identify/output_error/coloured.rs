//! Standard errors of output error where the residual is not white. See [`super::super::long_run`]; the scores are
//! `J'r/sigma^2`, summed over the outputs.

use nalgebra::{DMatrix, Matrix4};

use super::super::long_run::Scores;
use super::*;

impl OutputError<'_> {
    /// Covariance of I1, I2, B, K at a fit, whatever the colour of its residual; None where the fit's parameters were not
    /// free or the record does not determine them.
    #[must_use]
    pub fn coloured(&self, fit: &OutputErrorFit) -> Option<Matrix4<f64>> {
        fit.estimated.covariance?;
        let mut problem = self.clone();
        problem.options.scheme = fit.scheme;
        problem.sigma.clone_from(&fit.sigma);
        problem.damping_unit = if fit.estimated.values[2] > 0.0 { fit.estimated.values[2] } else { 1.0 };
        problem.free_offsets(fit.offset.iter().any(|o| *o != 0.0));
        problem.free[BIAS] = fit.bias != 0.0;
        let v = &fit.estimated.values;
        let q = problem.of_fit(fit);
        let free: Vec<usize> = (0..q.len()).filter(|i| problem.free[*i]).collect();
        let (hessian, scores) = problem.scores(&q, free.len());
        let (inverse, undetermined) = levenberg::covariance(&hessian);
        if !undetermined.is_empty() || inverse.iter().any(|v| !v.is_finite()) {
            return None;
        }
        let relative = &inverse * scores.omega() * &inverse;
        let unit = [v[0], v[1], problem.damping_unit, v[3]];
        let mut covariance = Matrix4::zeros();
        for (a, i) in free.iter().enumerate().filter(|(_, i)| **i < PARAMETERS) {
            for (b, j) in free.iter().enumerate().filter(|(_, j)| **j < PARAMETERS) {
                covariance[(*i, *j)] = relative[(a, b)] * unit[*i] * unit[*j];
            }
        }
        covariance.iter().all(|v| v.is_finite()).then_some(covariance)
    }

    /// `sum J'J/sigma^2` and the scores.
    fn scores(&self, q: &[f64], free: usize) -> (DMatrix<f64>, Scores) {
        let mut scores = Scores::new(self.torque.len(), free);
        let mut hessian = DMatrix::zeros(free, free);
        self.rows(q, |k, numbers, row, residual| {
            for (j, a) in numbers.iter().zip(row) {
                scores.add(k, *j, a * residual);
                for (i, b) in numbers.iter().zip(row) {
                    hessian[(*i, *j)] += a * b;
                }
            }
        });
        (hessian, scores)
    }
}
