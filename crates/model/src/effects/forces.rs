//! The torques of the effects on motor and table over a step, with their tangent.

use super::active::ActiveEffects;
use super::info::Place;
use super::law::slip;
use super::settings::{Internals, MEMORY_OF_ONE, Memory, Settings, memory_of};
use super::shapes::{Base, Coordinate, Internal, Kinematics, Modes, Moment, Reaction, Slip};
use super::{Effect, Law, WithLaw};
use crate::scalar::Scalar;

/// Motion `[theta1, omega1, twist, twist rate]` at the start and at the trial end of a step.
#[derive(Debug, Clone, Copy)]
pub(crate) struct StepMotion<S> {
    pub start: [S; 4],
    pub end: [S; 4],
    pub time: f64,
    pub h: S,
    pub modes: Modes,
}

impl<S: Scalar> StepMotion<S> {
    #[inline]
    pub(super) fn moment(&self, coordinate: Coordinate, load: S) -> Moment<S> {
        Moment {
            start: Kinematics::of(&self.start, coordinate),
            end: Kinematics::of(&self.end, coordinate),
            time: self.time,
            h: self.h,
            contact: self.modes.contact,
            slides: self.modes.slides(coordinate),
            load,
        }
    }
}

/// Torques on motor and table that resist, with their tangent; row = inertia, column = coordinate.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Forces<S> {
    pub torque: [S; 2],
    pub stiffness: [[f64; 2]; 2],
    pub damping: [[f64; 2]; 2],
    /// Sum of the laws' curvature bounds, N.m/rad2: zero if all are linear.
    pub curvature: f64,
}

impl<S: Scalar> Forces<S> {
    #[inline]
    pub(crate) fn add(&mut self, coordinate: Coordinate, r: &Reaction<S>) {
        self.curvature += r.curvature;
        match coordinate {
            Coordinate::Table => {
                self.torque[1] += r.torque;
                self.stiffness[1][1] += r.stiffness;
                self.damping[1][1] += r.damping;
            }
            Coordinate::Twist => {
                self.torque[0] += r.torque;
                self.torque[1] -= r.torque;
                for (row, column, sign) in [(0, 0, 1.0), (0, 1, -1.0), (1, 0, -1.0), (1, 1, 1.0)] {
                    self.stiffness[row][column] += sign * r.stiffness;
                    self.damping[row][column] += sign * r.damping;
                }
            }
            Coordinate::Motor => {
                self.torque[0] += r.torque;
                self.stiffness[0][0] += r.stiffness;
                self.damping[0][0] += r.damping;
            }
        }
    }
}

impl<S: Scalar> Settings<S> {
    /// Level of dry friction at a place against a slip, N.m.
    pub(crate) fn dry_level(&self, on: &ActiveEffects, place: Place, slip: &Slip<S>) -> S {
        let mut sum = S::default();
        for effect in on.dry().iter().filter(|e| e.info().place == place) {
            sum += effect.level(self.of(*effect), slip).level;
        }
        sum
    }

    /// Sum of the forces and of sliding friction: torque on motor and table, N.m, and the tangent. It sets the internal states'
    /// end on trial.
    #[inline]
    pub(crate) fn forces(
        &self,
        on: &ActiveEffects,
        base: &Base<S>,
        step: &StepMotion<S>,
        memory: &mut Internals<S>,
    ) -> Forces<S> {
        let mut sum = Forces::default();
        let none = S::default();
        for &effect in on.forces() {
            let coordinate = effect.info().place.coordinate();
            sum.add(coordinate, &self.reaction(effect, base, &step.moment(coordinate, none), memory));
        }
        let load = if self.counts_load(on) { self.transmitted(on, base, step) } else { Forces::default() };
        for &effect in on.dry() {
            let coordinate = effect.info().place.coordinate();
            let moment = step.moment(coordinate, load.torque[0].abs());
            if moment.slides != 0.0 {
                sum.add(coordinate, &self.reaction(effect, base, &moment, memory));
                if self.is_loaded(effect) {
                    // The level depends on the motion of both inertias, through the load.
                    let towards = if load.torque[0].re() < 0.0 { -moment.slides } else { moment.slides };
                    let per = effect.level(self.of(effect), &slip(&moment)).per_load * towards;
                    let row = usize::from(coordinate == Coordinate::Table);
                    for column in 0..2 {
                        sum.stiffness[row][column] += per * load.stiffness[0][column];
                        sum.damping[row][column] += per * load.damping[0][column];
                    }
                }
            }
        }
        sum
    }

    /// Torque of one effect against its coordinate at the end of each step of a motion, N.m, zero of a dry friction that holds; it remembers
    /// `memory` when the motion begins.
    pub(crate) fn torques_of(
        &self,
        effect: Effect,
        base: &Base<S>,
        steps: &[StepMotion<S>],
        memory: &Memory<S>,
    ) -> Vec<S> {
        let on = self.active();
        let load = |step: &StepMotion<S>| self.transmitted(&on, base, step).torque[0].abs();
        let loads = if self.is_loaded(effect) { steps.iter().map(load).collect() } else { Vec::new() };
        let mut internals = [S::default(); MEMORY_OF_ONE];
        internals.iter_mut().zip(&memory[memory_of(effect)]).for_each(|(own, state)| *own = *state);
        effect.with_law(Along {
            p: self.of(effect),
            base,
            steps,
            loads: &loads,
            memory: internals,
            dry: effect.is_dry(),
        })
    }

    /// The torque of one effect on the motion; it sets its internal states' end on trial.
    #[inline]
    fn reaction(&self, effect: Effect, base: &Base<S>, moment: &Moment<S>, memory: &mut Internals<S>) -> Reaction<S> {
        let memory = &mut memory[memory_of(effect)];
        effect.with_law(React { p: self.of(effect), base, moment, memory })
    }
}

/// A law's torque.
pub(super) struct React<'a, S> {
    pub p: &'a [S],
    pub base: &'a Base<S>,
    pub moment: &'a Moment<S>,
    pub memory: &'a mut [Internal<S>],
}

impl<S: Scalar> WithLaw for React<'_, S> {
    type Output = Reaction<S>;

    #[inline]
    fn with<L: Law>(self) -> Reaction<S> {
        L::react(self.p, self.base, self.moment, self.memory)
    }
}

/// A law's torque at the end of each step of a motion.
struct Along<'a, S> {
    p: &'a [S],
    base: &'a Base<S>,
    steps: &'a [StepMotion<S>],
    /// Torque transmitted in each step, N.m; empty where the law does not depend on it.
    loads: &'a [S],
    memory: [S; MEMORY_OF_ONE],
    dry: bool,
}

impl<S: Scalar> WithLaw for Along<'_, S> {
    type Output = Vec<S>;

    fn with<L: Law>(mut self) -> Vec<S> {
        let mut torques = Vec::with_capacity(self.steps.len());
        for (k, step) in self.steps.iter().enumerate() {
            let moment = step.moment(L::COORDINATE, self.loads.get(k).copied().unwrap_or_default());
            if self.dry && moment.slides == 0.0 {
                torques.push(S::default());
                continue;
            }
            let mut internals = self.memory.map(Internal::at);
            torques.push(L::react(self.p, self.base, &moment, &mut internals).torque);
            self.memory = internals.map(|internal| internal.end);
        }
        torques
    }
}

#[cfg(test)]
mod tests {
    use super::super::EFFECTS;
    use super::super::settings::MEMORY;
    use super::*;
    use crate::axis::tests::shown;

    /// Newton's method ends where the curvature bounds the residual after its step.
    #[test]
    fn no_law_leaves_its_tangent_by_more_than_its_curvature_bound() {
        let base = Base { k: 1.76e-2, b: 5.4e-4, rigid: false };
        let mut straight = 0;
        for &effect in EFFECTS.iter().filter(|e| e.is_force()) {
            let settings = shown(effect);
            for (x, v, contact) in [(0.3, 1.7, 0), (-0.2, -0.6, 1), (2.0, 0.4, -1)] {
                let reaction = |dx: f64, dv: f64| {
                    let (start, end) = (Kinematics { x: x - 2e-3, v }, Kinematics { x: x + dx, v: v + dv });
                    let moment = Moment { start, end, time: 0.7, h: 1e-3, contact, slides: 0.0, load: 0.0 };
                    settings.reaction(effect, &base, &moment, &mut [Internal::at(0.1); MEMORY])
                };
                let at = reaction(0.0, 0.0);
                for (dx, dv) in [(1e-2, 0.2), (-3e-3, 0.1), (0.5, -0.3)] {
                    let off = reaction(dx, dv).torque - (at.torque + at.stiffness * dx + at.damping * dv);
                    assert!(off.abs() <= 0.5 * at.curvature * dx * dx + 1e-15, "{effect:?} {off} {}", at.curvature);
                }
                straight += usize::from(at.curvature == 0.0);
            }
        }
        // Loads, play, drift of stiffness, third inertias, spring to the frame and disturbance, at each of the three.
        assert!(straight >= 8 * 3, "{straight}");
    }

    /// Newton's method takes the internal states along by their tangents.
    #[test]
    fn internal_states_have_their_tangents() {
        let base = Base { k: 1.76e-2, b: 5.4e-4, rigid: false };
        let mut states = 0;
        for &effect in EFFECTS.iter().filter(|e| e.info().memory > 0) {
            let settings = shown(effect);
            for (x, v) in [(0.3, 1.7), (-0.2, -0.6), (2.0, 0.4)] {
                let end = |dx: f64, dv: f64| {
                    let (start, end) = (Kinematics { x: x - 2e-3, v }, Kinematics { x: x + dx, v: v + dv });
                    let moment = Moment { start, end, time: 0.7, h: 1e-3, contact: 0, slides: 0.0, load: 0.0 };
                    let mut memory = [Internal::at(0.1); MEMORY];
                    settings.reaction(effect, &base, &moment, &mut memory);
                    memory
                };
                let at = end(0.0, 0.0);
                let d = 1e-6;
                for i in memory_of(effect) {
                    let difference =
                        |a: [Internal<f64>; MEMORY], b: [Internal<f64>; MEMORY]| (a[i].end - b[i].end) / (2.0 * d);
                    for (slope, own) in [
                        (difference(end(d, 0.0), end(-d, 0.0)), at[i].per.x),
                        (difference(end(0.0, d), end(0.0, -d)), at[i].per.v),
                    ] {
                        // The loop's is that of its equation, not of the Runge-Kutta step along it.
                        assert!((slope - own).abs() <= 1e-4 * (1.0 + own.abs()), "{effect:?} {i}: {slope} {own}");
                    }
                    states += 1;
                }
            }
        }
        // Two bristles, a loop, and the third inertias' three, at each of the three motions.
        assert_eq!(states, 9 * 3);
    }
}
