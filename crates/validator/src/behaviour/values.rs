//! Values that are set, and start values (FMI 2.0.4, section 2.1.7).

use super::super::description::{BaseType, Causality, Initial, Value, Variability, Variable};
use super::super::host::{HostError, Instance};
use super::probe::{Probe, Tested, settable, type_index};
use super::settable_real;

/// Relative tolerance between a start value as printed in the XML and as compiled: tools print six digits and more.
const PRINTED: f64 = 1e-5;

pub(super) fn get(instance: &mut Instance, v: &Variable) -> Result<Value, HostError> {
    let r = [v.value_reference];
    Ok(match v.base() {
        BaseType::Real => Value::Real(instance.get_real(&r)?[0]),
        BaseType::Integer | BaseType::Enumeration => Value::Integer(instance.get_integer(&r)?[0]),
        BaseType::Boolean => Value::Boolean(instance.get_boolean(&r)?[0]),
        BaseType::String => Value::String(instance.get_string(&r)?.swap_remove(0)),
    })
}

pub(super) fn set(instance: &mut Instance, v: &Variable, value: &Value) -> Result<(), HostError> {
    let r = [v.value_reference];
    match value {
        Value::Real(x) => instance.set_real(&r, &[*x]),
        Value::Integer(x) => instance.set_integer(&r, &[*x]),
        Value::Boolean(x) => instance.set_boolean(&r, &[*x]),
        Value::String(x) => instance.set_string(&r, &[x]),
    }
}

/// Whether two values are the same up to the digits that printing cuts.
pub(super) fn same(a: &Value, b: &Value) -> bool {
    match (a, b) {
        (Value::Real(x), Value::Real(y)) => {
            // A subnormal number may be printed as 0.
            x == y || x.is_nan() && y.is_nan() || (x - y).abs() <= (PRINTED * x.abs().max(y.abs())).max(1e-300)
        }
        _ => a == b,
    }
}

pub(in super::super) fn start_values(p: &Probe) -> Tested {
    let mut instance = p.instantiate()?;
    instance.initialize(p.start, p.stop)?;
    let mut problems = Vec::new();
    for v in &p.d.variables {
        let Some(start) = &v.start else { continue };
        // Discrete variables may have changed at an event at the start.
        let kept = matches!(v.causality, Causality::Parameter | Causality::Input | Causality::StructuralParameter)
            || v.variability == Variability::Constant
            || v.initial() == Some(Initial::Exact) && v.variability == Variability::Continuous;
        if kept {
            let value = get(&mut instance, v)?;
            if !same(start, &value) {
                problems.push(format!(
                    "\"{}\" starts at {} in the binary, at {} in modelDescription.xml",
                    v.name, value, start
                ));
            }
        }
    }
    Ok(problems)
}

pub(in super::super) fn start_settable(p: &Probe) -> Tested {
    let mut instance = p.instantiate()?;
    let mut problems = Vec::new();
    for v in p.d.variables.iter().filter(|v| settable(v)) {
        if let Some(start) = &v.start
            && let Err(error) = set(&mut instance, v, start)
        {
            problems
                .push(format!("\"{}\" cannot be set to its own start value before initialisation: {error}", v.name));
        }
    }
    if problems.is_empty() {
        instance.initialize(p.start, p.stop)?;
    }
    Ok(problems)
}

/// A variable that was set and read again: name, kind, value set, value read.
type Kept<'a> = (&'a str, &'static str, f64, f64);

/// Sets Real parameters before initialisation and inputs after it, and reads them. An input that takes effect with the
/// next step only is read after that.
fn kept(p: &Probe) -> Result<Vec<Kept<'_>>, super::Stop> {
    let mut instance = p.instantiate()?;
    let mut written = Vec::new();
    let chosen_values = super::super::host::chosen_values();
    for v in p.d.variables.iter().filter(|v| v.causality == Causality::Parameter) {
        if let Some(value) = settable_real(p, v)
            && instance.set_real(&[v.value_reference], &[value]).is_ok()
        {
            written.push((v, value));
        }
    }
    // Other parameters may contradict each other; then only inputs are tested.
    if instance.initialize(p.start, None).is_err() {
        instance.free();
        instance = p.instantiate()?;
        instance.initialize(p.start, None)?;
        written.clear();
    }
    drop(chosen_values);
    let mut found = Vec::new();
    for (v, value) in written {
        found.push((v.name.as_str(), "parameter", value, instance.get_real(&[v.value_reference])?[0]));
    }
    let mut late = Vec::new();
    for (order, v) in p.inputs().filter(|v| v.base() == BaseType::Real).enumerate() {
        let value = p.input(v, order, p.start);
        if instance.set_real(&[v.value_reference], &[value]).is_ok() {
            let read = instance.get_real(&[v.value_reference])?[0];
            if read == value {
                found.push((v.name.as_str(), "input", value, read));
            } else {
                late.push((v, value));
            }
        }
    }
    if !late.is_empty() {
        let _ = instance.do_step_status(p.start, p.step, true)?;
        for (v, value) in late {
            found.push((v.name.as_str(), "input", value, instance.get_real(&[v.value_reference])?[0]));
        }
    }
    Ok(found)
}

/// Relative difference that a value kept as a 32-bit number has (half a unit in its last place, 2^-24), with room.
const SINGLE: f64 = 1e-6;

fn is_rounded(value: f64, read: f64) -> bool {
    (read - value).abs() <= SINGLE * value.abs()
}

pub(in super::super) fn set_get(p: &Probe) -> Tested {
    let describe =
        |(name, kind, value, read): Kept| format!("the {kind} \"{name}\" was set to {value} and reads {read}");
    let mut problems: Vec<String> =
        kept(p)?.into_iter().filter(|(_, _, value, read)| !is_rounded(*value, *read)).map(describe).collect();
    let mut instance = p.ready()?;
    for v in p.inputs() {
        let Some(value) = &v.start else { continue };
        if v.base() != BaseType::Real && set(&mut instance, v, value).is_ok() {
            let mut found = get(&mut instance, v)?;
            if found != *value {
                let _ = instance.do_step_status(p.start, p.step, true)?;
                found = get(&mut instance, v)?;
            }
            if found != *value {
                problems.push(format!("the input \"{}\" was set to {} and reads {}", v.name, value, found));
            }
        }
    }
    Ok(problems)
}

pub(in super::super) fn set_get_rounded(p: &Probe) -> Tested {
    let rounded = kept(p)?.into_iter().filter(|(_, _, value, read)| value != read && is_rounded(*value, *read));
    let describe =
        |(name, kind, value, read): Kept| format!("the {kind} \"{name}\" was set to {value} and reads {read}");
    Ok(rounded.map(describe).collect())
}

/// Every variable of the description is one of the binary.
pub(in super::super) fn readable(p: &Probe) -> Tested {
    let mut instance = p.ready()?;
    let mut problems = Vec::new();
    for v in &p.d.variables {
        if type_index(v.base()) < 4
            && let Err(error) = get(&mut instance, v)
        {
            problems.push(format!("\"{}\" cannot be read: {error}", v.name));
            if problems.len() >= 20 {
                break;
            }
        }
    }
    Ok(problems)
}
