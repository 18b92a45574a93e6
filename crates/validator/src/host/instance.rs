//! One instance of an FMU.

use std::collections::HashMap;
use std::ffi::CString;
use std::sync::Arc;
use std::sync::PoisonError;

use tempfile::TempDir;

use super::abi::{self, Call, Callbacks, Component, Text};
use super::logger::{self, LogMessage, LogSink, lossy};
use super::three::{self, Layout, Three};
use super::{Binary, HostError, Status, note};

/// How to make an instance.
#[derive(Debug, Clone)]
pub struct InstanceOptions {
    /// Name of the instance.
    pub name: String,
    /// GUID, or instantiation token, to hand over.
    pub guid: String,
    /// URI of the resources folder; in FMI 3.0 its path.
    pub resources: String,
    /// Whether the FMU may show windows.
    pub visible: bool,
    /// Whether the FMU logs.
    pub logging: bool,
    /// What lies behind the handles of an FMU of FMI 3.0; none for FMI 2.0.
    pub layout: Option<Arc<Layout>>,
    /// FMI 3.0: whether events are handled.
    pub event_mode: bool,
    /// FMI 3.0: whether a step may return early.
    pub early_return: bool,
}

impl Default for InstanceOptions {
    fn default() -> Self {
        Self {
            name: "instance".into(),
            guid: String::new(),
            resources: String::new(),
            visible: false,
            logging: false,
            layout: None,
            event_mode: false,
            early_return: false,
        }
    }
}

/// One instance. Freed when dropped.
pub struct Instance {
    pub(crate) component: Component,
    pub(super) callbacks: Box<Callbacks>,
    pub(super) binary: Arc<Binary>,
    /// There for an FMU of FMI 3.0.
    pub(super) three: Option<Three>,
    log: Arc<LogSink>,
    freed: bool,
    /// Whether steps may be taken back: the negation of `noSetFMUStatePriorToCurrentPoint`.
    pub(crate) may_go_back: bool,
    // Kept for FMUs that go on using the pointers handed to them.
    pub(super) texts: [Vec<u8>; 3],
    /// The text set last under each reference, for FMUs that keep its pointer: that they do is found by one rule, and
    /// is not to spoil what others read.
    kept: HashMap<u32, CString>,
    _folder: Option<Arc<TempDir>>,
}

impl std::fmt::Debug for Instance {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Instance").field("component", &self.component).finish_non_exhaustive()
    }
}

// SAFETY: FMI 2.0 allows an instance to be used from any thread, one at a time; the log sink is locked.
unsafe impl Send for Instance {}

pub(super) fn c_string(text: &str) -> Result<CString, HostError> {
    CString::new(text).map_err(|_| HostError::Nul(text.to_owned()))
}

/// Calls a function of the binary, noting it first; gives its result, or the error that it is not exported.
macro_rules! call {
    ($self:ident, $function:ident ($($arg:expr),*)) => {
        match $self.binary.functions.$function {
            Some(function) => {
                note(Call::$function);
                // SAFETY: the component is alive, the pointers are valid for the lengths given with them.
                let result = unsafe { function($self.component, $($arg),*) };
                note(Call::None);
                Ok(result)
            }
            None => Err(HostError::Missing(abi::CALLS[Call::$function as usize])),
        }
    };
}

/// As [`call!`], with the status made an error unless it is fine.
macro_rules! checked {
    ($self:ident, $function:ident ($($arg:expr),*)) => {
        call!($self, $function($($arg),*)).map(Status::from).and_then(|status| {
            match status.is_ok() {
                true => Ok(()),
                false => Err(HostError::Status { function: abi::CALLS[Call::$function as usize], status }),
            }
        })
    };
}

// Behind the macros, which they use.
mod make;
mod states;
mod values;

pub(super) use make::ALLOCATION_FAILS;
use make::{allocate, make, make3, release};
pub use states::StateHandle;

impl Instance {
    /// Makes an instance of a loaded binary; `folder` is kept alive as long as the instance.
    ///
    /// # Errors
    /// When the FMU refuses, or lacks a function.
    pub fn new(
        binary: Arc<Binary>,
        folder: Option<Arc<TempDir>>,
        options: &InstanceOptions,
    ) -> Result<Self, HostError> {
        let texts =
            [&options.name, &options.guid, &options.resources].map(|t| c_string(t).map(CString::into_bytes_with_nul));
        let [name, guid, resources] = texts;
        let texts = [name?, guid?, resources?];
        let log = Arc::new(LogSink::default());
        logger::register(&log);
        let callbacks = Box::new(Callbacks {
            logger: logger::logger(),
            allocate: Some(allocate),
            free: Some(release),
            step_finished: std::ptr::null(),
            environment: Arc::as_ptr(&log).cast_mut().cast(),
        });
        let three = options.layout.as_ref().map(|layout| Three::new(Arc::clone(layout), options.event_mode));
        let made = match three {
            Some(_) => make3(&binary, options, &texts, callbacks.environment),
            None => make(&binary, options, &texts, &callbacks),
        };
        let component = match made {
            Ok(component) => component,
            Err(error) => {
                logger::forget(&log);
                return Err(error);
            }
        };
        let function = if three.is_some() { "fmi3InstantiateCoSimulation" } else { "fmi2Instantiate" };
        let instance = Self {
            component,
            callbacks,
            binary,
            three,
            log,
            freed: false,
            may_go_back: false,
            texts,
            kept: HashMap::new(),
            _folder: folder,
        };
        if component.is_null() {
            let log: Vec<String> = instance.take_log().into_iter().map(|m| m.message).collect();
            return Err(HostError::Refused { function, log: log.join("; ") });
        }
        Ok(instance)
    }

    /// Refuses what FMI 3.0 does not have: a binary may export both interfaces.
    fn only_two(&self, function: &'static str) -> Result<(), HostError> {
        if self.three.is_some() { Err(HostError::Missing(function)) } else { Ok(()) }
    }

    /// The messages logged since the last time, and forgets them.
    #[must_use]
    pub fn take_log(&self) -> Vec<LogMessage> {
        let mut messages = self.log.messages.lock().unwrap_or_else(PoisonError::into_inner);
        std::mem::take(&mut messages.0)
    }

    /// `fmi2GetTypesPlatform`.
    ///
    /// # Errors
    /// When it is not exported.
    pub fn types_platform(&self) -> Result<String, HostError> {
        static_text(&self.binary, Call::get_types_platform)
    }

    /// `fmi2GetVersion`.
    ///
    /// # Errors
    /// When it is not exported.
    pub fn version(&self) -> Result<String, HostError> {
        static_text(&self.binary, Call::get_version)
    }

    /// `fmi2SetDebugLogging`.
    ///
    /// # Errors
    /// When it is not exported or does not return `fmi2OK` or `fmi2Warning`; so for all methods below.
    pub fn set_debug_logging(&mut self, on: bool, categories: &[&str]) -> Result<(), HostError> {
        let texts = categories.iter().map(|c| c_string(c)).collect::<Result<Vec<_>, _>>()?;
        let pointers: Vec<Text> = texts.iter().map(|t| t.as_ptr()).collect();
        // Of no category, no array: so most importers call it.
        let array = if pointers.is_empty() { std::ptr::null() } else { pointers.as_ptr() };
        if self.three.is_some() {
            return checked!(self, set_debug_logging3(u8::from(on), pointers.len(), array));
        }
        checked!(self, set_debug_logging(i32::from(on), pointers.len(), array))
    }

    /// `fmi2SetupExperiment`; times in s. In FMI 3.0 they go with `fmi3EnterInitializationMode`.
    ///
    /// # Errors
    /// See [`Instance::set_debug_logging`].
    pub fn setup_experiment(&mut self, tolerance: Option<f64>, start: f64, stop: Option<f64>) -> Result<(), HostError> {
        if let Some(three) = &mut self.three {
            three.experiment = (tolerance, start, stop);
            return Ok(());
        }
        let (has_tolerance, has_stop) = (i32::from(tolerance.is_some()), i32::from(stop.is_some()));
        let (tolerance, stop) = (tolerance.unwrap_or(0.0), stop.unwrap_or(0.0));
        checked!(self, setup_experiment(has_tolerance, tolerance, start, has_stop, stop))
    }

    /// `fmi2EnterInitializationMode`.
    ///
    /// # Errors
    /// See [`Instance::set_debug_logging`].
    pub fn enter_initialization(&mut self) -> Result<(), HostError> {
        if self.three.is_some() { self.enter_initialization3() } else { checked!(self, enter_initialization()) }
    }

    /// `fmi2ExitInitializationMode`.
    ///
    /// # Errors
    /// See [`Instance::set_debug_logging`].
    pub fn exit_initialization(&mut self) -> Result<(), HostError> {
        if self.three.is_some() { self.exit_initialization3() } else { checked!(self, exit_initialization()) }
    }

    /// Sets up, enters and exits initialisation.
    ///
    /// # Errors
    /// See [`Instance::set_debug_logging`].
    pub fn initialize(&mut self, start: f64, stop: Option<f64>) -> Result<(), HostError> {
        self.setup_experiment(None, start, stop)?;
        self.enter_initialization()?;
        self.exit_initialization()
    }

    /// `fmi2Terminate`.
    ///
    /// # Errors
    /// See [`Instance::set_debug_logging`].
    pub fn terminate(&mut self) -> Result<(), HostError> {
        if self.three.is_some() { checked!(self, terminate3()) } else { checked!(self, terminate()) }
    }

    /// `fmi2Reset`.
    ///
    /// # Errors
    /// See [`Instance::set_debug_logging`].
    pub fn reset(&mut self) -> Result<(), HostError> {
        if let Some(three) = &mut self.three {
            three.renew();
            return checked!(self, reset3());
        }
        checked!(self, reset())
    }

    /// `fmi2DoStep`, with its status as it is: a discarded step is no error of the caller.
    ///
    /// # Errors
    /// When it is not exported.
    pub fn do_step_status(&mut self, time: f64, step: f64, no_set_prior: bool) -> Result<Status, HostError> {
        if self.three.is_some() {
            return self.do_step3(time, step, no_set_prior);
        }
        call!(self, do_step(time, step, i32::from(no_set_prior))).map(Status::from)
    }

    /// `fmi2DoStep` from `time` by `step`, in s.
    ///
    /// # Errors
    /// See [`Instance::set_debug_logging`]; `fmi2Discard` and `fmi2Pending` are errors too.
    pub fn do_step(&mut self, time: f64, step: f64) -> Result<(), HostError> {
        if self.three.is_some() {
            let status = self.do_step3(time, step, !self.may_go_back)?;
            let function = "fmi3DoStep";
            return if status.is_ok() { Ok(()) } else { Err(HostError::Status { function, status }) };
        }
        let no_set_prior = i32::from(!self.may_go_back);
        checked!(self, do_step(time, step, no_set_prior))
    }

    /// `fmi2CancelStep`.
    ///
    /// # Errors
    /// See [`Instance::set_debug_logging`].
    pub fn cancel_step(&mut self) -> Result<(), HostError> {
        self.only_two("fmi2CancelStep")?;
        checked!(self, cancel_step())
    }

    /// `fmi2GetRealStatus(fmi2LastSuccessfulTime)`, in s.
    ///
    /// # Errors
    /// See [`Instance::set_debug_logging`].
    pub fn last_successful_time(&mut self) -> Result<f64, HostError> {
        if self.three.is_some() {
            return Ok(self.step_result().time);
        }
        let mut time = f64::NAN;
        checked!(self, get_real_status(2, &raw mut time)).map(|()| time)
    }

    /// `fmi2GetBooleanStatus(fmi2Terminated)`.
    ///
    /// # Errors
    /// See [`Instance::set_debug_logging`].
    pub fn terminated(&mut self) -> Result<bool, HostError> {
        if self.three.is_some() {
            return Ok(self.step_result().terminate);
        }
        let mut value = 0;
        checked!(self, get_boolean_status(3, &raw mut value)).map(|()| value != 0)
    }

    /// `fmi2GetStatus(fmi2DoStepStatus)`.
    ///
    /// # Errors
    /// See [`Instance::set_debug_logging`].
    pub fn step_status(&mut self) -> Result<Status, HostError> {
        self.only_two("fmi2GetStatus")?;
        let mut value = -1;
        checked!(self, get_status(0, &raw mut value)).map(|()| Status::from(value))
    }

    /// `fmi2FreeInstance`, which dropping does too.
    pub fn free(mut self) {
        self.free_once();
    }

    pub(super) fn free_once(&mut self) {
        if !self.freed && !self.component.is_null() {
            self.freed = true;
            let functions = &self.binary.functions;
            let (function, call) = match self.three {
                Some(_) => (functions.free_instance3, Call::free_instance3),
                None => (functions.free_instance, Call::free_instance),
            };
            if let Some(function) = function {
                note(call);
                // SAFETY: the component is alive and freed once.
                unsafe { function(self.component) };
                note(Call::None);
            }
        }
    }
}

impl Drop for Instance {
    fn drop(&mut self) {
        self.free_once();
        logger::forget(&self.log);
    }
}

/// `fmi2GetTypesPlatform`, `fmi2GetVersion` or `fmi3GetVersion` of a binary.
///
/// # Errors
/// When the function is not exported.
pub(crate) fn static_text(binary: &Binary, call: Call) -> Result<String, HostError> {
    if call == Call::get_version3 {
        return three::version3(&binary.functions);
    }
    let function = match call {
        Call::get_types_platform => binary.functions.get_types_platform,
        _ => binary.functions.get_version,
    };
    let function = function.ok_or(HostError::Missing(abi::CALLS[call as usize]))?;
    note(call);
    // SAFETY: the functions take nothing and give a C string that lives as long as the library.
    let text = unsafe { lossy(function()) };
    note(Call::None);
    Ok(text)
}
