//! The calls of FMI 3.0 behind the methods of [`Instance`]: modes, events and steps here, [`values`] by handle, which are
//! those of [`layout`].

#![allow(unsafe_code)]

mod layout;

use std::collections::HashMap;
use std::sync::Arc;

use super::abi::{self, Call, Functions};
use super::instance::Instance;
use super::logger::lossy;
use super::{HostError, Status, note};
use crate::description::Value;
pub use layout::Layout;
use layout::Plan;

/// The output arguments of a step, without its status.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct StepResult {
    /// `eventHandlingNeeded`.
    pub event: bool,
    /// `terminateSimulation`.
    pub terminate: bool,
    /// `earlyReturn`.
    pub early: bool,
    /// `lastSuccessfulTime`, s.
    pub time: f64,
}

/// What an instance of FMI 3.0 has in addition to one of 2.0.
pub(super) struct Three {
    pub layout: Arc<Layout>,
    /// Tolerance, start and stop time, which go with `fmi3EnterInitializationMode`.
    pub experiment: (Option<f64>, f64, Option<f64>),
    /// Whether `eventModeUsed` was passed.
    pub event_mode: bool,
    /// Before initialisation: values cannot be read.
    fresh: bool,
    /// Elements of arrays set since.
    drafts: HashMap<u32, Vec<Value>>,
    pub step_result: StepResult,
    plan: Plan,
}

fn check(call: Call, status: i32) -> Result<(), HostError> {
    let status = status_of(status);
    if status.is_ok() { Ok(()) } else { Err(HostError::Status { function: abi::CALLS[call as usize], status }) }
}

/// A status of FMI 3.0, which knows no pending.
pub(super) fn status_of(raw: i32) -> Status {
    if raw == 5 { Status::Other(raw) } else { Status::from(raw) }
}

/// Calls a function of the binary by its name in the table.
macro_rules! call {
    ($instance:expr, $function:ident ($($arg:expr),*)) => {{
        match $instance.binary.functions.$function {
            Some(function) => {
                note(Call::$function);
                // SAFETY: the component is alive, the pointers are valid for the lengths given with them.
                let status = unsafe { function($instance.component, $($arg),*) };
                note(Call::None);
                check(Call::$function, status)
            }
            None => Err(HostError::Missing(abi::CALLS[Call::$function as usize])),
        }
    }};
}

// Behind the macro, which it uses.
mod values;

impl Three {
    pub fn new(layout: Arc<Layout>, event_mode: bool) -> Self {
        Self {
            layout,
            experiment: (None, 0.0, None),
            event_mode,
            fresh: true,
            drafts: HashMap::new(),
            step_result: StepResult::default(),
            plan: Plan::default(),
        }
    }

    /// A new instance, as far as values go.
    pub fn renew(&mut self) {
        self.fresh = true;
        self.drafts.clear();
        self.step_result = StepResult::default();
    }
}

impl Instance {
    pub(super) fn enter_initialization3(&mut self) -> Result<(), HostError> {
        let (tolerance, start, stop) = self.three.as_ref().map_or((None, 0.0, None), |three| three.experiment);
        call!(
            self,
            enter_initialization3(
                u8::from(tolerance.is_some()),
                tolerance.unwrap_or(0.0),
                start,
                u8::from(stop.is_some()),
                stop.unwrap_or(0.0)
            )
        )?;
        if let Some(three) = &mut self.three {
            three.fresh = false;
        }
        Ok(())
    }

    /// Leaves initialisation mode; where event mode is used, by way of it into step mode.
    pub(super) fn exit_initialization3(&mut self) -> Result<(), HostError> {
        call!(self, exit_initialization3())?;
        if self.three.as_ref().is_some_and(|three| three.event_mode) {
            self.iterate_events()?;
            call!(self, enter_step_mode())?;
        }
        Ok(())
    }

    /// `fmi3UpdateDiscreteStates` until nothing changes any more.
    fn iterate_events(&mut self) -> Result<(), HostError> {
        /// An event iteration that takes longer does not end.
        const MOST: usize = 1000;
        for _ in 0..MOST {
            let (mut again, mut terminate, mut nominals, mut states, mut next) = (0, 0, 0, 0, 0);
            let mut time = 0.0;
            call!(
                self,
                update_discrete_states(
                    &raw mut again,
                    &raw mut terminate,
                    &raw mut nominals,
                    &raw mut states,
                    &raw mut next,
                    &raw mut time
                )
            )?;
            if let Some(three) = &mut self.three {
                three.step_result.terminate |= terminate != 0;
            }
            if again == 0 || terminate != 0 {
                return Ok(());
            }
        }
        Err(HostError::Events(MOST))
    }

    /// Handles the events of a communication point: event mode, `set` there, and step mode again.
    ///
    /// # Errors
    /// When a call fails, or the events do not come to an end.
    pub(crate) fn handle_events(
        &mut self,
        set: impl FnOnce(&mut Self) -> Result<(), HostError>,
    ) -> Result<(), HostError> {
        call!(self, enter_event_mode())?;
        set(self)?;
        self.iterate_events()?;
        call!(self, enter_step_mode())
    }

    /// `fmi3EnterConfigurationMode`, and out of it again.
    pub(crate) fn configure(&mut self, set: impl FnOnce(&mut Self) -> Result<(), HostError>) -> Result<(), HostError> {
        call!(self, enter_configuration_mode())?;
        set(self)?;
        call!(self, exit_configuration_mode())
    }

    /// `fmi3DoStep`. A step after which the FMU asks for the end is [`Status::Discard`], as in FMI 2.0.
    pub(super) fn do_step3(&mut self, time: f64, step: f64, no_set_prior: bool) -> Result<Status, HostError> {
        let function = self.binary.functions.do_step3.ok_or(HostError::Missing("fmi3DoStep"))?;
        // What the FMU must write; values that are no booleans and no time show that it did not.
        let (mut event, mut terminate, mut early, mut last) = (0xA5_u8, 0xA5_u8, 0xA5_u8, f64::NAN);
        note(Call::do_step3);
        // SAFETY: the component is alive, the pointers are valid for one value.
        let status = unsafe {
            function(
                self.component,
                time,
                step,
                u8::from(no_set_prior),
                &raw mut event,
                &raw mut terminate,
                &raw mut early,
                &raw mut last,
            )
        };
        note(Call::None);
        let status = status_of(status);
        let Some(three) = &mut self.three else { return Ok(status) };
        three.step_result = StepResult { event: event == 1, terminate: terminate == 1, early: early == 1, time: last };
        three.step_result.unset(event, terminate, early);
        Ok(if status.is_ok() && three.step_result.terminate { Status::Discard } else { status })
    }

    /// The output arguments of the last step.
    pub(crate) fn step_result(&self) -> StepResult {
        self.three.as_ref().map_or(StepResult::default(), |three| three.step_result)
    }
}

impl StepResult {
    /// Outputs that are no booleans: the FMU did not write them.
    fn unset(&mut self, event: u8, terminate: u8, early: u8) {
        if [event, terminate, early].iter().any(|flag| *flag > 1) {
            self.time = f64::NAN;
        }
    }
}

/// `fmi3GetVersion` of a binary.
pub(crate) fn version3(functions: &Functions) -> Result<String, HostError> {
    let function = functions.get_version3.ok_or(HostError::Missing("fmi3GetVersion"))?;
    note(Call::get_version3);
    // SAFETY: the function takes nothing and gives a C string that lives as long as the library.
    let text = unsafe { lossy(function()) };
    note(Call::None);
    Ok(text)
}

/// An intermediate update that the host leaves alone.
pub(super) unsafe extern "C" fn intermediate_update(
    _environment: *mut std::ffi::c_void,
    _time: f64,
    _set: u8,
    _get: u8,
    _finished: u8,
    _can_return: u8,
    requested: *mut u8,
    at: *mut f64,
) {
    if !requested.is_null() {
        // SAFETY: not null, and a place for a boolean by the standard's contract.
        unsafe { *requested = 0 };
    }
    if !at.is_null() {
        // SAFETY: not null, and a place for a number by the standard's contract.
        unsafe { *at = 0.0 };
    }
}
