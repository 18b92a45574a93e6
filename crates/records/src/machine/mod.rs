//! `axis.toml`: a machine by its nominal parameters, its known effects, its units and its log's columns.
//!
//! ```toml
//! name = "X axis"
//! structure = "two_inertia"          # or "rigid"; here or in [parameters]
//! [parameters]                       # I1, I2, B, K, rho; or Mf, Rf, Mr, Rr, Mm, rho, eta in place of I1, I2, rho
//! I1 = 2.37e-4
//! I2 = 6.07e-6
//! B = 5.4e-4
//! K = 1.76e-2
//! rho = 3.18e-4
//! [units]
//! motion = "rotary"                  # or "linear": kg, m, N
//! [signals]                          # only for a log whose columns have other names
//! time = "t_s"
//! T = { column = "iq_meas_A", scale = 0.52, offset = 0.0, hold = "zoh" }
//! theta1 = "theta_motor_rad"
//! [effects.coulomb_motor]            # effects already known and modelled
//! level = 0.01
//! [controller]                       # the drive that a log was made under: see `controller`
//! reference = "q_ref"
//! kp = 20.0
//! kv = 0.02
//! ```

mod controller;
mod reader;
mod write;

pub use controller::Controller;

use std::path::Path;

use super::error::nearest;
use super::load::{Column, Mapping};
use super::signal::{AxisKind, Signal};
use crate::axis::{Hold, Parameters, PhysicalData, Structure};
use crate::effects::{EFFECTS, Effect, Settings};
use reader::{Reader, Section};

/// Times that the inertia that moves may be off its nominal value, either way: beyond it a record is of another axis, unit or sign.
pub const NOMINAL_OFF: f64 = 5.0;

/// Largest axis file that is read, bytes.
const MAX_BYTES: u64 = 1 << 20;

/// A machine: what `axis.toml` says.
#[derive(Debug, Clone, PartialEq)]
pub struct Machine {
    /// Its name, for reports.
    pub name: String,
    /// One inertia or two.
    pub structure: Structure,
    /// The nominal model.
    pub parameters: Parameters,
    /// The effects that are known and modelled; all off where the file names none.
    pub effects: Settings,
    /// The drive that its logs were made under, where the file names one.
    pub controller: Option<Controller>,
    /// How a log's columns become signals; [`Mapping::motion`] holds the units.
    pub signals: Mapping,
}

/// An axis file that cannot be used: where, what, and the way out.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{file}{}: {message}", line.map_or_else(String::new, |l| format!(": line {l}")))]
pub struct MachineError {
    /// The file.
    pub file: String,
    /// Line from 1, where one is to blame.
    pub line: Option<usize>,
    /// What is wrong and what to do.
    pub message: String,
}

impl Default for Machine {
    /// The paper's X axis (Table 3).
    fn default() -> Self {
        Self {
            name: "X axis of the seed paper".to_owned(),
            structure: Structure::TwoInertia,
            parameters: Parameters::PAPER,
            effects: Settings::default(),
            controller: None,
            signals: Mapping::default(),
        }
    }
}

impl Machine {
    /// Reads an axis file.
    ///
    /// # Errors
    /// [`MachineError`] with file and line.
    pub fn read(path: &Path) -> Result<Self, MachineError> {
        let file = path.display().to_string();
        let fail = |message| MachineError { file: file.clone(), line: None, message };
        let size = std::fs::metadata(path).map_err(|e| fail(format!("cannot read: {e}")))?.len();
        if size > MAX_BYTES {
            return Err(fail(format!("{size} bytes; an axis file has at most {MAX_BYTES}. Is it the trace?")));
        }
        let text = std::fs::read_to_string(path).map_err(|e| fail(format!("cannot read: {e}")))?;
        Self::parse(&text, &file)
    }

    /// Reads the text of an axis file; `file` names it in messages.
    ///
    /// # Errors
    /// [`MachineError`] with file and line.
    pub fn parse(text: &str, file: &str) -> Result<Self, MachineError> {
        let reader = Reader::new(text, file);
        let root = reader.root()?;
        reader.only(
            &root,
            &["name", "structure", "parameters", "effects", "units", "signals", "controller"],
            "axis file",
        )?;
        let name = match root.get("name") {
            Some(value) => {
                let name = reader.text(value, "name")?;
                // It goes into XML, file names and the terminal.
                if name.chars().any(|c| c.is_control() || matches!(c, '\u{fffe}' | '\u{ffff}')) {
                    return Err(reader.error(
                        root.line("name"),
                        "name holds a control character, which XML does not allow; write plain text",
                    ));
                }
                name.to_owned()
            }
            None => Path::new(file).file_stem().map_or_else(String::new, |s| s.to_string_lossy().into_owned()),
        };
        let Some(parameters) = root.table(&reader, "parameters")? else {
            return Err(reader.error(
                None,
                "there is no [parameters]; give I1, I2, B, K and rho, or the data Mf, Rf, Mr, Rr, Mm, rho, eta with B \
                 and K",
            ));
        };
        let structure = structure(&reader, &root, &parameters)?;
        let motion = match root.table(&reader, "units")? {
            None => AxisKind::Rotary,
            Some(units) => {
                reader.only(&units, &["motion"], "[units]")?;
                let choices = [("rotary", AxisKind::Rotary), ("linear", AxisKind::Linear)];
                units.get("motion").map_or(Ok(AxisKind::Rotary), |v| reader.choice(v, "motion", &choices))?
            }
        };
        let parameters = parameters_of(&reader, &parameters, structure)?;
        let effects = effects(&reader, root.table(&reader, "effects")?.as_ref())?;
        let mut signals = signals(&reader, root.table(&reader, "signals")?.as_ref(), motion)?;
        let inertia = parameters.i1 + parameters.i2;
        let controller = match root.table(&reader, "controller")? {
            Some(section) => Some(controller::controller(&reader, &section, inertia, &mut signals)?),
            None => None,
        };
        Ok(Self { name, structure, parameters, effects, controller, signals })
    }
}

fn structure(reader: &Reader, root: &Section, parameters: &Section) -> Result<Structure, MachineError> {
    let choices = [("two_inertia", Structure::TwoInertia), ("rigid", Structure::Rigid)];
    let top = root.get("structure").map(|v| reader.choice(v, "structure", &choices)).transpose()?;
    let inner = parameters.get("structure").map(|v| reader.choice(v, "structure", &choices)).transpose()?;
    match (top, inner) {
        (Some(a), Some(b)) if a != b => Err(reader.error(
            parameters.line("structure"),
            "structure is given twice and differently, at the top and in [parameters]; keep one",
        )),
        (a, b) => Ok(a.or(b).unwrap_or_default()),
    }
}

const PHYSICAL: [&str; 6] = ["Mf", "Rf", "Mr", "Rr", "Mm", "eta"];

fn parameters_of(reader: &Reader, section: &Section, structure: Structure) -> Result<Parameters, MachineError> {
    let rigid = structure == Structure::Rigid;
    let names = ["I1", "I2", "B", "K", "rho", "Mf", "Rf", "Mr", "Rr", "Mm", "eta", "structure"];
    reader.only(section, &names, "[parameters]")?;
    let number = |name: &str| section.get(name).map(|v| reader.number(v, name)).transpose();
    let required = |name: &str| -> Result<f64, MachineError> {
        number(name)?.ok_or_else(|| reader.error(section.own_line, &format!("[parameters] has no {name}")))
    };
    let inertias = ["I1", "I2"].into_iter().find(|n| section.get(n).is_some());
    let physical = PHYSICAL.into_iter().find(|n| section.get(n).is_some());
    let (i1, i2, rho) = match (inertias, physical) {
        (Some(inertia), Some(data)) => {
            return Err(reader.error(
                section.line(data),
                &format!(
                    "[parameters] has both {inertia} and {data}: give the inertias, or the data they follow from, not \
                     both"
                ),
            ));
        }
        (None, Some(_)) => {
            let positive = |name: &str| match required(name)? {
                v if v > 0.0 => Ok(v),
                v => Err(reader.error(section.line(name), &format!("{name} is {v}: it must be greater than zero"))),
            };
            let data = PhysicalData {
                mf: positive("Mf")?,
                rf: positive("Rf")?,
                mr: positive("Mr")?,
                rr: positive("Rr")?,
                mm: positive("Mm")?,
                rho: positive("rho")?,
                eta: positive("eta")?,
            };
            if data.eta > 1.0 {
                return Err(reader.error(section.line("eta"), "eta is an efficiency: it must be at most 1"));
            }
            (data.i1(), data.i2(), data.rho)
        }
        _ if rigid => (required("I1")?, number("I2")?.unwrap_or(0.0), number("rho")?.unwrap_or(1.0)),
        _ => (required("I1")?, required("I2")?, number("rho")?.unwrap_or(1.0)),
    };
    let (b, k) = if rigid {
        (number("B")?.unwrap_or(0.0), number("K")?.unwrap_or(0.0))
    } else {
        (required("B")?, required("K")?)
    };
    let parameters = Parameters { i1, i2, b, k, rho };
    parameters.check(structure).map_err(|e| reader.error(section.line(e.name).or(section.own_line), &e.to_string()))?;
    if !rigid && k == 0.0 {
        return Err(reader.error(
            section.line("K"),
            "K is 0: the two inertias are not joined; for an axis with one inertia write structure = \"rigid\"",
        ));
    }
    Ok(parameters)
}

fn effects(reader: &Reader, section: Option<&Section>) -> Result<Settings, MachineError> {
    let mut settings = Settings::default();
    let Some(section) = section else { return Ok(settings) };
    for (id, value, line) in section.entries() {
        let effect = Effect::from_id(id).map_err(|_| {
            let ids = EFFECTS.iter().map(|e| e.info().id);
            let list = ids.clone().collect::<Vec<_>>().join(", ");
            reader.error(line, &format!("there is no effect {id:?}{}; the effects are: {list}", nearest(id, ids)))
        })?;
        let info = effect.info();
        let table = reader.table(value, &format!("effects.{id}"))?;
        for (name, value, line) in table.entries() {
            let index = effect.parameter(name).map_err(|_| {
                let names = info.parameters.iter().map(|p| p.name);
                let list = names.clone().collect::<Vec<_>>().join(", ");
                let near = nearest(name, names);
                reader.error(line, &format!("effect {id} has no parameter {name:?}{near}; it has: {list}"))
            })?;
            let given = reader.number(value, name)?;
            let parameter = &info.parameters[index];
            if !(parameter.min..=parameter.max).contains(&given) {
                return Err(reader.error(
                    line,
                    &format!(
                        "{id}.{name} is {given} {unit}: it must lie between {min} and {max} {unit}",
                        unit = parameter.unit,
                        min = parameter.min,
                        max = parameter.max
                    ),
                ));
            }
            settings.of_mut(effect)[index] = given;
        }
    }
    Ok(settings)
}

fn hold(reader: &Reader, value: &reader::Value) -> Result<Hold, MachineError> {
    reader.choice(value, "hold", &[("zoh", Hold::Zoh), ("linear", Hold::Linear)])
}

fn signals(reader: &Reader, section: Option<&Section>, motion: AxisKind) -> Result<Mapping, MachineError> {
    let mut mapping = Mapping { motion, ..Mapping::default() };
    let Some(section) = section else { return Ok(mapping) };
    let mut names = vec!["time", "dt", "hold"];
    names.extend(Signal::ALL.map(Signal::name));
    reader.only(section, &names, "[signals]")?;
    for (name, value, line) in section.entries() {
        match name {
            "dt" => match reader.number(value, "dt")? {
                dt if dt > 0.0 => mapping.dt = Some(dt),
                dt => return Err(reader.error(line, &format!("dt is {dt} s: it must be greater than zero"))),
            },
            "hold" => mapping.hold = Some(hold(reader, value)?),
            _ => {
                let signal = Signal::from_name(name);
                let (column, own_hold) = column(reader, name, value, line, signal == Some(Signal::T))?;
                mapping.hold = own_hold.or(mapping.hold);
                match signal {
                    Some(signal) => mapping.signals.push((signal, column)),
                    None => mapping.time = column,
                }
            }
        }
    }
    mapping.signals.sort_by_key(|(signal, _)| *signal);
    Ok(mapping)
}

fn column(
    reader: &Reader,
    name: &str,
    value: &reader::Value,
    line: Option<usize>,
    torque: bool,
) -> Result<(Column, Option<Hold>), MachineError> {
    if value.as_ref().is_str() {
        // An empty name: the log has no such signal, whatever its columns are called.
        return Ok((Column::named(reader.text(value, name)?), None));
    }
    let table = reader.table(value, name)?;
    let place = format!("signals.{name}");
    let allowed: &[&str] =
        if torque { &["column", "unit", "scale", "offset", "hold"] } else { &["column", "unit", "scale", "offset"] };
    reader.only(&table, allowed, &place)?;
    let Some(of) = table.get("column") else {
        return Err(reader.error(line, &format!("{place} names no column: {name} = {{ column = \"...\" }}")));
    };
    let number = |key: &str, or: f64| table.get(key).map_or(Ok(or), |v| reader.number(v, key));
    let column = Column {
        column: reader.text(of, "column")?.to_owned(),
        unit: table.get("unit").map(|v| reader.text(v, "unit").map(str::to_owned)).transpose()?,
        scale: number("scale", 1.0)?,
        offset: number("offset", 0.0)?,
    };
    if column.scale == 0.0 {
        return Err(reader.error(table.line("scale"), &format!("{place}: a scale of 0 leaves nothing of the signal")));
    }
    let own_hold = table.get("hold").map(|v| hold(reader, v)).transpose()?;
    Ok((column, own_hold))
}

#[cfg(test)]
mod tests {
    use super::*;

    const PARAMETERS: &str = "[parameters]\nI1 = 2.37e-4\nI2 = 6.07e-6\nB = 5.4e-4\nK = 1.76e-2\nrho = 3.18e-4\n";

    fn error(text: &str) -> String {
        Machine::parse(text, "axis.toml").unwrap_err().to_string()
    }

    #[test]
    fn the_papers_axis_is_read_from_inertias_and_from_physical_data() {
        let given = Machine::parse(PARAMETERS, "axis.toml").unwrap();
        assert_eq!(given.parameters, Parameters::PAPER);
        assert_eq!(given.name, "axis");
        let data = "[parameters]\nMf = 0.58\nRf = 8.0e-3\nMr = 0.58\nRr = 27.5e-3\nMm = 30\nrho = 3.18e-4\neta = 0.5\n\
                    B = 5.4e-4\nK = 1.76e-2\n";
        let derived = Machine::parse(data, "axis.toml").unwrap().parameters;
        assert!((derived.i1 / 2.3787e-4 - 1.0).abs() < 1e-4);
        assert!((derived.i2 / 6.07e-6 - 1.0).abs() < 1e-3);
    }

    #[test]
    fn a_rigid_axis_needs_one_inertia_and_says_so_in_either_place() {
        for text in
            ["structure = \"rigid\"\n[parameters]\nI1 = 95.1\n", "[parameters]\nstructure = \"rigid\"\nI1 = 95.1\n"]
        {
            let machine = Machine::parse(text, "axis.toml").unwrap();
            assert_eq!((machine.structure, machine.parameters.i1), (Structure::Rigid, 95.1));
        }
        let twice = "structure = \"rigid\"\n[parameters]\nstructure = \"two_inertia\"\nI1 = 1\n";
        assert!(error(twice).contains("line 3: structure is given twice"), "{}", error(twice));
    }

    #[test]
    fn signals_are_mapped_with_scale_offset_unit_and_hold() {
        let text = format!(
            "{PARAMETERS}[units]\nmotion = \"linear\"\n[signals]\ntime = \"t_s\"\n\
             T = {{ column = \"iq_meas_A\", scale = 0.52, offset = -0.1, hold = \"linear\" }}\n\
             theta1 = {{ column = \"x\", unit = \"mm\" }}\n"
        );
        let mapping = Machine::parse(&text, "axis.toml").unwrap().signals;
        assert_eq!((mapping.hold, mapping.motion), (Some(Hold::Linear), AxisKind::Linear));
        assert_eq!(mapping.time.column, "t_s");
        assert_eq!(mapping.signals[0].1.scale, 0.52);
        assert_eq!(mapping.signals[1].1.unit.as_deref(), Some("mm"));
    }

    #[test]
    fn mistakes_are_named_with_line_and_nearest_name() {
        for (text, parts) in [
            ("[parameters]\nI1 = 1\nI3 = 2\n", &["line 3", "I3", "did you mean"][..]),
            ("[parameters]\nI1 = 1\n", &["line 1", "no I2"]),
            ("[parameters]\nI1 = -1\nI2 = 1\nB = 1\nK = 1\n", &["line 2", "greater than zero"]),
            ("[parameters]\nI1 = \"1\"\nI2 = 1\nB = 1\nK = 1\n", &["line 2", "I1", "number"]),
            ("[parameters]\nI1 = nan\nI2 = 1\nB = 1\nK = 1\n", &["line 2", "finite"]),
            ("[parameters]\nI1 = 1\nMf = 1\n", &["line 3", "both I1 and Mf"]),
            ("name = \"x\"\n", &["no [parameters]"]),
            ("name = \"x\"\nname = \"y\"\n", &["line 2"]),
            ("[parameter]\nI1 = 1\n", &["line 1", "did you mean \"parameters\""]),
            ("structure = \"stiff\"\n[parameters]\nI1=1\n", &["line 1", "\"rigid\""]),
        ] {
            let message = error(text);
            assert!(parts.iter().all(|p| message.contains(p)), "{text:?}: {message}");
        }
    }

    #[test]
    fn an_effect_is_set_by_name_and_checked_against_its_bounds() {
        let effect = EFFECTS[0];
        let parameter = &effect.info().parameters[0];
        let id = effect.info().id;
        let text = |name: &str, value: f64| format!("{PARAMETERS}[effects.{id}]\n{name} = {value:?}\n");
        let value = parameter.off + 0.01 * parameter.nominal;
        let machine = Machine::parse(&text(parameter.name, value), "axis.toml").unwrap();
        assert_eq!(machine.effects.of(effect)[0], value);
        let wrong = error(&text("nonsense", 1.0));
        assert!(wrong.contains("line 8") && wrong.contains(parameter.name), "{wrong}");
        let outside = error(&text(parameter.name, parameter.min - 1.0));
        assert!(outside.contains("must lie between"), "{outside}");
        let unknown = error(&format!("{PARAMETERS}[effects.{id}x]\na = 1\n"));
        assert!(unknown.contains(&format!("did you mean {id:?}")), "{unknown}");
    }

    #[test]
    fn a_controller_is_read_with_its_columns_and_written_out_the_same() {
        let text = format!(
            "{PARAMETERS}[controller]\nreference = {{ column = \"r_m\", scale = 3144.65 }}\nkp = 20\nkv = 0.02\ndelay = 1\n"
        );
        let machine = Machine::parse(&text, "axis.toml").unwrap();
        let controller = machine.controller.unwrap();
        assert_eq!((controller.gains.kp, controller.delay, controller.measured_speed), (20.0, 1, false));
        assert_eq!(controller.gains.limit, f64::INFINITY);
        assert_eq!(machine.signals.signals[0].0, Signal::Reference);
        let text = machine.to_toml();
        assert_eq!(Machine::parse(&text, "axis.toml").unwrap_or_else(|e| panic!("{e}\n{text}")), machine, "{text}");
        for (wrong, expected) in [
            ("kp = 1\nkv = 1\n", "names no column of the reference"),
            ("reference = \"r\"\nkp = 1\n", "has no kv"),
            ("reference = \"r\"\nkp = 1\nkv = -1\n", "kv is -1"),
            ("reference = \"r\"\nkp = 1\nkv = 1\ndelay = 0.5\n", "whole number of samples"),
            ("reference = \"r\"\nkp = 1\nkv = 1\nspeed = \"fast\"\n", "\"difference\" or \"measured\""),
        ] {
            let message = error(&format!("{PARAMETERS}[controller]\n{wrong}"));
            assert!(message.contains(expected), "{message}");
        }
    }

    #[test]
    fn a_machine_written_out_reads_back_the_same() {
        let mut machine = Machine::default();
        let effect = EFFECTS[0];
        machine.effects.of_mut(effect)[0] = 0.012_5;
        machine.signals.time.column = "t \"s\"".into();
        machine.signals.hold = Some(Hold::Linear);
        machine.signals.signals =
            vec![(Signal::T, Column { scale: 0.5, ..Column::named("iq") }), (Signal::Theta2, Column::named("q2"))];
        let text = machine.to_toml();
        assert_eq!(Machine::parse(&text, "axis.toml").unwrap_or_else(|e| panic!("{e}\n{text}")), machine, "{text}");
    }
}
