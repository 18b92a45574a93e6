//! Loading a binary, making, initialising and freeing its instances (FMI 2.0.4, sections 2.1.4 to 2.1.6).

use std::sync::Arc;
use std::time::{Duration, Instant};

use super::super::description::Fmi;
use super::super::host::abi::Call;
use super::super::host::{Binary, HostError, Instance, InstanceOptions, Status, abuse, resource_location};
use super::probe::{Learned, Probe, Tested, not_applicable};
use super::{Setup, measure};

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
