//! Every call from C passes here: null check, re-entry check, call sequence, `catch_unwind`, log.
//!
//! A refused call (a wrong place in the sequence, a bad argument) returns `fmi2Error`, logs why, and changes nothing.
//! A motion that is no longer finite leaves the instance in [`Mode::Error`], from where a stored state, a reset or
//! freeing leads on. A panic returns `fmi2Fatal` and leaves only freeing.

#![allow(unsafe_code)]

use std::cell::UnsafeCell;
use std::collections::BTreeSet;
use std::ffi::CStr;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, Ordering};

use super::abi::{Component, Status};
use super::fault::Fault;
use super::log::Log;
use super::sequence::{Function, Mode};
use super::simulation::Simulation;
use super::stored::Snapshot;
use crate::variables::Starts;

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
    use std::ffi::CString;

    use super::super::abi::Callbacks;
    use super::super::log::Sink;
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
}
