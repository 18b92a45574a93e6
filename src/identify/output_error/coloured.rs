//! Standard errors of output error where the residual is not white.
//!
//! ```text
//! covariance = H^-1 * Omega * H^-1,   H = sum J'J/sigma^2,   Omega = n * long-run covariance of the scores J'r/sigma^2
//! ```
//!
//! The long-run covariance is the mean of the outer products of the first B cosine transforms of the scores
//! (E. Lazarus, D. J. Lewis, J. H. Stock, M. W. Watson, HAR inference, J. Business & Economic Statistics 36, 2018; their
//! B = 0.4*n^(2/3)).

use nalgebra::{DMatrix, DVector, Matrix4};

use super::*;

/// Most cosine transforms.
const MOST: usize = 64;

impl OutputError<'_> {
    /// Covariance of I1, I2, B, K at a fit, whatever the colour of its residual; None where the fit's parameters were not
    /// free or the record does not determine them.
    #[must_use]
    pub fn coloured(&self, fit: &Fit) -> Option<Matrix4<f64>> {
        fit.estimated.covariance?;
        let mut problem = self.clone();
        problem.options.scheme = fit.scheme;
        problem.sigma.clone_from(&fit.sigma);
        problem.damping_unit = if fit.estimated.values[2] > 0.0 { fit.estimated.values[2] } else { 1.0 };
        problem.free[OFFSET] = fit.offset != 0.0;
        problem.free[BIAS] = fit.bias != 0.0;
        let v = &fit.estimated.values;
        let x = &fit.initial;
        let q: [f64; ALL] = [
            v[0].ln(),
            v[1].ln(),
            v[2] / problem.damping_unit,
            v[3].ln(),
            x[0],
            x[1],
            x[2],
            x[3],
            fit.offset,
            fit.bias,
        ];
        let free: Vec<usize> = (0..ALL).filter(|i| problem.free[*i]).collect();
        let scores = problem.scores(&q, &free);
        let (hessian, scores) = scores;
        let (inverse, undetermined) = levenberg::covariance(&hessian);
        if !undetermined.is_empty() || inverse.iter().any(|v| !v.is_finite()) {
            return None;
        }
        let n = scores.nrows();
        let transforms = ((0.4 * (n as f64).powf(2.0 / 3.0)) as usize).clamp(4, MOST);
        let mut omega = DMatrix::zeros(free.len(), free.len());
        for j in 1..=transforms {
            let mut x = DVector::zeros(free.len());
            for k in 0..n {
                let psi = (std::f64::consts::PI * j as f64 * (k as f64 + 0.5) / n as f64).cos();
                x += psi * scores.row(k).transpose();
            }
            omega += &x * x.transpose() * 2.0;
        }
        omega /= transforms as f64;
        let relative = &inverse * omega * &inverse;
        let unit = [v[0], v[1], problem.damping_unit, v[3]];
        let mut covariance = Matrix4::zeros();
        for (a, i) in free.iter().enumerate().filter(|(_, i)| **i < 4) {
            for (b, j) in free.iter().enumerate().filter(|(_, j)| **j < 4) {
                covariance[(*i, *j)] = relative[(a, b)] * unit[*i] * unit[*j];
            }
        }
        covariance.iter().all(|v| v.is_finite()).then_some(covariance)
    }

    /// `sum J'J/sigma^2` and the scores, n x p, one row a sample (over all outputs).
    fn scores(&self, q: &[f64; ALL], free: &[usize]) -> (DMatrix<f64>, DMatrix<f64>) {
        let dual: [Dual<DERIVED>; DERIVED] = std::array::from_fn(|i| Dual::variable(q[i], i));
        let response = self.respond(&dual, q[BIAS]);
        let step = self.free[BIAS].then(|| {
            let p: Parameters = self.axis(&q[..DERIVED]);
            simulate(&p, self.structure, &Settings::default(), [0.0; 4], &vec![1.0; self.torque.len()], &self.options)
        });
        let n = self.torque.len();
        let mut scores = DMatrix::zeros(n, free.len());
        let mut hessian = DMatrix::zeros(free.len(), free.len());
        let mut row = DVector::zeros(free.len());
        for ((_, c, measured), sigma) in self.outputs.iter().zip(&self.sigma) {
            let offset = if *c == 2 { q[OFFSET] } else { 0.0 };
            for (k, (y, reading)) in measured.iter().zip(&response.readings).enumerate() {
                let value = pick(reading, *c);
                for (out, i) in row.iter_mut().zip(free) {
                    *out = match *i {
                        OFFSET => f64::from(u8::from(*c == 2)),
                        BIAS => step.as_ref().map_or(0.0, |s| pick(&s.readings[k], *c)),
                        i => value.eps[i],
                    } / sigma;
                }
                let residual = (y - value.re - offset) / sigma;
                for (a, v) in row.iter().enumerate() {
                    scores[(k, a)] += v * residual;
                }
                hessian.syger(1.0, &row, &row, 1.0);
            }
        }
        hessian.fill_upper_triangle_with_lower_triangle();
        (hessian, scores)
    }
}
