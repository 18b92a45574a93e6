//! A single law on a motion without sticking friction: one equation in one unknown, the law's torque along its own coordinate.

use std::marker::PhantomData;

use super::axis_model::State;
use super::mechanics::Mechanics;
use super::newton::{Pass, TorqueEquations, derive, newton};
use super::propagator::Linear;
use super::segment::{Segment, before};
use crate::effects::{
    Coordinate, Effect, Internal, Kinematics, Law, MEMORY_OF_ONE, Memory, Moment, WithLaw, memory_of,
};
use crate::scalar::Scalar;

/// The state at the end of a segment.
pub(super) struct Solve<'a> {
    pub effect: Effect,
    pub mechanics: &'a Mechanics<f64>,
    pub from: &'a State<f64>,
    pub segment: &'a Segment<'a, f64>,
}

impl WithLaw for Solve<'_> {
    type Output = State<f64>;

    // One function per law: a common one would save the registers of the law that needs most of them, for every law.
    #[inline(never)]
    fn with<L: Law>(self) -> State<f64> {
        let Self { effect, mechanics, from, segment } = self;
        let mut memory = from.memory;
        let equation = SingleLaw::<_, L>::new(effect, mechanics, from, segment);
        let [[led], [found]] = newton(&equation, [along::<_, L>(from.force)], segment.ramp.end, &mut memory);
        equation.state(led, found, memory)
    }
}

/// The same with derivatives, from what was solved without.
pub(super) struct Differentiate<'a, S> {
    pub effect: Effect,
    pub mechanics: &'a Mechanics<S>,
    pub from: &'a State<S>,
    pub segment: &'a Segment<'a, S>,
    pub solved: &'a State<f64>,
}

impl<S: Scalar> WithLaw for Differentiate<'_, S> {
    type Output = State<S>;

    #[inline(never)]
    fn with<L: Law>(self) -> State<S> {
        let Self { effect, mechanics, from, segment, solved } = self;
        let mut memory = from.memory;
        let equation = SingleLaw::<_, L>::new(effect, mechanics, from, segment);
        let [torque] = derive(&equation, [along::<_, L>(solved.force).into()], &mut memory);
        equation.state(torque, torque, memory)
    }
}

/// The torque along a law's coordinate, of those on motor and table.
fn along<T: Copy, L: Law>([motor, table]: [T; 2]) -> T {
    if L::COORDINATE == Coordinate::Table { table } else { motor }
}

/// The equation of a law.
struct SingleLaw<'a, S, L> {
    mechanics: &'a Mechanics<S>,
    effect: Effect,
    from: &'a State<S>,
    segment: &'a Segment<'a, S>,
    /// The end without the torque there.
    free: Linear<S>,
    /// The same along the law's coordinate, and its derivative to the torque, with the sign turned.
    end: Kinematics<S>,
    per_torque: Kinematics<S>,
    law: PhantomData<L>,
}

impl<'a, S: Scalar, L: Law> SingleLaw<'a, S, L> {
    #[inline]
    fn new(effect: Effect, mechanics: &'a Mechanics<S>, from: &'a State<S>, segment: &'a Segment<'a, S>) -> Self {
        let [tau0, tau1] = before(from, &segment.ramp);
        let free = segment.length.step.apply(&from.linear, tau0, tau1);
        let end = Kinematics::of(&free, L::COORDINATE);
        let per_torque = Kinematics::of(&segment.length.response, L::COORDINATE);
        Self { mechanics, effect, from, segment, free, end, per_torque, law: PhantomData }
    }

    /// The state at the end under the torque `led`, N.m; `found` is the torque that the law gives there, N.m.
    #[inline]
    fn state(&self, led: S, found: S, memory: Memory<S>) -> State<S> {
        let linear = std::array::from_fn(|i| self.free[i] - self.segment.length.response[i] * led);
        let [motor, table] = L::COORDINATE.push();
        let force = [found * motor, found * table];
        State { linear, friction: [S::default(); 2], force, memory, ..*self.from }
    }
}

impl<S: Scalar, L: Law> TorqueEquations<S, 1> for SingleLaw<'_, S, L> {
    type Internals = [Internal<S>; MEMORY_OF_ONE];

    #[inline]
    fn internals(&self) -> Self::Internals {
        let mut internals = Self::Internals::default();
        let committed = &self.from.memory[memory_of(self.effect)];
        for (internal, state) in internals[..L::MEMORY].iter_mut().zip(committed) {
            *internal = Internal::at(*state);
        }
        internals
    }

    #[inline]
    fn pass(&self, [torque]: [S; 1], internals: &mut Self::Internals) -> Pass<S, 1> {
        let Self { mechanics, from, segment, end, per_torque: per, .. } = self;
        // Friction that grows with the load is never solved here; its derivative to the load may still be asked for.
        let load = if L::LOADED && S::HAS_DERIVATIVES && !mechanics.base.rigid {
            let twist = |i: usize| self.free[i] - segment.length.response[i] * torque;
            (mechanics.base.k * twist(2) + mechanics.base.b * twist(3)).abs()
        } else {
            S::default()
        };
        let moment = Moment {
            start: Kinematics::of(&from.linear, L::COORDINATE),
            end: Kinematics { x: end.x - per.x * torque, v: end.v - per.v * torque },
            time: segment.end,
            h: segment.length.step.h(),
            contact: from.modes.contact,
            slides: from.modes.slides(L::COORDINATE),
            load,
        };
        let p = mechanics.effects.of(self.effect);
        let found = L::react(p, &mechanics.base, &moment, &mut internals[..L::MEMORY]);
        let gain = found.stiffness * per.x.re() + found.damping * per.v.re();
        let correction = (torque - found.torque) / (1.0 + gain);
        let moved = per.x.re() * correction.re();
        let left = if found.curvature == 0.0 { 0.0 } else { 0.5 * found.curvature * moved * moved };
        Pass { found: [found.torque], correction: [correction], left }
    }

    #[inline]
    fn remember(&self, internals: &Self::Internals, _torque: [S; 1], [less]: [S; 1], memory: &mut Memory<S>) {
        let per = &self.per_torque;
        let moved = Kinematics { x: per.x * less, v: per.v * less };
        let own = &mut memory[memory_of(self.effect)];
        for (state, internal) in own.iter_mut().zip(&internals[..L::MEMORY]) {
            *state = internal.after(&moved);
        }
    }
}
