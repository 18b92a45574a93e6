//! Side effects of an FMU: on the process, on its host's memory, on the log.

use std::collections::BTreeSet;

use super::super::host::abuse;
use super::super::host::{HostError, InstanceOptions, LogMessage, Status};
use super::measure;
use super::probe::{Probe, Tested, not_applicable};
use super::{Instance, Setup};
use std::sync::Arc;

/// A life cycle of the FMU, from loading to freeing.
fn life(setup: &Setup) -> Result<(), HostError> {
    let p = setup.probe()?;
    let mut instance = p.ready()?;
    p.run(&mut instance, 0, 5)?;
    instance.terminate()?;
    instance.free();
    // Freed, but not unloaded: what its handlers point to must stay.
    std::mem::forget(p);
    Ok(())
}

pub(in super::super) fn directory(setup: &Setup) -> Tested {
    let before = std::env::current_dir().ok();
    life(setup)?;
    let after = std::env::current_dir().ok();
    let show = |d: Option<std::path::PathBuf>| d.map_or("one that is gone".to_owned(), |d| d.display().to_string());
    Ok(if before == after { vec![] } else { vec![format!("the working directory is now {}", show(after))] })
}

pub(in super::super) fn rounding(setup: &Setup) -> Tested {
    let before = measure::floating_point();
    life(setup)?;
    let after = measure::floating_point();
    if before == after {
        return Ok(vec![]);
    }
    Ok(vec![format!(
        "the floating-point environment is changed: rounding {:#x} to {:#x}, control register {:#06x} to {:#06x}",
        before.0, after.0, before.1, after.1
    )])
}

/// The rule is tested by the parent process, which holds this one's standard output.
pub(in super::super) fn stdout(setup: &Setup) -> Tested {
    life(setup)?;
    Ok(vec![])
}

pub(in super::super) fn signals(setup: &Setup) -> Tested {
    let before = measure::signal_handlers();
    life(setup)?;
    let changed: Vec<String> = before
        .iter()
        .zip(measure::signal_handlers())
        .filter(|(a, b)| **a != *b)
        .map(|((signal, _), _)| signal.to_string())
        .collect();
    Ok(if changed.is_empty() {
        vec![]
    } else {
        vec![format!("handlers of the signals {} are changed", changed.join(", "))]
    })
}

pub(in super::super) fn process(setup: &Setup) -> Tested {
    let before = measure::process();
    life(setup)?;
    let changed = before.into_iter().zip(measure::process()).filter(|(a, b)| a.1 != b.1);
    Ok(changed.map(|((what, before), (_, after))| format!("{what}: {after} instead of {before}")).collect())
}

pub(in super::super) fn environment(setup: &Setup) -> Tested {
    let read = || -> BTreeSet<_> { std::env::vars_os().collect() };
    let before = read();
    life(setup)?;
    let after = read();
    let names: BTreeSet<String> =
        before.symmetric_difference(&after).map(|(name, _)| name.to_string_lossy().into_owned()).collect();
    let names: Vec<String> = names.into_iter().collect();
    Ok(if names.is_empty() { vec![] } else { vec![format!("changed environment variables: {}", names.join(", "))] })
}

pub(in super::super) fn locale(setup: &Setup) -> Tested {
    let before = measure::numeric_locale();
    life(setup)?;
    let after = measure::numeric_locale();
    Ok(if before == after {
        vec![]
    } else {
        vec![format!("the locale of numbers is now {after:?} instead of {before:?}")]
    })
}

pub(in super::super) fn files(setup: &Setup) -> Tested {
    let list = || -> BTreeSet<String> {
        let entries = std::fs::read_dir(&setup.workplace).into_iter().flatten().flatten();
        entries.map(|e| e.file_name().to_string_lossy().into_owned()).collect()
    };
    let before = list();
    life(setup)?;
    let new: Vec<String> = list().difference(&before).cloned().collect();
    Ok(if new.is_empty() { vec![] } else { vec![format!("written to the working directory: {}", new.join(", "))] })
}

fn logging(p: &Probe) -> Result<Instance, HostError> {
    let options = InstanceOptions { logging: true, ..p.options() };
    Instance::new(Arc::clone(&p.binary), None, &options)
}

pub(in super::super) fn callbacks(p: &Probe) -> Tested {
    let mut instance = logging(p)?;
    instance.poison();
    let before = abuse::poison_hits();
    p.enter(&mut instance)?;
    instance.exit_initialization()?;
    p.run(&mut instance, 0, 5)?;
    instance.terminate()?;
    let mut problems = Vec::new();
    let is_damaged = |m: &&LogMessage| m.instance.starts_with('#');
    if instance.take_log().iter().any(|m| is_damaged(&m)) {
        problems.push("the FMU keeps the pointer to the instance name instead of a copy".into());
    }
    instance.free();
    let hits = abuse::poison_hits() - before;
    if hits > 0 {
        problems.push(format!(
            "the FMU keeps the pointer to the callbacks structure: {hits} calls went through it after it was overwritten"
        ));
    }
    Ok(problems)
}

pub(in super::super) fn allocation(p: &Probe) -> Tested {
    abuse::fail_allocations(true);
    let instance = p.instantiate();
    if let Ok(mut instance) = instance
        && instance.initialize(p.start, p.stop).is_ok()
    {
        let _ = instance.do_step(p.start, p.step);
    }
    abuse::fail_allocations(false);
    Ok(vec![])
}

pub(in super::super) fn debug_logging(p: &Probe) -> Tested {
    let mut instance = p.instantiate()?;
    let categories: Vec<&str> = p.d.log_categories.iter().map(|c| c.0.as_str()).collect();
    let mut problems = Vec::new();
    if let Err(error) = instance.set_debug_logging(true, &categories) {
        problems.push(format!("switching the declared log categories on: {error}"));
    } else if let Err(error) = instance.set_debug_logging(false, &[]) {
        problems.push(format!("switching logging off: {error}"));
    }
    Ok(problems)
}

/// Debug logging that is off, by `fmi2Instantiate` (section 2.1.5) or by the last `fmi2SetDebugLogging`. Messages that go
/// with fmi2Warning and worse are due all the same: "the function logger was called by the model" (section 2.1.3).
pub(in super::super) fn logging_off(p: &Probe) -> Tested {
    let ways = [
        (false, "made with loggingOn = fmi2False"),
        (true, "whose debug logging fmi2SetDebugLogging has switched off"),
    ];
    for (on, how) in ways {
        if on && p.interface().only_once {
            break;
        }
        let options = InstanceOptions { logging: on, ..p.options() };
        let mut instance = Instance::new(Arc::clone(&p.binary), None, &options)?;
        // That this succeeds is tested by another rule.
        if on && instance.set_debug_logging(false, &[]).is_err() {
            break;
        }
        if on {
            let _ = instance.take_log();
        }
        p.enter(&mut instance)?;
        instance.exit_initialization()?;
        p.run(&mut instance, 0, 5)?;
        instance.terminate()?;
        let log = instance.take_log();
        let mut idle = log.iter().filter(|m| m.status == Status::Ok);
        if let Some(first) = idle.next() {
            let (text, count) = (first.message.chars().take(80).collect::<String>(), 1 + idle.count());
            let category = &first.category;
            // An FMU that ignores loggingOn fails in both ways.
            return Ok(vec![format!(
                "an instance {how} logs all the same: {count} messages with fmi2OK, first {text:?} of {category:?}"
            )]);
        }
    }
    Ok(vec![])
}

pub(in super::super) fn log_categories(p: &Probe) -> Tested {
    let declared: BTreeSet<&str> = p.d.log_categories.iter().map(|c| c.0.as_str()).collect();
    if declared.is_empty() {
        return not_applicable("no log categories are declared");
    }
    let mut instance = logging(p)?;
    p.enter(&mut instance)?;
    instance.exit_initialization()?;
    p.run(&mut instance, 0, 5)?;
    instance.terminate()?;
    let used: BTreeSet<String> = instance.take_log().into_iter().map(|m| m.category).collect();
    let unknown: Vec<&String> = used.iter().filter(|c| !c.is_empty() && !declared.contains(c.as_str())).collect();
    Ok(if unknown.is_empty() { vec![] } else { vec![format!("log categories in use but not declared: {unknown:?}")] })
}

/// Categories of the messages with fmi2OK of a short run whose debug logging was switched on by `on`.
fn logged(p: &Probe, options: &InstanceOptions, on: Option<&[&str]>) -> Result<BTreeSet<String>, HostError> {
    let mut instance = Instance::new(Arc::clone(&p.binary), None, options)?;
    if let Some(categories) = on {
        instance.set_debug_logging(true, categories)?;
    }
    // What is logged while the instance is made comes before any choice.
    let _ = instance.take_log();
    p.enter(&mut instance)?;
    instance.exit_initialization()?;
    p.run(&mut instance, 0, 5)?;
    instance.terminate()?;
    let idle = instance.take_log().into_iter().filter(|m| m.status == Status::Ok);
    Ok(idle.map(|m| m.category).filter(|category| !category.is_empty()).collect())
}

/// "If loggingOn = fmi2True and nCategories = 0, then all debug messages shall be output. If loggingOn = fmi2True and
/// nCategories > 0, then only debug messages according to the categories argument shall be printed via the logger function"
/// (section 2.1.5). A debug message is here one with fmi2OK: what is logged with fmi2Warning and worse is due whatever was
/// chosen. Which categories loggingOn of fmi2Instantiate lets through is the vendor's choice: they are some of all.
pub(in super::super) fn log_chosen(p: &Probe) -> Tested {
    /// Each category takes an instance.
    const MOST: usize = 8;
    if p.interface().only_once {
        return not_applicable("canBeInstantiatedOnlyOncePerProcess is true");
    }
    // Messages while debug logging is off, and undeclared categories, are reported by other rules.
    let off = logged(p, &p.options(), None)?;
    let on = logged(p, &InstanceOptions { logging: true, ..p.options() }, None)?;
    let all = logged(p, &p.options(), Some(&[]))?;
    let missing: Vec<&String> = on.difference(&all).collect();
    let mut problems = Vec::new();
    if !missing.is_empty() {
        problems.push(format!(
            "a run made with loggingOn = fmi2True logs messages with fmi2OK of the categories {missing:?}, one after fmi2SetDebugLogging(fmi2True) with nCategories = 0, which asks for all debug messages, logs none of them"
        ));
    }
    let declared: BTreeSet<&String> = p.d.log_categories.iter().map(|c| &c.0).collect();
    for category in declared.iter().take(MOST) {
        let others = logged(p, &p.options(), Some(&[category]))?;
        let other = |name: &&String| name != category && declared.contains(name) && !off.contains(*name);
        let others: Vec<&String> = others.iter().filter(other).collect();
        if !others.is_empty() {
            problems.push(format!(
                "after fmi2SetDebugLogging(fmi2True) of the category {category:?} alone, messages with fmi2OK of {others:?} are logged as well"
            ));
            break;
        }
    }
    Ok(problems)
}

/// "None, some or all allowed values for categories are defined in the modelDescription.xml file" (section 2.1.5): another
/// one may be taken or refused, and is survived.
pub(in super::super) fn log_unknown(p: &Probe) -> Tested {
    let mut instance = p.instantiate()?;
    // The FMU may refuse it; an instance that has returned fmi2Error may only be freed.
    let taken = instance.set_debug_logging(true, &["noSuchCategory"]).is_ok();
    if taken {
        p.enter(&mut instance)?;
        instance.exit_initialization()?;
        p.run(&mut instance, 0, 3)?;
        instance.terminate()?;
    }
    instance.free();
    Ok(vec![])
}
