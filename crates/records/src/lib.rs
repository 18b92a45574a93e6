//! Records of the axis: sampled signals in memory, their files (CSV, Excel, Parquet, MATLAB 5, NumPy,
//! JSON, logs of LinuxCNC, TwinCAT, Sinumerik and TNCscope), and the machine description `axis.toml`. It knows files, units and time
//! stamps, and of the model its parameters; it estimates nothing and knows no FMI.
//!
//! A [`Trace`] is one uniformly sampled record: `time(k) = start + k*dt`, never accumulated. Everything is SI: T in N.m
//! (or N), angles in rad (or m), speeds in rad/s (or m/s). What the torque does between two samples is part of the
//! record: see [`Trace::hold`].

mod autoregressive;
#[cfg(any(feature = "hdf5", feature = "parquet"))]
mod caught;
mod clock;
mod csv;
mod error;
mod forms;
pub mod guess;
#[cfg(feature = "hdf5")]
mod hdf5;
#[cfg(not(feature = "hdf5"))]
#[path = "no_hdf5.rs"]
mod hdf5;
mod json;
mod load;
mod lost;
pub mod machine;
mod mat;
mod missing;
pub mod numerics;
mod packed;
#[cfg(feature = "parquet")]
mod parquet;
#[cfg(not(feature = "parquet"))]
#[path = "no_parquet.rs"]
mod parquet;
mod sampling;
mod signal;
pub mod stream;
mod table;
mod units;
mod vendors;
mod wrap;
mod write;
pub mod xml;

// What a machine lacks is said in one way by all tests.
#[cfg(test)]
#[path = "../../../tests/program/skip.rs"]
mod skip;

use std::ops::Range;

use eixo_model::{axis, drive, effects};

pub use crate::axis::Hold;
pub use autoregressive::floor;
pub use error::TraceError;
pub use error::nearest;
pub use load::{COUNTS, Column, Loaded, LoadedPieces, Mapping, from_table, load, load_pieces};
pub use lost::{bridge, held, restore};
pub use machine::{Controller, Machine, MachineError};
pub use sampling::{Grid, Sampling, grid};
pub use signal::{AxisKind, Quantity, Signal};
pub use table::{Header, Table};
pub use units::Unit;
pub use write::{append_number, number, writable, write_columns, write_csv, write_text};

/// What is said of a Parquet file by a build without the feature `parquet`.
pub const WITHOUT_PARQUET: &str = "this eixo was built without Parquet; build it with `--features parquet`, or use CSV";

/// One uniformly sampled record of the axis, SI units.
#[derive(Debug, Clone, PartialEq)]
pub struct Trace {
    /// Time of the first sample, s.
    pub start: f64,
    /// Sampling interval, s.
    pub dt: f64,
    /// What the torque does between two samples.
    pub hold: Hold,
    columns: [Option<Vec<f64>>; Signal::COUNT],
}

impl Trace {
    /// An empty record: no signals yet.
    #[must_use]
    pub const fn new(start: f64, dt: f64, hold: Hold) -> Self {
        Self { start, dt, hold, columns: [const { None }; Signal::COUNT] }
    }

    /// The record with one more signal (or one replaced), for building traces in an expression.
    ///
    /// # Errors
    /// [`TraceError::Length`] when the signal is not as long as those already there.
    pub fn with(mut self, signal: Signal, values: Vec<f64>) -> Result<Self, TraceError> {
        self.set(signal, values)?;
        Ok(self)
    }

    /// Puts a signal in, or replaces it.
    ///
    /// # Errors
    /// [`TraceError::Length`] when the signal is not as long as the others.
    pub fn set(&mut self, signal: Signal, values: Vec<f64>) -> Result<(), TraceError> {
        let others = Signal::ALL.into_iter().filter(|s| *s != signal).find_map(|s| self.get(s).map(<[f64]>::len));
        match others {
            Some(expected) if expected != values.len() => {
                Err(TraceError::Length { signal: signal.name(), found: values.len(), expected })
            }
            _ => {
                self.columns[signal.index()] = Some(values);
                Ok(())
            }
        }
    }

    /// Puts a signal in whatever its length: the others follow.
    fn put(&mut self, signal: Signal, values: Vec<f64>) {
        self.columns[signal.index()] = Some(values);
    }

    /// Takes a signal out of the record.
    pub fn remove(&mut self, signal: Signal) -> Option<Vec<f64>> {
        self.columns[signal.index()].take()
    }

    /// The samples of a signal, when the record has it.
    #[must_use]
    pub fn get(&self, signal: Signal) -> Option<&[f64]> {
        self.columns[signal.index()].as_deref()
    }

    /// The samples of a signal that the caller cannot do without.
    ///
    /// # Errors
    /// [`TraceError::MissingSignal`], naming the signals that are there.
    pub fn require(&self, signal: Signal) -> Result<&[f64], TraceError> {
        self.get(signal).ok_or_else(|| TraceError::MissingSignal {
            signal: signal.name(),
            present: self.signals().map(Signal::name).collect::<Vec<_>>().join(", "),
        })
    }

    /// Whether the record has a signal.
    #[must_use]
    pub const fn has(&self, signal: Signal) -> bool {
        self.columns[signal.index()].is_some()
    }

    /// The signals of the record, in the order of [`Signal::ALL`].
    pub fn signals(&self) -> impl Iterator<Item = Signal> + '_ {
        Signal::ALL.into_iter().filter(|s| self.has(*s))
    }

    /// Number of samples.
    #[must_use]
    pub fn len(&self) -> usize {
        self.columns.iter().flatten().next().map_or(0, Vec::len)
    }

    /// Whether there is no sample.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Sampling interval, s.
    #[must_use]
    pub const fn dt(&self) -> f64 {
        self.dt
    }

    /// Time of sample `k`, s.
    #[must_use]
    pub fn time(&self, k: usize) -> f64 {
        self.start + k as f64 * self.dt
    }

    /// A copy of the samples in `range`; the start moves with it.
    ///
    /// # Panics
    /// When the range reaches beyond the record.
    #[must_use]
    pub fn slice(&self, range: Range<usize>) -> Self {
        Self {
            start: self.time(range.start),
            dt: self.dt,
            hold: self.hold,
            columns: self.columns.each_ref().map(|c| c.as_ref().map(|v| v[range.clone()].to_vec())),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slice_keeps_the_time_of_its_first_sample() {
        let trace = Trace::new(1.0, 0.5, Hold::Zoh)
            .with(Signal::T, vec![0.0, 1.0, 2.0, 3.0])
            .and_then(|t| t.with(Signal::Theta1, vec![0.0, 0.1, 0.2, 0.3]))
            .unwrap();
        let part = trace.slice(2..4);
        assert_eq!(part.start, 2.0);
        assert_eq!(part.get(Signal::T).unwrap(), [2.0, 3.0]);
        assert_eq!(part.time(1), trace.time(3));
    }

    #[test]
    fn a_signal_of_another_length_is_refused() {
        let error = Trace::new(0.0, 1.0, Hold::Zoh)
            .with(Signal::T, vec![0.0; 4])
            .and_then(|t| t.with(Signal::Theta1, vec![0.0; 3]))
            .unwrap_err();
        assert!(error.to_string().contains("theta1"), "{error}");
    }
}
