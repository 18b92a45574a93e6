//! What is right within the FMU's tolerance, but not to the last digit: worth knowing where results are to be reproduced, and
//! no more than that, for a solver may go on with the step size or the derivative that it had.

use super::probe::{Probe, Tested, not_applicable, not_tested};
use super::reset;

pub(in super::super) fn reset(p: &Probe) -> Tested {
    p.comparable()?;
    let (expected, mut instance) = reset::before_reset(p)?;
    let again = reset::after_reset(p, &mut instance)?;
    if p.difference_beyond_tolerance(&expected, &again, 0).is_some() {
        return not_tested("fmi2Reset does not restore a new instance");
    }
    let what = p.difference_of_runs(&expected[1..], &again[1..], 0);
    Ok(what
        .map(|what| format!("a run after fmi2Reset is that of a new instance within the tolerance alone: {what}"))
        .into_iter()
        .collect())
}

pub(in super::super) fn state(p: &Probe) -> Tested {
    if !p.interface().can_get_and_set_state {
        return not_applicable("canGetAndSetFMUstate is false");
    }
    p.comparable()?;
    let (n, cut) = (p.steps(), p.steps() / 3);
    let mut instance = p.ready()?;
    instance.may_go_back = true;
    p.run(&mut instance, 0, cut)?;
    let state = instance.get_state()?;
    let expected = p.run(&mut instance, cut, n)?;
    instance.set_state(&state)?;
    let found = p.run(&mut instance, cut, n)?;
    instance.free_state(state)?;
    if p.difference_beyond_tolerance(&expected, &found, cut).is_some() {
        return not_tested("fmi2SetFMUstate does not restore");
    }
    let what = p.difference_of_runs(&expected, &found, cut);
    Ok(what
        .map(|what| format!("a run from a restored state is the one before within the tolerance alone: {what}"))
        .into_iter()
        .collect())
}
