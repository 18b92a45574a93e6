//! The motor's equation of motion with the nominal parameters, `T = I1*a1 + B*d' + K*d`, where `d = theta1 - theta2` is the twist (rad, m):
//! it holds whatever other torque acts on the table. Residuals are ratios of standard deviations, without unit.

use super::smoothing::{smoothed, widths};
use super::{Input, Nominal, Structure};
use crate::numerics::level::deviation;

/// Residual with a column as logged, over that with the column corrected, below which the column needs no correction.
const BETTER_FIT: f64 = 0.8;

/// Residual with the coupling to the table as logged, over that without coupling, below which the column is this axis' table.
const NEEDED_REDUCTION: f64 = 0.5;

/// Whether the table's motion as logged explains a part of the motor's torque: another axis' table would leave a larger residual.
pub(super) fn coupling_explains_torque(input: &Input<'_>) -> bool {
    let of = |coupling: f64| motor_side_residual(input, coupling, 1.0, 1.0);
    of(1.0).zip(of(0.0)).is_some_and(|(with, without)| with < NEEDED_REDUCTION * without)
}

/// Whether the residual is smaller with torque and table angle as logged than with them times `torque` and `table` (factors, without unit).
pub(super) fn fits_better_as_logged(input: &Input<'_>, table: f64, torque: f64) -> bool {
    let of = |table: f64, torque: f64| motor_side_residual(input, 1.0, table, torque);
    of(1.0, 1.0).zip(of(table, torque)).is_some_and(|(logged, mended)| logged < BETTER_FIT * mended)
}

/// How the equation is fulfilled with the table's column taken as the twist.
pub(super) struct TwistFit {
    /// The residual is much smaller than with the column as the table's angle.
    pub(super) better: bool,
    /// The residual is larger without the coupling's torque.
    pub(super) needed: bool,
}

/// The table's column, times `sign`, taken as the twist; `None` without torque, both angles and a nominal model of two inertias.
pub(super) fn fit_as_twist(input: &Input<'_>, sign: f64) -> Option<TwistFit> {
    let twist: Vec<f64> = input.theta2?.iter().map(|d| sign * d).collect();
    let of = |coupling: f64| residual_with_twist(input, &twist, coupling, 1.0);
    let (logged, with, without) = (motor_side_residual(input, 1.0, 1.0, 1.0)?, of(1.0)?, of(0.0)?);
    Some(TwistFit { better: with < NEEDED_REDUCTION * logged, needed: with < BETTER_FIT * without })
}

/// Residual with the table's angle times `table`, the coupling's torque times `coupling` and the torque times `torque` (factors).
fn motor_side_residual(input: &Input<'_>, coupling: f64, table: f64, torque: f64) -> Option<f64> {
    let twist: Vec<f64> = input.theta1?.iter().zip(input.theta2?).map(|(a, b)| a - table * b).collect();
    residual_with_twist(input, &twist, coupling, torque)
}

/// Standard deviation of the residual over that of the torque, for a twist in rad (m): the least of all smoothings.
fn residual_with_twist(input: &Input<'_>, twist: &[f64], coupling: f64, torque: f64) -> Option<f64> {
    let Nominal { structure: Structure::TwoInertia, parameters: p } = input.nominal? else { return None };
    let (t, x1, dt) = (input.torque?, input.theta1?, input.dt);
    let by = |width: usize| {
        let [t, x, d] = [t, x1, twist].map(|v| smoothed(v, width));
        let missed = (1..t.len() - 1).map(|k| {
            let acceleration = (x[k + 1] - 2.0 * x[k] + x[k - 1]) / (dt * dt);
            let pull = p.b * (d[k + 1] - d[k - 1]) / (2.0 * dt) + p.k * d[k];
            torque * t[k] - p.i1 * acceleration - coupling * pull
        });
        deviation(&missed.collect::<Vec<f64>>()) / (torque.abs() * deviation(&t))
    };
    widths(x1.len()).map(by).filter(|share| share.is_finite()).min_by(f64::total_cmp)
}
