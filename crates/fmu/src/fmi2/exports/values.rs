//! Getting and setting values, and derivatives.

use std::ffi::{c_int, c_uint};

use super::super::abi::{Component, Status, Text};
use super::super::fault::Fault;
use super::super::gate::{self, Body};
use super::super::sequence::{Function, Mode};
use super::{array, array_mut, call, typed};
use crate::variables::{Causality, Model, Named, Type, Variability};

/// Index of the Real variable, or of the Enumeration, with a value reference.
#[inline]
pub(crate) fn resolve(model: Model, reference: c_uint, real: bool) -> Result<usize, Fault> {
    let wanted = if real { "Real" } else { "Integer or Enumeration" };
    // The head of the table needs no look into it.
    if real && (reference as usize) < model.leading_reals() {
        return Ok(reference as usize);
    }
    let fits = |&i: &usize| (model.at(i).kind == Type::Real) == real;
    model.index_of(reference).filter(fits).ok_or(Fault::Reference { reference, wanted })
}

/// Checks that a value may be set now.
fn settable(body: &Body, index: usize, value: f64) -> Result<(), Fault> {
    let named = Named(body.kernel.model(), index);
    let v = named.variable();
    let allowed = match v.causality {
        Causality::Input => true,
        Causality::Output => false,
        Causality::Parameter => body.mode != Mode::Step || v.variability == Variability::Tunable,
    };
    if !allowed {
        return Err(Fault::NotSettable { index: named, mode: body.mode });
    }
    if !value.is_finite() {
        return Err(Fault::NotFinite { index: named, value });
    }
    if v.min.is_some_and(|m| value < m) || v.max.is_some_and(|m| value > m) {
        return Err(Fault::Bounds { index: named, value });
    }
    Ok(())
}

/// Sets values: all, or none of them where one is refused.
pub(crate) fn set(
    body: &mut Body,
    references: &[c_uint],
    real: bool,
    value: impl Fn(usize) -> f64,
) -> Result<Status, Fault> {
    let model = body.kernel.model();
    for (i, &reference) in references.iter().enumerate() {
        settable(body, resolve(model, reference, real)?, value(i))?;
    }
    for (i, &reference) in references.iter().enumerate() {
        body.kernel.set(resolve(model, reference, real)?, value(i));
    }
    Ok(Status::Ok)
}

/// A value for the importer: no infinity and no NaN passes as fmi2OK.
#[inline]
pub(crate) fn finite_value(model: Model, index: usize, value: f64) -> Result<f64, Fault> {
    if value.is_finite() { Ok(value) } else { Err(Fault::NoNumber { index: Named(model, index), value }) }
}

/// Refuses every value reference: there is no variable of that type.
pub(crate) fn none_of(references: &[c_uint], wanted: &'static str) -> Result<Status, Fault> {
    match references.first() {
        None => Ok(Status::Ok),
        Some(&reference) => Err(Fault::Reference { reference, wanted }),
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2GetReal(c: Component, vr: *const c_uint, count: usize, value: *mut f64) -> c_int {
    call!(c, fmi2GetReal, |body| {
        // SAFETY: the importer's.
        let (vr, value) = unsafe { (array(vr, count, "vr")?, array_mut(value, count, "value")?) };
        let model = body.kernel.model();
        for (out, &reference) in value.iter_mut().zip(vr) {
            let index = resolve(model, reference, true)?;
            *out = finite_value(model, index, body.kernel.get(index)?)?;
        }
        Ok(Status::Ok)
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2GetInteger(c: Component, vr: *const c_uint, count: usize, value: *mut c_int) -> c_int {
    call!(c, fmi2GetInteger, |body| {
        // SAFETY: the importer's.
        let (vr, value) = unsafe { (array(vr, count, "vr")?, array_mut(value, count, "value")?) };
        let model = body.kernel.model();
        for (out, &reference) in value.iter_mut().zip(vr) {
            *out = body.kernel.get(resolve(model, reference, false)?)? as c_int;
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
        directional(body, unknown, known, seed, result)
    })
}

/// Directional derivatives of outputs; by the same value references.
pub(crate) fn directional(
    body: &mut Body,
    unknown: &[c_uint],
    known: &[c_uint],
    seed: &[f64],
    result: &mut [f64],
) -> Result<Status, Fault> {
    let model = body.kernel.model();
    for &reference in unknown {
        let index = resolve(model, reference, true)?;
        if model.at(index).causality != Causality::Output {
            return Err(Fault::Not { index: Named(model, index), what: "output" });
        }
    }
    let initialising = body.mode == Mode::Initialization;
    for (&reference, &value) in known.iter().zip(seed) {
        let index = resolve(model, reference, true)?;
        if !model.may_be_known(index, initialising) {
            return Err(Fault::Not { index: Named(model, index), what: "known of the outputs here" });
        }
        if !value.is_finite() {
            return Err(Fault::NotFinite { index: Named(model, index), value });
        }
    }
    // Every reference has just been resolved once.
    let index = |reference: c_uint| resolve(model, reference, true).unwrap_or(0);
    let seeds = known.iter().zip(seed).map(|(&reference, &value)| (index(reference), value));
    body.kernel.directional(seeds, |derivative| {
        for (out, &reference) in result.iter_mut().zip(unknown) {
            *out = derivative(index(reference));
        }
    })?;
    for (out, &reference) in result.iter().zip(unknown) {
        finite_value(model, index(reference), *out)?;
    }
    Ok(Status::Ok)
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
        let model = body.kernel.model();
        for ((&reference, &order), &value) in vr.iter().zip(order).zip(value) {
            let index = resolve(model, reference, true)?;
            if model.at(index).causality != Causality::Input {
                return Err(Fault::Not { index: Named(model, index), what: "input" });
            }
            if order != 1 {
                return Err(Fault::Order(order));
            }
            if !value.is_finite() {
                return Err(Fault::NotFinite { index: Named(model, index), value });
            }
        }
        for (&reference, &value) in vr.iter().zip(value) {
            body.kernel.set_rate(resolve(model, reference, true)?, value);
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
        output_derivatives(body, vr, order, value)
    })
}

/// Derivatives of outputs to time.
pub(crate) fn output_derivatives(
    body: &mut Body,
    vr: &[c_uint],
    order: &[c_int],
    value: &mut [f64],
) -> Result<Status, Fault> {
    let model = body.kernel.model();
    for ((&reference, &order), out) in vr.iter().zip(order).zip(value) {
        let index = resolve(model, reference, true)?;
        if model.at(index).causality != Causality::Output {
            return Err(Fault::Not { index: Named(model, index), what: "output" });
        }
        if order != 1 {
            return Err(Fault::Order(order));
        }
        *out = finite_value(model, index, body.kernel.output_derivative(index)?)?;
    }
    Ok(Status::Ok)
}
