//! Declared dependencies against perturbation (FMI 2.0.4, section 2.2.8).

use super::super::description::{BaseType, Causality, DependencyKind, Description, Initial, Unknown, Variable};
use super::super::host::{HostError, Instance};
use super::partial::{MOST, delta, knowns, perturbed, quotients, real, responses};
use super::probe::{Probe, Stop, Tested, not_applicable, not_tested};

/// Unknowns whose dependencies are declared, with their variables.
fn declared<'a>(p: &Probe, d: &'a Description, unknowns: &'a [Unknown]) -> Vec<(&'a Unknown, &'a Variable)> {
    real(d, unknowns)
        .filter(|(u, v)| u.dependencies.is_some() && !p.learned.masked.contains(&(0, v.value_reference)))
        .take(MOST)
        .collect()
}

fn lists(d: &Description, unknown: &Unknown, known: &Variable) -> bool {
    let same = |v: &Variable| v.base() == BaseType::Real && v.value_reference == known.value_reference;
    unknown.dependencies.iter().flatten().any(|&i| d.by_index(i).is_some_and(same))
}

fn left_out(unknown: &Variable, known: &Variable, how: &str) -> String {
    format!("\"{}\" depends on \"{}\"{how}, which its dependencies leave out", unknown.name, known.name)
}

/// Whether a number has changed by more than the tolerance of an iterative solution.
fn moved(from: f64, to: f64) -> bool {
    (to - from).abs() > 1e-9 * from.abs().max(to.abs()) && (to - from).abs() > 1e-300
}

/// Outputs at a communication point against inputs that their dependencies leave out: at once where `soon` is false,
/// within a thousandth of a step where it is true, for FMUs that compute their outputs in `fmi2DoStep`.
fn against_inputs(p: &Probe, soon: bool) -> Tested {
    let outputs = declared(p, &p.d, &p.d.structure.outputs);
    if outputs.is_empty() {
        return not_applicable("no Real output has declared dependencies");
    }
    super::step_size::size_counts(p)?;
    let inputs: Vec<(usize, &Variable)> =
        p.inputs().enumerate().filter(|(_, v)| v.base() == BaseType::Real).take(MOST).collect();
    if inputs.is_empty() {
        return not_applicable("there is no Real input");
    }
    p.affordable(6 * (inputs.len() + 1))?;
    let references: Vec<u32> = outputs.iter().map(|(_, v)| v.value_reference).collect();
    let base = match responses(p, &references, None) {
        Ok(base) => base,
        Err(HostError::OnlyOnce) => return Err(HostError::OnlyOnce.into()),
        Err(error) => return not_tested(format!("the FMU refuses a thousandth of the step size: {error}")),
    };
    let mut problems = Vec::new();
    for (order, input) in inputs {
        let (_, changed) = perturbed(p, input, order);
        let Ok(rows) = responses(p, &references, Some((input.value_reference, changed))) else { continue };
        for (at, (unknown, variable)) in outputs.iter().enumerate() {
            let now = moved(base[0][at], rows[0][at]);
            let [early, late] = [1, 2].map(|row| (rows[row][at] - base[row][at]).abs());
            // As much after a thousandth of a step as after a whole one: what comes through the state grows with the
            // time, unless the state is fast.
            let within = early > 0.5 * late && early > 1e-9 * changed.abs();
            if (if soon { within && !now } else { now }) && !lists(&p.d, unknown, input) {
                problems.push(left_out(
                    variable,
                    input,
                    if soon { " within a thousandth of a step" } else { " directly" },
                ));
            }
        }
    }
    Ok(problems)
}

pub(in super::super) fn outputs(p: &Probe) -> Tested {
    against_inputs(p, false)
}

pub(in super::super) fn outputs_soon(p: &Probe) -> Tested {
    against_inputs(p, true)
}

/// Unknowns and outputs in initialisation mode, where they respond at once or not at all.
pub(in super::super) fn initial(p: &Probe) -> Tested {
    let outputs = declared(p, &p.d, &p.d.structure.outputs);
    let initial = declared(p, &p.d, &p.d.structure.initial_unknowns);
    if outputs.is_empty() && initial.is_empty() {
        return not_applicable("no Real output or initial unknown has declared dependencies");
    }
    let mut problems = at_initialisation(p, &initial, |_, v| {
        v.causality == Causality::Input || v.initial() == Some(Initial::Exact) && super::probe::settable(v)
    })?;
    problems.extend(at_initialisation(p, &outputs, |d, v| {
        v.causality != Causality::Input && knowns(d, true).iter().any(|k| k.name == v.name)
    })?);
    problems.sort();
    problems.dedup();
    Ok(problems)
}

/// Perturbs knowns in initialisation mode.
fn at_initialisation(
    p: &Probe,
    unknowns: &[(&Unknown, &Variable)],
    is_known: impl Fn(&Description, &Variable) -> bool,
) -> Result<Vec<String>, Stop> {
    let mut problems = Vec::new();
    if unknowns.is_empty() {
        return Ok(problems);
    }
    let references: Vec<u32> = unknowns.iter().map(|(_, v)| v.value_reference).collect();
    let mut instance = p.initializing()?;
    let base = instance.get_real(&references)?;
    for known in p.d.variables.iter().filter(|v| v.base() == BaseType::Real && is_known(&p.d, v)).take(MOST) {
        let r = [known.value_reference];
        let attempt = |instance: &mut Instance| -> Result<Vec<f64>, HostError> {
            let at = instance.get_real(&r)?[0];
            instance.set_real(&r, &[at + delta(&p.d, known, at)])?;
            let moved = instance.get_real(&references)?;
            instance.set_real(&r, &[at])?;
            Ok(moved)
        };
        let Ok(after) = attempt(&mut instance) else {
            // Not to be set here; a fresh instance for the next.
            instance = p.initializing()?;
            continue;
        };
        // Where an FMU does not return to its first value, a change proves nothing.
        if instance.get_real(&references)? != base {
            instance = p.initializing()?;
            continue;
        }
        for (((unknown, v), base), after) in unknowns.iter().zip(&base).zip(after) {
            if moved(*base, after) && !lists(&p.d, unknown, known) && v.value_reference != known.value_reference {
                problems.push(left_out(v, known, " at initialisation"));
            }
        }
    }
    Ok(problems)
}

/// "constant": the partial derivative is the same always. Against inputs, at two values and two times.
pub(in super::super) fn kinds(p: &Probe) -> Tested {
    let mut problems = Vec::new();
    let mut tested = false;
    for (unknown, v) in declared(p, &p.d, &p.d.structure.outputs) {
        let (Some(list), Some(kinds)) = (&unknown.dependencies, &unknown.kinds) else { continue };
        for (&index, _) in list.iter().zip(kinds).filter(|(_, kind)| **kind == DependencyKind::Constant) {
            let Some(known) = p.d.by_index(index).filter(|k| k.causality == Causality::Input) else { continue };
            if known.base() != BaseType::Real {
                continue;
            }
            let r = p.d.resolved(known);
            let (low, high) = (r.min.unwrap_or(f64::NEG_INFINITY), r.max.unwrap_or(f64::INFINITY));
            let mut found = Vec::new();
            for (steps, far) in [(1, 0.0), (1, 1.0), (p.steps().min(8), -0.5)] {
                let mut instance = p.ready()?;
                p.run(&mut instance, 0, steps)?;
                let at = instance.get_real(&[known.value_reference])?[0];
                let there = (at + far * at.abs().max(r.nominal.filter(|n| n.is_finite()).unwrap_or(1.0)))
                    .clamp(low.min(high), high);
                instance.set_real(&[known.value_reference], &[there])?;
                if let Some(Some(quotient)) = quotients(p, &mut instance, known, &[v.value_reference])?.first() {
                    found.push(*quotient);
                }
            }
            tested |= found.len() > 1;
            let (least, most) =
                found.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, m), q| (l.min(*q), m.max(*q)));
            if found.len() > 1 && most - least > 1e-2 * most.abs().max(least.abs()) + 1e-7 {
                problems.push(format!(
                    "the dependency of \"{}\" on \"{}\" is declared constant, but its factor goes from {least} to {most}",
                    v.name, known.name
                ));
            }
        }
    }
    if tested || !problems.is_empty() {
        Ok(problems)
    } else {
        not_applicable("no output depends on a Real input by a constant")
    }
}

/// An output that is another one at another start time depends on the time.
pub(in super::super) fn time(p: &Probe) -> Tested {
    let independent = p.d.variables.iter().position(|v| v.causality == Causality::Independent).map(|i| i as u32 + 1);
    let Some(independent) = independent else {
        return not_applicable("no independent variable is declared, which dependencies could name");
    };
    let silent = |(u, _): &(&Unknown, &Variable)| !u.dependencies.iter().flatten().any(|&i| i == independent);
    let outputs: Vec<_> = declared(p, &p.d, &p.d.structure.outputs).into_iter().filter(silent).collect();
    if outputs.is_empty() {
        return not_applicable("no Real output has dependencies that leave the time out");
    }
    let references: Vec<u32> = outputs.iter().map(|(_, v)| v.value_reference).collect();
    let at = |start: f64| -> Result<Vec<f64>, HostError> {
        let mut instance = p.instantiate()?;
        instance.initialize(start, None)?;
        instance.get_real(&references)
    };
    let (first, later) = (p.start, p.start + 10.0 * p.step);
    let values = at(first)?;
    let Ok(others) = at(later) else { return not_tested(format!("the FMU does not start at {later} s")) };
    Ok(outputs
        .iter()
        .zip(values.iter().zip(&others))
        .filter(|(_, (a, b))| moved(**a, **b))
        .map(|((_, v), (a, b))| {
            format!(
                "\"{}\" is {a} at the start time {first} and {b} at {later}; its dependencies leave the time out",
                v.name
            )
        })
        .collect())
}
