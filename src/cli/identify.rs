//! `eixo identify`: the parameters of the axis from a trace.

use std::io::IsTerminal;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Duration;

use anyhow::Context;
use indicatif::{ProgressBar, ProgressStyle};

use serde_json::json;

use super::FINDINGS;
use super::examined::{Believed, ExaminedPieces, Extent, Refused, examined_log, examined_pieces};
use super::many::Many;
use super::names;
use super::outputs;
use super::stdout::out;
use crate::axis::{Scheme, Structure};
use crate::fleet::{Found, Tracked};
use crate::identify::hold;
use crate::identify::joined::Joined;
use crate::identify::result::{Estimate, Identification};
use crate::identify::run::{Method, Request, identify_joined};
use crate::identify::stream;
use crate::report::driven::Driven;
use crate::report::{Block, terminal};
use crate::trace::stream::Stream;
use crate::trace::{Hold, Loaded, Machine, Signal, Trace, load_pieces, write_text};

/// Estimators on offer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Methods {
    /// Least squares
    Ls,
    /// Recursive least squares
    Rls,
    /// Extended least squares, recursive and in batches
    Els,
    /// Instrumental variables
    Iv,
    /// Output error
    Oe,
    /// Frequency response of a periodic record
    Frequency,
    /// All of them
    All,
}

/// Integrations on offer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Integration {
    /// The one that fits the record better
    Auto,
    /// Exact over the sample: a real machine
    Exact,
    /// Newmark steps of one sample: a simulation by the paper's method
    Newmark,
}

/// Arguments of `eixo identify`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  eixo identify trace.csv --axis axis.toml --report identification.html
  eixo identify machines/ --axis axis.toml --output identifications
  eixo identify year.parquet --stream --method ls,rls
  eixo identify --paper-tables")]
pub struct Args {
    /// Traces (CSV, Parquet, MATLAB 5) with time, T, theta1, theta2 (and omega1, omega2), or logs that --axis maps to them; with
    /// --output also folders and patterns
    #[arg(required_unless_present = "paper_tables")]
    traces: Vec<PathBuf>,
    /// The machine: its nominal parameters are the reference, its `[signals]` map the log's columns. With --output and without
    /// it, each trace's own is the axis.toml in its folder or the nearest one above
    #[arg(long, value_name = "FILE")]
    axis: Option<PathBuf>,
    /// Which estimators; may be given more than once
    #[arg(long, value_enum, default_value = "all", value_delimiter = ',')]
    method: Vec<Methods>,
    /// The paper's Euler regression for LS, RLS and ELS instead of the consistent one
    #[arg(long)]
    paper: bool,
    /// Reproduce Tables 1 to 5 of the paper beside its own figures, and say what agrees and why
    #[arg(long, conflicts_with_all = ["traces", "axis", "report", "output"])]
    paper_tables: bool,
    /// Forgetting factor of RLS and ELS
    #[arg(long, default_value_t = 1.0)]
    forgetting: f64,
    /// Start P(0) of RLS and ELS, on regressors of unit size
    #[arg(long, default_value_t = 1e8)]
    p0: f64,
    /// Samples of a period, for a periodic record; found from the torque if not given
    #[arg(long)]
    period: Option<usize>,
    /// What the torque does between samples; the axis file's word if not given
    #[arg(long, value_parser = names::hold("The torque keeps its value over the sample", "The torque runs straight from sample to sample"))]
    hold: Option<Hold>,
    /// Integration of the simulations
    #[arg(long, value_enum, default_value_t = Integration::Auto)]
    integration: Integration,
    /// Read the trace piece by piece, for one larger than memory (CSV or Parquet): LS and RLS alone
    #[arg(long, conflicts_with_all = ["from", "to", "resample", "period", "paper", "paper_tables"])]
    stream: bool,
    /// Write the result as JSON
    #[arg(long, value_name = "FILE", conflicts_with = "output")]
    json: Option<PathBuf>,
    /// Write the result as one HTML page
    #[arg(long, value_name = "FILE", conflicts_with = "output")]
    report: Option<PathBuf>,
    /// Write the axis file with the recommended estimates as its parameters
    #[arg(long, value_name = "FILE", conflicts_with = "output")]
    axis_out: Option<PathBuf>,
    #[command(flatten)]
    believed: Believed,
    #[command(flatten)]
    many: Many,
}

/// Samples of a streamed record that are examined.
const EXAMINED: usize = 1 << 18;

/// What the summary of many traces says of each beside its parameters.
const FACTS: [&str; 4] = ["verdict", "method", "fit", "why"];

/// Runs the command.
///
/// # Errors
/// When a file cannot be read or written, or no method gives an estimate.
pub fn run(args: Args) -> anyhow::Result<ExitCode> {
    if args.paper_tables {
        return paper_tables(args.json.as_deref());
    }
    anyhow::ensure!(
        args.forgetting > 0.0 && args.forgetting <= 1.0,
        "--forgetting is {}: it must be above 0 and at most 1",
        args.forgetting
    );
    anyhow::ensure!(args.p0 > 0.0 && args.p0.is_finite(), "--p0 is {}: it must be greater than zero", args.p0);
    if args.many.is_wanted(&args.traces)? {
        // All that bears on the result, in words.
        let settings = format!("{:?} {:?} {:?} {}", request(&args, true), args.hold, args.believed, args.stream);
        return args.many.run("identify", &FACTS, settings, &args.traces, args.axis.as_deref(), &|item| {
            let Identified { result, record, driven, .. } =
                examine(&item.path, item.axis.as_deref(), &args, &mut |_| ())?;
            found(&result, Joined::of(&record).ok().as_ref(), &driven)
        });
    }
    let inputs = args.traces.iter().map(PathBuf::as_path).chain(args.axis.as_deref());
    outputs::check(inputs, [], [args.json.as_ref(), args.report.as_ref(), args.axis_out.as_ref()])?;
    let path = args.traces.first().context("no trace given")?;
    let bar = progress();
    let done = examine(path, args.axis.as_deref(), &args, &mut |what| bar.set_message(what.to_owned()));
    bar.finish_and_clear();
    if let (Err(error), Some(path)) = (&done, &args.json)
        && let Some(refused) = error.downcast_ref::<Refused>()
    {
        write_text(path, &serde_json::to_vec_pretty(&refused.json())?)?;
    }
    let Identified { machine, result, record, driven } = done?;
    let mut shown = blocks(&result);
    if machine.controller.is_some() && result.recommended.is_some() {
        shown.extend(super::controlled::identified(path, args.believed.part, &machine, &improved(&machine, &result)?)?);
    }
    let shown = driven.blocks(shown);
    out!("{}", terminal::blocks(&shown, super::stdout::layout(super::stdout::WIDTH)))?;
    if let Some(path) = &args.json {
        write_text(path, &serde_json::to_vec_pretty(&driven.units(json!(result)))?)?;
    }
    if let Some(path) = &args.report {
        let report = crate::report::identify::report(&result, Joined::of(&record).ok().as_ref());
        write_text(path, crate::report::html::page(&driven.report(report)).as_bytes())?;
    }
    if let Some(path) = &args.axis_out {
        write_text(path, improved(&machine, &result)?.to_toml().as_bytes())?;
    }
    Ok(if result.identifiability.identified { ExitCode::SUCCESS } else { ExitCode::from(FINDINGS) })
}

/// One trace identified.
struct Identified {
    machine: Machine,
    result: Identification,
    /// The pieces that it was identified from; none of a streamed record.
    record: Vec<Trace>,
    driven: Driven,
}

/// Identifies one trace.
fn examine(
    path: &Path,
    axis: Option<&Path>,
    args: &Args,
    progress: &mut dyn FnMut(&str),
) -> anyhow::Result<Identified> {
    let mut machine = match axis {
        Some(axis) => Machine::read(axis)?,
        None => Machine { name: "axis".to_owned(), ..Machine::default() },
    };
    if let Some(hold) = args.hold {
        machine.signals.hold = Some(hold);
    }
    let file = path.display().to_string();
    progress("reading the trace");
    if args.stream {
        anyhow::ensure!(
            machine.structure == Structure::TwoInertia,
            "{file}: a rigid axis is not identified piece by piece; leave --stream out, or cut the trace into parts"
        );
        let stream = Stream::open(path, &machine.signals)?;
        // The head of the record stands for it: a defect of a sensor or a unit shows there as well.
        let head =
            Loaded { trace: stream.head(EXAMINED)?, stamps: None, warnings: Vec::new(), drive: stream.drive.clone() };
        let seen = examined_log(head, path, &machine, axis.is_some(), args.believed.trust, Extent::Longest)?;
        let mut request = request(args, axis.is_some());
        request.methods.retain(|m| stream::METHODS.contains(m));
        anyhow::ensure!(!request.methods.is_empty(), "--stream: only --method ls and rls are computed piece by piece");
        let mut result = stream::identify(&stream, &machine, &request, &file, progress).context(file)?;
        result.warnings.splice(0..0, seen.warnings);
        result.identifiability.identified &= seen.doubts.is_empty();
        result.identifiability.doubts.extend(seen.doubts);
        return Ok(Identified { machine, result, record: Vec::new(), driven: seen.driven });
    }
    let loaded = load_pieces(path, &args.believed.part.of(machine.signals.clone()))?;
    // What is not there is shown before what is there is examined.
    let there = &loaded.longest.trace;
    let mut needed = vec![Signal::T, Signal::Theta1];
    if machine.structure == Structure::TwoInertia && !there.has(Signal::X2) {
        needed.push(Signal::Theta2);
    }
    needed.into_iter().try_for_each(|s| there.require(s).map(|_| ())).context(file.clone())?;
    let ExaminedPieces { mut pieces, warnings, doubts, driven } =
        examined_pieces(loaded, path, &machine, axis.is_some(), args.believed.trust)?;
    let joined = Joined::of(&pieces)?;
    let request = request(args, axis.is_some());
    let mut result = identify_joined(joined, &machine, &request, &file, progress).context(file.clone())?;
    let given = args.hold.is_some() || axis.is_some() || pieces.iter().any(|t| t.hold == Hold::Linear);
    if !given
        && let Some(other) = hold::straight(&result, &pieces, &machine, &request, &file, progress).context(file)?
    {
        (result, pieces) = other;
        machine.signals.hold = Some(Hold::Linear);
    }
    result.warnings.splice(0..0, warnings);
    result.identifiability.identified &= doubts.is_empty();
    result.identifiability.doubts.extend(doubts);
    Ok(Identified { machine, result, record: pieces, driven })
}

fn request(args: &Args, reference: bool) -> Request {
    Request {
        methods: methods(&args.method),
        forgetting: args.forgetting,
        p0: args.p0,
        paper: args.paper,
        period: args.period,
        reference,
        scheme: match args.integration {
            Integration::Auto => None,
            Integration::Exact => Some(Scheme::Exact),
            Integration::Newmark => Some(Scheme::NEWMARK),
        },
    }
}

/// An identification as a row of the summary: the method to trust.
fn found(result: &Identification, record: Option<&Joined>, driven: &Driven) -> anyhow::Result<Found> {
    let best = result.recommended.as_ref().context("no method gives an estimate to trust")?;
    let method = &result.methods[best.method];
    let fit = method.outputs.iter().map(|o| o.fit_percent / 100.0).reduce(f64::min);
    let verdict = if !result.identifiability.identified {
        "not_identified"
    } else if method.outputs.is_empty() {
        "not_compared"
    } else if method.explains_exactly() || method.outputs.iter().all(|o| o.whiteness.white) {
        "explained"
    } else {
        "not_explained"
    };
    let tracked =
        |e: &Estimate| Tracked { name: e.name.to_owned(), unit: driven.convert(e.unit), value: e.value, std: e.std };
    Ok(Found {
        facts: vec![json!(verdict), json!(method.method), json!(fit), json!(driven.convert(&best.why))],
        parameters: method.parameters.iter().map(tracked).collect(),
        warnings: result.warnings.iter().map(|w| driven.convert(w)).collect(),
        result: driven.units(json!(result)),
        report: driven.report(crate::report::identify::report(result, record)),
    })
}

fn progress() -> ProgressBar {
    if super::stdout::is_quiet() || !std::io::stderr().is_terminal() {
        return ProgressBar::hidden();
    }
    let bar = ProgressBar::new_spinner();
    if let Ok(style) = ProgressStyle::with_template("{spinner} {elapsed} {msg}") {
        bar.set_style(style);
    }
    bar.enable_steady_tick(Duration::from_millis(120));
    bar
}

fn methods(asked: &[Methods]) -> Vec<Method> {
    let wanted = |m: Method| {
        asked.iter().any(|a| match a {
            Methods::All => true,
            Methods::Ls => m == Method::Ls,
            Methods::Rls => m == Method::Rls,
            Methods::Els => matches!(m, Method::Els | Method::ElsBatch),
            Methods::Iv => m == Method::Iv,
            Methods::Oe => m == Method::Oe,
            Methods::Frequency => m == Method::Frequency,
        })
    };
    Method::ALL.into_iter().filter(|m| wanted(*m)).collect()
}

/// The machine with the recommended estimates.
fn improved(machine: &Machine, result: &Identification) -> anyhow::Result<Machine> {
    let best = result.recommended.as_ref().context("there is no estimate to write to the axis file")?;
    let mut machine = machine.clone();
    for e in &result.methods[best.method].parameters {
        match (e.name, machine.structure) {
            ("I1", _) => machine.parameters.i1 = e.value,
            ("I", Structure::Rigid) => (machine.parameters.i1, machine.parameters.i2) = (e.value, 0.0),
            ("I2", _) => machine.parameters.i2 = e.value,
            ("B", _) => machine.parameters.b = e.value.max(0.0),
            ("K", _) => machine.parameters.k = e.value,
            (name, _) => {
                let known = name.split_once('.').and_then(|(id, parameter)| {
                    let effect = crate::effects::Effect::from_id(id).ok()?;
                    Some((effect, effect.parameter(parameter).ok()?))
                });
                if let Some((effect, index)) = known {
                    let limits = &effect.info().parameters[index];
                    machine.effects.of_mut(effect)[index] = e.value.clamp(limits.min, limits.max);
                }
            }
        }
    }
    Ok(machine)
}

/// What the terminal shows: the short report, then each method's failure and warnings.
fn blocks(result: &Identification) -> Vec<Block> {
    let t = &result.trace;
    let mut blocks = vec![Block::Paragraph(format!(
        "{}: {} samples at dt = {} s ({:.4} s{}), hold {}{}; signals {}",
        t.file,
        t.samples,
        t.dt,
        t.duration,
        if t.pieces > 1 { format!(" in {} pieces", t.pieces) } else { String::new() },
        t.hold,
        t.period.map_or_else(String::new, |n| format!(", periodic with {n} samples")),
        t.signals.iter().map(|s| s.name()).collect::<Vec<_>>().join(", ")
    ))];
    blocks.extend(crate::report::identify::short(result));
    // Where none has an estimate, the head gives the reason of each.
    let all_failed = result.methods.iter().all(|m| m.failure.is_some());
    for m in &result.methods {
        if let Some(why) = m.failure.as_ref().filter(|_| !all_failed) {
            blocks.push(Block::Warning(format!("{}: {why}", m.title)));
        }
        blocks.extend(m.notes.iter().map(|n| Block::Paragraph(format!("{}: {n}", m.title))));
    }
    blocks
}

fn paper_tables(json: Option<&Path>) -> anyhow::Result<ExitCode> {
    let tables = crate::identify::tables::reproduce()?;
    let blocks = crate::report::demo::tables(&tables);
    out!("{}", terminal::blocks(&blocks, terminal::Layout { colour: false, ..super::stdout::layout(120) }))?;
    if let Some(path) = json {
        write_text(path, &serde_json::to_vec_pretty(&tables)?)?;
    }
    Ok(ExitCode::SUCCESS)
}
