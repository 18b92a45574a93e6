//! Why a simulation was not made, or ended early.

use super::super::host::HostError;
use crate::trace::{TraceError, number};

/// Why a run could not be made, or ended early.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SimulateError {
    /// The FMU cannot be used.
    #[error(transparent)]
    Host(#[from] HostError),
    /// The input file cannot be used.
    #[error(transparent)]
    Trace(#[from] TraceError),
    /// The input file has no time.
    #[error("{file}: no column named time; the columns are: {present}")]
    NoTime {
        /// The file.
        file: String,
        /// Its columns.
        present: String,
    },
    /// No column of the input file is an input of the FMU.
    #[error("{file}: no column is an input of the FMU; the columns are: {present}; the inputs are: {wanted}{near}")]
    NoInput {
        /// The file.
        file: String,
        /// Its columns.
        present: String,
        /// The FMU's inputs.
        wanted: String,
        /// A near miss.
        near: String,
    },
    /// A part of the inputs with too few samples, or too many.
    #[error(
        "{left:.0} samples of the input lie from {from} s to {to} s at the steps asked for; give other --from, --to or --resample"
    )]
    Part {
        /// From when, s.
        from: f64,
        /// Until when, s.
        to: f64,
        /// Samples there.
        left: f64,
    },
    /// No column of the reference results is a variable of the FMU.
    #[error("{file}: no column is a variable of the FMU; the columns are: {present}; the outputs are: {wanted}")]
    NoReference {
        /// The file.
        file: String,
        /// Its columns.
        present: String,
        /// The FMU's outputs.
        wanted: String,
    },
    /// A unit that is not the FMU's.
    #[error("{file}: column {column} is in [{unit}], but the FMU takes it in {wanted}: convert the column")]
    Unit {
        /// The file.
        file: String,
        /// The column.
        column: String,
        /// Its unit.
        unit: String,
        /// The FMU's unit.
        wanted: String,
    },
    /// No such variable.
    #[error("the FMU has no {what} named {name:?}{near}")]
    Unknown {
        /// What was looked for.
        what: &'static str,
        /// The name given.
        name: String,
        /// A near miss.
        near: String,
    },
    /// A value that its variable cannot take.
    #[error("{name} = {value}: {why}")]
    Value {
        /// The variable.
        name: String,
        /// The value given.
        value: String,
        /// What it must be.
        why: String,
    },
    /// No step size to be found.
    #[error(
        "neither the input nor the FMU's default experiment gives a step: the input's times are not uniform, or there is \
         no input; give --step"
    )]
    NoStep,
    /// No end to be found.
    #[error("neither the input nor the FMU's default experiment gives an end: give --stop")]
    NoStop,
    /// An experiment that cannot be run.
    #[error("from {} s to {} s in steps of {} s: {why}", number(*start), number(*stop), number(*step))]
    Experiment {
        /// Start, s.
        start: f64,
        /// End, s.
        stop: f64,
        /// Step, s.
        step: f64,
        /// What is wrong.
        why: &'static str,
    },
    /// The FMU refused to go on.
    #[error("the FMU stopped at {time} s: {what}{}", log_text(.log))]
    Stopped {
        /// Communication point, s.
        time: f64,
        /// What it printed.
        what: String,
        /// Its last log messages.
        log: Vec<String>,
    },
    /// Event mode or early return with an FMU that has none.
    #[error("{option}: {why}")]
    NotOffered {
        /// What was asked for.
        option: &'static str,
        /// Why it cannot be.
        why: &'static str,
    },
    /// What became of the child process that ran the FMU.
    #[error("{0}")]
    Child(String),
}

fn log_text(log: &[String]) -> String {
    if log.is_empty() { String::new() } else { format!("; its log: {}", log.join("; ")) }
}
