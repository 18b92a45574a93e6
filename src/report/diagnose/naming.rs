//! Hypotheses, effects and signals as people call them.

use crate::diagnose::location::{Side, StateVariable};
use crate::diagnose::{Diagnosis, HeldOut, Hypothesis, Verdict};
use crate::effects::{EffectInfo, Family};

/// A hypothesis in words.
pub fn title(hypothesis: &Hypothesis) -> String {
    match hypothesis {
        Hypothesis::NoGap => "nothing: the model as it is".to_owned(),
        Hypothesis::Parameters => "parameters only".to_owned(),
        Hypothesis::Effects(effects) => effects.iter().map(|e| short_title(e.info())).collect::<Vec<_>>().join(" and "),
    }
}

/// The title up to its first colon or comma.
pub fn short_title(info: &EffectInfo) -> &'static str {
    info.title.split([':', ',']).next().unwrap_or(info.title)
}

/// The same within a sentence.
pub fn lower(text: &str) -> String {
    let mut chars = text.chars();
    let first_word_is_a_name = text.starts_with("Coulomb");
    match chars.next() {
        Some(c) if !first_word_is_a_name => c.to_lowercase().chain(chars).collect(),
        _ => text.to_owned(),
    }
}

/// What the model at its best is called.
pub fn improved(d: &Diagnosis) -> &'static str {
    match (d.verdict, d.causes.len()) {
        (Verdict::Effect, 2..) => "with the effects",
        (Verdict::Effect, _) => "with the effect",
        (Verdict::Unexplained, 2..) => "with the nearest effects",
        (Verdict::Unexplained, _) => "with the nearest effect",
        (Verdict::Parameters | Verdict::NoGap, _) => "re-identified",
    }
}

/// What the held-out data are.
pub const fn held_out(what: HeldOut) -> &'static str {
    match what {
        HeldOut::SecondRecord => "a second record",
        HeldOut::LastThird => "the last third of the record",
    }
}

/// Unit of a residual torque on a rotary axis.
pub const RESIDUAL: &str = "N.m";

/// A variable of the motion, and its unit on a rotary axis.
pub const fn variable(v: StateVariable) -> (&'static str, &'static str) {
    match v {
        StateVariable::Omega1 => ("omega1", "rad/s"),
        StateVariable::Turn1 => ("theta1 within the turn", "rad"),
        StateVariable::Theta1 => ("theta1", "rad"),
        StateVariable::Torque => ("T", "N.m"),
        StateVariable::Omega2 => ("omega2", "rad/s"),
        StateVariable::Turn2 => ("theta2 within the turn", "rad"),
        StateVariable::Theta2 => ("theta2", "rad"),
        StateVariable::Twist => ("twist", "rad"),
        StateVariable::TwistRate => ("twist rate", "rad/s"),
    }
}

/// A residual torque.
pub const fn residual(side: Side) -> &'static str {
    match side {
        Side::Motor => "residual torque on the motor",
        Side::Table => "residual torque on the table",
    }
}

/// What a cause usually means on a machine.
pub const fn meaning(family: Family) -> &'static str {
    match family {
        Family::DryFriction => {
            "On a machine: bearings, seals, guideway pads and their preload; it makes the quadrant glitches of a circle, and friction compensation in the drive removes them."
        }
        Family::ViscousFriction => {
            "On a machine: grease, oil and speed; it changes with temperature, so identify it warm."
        }
        Family::LoadTorque => {
            "On a machine: weight on a tilted axis, an unbalanced load, or an offset of the amplifier."
        }
        Family::TorqueRipple => {
            "On a machine: cogging or commutation of the motor (its order is a multiple of the pole pairs) or an eccentric screw (order one)."
        }
        Family::Backlash => {
            "On a machine: lost preload of the nut, a worn coupling or key; it shows as a step at each reversal."
        }
        Family::NonlinearStiffness => {
            "On a machine: contact stiffness of nut and bearings, or a coupling with an elastomer."
        }
        Family::Hysteresis => "On a machine: micro-slip in a clamped joint, an elastomer coupling, or a belt.",
        Family::Drift => "On a machine: warming up, or wear; repeat the measurement warm, and trend it.",
        Family::FlexibleMode => "On a machine: the workpiece, a spindle head or the frame swinging behind the table.",
        Family::Disturbance => {
            "On a machine: chatter, a pump, a neighbouring machine; look for what turns at this frequency."
        }
        Family::Gravity => "On a machine: a weight on a hinge, an arm, or a counterweight that is not in balance.",
        Family::ExternalSpring => "On a machine: a way cover, hoses or cables, a gas spring.",
        Family::DeadZone => "On a machine: an amplifier or a valve that does not answer to small commands.",
        Family::PositionFriction => "On a machine: a tight spot of the screw, a damaged rail, a bent shaft.",
        Family::Latch => {
            "On a machine: torque and encoders logged at different instants of the cycle, or behind different filters."
        }
        Family::EndStop => "On a machine: the travel limit or a bellows that touches; move the test away from it.",
        Family::Saturation => "On a machine: the torque limit of the drive; drive less, or raise the limit.",
        Family::ActuatorLag => "On a machine: the bandwidth of the current loop.",
        Family::Delay => "On a machine: cycles of the bus and the controller between command and torque.",
        Family::Parameters => "On a machine: a torque constant from the data sheet that the motor does not have.",
        Family::Sensor => {
            "On a machine: the measurement, not the motion: encoder interpolation, pitch error, or when the value is read."
        }
    }
}
