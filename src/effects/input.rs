//! Effects on the torque's way in: gain, limit, delay, lag.
//!
//! Over a step the torque is a [`Ramp`]. Where the true waveform is none (a held torque that jumps inside the step, an
//! exponential), the ramp has its mean and its first moment: the velocity and the position it gives a free inertia at
//! the end of the step are then exact, and the answer is smooth in the delay and in the time constant.

use super::info::{EffectInfo, Family, ParameterInfo, Place};
use super::shapes::Input;
use crate::scalar::Scalar;

/// Torque over a step, linear from start to end, N.m.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Ramp<S> {
    /// At the start of the step, after any jump.
    pub start: S,
    /// At the end.
    pub end: S,
}

impl<S: Scalar> Ramp<S> {
    /// A torque held over the step.
    pub fn held(torque: S) -> Self {
        Self { start: torque, end: torque }
    }

    /// The ramp of mean `m0` and first moment `m1` (both over a step of unit length).
    fn from_moments(m0: S, m1: S) -> Self {
        Self { start: m0 * 4.0 - m1 * 6.0, end: m1 * 6.0 - m0 * 2.0 }
    }

    fn at(&self, s: S) -> S {
        self.start + (self.end - self.start) * s
    }
}

/// Longest delay, in steps.
pub const LONGEST_DELAY: usize = 255;

/// What input effects remember of the torque: past steps, and the state of the lag.
#[derive(Debug, Clone, Copy)]
pub struct TorqueHistory<S> {
    past: [Ramp<S>; LONGEST_DELAY + 1],
    next: usize,
    lag: S,
}

impl<S: Scalar> Default for TorqueHistory<S> {
    fn default() -> Self {
        Self { past: [Ramp::default(); LONGEST_DELAY + 1], next: 0, lag: S::default() }
    }
}

impl<S: Scalar> TorqueHistory<S> {
    /// A history in which the torque has always been `torque`.
    #[must_use]
    pub fn settled(torque: S) -> Self {
        Self { past: [Ramp::held(torque); LONGEST_DELAY + 1], next: 0, lag: torque }
    }

    fn ago(&self, steps: usize) -> &Ramp<S> {
        &self.past[(self.next + self.past.len() - 1 - steps.min(LONGEST_DELAY)) % self.past.len()]
    }
}

/// A wrong torque constant: `T = gain*command`.
pub struct TorqueGain;

impl Input for TorqueGain {
    const INFO: EffectInfo = EffectInfo {
        id: "torque_gain",
        place: Place::Input,
        family: Family::Parameters,
        title: "A wrong torque constant",
        equation: "T = gain*command",
        reference: "Paper, section 2: T enters eq. 2 with gain one",
        parameters: &[ParameterInfo {
            off: 1.0,
            ..ParameterInfo::size("gain", "1", -1e3, 1e3, "Torque per torque commanded")
        }],
        memory: 0,
    };

    fn transform<S: Scalar>(p: &[S], ramp: Ramp<S>, _h: S, _history: &mut TorqueHistory<S>) -> Ramp<S> {
        Ramp { start: ramp.start * p[0], end: ramp.end * p[0] }
    }
}

/// The drive's torque limit.
pub struct Saturation;

impl Input for Saturation {
    const INFO: EffectInfo = EffectInfo {
        id: "saturation",
        place: Place::Input,
        family: Family::Saturation,
        title: "The drive's torque limit",
        equation: "T = min(max(command, -limit), limit)",
        reference: "Hippe, Windup in Control, 2006, chapter 1",
        parameters: &[ParameterInfo {
            off: 1e9,
            ..ParameterInfo::size("limit", "N.m", 0.0, 1e9, "Largest torque; 1e9 means none")
        }],
        memory: 0,
    };

    fn transform<S: Scalar>(p: &[S], ramp: Ramp<S>, _h: S, _history: &mut TorqueHistory<S>) -> Ramp<S> {
        let limit = p[0];
        let clip = |t: S| {
            if t.re() > limit.re() {
                limit
            } else if t.re() < -limit.re() {
                -limit
            } else {
                t
            }
        };
        Ramp { start: clip(ramp.start), end: clip(ramp.end) }
    }
}

/// Transport delay, in fractions of a step too.
pub struct Delay;

impl Input for Delay {
    const INFO: EffectInfo = EffectInfo {
        id: "delay",
        place: Place::Input,
        family: Family::Delay,
        title: "Transport delay between command and torque: bus cycles, computation",
        equation: "T(t) = command(t - time)",
        reference: "Astrom, Wittenmark, Computer-Controlled Systems, 1997, section 2.5",
        parameters: &[ParameterInfo::size("time", "s", 0.0, 10.0, "Delay").nominal(1e-3)],
        memory: 0,
    };

    fn transform<S: Scalar>(p: &[S], ramp: Ramp<S>, h: S, history: &mut TorqueHistory<S>) -> Ramp<S> {
        history.past[history.next] = ramp;
        history.next = (history.next + 1) % history.past.len();
        let steps = p[0] / h;
        let whole = steps.re().max(0.0).floor().min(LONGEST_DELAY as f64 - 1.0);
        // Share of this step that still belongs to the older of the two commands.
        let f = steps - whole;
        let (old, new) = (history.ago(whole as usize + 1), history.ago(whole as usize));
        let one = S::from(1.0);
        let rest = one - f;
        // Old on [0, f]: from old.at(1 - f) to old.end; new on [f, 1]: from new.start to new.at(1 - f).
        let (oa, ob, na, nb) = (old.at(rest), old.end, new.start, new.at(rest));
        let m0 = f * (oa + ob) * 0.5 + rest * (na + nb) * 0.5;
        // First moment of a ramp a..b on [s, s + w]: w*(s*(a + b)/2 + w*(a/6 + b/3)).
        let m1 = f * f * (oa * (1.0 / 6.0) + ob * (1.0 / 3.0))
            + rest * (f * (na + nb) * 0.5 + rest * (na * (1.0 / 6.0) + nb * (1.0 / 3.0)));
        Ramp::from_moments(m0, m1)
    }
}

/// First-order lag of the current loop.
pub struct ActuatorLag;

impl Input for ActuatorLag {
    const INFO: EffectInfo = EffectInfo {
        id: "actuator_lag",
        place: Place::Input,
        family: Family::ActuatorLag,
        title: "First-order lag of the drive's current loop",
        equation: "time_constant*T' = command - T",
        reference: "Schroder, Elektrische Antriebe 2, section 15.5 (equivalent lag of the current loop)",
        parameters: &[ParameterInfo::size("time_constant", "s", 0.0, 10.0, "Time constant of the lag").nominal(1e-3)],
        memory: 0,
    };

    fn transform<S: Scalar>(p: &[S], ramp: Ramp<S>, h: S, history: &mut TorqueHistory<S>) -> Ramp<S> {
        // In units of the step: x = h/tau; the lag's answer to the ramp c + g*s is c + g*(s - 1/x) + A*exp(-x*s).
        let tau = p[0] / h;
        if tau.re() < 1e-3 {
            // Far below the step: mean and moment to first order in tau.
            let g = ramp.end - ramp.start;
            let jump = history.lag - ramp.start + tau * g;
            let m0 = (ramp.start + ramp.end) * 0.5 - tau * g + jump * tau;
            let m1 = ramp.start * (1.0 / 6.0) + ramp.end * (1.0 / 3.0) - tau * g * 0.5;
            history.lag = ramp.end - tau * g;
            return Ramp::from_moments(m0, m1);
        }
        let g = ramp.end - ramp.start;
        let settled = ramp.start - tau * g;
        let a = history.lag - settled;
        let decay = (S::from(-1.0) / tau).exp();
        let gone = S::from(1.0) - decay;
        let m0 = settled + g * 0.5 + a * tau * gone;
        let m1 = settled * 0.5 + g * (1.0 / 3.0) + a * tau * (tau * gone - decay);
        history.lag = settled + g + a * decay;
        Ramp::from_moments(m0, m1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_delay_of_a_whole_number_of_steps_shifts_the_torque() {
        let mut h = TorqueHistory::default();
        let out: Vec<f64> =
            (0..6).map(|k| Delay::transform(&[2e-3], Ramp::held(f64::from(k)), 1e-3, &mut h).start).collect();
        assert_eq!(out, [0.0, 0.0, 0.0, 1.0, 2.0, 3.0]);
    }

    #[test]
    fn a_fractional_delay_keeps_mean_and_first_moment_of_the_held_torque() {
        let mut h = TorqueHistory::default();
        let _ = Delay::transform(&[0.3e-3], Ramp::held(1.0), 1e-3, &mut h);
        let r = Delay::transform(&[0.3e-3], Ramp::held(2.0), 1e-3, &mut h);
        // Waveform: 1 on [0, 0.3], 2 on [0.3, 1]: mean 1.7, first moment 0.045 + 0.91.
        assert!(((r.start + r.end) / 2.0 - 1.7).abs() < 1e-14);
        assert!((r.start / 6.0 + r.end / 3.0 - 0.955).abs() < 1e-14);
    }

    #[test]
    fn a_lag_answers_a_step_as_an_exponential() {
        let (tau, h) = (3e-3_f64, 1e-3_f64);
        let mut history = TorqueHistory::default();
        for _ in 0..5 {
            let _ = ActuatorLag::transform(&[tau], Ramp::held(1.0), h, &mut history);
        }
        assert!((history.lag - (1.0 - (-5.0 * h / tau).exp())).abs() < 1e-14);
        // Mean over the sixth step by the closed form.
        let r = ActuatorLag::transform(&[tau], Ramp::held(1.0), h, &mut history);
        let mean = 1.0 - tau / h * ((-5.0 * h / tau).exp() - (-6.0 * h / tau).exp());
        assert!(((r.start + r.end) / 2.0 - mean).abs() < 1e-14);
    }
}
