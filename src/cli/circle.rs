//! `eixo circle`: the circular test of machine tools (ISO 230-4), in simulation.

use std::io::IsTerminal;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use crate::axis::{Parameters, Structure};
use crate::circle::roundness::Roundness;
use crate::circle::{CircleTest, Feedback, Servo, ServoAxis, run as run_test};
use crate::effects::{EFFECTS, Settings};
use crate::report::circle::{Findings, report, short};
use crate::report::{html, terminal};
use crate::trace::machine::Machine;
use crate::trace::{write_columns, write_text};

/// Arguments of `eixo circle`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The X axis (axis.toml), with Y's mass in its I2, as identified in place; the paper's axis without
    axis: Option<PathBuf>,
    /// The Y axis; as X without
    #[arg(long, value_name = "FILE")]
    y: Option<PathBuf>,
    /// Radius of the circle, m
    #[arg(long, default_value_t = 0.05)]
    radius: f64,
    /// Feed along the circle, m/min
    #[arg(long, default_value_t = 1.0)]
    feed: f64,
    /// Turn clockwise
    #[arg(long)]
    clockwise: bool,
    /// Sampling interval of the drives, s
    #[arg(long, default_value_t = 1e-3)]
    dt: f64,
    /// Bandwidth of the velocity loop, rad/s
    #[arg(long, default_value_t = 80.0)]
    bandwidth: f64,
    /// Position gain, 1/s; a quarter of the bandwidth without
    #[arg(long)]
    kp: Option<f64>,
    /// Torque limit of the drives, N.m (N)
    #[arg(long, default_value_t = f64::INFINITY)]
    limit: f64,
    /// Feed nothing forward
    #[arg(long)]
    no_forward: bool,
    /// Close the position loop with the table's scale instead of the motor's encoder
    #[arg(long)]
    table_scale: bool,
    /// Write the path as CSV: x and y of the table, m
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Write the report as HTML
    #[arg(long, value_name = "FILE")]
    report: Option<PathBuf>,
}

struct Described {
    name: String,
    parameters: Parameters,
    structure: Structure,
    effects: Settings,
}

fn describe(file: Option<&Path>) -> anyhow::Result<Described> {
    Ok(match file {
        None => Described {
            name: "the paper's XY table".to_owned(),
            parameters: Parameters::PAPER,
            structure: Structure::TwoInertia,
            effects: Settings::default(),
        },
        Some(file) => {
            let Machine { name, structure, parameters, effects, .. } = Machine::read(file)?;
            Described { name, parameters, structure, effects }
        }
    })
}

/// Runs the command.
///
/// # Errors
/// When an axis file cannot be read, the test cannot be run or a file cannot be written.
pub fn run(args: Args) -> anyhow::Result<ExitCode> {
    let x = describe(args.axis.as_deref())?;
    let y = describe(args.y.as_deref().or(args.axis.as_deref()))?;
    anyhow::ensure!(
        args.bandwidth.is_finite() && args.bandwidth > 0.0,
        "--bandwidth is {}: it must be greater than zero",
        args.bandwidth
    );
    anyhow::ensure!(args.limit > 0.0, "--limit is {}: it must be greater than zero", args.limit);
    let servo = |p: &Parameters| {
        let forward = if args.no_forward { 0.0 } else { 1.0 };
        Servo {
            velocity_forward: forward,
            acceleration_forward: forward,
            limit: args.limit,
            feedback: if args.table_scale { Feedback::Table } else { Feedback::Motor },
            ..Servo::tuned(p, args.bandwidth, args.kp)
        }
    };
    let servos = [servo(&x.parameters), servo(&y.parameters)];
    let test = CircleTest { radius: args.radius, feed: args.feed / 60.0, clockwise: args.clockwise, dt: args.dt };
    let mut runs = Vec::new();
    let effects: Vec<String> = [("X", &x.effects), ("Y", &y.effects)]
        .into_iter()
        .flat_map(|(axis, s)| EFFECTS.iter().filter(|e| s.is_on(**e)).map(move |e| format!("{} on {axis}", e.info().id)))
        .collect();
    for with in [false, true] {
        if with && effects.is_empty() {
            continue;
        }
        let axis = |d: &Described, servo: Servo| ServoAxis {
            parameters: d.parameters,
            structure: d.structure,
            effects: if with { d.effects } else { Settings::default() },
            servo,
        };
        let path = run_test(&axis(&x, servos[0]), &axis(&y, servos[1]), &test)?;
        let roundness = Roundness::of(&path, test.radius).ok_or_else(|| anyhow::anyhow!("the path is no circle"))?;
        runs.push((if with { "axes with their effects" } else { "ideal axes" }.to_owned(), path, roundness));
    }
    let machine = if x.name == y.name { x.name } else { format!("{} and {}", x.name, y.name) };
    let findings = Findings { machine, test, servos, runs, effects };
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
