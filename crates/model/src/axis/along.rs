//! What other parameters of effects make of their torques along a motion that is given.

use super::axis_model::State;
use super::mechanics::{base, motions};
use super::parameters::{Parameters, Structure};
use crate::effects::{Base, Effect, Memory, Settings, StepMotion};

/// Parameters of an axis and of its effects, and what the effects remember.
#[derive(Debug, Clone, Copy)]
struct Variant {
    effects: Settings,
    base: Base<f64>,
    memory: Memory<f64>,
}

/// Some effects with one set of parameters and with another, both along the motion of one axis.
#[derive(Debug, Clone)]
pub struct TorqueChange {
    effects: Vec<Effect>,
    variants: [Variant; 2],
    /// At the end of the last step, on motor and table, N.m.
    last: [f64; 2],
}

impl TorqueChange {
    /// From one axis to another of the same structure, of some forces and dry frictions, which remember what they do when the motion begins.
    #[must_use]
    pub fn new(
        effects: Vec<Effect>,
        structure: Structure,
        variants: [(&Parameters, Settings, Memory<f64>); 2],
    ) -> Self {
        let variants = variants.map(|(p, effects, memory)| Variant { effects, base: base(p, structure), memory });
        Self { effects, variants, last: [0.0; 2] }
    }

    /// What the other resists more on motor and table, N.m, as its mean over a step of `h` s of the axis between two states, which ends at
    /// `time` s; dry friction slides as the axis does.
    #[must_use]
    pub fn step(&mut self, from: &State, to: &State, h: f64, time: f64) -> [f64; 2] {
        let (start, end) = (motions(&from.linear), motions(&to.linear));
        let step = StepMotion { start, end, time, h, modes: to.modes };
        let mut change = [0.0; 2];
        for &effect in &self.effects {
            let coordinate = effect.info().place.coordinate();
            let [own, other] = self.variants.each_mut().map(|v| v.torque(effect, &step));
            let push = coordinate.push();
            for i in 0..2 {
                change[i] += push[i] * (other - own);
            }
        }
        let mean = [0, 1].map(|i| 0.5 * (self.last[i] + change[i]));
        self.last = change;
        mean
    }
}

impl Variant {
    fn torque(&mut self, effect: Effect, step: &StepMotion<f64>) -> f64 {
        self.effects.torque_of(effect, &self.base, step, &mut self.memory)
    }
}
