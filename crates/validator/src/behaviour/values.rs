//! Getting and setting values (FMI 2.0.4, section 2.1.7).

use super::super::description::{BaseType, Causality, Initial, Value, Variability, Variable};
use super::super::host::{HostError, Instance};
use super::probe::{Probe, Snapshot, Tested, not_applicable, not_tested, settable, type_index};
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

pub(super) fn show(value: &Value) -> String {
    match value {
        Value::Real(x) => x.to_string(),
        Value::Integer(x) => x.to_string(),
        Value::Boolean(x) => x.to_string(),
        Value::String(x) => format!("{x:?}"),
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
                    v.name,
                    show(&value),
                    show(start)
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
    let venture = super::super::host::venture();
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
    drop(venture);
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
                problems.push(format!(
                    "the input \"{}\" was set to {} and reads {}",
                    v.name,
                    show(value),
                    show(&found)
                ));
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

/// A tunable parameter that acts when it is set before the run acts when it is set during it.
pub(in super::super) fn tunable_effect(p: &Probe) -> Tested {
    let tunable = |v: &&Variable| v.causality == Causality::Parameter && v.variability == Variability::Tunable;
    p.comparable()?;
    let (n, cut) = (p.steps(), p.steps() / 3);
    p.affordable(12 * n)?;
    // Up to the end of the run, which some FMUs set themselves.
    let until_end = |instance: &mut Instance, from: usize| -> Vec<Snapshot> {
        let mut record = Vec::new();
        for k in from..3 * n {
            match p.run(instance, k, k + 1) {
                Ok(mut one) => record.append(&mut one),
                Err(_) => break,
            }
        }
        record
    };
    let mut reference = p.ready()?;
    let expected = until_end(&mut reference, 0);
    reference.free();
    if expected.len() < n {
        return not_tested("the run is too short");
    }
    let (mut problems, mut any) = (Vec::new(), false);
    for v in p.d.variables.iter().filter(tunable).take(20) {
        let Some(value) = other(p, v) else { continue };
        if Some(&value) == v.start.as_ref() {
            continue;
        }
        let _venture = super::super::host::venture();
        let early = || -> Result<_, HostError> {
            let mut instance = p.instantiate()?;
            set(&mut instance, v, &value)?;
            p.enter(&mut instance)?;
            instance.exit_initialization()?;
            p.run(&mut instance, 0, n)
        };
        let late = || -> Result<_, HostError> {
            let mut instance = p.ready()?;
            p.run(&mut instance, 0, cut)?;
            set(&mut instance, v, &value)?;
            Ok(until_end(&mut instance, cut))
        };
        // A value that cannot be set, or fails, is reported by another rule.
        let (early, late) = match (early(), late()) {
            (Err(HostError::OnlyOnce), _) | (_, Err(HostError::OnlyOnce)) => return Err(HostError::OnlyOnce.into()),
            (Ok(early), Ok(late)) => (early, late),
            _ => continue,
        };
        any = true;
        let own = [v.value_reference];
        if p.responds(&expected[..n], &early, &own) && !p.responds(&expected[cut..], &late, &own) {
            problems.push(format!(
                "the tunable parameter \"{}\" set to {} during the run changes nothing; set before it, it does",
                v.name,
                show(&value)
            ));
        }
    }
    if any { Ok(problems) } else { not_applicable("there is no tunable parameter with another value to set") }
}

pub(in super::super) fn get_consistent(p: &Probe) -> Tested {
    p.comparable()?;
    let n = p.steps();
    let mut instance = p.ready()?;
    for k in 0..n {
        let read = p.run(&mut instance, k, k + 1)?.swap_remove(0);
        let again = p.observe(&mut instance)?;
        if let Some(what) = p.difference(&read, &again) {
            return Ok(vec![format!("reading twice gives two values: {what} at t = {}", p.time(k + 1))]);
        }
        // One by one, backwards.
        for (o, &expected) in p.observed[0].iter().zip(&read.reals).rev().take(50) {
            let value = instance.get_real(&[o.reference])?[0];
            if value != expected && !(value.is_nan() && expected.is_nan()) {
                return Ok(vec![format!("\"{}\" reads {value} alone, but {expected} among others", o.name)]);
            }
        }
    }
    let end = p.observe(&mut instance)?;
    instance.free();
    let mut unread = p.ready()?;
    for k in 0..n {
        p.drive(&mut unread, p.time(k))?;
        unread.do_step(p.time(k), p.step)?;
    }
    let what = p.difference(&p.observe(&mut unread)?, &end);
    Ok(what
        .map(|what| format!("reading values changes the run: {what} when values were read at every step"))
        .into_iter()
        .collect())
}

pub(in super::super) fn boolean_values(p: &Probe) -> Tested {
    let mut instance = p.ready()?;
    let booleans: Vec<&Variable> = p.d.variables.iter().filter(|v| v.base() == BaseType::Boolean).collect();
    if booleans.is_empty() {
        return not_applicable("there is no Boolean variable");
    }
    p.run(&mut instance, 0, 3)?;
    let references: Vec<u32> = booleans.iter().map(|v| v.value_reference).collect();
    let describe =
        |v: &Variable, value: i32| format!("\"{}\" is {value}, neither fmi2False (0) nor fmi2True (1)", v.name);
    let wrong = |values: Vec<i32>| -> Vec<String> {
        let odd = booleans.iter().zip(values).filter(|(_, value)| !matches!(value, 0 | 1));
        odd.map(|(v, value)| describe(v, value)).collect()
    };
    let found = wrong(instance.get_boolean_raw(&references)?);
    if !found.is_empty() {
        return Ok(found);
    }
    instance.free();
    let look = |instance: &mut Instance, time: f64| {
        let first = wrong(instance.get_boolean_raw(&references)?).into_iter().next();
        Ok(first.map(|problem| format!("{problem}, at t = {time}")))
    };
    Ok(watch(p, false, look)?.into_iter().collect())
}

pub(in super::super) fn unchanging(p: &Probe) -> Tested {
    let kept: Vec<&Variable> = p
        .d
        .variables
        .iter()
        .filter(|v| {
            matches!(v.variability, Variability::Constant | Variability::Fixed) || v.causality == Causality::Parameter
        })
        .take(5000)
        .collect();
    if kept.is_empty() {
        return not_applicable("there is no constant or fixed variable");
    }
    let mut instance = p.ready()?;
    let mut before = Vec::new();
    for v in &kept {
        before.push(get(&mut instance, v)?);
    }
    p.run(&mut instance, 0, p.steps())?;
    let mut problems = Vec::new();
    for (v, before) in kept.iter().zip(before) {
        let after = get(&mut instance, v)?;
        let nan = matches!((&before, &after), (Value::Real(x), Value::Real(y)) if x.is_nan() && y.is_nan());
        if before != after && !nan {
            problems.push(format!(
                "the {} variable \"{}\" went from {} to {} during the run",
                v.variability,
                v.name,
                show(&before),
                show(&after)
            ));
        }
    }
    Ok(problems)
}

/// Calls `look` on an instance before each step of the default experiment, as far as time allows, until it finds a problem;
/// `driven` with varying inputs, and then for the length of a comparison.
fn watch(
    p: &Probe,
    driven: bool,
    mut look: impl FnMut(&mut Instance, f64) -> Result<Option<String>, HostError>,
) -> Result<Option<String>, HostError> {
    let mut instance = if driven { p.ready()? } else { p.instantiate()? };
    if !driven {
        instance.initialize(p.start, None)?;
    }
    let stop = p.stop.filter(|_| !driven).unwrap_or_else(|| p.time(p.steps()));
    let steps = ((stop - p.start) / p.step * (1.0 - 1e-12)).ceil() as usize;
    let end = std::time::Instant::now() + std::time::Duration::from_millis(150);
    for k in 0..=steps {
        let problem = look(&mut instance, p.time(k))?;
        if problem.is_some() || k == steps || std::time::Instant::now() > end {
            return Ok(problem);
        }
        if driven {
            p.drive(&mut instance, p.time(k))?;
        }
        // A run that ends early has been seen to its end.
        if !instance.do_step_status(p.time(k), p.step, true)?.is_ok() {
            return Ok(None);
        }
    }
    Ok(None)
}

pub(in super::super) fn finite(p: &Probe) -> Tested {
    let outputs: Vec<&Variable> =
        p.d.variables.iter().filter(|v| v.causality == Causality::Output && v.base() == BaseType::Real).collect();
    if outputs.is_empty() {
        return not_applicable("there is no Real output");
    }
    let references: Vec<u32> = outputs.iter().map(|v| v.value_reference).collect();
    let look = |instance: &mut Instance, time: f64| {
        let values = instance.get_real(&references)?;
        let bad = outputs.iter().zip(values).find(|(_, value)| !value.is_finite());
        Ok(bad.map(|(v, value)| format!("the output \"{}\" is {value} at t = {time}", v.name)))
    };
    let found = watch(p, false, look)?;
    // Values chosen here count as legal where the FMU declares which ones it takes.
    let bounded = |v: &Variable| {
        let r = p.d.resolved(v);
        v.base() != BaseType::Real || r.min.is_some() && r.max.is_some()
    };
    let driven = found.is_none() && p.learned.stimulus && p.inputs().all(bounded);
    let found = if driven { watch(p, true, look)? } else { found };
    Ok(found.into_iter().collect())
}

pub(in super::super) fn range(p: &Probe) -> Tested {
    let watched: Vec<(&Variable, f64, f64, Vec<i64>)> =
        p.d.variables
            .iter()
            .filter(|v| matches!(v.causality, Causality::Output | Causality::Local))
            .filter_map(|v| {
                let r = p.d.resolved(v);
                let items: Vec<i64> = r.items.iter().map(|i| i.1).collect();
                let bounded = r.min.is_some() || r.max.is_some() || !items.is_empty();
                bounded.then(|| (v, r.min.unwrap_or(f64::NEG_INFINITY), r.max.unwrap_or(f64::INFINITY), items))
            })
            .take(2000)
            .collect();
    if watched.is_empty() {
        return not_applicable("no calculated variable has a min, a max or items");
    }
    let look = |instance: &mut Instance, time: f64| {
        for (v, low, high, items) in &watched {
            let value = match get(instance, v)? {
                Value::Real(x) => x,
                Value::Integer(i) if !items.is_empty() && !items.contains(&i) => {
                    return Ok(Some(format!("\"{}\" is {i} at t = {time}, no item of its enumeration", v.name)));
                }
                Value::Integer(i) => i as f64,
                _ => continue,
            };
            // A rounding error beyond the limit is not a finding.
            let slack = 1e-9 * value.abs().max(1.0);
            if value < low - slack || value > high + slack {
                return Ok(Some(format!("\"{}\" is {value} at t = {time}, outside {low} to {high}", v.name)));
            }
        }
        Ok(None)
    };
    let found = watch(p, false, look)?;
    // No input makes an enumeration leave its items.
    let items = watched.iter().any(|(.., items)| !items.is_empty());
    let driven = found.is_none() && items && p.learned.stimulus;
    let found = if driven { watch(p, true, look)?.filter(|problem| problem.contains("no item")) } else { found };
    Ok(found.into_iter().collect())
}

fn other(p: &Probe, v: &Variable) -> Option<Value> {
    match &v.start {
        Some(Value::Real(_)) => settable_real(p, v).map(Value::Real),
        Some(Value::Boolean(b)) => Some(Value::Boolean(!b)),
        other => other.clone(),
    }
}

pub(in super::super) fn fixed_set(p: &Probe) -> Tested {
    let fixed = |v: &&Variable| {
        matches!(v.causality, Causality::Parameter | Causality::StructuralParameter)
            && v.variability == Variability::Fixed
            || v.variability == Variability::Constant
    };
    let mut any = false;
    let mut accepted = Vec::new();
    for v in p.d.variables.iter().filter(fixed).take(20) {
        let Some(value) = other(p, v) else { continue };
        any = true;
        // A refusal may leave the instance in its error state: a fresh one each time.
        let mut instance = p.ready()?;
        p.run(&mut instance, 0, 1)?;
        if set(&mut instance, v, &value).is_ok() {
            accepted.push(format!("\"{}\"", v.name));
        }
    }
    if !any {
        return not_applicable("there is no fixed or constant variable with a start value");
    }
    let list = accepted.join(", ");
    Ok(if accepted.is_empty() {
        vec![]
    } else {
        vec![format!("accepted during the run, though fixed or constant: {list}")]
    })
}

pub(in super::super) fn tunable_set(p: &Probe) -> Tested {
    let tunable = |v: &&Variable| v.causality == Causality::Parameter && v.variability == Variability::Tunable;
    let mut any = false;
    let mut problems = Vec::new();
    for v in p.d.variables.iter().filter(tunable).take(50) {
        let Some(value) = &v.start else { continue };
        any = true;
        let mut instance = p.ready()?;
        p.run(&mut instance, 0, 1)?;
        if let Err(error) = set(&mut instance, v, value) {
            problems.push(format!("the tunable parameter \"{}\" cannot be set during the run: {error}", v.name));
        }
    }
    if any { Ok(problems) } else { not_applicable("there is no tunable parameter") }
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
