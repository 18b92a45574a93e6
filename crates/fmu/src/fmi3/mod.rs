//! The FMU in FMI 3.0: a second C ABI over the simulation of [`crate::fmi2`]: the same variables by the same value
//! references, the same gate (null check, call sequence, `catch_unwind`), the same states.
//!
//! A Real is a `Float64`, an enumeration an `Int64`; in addition to the table there is the independent variable
//! ([`TIME_REFERENCE`]), which FMI 3.0 asks for. There is no event mode (`hasEventMode` is false), no early return, and
//! nothing is updated between communication points.
//!
//! # Safety
//! All functions, as the standard asks of importers: an instance is a null pointer or one that
//! `fmi3InstantiateCoSimulation` gave and that has not been freed, and is used by one thread at a time; an array holds as
//! many entries as its argument for the length states.

#![allow(unsafe_code)]
#![allow(non_snake_case, reason = "the names are the standard's")]
#![allow(clippy::missing_safety_doc, clippy::too_many_arguments, reason = "the module's head says it for all")]
#![allow(missing_docs, reason = "documented by the standard")]

mod lifecycle;
mod others;
mod states;
mod steps;
mod values;

use std::ffi::c_void;

pub use lifecycle::*;
pub use others::*;
pub use states::*;
pub use steps::*;
pub use values::*;

/// Value reference of the independent variable, which no variable of the tables has.
pub const TIME_REFERENCE: u32 = 65_535;

/// `fmi3Instance`.
pub type Instance = *mut c_void;
/// `fmi3LogMessageCallback`: environment, status, category, message.
pub type LogMessage = unsafe extern "C" fn(*mut c_void, i32, crate::fmi2::Text, crate::fmi2::Text);

/// `enter` for the functions below.
macro_rules! call {
    ($c:expr, $function:ident, $call:expr) => {{
        let call = crate::fmi2::typed($call);
        // SAFETY: the importer's, see the module's head.
        unsafe { crate::fmi2::enter($c, crate::fmi2::Function::$function, call) as std::ffi::c_int }
    }};
}

use call;
