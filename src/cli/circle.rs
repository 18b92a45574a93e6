//! `eixo circle`: the circular test of machine tools (ISO 230-4), in simulation.

use std::io::IsTerminal;
use std::path::PathBuf;
use std::process::ExitCode;

use super::drives::{Drives, ideal, machine};
use crate::circle::roundness::Roundness;
use crate::circle::{CircleTest, run as run_test};
use crate::effects::EFFECTS;
use crate::report::circle::{Findings, report, short};
use crate::report::{html, terminal};
use crate::trace::{Machine, write_columns, write_text};

/// Arguments of `eixo circle`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example: eixo circle axis.toml --radius 0.1 --feed 2 --report circle.html")]
pub struct Args {
    /// The X axis (axis.toml), with Y's mass in its I2, as identified in place; the paper's axis without
    axis: Option<PathBuf>,
    /// The Y axis; as X without
    #[arg(long, value_name = "FILE")]
    y: Option<PathBuf>,
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
    /// Turn clockwise
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
    let x = machine(args.axis.as_deref())?;
    let y = machine(args.y.as_deref().or(args.axis.as_deref()))?;
    let findings = findings(&x, &y, &args.test)?;
    if let (Some(file), Some((_, path, _))) = (&args.output, findings.runs.last()) {
        write_columns(file, &[("x [m]", &path.x), ("y [m]", &path.y)])?;
    }
    if let Some(file) = &args.report {
        write_text(file, html::page(&report(&findings)).as_bytes())?;
    }
    let colour = std::io::stdout().is_terminal();
    print!("{}", terminal::blocks(&short(&findings), terminal::Layout { colour, ..terminal::Layout::default() }));
    Ok(ExitCode::SUCCESS)
}

/// Runs the test with ideal axes, and with the axes' effects where there are any.
///
/// # Errors
/// When the test cannot be run.
pub(super) fn findings(x: &Machine, y: &Machine, wanted: &Test) -> anyhow::Result<Findings> {
    let axes = wanted.drives.axes(x, y)?;
    let test =
        CircleTest { radius: wanted.radius, feed: wanted.feed / 60.0, clockwise: wanted.clockwise, dt: wanted.drives.dt };
    let mut runs = Vec::new();
    let effects: Vec<String> = [("X", &x.effects), ("Y", &y.effects)]
        .into_iter()
        .flat_map(|(axis, s)| EFFECTS.iter().filter(|e| s.is_on(**e)).map(move |e| format!("{} on {axis}", e.info().id)))
        .collect();
    for with in [false, true] {
        if with && effects.is_empty() {
            continue;
        }
        let [x, y] = if with { axes } else { axes.map(ideal) };
        let path = run_test(&x, &y, &test)?;
        let roundness = Roundness::of(&path, test.radius).ok_or_else(|| anyhow::anyhow!("the path is no circle"))?;
        runs.push((if with { "axes with their effects" } else { "ideal axes" }.to_owned(), path, roundness));
    }
    let machine = if x.name == y.name { x.name.clone() } else { format!("{} and {}", x.name, y.name) };
    Ok(Findings { machine, test, servos: axes.map(|a| a.servo), runs, effects })
}
