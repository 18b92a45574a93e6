//! What `diagnose` and `identify` have in common with many traces.

use std::io::IsTerminal;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Duration;

use anyhow::Context;
use indicatif::{ProgressBar, ProgressStyle};

use super::stdout::{out, out_line};
use super::{COULD_NOT_RUN, FINDINGS};
use crate::fleet::{Found, Item, Plan, find, is_many, run};
use crate::report::terminal;

/// Arguments for many traces.
#[derive(Debug, clap::Args)]
#[command(next_help_heading = "Many traces")]
pub struct Many {
    /// The folder for the results: results/, reports/, summary.csv and index.html. What an earlier run finished is used again
    /// when trace, axis file, options and program are the same
    #[arg(short, long, value_name = "FOLDER")]
    output: Option<PathBuf>,
    /// The summary, a row a trace: CSV, or Parquet where the name ends so
    #[arg(long, value_name = "FILE", requires = "output")]
    summary: Option<PathBuf>,
    /// Traces at a time; all cores without
    #[arg(long, value_name = "N", requires = "output", value_parser = clap::value_parser!(u16).range(1..))]
    jobs: Option<u16>,
    /// Work on this one of the traces only (may be given many times) and keep its result: another run, over all of them, puts
    /// the summary together
    #[arg(long, value_name = "TRACE", requires = "output")]
    part: Vec<PathBuf>,
    /// Print the traces that would be worked on, one a line, and stop
    #[arg(long, requires = "output")]
    list: bool,
}

impl Many {
    /// Whether the traces are to be worked on as many.
    ///
    /// # Errors
    /// When there are many and no folder to keep the results in.
    pub fn is_wanted(&self, traces: &[PathBuf]) -> anyhow::Result<bool> {
        anyhow::ensure!(
            self.output.is_some() || !is_many(traces),
            "more than one trace: give the folder for the results, as in --output results"
        );
        Ok(self.output.is_some())
    }

    /// Does `work` on every trace, and prints the outcome.
    ///
    /// # Errors
    /// When there is no trace, or an output cannot be written.
    pub fn run(
        &self,
        command: &'static str,
        facts: &'static [&'static str],
        settings: String,
        traces: &[PathBuf],
        axis: Option<&Path>,
        work: &(dyn Fn(&Item) -> anyhow::Result<Found> + Sync),
    ) -> anyhow::Result<ExitCode> {
        let output = self.output.as_deref().context("no --output folder")?;
        let mut items = find(traces, axis, output)?;
        // A summary that was written among the traces is none of them.
        let summary = self.summary.as_deref().filter(|path| is_summary(path)).and_then(|path| path.canonicalize().ok());
        items.retain(|item| summary.is_none() || item.path.canonicalize().ok() != summary);
        let inputs =
            items.iter().map(|item| item.path.as_path()).chain(items.iter().filter_map(|item| item.axis.as_deref()));
        super::outputs::check(inputs, [self.summary.as_ref()], [])?;
        for wanted in &self.part {
            anyhow::ensure!(
                items.iter().any(|item| item.path == *wanted),
                "--part {}: it is not one of the {} traces; --list prints them",
                wanted.display(),
                items.len()
            );
        }
        if !self.part.is_empty() {
            items.retain(|item| self.part.contains(&item.path));
        }
        if self.list {
            for item in &items {
                out_line!("{}", item.path.display())?;
            }
            return Ok(ExitCode::SUCCESS);
        }
        if let Some(jobs) = self.jobs {
            // The pool of the process, once: how many traces are worked on follows from it.
            rayon::ThreadPoolBuilder::new().num_threads(usize::from(jobs)).build_global()?;
        }
        let plan = Plan {
            command,
            facts,
            settings,
            items: &items,
            output,
            summary: self.summary.as_deref(),
            part: !self.part.is_empty(),
        };
        let bar = progress(items.len() as u64);
        let done = run(&plan, &|item| work(item).map_err(|e| format!("{e:#}")), &|item, outcome| {
            bar.set_message(item.path.display().to_string());
            bar.inc(1);
            if bar.is_hidden() {
                eprintln!("{}: {outcome}", item.path.display());
            }
        });
        bar.finish_and_clear();
        let outcome = done?;
        if self.part.is_empty() {
            out!("{}", terminal::blocks(&outcome.short, super::stdout::layout(120)))?;
            out_line!("\n{}", output.join("index.html").display())?;
        }
        if outcome.reused > 0 {
            eprintln!("{} of {} traces were done by an earlier run", outcome.reused, items.len());
        }
        Ok(match (outcome.done, outcome.failed) {
            (_, 0) => ExitCode::SUCCESS,
            (0, _) => ExitCode::from(COULD_NOT_RUN),
            _ => ExitCode::from(FINDINGS),
        })
    }
}

/// Whether a file is a summary of an earlier run, by its header or the name of its schema: only that is left out of the traces.
fn is_summary(path: &Path) -> bool {
    use std::io::{Read, Seek, SeekFrom};
    let look = || -> std::io::Result<bool> {
        let mut file = std::fs::File::open(path)?;
        let mut first = Vec::new();
        (&mut file).take(14).read_to_end(&mut first)?;
        if first == b"machine,trace," {
            return Ok(true);
        }
        // The schema of a Parquet file stands at its end.
        let length = file.metadata()?.len();
        file.seek(SeekFrom::Start(length.saturating_sub(1 << 16)))?;
        let mut last = Vec::new();
        file.take(1 << 16).read_to_end(&mut last)?;
        Ok(first.starts_with(b"PAR1") && memchr::memmem::find(&last, b"\x07summary").is_some())
    };
    look().unwrap_or(false)
}

fn progress(traces: u64) -> ProgressBar {
    if super::stdout::is_quiet() || !std::io::stderr().is_terminal() {
        return ProgressBar::hidden();
    }
    let bar = ProgressBar::new(traces);
    if let Ok(style) = ProgressStyle::with_template("{bar:30} {pos} of {len}, {elapsed}, {eta} left  {wide_msg}") {
        bar.set_style(style);
    }
    bar.enable_steady_tick(Duration::from_millis(250));
    bar
}
