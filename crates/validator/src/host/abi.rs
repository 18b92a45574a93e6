//! The C interfaces of FMI 2.0 and of FMI 3.0, written by hand from `fmi2FunctionTypes.h` and `fmi3FunctionTypes.h`.
//!
//! One table for both: a binary exports the functions of its own version. `fmi3Boolean` and `fmi3Clock` are C's `bool`,
//! here the byte that it is, because an FMU may put any number there. A status comes back as a raw `i32`, because an FMU may return any number.

#![allow(unsafe_code)]
// The table is the whole interface, whether or not each of its functions has a method.
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

/// `fmi3LogMessageCallback`.
pub(crate) type LogMessage3 = unsafe extern "C" fn(*mut c_void, RawStatus, Text, Text);
/// `fmi3IntermediateUpdateCallback`: environment, time, set requested, get allowed, step finished, can return early, and
/// the importer's reply: early return requested, and at which time.
pub(crate) type IntermediateUpdate = unsafe extern "C" fn(*mut c_void, f64, u8, u8, u8, u8, *mut u8, *mut f64);

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
            /// The library must export the symbols with the signatures of FMI 2.0 and FMI 3.0.
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
    get_version3 = "fmi3GetVersion" () -> Text;
    set_debug_logging3 = "fmi3SetDebugLogging" (Component, u8, usize, *const Text) -> RawStatus;
    instantiate3 = "fmi3InstantiateCoSimulation"
        (Text, Text, Text, u8, u8, u8, u8, *const u32, usize, *mut c_void, Option<LogMessage3>, Option<IntermediateUpdate>)
        -> Component;
    free_instance3 = "fmi3FreeInstance" (Component);
    enter_initialization3 = "fmi3EnterInitializationMode" (Component, u8, f64, f64, u8, f64) -> RawStatus;
    exit_initialization3 = "fmi3ExitInitializationMode" (Component) -> RawStatus;
    enter_event_mode = "fmi3EnterEventMode" (Component) -> RawStatus;
    enter_step_mode = "fmi3EnterStepMode" (Component) -> RawStatus;
    enter_configuration_mode = "fmi3EnterConfigurationMode" (Component) -> RawStatus;
    exit_configuration_mode = "fmi3ExitConfigurationMode" (Component) -> RawStatus;
    update_discrete_states = "fmi3UpdateDiscreteStates"
        (Component, *mut u8, *mut u8, *mut u8, *mut u8, *mut u8, *mut f64) -> RawStatus;
    evaluate_discrete_states = "fmi3EvaluateDiscreteStates" (Component) -> RawStatus;
    terminate3 = "fmi3Terminate" (Component) -> RawStatus;
    reset3 = "fmi3Reset" (Component) -> RawStatus;
    get3_float32 = "fmi3GetFloat32" (Component, *const u32, usize, *mut f32, usize) -> RawStatus;
    set3_float32 = "fmi3SetFloat32" (Component, *const u32, usize, *const f32, usize) -> RawStatus;
    get3_float64 = "fmi3GetFloat64" (Component, *const u32, usize, *mut f64, usize) -> RawStatus;
    set3_float64 = "fmi3SetFloat64" (Component, *const u32, usize, *const f64, usize) -> RawStatus;
    get3_int8 = "fmi3GetInt8" (Component, *const u32, usize, *mut i8, usize) -> RawStatus;
    set3_int8 = "fmi3SetInt8" (Component, *const u32, usize, *const i8, usize) -> RawStatus;
    get3_uint8 = "fmi3GetUInt8" (Component, *const u32, usize, *mut u8, usize) -> RawStatus;
    set3_uint8 = "fmi3SetUInt8" (Component, *const u32, usize, *const u8, usize) -> RawStatus;
    get3_int16 = "fmi3GetInt16" (Component, *const u32, usize, *mut i16, usize) -> RawStatus;
    set3_int16 = "fmi3SetInt16" (Component, *const u32, usize, *const i16, usize) -> RawStatus;
    get3_uint16 = "fmi3GetUInt16" (Component, *const u32, usize, *mut u16, usize) -> RawStatus;
    set3_uint16 = "fmi3SetUInt16" (Component, *const u32, usize, *const u16, usize) -> RawStatus;
    get3_int32 = "fmi3GetInt32" (Component, *const u32, usize, *mut i32, usize) -> RawStatus;
    set3_int32 = "fmi3SetInt32" (Component, *const u32, usize, *const i32, usize) -> RawStatus;
    get3_uint32 = "fmi3GetUInt32" (Component, *const u32, usize, *mut u32, usize) -> RawStatus;
    set3_uint32 = "fmi3SetUInt32" (Component, *const u32, usize, *const u32, usize) -> RawStatus;
    get3_int64 = "fmi3GetInt64" (Component, *const u32, usize, *mut i64, usize) -> RawStatus;
    set3_int64 = "fmi3SetInt64" (Component, *const u32, usize, *const i64, usize) -> RawStatus;
    get3_uint64 = "fmi3GetUInt64" (Component, *const u32, usize, *mut u64, usize) -> RawStatus;
    set3_uint64 = "fmi3SetUInt64" (Component, *const u32, usize, *const u64, usize) -> RawStatus;
    get3_boolean = "fmi3GetBoolean" (Component, *const u32, usize, *mut u8, usize) -> RawStatus;
    set3_boolean = "fmi3SetBoolean" (Component, *const u32, usize, *const u8, usize) -> RawStatus;
    get3_string = "fmi3GetString" (Component, *const u32, usize, *mut Text, usize) -> RawStatus;
    set3_string = "fmi3SetString" (Component, *const u32, usize, *const Text, usize) -> RawStatus;
    get3_binary = "fmi3GetBinary" (Component, *const u32, usize, *mut usize, *mut *const u8, usize) -> RawStatus;
    set3_binary = "fmi3SetBinary" (Component, *const u32, usize, *const usize, *const *const u8, usize) -> RawStatus;
    get_clock = "fmi3GetClock" (Component, *const u32, usize, *mut u8) -> RawStatus;
    set_clock = "fmi3SetClock" (Component, *const u32, usize, *const u8) -> RawStatus;
    number_of_dependencies = "fmi3GetNumberOfVariableDependencies" (Component, u32, *mut usize) -> RawStatus;
    variable_dependencies = "fmi3GetVariableDependencies"
        (Component, u32, *mut usize, *mut u32, *mut usize, *mut i32, usize) -> RawStatus;
    get_state3 = "fmi3GetFMUState" (Component, *mut State) -> RawStatus;
    set_state3 = "fmi3SetFMUState" (Component, State) -> RawStatus;
    free_state3 = "fmi3FreeFMUState" (Component, *mut State) -> RawStatus;
    serialized_size3 = "fmi3SerializedFMUStateSize" (Component, State, *mut usize) -> RawStatus;
    serialize3 = "fmi3SerializeFMUState" (Component, State, *mut u8, usize) -> RawStatus;
    deserialize3 = "fmi3DeserializeFMUState" (Component, *const u8, usize, *mut State) -> RawStatus;
    directional_derivative3 = "fmi3GetDirectionalDerivative"
        (Component, *const u32, usize, *const u32, usize, *const f64, usize, *mut f64, usize) -> RawStatus;
    adjoint_derivative = "fmi3GetAdjointDerivative"
        (Component, *const u32, usize, *const u32, usize, *const f64, usize, *mut f64, usize) -> RawStatus;
    get_interval_decimal = "fmi3GetIntervalDecimal" (Component, *const u32, usize, *mut f64, *mut i32) -> RawStatus;
    get_interval_fraction = "fmi3GetIntervalFraction"
        (Component, *const u32, usize, *mut u64, *mut u64, *mut i32) -> RawStatus;
    get_shift_decimal = "fmi3GetShiftDecimal" (Component, *const u32, usize, *mut f64) -> RawStatus;
    get_shift_fraction = "fmi3GetShiftFraction" (Component, *const u32, usize, *mut u64, *mut u64) -> RawStatus;
    set_interval_decimal = "fmi3SetIntervalDecimal" (Component, *const u32, usize, *const f64) -> RawStatus;
    set_interval_fraction = "fmi3SetIntervalFraction"
        (Component, *const u32, usize, *const u64, *const u64) -> RawStatus;
    set_shift_decimal = "fmi3SetShiftDecimal" (Component, *const u32, usize, *const f64) -> RawStatus;
    set_shift_fraction = "fmi3SetShiftFraction" (Component, *const u32, usize, *const u64, *const u64) -> RawStatus;
    get_output_derivatives3 = "fmi3GetOutputDerivatives"
        (Component, *const u32, usize, *const i32, *mut f64, usize) -> RawStatus;
    do_step3 = "fmi3DoStep" (Component, f64, f64, u8, *mut u8, *mut u8, *mut u8, *mut f64) -> RawStatus;
}

unsafe extern "C" {
    /// The C library's, as `fmi2CallbackAllocateMemory` asks: zeroed.
    pub(crate) fn calloc(count: usize, size: usize) -> *mut c_void;
    /// The C library's.
    pub(crate) fn free(memory: *mut c_void);
}
