//! The variables of the drive.

use super::fixed::{BLANK, output};
use super::{Causality, Variability, Variable};

/// A torque that no drive reaches: no limit.
pub const NO_LIMIT: f64 = 1e9;

const fn input(name: &'static str, unit: &'static str, nominal: f64, doc: &'static str) -> Variable {
    let (causality, variability) = (Causality::Input, Variability::Continuous);
    Variable { name, unit, nominal, doc, causality, variability, start: Some(0.0), ..BLANK }
}

const fn gain(name: &'static str, unit: &'static str, start: f64, doc: &'static str) -> Variable {
    Variable { name, unit, start: Some(start), min: Some(0.0), nominal: start, doc, ..BLANK }
}

slots! {
    DriveSlot in DRIVE:
    Reference = input("reference", "m", 1e-2, "Where the table shall be");
    Theta = input("theta", "rad", 1.0, "Angle of the encoder that closes the position loop: theta1 or theta2 of the axis");
    Omega = input("omega", "rad/s", 10.0, "Speed of the motor: omega1 of the axis");
    Torque = output("T", "N.m", 1e-2, "Torque command: of each sample, from the next one on");
    Error = output("error", "m", 1e-5, "Following error of each sample, from the next one on: reference - rho*theta");
    Kp = gain("kp", "1/s", 20.0, "Gain of the position loop");
    Kv = gain("kv", "N.m.s/rad", 0.0194456, "Gain of the velocity loop");
    Ki = gain("ki", "N.m/rad", 0.388912, "Integral gain of the velocity loop");
    VelocityForward = gain("velocity_forward", "1", 1.0, "Share of the reference's speed that is fed forward");
    AccelerationForward = gain("acceleration_forward", "1", 1.0, "Share of the reference's acceleration that is fed forward");
    Inertia = gain("inertia", "kg.m2", 2.4307e-4, "Inertia that the acceleration is fed forward with");
    Limit = Variable {
        max: Some(NO_LIMIT),
        nominal: 1.0,
        ..gain("limit", "N.m", NO_LIMIT, "Torque limit; the integral does not grow into it")
    };
    Rho = Variable {
        min: Some(1e-12),
        variability: Variability::Fixed,
        ..gain("rho", "m/rad", 3.18e-4, "Lead of the screw per radian")
    };
    SampleTime = Variable {
        // As for the axis' internal step.
        min: Some(1e-6),
        max: Some(1e3),
        variability: Variability::Fixed,
        ..gain("sample_time", "s", 1e-3, "Sampling interval: the drive reads its inputs at its start and after each interval")
    };
}
