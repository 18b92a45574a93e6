//! The twist of the coupling, logged in the table's place.
//!
//! Below the antiresonance the table moves as far as the motor or a little further. The twist `d` (rad, m) is far smaller there; it enters
//! the motor's equation of motion and accelerates the table:
//!
//! ```text
//! I1*a1 + B*d' + K*d = T
//! I2*(a1 - d'') = B*d' + K*d
//! ```

use super::finding::{Finding, Severity, rounded};
use super::motor_side::fit_as_twist;
use super::rigid::{MotionLines, rigid_band};
use super::{Input, NOMINAL_OFF};
use crate::numerics::level::deviation;

/// Standard deviation over that of the motor angle up to which a column may be the twist: at half the antiresonance it is a third.
const SMALL: f64 = 0.5;
/// Share of the power of the table's acceleration, over all lines of slow motion, that the column must explain.
const EXPLAINED: f64 = 0.8;
/// Least number of lines for that share to be significant.
const LEAST: usize = 6;

/// The finding that the table's column is the twist, with either sign: the motor's equation of motion fits better with the column as the
/// twist than as the table's angle, and either it does not fit without the column or the table's equation of motion holds with it.
pub(super) fn logged(input: &Input<'_>) -> Option<Finding> {
    let (x, y) = (input.theta1?, input.theta2?);
    let share = deviation(y) / deviation(x);
    if share.is_nan() || share > SMALL {
        return None;
    }
    let is_twist = |sign: f64| {
        fit_as_twist(input, sign).is_some_and(|fit| fit.better && (fit.needed || accelerates_the_table(input, sign)))
    };
    let sign = [1.0, -1.0].into_iter().find(|sign| is_twist(*sign))?;
    let (difference, way_out) =
        if sign > 0.0 { ("theta1 - theta2", "theta1 less it") } else { ("theta2 - theta1", "theta1 plus it") };
    Some(Finding::new(
        "twist",
        Severity::Refuse,
        "theta2",
        format!(
            "theta2 goes {} times as far as theta1, as the twist of the coupling does and no table: it is {difference}.",
            rounded(share)
        ),
        "The column holds the difference of the two encoders and not the table's angle.",
        format!(
            "Log the table's own encoder, or make its column of this one: {way_out}. Or leave it out in [signals]."
        ),
    ))
}

/// Whether the column, times `sign`, is the twist in the table's equation of motion, with about the nominal stiffness over inertia.
fn accelerates_the_table(input: &Input<'_>, sign: f64) -> bool {
    let (Some(x), Some(y), Some(nominal)) = (input.theta1, input.theta2, input.nominal) else { return false };
    let Some(MotionLines { spectra, lines }) = MotionLines::new(&[x, y], 0..2, input.dt, rigid_band(nominal)) else {
        return false;
    };
    if lines.len() < LEAST {
        return false;
    }
    // Stiffness and damping over the table's inertia (1/s^2, 1/s): two separate least squares, as d and d' are orthogonal.
    let (mut accelerations, mut twists, mut rates, mut by_twist, mut by_rate) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for f in lines {
        let (w, cross) = (spectra.omega(f), spectra.of(1, 0, f) * sign);
        let (motor, twist) = (spectra.power(0, f), spectra.power(1, f));
        accelerations += w.powi(4) * (motor + twist - 2.0 * cross.re);
        twists += twist;
        rates += w * w * twist;
        by_twist -= w * w * (cross.re - twist);
        by_rate -= w.powi(3) * cross.im;
    }
    let (k, b) = ((by_twist / twists).max(0.0), (by_rate / rates).max(0.0));
    let stiffness = nominal.parameters.k / nominal.parameters.i2;
    k * by_twist + b * by_rate > EXPLAINED * accelerations
        && (NOMINAL_OFF.recip()..NOMINAL_OFF).contains(&(k / stiffness))
}
