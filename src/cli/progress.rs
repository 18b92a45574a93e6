//! What a long command says while it works.

use std::io::IsTerminal;
use std::time::Duration;

use indicatif::{ProgressBar, ProgressStyle};

use crate::serve::PROGRESS;

/// How progress is told.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum How {
    /// In one line that changes, where standard error is a terminal
    Auto,
    /// A line for each step, `progress: ...`, for programs
    Lines,
    /// Not at all
    None,
}

/// The option.
#[derive(Debug, Clone, Copy, clap::Args)]
pub struct Progress {
    /// How progress is told, on standard error
    #[arg(long, value_enum, default_value_t = How::Auto, value_name = "HOW")]
    pub progress: How,
}

/// What is said of one work.
#[derive(Debug)]
pub struct Steps {
    bar: ProgressBar,
    lines: bool,
}

impl Progress {
    /// The place where the steps of a work are told.
    pub fn steps(self) -> Steps {
        let lines = self.progress == How::Lines;
        if self.progress != How::Auto || super::stdout::is_quiet() || !std::io::stderr().is_terminal() {
            return Steps { bar: ProgressBar::hidden(), lines };
        }
        let bar = ProgressBar::new_spinner();
        if let Ok(style) = ProgressStyle::with_template("{spinner} {elapsed} {wide_msg}") {
            bar.set_style(style);
        }
        bar.enable_steady_tick(Duration::from_millis(120));
        Steps { bar, lines }
    }
}

impl Steps {
    /// The next step.
    pub fn step(&self, what: &str) {
        if self.lines {
            eprintln!("{PROGRESS}{what}");
        }
        self.bar.set_message(what.to_owned());
    }

    /// The end.
    pub fn end(self) {
        self.bar.finish_and_clear();
    }
}
