//! Which effects may be named of an axis, which of them together, and what distinguishes them from their rivals.

use super::family::Family;
use super::info::{ParameterInfo, Place, Start};
use super::{Effect, Length};
use crate::axis::{AxisKind, Structure};

impl ParameterInfo {
    /// Its unit on that kind of axis; a phase is an angle on both.
    #[must_use]
    pub fn unit_on(&self, motion: AxisKind) -> &'static str {
        if matches!(self.start, Start::Phase) { self.unit } else { motion.unit(self.unit) }
    }
}

/// Periods of what repeats that a motion must show for it to be told from any other torque.
const SHOWN: f64 = 2.0;

impl Effect {
    /// Whether the effect can be identified from a record of an axis of that structure and motion: a rigid one has no coupling and no second
    /// encoder, and of two laws that differ by their side alone the motor's stands for both; a weight on a slide pulls alike everywhere.
    #[must_use]
    pub fn may_be_named(self, structure: Structure, motion: AxisKind) -> bool {
        let info = self.info();
        if !info.named || (motion == AxisKind::Linear && info.family == Family::Gravity) {
            return false;
        }
        if structure == Structure::TwoInertia {
            return true;
        }
        match info.place {
            Place::Coupling => false,
            Place::Sensor => info.family == Family::Latch,
            Place::Table => !super::EFFECTS.iter().any(|o| o.info().place == Place::Motor && o.is_alternative_to(self)),
            Place::Input | Place::Motor => true,
        }
    }

    /// The effect that scales every parameter of the axis by one factor, and its parameter: a wrong torque constant.
    #[must_use]
    pub fn of_gain() -> Option<(Self, usize)> {
        super::EFFECTS.iter().find_map(|e| Some((*e, e.gain_parameter()?)))
    }

    /// Order of a torque that is periodic in the angle: radians of its phase per radian at its place. `None` of any other.
    #[must_use]
    pub fn order(self, values: &[f64]) -> Option<f64> {
        match self.length()? {
            Length::Periods(p) => Some(values[p].abs()),
            Length::Turn => Some(1.0),
            Length::HalfPlay(_) => None,
        }
    }

    /// Whether a motion shows it again, that goes over a travel, rad, and turns back so many times: a period of any length that is seen once is
    /// a torque of the position like others, and so is of the time what a motion to and fro once shows alone.
    #[must_use]
    pub fn repeats(self, values: &[f64], travel: f64, reversals: f64) -> bool {
        match self.length() {
            Some(Length::Periods(order)) => values[order] * travel >= SHOWN * std::f64::consts::TAU,
            _ => !self.is_changing_friction() || reversals >= 2.0 * SHOWN - 1.0,
        }
    }

    /// Whether it is a constant torque alone: an amplifier's offset, a weight.
    #[must_use]
    pub fn is_bias(self) -> bool {
        let info = self.info();
        info.family == Family::LoadTorque && info.parameters.len() == 1
    }

    /// The effect that rounds the readings, and the parameter that is its step.
    #[must_use]
    pub fn of_rounding() -> Option<(Self, usize)> {
        super::EFFECTS.iter().find_map(|e| Some((*e, e.step_parameter()?)))
    }

    /// Whether two effects are laws of one thing, so that a record has one or the other.
    #[must_use]
    pub fn excludes(self, other: Self) -> bool {
        let (a, b) = (self.info(), other.info());
        let is = |f: Family, g: Family| (a.family, b.family) == (f, g) || (b.family, a.family) == (f, g);
        // A log that reads early undoes a late drive.
        is(Family::Latch, Family::Delay)
            || is(Family::Latch, Family::ActuatorLag)
            || is(Family::DryFriction, Family::DryFriction) && a.place == b.place
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::EFFECTS;

    #[test]
    fn a_gain_a_step_and_a_length_are_parameters_of_their_effect() {
        for e in EFFECTS {
            let length = e.length().and_then(|l| match l {
                Length::HalfPlay(p) | Length::Periods(p) => Some(p),
                Length::Turn => None,
            });
            for p in [e.gain_parameter(), e.step_parameter(), length].into_iter().flatten() {
                assert!(p < e.info().parameters.len(), "{e:?}");
            }
        }
    }

    #[test]
    fn one_effect_is_the_gain_and_one_the_rounding_and_neither_is_fitted() {
        let count = |of: fn(Effect) -> Option<usize>| EFFECTS.iter().filter(|e| of(**e).is_some()).count();
        assert_eq!((count(Effect::gain_parameter), count(Effect::step_parameter)), (1, 1));
        for (effect, _) in [Effect::of_gain(), Effect::of_rounding()].into_iter().flatten() {
            assert!(!effect.info().named, "{effect:?}");
        }
    }

    #[test]
    fn a_phase_is_an_angle_on_a_linear_axis_too() {
        let ripple = Effect::TorqueRipple.info();
        let units: Vec<&str> = ripple.parameters.iter().map(|p| p.unit_on(AxisKind::Linear)).collect();
        assert_eq!(units, ["N", "1/m", "rad"]);
    }
}
