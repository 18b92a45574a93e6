//! Extended least squares: the rows of [`super::regression`] with a moving-average noise model, recursive and in batches.
//!
//! ```text
//! y(k) = x(k)'*th + c1*e(k-1) + ... + cnc*e(k-nc) + e(k)
//! ```
//!
//! with the past residuals e in place of the noise, which nobody measures (L. Ljung, System Identification, 2nd ed., 10.3).

use nalgebra::{DMatrix, SMatrix, SVector};

use super::long_run::Scores;
use super::lsq::triangularise;
use super::parameters::{Estimated, Rows};
use super::record::RegressionRecord;
use super::recursive::Els;
use super::regression::{
    Recorder, RegressionError, RegressorScales, Variance, long_enough, motor_row, rows, table_row, variance,
};
use super::result::History;
use crate::trace::numerics::dot;

/// Past residuals in the noise model of ELS.
pub const NOISE_ORDER: usize = 2;
/// Unknowns of the motor's and the table's row with a noise model.
const MOTOR_ELS: usize = 3 + NOISE_ORDER;
const TABLE_ELS: usize = 2 + NOISE_ORDER;
/// Most rounds of batch ELS.
const ROUNDS: usize = 50;

/// Extended least squares, recursive: a moving-average noise model of order [`NOISE_ORDER`] in each row.
///
/// # Errors
/// As [`super::regression::recursive`].
pub fn extended_recursive(
    record: &RegressionRecord,
    lambda: f64,
    p0: f64,
) -> Result<(Estimated, History), RegressionError> {
    let scales = RegressorScales::new(record)?;
    let n = record.rows();
    // The past residuals are brought to the size of the other regressors by the level of the plain residuals.
    let plain = rows(record)?;
    let level = |sum: f64| if sum > 0.0 { 1.0 / (sum / n as f64).sqrt().max(1e-12) } else { 1e12 };
    let (mut sm, mut st) = (0.0, 0.0);
    for k in 0..n {
        let r = record.row(k);
        let motor = r.a1 + plain.motor[0] * r.twist + plain.motor[1] * r.rate - plain.motor[2] * r.torque;
        let table = r.a2 - plain.table[0] * r.twist - plain.table[1] * r.rate;
        sm += (motor / scales.motor[3]).powi(2);
        st += (table / scales.table[2]).powi(2);
    }
    let mut motor = Els::<MOTOR_ELS>::new(3, lambda, p0, level(sm));
    let mut table = Els::<TABLE_ELS>::new(2, lambda, p0, level(st));
    let (mut vm, mut vt) = (Variance::default(), Variance::default());
    let mut recorder = Recorder::new(n);
    let mut last = None;
    for k in 0..n {
        let r = record.row(k);
        if record.place(k).1 == 0 {
            // The noise before a gap is independent of that after it.
            motor.forget_noise();
            table.forget_noise();
        }
        let s = &scales.motor;
        let e = motor.update(&[-r.twist / s[0], -r.rate / s[1], r.torque / s[2]], r.a1 / s[3]);
        vm.add(lambda, e * e);
        let s = &scales.table;
        let e = table.update(&[r.twist / s[0], r.rate / s[1]], r.a2 / s[2]);
        vt.add(lambda, e * e);
        if recorder.wants(k, n) {
            let (m, t) = (&motor.rls, &table.rls);
            let rows = scales.rows(
                (m.theta.fixed_view::<3, 1>(0, 0).into(), m.covariance.fixed_view::<3, 3>(0, 0) * vm.value()),
                (t.theta.fixed_view::<2, 1>(0, 0).into(), t.covariance.fixed_view::<2, 2>(0, 0) * vt.value()),
            );
            recorder.take(record.time(k), &rows.reconcile());
            last = Some(rows);
        }
    }
    let rows = last.ok_or(RegressionError::Diverged { what: "ELS" })?;
    // The noise models on residuals as they are, not brought to unit size.
    let cm: Vec<f64> = (0..NOISE_ORDER).map(|l| motor.rls.theta[3 + l] * level(sm)).collect();
    let ct: Vec<f64> = (0..NOISE_ORDER).map(|l| table.rls.theta[2 + l] * level(st)).collect();
    let coloured = pseudolinear(record, (&rows.motor, &cm), (&rows.table, &ct), lambda);
    Ok((Rows { coloured, ..rows }.reconcile(), recorder.history))
}

/// Covariance of the five unknowns of both rows by extended least squares, `inv(H)*Omega*inv(H)'`:
///
/// ```text
/// e(k) = y - f'*th, f = [x ; e(k-1) .. e(k-nc)];  H = sum f*psi', psi(k) = f(k) - c1*psi(k-1) - ... - cnc*psi(k-nc)
/// ```
///
/// since the past residuals move with the estimates (L. Ljung, System Identification, 2nd ed., 10.3 and 9.4; pseudolinear
/// regression as an instrumental variable of its own gradient). None where the noise model is at the edge of stability.
fn pseudolinear(
    record: &RegressionRecord,
    (motor, cm): (&SVector<f64, 3>, &[f64]),
    (table, ct): (&SVector<f64, 2>, &[f64]),
    lambda: f64,
) -> Option<SMatrix<f64, 5, 5>> {
    const ALL: usize = MOTOR_ELS + TABLE_ELS;
    let n = record.rows();
    let remembered = if lambda < 1.0 { ((3.0 / (1.0 - lambda)).ceil() as usize).min(n) } else { n };
    let mut scores = Scores::new(remembered, ALL);
    let mut gradient = SMatrix::<f64, ALL, ALL>::zeros();
    let mut sizes = SVector::<f64, ALL>::zeros();
    let mut rows = (Filter::<MOTOR_ELS>::default(), Filter::<TABLE_ELS>::default());
    for k in 0..n {
        let r = record.row(k);
        if record.place(k).1 == 0 {
            rows = Default::default();
        }
        let ([a, b, c, y], [d, f, z]) = (motor_row(&r), table_row(&r));
        let (fm, pm, em) = rows.0.step(&[a, b, c], y, motor.as_slice(), cm);
        let (ft, pt, et) = rows.1.step(&[d, f], z, table.as_slice(), ct);
        let Some(k) = (k + remembered).checked_sub(n) else { continue };
        for i in 0..MOTOR_ELS {
            scores.add(k, i, fm[i] * em);
            sizes[i] += fm[i] * fm[i];
            (0..MOTOR_ELS).for_each(|j| gradient[(i, j)] += fm[i] * pm[j]);
        }
        for i in 0..TABLE_ELS {
            let at = MOTOR_ELS + i;
            scores.add(k, at, ft[i] * et);
            sizes[at] += ft[i] * ft[i];
            (0..TABLE_ELS).for_each(|j| gradient[(at, MOTOR_ELS + j)] += ft[i] * pt[j]);
        }
    }
    let count = remembered as f64;
    let sums = |l: f64| if l < 1.0 { (1.0 - l.powf(count)) / (1.0 - l) } else { count };
    let scale = sizes.map(|s| 1.0 / s.sqrt());
    let scaled = DMatrix::from_fn(ALL, ALL, |i, j| gradient[(i, j)] * scale[i] * scale[j]);
    let inverse = scaled.try_inverse()?;
    let inverse = SMatrix::<f64, ALL, ALL>::from_fn(|i, j| inverse[(i, j)] * scale[i] * scale[j]);
    let weight = sums(lambda * lambda) * count / sums(lambda).powi(2);
    let mut covariance = inverse * scores.omega_of::<ALL>() * inverse.transpose() * weight;
    if lambda >= 1.0 {
        // A recursion whose first steps still have weight need not end where the sum of its scores is zero: the remaining distance is an
        // error, too.
        let remaining = inverse * SVector::<f64, ALL>::from(scores.total::<ALL>());
        covariance += remaining * remaining.transpose();
    }
    let kept = [0, 1, 2, MOTOR_ELS, MOTOR_ELS + 1];
    let five = SMatrix::<f64, 5, 5>::from_fn(|i, j| covariance[(kept[i], kept[j])]);
    five.iter().all(|v| v.is_finite()).then_some(five)
}

/// Past residuals and gradients of one row with a noise model.
struct Filter<const P: usize> {
    residuals: [f64; NOISE_ORDER],
    gradients: [SVector<f64, P>; NOISE_ORDER],
}

impl<const P: usize> Default for Filter<P> {
    fn default() -> Self {
        Self { residuals: [0.0; NOISE_ORDER], gradients: [SVector::zeros(); NOISE_ORDER] }
    }
}

impl<const P: usize> Filter<P> {
    /// Regressor, gradient and residual of the next row.
    fn step(&mut self, x: &[f64], y: f64, theta: &[f64], noise: &[f64]) -> (SVector<f64, P>, SVector<f64, P>, f64) {
        let regressor = SVector::from_fn(|i, _| x.get(i).copied().unwrap_or_else(|| self.residuals[i - x.len()]));
        let mut gradient = regressor;
        let mut residual = y - dot(x, &theta[..x.len()]);
        for (l, c) in noise.iter().enumerate() {
            residual -= c * self.residuals[l];
            gradient -= self.gradients[l] * *c;
        }
        self.residuals.rotate_right(1);
        self.gradients.rotate_right(1);
        (self.residuals[0], self.gradients[0]) = (residual, gradient);
        (regressor, gradient, residual)
    }
}

/// Extended least squares in batches: LS, its residuals, LS with the past residuals as regressors, repeated until the
/// estimates converge.
///
/// # Errors
/// When the record is too short, does not excite a direction, or the rounds do not converge.
pub fn extended_batch(record: &RegressionRecord) -> Result<Estimated, RegressionError> {
    let n = long_enough(record.rows(), MOTOR_ELS)?;
    let plain = rows(record)?;
    let motor_of = |k: usize| {
        let [a, b, c, y] = motor_row(&record.row(k));
        ([a, b, c], y)
    };
    let table_of = |k: usize| {
        let [a, b, y] = table_row(&record.row(k));
        ([a, b], y)
    };
    let place = |k: usize| record.place(k).1;
    let motor = batch::<3>(n, plain.motor, plain.motor_covariance, motor_of, place)?;
    let table = batch::<2>(n, plain.table, plain.table_covariance, table_of, place)?;
    let coloured = match (&motor.coefficients[..], &table.coefficients[..]) {
        // Without noise there is no noise model.
        ([], _) | (_, []) => plain.coloured,
        (cm, ct) => pseudolinear(record, (&motor.phi, cm), (&table.phi, ct), 1.0),
    };
    let rows = Rows {
        motor: motor.phi,
        motor_covariance: motor.covariance,
        table: table.phi,
        table_covariance: table.covariance,
        coloured,
    };
    Ok(rows.reconcile())
}

/// What the rounds of batch ELS came to.
struct Fitted<const P: usize> {
    phi: SVector<f64, P>,
    covariance: SMatrix<f64, P, P>,
    /// Of the noise model.
    coefficients: Vec<f64>,
}

fn batch<const P: usize>(
    n: usize,
    plain: SVector<f64, P>,
    plain_covariance: SMatrix<f64, P, P>,
    row: impl Fn(usize) -> ([f64; P], f64) + Sync,
    place: impl Fn(usize) -> usize + Sync,
) -> Result<Fitted<P>, RegressionError> {
    let mut residual: Vec<f64> = (0..n)
        .map(|k| {
            let (x, y) = row(k);
            y - plain.dot(&SVector::from(x))
        })
        .collect();
    let mut fitted = Fitted { phi: plain, covariance: plain_covariance, coefficients: Vec::new() };
    let left = crate::numerics::level::rms(&(0..n).map(|k| row(k).1).collect::<Vec<_>>());
    for round in 1..=ROUNDS {
        // Without a residual beyond rounding there is no noise to model.
        if crate::numerics::level::rms(&residual) <= 1e-11 * left {
            return Ok(fitted);
        }
        let past = |k: usize, lag: usize| if place(k) >= lag { residual[k - lag] } else { 0.0 };
        let triangle = triangularise(n, P + NOISE_ORDER, 1, |k, out| {
            let (x, y) = row(k);
            out[..P].copy_from_slice(&x);
            for lag in 1..=NOISE_ORDER {
                out[P + lag - 1] = past(k, lag);
            }
            out[P + NOISE_ORDER] = y;
        });
        let solution = triangle.solve().map_err(|_| RegressionError::Diverged { what: "batch ELS" })?;
        let next = SVector::<f64, P>::from_fn(|i, _| solution.phi[(i, 0)]);
        let v = variance(&solution, triangle.rms(P + NOISE_ORDER));
        let moved =
            (0..P).map(|i| ((next[i] - fitted.phi[i]).powi(2) / fitted.covariance[(i, i)]).sqrt()).fold(0.0, f64::max);
        fitted.phi = next;
        fitted.covariance = SMatrix::from_fn(|i, j| solution.inverse[(i, j)] * v);
        fitted.coefficients = (0..NOISE_ORDER).map(|l| solution.phi[(P + l, 0)]).collect();
        let mut fresh = vec![0.0; n];
        for (k, fresh) in fresh.iter_mut().enumerate() {
            let (x, y) = row(k);
            let mut e = y - fitted.phi.dot(&SVector::from(x));
            for (l, c) in fitted.coefficients.iter().enumerate() {
                // The residuals of the round before, so that a noise model at the edge of stability cannot run away.
                e -= c * past(k, l + 1);
            }
            *fresh = e;
        }
        residual = fresh;
        // Noise at the edge of invertibility (differences of white noise) makes the rounds wander about the solution instead of converging: what
        // stays within half a standard error is no different estimate.
        if moved < if round == ROUNDS { 0.5 } else { 1e-3 } {
            return Ok(fitted);
        }
    }
    Err(RegressionError::Diverged { what: "batch ELS" })
}
