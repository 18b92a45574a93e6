//! The motor's side of the nominal axis, `T = I1*a1 + B*d' + K*d` with the twist `d`: it holds whatever else acts on the table.

use super::smoothing::{smoothed, widths};
use super::{Input, Nominal, Structure};
use crate::numerics::level::deviation;

/// Share of what the axis misses with a column mended that it may miss with the column as logged for nothing to be wrong with it.
const BETTER: f64 = 0.8;

/// Share of what a motor without coupling misses that it may miss with the coupling to the table as it is logged for that to be its table.
const FELT: f64 = 0.5;

/// Whether the motor feels the table's motion as it is logged, whatever moves that beside the coupling: of another axis' it would miss more.
pub(super) fn feels_the_table(input: &Input<'_>) -> bool {
    let of = |coupling: f64| missed_by_the_motor(input, coupling, 1.0, 1.0);
    of(1.0).zip(of(0.0)).is_some_and(|(with, without)| with < FELT * without)
}

/// Whether the motor's side has the torque and the table's motion as they are logged rather than times `torque` and `table`.
pub(super) fn rather_as_logged(input: &Input<'_>, table: f64, torque: f64) -> bool {
    let of = |table: f64, torque: f64| missed_by_the_motor(input, 1.0, table, torque);
    of(1.0, 1.0).zip(of(table, torque)).is_some_and(|(logged, mended)| logged < BETTER * mended)
}

/// What the motor's side makes of the table's column as the twist.
pub(super) struct AsTwist {
    /// As the table's motion it would need another torque by far.
    pub(super) rather: bool,
    /// Without it the torque is missed by more.
    pub(super) felt: bool,
}

/// The table's column, times `sign`, as the twist; None where the motor's side cannot be asked.
pub(super) fn as_twist(input: &Input<'_>, sign: f64) -> Option<AsTwist> {
    let twist: Vec<f64> = input.theta2?.iter().map(|d| sign * d).collect();
    let of = |coupling: f64| missed_with(input, &twist, coupling, 1.0);
    let (logged, with, without) = (missed_by_the_motor(input, 1.0, 1.0, 1.0)?, of(1.0)?, of(0.0)?);
    Some(AsTwist { rather: with < FELT * logged, felt: with < BETTER * without })
}

/// Share of the torque that the motor's side misses with the table's motion times `table` and so much of the coupling.
fn missed_by_the_motor(input: &Input<'_>, coupling: f64, table: f64, torque: f64) -> Option<f64> {
    let twist: Vec<f64> = input.theta1?.iter().zip(input.theta2?).map(|(a, b)| a - table * b).collect();
    missed_with(input, &twist, coupling, torque)
}

/// Share of the torque about its mean that the motor's side misses with a twist, by the smoothing that leaves the least.
fn missed_with(input: &Input<'_>, twist: &[f64], coupling: f64, torque: f64) -> Option<f64> {
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
