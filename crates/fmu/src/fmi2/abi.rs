//! The types of `fmi2TypesPlatform.h` and `fmi2FunctionTypes.h`.

use std::ffi::{c_char, c_void};

/// `fmi2Component`.
pub type Component = *mut c_void;
/// `fmi2FMUstate`.
pub type FmuState = *mut c_void;
/// `fmi2String`.
pub type Text = *const c_char;

/// `fmi2Status`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(i32)]
pub enum Status {
    /// All well.
    Ok = 0,
    /// Went on, with a warning.
    Warning = 1,
    /// Not done; the instance goes on.
    Discard = 2,
    /// Refused.
    Error = 3,
    /// A fault inside the FMU: only freeing is left.
    Fatal = 4,
    /// Still running; never returned.
    Pending = 5,
}

/// `fmi2CallbackLogger`.
pub type Logger = unsafe extern "C" fn(*mut c_void, Text, i32, Text, Text, ...);

/// `fmi2CallbackFunctions`; the memory functions and `stepFinished` stay unused.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct Callbacks {
    /// Log messages go here.
    pub logger: Option<Logger>,
    /// Unused.
    pub allocate: Option<unsafe extern "C" fn(usize, usize) -> *mut c_void>,
    /// Unused.
    pub free: Option<unsafe extern "C" fn(*mut c_void)>,
    /// Unused.
    pub step_finished: Option<unsafe extern "C" fn(*mut c_void, i32)>,
    /// Handed back to the logger.
    pub environment: *mut c_void,
}

/// The log categories, as the model description declares them: name and sentence.
pub const LOG_CATEGORIES: [(&str, &str); 5] = [
    ("logStatusWarning", "Calls that return fmi2Warning"),
    ("logStatusDiscard", "Calls that return fmi2Discard"),
    ("logStatusError", "Calls that return fmi2Error; logged unless switched off by its category"),
    ("logStatusFatal", "Calls that return fmi2Fatal; logged unless switched off by its category"),
    ("logAll", "Everything"),
];
