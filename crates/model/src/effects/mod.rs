//! The effects a nominal axis leaves out: one ordered, append-only list.
//!
//! An effect is a type with an [`EffectInfo`] and the physics of its shape: [`DryFriction`] gives the level of a
//! set-valued friction force, [`Force`] a torque with its tangent from the motion, [`Input`] changes the torque on its
//! way to the motor, [`Sensor`] the positions on their way to the log. **A new effect is one new file and one new line
//! in [the list](EFFECTS)** (`tests/new_effect.rs` adds one). Everything else (the FMU's parameters, `--set`, the diagnosis, the documentation, the
//! tests every effect must pass) iterates the list.

mod active;
mod encoders;
mod extent;
mod family;
mod forces;
mod hypotheses;
mod info;
mod input;
mod law;
mod lookup;
mod sensor;
mod settings;
mod shapes;
mod side;
mod transmitted;

pub use active::{ActiveEffects, effect_scope};
pub use extent::{Extent, PERIODS};
pub use family::{Contrast, Family};
pub(crate) use forces::{Forces, StepMotion};
pub use info::{EffectInfo, ONCE, ParameterInfo, Place, Role, Scale, Start, Variant};
pub use input::{Ramp, TorqueHistory};
use law::{Absent, Forced, Sliding};
pub use law::{Law, WithLaw};
pub use lookup::UnknownEffect;
pub use sensor::{Reading, Seen, SensorHistory};
pub(crate) use settings::{Internals, MEMORY_OF_ONE};
pub use settings::{MEMORY, Memory, PARAMETERS, Settings, memory_of};
pub(crate) use shapes::Modes;
pub use shapes::{
    Base, Coordinate, DryFriction, Force, Input, Internal, Kinematics, Length, Level, Moment, Reaction, Sensor, Slip,
};

use side::{Motor, Table};

use crate::scalar::Scalar;

/// Helper of the list: the call where the shape has it, else the other value.
macro_rules! when {
    (dry, dry, $call:expr, $other:expr) => {
        $call
    };
    (force, force, $call:expr, $other:expr) => {
        $call
    };
    (input, input, $call:expr, $other:expr) => {
        $call
    };
    (sensor, sensor, $call:expr, $other:expr) => {
        $call
    };
    ($wanted:ident, $shape:ident, $call:expr, $other:expr) => {
        $other
    };
}

macro_rules! effects {
    ($($shape:ident $name:ident = $law:ty $(, mod $file:ident)?;)*) => {
        // The formatter does not follow these: .ci/run names every file to it.
        $($(mod $file;)?)*

        /// An effect of the list.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
        #[repr(u8)]
        pub enum Effect {
            $(#[doc = concat!("See [`", stringify!($law), "`].")] $name,)*
        }

        /// The list itself, in order.
        pub const EFFECTS: &[Effect] = &[$(Effect::$name,)*];

        impl Effect {
            /// What the effect is: id, place, family, parameters, reference.
            #[must_use]
            pub const fn info(self) -> &'static EffectInfo {
                match self {
                    $(Self::$name => &<$law>::INFO,)*
                }
            }

            /// True for a set-valued friction.
            #[must_use]
            pub const fn is_dry(self) -> bool {
                match self { $(Self::$name => when!(dry, $shape, true, false),)* }
            }

            /// True for a force from the motion.
            #[must_use]
            pub const fn is_force(self) -> bool {
                match self { $(Self::$name => when!(force, $shape, true, false),)* }
            }

            /// True for an effect on the torque's way in.
            #[must_use]
            pub const fn is_input(self) -> bool {
                match self { $(Self::$name => when!(input, $shape, true, false),)* }
            }

            /// Whether it is a hysteresis loop: its one internal state is the position on the loop, -1 to 1.
            #[must_use]
            pub const fn loops(self) -> bool {
                self.info().memory == 1
            }

            /// Whether it is a third inertia on a spring: inertia, stiffness and damping its first parameters.
            #[must_use]
            pub fn is_mode(self) -> bool {
                self.info().parameters.iter().any(|p| p.start == Start::Mode)
            }

            /// The parameter of a dry friction that is its level's share of the torque transmitted.
            #[must_use]
            pub const fn load_parameter(self) -> Option<usize> {
                match self {
                    $(Self::$name => when!(dry, $shape, <$law as DryFriction>::LOAD, None),)*
                }
            }

            /// True for a static load, a force that is constant or given by the position alone: see [`Force::STATIC_LOAD`].
            #[must_use]
            pub const fn is_static_load(self) -> bool {
                match self {
                    $(Self::$name => when!(force, $shape, <$law as Force>::STATIC_LOAD, false),)*
                }
            }

            /// True for a sensor effect that changes what the motor's encoder reads.
            #[must_use]
            pub const fn reads_motor(self) -> bool {
                match self {
                    $(Self::$name => when!(sensor, $shape, <$law as Sensor>::MOTOR, false),)*
                }
            }

            /// Which of a force's angles the table shows as a length: see [`Force::LENGTH`].
            #[must_use]
            pub const fn length(self) -> Option<Length> {
                match self {
                    $(Self::$name => when!(force, $shape, <$law as Force>::LENGTH, None),)*
                }
            }

            /// The parameter at whose zero it is a simpler effect: see [`Force::SIMPLER_AT_ZERO`].
            #[must_use]
            pub const fn simpler_at_zero(self) -> Option<usize> {
                match self {
                    $(Self::$name => when!(force, $shape, <$law as Force>::SIMPLER_AT_ZERO, None),)*
                }
            }

            /// The shape without which it is a change of the axis' own parameters: see [`Force::IDENTIFYING`].
            #[must_use]
            pub const fn identifying_parameter(self) -> Option<usize> {
                match self {
                    $(Self::$name => when!(force, $shape, <$law as Force>::IDENTIFYING, None),)*
                }
            }

            /// Whether it is a friction that changes with time: see [`DryFriction::CHANGES`].
            #[must_use]
            pub const fn is_changing_friction(self) -> bool {
                match self {
                    $(Self::$name => when!(dry, $shape, <$law as DryFriction>::CHANGES, false),)*
                }
            }

            /// The parameter that is half of a play, whose contacts the step locates in time.
            #[must_use]
            pub const fn play_parameter(self) -> Option<usize> {
                match self.length() {
                    Some(Length::HalfPlay(p)) => Some(p),
                    _ => None,
                }
            }

            /// The parameter that is nothing but a factor of the torque: see [`Input::GAIN`].
            #[must_use]
            pub const fn gain_parameter(self) -> Option<usize> {
                match self {
                    $(Self::$name => when!(input, $shape, <$law as Input>::GAIN, None),)*
                }
            }

            /// Whether it makes of a mean torque another one than the mean of what it makes of each: see [`Input::BENDS`].
            #[must_use]
            pub const fn bends_torque(self) -> bool {
                match self {
                    $(Self::$name => when!(input, $shape, <$law as Input>::BENDS, false),)*
                }
            }

            /// The parameter that is the step of a rounding: see [`Sensor::STEP`].
            #[must_use]
            pub const fn step_parameter(self) -> Option<usize> {
                match self {
                    $(Self::$name => when!(sensor, $shape, <$law as Sensor>::STEP, None),)*
                }
            }

            /// Natural frequency at which it holds an inertia of `inertia` kg.m2 to one place, rad/s: see [`Force::pull`].
            #[must_use]
            pub fn pull(self, p: &[f64], inertia: f64) -> f64 {
                match self {
                    $(Self::$name => when!(force, $shape, <$law>::pull(p, inertia), { let _ = (p, inertia); 0.0 }),)*
                }
            }

            /// Fastest vibration that it adds to an inertia of `inertia` kg.m2 at its place, rad/s.
            pub(crate) fn rate(self, p: &[f64], inertia: f64) -> f64 {
                match self {
                    $(Self::$name => when!(force, $shape, <$law>::rate(p, inertia), { let _ = (p, inertia); 0.0 }),)*
                }
            }

            /// Corrects its internal states when the speed at its place jumps: see [`Force::jumped`].
            pub(crate) fn jumped<S: Scalar>(self, p: &[S], memory: &mut [S], jump: S) {
                match self {
                    $(Self::$name => when!(force, $shape, <$law>::jumped(p, memory, jump), { let _ = (p, memory, jump); }),)*
                }
            }

            #[inline]
            fn level<S: Scalar>(self, p: &[S], slip: &Slip<S>) -> Level<S> {
                match self {
                    $(Self::$name => when!(dry, $shape, <$law>::level(p, slip), Level::constant(S::default())),)*
                }
            }

            /// Runs an operation with the effect's law on the motion.
            #[inline]
            pub fn with_law<W: WithLaw>(self, work: W) -> W::Output {
                match self {
                    $(Self::$name => when!(
                        force,
                        $shape,
                        work.with::<Forced<$law>>(),
                        when!(dry, $shape, work.with::<Sliding<$law>>(), work.with::<Absent>())
                    ),)*
                }
            }

            fn transform_input<S: Scalar>(self, p: &[S], ramp: Ramp<S>, h: S, history: &mut TorqueHistory<S>) -> Ramp<S> {
                match self {
                    $(Self::$name => when!(input, $shape, <$law>::transform(p, ramp, h, history), ramp),)*
                }
            }

            fn input_now<S: Scalar>(self, p: &[S], torque: S, history: &TorqueHistory<f64>) -> S {
                match self {
                    $(Self::$name => when!(input, $shape, <$law>::now(p, torque, history), torque),)*
                }
            }

            fn transform_sensor<S: Scalar>(self, p: &[S], reading: Reading<S>, seen: &Seen<'_, S>) -> Reading<S> {
                match self {
                    $(Self::$name => when!(sensor, $shape, <$law>::transform(p, reading, seen), reading),)*
                }
            }

            fn late<S: Scalar>(self, p: &[S]) -> S {
                match self {
                    $(Self::$name => when!(sensor, $shape, <$law>::late(p), S::default()),)*
                }
            }

            /// The parameter that is how long ago it looks: see [`Input::DELAY`] and [`Sensor::DELAY`].
            #[must_use]
            pub const fn delay_parameter(self) -> Option<usize> {
                match self {
                    $(Self::$name => when!(
                        input,
                        $shape,
                        <$law as Input>::DELAY,
                        when!(sensor, $shape, <$law as Sensor>::DELAY, None)
                    ),)*
                }
            }

            fn filter<S: Scalar>(self, p: &[S]) -> S {
                match self {
                    $(Self::$name => when!(sensor, $shape, <$law>::filter(p), S::default()),)*
                }
            }
        }
    };
}

effects! {
    dry CoulombMotor = coulomb::Coulomb<Motor>, mod coulomb;
    dry CoulombTable = coulomb::Coulomb<Table>;
    force PreslidingMotor = presliding::Presliding<Motor>, mod presliding;
    force PreslidingTable = presliding::Presliding<Table>;
    force ViscousMotor = viscous::Viscous<Motor>, mod viscous;
    force ViscousTable = viscous::Viscous<Table>;
    force LoadMotor = load::Load<Motor>, mod load;
    force LoadTable = load::Load<Table>;
    force TorqueRipple = ripple::TorqueRipple, mod ripple;
    force Backlash = backlash::Backlash, mod backlash;
    force CubicStiffness = cubic_stiffness::CubicStiffness, mod cubic_stiffness;
    force CouplingHysteresis = coupling_hysteresis::CouplingHysteresis, mod coupling_hysteresis;
    force StiffnessDrift = drift::StiffnessDrift, mod drift;
    dry FrictionDrift = drift::FrictionDrift;
    force FlexibleMode = flexible_mode::Mode<Table>, mod flexible_mode;
    force Disturbance = disturbance::Disturbance, mod disturbance;
    force Unbalance = ripple::Unbalance;
    force QuadraticDrag = quadratic_drag::QuadraticDrag, mod quadratic_drag;
    force EndStop = end_stop::EndStop, mod end_stop;
    input TorqueGain = input::TorqueGain;
    input Saturation = input::Saturation;
    input Delay = input::Delay;
    input ActuatorLag = input::ActuatorLag;
    sensor SensorDelay = sensor::SensorDelay;
    sensor LeadError = sensor::LeadError;
    sensor EncoderQuantisation = sensor::EncoderQuantisation;
    force Gravity = gravity::Gravity, mod gravity;
    force ExternalSpring = external_spring::ExternalSpring, mod external_spring;
    input DeadZone = dead_zone::DeadZone, mod dead_zone;
    dry PositionFriction = position_friction::PositionFriction, mod position_friction;
    force MotorMode = flexible_mode::Mode<Motor>;
    sensor Latch = latch::Latch, mod latch;
}
