//! What models lack along the motion of one run, without a simulation of each (the inverse dynamics of robot identification: Gautier,
//! Khalil; Janot, Vandanjon, Gautier, IEEE TCST 22(1), 2014).
//!
//! The run's model was held to the measured motion as far as the discrepancy asks. Another lacks what that one does, with what its own
//! parameters make of the measured motion, in which the equations are linear, and what its effects resist the run's motion with. Exact for a
//! linear axis; where effects bend the motion, what is left out is of second order in what the model lacks.

use std::sync::Arc;

use rustfft::FftPlanner;

use super::hidden::Hidden;
use super::likelihood::{Band, C, MotionSpectra};
use super::model::{BaseParameter, Model};
use super::tracking::{Bandwidth, Torques, Tracked};
use super::trajectory::Trajectory;
use crate::conditioning::Record;
use crate::effects::{EFFECTS, Effect};

/// A run along which other models are compared.
#[derive(Debug)]
pub struct InverseDynamics {
    model: Model,
    /// Bandwidth at which it followed the record, rad/s.
    pub bandwidth: Bandwidth,
    /// Its motion at the samples, `[theta1, omega1, theta2, omega2]`.
    pub motion: Vec<[f64; 4]>,
    pub trajectory: Arc<Trajectory>,
    /// What it lacks beside its own effects and third inertias: torques on motor and table, N.m.
    without_effects: Torques,
}

impl InverseDynamics {
    /// Of a run of a model; `None` where its encoders read anything but its positions.
    pub fn new(
        model: &Model,
        bandwidth: Bandwidth,
        tracked: Tracked,
        trajectory: Trajectory,
        band: &Band,
        record: &Record,
    ) -> Option<Self> {
        if !Self::has_a_place_for(model) {
            return None;
        }
        let own = resisted(&trajectory, model, band, record);
        let mut without_effects = tracked.torque;
        add(&mut without_effects, &own, -1.0);
        Some(Self { model: *model, bandwidth, motion: tracked.motion, trajectory: trajectory.into(), without_effects })
    }

    /// Whether a model can be compared: its encoder reads its position when the torque says.
    pub fn has_a_place_for(model: &Model) -> bool {
        model.effects.active().sensors().is_empty()
    }

    /// Spectra of what a model lacks, whatever inertias without an encoder began with in it; `None` where its encoders read anything but its
    /// positions, or where it lacks no number.
    pub fn rows(
        &self,
        model: &Model,
        band: &Band,
        record: &Record,
        measured: &MotionSpectra,
        planner: &mut FftPlanner<f64>,
    ) -> Option<[Vec<C>; 2]> {
        if !Self::has_a_place_for(model) {
            return None;
        }
        let mut torque = resisted(&self.trajectory, model, band, record);
        add(&mut torque, &self.without_effects, 1.0);
        let mut rows = band.rows(&torque, 1.0, planner);
        for p in [BaseParameter::I1, BaseParameter::I2, BaseParameter::B, BaseParameter::K] {
            let by = p.value(&model.parameters) - p.value(&self.model.parameters);
            if by != 0.0 {
                let column = band.base_column(p, measured, by);
                for (row, column) in rows.iter_mut().zip(&column) {
                    row.iter_mut().zip(column).for_each(|(r, c)| *r += c);
                }
            }
        }
        rows.iter().flatten().all(|r| r.is_finite()).then_some(rows)
    }
}

/// What the effects of a model resist a trajectory with, third inertias by the measured motion, N.m.
fn resisted(trajectory: &Trajectory, model: &Model, band: &Band, record: &Record) -> Torques {
    let acts = |e: &Effect| model.effects.is_on(*e) && !e.is_mode();
    let mut torque = trajectory.resisted(model, EFFECTS.iter().copied().filter(acts));
    for mode in Hidden::modes(model, band.sides()) {
        let position = [mode.side, 1 - mode.side].iter().find_map(|side| record.channels[2 * side].as_deref());
        let pull = position.map(|y| mode.pull(y, record.dt)).unwrap_or_default();
        torque[mode.side].iter_mut().zip(pull).for_each(|(t, p)| *t += p);
    }
    torque
}

fn add(torque: &mut Torques, other: &Torques, by: f64) {
    for (torque, other) in torque.iter_mut().zip(other) {
        torque.iter_mut().zip(other).for_each(|(t, o)| *t += by * o);
    }
}
