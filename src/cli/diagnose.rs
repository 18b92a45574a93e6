//! `eixo diagnose`.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::Context;
use indicatif::{ProgressBar, ProgressStyle};

use crate::axis::Structure;
use crate::diagnose::{Case, Model, NoiseEstimate, Outcome, Record, diagnose, estimate_noise};
use crate::effects::{EFFECTS, Effect};
use crate::trace::{Machine, Signal, load, write_text};

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
    print(&outcome);
    if let Some(path) = &args.json {
        let mut text = serde_json::to_string_pretty(&outcome.diagnosis)?;
        text.push('\n');
        write_text(path, text.as_bytes())?;
    }
    Ok(ExitCode::SUCCESS)
}

fn library(without: &[String]) -> anyhow::Result<Vec<Effect>> {
    let without: Vec<Effect> = without
        .iter()
        .map(|id| Effect::from_id(id.trim()))
        .collect::<Result<_, _>>()
        .context("--without names effects of `eixo diagnose --help`")?;
    Ok(EFFECTS.iter().copied().filter(|e| !without.contains(e)).collect())
}

/// Reads a trace as the diagnosis needs it.
fn record(path: &Path, machine: &Machine) -> anyhow::Result<(Record, NoiseEstimate)> {
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

fn print(outcome: &Outcome) {
    let d = &outcome.diagnosis;
    println!("{}", d.sentence);
    for c in &d.causes {
        let parameters: Vec<String> = c
            .parameters
            .iter()
            .map(|(name, v)| {
                let number = |key: &str| v[key].as_f64().unwrap_or(f64::NAN);
                format!("{name} {:.4e} +- {:.1e} {}", number("value"), number("std"), v["unit"].as_str().unwrap_or(""))
            })
            .collect();
        println!("  {} [{}] share {:.3}: {}", c.id, c.place, c.share_of_gap, parameters.join(", "));
    }
    for r in d.ranking.iter().take(8) {
        println!(
            "  {:40} p {:.3}  dBIC {:12.1}  chi2 {:12.4}  closure {:.4}",
            r.id, r.probability, r.delta_bic, r.chi2, r.closure_holdout
        );
    }
}
