//! Runs from other start times: "startTime is the fixed initial value of the independent variable" (fmi2SetupExperiment, FMI
//! 2.0.4, section 2.1.6).

use super::super::description::{BaseType, Causality, Unknown, Variable};
use super::super::host::{HostError, Instance, Status};
use super::lifecycle::last_log_message;
use super::partial::{MOST, real};
use super::probe::{Probe, Tested, not_applicable, not_tested};
use super::step_size::range;

/// A run from another start time.
pub(in super::super) fn start_time(p: &Probe) -> Tested {
    let start = p.start + 10.0 * p.step;
    let mut instance = p.instantiate()?;
    if let Err(error) = instance.initialize(start, None) {
        return not_tested(format!("the FMU does not start at {start} s: {error}"));
    }
    let time = p.d.variables.iter().find(|v| v.causality == Causality::Independent && v.base() == BaseType::Real);
    let read = |instance: &mut Instance| match time {
        Some(v) => instance.get_real(&[v.value_reference]).map(|values| Some(values[0])),
        None => Ok(None),
    };
    let close = |found: f64, expected: f64| (found - expected).abs() <= 1e-6 * p.step + 1e-9 * expected.abs();
    let before = read(&mut instance)?;
    let status = instance.do_step_status(start, p.step, true)?;
    if matches!(status, Status::Error | Status::Fatal) {
        let message = last_log_message(&instance);
        return Ok(vec![format!(
            "a step from the start time {start} s returned {status}, one from {} s does not{message}",
            p.start
        )]);
    }
    // Some FMUs update their time only after a step; those with a step of their own, longer than this one, at its end only.
    if let (Some(before), Some(after), Some(v)) = (before, read(&mut instance)?, time)
        && !close(before, start)
        && !close(after, start + p.step)
    {
        let found = format!("\"{}\" is {before} after initialisation at {start}", v.name);
        return Ok(vec![format!("the start time is ignored: {found}, and {after} a step of {} later", p.step)]);
    }
    Ok(vec![])
}

/// Courses of what is declared to depend on the time, from several start times: where they all move alike, the time of their
/// excitation is counted from the beginning of the run. An equation without the time moves alike too, and dependencies may
/// name more than there is, so that this is no breach of the standard; without a declaration nothing is to be seen.
pub(in super::super) fn effect(p: &Probe) -> Tested {
    /// Start times other than that of the default experiment, in parts of the run: no period divides both.
    const LATER: [f64; 2] = [0.367_879, 0.618_034];
    let time = p.d.variables.iter().position(|v| v.causality == Causality::Independent).map(|i| i as u32 + 1);
    let names = |(u, _): &(&Unknown, &Variable)| u.dependencies.iter().flatten().any(|&i| Some(i) == time);
    let structure = &p.d.structure;
    let unknowns: Vec<&Variable> = real(&p.d, &structure.outputs)
        .chain(real(&p.d, &structure.derivatives))
        .filter(|unknown| time.is_some() && names(unknown))
        .map(|(_, v)| v)
        .filter(|v| !p.learned.masked.contains(&(0, v.value_reference)))
        .take(MOST)
        .collect();
    if unknowns.is_empty() {
        return not_applicable("no Real output or derivative names the independent variable among its dependencies");
    }
    if !start_time(p)?.is_empty() {
        return not_tested("the start time is ignored");
    }
    let (n, references) = (p.long(), unknowns.iter().map(|v| v.value_reference).collect::<Vec<u32>>());
    p.affordable(3 * n)?;
    let course = |start: f64| -> Result<Vec<Vec<f64>>, HostError> {
        let mut instance = p.instantiate()?;
        instance.initialize(start, None)?;
        let mut rows = vec![instance.get_real(&references)?];
        for k in 0..n {
            // The FMU ends its run here.
            if instance.do_step(start + k as f64 * p.step, p.step).is_err() {
                break;
            }
            rows.push(instance.get_real(&references)?);
        }
        Ok(rows)
    };
    let reference = course(p.start)?;
    let mut others = Vec::new();
    for part in LATER {
        let start = p.start + part * n as f64 * p.step;
        match course(start) {
            Ok(rows) if rows.len() > 1 => others.push(rows),
            _ => return not_tested(format!("the FMU does not run from {start} s")),
        }
    }
    let alike = |at: usize| {
        let spread = range(&reference, at);
        // What an FMU computes of times that are rounded otherwise.
        let close = |(a, b): (&Vec<f64>, &Vec<f64>)| (a[at] - b[at]).abs() <= 1e-9 * spread.max(a[at].abs());
        spread > 1e-9 * reference[0][at].abs() && others.iter().all(|rows| reference.iter().zip(rows).all(close))
    };
    Ok(unknowns
        .iter()
        .enumerate()
        .filter(|(at, _)| alike(*at))
        .map(|(_, v)| {
            format!(
                "\"{}\" names the independent variable among its dependencies, and moves alike from the start times {} s and {} s",
                v.name,
                p.start,
                p.start + LATER[0] * n as f64 * p.step
            )
        })
        .collect())
}
