//! The time and the derivatives of a run, and steps that the standard does not allow (FMI 2.0.4, sections 4.2.1, 4.2.2 and
//! 4.2.4).

use super::super::description::{BaseType, Causality, Fmi, Variable};
use super::super::host::{HostError, Instance};
use super::probe::{Probe, Tested, not_applicable};
use super::step_size::{size_counts, try_course};

pub(in super::super) fn time(p: &Probe) -> Tested {
    let Some(v) = p.d.variables.iter().find(|v| v.causality == Causality::Independent && v.base() == BaseType::Real)
    else {
        return not_applicable("there is no independent variable");
    };
    let mut instance = p.ready()?;
    let close = |found: f64, expected: f64| (found - expected).abs() <= 1e-6 * p.step + 1e-9 * expected.abs();
    let read = |instance: &mut Instance| instance.get_real(&[v.value_reference]).map(|values| values[0]);
    let found = read(&mut instance)?;
    if !close(found, p.start) {
        return Ok(vec![format!("the independent variable \"{}\" is {found} at t = {}", v.name, p.start)]);
    }
    // An FMU with a fixed step of its own lags behind by less than that step, and catches up again: it is in time
    // where it comes to a communication point at all, and never ahead.
    let mut wrong = None;
    for k in 1..=p.long() {
        if p.run(&mut instance, k - 1, k).is_err() {
            break;
        }
        let (expected, found) = (p.time(k), read(&mut instance)?);
        if close(found, expected) {
            return Ok(vec![]);
        }
        let problem = format!("the independent variable \"{}\" is {found} at t = {expected}", v.name);
        if found.is_nan() || found > expected {
            return Ok(vec![problem]);
        }
        wrong = wrong.or(Some(problem));
    }
    Ok(wrong.into_iter().collect())
}

pub(in super::super) fn derivative(p: &Probe) -> Tested {
    let pairs: Vec<(&Variable, &Variable)> =
        p.d.variables
            .iter()
            .filter_map(|v| Some((v, p.d.by_index(v.derivative?)?)))
            .filter(|(v, x)| v.base() == BaseType::Real && x.base() == BaseType::Real)
            .take(200)
            .collect();
    if pairs.is_empty() {
        return not_applicable("no variable is declared as the derivative of another");
    }
    size_counts(p)?;
    let references: Vec<u32> = pairs.iter().flat_map(|(v, x)| [v.value_reference, x.value_reference]).collect();
    // Whole steps: an FMU with a fixed step of its own may stand still within them.
    let h = p.step;
    let rows = try_course(p, &references, &[1.0], 16)?;
    let mut problems = Vec::new();
    for (at, (v, x)) in pairs.iter().enumerate() {
        let (mut clear, mut wrong, mut example) = (0, 0, String::new());
        for pair in rows.windows(2) {
            let (d0, d1) = (pair[0][2 * at], pair[1][2 * at]);
            let moved = pair[1][2 * at + 1] - pair[0][2 * at + 1];
            let mean = 0.5 * (d0 + d1);
            // Only where the derivative is steady over the step, and what it moves is more than rounding.
            let steady = (d1 - d0).abs() <= 0.2 * mean.abs();
            if steady && (mean * h).abs() > 1e-9 * pair[1][2 * at + 1].abs().max(1e-12) {
                clear += 1;
                if (moved - mean * h).abs() > 0.3 * (mean * h).abs() {
                    wrong += 1;
                    example = format!("\"{}\" moves at {} while \"{}\" is {mean}", x.name, moved / h, v.name);
                }
            }
        }
        if clear >= 5 && wrong == clear {
            problems.push(format!("\"{}\" is not the derivative of \"{}\": {example}", v.name, x.name));
        }
    }
    Ok(problems)
}

fn accepted(instance: &mut Instance, time: f64, step: f64) -> Result<bool, HostError> {
    instance.do_step_status(time, step, true).map(super::super::host::Status::is_ok)
}

pub(in super::super) fn negative(p: &Probe) -> Tested {
    let mut instance = p.ready()?;
    p.run(&mut instance, 0, 3)?;
    let taken = accepted(&mut instance, p.time(3), -p.step)?;
    Ok(if taken { vec![format!("fmi2DoStep by {} returned fmi2OK", -p.step)] } else { vec![] })
}

pub(in super::super) fn zero(p: &Probe) -> Tested {
    let mut instance = p.ready()?;
    p.run(&mut instance, 0, 3)?;
    let before = p.observe(&mut instance)?;
    if accepted(&mut instance, p.time(3), 0.0)? {
        let after = p.observe(&mut instance)?;
        let spoilt = before.reals.iter().zip(&after.reals).position(|(x, y)| x.is_finite() && !y.is_finite());
        if let Some(at) = spoilt {
            return Ok(vec![format!("\"{}\" is {} after a step of size 0", p.observed[0][at].name, after.reals[at])]);
        }
    }
    Ok(vec![])
}

pub(in super::super) fn wrong_point(p: &Probe) -> Tested {
    let mut problems = Vec::new();
    for (what, at) in [("ahead of", 8), ("behind", 1)] {
        let mut instance = p.ready()?;
        p.run(&mut instance, 0, 3)?;
        if accepted(&mut instance, p.time(at), p.step)? {
            problems.push(format!(
                "fmi2DoStep from t = {} returned fmi2OK, which is {what} the communication point t = {}",
                p.time(at),
                p.time(3)
            ));
        }
    }
    Ok(problems)
}

pub(in super::super) fn nan_input(p: &Probe) -> Tested {
    let references: Vec<u32> = p.inputs().filter(|v| v.base() == BaseType::Real).map(|v| v.value_reference).collect();
    if references.is_empty() {
        return not_applicable("there is no Real input");
    }
    for value in [f64::NAN, f64::INFINITY, 1e300] {
        let mut instance = p.ready()?;
        p.run(&mut instance, 0, 2)?;
        // Any status is allowed, as long as the call returns.
        let _ = instance.set_real(&references, &vec![value; references.len()]);
        for k in 2..4 {
            let _ = instance.do_step_status(p.time(k), p.step, true)?;
        }
    }
    Ok(vec![])
}

pub(in super::super) fn early(p: &Probe) -> Tested {
    let mut instance = p.instantiate()?;
    let mut problems = Vec::new();
    if accepted(&mut instance, p.start, p.step)? {
        problems.push("fmi2DoStep before initialisation returned fmi2OK".into());
    }
    let mut instance = p.initializing()?;
    if accepted(&mut instance, p.start, p.step)? {
        problems.push("fmi2DoStep in initialisation mode returned fmi2OK".into());
    }
    Ok(problems)
}

pub(in super::super) fn late(p: &Probe) -> Tested {
    let mut instance = p.ready()?;
    p.run(&mut instance, 0, 3)?;
    instance.terminate()?;
    let taken = accepted(&mut instance, p.time(3), p.step)?;
    Ok(if taken { vec!["fmi2DoStep after fmi2Terminate returned fmi2OK".into()] } else { vec![] })
}

pub(in super::super) fn initialisation_order(p: &Probe) -> Tested {
    let mut problems = Vec::new();
    let mut instance = p.instantiate()?;
    if instance.exit_initialization().is_ok() {
        problems.push("fmi2ExitInitializationMode returned fmi2OK outside initialisation mode".into());
    }
    let mut instance = p.ready()?;
    if instance.enter_initialization().is_ok() {
        problems.push("fmi2EnterInitializationMode returned fmi2OK after initialisation".into());
    }
    if p.d.fmi == Fmi::Three {
        return Ok(problems);
    }
    let mut instance = p.ready()?;
    if instance.setup_experiment(None, p.start, p.stop).is_ok() {
        problems.push("fmi2SetupExperiment returned fmi2OK after initialisation".into());
    }
    Ok(problems)
}

pub(in super::super) fn status_functions(p: &Probe) -> Tested {
    let mut instance = p.ready()?;
    p.run(&mut instance, 0, 1)?;
    instance.status_calls();
    // There is no step to cancel; the call must return all the same.
    let _ = instance.cancel_step();
    Ok(vec![])
}
