//! Every call from C passes here: null check, re-entry check, call sequence, `catch_unwind`, log.
//!
//! A refused call (a wrong place in the sequence, a bad argument) returns `fmi2Error`, logs why, and changes nothing.
//! A motion that is no longer finite leaves the instance in [`Mode::Error`], from where a stored state, a reset or
//! freeing leads on. A panic returns `fmi2Fatal` and leaves only freeing.

#![allow(unsafe_code)]

use std::cell::UnsafeCell;
use std::collections::BTreeSet;
use std::ffi::{CStr, CString};
use std::fmt::{self, Write};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, Ordering};

use super::abi::{Callbacks, Component, LOG_CATEGORIES, Status};
use super::fault::Fault;
use super::simulation::Simulation;
use super::stored::Snapshot;
use crate::variables::Starts;

/// Where an instance is in the call sequence (FMI 2.0.4, section 4.2.4): one bit each.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum Mode {
    /// After `fmi2Instantiate` or `fmi2Reset`.
    Instantiated = 1,
    /// Between `fmi2EnterInitializationMode` and `fmi2ExitInitializationMode`.
    Initialization = 2,
    /// Between steps (`stepComplete`).
    Step = 4,
    /// After `fmi2Terminate`.
    Terminated = 8,
    /// After a step whose result is not finite.
    Error = 16,
    /// After a panic.
    Fatal = 32,
}

impl Mode {
    /// The mode with that bit; none for [`Mode::Fatal`], which nothing leads back to.
    pub(crate) fn from_bits(bits: u8) -> Option<Self> {
        [Self::Instantiated, Self::Initialization, Self::Step, Self::Terminated, Self::Error]
            .into_iter()
            .find(|m| *m as u8 == bits)
    }
}

impl fmt::Display for Mode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Instantiated => "before initialisation",
            Self::Initialization => "during initialisation",
            Self::Step => "after initialisation",
            Self::Terminated => "after the termination",
            Self::Error => "after an error: set a stored state, reset or free the instance",
            Self::Fatal => "after a fatal error: free the instance",
        })
    }
}

const INSTANTIATED: u8 = Mode::Instantiated as u8;
const INITIALIZATION: u8 = Mode::Initialization as u8;
const STEP: u8 = Mode::Step as u8;
const AFTER: u8 = Mode::Terminated as u8 | Mode::Error as u8;
const NOWHERE: u8 = 0;
const ANY: u8 = INSTANTIATED | INITIALIZATION | STEP | AFTER;

macro_rules! functions {
    ($($name:ident: $mask:expr;)*) => {
        /// The functions that take an instance.
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        #[allow(non_camel_case_types, clippy::enum_variant_names)]
        pub(crate) enum Function { $($name),* }

        impl Function {
            /// Modes in which the call is legal (FMI 2.0.4, section 4.2.4, table of allowed calls; FMI 3.0, sections 2.3
            /// and 4.2).
            const fn mask(self) -> u8 {
                match self { $(Self::$name => $mask),* }
            }

            const fn name(self) -> &'static str {
                match self { $(Self::$name => stringify!($name)),* }
            }
        }
    };
}

functions! {
    fmi2SetDebugLogging: ANY;
    fmi2SetupExperiment: INSTANTIATED;
    fmi2EnterInitializationMode: INSTANTIATED;
    fmi2ExitInitializationMode: INITIALIZATION;
    fmi2Terminate: STEP;
    fmi2Reset: ANY;
    fmi2GetReal: INITIALIZATION | STEP | AFTER;
    fmi2GetInteger: INITIALIZATION | STEP | AFTER;
    fmi2GetBoolean: INITIALIZATION | STEP | AFTER;
    fmi2GetString: INITIALIZATION | STEP | AFTER;
    fmi2SetReal: INSTANTIATED | INITIALIZATION | STEP;
    fmi2SetInteger: INSTANTIATED | INITIALIZATION | STEP;
    fmi2SetBoolean: INSTANTIATED | INITIALIZATION | STEP;
    fmi2SetString: INSTANTIATED | INITIALIZATION | STEP;
    fmi2GetFMUstate: ANY;
    fmi2SetFMUstate: ANY;
    fmi2FreeFMUstate: ANY;
    fmi2SerializedFMUstateSize: ANY;
    fmi2SerializeFMUstate: ANY;
    fmi2DeSerializeFMUstate: ANY;
    fmi2GetDirectionalDerivative: INITIALIZATION | STEP | AFTER;
    fmi2SetRealInputDerivatives: INSTANTIATED | INITIALIZATION | STEP;
    fmi2GetRealOutputDerivatives: STEP | AFTER;
    fmi2DoStep: STEP;
    fmi2CancelStep: NOWHERE;
    fmi2GetStatus: STEP | AFTER;
    fmi2GetRealStatus: STEP | AFTER;
    fmi2GetIntegerStatus: STEP | AFTER;
    fmi2GetBooleanStatus: STEP | AFTER;
    fmi2GetStringStatus: STEP | AFTER;
    fmi3SetDebugLogging: ANY;
    fmi3EnterInitializationMode: INSTANTIATED;
    fmi3ExitInitializationMode: INITIALIZATION;
    fmi3EnterEventMode: NOWHERE;
    fmi3EnterStepMode: NOWHERE;
    fmi3EnterConfigurationMode: NOWHERE;
    fmi3ExitConfigurationMode: NOWHERE;
    fmi3EvaluateDiscreteStates: NOWHERE;
    fmi3UpdateDiscreteStates: NOWHERE;
    fmi3Terminate: STEP;
    fmi3Reset: ANY;
    fmi3GetFloat32: ANY;
    fmi3SetFloat32: INSTANTIATED | INITIALIZATION | STEP;
    fmi3GetFloat64: ANY;
    fmi3SetFloat64: INSTANTIATED | INITIALIZATION | STEP;
    fmi3GetInt8: ANY;
    fmi3SetInt8: INSTANTIATED | INITIALIZATION | STEP;
    fmi3GetUInt8: ANY;
    fmi3SetUInt8: INSTANTIATED | INITIALIZATION | STEP;
    fmi3GetInt16: ANY;
    fmi3SetInt16: INSTANTIATED | INITIALIZATION | STEP;
    fmi3GetUInt16: ANY;
    fmi3SetUInt16: INSTANTIATED | INITIALIZATION | STEP;
    fmi3GetInt32: ANY;
    fmi3SetInt32: INSTANTIATED | INITIALIZATION | STEP;
    fmi3GetUInt32: ANY;
    fmi3SetUInt32: INSTANTIATED | INITIALIZATION | STEP;
    fmi3GetInt64: ANY;
    fmi3SetInt64: INSTANTIATED | INITIALIZATION | STEP;
    fmi3GetUInt64: ANY;
    fmi3SetUInt64: INSTANTIATED | INITIALIZATION | STEP;
    fmi3GetBoolean: ANY;
    fmi3SetBoolean: INSTANTIATED | INITIALIZATION | STEP;
    fmi3GetString: ANY;
    fmi3SetString: INSTANTIATED | INITIALIZATION | STEP;
    fmi3GetBinary: ANY;
    fmi3SetBinary: INSTANTIATED | INITIALIZATION | STEP;
    fmi3GetClock: ANY;
    fmi3SetClock: INSTANTIATED | INITIALIZATION | STEP;
    fmi3GetIntervalDecimal: ANY;
    fmi3GetIntervalFraction: ANY;
    fmi3GetShiftDecimal: ANY;
    fmi3GetShiftFraction: ANY;
    fmi3SetIntervalDecimal: ANY;
    fmi3SetIntervalFraction: ANY;
    fmi3SetShiftDecimal: ANY;
    fmi3SetShiftFraction: ANY;
    fmi3GetFMUState: ANY;
    fmi3SetFMUState: ANY;
    fmi3FreeFMUState: ANY;
    fmi3SerializedFMUStateSize: ANY;
    fmi3SerializeFMUState: ANY;
    fmi3DeserializeFMUState: ANY;
    fmi3GetDirectionalDerivative: INITIALIZATION | STEP | AFTER;
    fmi3GetAdjointDerivative: NOWHERE;
    fmi3GetNumberOfVariableDependencies: NOWHERE;
    fmi3GetVariableDependencies: NOWHERE;
    fmi3GetOutputDerivatives: STEP | AFTER;
    fmi3DoStep: STEP;
    fmi3EnterContinuousTimeMode: NOWHERE;
    fmi3CompletedIntegratorStep: NOWHERE;
    fmi3SetTime: NOWHERE;
    fmi3SetContinuousStates: NOWHERE;
    fmi3GetContinuousStateDerivatives: NOWHERE;
    fmi3GetEventIndicators: NOWHERE;
    fmi3GetContinuousStates: NOWHERE;
    fmi3GetNominalsOfContinuousStates: NOWHERE;
    fmi3GetNumberOfEventIndicators: NOWHERE;
    fmi3GetNumberOfContinuousStates: NOWHERE;
    fmi3ActivateModelPartition: NOWHERE;
}

/// First field of every instance, by which a pointer to something else is noticed.
const MARK: u64 = 0x6569_786f_2d46_4d55;

/// An instance, as the importer's pointer leads to it.
pub(crate) struct Instance {
    mark: u64,
    /// Set while a call is under way: the logger may not call back into the instance.
    busy: AtomicBool,
    body: UnsafeCell<Body>,
}

/// The instance itself.
pub(crate) struct Body {
    pub kernel: Simulation,
    pub mode: Mode,
    pub set_up: bool,
    pub starts: Starts,
    /// States handed out and not yet freed, by address.
    pub states: BTreeSet<usize>,
    pub log: Log,
}

/// Where log messages go.
pub(crate) struct Log {
    pub name: CString,
    pub sink: Sink,
    /// By status: warning, discard, error, fatal.
    pub on: [bool; 4],
}

/// The importer's logger, by the version of FMI.
#[derive(Clone, Copy)]
pub(crate) enum Sink {
    /// FMI 2.0: a variadic function.
    Two(Callbacks),
    /// FMI 3.0.
    Three {
        /// Handed back to the logger.
        environment: *mut std::ffi::c_void,
        /// Log messages go here.
        message: Option<crate::fmi3::LogMessage>,
    },
}

/// A message on the stack; too long a text is cut.
struct Message {
    bytes: [u8; 480],
    len: usize,
}

impl Write for Message {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        for c in text.bytes().filter(|b| *b != 0) {
            // The last byte stays zero: C's end of text.
            if self.len + 1 < self.bytes.len() {
                self.bytes[self.len] = c;
                self.len += 1;
            }
        }
        Ok(())
    }
}

impl Log {
    /// Whether messages of a status go out.
    fn is_enabled(&self, status: Status) -> bool {
        let kind = status as usize;
        (1..=4).contains(&kind) && self.on[kind - 1]
    }

    /// Sends a message of that status, if anyone listens.
    pub fn send(&self, status: Status, message: impl fmt::Display) {
        let there = match self.sink {
            Sink::Two(callbacks) => callbacks.logger.is_some(),
            Sink::Three { message, .. } => message.is_some(),
        };
        if !there || !self.is_enabled(status) {
            return;
        }
        let mut text = Message { bytes: [0; 480], len: 0 };
        // Cannot fail: what does not fit is cut.
        let _ = write!(text, "{message}");
        let mut category = Message { bytes: [0; 480], len: 0 };
        let _ = category.write_str(LOG_CATEGORIES[status as usize - 1].0);
        let category = category.bytes.as_ptr().cast();
        // SAFETY: the logger has the signature of its version; all texts end in zero and live through the call; in FMI 2.0
        // the message goes through "%s", so that no sign in it is taken for a format.
        unsafe {
            match self.sink {
                Sink::Two(Callbacks { logger: Some(logger), environment, .. }) => {
                    let text = text.bytes.as_ptr();
                    logger(environment, self.name.as_ptr(), status as i32, category, c"%s".as_ptr(), text);
                }
                Sink::Three { environment, message: Some(message) } => {
                    message(environment, status as i32, category, text.bytes.as_ptr().cast());
                }
                _ => {}
            }
        }
    }
}

impl Body {
    /// Logs why a call is refused, and gives its status.
    fn refuse(&self, function: Function, fault: &Fault) -> Status {
        self.log.send(Status::Error, format_args!("{}: {fault}", function.name()));
        Status::Error
    }

    /// Takes the experiment's tolerance, start and stop time (s), where they are given.
    ///
    /// # Errors
    /// When one is not finite, or the stop time is not after the start time.
    pub fn set_up(&mut self, tolerance: Option<f64>, start: f64, stop: Option<f64>) -> Result<(), Fault> {
        // The tolerance has no meaning here: the internal step is fixed.
        if let Some(tolerance) = tolerance {
            finite("tolerance", tolerance)?;
        }
        finite("startTime", start)?;
        let stop = stop.map_or(Ok(f64::INFINITY), |stop| finite("stopTime", stop))?;
        if stop <= start {
            return Err(Fault::Number { name: "stopTime", value: stop, must_be: "after startTime" });
        }
        self.kernel.set_experiment(start, stop);
        self.set_up = true;
        Ok(())
    }

    /// Enters the initialisation, once the experiment is set up.
    ///
    /// # Errors
    /// When it is not.
    pub fn enter_initialisation(&mut self) -> Result<(), Fault> {
        if !self.set_up {
            return Err(Fault::NotSetUp);
        }
        self.mode = Mode::Initialization;
        Ok(())
    }

    /// Ends the initialisation: steps come next.
    ///
    /// # Errors
    /// When the parameters make no axis.
    pub fn exit_initialisation(&mut self) -> Result<(), Fault> {
        self.kernel.initialise()?;
        self.mode = Mode::Step;
        Ok(())
    }

    /// Ends the run.
    pub fn terminate(&mut self) {
        self.mode = Mode::Terminated;
    }

    /// Goes back to what [`create`] made; the log and the stored states stay.
    pub fn reset(&mut self) {
        self.kernel = Simulation::new(&self.starts);
        self.mode = Mode::Instantiated;
        self.set_up = false;
    }

    /// A copy to go back to.
    pub fn snapshot(&self) -> Snapshot {
        Snapshot { kernel: self.kernel, mode: self.mode, set_up: self.set_up }
    }

    /// Goes back to a copy.
    pub fn go_back(&mut self, to: &Snapshot) {
        self.kernel = to.kernel;
        self.mode = to.mode;
        self.set_up = to.set_up;
    }
}

/// A number, unless it is infinite or NaN.
fn finite(name: &'static str, value: f64) -> Result<f64, Fault> {
    if value.is_finite() { Ok(value) } else { Err(Fault::Number { name, value, must_be: "a finite number" }) }
}

/// Makes an instance and hands its ownership to the importer.
pub(crate) fn create(starts: Starts, log: Log) -> Component {
    let body = Body {
        kernel: Simulation::new(&starts),
        mode: Mode::Instantiated,
        set_up: false,
        starts,
        states: BTreeSet::new(),
        log,
    };
    let instance = Box::new(Instance { mark: MARK, busy: AtomicBool::new(false), body: UnsafeCell::new(body) });
    Box::into_raw(instance).cast()
}

/// The instance behind a pointer, unless it is null or leads to something else.
///
/// # Safety
/// `c` is null or points to readable memory of an instance's size.
unsafe fn instance<'a>(c: Component) -> Option<&'a Instance> {
    let c = c.cast::<Instance>();
    if c.is_null() || !c.is_aligned() {
        return None;
    }
    // SAFETY: not null, aligned, and readable as the caller vouches.
    let instance = unsafe { &*c };
    (instance.mark == MARK).then_some(instance)
}

/// Frees an instance and the states that the importer left behind.
///
/// # Safety
/// `c` is null or comes from [`create`] and has not been freed.
pub(crate) unsafe fn destroy(c: Component) {
    // SAFETY: the caller's.
    let Some(found) = (unsafe { instance(c) }) else { return };
    if found.busy.swap(true, Ordering::Acquire) {
        // Freed from inside its own logger: the call under way still needs it.
        return;
    }
    // SAFETY: from `Box::into_raw` in `create`, and not freed before, as the caller vouches.
    let mut instance = unsafe { Box::from_raw(c.cast::<Instance>()) };
    instance.mark = 0;
    for &state in &instance.body.get_mut().states {
        // SAFETY: every address in the set is from `Box::into_raw`, and is taken out when it is freed.
        drop(unsafe { Box::from_raw(state as *mut Snapshot) });
    }
}

/// Runs `call` on an instance, if it is there, idle, and the call is legal now.
///
/// # Safety
/// `c` is null or an instance that lives through the call.
#[inline]
pub(crate) unsafe fn enter(
    c: Component,
    function: Function,
    call: impl FnOnce(&mut Body) -> Result<Status, Fault>,
) -> Status {
    // SAFETY: the caller's.
    let Some(instance) = (unsafe { instance(c) }) else { return Status::Error };
    // Set and tested in one operation: of two threads at once, which the standard forbids, only one enters.
    if instance.busy.swap(true, Ordering::Acquire) {
        return Status::Error;
    }
    // SAFETY: `busy` lets one call at a time come here, so this is the only reference.
    let body = unsafe { &mut *instance.body.get() };
    let status = if body.mode as u8 & function.mask() == 0 {
        let _ = body.refuse(function, &Fault::Mode(body.mode));
        if body.mode == Mode::Fatal { Status::Fatal } else { Status::Error }
    } else {
        match catch_unwind(AssertUnwindSafe(|| call(body))) {
            Ok(Ok(status)) => status,
            Ok(Err(fault)) => body.refuse(function, &fault),
            Err(_) => {
                body.mode = Mode::Fatal;
                body.log.send(Status::Fatal, format_args!("{}: a fault inside the FMU", function.name()));
                Status::Fatal
            }
        }
    };
    instance.busy.store(false, Ordering::Release);
    status
}

/// A C string as text, for comparing; empty where it is null or no UTF-8.
///
/// # Safety
/// `text` is null or a C string that lives as long as the result is used.
pub(crate) unsafe fn text<'a>(text: super::abi::Text) -> &'a str {
    if text.is_null() {
        return "";
    }
    // SAFETY: not null, and a C string as the caller vouches.
    unsafe { CStr::from_ptr(text) }.to_str().unwrap_or("")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn silent_log() -> Log {
        let callbacks = Callbacks {
            logger: None,
            allocate: None,
            free: None,
            step_finished: None,
            environment: std::ptr::null_mut(),
        };
        Log { name: CString::default(), sink: Sink::Two(callbacks), on: [true; 4] }
    }

    #[test]
    fn a_panic_becomes_fatal_and_only_freeing_is_left() {
        let c = create(Starts::default(), silent_log());
        // SAFETY: a live instance, freed at the end.
        unsafe {
            assert_eq!(enter(c, Function::fmi2Reset, |_| panic!("a fault on purpose")), Status::Fatal);
            assert_eq!(enter(c, Function::fmi2Reset, |_| Ok(Status::Ok)), Status::Fatal);
            assert_eq!(enter(c, Function::fmi2GetFMUstate, |_| Ok(Status::Ok)), Status::Fatal);
            destroy(c);
        }
    }

    #[test]
    fn the_logger_cannot_call_back_into_a_busy_instance() {
        let c = create(Starts::default(), silent_log());
        // SAFETY: a live instance, freed at the end; the inner calls are what is tested.
        unsafe {
            let outer = enter(c, Function::fmi2Reset, |_| {
                assert_eq!(enter(c, Function::fmi2Reset, |_| Ok(Status::Ok)), Status::Error);
                destroy(c);
                Ok(Status::Ok)
            });
            assert_eq!(outer, Status::Ok);
            assert_eq!(enter(c, Function::fmi2Reset, |_| Ok(Status::Ok)), Status::Ok);
            destroy(c);
        }
    }

    #[test]
    fn a_long_message_is_cut_and_ends_in_zero() {
        let mut message = Message { bytes: [0; 480], len: 0 };
        assert!(write!(message, "{}\0{}", "a".repeat(300), "b".repeat(300)).is_ok());
        assert_eq!(message.len, 479);
        assert_eq!(message.bytes[479], 0);
        assert_eq!(message.bytes[300], b'b');
    }
}
