//! The paper's own formulation: the regression of the whole state over one sample, by Euler's rule, and its
//! trapezoidal counterpart.
//!
//! ```text
//! Euler        Theta(k+1) = (I + A*Dt)*Theta(k) + C*Dt*T(k)                       (paper, eq. 6)
//! trapezoidal  Theta(k+1) = F*Theta(k) + G*m(T);  A = (2/Dt)*(F - I)*inv(F + I);  C = (I - A*Dt/2)*G/Dt
//! ```
//!
//! `Theta = [th1 w1 th2 w2]'`; row 2 of A is `[-K/I1 -B/I1 K/I1 B/I1]`, row 4 `[K/I2 B/I2 -K/I2 -B/I2]`, C is
//! `[0 1/I1 0 0]'`. The parameters are read off as `I1 = 1/C2`, `K = -A21*I1`, `B = -A22*I1`, `I2 = K/A41`.

use nalgebra::{Matrix4, SMatrix, SVector, Vector4};

use super::lsq::triangularise;
use super::parameters::{Estimated, NAMES};
use super::record::RegressionRecord;
use super::recursive::Rls;
use super::regression::RegressionError;
use super::result::History;
use crate::axis::Hold;

/// What to know of the Euler regression.
pub const EULER_NOTE: &str = "Euler's rule is first order: on data of any better integration its estimates are biased by \
                              several to several hundred per cent, whatever the estimator; leave --paper out for the \
                              consistent regression";

/// The integration rule over a sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Rule {
    /// The paper's.
    Euler,
    /// Exact on data of Newmark 1/4, 1/2.
    Trapezoidal,
}

struct States<'a> {
    record: &'a RegressionRecord<'a>,
    omega: (&'a [f64], &'a [f64]),
    rule: Rule,
}

impl<'a> States<'a> {
    fn new(record: &'a RegressionRecord<'a>, rule: Rule) -> Result<Self, RegressionError> {
        let omega = record.omega.ok_or_else(|| RegressionError::Unexcited {
            side: "state",
            parameters: "any parameter".to_owned(),
            why: "the regression of the whole state needs omega1 and omega2, which are not in the trace".to_owned(),
        })?;
        if record.len() < 32 {
            return Err(RegressionError::TooShort { rows: record.len(), unknowns: 5 });
        }
        Ok(Self { record, omega, rule })
    }

    fn state(&self, k: usize) -> [f64; 4] {
        [self.record.theta1[k], self.omega.0[k], self.record.theta2[k], self.omega.1[k]]
    }

    fn torque(&self, k: usize) -> f64 {
        let t = self.record.torque;
        match (self.rule, self.record.hold) {
            (Rule::Trapezoidal, Hold::Linear) => 0.5 * (t[k] + t[k + 1]),
            _ => t[k],
        }
    }

    fn rows(&self) -> usize {
        self.record.len() - 1
    }

    /// Root mean squares of the regressors.
    fn scales(&self) -> SVector<f64, 5> {
        let mut sum = SVector::<f64, 5>::zeros();
        for k in 0..self.rows() {
            let [a, b, c, d] = self.state(k);
            sum += SVector::from([a, b, c, d, self.torque(k)]).map(|v| v * v);
        }
        sum.map(|s| (s / self.rows() as f64).sqrt().max(f64::MIN_POSITIVE))
    }

    /// Parameters from phi, 5 x 4: `Theta(k+1)' = [Theta(k)' T]*phi`.
    fn parameters(&self, phi: &SMatrix<f64, 5, 4>) -> Estimated {
        let (a, c) = self.matrices(phi);
        let i1 = 1.0 / c[1];
        let k = -a[(1, 0)] * i1;
        Estimated { values: Vector4::new(i1, k / a[(3, 0)], -a[(1, 1)] * i1, k), covariance: None }
    }

    /// A and C of the continuous axis.
    fn matrices(&self, phi: &SMatrix<f64, 5, 4>) -> (Matrix4<f64>, Vector4<f64>) {
        let dt = self.record.dt;
        let f: Matrix4<f64> = phi.fixed_view::<4, 4>(0, 0).transpose();
        let g: Vector4<f64> = phi.row(4).transpose();
        let one = Matrix4::identity();
        match self.rule {
            Rule::Euler => ((f - one) / dt, g / dt),
            Rule::Trapezoidal => {
                let inverse = (f + one).try_inverse().unwrap_or_else(Matrix4::zeros);
                let a = (f - one) * inverse * (2.0 / dt);
                (a, (one - a * (dt / 2.0)) * g / dt)
            }
        }
    }
}

/// Least squares of the whole state (paper, eq. 7; by QR instead of `inv(L'L)`).
///
/// # Errors
/// Without speeds, or when a direction of the state is not excited.
pub fn least_squares(record: &RegressionRecord, rule: Rule) -> Result<Estimated, RegressionError> {
    let states = States::new(record, rule)?;
    Ok(states.parameters(&solve(&states)?))
}

/// [`least_squares`] with I2 held at a known value: `K = A41*I2`, `I1 = -K/A21`, `B = -A22*I1`.
///
/// # Errors
/// As [`least_squares`].
pub fn least_squares_with_i2(record: &RegressionRecord, rule: Rule, i2: f64) -> Result<Estimated, RegressionError> {
    let states = States::new(record, rule)?;
    let (a, _) = states.matrices(&solve(&states)?);
    let k = a[(3, 0)] * i2;
    let i1 = -k / a[(1, 0)];
    Ok(Estimated { values: Vector4::new(i1, i2, -a[(1, 1)] * i1, k), covariance: None })
}

fn solve(states: &States) -> Result<SMatrix<f64, 5, 4>, RegressionError> {
    let solution = triangularise(states.rows(), 5, 4, |k, out| {
        out[..4].copy_from_slice(&states.state(k));
        out[4] = states.torque(k);
        out[5..].copy_from_slice(&states.state(k + 1));
    })
    .solve()
    .map_err(|e| RegressionError::Unexcited {
        side: "state",
        parameters: e
            .columns
            .iter()
            .filter_map(|c| ["theta1", "omega1", "theta2", "omega2", "T"].get(*c).copied())
            .collect::<Vec<_>>()
            .join(", "),
        why: format!("these signals are dependent to {:.0e}", e.smallest),
    })?;
    Ok(SMatrix::from_fn(|i, j| solution.phi[(i, j)]))
}

/// [`least_squares`] by Euler's rule.
///
/// # Errors
/// As [`least_squares`].
pub fn euler_least_squares(record: &RegressionRecord) -> Result<Estimated, RegressionError> {
    least_squares(record, Rule::Euler)
}

/// RLS (paper, eq. 9 and 10), or ELS with the state's last residual as four more regressors, by Euler's rule.
///
/// # Errors
/// As [`least_squares`].
pub fn euler_recursive(
    record: &RegressionRecord,
    lambda: f64,
    p0: f64,
    extended: bool,
) -> Result<(Estimated, History), RegressionError> {
    recursive(record, Rule::Euler, lambda, p0, extended)
}

/// The recursive estimators under either rule.
///
/// # Errors
/// As [`least_squares`].
pub fn recursive(
    record: &RegressionRecord,
    rule: Rule,
    lambda: f64,
    p0: f64,
    extended: bool,
) -> Result<(Estimated, History), RegressionError> {
    let states = States::new(record, rule)?;
    if extended { run::<9>(&states, lambda, p0) } else { run::<5>(&states, lambda, p0) }
}

/// `P` regressors: the five of the state, then the last residual's four.
fn run<const P: usize>(states: &States, lambda: f64, p0: f64) -> Result<(Estimated, History), RegressionError> {
    let scales = states.scales();
    let mut rls = Rls::<P, 4>::new(lambda, p0);
    let mut past = SVector::<f64, 4>::zeros();
    let rows = states.rows();
    let every = rows.div_ceil(400).max(1);
    let mut history = History { time: Vec::new(), parameters: NAMES.iter().map(|n| (*n, Vec::new())).collect() };
    let mut last = Estimated { values: Vector4::zeros(), covariance: None };
    for k in 0..rows {
        let x = states.state(k);
        let mut f = SVector::<f64, P>::zeros();
        for i in 0..4 {
            f[i] = x[i] / scales[i];
        }
        f[4] = states.torque(k) / scales[4];
        for i in 5..P {
            f[i] = past[i - 5];
        }
        let next = states.state(k + 1);
        let y = SVector::<f64, 4>::from_fn(|i, _| next[i] / scales[i]);
        rls.update(&f, &y);
        past = y - rls.theta.tr_mul(&f);
        if k.is_multiple_of(every) || k + 1 == rows {
            let phi = SMatrix::<f64, 5, 4>::from_fn(|i, j| rls.theta[(i, j)] * scales[j] / scales[i]);
            last = states.parameters(&phi);
            history.time.push(states.record.start + k as f64 * states.record.dt);
            let physical = last.is_physical();
            for (i, (_, values)) in history.parameters.iter_mut().enumerate() {
                values.push(if physical { last.values[i] } else { f64::NAN });
            }
        }
    }
    if last.values.iter().all(|v| v.is_finite()) {
        Ok((last, history))
    } else {
        Err(RegressionError::Diverged { what: "the recursive regression of the state" })
    }
}
