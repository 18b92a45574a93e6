//! `eixo circle`: the circular test of machine tools (ISO 230-4), in simulation.

use std::io::IsTerminal;
use std::path::PathBuf;
use std::process::ExitCode;

use super::say::say;
use super::diagnosed;
use super::outputs;
use super::drives::{Drives, ideal, machine};
use crate::circle::roundness::{Roundness, bidirectional};
use crate::circle::{CircleTest, ServoAxis, run as run_test};
use crate::effects::{EFFECTS, Effect};
use crate::report::circle::{Findings, Run, report, short};
use crate::report::{html, terminal};
use crate::trace::{Machine, write_columns, write_text};

/// Arguments of `eixo circle`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  eixo circle axis.toml --radius 0.1 --feed 2 --report circle.html\n  eixo circle axis.toml --diagnosed diagnosis.json --report circle.html")]
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
    /// The circle and the drives.
    #[command(flatten)]
    test: Test,
    /// Write the path as CSV: x and y of the table, m
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Write the report as HTML
    #[arg(long, value_name = "FILE")]
    report: Option<PathBuf>,
}

/// The circle and the drives.
#[derive(Debug, Clone, Copy, clap::Args)]
pub struct Test {
    /// Radius of the circle, m
    #[arg(long, default_value_t = Test::default().radius)]
    radius: f64,
    /// Feed along the circle, m/min
    #[arg(long, default_value_t = Test::default().feed)]
    feed: f64,
    /// Turn clockwise (the figures and the path; both directions are run)
    #[arg(long)]
    clockwise: bool,
    /// The drives.
    #[command(flatten)]
    drives: Drives,
}

impl Default for Test {
    fn default() -> Self {
        Self {
            radius: 0.05,
            feed: 1.0,
            clockwise: false,
            drives: Drives::default(),
        }
    }
}

/// Runs the command.
///
/// # Errors
/// When an axis file cannot be read, the test cannot be run or a file cannot be written.
pub fn run(args: Args) -> anyhow::Result<ExitCode> {
    let inputs = [&args.axis, &args.y, &args.diagnosed, &args.diagnosed_y].into_iter().filter_map(Option::as_deref);
    outputs::check(inputs, [args.output.as_ref(), args.report.as_ref()])?;
    let x = machine(args.axis.as_deref())?;
    let y = machine(args.y.as_deref().or(args.axis.as_deref()))?;
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
    if let Some(file) = &args.report {
        write_text(file, html::page(&report(&findings)).as_bytes())?;
    }
    let colour = std::io::stdout().is_terminal();
    say!("{}", terminal::blocks(&short(&findings), terminal::Layout { colour, ..terminal::Layout::default() }))?;
    Ok(ExitCode::SUCCESS)
}

/// Runs the test with X and Y as they are and as they were found to be; without findings, with ideal axes and with the
/// axes' own effects where there are any.
///
/// # Errors
/// When the test cannot be run.
pub(super) fn findings(
    axes: &[Machine; 2],
    found: Option<&[Machine; 2]>,
    wanted: &Test,
) -> anyhow::Result<Findings> {
    let [x, y] = axes;
    let given = wanted.drives.axes(x, y)?;
    let circle = CircleTest {
        radius: wanted.radius,
        feed: wanted.feed / 60.0,
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
    let more = differences(&first, &last);
    if found.is_some() || !more.is_empty() {
        runs.push(turn(names[1].to_owned(), last)?);
    }
    let alone = if more.len() < 2 { Vec::new() } else { more };
    let alone = alone.into_iter().map(|(name, axes)| turn(name, axes)).collect::<Result<_, _>>()?;
    let on = |[x, y]: &[ServoAxis; 2], e: Effect| [x.effects.is_on(e), y.effects.is_on(e)];
    let effects = EFFECTS.iter().filter_map(|&e| {
        let place = match on(&last, e) {
            [true, true] => "X and Y",
            [true, false] => "X",
            [false, true] => "Y",
            [false, false] => return None,
        };
        Some(format!("{} on {place}", e.info().id))
    });
    let machine = if x.name == y.name { x.name.clone() } else { format!("{} and {}", x.name, y.name) };
    Ok(Findings {
        machine,
        test: circle,
        servos: given.map(|a| a.servo),
        runs,
        alone,
        effects: effects.collect(),
    })
}

/// A parameter that differs by less than this share is not told as a difference of its own.
const MATERIAL: f64 = 1e-3;

/// What the last pair of axes has and the first has not: each by itself, put on the first.
fn differences(first: &[ServoAxis; 2], last: &[ServoAxis; 2]) -> Vec<(String, [ServoAxis; 2])> {
    let pair = |change: &dyn Fn(usize) -> ServoAxis| [change(0), change(1)];
    let mut all = Vec::new();
    let differ = |f: &dyn Fn(usize) -> bool| f(0) || f(1);
    let of = |axis: &ServoAxis| [axis.parameters.i1, axis.parameters.i2, axis.parameters.b, axis.parameters.k];
    let apart = |a: f64, b: f64| (a - b).abs() > MATERIAL * a.abs().max(b.abs());
    if differ(&|i| of(&first[i]).into_iter().zip(of(&last[i])).any(|(a, b)| apart(a, b))) {
        let moved = |i: usize| ServoAxis { parameters: last[i].parameters, structure: last[i].structure, ..first[i] };
        all.push(("fitted parameters".to_owned(), pair(&moved)));
    }
    for &effect in EFFECTS {
        if differ(&|i| first[i].effects.of(effect) != last[i].effects.of(effect)) {
            let added = |i: usize| {
                let mut axis = first[i];
                axis.effects.of_mut(effect).copy_from_slice(last[i].effects.of(effect));
                axis
            };
            all.push((effect.info().id.to_owned(), pair(&added)));
        }
    }
    all
}
