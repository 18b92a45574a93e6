//! Steps, and what can be asked about them.

use std::ffi::c_int;

use super::super::abi::{Component, Status, Text};
use super::super::fault::Fault;
use super::super::gate::{self, Body};
use super::super::sequence::{Function, Mode};
use super::super::step_error::StepError;
use super::{array_mut, call, typed};

/// A communication point may differ from the end of the last step by this share of the step, for importers that
/// accumulate time.
const TIME_SLACK: f64 = 1e-3;
/// And by this share of itself.
const TIME_ROUNDING: f64 = 1e-12;

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2DoStep(c: Component, point: f64, step: f64, _no_set_state_before: c_int) -> c_int {
    call!(c, fmi2DoStep, |body| self::step(body, point, step))
}

/// A step from a communication point.
#[inline]
pub(crate) fn step(body: &mut Body, point: f64, step: f64) -> Result<Status, Fault> {
    // Written so that NaN is refused too.
    if !(step > 0.0 && step.is_finite()) {
        let must_be = "finite and greater than zero";
        return Err(Fault::Number { name: "communicationStepSize", value: step, must_be });
    }
    let (expected, stop) = (body.kernel.time(), body.kernel.stop());
    let slack = TIME_SLACK * step + TIME_ROUNDING * expected.abs();
    if point.is_nan() || (point - expected).abs() > slack {
        return Err(Fault::Time { given: point, expected });
    }
    if point + step > stop + slack {
        return Err(Fault::PastStop { end: point + step, stop });
    }
    match body.kernel.step(point, step) {
        Ok(()) => Ok(Status::Ok),
        Err(error) => {
            if let StepError::NotFinite { .. } = error {
                body.mode = Mode::Error;
            }
            Err(Fault::Step(error))
        }
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2CancelStep(c: Component) -> c_int {
    // No step is ever pending: the call sequence allows it nowhere.
    call!(c, fmi2CancelStep, |_| Ok(Status::Error))
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2GetStatus(c: Component, kind: c_int, _value: *mut c_int) -> c_int {
    call!(c, fmi2GetStatus, |body| discard(body, kind))
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2GetRealStatus(c: Component, kind: c_int, value: *mut f64) -> c_int {
    call!(c, fmi2GetRealStatus, |body| {
        // fmi2LastSuccessfulTime
        if kind != 2 {
            return discard(body, kind);
        }
        // SAFETY: the importer's.
        unsafe { array_mut(value, 1, "value") }?.fill(body.kernel.time());
        Ok(Status::Ok)
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2GetIntegerStatus(c: Component, kind: c_int, _value: *mut c_int) -> c_int {
    call!(c, fmi2GetIntegerStatus, |body| discard(body, kind))
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2GetBooleanStatus(c: Component, kind: c_int, value: *mut c_int) -> c_int {
    call!(c, fmi2GetBooleanStatus, |body| {
        // fmi2Terminated: this FMU never ends a simulation of itself.
        if kind != 3 {
            return discard(body, kind);
        }
        // SAFETY: the importer's.
        unsafe { array_mut(value, 1, "value") }?.fill(0);
        Ok(Status::Ok)
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2GetStringStatus(c: Component, kind: c_int, _value: *mut Text) -> c_int {
    call!(c, fmi2GetStringStatus, |body| discard(body, kind))
}

/// A status kind that is only for pending steps: `fmi2Discard`, as section 4.2.3 asks.
fn discard(body: &Body, kind: c_int) -> Result<Status, Fault> {
    body.log.send(Status::Discard, Fault::StatusKind(kind));
    Ok(Status::Discard)
}
