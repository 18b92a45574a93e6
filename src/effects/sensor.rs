//! Effects on the positions' way out: what the measurement does, not the machine.

use super::info::{EffectInfo, Family, ParameterInfo, Place, Scale, Start, Variant};
use super::shapes::Sensor;
use crate::scalar::Scalar;

/// What the encoders read.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Reading<S> {
    /// Angle of the motor, rad.
    pub theta1: S,
    /// Speed of the motor, rad/s.
    pub omega1: S,
    /// Angle of the table side, rad.
    pub theta2: S,
    /// Speed of the table side, rad/s.
    pub omega2: S,
}

/// Longest look back, in samples.
const LONGEST: usize = 128;

/// The motion of the last samples, newest last.
#[derive(Debug, Clone, Copy)]
pub struct SensorHistory<S> {
    past: [Reading<S>; LONGEST],
    /// Time from the sample before to each sample, s.
    gaps: [f64; LONGEST],
    newest: usize,
    /// Newest samples that share one gap.
    uniform: usize,
}

impl<S: Scalar> SensorHistory<S> {
    /// A history in which the axis has coasted up to `reading` at its present speed, sampled every `dt` seconds.
    #[must_use]
    pub fn settled(reading: Reading<S>, dt: f64) -> Self {
        let mut past = [reading; LONGEST];
        for (k, slot) in past.iter_mut().enumerate() {
            let ago = (LONGEST - 1 - k) as f64 * dt;
            slot.theta1 = reading.theta1 - reading.omega1 * ago;
            slot.theta2 = reading.theta2 - reading.omega2 * ago;
        }
        Self { past, gaps: [dt; LONGEST], newest: LONGEST - 1, uniform: LONGEST }
    }

    /// Appends the motion of the next sample, as long after the last one as that after its own.
    pub fn push(&mut self, reading: Reading<S>) {
        self.push_after(reading, self.gaps[self.newest]);
    }

    /// Appends the motion `gap` seconds after the last sample.
    #[allow(clippy::float_cmp, reason = "equal gaps are the same number, not a measurement")]
    pub fn push_after(&mut self, reading: Reading<S>, gap: f64) {
        self.uniform = if self.gaps[self.newest] == gap { (self.uniform + 1).min(LONGEST) } else { 1 };
        self.newest = (self.newest + 1) % LONGEST;
        self.past[self.newest] = reading;
        self.gaps[self.newest] = gap;
    }

    /// The motion now.
    #[must_use]
    pub fn now(&self) -> Reading<S> {
        self.past[self.newest]
    }

    fn index(&self, samples: usize) -> usize {
        (self.newest + LONGEST - samples.min(LONGEST - 1)) % LONGEST
    }

    /// Whether the motion `delay` seconds ago is still remembered.
    #[must_use]
    pub fn covers(&self, delay: f64) -> bool {
        let mut length = 0.0;
        (0..LONGEST - 1).any(|k| {
            length += self.gaps[self.index(k)];
            length >= delay
        })
    }

    /// Angle and speed of the table side `delay` seconds ago, by cubic Hermite interpolation between samples.
    fn table_at(&self, delay: S, dt: f64) -> (S, S) {
        // The samples around it, how long before the later one, and the time between them.
        let steps = delay / dt;
        let whole = steps.re().max(0.0).floor().min((LONGEST - 2) as f64);
        let (mut k, mut s, mut gap) = (whole as usize, S::from(1.0) - (steps - whole), dt);
        #[allow(clippy::float_cmp, reason = "equal gaps are the same number, not a measurement")]
        let equal = self.uniform >= (k + 1).min(LONGEST) && self.gaps[self.newest] == dt;
        if !equal {
            let mut left = delay;
            k = 0;
            gap = self.gaps[self.index(0)];
            while left.re() > gap && k < LONGEST - 2 {
                left = left - gap;
                k += 1;
                gap = self.gaps[self.index(k)];
            }
            s = S::from(1.0) - left / gap;
        }
        let (after, before) = (&self.past[self.index(k)], &self.past[self.index(k + 1)]);
        // s = 0 at `before`, 1 at `after`.
        let rise = after.theta2 - before.theta2;
        let (v0, v1) = (before.omega2 * gap, after.omega2 * gap);
        // before + v0*s + (3*rise - 2*v0 - v1)*s^2 + (v0 + v1 - 2*rise)*s^3
        let c2 = rise * 3.0 - v0 * 2.0 - v1;
        let c3 = v0 + v1 - rise * 2.0;
        let theta = before.theta2 + s * (v0 + s * (c2 + s * c3));
        let omega = (v0 + s * (c2 * 2.0 + s * c3 * 3.0)) / gap;
        (theta, omega)
    }
}

impl SensorHistory<f64> {
    /// Hands every number of the history to `word`, which may change it: the one way in and out of a stored state.
    pub(crate) fn words(&mut self, word: &mut impl FnMut(&mut f64)) {
        for (r, gap) in self.past.iter_mut().zip(&mut self.gaps) {
            for value in [&mut r.theta1, &mut r.omega1, &mut r.theta2, &mut r.omega2, gap] {
                word(value);
            }
        }
        for (count, most) in [(&mut self.newest, LONGEST - 1), (&mut self.uniform, LONGEST)] {
            let mut value = *count as f64;
            word(&mut value);
            *count = (value.max(0.0) as usize).min(most);
        }
    }
}

/// Delay of the table's encoder against the motor's.
pub struct SensorDelay;

impl Sensor for SensorDelay {
    const INFO: EffectInfo = EffectInfo {
        id: "sensor_delay",
        place: Place::Sensor,
        family: Family::Sensor,
        title: "The table's encoder is read late",
        equation: "theta2 read at t is theta2(t - time)",
        signature: "r1 and r2 agree with no torque: theta2 late by the same time at every frequency",
        reference: "A delay of both encoders is one of the input; only their difference is a sensor's own",
        parameters: &[ParameterInfo::size("time", "s", 0.0, 10.0, "Delay of the reading")
            .nominal(1e-3)
            .start(Start::Grid(Scale::Sample, &[0.3, 1.0, 3.0]))],
        memory: 0,
        variants: &[Variant { name: "", free: &[0] }],
    };

    fn transform<S: Scalar>(p: &[S], reading: Reading<S>, history: &SensorHistory<S>, dt: f64) -> Reading<S> {
        let (theta2, omega2) = history.table_at(p[0], dt);
        Reading { theta2, omega2, ..reading }
    }
}

/// Lead error of the table's position: a wrong scale, and a part periodic in the turn.
pub struct LeadError;

impl Sensor for LeadError {
    const INFO: EffectInfo = EffectInfo {
        id: "lead_error",
        place: Place::Sensor,
        family: Family::Sensor,
        title: "The table's scale is off: in its pitch, or once or more per turn",
        equation: "theta2 read = theta2*(1 + scale) + amplitude*sin(order*theta2 + phase)",
        signature: "r1 and r2 agree with no torque: theta2 off as a function of theta2 itself",
        reference: "ISO 230-2:2014, 3.3 (systematic and periodic positioning deviation)",
        parameters: &[
            ParameterInfo::size("scale", "1", -0.9, 10.0, "Relative error of the pitch").nominal(1e-3),
            ParameterInfo::size("amplitude", "rad", -1e3, 1e3, "Amplitude of the periodic part").nominal(1e-3),
            ParameterInfo::shape("order", "1/rad", 1.0, 1e-6, 1e6, "Periods per radian of theta2")
                .start(Start::Grid(Scale::Order, &[1.0])),
            ParameterInfo::shape("phase", "rad", 0.0, -1e3, 1e3, "Phase at theta2 = 0").start(Start::Phase),
        ],
        memory: 0,
        variants: &[
            Variant { name: "scale", free: &[0] },
            Variant { name: "periodic", free: &[1, 2, 3] },
            Variant { name: "scale and periodic", free: &[0, 1, 2, 3] },
        ],
    };

    fn transform<S: Scalar>(p: &[S], r: Reading<S>, _history: &SensorHistory<S>, _dt: f64) -> Reading<S> {
        let angle = p[2] * r.theta2 + p[3];
        let theta2 = r.theta2 * (p[0] + 1.0) + p[1] * angle.sin();
        let omega2 = r.omega2 * (p[0] + 1.0 + p[1] * p[2] * angle.cos());
        Reading { theta2, omega2, ..r }
    }
}

/// Quantisation of both encoders.
pub struct EncoderQuantisation;

impl Sensor for EncoderQuantisation {
    const INFO: EffectInfo = EffectInfo {
        id: "encoder_quantisation",
        place: Place::Sensor,
        family: Family::Sensor,
        title: "The encoders count whole steps",
        equation: "theta read = step*round(theta/step)",
        signature: "no torque explains it: steps of one size in the position, white to the model",
        reference: "Widrow, Kollar, Quantization Noise, Cambridge 2008",
        parameters: &[ParameterInfo::size("step", "rad", 0.0, 1e3, "Angle of one count").nominal(1e-3)],
        memory: 0,
        variants: &[Variant { name: "", free: &[0] }],
    };

    fn transform<S: Scalar>(p: &[S], r: Reading<S>, _history: &SensorHistory<S>, _dt: f64) -> Reading<S> {
        let step = p[0].re();
        if step <= 0.0 {
            return r;
        }
        // The rounding moves by whole counts: its derivative is that of the motion, on average.
        let round = |x: S| x.chain((x.re() / step).round() * step, 1.0);
        Reading { theta1: round(r.theta1), theta2: round(r.theta2), ..r }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cubic_motion_is_read_back_exactly_over_samples_of_many_lengths() {
        // Hermite interpolation is exact for cubics.
        let at = |t: f64| Reading { theta2: t * t * t - 2.0 * t, omega2: 3.0 * t * t - 2.0, ..Reading::default() };
        let mut history = SensorHistory::settled(at(0.0), 0.1);
        let mut t = 0.0;
        for k in 0..30 {
            let gap = [0.1, 0.03, 0.07][k % 3];
            t += gap;
            history.push_after(at(t), gap);
        }
        for delay in [0.0, 0.05, 0.1, 0.234, 1.0] {
            let (theta, omega) = history.table_at(delay, 0.1);
            let want = at(t - delay);
            assert!((theta - want.theta2).abs() < 1e-12 && (omega - want.omega2).abs() < 1e-11, "{delay}");
        }
    }
}
