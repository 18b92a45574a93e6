//! The progress of a long command.

use std::io::IsTerminal;
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};

use crate::serve::PROGRESS;

/// How progress is shown.
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

/// The progress of one task.
#[derive(Debug)]
pub struct Steps {
    bar: ProgressBar,
    lines: bool,
    /// The step that is counted now, and when it began.
    counted: Mutex<Option<(String, Instant)>>,
}

impl Progress {
    /// A callback that reports the steps of a task.
    pub fn steps(self) -> Steps {
        let lines = self.progress == How::Lines;
        if self.progress != How::Auto || super::stdout::is_quiet() || !std::io::stderr().is_terminal() {
            return Steps { bar: ProgressBar::hidden(), lines, counted: Mutex::default() };
        }
        let bar = ProgressBar::new_spinner();
        if let Ok(style) = ProgressStyle::with_template("{spinner} {elapsed} {wide_msg}") {
            bar.set_style(style);
        }
        bar.enable_steady_tick(Duration::from_millis(120));
        Steps { bar, lines, counted: Mutex::default() }
    }
}

impl Steps {
    /// The next step.
    pub fn step(&self, what: &str) {
        if self.lines {
            eprintln!("{PROGRESS}{what}");
        }
        self.bar.set_message(format!("{what}{}", self.left(what)));
    }

    /// Time that a step of the form `n of N ...` still takes, from the time of the part that is done: `, 3 s left`; empty for another step
    /// or less than two seconds.
    fn left(&self, what: &str) -> String {
        let mut counted = self.counted.lock().unwrap_or_else(PoisonError::into_inner);
        let Some((done, all)) = count(what) else {
            *counted = None;
            return String::new();
        };
        let rest = what.split_once(' ').map_or("", |(_, rest)| rest);
        match &*counted {
            Some((of, began)) if of == rest => {
                let seconds = began.elapsed().as_secs_f64() * (all - done) / done;
                if seconds < 2.0 { String::new() } else { format!(", {seconds:.0} s left of this step") }
            }
            _ => {
                *counted = Some((rest.to_owned(), Instant::now()));
                String::new()
            }
        }
    }

    /// The end.
    pub fn end(self) {
        self.bar.finish_and_clear();
    }
}

/// `n` and `N` of `n of N ...`.
fn count(what: &str) -> Option<(f64, f64)> {
    let mut parts = what.split(' ');
    let done = parts.next()?.parse().ok()?;
    let all = parts.next().filter(|of| *of == "of").and_then(|_| parts.next())?.parse().ok()?;
    (1.0..=all).contains(&done).then_some((done, all))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_a_counted_step_has_an_end() {
        assert_eq!(count("3 of 12 fits of a cause beside 1"), Some((3.0, 12.0)));
        for what in ["26 hypotheses fitted", "13 of 12 fits", "0 of 12 fits", "the model as given", "3 of many"] {
            assert_eq!(count(what), None, "{what}");
        }
    }
}
