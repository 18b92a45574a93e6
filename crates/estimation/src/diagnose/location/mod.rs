//! Where the gap lies, whatever its cause: in the chain, in time, in frequency, in state.
//!
//! The residual torques `r1`, `r2` are what the model lacks to follow the record ([`crate::diagnose::procedure`]), in the sign of
//! `I1*a1 + B*(w1 - w2) + K*(th1 - th2) - T` and `I2*a2 - B*(w1 - w2) - K*(th1 - th2)`: positive where a torque drives the axis that the model does not know.

mod appearance;
mod by_frequency;
mod by_state;
mod by_time;

pub use appearance::{Appearance, Dependence, OwnFrequency};
pub use by_frequency::{FrequencyPart, PartOf};
pub use by_state::{Bin, Shape, StateCurve, StateVariable};
pub use by_time::{Spread, TimeSlot};

use crate::axis::{Parameters, Structure};
use crate::conditioning::{Record, find_period};
use crate::diagnose::diagnosis::Site;
use crate::effects::Place;
use crate::numerics::level::rms;

/// Parts that a residual is told in: of the record in time, of its frequencies, of a state; and orders of the motor's turn looked at.
const CELLS: usize = 20;

/// Which of the residual torques.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// `r1`; a rigid axis has no other.
    Motor,
    /// `r2`.
    Table,
}

/// Where a residual torque shows.
#[derive(Debug, Clone)]
pub struct Location {
    /// The place in the chain.
    pub site: Site,
    /// Rms of `r1`, N.m.
    pub rms: f64,
    /// What `r1` looks like.
    pub looks: Appearance,
    /// Rms in slots of time.
    pub by_time: Vec<TimeSlot>,
    /// Parts by frequency.
    pub by_frequency: Vec<FrequencyPart>,
    /// Residuals against the state.
    pub by_state: Vec<StateCurve>,
}

/// Residual torques and smoothed states, by sample.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Residual {
    /// Torque on the motor that the model does not know, N.m.
    pub r1: Vec<f64>,
    /// The same on the table; empty for a rigid axis.
    pub r2: Vec<f64>,
    /// Smoothed `[theta1, omega1, theta2, omega2]`.
    pub states: Vec<[f64; 4]>,
}

impl Residual {
    /// The torques that there are.
    fn series(&self) -> impl Iterator<Item = (Side, &[f64])> {
        [(Side::Motor, &self.r1[..]), (Side::Table, &self.r2[..])].into_iter().filter(|(_, r)| !r.is_empty())
    }
}

/// How a residual torque that acts at a site shows: in time, frequency and state.
#[must_use]
pub fn along(record: &Record, residual: &Residual, site: Site) -> Location {
    let Residual { r1, r2, .. } = residual;
    let flexible = !r2.is_empty();
    let by_state = state_curves(record, residual, flexible);
    let by_frequency = frequency_parts(record, residual);
    let at_site = if flexible && site == Site::At(Place::Table) { r2 } else { r1 };
    let by_time = by_time::by_time(record.start, record.dt, r1, flexible.then_some(&r2[..]), at_site);
    let looks = Appearance {
        dependence: appearance::dependence(&by_state, Side::Motor),
        frequency: appearance::frequency(&by_frequency, Side::Motor),
        spread: by_time::spread(&by_time),
    };
    Location { site, rms: rms(r1), looks, by_time, by_frequency, by_state }
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

fn frequency_parts(record: &Record, residual: &Residual) -> Vec<FrequencyPart> {
    let period = find_period(&record.torque);
    let theta1: Vec<f64> = residual.states.iter().map(|s| s[0]).collect();
    residual
        .series()
        .flat_map(|(side, r)| by_frequency::by_frequency(side, r, &record.torque, &theta1, record.dt, period))
        .collect()
}

fn state_curves(record: &Record, residual: &Residual, flexible: bool) -> Vec<StateCurve> {
    let column = |f: &dyn Fn(&[f64; 4]) -> f64| residual.states.iter().map(f).collect::<Vec<_>>();
    let mut variables = vec![
        (StateVariable::Omega1, column(&|s| s[1])),
        (StateVariable::Turn1, by_state::within_turn(&column(&|s| s[0]))),
        (StateVariable::Theta1, column(&|s| s[0])),
        (StateVariable::Torque, record.torque.clone()),
    ];
    if flexible {
        variables.extend([
            (StateVariable::Omega2, column(&|s| s[3])),
            (StateVariable::Turn2, by_state::within_turn(&column(&|s| s[2]))),
            (StateVariable::Theta2, column(&|s| s[2])),
            (StateVariable::Twist, column(&|s| s[0] - s[2])),
            (StateVariable::TwistRate, column(&|s| s[1] - s[3])),
        ]);
    }
    residual
        .series()
        .flat_map(|(side, r)| variables.iter().filter_map(move |(v, x)| by_state::curve(side, r, *v, x)))
        .collect()
}
