//! States where each step was done with the flag that none before it will be set: "noSetFMUStatePriorToCurrentPoint is fmi2True if
//! fmi2SetFMUstate will no longer be called for time instants prior to currentCommunicationPoint in this simulation run"
//! (FMI 2.0.4, section 4.2.2). The state at that point, from which the step is repeated, is not prior to it.

use super::super::host::HostError;
use super::probe::Probe;

/// Times that a step is repeated: masters that solve a loop over several FMUs do so until they converge.
const AGAIN: usize = 3;

/// Whether states that may still be set are restored; the message where not.
pub(super) fn check(p: &Probe) -> Result<Option<String>, HostError> {
    if p.interface().only_once {
        return Ok(None);
    }
    let found = after_flagged_steps(p)?;
    if found.is_some() { Ok(found) } else { at_the_point(p) }
}

/// After steps with the flag, the run may be repeated from the state at their end.
fn after_flagged_steps(p: &Probe) -> Result<Option<String>, HostError> {
    let (n, cut) = (p.steps(), p.steps() / 3);
    let mut instance = p.ready()?;
    p.run(&mut instance, 0, cut)?;
    instance.may_go_back = true;
    let state = instance.get_state()?;
    let expected = p.run(&mut instance, cut, n)?;
    instance.set_state(&state)?;
    let found = p.run(&mut instance, cut, n)?;
    instance.free_state(state)?;
    let what = p.difference_beyond_tolerance(&expected, &found, cut);
    Ok(what.map(|what| {
        format!("a state got after steps with noSetFMUStatePriorToCurrentPoint = fmi2True is not restored: {what}")
    }))
}

/// Each step with the flag, repeated from the state at its beginning; then a step with the flag and some without, repeated
/// from the state at the beginning of the first.
fn at_the_point(p: &Probe) -> Result<Option<String>, HostError> {
    let n = p.steps() / 2;
    let mut instance = p.ready()?;
    // It is never set again, so that the FMU may discard its contents; it is freed all the same.
    let first = instance.get_state()?;
    for k in 0..n {
        let state = instance.get_state()?;
        let flagged_step = |instance: &mut super::Instance| -> Result<_, HostError> {
            instance.may_go_back = false;
            p.run(instance, k, k + 1)
        };
        let expected = flagged_step(&mut instance)?;
        for again in 1..=AGAIN {
            instance.set_state(&state)?;
            let found = flagged_step(&mut instance)?;
            if let Some(what) = p.difference_beyond_tolerance(&expected, &found, k) {
                return Ok(Some(format!(
                    "a step with noSetFMUStatePriorToCurrentPoint = fmi2True, had again from the state at its beginning, is another one \
                     the {} time: {what}",
                    ["first", "second", "third"][again - 1]
                )));
            }
        }
        instance.free_state(state)?;
    }
    let state = instance.get_state()?;
    let mut runs = Vec::new();
    for _ in 0..2 {
        instance.may_go_back = false;
        let mut run = p.run(&mut instance, n, n + 1)?;
        instance.may_go_back = true;
        run.extend(p.run(&mut instance, n + 1, p.steps())?);
        runs.push(run);
        instance.set_state(&state)?;
    }
    instance.free_state(state)?;
    instance.free_state(first)?;
    let what = p.difference_beyond_tolerance(&runs[0], &runs[1], n);
    Ok(what.map(|what| {
        format!(
            "after a step with noSetFMUStatePriorToCurrentPoint = fmi2True and some with fmi2False the state at the beginning of the \
             first is not restored: {what}"
        )
    }))
}
