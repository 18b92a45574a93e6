//! Effects on the positions' way out: what the measurement does, not the machine.

use super::family::Family;
use super::info::{EffectInfo, ParameterInfo, Place, Scale, Start, Variant};
use super::shapes::{Sensor, mean_decay};
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

/// The motion of the last samples, newest last, behind the filter of the encoders if there is one.
#[derive(Debug, Clone, Copy)]
pub struct SensorHistory<S> {
    past: [Reading<S>; LONGEST],
    /// Time from the sample before to each sample, s.
    gaps: [f64; LONGEST],
    newest: usize,
    /// Newest samples that share one gap.
    uniform: usize,
    /// Samples since the history began.
    recorded: usize,
    /// The motion at the newest sample, before the filter.
    motion: Reading<S>,
}

impl<S: Scalar> SensorHistory<S> {
    /// A history in which the axis has coasted up to `motion` at its present speed, sampled every `dt` seconds; `filter` is
    /// the encoders' time constant, s.
    #[must_use]
    pub(super) fn coasting(motion: Reading<S>, dt: f64, filter: S) -> Self {
        let mut past = [motion; LONGEST];
        for (k, slot) in past.iter_mut().enumerate() {
            let ago = filter + (LONGEST - 1 - k) as f64 * dt;
            slot.theta1 = motion.theta1 - motion.omega1 * ago;
            slot.theta2 = motion.theta2 - motion.omega2 * ago;
        }
        Self { past, gaps: [dt; LONGEST], newest: LONGEST - 1, uniform: LONGEST, recorded: 0, motion }
    }

    /// Time from the sample before to the newest, s.
    pub(super) fn gap(&self) -> f64 {
        self.gaps[self.newest]
    }

    /// Appends the motion `gap` seconds after the last sample, through a filter of that time constant.
    #[allow(clippy::float_cmp, reason = "equal gaps are the same number, not a measurement")]
    pub(super) fn push(&mut self, motion: Reading<S>, gap: f64, filter: S) {
        let reading = if filter.re() == 0.0 && !S::HAS_DERIVATIVES {
            motion
        } else {
            let (was, last) = (self.motion, self.past[self.newest]);
            let (theta1, omega1) =
                filtered(filter, gap, [(was.theta1, was.omega1), (motion.theta1, motion.omega1)], last.omega1);
            let (theta2, omega2) =
                filtered(filter, gap, [(was.theta2, was.omega2), (motion.theta2, motion.omega2)], last.omega2);
            Reading { theta1, omega1, theta2, omega2 }
        };
        self.motion = motion;
        self.recorded = (self.recorded + 1).min(LONGEST);
        self.uniform = if self.gaps[self.newest] == gap { (self.uniform + 1).min(LONGEST) } else { 1 };
        self.newest = (self.newest + 1) % LONGEST;
        self.past[self.newest] = reading;
        self.gaps[self.newest] = gap;
    }

    /// The motion at the newest sample.
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

    /// Where the motion `delay` seconds ago lies, `dt` the time between samples where that is one.
    fn ago(&self, delay: S, dt: f64) -> Instant<'_, S> {
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
        if k >= self.recorded {
            // Before the history: exactly the speed at which it began.
            let age: f64 = (0..self.recorded).map(|k| self.gaps[self.index(k)]).sum();
            return Instant::Coasting { from: &self.past[self.index(self.recorded)], time: S::from(age) - delay };
        }
        Instant::Between { before: &self.past[self.index(k + 1)], after: &self.past[self.index(k)], s, gap }
    }
}

/// An instant of a motion known at samples.
enum Instant<'a, S> {
    /// Between two samples: `s` 0 at `before`, 1 at `after`, which comes `gap` seconds later.
    Between { before: &'a Reading<S>, after: &'a Reading<S>, s: S, gap: f64 },
    /// `time` seconds after a sample, or before it, at its speed.
    Coasting { from: &'a Reading<S>, time: S },
}

impl<S: Scalar> Instant<'_, S> {
    /// Angle and speed there, by cubic Hermite interpolation of one encoder.
    fn of(&self, encoder: impl Fn(&Reading<S>) -> (S, S)) -> (S, S) {
        let (before, after, s, gap) = match *self {
            Self::Between { before, after, s, gap } => (before, after, s, gap),
            Self::Coasting { from, time } => {
                let (theta, omega) = encoder(from);
                return (theta + omega * time, omega);
            }
        };
        let ((x0, v0), (x1, v1)) = (encoder(before), encoder(after));
        let (rise, v0, v1) = (x1 - x0, v0 * gap, v1 * gap);
        // x0 + v0*s + (3*rise - 2*v0 - v1)*s^2 + (v0 + v1 - 2*rise)*s^3
        let c2 = rise * 3.0 - v0 * 2.0 - v1;
        let c3 = v0 + v1 - rise * 2.0;
        let theta = x0 + s * (v0 + s * (c2 + s * c3));
        let omega = (v0 + s * (c2 * 2.0 + s * c3 * 3.0)) / gap;
        (theta, omega)
    }
}

/// The motor's encoder.
fn motor<S: Scalar>(r: &Reading<S>) -> (S, S) {
    (r.theta1, r.omega1)
}

/// The table's encoder.
fn table<S: Scalar>(r: &Reading<S>) -> (S, S) {
    (r.theta2, r.omega2)
}

/// Angle and speed behind a first-order filter of time constant `filter`, `gap` s after it gave the speed `lagged`; the
/// motion was at the first angle and speed then, and is at the second now.
///
/// The filtered speed `l` obeys `filter*l' = omega - l`, and the filtered angle is `theta - filter*l`. Between the samples
/// the speed is the quadratic through both ends whose mean is the angle's rise over `gap`, and the response to that is exact.
fn filtered<S: Scalar>(filter: S, gap: f64, motion: [(S, S); 2], lagged: S) -> (S, S) {
    let [(from, v0), (to, v1)] = motion;
    let lag = if filter.re() > 0.0 {
        let x = S::from(gap) / filter;
        let one = S::from(1.0);
        let (decay, mean) = ((-x).exp(), mean_decay(x));
        // v0 + rise*s + bow*(s^2 - s): the mean of s^2 - s is -1/6.
        let rise = v1 - v0;
        let bow = (v0 + rise * 0.5 - (to - from) / gap) * 6.0;
        decay * lagged + v0 * (one - decay) + rise * (one - mean) + bow * (mean - (one - mean) * 2.0 / x)
    } else {
        v1
    };
    (to - filter * lag, lag)
}

/// The motion as the encoders see it: at an instant `late` seconds before the newest sample, or after it.
#[derive(Debug, Clone, Copy)]
pub struct Seen<'a, S> {
    pub(super) history: &'a SensorHistory<S>,
    pub(super) dt: f64,
    pub(super) late: S,
}

impl<S: Scalar> Seen<'_, S> {
    /// What both encoders read.
    pub(super) fn reading(&self) -> Reading<S> {
        if self.late.re() == 0.0 && !S::HAS_DERIVATIVES {
            return self.history.now();
        }
        let at = self.at(self.late);
        let ((theta1, omega1), (theta2, omega2)) = (at.of(motor), at.of(table));
        Reading { theta1, omega1, theta2, omega2 }
    }

    /// Angle and speed of the table side `delay` seconds before that instant.
    fn table(&self, delay: S) -> (S, S) {
        self.at(self.late + delay).of(table)
    }

    /// The instant `ago` seconds before the newest sample; after it nothing is known, and the axis coasts.
    fn at(&self, ago: S) -> Instant<'_, S> {
        let history = self.history;
        if ago.re() < 0.0 {
            return Instant::Coasting { from: &history.past[history.newest], time: -ago };
        }
        history.ago(ago, self.dt)
    }
}

impl SensorHistory<f64> {
    /// Calls `visit` on every number of the history, which it may change: a stored state is written and read by this function alone.
    pub fn visit_numbers(&mut self, visit: &mut impl FnMut(&mut f64)) {
        for r in self.past.iter_mut().chain([&mut self.motion]) {
            [&mut r.theta1, &mut r.omega1, &mut r.theta2, &mut r.omega2].into_iter().for_each(&mut *visit);
        }
        self.gaps.iter_mut().for_each(&mut *visit);
        let counts = [(&mut self.newest, LONGEST - 1), (&mut self.uniform, LONGEST), (&mut self.recorded, LONGEST)];
        for (count, most) in counts {
            let mut value = *count as f64;
            visit(&mut value);
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
        named: true,
        textbook: false,
        odds: 1.0,
        bounds: |p, x| x.is_some_samples(p[0]),
        example: &[2.3e-3],
        variants: &[Variant { name: "", free: &[0] }],
    };
    const DELAY: Option<usize> = Some(0);

    fn transform<S: Scalar>(p: &[S], reading: Reading<S>, seen: &Seen<'_, S>) -> Reading<S> {
        let (theta2, omega2) = seen.table(p[0]);
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
        named: true,
        textbook: false,
        odds: 1.0,
        // More than a tenth is another gear or another sensor.
        bounds: |p, x| p[0].abs() <= 0.1 && (p[1] == 0.0 || p[1].abs() <= 0.1 * x.travel() && x.turns(p[2])),
        example: &[0.01, 0.02, 2.0, 0.5],
        variants: &[
            Variant { name: "scale", free: &[0] },
            Variant { name: "periodic", free: &[1, 2, 3] },
            Variant { name: "scale and periodic", free: &[0, 1, 2, 3] },
        ],
    };

    fn transform<S: Scalar>(p: &[S], r: Reading<S>, _seen: &Seen<'_, S>) -> Reading<S> {
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
        named: false,
        textbook: false,
        odds: 1.0,
        bounds: |_, _| true,
        example: &[0.01],
        variants: &[Variant { name: "", free: &[0] }],
    };

    const STEP: Option<usize> = Some(0);
    const MOTOR: bool = true;

    fn transform<S: Scalar>(p: &[S], r: Reading<S>, _seen: &Seen<'_, S>) -> Reading<S> {
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
        let mut history = SensorHistory::coasting(at(0.0), 0.1, 0.0);
        let mut t = 0.0;
        for k in 0..30 {
            let gap = [0.1, 0.03, 0.07][k % 3];
            t += gap;
            history.push(at(t), gap, 0.0);
        }
        for delay in [0.0, 0.05, 0.1, 0.234, 1.0] {
            let (theta, omega) = history.ago(delay, 0.1).of(table);
            let want = at(t - delay);
            assert!((theta - want.theta2).abs() < 1e-12 && (omega - want.omega2).abs() < 1e-11, "{delay}");
        }
    }
}
