//! Loading, making, freeing, resetting and running instances (FMI 2.0.4, sections 2.1.4 to 2.1.6 and 4.2).

use std::sync::Arc;
use std::time::{Duration, Instant};

use super::super::description::{Causality, Value, Variability};
use super::super::host::abi::{CALLS, Call};
use super::super::host::{Binary, Instance, InstanceOptions, Status, abuse};
use super::measure;
use super::probe::{Learned, Probe, STEPS, Stop, Tested, not_applicable, not_tested};
use super::{Setup, settable_real};
use crate::fmu::host::HostError;

/// Longest default run, in wall time; later steps are left out, and the report says so.
const RUN: Duration = Duration::from_millis(500);
/// Most communication steps of the default run.
const RUN_STEPS: usize = 20_000;

pub(super) fn load(setup: &Setup) -> Tested {
    match Binary::load(&setup.binary_path, true) {
        Ok(binary) => {
            // Unloading is a rule of its own.
            std::mem::forget(binary);
            Ok(vec![])
        }
        Err(error) => Ok(vec![error.to_string()]),
    }
}

/// Functions that a host needs, whatever the capability flags say.
const CORE: [Call; 19] = [
    Call::get_types_platform,
    Call::get_version,
    Call::set_debug_logging,
    Call::instantiate,
    Call::free_instance,
    Call::setup_experiment,
    Call::enter_initialization,
    Call::exit_initialization,
    Call::terminate,
    Call::reset,
    Call::get_real,
    Call::get_integer,
    Call::get_boolean,
    Call::get_string,
    Call::set_real,
    Call::set_integer,
    Call::set_boolean,
    Call::set_string,
    Call::do_step,
];

fn needed(p: &Probe) -> Vec<&'static str> {
    let i = p.interface();
    let mut calls = CORE.to_vec();
    let mut add = |flag: bool, more: &[Call]| {
        if flag {
            calls.extend_from_slice(more);
        }
    };
    add(i.can_get_and_set_state, &[Call::get_state, Call::set_state, Call::free_state]);
    add(i.can_serialize_state, &[Call::serialized_size, Call::serialize, Call::deserialize]);
    add(i.provides_directional_derivative, &[Call::directional_derivative]);
    add(i.can_interpolate_inputs, &[Call::set_input_derivatives]);
    add(i.max_output_derivative_order > 0, &[Call::get_output_derivatives]);
    add(
        i.can_run_asynchronuously,
        &[Call::cancel_step, Call::get_status, Call::get_real_status, Call::get_boolean_status],
    );
    calls.into_iter().map(|c| CALLS[c as usize]).collect()
}

pub(super) fn symbols(p: &Probe) -> Tested {
    Ok(needed(p).into_iter().filter(|s| !p.binary.exports(s)).map(|s| format!("{s} is not exported")).collect())
}

pub(super) fn all_symbols(p: &Probe) -> Tested {
    let needed = needed(p);
    let missing: Vec<&str> =
        CALLS.iter().skip(3).filter(|s| !needed.contains(s) && !p.binary.exports(s)).copied().collect();
    Ok(if missing.is_empty() { vec![] } else { vec![format!("not exported: {}", missing.join(", "))] })
}

pub(super) fn types_platform(p: &Probe) -> Tested {
    let text = super::super::host::static_text(&p.binary, Call::get_types_platform)?;
    Ok(if text == "default" { vec![] } else { vec![format!("fmi2GetTypesPlatform gives {text:?}, not \"default\"")] })
}

pub(super) fn version(p: &Probe) -> Tested {
    let text = super::super::host::static_text(&p.binary, Call::get_version)?;
    Ok(if text == "2.0" { vec![] } else { vec![format!("fmi2GetVersion gives {text:?}, not \"2.0\"")] })
}

pub(super) fn instantiate(p: &Probe) -> Tested {
    p.instantiate()?.free();
    Ok(vec![])
}

pub(super) fn free_null(p: &Probe) -> Tested {
    abuse::free_null(&p.binary)?;
    Ok(vec![])
}

pub(super) fn initialise(p: &Probe) -> Tested {
    let mut instance = p.instantiate()?;
    instance.setup_experiment(None, p.start, p.stop)?;
    instance.enter_initialization()?;
    instance.exit_initialization()?;
    Ok(vec![])
}

pub(super) fn step_status(p: &Probe) -> Tested {
    let mut instance = p.ready()?;
    for k in 0..3 {
        match instance.do_step_status(p.time(k), p.step, true)? {
            Status::Pending if !p.interface().can_run_asynchronuously => {
                return Ok(vec!["fmi2DoStep returned fmi2Pending, though canRunAsynchronuously is false".into()]);
            }
            status @ Status::Other(_) => return Ok(vec![format!("fmi2DoStep returned {status}")]),
            Status::Pending => {
                let end = Instant::now() + Duration::from_secs(5);
                while instance.step_status()? == Status::Pending {
                    if Instant::now() > end {
                        return Ok(vec!["fmi2DoStep stays fmi2Pending for more than 5 s".into()]);
                    }
                    std::thread::sleep(Duration::from_millis(1));
                }
            }
            Status::Discard => {
                let time = instance.last_successful_time();
                if time.is_err() {
                    let what = "fmi2DoStep returned fmi2Discard, but fmi2GetRealStatus does not say how far it came";
                    return Ok(vec![what.into()]);
                }
                break;
            }
            // Failing steps are the next rule's.
            _ => {}
        }
    }
    Ok(vec![])
}

/// Tries how much the FMU can be asked for, then runs the default experiment.
pub(super) fn simulate(p: &mut Probe) -> Tested {
    if p.interface().only_once {
        p.learn(Learned { observe_all: true, ..Learned::default() });
        return default_run(p);
    }
    let mut last = None;
    for (stimulus, observe_all) in [(true, true), (true, false), (false, true), (false, false)] {
        p.learn(Learned { stimulus, observe_all, ..Learned::default() });
        let begin = Instant::now();
        match trial(p) {
            Ok(taken) => {
                p.learned.cost = begin.elapsed().as_secs_f64() / taken as f64;
                let affordable = (0.1 / p.learned.cost.max(1e-9)) as usize;
                p.learned.steps = taken.min(affordable.max(6));
                last = None;
                break;
            }
            Err(error) => last = Some(error),
        }
    }
    if let Some(error) = last {
        return Err(error.into());
    }
    default_run(p)
}

/// Runs the steps of a comparison; how many there were before the FMU ended the simulation.
fn trial(p: &Probe) -> Result<usize, HostError> {
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
    }
    Ok(STEPS)
}

fn default_run(p: &Probe) -> Tested {
    let mut instance = p.instantiate()?;
    instance.initialize(p.start, p.stop)?;
    let stop = p.stop.unwrap_or_else(|| p.time(100));
    let steps = ((stop - p.start) / p.step * (1.0 - 1e-12)).ceil().min(RUN_STEPS as f64) as usize;
    let end = Instant::now() + RUN;
    for k in 0..steps {
        let time = p.time(k);
        let step = p.step.min(stop - time);
        match instance.do_step_status(time, step, true)? {
            // The FMU may end the simulation.
            Status::Discard if instance.terminated().unwrap_or(false) => break,
            Status::Pending | Status::Other(_) => return Ok(vec![]),
            status if status.is_ok() => {}
            status => {
                let said = last_words(&instance);
                return Ok(vec![format!("fmi2DoStep from t = {time} by {step} returned {status}{said}")]);
            }
        }
        if Instant::now() > end {
            break;
        }
    }
    Ok(vec![])
}

/// What the FMU logged last, for a message.
pub(super) fn last_words(instance: &Instance) -> String {
    instance.take_log().last().map_or(String::new(), |m| format!("; the FMU says: {}", m.message))
}

pub(super) fn terminate(p: &Probe) -> Tested {
    let mut instance = p.ready()?;
    p.run(&mut instance, 0, 3)?;
    instance.terminate()?;
    instance.free();
    // Freed without termination, as hosts do when something fails.
    let mut instance = p.ready()?;
    p.run(&mut instance, 0, 3)?;
    instance.free();
    p.initializing()?.free();
    Ok(vec![])
}

pub(super) fn guid(p: &Probe) -> Tested {
    let options = InstanceOptions { guid: "{00000000-dead-beef-0000-000000000000}".into(), ..p.options() };
    match Instance::new(Arc::clone(&p.binary), None, &options) {
        Ok(_) => Ok(vec!["fmi2Instantiate accepts a wrong GUID".into()]),
        Err(_) => Ok(vec![]),
    }
}

pub(super) fn resources(p: &Probe) -> Tested {
    let options = InstanceOptions { resources: "file:///nowhere/at/all/resources".into(), ..p.options() };
    if let Ok(mut instance) = Instance::new(Arc::clone(&p.binary), None, &options)
        && instance.initialize(p.start, p.stop).is_ok()
    {
        let _ = instance.do_step(p.start, p.step);
    }
    Ok(vec![])
}

/// Cycles of a window, and of a slow FMU.
const CYCLES: usize = 10;
const SLOW_CYCLES: usize = 2;
/// Windows that must all grow.
const WINDOWS: usize = 4;
/// Bytes a cycle, and a window, from which a growth counts: the C library's own bookkeeping moves by less.
const GROWTH: i64 = 16;
const WINDOW_GROWTH: i64 = 300;

/// Repeats something until the heap is warm, then looks whether all windows grow; by how many bytes a cycle.
fn grows(slow: Duration, mut cycle: impl FnMut() -> Result<(), HostError>) -> Result<Option<i64>, Stop> {
    let mut sizes = Vec::with_capacity(WINDOWS + 1);
    let begin = Instant::now();
    cycle()?;
    cycle()?;
    if begin.elapsed() > 30 * slow {
        return not_tested(format!("a cycle takes {:.1} s", begin.elapsed().as_secs_f64() / 2.0));
    }
    let cycles = if begin.elapsed() > 2 * slow { SLOW_CYCLES } else { CYCLES };
    for _ in 0..cycles {
        cycle()?;
    }
    // What grows must grow on.
    let mut each = None;
    for longer in [1, if cycles == CYCLES { 3 } else { 2 }] {
        sizes.clear();
        sizes.push(heap()?);
        for _ in 0..WINDOWS {
            for _ in 0..longer * cycles {
                cycle()?;
            }
            sizes.push(heap()?);
        }
        let least = sizes.windows(2).map(|w| w[1] - w[0]).min().unwrap_or(0);
        each = Some(least / (longer * cycles) as i64).filter(|&each| least >= WINDOW_GROWTH && each >= GROWTH);
        if each.is_none() {
            break;
        }
    }
    Ok(each)
}

fn heap() -> Result<i64, Stop> {
    measure::heap().ok_or_else(|| Stop::NotTested("the C library here does not tell how much memory is in use".into()))
}

/// Bytes an instance from which a leak is large.
const LARGE: i64 = 32 << 10;

/// What making, running and freeing an instance leaves behind: bytes, files, threads.
fn left_behind(p: &Probe) -> Result<(Option<i64>, bool, bool), Stop> {
    let (mut files, mut threads) = (0, 0);
    let mut cycle = 0;
    let growth = grows(Duration::from_millis(15), || {
        let mut instance = p.ready()?;
        p.run(&mut instance, 0, p.steps().min(3))?;
        instance.terminate()?;
        instance.free();
        cycle += 1;
        if cycle == 2 {
            (files, threads) = (measure::open_files(), measure::threads());
        }
        Ok(())
    })?;
    let more = |now: usize, before: usize| now > before && (now - before) * 2 > cycle;
    Ok((growth, more(measure::open_files(), files), more(measure::threads(), threads)))
}

pub(super) fn instance_leak(p: &Probe) -> Tested {
    let (growth, files, threads) = left_behind(p)?;
    let growth = growth.filter(|&bytes| bytes < LARGE && !files && !threads);
    Ok(growth
        .map(|bytes| format!("each instance made, run and freed leaves {bytes} bytes of memory allocated"))
        .into_iter()
        .collect())
}

pub(super) fn instance_leak_large(p: &Probe) -> Tested {
    let (growth, files, threads) = left_behind(p)?;
    let mut problems = Vec::new();
    if let Some(growth) = growth.filter(|&bytes| bytes >= LARGE) {
        problems.push(format!("each instance made, run and freed leaves {growth} bytes of memory allocated"));
    }
    if files {
        problems.push("each instance made, run and freed leaves a file open".into());
    }
    if threads {
        problems.push("each instance made, run and freed leaves a thread running".into());
    }
    Ok(problems)
}

pub(super) fn step_leak(p: &Probe) -> Tested {
    let mut instance = p.ready()?;
    let mut k = 0;
    let growth = grows(Duration::from_millis(15), || {
        for _ in 0..10 {
            instance.do_step(p.time(k), p.step)?;
            k += 1;
        }
        Ok(())
    });
    let growth = match growth {
        Err(Stop::Host(error)) => return not_tested(format!("no run is long enough: {error}")),
        other => other?,
    };
    Ok(growth
        .map(|bytes| format!("each fmi2DoStep leaves {} bytes of memory allocated", bytes / 10))
        .into_iter()
        .collect())
}

pub(super) fn determinism(p: &mut Probe) -> Tested {
    let run = |p: &Probe| -> Result<_, HostError> {
        let mut instance = p.ready()?;
        let mut record = vec![p.observe(&mut instance)?];
        record.extend(p.run(&mut instance, 0, p.steps())?);
        Ok(record)
    };
    // Memory that the FMU never wrote reads differently in the second run, and the clock has moved on.
    measure::perturb_memory(0x11);
    let first = run(p)?;
    measure::perturb_memory(0xA5);
    std::thread::sleep(Duration::from_millis(2));
    let second = run(p)?;
    measure::perturb_memory(0);
    let masked = p.differing(&first, &second);
    if masked.is_empty() {
        return Ok(vec![]);
    }
    let what = first.iter().zip(&second).find_map(|(a, b)| p.difference(a, b));
    let count = masked.len();
    let learned = Learned { masked, ..p.learned.clone() };
    p.learn(learned);
    let what = what.unwrap_or_default();
    Ok(vec![format!("two equal runs differ in {count} variables: {what}, in the second run")])
}

pub(super) fn reset(p: &Probe) -> Tested {
    p.comparable()?;
    let n = p.steps();
    let mut fresh = p.ready()?;
    let mut expected = vec![p.observe(&mut fresh)?];
    expected.extend(p.run(&mut fresh, 0, n)?);
    fresh.free();
    // With other parameters if the FMU takes them, so that these must be restored too.
    let mut instance = p.instantiate()?;
    if detour(p, &mut instance).is_err() {
        instance.free();
        instance = p.ready()?;
        p.run(&mut instance, 0, n / 2)?;
    }
    instance.reset()?;
    p.enter(&mut instance)?;
    instance.exit_initialization()?;
    let mut again = vec![p.observe(&mut instance)?];
    again.extend(p.run(&mut instance, 0, n)?);
    let what = p.difference(&expected[0], &again[0]).map(|what| format!("{what} right after initialisation"));
    let what = what.or_else(|| p.difference_of_runs(&expected[1..], &again[1..], 0));
    Ok(what.map(|what| format!("a run after fmi2Reset is not that of a new instance: {what}")).into_iter().collect())
}

fn detour(p: &Probe, instance: &mut Instance) -> Result<(), HostError> {
    for v in p.d.variables.iter().filter(|v| v.causality == Causality::Parameter) {
        if let Some(value) = settable_real(p, v) {
            instance.set_real(&[v.value_reference], &[value])?;
        } else if let Some(Value::Boolean(value)) = v.start
            && v.variability == Variability::Tunable
        {
            instance.set_boolean(&[v.value_reference], &[!value])?;
        }
    }
    p.enter(instance)?;
    instance.exit_initialization()?;
    p.run(instance, 0, p.steps() / 2).map(|_| ())
}

pub(super) fn independent(p: &Probe) -> Tested {
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
    let what = p.difference_of_runs(&expected, &found, 0);
    Ok(what.map(|what| format!("another instance in the same process changes this one: {what}")).into_iter().collect())
}

/// Instances that run at the same time.
const THREADS: usize = 4;

pub(super) fn threads(p: &Probe) -> Tested {
    if !independent(p)?.is_empty() {
        return not_tested("instances affect each other on one thread already");
    }
    let n = p.steps();
    let mut alone = p.ready()?;
    let expected = p.run(&mut alone, 0, n)?;
    alone.free();
    let mut problems = Vec::new();
    let together = std::sync::Barrier::new(THREADS);
    let results: Vec<Result<Option<String>, HostError>> = std::thread::scope(|scope| {
        let many = || {
            together.wait();
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

pub(super) fn handover(p: &Probe) -> Tested {
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

pub(super) fn unload(setup: &Setup) -> Tested {
    let p = setup.probe()?;
    let mut instance = p.ready()?;
    p.run(&mut instance, 0, 2)?;
    instance.terminate()?;
    instance.free();
    drop(p);
    Ok(vec![])
}

pub(super) fn null_component(p: &Probe) -> Tested {
    abuse::null_component(&p.binary);
    Ok(vec![])
}
