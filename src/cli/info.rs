//! `eixo info`.

use std::fmt::Write as _;
use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::Context;
use serde_json::{Value as Json, json};

use super::info3;
use super::stdout::{layout, out};
use crate::fmu::archive::Archive;
use crate::fmu::description::{Causality, Description, Interface, SI_BASE, Unit, Value, Variable};
use crate::fmu::xml::Document;
use crate::report::terminal::wrapped;

/// Arguments of `eixo info`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example: eixo info axis.fmu")]
pub struct Args {
    /// The FMU
    fmu: PathBuf,
    /// Write JSON instead of text
    #[arg(long)]
    json: bool,
    /// Only variables of these causalities
    #[arg(long, value_name = "CAUSALITY,...", value_delimiter = ',', value_parser = causality)]
    causality: Vec<Causality>,
}

fn causality(keyword: &str) -> Result<Causality, String> {
    keyword.parse().map_err(|()| {
        let all: Vec<&str> = Causality::ALL.iter().map(|c| c.keyword()).collect();
        format!("one of {}", all.join(", "))
    })
}

/// Runs the command.
///
/// # Errors
/// When the file is no FMU of FMI 2.0 or 3.0.
pub fn run(args: Args) -> anyhow::Result<ExitCode> {
    let mut archive = Archive::open(&args.fmu)?;
    let xml = archive.read("modelDescription.xml").with_context(|| args.fmu.display().to_string())?;
    let name = || args.fmu.display().to_string();
    // One variable a line where no terminal says how long a line is: for other programs.
    let width = layout(u16::MAX).width;
    let document = Document::parse(&xml).with_context(name)?;
    if document.root.name == "fmiModelDescription"
        && document.root.get("fmiVersion").is_some_and(|v| v.starts_with("3."))
    {
        let keywords: Vec<String> = args.causality.iter().map(|c| c.keyword().to_owned()).collect();
        let platforms = platforms(&archive);
        if args.json {
            out!("{:#}\n", info3::as_json(&document.root, &platforms, &keywords))?;
        } else {
            out!("{}", info3::as_text(&document.root, &platforms, &keywords, width))?;
        }
        return Ok(ExitCode::SUCCESS);
    }
    let d = Description::parse(&xml).with_context(name)?;
    let shown: Vec<&Variable> =
        d.variables.iter().filter(|v| args.causality.is_empty() || args.causality.contains(&v.causality)).collect();
    let platforms = platforms(&archive);
    let text = if args.json {
        format!("{:#}\n", as_json(&d, &platforms, &shown))
    } else {
        as_text(&d, &platforms, &shown, width)
    };
    out!("{text}")?;
    Ok(ExitCode::SUCCESS)
}

/// Platform folders with their files and the files' sizes in bytes.
pub(super) type Platforms = Vec<(String, Vec<(String, u64)>)>;

/// Platform folders with their binaries and sizes in bytes; `sources` for source code.
fn platforms(archive: &Archive) -> Platforms {
    let mut found = Platforms::new();
    for entry in archive.entries().iter().filter(|e| !e.is_dir) {
        let (folder, file) = match entry.name.strip_prefix("binaries/").and_then(|rest| rest.split_once('/')) {
            Some(parts) => parts,
            None => match entry.name.strip_prefix("sources/") {
                Some(file) => ("sources", file),
                None => continue,
            },
        };
        let file = (file.to_owned(), entry.size);
        match found.iter_mut().find(|(name, _)| name == folder) {
            Some((_, files)) => files.push(file),
            None => found.push((folder.to_owned(), vec![file])),
        }
    }
    found.sort();
    found
}

fn interfaces(d: &Description) -> impl Iterator<Item = (&'static str, &Interface)> {
    let all = [("co-simulation", &d.co_simulation), ("model exchange", &d.model_exchange)];
    all.into_iter().filter_map(|(name, interface)| Some((name, interface.as_ref()?)))
}

/// Capabilities as the XML names them, with whether they are there.
fn capabilities(i: &Interface) -> [(&'static str, bool); 9] {
    [
        ("needsExecutionTool", i.needs_execution_tool),
        ("canHandleVariableCommunicationStepSize", i.can_handle_variable_step_size),
        ("canInterpolateInputs", i.can_interpolate_inputs),
        ("canRunAsynchronuously", i.can_run_asynchronuously),
        ("canBeInstantiatedOnlyOncePerProcess", i.only_once),
        ("canNotUseMemoryManagementFunctions", i.no_memory_callbacks),
        ("canGetAndSetFMUstate", i.can_get_and_set_state),
        ("canSerializeFMUstate", i.can_serialize_state),
        ("providesDirectionalDerivative", i.provides_directional_derivative),
    ]
}

/// A unit in SI base units: `kg.m2.s-2`, with its factor and offset where they are not 1 and 0.
fn in_base_units(unit: &Unit) -> String {
    let Some(base) = unit.base else { return "no base unit".into() };
    let parts: Vec<String> = SI_BASE
        .iter()
        .zip(base.exponents)
        .filter(|(_, e)| *e != 0)
        .map(|(name, e)| if e == 1 { (*name).to_owned() } else { format!("{name}{e}") })
        .collect();
    let mut text = if parts.is_empty() { "1".to_owned() } else { parts.join(".") };
    if base.factor != 1.0 {
        text = format!("{} {text}", base.factor);
    }
    if base.offset != 0.0 {
        let _ = write!(text, " + {}", base.offset);
    }
    text
}

/// Control characters of an FMU's texts must not steer the terminal.
pub(super) fn plain(text: &str) -> String {
    text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect()
}

fn as_text(d: &Description, platforms: &[(String, Vec<(String, u64)>)], shown: &[&Variable], width: u16) -> String {
    let mut out = String::new();
    let mut line = |name: &str, value: Option<String>| {
        if let Some(value) = value.filter(|v| !v.is_empty()) {
            out.push_str(&fact(name, &plain(&value), width));
        }
    };
    line("model", Some(d.model_name.clone()));
    line("", d.description.clone());
    line("FMI", Some(d.fmi_version.clone()));
    for (name, i) in interfaces(d) {
        line(name, Some(i.model_identifier.clone()));
        let there: Vec<&str> = capabilities(i).into_iter().filter(|(_, there)| *there).map(|(name, _)| name).collect();
        let there = if there.is_empty() { "no capability flag".to_owned() } else { there.join(", ") };
        line("", Some(there));
        if i.max_output_derivative_order > 0 {
            line("", Some(format!("maxOutputDerivativeOrder {}", i.max_output_derivative_order)));
        }
    }
    line("guid", Some(d.guid.clone()));
    line("version", d.version.clone());
    line("author", d.author.clone());
    line("license", d.license.clone());
    line("tool", d.generation_tool.clone());
    line("generated", d.generation_date_and_time.clone());
    if let Some(e) = d.default_experiment {
        let part = |name: &str, value: Option<f64>, unit: &str| value.map(|v| format!("{name} {v}{unit}"));
        let parts = [
            part("start", e.start_time, " s"),
            part("stop", e.stop_time, " s"),
            part("step", e.step_size, " s"),
            part("tolerance", e.tolerance, ""),
        ];
        line("experiment", Some(parts.into_iter().flatten().collect::<Vec<_>>().join(", ")));
    }
    if platforms.is_empty() {
        line("platforms", Some("none: neither binaries nor sources".into()));
    }
    for (at, (folder, files)) in platforms.iter().enumerate() {
        let files: Vec<String> =
            files.iter().map(|(name, size)| format!("{name} ({} kB)", size.div_ceil(1000))).collect();
        line(if at == 0 { "platforms" } else { "" }, Some(format!("{folder}: {}", files.join(", "))));
    }
    for (at, unit) in d.units.iter().enumerate() {
        let display: Vec<&str> = unit.display.iter().map(|x| x.name.as_str()).collect();
        let display = if display.is_empty() { String::new() } else { format!("; shown as {}", display.join(", ")) };
        line(if at == 0 { "units" } else { "" }, Some(format!("{} = {}{display}", unit.name, in_base_units(unit))));
    }
    let _ = writeln!(out, "\n{} of {} variables", shown.len(), d.variables.len());
    let rows = shown.iter().map(|v| {
        [
            plain(&v.name),
            v.base().to_string(),
            v.causality.to_string(),
            v.variability.to_string(),
            v.start.as_ref().map_or(String::new(), |s| plain(&s.to_string())),
            plain(&d.resolved(v).unit.unwrap_or_default()),
            plain(v.description.as_deref().unwrap_or("")),
        ]
    });
    out + &variables(&rows.collect::<Vec<_>>(), width)
}

/// A name and what it is, within a width.
pub(super) fn fact(name: &str, value: &str, width: u16) -> String {
    // As wide as "model exchange", and a blank.
    const NAME: usize = 15;
    let value = wrapped(value, width.saturating_sub(NAME as u16), "");
    let lines: Vec<String> = value
        .lines()
        .enumerate()
        .map(|(k, line)| format!("{:<NAME$}{line}", if k == 0 { name } else { "" }).trim_end().to_owned())
        .collect();
    lines.join("\n") + "\n"
}

/// Least characters that a description in the line of its variable is wrapped to.
const DESCRIPTION_WIDTH: usize = 24;

/// The variables: name, type, causality, variability, start, unit, description. One a line where there is room for that; else the
/// description goes on below itself, and in a narrow terminal all but name and start below these.
pub(super) fn variables(rows: &[[String; 7]], width: u16) -> String {
    const HEAD: [&str; 7] = ["name", "type", "causality", "variability", "start", "unit", "description"];
    let longest =
        |at: usize| rows.iter().map(|r| r[at].chars().count()).chain([HEAD[at].len()]).max().unwrap_or(0).min(50);
    let widths: Vec<usize> = (0..6).map(longest).collect();
    let before: usize = widths.iter().map(|w| w + 2).sum();
    let width = usize::from(width);
    let mut out = String::new();
    if before + DESCRIPTION_WIDTH > width {
        for [name, of_type, causality, variability, start, unit, description] in rows {
            let value = if start.is_empty() { String::new() } else { format!(" = {start}") };
            let unit = if unit.is_empty() { String::new() } else { format!(" [{unit}]") };
            let _ = writeln!(out, "{}", wrapped(&format!("{name}{value}{unit}"), width as u16 - 4, "    "));
            let what = format!(
                "{of_type}, {causality}, {variability}{}{description}",
                if description.is_empty() { "" } else { ": " }
            );
            for line in wrapped(&what, width as u16 - 4, "").lines() {
                let _ = writeln!(out, "    {line}");
            }
        }
        return out;
    }
    let mut write_row = |row: [&str; 7]| {
        let cells: Vec<String> = row.iter().zip(&widths).map(|(cell, width)| format!("{cell:<width$}  ")).collect();
        let room = u16::try_from(width - before).unwrap_or(u16::MAX);
        let description = wrapped(row[6], room, "");
        let mut lines = description.lines();
        let first = format!("{}{}", cells.concat(), lines.next().unwrap_or(""));
        let _ = writeln!(out, "{}", first.trim_end());
        lines.for_each(|line| {
            let _ = writeln!(out, "{:before$}{line}", "");
        });
    };
    write_row(HEAD);
    rows.iter().for_each(|row| write_row(row.each_ref().map(String::as_str)));
    out
}

fn as_json(d: &Description, platforms: &[(String, Vec<(String, u64)>)], shown: &[&Variable]) -> Json {
    let of_interface = |i: &Interface| {
        let mut flags: serde_json::Map<String, Json> =
            capabilities(i).into_iter().map(|(name, there)| (name.to_owned(), json!(there))).collect();
        flags.insert("maxOutputDerivativeOrder".into(), json!(i.max_output_derivative_order));
        json!({ "modelIdentifier": i.model_identifier, "capabilities": flags })
    };
    let variables: Vec<Json> = shown
        .iter()
        .map(|v| {
            let r = d.resolved(v);
            json!({
                "name": v.name,
                "valueReference": v.value_reference,
                "type": v.base().keyword(),
                "causality": v.causality.keyword(),
                "variability": v.variability.keyword(),
                "initial": v.initial().map(|i| i.keyword()),
                "start": match &v.start {
                    Some(Value::Real(x)) => json!(x),
                    Some(Value::Integer(x)) => json!(x),
                    Some(Value::Boolean(x)) => json!(x),
                    Some(Value::String(x)) => json!(x),
                    None => Json::Null,
                },
                "unit": r.unit,
                "displayUnit": r.display_unit,
                "min": r.min,
                "max": r.max,
                "nominal": r.nominal,
                "description": v.description,
            })
        })
        .collect();
    let units: Vec<Json> = d
        .units
        .iter()
        .map(|u| {
            json!({
                "name": u.name,
                "base": u.base.map(|b| json!({
                    "exponents": SI_BASE.iter().zip(b.exponents).filter(|(_, e)| *e != 0)
                        .map(|(name, e)| ((*name).to_owned(), json!(e))).collect::<serde_json::Map<_, _>>(),
                    "factor": b.factor, "offset": b.offset,
                })),
                "display": u.display.iter().map(|x| json!({ "name": x.name, "factor": x.factor, "offset": x.offset })).collect::<Vec<_>>(),
            })
        })
        .collect();
    json!({
        "schema": "eixo.info/1",
        "modelName": d.model_name,
        "description": d.description,
        "fmiVersion": d.fmi_version,
        "guid": d.guid,
        "version": d.version,
        "author": d.author,
        "license": d.license,
        "generationTool": d.generation_tool,
        "generationDateAndTime": d.generation_date_and_time,
        "coSimulation": d.co_simulation.as_ref().map(of_interface),
        "modelExchange": d.model_exchange.as_ref().map(of_interface),
        "defaultExperiment": d.default_experiment.map(|e| json!({
            "startTime": e.start_time, "stopTime": e.stop_time, "stepSize": e.step_size, "tolerance": e.tolerance,
        })),
        "platforms": platforms.iter().map(|(folder, files)| json!({
            "platform": folder,
            "files": files.iter().map(|(name, size)| json!({ "name": name, "bytes": size })).collect::<Vec<_>>(),
        })).collect::<Vec<_>>(),
        "units": units,
        "variables": variables,
    })
}
