//! The values behind the table, and what the model is made of from them.

use std::array;

use super::{COUNT, FIXED, Model, Slot, all};
use super::{DriveSlot, NO_LIMIT};
use crate::axis::{AxisKind, Parameters, Scheme, Structure};
use crate::drive::Gains;
use crate::effects::{PARAMETERS, Settings};
use crate::scalar::Scalar;

/// Start values of every variable (zero for outputs), as they are stored in an FMU.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Starts {
    /// Of which model.
    pub model: Model,
    /// One a variable, in the order of the model's table; what is left over is zero.
    pub values: [f64; COUNT],
    /// Units of the axis.
    pub motion: AxisKind,
}

impl Default for Starts {
    /// The paper's axis with every effect off.
    fn default() -> Self {
        let mut values = [0.0; COUNT];
        for (value, variable) in values.iter_mut().zip(all()) {
            *value = variable.start.unwrap_or(0.0);
        }
        Self { model: Model::Axis, values, motion: AxisKind::Rotary }
    }
}

impl Starts {
    /// The start values of a machine.
    #[must_use]
    pub fn of(parameters: &Parameters, structure: Structure, effects: &Settings, motion: AxisKind) -> Self {
        let mut starts = Self { motion, ..Self::default() };
        let mut put = |slot: Slot, value: f64| starts.values[slot as usize] = value;
        put(Slot::I1, parameters.i1);
        put(Slot::I2, parameters.i2);
        put(Slot::B, parameters.b);
        put(Slot::K, parameters.k);
        put(Slot::Rho, parameters.rho);
        put(Slot::Structure, if structure == Structure::Rigid { 2.0 } else { 1.0 });
        starts.values[FIXED.len()..].copy_from_slice(effects.flat());
        starts
    }

    /// The start values of a drive with a sampling interval of `dt` s, for an axis with a lead of `rho`.
    #[must_use]
    pub fn drive(gains: &Gains, rho: f64, dt: f64, motion: AxisKind) -> Self {
        let mut starts = Self { model: Model::Drive, values: [0.0; COUNT], motion };
        for (slot, value) in [
            (DriveSlot::Kp, gains.kp),
            (DriveSlot::Kv, gains.kv),
            (DriveSlot::Ki, gains.ki),
            (DriveSlot::VelocityForward, gains.velocity_forward),
            (DriveSlot::AccelerationForward, gains.acceleration_forward),
            (DriveSlot::Inertia, gains.inertia),
            (DriveSlot::Limit, gains.limit.min(NO_LIMIT)),
            (DriveSlot::Rho, rho),
            (DriveSlot::SampleTime, dt),
        ] {
            starts.values[slot as usize] = value;
        }
        starts
    }
}

/// The values of every variable but the outputs, whose places stay unused.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Values<S = f64>(pub [S; COUNT]);

impl<S: Scalar> Values<S> {
    /// The value of a fixed variable.
    #[must_use]
    pub fn of(&self, slot: Slot) -> S {
        self.0[slot as usize]
    }

    /// The nominal parameters.
    #[must_use]
    pub fn parameters(&self) -> Parameters<S> {
        Parameters {
            i1: self.of(Slot::I1),
            i2: self.of(Slot::I2),
            b: self.of(Slot::B),
            k: self.of(Slot::K),
            rho: self.of(Slot::Rho),
        }
    }

    /// One inertia or two.
    #[must_use]
    pub fn structure(&self) -> Structure {
        if self.of(Slot::Structure).re() > 1.5 { Structure::Rigid } else { Structure::TwoInertia }
    }

    /// The integration scheme.
    #[must_use]
    pub fn scheme(&self) -> Scheme {
        if self.of(Slot::Scheme).re() > 1.5 {
            Scheme::Exact
        } else {
            Scheme::Newmark { alpha: self.of(Slot::NewmarkAlpha).re(), delta: self.of(Slot::NewmarkDelta).re() }
        }
    }

    /// The effects.
    #[must_use]
    pub fn effects(&self) -> Settings<S> {
        let values: [S; PARAMETERS] = array::from_fn(|i| self.0[FIXED.len() + i]);
        Settings::from_flat(values)
    }

    /// Motion at the start: theta1, omega1, theta2, omega2.
    #[must_use]
    pub fn initial(&self) -> [S; 4] {
        [Slot::Theta1Start, Slot::Omega1Start, Slot::Theta2Start, Slot::Omega2Start].map(|slot| self.of(slot))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_start_values_are_the_papers_axis_without_effects() {
        let values = Values(Starts::default().values);
        assert_eq!(values.parameters(), Parameters::PAPER);
        assert_eq!(values.effects(), Settings::default());
        assert_eq!(values.structure(), Structure::TwoInertia);
        assert_eq!(values.scheme(), Scheme::NEWMARK);
        let of = Starts::of(&Parameters::PAPER, Structure::TwoInertia, &Settings::default(), AxisKind::Rotary);
        assert_eq!(of, Starts::default());
    }
}
