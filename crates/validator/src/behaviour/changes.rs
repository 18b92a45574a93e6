//! Parameters set during the run: tunable ones take effect, fixed and constant ones are refused (FMI 2.0.4, section 4.2.4).

use super::super::description::{Causality, Value, Variability, Variable};
use super::super::host::{HostError, Instance};
use super::probe::{Probe, Snapshot, Tested, not_applicable, not_tested};
use super::settable_real;
use super::values::set;

/// A tunable parameter that acts when it is set before the run acts when it is set during it.
pub(in super::super) fn tunable_effect(p: &Probe) -> Tested {
    let tunable = |v: &&Variable| v.causality == Causality::Parameter && v.variability == Variability::Tunable;
    p.comparable()?;
    let (n, cut) = (p.steps(), p.steps() / 3);
    p.affordable(12 * n)?;
    // Up to the end of the run, which some FMUs set themselves.
    let until_end = |instance: &mut Instance, from: usize| -> Vec<Snapshot> {
        let mut record = Vec::new();
        for k in from..3 * n {
            match p.run(instance, k, k + 1) {
                Ok(mut one) => record.append(&mut one),
                Err(_) => break,
            }
        }
        record
    };
    let mut reference = p.ready()?;
    let expected = until_end(&mut reference, 0);
    reference.free();
    if expected.len() < n {
        return not_tested("the run is too short");
    }
    let (mut problems, mut any) = (Vec::new(), false);
    for v in p.d.variables.iter().filter(tunable).take(20) {
        let Some(value) = other(p, v) else { continue };
        if Some(&value) == v.start.as_ref() {
            continue;
        }
        let _guard = super::super::host::chosen_values();
        let early = || -> Result<_, HostError> {
            let mut instance = p.instantiate()?;
            set(&mut instance, v, &value)?;
            p.enter(&mut instance)?;
            instance.exit_initialization()?;
            p.run(&mut instance, 0, n)
        };
        let late = || -> Result<_, HostError> {
            let mut instance = p.ready()?;
            p.run(&mut instance, 0, cut)?;
            set(&mut instance, v, &value)?;
            Ok(until_end(&mut instance, cut))
        };
        // A value that cannot be set, or fails, is reported by another rule.
        let (early, late) = match (early(), late()) {
            (Err(HostError::OnlyOnce), _) | (_, Err(HostError::OnlyOnce)) => return Err(HostError::OnlyOnce.into()),
            (Ok(early), Ok(late)) => (early, late),
            _ => continue,
        };
        any = true;
        let own = [v.value_reference];
        if p.responds(&expected[..n], &early, &own) && !p.responds(&expected[cut..], &late, &own) {
            problems.push(format!(
                "the tunable parameter \"{}\" set to {} during the run changes nothing; set before it, it does",
                v.name, value
            ));
        }
    }
    if any { Ok(problems) } else { not_applicable("there is no tunable parameter with another value to set") }
}

fn other(p: &Probe, v: &Variable) -> Option<Value> {
    match &v.start {
        Some(Value::Real(_)) => settable_real(p, v).map(Value::Real),
        Some(Value::Boolean(b)) => Some(Value::Boolean(!b)),
        other => other.clone(),
    }
}

pub(in super::super) fn fixed_set(p: &Probe) -> Tested {
    let fixed = |v: &&Variable| {
        matches!(v.causality, Causality::Parameter | Causality::StructuralParameter)
            && v.variability == Variability::Fixed
            || v.variability == Variability::Constant
    };
    let mut any = false;
    let mut accepted = Vec::new();
    for v in p.d.variables.iter().filter(fixed).take(20) {
        let Some(value) = other(p, v) else { continue };
        any = true;
        // A refusal may leave the instance in its error state: a fresh one each time.
        let mut instance = p.ready()?;
        p.run(&mut instance, 0, 1)?;
        if set(&mut instance, v, &value).is_ok() {
            accepted.push(format!("\"{}\"", v.name));
        }
    }
    if !any {
        return not_applicable("there is no fixed or constant variable with a start value");
    }
    let list = accepted.join(", ");
    Ok(if accepted.is_empty() {
        vec![]
    } else {
        vec![format!("accepted during the run, though fixed or constant: {list}")]
    })
}

pub(in super::super) fn tunable_set(p: &Probe) -> Tested {
    let tunable = |v: &&Variable| v.causality == Causality::Parameter && v.variability == Variability::Tunable;
    let mut any = false;
    let mut problems = Vec::new();
    for v in p.d.variables.iter().filter(tunable).take(50) {
        let Some(value) = &v.start else { continue };
        any = true;
        let mut instance = p.ready()?;
        p.run(&mut instance, 0, 1)?;
        if let Err(error) = set(&mut instance, v, value) {
            problems.push(format!("the tunable parameter \"{}\" cannot be set during the run: {error}", v.name));
        }
    }
    if any { Ok(problems) } else { not_applicable("there is no tunable parameter") }
}
