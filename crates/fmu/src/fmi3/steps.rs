//! Steps (FMI 3.0, section 4.2.1), and the modes that this FMU does not have.

use std::ffi::c_int;

use super::{Instance, call};
use crate::fmi2::{Status, array_mut, step};

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3DoStep(
    c: Instance,
    point: f64,
    length: f64,
    _no_set_state_before: u8,
    event_handling_needed: *mut u8,
    terminate_simulation: *mut u8,
    early_return: *mut u8,
    last_successful_time: *mut f64,
) -> c_int {
    call!(c, fmi3DoStep, |body| {
        // SAFETY: the importer's; all four are looked at before anything is done.
        let (flags, last) = unsafe {
            (
                [
                    array_mut(event_handling_needed, 1, "eventHandlingNeeded")?,
                    array_mut(terminate_simulation, 1, "terminateSimulation")?,
                    array_mut(early_return, 1, "earlyReturn")?,
                ],
                array_mut(last_successful_time, 1, "lastSuccessfulTime")?,
            )
        };
        let done = step(body, point, length);
        // Also when the step was refused: then nothing has changed.
        flags.into_iter().for_each(|flag| flag.fill(0));
        last.fill(body.kernel.time());
        done
    })
}

/// Functions of modes that the FMU does not have: legal in no state of it.
macro_rules! nowhere {
    ($($name:ident ($($arg:ident: $kind:ty),*);)*) => {$(
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $name(c: Instance, $($arg: $kind),*) -> c_int {
            call!(c, $name, |_| Ok(Status::Error))
        }
    )*};
}

nowhere! {
    fmi3EnterEventMode();
    fmi3EnterStepMode();
    fmi3EnterConfigurationMode();
    fmi3ExitConfigurationMode();
    fmi3EvaluateDiscreteStates();
    fmi3UpdateDiscreteStates(
        _discrete_states: *mut u8,
        _terminate: *mut u8,
        _nominals: *mut u8,
        _states: *mut u8,
        _next_defined: *mut u8,
        _next: *mut f64
    );
}
