//! The end of a step with the modes held: torques that are what their laws give for the motion they lead to.
//!
//! One effect alone is one equation of one unknown; others are coupled, through the axis or through what sticks.

use super::axis_model::State;
use super::coupled::Coupled;
use super::lone::{Carry, Solve};
use super::mechanics::{Length, Mechanics};
use crate::effects::{Effect, Ramp};
use crate::scalar::Scalar;

/// A stretch of a step over which nothing changes its mode.
#[derive(Clone, Copy)]
pub(super) struct Leg<'a, S> {
    pub ramp: Ramp<S>,
    pub length: &'a Length<S>,
    /// Time at its end, s.
    pub end: f64,
}

impl Mechanics<f64> {
    /// The state at the end of a leg.
    #[inline]
    pub fn solve(&self, s: &State<f64>, leg: &Leg<f64>) -> State<f64> {
        match self.alone(s) {
            Some(effect) => effect.with_law(Solve { effect, mechanics: self, from: s, leg }),
            None => Coupled::new(self, s, leg).solve(leg.ramp.end),
        }
    }
}

impl<S: Scalar> Mechanics<S> {
    /// The state at the end of a leg, with derivatives, from what [`Mechanics::solve`] found without.
    pub fn carry(&self, s: &State<S>, leg: &Leg<S>, solved: &State<f64>) -> State<S> {
        match self.alone(s) {
            Some(effect) => effect.with_law(Carry { effect, mechanics: self, from: s, leg, solved }),
            None => Coupled::new(self, s, leg).carry(solved),
        }
    }

    /// The effect that acts alone and is free to move.
    fn alone(&self, s: &State<S>) -> Option<Effect> {
        self.lone.filter(|_| self.sticks(s) == [false, false])
    }
}

/// Torques at both ends of a leg, before the effects' at its end.
pub(super) fn before<S: Scalar>(s: &State<S>, ramp: &Ramp<S>) -> [[S; 2]; 2] {
    [[ramp.start - s.force[0], -s.force[1]], [ramp.end, S::default()]]
}
