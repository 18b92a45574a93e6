//! `eixo diagnose`.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::Context;
use serde_json::{Value, json};

use super::examined::{Believed, Examined, examined};
use super::many::Many;
use super::outputs;
use super::progress::Progress;
use super::stdout::{WIDTH, layout, out};
use crate::axis::Structure;
use crate::control::UnderControl;
use crate::diagnose::{
    CHANNELS, Case, Estimate, Model, NoiseEstimate, Outcome, Record, Replay, diagnose, estimate_noise, verified,
};
use crate::effects::{EFFECTS, Effect};
use crate::fleet::{Found, Tracked};
use crate::fmu::contained::{Host, simulate};
use crate::fmu::package::Package;
use crate::fmu::simulate::{Inputs, Options, Setting};
use crate::report::diagnose::{Findings, json as contract, report, short, warnings};
use crate::report::driven::Driven;
use crate::report::format::{Medium, number, percent, printable};
use crate::report::{Block, html, terminal};
use crate::trace::{Machine, Signal, Trace, nearest, restore, write_text};

/// Arguments of `eixo diagnose`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  eixo diagnose log.csv --axis axis.toml --holdout other.csv --json diagnosis.json --report diagnosis.html
  eixo diagnose machines/ 'archive/*.parquet' --output diagnoses")]
pub struct Args {
    /// Measured traces (CSV, Parquet, MATLAB 5); with --output also folders and patterns
    #[arg(required = true)]
    traces: Vec<PathBuf>,
    /// The nominal axis: parameters, known effects, columns of the log. With --output and without it, each trace's own is the
    /// axis.toml in its folder or the nearest one above
    #[arg(long)]
    axis: Option<PathBuf>,
    /// A second trace that the fits never see; without it the last third is held out
    #[arg(long, conflicts_with = "output")]
    holdout: Option<PathBuf>,
    /// Effects that must not be named, separated by commas
    #[arg(long, value_delimiter = ',', value_name = "EFFECT", value_parser = super::names::effect(), hide_possible_values = true)]
    without: Vec<String>,
    /// Write the diagnosis as JSON (schema eixo.diagnosis/1)
    #[arg(long, value_name = "FILE", conflicts_with = "output")]
    json: Option<PathBuf>,
    /// Write the report as one HTML page
    #[arg(long, value_name = "FILE", conflicts_with = "output")]
    report: Option<PathBuf>,
    /// Write the improved model as an FMU, and run it on held-out data through the import host
    #[arg(long, value_name = "FILE", conflicts_with = "output")]
    fmu: Option<PathBuf>,
    #[command(flatten)]
    believed: Believed,
    #[command(flatten)]
    many: Many,
    #[command(flatten)]
    progress: Progress,
}

/// What the summary of many traces says of each beside its parameters.
const FACTS: [&str; 11] = [
    "verdict",
    "place",
    "cause",
    "probability",
    "closure",
    "closure_low",
    "closure_high",
    "error_before",
    "error_reidentified",
    "error_after",
    "noise_floor",
];

/// One trace diagnosed.
struct Diagnosed {
    machine: Machine,
    outcome: Outcome,
    /// What was diagnosed: file, samples, rate.
    described: String,
    warnings: Vec<String>,
    driven: Driven,
}

impl Diagnosed {
    fn findings(&self) -> Findings<'_> {
        Findings {
            diagnosis: &self.outcome.diagnosis,
            overlays: &self.outcome.overlays,
            trace: &self.described,
            motion: self.machine.signals.motion,
            warnings: &self.warnings,
        }
    }
}

/// Diagnoses one trace.
fn examine(
    trace: &Path,
    axis: &Path,
    holdout: Option<&Path>,
    suspects: Vec<Effect>,
    believed: Believed,
    progress: &(dyn Fn(&str) + Sync),
) -> anyhow::Result<Diagnosed> {
    let mut machine = Machine::read(axis)?;
    let Recorded { record: train, noise, mut warnings, reference, command, driven } =
        record(trace, &machine, believed)?;
    warnings.extend(noise.jitter.map(|samples| {
        format!(
            "{}: the noise of the position grows with its speed, as if the encoder were read {} s ({} of a sample) early or late. No \
             stamp tells by how much, so it counts as noise. Have the encoder read by the controller's clock, or log when it is read.",
            trace.display(),
            number(samples * train.dt, 2, Medium::Terminal),
            percent(samples, Medium::Terminal)
        )
    }));
    // The part is that of the first record; the second one is used from its start to its end. What the torque does is asked of the first.
    machine.signals.hold = Some(train.hold);
    let whole = Believed { trust: believed.trust, ..Believed::default() };
    let holdout = holdout.map(|p| record(p, &machine, whole).map(|r| (r, p))).transpose()?;
    warnings.extend(holdout.iter().flat_map(|(r, _)| r.warnings.iter().cloned()));
    let case = Case {
        machine: machine.name.clone(),
        nominal: Model::new(machine.parameters, machine.structure, machine.effects),
        motion: machine.signals.motion,
        train: &train,
        noise: &noise,
        holdout: holdout.as_ref().map(|(r, _)| &r.record),
        suspects,
    };
    let mut outcome = diagnose(&case, progress);
    let gap = &outcome.diagnosis.gap;
    anyhow::ensure!(
        [&gap.train.combined, &gap.holdout.combined].iter().all(|l| l.before.is_finite() && l.after.is_finite()),
        "{}: the model of {} leaves every bound along this record; check the parameters of the axis file and the units of the log",
        trace.display(),
        axis.display()
    );
    if let Some(controller) = &machine.controller {
        match &reference {
            Some(reference) => {
                let command = command.as_deref().unwrap_or(&train.torque);
                let seen = UnderControl { record: &train, reference, command, controller };
                outcome.diagnosis.closed_loop = Some(verified(&seen, &outcome.decision));
            }
            None => warnings.push(format!(
                "{}: [controller] is given, but the trace has no column of the reference: the loop is not simulated.",
                trace.display()
            )),
        }
    }
    let described = format!(
        "{}: {} samples at {} Hz{}",
        trace.display(),
        train.len(),
        number(1.0 / train.dt, 4, Medium::Page),
        holdout.as_ref().map_or_else(String::new, |(_, p)| format!("; held out: {}", p.display()))
    );
    Ok(Diagnosed { machine, outcome, described, warnings, driven })
}

/// Runs the command.
///
/// # Errors
/// When the command could not run.
pub fn run(args: Args) -> anyhow::Result<ExitCode> {
    let suspects = library(&args.without)?;
    if args.many.is_wanted(&args.traces)? {
        let ids: Vec<&str> = suspects.iter().map(|e| e.info().id).collect();
        return args.many.run(
            "diagnose",
            &FACTS,
            format!("{} {:?}", ids.join(","), args.believed),
            &args.traces,
            args.axis.as_deref(),
            &|item| {
                let axis = item.axis.as_deref().context("no axis.toml in its folder or above, and no --axis")?;
                Ok(found(&examine(&item.path, axis, None, suspects.clone(), args.believed, &|_| ())?))
            },
        );
    }
    let inputs = args.traces.iter().map(PathBuf::as_path).chain(args.axis.as_deref()).chain(args.holdout.as_deref());
    outputs::check(inputs, [], [args.json.as_ref(), args.report.as_ref(), args.fmu.as_ref()])?;
    let trace = args.traces.first().context("no trace given")?;
    let axis = args
        .axis
        .as_deref()
        .context("--axis is missing: the nominal axis, as in --axis axis.toml; `eixo init` writes one from the log")?;
    let steps = args.progress.steps();
    let diagnosed = examine(trace, axis, args.holdout.as_deref(), suspects, args.believed, &|what| steps.step(what))?;
    steps.end();
    diagnosed.warnings.iter().for_each(|w| eprintln!("warning: {}", printable(&diagnosed.driven.convert(w))));
    let findings = diagnosed.findings();
    let outcome = &diagnosed.outcome;
    out!("{}", terminal::blocks(&diagnosed.driven.blocks(short(&findings)), layout(WIDTH)))?;
    if let Some(path) = &args.json {
        let mut text = serde_json::to_string_pretty(
            &diagnosed.driven.units(contract::value(&outcome.diagnosis, &diagnosed.warnings)),
        )?;
        text.push('\n');
        write_text(path, text.as_bytes())?;
    }
    if let Some(path) = &args.report {
        write_text(path, html::page(&diagnosed.driven.report(report(&findings))).as_bytes())?;
    }
    if let Some(path) = &args.fmu {
        let improved = Machine {
            parameters: outcome.improved.parameters,
            effects: outcome.improved.effects,
            ..diagnosed.machine.clone()
        };
        let bytes = Package::of(&improved).with_context(|| path.display().to_string())?.archive()?;
        super::export::read_back(&bytes, "modelDescription.xml").with_context(|| path.display().to_string())?;
        write_text(path, &bytes)?;
        let line = Block::Paragraph(replayed(path, &outcome.replay)?);
        out!("{}", terminal::blocks(&[line], layout(WIDTH)))?;
    }
    Ok(ExitCode::SUCCESS)
}

/// A diagnosis as a row of the summary.
fn found(diagnosed: &Diagnosed) -> Found {
    let d = &diagnosed.outcome.diagnosis;
    let held = &d.gap.holdout.combined;
    let causes: Vec<&str> = d.causes.iter().map(|c| c.effect.info().id).collect();
    let facts = vec![
        json!(contract::verdict(d.verdict)),
        json!(contract::site(d.location.site)),
        if causes.is_empty() { Value::Null } else { json!(causes.join("+")) },
        json!(d.causes.first().map(|c| c.probability)),
        json!(d.gap.closure),
        json!(d.gap.interval[0]),
        json!(d.gap.interval[1]),
        json!(held.before),
        json!(held.reidentified),
        json!(held.after),
        json!(held.noise_floor),
    ];
    let driven = &diagnosed.driven;
    let tracked =
        |name: String, e: &Estimate| Tracked { name, unit: driven.convert(e.unit), value: e.value, std: e.std };
    let base = d.parameters.iter().map(|p| tracked(p.parameter.name().to_owned(), &p.fitted));
    let of_causes = d.causes.iter().flat_map(|c| c.named().map(move |(name, e)| (c.effect.info().id, name, e)));
    let of_causes = of_causes.map(|(id, name, e)| tracked(format!("{id}.{name}"), e));
    Found {
        facts,
        parameters: base.chain(of_causes).filter(|t| t.value.is_finite()).collect(),
        warnings: diagnosed
            .warnings
            .iter()
            .cloned()
            .chain(warnings(d, Some(diagnosed.machine.signals.motion)))
            .map(|w| driven.convert(&w))
            .collect(),
        result: driven.units(contract::value(d, &diagnosed.warnings)),
        report: driven.report(report(&diagnosed.findings())),
    }
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
    let run = simulate(path, &Inputs::of(&trace)?, &options, &Host::new()?)?;
    let mut parts = Vec::new();
    for (channel, name) in record.channels.iter().zip(CHANNELS) {
        let (Some(measured), Some(own)) = (channel, run.get(name)) else { continue };
        let mean = measured.iter().sum::<f64>() / measured.len() as f64;
        let squares = |f: &dyn Fn(usize) -> f64| (0..own.len()).map(|k| f(k).powi(2)).sum::<f64>();
        let error = squares(&|k| own[k] - measured[k]) / squares(&|k| measured[k] - mean);
        parts.push(format!("{name} {}", number(100.0 * error.sqrt(), 3, Medium::Terminal) + " %"));
    }
    Ok(format!(
        "{}: run on held-out data, {} samples: its own error is {} of the signal",
        path.display(),
        record.len(),
        parts.join(", ")
    ))
}

fn library(without: &[String]) -> anyhow::Result<Vec<Effect>> {
    let without: Vec<Effect> = without
        .iter()
        .map(|id| {
            Effect::from_id(id.trim()).map_err(|_| {
                let near = nearest(id.trim(), EFFECTS.iter().map(|e| e.info().id));
                anyhow::anyhow!("--without {}: there is no such effect{near}; `eixo effects` lists them", id.trim())
            })
        })
        .collect::<anyhow::Result<_>>()?;
    Ok(EFFECTS.iter().copied().filter(|e| !without.contains(e)).collect())
}

/// A trace as the diagnosis needs it.
pub(super) struct Recorded {
    /// The record.
    pub record: Record,
    /// What is known of its noise.
    pub noise: NoiseEstimate,
    /// What the user should know.
    pub warnings: Vec<String>,
    /// Reference of the drive, where the trace has it.
    pub reference: Option<Vec<f64>>,
    /// Its command, where that is another than the torque.
    pub command: Option<Vec<f64>>,
    /// What drives the axis.
    pub driven: Driven,
}

/// Samples that a diagnosis needs: a third of them is held out, and what is left must give a speed and its noise.
const SHORTEST: usize = 64;

/// Reads a trace as the diagnosis needs it.
pub(super) fn record(path: &Path, machine: &Machine, believed: Believed) -> anyhow::Result<Recorded> {
    let Examined { trace, idle, mut warnings, driven, .. } = examined(path, machine, true, believed)?;
    let trace = &trace;
    let torque = trace.require(Signal::T).with_context(|| path.display().to_string())?.to_vec();
    let mut channels =
        [Signal::Theta1, Signal::Omega1, Signal::Theta2, Signal::Omega2].map(|s| trace.get(s).map(<[f64]>::to_vec));
    if machine.structure == Structure::Rigid && (channels[2].is_some() || channels[3].is_some()) {
        warnings.push("A rigid axis has no table of its own: theta2 and omega2 are left out.".to_owned());
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
    anyhow::ensure!(
        torque.len() >= SHORTEST,
        "{}: {} samples are too few for a diagnosis, which needs {SHORTEST}; log a longer record, or take more of it with --from and --to",
        path.display(),
        torque.len()
    );
    // Of a fast motion a sample that was held is more than the noise: it must not be taken for it.
    channels.iter_mut().step_by(2).flatten().for_each(|position| restore(position));
    let views = [0, 1, 2, 3].map(|i: usize| channels[i].as_deref());
    let noise = estimate_noise(&torque, &views, None);
    // A noise-free trace (a simulation) still has the rounding of its file: no channel is taken as exact.
    let std = [0, 1, 2, 3].map(|i: usize| {
        let span = channels[i].as_ref().map_or(0.0, |v| v.iter().fold(0.0_f64, |m, x| m.max(x.abs())));
        noise.std[i].max(1e-9 * span).max(1e-12)
    });
    let record = Record {
        start: trace.start,
        noise: std,
        corner: noise.corner.map(|c| c / trace.dt),
        common_noise: noise.common,
        idle,
        ..Record::new(trace.dt, trace.hold, torque, channels)
    };
    let [reference, command] = [Signal::Reference, Signal::Command].map(|s| trace.get(s).map(<[f64]>::to_vec));
    Ok(Recorded { record, noise, warnings, reference, command, driven })
}
