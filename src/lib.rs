//! `eixo`: the drive axis of a machine tool as a co-simulation FMU of FMI 2.0 or 3.0, its identification from logged traces,
//! and the diagnosis of the gap between the model and the machine.
//!
//! This crate is the program: its commands, its reports, a machine's circle, the FMUs that it writes. What it stands on are crates of
//! their own, under names by which the program and its tests have them here:
//!
//! ```text
//! eixo_model         axis, drive, effects, scalar                depends on nothing
//! eixo_fmu           fmi2, fmi3, variables                       -> eixo_model
//! eixo_records       trace                                       -> eixo_model
//! eixo_estimation    numerics, conditioning, hypothesis, control,
//!                    identify, examine, diagnose                 -> eixo_model, eixo_records
//! eixo_validator     fmu (all but fmu::package)                  -> eixo_records
//! ```
//!
//! Imports run downward only: `cli -> fleet -> report -> circle`, `cli -> serve`, `cli -> package -> circle`, and from each of them to the
//! crates.

pub use eixo_estimation::{control, diagnose, examine, identify, numerics};
pub use eixo_fmu::{fmi2, fmi3, variables};
pub use eixo_model::{axis, drive, effects, scalar};
pub use eixo_records as trace;

/// FMUs: what [`eixo_validator`] knows of them from the outside, and how the axis becomes one.
pub mod fmu {
    pub use crate::package;
    pub use eixo_validator::*;
}

pub mod circle;
pub mod cli;
pub mod fleet;
pub mod package;
pub mod report;
pub mod serve;
