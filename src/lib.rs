//! `eixo`: the drive axis of a machine tool as a co-simulation FMU of FMI 2.0 or 3.0, its identification from logged traces,
//! and the diagnosis of the gap between the model and the machine.
//!
//! Imports run downward only: `cli -> fleet -> report -> diagnose -> identify -> trace -> axis -> effects`,
//! `cli -> examine -> trace`, `diagnose, identify, examine -> numerics`, `cli -> serve -> trace`, `cli -> fmu -> variables -> axis`, `fmi2 -> variables` and `fmi3 -> fmi2`.

pub use eixo_estimation::{diagnose, examine, identify, numerics};
pub use eixo_fmu::{fmi2, fmi3, variables};
pub use eixo_model::{axis, drive, effects, scalar};
pub use eixo_records as trace;

pub mod circle;
pub mod cli;
pub mod fleet;
pub mod fmu;
pub mod report;
pub mod serve;

// What a machine lacks is said in one way by unit tests and by the program's.
#[cfg(test)]
#[path = "../tests/program/skip.rs"]
mod skip;
