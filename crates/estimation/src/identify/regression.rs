//! The regressions that need no simulation, on the rows of [`RegressionRecord`] in the form F5: LS and RLS, and what they share with ELS
//! ([`super::extended`]).
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
use super::lsq::{Deficient, Solution, Triangle};
use super::parameters::{Estimated, Rows};
use super::record::{RegressionRecord, Row};
use super::recursive::Rls;
use super::result::History;

/// Points of a parameter history.
const HISTORY: usize = 400;

/// Why a regression has no result.
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
    /// An iteration that did not converge.
    #[error("{what} did not converge; use OE (--method oe), which needs no noise-free regressors")]
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

/// The number of rows, where there are at least four for each unknown.
///
/// # Errors
/// [`RegressionError::TooShort`].
pub(super) fn long_enough(rows: usize, unknowns: usize) -> Result<usize, RegressionError> {
    if rows < 4 * unknowns { Err(RegressionError::TooShort { rows, unknowns }) } else { Ok(rows) }
}

/// Variance of a row's residual, kept above what rounding leaves of the left side.
pub(super) fn variance(solution: &Solution, left: f64) -> f64 {
    solution.variance(0).max((1e-15 * left).powi(2)).max(f64::MIN_POSITIVE)
}

/// Least squares (paper, eq. 7; by QR).
///
/// # Errors
/// When the record is too short or does not excite a direction.
pub fn least_squares(record: &RegressionRecord) -> Result<Estimated, RegressionError> {
    Ok(rows(record)?.reconcile())
}

/// Least squares for both rows.
///
/// # Errors
/// When the record is too short or does not excite a direction.
pub(super) fn rows(record: &RegressionRecord) -> Result<Rows, RegressionError> {
    let mut squares = LeastSquares::new(record.rows());
    squares.extend(record, record.rows());
    squares.rows()
}

/// The motor's row: regressors and left side.
pub(super) const fn motor_row(r: &Row) -> [f64; 4] {
    [-r.twist, -r.rate, r.torque, r.a1]
}

/// The table's row.
pub(super) const fn table_row(r: &Row) -> [f64; 3] {
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
    pub fn extend(&mut self, record: &RegressionRecord, count: usize) {
        self.motor.extend(count, |k, out| out.copy_from_slice(&motor_row(&record.row(k))));
        self.table.extend(count, |k, out| out.copy_from_slice(&table_row(&record.row(k))));
        (0..count).for_each(|k| self.moments.take(&record.row(k)));
        self.count += count;
    }

    /// The moments of the rows, for the standard errors.
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
    ///
    /// # Errors
    /// When there are too few rows, or a direction is not excited.
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
pub(super) struct RegressorScales {
    pub motor: [f64; 4],
    pub table: [f64; 3],
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

impl RegressorScales {
    /// From all rows of a record.
    ///
    /// # Errors
    /// When there are too few rows, or a regressor is zero throughout.
    pub fn new(record: &RegressionRecord) -> Result<Self, RegressionError> {
        let mut sums = Sums::default();
        (0..record.rows()).for_each(|k| sums.take(&record.row(k)));
        Self::of(&sums)
    }

    /// From the sums over all rows.
    ///
    /// # Errors
    /// When there are too few rows, or a regressor is zero throughout.
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

    /// Estimates and covariances on scaled rows, as they are on rows without scales.
    pub fn rows(
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
pub(super) struct Variance {
    sum: f64,
    weight: f64,
}

impl Variance {
    /// Takes the square of a residual.
    pub fn add(&mut self, lambda: f64, square: f64) {
        self.sum = lambda * self.sum + square;
        self.weight = lambda * self.weight + 1.0;
    }

    /// The variance, above zero.
    pub fn value(&self) -> f64 {
        (self.sum / self.weight.max(1.0)).max(1e-30)
    }
}

/// Collects a history at some hundred rows.
pub(super) struct Recorder {
    every: usize,
    pub history: History,
}

impl Recorder {
    /// For so many rows.
    pub fn new(rows: usize) -> Self {
        let parameters = super::parameters::NAMES.iter().map(|n| (*n, Vec::new())).collect();
        Self { every: rows.div_ceil(HISTORY).max(1), history: History { time: Vec::new(), parameters } }
    }

    /// Whether row `k` of so many goes in.
    pub fn wants(&self, k: usize, rows: usize) -> bool {
        k.is_multiple_of(self.every) || k + 1 == rows
    }

    /// Takes the estimate at a time, s.
    pub fn take(&mut self, time: f64, estimated: &Estimated) {
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
pub fn recursive(record: &RegressionRecord, lambda: f64, p0: f64) -> Result<(Estimated, History), RegressionError> {
    let n = record.rows();
    let mut recursion = Recursion::new(RegressorScales::new(record)?, n, lambda, p0);
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
    scales: RegressorScales,
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
    pub fn new(scales: RegressorScales, rows: usize, lambda: f64, p0: f64) -> Self {
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
    ///
    /// # Errors
    /// When the recursion diverged.
    pub fn finish(self, moments: &Moments) -> Result<(Estimated, History), RegressionError> {
        let rows = self.last.ok_or(RegressionError::Diverged { what: "RLS" })?;
        let coloured = moments.covariance(&rows.motor, &rows.table, self.lambda);
        Ok((Rows { coloured, ..rows }.reconcile(), self.recorder.history))
    }
}
