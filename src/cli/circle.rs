//! `eixo circle`: the circular test of machine tools (ISO 230-4), in simulation.

use std::io::IsTerminal;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use crate::axis::Parameters;
use crate::circle::roundness::Roundness;
use crate::circle::{CircleTest, Feedback, Servo, ServoAxis, run as run_test};
use crate::effects::{EFFECTS, Settings};
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
    /// Sampling interval of the drives, s
    #[arg(long, default_value_t = Test::default().dt)]
    dt: f64,
    /// Bandwidth of the velocity loop, rad/s
    #[arg(long, default_value_t = Test::default().bandwidth)]
    bandwidth: f64,
    /// Position gain, 1/s; a quarter of the bandwidth without
    #[arg(long)]
    kp: Option<f64>,
    /// Torque limit of the drives, N.m (N)
    #[arg(long, default_value_t = Test::default().limit)]
    limit: f64,
    /// Feed nothing forward
    #[arg(long)]
    no_forward: bool,
    /// Close the position loop with the table's scale instead of the motor's encoder
    #[arg(long)]
    table_scale: bool,
}

impl Default for Test {
    fn default() -> Self {
        Self {
            radius: 0.05,
            feed: 1.0,
            clockwise: false,
            dt: 1e-3,
            bandwidth: 80.0,
            kp: None,
            limit: f64::INFINITY,
            no_forward: false,
            table_scale: false,
        }
    }
}

fn describe(file: Option<&Path>) -> anyhow::Result<Machine> {
    Ok(match file {
        None => Machine::default(),
        Some(file) => Machine::read(file)?,
    })
}

/// Runs the command.
///
/// # Errors
/// When an axis file cannot be read, the test cannot be run or a file cannot be written.
pub fn run(args: Args) -> anyhow::Result<ExitCode> {
    let x = describe(args.axis.as_deref())?;
    let y = describe(args.y.as_deref().or(args.axis.as_deref()))?;
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
    anyhow::ensure!(
        wanted.bandwidth.is_finite() && wanted.bandwidth > 0.0,
        "--bandwidth is {}: it must be greater than zero",
        wanted.bandwidth
    );
    anyhow::ensure!(wanted.limit > 0.0, "--limit is {}: it must be greater than zero", wanted.limit);
    let servo = |p: &Parameters| {
        let forward = if wanted.no_forward { 0.0 } else { 1.0 };
        Servo {
            velocity_forward: forward,
            acceleration_forward: forward,
            limit: wanted.limit,
            feedback: if wanted.table_scale { Feedback::Table } else { Feedback::Motor },
            ..Servo::tuned(p, wanted.bandwidth, wanted.kp)
        }
    };
    let servos = [servo(&x.parameters), servo(&y.parameters)];
    let test =
        CircleTest { radius: wanted.radius, feed: wanted.feed / 60.0, clockwise: wanted.clockwise, dt: wanted.dt };
    let mut runs = Vec::new();
    let effects: Vec<String> = [("X", &x.effects), ("Y", &y.effects)]
        .into_iter()
        .flat_map(|(axis, s)| EFFECTS.iter().filter(|e| s.is_on(**e)).map(move |e| format!("{} on {axis}", e.info().id)))
        .collect();
    for with in [false, true] {
        if with && effects.is_empty() {
            continue;
        }
        let axis = |d: &Machine, servo: Servo| ServoAxis {
            parameters: d.parameters,
            structure: d.structure,
            effects: if with { d.effects } else { Settings::default() },
            servo,
        };
        let path = run_test(&axis(x, servos[0]), &axis(y, servos[1]), &test)?;
        let roundness = Roundness::of(&path, test.radius).ok_or_else(|| anyhow::anyhow!("the path is no circle"))?;
        runs.push((if with { "axes with their effects" } else { "ideal axes" }.to_owned(), path, roundness));
    }
    let machine = if x.name == y.name { x.name.clone() } else { format!("{} and {}", x.name, y.name) };
    Ok(Findings { machine, test, servos, runs, effects })
}
