//! Copies of the state, in memory and as bytes (FMI 3.0, section 2.2.6.4).

use std::ffi::c_int;

use super::{Instance, call};
use crate::fmi2::{FmuState, deserialise, free_state, get_state, serialise, serialised_size, set_state};

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3GetFMUState(c: Instance, state: *mut FmuState) -> c_int {
    // SAFETY: the importer's; so for all below.
    call!(c, fmi3GetFMUState, |body| unsafe { get_state(body, state) })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3SetFMUState(c: Instance, state: FmuState) -> c_int {
    call!(c, fmi3SetFMUState, |body| set_state(body, state))
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3FreeFMUState(c: Instance, state: *mut FmuState) -> c_int {
    // SAFETY: the importer's.
    call!(c, fmi3FreeFMUState, |body| unsafe { free_state(body, state) })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3SerializedFMUStateSize(c: Instance, state: FmuState, size: *mut usize) -> c_int {
    // SAFETY: the importer's.
    call!(c, fmi3SerializedFMUStateSize, |body| unsafe { serialised_size(body, state, size) })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3SerializeFMUState(c: Instance, state: FmuState, bytes: *mut u8, size: usize) -> c_int {
    // SAFETY: the importer's.
    call!(c, fmi3SerializeFMUState, |body| unsafe { serialise(body, state, bytes, size) })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3DeserializeFMUState(
    c: Instance,
    bytes: *const u8,
    size: usize,
    state: *mut FmuState,
) -> c_int {
    // SAFETY: the importer's.
    call!(c, fmi3DeserializeFMUState, |body| unsafe { deserialise(body, bytes, size, state) })
}
