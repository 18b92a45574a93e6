//! The default experiment, its start and its end (FMI 2.0.4, sections 2.1.6, 2.2.5 and 4.2.2).

use std::time::{Duration, Instant};

use super::super::description::{BaseType, Causality, Value, Variable};
use super::super::host::{HostError, Status};
use super::lifecycle::last_log_message;
use super::probe::{Learned, Probe, Snapshot, Tested, not_applicable, not_tested, settable};
use super::settable_real;
use super::values::{get, same, set};

/// Longest default run, in wall time; later steps are left out.
const RUN: Duration = Duration::from_millis(500);
/// Most communication steps of the default run.
const RUN_STEPS: usize = 20_000;
/// Steps that are tried with an FMU that declares none and refuses a 500th of the experiment, in s.
const USUAL: [f64; 5] = [0.01, 0.001, 0.1, 1.0, 0.0001];

/// The result of a run.
enum Run {
    /// Wall time of a step, s.
    Done(f64),
    /// The finding, and whether the first step already failed.
    Failed(String, bool),
}

/// Runs the default experiment, in one instance. Where no step size is declared and the FMU refuses the first one, other
/// usual ones are tried: an FMU with a fixed step of its own cannot declare it in FMI 2.0.
pub(in super::super) fn simulate(p: &mut Probe) -> Tested {
    let declared = p.d.default_experiment.and_then(|e| e.step_size).is_some();
    let mut finding = match default_run(p)? {
        Run::Done(cost) => {
            p.learn(Learned { cost, observe_all: true, ..Learned::default() });
            return Ok(vec![]);
        }
        Run::Failed(finding, first) if declared || !first => return Ok(vec![finding]),
        Run::Failed(finding, _) => finding,
    };
    for step in USUAL {
        p.learn(Learned { step, ..Learned::default() });
        match default_run(p) {
            Ok(Run::Done(cost)) => {
                p.learn(Learned { step, cost, observe_all: true, ..Learned::default() });
                return Ok(vec![]);
            }
            Ok(Run::Failed(..)) => {}
            Err(_) => break,
        }
    }
    finding.push_str("; no step size is declared, and the usual ones are refused too");
    Ok(vec![finding])
}

fn default_run(p: &Probe) -> Result<Run, super::Stop> {
    let mut instance = p.instantiate()?;
    instance.initialize(p.start, p.stop)?;
    let stop = p.stop.unwrap_or_else(|| p.time(100));
    let steps = ((stop - p.start) / p.step * (1.0 - 1e-12)).ceil().min(RUN_STEPS as f64) as usize;
    let begin = Instant::now();
    let cost = |k: usize| begin.elapsed().as_secs_f64() / k.max(1) as f64;
    for k in 0..steps {
        let time = p.time(k);
        // A step that would end after the stop time by rounding ends on it; a much shorter last one is not everyone's.
        let step = if time + p.step > stop { stop - time } else { p.step };
        if step < 0.999 * p.step && !p.interface().can_handle_variable_step_size {
            break;
        }
        match instance.do_step_status(time, step, true)? {
            // The FMU may end the simulation.
            Status::Discard if instance.terminated().unwrap_or(false) => return Ok(Run::Done(cost(k))),
            // Odd statuses are a rule of their own.
            Status::Pending | Status::Other(_) => return Ok(Run::Done(cost(k))),
            status if status.is_ok() => {}
            status => {
                let message = last_log_message(&instance);
                let finding = format!("fmi2DoStep from t = {time} by {step} returned {status}{message}");
                return Ok(Run::Failed(finding, k == 0));
            }
        }
        if begin.elapsed() > RUN {
            return Ok(Run::Done(cost(k + 1)));
        }
    }
    Ok(Run::Done(cost(steps)))
}

/// "If the environment tries to compute past stopTime the FMU has to return fmi2Error" (section 2.1.6).
pub(in super::super) fn stop_time(p: &Probe) -> Tested {
    let mut instance = p.instantiate()?;
    instance.initialize(p.start, Some(p.time(3)))?;
    for k in 0..3 {
        let step = p.step.min(p.time(3) - p.time(k));
        if !instance.do_step_status(p.time(k), step, true)?.is_ok() {
            return not_tested("the FMU does not reach the stop time");
        }
    }
    let status = instance.do_step_status(p.time(3), p.step, true)?;
    Ok(if status.is_ok() {
        vec![format!("fmi2DoStep from the stop time {} s by {} returned {status}", p.time(3), p.step)]
    } else {
        vec![]
    })
}

/// Inputs set before and during initialisation are there after it.
pub(in super::super) fn inputs_initial(p: &Probe) -> Tested {
    let mut problems = Vec::new();
    let mut any = false;
    for v in p.inputs().filter(|v| v.base() == BaseType::Real).take(50) {
        let Some(value) = settable_real(p, v) else { continue };
        for (when, early) in [("before initialisation", true), ("in initialisation mode", false)] {
            let attempt = |early: bool| -> Result<Option<f64>, HostError> {
                let mut instance = p.instantiate()?;
                if early {
                    instance.set_real(&[v.value_reference], &[value])?;
                }
                instance.setup_experiment(None, p.start, None)?;
                instance.enter_initialization()?;
                if !early {
                    instance.set_real(&[v.value_reference], &[value])?;
                }
                // A value that does not read as it was set is reported by another rule.
                let there = instance.get_real(&[v.value_reference])?[0];
                instance.exit_initialization()?;
                let mut after = instance.get_real(&[v.value_reference])?[0];
                if after != value {
                    // Some take what is set over with the first step.
                    let _ = instance.do_step_status(p.start, p.step, true)?;
                    after = instance.get_real(&[v.value_reference])?[0];
                }
                Ok((early || (there - value).abs() <= 1e-6 * value.abs()).then_some(after))
            };
            match attempt(early) {
                Ok(Some(after)) => {
                    any = true;
                    let own = matches!(v.start, Some(Value::Real(start)) if start == after);
                    if own {
                        problems.push(format!(
                            "the input \"{}\" was set to {value} {when} and reads {after} after it",
                            v.name
                        ));
                        break;
                    }
                }
                Ok(None) => {}
                Err(HostError::OnlyOnce) => return Err(HostError::OnlyOnce.into()),
                // Whether it can be set then is tested by another rule.
                Err(_) => {}
            }
        }
    }
    if any { Ok(problems) } else { not_applicable("there is no Real input to be set before the run") }
}

/// Parameters set in initialisation mode, where that is allowed "for a variable with variability != constant that has
/// initial = exact" (section 4.2.4), act as those set before it.
pub(in super::super) fn parameters_initial(p: &Probe) -> Tested {
    let parameter = |v: &&Variable| v.causality == Causality::Parameter && settable(v);
    let other = |v| settable_real(p, v).map(Value::Real).or_else(|| super::settings::another(p, v));
    let chosen = p.d.variables.iter().filter(parameter).filter_map(|v| Some((v, other(v)?))).take(20);
    let chosen: Vec<(&Variable, Value)> = chosen.collect();
    if chosen.is_empty() {
        return not_applicable("there is no parameter with another value to set");
    }
    let n = p.steps();
    p.affordable((2 * chosen.len() + 1) * n)?;
    let mut instance = p.ready()?;
    let expected = p.run(&mut instance, 0, n)?;
    instance.free();
    let (mut problems, mut any) = (Vec::new(), false);
    for (v, value) in &chosen {
        let _guard = super::super::host::chosen_values();
        let run = |early: bool| -> Result<(Value, Vec<Snapshot>), HostError> {
            let mut instance = p.instantiate()?;
            if early {
                set(&mut instance, v, value)?;
            }
            p.enter(&mut instance)?;
            if !early {
                set(&mut instance, v, value)?;
            }
            instance.exit_initialization()?;
            Ok((get(&mut instance, v)?, p.run(&mut instance, 0, n)?))
        };
        // A value that cannot be set at all, or fails, is reported by another rule.
        let (before, within) = match (run(true), run(false)) {
            (Err(HostError::OnlyOnce), _) | (_, Err(HostError::OnlyOnce)) => return Err(HostError::OnlyOnce.into()),
            (Err(_), _) => continue,
            (Ok(before), within) => (before, within),
        };
        any = true;
        let (name, value) = (&v.name, value.to_string());
        let own = [v.value_reference];
        match within {
            Err(error) => problems.push(format!(
                "the parameter \"{name}\" can be set to {value} before initialisation, and not in initialisation mode: {error}"
            )),
            Ok(within) if !same(&within.0, &before.0) => problems.push(format!(
                "the parameter \"{name}\" was set to {value} in initialisation mode and reads {} after it; set before it, it reads {}",
                within.0,
                before.0
            )),
            Ok(within) if p.responds(&expected, &before.1, &own) && !p.responds(&expected, &within.1, &own) => problems
                .push(format!(
                    "the parameter \"{name}\" set to {value} in initialisation mode changes nothing; set before it, it does"
                )),
            Ok(_) => {}
        }
    }
    if any { Ok(problems) } else { not_tested("the FMU does not run with other parameters than its own") }
}

/// "In this state, the solution at the final time can be retrieved" (terminated, section 4.2.4).
pub(in super::super) fn terminated(p: &Probe) -> Tested {
    let mut instance = p.ready()?;
    p.run(&mut instance, 0, 3)?;
    let last = p.observe(&mut instance)?;
    instance.terminate()?;
    let found = match p.observe(&mut instance) {
        Ok(found) => found,
        Err(error) => return Ok(vec![format!("the final values cannot be read after fmi2Terminate: {error}")]),
    };
    let slack = [last.clone()];
    if let Some(what) = p.difference_beyond_tolerance(&slack, &[found], 2) {
        return Ok(vec![format!("after fmi2Terminate, {what}")]);
    }
    Ok(vec![])
}
