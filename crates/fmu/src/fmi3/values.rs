//! Getting and setting values, and derivatives (FMI 3.0, sections 2.2.6.2, 2.2.11 and 2.2.12). Every variable is a scalar.

use std::ffi::c_int;

use super::{Instance, TIME_REFERENCE, call};
use crate::fmi2::{
    Body, Fault, Status, Text, array, array_mut, directional, finite_value, none_of, output_derivatives, resolve, set,
};

/// As many values as references: every variable is a scalar.
fn scalars(references: usize, values: usize) -> Result<(), Fault> {
    if references == values { Ok(()) } else { Err(Fault::Count { given: values, needed: references }) }
}

fn float(body: &mut Body, reference: u32) -> Result<f64, Fault> {
    if reference == TIME_REFERENCE {
        return Ok(body.kernel.time());
    }
    let model = body.kernel.model();
    let index = resolve(model, reference, true)?;
    finite_value(model, index, body.kernel.get(index)?)
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3GetFloat64(
    c: Instance,
    vr: *const u32,
    count: usize,
    value: *mut f64,
    values: usize,
) -> c_int {
    call!(c, fmi3GetFloat64, |body| {
        scalars(count, values)?;
        // SAFETY: the importer's.
        let (vr, value) = unsafe { (array(vr, count, "valueReferences")?, array_mut(value, values, "values")?) };
        for (out, &reference) in value.iter_mut().zip(vr) {
            *out = float(body, reference)?;
        }
        Ok(Status::Ok)
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3SetFloat64(
    c: Instance,
    vr: *const u32,
    count: usize,
    value: *const f64,
    values: usize,
) -> c_int {
    call!(c, fmi3SetFloat64, |body| {
        scalars(count, values)?;
        // SAFETY: the importer's.
        let (vr, value) = unsafe { (array(vr, count, "valueReferences")?, array(value, values, "values")?) };
        set(body, vr, true, |i| value[i])
    })
}

/// Enumerations go by the functions of 64 bits.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3GetInt64(
    c: Instance,
    vr: *const u32,
    count: usize,
    value: *mut i64,
    values: usize,
) -> c_int {
    call!(c, fmi3GetInt64, |body| {
        scalars(count, values)?;
        // SAFETY: the importer's.
        let (vr, value) = unsafe { (array(vr, count, "valueReferences")?, array_mut(value, values, "values")?) };
        let model = body.kernel.model();
        for (out, &reference) in value.iter_mut().zip(vr) {
            *out = body.kernel.get(resolve(model, reference, false)?)? as i64;
        }
        Ok(Status::Ok)
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3SetInt64(
    c: Instance,
    vr: *const u32,
    count: usize,
    value: *const i64,
    values: usize,
) -> c_int {
    call!(c, fmi3SetInt64, |body| {
        scalars(count, values)?;
        // SAFETY: the importer's.
        let (vr, value) = unsafe { (array(vr, count, "valueReferences")?, array(value, values, "values")?) };
        set(body, vr, false, |i| value[i] as f64)
    })
}

/// Types of which there is no variable: every value reference is refused.
macro_rules! none {
    ($($get:ident $set:ident $what:literal $native:ty;)*) => {$(
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $get(
            c: Instance, vr: *const u32, count: usize, _value: *mut $native, _values: usize,
        ) -> c_int {
            // SAFETY: the importer's.
            call!(c, $get, |_| none_of(unsafe { array(vr, count, "valueReferences") }?, $what))
        }

        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $set(
            c: Instance, vr: *const u32, count: usize, _value: *const $native, _values: usize,
        ) -> c_int {
            // SAFETY: the importer's.
            call!(c, $set, |_| none_of(unsafe { array(vr, count, "valueReferences") }?, $what))
        }
    )*};
}

none! {
    fmi3GetFloat32 fmi3SetFloat32 "Float32" f32;
    fmi3GetInt8 fmi3SetInt8 "Int8" i8;
    fmi3GetUInt8 fmi3SetUInt8 "UInt8" u8;
    fmi3GetInt16 fmi3SetInt16 "Int16" i16;
    fmi3GetUInt16 fmi3SetUInt16 "UInt16" u16;
    fmi3GetInt32 fmi3SetInt32 "Int32" i32;
    fmi3GetUInt32 fmi3SetUInt32 "UInt32" u32;
    fmi3GetUInt64 fmi3SetUInt64 "UInt64" u64;
    fmi3GetBoolean fmi3SetBoolean "Boolean" u8;
    fmi3GetString fmi3SetString "String" Text;
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3GetBinary(
    c: Instance,
    vr: *const u32,
    count: usize,
    _sizes: *mut usize,
    _value: *mut *const u8,
    _values: usize,
) -> c_int {
    // SAFETY: the importer's.
    call!(c, fmi3GetBinary, |_| none_of(unsafe { array(vr, count, "valueReferences") }?, "Binary"))
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3SetBinary(
    c: Instance,
    vr: *const u32,
    count: usize,
    _sizes: *const usize,
    _value: *const *const u8,
    _values: usize,
) -> c_int {
    // SAFETY: the importer's.
    call!(c, fmi3SetBinary, |_| none_of(unsafe { array(vr, count, "valueReferences") }?, "Binary"))
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3GetDirectionalDerivative(
    c: Instance,
    unknown: *const u32,
    unknowns: usize,
    known: *const u32,
    knowns: usize,
    seed: *const f64,
    seeds: usize,
    result: *mut f64,
    results: usize,
) -> c_int {
    call!(c, fmi3GetDirectionalDerivative, |body| {
        scalars(knowns, seeds)?;
        scalars(unknowns, results)?;
        // SAFETY: the importer's.
        let (unknown, known) = unsafe { (array(unknown, unknowns, "unknowns")?, array(known, knowns, "knowns")?) };
        // SAFETY: the importer's.
        let (seed, result) = unsafe { (array(seed, seeds, "seed")?, array_mut(result, results, "sensitivity")?) };
        directional(body, unknown, known, seed, result)
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3GetOutputDerivatives(
    c: Instance,
    vr: *const u32,
    count: usize,
    order: *const i32,
    value: *mut f64,
    values: usize,
) -> c_int {
    call!(c, fmi3GetOutputDerivatives, |body| {
        scalars(count, values)?;
        // SAFETY: the importer's.
        let (vr, order) = unsafe { (array(vr, count, "valueReferences")?, array(order, count, "orders")?) };
        // SAFETY: the importer's.
        let value = unsafe { array_mut(value, values, "values") }?;
        output_derivatives(body, vr, order, value)
    })
}
