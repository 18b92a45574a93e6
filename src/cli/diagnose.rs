//! `eixo diagnose`.

use std::io::IsTerminal;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::Context;
use indicatif::{ProgressBar, ProgressStyle};

use crate::axis::Structure;
use crate::diagnose::{CHANNELS, Case, Model, Replay, NoiseEstimate, Record, diagnose, estimate_noise};
use crate::effects::{EFFECTS, Effect};
use crate::report::diagnose::{Findings, report, short};
use crate::report::format::{Medium, number};
use crate::report::{html, terminal};
use crate::fmu::host::Fmu;
use crate::fmu::package::Package;
use crate::fmu::simulate::{Inputs, Options, Setting, simulate};
use crate::trace::{Machine, Signal, Trace, load, write_text};

/// Arguments of `eixo diagnose`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example: eixo diagnose log.csv --axis axis.toml --holdout other.csv --json diagnosis.json")]
pub struct Args {
    /// Measured trace (CSV)
    trace: PathBuf,
    /// The nominal axis: parameters, known effects, columns of the log
    #[arg(long)]
    axis: PathBuf,
    /// A second trace that the fits never see; without it the last third is held out
    #[arg(long)]
    holdout: Option<PathBuf>,
    /// Effects that must not be named, separated by commas
    #[arg(long, value_delimiter = ',', value_name = "EFFECT")]
    without: Vec<String>,
    /// Write the diagnosis as JSON (schema eixo.diagnosis/1)
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Write the report as one HTML page
    #[arg(long, value_name = "FILE")]
    report: Option<PathBuf>,
    /// Write the improved model as an FMU, and run it on held-out data through the import host
    #[arg(long, value_name = "FILE")]
    fmu: Option<PathBuf>,
}

/// Runs the command.
///
/// # Errors
/// When the command could not run.
pub fn run(args: Args) -> anyhow::Result<ExitCode> {
    let machine = Machine::read(&args.axis)?;
    let (train, noise) = record(&args.trace, &machine)?;
    let holdout = args.holdout.as_deref().map(|p| record(p, &machine)).transpose()?;
    let library = library(&args.without)?;
    let bar = ProgressBar::new_spinner().with_style(ProgressStyle::with_template("{spinner} {elapsed} {msg}")?);
    let case = Case {
        machine: machine.name.clone(),
        nominal: Model { parameters: machine.parameters, structure: machine.structure, effects: machine.effects },
        train: &train,
        noise: &noise,
        holdout: holdout.as_ref().map(|(r, _)| r),
        library,
    };
    let outcome = diagnose(&case, &|what| {
        bar.set_message(what.to_owned());
        bar.tick();
    });
    bar.finish_and_clear();
    let described = format!(
        "{}: {} samples at {} Hz{}",
        args.trace.display(),
        train.len(),
        number(1.0 / train.dt, 4, Medium::Page),
        args.holdout.as_ref().map_or_else(String::new, |p| format!("; held out: {}", p.display()))
    );
    let findings = Findings {
        diagnosis: &outcome.diagnosis,
        evidence: Some(&outcome.evidence),
        trace: &described,
        motion: machine.signals.motion,
    };
    let colour = std::io::stdout().is_terminal();
    print!("{}", terminal::blocks(&short(&findings), terminal::Layout { colour, ..terminal::Layout::default() }));
    if let Some(path) = &args.json {
        let mut text = serde_json::to_string_pretty(&outcome.diagnosis)?;
        text.push('\n');
        write_text(path, text.as_bytes())?;
    }
    if let Some(path) = &args.report {
        write_text(path, html::page(&report(&findings)).as_bytes())?;
    }
    if let Some(path) = &args.fmu {
        let improved = Machine {
            parameters: outcome.improved.parameters,
            effects: outcome.improved.effects,
            ..machine.clone()
        };
        Package::of(&improved).with_context(|| path.display().to_string())?.write(path)?;
        println!("{}", replayed(path, &outcome.replay)?);
    }
    Ok(ExitCode::SUCCESS)
}

/// Runs the FMU as any importer would, on held-out data from its state there; its own error in a sentence.
fn replayed(path: &Path, replay: &Replay) -> anyhow::Result<String> {
    let record = &replay.record;
    let trace = Trace::new(record.start, record.dt, record.hold).with(Signal::T, record.torque.clone())?;
    let starts = ["theta1_0", "omega1_0", "theta2_0", "omega2_0"];
    let settings = starts.iter().zip(replay.initial);
    let options = Options {
        hold: record.hold,
        settings: settings.map(|(n, v)| Setting { name: (*n).to_owned(), value: format!("{v:e}") }).collect(),
        ..Options::default()
    };
    let run = simulate(&Fmu::open(path)?, &Inputs::of(&trace)?, &options)?;
    let mut parts = Vec::new();
    for (channel, name) in record.channels.iter().zip(CHANNELS) {
        let (Some(measured), Some(own)) = (channel, run.get(name)) else { continue };
        let mean = measured.iter().sum::<f64>() / measured.len() as f64;
        let squares = |f: &dyn Fn(usize) -> f64| (0..own.len()).map(|k| f(k).powi(2)).sum::<f64>();
        let error = squares(&|k| own[k] - measured[k]) / squares(&|k| measured[k] - mean);
        parts.push(format!("{name} {}", number(100.0 * error.sqrt(), 3, Medium::Terminal) + " %"));
    }
    Ok(format!("{}: run on held-out data, {} samples: its own error is {} of the signal", path.display(), record.len(), parts.join(", ")))
}

fn library(without: &[String]) -> anyhow::Result<Vec<Effect>> {
    let without: Vec<Effect> = without
        .iter()
        .map(|id| Effect::from_id(id.trim()))
        .collect::<Result<_, _>>()
        .context("--without names effects of `eixo effects`")?;
    Ok(EFFECTS.iter().copied().filter(|e| !without.contains(e)).collect())
}

/// Reads a trace as the diagnosis needs it.
pub(super) fn record(path: &Path, machine: &Machine) -> anyhow::Result<(Record, NoiseEstimate)> {
    let loaded = load(path, &machine.signals)?;
    for warning in &loaded.warnings {
        eprintln!("warning: {}: {warning}", path.display());
    }
    let trace = &loaded.trace;
    let torque = trace.require(Signal::T)?.to_vec();
    let mut channels =
        [Signal::Theta1, Signal::Omega1, Signal::Theta2, Signal::Omega2].map(|s| trace.get(s).map(<[f64]>::to_vec));
    if machine.structure == Structure::Rigid && (channels[2].is_some() || channels[3].is_some()) {
        eprintln!("warning: a rigid axis has no table of its own: theta2 and omega2 are left out.");
        channels[2] = None;
        channels[3] = None;
    }
    if channels[0].is_none() && channels[2].is_none() {
        anyhow::bail!(
            "{}: neither theta1 nor theta2 is there; a diagnosis needs the position of the motor or of the table. Name \
             its column in [signals] of the axis file",
            path.display()
        );
    }
    let views = [0, 1, 2, 3].map(|i: usize| channels[i].as_deref());
    let noise = estimate_noise(&torque, &views, None);
    // A noise-free trace (a simulation) still has the rounding of its file: no channel is taken as exact.
    let std = [0, 1, 2, 3].map(|i: usize| {
        let span = channels[i].as_ref().map_or(0.0, |v| v.iter().fold(0.0_f64, |m, x| m.max(x.abs())));
        noise.std[i].max(1e-9 * span).max(1e-12)
    });
    Ok((Record { start: trace.start, dt: trace.dt, hold: trace.hold, torque, channels, noise: std }, noise))
}
