//! The record that the diagnosis works on: torque, the measured channels and the noise of each.

use crate::axis::Hold;
use crate::effects::Ramp;

/// Names of the channels, in the order of [`Record::channels`].
pub const CHANNELS: [&str; 4] = ["theta1", "omega1", "theta2", "omega2"];

/// Name of the torque.
pub const TORQUE: &str = "T";

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
    /// Where it is known more often than the motion: at this many even instants a sample, the first of them the sample's own.
    pub between: Option<(usize, Vec<f64>)>,
    /// `[theta1, omega1, theta2, omega2]`, rad and rad/s, as long as the torque; what was not measured is `None`.
    pub channels: [Option<Vec<f64>>; 4],
    /// Standard deviation of the noise of each channel, in its unit; means nothing where the channel is `None`.
    pub noise: [f64; 4],
    /// Covariance of the noises of both positions, rad^2.
    pub common_noise: f64,
    /// Stretches that tell nothing (the drive is off, the axis stands): they are followed, and not weighed.
    pub idle: Vec<std::ops::Range<usize>>,
}

impl Record {
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
            channels: std::array::from_fn(|c| self.channels[c].as_ref().map(|v| v[range.clone()].to_vec())),
            noise: self.noise,
            common_noise: self.common_noise,
            idle: (self.idle.iter())
                .map(|r| r.start.max(range.start)..r.end.min(range.end))
                .filter(|r| !r.is_empty())
                .map(|r| r.start - range.start..r.end - range.start)
                .collect(),
        }
    }

    /// Instants a sample at which the torque is known.
    #[must_use]
    pub fn instants(&self) -> usize {
        self.between.as_ref().map_or(1, |(m, _)| *m)
    }

    /// The torque over part `j` of the `parts` equal ones of the interval after sample `k`, N.m.
    #[must_use]
    pub fn ramp(&self, k: usize, j: usize, parts: usize) -> Ramp<f64> {
        let share = |i: usize| i as f64 / parts as f64;
        if let Some((instants, torque)) = &self.between {
            let at = |i: usize| {
                let x = (k as f64 + share(i)) * *instants as f64;
                let first = (x as usize).min(torque.len() - 1);
                let next = (first + 1).min(torque.len() - 1);
                torque[first] + (torque[next] - torque[first]) * (x - first as f64)
            };
            return Ramp { start: at(j), end: at(j + 1) };
        }
        let whole: Ramp<f64> = self.hold.ramp(&self.torque, k);
        let at = |i: usize| whole.start + (whole.end - whole.start) * share(i);
        if parts == 1 || self.hold == Hold::Zoh { whole } else { Ramp { start: at(j), end: at(j + 1) } }
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
