//! Why a call was refused, as the text of a log line. Numbers and names only, so that refusing needs no heap.

use std::fmt;

use super::sequence::Mode;
use super::step_error::StepError;
use crate::axis::ParameterError;
use crate::variables::Named;

/// A refused call. Nothing has changed.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Fault {
    /// Not allowed at this place of the call sequence.
    Mode(Mode),
    /// `fmi2SetupExperiment` is missing.
    NotSetUp,
    /// A null pointer for this argument.
    Null(&'static str),
    /// No variable of the type has this value reference.
    Reference { reference: u32, wanted: &'static str },
    /// The variable may not be set now.
    NotSettable { index: Named, mode: Mode },
    /// NaN or infinity.
    NotFinite { index: Named, value: f64 },
    /// An output that is no finite number any more.
    NoNumber { index: Named, value: f64 },
    /// Out of the bounds of the variable.
    Bounds { index: Named, value: f64 },
    /// An argument that must be a finite number, and greater than zero where the standard asks for it.
    Number { name: &'static str, value: f64, must_be: &'static str },
    /// A communication point that is not where the last step ended.
    Time { given: f64, expected: f64 },
    /// A step past the end of the experiment.
    PastStop { end: f64, stop: f64 },
    /// No input, or no output, where one is needed.
    Not { index: Named, what: &'static str },
    /// An order of derivatives that is not offered.
    Order(i32),
    /// A state that this instance did not make.
    UnknownState,
    /// A stored state that cannot be read.
    Stored(&'static str),
    /// Not as many values as scalars.
    Count { given: usize, needed: usize },
    /// Too small a buffer.
    Buffer { given: usize, needed: usize },
    /// A log category that is not declared.
    Category,
    /// A status kind that is not offered.
    StatusKind(i32),
    /// The parameters make no axis.
    Parameter(ParameterError),
    /// The step could not be done.
    Step(StepError),
}

impl From<ParameterError> for Fault {
    fn from(error: ParameterError) -> Self {
        Self::Parameter(error)
    }
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Mode(mode) => write!(f, "not allowed {mode}"),
            Self::NotSetUp => f.write_str("fmi2SetupExperiment must be called first"),
            Self::Null(name) => write!(f, "{name} is a null pointer"),
            Self::Reference { reference, wanted } => write!(f, "no {wanted} variable has value reference {reference}"),
            Self::NotSettable { index, mode } => {
                let v = index.variable();
                write!(f, "{v} ({:?} {:?}) cannot be set {mode}", v.variability, v.causality)
            }
            Self::NotFinite { index, value } => write!(f, "{} = {value}: it must be a finite number", index),
            Self::NoNumber { index, value } => {
                write!(f, "{index} is {value}: check the start values, the parameters and the inputs")
            }
            Self::Bounds { index, value } => {
                let v = index.variable();
                let (min, max) = (v.min.unwrap_or(f64::NEG_INFINITY), v.max.unwrap_or(f64::INFINITY));
                write!(f, "{v} = {value:?}: it must be from {min:?} to {max:?}")
            }
            Self::Number { name, value, must_be } => write!(f, "{name} = {value}: it must be {must_be}"),
            Self::Time { given, expected } => {
                write!(f, "currentCommunicationPoint = {given} s, but the last step ended at {expected} s")
            }
            Self::PastStop { end, stop } => write!(f, "the step ends at {end} s, after the stop time {stop} s"),
            Self::Not { index, what } => write!(f, "{} is no {what}", index),
            Self::Order(order) => write!(f, "order {order}: only derivatives of order 1 are offered"),
            Self::UnknownState => f.write_str("this FMU state is none of this instance, or has been freed"),
            Self::Stored(why) => write!(f, "the serialised state cannot be used: {why}"),
            Self::Count { given, needed } => {
                write!(f, "{given} values for {needed} value references: every variable is a scalar")
            }
            Self::Buffer { given, needed } => write!(f, "the buffer has {given} bytes, {needed} are needed"),
            Self::Category => f.write_str("a log category that modelDescription.xml does not declare"),
            Self::StatusKind(kind) => write!(f, "status kind {kind} is not offered: steps are never pending"),
            Self::Parameter(error) => error.fmt(f),
            Self::Step(error) => error.fmt(f),
        }
    }
}
