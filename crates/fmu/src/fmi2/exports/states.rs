//! Copies of the state, in memory and as bytes.

use std::ffi::{c_char, c_int};

use super::super::abi::{Component, FmuState, Status};
use super::super::fault::Fault;
use super::super::gate::{self, Body};
use super::super::sequence::Function;
use super::super::stored::{self, Snapshot};
use super::{array, array_mut, call, typed};

/// A state of this instance, by its pointer.
fn state_of(body: &Body, state: FmuState) -> Result<&Snapshot, Fault> {
    if !body.states.contains(&(state as usize)) {
        return Err(Fault::UnknownState);
    }
    // SAFETY: every address in the set is a boxed snapshot that has not been freed.
    Ok(unsafe { &*state.cast::<Snapshot>() })
}

/// Keeps a snapshot and gives its pointer.
fn keep(body: &mut Body, snapshot: Snapshot) -> FmuState {
    let state: FmuState = Box::into_raw(Box::new(snapshot)).cast();
    body.states.insert(state as usize);
    state
}

/// Takes a copy of the state, over one that is handed in.
///
/// # Safety
/// `state` is null or a place for a pointer.
pub(crate) unsafe fn get_state(body: &mut Body, state: *mut FmuState) -> Result<Status, Fault> {
    // SAFETY: the caller's.
    let [state] = (unsafe { array_mut(state, 1, "FMUstate") })? else { return Err(Fault::Null("FMUstate")) };
    let snapshot = body.snapshot();
    if state.is_null() {
        *state = keep(body, snapshot);
    } else if body.states.contains(&(*state as usize)) {
        // SAFETY: the address of a boxed snapshot of this instance; nothing else refers to it.
        unsafe { *state.cast::<Snapshot>() = snapshot };
    } else {
        return Err(Fault::UnknownState);
    }
    Ok(Status::Ok)
}

/// Goes back to a copy.
pub(crate) fn set_state(body: &mut Body, state: FmuState) -> Result<Status, Fault> {
    let to = *state_of(body, state)?;
    body.go_back(&to);
    Ok(Status::Ok)
}

/// Frees a copy.
///
/// # Safety
/// As [`get_state`].
pub(crate) unsafe fn free_state(body: &mut Body, state: *mut FmuState) -> Result<Status, Fault> {
    // SAFETY: the caller's.
    let [state] = (unsafe { array_mut(state, 1, "FMUstate") })? else { return Err(Fault::Null("FMUstate")) };
    if state.is_null() {
        return Ok(Status::Ok);
    }
    if !body.states.remove(&(*state as usize)) {
        return Err(Fault::UnknownState);
    }
    // SAFETY: the address was in the set: a boxed snapshot that has not been freed.
    drop(unsafe { Box::from_raw(state.cast::<Snapshot>()) });
    *state = std::ptr::null_mut();
    Ok(Status::Ok)
}

/// Number of bytes of a copy.
///
/// # Safety
/// `size` is null or a place for a number.
pub(crate) unsafe fn serialised_size(body: &mut Body, state: FmuState, size: *mut usize) -> Result<Status, Fault> {
    let needed = stored::size(&state_of(body, state)?.kernel);
    // SAFETY: the caller's.
    unsafe { array_mut(size, 1, "size") }?.fill(needed);
    Ok(Status::Ok)
}

/// Writes a copy as bytes.
///
/// # Safety
/// `bytes` is null or has room for `size` bytes.
pub(crate) unsafe fn serialise(body: &mut Body, state: FmuState, bytes: *mut u8, size: usize) -> Result<Status, Fault> {
    let snapshot = state_of(body, state)?;
    // SAFETY: the caller's.
    let buffer = unsafe { array_mut(bytes, size, "serializedState") }?;
    if stored::write(snapshot, &body.starts, buffer) {
        Ok(Status::Ok)
    } else {
        Err(Fault::Buffer { given: size, needed: stored::size(&snapshot.kernel) })
    }
}

/// Makes a copy from bytes.
///
/// # Safety
/// `bytes` is null or holds `size` bytes; `state` is null or a place for a pointer.
pub(crate) unsafe fn deserialise(
    body: &mut Body,
    bytes: *const u8,
    size: usize,
    state: *mut FmuState,
) -> Result<Status, Fault> {
    // SAFETY: the caller's.
    let (bytes, out) = unsafe { (array(bytes, size, "serializedState")?, array_mut(state, 1, "FMUstate")?) };
    let snapshot = stored::read(&body.starts, bytes).map_err(Fault::Stored)?;
    out.fill(keep(body, snapshot));
    Ok(Status::Ok)
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2GetFMUstate(c: Component, state: *mut FmuState) -> c_int {
    // SAFETY: the importer's; so for all below.
    call!(c, fmi2GetFMUstate, |body| unsafe { get_state(body, state) })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2SetFMUstate(c: Component, state: FmuState) -> c_int {
    call!(c, fmi2SetFMUstate, |body| set_state(body, state))
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2FreeFMUstate(c: Component, state: *mut FmuState) -> c_int {
    // SAFETY: the importer's.
    call!(c, fmi2FreeFMUstate, |body| unsafe { free_state(body, state) })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2SerializedFMUstateSize(c: Component, state: FmuState, size: *mut usize) -> c_int {
    // SAFETY: the importer's.
    call!(c, fmi2SerializedFMUstateSize, |body| unsafe { serialised_size(body, state, size) })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2SerializeFMUstate(
    c: Component,
    state: FmuState,
    bytes: *mut c_char,
    size: usize,
) -> c_int {
    // SAFETY: the importer's.
    call!(c, fmi2SerializeFMUstate, |body| unsafe { serialise(body, state, bytes.cast(), size) })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2DeSerializeFMUstate(
    c: Component,
    bytes: *const c_char,
    size: usize,
    state: *mut FmuState,
) -> c_int {
    // SAFETY: the importer's.
    call!(c, fmi2DeSerializeFMUstate, |body| unsafe { deserialise(body, bytes.cast(), size, state) })
}
