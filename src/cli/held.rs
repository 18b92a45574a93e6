//! Samples that a log held, as notes on a record: `identify` and `diagnose` bridge them, and who reads the log should know how many and when.

use rayon::prelude::*;

use crate::examine::{Finding, Severity};
use crate::trace::{Signal, Trace, held};

/// Most samples whose time one note names.
const MOST: usize = 64;

/// A note for each position of the record that has such samples.
pub(super) fn notes(trace: &Trace) -> Vec<Finding> {
    let positions = [Signal::Theta1, Signal::Theta2, Signal::X2];
    positions.into_par_iter().filter_map(|signal| note(trace, signal, &held(trace.get(signal)?, 0.0))).collect()
}

fn note(trace: &Trace, signal: Signal, at: &[usize]) -> Option<Finding> {
    let seen = match at {
        [] => return None,
        [_] => format!("One sample of {} repeats the one before while the axis goes on.", signal.name()),
        many => format!("{} samples of {} repeat the one before while the axis goes on.", many.len(), signal.name()),
    };
    let shown = &at[..at.len().min(MOST)];
    Some(Finding {
        samples: at.len(),
        stretches: shown.iter().map(|k| *k..k + 1).collect(),
        seconds: shown.iter().map(|k| [trace.time(*k); 2]).collect(),
        ..Finding::new(
            "held_samples",
            Severity::Note,
            signal.name(),
            seen,
            "The log held them: a cycle of the bus or of the logger was missed.",
            "`eixo identify` and `eixo diagnose` bridge them; see to the logger where they are many.",
        )
    })
}
