//! Partial derivatives and dependencies against perturbation (FMI 2.0.4, sections 2.1.9 and 2.2.8).

use super::super::description::{BaseType, Causality, Description, Initial, Unknown, Value, Variable};
use super::super::host::{HostError, Instance};
use super::probe::{Probe, Stop, Tested, not_applicable, not_tested};

/// Most unknowns and knowns that are tested against each other.
const MOST: usize = 40;

fn start(v: &Variable) -> f64 {
    match v.start {
        Some(Value::Real(x)) if x.is_finite() => x,
        _ => 0.0,
    }
}

/// A difference to perturb by, away from the nearer limit.
fn delta(d: &Description, v: &Variable, at: f64) -> f64 {
    let r = d.resolved(v);
    let size = 1e-4 * at.abs().max(r.nominal.filter(|n| n.is_finite()).unwrap_or(1.0));
    let (low, high) = (r.min.unwrap_or(f64::NEG_INFINITY), r.max.unwrap_or(f64::INFINITY));
    if at + size <= high || at - size < low { size } else { -size }
}

fn real<'a>(d: &'a Description, unknowns: &'a [Unknown]) -> impl Iterator<Item = (&'a Unknown, &'a Variable)> {
    unknowns.iter().filter_map(|u| Some((u, d.by_index(u.index)?))).filter(|(_, v)| v.base() == BaseType::Real)
}

/// Real unknowns at communication points: outputs and state derivatives.
fn unknowns(d: &Description) -> Vec<(&Unknown, &Variable)> {
    let mut all: Vec<_> = real(d, &d.structure.outputs).chain(real(d, &d.structure.derivatives)).collect();
    all.dedup_by_key(|(u, _)| u.index);
    all.truncate(MOST);
    all
}

/// Knowns that can be perturbed: Real inputs, and states with an exact start in initialisation mode.
fn knowns(d: &Description, states: bool) -> Vec<&Variable> {
    let is_state = |v: &Variable| {
        states
            && v.initial() == Some(Initial::Exact)
            && d.structure.derivatives.iter().any(|u| {
                d.by_index(u.index)
                    .and_then(|x| x.derivative)
                    .and_then(|i| d.by_index(i))
                    .is_some_and(|x| x.name == v.name)
            })
    };
    let kept = |v: &&Variable| v.base() == BaseType::Real && (v.causality == Causality::Input || is_state(v));
    d.variables.iter().filter(kept).take(MOST).collect()
}

/// Central difference quotients of the unknowns by one known, at two step widths; `None` where they disagree, as at a
/// kink or within noise.
fn quotients(
    p: &Probe,
    instance: &mut Instance,
    known: &Variable,
    unknowns: &[u32],
) -> Result<Vec<Option<f64>>, HostError> {
    let r = [known.value_reference];
    let at = instance.get_real(&r)?[0];
    let mut at_width = |width: f64| -> Result<Vec<f64>, HostError> {
        instance.set_real(&r, &[at + width])?;
        let above = instance.get_real(unknowns)?;
        instance.set_real(&r, &[at - width])?;
        let below = instance.get_real(unknowns)?;
        instance.set_real(&r, &[at])?;
        Ok(above.iter().zip(&below).map(|(a, b)| (a - b) / (2.0 * width)).collect())
    };
    let width = delta(&p.d, known, at);
    let (wide, narrow) = (at_width(width)?, at_width(0.25 * width)?);
    let agree = |a: f64, b: f64| (a - b).abs() <= 1e-3 * a.abs().max(b.abs()) + 1e-9;
    Ok(wide.into_iter().zip(narrow).map(|(a, b)| agree(a, b).then_some(b)).collect())
}

pub(super) fn directional(p: &Probe) -> Tested {
    if !p.interface().provides_directional_derivative {
        return not_applicable("providesDirectionalDerivative is false");
    }
    let unknowns = unknowns(&p.d);
    let references: Vec<u32> = unknowns.iter().map(|(_, v)| v.value_reference).collect();
    if references.is_empty() {
        return not_applicable("there is no Real output or derivative");
    }
    let mut problems = Vec::new();
    let mut tested = 0;
    let mut moved = false;
    let mut silent: Vec<String> = Vec::new();
    for initializing in [true, false] {
        let mut instance = if initializing { p.initializing()? } else { p.ready()? };
        if !initializing {
            p.run(&mut instance, 0, 2)?;
        }
        for known in knowns(&p.d, initializing) {
            let quotients = match quotients(p, &mut instance, known, &references) {
                Ok(quotients) => quotients,
                // Not every FMU lets a state be set; a fresh instance for the next.
                Err(_) => {
                    instance = if initializing { p.initializing()? } else { p.ready()? };
                    continue;
                }
            };
            let given = match instance.directional_derivative(&references, &[known.value_reference], &[1.0]) {
                Ok(given) => given,
                Err(error) if initializing => {
                    silent.push(error.to_string());
                    instance = p.initializing()?;
                    continue;
                }
                Err(error) => return Err(Stop::Host(error)),
            };
            for (((_, unknown), quotient), given) in unknowns.iter().zip(quotients).zip(given) {
                let Some(quotient) = quotient else { continue };
                let scale = quotient.abs().max(given.abs());
                moved |= quotient != 0.0;
                tested += 1;
                // What does not move may be computed by fmi2DoStep alone.
                if quotient == 0.0 && given != 0.0 && given.is_finite() {
                    continue;
                }
                let error = (quotient - given).abs();
                if error.is_nan() || error > 5e-3 * scale + 1e-7 {
                    problems.push(format!(
                        "the derivative of \"{}\" by \"{}\" is {given}, but a perturbation gives {quotient}",
                        unknown.name, known.name
                    ));
                }
            }
        }
        if !problems.is_empty() {
            break;
        }
    }
    if problems.is_empty()
        && !moved
        && let Some(found) = after_a_step(p, &unknowns)?
    {
        return Ok(found);
    }
    if problems.is_empty() && (tested == 0 || !moved) {
        return not_tested("no output answers to a perturbed input at a communication point");
    }
    Ok(problems)
}

/// For an FMU that computes its outputs in `fmi2DoStep` alone: the derivatives by the inputs against the difference that
/// a perturbed input makes within a thousandth of a step. `None` when that shows nothing.
fn after_a_step(p: &Probe, unknowns: &[(&Unknown, &Variable)]) -> Result<Option<Vec<String>>, Stop> {
    let references: Vec<u32> = unknowns.iter().map(|(_, v)| v.value_reference).collect();
    let Ok(base) = responses(p, &references, None) else { return Ok(None) };
    let mut found = None;
    for (order, input) in p.inputs().enumerate().filter(|(_, v)| v.base() == BaseType::Real).take(MOST) {
        let (value, changed) = perturbed(p, input, order);
        let Ok(rows) = responses(p, &references, Some((input.value_reference, changed))) else { continue };
        let mut instance = p.ready()?;
        p.run(&mut instance, 0, 1)?;
        p.drive(&mut instance, p.time(1))?;
        let given = instance.directional_derivative(&references, &[input.value_reference], &[1.0])?;
        for (at, (_, unknown)) in unknowns.iter().enumerate() {
            let quotient = (rows[1][at] - base[1][at]) / (changed - value);
            if quotient == 0.0 || !quotient.is_finite() {
                continue;
            }
            let problems = found.get_or_insert_with(Vec::new);
            let error = (quotient - given[at]).abs();
            // What a thousandth of a step adds through the states is well below this.
            if error.is_nan() || error > 0.05 * quotient.abs().max(given[at].abs()) {
                problems.push(format!(
                    "the derivative of \"{}\" by \"{}\" is {}, but a perturbation gives {quotient}",
                    unknown.name, input.name, given[at]
                ));
            }
        }
    }
    Ok(found)
}

/// The value that an input has at the first communication point after the start, and one next to it within its limits.
fn perturbed(p: &Probe, input: &Variable, order: usize) -> (f64, f64) {
    let value = if p.learned.stimulus { p.input(input, order, p.time(1)) } else { start(input) };
    let r = p.d.resolved(input);
    let (low, high) = (r.min.unwrap_or(f64::NEG_INFINITY), r.max.unwrap_or(f64::INFINITY));
    (value, (value + 100.0 * delta(&p.d, input, value)).clamp(low.min(high), high))
}

/// Values of the unknowns with one input perturbed: at once, after a thousandth of a step, and after a step.
fn responses(p: &Probe, references: &[u32], change: Option<(u32, f64)>) -> Result<[Vec<f64>; 3], HostError> {
    let mut rows: [Vec<f64>; 3] = Default::default();
    for (row, fraction) in rows.iter_mut().zip([0.0, 1e-3, 1.0]) {
        let mut instance = p.ready()?;
        p.run(&mut instance, 0, 1)?;
        p.drive(&mut instance, p.time(1))?;
        if let Some((reference, value)) = change {
            instance.set_real(&[reference], &[value])?;
        }
        if fraction > 0.0 {
            instance.do_step(p.time(1), fraction * p.step)?;
        }
        *row = instance.get_real(references)?;
    }
    Ok(rows)
}

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

pub(super) fn dependencies(p: &Probe) -> Tested {
    let outputs = declared(p, &p.d, &p.d.structure.outputs);
    let initial = declared(p, &p.d, &p.d.structure.initial_unknowns);
    if outputs.is_empty() && initial.is_empty() {
        return not_applicable("no Real output or initial unknown has declared dependencies");
    }
    super::steps::size_counts(p)?;
    let mut problems = at_initialisation(p, &initial, |_, v| {
        v.causality == Causality::Input || v.initial() == Some(Initial::Exact) && super::probe::settable(v)
    })?;
    problems.extend(at_initialisation(p, &outputs, |d, v| {
        v.causality == Causality::Input || knowns(d, true).iter().any(|k| k.name == v.name)
    })?);
    if problems.is_empty() {
        problems = at_steps(p, &outputs)?;
    }
    problems.sort();
    problems.dedup();
    Ok(problems)
}

/// Perturbs knowns in initialisation mode, where the unknowns answer at once if at all.
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
        let Ok(moved) = attempt(&mut instance) else {
            // Not to be set here; a fresh instance for the next.
            instance = p.initializing()?;
            continue;
        };
        // An FMU that does not come back to where it was shows nothing by moving.
        if instance.get_real(&references)? != base {
            instance = p.initializing()?;
            continue;
        }
        for (((unknown, v), base), moved) in unknowns.iter().zip(&base).zip(moved) {
            let changed = (moved - base).abs() > 1e-12 * base.abs();
            if changed && !lists(&p.d, unknown, known) && v.value_reference != known.value_reference {
                problems.push(left_out(v, known, " at initialisation"));
            }
        }
    }
    Ok(problems)
}

/// Perturbs inputs at a communication point.
fn at_steps(p: &Probe, listed: &[(&Unknown, &Variable)]) -> Tested {
    let mut problems = Vec::new();
    let inputs: Vec<(usize, &Variable)> =
        p.inputs().enumerate().filter(|(_, v)| v.base() == BaseType::Real).take(MOST).collect();
    if listed.is_empty() || inputs.is_empty() {
        return Ok(problems);
    }
    p.affordable(6 * (inputs.len() + 1))?;
    let references: Vec<u32> = listed.iter().map(|(_, v)| v.value_reference).collect();
    let base = match responses(p, &references, None) {
        Ok(base) => base,
        Err(error) => return not_tested(format!("the FMU refuses a thousandth of the step size: {error}")),
    };
    for (order, input) in inputs {
        let (_, changed) = perturbed(p, input, order);
        let Ok(rows) = responses(p, &references, Some((input.value_reference, changed))) else { continue };
        for (at, (unknown, variable)) in listed.iter().enumerate() {
            let [now, soon, later] = [0, 1, 2].map(|row| (rows[row][at] - base[row][at]).abs());
            // An output that answers at once, or as much after a thousandth of a step as after a whole one, depends on
            // the input itself; what comes through the state grows with the time.
            let direct = now > 0.0 || soon > 0.5 * later && soon > 1e-9 * changed.abs();
            if direct && !lists(&p.d, unknown, input) {
                problems.push(left_out(variable, input, " directly"));
            }
        }
    }
    Ok(problems)
}
