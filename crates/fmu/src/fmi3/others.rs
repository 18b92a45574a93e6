//! Functions of what the FMU does not offer, which must be there all the same (FMI 3.0, section 2.2.1): other interfaces,
//! clocks, adjoint derivatives, dependencies of elements.

use std::ffi::{c_int, c_void};

use super::{Instance, LogMessage, call};
use crate::fmi2::{Status, Text, array, none_of};

#[unsafe(no_mangle)]
pub extern "C" fn fmi3InstantiateModelExchange(
    _name: Text,
    _token: Text,
    _resources: Text,
    _visible: u8,
    _logging: u8,
    _environment: *mut c_void,
    _message: Option<LogMessage>,
) -> Instance {
    std::ptr::null_mut()
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi3InstantiateScheduledExecution(
    _name: Text,
    _token: Text,
    _resources: Text,
    _visible: u8,
    _logging: u8,
    _environment: *mut c_void,
    _message: Option<LogMessage>,
    _clock_update: *const c_void,
    _lock: *const c_void,
    _unlock: *const c_void,
) -> Instance {
    std::ptr::null_mut()
}

/// There are no clocks: every value reference is refused.
macro_rules! no_clock {
    ($($name:ident ($($arg:ident: $kind:ty),*);)*) => {$(
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $name(c: Instance, vr: *const u32, count: usize, $($arg: $kind),*) -> c_int {
            // SAFETY: the importer's.
            call!(c, $name, |_| none_of(unsafe { array(vr, count, "valueReferences") }?, "Clock"))
        }
    )*};
}

no_clock! {
    fmi3GetClock(_values: *mut u8);
    fmi3SetClock(_values: *const u8);
    fmi3GetIntervalDecimal(_intervals: *mut f64, _qualifiers: *mut c_int);
    fmi3GetIntervalFraction(_counters: *mut u64, _resolutions: *mut u64, _qualifiers: *mut c_int);
    fmi3GetShiftDecimal(_shifts: *mut f64);
    fmi3GetShiftFraction(_counters: *mut u64, _resolutions: *mut u64);
    fmi3SetIntervalDecimal(_intervals: *const f64);
    fmi3SetIntervalFraction(_counters: *const u64, _resolutions: *const u64);
    fmi3SetShiftDecimal(_shifts: *const f64);
    fmi3SetShiftFraction(_counters: *const u64, _resolutions: *const u64);
}

/// Not offered, as the capability flags declare.
macro_rules! not_offered {
    ($($name:ident ($($arg:ident: $kind:ty),*);)*) => {$(
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $name(c: Instance, $($arg: $kind),*) -> c_int {
            call!(c, $name, |_| Ok(Status::Error))
        }
    )*};
}

not_offered! {
    fmi3GetAdjointDerivative(
        _unknowns: *const u32,
        _unknown_count: usize,
        _knowns: *const u32,
        _known_count: usize,
        _seed: *const f64,
        _seeds: usize,
        _sensitivity: *mut f64,
        _sensitivities: usize
    );
    fmi3GetNumberOfVariableDependencies(_reference: u32, _count: *mut usize);
    fmi3GetVariableDependencies(
        _reference: u32,
        _elements: *mut usize,
        _independents: *mut u32,
        _independent_elements: *mut usize,
        _kinds: *mut c_int,
        _count: usize
    );
    // Of model exchange and scheduled execution: some importers (FMPy) look every function up.
    fmi3EnterContinuousTimeMode();
    fmi3CompletedIntegratorStep(_no_set_state_before: u8, _enter_event_mode: *mut u8, _terminate: *mut u8);
    fmi3SetTime(_time: f64);
    fmi3SetContinuousStates(_states: *const f64, _count: usize);
    fmi3GetContinuousStateDerivatives(_derivatives: *mut f64, _count: usize);
    fmi3GetEventIndicators(_indicators: *mut f64, _count: usize);
    fmi3GetContinuousStates(_states: *mut f64, _count: usize);
    fmi3GetNominalsOfContinuousStates(_nominals: *mut f64, _count: usize);
    fmi3GetNumberOfEventIndicators(_count: *mut usize);
    fmi3GetNumberOfContinuousStates(_count: *mut usize);
    fmi3ActivateModelPartition(_clock: u32, _time: f64);
}
