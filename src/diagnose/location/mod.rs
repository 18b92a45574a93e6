//! Where the gap lies, whatever its cause: in the chain, in time, in frequency, in state.
//!
//! The residual torques `r1`, `r2` are what the model lacks to follow the record ([`super::torque`]), in the sign of
//! `I1*a1 + B*(w1 - w2) + K*(th1 - th2) - T` and `I2*a2 - B*(w1 - w2) - K*(th1 - th2)`: positive where a torque drives the axis that the model does not know.

mod by_frequency;
mod by_state;
mod by_time;
pub(super) mod words;

use serde::Serialize;

pub use by_frequency::FrequencyPart;
pub use by_state::{Bin, StateCurve};
pub use by_time::{Spread, TimeSlot};

use super::noise::find_period;
use super::record::Record;
use crate::axis::{Parameters, Structure};
use crate::effects::Place;

/// Where the gap lies.
#[derive(Debug, Clone, Serialize)]
pub struct Location {
    /// The place; `None` where nothing but parameters and initial state is needed.
    #[serde(skip)]
    pub place: Option<Place>,
    /// How the gap spreads over the record.
    pub spread: Spread,
    /// Rms in slots of time.
    pub by_time: Vec<TimeSlot>,
    /// Parts by frequency.
    pub by_frequency: Vec<FrequencyPart>,
    /// Residuals against the state.
    pub by_state: Vec<StateCurve>,
    /// In a sentence.
    pub summary: String,
    /// The residual torques and the states by sample.
    #[serde(skip)]
    pub residual: Residual,
}

/// Residual torques and smoothed states, by sample.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Residual {
    /// Torque on the motor that the model does not know, N.m.
    pub r1: Vec<f64>,
    /// The same on the table; empty for a rigid axis.
    pub r2: Vec<f64>,
    /// That of the two at the place found, N.m.
    pub at_place: Vec<f64>,
    /// Smoothed `[theta1, omega1, theta2, omega2]`.
    pub states: Vec<[f64; 4]>,
}

/// Where a residual torque on the one inertia of a rigid axis shows: in time, frequency and state.
#[must_use]
pub fn along(record: &Record, residual: Residual) -> Location {
    let flexible = !residual.r2.is_empty();
    let by_state = state_curves(record, &residual, flexible);
    let by_frequency = frequency_parts(record, &residual);
    let slots = by_time::by_time(
        record.start,
        record.dt,
        &residual.r1,
        flexible.then_some(&residual.r2[..]),
        &residual.at_place,
    );
    Location {
        place: None,
        spread: by_time::spread(&slots),
        by_time: slots,
        by_frequency,
        by_state,
        summary: String::new(),
        residual,
    }
}

/// The record with the table's angle moved to the motor's, where the two start farther apart than the coupling could
/// twist: encoders have their own zeros.
#[must_use]
pub fn without_offset(record: &Record, p: &Parameters, structure: Structure) -> Record {
    let mut record = record.clone();
    if let [Some(motor), _, Some(table), _] = &mut record.channels {
        let n = motor.len().max(1) as f64;
        let offset = motor.iter().zip(table.iter()).map(|(a, b)| a - b).sum::<f64>() / n;
        let peak = record.torque.iter().fold(0.0_f64, |m, t| m.max(t.abs()));
        let flexible = structure == Structure::TwoInertia && p.k > 0.0;
        let reach = if flexible { 5.0 * peak / p.k } else { 0.0 };
        if offset.abs() > reach {
            for v in table {
                *v += offset;
            }
        }
    }
    record
}

/// The series to look at: both residual torques.
fn series(residual: &Residual) -> Vec<((&'static str, &'static str), &[f64])> {
    let mut all: Vec<((&'static str, &'static str), &[f64])> = vec![(("r1", "N.m"), &residual.r1)];
    if !residual.r2.is_empty() {
        all.push((("r2", "N.m"), &residual.r2));
    }
    all
}

fn frequency_parts(record: &Record, residual: &Residual) -> Vec<FrequencyPart> {
    let period = find_period(&record.torque);
    let theta1: Vec<f64> = residual.states.iter().map(|s| s[0]).collect();
    series(residual)
        .into_iter()
        .flat_map(|((name, _), r)| by_frequency::by_frequency(name, r, &record.torque, &theta1, record.dt, period))
        .collect()
}

fn state_curves(record: &Record, residual: &Residual, flexible: bool) -> Vec<StateCurve> {
    let column = |f: &dyn Fn(&[f64; 4]) -> f64| residual.states.iter().map(f).collect::<Vec<_>>();
    let mut variables: Vec<by_state::Variable<'_>> = vec![
        ("omega1", "rad/s", column(&|s| s[1])),
        ("theta1 within the turn", "rad", by_state::within_turn(&column(&|s| s[0]))),
        ("theta1", "rad", column(&|s| s[0])),
        ("T", "N.m", record.torque.clone()),
    ];
    if flexible {
        variables.extend([
            ("omega2", "rad/s", column(&|s| s[3])),
            ("theta2 within the turn", "rad", by_state::within_turn(&column(&|s| s[2]))),
            ("theta2", "rad", column(&|s| s[2])),
            ("twist", "rad", column(&|s| s[0] - s[2])),
            ("twist rate", "rad/s", column(&|s| s[1] - s[3])),
        ]);
    }
    series(residual)
        .into_iter()
        .flat_map(|(name, r)| variables.iter().filter_map(move |v| by_state::curve(name, r, v)).collect::<Vec<_>>())
        .collect()
}
