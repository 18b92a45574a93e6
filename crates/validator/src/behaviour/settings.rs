//! Setting values of every type, together and in any order, from memory that ends with the call (FMI 2.0.4, section 2.1.7).

use super::super::description::{BaseType, Causality, Value, Variable};
use super::super::host::{HostError, Instance, InstanceOptions};
use super::probe::{Probe, Tested, not_applicable, not_tested, settable};
use super::settable_real;
use super::values::{get, set};
use std::sync::Arc;

/// Most variables of a type that are set.
const MOST: usize = 200;

/// Another value of a parameter or an input that is no Real: within its limits, an item of its enumeration, a short text.
pub(super) fn another(p: &Probe, v: &Variable) -> Option<Value> {
    let r = p.d.resolved(v);
    match v.start.as_ref()? {
        Value::Integer(start) => {
            let fits = |x: &i64| {
                let within = r.min.is_none_or(|min| *x as f64 >= min) && r.max.is_none_or(|max| *x as f64 <= max);
                within && (v.base() != BaseType::Enumeration || r.items.iter().any(|item| item.1 == *x))
            };
            [start + 1, start - 1].into_iter().find(fits).map(Value::Integer)
        }
        Value::Boolean(flag) => Some(Value::Boolean(!flag)),
        Value::String(text) => Some(Value::String(format!("{text} 2 \u{e4}"))),
        Value::Real(_) => None,
    }
}

fn parameters(p: &Probe) -> impl Iterator<Item = &Variable> {
    p.d.variables.iter().filter(|v| v.causality == Causality::Parameter && settable(v))
}

/// Parameters that are no Reals, set to another value before initialisation, each in a run of its own where the run with
/// all of them fails: what those read that initialise.
pub(in super::super) fn others(p: &Probe) -> Tested {
    let chosen: Vec<(&Variable, Value)> = parameters(p).filter_map(|v| Some((v, another(p, v)?))).take(MOST).collect();
    if chosen.is_empty() {
        return not_applicable("there is no Integer, Boolean or String parameter");
    }
    let chosen_values = super::super::host::chosen_values();
    let read = |some: &[(&Variable, Value)]| -> Result<Vec<Value>, HostError> {
        let mut instance = p.instantiate()?;
        for (v, value) in some {
            set(&mut instance, v, value)?;
        }
        instance.initialize(p.start, None)?;
        some.iter().map(|(v, _)| get(&mut instance, v)).collect()
    };
    let mut found = Vec::new();
    match read(&chosen) {
        Ok(values) => found.extend(chosen.iter().zip(values)),
        Err(HostError::OnlyOnce) => return Err(HostError::OnlyOnce.into()),
        Err(_) => {
            for one in chosen.iter().take(20) {
                if let Ok(mut value) = read(std::slice::from_ref(one)) {
                    found.push((one, value.swap_remove(0)));
                }
            }
        }
    }
    if found.is_empty() {
        return not_tested("the FMU does not initialise with other Integer, Boolean and String parameters");
    }
    drop(chosen_values);
    let (mut problems, mut texts) = (Vec::new(), 0);
    for ((v, value), read) in found {
        if *value != read {
            let (name, value, read) = (&v.name, value.to_string(), read.to_string());
            problems.push(format!("the parameter \"{name}\" was set to {value} and reads {read}"));
        } else if let Value::String(text) = value
            && texts < 20
        {
            texts += 1;
            problems.extend(cut(p, v, text));
        }
    }
    Ok(problems)
}

/// Tests a text longer than usual buffers, after the FMU has taken another short one: it may refuse the long one, but not
/// truncate it, or write past its memory and crash its host.
fn cut(p: &Probe, v: &Variable, short: &str) -> Option<String> {
    /// Length in bytes: above the common buffers of 32 to 256 bytes, and above the limit of file names.
    const LONG: usize = 300;
    let mut text = short.to_owned();
    for n in 3.. {
        if text.len() >= LONG {
            break;
        }
        text.push_str(&format!(" {n}"));
    }
    let read = || -> Result<Value, HostError> {
        let mut instance = p.instantiate()?;
        instance.set_string(&[v.value_reference], &[&text])?;
        instance.initialize(p.start, None)?;
        let read = get(&mut instance, v)?;
        // Corrupted memory is often detected when it is freed, or at the next allocation.
        instance.free();
        p.instantiate()?;
        Ok(read)
    };
    let Ok(Value::String(read)) = read() else { return None };
    let (name, length) = (&v.name, text.len());
    (read != text).then(|| match text.strip_prefix(&read) {
        Some(_) => {
            format!("the parameter \"{name}\" was set to a text of {length} bytes and reads its first {}", read.len())
        }
        None => format!("the parameter \"{name}\" was set to a text of {length} bytes and reads another, {read:?}"),
    })
}

/// Real parameters and inputs with another value each.
fn reals(p: &Probe) -> Vec<(&Variable, f64)> {
    let kept = |v: &&Variable| matches!(v.causality, Causality::Parameter | Causality::Input) && settable(v);
    p.d.variables.iter().filter(kept).filter_map(|v| Some((v, settable_real(p, v)?))).take(MOST).collect()
}

/// Values set in one call, and one by one in two orders, are the same values: what an initialised instance reads.
pub(in super::super) fn joint(p: &Probe) -> Tested {
    let chosen = reals(p);
    if chosen.len() < 2 {
        return not_applicable("there are no two Real parameters or inputs with another value to set");
    }
    let references: Vec<u32> = chosen.iter().map(|(v, _)| v.value_reference).collect();
    let values: Vec<f64> = chosen.iter().map(|c| c.1).collect();
    let _guard = super::super::host::chosen_values();
    let read = |set_order: SetOrder| -> Result<Vec<f64>, HostError> {
        let mut instance = p.instantiate()?;
        let mut order: Vec<usize> = (0..references.len()).collect();
        match set_order {
            SetOrder::AtOnce => instance.set_real(&references, &values)?,
            SetOrder::Backwards => order.reverse(),
            SetOrder::OneByOne => {}
        }
        for at in order.into_iter().filter(|_| set_order != SetOrder::AtOnce) {
            instance.set_real(&[references[at]], &[values[at]])?;
        }
        instance.initialize(p.start, None)?;
        instance.get_real(&references)
    };
    let reference = match read(SetOrder::OneByOne) {
        Ok(reference) => reference,
        Err(HostError::OnlyOnce) => return Err(HostError::OnlyOnce.into()),
        Err(error) => return not_tested(format!("the FMU does not run with other parameters: {error}")),
    };
    for (set_order, how) in [(SetOrder::AtOnce, "in one call"), (SetOrder::Backwards, "in the opposite order")] {
        let found = match read(set_order) {
            Ok(found) => found,
            Err(error) => return Ok(vec![format!("values that can be set one by one cannot be set {how}: {error}")]),
        };
        let differs = (0..reference.len()).find(|&at| reference[at] != found[at] && !found[at].is_nan());
        if let Some(at) = differs {
            let (name, one) = (&chosen[at].0.name, reference[at]);
            let message = format!("\"{name}\" reads {one} where {} variables are set one by one", reference.len());
            return Ok(vec![format!("{message}, and {} where the same values are set {how}", found[at])]);
        }
    }
    Ok(vec![])
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum SetOrder {
    OneByOne,
    AtOnce,
    Backwards,
}

/// Of two values set at one instant the second counts.
pub(in super::super) fn twice(p: &Probe) -> Tested {
    let inputs: Vec<(&Variable, f64)> = reals(p)
        .into_iter()
        .filter(|(v, _)| v.causality == Causality::Input && v.can_handle_multiple_set != Some(false))
        .take(20)
        .collect();
    if inputs.is_empty() {
        return not_applicable("there is no Real input to be set twice");
    }
    let mut instance = p.ready()?;
    p.run(&mut instance, 0, 2)?;
    let _guard = super::super::host::chosen_values();
    let mut written = Vec::new();
    for (v, other) in inputs {
        let Some(Value::Real(start)) = v.start else { continue };
        let r = [v.value_reference];
        if instance.set_real(&r, &[start]).is_ok() && instance.set_real(&r, &[other]).is_ok() {
            written.push((v, start, other));
        }
    }
    // Some take what is set over with the next step.
    let _ = instance.do_step_status(p.time(2), p.step, true)?;
    let mut problems = Vec::new();
    for (v, start, other) in written {
        let read = instance.get_real(&[v.value_reference])?[0];
        if read == start {
            problems.push(format!("the input \"{}\" was set to {start} and then to {other}, and reads {read}", v.name));
        }
    }
    Ok(problems)
}

/// A text that is overwritten when the call has come back reads as it was set.
pub(in super::super) fn copied(p: &Probe) -> Tested {
    let texts: Vec<&Variable> =
        p.d.variables.iter().filter(|v| v.base() == BaseType::String && settable(v)).take(20).collect();
    if texts.is_empty() {
        return not_applicable("there is no String to be set");
    }
    let mut instance = p.instantiate()?;
    let mut written = Vec::new();
    for v in texts {
        if let Some(Value::String(text)) = v.start.as_ref().filter(|t| **t != Value::String(String::new()))
            && instance.set_string_overwritten(v.value_reference, text).is_ok()
        {
            written.push((v, text));
        }
    }
    instance.initialize(p.start, None)?;
    let mut problems = Vec::new();
    for (v, text) in written {
        let read = instance.get_string(&[v.value_reference])?.swap_remove(0);
        if read != *text && read.bytes().all(|byte| byte == b'#') {
            problems.push(format!(
                "\"{}\" was set to {text:?} and reads {read:?}, which its host's memory held later",
                v.name
            ));
        }
    }
    Ok(problems)
}

/// References of at most so many variables of each type.
fn by_type(p: &Probe, most: usize) -> [Vec<u32>; 4] {
    let mut all: [Vec<u32>; 4] = Default::default();
    for v in &p.d.variables {
        let list = &mut all[super::probe::type_index(v.base())];
        if list.len() < most {
            list.push(v.value_reference);
        }
    }
    all
}

/// Getters and setters keep within the arrays that they are given.
pub(in super::super) fn bounds(p: &Probe) -> Tested {
    let all = by_type(p, 100);
    let mut instance = p.instantiate()?;
    instance.initialize(p.start, None)?;
    let problems = instance.get_all_within([&all[0], &all[1], &all[2], &all[3]]);
    if !problems.is_empty() {
        return Ok(problems);
    }
    let (mut reals, mut integers, mut flags) = ((vec![], vec![]), (vec![], vec![]), (vec![], vec![]));
    for v in p.inputs().take(100) {
        let r = v.value_reference;
        match v.start {
            Some(Value::Real(x)) => {
                reals.0.push(r);
                reals.1.push(x);
            }
            Some(Value::Integer(x)) => {
                if let Ok(x) = i32::try_from(x) {
                    integers.0.push(r);
                    integers.1.push(x);
                }
            }
            Some(Value::Boolean(x)) => {
                flags.0.push(r);
                flags.1.push(i32::from(x));
            }
            _ => {}
        }
    }
    instance.set_all_within((&reals.0, &reals.1), (&integers.0, &integers.1), (&flags.0, &flags.1));
    Ok(vec![])
}

/// Outputs are there in initialisation mode.
pub(in super::super) fn initial_readable(p: &Probe) -> Tested {
    let mut instance = p.instantiate()?;
    instance.setup_experiment(None, p.start, p.stop)?;
    instance.enter_initialization()?;
    let outputs = p.d.variables.iter().filter(|v| v.causality == Causality::Output).take(MOST);
    let mut problems = Vec::new();
    let mut any = false;
    for v in outputs {
        any = true;
        if let Err(error) = get(&mut instance, v) {
            problems.push(format!("the output \"{}\" cannot be read in initialisation mode: {error}", v.name));
            break;
        }
    }
    if any { Ok(problems) } else { not_applicable("there is no output") }
}

/// A long name with blanks, percent signs and letters beyond ASCII.
pub(in super::super) fn name(p: &Probe) -> Tested {
    let name = format!("axis 1 (left), 100 %s%n%d, M\u{fc}ller/{}", "x".repeat(500));
    let options = InstanceOptions { name, logging: true, ..p.options() };
    let attempt = || -> Result<(), HostError> {
        let mut instance = Instance::new(Arc::clone(&p.binary), None, &options)?;
        p.enter(&mut instance)?;
        instance.exit_initialization()?;
        p.run(&mut instance, 0, 2)?;
        instance.terminate()?;
        instance.free();
        // Spoilt memory is often found out by what is taken from it next.
        p.ready()?;
        Ok(())
    };
    // A refusal harms nobody.
    let _ = attempt();
    Ok(vec![])
}
