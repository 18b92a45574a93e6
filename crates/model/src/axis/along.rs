//! What effects make of their torques along a motion that is given.

use super::axis_model::State;
use super::mechanics::base;
use super::parameters::{Parameters, Structure};
use crate::effects::{Effect, Memory, Settings, StepMotion};

/// A motion of an axis, step by step: along it an effect's torque is told without solving for the motion.
#[derive(Debug, Clone, Default)]
pub struct Course {
    steps: Vec<StepMotion<f64>>,
}

impl Course {
    /// An empty one for so many steps.
    #[must_use]
    pub fn with_capacity(steps: usize) -> Self {
        Self { steps: Vec::with_capacity(steps) }
    }

    /// Adds a step of `h` s of the axis between two states, which ends at `time` s.
    pub fn push(&mut self, [from, to]: [&State; 2], h: f64, time: f64) {
        self.steps.push(StepMotion { start: from.linear, end: to.linear, time, h, modes: to.modes });
    }

    /// What an effect of an axis resists with at the end of each step, N.m against its coordinate; it remembers `memory` when the motion
    /// begins, and dry friction slides as the axis does.
    #[must_use]
    pub fn torques(
        &self,
        effect: Effect,
        parameters: &Parameters,
        structure: Structure,
        settings: &Settings,
        memory: &Memory<f64>,
    ) -> Vec<f64> {
        settings.torques_of(effect, &base(parameters, structure), &self.steps, memory)
    }
}
