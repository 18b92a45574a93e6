//! What a co-simulation needs of the axis between its steps: another step length, changed parameters, and a state that
//! can be stored as numbers.

use super::axis_model::{Axis, State};
use super::mechanics::Mechanics;
use crate::scalar::Scalar;

impl<S: Scalar> Axis<S> {
    /// Goes on with steps of `h` seconds.
    pub fn set_step(&mut self, h: f64) {
        let Mechanics { parameters, structure, effects, on, scheme, .. } = self.full;
        *self = Self::of(Mechanics::new(parameters, structure, effects, on, scheme, h));
    }

    /// The state taken over from an axis with other parameters or effects, at `time` s: the motion and the effects'
    /// internal states go on, the modes of friction and contact and the effects' torques are found anew.
    #[must_use]
    pub fn take_over(&self, s: &State<S>, time: f64) -> State<S> {
        let mut state = *s;
        let fresh = self.state(s.theta1(), s.omega1(), s.theta2(), s.omega2(), time);
        state.friction = fresh.friction;
        state.modes = fresh.modes;
        state.force = fresh.force;
        self.full.refresh_force(&mut state, time);
        state
    }
}

impl<S: Scalar> State<S> {
    /// The same state over another scalar, as constants.
    #[must_use]
    #[inline]
    pub fn lift(s: &State<f64>) -> Self {
        Self {
            linear: s.linear.map(S::from),
            friction: s.friction.map(S::from),
            force: s.force.map(S::from),
            memory: s.memory.map(S::from),
            modes: s.modes,
        }
    }

    /// The same without derivatives.
    #[must_use]
    #[inline]
    pub fn primal(&self) -> State<f64> {
        State {
            linear: self.linear.map(S::re),
            friction: self.friction.map(S::re),
            force: self.force.map(S::re),
            memory: self.memory.map(S::re),
            modes: self.modes,
        }
    }
}

impl State<f64> {
    /// Whether every angle and speed is a finite number.
    #[must_use]
    #[inline]
    pub fn is_finite(&self) -> bool {
        // One test for all: an infinity or a NaN in any of them makes the sum of zeros a NaN.
        self.linear.iter().map(|x| x * 0.0).sum::<f64>() == 0.0
    }

    /// Calls `visit` on every number of the state, which it may change: a stored state is written and read by this function alone.
    pub fn visit_numbers(&mut self, visit: &mut impl FnMut(&mut f64)) {
        let numbers = self.linear.iter_mut().chain(&mut self.friction).chain(&mut self.force).chain(&mut self.memory);
        numbers.for_each(&mut *visit);
        for mode in self.modes.dry.iter_mut().chain([&mut self.modes.contact]) {
            let mut value = f64::from(*mode);
            visit(&mut value);
            *mode = if value > 0.0 { 1 } else { -i8::from(value < 0.0) };
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::axis::{Axis, Parameters, Scheme, Structure};
    use crate::effects::{Effect, Ramp, Settings};

    #[test]
    fn friction_that_sticks_answers_the_torque_of_now() {
        let mut effects = Settings::default();
        effects.of_mut(Effect::CoulombMotor)[0] = 0.01;
        let p = Parameters::PAPER;
        let axis = Axis::new(p, Structure::TwoInertia, effects, Scheme::NEWMARK, 1e-3);
        let rest = axis.state(0.0, 0.0, 0.0, 0.0, 0.0);
        let after = axis.advance(&rest, Ramp::held(0.004), 0.0);
        assert_eq!(axis.accelerations(&after, 0.009, 1e-3), [0.0, 0.0]);
        assert_eq!(axis.accelerations(&after, -0.009, 1e-3), [0.0, 0.0]);
        let a = axis.accelerations(&after, 0.012, 1e-3);
        assert!((a[0] - 0.002 / p.i1).abs() < 1e-9 && a[1] == 0.0, "{a:?}");
    }

    #[test]
    fn friction_switched_on_in_motion_slides_at_once() {
        let p = Parameters::PAPER;
        let plain = Axis::new(p, Structure::TwoInertia, Settings::default(), Scheme::NEWMARK, 1e-3);
        let mut s = plain.state(0.0, 0.0, 0.0, 0.0, 0.0);
        for k in 0..50 {
            s = plain.advance(&s, Ramp::held(0.02), f64::from(k) * 1e-3);
        }
        let mut effects = Settings::default();
        effects.of_mut(Effect::CoulombMotor)[0] = 0.005;
        let rough = Axis::new(p, Structure::TwoInertia, effects, Scheme::NEWMARK, 1e-3);
        let taken = rough.take_over(&s, 0.05);
        assert_eq!(taken.reading(), s.reading());
        let before = plain.accelerations(&s, 0.02, 0.05)[0];
        let after = rough.accelerations(&taken, 0.02, 0.05)[0];
        assert!((before - after - 0.005 / p.i1).abs() < 1e-9 * before.abs(), "{before} {after}");
    }
}
