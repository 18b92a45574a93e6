//! Several instances in one process: one after the other, side by side, on several threads (FMI 2.0.4, section 2.1.5).

use std::time::{Duration, Instant};

use super::super::description::Causality;
use super::super::host::{HostError, Status};
use super::probe::{Learned, Probe, STEPS, Tested, not_applicable, not_tested};
use super::reset::diverted;

/// Longest trial of what an FMU can be asked for.
const TRIAL: Duration = Duration::from_secs(2);

/// A second instance after the first; then how much the FMU can be asked for.
pub(in super::super) fn repeated(p: &mut Probe) -> Tested {
    if p.interface().only_once {
        p.learn(Learned { observe_all: true, ..p.learned.clone() });
        return not_applicable("canBeInstantiatedOnlyOncePerProcess is true");
    }
    let life = |p: &Probe| -> Result<(), HostError> {
        let mut instance = p.instantiate()?;
        instance.initialize(p.start, None)?;
        match instance.do_step_status(p.start, p.step, true)? {
            // The status of a step is a rule of its own.
            Status::Error | Status::Fatal => Err(HostError::Status { function: "fmi2DoStep", status: Status::Error }),
            _ => Ok(()),
        }
    };
    life(p)?;
    if let Err(error) = life(p) {
        return Ok(vec![format!("a second instance, made after the first was freed, fails: {error}")]);
    }
    let known = p.learned.clone();
    for (stimulus, observe_all) in [(true, true), (true, false), (false, true), (false, false)] {
        if stimulus && known.tame {
            continue;
        }
        let _guard = stimulus.then(super::super::host::chosen_values);
        p.learn(Learned { stimulus, observe_all, ..known.clone() });
        let begin = Instant::now();
        if let Ok(taken) = trial(p) {
            p.learned.cost = begin.elapsed().as_secs_f64() / taken as f64;
            let affordable = (0.1 / p.learned.cost.max(1e-9)) as usize;
            p.learned.steps = taken.min(affordable.max(6));
            break;
        }
    }
    Ok(vec![])
}

/// Runs the steps of a comparison; how many there were before the FMU ended the simulation, or time did.
fn trial(p: &Probe) -> Result<usize, HostError> {
    let begin = Instant::now();
    let mut instance = p.ready()?;
    p.observe(&mut instance)?;
    for k in 0..STEPS {
        p.drive(&mut instance, p.time(k))?;
        match instance.do_step_status(p.time(k), p.step, true)? {
            // Odd statuses are a rule of their own.
            Status::Discard | Status::Pending | Status::Other(_) => return Ok(k.max(1)),
            status if status.is_ok() => {}
            status => return Err(HostError::Status { function: "fmi2DoStep", status }),
        }
        p.observe(&mut instance)?;
        if begin.elapsed() > TRIAL {
            return Ok(k + 1);
        }
    }
    Ok(STEPS)
}

/// An instance after one that had other values, against one that was the first.
pub(in super::super) fn sequential(p: &Probe) -> Tested {
    p.comparable()?;
    // Before any other instance of the process has left something.
    if let Some(problem) = initial_kept(p)? {
        return Ok(vec![problem]);
    }
    let n = p.steps();
    let record = |p: &Probe| -> Result<_, HostError> {
        let mut instance = p.ready()?;
        let mut record = vec![p.observe(&mut instance)?];
        record.extend(p.run(&mut instance, 0, n)?);
        Ok(record)
    };
    let expected = record(p)?;
    match diverted(p)? {
        Some(other) => other.free(),
        None => return not_tested("the FMU does not run with other parameters and start values"),
    }
    let found = record(p)?;
    let what = p.difference_beyond_tolerance(&expected, &found, 0);
    Ok(what
        .map(|what| format!("an instance made after one with other values keeps something of it: {what}"))
        .into_iter()
        .collect())
}

/// Initial values that are set in the first instance of the process, and not in the second: whether the second has those of
/// the first; the first such variable.
fn initial_kept(p: &Probe) -> Result<Option<String>, HostError> {
    /// Each takes two instances.
    const MOST: usize = 10;
    let _guard = super::super::host::chosen_values();
    let states = p.d.variables.iter().filter(|v| matches!(v.causality, Causality::Local | Causality::Output));
    for v in states.filter(|v| super::probe::settable(v)).take(MOST) {
        let Some(value) = super::settable_real(p, v) else { continue };
        let r = [v.value_reference];
        let initial = |set: bool| -> Result<f64, HostError> {
            let mut instance = p.instantiate()?;
            if set {
                instance.set_real(&r, &[value])?;
            }
            p.enter(&mut instance)?;
            instance.exit_initialization()?;
            Ok(instance.get_real(&r)?[0])
        };
        // Whether it can be set is a rule of its own.
        if let (Ok(first), Ok(second)) = (initial(true), initial(false))
            && (first, second) == (value, value)
        {
            return Ok(Some(format!(
                "\"{}\" starts at {value}, to which it was set in an instance before, instead of {}",
                v.name,
                super::partial::start(v)
            )));
        }
    }
    Ok(None)
}

pub(in super::super) fn independent(p: &Probe) -> Tested {
    if p.interface().only_once {
        return not_applicable("canBeInstantiatedOnlyOncePerProcess is true");
    }
    p.comparable()?;
    let n = p.steps();
    let mut alone = p.ready()?;
    let expected = p.run(&mut alone, 0, n)?;
    alone.free();
    let mut first = p.ready()?;
    let mut second = Some(p.ready()?);
    let mut found = Vec::new();
    for k in 0..n {
        if let Some(other) = &mut second {
            // The other one runs ahead, with other inputs.
            p.drive(other, p.time(k + 7))?;
            if k == 0 {
                other.do_step(p.time(0), p.step)?;
            }
            other.do_step(p.time(k + 1), p.step)?;
        }
        if k == n / 2 {
            second = None;
        }
        found.extend(p.run(&mut first, k, k + 1)?);
    }
    if let Some(what) = p.difference_of_runs(&expected, &found, 0) {
        return Ok(vec![format!("another instance in the same process changes this one: {what}")]);
    }
    first.free();
    // The one made second, while the first lived.
    let (first, mut second) = (p.ready()?, p.ready()?);
    let found = p.run(&mut second, 0, n)?;
    drop(first);
    let what = p.difference_of_runs(&expected, &found, 0);
    Ok(what.map(|what| format!("an instance made while another lives is another one: {what}")).into_iter().collect())
}

/// Instances that run at the same time.
const THREADS: usize = 4;

pub(in super::super) fn threads(p: &Probe) -> Tested {
    if !independent(p)?.is_empty() {
        return not_tested("instances affect each other on one thread already");
    }
    let n = p.steps();
    let mut alone = p.ready()?;
    let expected = p.run(&mut alone, 0, n)?;
    alone.free();
    let mut problems = Vec::new();
    let barrier = std::sync::Barrier::new(THREADS);
    let results: Vec<Result<Option<String>, HostError>> = std::thread::scope(|scope| {
        let many = || {
            barrier.wait();
            let end = Instant::now() + Duration::from_millis(120);
            while Instant::now() < end {
                let mut instance = p.ready()?;
                let found = p.run(&mut instance, 0, n)?;
                instance.free();
                if let Some(what) = p.difference_of_runs(&expected, &found, 0) {
                    return Ok(Some(what));
                }
            }
            Ok(None)
        };
        let handles: Vec<_> = (0..THREADS).map(|_| scope.spawn(many)).collect();
        handles.into_iter().map(|h| h.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))).collect()
    });
    for result in results {
        match result {
            Ok(None) => {}
            Ok(Some(what)) => problems.push(format!("instances on several threads disturb each other: {what}")),
            Err(error) => problems.push(format!("with instances on several threads, {error}")),
        }
    }
    problems.truncate(1);
    Ok(problems)
}

pub(in super::super) fn handover(p: &Probe) -> Tested {
    p.comparable()?;
    let n = p.steps();
    let mut alone = p.ready()?;
    let expected = p.run(&mut alone, 0, n)?;
    alone.free();
    let mut instance = p.ready()?;
    let mut found = p.run(&mut instance, 0, n / 2)?;
    let rest = std::thread::scope(|scope| {
        let instance = &mut instance;
        let handle = scope.spawn(move || p.run(instance, n / 2, n));
        handle.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))
    })?;
    found.extend(rest);
    let what = p.difference_of_runs(&expected, &found, 0);
    Ok(what.map(|what| format!("an instance stepped from a second thread goes astray: {what}")).into_iter().collect())
}
