//! Partial derivatives against perturbation (FMI 2.0.4, section 2.1.9).

use super::super::description::{BaseType, Causality, Description, Initial, Unknown, Value, Variable};
use super::super::host::{HostError, Instance};
use super::probe::{Probe, Stop, Tested, not_applicable, not_tested};

/// Most unknowns and knowns that are tested against each other.
pub(super) const MOST: usize = 40;

pub(super) fn start(v: &Variable) -> f64 {
    match v.start {
        Some(Value::Real(x)) if x.is_finite() => x,
        _ => 0.0,
    }
}

/// A difference to perturb by, away from the nearer limit.
pub(super) fn delta(d: &Description, v: &Variable, at: f64) -> f64 {
    let r = d.resolved(v);
    let size = 1e-4 * at.abs().max(r.nominal.filter(|n| n.is_finite()).unwrap_or(1.0));
    let (low, high) = (r.min.unwrap_or(f64::NEG_INFINITY), r.max.unwrap_or(f64::INFINITY));
    if at + size <= high || at - size < low { size } else { -size }
}

pub(super) fn real<'a>(
    d: &'a Description,
    unknowns: &'a [Unknown],
) -> impl Iterator<Item = (&'a Unknown, &'a Variable)> {
    unknowns.iter().filter_map(|u| Some((u, d.by_index(u.index)?))).filter(|(_, v)| v.base() == BaseType::Real)
}

/// Real unknowns: in initialisation mode those of InitialUnknowns, at communication points outputs and state derivatives
/// (FMI 2.0.4, section 2.2.8). A state that is an output is a known of the one and an unknown of the other.
fn unknowns(d: &Description, initializing: bool) -> Vec<(&Unknown, &Variable)> {
    let s = &d.structure;
    let mut all: Vec<_> = match initializing {
        true => real(d, &s.initial_unknowns).collect(),
        false => real(d, &s.outputs).chain(real(d, &s.derivatives)).collect(),
    };
    all.dedup_by_key(|(u, _)| u.index);
    all.truncate(MOST);
    all
}

/// Knowns that can be perturbed: Real inputs, and states with an exact start in initialisation mode.
pub(super) fn knowns(d: &Description, states: bool) -> Vec<&Variable> {
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
pub(super) fn quotients(
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

pub(in super::super) fn directional(p: &Probe) -> Tested {
    if !p.interface().provides_directional_derivative {
        return not_applicable("providesDirectionalDerivative is false");
    }
    if unknowns(&p.d, false).is_empty() {
        return not_applicable("there is no Real output or derivative");
    }
    let mut problems = Vec::new();
    let mut tested = 0;
    let mut moved = false;
    let mut silent: Vec<String> = Vec::new();
    for initializing in [true, false] {
        let unknowns = unknowns(&p.d, initializing);
        let references: Vec<u32> = unknowns.iter().map(|(_, v)| v.value_reference).collect();
        if references.is_empty() {
            continue;
        }
        let mut instance = if initializing { p.initializing()? } else { p.ready()? };
        if !initializing {
            p.run(&mut instance, 0, 2)?;
        }
        let mut single = Vec::new();
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
            single.push((known.value_reference, given.clone()));
            let values = instance.get_real(&references)?;
            let rows = unknowns.iter().zip(quotients).zip(given).zip(values);
            for ((((_, unknown), quotient), given), value) in rows {
                let Some(quotient) = quotient else { continue };
                // A variable is no function of itself.
                if unknown.value_reference == known.value_reference {
                    continue;
                }
                let scale = quotient.abs().max(given.abs());
                // What an FMU gets by differences of its own is right to the square root of its precision.
                let rounding = 1e-7 * value.abs().max(1.0) / delta(&p.d, known, start(known)).abs().max(1e-4) * 1e-3;
                moved |= quotient != 0.0;
                tested += 1;
                // What does not move may be computed by fmi2DoStep alone.
                if quotient == 0.0 && given != 0.0 && given.is_finite() {
                    continue;
                }
                let error = (quotient - given).abs();
                if error.is_nan() || error > 1e-2 * scale + 1e-7 + rounding {
                    problems.push(format!(
                        "the derivative of \"{}\" by \"{}\" is {given}, but a perturbation gives {quotient}",
                        unknown.name, known.name
                    ));
                }
            }
        }
        if problems.is_empty()
            && let Some((at, sum, given)) = not_the_sum(&mut instance, &references, &single)?
        {
            problems.push(format!(
                "the derivative of \"{}\" in the direction of {} knowns at once is {given}, but {sum} as the sum of those by each of them",
                unknowns[at].1.name,
                single.len()
            ));
        }
        if !problems.is_empty() {
            break;
        }
    }
    if problems.is_empty()
        && !moved
        && let Some(found) = after_a_step(p, &unknowns(&p.d, false))?
    {
        return Ok(found);
    }
    if problems.is_empty() && (tested == 0 || !moved) {
        return not_tested("no output answers to a perturbed input at a communication point");
    }
    Ok(problems)
}

/// A derivative in the direction of several knowns is the sum of those by each (section 2.1.9). The first unknown of which it
/// is not: its place, the sum, and what is given.
fn not_the_sum(
    instance: &mut Instance,
    references: &[u32],
    single: &[(u32, Vec<f64>)],
) -> Result<Option<(usize, f64, f64)>, HostError> {
    if single.len() < 2 {
        return Ok(None);
    }
    let knowns: Vec<u32> = single.iter().map(|(known, _)| *known).collect();
    let seed: Vec<f64> = (0..knowns.len()).map(|k| 1.0 + 0.5 * k as f64).collect();
    let given = instance.directional_derivative(references, &knowns, &seed)?;
    Ok(given.into_iter().enumerate().find_map(|(at, given)| {
        let parts = || single.iter().zip(&seed).map(|((_, column), seed)| seed * column[at]);
        let (sum, size) = (parts().sum::<f64>(), parts().map(f64::abs).sum::<f64>());
        // What an FMU gets by differences of its own is right to the square root of its precision.
        ((given - sum).abs() > 1e-2 * size + 1e-7).then_some((at, sum, given))
    }))
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
pub(super) fn perturbed(p: &Probe, input: &Variable, order: usize) -> (f64, f64) {
    let value = if p.learned.stimulus { p.input(input, order, p.time(1)) } else { start(input) };
    let r = p.d.resolved(input);
    let (low, high) = (r.min.unwrap_or(f64::NEG_INFINITY), r.max.unwrap_or(f64::INFINITY));
    (value, (value + 100.0 * delta(&p.d, input, value)).clamp(low.min(high), high))
}

/// Values of the unknowns with one input perturbed: at once, after a thousandth of a step, and after a step.
pub(super) fn responses(p: &Probe, references: &[u32], change: Option<(u32, f64)>) -> Result<[Vec<f64>; 3], HostError> {
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
