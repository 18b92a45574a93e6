//! Making, initialising, resetting and freeing an instance, and its log.

use std::ffi::{CStr, c_int};
use std::panic::catch_unwind;

use super::super::abi::{Callbacks, Component, LOG_CATEGORIES, Status, Text};
use super::super::baked;
use super::super::fault::Fault;
use super::super::gate::{self, Body};
use super::super::log::{Log, Sink};
use super::super::sequence::Function;
use super::{array, call, typed};
use crate::variables::guid;

#[unsafe(no_mangle)]
pub extern "C" fn fmi2GetTypesPlatform() -> Text {
    c"default".as_ptr()
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi2GetVersion() -> Text {
    c"2.0".as_ptr()
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2Instantiate(
    name: Text,
    kind: c_int,
    given_guid: Text,
    _resources: Text,
    callbacks: *const Callbacks,
    _visible: c_int,
    logging: c_int,
) -> Component {
    let made = catch_unwind(|| {
        if callbacks.is_null() {
            return std::ptr::null_mut();
        }
        // SAFETY: not null, and a callbacks structure by the standard's contract. Copied, because the importer need not
        // keep it where it is.
        let callbacks = unsafe { *callbacks };
        // SAFETY: null or a C string by the standard's contract. The name is copied for the same reason.
        let (name, given) = unsafe {
            let name = if name.is_null() { c"" } else { CStr::from_ptr(name) };
            (name.to_owned(), gate::text(given_guid))
        };
        // Errors always, the rest on request.
        let on = logging != 0;
        let log = Log { name, sink: Sink::Two(callbacks), on: [on, on, true, true] };
        let refuse = |why: std::fmt::Arguments<'_>| {
            log.send(Status::Error, format_args!("fmi2Instantiate: {why}"));
            std::ptr::null_mut()
        };
        if log.name.is_empty() {
            return refuse(format_args!("instanceName is empty"));
        }
        if kind != 1 {
            return refuse(format_args!("fmuType = {kind}: this FMU is for co-simulation (1)"));
        }
        let starts = baked::starts();
        let own = guid(&starts);
        if !own.is(given) {
            return refuse(format_args!(
                "the GUID {given} is not this binary's, {own}: modelDescription.xml belongs to another binary"
            ));
        }
        gate::create(starts, log)
    });
    made.unwrap_or(std::ptr::null_mut())
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2FreeInstance(c: Component) {
    // SAFETY: the importer's, see the module's head. Freeing cannot panic; were it to, it must not unwind into C.
    let _ = catch_unwind(|| unsafe { gate::destroy(c) });
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2SetDebugLogging(c: Component, on: c_int, count: usize, categories: *const Text) -> c_int {
    call!(c, fmi2SetDebugLogging, |body| {
        // SAFETY: the importer's.
        let categories = unsafe { array(categories, count, "categories") }?;
        // SAFETY: C strings or null, by the standard's contract.
        unsafe { choose_categories(body, on != 0, categories) }
    })
}

/// Switches log categories on or off; all of them where none is named.
///
/// # Safety
/// The categories are C strings or null.
pub(crate) unsafe fn choose_categories(body: &mut Body, on: bool, categories: &[Text]) -> Result<Status, Fault> {
    let mut chosen = [categories.is_empty(); 4];
    for &category in categories {
        // SAFETY: the caller's.
        let category = unsafe { gate::text(category) };
        match LOG_CATEGORIES.iter().position(|(name, _)| *name == category) {
            Some(i) if i < 4 => chosen[i] = true,
            Some(_) => chosen = [true; 4],
            None => return Err(Fault::Category),
        }
    }
    for (now, _) in body.log.on.iter_mut().zip(chosen).filter(|(_, chosen)| *chosen) {
        *now = on;
    }
    Ok(Status::Ok)
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2SetupExperiment(
    c: Component,
    tolerance_defined: c_int,
    tolerance: f64,
    start: f64,
    stop_defined: c_int,
    stop: f64,
) -> c_int {
    call!(c, fmi2SetupExperiment, |body| {
        let tolerance = (tolerance_defined != 0).then_some(tolerance);
        body.set_up(tolerance, start, (stop_defined != 0).then_some(stop))?;
        Ok(Status::Ok)
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2EnterInitializationMode(c: Component) -> c_int {
    call!(c, fmi2EnterInitializationMode, |body| {
        body.enter_initialisation()?;
        Ok(Status::Ok)
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2ExitInitializationMode(c: Component) -> c_int {
    call!(c, fmi2ExitInitializationMode, |body| {
        body.exit_initialisation()?;
        Ok(Status::Ok)
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2Terminate(c: Component) -> c_int {
    call!(c, fmi2Terminate, |body| {
        body.terminate();
        Ok(Status::Ok)
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2Reset(c: Component) -> c_int {
    call!(c, fmi2Reset, |body| {
        body.reset();
        Ok(Status::Ok)
    })
}
