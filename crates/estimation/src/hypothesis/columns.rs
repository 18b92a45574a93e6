//! How what a model lacks changes with each free value: the columns of a fit.

use super::descent::Along;
use super::likelihood::C;
use super::model::{BaseParameter, Coordinate, Free, Model};
use super::problem::{Columns, PLANNER, Problem};
use super::tracking::{Resolution, Torques};
use super::trajectory::Trajectory;
use crate::axis::Structure;
use crate::effects::{EFFECTS, Effect, Place, Scale, Start};

impl Problem<'_> {
    /// What a coordinate changes of what a model lacks, where no other run tells it. The axis' own parameters act along the motion as
    /// measured, which is the model's own nearly, effects along the model's own where that is kept ([`Self::has_columns_along_motion`]).
    pub fn column_without_simulation(&self, c: &Coordinate, at: &Along) -> Option<[Vec<C>; 2]> {
        let motion = self.motion.as_ref().filter(|_| !has_mode(&at.model));
        let along = self.column_along_motion(c, at);
        if let (Free::Base(p), Some(motion)) = (c.free, motion)
            && (along.is_some() || coupling_effects(&at.model).next().is_none() || is_inertia(p))
        {
            let own = self.band.base_column(p, motion, c.slope(c.x(&at.model)));
            return Some(match along {
                Some(along) => sum(&own, &along),
                None => own,
            });
        }
        along
    }

    /// Whether simulated columns may be brought along from step to step. On a rigid axis as many more steps are tried as columns are saved.
    pub fn may_follow(&self) -> bool {
        self.nominal.structure == Structure::TwoInertia
    }

    /// What a coordinate changes of what a model lacks, by a run of the model a step further.
    pub fn simulated_column(&self, c: &Coordinate, at: &Along) -> Option<[Vec<C>; 2]> {
        let h = self.step_within(c, &at.model);
        let (model, weighed_at) = (moved(&at.model, c, h), Some(at.rows.weighed_at));
        let moved = match at.columns {
            Columns::AsMeasured => {
                self.residual(&model, &self.measured_motion()?.lacked(&model, self.record), weighed_at)
            }
            _ => self.rows(&model, at.bandwidth, weighed_at)?,
        };
        Some([0, 1].map(|e| moved.rows[e].iter().zip(&at.rows.rows[e]).map(|(a, b)| (a - b) / h).collect()))
    }

    /// What a coordinate changes of what the effects that it is one of resist the model's motion with, where that was kept.
    fn column_along_motion(&self, c: &Coordinate, at: &Along) -> Option<[Vec<C>; 2]> {
        let Columns::Along(trajectory) = &at.columns else { return None };
        if has_mode(&at.model) {
            return None;
        }
        let effects: Vec<Effect> = match c.free {
            Free::Base(p) if is_inertia(p) => Vec::new(),
            Free::Base(_) => coupling_effects(&at.model).collect(),
            Free::Effect(e, _) | Free::Loop(e) => {
                Some(e).filter(|e| e.info().place != Place::Sensor).into_iter().collect()
            }
        };
        if effects.is_empty() {
            return None;
        }
        let h = self.step_within(c, &at.model);
        let own = trajectory.resisted(&at.model, self.record, effects.iter().copied());
        Some(self.change_along(trajectory, &own, &moved(&at.model, c, h), &effects, 1.0 / h))
    }

    /// What some effects of a model resist a motion with beyond the `own` torques of another's, by a factor.
    pub(super) fn change_along(
        &self,
        trajectory: &Trajectory,
        own: &Torques,
        to: &Model,
        of: &[Effect],
        factor: f64,
    ) -> [Vec<C>; 2] {
        let mut change = trajectory.resisted(to, self.record, of.iter().copied());
        for (change, own) in change.iter_mut().zip(own) {
            change.iter_mut().zip(own).for_each(|(c, o)| *c -= o);
        }
        PLANNER.with_borrow_mut(|planner| self.band.rows(&change, factor, planner))
    }

    /// Step of a coordinate for its column.
    fn step(&self, c: &Coordinate, model: &Model) -> f64 {
        match c.free {
            Free::Base(_) => 1e-3,
            Free::Loop(_) => 0.1,
            Free::Effect(e, i) => {
                let info = &e.info().parameters[i];
                let value = model.effects.of(e)[i];
                match info.start {
                    Start::Grid(Scale::Order, _) => 0.02 / (value.abs() * self.range[e.info().place.side()]).max(1e-3),
                    Start::Grid(Scale::Frequency, _) => {
                        0.02 / (std::f64::consts::TAU * value.abs() * self.record.dt * self.record.len() as f64)
                            .max(1e-3)
                    }
                    _ => 1e-2,
                }
            }
        }
    }

    /// The step of a coordinate for its column, inside its bounds.
    fn step_within(&self, c: &Coordinate, model: &Model) -> f64 {
        let h = self.step(c, model);
        if c.x(model) + h > c.bounds[1] { -h } else { h }
    }

    /// Whether what effects change is told along the motion of the model itself: in looks, which only rank, and on a rigid axis on the way to
    /// a fit's end. There, and near the noise where the axis has two inertias, what an effect does to the motion is as large as what is left.
    pub(super) fn has_columns_along_motion(&self, model: &Model) -> bool {
        let is_far = self.nominal.structure == Structure::Rigid || self.resolution == Resolution::Coarse;
        self.motion.is_some() && is_far && !self.exact && !has_mode(model)
    }
}

/// Whether a third inertia is on: what it began with is taken out of what any change lacks, too.
fn has_mode(model: &Model) -> bool {
    EFFECTS.iter().any(|e| e.is_mode() && model.effects.is_on(*e))
}

/// What makes the coupling pull by more than its twist.
fn coupling_effects(model: &Model) -> impl Iterator<Item = Effect> {
    EFFECTS.iter().copied().filter(|e| e.info().place == Place::Coupling && model.effects.is_on(*e))
}

const fn is_inertia(p: BaseParameter) -> bool {
    matches!(p, BaseParameter::I1 | BaseParameter::I2)
}

/// The model with a coordinate a step further.
fn moved(model: &Model, c: &Coordinate, h: f64) -> Model {
    model.at(std::slice::from_ref(c), &[c.x(model) + h])
}

fn sum(a: &[Vec<C>; 2], b: &[Vec<C>; 2]) -> [Vec<C>; 2] {
    [0, 1].map(|e| a[e].iter().zip(&b[e]).map(|(a, b)| a + b).collect())
}
