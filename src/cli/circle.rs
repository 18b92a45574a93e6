//! `eixo circle`: the circular test of machine tools (ISO 230-4), in simulation and as measured.

use std::f64::consts::TAU;
use std::path::PathBuf;
use std::process::ExitCode;

use super::diagnosed;
use super::drives::{Drives, ideal, machine};
use super::examined::finite;
use super::outputs;
use super::stdout::out;
use crate::circle::measured::{Given, Part};
use crate::circle::roundness::{Roundness, SHOWN, bidirectional};
use crate::circle::trace::{analyse, turns};
use crate::circle::{CircleTest, ServoAxis, run as run_test};
use crate::effects::{EFFECTS, Effect, Length};
pub(super) use crate::report::circle::Findings;
use crate::report::circle::{Run, report, short};
use crate::report::{Block, Report, ballbar, html, terminal};
use crate::trace::{Machine, write_columns, write_text};

/// Arguments of `eixo circle`.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  eixo circle axis.toml --radius 0.1 --feed 2 --report circle.html\n  eixo circle axis.toml --diagnosed diagnosis.json --report circle.html\n  eixo circle --measured ccw.csv cw.csv --report ballbar.html"
)]
pub struct Args {
    /// The X axis (axis.toml), with Y's mass in its I2, as identified in place; the paper's axis without
    axis: Option<PathBuf>,
    /// The Y axis; as X without
    #[arg(long, value_name = "FILE")]
    y: Option<PathBuf>,
    /// What was found on X: diagnosis.json, the improved FMU or an axis.toml; compared with the axes as given
    #[arg(long, value_name = "FILE")]
    diagnosed: Option<PathBuf>,
    /// What was found on Y; as on X without
    #[arg(long, value_name = "FILE", requires = "diagnosed")]
    diagnosed_y: Option<PathBuf>,
    /// A measured test in place of a simulated one: one or two files (a ballbar's or a control's export, CSV) of angle and radius or
    /// deviation, or of X and Y. With an axis file its model stands beside it
    #[arg(long, value_name = "FILE", num_args = 1..=2, conflicts_with_all = ["diagnosed", "output"])]
    measured: Vec<PathBuf>,
    /// Which way the measured turns go, in the order of the files, where they do not say it
    #[arg(long, value_name = "ccw|cw", value_delimiter = ',', value_parser = direction, requires = "measured")]
    directions: Vec<bool>,
    /// First time used of a measured turn, s, as its file counts it
    #[arg(long, allow_negative_numbers = true, value_name = "S", value_parser = finite, requires = "measured")]
    from: Option<f64>,
    /// Last time used of a measured turn, s
    #[arg(long, allow_negative_numbers = true, value_name = "S", value_parser = finite, requires = "measured")]
    to: Option<f64>,
    /// The circle and the drives.
    #[command(flatten)]
    test: Test,
    /// Write the path as CSV: x and y of the table, m
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Write the report as HTML
    #[arg(long, value_name = "FILE")]
    report: Option<PathBuf>,
    /// Write the figures as JSON
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

/// Clockwise or not.
fn direction(text: &str) -> Result<bool, String> {
    match text.to_ascii_lowercase().as_str() {
        "cw" => Ok(true),
        "ccw" => Ok(false),
        _ => Err("ccw (counter-clockwise) or cw (clockwise)".to_owned()),
    }
}

/// The circle and the drives.
#[derive(Debug, Clone, Copy, Default, clap::Args)]
pub struct Test {
    /// Radius of the circle, m; 0.05 without, of a measured one what it says itself
    #[arg(long)]
    pub(super) radius: Option<f64>,
    /// Feed along the circle, m/min; 1 without, of a measured one what it says itself
    #[arg(long)]
    pub(super) feed: Option<f64>,
    /// Turn clockwise (the figures and the path; both directions are run)
    #[arg(long)]
    pub(super) clockwise: bool,
    /// The drives.
    #[command(flatten)]
    pub(super) drives: Drives,
}

/// Radius of a simulated circle, m, and feed along it, m/min, where none is given.
const RADIUS: f64 = 0.05;
const FEED: f64 = 1.0;

/// Runs the command.
///
/// # Errors
/// When an axis file cannot be read, the test cannot be run or a file cannot be written.
pub fn run(args: Args) -> anyhow::Result<ExitCode> {
    let inputs = [&args.axis, &args.y, &args.diagnosed, &args.diagnosed_y].into_iter().filter_map(Option::as_deref);
    let inputs = inputs.chain(args.measured.iter().map(PathBuf::as_path));
    outputs::check(inputs, [args.output.as_ref()], [args.report.as_ref(), args.json.as_ref()])?;
    let x = machine(args.axis.as_deref())?;
    let y = machine(args.y.as_deref().or(args.axis.as_deref()))?;
    if !args.measured.is_empty() {
        let axes = [x, y];
        let known = (args.axis.is_some() || args.y.is_some()).then_some(&axes);
        let given = Given {
            radius: args.test.radius,
            feed: args.test.feed.map(|f| f / 60.0),
            clockwise: args.directions.clone(),
            part: Part { from: args.from, to: args.to },
        };
        let found = super::circle_measured::findings(&args.measured, &given, &args.test, known)?;
        return write_out(
            &args,
            || ballbar::report(&found),
            || super::circle_json::measured(&found),
            &ballbar::short(&found),
        );
    }
    let found = match &args.diagnosed {
        None => None,
        Some(file) => {
            let on_y = args.diagnosed_y.as_ref().unwrap_or(file);
            Some([diagnosed::apply(&x, file)?, diagnosed::apply(&y, on_y)?])
        }
    };
    let findings = findings(&[x, y], found.as_ref(), &args.test)?;
    if let (Some(file), Some(Run { paths: [path, _], .. })) = (&args.output, findings.runs.last()) {
        write_columns(file, &[("x [m]", &path.x), ("y [m]", &path.y)])?;
    }
    write_out(&args, || report(&findings), || super::circle_json::simulated(&findings), &short(&findings))
}

/// Writes what was asked for and prints the short form.
fn write_out(
    args: &Args,
    page: impl Fn() -> Report,
    json: impl Fn() -> serde_json::Value,
    short: &[Block],
) -> anyhow::Result<ExitCode> {
    if let Some(file) = &args.json {
        write_text(file, &serde_json::to_vec_pretty(&json())?)?;
    }
    if let Some(file) = &args.report {
        write_text(file, html::page(&page()).as_bytes())?;
    }
    out!("{}", terminal::blocks(short, super::stdout::layout(super::stdout::WIDTH)))?;
    Ok(ExitCode::SUCCESS)
}

/// Runs the test with X and Y as they are and as they were found to be; without findings, with ideal axes and with the
/// axes' own effects where there are any.
///
/// # Errors
/// When the test cannot be run.
pub(super) fn findings(axes: &[Machine; 2], found: Option<&[Machine; 2]>, wanted: &Test) -> anyhow::Result<Findings> {
    let [x, y] = axes;
    let given = wanted.drives.axes(x, y)?;
    let circle = CircleTest {
        radius: wanted.radius.unwrap_or(RADIUS),
        feed: wanted.feed.unwrap_or(FEED) / 60.0,
        clockwise: wanted.clockwise,
        dt: wanted.drives.dt,
    };
    let turn = |name: String, [x, y]: [ServoAxis; 2]| -> anyhow::Result<Run> {
        let back = CircleTest { clockwise: !circle.clockwise, ..circle };
        let paths = [run_test(&x, &y, &circle)?, run_test(&x, &y, &back)?];
        let no_circle = || anyhow::anyhow!("the path is no circle");
        let [one, other] = [0, 1].map(|i: usize| Roundness::of(&paths[i], circle.radius).ok_or_else(no_circle));
        Ok(Run { name, roundness: [one?, other?], both: bidirectional(&paths).ok_or_else(no_circle)?, paths })
    };
    // The drives stay as they were tuned for the axes as given.
    let (first, last, names) = match found {
        None => (given.map(ideal), given, ["ideal axes", "axes with their effects"]),
        Some([on_x, on_y]) => {
            let as_found = wanted.drives.axes(on_x, on_y)?;
            let last = [0, 1].map(|i: usize| ServoAxis { servo: given[i].servo, ..as_found[i] });
            (given, last, ["nominal model", "diagnosed model"])
        }
    };
    let mut runs = vec![turn(names[0].to_owned(), first)?];
    let less = differences(&first, &last);
    if found.is_some() || !less.is_empty() {
        runs.push(turn(names[1].to_owned(), last)?);
    }
    let less = if less.len() < 2 { Vec::new() } else { less };
    let without =
        less.into_iter().map(|(name, axes)| turn(format!("without {name}"), axes)).collect::<Result<_, _>>()?;
    let analysis = runs.last().filter(|run| run.both >= SHOWN).and_then(|run| {
        let [one, other] = run.paths.clone();
        let (turns, _) = turns(&[(circle.clockwise, one), (!circle.clockwise, other)], circle.radius)?;
        analyse(&turns, circle.radius, Some(circle.feed))
    });
    let on = |[x, y]: &[ServoAxis; 2], e: Effect| [x.effects.is_on(e), y.effects.is_on(e)];
    let effects = EFFECTS.iter().filter_map(|&e| {
        let place = match on(&last, e) {
            [true, true] => "X and Y",
            [true, false] => "X",
            [false, true] => "Y",
            [false, false] => return None,
        };
        let at = usize::from(!last[0].effects.is_on(e));
        let length = in_millimetres(e, last[at].effects.of(e), last[at].parameters.rho);
        Some(format!("{} on {place}{}", e.info().id, length.map_or_else(String::new, |l| format!(" ({l})"))))
    });
    let machine = if x.name == y.name { x.name.clone() } else { format!("{} and {}", x.name, y.name) };
    Ok(Findings {
        machine,
        test: circle,
        servos: given.map(|a| a.servo),
        motion: [x.signals.motion, y.signals.motion],
        runs,
        without,
        analysis,
        effects: effects.collect(),
    })
}

/// A parameter that differs by less than this share is not shown as a difference of its own.
const MATERIAL: f64 = 1e-3;

/// What an effect's angle is on the table.
fn in_millimetres(effect: Effect, values: &[f64], rho: f64) -> Option<String> {
    let every = |order: f64| (order > 0.0).then(|| format!("every {:.4} mm", 1e3 * TAU * rho / order));
    match effect.length()? {
        Length::HalfPlay(p) => Some(format!("{:.3} µm", 2e6 * rho * values.get(p)?)),
        Length::Periods(p) => every(*values.get(p)?),
        Length::Turn => every(1.0),
    }
}

/// What the last pair of axes has and the first has not: the last without each of it.
fn differences(first: &[ServoAxis; 2], last: &[ServoAxis; 2]) -> Vec<(String, [ServoAxis; 2])> {
    let pair = |change: &dyn Fn(usize) -> ServoAxis| [change(0), change(1)];
    let mut all = Vec::new();
    let differ = |f: &dyn Fn(usize) -> bool| f(0) || f(1);
    let of = |axis: &ServoAxis| [axis.parameters.i1, axis.parameters.i2, axis.parameters.b, axis.parameters.k];
    let apart = |a: f64, b: f64| (a - b).abs() > MATERIAL * a.abs().max(b.abs());
    if differ(&|i| of(&first[i]).into_iter().zip(of(&last[i])).any(|(a, b)| apart(a, b))) {
        let back = |i: usize| ServoAxis { parameters: first[i].parameters, structure: first[i].structure, ..last[i] };
        all.push(("the fitted parameters".to_owned(), pair(&back)));
    }
    for &effect in EFFECTS {
        if differ(&|i| first[i].effects.of(effect) != last[i].effects.of(effect)) {
            let taken = |i: usize| {
                let mut axis = last[i];
                axis.effects.of_mut(effect).copy_from_slice(first[i].effects.of(effect));
                axis
            };
            all.push((effect.info().id.to_owned(), pair(&taken)));
        }
    }
    all
}
