//! Recursive least squares with a forgetting factor (paper, eq. 9 and 10), and its extended form for coloured noise.
//!
//! ```text
//! RLS  e = y - f'*th ; g = lambda + f'*P*f ; th += P*f*e/g ; P = (P - P*f*(P*f)'/g)/lambda, symmetrised
//! ELS  f = [x ; r(k-1) .. r(k-nc)], r(k) = y - f'*th(k) the a-posteriori residual
//! ```
//!
//! Source: L. Ljung, System Identification, 2nd ed., 11.2 and 10.1 (pseudolinear regression).

use nalgebra::{SMatrix, SVector};

/// A recursive estimator of `P` unknowns with `Q` outputs that share the regressor.
#[derive(Debug, Clone, PartialEq)]
pub struct Rls<const P: usize, const Q: usize> {
    /// The estimates, one column an output.
    pub theta: SMatrix<f64, P, Q>,
    /// The inverse of the (forgetting) information matrix, over the noise variance.
    pub covariance: SMatrix<f64, P, P>,
    /// Forgetting factor, 0 < lambda <= 1.
    pub lambda: f64,
}

impl<const P: usize, const Q: usize> Rls<P, Q> {
    /// Starts from zero estimates with `P(0) = p0*I`.
    #[must_use]
    pub fn new(lambda: f64, p0: f64) -> Self {
        Self { theta: SMatrix::zeros(), covariance: SMatrix::identity() * p0, lambda }
    }

    /// Takes one sample: regressor `f`, outputs `y`; gives the innovation `e = y - f'*th` before the update.
    #[inline]
    pub fn update(&mut self, f: &SVector<f64, P>, y: &SVector<f64, Q>) -> SVector<f64, Q> {
        let innovation = y - self.theta.tr_mul(f);
        let pf = self.covariance * f;
        let gain = 1.0 / (self.lambda + f.dot(&pf));
        let forget = 1.0 / self.lambda;
        for q in 0..Q {
            let step = gain * innovation[q];
            for i in 0..P {
                self.theta[(i, q)] += pf[i] * step;
            }
        }
        // Both halves get the same numbers, so that P stays symmetric.
        for j in 0..P {
            let weight = gain * pf[j];
            for i in 0..=j {
                let value = (self.covariance[(i, j)] - pf[i] * weight) * forget;
                self.covariance[(i, j)] = value;
                self.covariance[(j, i)] = value;
            }
        }
        innovation
    }
}

/// Recursive extended least squares: `X` regressors and `P - X` past residuals, one output.
#[derive(Debug, Clone, PartialEq)]
pub struct Els<const P: usize> {
    /// The estimator over `[x ; past residuals]`.
    pub rls: Rls<P, 1>,
    regressors: usize,
    past: [f64; P],
    scale: f64,
}

impl<const P: usize> Els<P> {
    /// `regressors` of the `P` unknowns belong to x; residuals are scaled by `scale` (about the rms of the noise).
    #[must_use]
    pub fn new(regressors: usize, lambda: f64, p0: f64, scale: f64) -> Self {
        Self { rls: Rls::new(lambda, p0), regressors, past: [0.0; P], scale }
    }

    /// Clears the past residuals, at a gap of the record.
    pub fn forget_noise(&mut self) {
        self.past = [0.0; P];
    }

    /// Takes one sample and gives the a-posteriori residual.
    pub fn update(&mut self, x: &[f64], y: f64) -> f64 {
        let order = P - self.regressors;
        let mut f = SVector::<f64, P>::zeros();
        f.as_mut_slice()[..self.regressors].copy_from_slice(x);
        f.as_mut_slice()[self.regressors..].copy_from_slice(&self.past[..order]);
        self.rls.update(&f, &SVector::from([y]));
        let residual = y - self.rls.theta.column(0).dot(&f);
        self.past[..order].rotate_right(1);
        // A diverging noise model must not feed on itself.
        self.past[0] = (residual * self.scale).clamp(-1e6, 1e6);
        residual
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::identify::lsq::triangularise;
    use crate::numerics::level::noise;

    #[test]
    fn without_forgetting_it_is_least_squares_up_to_the_bias_of_p0() {
        let (n, p0) = (500, 1e8);
        let (u, e) = (noise(2 * n, 1), noise(n, 2));
        let row = |k: usize| [u[2 * k], u[2 * k + 1]];
        let y = |k: usize| 3.0 * row(k)[0] - 0.5 * row(k)[1] + 0.1 * e[k];
        let mut rls = Rls::<2, 1>::new(1.0, p0);
        for k in 0..n {
            rls.update(&row(k).into(), &[y(k)].into());
        }
        let ls = triangularise(n, 2, 1, |k, out| {
            out[..2].copy_from_slice(&row(k));
            out[2] = y(k);
        })
        .solve()
        .unwrap();
        for i in 0..2 {
            // P0 bias = (R + P0^-1)^-1 * P0^-1 * th: about th/(n*p0).
            assert!((rls.theta[i] - ls.phi[(i, 0)]).abs() < 1e-9, "{i}");
            assert!((rls.covariance[(i, i)] / ls.inverse[(i, i)] - 1.0).abs() < 1e-6);
        }
    }

    #[test]
    fn forgetting_follows_a_parameter_that_jumps() {
        let u = noise(2000, 3);
        let mut rls = Rls::<1, 1>::new(0.98, 1e6);
        for (k, x) in u.iter().enumerate() {
            let truth = if k < 1000 { 1.0 } else { 2.0 };
            rls.update(&[*x].into(), &[truth * x].into());
        }
        assert!((rls.theta[0] - 2.0).abs() < 1e-6);
    }

    #[test]
    fn the_extended_form_removes_the_bias_of_coloured_noise() {
        // y(k) = 0.8*y(k-1) + u(k-1) + e(k) - 0.7*e(k-1): LS is biased, ELS is not (Ljung, example 10.1 in kind).
        let n = 20_000;
        let (u, e) = (noise(n, 4), noise(n, 5));
        let mut y = vec![0.0; n];
        let mut plain = Rls::<2, 1>::new(1.0, 1e6);
        let mut extended = Els::<3>::new(2, 1.0, 1e6, 1.0);
        for k in 1..n {
            y[k] = 0.8 * y[k - 1] + u[k - 1] + e[k] - 0.7 * e[k - 1];
            plain.update(&[y[k - 1], u[k - 1]].into(), &[y[k]].into());
            extended.update(&[y[k - 1], u[k - 1]], y[k]);
        }
        let std = extended.rls.covariance[(0, 0)].sqrt();
        assert!((plain.theta[0] - 0.8).abs() > 0.1);
        assert!((extended.rls.theta[(0, 0)] - 0.8).abs() < 4.0 * std, "{}", extended.rls.theta);
        assert!((extended.rls.theta[(2, 0)] + 0.7).abs() < 0.05);
    }
}
