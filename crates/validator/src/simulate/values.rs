//! Values in and out of an instance by name, whatever their types.

use super::{Column, Inputs, SimulateError, SimulationResult, is_output, numeric};
use crate::description::{BaseType, Causality, Description, Kind, Variability, Variable};
use crate::host::{Fmu, HostError, Instance};
use crate::trace::{Hold, nearest};

/// A value for a variable, as text: `name=value`.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Setting {
    /// Name of the variable.
    pub name: String,
    /// The value: a number, true or false, the name or number of an enumeration's item, or a text.
    pub value: String,
}

/// Reads `name=value`.
///
/// # Errors
/// Says how it is written.
pub fn parse_setting(text: &str) -> Result<Setting, String> {
    match text.split_once('=') {
        Some((name, value)) if !name.trim().is_empty() => {
            Ok(Setting { name: name.trim().to_owned(), value: value.trim().to_owned() })
        }
        _ => Err(format!("{text:?} is no setting; write name=value, as in coulomb_motor.level=0.01")),
    }
}

fn find<'a>(
    description: &'a Description,
    name: &str,
    what: &'static str,
    fits: impl Fn(&Variable) -> bool,
) -> Result<&'a Variable, SimulateError> {
    let fitting = || description.variables.iter().filter(|v| fits(v));
    fitting().find(|v| v.name == name).ok_or_else(|| SimulateError::Unknown {
        what,
        name: name.to_owned(),
        near: nearest(name, fitting().map(|v| v.name.as_str())),
    })
}

/// Sets a value before initialisation.
pub(super) fn apply(
    instance: &mut Instance,
    description: &Description,
    setting: &Setting,
) -> Result<(), SimulateError> {
    let may_be_set = |v: &Variable| {
        matches!(v.causality, Causality::Parameter | Causality::Input)
            || (v.has_start && v.causality != Causality::Independent && v.variability != Variability::Constant)
    };
    let v = find(description, &setting.name, "parameter or start value", may_be_set)?;
    let text = setting.value.as_str();
    let fail = |why: String| SimulateError::Value { name: v.name.clone(), value: text.to_owned(), why };
    let attributes = description.resolved(v);
    let within = |value: f64| {
        let (min, max) = (attributes.min.unwrap_or(f64::NEG_INFINITY), attributes.max.unwrap_or(f64::INFINITY));
        if value >= min && value <= max { Ok(()) } else { Err(fail(format!("it must be from {min:?} to {max:?}"))) }
    };
    let reference = [v.value_reference];
    let set = match v.base() {
        BaseType::Real => {
            let value: f64 = text.parse().map_err(|_| fail("it must be a number".to_owned()))?;
            within(value)?;
            instance.set_real(&reference, &[value])
        }
        BaseType::Integer => {
            let unsigned = || text.parse::<u64>().map(|x| x as i64);
            let value: i64 =
                text.parse().or_else(|_| unsigned()).map_err(|_| fail("it must be a whole number".to_owned()))?;
            within(whole(v, value))?;
            instance.set_integer(&reference, &[value])
        }
        BaseType::Enumeration => {
            let item = attributes.items.iter().find(|(name, value, _)| name == text || value.to_string() == text);
            let names = || attributes.items.iter().map(|i| i.0.as_str()).collect::<Vec<_>>().join(", ");
            let (_, value, _) = item.ok_or_else(|| fail(format!("it must be one of {}", names())))?;
            instance.set_integer(&reference, &[*value])
        }
        BaseType::Boolean => {
            let value = match text {
                "true" | "1" => true,
                "false" | "0" => false,
                _ => return Err(fail("it must be true or false".to_owned())),
            };
            instance.set_boolean(&reference, &[value])
        }
        BaseType::String => instance.set_string(&reference, &[text]),
    };
    set.map_err(|error| {
        let messages: Vec<String> = instance.take_log().into_iter().map(|m| m.message).collect();
        let messages = if messages.is_empty() { error.to_string() } else { messages.join("; ") };
        fail(format!("the FMU refuses it: {messages}"))
    })
}

/// An integer of a variable as a number: an unsigned one of 64 bits is stored with the bits of a signed one.
fn whole(v: &Variable, value: i64) -> f64 {
    number(v.cell.is_some_and(|c| c.kind == Kind::UInt64), value)
}

fn number(unsigned: bool, value: i64) -> f64 {
    if unsigned { value as u64 as f64 } else { value as f64 }
}

/// One of the FMU's variables that a run touches.
struct Port {
    reference: u32,
    base: BaseType,
    /// Of 64 bits without a sign.
    unsigned: bool,
    /// Changes at events only.
    discrete: bool,
}

/// Which inputs are set.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Which {
    /// All of them.
    All,
    /// All of them, with their slopes over the step.
    Sloped,
    /// Those that are not discrete, which are set in event mode.
    Continuous,
}

/// The inputs and outputs of a run.
pub(super) struct Ports {
    inputs: Vec<Port>,
    outputs: Vec<Port>,
    names: Vec<String>,
    /// Value references of the outputs, if all are Reals: then one call reads them.
    reals: Option<Vec<u32>>,
}

impl Ports {
    pub fn find(description: &Description, inputs: &Inputs, outputs: &[String]) -> Result<Self, SimulateError> {
        let port = |v: &Variable| Port {
            reference: v.value_reference,
            base: v.base(),
            unsigned: v.cell.is_some_and(|c| c.kind == Kind::UInt64),
            discrete: v.variability != Variability::Continuous,
        };
        let mut found = Vec::new();
        for (name, _) in &inputs.signals {
            let is_input = |v: &Variable| v.causality == Causality::Input && numeric(v.base());
            found.push(port(find(description, name, "input", is_input)?));
        }
        let variables: Vec<&Variable> = if outputs.is_empty() {
            description.variables.iter().filter(|v| is_output(v.causality) && numeric(v.base())).collect()
        } else {
            let readable = |v: &Variable| numeric(v.base());
            outputs
                .iter()
                .map(|name| find(description, name, "numeric variable", readable))
                .collect::<Result<_, _>>()?
        };
        let all_real = variables.iter().all(|v| v.base() == BaseType::Real);
        Ok(Self {
            inputs: found,
            reals: all_real.then(|| variables.iter().map(|v| v.value_reference).collect()),
            outputs: variables.iter().map(|v| port(v)).collect(),
            names: variables.iter().map(|v| v.name.clone()).collect(),
        })
    }

    /// An empty record with room for `rows`.
    pub fn record(&self, fmu: &Fmu, inputs: &Inputs, rows: usize) -> SimulationResult {
        let description = &fmu.description;
        let unit = |name: &str| {
            let variable = description.variables.iter().find(|v| v.name == name)?;
            description.resolved(variable).unit
        };
        let column = |name: &String, input| Column {
            name: name.clone(),
            unit: unit(name),
            values: Vec::with_capacity(rows),
            input,
        };
        let ins = inputs.signals.iter().map(|(name, _)| column(name, true));
        let outs = self.names.iter().map(|name| column(name, false));
        SimulationResult {
            time: Vec::with_capacity(rows),
            columns: ins.chain(outs).collect(),
            ..SimulationResult::default()
        }
    }

    /// Sets the inputs of `time`.
    pub fn set(
        &self,
        instance: &mut Instance,
        inputs: &Inputs,
        time: f64,
        step: f64,
        hold: Hold,
        which: Which,
    ) -> Result<(), HostError> {
        for (index, port) in self.inputs.iter().enumerate() {
            if which == Which::Continuous && port.discrete {
                continue;
            }
            let (value, slope) = inputs.at(index, time, step, hold);
            let reference = [port.reference];
            match port.base {
                BaseType::Real => instance.set_real(&reference, &[value])?,
                BaseType::Integer | BaseType::Enumeration => {
                    instance.set_integer(&reference, &[value.round() as i64])?
                }
                BaseType::Boolean => instance.set_boolean(&reference, &[value != 0.0])?,
                // Left out by `find`.
                BaseType::String => {}
            }
            if which == Which::Sloped && port.base == BaseType::Real {
                instance.set_input_derivatives(&reference, &[1], &[slope])?;
            }
        }
        Ok(())
    }

    /// The values of the discrete inputs at `time`.
    pub fn discrete(&self, inputs: &Inputs, time: f64, step: f64, hold: Hold) -> Vec<f64> {
        let discrete = self.inputs.iter().enumerate().filter(|(_, port)| port.discrete);
        discrete.map(|(index, _)| inputs.at(index, time, step, hold).0).collect()
    }

    /// Writes the inputs of `time` into the record.
    pub fn note_inputs(&self, inputs: &Inputs, time: f64, step: f64, hold: Hold, record: &mut SimulationResult) {
        for (index, column) in record.columns.iter_mut().take(self.inputs.len()).enumerate() {
            column.values.push(inputs.at(index, time, step, hold).0);
        }
    }

    /// Reads the outputs into the record.
    pub fn read(&self, instance: &mut Instance, record: &mut SimulationResult) -> Result<(), HostError> {
        let columns = &mut record.columns[self.inputs.len()..];
        if let Some(references) = &self.reals {
            let mut buffer = [0.0; 64];
            for (references, columns) in references.chunks(buffer.len()).zip(columns.chunks_mut(64)) {
                let values = &mut buffer[..references.len()];
                instance.get_real_into(references, values)?;
                columns.iter_mut().zip(values).for_each(|(column, value)| column.values.push(*value));
            }
            return Ok(());
        }
        for (port, column) in self.outputs.iter().zip(columns) {
            let reference = [port.reference];
            column.values.push(match port.base {
                BaseType::Real => instance.get_real(&reference)?[0],
                BaseType::Integer | BaseType::Enumeration => {
                    number(port.unsigned, instance.get_integer(&reference)?[0])
                }
                BaseType::Boolean => f64::from(u8::from(instance.get_boolean(&reference)?[0])),
                // Left out by `find`.
                BaseType::String => f64::NAN,
            });
        }
        Ok(())
    }
}
