//! The command line: arguments, and one file a command.
//!
//! Exit codes: 0 fine, 1 findings, 2 could not run.

use std::process::ExitCode;

use clap::{Parser, Subcommand};

use crate::fmu::isolation;

/// Could not run: bad input, unreadable file, unwritable output.
pub const COULD_NOT_RUN: u8 = 2;
/// The command ran and has findings to report.
pub const FINDINGS: u8 = 1;

/// The drive axis of a machine tool: FMU, identification, and diagnosis of the gap between model and machine.
#[derive(Debug, Parser)]
#[command(name = "eixo", version, about, propagate_version = true)]
#[command(after_help = "Exit codes: 0 fine, 1 findings, 2 could not run.

Examples:
  eixo demo
  eixo identify trace.csv --report identification.html
  eixo diagnose log.csv --axis axis.toml --report diagnosis.html")]
pub struct Cli {
    /// Print no results and no progress: only warnings and errors; files are written and the exit code tells
    #[arg(long, short, global = true)]
    pub quiet: bool,
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

// Plain declarations: the formatter does not follow those that a macro makes.
mod circle;
mod circle_json;
mod circle_measured;
mod completions;
mod controlled;
mod demo;
mod diagnose;
mod diagnosed;
mod drives;
mod effects;
mod examined;
mod excite;
mod export;
mod held;
mod identify;
mod info;
mod info3;
mod init;
mod inspect;
mod limits;
mod man;
mod many;
mod names;
mod outputs;
mod progress;
mod serve;
mod simulate;
mod stdout;
mod validate;

macro_rules! commands {
    ($($(#[$doc:meta])* $name:ident => $module:ident),* $(,)?) => {
        /// The commands, one file each.
        #[derive(Debug, Subcommand)]
        pub enum Command {
            $($(#[$doc])* $name($module::Args),)*
        }

        impl Command {
            fn run(self) -> anyhow::Result<ExitCode> {
                match self {
                    $(Self::$name(args) => $module::run(args),)*
                }
            }
        }
    };
}

commands! {
    /// Run the main job on bundled data, start to finish, ending in an HTML report
    Demo => demo,
    /// Make an excitation: Schroeder, random-phase or odd multisine
    Excite => excite,
    /// Export the axis as a co-simulation FMU of FMI 2.0 or 3.0
    Export => export,
    /// Drive an FMU, or the axis of an axis.toml, with an input trace and record the outputs
    Simulate => simulate,
    /// Validate any FMU of FMI 2.0 or 3.0, by what its XML says and by what its binary does
    Validate => validate,
    /// List platforms, capabilities, variables and units of any FMU
    Info => info,
    /// Look at a foreign log and write the axis.toml that reads it
    Init => init,
    /// Examine a record before it is believed: dead, stuck, swapped or turned sensors, units, time stamps
    Inspect => inspect,
    /// Identify the axis from a trace
    Identify => identify,
    /// Diagnose the gap between the model and a measured trace: where, which effect, how far it shrinks
    Diagnose => diagnose,
    /// Circular test (ISO 230-4), measured or in simulation: what deviates, and what each takes of the circularity
    Circle => circle,
    /// Serve a page on this computer alone: bring a log, confirm its columns, diagnose it, open the report
    Serve => serve,
    /// List the effects that a nominal axis leaves out: place, equation, parameters, signature
    Effects => effects,
    /// Write a completion script for a shell
    Completions => completions,
    /// Write the manual page
    Man => man,
}

/// Parses the arguments, runs the command, prints an error with its causes, and gives the exit code.
#[must_use]
pub fn main() -> ExitCode {
    outputs::survive_limits();
    // A validation starts one child for each rule: they have no use for the parser of the command line.
    if std::env::args_os().skip(1).eq(isolation::CHILD) {
        return isolation::child();
    }
    let cli = Cli::parse();
    if cli.quiet {
        stdout::be_quiet();
    }
    match cli.command.run() {
        Ok(code) => code,
        Err(error) => {
            if let Some(refused) = error.downcast_ref::<examined::Refused>() {
                let written = stdout::out!(
                    "{}",
                    crate::report::terminal::blocks(&refused.blocks(), stdout::layout(stdout::WIDTH))
                );
                return ExitCode::from(if written.is_ok() { FINDINGS } else { COULD_NOT_RUN });
            }
            eprintln!("error: {}", crate::report::format::printable(&format!("{error:#}")));
            ExitCode::from(COULD_NOT_RUN)
        }
    }
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    #[test]
    fn the_argument_parser_is_consistent() {
        super::Cli::command().debug_assert();
    }

    #[test]
    fn every_help_ends_with_an_example() {
        let mut program = super::Cli::command();
        program.build();
        let ends = |command: &mut clap::Command, call: &str| {
            let help = command.render_long_help().to_string();
            let last = help.trim_end().rsplit("\n\n").next().unwrap_or_default().to_owned();
            assert!(last.starts_with("Example") && last.contains(call), "{call}: {last}");
        };
        ends(&mut program.clone(), "eixo ");
        for command in program.get_subcommands().filter(|c| c.get_name() != "help") {
            ends(&mut command.clone(), &format!("eixo {}", command.get_name()));
        }
    }
}
