//! The functions of `fmi2Functions.h` for co-simulation.
//!
//! # Safety
//! All of them, as the standard asks of importers: an instance is a null pointer or one that `fmi2Instantiate` gave and
//! that has not been freed, and is used by one thread at a time; an array holds as many entries as its length states.

#![allow(unsafe_code)]
#![allow(non_snake_case, reason = "the names are the standard's")]
#![allow(clippy::missing_safety_doc, clippy::too_many_arguments, reason = "the module's head says it for all")]
#![allow(missing_docs, reason = "documented by the standard")]

mod lifecycle;
mod states;
mod steps;
mod values;

use std::slice;

use super::abi::Status;
use super::fault::Fault;
use super::gate::Body;

pub use lifecycle::*;
pub use states::*;
pub use steps::*;
pub use values::*;

/// `enter` for the functions below.
macro_rules! call {
    ($c:expr, $function:ident, $call:expr) => {{
        let call = typed($call);
        // SAFETY: the importer's, see the module's head.
        unsafe { gate::enter($c, Function::$function, call) as c_int }
    }};
}

pub(crate) use lifecycle::choose_categories;
pub(crate) use states::{deserialise, free_state, get_state, serialise, serialised_size, set_state};
pub(crate) use steps::step;
pub(crate) use values::{directional, finite_value, none_of, output_derivatives, resolve, set};

use call;

/// Tells the compiler what a closure for the gate takes.
pub(crate) fn typed<F: FnOnce(&mut Body) -> Result<Status, Fault>>(call: F) -> F {
    call
}

/// An array from C.
///
/// # Safety
/// `data` is null or holds `len` entries that live through the call.
pub(crate) unsafe fn array<'a, T>(data: *const T, len: usize, name: &'static str) -> Result<&'a [T], Fault> {
    match len {
        0 => Ok(&[]),
        _ if data.is_null() || !data.is_aligned() => Err(Fault::Null(name)),
        // SAFETY: neither null nor out of alignment, and as long as said.
        _ => Ok(unsafe { slice::from_raw_parts(data, len) }),
    }
}

/// The same to write to.
///
/// # Safety
/// `data` is null or holds `len` entries that live through the call and that nothing else refers to.
pub(crate) unsafe fn array_mut<'a, T>(data: *mut T, len: usize, name: &'static str) -> Result<&'a mut [T], Fault> {
    match len {
        0 => Ok(&mut []),
        _ if data.is_null() || !data.is_aligned() => Err(Fault::Null(name)),
        // SAFETY: neither null nor out of alignment, and as long as said.
        _ => Ok(unsafe { slice::from_raw_parts_mut(data, len) }),
    }
}
