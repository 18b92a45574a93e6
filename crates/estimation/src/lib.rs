//! Estimation: from records to parameters, and from what the parameters leave unexplained to a cause. It knows the model, the record
//! and statistics; it reads no file, knows no FMI and writes no sentence for a reader.
//!
//! Imports run downward only: `diagnose -> control -> hypothesis -> conditioning -> numerics`, `diagnose -> examine -> numerics` and
//! `identify -> numerics`, each over [`eixo_records`] and [`eixo_model`].

pub mod conditioning;
pub mod control;
pub mod diagnose;
pub mod examine;
pub mod hypothesis;
pub mod identify;
pub mod numerics;

use eixo_model::{axis, drive, effects, scalar};
use eixo_records as trace;

// What a machine lacks is said in one way by all tests.
#[cfg(test)]
#[path = "../../../tests/program/skip.rs"]
mod skip;
