//! Effects on the torque's way in: gain, limit, delay, lag.
//!
//! Over a step the torque is a [`Ramp`]. Where the true waveform is none (a held torque that jumps inside the step, an
//! exponential), the ramp has its mean and its first moment: the velocity and the position it gives a free inertia at
//! the end of the step are then exact, and the response is smooth in the delay and in the time constant.

use super::family::Family;
use super::info::{EffectInfo, ParameterInfo, Place, Scale, Start, Variant};
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

    /// The same without derivatives.
    #[must_use]
    #[inline]
    pub fn primal(&self) -> Ramp<f64> {
        Ramp { start: self.start.re(), end: self.end.re() }
    }

    /// The ramp of mean `m0` and first moment `m1` (both over a step of unit length).
    pub fn from_moments(m0: S, m1: S) -> Self {
        Self { start: m0 * 4.0 - m1 * 6.0, end: m1 * 6.0 - m0 * 2.0 }
    }

    /// The torque at the share `s` of the step.
    pub(crate) fn at(&self, s: S) -> S {
        self.start + (self.end - self.start) * s
    }
}

/// Longest delay, in steps.
pub const LONGEST_DELAY: usize = 255;

/// What input effects remember of the torque: past steps with their lengths, and the state of the lag.
#[derive(Debug, Clone, Copy)]
pub struct TorqueHistory<S> {
    past: [Ramp<S>; LONGEST_DELAY + 1],
    /// Length of each step, s; infinite where nothing has been recorded yet.
    lengths: [f64; LONGEST_DELAY + 1],
    next: usize,
    /// Newest steps that share one length.
    uniform: usize,
    /// Steps recorded.
    recorded: usize,
    lag: S,
}

impl<S: Scalar> Default for TorqueHistory<S> {
    fn default() -> Self {
        Self::constant(S::default())
    }
}

impl<S: Scalar> TorqueHistory<S> {
    /// A history in which the torque has always been `torque`.
    #[must_use]
    pub fn constant(torque: S) -> Self {
        Self {
            past: [Ramp::held(torque); LONGEST_DELAY + 1],
            lengths: [f64::INFINITY; LONGEST_DELAY + 1],
            next: 0,
            uniform: 0,
            recorded: 0,
            lag: torque,
        }
    }

    #[allow(clippy::float_cmp, reason = "equal lengths are the same number, not a measurement")]
    fn push(&mut self, ramp: Ramp<S>, h: f64) {
        let size = self.past.len();
        let same = self.lengths[(self.next + size - 1) % size] == h;
        self.uniform = if same { (self.uniform + 1).min(size) } else { 1 };
        self.recorded = (self.recorded + 1).min(size);
        self.past[self.next] = ramp;
        self.lengths[self.next] = h;
        self.next = (self.next + 1) % size;
    }

    fn index(&self, steps: usize) -> usize {
        (self.next + self.past.len() - 1 - steps.min(LONGEST_DELAY)) % self.past.len()
    }

    fn ago(&self, steps: usize) -> &Ramp<S> {
        &self.past[self.index(steps)]
    }

    /// Whether a delay of `delay` s before a step of `h` s still lies inside what is remembered.
    #[must_use]
    pub fn covers(&self, delay: f64, h: f64) -> bool {
        if self.uniform == self.recorded {
            // Equal steps so far: a delay that equal steps to come cannot cover is refused at once.
            return delay <= LONGEST_DELAY as f64 * h;
        }
        if self.recorded < LONGEST_DELAY {
            return true;
        }
        // The step to come pushes the oldest out.
        let mut length = h;
        for k in 0..LONGEST_DELAY {
            length += self.lengths[self.index(k)];
            if length >= delay + h {
                return true;
            }
        }
        false
    }

    /// The torque `delay` s ago, after any jump there, seen from the end of the newest step.
    fn value(&self, delay: f64) -> f64 {
        let mut left = delay;
        for k in 0..=LONGEST_DELAY {
            let (i, length) = (self.index(k), self.lengths[self.index(k)]);
            if left <= length {
                let share = if length.is_finite() { 1.0 - left / length } else { 1.0 };
                let ramp = &self.past[i];
                return ramp.start.re() + (ramp.end.re() - ramp.start.re()) * share;
            }
            left -= length;
        }
        self.ago(LONGEST_DELAY).start.re()
    }

    /// The delayed torque over the newest step, when the steps had different lengths: mean and first moment, piece by
    /// piece.
    fn delayed(&self, delay: S, h: f64) -> Ramp<S> {
        let (from, to) = (-delay, S::from(h) - delay);
        let (mut m0, mut m1) = (S::default(), S::default());
        let mut end = S::from(h);
        for k in 0..=LONGEST_DELAY {
            let i = self.index(k);
            let (ramp, length) = (&self.past[i], self.lengths[i]);
            let last = k == LONGEST_DELAY || !length.is_finite();
            let start = if last { from } else { end - length };
            if start.re() < to.re() {
                let a = if start.re() > from.re() { start } else { from };
                let b = if end.re() < to.re() { end } else { to };
                let at = |t: S| if last { ramp.end } else { ramp.at((t - start) / length) };
                let (va, vb) = (at(a), at(b));
                let (s, w) = ((a + delay) / h, (b - a) / h);
                m0 += w * (va + vb) * 0.5;
                m1 += w * (s * (va + vb) * 0.5 + w * (va * (1.0 / 6.0) + vb * (1.0 / 3.0)));
            }
            if start.re() <= from.re() {
                break;
            }
            end = start;
        }
        Ramp::from_moments(m0, m1)
    }
}

impl TorqueHistory<f64> {
    /// Calls `visit` on every number of the history, which it may change: a stored state is written and read by this function alone.
    pub fn visit_numbers(&mut self, visit: &mut impl FnMut(&mut f64)) {
        for (ramp, length) in self.past.iter_mut().zip(&mut self.lengths) {
            visit(&mut ramp.start);
            visit(&mut ramp.end);
            visit(length);
        }
        visit(&mut self.lag);
        let size = self.past.len();
        for (count, most) in [(&mut self.next, size - 1), (&mut self.uniform, size), (&mut self.recorded, size)] {
            let mut value = *count as f64;
            visit(&mut value);
            *count = (value.max(0.0) as usize).min(most);
        }
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
        signature: "r1 proportional to the command; as if I1, I2, B and K were all off by one factor",
        reference: "Paper, section 2: T enters eq. 2 with gain one",
        parameters: &[ParameterInfo {
            off: 1.0,
            ..ParameterInfo::size("gain", "1", -1e3, 1e3, "Torque per torque commanded")
        }],
        memory: 0,
        named: false,
        textbook: false,
        odds: 1.0,
        bounds: |_, _| true,
        example: &[1.2],
        variants: &[Variant { name: "", free: &[0] }],
    };
    const GAIN: Option<usize> = Some(0);

    fn transform<S: Scalar>(p: &[S], ramp: Ramp<S>, _h: S, _history: &mut TorqueHistory<S>) -> Ramp<S> {
        Ramp { start: ramp.start * p[0], end: ramp.end * p[0] }
    }

    fn now<S: Scalar>(p: &[S], torque: S, _history: &TorqueHistory<f64>) -> S {
        torque * p[0]
    }
}

fn clip<S: Scalar>(torque: S, limit: S) -> S {
    if torque.re() > limit.re() {
        limit
    } else if torque.re() < -limit.re() {
        -limit
    } else {
        torque
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
        signature: "r1 only where the command passes a level; odd lines; grows with the amplitude",
        reference: "Hippe, Windup in Control, 2006, chapter 1",
        parameters: &[ParameterInfo {
            off: 1e9,
            start: Start::Grid(Scale::Torque, &[0.35, 0.45, 0.55, 0.65, 0.75, 0.85, 0.95]),
            ..ParameterInfo::size("limit", "N.m", 0.0, 1e9, "Largest torque; 1e9 means none")
        }],
        memory: 0,
        named: true,
        textbook: false,
        odds: 0.1,
        bounds: |p, x| x.limits(p[0]),
        example: &[0.02],
        variants: &[Variant { name: "", free: &[0] }],
    };
    const BENDS: bool = true;

    fn transform<S: Scalar>(p: &[S], ramp: Ramp<S>, _h: S, _history: &mut TorqueHistory<S>) -> Ramp<S> {
        Ramp { start: clip(ramp.start, p[0]), end: clip(ramp.end, p[0]) }
    }

    fn now<S: Scalar>(p: &[S], torque: S, _history: &TorqueHistory<f64>) -> S {
        clip(torque, p[0])
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
        signature: "r1 with the rate of the command; linear; phase grows in proportion to frequency, gain stays",
        reference: "Astrom, Wittenmark, Computer-Controlled Systems, 1997, section 2.5",
        parameters: &[ParameterInfo::size("time", "s", 0.0, 10.0, "Delay")
            .nominal(1e-3)
            .start(Start::Grid(Scale::Sample, &[0.3, 1.0, 3.0, 10.0]))],
        memory: 0,
        named: true,
        textbook: false,
        odds: 1.0,
        bounds: |p, x| x.is_some_samples(p[0]) && x.turns_phase(p[0]),
        example: &[2.3e-3],
        variants: &[Variant { name: "", free: &[0] }],
    };
    const DELAY: Option<usize> = Some(0);

    fn transform<S: Scalar>(p: &[S], ramp: Ramp<S>, h: S, history: &mut TorqueHistory<S>) -> Ramp<S> {
        history.push(ramp, h.re());
        let steps = p[0] / h;
        let whole = steps.re().max(0.0).floor().min(LONGEST_DELAY as f64 - 1.0);
        if history.uniform < history.recorded && history.uniform < whole as usize + 2 {
            return history.delayed(p[0], h.re());
        }
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

    fn now<S: Scalar>(p: &[S], torque: S, history: &TorqueHistory<f64>) -> S {
        if p[0].re() > 0.0 { S::from(history.value(p[0].re())) } else { torque }
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
        signature: "r1 with the rate of the command; linear; gain falls and phase bends with frequency",
        reference: "Schroder, Elektrische Antriebe 2, section 15.5 (equivalent lag of the current loop)",
        parameters: &[ParameterInfo::size("time_constant", "s", 0.0, 10.0, "Time constant of the lag")
            .nominal(1e-3)
            .start(Start::Grid(Scale::Sample, &[0.3, 1.0, 3.0, 10.0]))],
        memory: 0,
        named: true,
        textbook: false,
        // Every bus shifts a log's torque in time; few logs show a lag in addition to that.
        odds: 0.2,
        bounds: |p, x| x.passes_the_band(p[0]) && x.turns_phase(p[0]),
        example: &[3e-3],
        variants: &[Variant { name: "", free: &[0] }],
    };

    fn transform<S: Scalar>(p: &[S], ramp: Ramp<S>, h: S, history: &mut TorqueHistory<S>) -> Ramp<S> {
        // In units of the step: x = h/tau; the lag's response to the ramp c + g*s is c + g*(s - 1/x) + A*exp(-x*s).
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
        let steady = ramp.start - tau * g;
        let a = history.lag - steady;
        let decay = (S::from(-1.0) / tau).exp();
        let rise = S::from(1.0) - decay;
        let m0 = steady + g * 0.5 + a * tau * rise;
        let m1 = steady * 0.5 + g * (1.0 / 3.0) + a * tau * (tau * rise - decay);
        history.lag = steady + g + a * decay;
        Ramp::from_moments(m0, m1)
    }

    fn now<S: Scalar>(p: &[S], torque: S, history: &TorqueHistory<f64>) -> S {
        if p[0].re() > 0.0 { S::from(history.lag) } else { torque }
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

    #[test]
    fn a_delay_over_steps_of_many_lengths_keeps_mean_and_first_moment() {
        // The same held torque, 1 up to t = 2 and 3 after, cut into steps in two ways; the last step is [2.4, 3.4].
        let run = |cuts: &[f64]| {
            let mut history = TorqueHistory::default();
            let mut from = 0.0;
            for &to in cuts {
                let ramp = Ramp::held(if from < 2.0 { 1.0 } else { 3.0 });
                let _ = Delay::transform(&[0.7], ramp, to - from, &mut history);
                from = to;
            }
            Delay::transform(&[0.7], Ramp::held(3.0), 1.0, &mut history)
        };
        let r = run(&[1.0, 2.0, 2.1, 2.4]);
        // Delayed by 0.7 the jump lies at 2.7, at 0.3 of the step: mean 0.3 + 2.1, first moment 0.045 + 3*0.455.
        assert!(((r.start + r.end) / 2.0 - 2.4).abs() < 1e-14, "{r:?}");
        assert!((r.start / 6.0 + r.end / 3.0 - 1.41).abs() < 1e-14, "{r:?}");
        let other = run(&[0.25, 1.3, 1.9, 2.0, 2.4]);
        assert!((r.start - other.start).abs() < 1e-13 && (r.end - other.end).abs() < 1e-13);
    }

    #[test]
    fn the_general_delay_equals_the_one_for_equal_steps() {
        let mut history = TorqueHistory::default();
        for k in 0..20 {
            let ramp = Ramp { start: f64::from(k).sin(), end: f64::from(k).cos() };
            let fast = Delay::transform(&[3.4e-3], ramp, 1e-3, &mut history);
            let slow = history.delayed(3.4e-3, 1e-3);
            assert!((fast.start - slow.start).abs() < 1e-12 && (fast.end - slow.end).abs() < 1e-12, "{k}");
        }
        assert!(history.covers(0.2, 1e-3));
        for _ in 0..300 {
            let _ = Delay::transform(&[3.4e-3], Ramp::held(1.0), 1e-3, &mut history);
        }
        assert!(history.covers(0.25, 1e-3) && !history.covers(0.26, 1e-3));
    }
}
