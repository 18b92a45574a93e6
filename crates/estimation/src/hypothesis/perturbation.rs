//! What a model with other parameters of its effects lacks beyond another, along the other's motion: the derivative of a residual torque
//! without a simulation of its own.
//!
//! A change of an effect's torque changes the motion, too, and by that the effects' torques. Where the model is held to a measured motion,
//! that is of second order.

use super::model::Model;
use super::tracking::Torques;
use crate::axis::{Axis, State, TorqueChange};
use crate::conditioning::Record;
use crate::effects::{ActiveEffects, Effect, Place, Ramp, TorqueHistory};

/// Another model along the motion of a model.
pub struct Perturbation {
    change: TorqueChange,
    /// The torque's way in, where that is what the other has changed.
    input: Option<(Model, ActiveEffects, TorqueHistory<f64>)>,
    /// What it resists the motion with beyond the model, less what more of the torque arrives at its motor: at each sample as the hat
    /// function over its neighbours weighs it, which is what an impulse there would be.
    lacks: Torques,
    per: usize,
    h: f64,
}

impl Perturbation {
    /// From a model to another that differs in some effects, stepped in as many parts a sample as the model.
    pub fn new([model, other]: [&Model; 2], of: &[Effect], record: &Record, per: usize) -> Self {
        let torque = record.torque.first().copied().unwrap_or_default();
        let (inputs, forces): (Vec<Effect>, Vec<Effect>) = of.iter().partition(|e| e.info().place == Place::Input);
        let variants = [model, other].map(|m| (&m.parameters, m.effects, m.memory));
        let way_in = || (*other, other.effects.active(), TorqueHistory::settled(torque));
        Self {
            change: TorqueChange::new(forces, model.structure, variants),
            input: (!inputs.is_empty()).then(way_in),
            lacks: [vec![0.0; record.len()], vec![0.0; record.len()]],
            per,
            h: record.dt / per as f64,
        }
    }

    /// Part `j` of the interval from sample `k` on, which ends at `end` s, in which the axis moves from one state to another, under the torque
    /// `logged` that arrives at its motor as `arrived`; friction at rest takes all of what changes.
    pub fn step(
        &mut self,
        axis: &Axis,
        (k, j): (usize, usize),
        [from, to]: [&State; 2],
        [logged, arrived]: [Ramp<f64>; 2],
        end: f64,
    ) {
        let [mut motor, table] = self.change.step(from, to, self.h, end);
        if let Some((model, on, history)) = &mut self.input {
            let other = model.effects.transform_input(on, logged, self.h, history);
            motor -= 0.5 * (other.start + other.end - arrived.start - arrived.end);
        }
        let next = (j as f64 + 0.5) / self.per as f64;
        for ((lacks, torque), _) in
            self.lacks.iter_mut().zip([motor, table]).zip(axis.holds(to)).filter(|(_, held)| !held)
        {
            lacks[k] += torque * (1.0 - next) / self.per as f64;
            lacks[k + 1] += torque * next / self.per as f64;
        }
    }

    /// What the other lacks beyond the model.
    pub fn into_torques(self) -> Torques {
        self.lacks
    }
}
