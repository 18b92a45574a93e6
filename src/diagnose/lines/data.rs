//! The measured response at the excited lines, and the linear axis with its linear effects there.

use std::f64::consts::TAU;

use rustfft::num_complex::Complex;

use crate::axis::{Hold, Parameters, Structure};
use crate::diagnose::model::Model;
use crate::diagnose::record::Record;
use crate::effects::{Effect, Place};
use crate::identify::frequency::{Measured, measure};
use crate::trace::{Signal, Trace};

/// A complex number.
pub type C = Complex<f64>;

/// Relative error of a response up to which a linear model of a machine is forgiven quadratically, beyond which linearly.
pub const FORGIVEN: f64 = 0.05;
/// Images of the sampling kept on each side of a line: the third one's share of a position is below `1e-3` at a tenth of
/// the sampling rate.
const IMAGES: i32 = 1;
/// Most lines used; of more, every second, third, ... is taken.
const MOST: usize = 400;
/// The signals in the order of [`Record::channels`].
const SIGNALS: [Signal; 4] = [Signal::Theta1, Signal::Omega1, Signal::Theta2, Signal::Omega2];

/// A line of the excitation.
#[derive(Debug, Clone)]
struct Line {
    /// Frequency, Hz.
    frequency: f64,
    /// Laplace variable of the line and of its images, and the hold's response there.
    drive: Vec<(C, C)>,
    /// Response measured on each channel used, and its standard deviation.
    measured: Vec<(C, f64)>,
}

/// The lines of a record.
#[derive(Debug, Clone)]
pub struct Lines {
    lines: Vec<Line>,
    /// Channels used, as in [`Record::channels`].
    pub channels: Vec<usize>,
    /// Parameters that the response itself suggests.
    pub guess: Option<Parameters>,
    /// Periods that were averaged.
    pub periods: usize,
    /// Sampling interval, s.
    pub dt: f64,
}

/// The response of every channel of a periodic record; `None` without two whole periods or an excited line.
pub fn response(record: &Record, period: usize) -> Option<Measured> {
    let mut trace = Trace::new(record.start, record.dt, record.hold).with(Signal::T, record.torque.clone()).ok()?;
    for (signal, channel) in SIGNALS.iter().zip(&record.channels) {
        if let Some(values) = channel {
            trace.set(*signal, values.clone()).ok()?;
        }
    }
    measure(&trace, period)
}

impl Lines {
    /// The lines of a measured response; the speeds only where no angle was measured: a logged speed is often a filtered
    /// difference.
    #[must_use]
    pub fn new(measured: &Measured, rho: f64) -> Self {
        let at = |signal: Signal| measured.outputs.iter().find(|o| o.0 == signal);
        let angles: Vec<usize> = [0, 2].into_iter().filter(|c| at(SIGNALS[*c]).is_some()).collect();
        let speeds = || [1, 3].into_iter().filter(|c| at(SIGNALS[*c]).is_some()).collect();
        let channels: Vec<usize> = if angles.is_empty() { speeds() } else { angles };
        let outputs: Vec<_> = channels.iter().filter_map(|c| at(SIGNALS[*c])).collect();
        let lines = measured
            .frequencies()
            .iter()
            .enumerate()
            .step_by(measured.harmonics.len().div_ceil(MOST).max(1))
            .map(|(k, &frequency)| Line {
                frequency,
                drive: drive(frequency, measured.dt, measured.hold),
                measured: outputs.iter().map(|(_, g, variance)| (g[k], variance[k].sqrt())).collect(),
            })
            .collect();
        Self { lines, channels, guess: measured.guess(rho), periods: measured.periods, dt: measured.dt }
    }

    /// Number of lines.
    #[must_use]
    pub fn len(&self) -> usize {
        self.lines.len()
    }

    /// Lowest and highest line, Hz.
    #[must_use]
    pub fn band(&self) -> [f64; 2] {
        [self.lines.first(), self.lines.last()].map(|l| l.map_or(0.0, |l| l.frequency))
    }

    /// The natural logarithm of modelled over measured response, and the relative standard deviation of the measured
    /// one: line by line, channel inside line. `None` where the model has no finite response.
    #[must_use]
    pub fn errors(&self, model: &Model) -> Option<Vec<(C, f64)>> {
        let mut out = Vec::with_capacity(self.lines.len() * self.channels.len());
        for line in &self.lines {
            let mut sum = [C::default(); 4];
            for (s, hold) in &line.drive {
                let g = transfer(model, *s);
                for (sum, g) in sum.iter_mut().zip(g) {
                    *sum += g * hold;
                }
            }
            for (channel, (g, std)) in self.channels.iter().zip(&line.measured) {
                let e = (sum[*channel] / g).ln();
                if !(e.re.is_finite() && e.im.is_finite()) {
                    return None;
                }
                out.push((e, std / g.norm()));
            }
        }
        Some(out)
    }

    /// Root mean square of the relative error over lines and channels; a line that scatters counts less.
    #[must_use]
    pub fn relative_error(&self, model: &Model) -> f64 {
        self.errors(model).map_or(f64::INFINITY, |errors| {
            let weight = |s: f64| 1.0 / (1.0 + (s / FORGIVEN).powi(2));
            let sum: f64 = errors.iter().map(|(e, s)| weight(*s) * (e.exp() - 1.0).norm_sqr()).sum();
            (sum / errors.iter().map(|(_, s)| weight(*s)).sum::<f64>()).sqrt()
        })
    }

    /// Frequency of the line with the largest error, Hz.
    #[must_use]
    pub fn worst(&self, model: &Model) -> f64 {
        let errors = self.errors(model).unwrap_or_default();
        let size =
            |k: usize| errors[k * self.channels.len()..][..self.channels.len()].iter().map(|e| e.0.norm_sqr()).sum();
        let sizes: Vec<f64> = (0..errors.len() / self.channels.len().max(1)).map(size).collect();
        let worst = (0..sizes.len()).max_by(|a, b| sizes[*a].total_cmp(&sizes[*b]));
        worst.map_or(0.0, |k| self.lines[k].frequency)
    }

    /// Squared error per value in units of the scatter from period to period.
    #[must_use]
    pub fn chi2(&self, model: &Model) -> f64 {
        self.errors(model).map_or(f64::INFINITY, |e| {
            e.iter().map(|(e, std)| e.norm_sqr() / (std * std).max(f64::MIN_POSITIVE)).sum::<f64>() / e.len() as f64
        })
    }
}

/// The Laplace variable at a line and at its images, and the hold's response there.
///
/// The samples' spectrum repeats with the sampling rate; what the hold leaves of each image moves the axis, and is folded
/// back onto the line where the readings are sampled.
fn drive(frequency: f64, dt: f64, hold: Hold) -> Vec<(C, C)> {
    (-IMAGES..=IMAGES)
        .map(|m| {
            let s = C::new(0.0, TAU * (frequency + f64::from(m) / dt));
            let half = (s * dt * 0.5).im;
            let sinc = if half == 0.0 { 1.0 } else { half.sin() / half };
            let gain = match hold {
                Hold::Zoh => C::from_polar(1.0, -half) * sinc,
                Hold::Linear => C::new(sinc * sinc, 0.0),
            };
            (s, gain)
        })
        .collect()
}

/// The linear axis with the linear effects that are on, from the command to `[theta1, omega1, theta2, omega2]`.
fn transfer(model: &Model, s: C) -> [C; 4] {
    let p = &model.parameters;
    let of = |e: Effect, i: usize| model.effects.of(e)[i];
    let s2 = s * s;
    let mut motor = s2 * p.i1 + s * of(Effect::ViscousMotor, 0);
    let mut table = s2 * p.i2 + s * of(Effect::ViscousTable, 0);
    let inertia = of(Effect::FlexibleMode, 0);
    if inertia > 0.0 {
        let link = s * of(Effect::FlexibleMode, 2) + of(Effect::FlexibleMode, 1);
        table += s2 * inertia * link / (s2 * inertia + link);
    }
    let input = (-s * of(Effect::Delay, 0)).exp() / (s * of(Effect::ActuatorLag, 0) + 1.0) * of(Effect::TorqueGain, 0);
    let (theta1, theta2) = match model.structure {
        Structure::Rigid => {
            motor += table;
            (input / motor, input / motor)
        }
        Structure::TwoInertia => {
            let link = s * p.b + p.k;
            let both = motor * table + link * (motor + table);
            (input * (table + link) / both, input * link / both)
        }
    };
    let theta2 = theta2 * (-s * of(Effect::SensorDelay, 0)).exp();
    [theta1, s * theta1, theta2, s * theta2]
}

/// Whether an effect is linear and the response at the lines tells it.
#[must_use]
pub fn is_linear(effect: Effect) -> bool {
    matches!(
        effect,
        Effect::ActuatorLag
            | Effect::Delay
            | Effect::SensorDelay
            | Effect::FlexibleMode
            | Effect::ViscousMotor
            | Effect::ViscousTable
    )
}

/// A sentence for every logged speed that is not the derivative of its angle.
///
/// At each line the speed's response over `j*w` times the angle's: `exp(-j*w*time)` of a difference over some samples,
/// `1/(1 + j*w*time)` of a first-order low pass. The form whose time differs less from line to line is told.
#[must_use]
pub fn late_speeds(measured: &Measured) -> Vec<String> {
    let at = |signal: Signal| measured.outputs.iter().find(|o| o.0 == signal).map(|o| (&o.1, &o.2));
    let mut out = Vec::new();
    for (angle, speed, [theta, omega]) in
        [(Signal::Theta1, Signal::Omega1, ["theta1", "omega1"]), (Signal::Theta2, Signal::Omega2, ["theta2", "omega2"])]
    {
        let (Some((a, va)), Some((v, vv))) = (at(angle), at(speed)) else { continue };
        let clear = |k: &usize| va[*k] < 0.01 * a[*k].norm_sqr() && vv[*k] < 0.01 * v[*k].norm_sqr();
        let (mut delays, mut lags) = (Vec::new(), Vec::new());
        for (k, frequency) in measured.frequencies().iter().enumerate().filter(|(k, _)| clear(k)) {
            let w = TAU * frequency;
            let ratio = v[k] / (C::new(0.0, w) * a[k]);
            delays.push(-ratio.arg() / w);
            lags.push(-ratio.im / ratio.re / w);
        }
        if delays.len() < FEWEST {
            continue;
        }
        let (delay, lag) = (Quartiles::of(delays), Quartiles::of(lags));
        if !delay.agree() || delay.middle.abs() <= LATE * measured.dt {
            continue;
        }
        let told = if lag.spread() < delay.spread() && lag.middle > 0.0 {
            format!(
                "is the derivative of {theta} behind a low pass of {:.2} ms ({:.1} Hz)",
                lag.middle * 1e3,
                1.0 / (TAU * lag.middle)
            )
        } else {
            let side = if delay.middle > 0.0 { "behind" } else { "ahead of" };
            format!("runs {:.2} ms {side} the derivative of {theta}", delay.middle.abs() * 1e3)
        };
        out.push(format!(
            "{omega} {told}: a fit that compares both leans to one side. Leave {omega} out of [signals]."
        ));
    }
    out
}

/// The quartiles of a time over the lines, s.
struct Quartiles {
    low: f64,
    middle: f64,
    high: f64,
}

impl Quartiles {
    fn of(mut values: Vec<f64>) -> Self {
        values.sort_by(f64::total_cmp);
        let at = |q: f64| values[((values.len() - 1) as f64 * q).round() as usize];
        Self { low: at(0.25), middle: at(0.5), high: at(0.75) }
    }

    /// Whether the middle half of the lines says late, or early.
    fn agree(&self) -> bool {
        self.low * self.high > 0.0
    }

    fn spread(&self) -> f64 {
        (self.high - self.low) / self.middle.abs().max(f64::MIN_POSITIVE)
    }
}

/// Fewest clear lines that say anything of a speed.
const FEWEST: usize = 8;
/// Share of the sampling interval by which a speed may be late without a word.
const LATE: f64 = 0.2;

/// Place of an effect.
#[must_use]
pub fn place(effect: Effect) -> Place {
    effect.info().place
}
