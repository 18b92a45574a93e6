//! Calls that an ordinary host does not make, for the validator: null pointers, poisoned callbacks, raw values.

#![allow(unsafe_code)]

use std::ffi::{c_char, c_void};
use std::sync::atomic::{AtomicU32, Ordering};

use super::abi::{self, CALLS, Call};
use super::instance::{ALLOCATION_FAILS, Instance};
use super::logger::lossy;
use super::texts::{Given, Room, steady};
use super::{Binary, HostError, Status, note};
use crate::description::Fmi;

/// Calls of callbacks through the structure after it was poisoned.
static POISON: AtomicU32 = AtomicU32::new(0);

unsafe extern "C" fn poisoned_logger(
    _environment: *mut c_void,
    _name: *const c_char,
    _status: i32,
    _category: *const c_char,
    _format: *const c_char,
) {
    POISON.fetch_add(1, Ordering::Relaxed);
}

unsafe extern "C" fn poisoned_allocate(count: usize, size: usize) -> *mut c_void {
    POISON.fetch_add(1, Ordering::Relaxed);
    // SAFETY: `calloc` takes any numbers.
    unsafe { abi::calloc(count.max(1), size.max(1)) }
}

unsafe extern "C" fn poisoned_free(memory: *mut c_void) {
    POISON.fetch_add(1, Ordering::Relaxed);
    // SAFETY: the FMU hands back what an allocation callback gave, or null.
    unsafe { abi::free(memory) }
}

/// How often poisoned callbacks were called so far.
pub(crate) fn poison_hits() -> u32 {
    POISON.load(Ordering::Relaxed)
}

/// Makes the allocation callback give null from now on, or no longer.
pub(crate) fn fail_allocations(fail: bool) {
    ALLOCATION_FAILS.store(fail, Ordering::Relaxed);
}

/// `fmi2FreeInstance(NULL)` or `fmi3FreeInstance(NULL)`, which has no effect.
pub(crate) fn free_null(binary: &Binary, fmi: Fmi) -> Result<(), HostError> {
    let (function, call) = match fmi {
        Fmi::Two => (binary.functions.free_instance, Call::free_instance),
        Fmi::Three => (binary.functions.free_instance3, Call::free_instance3),
    };
    let function = function.ok_or(HostError::Missing(CALLS[call as usize]))?;
    note(call);
    // SAFETY: the standard allows null (FMI 2.0.4, section 2.1.5; FMI 3.0, section 2.3.1).
    unsafe { function(std::ptr::null_mut()) };
    note(Call::None);
    Ok(())
}

/// Functions that change an instance, of no instance.
pub(crate) fn null_component(binary: &Binary, fmi: Fmi) {
    let c = std::ptr::null_mut();
    let f = &binary.functions;
    macro_rules! call {
        ($($function:ident ($($arg:expr),*)),*) => {$(
            if let Some(function) = f.$function {
                note(Call::$function);
                // SAFETY: nothing is known of it; the validator's child process exists to find out.
                let _ = unsafe { function(c, $($arg),*) };
                note(Call::None);
            }
        )*};
    }
    let (reference, mut value) = (0_u32, 0.0);
    if fmi == Fmi::Three {
        let (mut event, mut end, mut early, mut last) = (0, 0, 0, 0.0);
        call!(
            enter_initialization3(0, 0.0, 0.0, 0, 0.0),
            exit_initialization3(),
            get3_float64(&raw const reference, 1, &raw mut value, 1),
            set3_float64(&raw const reference, 1, &raw const value, 1),
            do_step3(0.0, 0.01, 1, &raw mut event, &raw mut end, &raw mut early, &raw mut last),
            reset3(),
            terminate3()
        );
        return;
    }
    call!(
        setup_experiment(0, 0.0, 0.0, 0, 0.0),
        enter_initialization(),
        exit_initialization(),
        get_real(&raw const reference, 1, &raw mut value),
        set_real(&raw const reference, 1, &raw const value),
        do_step(0.0, 0.01, 1),
        reset(),
        terminate()
    );
}

impl Instance {
    /// Whatever the FMU needs after instantiation it must have copied: overwrites the callbacks structure with
    /// functions that count their calls, and the three texts with rubbish.
    pub(crate) fn poison(&mut self) {
        *self.callbacks = abi::Callbacks {
            logger: poisoned_logger as *const c_void,
            allocate: Some(poisoned_allocate),
            free: Some(poisoned_free),
            step_finished: std::ptr::null(),
            environment: self.callbacks.environment,
        };
        for text in &mut self.texts {
            let end = text.len() - 1;
            text[..end].fill(b'#');
        }
    }

    /// `fmi2GetBoolean` as raw integers.
    pub(crate) fn get_boolean_raw(&mut self, references: &[u32]) -> Result<Vec<i32>, HostError> {
        if self.three.is_some() {
            return self.get_flag3(references);
        }
        let mut values = vec![i32::MIN; references.len()];
        let function = self.binary.functions.get_boolean.ok_or(HostError::Missing("fmi2GetBoolean"))?;
        note(Call::get_boolean);
        // SAFETY: the pointers are valid for the length.
        let status = unsafe { function(self.component, references.as_ptr(), references.len(), values.as_mut_ptr()) };
        note(Call::None);
        ok(Call::get_boolean, status).map(|()| values)
    }

    /// `fmi2GetString` with a check of each: `Err` is what is wrong with the text.
    pub(crate) fn get_string_raw(
        &mut self,
        references: &[u32],
    ) -> Result<Vec<Result<String, &'static str>>, HostError> {
        if self.three.is_some() {
            return self.get_text3(references, true);
        }
        let mut values = vec![std::ptr::null::<c_char>(); references.len()];
        let room = Room::twice(references.len());
        let function = self.binary.functions.get_string.ok_or(HostError::Missing("fmi2GetString"))?;
        note(Call::get_string);
        // SAFETY: the pointers are valid for the length.
        let status = unsafe { function(self.component, references.as_ptr(), references.len(), values.as_mut_ptr()) };
        ok(Call::get_string, status)?;
        let texts = steady(Given::Strings(&values), room);
        note(Call::None);
        Ok(texts)
    }

    /// Every getter and setter with no value references and null arrays.
    pub(crate) fn empty_calls(&mut self) -> Vec<(&'static str, Status)> {
        let f = &self.binary.functions;
        let three = self.three.is_some();
        let c = self.component;
        let (n, null) = (0, std::ptr::null());
        let mut results = Vec::new();
        macro_rules! empty {
            ($($function:ident ($array:expr)),*) => {$(
                if let Some(function) = f.$function.filter(|_| !three) {
                    note(Call::$function);
                    // SAFETY: a length of 0 lets nothing be read or written.
                    let status = unsafe { function(c, null, n, $array) };
                    note(Call::None);
                    results.push((CALLS[Call::$function as usize], Status::from(status)));
                }
            )*};
        }
        empty!(
            get_real(std::ptr::null_mut()),
            get_integer(std::ptr::null_mut()),
            get_boolean(std::ptr::null_mut()),
            get_string(std::ptr::null_mut()),
            set_real(std::ptr::null()),
            set_integer(std::ptr::null()),
            set_boolean(std::ptr::null()),
            set_string(std::ptr::null())
        );
        macro_rules! empty3 {
            ($($function:ident ($array:expr)),*) => {$(
                if let Some(function) = f.$function.filter(|_| three) {
                    note(Call::$function);
                    // SAFETY: lengths of 0 let nothing be read or written.
                    let status = unsafe { function(c, null, n, $array, 0) };
                    note(Call::None);
                    results.push((CALLS[Call::$function as usize], Status::from(status)));
                }
            )*};
        }
        empty3!(
            get3_float32(std::ptr::null_mut()),
            get3_float64(std::ptr::null_mut()),
            get3_int32(std::ptr::null_mut()),
            get3_int64(std::ptr::null_mut()),
            get3_boolean(std::ptr::null_mut()),
            get3_string(std::ptr::null_mut()),
            set3_float32(std::ptr::null()),
            set3_float64(std::ptr::null()),
            set3_int32(std::ptr::null()),
            set3_int64(std::ptr::null()),
            set3_boolean(std::ptr::null()),
            set3_string(std::ptr::null())
        );
        results
    }

    /// Every status function of co-simulation, for every kind of status.
    pub(crate) fn status_calls(&mut self) {
        if self.three.is_some() {
            return;
        }
        let f = &self.binary.functions;
        let c = self.component;
        for kind in 0..4 {
            let (mut status, mut real, mut integer) = (0, 0.0, 0);
            let mut text = std::ptr::null();
            macro_rules! ask {
                ($($function:ident ($value:expr)),*) => {$(
                    if let Some(function) = f.$function {
                        note(Call::$function);
                        // SAFETY: the pointer is valid for one value.
                        let _ = unsafe { function(c, kind, $value) };
                    }
                )*};
            }
            ask!(
                get_status(&raw mut status),
                get_real_status(&raw mut real),
                get_integer_status(&raw mut integer),
                get_boolean_status(&raw mut integer),
                get_string_status(&raw mut text)
            );
            // SAFETY: null or a C string of the FMU.
            let _ = unsafe { lossy(text) };
        }
        note(Call::None);
    }

    /// `fmi2GetFMUstate` into a state that exists, which overwrites it; then frees it twice, which sets it to null and
    /// then does nothing.
    pub(crate) fn state_handles(&mut self) -> Result<Vec<String>, HostError> {
        let f = &self.binary.functions;
        let c = self.component;
        let mut problems = Vec::new();
        let (get, free) = match self.three {
            Some(_) => (f.get_state3, f.free_state3),
            None => (f.get_state, f.free_state),
        };
        let (Some(get), Some(free)) = (get, free) else {
            return Err(HostError::Missing("fmi2GetFMUstate or fmi2FreeFMUstate"));
        };
        let mut state = std::ptr::null_mut();
        for _ in 0..2 {
            note(Call::get_state);
            // SAFETY: `state` is null or a state of this instance.
            ok(Call::get_state, unsafe { get(c, &raw mut state) })?;
            if state.is_null() {
                problems.push("fmi2GetFMUstate left a null state".to_owned());
            }
        }
        note(Call::free_state);
        // SAFETY: a state of this instance.
        ok(Call::free_state, unsafe { free(c, &raw mut state) })?;
        if state.is_null() {
            note(Call::free_state);
            // SAFETY: null, which the call ignores.
            let status = Status::from(unsafe { free(c, &raw mut state) });
            if !status.is_ok() {
                problems.push(format!("fmi2FreeFMUstate of a null state returned {status}; it has no effect"));
            }
        } else {
            problems.push("fmi2FreeFMUstate did not set the state to null".to_owned());
        }
        note(Call::None);
        Ok(problems)
    }
}

fn ok(call: Call, status: i32) -> Result<(), HostError> {
    let status = Status::from(status);
    if status.is_ok() { Ok(()) } else { Err(HostError::Status { function: CALLS[call as usize], status }) }
}
