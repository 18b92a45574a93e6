//! Making, initialising, resetting and freeing an instance, and its log (FMI 3.0, sections 2.3.1 to 2.3.4).

use std::ffi::{CStr, c_int, c_void};
use std::panic::catch_unwind;

use super::{Instance, LogMessage, call};
use crate::fmi2::{Log, Sink, Status, Text, array, choose_categories, create, destroy, starts, text};
use crate::variables::guid;

#[unsafe(no_mangle)]
pub extern "C" fn fmi3GetVersion() -> Text {
    c"3.0".as_ptr()
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3InstantiateCoSimulation(
    name: Text,
    token: Text,
    _resources: Text,
    _visible: u8,
    logging: u8,
    event_mode_used: u8,
    _early_return_allowed: u8,
    _required: *const u32,
    _required_count: usize,
    environment: *mut c_void,
    message: Option<LogMessage>,
    _intermediate: *const c_void,
) -> Instance {
    let made = catch_unwind(|| {
        // SAFETY: null or C strings by the standard's contract. The name is copied, for importers that free theirs.
        let (name, given) = unsafe {
            let name = if name.is_null() { c"" } else { CStr::from_ptr(name) };
            (name.to_owned(), text(token))
        };
        let on = logging != 0;
        let log = Log { name, sink: Sink::Three { environment, message }, on: [on, on, true, true] };
        let refuse = |why: std::fmt::Arguments<'_>| {
            log.send(Status::Error, format_args!("fmi3InstantiateCoSimulation: {why}"));
            std::ptr::null_mut()
        };
        if log.name.to_bytes().trim_ascii().is_empty() {
            return refuse(format_args!("instanceName is empty"));
        }
        if event_mode_used != 0 {
            return refuse(format_args!("eventModeUsed: this FMU has no event mode (hasEventMode is false)"));
        }
        let starts = starts();
        let own = guid(&starts);
        if !own.is(given) {
            return refuse(format_args!(
                "the instantiationToken {given} is not this binary's, {own}: modelDescription.xml belongs to another binary"
            ));
        }
        create(starts, log)
    });
    made.unwrap_or(std::ptr::null_mut())
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3FreeInstance(c: Instance) {
    // SAFETY: the importer's, see the module's head. Freeing cannot panic; were it to, it must not unwind into C.
    let _ = catch_unwind(|| unsafe { destroy(c) });
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3SetDebugLogging(c: Instance, on: u8, count: usize, categories: *const Text) -> c_int {
    call!(c, fmi3SetDebugLogging, |body| {
        // SAFETY: the importer's.
        let categories = unsafe { array(categories, count, "categories") }?;
        // SAFETY: C strings or null, by the standard's contract.
        unsafe { choose_categories(body, on != 0, categories) }
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3EnterInitializationMode(
    c: Instance,
    tolerance_defined: u8,
    tolerance: f64,
    start: f64,
    stop_defined: u8,
    stop: f64,
) -> c_int {
    call!(c, fmi3EnterInitializationMode, |body| {
        let tolerance = (tolerance_defined != 0).then_some(tolerance);
        body.set_up(tolerance, start, (stop_defined != 0).then_some(stop))?;
        body.enter_initialisation()?;
        Ok(Status::Ok)
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3ExitInitializationMode(c: Instance) -> c_int {
    call!(c, fmi3ExitInitializationMode, |body| {
        body.exit_initialisation()?;
        Ok(Status::Ok)
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3Terminate(c: Instance) -> c_int {
    call!(c, fmi3Terminate, |body| {
        body.terminate();
        Ok(Status::Ok)
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3Reset(c: Instance) -> c_int {
    call!(c, fmi3Reset, |body| {
        body.reset();
        Ok(Status::Ok)
    })
}
