//! One effect alone on the motion, free to move: one equation of one unknown, its torque along its own coordinate.

use std::marker::PhantomData;

use super::axis_model::State;
use super::balance::{Leg, before};
use super::mechanics::{Mechanics, motion};
use super::newton::{Balance, Pass, derive, newton};
use super::propagator::Linear;
use crate::effects::{Coordinate, Effect, Internal, Law, MEMORY_OF_ONE, Memory, Moment, Motion, WithLaw, memory_of};
use crate::scalar::Scalar;

/// The state at the end of a leg.
pub(super) struct Solve<'a> {
    pub effect: Effect,
    pub mechanics: &'a Mechanics<f64>,
    pub from: &'a State<f64>,
    pub leg: &'a Leg<'a, f64>,
}

impl WithLaw for Solve<'_> {
    type Output = State<f64>;

    // Each law a function of its own: in one for all, the registers of one are saved for all.
    #[inline(never)]
    fn with<L: Law>(self) -> State<f64> {
        let Self { effect, mechanics, from, leg } = self;
        let mut memory = from.memory;
        let lone = Lone::<_, L>::new(effect, mechanics, from, leg);
        let [[led], [found]] = newton(&lone, [along::<_, L>(from.force)], leg.ramp.end, &mut memory);
        lone.state(led, found, memory)
    }
}

/// The same with derivatives, from what was solved without.
pub(super) struct Carry<'a, S> {
    pub effect: Effect,
    pub mechanics: &'a Mechanics<S>,
    pub from: &'a State<S>,
    pub leg: &'a Leg<'a, S>,
    pub solved: &'a State<f64>,
}

impl<S: Scalar> WithLaw for Carry<'_, S> {
    type Output = State<S>;

    #[inline(never)]
    fn with<L: Law>(self) -> State<S> {
        let Self { effect, mechanics, from, leg, solved } = self;
        let mut memory = from.memory;
        let lone = Lone::<_, L>::new(effect, mechanics, from, leg);
        let [torque] = derive(&lone, [along::<_, L>(solved.force).into()], &mut memory);
        lone.state(torque, torque, memory)
    }
}

/// The torque along a law's coordinate, of those on motor and table.
fn along<T: Copy, L: Law>([motor, table]: [T; 2]) -> T {
    if L::COORDINATE == Coordinate::Table { table } else { motor }
}

/// The equation of a law.
struct Lone<'a, S, L> {
    mechanics: &'a Mechanics<S>,
    effect: Effect,
    from: &'a State<S>,
    leg: &'a Leg<'a, S>,
    /// The end without the torque there.
    free: Linear<S>,
    /// The same, and what one unit of the torque takes from it, along the law's coordinate.
    end: Motion<S>,
    per_torque: Motion<S>,
    law: PhantomData<L>,
}

impl<'a, S: Scalar, L: Law> Lone<'a, S, L> {
    #[inline]
    fn new(effect: Effect, mechanics: &'a Mechanics<S>, from: &'a State<S>, leg: &'a Leg<'a, S>) -> Self {
        let [tau0, tau1] = before(from, &leg.ramp);
        let free = leg.length.step.apply(&from.linear, tau0, tau1);
        let end = motion(&free, L::COORDINATE);
        let per_torque = motion(&leg.length.answer, L::COORDINATE);
        Self { mechanics, effect, from, leg, free, end, per_torque, law: PhantomData }
    }

    /// The end that one torque led to and where the law gives another.
    #[inline]
    fn state(&self, led: S, found: S, memory: Memory<S>) -> State<S> {
        let linear = std::array::from_fn(|i| self.free[i] - self.leg.length.answer[i] * led);
        let [motor, table] = L::COORDINATE.push();
        let force = [found * motor, found * table];
        State { linear, friction: [S::default(); 2], force, memory, ..*self.from }
    }
}

impl<S: Scalar, L: Law> Balance<S, 1> for Lone<'_, S, L> {
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
        let Self { mechanics, from, leg, end, per_torque: per, .. } = self;
        // A friction alone does not grow with its load, or it were not alone; but it may have the derivative to that.
        let load = if L::LOADED && S::HAS_DERIVATIVES && !mechanics.base.rigid {
            let twist = |i: usize| self.free[i] - leg.length.answer[i] * torque;
            (mechanics.base.k * twist(2) + mechanics.base.b * twist(3)).abs()
        } else {
            S::default()
        };
        let moment = Moment {
            start: motion(&from.linear, L::COORDINATE),
            end: Motion { x: end.x - per.x * torque, v: end.v - per.v * torque },
            time: leg.end,
            h: leg.length.step.h(),
            contact: from.modes.contact,
            slides: from.modes.slides(L::COORDINATE),
            load,
        };
        let p = mechanics.effects.of(self.effect);
        let found = L::react(p, &mechanics.base, &moment, &mut internals[..L::MEMORY]);
        let answers = found.stiffness * per.x.re() + found.damping * per.v.re();
        let correction = (torque - found.torque) / (1.0 + answers);
        let moved = per.x.re() * correction.re();
        let left = if found.bend == 0.0 { 0.0 } else { 0.5 * found.bend * moved * moved };
        Pass { found: [found.torque], correction: [correction], left }
    }

    #[inline]
    fn remember(&self, internals: &Self::Internals, _torque: [S; 1], [less]: [S; 1], memory: &mut Memory<S>) {
        let per = &self.per_torque;
        let moved = Motion { x: per.x * less, v: per.v * less };
        let own = &mut memory[memory_of(self.effect)];
        for (state, internal) in own.iter_mut().zip(&internals[..L::MEMORY]) {
            *state = internal.after(&moved);
        }
    }
}
