//! The motor's equation of motion with the nominal parameters, `T = I1*a1 + B*d' + K*d`, where `d = theta1 - theta2` is the twist (rad, m):
//! it holds whatever other torque acts on the table. Residuals are ratios of standard deviations, without unit.

use super::motion::{Direction, acceleration, speed};
use super::regression::Regression;
use super::rigid::SIGNIFICANT;
use super::smoothing::{smoothed, widths};
use super::standing::friction_holds_table;
use super::{Input, NOMINAL_OFF, Nominal, Structure};
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

/// Share of the nominal coupling's torque that the motor's torque holds.
struct CouplingShare {
    value: f64,
    /// Its standard error with the residual's own colour.
    error: f64,
    /// Standard deviation of what is left of the torque, N.m (N), over the torque's.
    left: f64,
}

/// What a table leaves of the torque over what one at rest leaves, up to which its motion is in the motor's torque: noise of its encoder leaves
/// a little more, another motion more by its own size.
const AS_AT_REST: f64 = 1.05;

/// Whether the motor's torque holds the torque of the nominal coupling to the table as logged, beside the friction and the load on the motor:
///
/// ```text
/// T = share*(B*d' + K*d) + I1*a + c*v + F*sign(v) + b
/// ```
///
/// A table that its own friction holds follows no motor, and its coupling pulls at the motor all the same, as a spring does; where it moves it
/// leaves no more of the torque than one at rest would. Another axis' table leaves more, or the motor is not pulled at. Where the motor's own
/// friction hides the pull, whose error then lets the nominal coupling in, the table must move as friction lets it.
pub(super) fn motor_holds_coupling(input: &Input<'_>) -> bool {
    let Some(table) = input.theta2 else { return false };
    let rests = vec![0.0; table.len()];
    coupling_share(input, table).zip(coupling_share(input, &rests)).is_some_and(|(share, rests)| {
        let (least, most) = (NOMINAL_OFF.recip(), NOMINAL_OFF);
        let reach = SIGNIFICANT * share.error;
        let shows = (least..most).contains(&share.value) && share.value > reach;
        let may_be = share.value + reach > least && share.value - reach < most;
        share.left <= AS_AT_REST * rests.left && (shows || may_be && friction_holds_table(input))
    })
}

/// The share for a table's angle, rad (m), with the smoothing that leaves the least of the torque.
fn coupling_share(input: &Input<'_>, table: &[f64]) -> Option<CouplingShare> {
    let Nominal { structure: Structure::TwoInertia, parameters: p } = input.nominal? else { return None };
    let (t, x1, dt) = (input.torque?, input.theta1?, input.dt);
    let by = |width: usize| {
        let [t, x, y] = [t, x1, table].map(|v| smoothed(v, width));
        let direction = Direction::of_angle(&x, dt);
        let row = |k: usize| {
            let v = speed(&x, k, dt);
            let pull = p.b * (v - speed(&y, k, dt)) + p.k * (x[k] - y[k]);
            ([pull, p.i1 * acceleration(&x, k, dt), v, direction.at(v), 1.0], t[k])
        };
        let fit = Regression::of(t.len(), row)?;
        let left = fit.left / deviation(&t);
        left.is_finite().then(|| CouplingShare { value: fit.values[0], error: fit.errors(row)[0], left })
    };
    widths(x1.len()).filter_map(by).min_by(|a, b| a.left.total_cmp(&b.left))
}

/// Whether the residual is smaller with torque and table angle as logged than with them times `torque` and `table` (factors, without unit).
pub(super) fn fits_better_as_logged(input: &Input<'_>, table: f64, torque: f64) -> bool {
    let of = |table: f64, torque: f64| motor_side_residual(input, 1.0, table, torque);
    of(1.0, 1.0).zip(of(table, torque)).is_some_and(|(logged, mended)| logged < BETTER_FIT * mended)
}

/// The first of the multiples of the twist that the table's column is by this equation: the residual is much smaller than with the column as
/// the table's angle, and it is larger without the coupling's torque. `None` without torque, both angles and a nominal model of two inertias.
pub(super) fn fitting_twist(input: &Input<'_>, multiples: &[f64]) -> Option<f64> {
    let column = input.theta2?;
    let of = |multiple: f64, coupling: f64| {
        let twist: Vec<f64> = column.iter().map(|y| y / multiple).collect();
        residual_with_twist(input, &twist, coupling, 1.0)
    };
    let (logged, without) = (motor_side_residual(input, 1.0, 1.0, 1.0)?, of(1.0, 0.0)?);
    let enough = (NEEDED_REDUCTION * logged).min(BETTER_FIT * without);
    multiples.iter().copied().find(|multiple| of(*multiple, 1.0).is_some_and(|with| with < enough))
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
            let pull = p.b * speed(&d, k, dt) + p.k * d[k];
            torque * t[k] - p.i1 * acceleration(&x, k, dt) - coupling * pull
        });
        deviation(&missed.collect::<Vec<f64>>()) / (torque.abs() * deviation(&t))
    };
    widths(x1.len()).map(by).filter(|share| share.is_finite()).min_by(f64::total_cmp)
}
