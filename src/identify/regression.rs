//! The regressions that need no model run: LS, RLS and ELS on the rows of [`Record`] in the form F5.
//!
//! ```text
//! F5   a1 = -(K/I1)*twist - (B/I1)*rate + (1/I1)*torque      motor
//!      a2 =  (K/I2)*twist + (B/I2)*rate                      table
//! ```
//!
//! The accelerations, which noise hurts most, stand on the left; the unknowns are reconciled to I1, I2, B, K by
//! [`Rows::reconcile`].
//!
//! Standard errors allow for residuals that are not white ([`super::long_run`]): the covariance of the least-squares
//! estimate is `inv(X'X)*Omega*inv(X'X)` with the long-run covariance of the scores `x*e`, over both equations, whose
//! residuals may go together. They are never smaller than those of white residuals.

use nalgebra::{DMatrix, SMatrix, SVector};

use super::long_run::{self, Scores};
use super::lsq::{Deficient, Solution, Triangle, triangularise};
use super::parameters::{Estimated, Rows};
use super::record::{Record, Row};
use super::recursive::{Els, Rls};
use super::result::History;

/// Past residuals in the noise model of ELS.
pub const NOISE_ORDER: usize = 2;
/// Unknowns of the motor's and the table's row with a noise model.
const MOTOR_ELS: usize = 3 + NOISE_ORDER;
const TABLE_ELS: usize = 2 + NOISE_ORDER;
/// Most rounds of batch ELS.
const ROUNDS: usize = 50;
/// Points of a parameter history.
const HISTORY: usize = 400;

/// A regression that the data cannot carry.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RegressionError {
    /// Directions that the record does not excite.
    #[error(
        "the record does not determine {parameters} ({side} equation): {why}. Excite the axis around and above its \
         natural frequency, with both sides moving"
    )]
    Unexcited {
        /// `motor` or `table`.
        side: &'static str,
        /// The parameters.
        parameters: String,
        /// What the data show.
        why: String,
    },
    /// Too few rows.
    #[error("{rows} rows for {unknowns} unknowns; record longer")]
    TooShort {
        /// Rows there are.
        rows: usize,
        /// Unknowns.
        unknowns: usize,
    },
    /// An iteration that did not settle.
    #[error("{what} did not settle; use OE (--method oe), which needs no noise-free regressors")]
    Diverged {
        /// What.
        what: &'static str,
    },
}

fn unexcited(side: &'static str, names: &[&str], e: &Deficient) -> RegressionError {
    let which: Vec<&str> = e.columns.iter().filter_map(|c| names.get(*c).copied()).collect();
    let parameters = if which.is_empty() { names.join(", ") } else { which.join(", ") };
    let why = if e.smallest == 0.0 {
        "the signal that goes with it is zero throughout".to_owned()
    } else {
        format!("its signals are dependent to {:.0e}", e.smallest)
    };
    RegressionError::Unexcited { side, parameters, why }
}

const MOTOR: [&str; 3] = ["K", "B", "I1"];
const TABLE: [&str; 2] = ["K/I2", "B/I2"];

fn long_enough(rows: usize, unknowns: usize) -> Result<usize, RegressionError> {
    if rows < 4 * unknowns { Err(RegressionError::TooShort { rows, unknowns }) } else { Ok(rows) }
}

/// Variance of a row's residual, kept above what rounding leaves of the left side.
fn variance(solution: &Solution, left: f64) -> f64 {
    solution.variance(0).max((1e-15 * left).powi(2)).max(f64::MIN_POSITIVE)
}

/// Least squares (paper, eq. 7; by QR).
///
/// # Errors
/// When the record is too short or does not excite a direction.
pub fn least_squares(record: &Record) -> Result<Estimated, RegressionError> {
    Ok(rows(record)?.reconcile())
}

/// Least squares for both rows.
pub(super) fn rows(record: &Record) -> Result<Rows, RegressionError> {
    let mut squares = LeastSquares::new(record.rows());
    squares.extend(record, record.rows());
    squares.rows()
}

/// The motor's row: regressors and left side.
const fn motor_row(r: &Row) -> [f64; 4] {
    [-r.twist, -r.rate, r.torque, r.a1]
}

/// The table's row.
const fn table_row(r: &Row) -> [f64; 3] {
    [r.twist, r.rate, r.a2]
}

/// Products over a block: of the motor's regressors, 3 x 4, and of the table's, 2 x 3.
type Products = ([[f64; 4]; 3], [[f64; 3]; 2]);

/// Products of the regressors with themselves and with the left side over blocks of rows: from them the scores follow
/// for any estimate, without a second pass.
pub(super) struct Moments {
    block: usize,
    rows: usize,
    taken: usize,
    /// One pair a block.
    sums: Vec<Products>,
}

impl Moments {
    /// Of a record of so many rows.
    pub fn new(rows: usize) -> Self {
        Self { block: long_run::block(rows), rows, taken: 0, sums: Vec::new() }
    }

    fn take(&mut self, r: &Row) {
        if self.taken.is_multiple_of(self.block) {
            self.sums.push(Default::default());
        }
        self.taken += 1;
        let Some((motor, table)) = self.sums.last_mut() else { return };
        let (m, t) = (motor_row(r), table_row(r));
        for i in 0..3 {
            for j in 0..4 {
                motor[i][j] += m[i] * m[j];
            }
        }
        for i in 0..2 {
            for j in 0..3 {
                table[i][j] += t[i] * t[j];
            }
        }
    }

    /// Covariance of K/I1, B/I1, 1/I1, K/I2, B/I2 at an estimate by least squares that forgets with `lambda`.
    ///
    /// The sums of squares are over the rows that the estimate remembers, `3/(1 - lambda)` of them; its weights fall as
    /// `lambda^k`, so that `Omega = sum(lambda^2k)*long-run covariance` and `X'X = sum(lambda^k)*mean(x*x')`.
    pub fn covariance(
        &self,
        motor: &SVector<f64, 3>,
        table: &SVector<f64, 2>,
        lambda: f64,
    ) -> Option<SMatrix<f64, 5, 5>> {
        let remembered = if lambda < 1.0 { (3.0 / (1.0 - lambda)).ceil() as usize } else { self.rows };
        let blocks = remembered.div_ceil(self.block).clamp(1, self.sums.len().max(1));
        let skipped = self.sums.len() - blocks.min(self.sums.len());
        let part = &self.sums[skipped..];
        let rows = self.taken - skipped * self.block;
        let mut scores = Scores::in_blocks(rows, 5, self.block);
        let mut information = SMatrix::<f64, 5, 5>::zeros();
        for (b, (m, t)) in part.iter().enumerate() {
            for i in 0..3 {
                scores.add_block(b, i, m[i][3] - (0..3).map(|j| m[i][j] * motor[j]).sum::<f64>());
                (0..3).for_each(|j| information[(i, j)] += m[i][j]);
            }
            for i in 0..2 {
                scores.add_block(b, 3 + i, t[i][2] - (0..2).map(|j| t[i][j] * table[j]).sum::<f64>());
                (0..2).for_each(|j| information[(3 + i, 3 + j)] += t[i][j]);
            }
        }
        let n = rows as f64;
        // Sums of the weights and of their squares, over n rows.
        let sums = |l: f64| if l < 1.0 { (1.0 - l.powf(n)) / (1.0 - l) } else { n };
        let (first, second) = (sums(lambda), sums(lambda * lambda));
        sandwich(&(information * (first / n)), &(scores.omega_of::<5>() * (second / n)))
    }
}

/// `inv(information)*omega*inv(information)`; None where a direction is not determined.
fn sandwich<const N: usize>(
    information: &SMatrix<f64, N, N>,
    omega: &SMatrix<f64, N, N>,
) -> Option<SMatrix<f64, N, N>> {
    let scale = SVector::<f64, N>::from_fn(|i, _| 1.0 / information[(i, i)].sqrt());
    let scaled = DMatrix::from_fn(N, N, |i, j| information[(i, j)] * scale[i] * scale[j]);
    let inverse = scaled.try_inverse()?;
    let inverse = SMatrix::<f64, N, N>::from_fn(|i, j| inverse[(i, j)] * scale[i] * scale[j]);
    let covariance = inverse * omega * inverse.transpose();
    covariance.iter().all(|v| v.is_finite()).then_some(covariance)
}

/// Least squares that takes the rows part by part.
pub(super) struct LeastSquares {
    motor: Triangle,
    table: Triangle,
    count: usize,
    moments: Moments,
}

impl LeastSquares {
    /// For a record of so many rows.
    pub fn new(rows: usize) -> Self {
        Self { motor: Triangle::empty(3, 1), table: Triangle::empty(2, 1), count: 0, moments: Moments::new(rows) }
    }

    /// Takes the first `count` rows of a record, a multiple of [`super::lsq::BLOCK`] in every part but the last.
    pub fn extend(&mut self, record: &Record, count: usize) {
        self.motor.extend(count, |k, out| out.copy_from_slice(&motor_row(&record.row(k))));
        self.table.extend(count, |k, out| out.copy_from_slice(&table_row(&record.row(k))));
        (0..count).for_each(|k| self.moments.take(&record.row(k)));
        self.count += count;
    }

    /// What the standard errors are made of.
    pub const fn moments(&self) -> &Moments {
        &self.moments
    }

    /// Share of the accelerations' squares that the equations explain, motor and table; zero where they cannot be solved.
    pub fn explained(&self) -> [f64; 2] {
        let of = |triangle: &Triangle, column: usize| {
            let size = triangle.rms(column).powi(2);
            triangle.solve().map_or(0.0, |s| if size > 0.0 { 1.0 - s.variance(0) / size } else { 0.0 })
        };
        [of(&self.motor, 3), of(&self.table, 2)]
    }

    /// The estimates.
    pub fn rows(&self) -> Result<Rows, RegressionError> {
        long_enough(self.count, 5)?;
        let m = self.motor.solve().map_err(|e| unexcited("motor", &MOTOR, &e))?;
        let t = self.table.solve().map_err(|e| unexcited("table", &TABLE, &e))?;
        if t.phi.iter().all(|v| *v == 0.0) {
            let why = "the table does not move".to_owned();
            return Err(RegressionError::Unexcited { side: "table", parameters: "I2".to_owned(), why });
        }
        let (vm, vt) = (variance(&m, self.motor.rms(3)), variance(&t, self.table.rms(2)));
        let motor = SVector::from_fn(|i, _| m.phi[(i, 0)]);
        let table = SVector::from_fn(|i, _| t.phi[(i, 0)]);
        Ok(Rows {
            motor,
            motor_covariance: SMatrix::from_fn(|i, j| m.inverse[(i, j)] * vm),
            table,
            table_covariance: SMatrix::from_fn(|i, j| t.inverse[(i, j)] * vt),
            coloured: self.moments.covariance(&motor, &table, 1.0),
        })
    }
}

/// Scales that bring regressors and left sides to unit rms.
pub(super) struct Scales {
    motor: [f64; 4],
    table: [f64; 3],
}

/// Sums of squares of what a row holds.
#[derive(Default)]
pub(super) struct Sums {
    sums: [f64; 5],
    count: usize,
}

impl Sums {
    /// Takes one row.
    pub fn take(&mut self, r: &Row) {
        for (sum, v) in self.sums.iter_mut().zip([r.twist, r.rate, r.torque, r.a1, r.a2]) {
            *sum += v * v;
        }
        self.count += 1;
    }
}

impl Scales {
    fn new(record: &Record) -> Result<Self, RegressionError> {
        let mut sums = Sums::default();
        (0..record.rows()).for_each(|k| sums.take(&record.row(k)));
        Self::of(&sums)
    }

    /// From the sums over all rows.
    pub fn of(sums: &Sums) -> Result<Self, RegressionError> {
        let n = long_enough(sums.count, 5)?;
        let [twist, rate, torque, a1, a2] = sums.sums.map(|s| (s / n as f64).sqrt());
        for (value, name) in [(twist, "K"), (rate, "B"), (torque, "I1"), (a1, "I1"), (a2, "I2")] {
            if value == 0.0 || !value.is_finite() {
                let why = "the signal that goes with it is zero throughout".to_owned();
                return Err(RegressionError::Unexcited { side: "motion", parameters: name.to_owned(), why });
            }
        }
        Ok(Self { motor: [twist, rate, torque, a1], table: [twist, rate, a2] })
    }

    fn rows(
        &self,
        (motor, motor_covariance): (SVector<f64, 3>, SMatrix<f64, 3, 3>),
        (table, table_covariance): (SVector<f64, 2>, SMatrix<f64, 2, 2>),
    ) -> Rows {
        let m = |i: usize| self.motor[3] / self.motor[i];
        let t = |i: usize| self.table[2] / self.table[i];
        Rows {
            motor: SVector::from_fn(|i, _| motor[i] * m(i)),
            motor_covariance: SMatrix::from_fn(|i, j| motor_covariance[(i, j)] * m(i) * m(j)),
            table: SVector::from_fn(|i, _| table[i] * t(i)),
            table_covariance: SMatrix::from_fn(|i, j| table_covariance[(i, j)] * t(i) * t(j)),
            coloured: None,
        }
    }
}

/// Running residual variance of a recursive method, with the method's forgetting.
#[derive(Default)]
struct Variance {
    sum: f64,
    weight: f64,
}

impl Variance {
    fn add(&mut self, lambda: f64, square: f64) {
        self.sum = lambda * self.sum + square;
        self.weight = lambda * self.weight + 1.0;
    }

    fn value(&self) -> f64 {
        (self.sum / self.weight.max(1.0)).max(1e-30)
    }
}

/// Collects a history at some hundred rows.
struct Recorder {
    every: usize,
    history: History,
}

impl Recorder {
    fn new(rows: usize) -> Self {
        let parameters = super::parameters::NAMES.iter().map(|n| (*n, Vec::new())).collect();
        Self { every: rows.div_ceil(HISTORY).max(1), history: History { time: Vec::new(), parameters } }
    }

    fn wants(&self, k: usize, rows: usize) -> bool {
        k.is_multiple_of(self.every) || k + 1 == rows
    }

    fn take(&mut self, time: f64, estimated: &Estimated) {
        self.history.time.push(time);
        let physical = estimated.is_physical();
        for (i, (_, values)) in self.history.parameters.iter_mut().enumerate() {
            values.push(if physical { estimated.values[i] } else { f64::NAN });
        }
    }
}

/// Recursive least squares with forgetting factor `lambda` and `P(0) = p0*I` on regressors of unit rms; the estimate at
/// the end and its history.
///
/// # Errors
/// When the record is too short or a signal is zero throughout.
pub fn recursive(record: &Record, lambda: f64, p0: f64) -> Result<(Estimated, History), RegressionError> {
    let n = record.rows();
    let mut recursion = Recursion::new(Scales::new(record)?, n, lambda, p0);
    let mut moments = Moments::new(n);
    for k in 0..n {
        let row = record.row(k);
        recursion.take(&row, k, record.time(k));
        moments.take(&row);
    }
    recursion.finish(&moments)
}

/// Recursive least squares that takes the rows one by one.
pub(super) struct Recursion {
    scales: Scales,
    rows: usize,
    lambda: f64,
    motor: Rls<3, 1>,
    table: Rls<2, 1>,
    variances: (Variance, Variance),
    recorder: Recorder,
    last: Option<Rows>,
}

impl Recursion {
    /// For so many rows.
    pub fn new(scales: Scales, rows: usize, lambda: f64, p0: f64) -> Self {
        Self {
            scales,
            rows,
            lambda,
            motor: Rls::new(lambda, p0),
            table: Rls::new(lambda, p0),
            variances: Default::default(),
            recorder: Recorder::new(rows),
            last: None,
        }
    }

    /// Takes row `k`, which lies at `time` (s).
    pub fn take(&mut self, r: &Row, k: usize, time: f64) {
        let (lambda, s) = (self.lambda, &self.scales.motor);
        let f = SVector::from([-r.twist / s[0], -r.rate / s[1], r.torque / s[2]]);
        let y = r.a1 / s[3];
        self.motor.update(&f, &[y].into());
        self.variances.0.add(lambda, (y - self.motor.theta.column(0).dot(&f)).powi(2));
        let s = &self.scales.table;
        let f = SVector::from([r.twist / s[0], r.rate / s[1]]);
        let y = r.a2 / s[2];
        self.table.update(&f, &[y].into());
        self.variances.1.add(lambda, (y - self.table.theta.column(0).dot(&f)).powi(2));
        if self.recorder.wants(k, self.rows) {
            let (motor, table) = (&self.motor, &self.table);
            let rows = self.scales.rows(
                (motor.theta.column(0).into(), motor.covariance * self.variances.0.value()),
                (table.theta.column(0).into(), table.covariance * self.variances.1.value()),
            );
            self.recorder.take(time, &rows.reconcile());
            self.last = Some(rows);
        }
    }

    /// The estimate at the end and its history; the moments of the same rows give its standard errors.
    pub fn finish(self, moments: &Moments) -> Result<(Estimated, History), RegressionError> {
        let rows = self.last.ok_or(RegressionError::Diverged { what: "RLS" })?;
        let coloured = moments.covariance(&rows.motor, &rows.table, self.lambda);
        Ok((Rows { coloured, ..rows }.reconcile(), self.recorder.history))
    }
}

/// Extended least squares, recursive: a moving-average noise model of order [`NOISE_ORDER`] in each row.
///
/// # Errors
/// As [`recursive`].
pub fn extended_recursive(record: &Record, lambda: f64, p0: f64) -> Result<(Estimated, History), RegressionError> {
    let scales = Scales::new(record)?;
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
            // The noise before a gap says nothing of the noise behind it.
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
    record: &Record,
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
        // A recursion that remembers its first steps need not have come to rest where the sum of its scores is zero: what is
        // left of the way there is an error, too.
        let way = inverse * SVector::<f64, ALL>::from(scores.total::<ALL>());
        covariance += way * way.transpose();
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
        let mut residual = y - x.iter().zip(theta).map(|(a, b)| a * b).sum::<f64>();
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
/// estimates rest.
///
/// # Errors
/// When the record is too short, does not excite a direction, or the rounds do not settle.
pub fn extended_batch(record: &Record) -> Result<Estimated, RegressionError> {
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
        // Noise at the edge of invertibility (differences of white noise) makes the rounds hover instead of settle: what
        // stays within half a standard error is no different estimate.
        if moved < if round == ROUNDS { 0.5 } else { 1e-3 } {
            return Ok(fitted);
        }
    }
    Err(RegressionError::Diverged { what: "batch ELS" })
}
