//! The shapes of an effect: what each kind must provide.

use super::info::{EffectInfo, Place};
use super::input::{Ramp, TorqueHistory};
use super::sensor::{Reading, Seen};
use crate::scalar::Scalar;

/// What a torque from the motion sees and acts on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Coordinate {
    /// `theta1`.
    Motor,
    /// `theta2`.
    Table,
    /// `theta1 - theta2`.
    Twist,
}

impl Coordinate {
    /// What a torque of one along it is on motor and table.
    #[inline]
    pub const fn push(self) -> [f64; 2] {
        match self {
            Self::Motor => [1.0, 0.0],
            Self::Table => [0.0, 1.0],
            Self::Twist => [1.0, -1.0],
        }
    }
}

impl Place {
    /// The coordinate of the effects there.
    #[inline]
    pub const fn coordinate(self) -> Coordinate {
        match self {
            Self::Table => Coordinate::Table,
            Self::Coupling => Coordinate::Twist,
            Self::Motor | Self::Input | Self::Sensor => Coordinate::Motor,
        }
    }
}

/// Position and velocity of the coordinate an effect sees: `theta1`, `theta2`, or the twist `theta1 - theta2`.
#[derive(Debug, Clone, Copy, Default)]
pub struct Kinematics<S> {
    /// Position, rad.
    pub x: S,
    /// Velocity, rad/s.
    pub v: S,
}

impl<S: Scalar> Kinematics<S> {
    /// One coordinate of a motion `[theta1, omega1, twist, twist rate]`.
    #[inline]
    pub fn of(motion: &[S; 4], along: Coordinate) -> Self {
        let [x, v, twist, rate] = *motion;
        match along {
            Coordinate::Motor => Self { x, v },
            Coordinate::Table => Self { x: x - twist, v: v - rate },
            Coordinate::Twist => Self { x: twist, v: rate },
        }
    }
}

/// The nominal parameters an effect may need.
#[derive(Debug, Clone, Copy)]
pub struct Base<S> {
    /// Stiffness of the coupling, N.m/rad.
    pub k: S,
    /// Damping of the coupling, N.m.s/rad.
    pub b: S,
    /// One inertia: there is no coupling that transmits a torque.
    pub rigid: bool,
}

/// What holds over a segment of a step, until an event.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct Modes {
    /// Dry friction of motor and table: -1 or +1 sliding that way, 0 sticking.
    pub dry: [i8; 2],
    /// Backlash: -1 or +1 in contact at that side, 0 in the gap.
    pub contact: i8,
}

impl Modes {
    /// The way dry friction slides along a coordinate; none does in the coupling.
    #[inline]
    pub fn slides(self, along: Coordinate) -> f64 {
        match along {
            Coordinate::Motor => f64::from(self.dry[0]),
            Coordinate::Table => f64::from(self.dry[1]),
            Coordinate::Twist => 0.0,
        }
    }
}

/// A step as a force effect sees it: from the committed start to a trial end.
#[derive(Debug, Clone, Copy)]
pub struct Moment<S> {
    /// Motion at the start, committed.
    pub start: Kinematics<S>,
    /// Motion at the end, on trial.
    pub end: Kinematics<S>,
    /// Time at the end, s.
    pub time: f64,
    /// Length of the step, s; zero asks for the force at the start itself.
    pub h: S,
    /// The side of contact (backlash): -1, 0 (in the gap) or +1.
    pub contact: i8,
    /// The way dry friction slides there: -1 or +1, 0 at rest.
    pub slides: f64,
    /// Torque that the axis transmits at the end, as an absolute value, N.m: what a friction that grows with its load sees.
    pub load: S,
}

/// A torque that resists the motion, with its tangent for Newton's method.
#[derive(Debug, Clone, Copy)]
pub struct Reaction<S> {
    /// Torque on the left-hand side of the equation of motion (positive resists positive motion), N.m.
    pub torque: S,
    /// Its derivative to the position at the end, N.m/rad.
    pub stiffness: f64,
    /// Its derivative to the velocity at the end, N.m.s/rad.
    pub damping: f64,
    /// Bound of the second derivative to the position, N.m/rad2: over `dx` the torque is within `curvature*dx^2/2` of this tangent.
    /// Zero for a law that is linear, infinite where no bound is known.
    pub curvature: f64,
}

impl<S: Scalar> Reaction<S> {
    /// A torque that does not depend on the end of the step.
    #[inline]
    pub fn given(torque: S) -> Self {
        Self { torque, stiffness: 0.0, damping: 0.0, curvature: 0.0 }
    }
}

/// An internal state of an effect over a step.
#[derive(Debug, Clone, Copy, Default)]
pub struct Internal<S> {
    /// At the start, committed.
    pub start: S,
    /// At the end, on trial.
    pub end: S,
    /// Derivative of the end to the position and to the velocity at the end of the step.
    pub per: Kinematics<f64>,
}

impl<S: Scalar> Internal<S> {
    /// A state that stays as it is.
    #[inline]
    pub fn at(start: S) -> Self {
        Self { start, end: start, per: Kinematics::default() }
    }

    /// Sets the end on trial, and its derivative to position and velocity there.
    #[inline]
    pub fn set_end(&mut self, end: S, x: f64, v: f64) {
        self.end = end;
        self.per = Kinematics { x, v };
    }

    /// The end on trial, corrected to first order for a move `moved` of the end of the step.
    #[inline]
    pub(crate) fn after(&self, moved: &Kinematics<S>) -> S {
        self.end + moved.x * self.per.x + moved.v * self.per.v
    }
}

/// A slip under dry friction, or one that a push tries at rest.
#[derive(Debug, Clone, Copy)]
pub struct Slip<S> {
    /// The way of it: -1 or +1.
    pub direction: f64,
    /// How fast, not negative, rad/s.
    pub speed: S,
    /// Where, rad.
    pub position: S,
    /// Torque that the axis transmits, as an absolute value, N.m.
    pub load: S,
    /// When, s.
    pub time: f64,
}

/// The level of a dry friction, with its derivatives.
#[derive(Debug, Clone, Copy)]
pub struct Level<S> {
    /// Torque against the slip, N.m.
    pub level: S,
    /// Its derivative to the speed, N.m.s/rad.
    pub per_speed: f64,
    /// Its derivative to the position, N.m/rad.
    pub per_position: f64,
    /// Its derivative to the load, 1.
    pub per_load: f64,
    /// Whether it is the same wherever and however fast the slip is.
    pub constant: bool,
}

impl<S: Scalar> Level<S> {
    /// A level that does not depend on the slip.
    #[inline]
    pub fn constant(level: S) -> Self {
        Self { level, per_speed: 0.0, per_position: 0.0, per_load: 0.0, constant: true }
    }
}

/// A set-valued friction: `torque = level*sgn(v)`, anything between while at rest.
pub trait DryFriction {
    /// What the effect is.
    const INFO: EffectInfo;
    /// The parameter that is the level's share of the load, if it has one.
    const LOAD: Option<usize> = None;
    /// Whether it changes with time, so that a motion to and fro alone shows it: while the axis goes one way it may be any torque.
    const CHANGES: bool = false;

    /// The level for a slip.
    fn level<S: Scalar>(p: &[S], slip: &Slip<S>) -> Level<S>;
}

/// A torque from the motion.
///
/// Its internal states keep the committed value next to the one on trial, so that Newton's method may retry a step (trial /
/// commit / revert, as OpenSees' `UniaxialMaterial`).
pub trait Force {
    /// What the effect is.
    const INFO: EffectInfo;
    /// Whether the torque is a static load, constant or given by the position alone, as a weight's is: on a rigid axis it loads
    /// the guides.
    const STATIC_LOAD: bool = false;
    /// Which of its angles the table shows as a length.
    const LENGTH: Option<Length> = None;
    /// The parameter at whose zero the effect is a simpler one of the list.
    const SIMPLER_AT_ZERO: Option<usize> = None;
    /// The shape without which the effect is a change of the axis' own parameters: a mode of unknown stiffness is an inertia of its place.
    const IDENTIFYING: Option<usize> = None;

    /// Natural frequency at which the effect holds an inertia of `inertia` kg.m2 to one place, rad/s; zero of what holds it to none.
    fn pull(_p: &[f64], _inertia: f64) -> f64 {
        0.0
    }

    /// Fastest vibration that the effect adds to an inertia of `inertia` kg.m2 at its place, rad/s.
    fn rate(p: &[f64], inertia: f64) -> f64 {
        Self::pull(p, inertia)
    }

    /// Corrects the internal states that are relative to the speed at its place when that jumps by `jump` rad/s.
    fn jumped<S: Scalar>(_p: &[S], _memory: &mut [S], _jump: S) {}

    /// The torque at the end of the step and its tangent; it sets the end of the internal states, with their tangents.
    fn torque<S: Scalar>(p: &[S], base: &Base<S>, moment: &Moment<S>, memory: &mut [Internal<S>]) -> Reaction<S>;
}

/// An angle of a force that is seen on the table as a length, by the parameter that holds it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Length {
    /// Half of a play, rad; the step locates its contacts in time, see [`Moment::contact`].
    HalfPlay(usize),
    /// Periods per radian of a force that repeats with the angle.
    Periods(usize),
    /// One period in a turn.
    Turn,
}

/// A change of the torque on its way from the command to the motor.
pub trait Input {
    /// What the effect is.
    const INFO: EffectInfo;
    /// The parameter that is a factor of the torque, if it is nothing but that: every parameter of the axis seems off by it.
    const GAIN: Option<usize> = None;
    /// The parameter that is how long ago it looks, s, which the history of torques must cover.
    const DELAY: Option<usize> = None;
    /// Whether it is no linear filter: what it makes of a mean torque is not the mean of what it makes of each.
    const BENDS: bool = false;

    /// The torque over a step of length `h`, from the torque commanded over it.
    fn transform<S: Scalar>(p: &[S], ramp: Ramp<S>, h: S, history: &mut TorqueHistory<S>) -> Ramp<S>;

    /// The torque at this instant, from the torque commanded now and the steps up to now.
    fn now<S: Scalar>(p: &[S], torque: S, history: &TorqueHistory<f64>) -> S;
}

/// A change of the positions on their way from the axis to the log.
pub trait Sensor {
    /// What the effect is.
    const INFO: EffectInfo;

    /// Whether it changes what the motor's encoder reads, too.
    const MOTOR: bool = false;
    /// The parameter that is the step to which it rounds the readings, if it does: no derivative, but steps in the log.
    const STEP: Option<usize> = None;
    /// The parameter that is how long ago it looks, s, which the history of readings must cover.
    const DELAY: Option<usize> = None;

    /// What is read at an instant: `reading` as changed by the effects before, `seen` the motion up to then.
    fn transform<S: Scalar>(p: &[S], reading: Reading<S>, seen: &Seen<'_, S>) -> Reading<S>;

    /// How long before the log's stamp both encoders are read, s; negative after it.
    fn late<S: Scalar>(_p: &[S]) -> S {
        S::default()
    }

    /// Time constant of a first-order filter before both encoders are read, s.
    fn filter<S: Scalar>(_p: &[S]) -> S {
        S::default()
    }
}

/// Undamped natural frequency of an inertia, kg.m2, on a spring, N.m/rad, in rad/s; zero without an inertia.
pub(super) fn natural_frequency(stiffness: f64, inertia: f64) -> f64 {
    if inertia > 0.0 { (stiffness / inertia).sqrt() } else { 0.0 }
}

/// `(1 - exp(-a))/a`, with its limit at zero.
pub(super) fn mean_decay<S: Scalar>(a: S) -> S {
    if a.re().abs() < 1e-4 {
        return S::from(1.0) - a * 0.5 + a.squared() * (1.0 / 6.0);
    }
    (S::from(1.0) - (-a).exp()) / a
}
