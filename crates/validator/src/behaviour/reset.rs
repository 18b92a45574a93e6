//! An instance that is reset is as a new one (FMI 2.0.4, section 2.1.6).

use super::super::description::{BaseType, Causality, Value, Variability, Variable};
use super::super::host::{HostError, Instance};
use super::probe::{Probe, Snapshot, Tested};
use super::{settable_real, settings, values};

/// `fmi2Reset` is allowed before and during initialisation too (table of section 4.2.4).
fn reset_early(p: &Probe) -> Result<Option<String>, HostError> {
    for (when, entered) in [("an instance just made", false), ("an instance in initialisation mode", true)] {
        let mut instance = p.instantiate()?;
        if entered {
            p.enter(&mut instance)?;
        }
        let begun =
            instance.reset().and_then(|()| p.enter(&mut instance)).and_then(|()| instance.exit_initialization());
        if let Err(error) = begun.and_then(|()| p.run(&mut instance, 0, 1)) {
            return Ok(Some(format!("no run after fmi2Reset of {when}: {error}")));
        }
    }
    Ok(None)
}

/// What parameters and inputs read after a reset where nothing is set, against a new instance; the first difference.
fn reset_settings(p: &Probe) -> Result<Option<String>, HostError> {
    let kept = |v: &&Variable| matches!(v.causality, Causality::Parameter | Causality::Input);
    let variables: Vec<&Variable> = p.d.variables.iter().filter(kept).take(2000).collect();
    let read = |instance: &mut Instance| -> Result<Vec<Value>, HostError> {
        instance.initialize(p.start, None)?;
        variables.iter().map(|v| values::get(instance, v)).collect()
    };
    let fresh = read(&mut p.instantiate()?)?;
    let Some(mut instance) = diverted(p)? else { return Ok(None) };
    instance.reset()?;
    let again = read(&mut instance)?;
    let nan = |a: &Value, b: &Value| matches!((a, b), (Value::Real(x), Value::Real(y)) if x.is_nan() && y.is_nan());
    let changed =
        variables.iter().zip(fresh.iter().zip(&again)).find(|(_, (new, again))| new != again && !nan(new, again));
    Ok(changed
        .map(|(v, (new, again))| format!("\"{}\" is {} instead of {} right after initialisation", v.name, again, new)))
}

pub(in super::super) fn reset(p: &Probe) -> Tested {
    if let Some(problem) = reset_early(p)? {
        return Ok(vec![problem]);
    }
    p.comparable()?;
    let (expected, mut instance) = before_reset(p)?;
    let again = after_reset(p, &mut instance)?;
    instance.terminate()?;
    let ended = instance.reset().and_then(|()| p.enter(&mut instance)).and_then(|()| instance.exit_initialization());
    if let Err(error) = ended.and_then(|()| p.run(&mut instance, 0, 1)) {
        return Ok(vec![format!("no new run after fmi2Terminate and fmi2Reset: {error}")]);
    }
    let what =
        p.difference_beyond_tolerance(&expected, &again, 0).map(|what| match p.difference(&expected[0], &again[0]) {
            Some(what) => format!("{what} right after initialisation"),
            None => what,
        });
    let what = match what {
        Some(what) => Some(what),
        None => reset_settings(p)?,
    };
    Ok(what.map(|what| format!("a run after fmi2Reset is not that of a new instance: {what}")).into_iter().collect())
}

/// What is observed of a new instance, after initialisation and after each step; and an instance that has run otherwise.
pub(super) fn before_reset(p: &Probe) -> Result<(Vec<Snapshot>, Instance), HostError> {
    let n = p.steps();
    let mut fresh = p.ready()?;
    let mut expected = vec![p.observe(&mut fresh)?];
    expected.extend(p.run(&mut fresh, 0, n)?);
    fresh.free();
    // With other values if the FMU takes them, so that these must be restored too.
    let mut instance = match diverted(p)? {
        Some(instance) => instance,
        None => {
            let mut instance = p.ready()?;
            p.run(&mut instance, 0, n / 2)?;
            instance
        }
    };
    slopes(p, &mut instance);
    Ok((expected, instance))
}

/// What is observed of an instance that is reset first, as of a new one.
pub(super) fn after_reset(p: &Probe, instance: &mut Instance) -> Result<Vec<Snapshot>, HostError> {
    instance.reset()?;
    p.enter(instance)?;
    instance.exit_initialization()?;
    let mut again = vec![p.observe(instance)?];
    again.extend(p.run(instance, 0, p.steps())?);
    Ok(again)
}

/// An instance that has run with other parameters and start values than its own: all that can be set, else Reals alone, else
/// those that are not zero (which often switches something off that does not go with the rest); none where the FMU takes neither.
pub(super) fn diverted(p: &Probe) -> Result<Option<Instance>, HostError> {
    let _guard = super::super::host::chosen_values();
    for (zeros, others) in [(true, true), (true, false), (false, false)] {
        let mut instance = p.instantiate()?;
        if detour(p, &mut instance, zeros, others).is_ok() {
            return Ok(Some(instance));
        }
    }
    Ok(None)
}

fn detour(p: &Probe, instance: &mut Instance, zeros: bool, others: bool) -> Result<(), HostError> {
    for v in &p.d.variables {
        if !matches!(v.causality, Causality::Parameter | Causality::Local | Causality::Output) {
            continue;
        }
        if !zeros && v.start == Some(Value::Real(0.0)) {
            continue;
        }
        if let Some(value) = settable_real(p, v).filter(|_| super::probe::settable(v)) {
            instance.set_real(&[v.value_reference], &[value])?;
        } else if let Some(Value::Boolean(value)) = v.start
            && v.causality == Causality::Parameter
            && v.variability == Variability::Tunable
        {
            instance.set_boolean(&[v.value_reference], &[!value])?;
        } else if others
            && v.causality == Causality::Parameter
            && super::probe::settable(v)
            && let Some(value) = settings::another(p, v)
        {
            values::set(instance, v, &value)?;
        }
    }
    p.enter(instance)?;
    instance.exit_initialization()?;
    p.run(instance, 0, p.steps() / 2).map(|_| ())
}

/// Gives the inputs slopes for a step that is never taken.
fn slopes(p: &Probe, instance: &mut Instance) {
    if !p.interface().can_interpolate_inputs {
        return;
    }
    let continuous = |v: &&Variable| v.base() == BaseType::Real && v.variability == Variability::Continuous;
    for v in p.inputs().filter(continuous) {
        let _ = instance.set_input_derivatives(&[v.value_reference], &[1], &[1.0 / p.step]);
    }
}
