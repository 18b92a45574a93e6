//! `eixo demo`: the main job from start to finish on the paper's own experiment.
//!
//! The axis is exported as an FMU. The FMU plays a machine with a worn nut, with friction and with something that no model knows; its
//! noisy positions are diagnosed with a model of none of them, and the circular test shows what the two causes do to a part.
//! Then the paper's own experiment: excited with a Schroeder signal, simulated through the FMU as any importer would, and
//! identified from the trace; the report holds the plots of the paper's Figures 4 to 13 and its tables.

use std::io::IsTerminal;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Duration;

use anyhow::Context;
use indicatif::{ProgressBar, ProgressStyle};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::stdout::{out, out_line};
use crate::axis::{Parameters, dt_criterion};
use crate::diagnose::{Case, Model, diagnose};
use crate::effects::EFFECTS;
use crate::fmu::contained::{Host, simulate};
use crate::fmu::package::Package;
use crate::fmu::simulate::{Inputs, Options, Rows, parse_setting};
use crate::identify::excitation::{Kind, Multisine};
use crate::identify::run::{Method, Request, identify};
use crate::identify::tables::reproduce;
use crate::report::demo::{Findings, PLAYED, linked, report, short};
use crate::report::{Block, Report, diagnose as diagnosis, html, terminal};
use crate::trace::{AxisKind, Hold, Machine, Signal, Trace, write_csv, write_text};

/// Arguments of `eixo demo`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example: eixo demo -o demo && open demo/report.html")]
pub struct Args {
    /// Folder for the FMU, the traces, the results and the report
    #[arg(short, long, default_value = "eixo-demo", value_name = "FOLDER")]
    output: PathBuf,
}

/// Samples of the record, periods of the mode in it, lines of the excitation (paper, Table 1 and section 4.2).
const SAMPLES: usize = 2048;
const KAPPA: f64 = 10.0;
const LINES: usize = 100;
/// The paper gives no amplitude: an rms that turns its axis by some radians.
const RMS: f64 = 0.03;

/// Runs the command.
///
/// # Errors
/// When the FMU cannot be made or run, or a file cannot be written.
pub fn run(args: Args) -> anyhow::Result<ExitCode> {
    let folder = &args.output;
    std::fs::create_dir_all(folder)
        .with_context(|| format!("cannot make the folder {}: choose another with -o", folder.display()))?;
    let file = |name: &str| folder.join(name);
    let steps = Steps::new();

    steps.next("exporting the axis as an FMU");
    let fmu_file = file("axis.fmu");
    Package::default().write(&fmu_file)?;

    steps.next("making the Schroeder excitation");
    let dt = dt_criterion(KAPPA, SAMPLES, Parameters::PAPER.modal().wn);
    let excitation = Multisine::new(Kind::Schroeder, SAMPLES, 1, LINES, RMS, 0.0, 0)?;
    let torque = Trace::new(0.0, dt, Hold::Linear).with(Signal::T, excitation.period())?;
    write_csv(&file("excitation.csv"), &torque, AxisKind::Rotary)?;

    steps.next("simulating the FMU");
    let host = Host::new().context("cannot find this program's own file")?;
    let options = Options { hold: Hold::Linear, rows: Rows::InputsSet, ..Options::default() };
    let record =
        simulate(&fmu_file, &Inputs::of(&torque)?, &options, &host).with_context(|| fmu_file.display().to_string())?;
    let trace = record.trace(Hold::Linear)?;
    write_csv(&file("trace.csv"), &trace, AxisKind::Rotary)?;

    let machine = Machine { name: "the paper's X axis".to_owned(), ..Machine::default() };
    let methods = [Method::Ls, Method::Rls, Method::Els, Method::Iv, Method::Oe];
    let request = Request { methods: methods.to_vec(), reference: true, ..Request::default() };
    let consistent =
        steps.during("identifying: ", |progress| identify(&trace, &machine, &request, "trace.csv", progress))?;
    let request = Request { methods: methods[..3].to_vec(), paper: true, ..request };
    let euler = steps.during("identifying by the paper's Euler regression: ", |progress| {
        identify(&trace, &machine, &request, "trace.csv", progress)
    })?;

    steps.next("computing the paper's tables again");
    let findings = Findings {
        record: trace,
        consistent,
        euler,
        tables: reproduce()?,
        crest_factor: excitation.crest_factor(),
        lines: LINES,
    };

    let Disagreement { blocks: disagreement, diagnosis: found, circle } =
        disagreement(&fmu_file, &host, &args.output, dt, &steps)?;

    steps.next("writing the report");
    write_text(&file("identification.json"), &serde_json::to_vec_pretty(&findings.consistent)?)?;
    write_text(&file("report.html"), html::page(&report(&findings, &found, &circle)).as_bytes())?;
    steps.finish();

    let layout = super::stdout::layout(super::stdout::WIDTH);
    let mut paragraphs = vec![Block::Paragraph(format!("A machine that disagrees with its model: {PLAYED}"))];
    paragraphs.extend(disagreement);
    out!("{}", terminal::blocks(&paragraphs, layout))?;
    out_line!("\nThe paper's experiment, from FMU to parameters:\n")?;
    out!("{}", terminal::blocks(&short(&findings), layout))?;
    out_line!()?;
    for (name, what) in [
        ("report.html", "the report: open it in a browser"),
        ("diagnosis.html", "where the gap lies, what causes it, how far it shrinks"),
        ("circle.html", "what the two causes do to a circle"),
        ("machine.csv", "the log of the machine that disagrees"),
        ("nominal.toml", "the model that knows of no play and no friction"),
        ("axis.fmu", "the axis, for any tool that imports FMI 2.0"),
        ("excitation.csv", "the torque of the paper's experiment"),
        ("trace.csv", "what the FMU answered"),
        ("identification.json", "the estimates"),
    ] {
        out_line!("  {:<40} {what}", file(name).display())?;
    }
    Ok(ExitCode::SUCCESS)
}

/// What is hidden in the FMU: a play of 6.4 um on the table, and a friction of about a tenth of the torque's rms.
const HIDDEN: [&str; 2] = ["backlash.half_gap=0.01", "coulomb_motor.level=0.004"];
/// The torque that acts on the motor and is in no log and in no model, such as that of chips or a neighbour: its rms, N.m, and its
/// correlation time, s.
const UNKNOWN: (f64, f64) = (6e-4, 0.05);
/// Noise of the encoders, rad, and the seed that draws it.
const NOISE: f64 = 1e-4;
const SEED: u64 = 20_060_718;
/// Periods of the excitation: the last third of the record is held out.
const PERIODS: usize = 2;

/// What the machine that disagrees showed: for the terminal, and the reports of the diagnosis and of the circle.
struct Disagreement {
    blocks: Vec<Block>,
    diagnosis: Report,
    circle: Report,
}

/// Lets the FMU play a machine with causes that the model does not know, and diagnoses it.
fn disagreement(fmu: &Path, host: &Host, folder: &Path, dt: f64, steps: &Steps) -> anyhow::Result<Disagreement> {
    let file = |name: &str| folder.join(name);
    let mut draws = ChaCha8Rng::seed_from_u64(SEED);
    let mut draw = || -> f64 { StandardNormal.sample(&mut draws) };
    steps.next("simulating a machine with hidden trouble");
    let period = Multisine::new(Kind::Schroeder, SAMPLES, 1, LINES, RMS, 0.0, 0)?.period();
    let torque: Vec<f64> = period.iter().copied().cycle().take(PERIODS * SAMPLES).collect();
    let torque = Trace::new(0.0, dt, Hold::Zoh).with(Signal::T, torque)?;
    let settings = HIDDEN.iter().map(|s| parse_setting(s)).collect::<Result<_, _>>().map_err(anyhow::Error::msg)?;
    let options = Options { hold: Hold::Zoh, rows: Rows::InputsSet, settings, ..Options::default() };
    // White noise behind a lag of first order.
    let (rms, time) = UNKNOWN;
    let (kept, mut unknown) = ((-dt / time).exp(), 0.0);
    let acting = torque.require(Signal::T)?.iter().map(|t| {
        unknown = kept * unknown + rms * (1.0 - kept * kept).sqrt() * draw();
        t + unknown
    });
    let acting = Trace::new(0.0, dt, Hold::Zoh).with(Signal::T, acting.collect())?;
    let run = simulate(fmu, &Inputs::of(&acting)?, &options, host)?.trace(Hold::Zoh)?;
    let mut log = torque;
    for signal in [Signal::Theta1, Signal::Theta2] {
        log.set(signal, run.require(signal)?.iter().map(|v| v + NOISE * draw()).collect())?;
    }
    write_csv(&file("machine.csv"), &log, AxisKind::Rotary)?;
    // The data sheet is off by a few per cent, as data sheets are.
    let paper = Parameters::PAPER;
    let parameters = Parameters { i1: 0.97 * paper.i1, i2: 1.04 * paper.i2, ..paper };
    let mut machine = Machine { name: "a machine with hidden trouble".to_owned(), parameters, ..Machine::default() };
    write_text(&file("nominal.toml"), machine.to_toml().as_bytes())?;

    let super::diagnose::Recorded { record, noise, .. } =
        super::diagnose::record(&file("machine.csv"), &machine, super::examined::Believed::default())?;
    let case = Case {
        machine: machine.name.clone(),
        nominal: Model::new(machine.parameters, machine.structure, machine.effects),
        motion: machine.signals.motion,
        train: &record,
        noise: &noise,
        holdout: None,
        suspects: EFFECTS.to_vec(),
    };
    let bar = &steps.0;
    let outcome = diagnose(&case, &|part| bar.set_message(format!("diagnosing: {part}")));
    let findings = diagnosis::Findings {
        diagnosis: &outcome.diagnosis,
        overlays: &outcome.overlays,
        trace: "machine.csv",
        motion: AxisKind::Rotary,
        warnings: &[],
    };
    let report = diagnosis::report(&findings);
    write_text(&file("diagnosis.html"), html::page(&linked(report.clone(), "diagnosis.html")).as_bytes())?;

    steps.next("turning a circle");
    let (parameters, effects) = (outcome.improved.parameters, outcome.improved.effects);
    let found = Machine { parameters, effects, ..machine.clone() };
    machine.name = "an XY table with the diagnosed axis".to_owned();
    let found = [found.clone(), found];
    let circle = super::circle::findings(&[machine.clone(), machine], Some(&found), &super::circle::Test::default())?;
    let drawn = crate::report::circle::report(&circle);
    write_text(&file("circle.html"), html::page(&linked(drawn.clone(), "circle.html")).as_bytes())?;
    let mut blocks = diagnosis::short(&findings);
    blocks.extend(crate::report::circle::short(&circle).into_iter().take(1));
    Ok(Disagreement { blocks, diagnosis: report, circle: drawn })
}

/// Progress on the terminal: a line that says what is being done.
struct Steps(ProgressBar);

impl Steps {
    fn new() -> Self {
        if super::stdout::is_quiet() || !std::io::stderr().is_terminal() {
            return Self(ProgressBar::hidden());
        }
        let bar = ProgressBar::new_spinner();
        if let Ok(style) = ProgressStyle::with_template("{spinner} {elapsed} {msg}") {
            bar.set_style(style);
        }
        bar.enable_steady_tick(Duration::from_millis(120));
        Self(bar)
    }

    fn next(&self, what: &'static str) {
        self.0.set_message(what);
    }

    fn during<T>(&self, what: &str, job: impl FnOnce(&mut dyn FnMut(&str)) -> T) -> T {
        job(&mut |part: &str| self.0.set_message(format!("{what}{part}")))
    }

    fn finish(&self) {
        self.0.finish_and_clear();
    }
}
