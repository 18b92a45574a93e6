//! The record that the diagnosis works on: torque, the measured channels and the noise of each.

use std::sync::Arc;

use super::decimation::LoggedTorque;
use crate::axis::Hold;
use crate::effects::{Ramp, Settings};

/// Names of the channels, in the order of [`Record::channels`].
pub const CHANNELS: [&str; 4] = ["theta1", "omega1", "theta2", "omega2"];

/// Name of the torque.
pub const TORQUE: &str = "T";

/// Share of a sample within which an instant is that sample's own.
const ROUNDING: f64 = 1e-9;

/// One uniformly sampled record of the axis, SI units.
#[derive(Debug, Clone, PartialEq)]
pub struct Record {
    /// Time of the first sample, s.
    pub start: f64,
    /// Sampling interval, s.
    pub dt: f64,
    /// What the torque does between two samples.
    pub hold: Hold,
    /// Torque on the motor (or its command), N.m; one value a sample.
    pub torque: Vec<f64>,
    /// The torque where it is known more often than the motion: how many times a sample, at even steps from the sample's own time on, and
    /// its values at those times, N.m.
    pub between: Option<(usize, Vec<f64>)>,
    /// The torque as it was logged, where this record is one at a lower rate, and the sample of that rate that this record begins with.
    pub logged: Option<(Arc<LoggedTorque>, usize)>,
    /// `[theta1, omega1, theta2, omega2]`, rad and rad/s, as long as the torque; what was not measured is `None`.
    pub channels: [Option<Vec<f64>>; 4],
    /// Standard deviation of the noise of each channel, in its unit; without meaning where the channel is `None`.
    pub noise: [f64; 4],
    /// Frequency below which the noise of theta1 and of theta2 grows as 1/f, Hz; zero where it is white.
    pub corner: [f64; 2],
    /// Covariance of the noises of both positions, rad^2.
    pub common_noise: f64,
    /// Time at either end within which a filter began, s.
    pub settling: f64,
    /// Samples without information (the drive is off, the axis stands): they are simulated, with zero weight.
    pub idle: Vec<std::ops::Range<usize>>,
}

impl Record {
    /// A record from the time zero on, without noise: its torque, N.m, and its channels, each as long.
    #[must_use]
    pub fn new(dt: f64, hold: Hold, torque: Vec<f64>, channels: [Option<Vec<f64>>; 4]) -> Self {
        Self {
            start: 0.0,
            dt,
            hold,
            torque,
            between: None,
            logged: None,
            channels,
            noise: [0.0; 4],
            corner: [0.0; 2],
            common_noise: 0.0,
            settling: 0.0,
            idle: Vec::new(),
        }
    }

    /// Number of samples.
    #[must_use]
    pub fn len(&self) -> usize {
        self.torque.len()
    }

    /// The samples of a range as a record of their own, at the same times.
    #[must_use]
    pub fn part(&self, range: std::ops::Range<usize>) -> Self {
        Self {
            start: self.time(range.start),
            dt: self.dt,
            hold: self.hold,
            torque: self.torque[range.clone()].to_vec(),
            between: (self.between.as_ref()).map(|(m, t)| (*m, t[m * range.start..m * range.end].to_vec())),
            logged: (self.logged.as_ref()).map(|(logged, first)| (logged.clone(), first + range.start)),
            channels: std::array::from_fn(|c| self.channels[c].as_ref().map(|v| v[range.clone()].to_vec())),
            noise: self.noise,
            corner: self.corner,
            common_noise: self.common_noise,
            settling: self.settling,
            idle: (self.idle.iter())
                .map(|r| r.start.max(range.start)..r.end.min(range.end))
                .filter(|r| !r.is_empty())
                .map(|r| r.start - range.start..r.end - range.start)
                .collect(),
        }
    }

    /// Variance of the noise of a side's position as if all frequencies had as much of it as one in Hz, rad^2.
    #[must_use]
    pub fn position_noise(&self, side: usize, frequency: f64) -> f64 {
        self.noise[2 * side].powi(2) * (1.0 + self.corner[side] / frequency)
    }

    /// The same motion without a torque.
    #[must_use]
    pub fn undriven(&self) -> Self {
        Self { torque: vec![0.0; self.torque.len()], between: None, logged: None, ..self.clone() }
    }

    /// Sampling interval of the log, s.
    #[must_use]
    pub fn logged_at(&self) -> f64 {
        self.logged.as_ref().map_or(self.dt, |(torque, _)| torque.dt())
    }

    /// Instants a sample at which the torque is known.
    #[must_use]
    pub fn instants(&self) -> usize {
        self.between.as_ref().map_or(1, |(m, _)| *m)
    }

    /// Speeds of motor and table, rad/s: the peak of a sine of the same mean square; a side that is not measured moves with the other.
    #[must_use]
    pub fn speeds(&self) -> [f64; 2] {
        let peak = |sum: f64, n: usize| (2.0 * sum / n.max(1) as f64).sqrt();
        let of = |side: usize| {
            let steps = |y: &Vec<f64>| {
                peak(y.windows(2).map(|w| ((w[1] - w[0]) / self.dt).powi(2)).sum(), y.len().saturating_sub(1))
            };
            let speeds = |v: &Vec<f64>| peak(v.iter().map(|v| v * v).sum(), v.len());
            self.channels[2 * side].as_ref().map(steps).or_else(|| self.channels[2 * side + 1].as_ref().map(speeds))
        };
        let (motor, table) = (of(0), of(1));
        [motor.or(table), table.or(motor)].map(Option::unwrap_or_default)
    }

    /// The record with the torque that settings let through at the rate of the log, without any channel; `None` where it is at that rate, or
    /// where they do at any rate what they do at that.
    #[must_use]
    pub fn through(&self, effects: &Settings) -> Option<Self> {
        let (logged, first) = self.logged.as_ref()?;
        if !effects.active().inputs().iter().any(|e| e.bends_torque()) {
            return None;
        }
        let kept = logged.kept(effects)?;
        let (instants, mut between) = self.between.clone()?;
        let last = kept.len() - 1;
        for (torque, i) in between.iter_mut().zip(first * instants..) {
            *torque -= kept[i.min(last)];
        }
        let torque = between.iter().copied().step_by(instants).collect();
        let idle = Vec::new();
        Some(Self {
            torque,
            between: Some((instants, between)),
            logged: None,
            channels: [const { None }; 4],
            idle,
            ..*self
        })
    }

    /// The torque over part `j` of the `parts` equal ones of the interval that begins `ahead` seconds after sample `k`, N.m: of one that
    /// jumps or bends within it the ramp of the same mean and first moment; before and after the record its first and last.
    #[must_use]
    pub fn ramp(&self, k: usize, j: usize, parts: usize, ahead: f64) -> Ramp<f64> {
        let (instants, torque) = self.between.as_ref().map_or((1, &self.torque), |(m, t)| (*m, t));
        let last = torque.len() - 1;
        let is_held = self.between.is_none() && self.hold == Hold::Zoh;
        if is_held && ahead == 0.0 {
            return Ramp::held(torque[k.min(last)]);
        }
        let logged = |i: usize| torque[i.min(last)];
        // Stepped as finely as the torque is kept, a part runs from one value of it to the next: most of what is ever simulated.
        if !is_held && ahead == 0.0 && parts == instants {
            let from = k * instants + j;
            return Ramp { start: logged(from), end: logged(from + 1) };
        }
        let ahead = ahead / self.dt;
        let at = |i: usize| ((k as f64 + i as f64 / parts as f64) + ahead) * instants as f64;
        let (from, to) = (at(j), at(j + 1));
        // A part that ends at an instant ends there, whatever rounding says.
        let (first, next) = ((from + ROUNDING) as usize, (to - ROUNDING) as usize);
        let between = |i: usize, x: f64| {
            if is_held { logged(i) } else { logged(i) + (logged(i + 1) - logged(i)) * (x - i as f64).min(1.0) }
        };
        // A straight torque is read at both ends of a part that is no longer than what it runs straight over.
        let is_read_at_ends = first >= next || first >= last || (!is_held && to - from <= 1.0 + ROUNDING);
        if is_read_at_ends {
            let end = if is_held { first } else { (to + ROUNDING) as usize };
            return Ramp { start: between(first, from), end: between(end, to) };
        }
        let length = to - from;
        let (mut mean, mut moment) = (0.0, 0.0);
        for i in first..=next {
            let (a, b) = ((i as f64).max(from), ((i + 1) as f64).min(to));
            let [start, end] = [a, b].map(|x| between(i, x));
            let (begin, part) = ((a - from) / length, (b - a) / length);
            mean += part * 0.5 * (start + end);
            moment += part * (begin * 0.5 * (start + end) + part * (start / 6.0 + end / 3.0));
        }
        Ramp::from_moments(mean, moment)
    }

    /// Whether there is no sample.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.torque.is_empty()
    }

    /// Time of sample `k`, s.
    #[must_use]
    pub fn time(&self, k: usize) -> f64 {
        self.start + k as f64 * self.dt
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record(hold: Hold, torque: &[f64]) -> Record {
        Record::new(0.5, hold, torque.to_vec(), [const { None }; 4])
    }

    #[test]
    fn a_held_torque_that_jumps_within_the_step_keeps_its_mean_and_first_moment() {
        let record = record(Hold::Zoh, &[1.0, 3.0, 3.0]);
        assert_eq!(record.ramp(0, 0, 1, 0.0), Ramp::held(1.0));
        assert_eq!(record.ramp(0, 1, 2, 0.0), Ramp::held(1.0));
        // 0.2 s after the first sample: three fifths of the step at 1, two fifths at 3.
        let Ramp { start, end } = record.ramp(0, 0, 1, 0.2);
        let (mean, moment) = (0.6 + 3.0 * 0.4, 0.5 * 0.36 + 3.0 * 0.5 * (1.0 - 0.36));
        assert!((0.5 * (start + end) - mean).abs() < 1e-12, "{start} {end}");
        assert!((start / 6.0 + end / 3.0 - moment).abs() < 1e-12, "{start} {end}");
        // Its last value holds on.
        assert_eq!(record.ramp(2, 0, 1, 0.7), Ramp::held(3.0));
    }

    #[test]
    fn a_straight_torque_is_read_ahead_on_its_line() {
        let record = record(Hold::Linear, &[1.0, 3.0, 7.0]);
        assert_eq!(record.ramp(0, 0, 1, 0.0), Ramp { start: 1.0, end: 3.0 });
        assert_eq!(record.ramp(0, 0, 2, 0.0), Ramp { start: 1.0, end: 2.0 });
        assert_eq!(record.ramp(0, 0, 1, 0.25), Ramp { start: 2.0, end: 5.0 });
        assert_eq!(record.ramp(1, 0, 1, 0.5), Ramp { start: 7.0, end: 7.0 });
    }

    #[test]
    fn a_torque_stepped_as_finely_as_it_is_kept_is_read_as_a_moment_later() {
        let torque = [0.5, -1.0, 4.0, 2.5, 2.0, 7.0];
        let between = Some((3, torque.to_vec()));
        let fine = Record { between, ..record(Hold::Linear, &[0.5, 2.5]) };
        for (k, j) in [(0, 0), (0, 2), (1, 0), (1, 1), (1, 2), (2, 0)] {
            let (own, later) = (fine.ramp(k, j, 3, 0.0), fine.ramp(k, j, 3, 1e-12));
            let at = |i: usize| torque[(3 * k + j + i).min(5)];
            assert_eq!(own, Ramp { start: at(0), end: at(1) });
            assert!((own.start - later.start).abs() < 1e-9 && (own.end - later.end).abs() < 1e-9, "{k} {j}");
        }
    }

    #[test]
    fn a_torque_that_bends_within_the_step_keeps_its_mean_and_first_moment() {
        let between = Some((2, vec![0.0, 4.0, 2.0, 2.0]));
        let record = Record { between, ..record(Hold::Linear, &[0.0, 2.0]) };
        assert_eq!(record.ramp(0, 1, 2, 0.0), Ramp { start: 4.0, end: 2.0 });
        // 8t up to the middle, 6 - 4t from there: the integrals of it and of it times t.
        let Ramp { start, end } = record.ramp(0, 0, 1, 0.0);
        assert!((0.5 * (start + end) - 2.5).abs() < 1e-12, "{start} {end}");
        let moment = 8.0 / 24.0 + (6.0 * 3.0 / 8.0 - 4.0 * 7.0 / 24.0);
        assert!((start / 6.0 + end / 3.0 - moment).abs() < 1e-12, "{start} {end} {moment}");
    }
}
