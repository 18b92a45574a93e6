//! `eixo excite`: an excitation signal as a trace file.

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::Context;

use super::limits;
use super::outputs;
use super::stdout::out_line;
use crate::identify::excitation::{Kind, Multisine};
use crate::report::format::{Medium, number};
use crate::trace::{AxisKind, Hold, Signal, Trace, write_csv};

/// Samples of a period of the paper's experiment (Table 1).
const PAPER_SAMPLES: usize = 2048;
/// Sampling interval of the paper's experiment, s (Table 1).
const PAPER_DT: f64 = 5.626e-4;
/// Lines of the paper's band: up to `10*kappa` harmonics, that is ten times the natural frequency.
const PAPER_LINES: usize = 100;
/// Most samples that are written: a file of some gigabytes.
const MAX_SAMPLES: usize = 100_000_000;

/// The signals on offer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Signals {
    /// Every line of the band, Schroeder's phases: a low crest factor
    Schroeder,
    /// Every line of the band, random phases
    RandomPhase,
    /// Odd lines, random phases, one line in four left out: shows even and odd nonlinearities
    Odd,
}

/// Arguments of `eixo excite`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example: eixo excite -o excitation.csv --kind odd --band 1:80 --periods 4 --rms 0.03")]
pub struct Args {
    /// Where the signal goes, as CSV with the columns time and T
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Which signal
    #[arg(long, value_enum, default_value_t = Signals::Schroeder)]
    kind: Signals,
    /// Samples of one period
    #[arg(long, default_value_t = PAPER_SAMPLES)]
    samples: usize,
    /// Sampling interval, s
    #[arg(long, default_value_t = PAPER_DT)]
    dt: f64,
    /// Band in Hz, LOW:HIGH; without it, the lines 1 to 100 of the period (the paper's experiment)
    #[arg(long, value_name = "LOW:HIGH", value_parser = band)]
    band: Option<(f64, f64)>,
    /// Number of lines from the first harmonic on, instead of a band
    #[arg(long, conflicts_with = "band")]
    lines: Option<usize>,
    /// Root mean square of the torque, N.m (N)
    #[arg(long, default_value_t = 0.03)]
    rms: f64,
    /// Amplitudes proportional to frequency^SLOPE: 0 is flat, -1 falls with frequency
    #[arg(long, default_value_t = 0.0, allow_negative_numbers = true)]
    slope: f64,
    /// Number of periods
    #[arg(long, default_value_t = 1)]
    periods: usize,
    /// Constant torque added, N.m (N)
    #[arg(long, default_value_t = 0.0, allow_negative_numbers = true)]
    offset: f64,
    /// Seed of random phases
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Write the unit of a linear axis (N) instead of N.m
    #[arg(long)]
    linear: bool,
}

fn band(text: &str) -> Result<(f64, f64), String> {
    let usage = || format!("{text:?} is not a band; write LOW:HIGH in Hz, as in 1:50");
    let (low, high) = text.split_once(':').ok_or_else(usage)?;
    let (low, high): (f64, f64) = (low.trim().parse().map_err(|_| usage())?, high.trim().parse().map_err(|_| usage())?);
    if low.is_finite() && high.is_finite() && 0.0 <= low && low < high { Ok((low, high)) } else { Err(usage()) }
}

/// Runs the command.
///
/// # Errors
/// When the signal cannot be made or the file cannot be written.
pub fn run(args: Args) -> anyhow::Result<ExitCode> {
    outputs::check([], [Some(&args.output)], [])?;
    let kind = match args.kind {
        Signals::Schroeder => Kind::Schroeder,
        Signals::RandomPhase => Kind::RandomPhase,
        Signals::Odd => Kind::Odd,
    };
    anyhow::ensure!(args.periods > 0, "--periods is 0: at least one period is needed");
    let total = args.samples.checked_mul(args.periods).filter(|n| *n <= MAX_SAMPLES);
    let total = total.with_context(|| {
        format!("{} periods of {} samples are more than {MAX_SAMPLES} samples", args.periods, args.samples)
    })?;
    limits::bearable(total as f64, 2)?;
    // As a record is examined for: nothing is sampled faster or slower.
    anyhow::ensure!((1e-9..=1e6).contains(&args.dt), "--dt is {:e} s: it must lie between 1e-9 and 1e6", args.dt);
    let signal = match args.band {
        Some((low, high)) => {
            Multisine::in_band(kind, args.samples, args.dt, low, high, args.rms, args.slope, args.seed)
        }
        None => {
            let lines = args.lines.unwrap_or(PAPER_LINES);
            Multisine::new(kind, args.samples, 1, lines, args.rms, args.slope, args.seed)
        }
    }?;
    let period = signal.period();
    let torque: Vec<f64> = (0..total).map(|k| period[k % args.samples] + args.offset).collect();
    let trace = Trace::new(0.0, args.dt, Hold::Zoh).with(Signal::T, torque)?;
    write_csv(&args.output, &trace, if args.linear { AxisKind::Linear } else { AxisKind::Rotary })?;

    let resolution = 1.0 / (args.samples as f64 * args.dt);
    let harmonic = |k: Option<&crate::identify::excitation::Line>| k.map_or(0.0, |l| l.harmonic as f64 * resolution);
    out_line!(
        "{}: {} samples at dt = {} s, {} {} of {:.6} s",
        args.output.display(),
        total,
        args.dt,
        args.periods,
        if args.periods == 1 { "period" } else { "periods" },
        args.samples as f64 * args.dt
    )?;
    out_line!(
        "lines         {} from {:.6} to {:.6} Hz",
        signal.lines.len(),
        harmonic(signal.lines.first()),
        harmonic(signal.lines.last())
    )?;
    out_line!("rms           {}", number(signal.rms(), 4, Medium::Terminal))?;
    out_line!("crest factor  {:.3}", signal.crest_factor())?;
    Ok(ExitCode::SUCCESS)
}
