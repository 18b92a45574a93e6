//! The axis ready to step, and its state.

use super::mechanics::Mechanics;
use super::oscillator::Scheme;
use super::parameters::{Parameters, Structure};
use super::propagator::Linear;
use crate::effects::{ActiveEffects, Coordinate, Effect, Memory, Modes, Reading, Settings, memory_of};
use crate::scalar::Scalar;

/// The axis with its effects, prepared for steps of one length.
#[derive(Debug, Clone, Copy)]
pub struct Axis<S = f64> {
    pub(super) full: Mechanics<S>,
    /// The same without derivatives.
    pub(super) primal: Mechanics<f64>,
}

impl<S: Scalar> Axis<S> {
    /// Prepares the axis for steps of `h` seconds.
    pub fn new(parameters: Parameters<S>, structure: Structure, effects: Settings<S>, scheme: Scheme, h: f64) -> Self {
        Self::with_on(parameters, structure, effects, &[], scheme, h)
    }

    /// The same with some effects taken as on whatever their size, so that derivatives at the off value exist.
    pub fn with_on(
        parameters: Parameters<S>,
        structure: Structure,
        effects: Settings<S>,
        also: &[Effect],
        scheme: Scheme,
        h: f64,
    ) -> Self {
        Self::of(Mechanics::new(parameters, structure, effects, effects.active_with(also), scheme, h))
    }

    pub(super) fn of(full: Mechanics<S>) -> Self {
        Self { full, primal: full.primal() }
    }

    /// The parameters.
    pub fn parameters(&self) -> &Parameters<S> {
        &self.full.parameters
    }

    /// The effects.
    pub fn effects(&self) -> &Settings<S> {
        &self.full.effects
    }

    /// Which effects act.
    pub fn on(&self) -> &ActiveEffects {
        &self.full.on
    }

    /// Length of a step, s.
    pub fn h(&self) -> f64 {
        self.full.whole.step.h().re()
    }

    /// The state with these angles (rad) and speeds (rad/s) at `time` s, everything else at rest.
    pub fn state(&self, theta1: S, omega1: S, theta2: S, omega2: S, time: f64) -> State<S> {
        let linear = match self.full.structure {
            Structure::TwoInertia => [theta1, omega1, theta1 - theta2, omega1 - omega2],
            Structure::Rigid => [theta1, omega1, S::default(), S::default()],
        };
        let mut state = State {
            linear,
            friction: [S::default(); 2],
            force: [S::default(); 2],
            memory: [S::default(); crate::effects::MEMORY],
            modes: Modes::default(),
        };
        state.modes.dry = [mode(state.omega1()), mode(state.omega2())];
        self.full.set_contact(&mut state);
        self.full.refresh_force(&mut state, time);
        state
    }

    /// The same with the effects' internal states of another state: where one window of a record continues another.
    pub fn resume(&self, [theta1, omega1, theta2, omega2]: [S; 4], internals: &Memory<S>, time: f64) -> State<S> {
        let mut state = self.state(theta1, omega1, theta2, omega2, time);
        state.memory = *internals;
        self.full.refresh_force(&mut state, time);
        state
    }

    /// Accelerations `[alpha1, alpha2]` under the torque `torque` on the motor at `time` s, rad/s2 (paper, eq. 2).
    ///
    /// Dry friction at rest balances the present torque, whatever it was over the step before: up to its level the
    /// inertia stays.
    pub fn accelerations(&self, s: &State<S>, torque: S, time: f64) -> [S; 2] {
        let coupling = match self.full.structure {
            Structure::Rigid => S::default(),
            Structure::TwoInertia => self.full.parameters.k * s.linear[2] + self.full.parameters.b * s.linear[3],
        };
        let mut push = [torque - s.force[0] - coupling, coupling - s.force[1]];
        let sticks = self.full.sticks(s);
        if self.full.structure == Structure::Rigid {
            let mut sum = push[0] + push[1];
            if sticks[0] || sticks[1] {
                let level = |i: usize| {
                    if sticks[i] { self.rest_level(i, sum, s, time) } else { S::default() }
                };
                sum = beyond(sum, level(0) + level(1));
            }
            let a = sum / (self.full.parameters.i1 + self.full.parameters.i2);
            return [a, a];
        }
        for i in 0..2 {
            if sticks[i] {
                push[i] = beyond(push[i], self.rest_level(i, push[i], s, time));
            }
        }
        [push[0] / self.full.parameters.i1, push[1] / self.full.parameters.i2]
    }

    /// Gives each inertia an impulse at the state, N.m.s, and returns what took effect: an inertia that dry friction holds
    /// takes none of an impulse that, spread over `span` s, stays below what its friction can still hold.
    ///
    /// A correction of the motion enters here as a torque, which friction at rest resists like any other (a rigid axis
    /// takes both on its one inertia).
    pub fn kick(&self, s: &mut State<S>, impulse: [S; 2], span: f64, time: f64) -> [S; 2] {
        let mut taken = impulse;
        let sticks = self.full.sticks(s);
        for i in 0..2 {
            let push = impulse[i].re() / span + s.friction[i].re();
            if sticks[i] && push.abs() <= self.rest_level(i, S::from(push), s, time).re() {
                taken[i] = S::default();
            }
        }
        let p = &self.full.parameters;
        let [motor, table] = match self.full.structure {
            Structure::Rigid => [(taken[0] + taken[1]) / (p.i1 + p.i2); 2],
            Structure::TwoInertia => [taken[0] / p.i1, taken[1] / p.i2],
        };
        s.linear[1] += motor;
        if self.full.structure == Structure::TwoInertia {
            s.linear[3] += motor - table;
        }
        for effect in self.full.on.forces().iter().filter(|e| e.info().memory > 0) {
            let jump = match effect.info().place.coordinate() {
                Coordinate::Motor => motor,
                Coordinate::Table => table,
                Coordinate::Twist => motor - table,
            };
            effect.jumped(self.full.effects.of(*effect), &mut s.memory[memory_of(*effect)], jump);
        }
        let moves = [mode(s.omega1()), mode(s.omega2())];
        for i in 0..2 {
            if !sticks[i] || taken[i].re() != 0.0 {
                s.modes.dry[i] = moves[i];
            }
        }
        if !self.full.on.motion_is_linear() {
            self.full.refresh_force(s, time);
        }
        taken
    }

    /// Which inertias dry friction holds at rest: up to its level no torque shows in the motion.
    pub fn holds(&self, s: &State<S>) -> [bool; 2] {
        let sticks = self.full.sticks(s);
        match self.full.structure {
            Structure::TwoInertia => sticks,
            Structure::Rigid => [sticks[0] || sticks[1]; 2],
        }
    }

    /// Level of dry friction of inertia `i` at rest, against `push`, N.m.
    fn rest_level(&self, i: usize, push: S, s: &State<S>, time: f64) -> S {
        self.full.rest_level(i, push.re().signum(), s, self.full.load(s, time), time)
    }
}

/// What is left of a torque beyond the `level` that friction can hold.
fn beyond<S: Scalar>(push: S, level: S) -> S {
    if push.re().abs() <= level.re() {
        S::default()
    } else if push.re() > 0.0 {
        push - level
    } else {
        push + level
    }
}

fn mode<S: Scalar>(v: S) -> i8 {
    if v.re() > 0.0 {
        1
    } else if v.re() < 0.0 {
        -1
    } else {
        0
    }
}

/// Everything that the axis remembers from one step to the next; `Copy`, so that a rollback is a copy.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct State<S = f64> {
    /// `[theta1, omega1, twist, twist rate]`.
    pub(super) linear: Linear<S>,
    /// Dry friction while it sticks, N.m.
    pub(super) friction: [S; 2],
    /// Torques of the effects at this state, N.m.
    pub(super) force: [S; 2],
    /// Internal states of the effects.
    pub(super) memory: Memory<S>,
    pub(super) modes: Modes,
}

impl<S: Scalar> State<S> {
    /// Angle of the motor, rad.
    pub fn theta1(&self) -> S {
        self.linear[0]
    }
    /// Speed of the motor, rad/s.
    pub fn omega1(&self) -> S {
        self.linear[1]
    }
    /// Angle of the table side, rad.
    pub fn theta2(&self) -> S {
        self.linear[0] - self.linear[2]
    }
    /// Speed of the table side, rad/s.
    pub fn omega2(&self) -> S {
        self.linear[1] - self.linear[3]
    }
    /// All four, as an encoder without effects reads them.
    pub fn reading(&self) -> Reading<S> {
        Reading { theta1: self.theta1(), omega1: self.omega1(), theta2: self.theta2(), omega2: self.omega2() }
    }
    /// Internal states of the effects.
    pub fn memory(&self) -> &Memory<S> {
        &self.memory
    }
}
