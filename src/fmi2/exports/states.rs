//! Copies of the state, in memory and as bytes.

use std::ffi::{c_char, c_int};

use super::super::abi::{Component, FmuState, Status};
use super::super::fault::Fault;
use super::super::gate::{self, Body, Function};
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

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2GetFMUstate(c: Component, state: *mut FmuState) -> c_int {
    call!(c, fmi2GetFMUstate, |body| {
        // SAFETY: the importer's.
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
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2SetFMUstate(c: Component, state: FmuState) -> c_int {
    call!(c, fmi2SetFMUstate, |body| {
        let to = *state_of(body, state)?;
        body.go_back(&to);
        Ok(Status::Ok)
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2FreeFMUstate(c: Component, state: *mut FmuState) -> c_int {
    call!(c, fmi2FreeFMUstate, |body| {
        // SAFETY: the importer's.
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
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2SerializedFMUstateSize(c: Component, state: FmuState, size: *mut usize) -> c_int {
    call!(c, fmi2SerializedFMUstateSize, |body| {
        let needed = stored::size(&state_of(body, state)?.kernel);
        // SAFETY: the importer's.
        unsafe { array_mut(size, 1, "size") }?.fill(needed);
        Ok(Status::Ok)
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2SerializeFMUstate(
    c: Component,
    state: FmuState,
    bytes: *mut c_char,
    size: usize,
) -> c_int {
    call!(c, fmi2SerializeFMUstate, |body| {
        let snapshot = state_of(body, state)?;
        // SAFETY: the importer's.
        let buffer = unsafe { array_mut(bytes.cast::<u8>(), size, "serializedState") }?;
        if stored::write(snapshot, &body.starts, buffer) {
            Ok(Status::Ok)
        } else {
            Err(Fault::Buffer { given: size, needed: stored::size(&snapshot.kernel) })
        }
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2DeSerializeFMUstate(
    c: Component,
    bytes: *const c_char,
    size: usize,
    state: *mut FmuState,
) -> c_int {
    call!(c, fmi2DeSerializeFMUstate, |body| {
        // SAFETY: the importer's.
        let (bytes, out) =
            unsafe { (array(bytes.cast::<u8>(), size, "serializedState")?, array_mut(state, 1, "FMUstate")?) };
        let snapshot = stored::read(&body.starts, bytes).map_err(Fault::Stored)?;
        out.fill(keep(body, snapshot));
        Ok(Status::Ok)
    })
}
