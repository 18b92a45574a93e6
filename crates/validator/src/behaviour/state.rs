//! Getting, setting and serialising the FMU state (FMI 2.0.4, section 2.1.8).

use super::super::description::{Causality, Variability};
use super::super::host::{HostError, Instance};
use super::no_set_prior;
use super::observed::get_consistent;
use super::probe::{Probe, Snapshot, Tested, not_applicable, not_tested};
use super::settable_real;

fn needs_state(p: &Probe) -> Result<(), super::Stop> {
    if !p.interface().can_get_and_set_state {
        return not_applicable("canGetAndSetFMUstate is false");
    }
    p.comparable()
}

/// Changes what the environment may change during a run, so that a restored state must restore it.
fn disturb(p: &Probe, instance: &mut Instance) {
    for v in &p.d.variables {
        if v.causality == Causality::Parameter
            && v.variability == Variability::Tunable
            && let Some(value) = settable_real(p, v)
        {
            let _ = instance.set_real(&[v.value_reference], &[value]);
        }
    }
}

/// Whether the FMU takes such changes at all.
fn takes_disturbance(p: &Probe) -> bool {
    let _guard = super::super::host::chosen_values();
    let attempt = || -> Result<(), HostError> {
        let mut instance = p.ready()?;
        p.run(&mut instance, 0, 2)?;
        disturb(p, &mut instance);
        p.run(&mut instance, 2, 4).map(|_| ())
    };
    attempt().is_ok()
}

pub(in super::super) fn restore(p: &Probe) -> Tested {
    needs_state(p)?;
    if !get_consistent(p)?.is_empty() {
        return not_tested("reading changes values");
    }
    // Some things show late: an event time, a delay, a counter.
    let (n, cut) = (p.long(), p.steps() / 3);
    let disturbed = takes_disturbance(p);
    let reference = without_states(p)?;
    let mut instance = p.ready()?;
    // Without this the FMU need not keep what lies before the communication point (section 4.2.2).
    instance.may_go_back = true;
    p.run(&mut instance, 0, cut)?;
    let early = instance.get_state()?;
    let then = p.observe(&mut instance)?;
    let mut expected = Vec::new();
    for k in cut..n {
        match p.run(&mut instance, k, k + 1) {
            Ok(mut one) => expected.append(&mut one),
            // The FMU ends its run here.
            Err(_) if k >= p.steps() => break,
            Err(error) => return Err(error.into()),
        }
    }
    let n = cut + expected.len();
    if let Some(reference) = &reference {
        let both = reference.len().min(n);
        if let Some(what) = p.difference_beyond_tolerance(&reference[cut..both], &expected[..both - cut], cut) {
            return Ok(vec![format!("fmi2GetFMUstate changes the run: {what}")]);
        }
    }
    let late = instance.get_state()?;
    let last = p.observe(&mut instance)?;
    if disturbed {
        disturb(p, &mut instance);
    }
    p.drive(&mut instance, p.time(n + 5))?;
    // At its end an FMU may refuse to go on, which is not tested here.
    let _ = instance.do_step_status(p.time(n), p.step, false)?;
    instance.set_state(&early)?;
    let at_once = [p.observe(&mut instance)?];
    if let Some(what) = p.difference_beyond_tolerance(&[then], &at_once, cut) {
        return Ok(vec![format!("fmi2SetFMUstate does not restore: {what}, right after it")]);
    }
    let found = p.run(&mut instance, cut, n)?;
    if let Some(what) = p.difference_beyond_tolerance(&expected, &found, cut) {
        return Ok(vec![format!("a run from a restored state is not the one before: {what}")]);
    }
    instance.set_state(&early)?;
    let again = p.run(&mut instance, cut, cut + expected.len().min(3));
    let what = match &again {
        Ok(again) => p.difference_beyond_tolerance(&expected[..again.len()], again, cut),
        Err(error) => Some(error.to_string()),
    };
    if let Some(what) = what {
        return Ok(vec![format!("a state that was restored once is not restored a second time: {what}")]);
    }
    instance.set_state(&late)?;
    let mut problems = Vec::new();
    if let Some(what) = p.difference_beyond_tolerance(&[last], &[p.observe(&mut instance)?], n) {
        problems.push(format!("of two states kept, the second is not restored: {what}"));
    }
    instance.free_state(early)?;
    instance.free_state(late)?;
    if problems.is_empty() {
        problems.extend(no_set_prior::check(p)?);
    }
    Ok(problems)
}

/// A run in which no state is ever got; none where there can be but one instance.
fn without_states(p: &Probe) -> Result<Option<Vec<Snapshot>>, HostError> {
    if p.interface().only_once {
        return Ok(None);
    }
    let mut instance = p.ready()?;
    instance.may_go_back = true;
    p.run(&mut instance, 0, p.steps()).map(Some)
}

pub(in super::super) fn handles(p: &Probe) -> Tested {
    needs_state(p)?;
    let mut instance = p.ready()?;
    p.run(&mut instance, 0, 1)?;
    let problems = instance.state_handles()?;
    p.run(&mut instance, 1, 2)?;
    Ok(problems)
}

pub(in super::super) fn serialise(p: &Probe) -> Tested {
    needs_state(p)?;
    if !p.interface().can_serialize_state {
        return not_applicable("canSerializeFMUstate is false");
    }
    let (n, cut) = (p.steps(), p.steps() / 3);
    let mut instance = p.ready()?;
    instance.may_go_back = true;
    p.run(&mut instance, 0, cut)?;
    let state = instance.get_state()?;
    let bytes = instance.serialize_state(&state)?;
    // The run from the unserialised state is the reference; whether that is right is tested by another rule.
    instance.set_state(&state)?;
    let expected = p.run(&mut instance, cut, n)?;
    instance.set_state(&state)?;
    if p.difference_beyond_tolerance(&expected, &p.run(&mut instance, cut, n)?, cut).is_some() {
        return not_tested("fmi2SetFMUstate does not restore");
    }
    let copy = instance.deserialize_state(&bytes)?;
    instance.set_state(&copy)?;
    let found = p.run(&mut instance, cut, n)?;
    if let Some(what) = p.difference_beyond_tolerance(&expected, &found, cut) {
        return Ok(vec![format!("a state serialised and read back is another one: {what}")]);
    }
    if p.interface().only_once {
        return Ok(vec![]);
    }
    let mut other = p.ready()?;
    other.may_go_back = true;
    let copy = other.deserialize_state(&bytes)?;
    other.set_state(&copy)?;
    let found = p.run(&mut other, cut, n)?;
    if let Some(what) = p.difference_beyond_tolerance(&expected, &found, cut) {
        return Ok(vec![format!("a serialised state read into a new instance is another one: {what}")]);
    }
    let what = serialise_diverted(p).unwrap_or_default();
    Ok(what
        .map(|what| {
            format!("a serialised state with other parameters, read into a new instance, is another one: {what}")
        })
        .into_iter()
        .collect())
}

/// The state of an instance with other parameters and start values than its own, read into a new instance, which has its own
/// ones: "the internal FMU state consists of the values of the continuous states, iteration variables, parameter values, ..."
/// (section 2.1.8). Nothing where the FMU does not run so.
fn serialise_diverted(p: &Probe) -> Result<Option<String>, HostError> {
    let _guard = super::super::host::chosen_values();
    let Some(mut instance) = super::reset::diverted(p)? else { return Ok(None) };
    let (n, cut) = (p.steps(), p.steps() / 2);
    instance.may_go_back = true;
    let state = instance.get_state()?;
    let bytes = instance.serialize_state(&state)?;
    let mut courses = Vec::new();
    for _ in 0..2 {
        instance.set_state(&state)?;
        courses.push(p.run(&mut instance, cut, n)?);
    }
    if p.difference_beyond_tolerance(&courses[0], &courses[1], cut).is_some() {
        return Ok(None);
    }
    let mut other = p.ready()?;
    other.may_go_back = true;
    let copy = other.deserialize_state(&bytes)?;
    other.set_state(&copy)?;
    let found = p.run(&mut other, cut, n)?;
    Ok(p.difference_beyond_tolerance(&courses[0], &found, cut))
}
