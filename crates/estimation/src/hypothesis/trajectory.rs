//! The motion that a model took along a record: along it, what the effects of any model resist with is told without a simulation.
//!
//! A change of an effect's torque changes the motion, too, and by that the effects' torques. Where the model is held to a measured motion,
//! that is of second order.

use super::arriving::Arriving;
use super::model::Model;
use super::tracking::Torques;
use crate::axis::{Axis, Course, State};
use crate::conditioning::Record;
use crate::effects::{Effect, Place};

/// The motion of a run, step by step.
#[derive(Debug)]
pub struct Trajectory {
    course: Course,
    /// Inertias that dry friction holds at the end of each step: all that changes is taken by it.
    held: Vec<[bool; 2]>,
    samples: usize,
    /// Steps a sample.
    per: usize,
    /// Length of a step, s.
    h: f64,
}

impl Trajectory {
    /// One without a step, for a record that is run in so many steps a sample.
    pub fn new(record: &Record, per: usize) -> Self {
        let steps = record.len() * per;
        Self {
            course: Course::with_capacity(steps),
            held: Vec::with_capacity(steps),
            samples: record.len(),
            per,
            h: record.dt / per as f64,
        }
    }

    /// Adds a step between two states, which ends at `time` s.
    pub fn push(&mut self, axis: &Axis, states: [&State; 2], time: f64) {
        self.course.push(states, self.h, time);
        self.held.push(axis.holds(states[1]));
    }

    /// What some effects of a model resist the motion with, on motor and table, N.m, what they keep of the record's torque on its way in among
    /// it: at each sample as the hat function over its neighbours weighs it, which is what an impulse there would be.
    pub fn resisted(&self, model: &Model, record: &Record, of: impl IntoIterator<Item = Effect>) -> Torques {
        let mut resisted = [vec![0.0; self.samples], vec![0.0; self.samples]];
        let mut changes_input = false;
        for effect in of {
            if effect.info().place == Place::Input {
                changes_input = true;
                continue;
            }
            let push = effect.info().place.coordinate().push();
            let torques =
                self.course.torques(effect, &model.parameters, model.structure, &model.effects, &model.memory);
            let mut last = 0.0;
            self.add(&mut resisted, push, |i| 0.5 * (std::mem::replace(&mut last, torques[i]) + torques[i]));
        }
        if changes_input {
            let (model, ahead) = &model.on_time();
            let mut arriving = Arriving::new(model, record, self.per, *ahead, 0);
            self.add(&mut resisted, [1.0, 0.0], |i| {
                let (k, j) = (i / self.per, i % self.per);
                let (logged, arrived) = (record.ramp(k, j, self.per, *ahead), arriving.over(k, j));
                0.5 * (logged.start + logged.end - arrived.start - arrived.end)
            });
        }
        resisted
    }

    /// Adds the mean torque of each step, as it acts on motor and table, to the samples.
    fn add(&self, resisted: &mut Torques, push: [f64; 2], mut torque: impl FnMut(usize) -> f64) {
        for (i, held) in self.held.iter().enumerate() {
            let (k, next) = (i / self.per, ((i % self.per) as f64 + 0.5) / self.per as f64);
            let torque = torque(i) / self.per as f64;
            for side in (0..2).filter(|&side| push[side] != 0.0 && !held[side]) {
                resisted[side][k] += push[side] * torque * (1.0 - next);
                resisted[side][k + 1] += push[side] * torque * next;
            }
        }
    }
}
