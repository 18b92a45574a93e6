//! Effects on both inertias together with sticking friction: two equations of two unknowns.

use super::axis_model::State;
use super::mechanics::Mechanics;
use super::newton::{Pass, TorqueEquations, derive, newton};
use super::propagator::{Linear, Propagator};
use super::segment::{Segment, before};
use super::stick::StickTorques;
use crate::effects::{Forces, Internal, Internals, Kinematics, Memory, StepMotion, memory_of};
use crate::scalar::Scalar;

/// The equations of the torques on both inertias, with the friction that sticks.
pub(super) struct Coupled<'a, S> {
    mechanics: &'a Mechanics<S>,
    stick: StickTorques<S>,
    step: &'a Propagator<S>,
    from: &'a State<S>,
    tau0: [S; 2],
    tau1: [S; 2],
    /// The end without torques there.
    free: Linear<S>,
    time: f64,
    /// Whether sticking friction is the only torque, so that nothing has to be solved.
    known: bool,
}

impl<'a, S: Scalar> Coupled<'a, S> {
    pub fn new(mechanics: &'a Mechanics<S>, from: &'a State<S>, segment: &'a Segment<'a, S>) -> Self {
        let sticks = mechanics.sticks(from);
        let held = sticks.iter().filter(|s| **s).count();
        let step = &segment.length.step;
        let [tau0, tau1] = before(from, &segment.ramp);
        let compliance = segment.length.compliance.unwrap_or_else(|| step.compliance());
        Self {
            mechanics,
            stick: StickTorques::new(sticks, step, compliance, mechanics.structure),
            step,
            from,
            tau0,
            tau1,
            free: step.apply(&from.linear, tau0, tau1),
            time: segment.end,
            known: mechanics.on.forces().is_empty() && mechanics.on.dry().len() <= held,
        }
    }

    /// The state at the end, with derivatives, from what was solved without.
    pub fn differentiate(&self, solved: &State<f64>) -> State<S> {
        let mut memory = self.from.memory;
        let force = if self.known { self.from.force } else { derive(self, solved.force.map(S::from), &mut memory) };
        self.state(force, force, memory)
    }

    /// The state at the end under the torques `led`, N.m; `found` are the torques that the laws give there, N.m.
    fn state(&self, led: [S; 2], found: [S; 2], memory: Memory<S>) -> State<S> {
        let (linear, friction) = self.end(led);
        State { linear, friction, force: found, memory, ..*self.from }
    }

    /// The end under torques, and the torques of sticking friction, N.m.
    #[inline]
    fn end(&self, force: [S; 2]) -> (Linear<S>, [S; 2]) {
        let free = self.step.less(&self.free, force);
        let tau1 = [self.tau1[0] - force[0], self.tau1[1] - force[1]];
        self.stick.apply(self.step, &self.from.linear, self.tau0, tau1, free)
    }

    /// Torques of the effects for that end, and their tangent.
    fn laws(&self, end: &Linear<S>, internals: &mut Internals<S>) -> Forces<S> {
        let (mechanics, modes) = (self.mechanics, self.from.modes);
        let step = StepMotion { start: self.from.linear, end: *end, time: self.time, h: self.step.h(), modes };
        mechanics.effects.forces(&mechanics.on, &mechanics.base, &step, internals)
    }
}

impl Coupled<'_, f64> {
    /// The state at the end; the residual is judged against `input`, the torque on the motor, N.m.
    pub fn solve(&self, input: f64) -> State<f64> {
        let (mut memory, force) = (self.from.memory, self.from.force);
        let [led, found] = if self.known { [force; 2] } else { newton(self, force, input, &mut memory) };
        self.state(led, found, memory)
    }
}

impl<S: Scalar> TorqueEquations<S, 2> for Coupled<'_, S> {
    type Internals = Internals<S>;

    fn internals(&self) -> Internals<S> {
        self.from.memory.map(Internal::at)
    }

    fn pass(&self, torque: [S; 2], internals: &mut Internals<S>) -> Pass<S, 2> {
        let Forces { torque: found, stiffness, damping, curvature } = self.laws(&self.end(torque).0, internals);
        let off = [torque[0] - found[0], torque[1] - found[1]];
        let correction = solve2(&self.stick.jacobian(&[stiffness, damping]), off);
        Pass { found, correction, left: if curvature == 0.0 { 0.0 } else { f64::INFINITY } }
    }

    fn remember(&self, internals: &Internals<S>, torque: [S; 2], less: [S; 2], memory: &mut Memory<S>) {
        let remembering = || self.mechanics.on.forces().iter().filter(|e| e.info().memory > 0);
        if remembering().next().is_none() {
            return;
        }
        let there = self.end(torque).0;
        let end = self.end([torque[0] - less[0], torque[1] - less[1]]).0;
        for effect in remembering() {
            let along = effect.info().place.coordinate();
            let [there, end] = [there, end].map(|motion| Kinematics::of(&motion, along));
            let moved = Kinematics { x: end.x - there.x, v: end.v - there.v };
            memory_of(*effect).for_each(|i| memory[i] = internals[i].after(&moved));
        }
    }
}

/// Solves a 2 x 2 system whose matrix is real.
fn solve2<S: Scalar>(a: &[[f64; 2]; 2], b: [S; 2]) -> [S; 2] {
    let det = a[0][0] * a[1][1] - a[0][1] * a[1][0];
    [(b[0] * a[1][1] - b[1] * a[0][1]) / det, (b[1] * a[0][0] - b[0] * a[1][0]) / det]
}
