//! The call sequence: the states of an instance, and in which of them each function may be called.

use std::fmt;

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
            pub(super) const fn mask(self) -> u8 {
                match self { $(Self::$name => $mask),* }
            }

            pub(super) const fn name(self) -> &'static str {
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
