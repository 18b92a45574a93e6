//! The motion as measured, and what models lack along it.
//!
//! What a model lacks is told along its own motion, held to the readings as far as the discrepancy asks ([`super::tracking`]). Within their
//! noise that is the motion itself. Farther off the effects act along another one: friction that holds the model takes any torque, and a
//! drag takes what the speed is off. A light axis is dragged along by little, and little is all that it then lacks. There it is told along
//! the motion as measured, by the inverse dynamics, so that no hypothesis gains by going another way than the axis did.

use std::sync::Arc;

use super::inverse_dynamics::InverseDynamics;
use super::likelihood::NEAR_THE_NOISE;
use super::model::Model;
use super::problem::{HELD, Problem};
use super::tracking::{Bandwidth, Resolution, Tracked, track_step_by_step};
use super::trajectory::Trajectory;
use crate::axis::Structure;
use crate::effects::{EFFECTS, Effect, Settings};
use crate::numerics::level::{deviation, rms};

/// Share of the motion that a model's own is off at least to be another one: less changes no torque by more, but for that of a friction where
/// the axis stands, whose sign along the motion as measured is the noise's.
const ASTRAY: f64 = 0.01;

impl Problem<'_> {
    /// The same along the motion as measured, where that is given.
    #[must_use]
    pub fn along_what_is_given(self) -> Self {
        if self.band.motion_is_given() { self.along_the_measured_motion() } else { self }
    }

    /// The same along the motion as measured, whatever is given.
    #[must_use]
    pub fn along_the_measured_motion(&self) -> Self {
        Self { dynamics: self.measured_motion(), ..self.clone() }
    }

    /// The motion as measured of a rigid axis, one for all models and resolutions. The torque that a log gives or a model lacks takes an axis of
    /// little inertia anywhere: the feedback alone takes one that nothing drives or brakes along the record.
    pub(super) fn measured_motion(&self) -> Option<Arc<InverseDynamics>> {
        let run = || {
            let (bandwidth, free) = ([HELD / self.record.dt; 2], self.free_axis());
            let exact = Self { resolution: Resolution::Full, ..self.clone() };
            let (tracked, trajectory) = exact.track_step_by_step(&free, bandwidth)?;
            let dynamics = InverseDynamics::new(&free, bandwidth, tracked, trajectory, self.record)?;
            let (tracked, trajectory) = exact.free_run(bandwidth)?;
            Some(Arc::new(dynamics.along(tracked.motion, trajectory)))
        };
        self.measured.get_or_init(run).clone()
    }

    /// An axis that nothing drives or brakes, held to the record.
    pub(super) fn free_run(&self, bandwidth: Bandwidth) -> Option<(Tracked, Trajectory)> {
        track_step_by_step(&self.free_axis(), &self.record.undriven(), bandwidth, self.counted(&self.nominal))
    }

    /// The axis without any effect.
    fn free_axis(&self) -> Model {
        Model::new(self.nominal.parameters, self.nominal.structure, Settings::default())
    }

    /// The motion as measured where a run of a rigid axis was another one, and what the model lacks along it. Of a model whose effects lack the same along any motion, or that reads
    /// its position late, the own one is taken.
    pub(super) fn other_motion(&self, model: &Model, run: &Tracked) -> Option<(Arc<InverseDynamics>, Tracked)> {
        let is_bent = |e: &Effect| model.effects.is_on(*e) && (e.is_dry() || e.is_force()) && !e.is_mode();
        let is_rigid = model.structure == Structure::Rigid;
        if !is_rigid || !EFFECTS.iter().any(is_bent) || !InverseDynamics::has_a_place_for(model) {
            return None;
        }
        let read = self.record.channels[0].as_ref()?;
        let off = |((read, at), weight): ((&f64, &[f64; 4]), &f64)| weight * (read - at[0]);
        let off = rms(&read.iter().zip(&run.motion).zip(&self.band.taper).map(off).collect::<Vec<f64>>());
        let is_other = off > NEAR_THE_NOISE * self.record.noise[0] && off > ASTRAY * deviation(read);
        let measured = is_other.then(|| self.measured_motion()).flatten()?;
        let lacked = measured.lacked(model, self.record);
        lacked.is_bounded().then_some((measured, lacked))
    }

    /// What a model lacks along its run, or along the motion as measured where that was another one.
    pub(super) fn lacked_by_simulation(&self, model: &Model, bandwidth: Bandwidth) -> Option<Tracked> {
        let run = self.track(model, bandwidth)?;
        let other = self.other_motion(model, &run);
        Some(other.map_or(run, |(_, lacked)| lacked))
    }
}
