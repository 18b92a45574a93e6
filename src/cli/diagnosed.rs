//! A machine with what a diagnosis found: from `diagnosis.json`, from the improved FMU, or from an axis file.

use std::path::Path;

use anyhow::{Context, bail};
use serde_json::Value;

use crate::effects::Effect;
use crate::fmu::archive::Archive;
use crate::fmu::description::{Description, Value as Start};
use crate::report::diagnose::json::SCHEMA;
use crate::trace::Machine;
use crate::variables::{Causality, Starts, Type, Values, all, at};

/// Largest diagnosis that is read, bytes.
const MOST: u64 = 64 << 20;

/// The machine with the parameters and effects of the file.
///
/// # Errors
/// When the file cannot be used.
pub fn apply(machine: &Machine, file: &Path) -> anyhow::Result<Machine> {
    let end = file.extension().unwrap_or_default().to_ascii_lowercase();
    let found = match end.to_str() {
        Some("fmu") => from_fmu(machine, file),
        Some("json") => from_json(machine, file),
        _ => return Ok(Machine::read(file)?),
    };
    found.with_context(|| file.display().to_string())
}

fn from_fmu(machine: &Machine, file: &Path) -> anyhow::Result<Machine> {
    let mut archive = Archive::open(file)?;
    let description = Description::parse(&archive.read("modelDescription.xml")?)?;
    let mut starts = Starts { motion: machine.signals.motion, ..Starts::default() };
    for (index, variable) in all().enumerate().filter(|(_, v)| v.causality == Causality::Parameter) {
        let name = variable.to_string();
        let start = description.variable(&name).and_then(|v| v.start.clone());
        starts.values[index] = match (start, at(index).kind) {
            (Some(Start::Real(x)), Type::Real) if x.is_finite() => x,
            (Some(Start::Integer(i)), Type::Enumeration(_)) => i as f64,
            _ => bail!("it has no start value of {name}: it is no axis of this version of eixo; export it again"),
        };
    }
    let values = Values(starts.values);
    Ok(Machine {
        parameters: values.parameters(),
        structure: values.structure(),
        effects: values.effects(),
        ..machine.clone()
    })
}

fn from_json(machine: &Machine, file: &Path) -> anyhow::Result<Machine> {
    let size = std::fs::metadata(file)?.len();
    anyhow::ensure!(size <= MOST, "{size} bytes; a diagnosis has at most {MOST}");
    let json: Value = serde_json::from_slice(&std::fs::read(file)?)?;
    anyhow::ensure!(
        json["schema"] == SCHEMA,
        "it is no diagnosis of `eixo diagnose --json`: its schema is {}, not \"{SCHEMA}\"",
        json["schema"]
    );
    let mut found = machine.clone();
    let p = &mut found.parameters;
    for (name, slot) in [("I1", &mut p.i1), ("I2", &mut p.i2), ("B", &mut p.b), ("K", &mut p.k)] {
        if let Some(fitted) = json["parameters"][name]["fitted"].as_f64() {
            *slot = fitted;
        }
    }
    p.check(found.structure).map_err(|e| anyhow::anyhow!("parameters: {e}"))?;
    // Where only the parameters are off, the cause named is what they come to.
    let causes = json["causes"].as_array().filter(|_| json["verdict"] != "parameters");
    for cause in causes.into_iter().flatten() {
        let id = cause["id"].as_str().unwrap_or_default();
        let effect = Effect::from_id(id).map_err(|_| anyhow::anyhow!("causes: there is no effect {id:?}"))?;
        for (name, given) in cause["parameters"].as_object().into_iter().flatten() {
            let index =
                effect.parameter(name).map_err(|_| anyhow::anyhow!("causes: {id} has no parameter {name:?}"))?;
            let bounds = &effect.info().parameters[index];
            match given["value"].as_f64() {
                Some(value) if (bounds.min..=bounds.max).contains(&value) => {
                    found.effects.of_mut(effect)[index] = value
                }
                _ => bail!(
                    "causes: {id}.{name} is {}: it must lie between {} and {}",
                    given["value"],
                    bounds.min,
                    bounds.max
                ),
            }
        }
    }
    Ok(found)
}
