//! The functions of `fmi2Functions.h` for co-simulation.
//!
//! # Safety
//! All of them, as the standard asks of importers: an instance is a null pointer or one that `fmi2Instantiate` gave and
//! that has not been freed, and is used by one thread at a time; an array holds as many entries as said.

#![allow(unsafe_code)]
#![allow(non_snake_case, reason = "the names are the standard's")]
#![allow(clippy::missing_safety_doc, clippy::too_many_arguments, reason = "the module's head says it for all")]
#![allow(missing_docs, reason = "documented by the standard")]

use std::ffi::{CStr, c_char, c_int, c_uint};
use std::panic::catch_unwind;
use std::slice;

use super::abi::{Callbacks, Component, FmuState, LOG_CATEGORIES, Status, Text};
use super::baked;
use super::fault::Fault;
use super::gate::{self, Body, Function, Log, Mode};
use super::kernel::{Kernel, StepError, may_be_known};
use super::stored::{self, Snapshot};
use crate::variables::{Causality, Slot, Type, Variability, at, guid, index_of};

/// A communication point may differ from the end of the last step by this share of the step, for importers that
/// accumulate time.
const TIME_SLACK: f64 = 1e-3;
/// And by this share of itself.
const TIME_ROUNDING: f64 = 1e-12;

#[unsafe(no_mangle)]
pub extern "C" fn fmi2GetTypesPlatform() -> Text {
    c"default".as_ptr()
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi2GetVersion() -> Text {
    c"2.0".as_ptr()
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2Instantiate(
    name: Text,
    kind: c_int,
    given_guid: Text,
    _resources: Text,
    callbacks: *const Callbacks,
    _visible: c_int,
    logging: c_int,
) -> Component {
    let made = catch_unwind(|| {
        if callbacks.is_null() {
            return std::ptr::null_mut();
        }
        // SAFETY: not null, and a callbacks structure by the standard's contract. Copied, because the importer need not
        // keep it where it is.
        let callbacks = unsafe { *callbacks };
        // SAFETY: null or a C string by the standard's contract. The name is copied for the same reason.
        let (name, given) = unsafe {
            let name = if name.is_null() { c"" } else { CStr::from_ptr(name) };
            (name.to_owned(), gate::text(given_guid))
        };
        // Errors always, the rest on request.
        let on = logging != 0;
        let log = Log { name, callbacks, on: [on, on, true, true] };
        let refuse = |why: std::fmt::Arguments<'_>| {
            log.send(Status::Error, format_args!("fmi2Instantiate: {why}"));
            std::ptr::null_mut()
        };
        if log.name.is_empty() {
            return refuse(format_args!("instanceName is empty"));
        }
        if kind != 1 {
            return refuse(format_args!("fmuType = {kind}: this FMU is for co-simulation (1)"));
        }
        let starts = baked::starts();
        let own = guid(&starts);
        if !own.is(given) {
            return refuse(format_args!(
                "the GUID {given} is not this binary's, {own}: modelDescription.xml belongs to another binary"
            ));
        }
        gate::create(starts, log)
    });
    made.unwrap_or(std::ptr::null_mut())
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2FreeInstance(c: Component) {
    // SAFETY: the importer's, see the module's head. Freeing cannot panic; were it to, it must not unwind into C.
    let _ = catch_unwind(|| unsafe { gate::destroy(c) });
}

/// `enter` for the functions below.
macro_rules! call {
    ($c:expr, $function:ident, $call:expr) => {{
        let call = typed($call);
        // SAFETY: the importer's, see the module's head.
        unsafe { gate::enter($c, Function::$function, call) as c_int }
    }};
}

/// Tells the compiler what a closure for the gate takes.
fn typed<F: FnOnce(&mut Body) -> Result<Status, Fault>>(call: F) -> F {
    call
}

/// An array from C.
///
/// # Safety
/// `data` is null or holds `len` entries that live through the call.
unsafe fn array<'a, T>(data: *const T, len: usize, name: &'static str) -> Result<&'a [T], Fault> {
    match len {
        0 => Ok(&[]),
        _ if data.is_null() || !data.is_aligned() => Err(Fault::Null(name)),
        // SAFETY: neither null nor out of alignment, and as long as said.
        _ => Ok(unsafe { slice::from_raw_parts(data, len) }),
    }
}

/// The same to write to.
///
/// # Safety
/// `data` is null or holds `len` entries that live through the call and that nothing else refers to.
unsafe fn array_mut<'a, T>(data: *mut T, len: usize, name: &'static str) -> Result<&'a mut [T], Fault> {
    match len {
        0 => Ok(&mut []),
        _ if data.is_null() || !data.is_aligned() => Err(Fault::Null(name)),
        // SAFETY: neither null nor out of alignment, and as long as said.
        _ => Ok(unsafe { slice::from_raw_parts_mut(data, len) }),
    }
}

/// Index of the Real variable, or of the Enumeration, with a value reference.
#[inline]
fn resolve(reference: c_uint, real: bool) -> Result<usize, Fault> {
    let wanted = if real { "Real" } else { "Integer or Enumeration" };
    // The fixed variables up to the structure are Reals with their index as reference: no table needed.
    if real && reference < Slot::Structure as u32 {
        return Ok(reference as usize);
    }
    index_of(reference).filter(|&i| (at(i).kind == Type::Real) == real).ok_or(Fault::Reference { reference, wanted })
}

/// Checks that a value may be set now.
fn settable(body: &Body, index: usize, value: f64) -> Result<(), Fault> {
    let v = at(index);
    let allowed = match v.causality {
        Causality::Input => true,
        Causality::Output => false,
        Causality::Parameter => body.mode != Mode::Step || v.variability == Variability::Tunable,
    };
    if !allowed {
        return Err(Fault::NotSettable { index, mode: body.mode });
    }
    if !value.is_finite() {
        return Err(Fault::NotFinite { index, value });
    }
    if v.min.is_some_and(|m| value < m) || v.max.is_some_and(|m| value > m) {
        return Err(Fault::Bounds { index, value });
    }
    Ok(())
}

/// Sets values: all, or none of them where one is refused.
fn set(body: &mut Body, references: &[c_uint], real: bool, value: impl Fn(usize) -> f64) -> Result<Status, Fault> {
    for (i, &reference) in references.iter().enumerate() {
        settable(body, resolve(reference, real)?, value(i))?;
    }
    for (i, &reference) in references.iter().enumerate() {
        body.kernel.set(resolve(reference, real)?, value(i));
    }
    Ok(Status::Ok)
}

/// Refuses every value reference: there is no variable of that type.
fn none_of(references: &[c_uint], wanted: &'static str) -> Result<Status, Fault> {
    match references.first() {
        None => Ok(Status::Ok),
        Some(&reference) => Err(Fault::Reference { reference, wanted }),
    }
}

fn finite(name: &'static str, value: f64) -> Result<f64, Fault> {
    if value.is_finite() { Ok(value) } else { Err(Fault::Number { name, value, must_be: "a finite number" }) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2SetDebugLogging(c: Component, on: c_int, count: usize, categories: *const Text) -> c_int {
    call!(c, fmi2SetDebugLogging, |body| {
        // SAFETY: the importer's.
        let categories = unsafe { array(categories, count, "categories") }?;
        let mut chosen = [categories.is_empty(); 4];
        for &category in categories {
            // SAFETY: null or a C string by the standard's contract.
            let category = unsafe { gate::text(category) };
            match LOG_CATEGORIES.iter().position(|(name, _)| *name == category) {
                Some(i) if i < 4 => chosen[i] = true,
                Some(_) => chosen = [true; 4],
                None => return Err(Fault::Category),
            }
        }
        for (now, _) in body.log.on.iter_mut().zip(chosen).filter(|(_, chosen)| *chosen) {
            *now = on != 0;
        }
        Ok(Status::Ok)
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2SetupExperiment(
    c: Component,
    tolerance_defined: c_int,
    tolerance: f64,
    start: f64,
    stop_defined: c_int,
    stop: f64,
) -> c_int {
    call!(c, fmi2SetupExperiment, |body| {
        // The tolerance has no meaning here: the internal step is fixed.
        if tolerance_defined != 0 {
            finite("tolerance", tolerance)?;
        }
        finite("startTime", start)?;
        let stop = if stop_defined != 0 { finite("stopTime", stop)? } else { f64::INFINITY };
        if stop <= start {
            return Err(Fault::Number { name: "stopTime", value: stop, must_be: "after startTime" });
        }
        body.kernel.set_experiment(start, stop);
        body.set_up = true;
        Ok(Status::Ok)
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2EnterInitializationMode(c: Component) -> c_int {
    call!(c, fmi2EnterInitializationMode, |body| {
        if !body.set_up {
            return Err(Fault::NotSetUp);
        }
        body.mode = Mode::Initialization;
        Ok(Status::Ok)
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2ExitInitializationMode(c: Component) -> c_int {
    call!(c, fmi2ExitInitializationMode, |body| {
        body.kernel.initialise()?;
        body.mode = Mode::Step;
        Ok(Status::Ok)
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2Terminate(c: Component) -> c_int {
    call!(c, fmi2Terminate, |body| {
        body.mode = Mode::Terminated;
        Ok(Status::Ok)
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2Reset(c: Component) -> c_int {
    call!(c, fmi2Reset, |body| {
        body.kernel = Kernel::new(&body.starts);
        body.mode = Mode::Instantiated;
        body.set_up = false;
        Ok(Status::Ok)
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2GetReal(c: Component, vr: *const c_uint, count: usize, value: *mut f64) -> c_int {
    call!(c, fmi2GetReal, |body| {
        // SAFETY: the importer's.
        let (vr, value) = unsafe { (array(vr, count, "vr")?, array_mut(value, count, "value")?) };
        for (out, &reference) in value.iter_mut().zip(vr) {
            *out = body.kernel.get(resolve(reference, true)?)?;
        }
        Ok(Status::Ok)
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2GetInteger(c: Component, vr: *const c_uint, count: usize, value: *mut c_int) -> c_int {
    call!(c, fmi2GetInteger, |body| {
        // SAFETY: the importer's.
        let (vr, value) = unsafe { (array(vr, count, "vr")?, array_mut(value, count, "value")?) };
        for (out, &reference) in value.iter_mut().zip(vr) {
            *out = body.kernel.get(resolve(reference, false)?)? as c_int;
        }
        Ok(Status::Ok)
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2GetBoolean(c: Component, vr: *const c_uint, count: usize, _value: *mut c_int) -> c_int {
    call!(c, fmi2GetBoolean, |_| {
        // SAFETY: the importer's.
        none_of(unsafe { array(vr, count, "vr") }?, "Boolean")
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2GetString(c: Component, vr: *const c_uint, count: usize, _value: *mut Text) -> c_int {
    call!(c, fmi2GetString, |_| {
        // SAFETY: the importer's.
        none_of(unsafe { array(vr, count, "vr") }?, "String")
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2SetReal(c: Component, vr: *const c_uint, count: usize, value: *const f64) -> c_int {
    call!(c, fmi2SetReal, |body| {
        // SAFETY: the importer's.
        let (vr, value) = unsafe { (array(vr, count, "vr")?, array(value, count, "value")?) };
        set(body, vr, true, |i| value[i])
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2SetInteger(c: Component, vr: *const c_uint, count: usize, value: *const c_int) -> c_int {
    call!(c, fmi2SetInteger, |body| {
        // SAFETY: the importer's.
        let (vr, value) = unsafe { (array(vr, count, "vr")?, array(value, count, "value")?) };
        set(body, vr, false, |i| f64::from(value[i]))
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2SetBoolean(c: Component, vr: *const c_uint, count: usize, _value: *const c_int) -> c_int {
    call!(c, fmi2SetBoolean, |_| {
        // SAFETY: the importer's.
        none_of(unsafe { array(vr, count, "vr") }?, "Boolean")
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2SetString(c: Component, vr: *const c_uint, count: usize, _value: *const Text) -> c_int {
    call!(c, fmi2SetString, |_| {
        // SAFETY: the importer's.
        none_of(unsafe { array(vr, count, "vr") }?, "String")
    })
}

/// A state of this instance, by its pointer.
fn state_of(body: &Body, state: FmuState) -> Result<&Snapshot, Fault> {
    if !body.states.contains(&(state as usize)) {
        return Err(Fault::UnknownState);
    }
    // SAFETY: every address in the set is a boxed snapshot that has not been freed.
    Ok(unsafe { &*state.cast::<Snapshot>() })
}

/// Keeps a snapshot and gives its pointer.
fn keep(body: &mut Body, snapshot: Snapshot) -> FmuState {
    let state: FmuState = Box::into_raw(Box::new(snapshot)).cast();
    body.states.insert(state as usize);
    state
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2GetFMUstate(c: Component, state: *mut FmuState) -> c_int {
    call!(c, fmi2GetFMUstate, |body| {
        // SAFETY: the importer's.
        let [state] = (unsafe { array_mut(state, 1, "FMUstate") })? else { return Err(Fault::Null("FMUstate")) };
        let snapshot = body.snapshot();
        if state.is_null() {
            *state = keep(body, snapshot);
        } else if body.states.contains(&(*state as usize)) {
            // SAFETY: the address of a boxed snapshot of this instance; nothing else refers to it.
            unsafe { *state.cast::<Snapshot>() = snapshot };
        } else {
            return Err(Fault::UnknownState);
        }
        Ok(Status::Ok)
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2SetFMUstate(c: Component, state: FmuState) -> c_int {
    call!(c, fmi2SetFMUstate, |body| {
        let to = *state_of(body, state)?;
        body.go_back(&to);
        Ok(Status::Ok)
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2FreeFMUstate(c: Component, state: *mut FmuState) -> c_int {
    call!(c, fmi2FreeFMUstate, |body| {
        // SAFETY: the importer's.
        let [state] = (unsafe { array_mut(state, 1, "FMUstate") })? else { return Err(Fault::Null("FMUstate")) };
        if state.is_null() {
            return Ok(Status::Ok);
        }
        if !body.states.remove(&(*state as usize)) {
            return Err(Fault::UnknownState);
        }
        // SAFETY: the address was in the set: a boxed snapshot that has not been freed.
        drop(unsafe { Box::from_raw(state.cast::<Snapshot>()) });
        *state = std::ptr::null_mut();
        Ok(Status::Ok)
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2SerializedFMUstateSize(c: Component, state: FmuState, size: *mut usize) -> c_int {
    call!(c, fmi2SerializedFMUstateSize, |body| {
        let needed = stored::size(&state_of(body, state)?.kernel);
        // SAFETY: the importer's.
        unsafe { array_mut(size, 1, "size") }?.fill(needed);
        Ok(Status::Ok)
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2SerializeFMUstate(
    c: Component,
    state: FmuState,
    bytes: *mut c_char,
    size: usize,
) -> c_int {
    call!(c, fmi2SerializeFMUstate, |body| {
        let snapshot = state_of(body, state)?;
        // SAFETY: the importer's.
        let buffer = unsafe { array_mut(bytes.cast::<u8>(), size, "serializedState") }?;
        if stored::write(snapshot, &body.starts, buffer) {
            Ok(Status::Ok)
        } else {
            Err(Fault::Buffer { given: size, needed: stored::size(&snapshot.kernel) })
        }
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2DeSerializeFMUstate(
    c: Component,
    bytes: *const c_char,
    size: usize,
    state: *mut FmuState,
) -> c_int {
    call!(c, fmi2DeSerializeFMUstate, |body| {
        // SAFETY: the importer's.
        let (bytes, out) =
            unsafe { (array(bytes.cast::<u8>(), size, "serializedState")?, array_mut(state, 1, "FMUstate")?) };
        let snapshot = stored::read(&body.starts, bytes).map_err(Fault::Stored)?;
        out.fill(keep(body, snapshot));
        Ok(Status::Ok)
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2GetDirectionalDerivative(
    c: Component,
    unknown: *const c_uint,
    unknowns: usize,
    known: *const c_uint,
    knowns: usize,
    seed: *const f64,
    result: *mut f64,
) -> c_int {
    call!(c, fmi2GetDirectionalDerivative, |body| {
        // SAFETY: the importer's.
        let (unknown, known) =
            unsafe { (array(unknown, unknowns, "vUnknown_ref")?, array(known, knowns, "vKnown_ref")?) };
        // SAFETY: the importer's.
        let (seed, result) = unsafe { (array(seed, knowns, "dvKnown")?, array_mut(result, unknowns, "dvUnknown")?) };
        for &reference in unknown {
            let index = resolve(reference, true)?;
            if at(index).causality != Causality::Output {
                return Err(Fault::Not { index, what: "output" });
            }
        }
        let initialising = body.mode == Mode::Initialization;
        for (&reference, &value) in known.iter().zip(seed) {
            let index = resolve(reference, true)?;
            if !may_be_known(index, initialising) {
                return Err(Fault::Not { index, what: "known of the outputs here" });
            }
            if !value.is_finite() {
                return Err(Fault::NotFinite { index, value });
            }
        }
        // Every reference has just been resolved once.
        let index = |reference: c_uint| resolve(reference, true).unwrap_or(0);
        let seeds = known.iter().zip(seed).map(|(&reference, &value)| (index(reference), value));
        body.kernel.directional(seeds, |derivative| {
            for (out, &reference) in result.iter_mut().zip(unknown) {
                *out = derivative(index(reference));
            }
        })?;
        Ok(Status::Ok)
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2SetRealInputDerivatives(
    c: Component,
    vr: *const c_uint,
    count: usize,
    order: *const c_int,
    value: *const f64,
) -> c_int {
    call!(c, fmi2SetRealInputDerivatives, |body| {
        // SAFETY: the importer's.
        let (vr, order) = unsafe { (array(vr, count, "vr")?, array(order, count, "order")?) };
        // SAFETY: the importer's.
        let value = unsafe { array(value, count, "value") }?;
        for ((&reference, &order), &value) in vr.iter().zip(order).zip(value) {
            let index = resolve(reference, true)?;
            if at(index).causality != Causality::Input {
                return Err(Fault::Not { index, what: "input" });
            }
            if order != 1 {
                return Err(Fault::Order(order));
            }
            if !value.is_finite() {
                return Err(Fault::NotFinite { index, value });
            }
        }
        // There is one input.
        if let Some(&last) = value.last() {
            body.kernel.set_rate(last);
        }
        Ok(Status::Ok)
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2GetRealOutputDerivatives(
    c: Component,
    vr: *const c_uint,
    count: usize,
    order: *const c_int,
    value: *mut f64,
) -> c_int {
    call!(c, fmi2GetRealOutputDerivatives, |body| {
        // SAFETY: the importer's.
        let (vr, order) = unsafe { (array(vr, count, "vr")?, array(order, count, "order")?) };
        // SAFETY: the importer's.
        let value = unsafe { array_mut(value, count, "value") }?;
        for ((&reference, &order), out) in vr.iter().zip(order).zip(value) {
            let index = resolve(reference, true)?;
            if at(index).causality != Causality::Output {
                return Err(Fault::Not { index, what: "output" });
            }
            if order != 1 {
                return Err(Fault::Order(order));
            }
            *out = body.kernel.output_derivative(index)?;
        }
        Ok(Status::Ok)
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2DoStep(c: Component, point: f64, step: f64, _no_set_state_before: c_int) -> c_int {
    call!(c, fmi2DoStep, |body| {
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
    })
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
