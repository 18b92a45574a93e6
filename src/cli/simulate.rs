//! `eixo simulate`.

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Duration;

use anyhow::{Context, bail};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::examined::Part;
use super::limits;
use super::names::{hold, offering, settings, signals, signals_equal, text};
use super::outputs;
use super::stdout::out_line;
use crate::fmu::contained::{self, Host, simulate};
use crate::fmu::isolation;
use crate::fmu::package::Package;
use crate::fmu::simulate::{Inputs, Options, Rows, Setting, SimulationResult, parse_setting};
use crate::report::format::printable;
use crate::trace::{Hold, Machine, Table, load, nearest, write_columns};

/// Arguments of `eixo simulate`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  eixo simulate axis.fmu --input excitation.csv -o trace.csv
  eixo simulate axis.toml --input u.csv -o log.csv --set coulomb_motor.level=0.004 --noise theta1=1e-4 --seed 7")]
pub struct Args {
    /// An FMU, or an axis.toml, which is exported first
    pub model: PathBuf,
    /// Input trace (CSV, Parquet, MATLAB 5): a column `time`, and one for each input of the FMU (T)
    #[arg(short, long, value_name = "FILE")]
    pub input: Option<PathBuf>,
    /// Where the trace goes, as CSV
    #[arg(short, long, value_name = "CSV")]
    pub output: PathBuf,
    /// A parameter or start value, as in coulomb_motor.level=0.01; may be given many times
    #[arg(long, visible_alias = "start-value", value_name = "NAME=VALUE", value_parser = offering(parse_setting, settings), hide_possible_values = true)]
    pub set: Vec<Setting>,
    /// Outputs to record, separated by commas; all by default
    #[arg(long, value_name = "NAME,...", value_delimiter = ',', value_parser = text(signals), hide_possible_values = true)]
    pub outputs: Vec<String>,
    /// White noise on the recorded outputs: NAME=STANDARD_DEVIATION, or a signal-to-noise ratio for all of them, as in 60dB
    #[arg(long, value_name = "NOISE", value_delimiter = ',', value_parser = offering(parse_noise, signals_equal), hide_possible_values = true)]
    pub noise: Vec<Noise>,
    /// Seed of the noise
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// What the inputs do between samples; by default what the axis.toml says, else zoh
    #[arg(long, value_parser = hold("Held over the sample", "A straight line between samples"))]
    pub hold: Option<Hold>,
    /// Start, s; by default the input's
    #[arg(long, visible_alias = "start-time", allow_negative_numbers = true)]
    pub start: Option<f64>,
    /// End, s; by default the input's
    #[arg(long, visible_alias = "stop-time", allow_negative_numbers = true)]
    pub stop: Option<f64>,
    /// Communication step, s; by default the input's sampling interval
    #[arg(long, visible_alias = "output-interval")]
    pub step: Option<f64>,
    /// Close the drive's loop of the axis.toml's `[controller]`: the input is the trace of the reference, T what the drive commands
    #[arg(long, requires = "input", conflicts_with_all = ["start", "stop", "step", "step_end", "hold"])]
    pub controlled: bool,
    /// Record the outputs as each step left them, before the next inputs are set (as most importers do)
    #[arg(long)]
    pub step_end: bool,
    /// FMI 3.0: handle events in event mode, if the FMU has it (always so with an FMU that has clocks)
    #[arg(long)]
    pub event_mode: bool,
    /// FMI 3.0: let steps return early at events, and go on from there to the next row
    #[arg(long)]
    pub early_return: bool,
    #[command(flatten)]
    pub part: Part,
    /// Run the FMU in a sandbox: no network, no new processes, no files but its own (as `validate` does)
    #[arg(long)]
    pub sandbox: bool,
    /// Longest time a call of an FMI function may take, s; no limit by default
    #[arg(long, value_name = "SECONDS")]
    pub timeout: Option<f64>,
}

/// Noise to add.
#[derive(Debug, Clone, PartialEq)]
pub enum Noise {
    /// Standard deviation on one column.
    Column(String, f64),
    /// Signal-to-noise ratio of every output, dB, by root mean square.
    Ratio(f64),
}

fn parse_noise(text: &str) -> Result<Noise, String> {
    let usage =
        || format!("{text:?} is no noise; write NAME=STANDARD_DEVIATION, as in theta1=1e-5, or a ratio, as in 60dB");
    let number = |text: &str| text.trim().parse::<f64>().ok().filter(|x| x.is_finite()).ok_or_else(usage);
    match text.split_once('=') {
        Some((name, std)) => Ok(Noise::Column(
            name.trim().to_owned(),
            number(std).and_then(|x| if x >= 0.0 { Ok(x) } else { Err(usage()) })?,
        )),
        None => {
            let ratio = text.strip_suffix("dB").or_else(|| text.strip_suffix("db")).ok_or_else(usage)?;
            Ok(Noise::Ratio(number(ratio)?))
        }
    }
}

/// Adds the noise; each column draws from a stream of its own, so that one column's noise does not depend on the others.
fn add_noise(record: &mut SimulationResult, noise: &[Noise], seed: u64) -> anyhow::Result<()> {
    for wanted in noise {
        if let Noise::Column(name, _) = wanted
            && !record.columns.iter().any(|c| c.name == *name)
        {
            let names: Vec<&str> = record.columns.iter().map(|c| c.name.as_str()).collect();
            let near = nearest(name, names.iter().copied());
            bail!("--noise {name}: no such column is recorded{near}; the columns are: {}", names.join(", "));
        }
    }
    for (stream, column) in record.columns.iter_mut().enumerate() {
        let square: f64 = noise
            .iter()
            .map(|n| match n {
                Noise::Column(name, std) if *name == column.name => std * std,
                Noise::Ratio(ratio) if !column.input => {
                    let power = column.values.iter().map(|v| v * v).sum::<f64>() / column.values.len().max(1) as f64;
                    power * 10_f64.powf(-ratio / 10.0)
                }
                _ => 0.0,
            })
            .sum();
        if square > 0.0 {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            rng.set_stream(stream as u64);
            let std = square.sqrt();
            for value in &mut column.values {
                let draw: f64 = StandardNormal.sample(&mut rng);
                *value += std * draw;
            }
        }
    }
    Ok(())
}

/// The model: an axis file is exported into a temporary folder and run as an FMU, as any other tool would.
struct Model {
    fmu: PathBuf,
    machine: Option<Machine>,
    _folder: Option<tempfile::TempDir>,
}

fn open(path: &Path) -> anyhow::Result<Model> {
    if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("toml")) {
        let machine = Machine::read(path)?;
        let folder = isolation::temporary::folder().context("cannot make a temporary folder")?;
        let fmu = folder.path().join("axis.fmu");
        Package::of(&machine).with_context(|| path.display().to_string())?.write(&fmu)?;
        return Ok(Model { fmu, machine: Some(machine), _folder: Some(folder) });
    }
    Ok(Model { fmu: path.to_owned(), machine: None, _folder: None })
}

/// Runs the command.
///
/// # Errors
/// When the FMU or the input cannot be used, the FMU stops, or the trace cannot be written.
pub fn run(args: Args) -> anyhow::Result<ExitCode> {
    let inputs = std::iter::once(args.model.as_path()).chain(args.input.as_deref());
    outputs::check(inputs, [Some(&args.output)], [])?;
    if args.controlled {
        return controlled(args);
    }
    let Model { fmu, machine, _folder } = open(&args.model)?;
    let name = || args.model.display().to_string();
    let description = contained::describe(&fmu).with_context(name)?;
    if let Some(timeout) = args.timeout {
        anyhow::ensure!(timeout > 0.0 && timeout < 1e9, "--timeout {timeout}: must be above 0");
    }
    let mut hold = args.hold;
    let inputs = match (&args.input, &machine) {
        (None, _) => Inputs::default(),
        // The axis file says how its own log's columns are named.
        (Some(path), Some(machine)) => {
            let loaded = load(path, &args.part.of(machine.signals.clone()))?;
            loaded.warnings.iter().for_each(|w| eprintln!("warning: {}", printable(w)));
            hold = hold.or(Some(loaded.trace.hold));
            Inputs::of(&loaded.trace)?
        }
        (Some(path), None) => {
            let inputs = Inputs::from_table(&Table::read(path)?, &description)?;
            inputs.part(args.part.from, args.part.to, args.part.resample)?
        }
    };
    let options = Options {
        start: args.start,
        stop: args.stop,
        step: args.step,
        hold: hold.unwrap_or_default(),
        settings: args.set,
        outputs: args.outputs,
        rows: if args.step_end { Rows::StepEnd } else { Rows::InputsSet },
        event_mode: args.event_mode,
        early_return: args.early_return,
    };
    // What the run would be, where that is asked for: the run itself says what is wrong with it otherwise.
    let stop = options.stop.or(inputs.time.last().copied());
    if let (Some(stop), Some(step)) = (stop, options.step.or(inputs.dt))
        && step > 0.0
    {
        let start = options.start.or(inputs.time.first().copied()).unwrap_or(0.0);
        limits::bearable(((stop - start) / step).max(0.0), 2 + options.outputs.len().max(8))?;
    }
    let host = Host::new().context("cannot find this program's own file")?;
    let host = Host { sandbox: args.sandbox, call: args.timeout.map(Duration::from_secs_f64), ..host };
    isolation::adopt_orphans();
    let record = simulate(&fmu, &inputs, &options, &host);
    isolation::end_orphans();
    let record = record.with_context(name)?;
    finish(record, &args.output, &args.noise, args.seed)
}

/// The same in the drive's loop, on the model itself.
fn controlled(args: Args) -> anyhow::Result<ExitCode> {
    anyhow::ensure!(
        args.model.extension().is_some_and(|e| e.eq_ignore_ascii_case("toml")),
        "--controlled takes an axis.toml with a [controller]; {} is none",
        args.model.display()
    );
    let machine = Machine::read(&args.model)?;
    let input = args.input.as_deref().context("--controlled needs --input: the trace of the reference")?;
    let mut record = super::controlled::simulate(
        &Machine { signals: args.part.of(machine.signals.clone()), ..machine },
        input,
        &args.set,
    )?;
    if let Some(name) = args.outputs.iter().find(|name| !record.columns.iter().any(|c| c.name == **name)) {
        let names: Vec<&str> = record.columns.iter().map(|c| c.name.as_str()).collect();
        bail!("--outputs {name}: in the loop there are {}", names.join(", "));
    }
    record.columns.retain(|c| c.input || args.outputs.is_empty() || args.outputs.contains(&c.name));
    finish(record, &args.output, &args.noise, args.seed)
}

/// Adds the noise, writes the trace, and says so.
fn finish(mut record: SimulationResult, output: &Path, noise: &[Noise], seed: u64) -> anyhow::Result<ExitCode> {
    add_noise(&mut record, noise, seed)?;
    let table = record.table();
    let columns: Vec<(&str, &[f64])> = table.iter().map(|(name, values)| (name.as_str(), *values)).collect();
    write_columns(output, &columns)?;
    record.notes.iter().for_each(|note| eprintln!("note: {note}"));
    out_line!(
        "{}: {} rows, {} s to {} s, {} columns",
        output.display(),
        record.time.len(),
        crate::trace::number(record.time.first().copied().unwrap_or(0.0)),
        crate::trace::number(record.time.last().copied().unwrap_or(0.0)),
        columns.len()
    )?;
    Ok(ExitCode::SUCCESS)
}
