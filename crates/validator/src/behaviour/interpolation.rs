//! Derivatives of inputs and outputs to time (FMI 2.0.4, section 4.2.1).

use super::super::description::{BaseType, Causality, Variability, Variable};
use super::super::host::HostError;
use super::probe::{Probe, Snapshot, Stop, Tested, not_applicable, not_tested};

pub(super) fn continuous_inputs(p: &Probe) -> Result<Vec<(usize, &Variable)>, Stop> {
    if !p.interface().can_interpolate_inputs {
        return not_applicable("canInterpolateInputs is false");
    }
    let kept = |v: &Variable| v.base() == BaseType::Real && v.variability == Variability::Continuous;
    let inputs: Vec<_> = p.inputs().enumerate().filter(|(_, v)| kept(v)).collect();
    if inputs.is_empty() { not_applicable("there is no continuous Real input") } else { Ok(inputs) }
}

/// The value of an input where the tested step begins, and a change of it that stays within its bounds; None where there is no such.
pub(super) fn change(p: &Probe, v: &Variable, order: usize) -> Option<(f64, f64)> {
    let r = p.d.resolved(v);
    let (low, high) = (r.min.unwrap_or(f64::NEG_INFINITY), r.max.unwrap_or(f64::INFINITY));
    let value = if p.learned.stimulus { p.input(v, order, p.time(2)) } else { 0.0 };
    let size = 0.1 * r.nominal.filter(|n| n.is_finite()).unwrap_or(1.0).max(value.abs()).min((high - low).abs());
    let size = if value + size > high { -size } else { size };
    (value + size >= low).then_some((value, size))
}

/// "Calling fmi2SetRealInputDerivatives has an effect" (canInterpolateInputs, section 4.3.1): the
/// slope moves the input so far that the result of a step responds to it.
pub(in super::super) fn effect(p: &Probe) -> Tested {
    let inputs = continuous_inputs(p)?;
    let stepped = |change: Option<(&Variable, f64)>, slope: Option<(&Variable, f64)>| -> Result<Snapshot, HostError> {
        let mut instance = p.ready()?;
        p.run(&mut instance, 0, 2)?;
        p.drive(&mut instance, p.time(2))?;
        if let Some((v, value)) = change {
            instance.set_real(&[v.value_reference], &[value])?;
        }
        if let Some((v, slope)) = slope {
            instance.set_input_derivatives(&[v.value_reference], &[1], &[slope])?;
        }
        instance.do_step(p.time(2), p.step)?;
        p.observe(&mut instance)
    };
    let reference = [stepped(None, None)?];
    let (mut silent, mut responded) = (Vec::new(), false);
    for (order, v) in inputs.into_iter().take(10) {
        let Some((value, size)) = change(p, v, order) else { continue };
        // The input itself and direct feedthrough left out, the other variables must respond.
        let Ok(moved) = stepped(Some((v, value + size)), None) else { continue };
        if !p.responds(&reference, &[moved], &[v.value_reference]) {
            continue;
        }
        let sloped = stepped(None, Some((v, 2.0 * size / p.step)))?;
        match p.responds(&reference, &[sloped], &[v.value_reference]) {
            true => responded = true,
            false => silent.push(v.name.as_str()),
        }
    }
    match (responded, silent.first()) {
        (false, Some(name)) => Ok(vec![format!(
            "a slope of the input \"{name}\" set with fmi2SetRealInputDerivatives changes nothing, though its value does and \
             canInterpolateInputs is true"
        )]),
        (true, _) => Ok(vec![]),
        (false, None) => not_tested("nothing answers to an input within a step"),
    }
}

pub(in super::super) fn input_derivatives(p: &Probe) -> Tested {
    let inputs: Vec<u32> = continuous_inputs(p)?.into_iter().map(|(_, v)| v.value_reference).collect();
    let mut instance = p.ready()?;
    p.drive(&mut instance, p.start)?;
    instance.set_input_derivatives(&inputs, &vec![1; inputs.len()], &vec![0.0; inputs.len()])?;
    instance.do_step(p.start, p.step)?;
    let flat = p.observe(&mut instance)?;
    instance.free();
    // A slope of zero is what happens without derivatives.
    let mut reference = p.ready()?;
    p.drive(&mut reference, p.start)?;
    reference.do_step(p.start, p.step)?;
    let what = p.difference(&p.observe(&mut reference)?, &flat);
    Ok(what.map(|what| format!("input derivatives of 0 change the step: {what}")).into_iter().collect())
}

pub(in super::super) fn output_derivatives(p: &Probe) -> Tested {
    let order = p.interface().max_output_derivative_order;
    if order == 0 {
        return not_applicable("maxOutputDerivativeOrder is 0");
    }
    let kept = |v: &&Variable| {
        v.base() == BaseType::Real && v.causality == Causality::Output && v.variability == Variability::Continuous
    };
    let outputs: Vec<&Variable> = p.d.variables.iter().filter(kept).collect();
    if outputs.is_empty() {
        return not_applicable("there is no continuous Real output");
    }
    super::step_size::size_counts(p)?;
    let mut instance = p.ready()?;
    p.run(&mut instance, 0, 3)?;
    let references: Vec<u32> = outputs.iter().map(|v| v.value_reference).collect();
    let values = instance.get_output_derivatives(&references, &vec![1; references.len()])?;
    let bad = outputs.iter().zip(values).filter(|(_, value)| !value.is_finite());
    let bad: Vec<String> = bad.map(|(v, value)| format!("the first derivative of \"{}\" is {value}", v.name)).collect();
    if !bad.is_empty() {
        return Ok(bad);
    }
    drop(instance);
    slopes(p, &outputs, &references)
}

/// First derivatives of outputs against what they move by in whole steps, with constant inputs.
fn slopes(p: &Probe, outputs: &[&Variable], references: &[u32]) -> Tested {
    let orders = vec![1; references.len()];
    let mut instance = p.instantiate()?;
    instance.initialize(p.start, None)?;
    let mut rows = Vec::new();
    for k in 0..17 {
        instance.do_step(p.time(k), p.step)?;
        let values = instance.get_real(references)?;
        rows.push((values, instance.get_output_derivatives(references, &orders)?));
    }
    let mut problems = Vec::new();
    for (at, v) in outputs.iter().enumerate() {
        let (mut clear, mut wrong, mut example) = (0, 0, String::new());
        for pair in rows.windows(2) {
            let (given, later) = (pair[0].1[at], pair[1].1[at]);
            let slope = (pair[1].0[at] - pair[0].0[at]) / p.step;
            let mean = 0.5 * (given + later);
            // Only where it is steady over the step, and moves more than rounding.
            let steady = (later - given).abs() <= 0.2 * mean.abs() || given == 0.0 && later == 0.0;
            if steady && (slope * p.step).abs() > 1e-6 * pair[1].0[at].abs().max(1e-9) {
                clear += 1;
                if (slope - mean).abs() > 0.3 * slope.abs() {
                    wrong += 1;
                    example = format!("is {mean} while it moves at {slope}");
                }
            }
        }
        if clear >= 5 && wrong == clear {
            problems.push(format!("the first derivative of \"{}\" {example}", v.name));
        }
    }
    Ok(problems)
}
