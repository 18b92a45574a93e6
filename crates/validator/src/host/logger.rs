//! The logger callback, which is variadic in C: `logger(environment, name, status, category, message, ...)`.
//!
//! Stable Rust cannot define a variadic function. On the common 64-bit Unix ABIs (x86-64 System V, AArch64 Linux) a
//! variadic call passes its arguments as an ordinary one does: integers and pointers in their registers and then on the
//! stack, floating-point numbers in theirs. So the logger here takes the remaining integer registers, the eight
//! floating-point registers and some stack slots as literal parameters, and hands them to the C library's `snprintf`,
//! which picks what the format asks for. Elsewhere the message is recorded as it stands, with its `%` unexpanded.

#![allow(unsafe_code)]

use std::ffi::{CStr, c_char, c_void};
use std::sync::{Arc, Mutex, PoisonError};

use super::Status;

/// A message that the FMU sent to the logger.
#[derive(Debug, Clone)]
pub struct LogMessage {
    /// Name of the instance, as the FMU passes it.
    pub instance: String,
    /// Status that it reports.
    pub status: Status,
    /// Log category.
    pub category: String,
    /// Text, with its arguments filled in.
    pub message: String,
}

/// Most messages that one instance keeps; later ones are counted only.
const MAX_MESSAGES: usize = 10_000;

/// The sinks of the instances that live. An FMU hands back what it takes for `componentEnvironment`: the pointer is
/// compared with these and never followed, for some FMUs pass one of their own.
static SINKS: Mutex<Vec<Arc<LogSink>>> = Mutex::new(Vec::new());

/// Where an instance's messages go. Its address is the instance's `componentEnvironment`.
#[derive(Debug, Default)]
pub(crate) struct LogSink {
    pub messages: Mutex<(Vec<LogMessage>, usize)>,
}

impl LogSink {
    fn push(&self, message: LogMessage) {
        let mut messages = self.messages.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        if messages.0.len() < MAX_MESSAGES {
            messages.0.push(message);
        } else {
            messages.1 += 1;
        }
    }
}

/// # Safety
/// `text` is null or a C string.
pub(crate) unsafe fn lossy(text: *const c_char) -> String {
    if text.is_null() {
        return String::new();
    }
    // SAFETY: not null, and a C string as the caller vouches.
    unsafe { CStr::from_ptr(text) }.to_string_lossy().into_owned()
}

/// Makes a sink known to the logger.
pub(crate) fn register(sink: &Arc<LogSink>) {
    SINKS.lock().unwrap_or_else(PoisonError::into_inner).push(Arc::clone(sink));
}

/// Removes a sink from the logger; messages that come later are dropped.
pub(crate) fn forget(sink: &Arc<LogSink>) {
    SINKS.lock().unwrap_or_else(PoisonError::into_inner).retain(|other| !Arc::ptr_eq(other, sink));
}

/// The sink of a message: the one that the pointer names; else, for a pointer of the FMU's own, that of the youngest
/// instance.
fn sink(environment: *mut c_void) -> Option<Arc<LogSink>> {
    let sinks = SINKS.lock().unwrap_or_else(PoisonError::into_inner);
    sinks.iter().find(|sink| std::ptr::eq(Arc::as_ptr(sink).cast(), environment)).or(sinks.last()).cloned()
}

/// # Safety
/// The texts are C strings or null.
unsafe fn record(environment: *mut c_void, name: *const c_char, status: i32, category: *const c_char, message: String) {
    let Some(sink) = sink(environment) else { return };
    // SAFETY: C strings by the standard's contract.
    let (instance, category) = unsafe { (lossy(name), lossy(category)) };
    sink.push(LogMessage { instance, status: Status::from(status), category, message });
}

#[cfg(all(unix, any(target_arch = "x86_64", all(target_arch = "aarch64", target_os = "linux"))))]
mod imp {
    use super::{c_char, c_void, lossy, record};

    type Slot = usize;

    unsafe extern "C" {
        fn snprintf(buffer: *mut c_char, size: usize, format: *const c_char, ...) -> i32;
    }

    /// Longest message kept, in bytes.
    const LONGEST: usize = 4096;

    macro_rules! variadic {
        ($($slot:ident)*; $($real:ident)*) => {
            #[allow(clippy::too_many_arguments)]
            pub(crate) unsafe extern "C" fn logger(
                environment: *mut c_void, name: *const c_char, status: i32, category: *const c_char, format: *const c_char,
                $($slot: Slot,)* $($real: f64,)*
            ) {
                let literal = format.is_null()
                    // SAFETY: not null, and a C string by the standard's contract.
                    || !unsafe { std::ffi::CStr::from_ptr(format) }.to_bytes().contains(&b'%');
                let message = if literal {
                    // SAFETY: a C string or null.
                    unsafe { lossy(format) }
                } else {
                    let mut buffer = [0 as c_char; LONGEST];
                    // SAFETY: the buffer is as long as the length passed; `snprintf` reads the arguments that the FMU passed, in the
                    // registers and slots where a variadic call puts them (module head).
                    unsafe {
                        snprintf(buffer.as_mut_ptr(), LONGEST, format, $($slot,)* $($real,)*);
                        lossy(buffer.as_ptr())
                    }
                };
                // SAFETY: as this function's own contract, which is that of `fmi2CallbackLogger`.
                unsafe { record(environment, name, status, category, message) };
            }
        };
    }

    // Beyond the registers, eight stack slots: within the caller's frames even when it passed none.
    #[cfg(target_arch = "x86_64")]
    variadic!(r9 s0 s1 s2 s3 s4 s5 s6 s7; d0 d1 d2 d3 d4 d5 d6 d7);
    #[cfg(target_arch = "aarch64")]
    variadic!(x5 x6 x7 s0 s1 s2 s3 s4 s5 s6 s7; d0 d1 d2 d3 d4 d5 d6 d7);
}

#[cfg(not(all(unix, any(target_arch = "x86_64", all(target_arch = "aarch64", target_os = "linux")))))]
mod imp {
    use super::{c_char, c_void, lossy, record};

    pub(crate) unsafe extern "C" fn logger(
        environment: *mut c_void,
        name: *const c_char,
        status: i32,
        category: *const c_char,
        format: *const c_char,
    ) {
        // SAFETY: as this function's own contract, which is that of `fmi2CallbackLogger`.
        unsafe { record(environment, name, status, category, lossy(format)) };
    }
}

/// The logger's address, for the callbacks structure.
pub(crate) fn logger() -> *const c_void {
    imp::logger as *const c_void
}

/// `fmi3LogMessageCallback`, which is not variadic and names no instance.
pub(crate) unsafe extern "C" fn log_message3(
    environment: *mut c_void,
    status: i32,
    category: *const c_char,
    message: *const c_char,
) {
    // SAFETY: C strings or null, by the standard's contract.
    unsafe { record(environment, std::ptr::null(), status, category, lossy(message)) };
}
