//! The drive axis: two inertias joined by a spring and a damper, stepped in time.
//!
//! ```text
//! I1*a1 + B*(w1 - w2) + K*(th1 - th2) = T     motor and screw     (paper, eq. 2)
//! I2*a2 - B*(w1 - w2) - K*(th1 - th2) = 0     table
//! x2 = rho*th2                                table position
//! ```
//!
//! Effects of [`crate::effects`] add forces to either row, and change the torque on its way in and the positions on
//! their way out. The linear analogue (kg, N, m) is the same model in other units.

mod along;
mod axis_model;
mod continuation;
mod coupled;
mod criterion;
mod events;
mod mechanics;
mod newton;
mod oscillator;
mod parameters;
mod propagator;
mod segment;
mod simulate;
mod single_law;
mod step;
mod stick;

pub use along::Course;
pub use axis_model::{Axis, State};
pub use criterion::{dt_criterion, period_elongation};
pub use oscillator::Scheme;
pub use parameters::{AxisKind, Modal, ParameterError, Parameters, PhysicalData, Structure};
pub use propagator::{Linear, Propagator};
pub use simulate::{Hold, Response, SimulateOptions, simulate, substeps, substeps_at_speed};

#[cfg(test)]
pub(crate) mod tests;
