//! `eixo`: the drive axis of a machine tool as a co-simulation FMU of FMI 2.0 or 3.0, its identification from logged traces,
//! and the diagnosis of the gap between the model and the machine.
//!
//! Imports run downward only: `cli -> fleet -> report -> diagnose -> identify -> trace -> axis -> effects`,
//! `cli -> examine -> trace`, `diagnose, identify, examine -> numerics`, `cli -> serve -> trace`, `cli -> fmu -> variables -> axis`, `fmi2 -> variables` and `fmi3 -> fmi2`.

pub mod axis;
pub mod drive;
pub mod effects;
pub mod fmi2;
pub mod fmi3;
pub mod scalar;
pub mod variables;

#[cfg(feature = "cli")]
pub mod circle;
#[cfg(feature = "cli")]
pub mod cli;
#[cfg(feature = "cli")]
pub mod diagnose;
#[cfg(feature = "cli")]
pub mod examine;
#[cfg(feature = "cli")]
pub mod fleet;
#[cfg(feature = "cli")]
pub mod fmu;
#[cfg(feature = "cli")]
pub mod identify;
#[cfg(feature = "cli")]
pub mod numerics;
#[cfg(feature = "cli")]
pub mod report;
#[cfg(feature = "cli")]
pub mod serve;
#[cfg(feature = "cli")]
pub mod trace;

// What a machine lacks is said in one way by unit tests and by the program's.
#[cfg(test)]
#[path = "../tests/program/skip.rs"]
mod skip;
