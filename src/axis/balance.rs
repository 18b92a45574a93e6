//! The end of a step with the modes held: torques that are what their laws give for the motion they lead to.
//!
//! Newton's method on plain numbers finds them; one pass over numbers with derivatives gives these what is theirs
//! (implicit function theorem). One effect alone is one equation of one unknown.

use super::axis_model::State;
use super::hold::Hold;
use super::mechanics::{Length, Mechanics, Motions, motion, motions};
use super::propagator::{Linear, Propagator};
use crate::effects::{
    Coordinate, Effect, Forces, Internal, Internals, Memory, Moment, Motion, Ramp, Reaction, StepMotion, memory_of,
};
use crate::scalar::Scalar;

/// Most Newton iterations of a step.
const NEWTON: usize = 30;
/// Newton ends when the torques repeat to this share of their size.
const NEWTON_TOLERANCE: f64 = 1e-13;

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
    pub fn solve(&self, s: &State<f64>, leg: &Leg<f64>) -> State<f64> {
        let mut memory = s.memory;
        let equation = Equation::of(self, s, leg);
        let [drives, force] = match &equation {
            Equation::Lone(lone) => {
                newton(lone, [lone.at_start()], leg.ramp.end, &mut memory).map(|[torque]| lone.force(torque))
            }
            Equation::Coupled(coupled) => newton(coupled, s.force, leg.ramp.end, &mut memory),
            Equation::Known(_) => [s.force; 2],
        };
        let (linear, friction) = equation.end(drives);
        State { linear, friction, force, memory, ..*s }
    }
}

impl<S: Scalar> Mechanics<S> {
    /// The state at the end of a leg, with derivatives, from what [`Mechanics::solve`] found without.
    pub fn carry(&self, s: &State<S>, leg: &Leg<S>, solved: &State<f64>) -> State<S> {
        let mut memory = s.memory;
        let equation = Equation::of(self, s, leg);
        let solved = solved.force.map(S::from);
        let force = match &equation {
            Equation::Lone(lone) => {
                let [torque] = derive(lone, [lone.along(solved)], &mut memory);
                lone.force(torque)
            }
            Equation::Coupled(coupled) => derive(coupled, solved, &mut memory),
            Equation::Known(_) => s.force,
        };
        let (linear, friction) = equation.end(force);
        State { linear, friction, force, memory, ..*s }
    }
}

/// Newton's method from `torque`, with `input` on the motor to measure by: the torques that led to the end, and those that
/// the laws give there; `memory` goes along.
fn newton<const N: usize>(
    balance: &impl Balance<f64, N>,
    mut torque: [f64; N],
    input: f64,
    memory: &mut Memory<f64>,
) -> [[f64; N]; 2] {
    let largest = |a: &[f64; N]| a.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
    let mut internals = memory.map(Internal::at);
    let mut previous = f64::INFINITY;
    for iteration in 1.. {
        let pass = balance.pass(torque, &mut internals);
        let size = largest(&std::array::from_fn(|i| torque[i] - pass.found[i]));
        let scale = largest(&pass.found) + input.abs();
        if size <= NEWTON_TOLERANCE * scale || iteration == NEWTON {
            balance.remember(&internals, torque, [0.0; N], memory);
            return [torque, pass.found];
        }
        // A residual that grows means a kink was crossed: half the step.
        let damp = if size > previous * 2.0 { 0.5 } else { 1.0 };
        previous = size;
        let less = pass.correction.map(|c| c * damp);
        // Newton squares the share that is missing.
        if size <= NEWTON_TOLERANCE.sqrt() * scale || (pass.left <= NEWTON_TOLERANCE * scale && damp == 1.0) {
            balance.remember(&internals, torque, less, memory);
            torque = std::array::from_fn(|i| torque[i] - less[i]);
            break;
        }
        torque = std::array::from_fn(|i| torque[i] - less[i]);
    }
    [torque, torque]
}

/// The derivatives of torques whose values balance; `memory` goes along.
fn derive<S: Scalar, const N: usize>(
    balance: &impl Balance<S, N>,
    torque: [S; N],
    memory: &mut Memory<S>,
) -> [S; N] {
    let mut internals = memory.map(Internal::at);
    let pass = balance.pass(torque, &mut internals);
    balance.remember(&internals, torque, pass.correction, memory);
    std::array::from_fn(|i| torque[i] - pass.correction[i])
}

/// An equation of `N` torques at the end of a leg.
trait Balance<S, const N: usize> {
    /// What the laws give for the motion under `torque`; the internal states reach their end there.
    fn pass(&self, torque: [S; N], memory: &mut Internals<S>) -> Pass<S, N>;

    /// The internal states for `less` than the torque of the last pass, by their tangents there.
    fn remember(&self, internals: &Internals<S>, torque: [S; N], less: [S; N], memory: &mut Memory<S>);
}

struct Pass<S, const N: usize> {
    /// Torques of the laws.
    found: [S; N],
    /// What is to be taken from the torques for them to agree with the laws, to first order.
    correction: [S; N],
    /// What is then still missing, at most.
    left: f64,
}

enum Equation<'a, S> {
    /// One effect alone, free to move.
    Lone(Lone<'a, S>),
    /// Torques on both inertias.
    Coupled(Coupled<'a, S>),
    /// No torque but friction that holds.
    Known(Coupled<'a, S>),
}

impl<'a, S: Scalar> Equation<'a, S> {
    #[inline]
    fn of(mechanics: &'a Mechanics<S>, s: &'a State<S>, leg: &'a Leg<'a, S>) -> Self {
        let sticks = mechanics.sticks(s);
        if let Some(effect) = mechanics.lone
            && sticks == [false, false]
        {
            return Self::Lone(Lone::new(effect, mechanics, s, leg));
        }
        let coupled = Coupled::new(sticks, mechanics, s, leg);
        let held = sticks.iter().filter(|s| **s).count();
        if mechanics.on.forces().is_empty() && mechanics.on.dry().len() <= held {
            Self::Known(coupled)
        } else {
            Self::Coupled(coupled)
        }
    }
}

impl<S: Scalar> Equation<'_, S> {
    /// The end under the effects' torques there, and the friction that holds.
    fn end(&self, force: [S; 2]) -> (Linear<S>, [S; 2]) {
        match self {
            Self::Lone(lone) => (lone.end(lone.along(force)), [S::default(); 2]),
            Self::Coupled(coupled) | Self::Known(coupled) => coupled.end(force),
        }
    }
}

/// Torques at both ends of a leg, before the effects' at its end.
fn before<S: Scalar>(s: &State<S>, ramp: &Ramp<S>) -> [[S; 2]; 2] {
    [[ramp.start - s.force[0], -s.force[1]], [ramp.end, S::default()]]
}

/// One effect's torque on one coordinate.
struct Lone<'a, S> {
    mechanics: &'a Mechanics<S>,
    effect: Effect,
    coordinate: Coordinate,
    /// The state that is left.
    from: &'a State<S>,
    /// The end without the torque there.
    free: Linear<S>,
    /// What the end loses to one unit of it.
    answer: &'a Linear<S>,
    /// The same of the coordinate alone.
    start: Motion<S>,
    end: Motion<S>,
    per_torque: Motion<S>,
    h: S,
    time: f64,
    /// The way that a dry friction slides.
    slides: f64,
}

impl<'a, S: Scalar> Lone<'a, S> {
    #[inline]
    fn new(effect: Effect, mechanics: &'a Mechanics<S>, from: &'a State<S>, leg: &'a Leg<'a, S>) -> Self {
        let coordinate = effect.info().place.coordinate();
        let [tau0, tau1] = before(from, &leg.ramp);
        let free = leg.length.step.apply(&from.linear, tau0, tau1);
        let answer = &leg.length.answer;
        Self {
            mechanics,
            effect,
            coordinate,
            from,
            free,
            answer,
            start: motion(&from.linear, coordinate),
            end: motion(&free, coordinate),
            per_torque: motion(answer, coordinate),
            h: leg.length.step.h(),
            time: leg.end,
            slides: f64::from(from.dry[usize::from(coordinate == Coordinate::Table)]),
        }
    }

    /// The torque, of those on motor and table.
    fn along(&self, force: [S; 2]) -> S {
        if self.coordinate == Coordinate::Table { force[1] } else { force[0] }
    }

    fn at_start(&self) -> S {
        self.along(self.from.force)
    }

    fn force(&self, torque: S) -> [S; 2] {
        self.coordinate.push().map(|push| torque * push)
    }

    fn end(&self, torque: S) -> Linear<S> {
        std::array::from_fn(|i| self.free[i] - self.answer[i] * torque)
    }
}

impl<S: Scalar> Balance<S, 1> for Lone<'_, S> {
    #[inline]
    fn pass(&self, [torque]: [S; 1], memory: &mut Internals<S>) -> Pass<S, 1> {
        let (free, per) = (&self.end, &self.per_torque);
        let end = Motion { x: free.x - per.x * torque, v: free.v - per.v * torque };
        let effects = &self.mechanics.effects;
        let found = if self.effect.is_dry() {
            // On trial the velocity may have passed zero: the sliding law continues there until the event is found.
            let (level, damping) = effects.level(self.effect, self.slides, end.v * self.slides, self.time);
            Reaction { torque: level * self.slides, stiffness: 0.0, damping, bend: bend_of_level(damping) }
        } else {
            let contact = self.from.contact;
            let moment = Moment { start: self.start, end, time: self.time, h: self.h, contact };
            effects.reaction(self.effect, &self.mechanics.base, &moment, memory)
        };
        let answers = found.stiffness * per.x.re() + found.damping * per.v.re();
        let correction = (torque - found.torque) / (1.0 + answers);
        let moved = per.x.re() * correction.re();
        let left = if found.bend == 0.0 { 0.0 } else { 0.5 * found.bend * moved * moved };
        Pass { found: [found.torque], correction: [correction], left }
    }

    #[inline]
    fn remember(&self, internals: &Internals<S>, _torque: [S; 1], [less]: [S; 1], memory: &mut Memory<S>) {
        let per = &self.per_torque;
        let moved = Motion { x: per.x * less, v: per.v * less };
        memory_of(self.effect).for_each(|i| memory[i] = internals[i].after(&moved));
    }
}

/// Torques on both inertias, beside dry friction that holds.
struct Coupled<'a, S> {
    mechanics: &'a Mechanics<S>,
    hold: Hold<'a, S>,
    step: &'a Propagator<S>,
    from: &'a State<S>,
    start: Motions<S>,
    tau0: [S; 2],
    tau1: [S; 2],
    /// The end without torques there.
    free: Linear<S>,
    time: f64,
}

impl<'a, S: Scalar> Coupled<'a, S> {
    fn new(sticks: [bool; 2], mechanics: &'a Mechanics<S>, from: &'a State<S>, leg: &'a Leg<'a, S>) -> Self {
        let step = &leg.length.step;
        let [tau0, tau1] = before(from, &leg.ramp);
        Self {
            mechanics,
            hold: Hold::new(sticks, step, &leg.length.compliance, mechanics.structure),
            step,
            from,
            start: motions(&from.linear),
            tau0,
            tau1,
            free: step.apply(&from.linear, tau0, tau1),
            time: leg.end,
        }
    }

    /// The end under torques, and the friction that holds.
    fn end(&self, force: [S; 2]) -> (Linear<S>, [S; 2]) {
        let free = self.step.less(&self.free, force);
        let tau1 = [self.tau1[0] - force[0], self.tau1[1] - force[1]];
        self.hold.apply(self.step, &self.from.linear, self.tau0, tau1, free)
    }

    /// Torques of the effects for that end, and their tangent.
    fn laws(&self, end: &Linear<S>, memory: &mut Internals<S>) -> Forces<S> {
        let (mechanics, from) = (self.mechanics, self.from);
        let end = motions(end);
        let step = StepMotion { start: self.start, end, time: self.time, h: self.step.h(), contact: from.contact };
        let mut forces = mechanics.effects.forces(&mechanics.on, &mechanics.base, &step, memory);
        for i in (0..2).filter(|i| from.dry[*i] != 0 && mechanics.dry[*i]) {
            let direction = f64::from(from.dry[i]);
            // Past zero on trial, as for one alone.
            let (level, slope) = mechanics.level(i, direction, end[i].v * direction, self.time);
            forces.torque[i] += level * direction;
            forces.damping[i][i] += slope;
            forces.bend += bend_of_level(slope);
        }
        forces
    }
}

impl<S: Scalar> Balance<S, 2> for Coupled<'_, S> {
    fn pass(&self, torque: [S; 2], memory: &mut Internals<S>) -> Pass<S, 2> {
        let Forces { torque: found, stiffness, damping, bend } = self.laws(&self.end(torque).0, memory);
        let off = [torque[0] - found[0], torque[1] - found[1]];
        let correction = solve2(&self.hold.jacobian(&[stiffness, damping]), off);
        Pass { found, correction, left: if bend == 0.0 { 0.0 } else { f64::INFINITY } }
    }

    fn remember(&self, internals: &Internals<S>, torque: [S; 2], less: [S; 2], memory: &mut Memory<S>) {
        let remembering = || self.mechanics.on.forces().iter().filter(|e| e.info().memory > 0);
        if remembering().next().is_none() {
            return;
        }
        let there = motions(&self.end(torque).0);
        let end = motions(&self.end([torque[0] - less[0], torque[1] - less[1]]).0);
        for effect in remembering() {
            let i = effect.info().place.coordinate() as usize;
            let moved = Motion { x: end[i].x - there[i].x, v: end[i].v - there[i].v };
            memory_of(*effect).for_each(|i| memory[i] = internals[i].after(&moved));
        }
    }
}

/// A level that hangs on the speed may do so in any way.
fn bend_of_level(slope: f64) -> f64 {
    if slope == 0.0 { 0.0 } else { f64::INFINITY }
}

/// Solves a 2 x 2 system whose matrix is real.
fn solve2<S: Scalar>(a: &[[f64; 2]; 2], b: [S; 2]) -> [S; 2] {
    let det = a[0][0] * a[1][1] - a[0][1] * a[1][0];
    [(b[0] * a[1][1] - b[1] * a[0][1]) / det, (b[1] * a[0][0] - b[0] * a[1][0]) / det]
}
