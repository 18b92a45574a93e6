//! Hypotheses that went another way than the axis did.
//!
//! What a model lacks is told along its own motion, held to the readings as far as the discrepancy asks ([`crate::hypothesis::tracking`]).
//! Within their noise that is the motion itself. Farther off the effects act along another one: friction that holds the model takes any
//! torque, and a drag takes what the speed is off. A light axis is dragged along by little, and little is all that it then lacks.

use super::search::Search;
use crate::axis::Structure;
use crate::hypothesis::descent::Along;
use crate::hypothesis::fit::Fit;
use crate::hypothesis::likelihood::NEAR_THE_NOISE;
use crate::hypothesis::tracking::Tracked;

/// Share of the motion that a hypothesis' own is off at least to be another one: less changes no torque by more, but for that of a friction
/// where the axis stands, whose sign along the motion as measured is the noise's.
const ASTRAY: f64 = 0.01;

/// What a hypothesis that went astray lacks along the motion as measured.
#[derive(Debug, Clone)]
pub struct Astray {
    /// In the band.
    pub along: Along,
    /// In time.
    pub tracked: Tracked,
}

impl Search<'_> {
    /// What a hypothesis of a rigid axis lacks along the motion as measured, where its own is off that and it lacks less along its own.
    pub fn astray(&self, fit: &Fit) -> Option<Astray> {
        let is_linear = fit.terms.is_empty();
        if is_linear || self.problem.nominal.structure != Structure::Rigid || self.band().motion_is_given() {
            return None;
        }
        let [noises, of_motion] = self.problem.distance_of_readings(fit)?;
        if noises <= NEAR_THE_NOISE || of_motion <= ASTRAY {
            return None;
        }
        let problem = self.measured.get_or_init(|| self.problem.along_the_measured_motion());
        let along = problem.along(&fit.model, problem.bandwidth([0.0; 2]))?;
        let tracked = problem.lacked_without_simulation(&fit.model)?;
        (along.s[0] > fit.discrepancy[0]).then_some(Astray { along, tracked })
    }

    /// Share of the torque that a hypothesis leaves of the motion as it was.
    pub fn left_of_the_motion(&self, fit: &Fit) -> f64 {
        let astray = self.astray(fit);
        let discrepancy = astray.map_or(fit.discrepancy, |a| a.along.s);
        self.band().torque_share(discrepancy, self.problem.record)
    }
}
