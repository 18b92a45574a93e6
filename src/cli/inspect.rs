//! `eixo inspect`: what is to be known of a record before it is believed.

use std::path::PathBuf;
use std::process::ExitCode;

use super::FINDINGS;
use super::examined::Part;
use super::held;
use super::outputs;
use super::stdout::{WIDTH, layout, out};
use crate::examine::{Input, examine};
use crate::report::driven::Driven;
use crate::report::examine::{Inspected, report, short};
use crate::report::{html, terminal};
use crate::trace::{Machine, load, write_text};

/// Arguments of `eixo inspect`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  eixo inspect log.csv
  eixo inspect log.csv --axis axis.toml --report inspection.html")]
pub struct Args {
    /// The record
    trace: PathBuf,
    /// The machine: its `[signals]` map the log's columns, its parameters are what units are checked against
    #[arg(long, value_name = "FILE")]
    axis: Option<PathBuf>,
    #[command(flatten)]
    part: Part,
    /// Write the findings as JSON (schema eixo.examination/1)
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Write the findings and a plot of the record as one HTML page
    #[arg(long, value_name = "FILE")]
    report: Option<PathBuf>,
}

/// Runs the command.
///
/// # Errors
/// When the record cannot be read, or an output not be written.
pub fn run(args: Args) -> anyhow::Result<ExitCode> {
    let inputs = std::iter::once(args.trace.as_path()).chain(args.axis.as_deref());
    outputs::check(inputs, [], [args.json.as_ref(), args.report.as_ref()])?;
    let mut machine = match &args.axis {
        Some(axis) => Machine::read(axis)?,
        None => Machine { name: "axis".to_owned(), ..Machine::default() },
    };
    machine.signals = args.part.of(machine.signals);
    let file = args.trace.display().to_string();
    let loaded = load(&args.trace, &machine.signals)?;
    let input = Input::of(&loaded.trace, loaded.stamps.as_deref()).against(&machine, args.axis.is_some());
    let (mut examination, notes) = rayon::join(|| examine(&input), || held::notes(&loaded.trace));
    examination.findings.extend(notes);
    let seen = Inspected {
        examination: &examination,
        trace: &loaded.trace,
        file: &file,
        motion: machine.signals.motion,
        warnings: &loaded.warnings,
    };
    let driven = Driven { motion: machine.signals.motion, unit: loaded.drive.clone() };
    if let Some(path) = &args.json {
        let found = serde_json::json!({
            "schema": "eixo.examination/1",
            "trace": file,
            "samples": loaded.trace.len(),
            "dt": loaded.trace.dt,
            "start": loaded.trace.start,
            "warnings": loaded.warnings,
            "examination": examination,
        });
        write_text(path, &serde_json::to_vec_pretty(&found)?)?;
    }
    if let Some(path) = &args.report {
        write_text(path, html::page(&driven.report(report(&seen))).as_bytes())?;
    }
    out!("{}", terminal::blocks(&driven.blocks(short(&seen)), layout(WIDTH)))?;
    Ok(if examination.refuses() { ExitCode::from(FINDINGS) } else { ExitCode::SUCCESS })
}
