//! Kinds of effects, whatever their place: one list, in which each kind has everything that is known of it.

/// What an experiment must vary to distinguish the effects of a family from their rivals.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Contrast {
    /// How far the coupling is twisted: play, a cubic spring and a loop grow differently with it.
    Twist,
    /// How high the excitation reaches: lateness is a phase that grows with frequency.
    Phase,
    /// How the motion reverses: what acts against it changes sign there, a bias does not.
    Reversals,
}

macro_rules! families {
    ($($name:ident = $id:literal $(, $contrast:expr)?; $meaning:literal;)*) => {
        /// Effects of one kind, whatever their place.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
        pub enum Family {
            $(#[doc = $meaning] $name,)*
        }

        impl Family {
            /// The name used in files.
            #[must_use]
            pub const fn as_str(self) -> &'static str {
                match self { $(Self::$name => $id,)* }
            }

            /// What distinguishes it from its rivals; `None` where they scale differently with the amplitude.
            #[must_use]
            pub const fn contrast(self) -> Option<Contrast> {
                match self { $(Self::$name => first([$(Some($contrast),)? None]),)* }
            }

            /// What a cause of the kind usually is on a machine, and what to do about it: one sentence.
            #[must_use]
            pub const fn meaning(self) -> &'static str {
                match self { $(Self::$name => $meaning,)* }
            }
        }
    };
}

/// The first of one or two.
const fn first<const N: usize>(of: [Option<Contrast>; N]) -> Option<Contrast> {
    of[0]
}

families! {
    DryFriction = "dry_friction", Contrast::Reversals;
        "On a machine: bearings, seals, guideway pads and their preload; it makes the quadrant glitches of a circle, and friction compensation in the drive removes them.";
    ViscousFriction = "viscous_friction";
        "On a machine: grease, oil and speed; it changes with temperature, so identify it warm.";
    LoadTorque = "load_torque", Contrast::Reversals;
        "On a machine: weight on a tilted axis, an unbalanced load, or an offset of the amplifier.";
    TorqueRipple = "torque_ripple";
        "On a machine: cogging or commutation of the motor (its order is a multiple of the pole pairs) or an eccentric screw (order one).";
    Backlash = "backlash", Contrast::Twist;
        "On a machine: lost preload of the nut, a worn coupling or key; it shows as a step at each reversal.";
    NonlinearStiffness = "nonlinear_stiffness", Contrast::Twist;
        "On a machine: contact stiffness of nut and bearings, or a coupling with an elastomer.";
    Hysteresis = "hysteresis", Contrast::Twist;
        "On a machine: micro-slip in a clamped joint, an elastomer coupling, or a belt.";
    Drift = "drift";
        "On a machine: warming up, or wear; repeat the measurement warm, and trend it.";
    FlexibleMode = "flexible_mode";
        "On a machine: the workpiece, a spindle head or the frame swinging behind the table.";
    Disturbance = "disturbance";
        "On a machine: chatter, a pump, a neighbouring machine; look for what turns at this frequency.";
    EndStop = "end_stop";
        "On a machine: the travel limit or a bellows that touches; move the test away from it.";
    Saturation = "saturation";
        "On a machine: the torque limit of the drive; drive less, or raise the limit.";
    ActuatorLag = "actuator_lag", Contrast::Phase;
        "On a machine: the bandwidth of the current loop.";
    Delay = "delay", Contrast::Phase;
        "On a machine: cycles of the bus and the controller between command and torque.";
    Parameters = "parameters";
        "On a machine: a torque constant from the data sheet that the motor does not have.";
    Sensor = "sensor";
        "On a machine: the measurement, not the motion: encoder interpolation, pitch error, or when the value is read.";
    Gravity = "gravity";
        "On a machine: a weight on a hinge, an arm, or a counterweight that is not in balance.";
    ExternalSpring = "external_spring";
        "On a machine: a way cover, hoses or cables, a gas spring.";
    DeadZone = "dead_zone";
        "On a machine: an amplifier or a valve that does not answer to small commands.";
    PositionFriction = "position_friction";
        "On a machine: a tight spot of the screw, a damaged rail, a bent shaft.";
    Latch = "latch";
        "On a machine: torque and encoders logged at different instants of the cycle, or behind different filters.";
}
