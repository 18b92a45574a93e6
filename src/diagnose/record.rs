//! The record that the diagnosis works on: torque, the measured channels and the noise of each.

use crate::axis::Hold;

/// Names of the channels, in the order of [`Record::channels`].
pub const CHANNELS: [&str; 4] = ["theta1", "omega1", "theta2", "omega2"];

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
    /// `[theta1, omega1, theta2, omega2]`, rad and rad/s, as long as the torque; what was not measured is `None`.
    pub channels: [Option<Vec<f64>>; 4],
    /// Standard deviation of the noise of each channel, in its unit; means nothing where the channel is `None`.
    pub noise: [f64; 4],
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
            channels: std::array::from_fn(|c| self.channels[c].as_ref().map(|v| v[range.clone()].to_vec())),
            noise: self.noise,
            idle: (self.idle.iter())
                .map(|r| r.start.max(range.start)..r.end.min(range.end))
                .filter(|r| !r.is_empty())
                .map(|r| r.start - range.start..r.end - range.start)
                .collect(),
        }
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
