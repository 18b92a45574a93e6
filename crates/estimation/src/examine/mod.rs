//! Examination of a record before it is believed: what is wrong with its channels, its units and its time stamps, and which
//! pieces of it may be used.
//!
//! It knows a record as plain columns and, where there is one, the nominal model; it reads no file and fits no model of the
//! axis. What it asks of the columns holds for every axis that this library has a law for:
//!
//! ```text
//! omega = d theta/dt                            a speed is the derivative of its angle
//! theta2/theta1 -> 1 below the antiresonance    both encoders turn together where the coupling is stiff to the motion
//! T = M1*a1 + M2*a2 + c*v1 + F*sign(v1) + k*x1  momentum: M1, M2, c, F >= 0, k of either sign (a spring, gravity)
//! ```
//!
//! A finding of severity [`Severity::Refuse`] says that a verdict from this record would be about its defect.

mod as_logged;
mod ceiling;
mod channels;
mod computed;
mod copies;
mod encoders;
mod finding;
mod least;
mod momentum;
mod motion;
mod motor_side;
mod nominal;
mod pairs;
mod regression;
mod rigid;
mod robust;
mod slips;
mod smoothing;
mod spectra;
mod stamps;
mod standing;
mod twist;
mod usable;

#[cfg(test)]
mod tests;

use std::ops::Range;

use rayon::prelude::*;

pub use finding::{Finding, Severity};

use crate::axis::{AxisKind, Hold, Parameters, Structure};
use crate::trace::machine::NOMINAL_OFF;
use crate::trace::{Machine, Signal, Trace, bridge};

/// The nominal model, where one is known.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Nominal {
    /// One inertia or two.
    pub structure: Structure,
    /// Its parameters, SI units.
    pub parameters: Parameters,
}

/// A record as plain columns, all of one length, SI units as the user declared them.
#[derive(Debug, Clone, Copy, Default)]
pub struct Input<'a> {
    /// Time of the first sample, s.
    pub start: f64,
    /// Sampling interval, s.
    pub dt: f64,
    /// The time stamps as they were logged, s, where they are known; the columns may have been resampled since.
    pub stamps: Option<&'a [f64]>,
    /// Torque (force) on the motor side.
    pub torque: Option<&'a [f64]>,
    /// Motor angle.
    pub theta1: Option<&'a [f64]>,
    /// Motor speed.
    pub omega1: Option<&'a [f64]>,
    /// Table angle.
    pub theta2: Option<&'a [f64]>,
    /// Table speed.
    pub omega2: Option<&'a [f64]>,
    /// The nominal model, where one is known: units are checked against it.
    pub nominal: Option<Nominal>,
    /// Rotary or linear, for the units in the sentences.
    pub motion: AxisKind,
    /// What the torque does between samples, where the user says it.
    pub hold: Option<Hold>,
}

/// A channel of the record.
#[derive(Debug, Clone, Copy)]
struct Channel<'a> {
    name: &'static str,
    values: &'a [f64],
}

impl<'a> Input<'a> {
    /// The columns of a trace; `stamps` are the time stamps as they were logged, where they are known.
    #[must_use]
    pub fn of(trace: &'a Trace, stamps: Option<&'a [f64]>) -> Self {
        Self {
            start: trace.start,
            dt: trace.dt,
            stamps,
            torque: trace.get(Signal::T),
            theta1: trace.get(Signal::Theta1),
            omega1: trace.get(Signal::Omega1),
            theta2: trace.get(Signal::Theta2),
            omega2: trace.get(Signal::Omega2),
            ..Self::default()
        }
    }

    /// The same beside a machine: of a rigid one the motor's channels alone, and its nominal parameters to check units
    /// against where they are `known` and not a guess.
    #[must_use]
    pub fn against(self, machine: &Machine, known: bool) -> Self {
        let nominal = Nominal { structure: machine.structure, parameters: machine.parameters };
        let rigid = machine.structure == Structure::Rigid && (self.theta1.is_some() || self.omega1.is_some());
        Self {
            nominal: known.then_some(nominal),
            motion: machine.signals.motion,
            hold: machine.signals.hold,
            theta2: self.theta2.filter(|_| !rigid),
            omega2: self.omega2.filter(|_| !rigid),
            ..self
        }
    }

    /// Samples of the record.
    #[must_use]
    pub fn len(&self) -> usize {
        self.channels().map(|c| c.values.len()).min().unwrap_or(0)
    }

    /// Whether there is no sample.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The channels that are there.
    fn channels(&self) -> impl Iterator<Item = Channel<'a>> {
        [
            ("T", self.torque),
            ("theta1", self.theta1),
            ("omega1", self.omega1),
            ("theta2", self.theta2),
            ("omega2", self.omega2),
        ]
        .into_iter()
        .filter_map(|(name, values)| values.map(|values| Channel { name, values }))
    }

    /// Time of a sample, s.
    fn time(&self, k: usize) -> f64 {
        self.start + k as f64 * self.dt
    }
}

/// What an examination found.
#[derive(Debug, Clone, Default, serde::Serialize)]
pub struct Examination {
    /// What was found, the gravest first.
    pub findings: Vec<Finding>,
    /// The pieces where the drive is on and the axis is not merely standing; ascending, apart from each other. The whole
    /// record where nothing speaks against it.
    pub usable: Vec<Range<usize>>,
    /// Band in which the motion follows the torque, Hz; None where there is none.
    pub band: Option<[f64; 2]>,
    /// The inertia (mass) that moves, roughly; None where no torque goes with the acceleration.
    pub inertia: Option<Inertia>,
    /// Whether the torque acts as if it ran straight from sample to sample: as one that is measured at each, not as one that a drive holds from
    /// one to the next.
    #[serde(skip)]
    pub runs_straight: bool,
}

/// The inertia that moves, as a record without a nominal one tells it.
#[derive(Debug, Clone, Copy, serde::Serialize)]
pub struct Inertia {
    /// kg.m2 (kg).
    pub value: f64,
    /// Whether it is known to a third; if not, its torque hardly shows beside the others.
    pub is_shown: bool,
}

impl Examination {
    /// Whether no verdict may be given on this record.
    #[must_use]
    pub fn refuses(&self) -> bool {
        self.findings.iter().any(|f| f.severity == Severity::Refuse)
    }

    /// The finding of an id.
    #[must_use]
    pub fn find(&self, id: &str) -> Option<&Finding> {
        self.findings.iter().find(|f| f.id == id)
    }

    /// The longest usable piece; None where no sample is usable.
    #[must_use]
    pub fn longest(&self) -> Option<Range<usize>> {
        self.usable.iter().max_by_key(|r| r.len()).cloned()
    }
}

/// Sampling intervals between which drives are logged, s: a converter's own rate, and one that still shows an acceleration.
const MIN_INTERVAL: f64 = 1e-8;
const MAX_INTERVAL: f64 = 10.0;
/// Speeds beyond what machines turn or move at: three million turns a minute, ten times the fastest turbine; a rifle's bullet.
const MAX_SPEED_ROTARY: f64 = 3e5;
const MAX_SPEED_LINEAR: f64 = 1e3;
/// Torques and forces beyond those of the largest drives: a wind turbine's gear sees 1e7 N.m, a forging press 1e9 N.
const MAX_TORQUE: f64 = 1e8;
const MAX_FORCE: f64 = 1e10;

/// Torques and speeds that no machine has: the column is in another unit, or counts.
fn sizes(input: &Input<'_>, findings: &mut Vec<Finding>) {
    let linear = input.motion == AxisKind::Linear;
    let unit = |rotary| AxisKind::unit(input.motion, rotary);
    let report = |signal: &'static str, seen: String, remedy: &str| {
        Finding::new(
            "magnitude",
            Severity::Refuse,
            signal,
            seen,
            "The column counts in another unit than is assumed: every parameter would be off by the factor between the two.",
            remedy,
        )
    };
    for channel in input.channels() {
        if channel.name == "T" {
            let typical = robust::quantile(channel.values.iter().copied(), 0.9);
            if typical > if linear { MAX_FORCE } else { MAX_TORQUE } {
                let seen = format!("T is about {} {}: no drive gives that.", finding::rounded(typical), unit("N.m"));
                findings.push(report(
                    "T",
                    seen,
                    "Give its unit in the header, or the drive's own factor as scale of T in [signals].",
                ));
            }
            continue;
        }
        let position = channel.name.starts_with("theta");
        // Over several samples: noise and steps of an encoder that is sampled fast are no speed.
        let apart = if position { (channel.values.len() / 64).clamp(1, 64) } else { 0 };
        let span = apart as f64 * input.dt;
        let speed = if position {
            robust::quantile(channel.values.windows(apart + 1).map(|w| (w[apart] - w[0]) / span), 0.9)
        } else {
            robust::quantile(channel.values.iter().copied(), 0.9)
        };
        if speed > if linear { MAX_SPEED_LINEAR } else { MAX_SPEED_ROTARY } {
            let seen =
                format!("{} moves at about {} {}: no axis does.", channel.name, finding::rounded(speed), unit("rad/s"));
            let remedy = if linear {
                "Give its unit in the header; of an encoder's counts the length of one (m) as scale in [signals]."
            } else {
                "Give its unit in the header; of an encoder's counts the angle of one (2*pi over the counts of a turn) as scale in [signals]."
            };
            findings.push(report(channel.name, seen, remedy));
        }
    }
}

/// Largest size that is taken for a measurement: its fourth power is still finite.
const MAX_MAGNITUDE: f64 = 1e60;

/// A torque that the user says is held, and does not act so.
fn taken_as_held() -> Finding {
    Finding::new(
        "hold",
        Severity::Warn,
        "T",
        "The motion follows a torque that runs straight from one sample to the next, at least twice as well as one that is held."
            .to_owned(),
        "The torque is measured, or the log is a part of the samples of a faster drive: held, it acts half a sample late, and a model reads \
         that as a delay, a latch or a friction.",
        "Write hold = \"linear\" at T in [signals] of the axis file.",
    )
}

/// Examines a record. All columns must be as long as each other; a shorter one limits what is looked at.
#[must_use]
pub fn examine(input: &Input<'_>) -> Examination {
    let n = input.len();
    let mut findings = Vec::new();
    stamps::examine(input, &mut findings);
    if !numbers(input, &mut findings) || n < 16 {
        finding::sort(&mut findings);
        let usable = std::iter::once(0..n).filter(|r| !r.is_empty()).collect();
        return Examination { findings, usable, ..Examination::default() };
    }
    let input = &cut(input, n);
    let even = findings.iter().all(|f| f.signal != "time");
    let mut bad = Vec::new();
    let found = in_parallel([
        &mut |found| bad = channels::examine(input, found),
        &mut |found| copies::examine(input, found),
        &mut |found| computed::examine(input, found),
        &mut |found| {
            if even {
                slips::examine(input, found);
            }
        },
        &mut |found| sizes(input, found),
    ]);
    findings.extend(found);
    let usable = usable::examine(input, &bad, &mut findings);
    // What the channels say of each other is asked where the drive is on; a dead one says nothing of any.
    let piece = usable.iter().max_by_key(|r| r.len()).cloned().unwrap_or(0..n);
    let (mut band, mut inertia, mut runs_straight) = (None, None, false);
    if piece.len() >= 64 {
        let mut part = slice(input, &piece);
        part.torque = part.torque.filter(|v| robust::span(v) > 0.0);
        for channel in [&mut part.theta1, &mut part.omega1, &mut part.theta2, &mut part.omega2] {
            *channel = channel.filter(|v| robust::span(v) > 0.0);
        }
        // A lost sample reads as a blow: torque and motion are compared without.
        let mended = [("theta1", part.theta1), ("theta2", part.theta2)].map(|(name, y)| {
            let spikes = findings.iter().any(|f| f.id == "spikes" && f.signal == name);
            y.filter(|_| spikes).map(|y| {
                let mut y = y.to_vec();
                bridge(&mut y, 0.0);
                y
            })
        });
        let [one, two] = &mended;
        let part = Input { theta1: one.as_deref().or(part.theta1), theta2: two.as_deref().or(part.theta2), ..part };
        pairs::speeds(&part, &mut findings);
        let twist = twist::logged(&part);
        // In its place nothing is known of the table.
        let part = if twist.is_some() { Input { theta2: None, omega2: None, ..part } } else { part };
        findings.extend(twist);
        let (of_the_lines, guessed) =
            rayon::join(|| momentum::examine(&part, &mut inertia, &mut findings), || rigid::Guess::of(&part));
        band = of_the_lines;
        inertia = guessed.inertia.map(|value| Inertia { value, is_shown: true }).or(inertia);
        runs_straight = guessed.runs_straight;
        if runs_straight && input.hold == Some(Hold::Zoh) {
            findings.push(taken_as_held());
        }
    }
    finding::sort(&mut findings);
    Examination { findings, usable, band, inertia, runs_straight }
}

/// A part of an examination that needs no other's findings.
type Part<'a> = &'a mut (dyn FnMut(&mut Vec<Finding>) + Send);

/// What independent parts of an examination find, in their order whichever ends first.
fn in_parallel<const N: usize>(parts: [Part<'_>; N]) -> Vec<Finding> {
    let run = |part: Part<'_>| {
        let mut found = Vec::new();
        part(&mut found);
        found
    };
    let found: Vec<Vec<Finding>> = parts.into_par_iter().map(run).collect();
    found.into_iter().flatten().collect()
}

/// Numbers that can be computed with; says so where they cannot.
fn numbers(input: &Input<'_>, findings: &mut Vec<Finding>) -> bool {
    let mut sound = true;
    if !(input.dt > MIN_INTERVAL && input.dt < MAX_INTERVAL) {
        sound = false;
        findings.push(Finding::new(
            "interval",
            Severity::Refuse,
            "time",
            format!("The sampling interval is {:e} s.", input.dt),
            "No drive is logged at such a rate: the unit of the time column is another than the file says.",
            "Give the unit in the header, as in time [ms], or the interval as dt in [signals] of the axis file.",
        ));
    }
    for channel in input.channels() {
        let concerned = finding::runs(channel.values.len(), |k| is_no_reading(channel.values, k));
        if !concerned.is_empty() {
            sound = false;
            let first = channel.values[concerned[0].start];
            findings.push(
                Finding::new(
                    "magnitude",
                    Severity::Refuse,
                    channel.name,
                    format!("{} holds numbers that no sensor gives, the first {first:e}.", channel.name),
                    "They are marks of missing values, or the column is not what it is taken for.",
                    "Cut the record before or after them (--from, --to), or map another column in [signals].",
                )
                .at(input, concerned),
            );
        }
    }
    sound
}

/// Whether a sample is no number that a sensor gives. One that is next to none is one where a simulated torque dies away: within a factor of
/// a thousand of a sample beside it, and another.
#[allow(clippy::float_cmp, reason = "a mark is the same number again")]
fn is_no_reading(values: &[f64], k: usize) -> bool {
    let v = values[k].abs();
    let is_mark = v != 0.0 && v < 1.0 / MAX_MAGNITUDE;
    let near = |i: usize| values.get(i).is_some_and(|n| n.abs() != v && (1e-3..1e3).contains(&(n.abs() / v)));
    !v.is_finite() || v > MAX_MAGNITUDE || is_mark && !near(k + 1) && !near(k.wrapping_sub(1))
}

/// The first `n` samples of every channel.
fn cut<'a>(input: &Input<'a>, n: usize) -> Input<'a> {
    slice(input, &(0..n))
}

/// The samples of a range, of every channel.
fn slice<'a>(input: &Input<'a>, range: &Range<usize>) -> Input<'a> {
    let part = |v: Option<&'a [f64]>| v.map(|v| &v[range.clone()]);
    Input {
        start: input.time(range.start),
        stamps: input.stamps.filter(|s| s.len() >= range.end).map(|s| &s[range.clone()]),
        torque: part(input.torque),
        theta1: part(input.theta1),
        omega1: part(input.omega1),
        theta2: part(input.theta2),
        omega2: part(input.omega2),
        ..*input
    }
}
