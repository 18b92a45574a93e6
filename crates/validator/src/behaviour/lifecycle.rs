//! Loading, making, freeing and resetting instances (FMI 2.0.4, sections 2.1.4 to 2.1.6).

use std::sync::Arc;
use std::time::{Duration, Instant};

use super::super::description::{BaseType, Causality, Fmi, Value, Variability, Variable};
use super::super::host::abi::{CALLS, Call};
use super::super::host::{Binary, Instance, InstanceOptions, Status, abuse, resource_location};
use super::measure;
use super::probe::{Learned, Probe, Snapshot, Tested, not_applicable};
use super::{Setup, settable_real, settings, values};
use crate::host::HostError;

pub(in super::super) fn load(setup: &Setup) -> Tested {
    match Binary::load(&setup.binary_path, true) {
        Ok(binary) => {
            // Unloading is a rule of its own.
            std::mem::forget(binary);
            Ok(vec![])
        }
        Err(error) => Ok(vec![error.to_string()]),
    }
}

/// Functions that a host needs, whatever the capability flags declare.
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

/// The same of FMI 3.0.
const CORE3: [Call; 21] = [
    Call::get_version3,
    Call::set_debug_logging3,
    Call::instantiate3,
    Call::free_instance3,
    Call::enter_initialization3,
    Call::exit_initialization3,
    Call::terminate3,
    Call::reset3,
    Call::get3_float32,
    Call::get3_float64,
    Call::get3_int32,
    Call::get3_int64,
    Call::get3_boolean,
    Call::get3_string,
    Call::set3_float32,
    Call::set3_float64,
    Call::set3_int32,
    Call::set3_int64,
    Call::set3_boolean,
    Call::set3_string,
    Call::do_step3,
];

/// Whether a function is of a version of FMI.
fn is_of(function: &str, fmi: Fmi) -> bool {
    function.starts_with(if fmi == Fmi::Three { "fmi3" } else { "fmi2" })
}

fn needed(p: &Probe) -> Vec<&'static str> {
    let i = p.interface();
    if p.d.fmi == Fmi::Three {
        let mut calls = CORE3.to_vec();
        for (flag, more) in [
            (i.can_get_and_set_state, &[Call::get_state3, Call::set_state3, Call::free_state3][..]),
            (i.can_serialize_state, &[Call::serialized_size3, Call::serialize3, Call::deserialize3]),
            (i.provides_directional_derivative, &[Call::directional_derivative3]),
            (i.max_output_derivative_order > 0, &[Call::get_output_derivatives3]),
            (i.has_event_mode, &[Call::enter_event_mode, Call::enter_step_mode, Call::update_discrete_states]),
        ] {
            if flag {
                calls.extend_from_slice(more);
            }
        }
        return calls.into_iter().map(|c| CALLS[c as usize]).collect();
    }
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

/// Functions of FMI 3.0 for other interfaces, which importers look up all the same (FMPy 0.3.32 does).
const OTHERS3: [&str; 13] = [
    "fmi3InstantiateModelExchange",
    "fmi3InstantiateScheduledExecution",
    "fmi3EnterContinuousTimeMode",
    "fmi3CompletedIntegratorStep",
    "fmi3SetTime",
    "fmi3SetContinuousStates",
    "fmi3GetContinuousStateDerivatives",
    "fmi3GetEventIndicators",
    "fmi3GetContinuousStates",
    "fmi3GetNominalsOfContinuousStates",
    "fmi3GetNumberOfEventIndicators",
    "fmi3GetNumberOfContinuousStates",
    "fmi3ActivateModelPartition",
];

pub(in super::super) fn symbols(p: &Probe) -> Tested {
    Ok(needed(p).into_iter().filter(|s| !p.binary.exports(s)).map(|s| format!("{s} is not exported")).collect())
}

pub(in super::super) fn all_symbols(p: &Probe) -> Tested {
    let needed = needed(p);
    let others: &[&str] = if p.d.fmi == Fmi::Three { &OTHERS3 } else { &[] };
    let missing: Vec<&str> = CALLS
        .iter()
        .chain(others)
        .filter(|s| is_of(s, p.d.fmi) && !needed.contains(s) && !p.binary.exports(s))
        .copied()
        .collect();
    Ok(if missing.is_empty() { vec![] } else { vec![format!("not exported: {}", missing.join(", "))] })
}

pub(in super::super) fn types_platform(p: &Probe) -> Tested {
    let text = super::super::host::static_text(&p.binary, Call::get_types_platform)?;
    Ok(if text == "default" { vec![] } else { vec![format!("fmi2GetTypesPlatform gives {text:?}, not \"default\"")] })
}

pub(in super::super) fn version(p: &Probe) -> Tested {
    if p.d.fmi == Fmi::Three {
        let text = super::super::host::static_text(&p.binary, Call::get_version3)?;
        return Ok(if text == "3.0" { vec![] } else { vec![format!("fmi3GetVersion gives {text:?}, not \"3.0\"")] });
    }
    let text = super::super::host::static_text(&p.binary, Call::get_version)?;
    Ok(if text == "2.0" { vec![] } else { vec![format!("fmi2GetVersion gives {text:?}, not \"2.0\"")] })
}

pub(in super::super) fn instantiate(p: &Probe) -> Tested {
    p.instantiate()?.free();
    Ok(vec![])
}

pub(in super::super) fn free_null(p: &Probe) -> Tested {
    abuse::free_null(&p.binary, p.d.fmi)?;
    Ok(vec![])
}

pub(in super::super) fn initialise(p: &Probe) -> Tested {
    let mut instance = p.instantiate()?;
    instance.setup_experiment(None, p.start, p.stop)?;
    instance.enter_initialization()?;
    instance.exit_initialization()?;
    Ok(vec![])
}

/// Initialises an instance, the only one; the message where that fails.
fn initialises(p: &Probe, how: &str, tolerance: Option<f64>, stop: Option<f64>) -> Tested {
    let mut instance = p.instantiate()?;
    let begun = instance.setup_experiment(tolerance, p.start, stop);
    let ended = begun.and_then(|()| instance.enter_initialization()).and_then(|()| instance.exit_initialization());
    let message = last_log_message(&instance);
    Ok(ended.err().map(|error| format!("{how} the FMU does not initialise: {error}{message}")).into_iter().collect())
}

/// "stopTimeDefined = fmi2False: no final value of the independent variable is defined" (section 2.1.6).
pub(in super::super) fn setup_endless(p: &Probe) -> Tested {
    initialises(p, "without a stop time", None, None)
}

/// The tolerance of the default experiment, as importers hand it over (section 2.1.6).
pub(in super::super) fn setup_tolerance(p: &Probe) -> Tested {
    match p.d.default_experiment.and_then(|e| e.tolerance).filter(|t| *t > 0.0) {
        Some(tolerance) => initialises(p, "with the tolerance of its default experiment", Some(tolerance), p.stop),
        None => not_applicable("the default experiment has no tolerance"),
    }
}

pub(in super::super) fn step_status(p: &Probe) -> Tested {
    if p.d.fmi == Fmi::Three {
        return super::three::status(p);
    }
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
            // Failing steps are reported by the next rule.
            _ => {}
        }
    }
    Ok(vec![])
}

/// The last log message of the FMU, as the end of a finding; empty where there is none.
pub(super) fn last_log_message(instance: &Instance) -> String {
    instance.take_log().last().map_or(String::new(), |m| format!("; the FMU says: {}", m.message))
}

pub(in super::super) fn terminate(p: &Probe) -> Tested {
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

pub(in super::super) fn guid(p: &Probe) -> Tested {
    let options = InstanceOptions { guid: "{00000000-dead-beef-0000-000000000000}".into(), ..p.options() };
    match Instance::new(Arc::clone(&p.binary), None, &options) {
        Ok(_) => Ok(vec!["fmi2Instantiate accepts a wrong GUID".into()]),
        Err(_) => Ok(vec![]),
    }
}

pub(in super::super) fn resources(p: &Probe) -> Tested {
    let options = InstanceOptions { resources: resource_location("/nowhere/at/all".as_ref(), p.d.fmi), ..p.options() };
    if let Ok(mut instance) = Instance::new(Arc::clone(&p.binary), None, &options)
        && instance.initialize(p.start, p.stop).is_ok()
    {
        let _ = instance.do_step(p.start, p.step);
    }
    Ok(vec![])
}

pub(in super::super) fn determinism(p: &mut Probe) -> Tested {
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
    Ok(changed.map(|(v, (new, again))| {
        format!("\"{}\" is {} instead of {} right after initialisation", v.name, values::show(again), values::show(new))
    }))
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
    let _venture = super::super::host::venture();
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

pub(in super::super) fn unload(setup: &Setup) -> Tested {
    let p = setup.probe()?;
    let mut instance = p.ready()?;
    p.run(&mut instance, 0, 2)?;
    instance.terminate()?;
    instance.free();
    drop(p);
    Ok(vec![])
}

pub(in super::super) fn null_component(p: &Probe) -> Tested {
    abuse::null_component(&p.binary, p.d.fmi);
    Ok(vec![])
}
