//! The twist of the coupling, logged in the table's place.
//!
//! Motor and table obey, with the twist `d = theta1 - theta2` (rad, m) and friction and a load on the table,
//!
//! ```text
//! I1*a1 + B*d' + K*d = T
//! a2 = (K/I2)*d + (B/I2)*d' + c*v2 + f*sign(v2) + g
//! ```
//!
//! A column in the table's place is read in two ways: as the table's angle `y`, with the twist `theta1 - y`, and as a multiple of the twist,
//! `y = m*d`, with the table at `theta1 - y/m`. The reading that leaves next to nothing of what the other one leaves is the true one. Read as
//! the table's angle, a twist accelerates itself by a stiffness of about zero: it is far smaller than the motor's angle and follows from
//! that one's acceleration.

use rayon::prelude::*;

use super::encoders::table_tracks_motor;
use super::finding::{Finding, Severity, rounded};
use super::motion::Direction;
use super::motor_side::fitting_twist;
use super::regression::Regression;
use super::rigid::{SAMPLES, SIGNIFICANT};
use super::robust::noise;
use super::smoothing::{noise_of_acceleration, smoothed, widths};
use super::{Input, NOMINAL_OFF};
use crate::numerics::level::deviation;

/// What the column may be of the twist: it, the difference the other way round, and either in a unit that is off by ten.
const MULTIPLES: [f64; 6] = [1.0, -1.0, 10.0, -10.0, 0.1, -0.1];
/// Standard deviation of a twist over that of the motor angle up to which the motor's equation alone tells it from a table's angle: at half the
/// antiresonance it is a third.
const SMALL: f64 = 0.5;
/// Share of the table's acceleration, in its variance, that a reading may leave.
const LEFT: f64 = 0.2;
/// The same over what the column leaves as the table's angle: of 752 sound records of two encoders the smallest was 0.15.
const NEXT_TO_NOTHING: f64 = 0.1;

/// The finding that the table's column is the twist or a multiple of it: either the table's equation of motion holds with it and not with the
/// column as the table's angle, or the motor's does and needs it.
pub(super) fn logged(input: &Input<'_>) -> Option<Finding> {
    let (x, y) = (input.theta1?, input.theta2?);
    if table_tracks_motor(input) {
        return None;
    }
    let multiple = match by_the_tables_equation(input, x, y) {
        Column::Table => return None,
        Column::Twist(multiple) => multiple,
        Column::Unknown => {
            let share = deviation(y) / deviation(x);
            let small: Vec<f64> = MULTIPLES.into_iter().filter(|m| share <= SMALL * m.abs()).collect();
            fitting_twist(input, &small)?
        }
    };
    let difference = if multiple > 0.0 { "theta1 - theta2" } else { "theta2 - theta1" };
    let (sense, size) = (if multiple > 0.0 { "less" } else { "plus" }, multiple.abs());
    let (of, way_out) = match size {
        1.0 => (String::new(), "it".to_owned()),
        _ => (format!("{size} times "), format!("{} times it", 1.0 / size)),
    };
    Some(Finding::new(
        "twist",
        Severity::Refuse,
        "theta2",
        format!(
            "theta2 goes {} times as far as theta1 and acts as the twist of the coupling, and not as a table: it is {of}{difference}.",
            rounded(deviation(y) / deviation(x))
        ),
        "The column holds the difference of the two encoders and not the table's angle.",
        format!(
            "Log the table's own encoder, or make its column of this one: theta1 {sense} {way_out}. Or leave it out in [signals]."
        ),
    ))
}

/// What a column in the table's place is.
#[derive(Debug, PartialEq)]
enum Column {
    /// The table's angle.
    Table,
    /// This multiple of the twist.
    Twist(f64),
    Unknown,
}

/// What the column is by the table's equation of motion: the table's angle wherever it holds with that. Nothing speaks against that where
/// the column's acceleration, or what is left of it, is its noise, as of a table that friction holds.
fn by_the_tables_equation(input: &Input<'_>, x: &[f64], y: &[f64]) -> Column {
    let mut as_table = f64::INFINITY;
    let mut as_twist = [f64::INFINITY; MULTIPLES.len()];
    let noise = noise(y);
    // In the time domain: friction has no line of its own, and of a short record few lines are slow.
    for width in widths(x.len()) {
        let (x, y) = (smoothed(x, width), smoothed(y, width));
        if let Some(reading) = Reading::of(input, x.len(), |k| [y[k], x[k] - y[k]]) {
            if reading.holds {
                return Column::Table;
            }
            // At twice the noise's variance it is more than that.
            let noise = 2.0 * (noise_of_acceleration(noise, width, input.dt) / reading.acceleration).powi(2);
            if noise < 1.0 {
                as_table = as_table.min(if reading.left > noise { reading.left } else { 0.0 });
            }
        }
        MULTIPLES.par_iter().zip(&mut as_twist).for_each(|(multiple, least)| {
            let reading = Reading::of(input, x.len(), |k| [x[k] - y[k] / multiple, y[k] / multiple]);
            *least = reading.filter(|r| r.holds).map_or(*least, |r| least.min(r.left));
        });
    }
    let holds = |left: f64| left < NEXT_TO_NOTHING * as_table && as_table.is_finite();
    let twist = MULTIPLES.into_iter().zip(as_twist).find(|(_, left)| holds(*left));
    twist.map_or(Column::Unknown, |(multiple, _)| Column::Twist(multiple))
}

/// A column's reading in the table's equation of motion.
struct Reading {
    /// Standard deviation of the table's acceleration, rad/s^2 (m/s^2).
    acceleration: f64,
    /// Share of its variance that is left.
    left: f64,
    /// Little is, with a significant stiffness that is about the nominal one where one is known.
    holds: bool,
}

impl Reading {
    /// Of the table's angle and the twist, rad (m), at each of `n` samples.
    fn of(input: &Input<'_>, n: usize, at: impl Fn(usize) -> [f64; 2] + Sync) -> Option<Self> {
        let dt = input.dt;
        let rates = |k: usize| {
            let ([before, twisted_before], [after, twisted_after]) = (at(k - 1), at(k + 1));
            [(after - before) / (2.0 * dt), (twisted_after - twisted_before) / (2.0 * dt)]
        };
        let acceleration = |k: usize| (at(k + 1)[0] - 2.0 * at(k)[0] + at(k - 1)[0]) / (dt * dt);
        let direction = Direction::of((1..n - 1).map(|k| rates(k)[0]));
        let row = |k: usize| {
            let [v, rate] = rates(k);
            ([at(k)[1], rate, v, direction.at(v), 1.0], acceleration(k))
        };
        let fit = Regression::of(n, row)?;
        let accelerations: Vec<f64> = (1..n - 1).step_by((n / SAMPLES).max(1)).map(acceleration).collect();
        let accelerations = deviation(&accelerations);
        let left = (fit.left / accelerations).powi(2);
        let stiffness = fit.values[0];
        let of_nominal = input.nominal.map(|nominal| stiffness * nominal.parameters.i2 / nominal.parameters.k);
        let holds = left < LEFT
            && of_nominal.is_none_or(|ratio| (NOMINAL_OFF.recip()..NOMINAL_OFF).contains(&ratio))
            && stiffness > SIGNIFICANT * fit.errors(row)[0];
        left.is_finite().then_some(Self { acceleration: accelerations, left, holds })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::axis::{Parameters, Structure};
    use crate::examine::Nominal;

    /// A table whose motion is given, with friction on it, and the motor that its equation of motion asks for, in closed form.
    #[test]
    fn the_reading_of_a_column_in_the_tables_equation_is_its_closed_form() {
        let p = Parameters { i1: 3e-4, i2: 2e-4, b: 0.0, k: 5.0, rho: 1.0 };
        let (dt, dry) = (1e-3, 0.004);
        let nominal = Some(Nominal { structure: Structure::TwoInertia, parameters: p });
        let parts: Vec<(f64, f64, f64)> = (1..20).map(f64::from).map(|i| (0.5 / i, 2.3 * i, 1.3 * i * i)).collect();
        let sum = |of: &dyn Fn(f64, f64) -> f64, t: f64| -> f64 {
            parts.iter().map(|(a, w, phase)| a * of(*w, w * t + phase)).sum()
        };
        let table: Vec<f64> = (0..4096_u32).map(|k| sum(&|_, p| p.sin(), f64::from(k) * dt)).collect();
        let twist: Vec<f64> = (0..4096_u32)
            .map(|k| {
                let t = f64::from(k) * dt;
                let friction = dry * sum(&|w, p| w * p.cos(), t).signum();
                (p.i2 * sum(&|w, p| -w * w * p.sin(), t) + friction) / p.k
            })
            .collect();
        let motor: Vec<f64> = table.iter().zip(&twist).map(|(x, d)| x + d).collect();
        for times_nominal in [1.0, 4.5, 5.5] {
            let off = Parameters { k: p.k / times_nominal, ..p };
            let nominal = nominal.map(|n| Nominal { parameters: off, ..n });
            let input = Input { dt, theta1: Some(&motor), theta2: Some(&twist), nominal, ..Input::default() };
            let reading = Reading::of(&input, 4096, |k| [table[k], twist[k]]).expect("it is determined");
            // Central differences of a frequency w are off by (w*dt)^2/12, here less than 2e-4 of the acceleration; friction, a fifth of
            // that, has no sign at one sample in fifty.
            assert!(reading.left < 2e-3, "{}", reading.left);
            assert_eq!(reading.holds, times_nominal < NOMINAL_OFF, "{times_nominal}");
        }
        let input = Input { dt, theta1: Some(&motor), theta2: Some(&twist), nominal, ..Input::default() };
        for multiple in MULTIPLES {
            let logged: Vec<f64> = twist.iter().map(|d| multiple * d).collect();
            assert_eq!(by_the_tables_equation(&input, &motor, &logged), Column::Twist(multiple));
        }
        assert_eq!(by_the_tables_equation(&input, &motor, &table), Column::Table);
        // Without a nominal stiffness the unit cannot be told, and the sign can.
        let unknown = Input { nominal: None, ..input };
        for (multiple, sign) in [(10.0, 1.0), (-0.1, -1.0)] {
            let logged: Vec<f64> = twist.iter().map(|d| multiple * d).collect();
            let column = by_the_tables_equation(&unknown, &motor, &logged);
            assert!(matches!(column, Column::Twist(m) if m.signum() == sign), "{column:?}");
        }
    }
}
