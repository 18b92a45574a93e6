//! `eixo validate`.

use std::io::IsTerminal;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;

use anyhow::Context;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use super::say::say;
use crate::fmu::isolation::{self, Bounds};
use crate::fmu::output;
use crate::fmu::validation::{Options, validate};
use crate::trace::write_text;

use super::FINDINGS;

/// How to write the report.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum Format {
    /// For a person
    Text,
    /// For programs
    Json,
    /// For continuous integration
    Junit,
    /// For code scanning services
    Sarif,
}

/// Arguments of `eixo validate`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Each behavioural rule runs the FMU in a process of its own with limits of time and memory. That contains mistakes, not
malice: an FMU is a program, and runs with your rights.

Exit code: 0 no finding of error severity (with --strict: no finding), 1 findings, 2 could not run.

Examples:
  eixo validate axis.fmu --strict
  eixo validate axis.fmu --format junit -o validation.xml")]
pub struct Args {
    /// The FMU
    #[arg(required_unless_present_any = ["rules", "child"])]
    fmu: Option<PathBuf>,
    /// Form of the report
    #[arg(long, value_enum, default_value_t = Format::Text)]
    format: Format,
    /// Write the report to a file instead of standard output
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Test only these rules
    #[arg(long, value_name = "RULE,...", value_delimiter = ',')]
    only: Vec<String>,
    /// Leave these rules out
    #[arg(long, value_name = "RULE,...", value_delimiter = ',')]
    skip: Vec<String>,
    /// Let any finding count as an error
    #[arg(long)]
    strict: bool,
    /// Test the archive and the XML alone; run nothing of the FMU
    #[arg(long = "static")]
    static_only: bool,
    /// Print the list of rules and end
    #[arg(long)]
    rules: bool,
    /// Longest time a behavioural rule may take, in seconds
    #[arg(long, value_name = "SECONDS", default_value_t = 10.0)]
    timeout: f64,
    /// Most memory a behavioural rule may take, in MiB
    #[arg(long, value_name = "MIB", default_value_t = 8192)]
    memory: u64,
    /// Rules tested at the same time [default: as many as there are processors]
    #[arg(short, long)]
    jobs: Option<usize>,
    /// Test one rule for a parent process
    #[arg(long, hide = true, value_name = "TASK")]
    child: Option<PathBuf>,
}

/// Runs the command.
///
/// # Errors
/// When the file cannot be read, a rule does not exist, or the report cannot be written.
pub fn run(args: Args) -> anyhow::Result<ExitCode> {
    if let Some(task) = &args.child {
        return Ok(isolation::child(task));
    }
    if args.rules {
        let text = match args.format {
            Format::Text => output::rules_text(),
            _ => format!("{:#}\n", output::rules_json()),
        };
        write(&args, &text)?;
        return Ok(ExitCode::SUCCESS);
    }
    let fmu = args.fmu.as_ref().context("no FMU given")?;
    anyhow::ensure!(args.timeout > 0.0 && args.timeout < 1e6, "--timeout {}: must be above 0", args.timeout);
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let options = Options {
        only: args.only.clone(),
        skip: args.skip.clone(),
        static_only: args.static_only,
        jobs: args.jobs.unwrap_or(cores),
        bounds: Bounds { time: Duration::from_secs_f64(args.timeout), memory: args.memory << 20 },
        program: std::env::current_exe().context("cannot find this program's own file")?,
    };
    let bar = ProgressBar::with_draw_target(None, ProgressDrawTarget::stderr());
    bar.set_style(ProgressStyle::with_template("{bar:30} {pos}/{len} {msg}")?);
    isolation::adopt_orphans();
    let report = validate(fmu, &options, &|rule, total| {
        bar.set_length(total as u64);
        bar.set_message(rule.to_owned());
        bar.inc(1);
    });
    isolation::end_orphans();
    bar.finish_and_clear();
    let report = report?;
    let color = args.output.is_none() && std::io::stdout().is_terminal() && std::env::var_os("NO_COLOR").is_none();
    let text = match args.format {
        Format::Text => output::text(&report, args.strict, color),
        Format::Json => format!("{:#}\n", output::json(&report, args.strict)),
        Format::Junit => output::junit(&report, args.strict),
        Format::Sarif => format!("{:#}\n", output::sarif(&report)),
    };
    write(&args, &text)?;
    Ok(if report.passes(args.strict) { ExitCode::SUCCESS } else { ExitCode::from(FINDINGS) })
}

/// Writes to the file, which appears whole or not at all, or to standard output.
fn write(args: &Args, text: &str) -> anyhow::Result<()> {
    let Some(path) = &args.output else {
        return Ok(say!("{text}")?);
    };
    write_text(path, text.as_bytes())?;
    Ok(())
}
