//! Why a communication step was not done.

use std::fmt;

use crate::axis::ParameterError;
use crate::effects::Effect;

/// Most internal steps in one communication step: about a second of work with every effect on, so that no call is taken
/// for one that hangs.
pub(super) const MOST_STEPS: f64 = 2e6;

/// Why a step could not be done. Nothing has changed then, but for [`StepError::NotFinite`].
#[derive(Debug, Clone, PartialEq)]
pub enum StepError {
    /// The parameters make no axis.
    Parameter(ParameterError),
    /// Too many internal steps in one communication step.
    TooLong {
        /// The communication step, s.
        step: f64,
        /// The longest internal step, s.
        internal: f64,
    },
    /// A delay longer than what is remembered.
    Delay {
        /// What is delayed.
        effect: Effect,
        /// The delay, s.
        delay: f64,
        /// The internal step, s.
        internal: f64,
    },
    /// The motion left the range of numbers.
    NotFinite {
        /// Communication point, s.
        time: f64,
    },
}

impl fmt::Display for StepError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Parameter(error) => error.fmt(f),
            Self::TooLong { step, internal } => {
                write!(
                    f,
                    "a step of {step} s holds more than {MOST_STEPS:e} internal steps of {internal} s: raise dt_internal"
                )
            }
            Self::Delay { effect, delay, internal } => {
                let info = effect.info();
                let name = effect.delay_parameter().map_or("", |i| info.parameters[i].name);
                write!(
                    f,
                    "{}.{name} = {delay} s reaches back further than the history of past steps at an internal step of \
                     {internal} s: use longer steps or a shorter delay",
                    info.id
                )
            }
            Self::NotFinite { time } => {
                write!(
                    f,
                    "the motion is no longer finite after the step from {time} s: check the parameters and the step"
                )
            }
        }
    }
}

impl From<ParameterError> for StepError {
    fn from(error: ParameterError) -> Self {
        Self::Parameter(error)
    }
}
