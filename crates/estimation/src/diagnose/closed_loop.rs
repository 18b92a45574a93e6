//! What a diagnosis is worth in the loop that made the record: the drive's command around each model that was weighed.

use super::material::DISTINCT;
use super::{Decision, Fit};
use crate::control::{LoopErrors, UnderControl};
use crate::hypothesis::Hypothesis;

/// The drive's command over time, N.m.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Commands {
    /// Time of each sample, s.
    pub time: Vec<f64>,
    /// What was measured.
    pub measured: Vec<f64>,
    /// Around the model as given.
    pub before: Vec<f64>,
    /// Around the model with the effect.
    pub after: Vec<f64>,
}

/// A hypothesis as the loop sees it.
#[derive(Debug, Clone, PartialEq)]
pub struct LoopRanked {
    /// The hypothesis.
    pub hypothesis: Hypothesis,
    /// Its errors.
    pub errors: LoopErrors,
    /// Share of the command's squared error, as given, that it closes.
    pub closure: f64,
}

/// What the loop says of a diagnosis.
#[derive(Debug, Clone, PartialEq)]
pub struct ClosedLoop {
    /// The model as given.
    pub before: LoopErrors,
    /// Its parameters fitted.
    pub reidentified: LoopErrors,
    /// With the effect.
    pub after: LoopErrors,
    /// Share of the command's squared error, as given, that the diagnosed model closes.
    pub closure: f64,
    /// Every hypothesis tried, the one that closes most first.
    pub ranking: Vec<LoopRanked>,
    /// The commands over time: for plots.
    pub commands: Commands,
    /// Whether no other hypothesis closes more than the diagnosed one by more than 0.5 %.
    pub agrees: bool,
}

/// What the loop says of every hypothesis of a decision.
#[must_use]
pub fn verified(seen: &UnderControl<'_>, decision: &Decision) -> ClosedLoop {
    let run = |fit: &Fit| {
        let (commands, positions) = seen.run(&fit.model);
        (seen.errors_of(&commands, &positions), commands)
    };
    let (before, commands_before) = run(&decision.given);
    let (after, commands_after) = run(&decision.chosen);
    let commands = Commands {
        time: (0..seen.reference.len()).map(|k| seen.record.time(k)).collect(),
        measured: seen.command.to_vec(),
        before: commands_before,
        after: commands_after,
    };
    let closure = |e: &LoopErrors| 1.0 - (e.command / before.command).powi(2);
    let ranked = |t: &Fit| {
        let errors = seen.errors(&t.model);
        LoopRanked { hypothesis: t.hypothesis(), errors, closure: closure(&errors) }
    };
    let mut ranking: Vec<LoopRanked> = decision.ranking.iter().map(|w| ranked(&w.fit)).collect();
    ranking.sort_by(|a, b| b.closure.total_cmp(&a.closure));
    ClosedLoop {
        before,
        reidentified: seen.errors(&decision.parameters.model),
        after,
        closure: closure(&after),
        agrees: ranking.first().is_none_or(|best| best.closure <= closure(&after) + DISTINCT),
        ranking,
        commands,
    }
}
