//! The FMU: FMI 2.0 co-simulation, its C ABI and the simulation behind it, which [`crate::fmi3`] shares.
//!
//! [`simulation`] is what runs, in safe code and without a heap: [`kernel`] is the axis, [`drive`] the drive, [`stored`] its
//! state as bytes. Every call from C passes `gate` (null check, `catch_unwind`) and `sequence` (which call is legal when) to
//! `exports`, the functions of `fmi2Functions.h`. No globals: everything lives in the instance.

mod abi;
mod baked;
pub mod drive;
mod exports;
mod fault;
mod gate;
pub mod kernel;
mod log;
mod outputs;
mod sequence;
pub mod simulation;
pub mod step_error;
pub mod stored;

pub use abi::*;
pub use baked::bake;
pub(crate) use baked::starts;
pub use exports::*;
pub(crate) use exports::{
    array, array_mut, choose_categories, deserialise, directional, finite_value, free_state, get_state, none_of,
    output_derivatives, resolve, serialise, serialised_size, set, set_state, step, typed,
};
pub(crate) use fault::Fault;
pub(crate) use gate::{Body, create, destroy, enter, text};
pub(crate) use log::{Log, Sink};
pub(crate) use sequence::Function;
pub use sequence::Mode;
