//! Values that are read: the same each time, finite, within their range, and unchanging where they are declared so (FMI 2.0.4,
//! section 2.1.7).

use super::super::description::{BaseType, Causality, Value, Variability, Variable};
use super::super::host::{HostError, Instance};
use super::probe::{Probe, Tested, not_applicable};
use super::values::get;

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
                v.variability, v.name, before, after
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
