//! The drive's loop of `[controller]` around a machine's model, for `simulate` and `identify`.

use std::path::Path;

use anyhow::{Context, bail};

use super::examined::Part;
use crate::control::UnderControl;
use crate::diagnose::{Model, Record};
use crate::fmu::simulate::{Column, Setting, SimulationResult};
use crate::report::Block;
use crate::report::diagnose::errors_in_the_loop;
use crate::trace::{Machine, Signal, Trace, load};
use crate::variables::{Causality, Model as Kind, Named, Starts, Values, find};

/// A machine's model.
fn model(machine: &Machine) -> Model {
    Model::new(machine.parameters, machine.structure, machine.effects)
}

/// A trace as the loop sees it: what the drive controls, without noise.
fn logged(trace: &Trace) -> Record {
    let channel = |s| trace.get(s).map(<[f64]>::to_vec);
    let channels = [Signal::Theta1, Signal::Omega1, Signal::Theta2, Signal::Omega2].map(channel);
    let torque = channel(Signal::T).unwrap_or_default();
    Record { start: trace.start, ..Record::new(trace.dt, trace.hold, torque, channels) }
}

/// The machine with parameters set by the names that the FMU has for them.
fn with(machine: &Machine, settings: &[Setting]) -> anyhow::Result<Machine> {
    let mut starts = Starts::of(&machine.parameters, machine.structure, &machine.effects, machine.signals.motion);
    for Setting { name, value } in settings {
        let index = find(name).filter(|&i| Named(Kind::Axis, i).variable().causality == Causality::Parameter);
        let index = index.with_context(|| format!("--set {name}: the axis has no such parameter"))?;
        let v = Named(Kind::Axis, index).variable();
        let (min, max) = (v.min.unwrap_or(f64::NEG_INFINITY), v.max.unwrap_or(f64::INFINITY));
        match value.parse::<f64>() {
            Ok(number) if (min..=max).contains(&number) => starts.values[index] = number,
            _ => bail!("--set {name}={value}: it must be a number from {min:?} to {max:?}"),
        }
    }
    let values = Values(starts.values);
    let (parameters, structure) = (values.parameters(), values.structure());
    parameters.check(structure).map_err(|e| anyhow::anyhow!("--set: {e}"))?;
    Ok(Machine { parameters, structure, effects: values.effects(), ..machine.clone() })
}

/// Moves the machine's model along the reference of the input, by the drive of its file.
///
/// # Errors
/// When there is no drive, no reference, or the loop runs away.
pub(super) fn simulate(machine: &Machine, input: &Path, settings: &[Setting]) -> anyhow::Result<SimulationResult> {
    let controller = machine.controller.as_ref().context("--controlled needs a [controller] in the axis file")?;
    let machine = with(machine, settings)?;
    let loaded = load(input, &machine.signals)?;
    loaded.warnings.iter().for_each(|w| eprintln!("warning: {w}"));
    let reference = loaded
        .trace
        .require(Signal::Reference)
        .with_context(|| format!("{}: --controlled needs the drive's reference", input.display()))?;
    let record = logged(&loaded.trace);
    let seen = UnderControl { record: &record, reference, command: &[], controller };
    let motion = machine.signals.motion;
    let mut columns: Vec<Column> = [
        (Signal::Reference, true),
        (Signal::T, true),
        (Signal::Theta1, false),
        (Signal::Omega1, false),
        (Signal::Theta2, false),
        (Signal::Omega2, false),
        (Signal::X2, false),
    ]
    .into_iter()
    .map(|(s, input)| Column { name: s.name().into(), unit: Some(s.unit(motion).into()), values: Vec::new(), input })
    .collect();
    let rho = machine.parameters.rho;
    seen.steps(&model(&machine), |k, at| {
        let r = &at.reading;
        let row = [reference[k], at.torque, r.theta1, r.omega1, r.theta2, r.omega2, rho * r.theta2];
        for (column, value) in columns.iter_mut().zip(row) {
            column.values.push(value);
        }
    });
    if let Some(k) = (0..reference.len()).find(|&k| columns.iter().any(|c| !c.values[k].is_finite())) {
        bail!("the loop runs away: the motion is no longer finite at {} s; lower the gains", record.time(k));
    }
    let time = (0..reference.len()).map(|k| record.time(k)).collect();
    Ok(SimulationResult { time, step: record.dt, columns, notes: Vec::new() })
}

/// An identification in the closed loop: the machine as given and as identified; nothing without a drive or reference.
///
/// # Errors
/// When the trace cannot be read again.
pub(super) fn identified(trace: &Path, part: Part, given: &Machine, found: &Machine) -> anyhow::Result<Vec<Block>> {
    let Some(controller) = &given.controller else { return Ok(Vec::new()) };
    let trace = load(trace, &part.of(given.signals.clone()))?.trace;
    let (Some(reference), Some(torque)) = (trace.get(Signal::Reference), trace.get(Signal::T)) else {
        return Ok(Vec::new());
    };
    let record = logged(&trace);
    let command = trace.get(Signal::Command).unwrap_or(torque);
    let seen = UnderControl { record: &record, reference, command, controller };
    let models = [("as given", given), ("as identified", found)];
    Ok(vec![Block::Table(errors_in_the_loop(
        models.map(|(name, machine)| (name, seen.errors(&model(machine)), false)),
    ))])
}
