//! What FMI 3.0 alone has: the output arguments of a step, early return, event mode, configuration mode, arrays (FMI 3.0, sections
//! 2.2.6.2, 2.3.5, 2.3.6 and 4.2.1).

use std::sync::Arc;

use super::super::description::{Causality, Kind, Value};
use super::super::host::{HostError, Instance, InstanceOptions, Status};
use super::probe::{Probe, Tested, not_applicable, not_tested};

/// Steps of a run in which the output arguments of each are tested.
const STEPS: usize = 50;

fn with(p: &Probe, event_mode: bool, early_return: bool) -> Result<Instance, HostError> {
    let options = InstanceOptions { event_mode, early_return, ..p.options() };
    let mut instance = Instance::new(Arc::clone(&p.binary), None, &options)?;
    p.enter(&mut instance)?;
    instance.exit_initialization()?;
    Ok(instance)
}

fn steps(p: &Probe) -> usize {
    p.long().min(STEPS)
}

/// The output arguments of each step, where no early return is allowed.
pub(in super::super) fn report(p: &Probe) -> Tested {
    let mut instance = p.ready()?;
    let (mut lagging, mut in_time) = (None, false);
    for k in 0..steps(p) {
        p.drive(&mut instance, p.time(k))?;
        if !instance.do_step_status(p.time(k), p.step, true)?.is_ok() {
            break;
        }
        let (result, end) = (instance.step_result(), p.time(k + 1));
        if result.early {
            return Ok(vec![format!(
                "fmi3DoStep from t = {} returned early, though earlyReturnAllowed was false",
                p.time(k)
            )]);
        }
        if result.time.is_nan() {
            return Ok(vec!["fmi3DoStep does not write its output arguments, or lastSuccessfulTime is NaN".into()]);
        }
        let slack = 1e-6 * p.step + 1e-9 * end.abs();
        let problem = format!("lastSuccessfulTime is {} after a whole step to t = {end}", result.time);
        if result.time > end + slack {
            return Ok(vec![problem]);
        }
        // An FMU with a fixed step of its own may be before the communication point now and then.
        in_time |= result.time >= end - slack;
        lagging = lagging.or(Some(problem));
    }
    Ok(lagging.filter(|_| !in_time).into_iter().collect())
}

/// Runs with early return allowed: each early return is reported, advances the time, and can be continued.
pub(in super::super) fn early_return(p: &Probe) -> Tested {
    if !p.interface().might_return_early {
        return not_applicable("mightReturnEarlyFromDoStep is false");
    }
    let event_mode = p.interface().has_event_mode;
    let mut instance = with(p, event_mode, true)?;
    for k in 0..steps(p) {
        p.drive(&mut instance, p.time(k))?;
        let (mut from, end) = (p.time(k), p.time(k + 1));
        // As many parts as events fit into a step.
        for part in 0.. {
            let step = end - from;
            if step <= 1e-9 * p.step {
                break;
            }
            if !instance.do_step_status(from, step, true)?.is_ok() {
                return Ok(vec![]);
            }
            let result = instance.step_result();
            let end_time = if result.early { result.time } else { end };
            if !(end_time >= from - 1e-9 * p.step && end_time <= end + 1e-6 * p.step) {
                return Ok(vec![format!(
                    "fmi3DoStep from t = {from} by {step} returned early with lastSuccessfulTime = {}",
                    result.time
                )]);
            }
            if part > 1000 {
                return Ok(vec![format!("steps from t = {from} return early without getting on")]);
            }
            if result.event && event_mode {
                instance.handle_events(|_| Ok(()))?;
            }
            from = end_time;
        }
    }
    Ok(vec![])
}

/// Runs with event mode used, entering it where the FMU asks for it, and at one point where only the importer does.
pub(in super::super) fn event_mode(p: &Probe) -> Tested {
    if !p.interface().has_event_mode {
        return not_applicable("hasEventMode is false");
    }
    let mut instance = with(p, true, false)?;
    for k in 0..steps(p) {
        let time = p.time(k);
        if k == 1 {
            // An input event: inputs are set in event mode.
            instance.handle_events(|instance| p.drive(instance, time))?;
        }
        if !instance.do_step_status(time, p.step, true)?.is_ok() {
            break;
        }
        if instance.step_result().event {
            instance.handle_events(|_| Ok(()))?;
            if instance.step_result().terminate {
                break;
            }
        }
        let message = p.observe(&mut instance);
        if let Err(error) = message {
            return Ok(vec![format!("after t = {} with event mode used, {error}", p.time(k + 1))]);
        }
    }
    instance.terminate()?;
    Ok(vec![])
}

/// Structural parameters set to their own values in configuration mode leave a run as it was.
pub(in super::super) fn configuration_mode(p: &Probe) -> Tested {
    let structural: Vec<_> = p.d.variables.iter().filter(|v| v.causality == Causality::StructuralParameter).collect();
    if structural.is_empty() {
        return not_applicable("there is no structural parameter");
    }
    p.comparable()?;
    let n = p.steps();
    let mut reference = p.ready()?;
    let expected = p.run(&mut reference, 0, n)?;
    reference.free();
    let mut instance = p.instantiate()?;
    instance.configure(|instance| {
        for v in &structural {
            if let Some(Value::Integer(size)) = v.start {
                instance.set_integer(&[v.value_reference], &[size])?;
            }
        }
        Ok(())
    })?;
    // Arrays may have been made anew: their values are set as the XML has them.
    for v in p.d.variables.iter().filter(|v| super::probe::settable(v) && v.cell.is_some_and(|c| c.of > 1)) {
        if let Some(Value::Real(start)) = v.start {
            instance.set_real(&[v.value_reference], &[start])?;
        }
    }
    p.enter(&mut instance)?;
    instance.exit_initialization()?;
    let found = p.run(&mut instance, 0, n)?;
    let what = p.difference_beyond_tolerance(&expected, &found, 0);
    Ok(what
        .map(|what| format!("structural parameters set to their own values change the run: {what}"))
        .into_iter()
        .collect())
}

/// Reading an array into less room than it needs.
pub(in super::super) fn array_count(p: &Probe) -> Tested {
    let arrays =
        p.d.variables.iter().filter_map(|v| v.cell).filter(|c| c.kind == Kind::Float64 && c.of > 1 && c.at == 0);
    let mut any = false;
    for cell in arrays.take(10) {
        let mut instance = p.ready()?;
        match instance.short_read(cell.reference, cell.of)? {
            Some(true) => any = true,
            Some(false) => {
                return Ok(vec![format!(
                    "fmi3GetFloat64 of an array of {} elements (value reference {}) with nValues = {} returned fmi3OK",
                    cell.of,
                    cell.reference,
                    cell.of - 1
                )]);
            }
            None => {}
        }
    }
    if any { Ok(vec![]) } else { not_applicable("there is no array of Float64") }
}

/// A step's status, which is never pending.
pub(super) fn status(p: &Probe) -> Tested {
    let mut instance = p.ready()?;
    for k in 0..3 {
        match instance.do_step_status(p.time(k), p.step, true)? {
            status @ (Status::Other(_) | Status::Pending) => {
                return Ok(vec![format!("fmi3DoStep returned {}", status.to_string().replace("fmi2", "fmi3"))]);
            }
            Status::Discard if !instance.step_result().terminate => {
                return not_tested("the first steps are discarded");
            }
            _ => {}
        }
    }
    Ok(vec![])
}
