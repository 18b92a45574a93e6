//! The C interface of FMI 2.0, written by hand from `fmi2FunctionTypes.h`.
//!
//! A status comes back as a raw `i32`, because an FMU may return any number.

#![allow(unsafe_code)]
// The table is the whole interface, whether or not a method stands for each of its functions.
#![allow(dead_code)]

use std::ffi::{c_char, c_void};

use libloading::Library;

pub(crate) type Component = *mut c_void;
pub(crate) type State = *mut c_void;
pub(crate) type Text = *const c_char;
pub(crate) type RawStatus = i32;

/// `fmi2CallbackFunctions`.
#[repr(C)]
#[derive(Clone, Copy)]
pub(crate) struct Callbacks {
    pub logger: *const c_void,
    pub allocate: Option<unsafe extern "C" fn(usize, usize) -> *mut c_void>,
    pub free: Option<unsafe extern "C" fn(*mut c_void)>,
    pub step_finished: *const c_void,
    pub environment: *mut c_void,
}

macro_rules! functions {
    ($($field:ident = $symbol:literal ($($arg:ty),*) $(-> $result:ty)?;)*) => {
        /// The functions of a binary; `None` where it does not export the symbol.
        pub(crate) struct Functions {
            $(pub $field: Option<unsafe extern "C" fn($($arg),*) $(-> $result)?>,)*
        }

        impl Functions {
            /// Looks every symbol up.
            ///
            /// # Safety
            /// The library must export the symbols with the signatures of FMI 2.0.
            pub unsafe fn load(library: &Library) -> Self {
                Self {
                    // SAFETY: the caller vouches for the signatures.
                    $($field: unsafe { library.get(concat!($symbol, "\0").as_bytes()) }.ok().map(|symbol| *symbol),)*
                }
            }
        }

        /// The functions by number, for reports on what was called last.
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        #[repr(u32)]
        #[allow(non_camel_case_types)]
        pub(crate) enum Call { None = 0, Load, Unload, $($field),* }

        /// Names of the calls, by number.
        pub(crate) const CALLS: &[&str] = &["(no call)", "(loading the library)", "(unloading the library)", $($symbol),*];
    };
}

functions! {
    get_types_platform = "fmi2GetTypesPlatform" () -> Text;
    get_version = "fmi2GetVersion" () -> Text;
    set_debug_logging = "fmi2SetDebugLogging" (Component, i32, usize, *const Text) -> RawStatus;
    instantiate = "fmi2Instantiate" (Text, i32, Text, Text, *const Callbacks, i32, i32) -> Component;
    free_instance = "fmi2FreeInstance" (Component);
    setup_experiment = "fmi2SetupExperiment" (Component, i32, f64, f64, i32, f64) -> RawStatus;
    enter_initialization = "fmi2EnterInitializationMode" (Component) -> RawStatus;
    exit_initialization = "fmi2ExitInitializationMode" (Component) -> RawStatus;
    terminate = "fmi2Terminate" (Component) -> RawStatus;
    reset = "fmi2Reset" (Component) -> RawStatus;
    get_real = "fmi2GetReal" (Component, *const u32, usize, *mut f64) -> RawStatus;
    get_integer = "fmi2GetInteger" (Component, *const u32, usize, *mut i32) -> RawStatus;
    get_boolean = "fmi2GetBoolean" (Component, *const u32, usize, *mut i32) -> RawStatus;
    get_string = "fmi2GetString" (Component, *const u32, usize, *mut Text) -> RawStatus;
    set_real = "fmi2SetReal" (Component, *const u32, usize, *const f64) -> RawStatus;
    set_integer = "fmi2SetInteger" (Component, *const u32, usize, *const i32) -> RawStatus;
    set_boolean = "fmi2SetBoolean" (Component, *const u32, usize, *const i32) -> RawStatus;
    set_string = "fmi2SetString" (Component, *const u32, usize, *const Text) -> RawStatus;
    get_state = "fmi2GetFMUstate" (Component, *mut State) -> RawStatus;
    set_state = "fmi2SetFMUstate" (Component, State) -> RawStatus;
    free_state = "fmi2FreeFMUstate" (Component, *mut State) -> RawStatus;
    serialized_size = "fmi2SerializedFMUstateSize" (Component, State, *mut usize) -> RawStatus;
    serialize = "fmi2SerializeFMUstate" (Component, State, *mut u8, usize) -> RawStatus;
    deserialize = "fmi2DeSerializeFMUstate" (Component, *const u8, usize, *mut State) -> RawStatus;
    directional_derivative = "fmi2GetDirectionalDerivative"
        (Component, *const u32, usize, *const u32, usize, *const f64, *mut f64) -> RawStatus;
    set_input_derivatives = "fmi2SetRealInputDerivatives"
        (Component, *const u32, usize, *const i32, *const f64) -> RawStatus;
    get_output_derivatives = "fmi2GetRealOutputDerivatives"
        (Component, *const u32, usize, *const i32, *mut f64) -> RawStatus;
    do_step = "fmi2DoStep" (Component, f64, f64, i32) -> RawStatus;
    cancel_step = "fmi2CancelStep" (Component) -> RawStatus;
    get_status = "fmi2GetStatus" (Component, i32, *mut RawStatus) -> RawStatus;
    get_real_status = "fmi2GetRealStatus" (Component, i32, *mut f64) -> RawStatus;
    get_integer_status = "fmi2GetIntegerStatus" (Component, i32, *mut i32) -> RawStatus;
    get_boolean_status = "fmi2GetBooleanStatus" (Component, i32, *mut i32) -> RawStatus;
    get_string_status = "fmi2GetStringStatus" (Component, i32, *mut Text) -> RawStatus;
}

unsafe extern "C" {
    /// The C library's, as `fmi2CallbackAllocateMemory` asks: zeroed.
    pub(crate) fn calloc(count: usize, size: usize) -> *mut c_void;
    /// The C library's.
    pub(crate) fn free(memory: *mut c_void);
}
