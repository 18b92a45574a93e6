//! From the unknowns of a regression to the parameters of the axis, and on to the modal ones, with covariances.
//!
//! The order everywhere is I1, I2, B, K.

use nalgebra::{DMatrix, DVector, Matrix4, SMatrix, SVector, Vector4};

use super::levenberg::{self, Normal, Problem};
use super::result::Estimate;
use crate::axis::Parameters;
use crate::scalar::{Dual, Scalar};
use crate::trace::AxisKind;

/// Parameters with their covariance.
#[derive(Debug, Clone, PartialEq)]
pub struct Estimated {
    /// I1, I2, B, K.
    pub values: Vector4<f64>,
    /// Their covariance, where the estimator gives one.
    pub covariance: Option<Matrix4<f64>>,
}

/// Names of the four, in order.
pub const NAMES: [&str; 4] = ["I1", "I2", "B", "K"];

/// Units of the four.
#[must_use]
pub const fn units(motion: AxisKind) -> [&'static str; 4] {
    match motion {
        AxisKind::Rotary => ["kg.m2", "kg.m2", "N.m.s/rad", "N.m/rad"],
        AxisKind::Linear => ["kg", "kg", "N.s/m", "N/m"],
    }
}

impl Estimated {
    /// As the axis takes them.
    #[must_use]
    pub fn parameters(&self, rho: f64) -> Parameters {
        let v = &self.values;
        Parameters { i1: v[0], i2: v[1], b: v[2], k: v[3], rho }
    }

    /// Whether an axis with these can exist: finite, inertias and stiffness positive.
    #[must_use]
    pub fn is_physical(&self) -> bool {
        self.values.iter().all(|v| v.is_finite())
            && self.values[0] > 0.0
            && self.values[1] > 0.0
            && self.values[3] > 0.0
    }

    /// Whether its natural frequency lies beyond half the sampling rate, where no sample shows it; `dt`: sampling interval, s.
    #[must_use]
    pub fn is_unseen(&self, dt: f64) -> bool {
        self.parameters(1.0).modal().wn > std::f64::consts::PI / dt
    }

    fn std(&self, gradient: &Vector4<f64>) -> Option<f64> {
        let variance = (gradient.transpose() * self.covariance? * gradient)[0];
        variance.is_finite().then(|| variance.max(0.0).sqrt())
    }

    /// The table of the four parameters.
    #[must_use]
    pub fn estimates(&self, reference: Option<&Parameters>, motion: AxisKind) -> Vec<Estimate> {
        let reference = reference.map(|p| [p.i1, p.i2, p.b, p.k]);
        (0..4)
            .map(|i| {
                let mut unit = Vector4::zeros();
                unit[i] = 1.0;
                Estimate::new(NAMES[i], units(motion)[i], self.values[i], self.std(&unit), reference.map(|r| r[i]))
            })
            .collect()
    }

    /// The modal parameters (paper, 4.3.5) with standard errors propagated to first order.
    #[must_use]
    pub fn modal(&self, reference: Option<&Parameters>) -> Vec<Estimate> {
        let dual = |i: usize| Dual::<4>::variable(self.values[i], i);
        let p = Parameters { i1: dual(0), i2: dual(1), b: dual(2), k: dual(3), rho: Dual::from(1.0) };
        let modal = p.modal();
        let reference = reference.map(Parameters::modal);
        let one = |name, unit, value: Dual<4>, reference: Option<f64>| {
            Estimate::new(name, unit, value.re(), self.std(&Vector4::from(value.eps)), reference)
        };
        vec![
            one("wn", "rad/s", modal.wn, reference.map(|m| m.wn)),
            one("wd", "rad/s", modal.wd, reference.map(|m| m.wd)),
            one("zeta", "1", modal.zeta, reference.map(|m| m.zeta)),
        ]
    }
}

/// Estimates of both rows of F5 with their covariances.
///
/// ```text
/// a1 = -(K/I1)*twist - (B/I1)*rate + (1/I1)*torque ;  a2 = (K/I2)*twist + (B/I2)*rate
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Rows {
    /// K/I1, B/I1, 1/I1.
    pub motor: SVector<f64, 3>,
    /// Their covariance.
    pub motor_covariance: SMatrix<f64, 3, 3>,
    /// K/I2, B/I2.
    pub table: SVector<f64, 2>,
    /// Their covariance.
    pub table_covariance: SMatrix<f64, 2, 2>,
    /// Covariance of all five that allows for coloured residuals, correlated between the rows; None where it is not known.
    pub coloured: Option<SMatrix<f64, 5, 5>>,
}

impl Rows {
    /// The four parameters that the five ratios agree on best, weighted by their covariances (the rows are five
    /// equations in four unknowns: `I2` follows from stiffness and from damping). The weights are those of white
    /// residuals; the covariance is that of coloured ones where it is known, and never below that of white ones.
    #[must_use]
    pub fn reconcile(&self) -> Estimated {
        let (m, t) = (&self.motor, &self.table);
        let direct = Vector4::new(1.0 / m[2], m[0] / m[2] / t[0], m[1] / m[2], m[0] / m[2]);
        let first = Estimated { values: direct, covariance: None };
        if !first.is_physical() {
            return first;
        }
        let (Some(wm), Some(wt)) = (whitener(&self.motor_covariance), whitener(&self.table_covariance)) else {
            return first;
        };
        let problem = Reconciliation { rows: self, wm, wt, unit: direct };
        let report = levenberg::minimise(&problem, &DVector::from_element(4, 1.0), &levenberg::Options::default());
        if !report.termination.is_converged() {
            return first;
        }
        let relative = report.covariance();
        let unit = DVector::from_column_slice(direct.as_slice());
        let mut covariance = Matrix4::from_fn(|i, j| relative[(i, j)] * unit[i] * unit[j]);
        if let Some(coloured) = self.coloured.and_then(|five| problem.propagated(&report.parameters, &relative, &five))
        {
            let coloured = Matrix4::from_fn(|i, j| coloured[(i, j)] * unit[i] * unit[j]);
            covariance = wider(&covariance, &coloured);
        }
        let values = Vector4::from_fn(|i, _| report.parameters[i] * unit[i]);
        Estimated { values, covariance: Some(covariance) }
    }
}

/// The coloured covariance, with no standard error below the plain one's.
pub(super) fn wider(plain: &Matrix4<f64>, coloured: &Matrix4<f64>) -> Matrix4<f64> {
    let factor = |i: usize| {
        let ratio = plain[(i, i)] / coloured[(i, i)];
        if ratio.is_finite() { ratio.max(1.0).sqrt() } else { 1.0 }
    };
    let wide = Matrix4::from_fn(|i, j| coloured[(i, j)] * factor(i) * factor(j));
    if wide.iter().all(|v| v.is_finite()) && (0..4).all(|i| wide[(i, i)] > 0.0) { wide } else { *plain }
}

/// `W` with `W'W = inv(covariance)`, the covariance scaled to unit diagonal on the way.
fn whitener<const N: usize>(covariance: &SMatrix<f64, N, N>) -> Option<SMatrix<f64, N, N>> {
    let scale = SVector::<f64, N>::from_fn(|i, _| 1.0 / covariance[(i, i)].sqrt());
    let scaled = DMatrix::from_fn(N, N, |i, j| covariance[(i, j)] * scale[i] * scale[j]);
    let upper = scaled.try_inverse()?.cholesky()?.l().transpose();
    let out = SMatrix::<f64, N, N>::from_fn(|i, j| upper[(i, j)] * scale[j]);
    out.iter().all(|v| v.is_finite()).then_some(out)
}

struct Reconciliation<'a> {
    rows: &'a Rows,
    wm: SMatrix<f64, 3, 3>,
    wt: SMatrix<f64, 2, 2>,
    unit: Vector4<f64>,
}

impl Reconciliation<'_> {
    /// The covariance of the five ratios propagated to the four parameters (over their units): `A*five*A'` with
    /// `A = inv(J'J)*J'*W`, which is how the parameters move with the ratios.
    fn propagated(&self, q: &DVector<f64>, relative: &DMatrix<f64>, five: &SMatrix<f64, 5, 5>) -> Option<DMatrix<f64>> {
        let jacobian = DMatrix::from_fn(5, 4, {
            let residual = self.residual(q);
            move |i, j| residual[i].eps[j]
        });
        let mut weights = DMatrix::zeros(5, 5);
        weights.view_mut((0, 0), (3, 3)).copy_from(&self.wm);
        weights.view_mut((3, 3), (2, 2)).copy_from(&self.wt);
        let moved = relative * jacobian.transpose() * weights;
        let covariance = &moved * DMatrix::from_fn(5, 5, |i, j| five[(i, j)]) * moved.transpose();
        covariance.iter().all(|v| v.is_finite()).then_some(covariance)
    }

    fn residual(&self, q: &DVector<f64>) -> [Dual<4>; 5] {
        let p: [Dual<4>; 4] = std::array::from_fn(|i| Dual::variable(q[i], i) * self.unit[i]);
        let [i1, i2, b, k] = p;
        let motor = [k / i1, b / i1, Dual::from(1.0) / i1];
        let table = [k / i2, b / i2];
        let mut out = [Dual::default(); 5];
        for (out, w) in out[..3].iter_mut().zip(self.wm.row_iter()) {
            for ((model, found), w) in motor.iter().zip(&self.rows.motor).zip(w.iter()) {
                *out += (*model - *found) * *w;
            }
        }
        for (out, w) in out[3..].iter_mut().zip(self.wt.row_iter()) {
            for ((model, found), w) in table.iter().zip(&self.rows.table).zip(w.iter()) {
                *out += (*model - *found) * *w;
            }
        }
        out
    }
}

impl Problem for Reconciliation<'_> {
    fn cost(&self, q: &DVector<f64>) -> Option<f64> {
        Some(0.5 * self.residual(q).iter().map(|r| r.re * r.re).sum::<f64>())
    }

    fn linearise(&self, q: &DVector<f64>) -> Option<Normal> {
        let mut normal = Normal::zeros(4);
        for r in self.residual(q) {
            normal.add(r.re, &r.eps);
        }
        Some(normal)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn consistent_rows_give_the_parameters_and_the_modal_ones_of_table_5() {
        let p = Parameters::PAPER;
        let rows = Rows {
            motor: [p.k / p.i1, p.b / p.i1, 1.0 / p.i1].into(),
            motor_covariance: SMatrix::identity() * 1e-8,
            table: [p.k / p.i2, p.b / p.i2].into(),
            table_covariance: SMatrix::identity() * 1e-8,
            coloured: None,
        };
        let found = rows.reconcile();
        for (value, expected) in found.values.iter().zip([p.i1, p.i2, p.b, p.k]) {
            assert!((value / expected - 1.0).abs() < 1e-12);
        }
        let modal = found.modal(None);
        // Table 5 of the paper.
        for (estimate, expected) in modal.iter().zip([5.4532e1, 2.9876e1, 8.3657e-1]) {
            assert!((estimate.value / expected - 1.0).abs() < 2e-5, "{estimate:?}");
        }
    }

    #[test]
    fn propagated_standard_errors_follow_the_rules_of_products() {
        let mut covariance = Matrix4::zeros();
        covariance[(3, 3)] = (0.01 * 1.76e-2_f64).powi(2);
        let p = Parameters::PAPER;
        let found = Estimated { values: Vector4::new(p.i1, p.i2, p.b, p.k), covariance: Some(covariance) };
        // wn goes with sqrt(K), zeta with 1/sqrt(K): 1 % of K is 0.5 % of either.
        let modal = found.modal(None);
        for i in [0, 2] {
            assert!((modal[i].std.unwrap() / modal[i].value - 0.005).abs() < 1e-12);
        }
        assert_eq!(found.estimates(None, AxisKind::Rotary)[3].std, Some(0.01 * 1.76e-2));
    }
}
