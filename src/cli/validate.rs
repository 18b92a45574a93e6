//! `eixo validate`.

use std::io::IsTerminal;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;

use anyhow::Context;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use super::outputs;
use super::stdout::out;
use crate::fmu::contained::Host;
use crate::fmu::isolation;
use crate::fmu::output;
use crate::fmu::reference::{Wanted, compare};
use crate::fmu::rules::Outcome;
use crate::fmu::validation::{Options, validate};
use crate::report::{html, validation as page};
use crate::trace::{Hold, number, write_text};

use super::FINDINGS;

/// Nothing was found, but the FMU's behaviour could not be tested.
const NOT_TESTED: u8 = 3;

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
Each behavioural rule runs the FMU in a process of its own, with limits of time, memory and disk, in a sandbox without
network, new processes and your files (Linux: Landlock and seccomp; a line says where the kernel lacks them).

Exit code: 0 no finding of error severity (with --strict: nor a warning), 1 findings, 2 could not run, 3 no finding, but
the behaviour could not be tested (no co-simulation, no binary for this platform, a tool that is missing).

Examples:
  eixo validate axis.fmu --strict
  eixo validate axis.fmu --format junit -o validation.xml
  eixo validate model.fmu --reference model_ref.csv --report validation.html")]
pub struct Args {
    /// The FMU
    #[arg(required_unless_present = "rules")]
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
    /// Let warnings count as errors
    #[arg(long)]
    strict: bool,
    /// Test the archive and the XML alone; run nothing of the FMU
    #[arg(long = "static")]
    static_only: bool,
    /// Print the list of rules and end
    #[arg(long)]
    rules: bool,
    /// List each finding, not each cause
    #[arg(long)]
    all: bool,
    /// Longest time a call of an FMI function may take, in seconds; an FMU that is slow from the start is given more
    #[arg(long, value_name = "SECONDS", default_value_t = 10.0)]
    timeout: f64,
    /// Longest time of all behavioural rules together, in seconds; what is not reached is not tested
    #[arg(long, value_name = "SECONDS", default_value_t = 60.0)]
    budget: f64,
    /// Run the FMU in the sandbox, the default
    #[arg(long, overrides_with = "no_sandbox")]
    sandbox: bool,
    /// Run the FMU with your rights: files, network, processes
    #[arg(long, overrides_with = "sandbox")]
    no_sandbox: bool,
    /// Let the FMU read this file or folder too, as its tool's; may be given many times
    #[arg(long, value_name = "PATH")]
    allow: Vec<PathBuf>,
    /// Most memory a behavioural rule may take, in MiB
    #[arg(long, value_name = "MIB", default_value_t = 8192)]
    memory: u64,
    /// Rules tested at the same time [default: as many as there are processors]
    #[arg(short, long)]
    jobs: Option<usize>,
    /// Compare a run with reference results: a trace with a column `time` and one for each variable
    #[arg(long, value_name = "TRACE", conflicts_with = "static_only")]
    reference: Option<PathBuf>,
    /// Inputs of that run: a trace with a column `time` and one for each input
    #[arg(long, value_name = "TRACE", requires = "reference")]
    input: Option<PathBuf>,
    /// How far that run may be from the reference, as a share of its range
    #[arg(long, value_name = "SHARE", default_value_t = 0.01, requires = "reference")]
    tolerance: f64,
    /// Write the report as a page, with plots
    #[arg(long, value_name = "HTML")]
    report: Option<PathBuf>,
}

/// Runs the command.
///
/// # Errors
/// When the file cannot be read, a rule does not exist, or the report cannot be written.
pub fn run(args: Args) -> anyhow::Result<ExitCode> {
    if args.rules {
        let text = match args.format {
            Format::Text => output::rules_text(),
            _ => format!("{:#}\n", output::rules_json()),
        };
        write(&args, &text)?;
        return Ok(ExitCode::SUCCESS);
    }
    let fmu = args.fmu.as_ref().context("no FMU given")?;
    let inputs = [Some(fmu), args.reference.as_ref(), args.input.as_ref()].into_iter().flatten().map(PathBuf::as_path);
    outputs::check(inputs, [], [args.output.as_ref(), args.report.as_ref()])?;
    for (name, value) in [("--timeout", args.timeout), ("--budget", args.budget)] {
        anyhow::ensure!(value > 0.0 && value < 1e6, "{name} {}: must be above 0 and below 1e6 (s)", number(value));
    }
    for path in &args.allow {
        path.symlink_metadata().with_context(|| format!("--allow {}", path.display()))?;
    }
    let defaults = Options::new(std::env::current_exe().context("cannot find this program's own file")?);
    let options = Options {
        only: args.only.clone(),
        skip: args.skip.clone(),
        static_only: args.static_only,
        jobs: args.jobs.unwrap_or(defaults.jobs),
        call: Duration::from_secs_f64(args.timeout),
        budget: Duration::from_secs_f64(args.budget),
        memory: args.memory << 20,
        sandbox: !args.no_sandbox,
        allow: args.allow.clone(),
        ..defaults
    };
    let bar = ProgressBar::with_draw_target(
        None,
        if super::stdout::is_quiet() { ProgressDrawTarget::hidden() } else { ProgressDrawTarget::stderr() },
    );
    bar.set_style(ProgressStyle::with_template("{bar:30} {pos} of {len} rules, {eta} left  {msg}")?);
    isolation::adopt_orphans();
    let report = validate(fmu, &options, &|rule, total| {
        bar.set_length(total as u64);
        bar.set_message(rule.to_owned());
        bar.inc(1);
    });
    let comparison = args.reference.as_ref().filter(|_| report.is_ok()).map(|reference| {
        bar.set_message("reference results");
        anyhow::ensure!(
            args.tolerance > 0.0 && args.tolerance.is_finite(),
            "--tolerance {}: must be above 0",
            args.tolerance
        );
        let wanted = Wanted { reference, input: args.input.as_deref(), hold: Hold::Linear, tolerance: args.tolerance };
        let host = Host {
            program: options.program.clone(),
            sandbox: options.sandbox,
            call: Some(options.call * 20),
            memory: Some(options.memory),
        };
        compare(fmu, &wanted, &host).with_context(|| fmu.display().to_string())
    });
    isolation::end_orphans();
    bar.finish_and_clear();
    let report = report?;
    let comparison = comparison.transpose()?;
    let color = args.output.is_none() && std::io::stdout().is_terminal() && std::env::var_os("NO_COLOR").is_none();
    let text = match args.format {
        Format::Text => {
            let compared = comparison.as_ref().map(output::compared).unwrap_or_default();
            // The rules' own sentence stands last, and speaks of the rules alone.
            let against = match &comparison {
                Some(c) if !c.passes() => {
                    format!("{}: the run is outside the reference results of {}\n", fmu.display(), c.file)
                }
                _ => String::new(),
            };
            compared + &output::text(&report, args.strict, color, args.all) + &against
        }
        Format::Json => {
            let mut json = output::json(&report, args.strict);
            json["reference"] = comparison.as_ref().map_or(serde_json::Value::Null, output::compared_json);
            format!("{json:#}\n")
        }
        Format::Junit => output::junit(&report, args.strict),
        Format::Sarif => format!("{:#}\n", output::sarif(&report)),
    };
    write(&args, &text)?;
    if let Some(path) = &args.report {
        let page = page::report(&report, comparison.as_ref(), args.strict);
        write_text(path, html::page(&page).as_bytes())?;
    }
    Ok(match report.outcome(args.strict) {
        _ if comparison.is_some_and(|c| !c.passes()) => ExitCode::from(FINDINGS),
        Outcome::Passes => ExitCode::SUCCESS,
        Outcome::Fails => ExitCode::from(FINDINGS),
        Outcome::NotTested => ExitCode::from(NOT_TESTED),
    })
}

/// Writes to the file, which appears whole or not at all, or to standard output.
fn write(args: &Args, text: &str) -> anyhow::Result<()> {
    let Some(path) = &args.output else {
        return Ok(out!("{text}")?);
    };
    write_text(path, text.as_bytes())?;
    Ok(())
}
