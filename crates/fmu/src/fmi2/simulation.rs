//! The simulation behind an instance: the axis or the drive.

use super::drive::DriveKernel;
use super::kernel::Kernel;
use super::step_error::StepError;
use crate::axis::ParameterError;
use crate::variables::{Model, Starts};

/// One of the library's models at work. `Copy`: getting and setting the FMU state is one copy.
#[derive(Debug, Clone, Copy)]
#[allow(clippy::large_enum_variant, reason = "a state is copied as a whole, without a heap")]
pub enum Simulation {
    /// The drive axis.
    Axis(Kernel),
    /// The drive.
    Drive(DriveKernel),
}

macro_rules! each {
    ($self:ident, $kernel:ident => $call:expr) => {
        match $self {
            Simulation::Axis($kernel) => $call,
            Simulation::Drive($kernel) => $call,
        }
    };
}

impl Simulation {
    /// A simulation at its start values.
    #[must_use]
    pub fn new(starts: &Starts) -> Self {
        match starts.model {
            Model::Axis => Self::Axis(Kernel::new(starts)),
            Model::Drive => Self::Drive(DriveKernel::new(starts)),
        }
    }

    /// Which model this is.
    #[must_use]
    pub fn model(&self) -> Model {
        match self {
            Self::Axis(_) => Model::Axis,
            Self::Drive(_) => Model::Drive,
        }
    }

    /// Start and end of the experiment, s.
    pub fn set_experiment(&mut self, start: f64, stop: f64) {
        each!(self, k => k.set_experiment(start, stop));
    }

    /// Communication point, s.
    #[must_use]
    pub fn time(&self) -> f64 {
        each!(self, k => k.time())
    }

    /// End of the experiment, s; infinite where none is set.
    #[must_use]
    pub fn stop(&self) -> f64 {
        each!(self, k => k.stop())
    }

    /// Sets an input or a parameter; the caller checks that it may be set now.
    #[inline]
    pub fn set(&mut self, index: usize, value: f64) {
        each!(self, k => k.set(index, value));
    }

    /// Sets the derivative of an input over the step to come.
    pub fn set_rate(&mut self, index: usize, rate: f64) {
        match self {
            Self::Axis(axis) => axis.set_rate(rate),
            Self::Drive(drive) => drive.set_rate(index, rate),
        }
    }

    /// Ends the initialisation.
    ///
    /// # Errors
    /// When the parameters make no axis.
    pub fn initialise(&mut self) -> Result<(), ParameterError> {
        match self {
            Self::Axis(axis) => axis.initialise(),
            Self::Drive(_) => Ok(()),
        }
    }

    /// Advances from the communication point by `length` s.
    ///
    /// # Errors
    /// See [`StepError`].
    #[inline]
    pub fn step(&mut self, from: f64, length: f64) -> Result<(), StepError> {
        each!(self, k => k.step(from, length))
    }

    /// A value.
    ///
    /// # Errors
    /// When the parameters make no axis.
    #[inline]
    pub fn get(&mut self, index: usize) -> Result<f64, ParameterError> {
        match self {
            Self::Axis(axis) => axis.get(index),
            Self::Drive(drive) => Ok(drive.get(index)),
        }
    }

    /// First derivative to time of an output, at the end of the last step; a drive holds its outputs.
    ///
    /// # Errors
    /// When the parameters make no axis.
    pub fn output_derivative(&mut self, index: usize) -> Result<f64, ParameterError> {
        match self {
            Self::Axis(axis) => axis.output_derivative(index),
            Self::Drive(_) => Ok(0.0),
        }
    }

    /// Directional derivative of outputs: see [`Kernel::directional`]; nothing reaches a drive's outputs between samples.
    ///
    /// # Errors
    /// When the parameters make no axis.
    pub fn directional(
        &mut self,
        knowns: impl Iterator<Item = (usize, f64)>,
        mut unknown: impl FnMut(&mut dyn FnMut(usize) -> f64),
    ) -> Result<(), ParameterError> {
        match self {
            Self::Axis(axis) => axis.directional(knowns, unknown),
            Self::Drive(_) => {
                unknown(&mut |_| 0.0);
                Ok(())
            }
        }
    }

    /// Calls `visit` on every number of the simulation, which it may change.
    pub(super) fn visit_numbers(&mut self, visit: &mut impl FnMut(&mut f64)) {
        each!(self, k => k.visit_numbers(visit));
    }

    /// What [`Simulation::restore`] needs beside the numbers of [`Simulation::visit_numbers`].
    pub(super) fn internal_step(&self) -> f64 {
        match self {
            Self::Axis(axis) => axis.internal_step(),
            Self::Drive(_) => 0.0,
        }
    }

    /// Computes what depends on the numbers read; false when one is out of its bounds.
    pub(super) fn restore(&mut self, internal_step: f64) -> bool {
        match self {
            Self::Axis(axis) => axis.restore(internal_step),
            Self::Drive(drive) => drive.is_valid(),
        }
    }
}
