//! What models lack along the motion of one run, without a simulation of each (the inverse dynamics of robot identification: Gautier,
//! Khalil; Janot, Vandanjon, Gautier, IEEE TCST 22(1), 2014).
//!
//! The run's model was held to the measured motion as far as the discrepancy asks. Another lacks what that one does, with what its own
//! parameters make of the measured motion, in which the equations are linear, and what its effects resist the run's motion with. Exact for a
//! linear axis; where effects bend the motion, what is left out is of second order in what the model lacks.

use std::sync::Arc;

use super::model::Model;
use super::tracking::{Bandwidth, Torques, Tracked, add_linear, measured_positions};
use super::trajectory::Trajectory;
use crate::conditioning::Record;
use crate::effects::{EFFECTS, Effect};

/// A run along which other models are compared.
#[derive(Debug)]
pub struct InverseDynamics {
    /// Bandwidth at which it followed the record, rad/s.
    pub bandwidth: Bandwidth,
    /// Its motion at the samples, `[theta1, omega1, theta2, omega2]`.
    pub motion: Vec<[f64; 4]>,
    pub trajectory: Arc<Trajectory>,
    /// Positions as measured, rad; zero of a side that is not.
    measured: Torques,
    /// What it lacks beside its own parameters and effects: torques on motor and table, N.m.
    rest: Torques,
}

impl InverseDynamics {
    /// Of a run of a model; `None` where the model is none of those that can be compared.
    pub fn new(
        model: &Model,
        bandwidth: Bandwidth,
        tracked: Tracked,
        trajectory: Trajectory,
        record: &Record,
    ) -> Option<Self> {
        if !Self::has_a_place_for(model) {
            return None;
        }
        let mut of = Self {
            bandwidth,
            motion: tracked.motion,
            trajectory: trajectory.into(),
            measured: measured_positions(record),
            rest: [vec![0.0; record.len()], vec![0.0; record.len()]],
        };
        let mut rest = tracked.torque;
        for (rest, own) in rest.iter_mut().zip(of.torque(model, record)) {
            rest.iter_mut().zip(own).for_each(|(r, o)| *r -= o);
        }
        of.rest = rest;
        Some(of)
    }

    /// The same along another motion, of which only the effects know: the equations of the axis are linear in the measured one.
    #[must_use]
    pub fn along(self, motion: Vec<[f64; 4]>, trajectory: Trajectory) -> Self {
        Self { motion, trajectory: trajectory.into(), ..self }
    }

    /// Whether a model can be compared: its encoder reads its position when the torque says.
    pub fn has_a_place_for(model: &Model) -> bool {
        model.effects.active().sensors().is_empty()
    }

    /// What a model keeps of the record's torque on its way in, N.m; `None` where all of it acts.
    pub fn kept(&self, model: &Model, record: &Record) -> Option<Vec<f64>> {
        let on = model.effects.active();
        let inputs = on.inputs();
        (!inputs.is_empty()).then(|| {
            let [kept, _] = self.trajectory.resisted(model, record, inputs.iter().copied());
            kept
        })
    }

    /// What a model lacks, along the run's motion.
    pub fn lacked(&self, model: &Model, record: &Record) -> Tracked {
        Tracked { torque: self.torque(model, record), motion: self.motion.clone() }
    }

    /// What a model lacks, on motor and table, N.m.
    pub fn torque(&self, model: &Model, record: &Record) -> Torques {
        let acts = |e: &Effect| model.effects.is_on(*e) && !e.is_mode();
        let mut torque = self.trajectory.resisted(model, record, EFFECTS.iter().copied().filter(acts));
        add_linear(model, record, &self.measured, &mut torque);
        for (torque, rest) in torque.iter_mut().zip(&self.rest) {
            torque.iter_mut().zip(rest).for_each(|(t, r)| *t += r);
        }
        torque
    }
}
