//! The end of a segment, a part of a step without an event: the torques of the effects solve `tau = law(motion(tau))`.
//!
//! A single law is one equation in one unknown; several, or one together with dry friction at rest, are coupled through
//! the axis.

use super::axis_model::State;
use super::coupled::Coupled;
use super::mechanics::{Length, Mechanics};
use super::single_law::{Differentiate, Solve};
use crate::effects::{Effect, Ramp};
use crate::scalar::Scalar;

/// A stretch of a step over which nothing changes its mode.
#[derive(Clone, Copy)]
pub(super) struct Segment<'a, S> {
    pub ramp: Ramp<S>,
    pub length: &'a Length<S>,
    /// Time at its end, s.
    pub end: f64,
}

impl Mechanics<f64> {
    /// The state at the end of a segment.
    #[inline]
    pub fn solve(&self, s: &State<f64>, segment: &Segment<f64>) -> State<f64> {
        match self.free_law(s) {
            Some(effect) => effect.with_law(Solve { effect, mechanics: self, from: s, segment }),
            None => Coupled::new(self, s, segment).solve(segment.ramp.end),
        }
    }
}

impl<S: Scalar> Mechanics<S> {
    /// The state at the end of a segment, with derivatives, from what [`Mechanics::solve`] found without.
    pub fn differentiate(&self, s: &State<S>, segment: &Segment<S>, solved: &State<f64>) -> State<S> {
        match self.free_law(s) {
            Some(effect) => effect.with_law(Differentiate { effect, mechanics: self, from: s, segment, solved }),
            None => Coupled::new(self, s, segment).differentiate(solved),
        }
    }

    /// The only law, where dry friction holds neither inertia.
    fn free_law(&self, s: &State<S>) -> Option<Effect> {
        self.single_law.filter(|_| self.sticks(s) == [false, false])
    }
}

/// Torques at both ends of a segment, before the effects' at its end.
pub(super) fn before<S: Scalar>(s: &State<S>, ramp: &Ramp<S>) -> [[S; 2]; 2] {
    [[ramp.start - s.force[0], -s.force[1]], [ramp.end, S::default()]]
}
