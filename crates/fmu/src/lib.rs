//! The FMU's own library: [`eixo_model`] behind the C interface of FMI 2.0 and 3.0. It knows the model, the table of the FMU's
//! variables and the two interfaces; it depends on the model alone, and `build.rs` of the program makes `eixo.so` of it.
//!
//! Imports run downward only: `fmi3 -> fmi2 -> variables -> eixo_model`.

pub mod fmi2;
pub mod fmi3;
pub mod variables;

use eixo_model::{axis, drive, effects, scalar};
