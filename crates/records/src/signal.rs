//! The signals of the axis by the seed paper's names, and the quantity each one is.

use serde::{Deserialize, Serialize};

pub use crate::axis::AxisKind;

/// A physical quantity, by which the units of a trace are checked.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quantity {
    /// s
    Time,
    /// N.m
    Torque,
    /// N
    Force,
    /// rad
    Angle,
    /// m
    Length,
    /// rad/s
    AngularVelocity,
    /// m/s
    Velocity,
    /// rad/s2
    AngularAcceleration,
    /// m/s2
    Acceleration,
    /// A, V or %: a drive signal in proportion to the torque, its constant unknown
    Drive,
}

/// A signal of the axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
pub enum Signal {
    /// Driving torque (force) on the motor side.
    T,
    /// Motor angle.
    #[serde(rename = "theta1")]
    Theta1,
    /// Motor speed.
    #[serde(rename = "omega1")]
    Omega1,
    /// Motor acceleration.
    #[serde(rename = "alpha1")]
    Alpha1,
    /// Table angle.
    #[serde(rename = "theta2")]
    Theta2,
    /// Table speed.
    #[serde(rename = "omega2")]
    Omega2,
    /// Table acceleration.
    #[serde(rename = "alpha2")]
    Alpha2,
    /// Table position, `x2 = rho*theta2`.
    #[serde(rename = "x2")]
    X2,
    /// Reference of the drive: the angle that it follows.
    #[serde(rename = "reference")]
    Reference,
    /// Command of the drive, where it is another than T.
    #[serde(rename = "command")]
    Command,
}

impl Signal {
    /// How many signals there are.
    pub const COUNT: usize = 10;

    /// All signals, in the order of a trace file.
    pub const ALL: [Self; Self::COUNT] = [
        Self::T,
        Self::Theta1,
        Self::Omega1,
        Self::Alpha1,
        Self::Theta2,
        Self::Omega2,
        Self::Alpha2,
        Self::X2,
        Self::Reference,
        Self::Command,
    ];

    /// Whether the signal belongs to the drive's control loop, not to the axis: a trace may be without it.
    #[must_use]
    pub const fn is_of_the_loop(self) -> bool {
        matches!(self, Self::Reference | Self::Command)
    }

    /// Position in [`Signal::ALL`].
    #[must_use]
    pub const fn index(self) -> usize {
        self as usize
    }

    /// The name in files and in the FMU.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::T => "T",
            Self::Theta1 => "theta1",
            Self::Omega1 => "omega1",
            Self::Alpha1 => "alpha1",
            Self::Theta2 => "theta2",
            Self::Omega2 => "omega2",
            Self::Alpha2 => "alpha2",
            Self::X2 => "x2",
            Self::Reference => "reference",
            Self::Command => "command",
        }
    }

    /// The signal of a name, as it is written in files.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|s| s.name() == name)
    }

    /// What the signal measures.
    #[must_use]
    pub const fn quantity(self, motion: AxisKind) -> Quantity {
        match (self, motion) {
            (Self::T | Self::Command, AxisKind::Rotary) => Quantity::Torque,
            (Self::T | Self::Command, AxisKind::Linear) => Quantity::Force,
            (Self::Theta1 | Self::Theta2 | Self::Reference, AxisKind::Rotary) => Quantity::Angle,
            (Self::Theta1 | Self::Theta2 | Self::Reference, AxisKind::Linear) | (Self::X2, _) => Quantity::Length,
            (Self::Omega1 | Self::Omega2, AxisKind::Rotary) => Quantity::AngularVelocity,
            (Self::Omega1 | Self::Omega2, AxisKind::Linear) => Quantity::Velocity,
            (Self::Alpha1 | Self::Alpha2, AxisKind::Rotary) => Quantity::AngularAcceleration,
            (Self::Alpha1 | Self::Alpha2, AxisKind::Linear) => Quantity::Acceleration,
        }
    }

    /// The SI unit of the signal.
    #[must_use]
    pub const fn unit(self, motion: AxisKind) -> &'static str {
        self.quantity(motion).unit()
    }
}

impl Quantity {
    /// The SI unit of the quantity, as written in the brackets of a trace's header.
    #[must_use]
    pub const fn unit(self) -> &'static str {
        match self {
            Self::Time => "s",
            Self::Torque => "N.m",
            Self::Force => "N",
            Self::Angle => "rad",
            Self::Length => "m",
            Self::AngularVelocity => "rad/s",
            Self::Velocity => "m/s",
            Self::AngularAcceleration => "rad/s2",
            Self::Acceleration => "m/s2",
            Self::Drive => "A, V or %",
        }
    }

    /// What the quantity is called in a message.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Time => "a time",
            Self::Torque => "a torque",
            Self::Force => "a force",
            Self::Angle => "an angle",
            Self::Length => "a length",
            Self::AngularVelocity => "an angular velocity",
            Self::Velocity => "a velocity",
            Self::AngularAcceleration => "an angular acceleration",
            Self::Acceleration => "an acceleration",
            Self::Drive => "a drive signal",
        }
    }
}

impl std::fmt::Display for Signal {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_signal_is_found_by_its_name_and_stands_at_its_index() {
        for (k, signal) in Signal::ALL.into_iter().enumerate() {
            assert_eq!(signal.index(), k);
            assert_eq!(Signal::from_name(signal.name()), Some(signal));
            assert_eq!(serde_json::to_string(&signal).unwrap(), format!("\"{}\"", signal.name()));
        }
    }
}
