//! The torque that the axis transmits, which is the load of a friction that grows with it.

use super::Effect;
use super::active::ActiveEffects;
use super::forces::{Forces, React, StepMotion};
use super::settings::Settings;
use super::shapes::{Base, Coordinate, Kinematics, Reaction};
use crate::scalar::Scalar;

impl<S: Scalar> Settings<S> {
    /// Whether the level of an effect grows with the torque transmitted.
    pub(crate) fn is_loaded(&self, effect: Effect) -> bool {
        effect.load_parameter().is_some_and(|i| self.of(effect)[i].re() != 0.0)
    }

    /// Whether the transmitted torque is needed: a dry friction grows with it, or its derivative to that share is asked for.
    pub(crate) fn counts_load(&self, on: &ActiveEffects) -> bool {
        on.dry().iter().any(|e| e.load_parameter().is_some() && (S::HAS_DERIVATIVES || self.is_loaded(*e)))
    }

    /// The torque that the axis transmits at the end of a step: through its coupling, or on a rigid axis what the guides
    /// carry, of torques that are constant or given by the position.
    pub(crate) fn transmitted(&self, on: &ActiveEffects, base: &Base<S>, step: &StepMotion<S>) -> Forces<S> {
        let mut sum = Forces::default();
        if !base.rigid {
            let twist = Kinematics::of(&step.end, Coordinate::Twist);
            let (stiffness, damping) = (base.k.re(), base.b.re());
            let torque = base.k * twist.x + base.b * twist.v;
            // The load is the motor's row; the table's is its negative.
            sum.add(Coordinate::Twist, &Reaction { torque, stiffness, damping, curvature: f64::INFINITY });
            return sum;
        }
        for &effect in on.forces().iter().filter(|e| e.is_static_load()) {
            let moment = step.moment(effect.info().place.coordinate(), S::default());
            let found = effect.with_law(React { p: self.of(effect), base, moment: &moment, memory: &mut [] });
            // One body: what acts anywhere acts on the row of the motor.
            sum.torque[0] += found.torque;
            sum.stiffness[0][0] += found.stiffness;
            sum.damping[0][0] += found.damping;
        }
        sum
    }
}
