//! The linear part of a gap, read at the lines of a periodic excitation.
//!
//! On a real machine drift and friction rule the error in time, and no model of the library brings it to the encoders'
//! noise. What repeats with the excitation can still be told from what does not: the response averaged over the periods
//! shows a lag, a delay or a missing mode by its phase and its shape whatever drifts below. So where the decision in time
//! abstains and the record is periodic, linear hypotheses are fitted to the response at the excited lines.
//!
//! The remainder there is the model's own error, not noise: it is the floor that evidence is counted against, lines that
//! err together count as one, and a cause is named only if it closes the better part of the gap at the lines. A machine
//! that repeats to its noise is not judged here: what it leaves unexplained in time, a right model would explain.

mod choose;
mod data;
mod fit;
mod tell;

#[cfg(test)]
mod tests;

use self::choose::{Choice, choose};
use self::data::{Lines, late_speeds, response};
use self::fit::{cost_of, cost_of_noise};
use super::assess::Case;
use super::model::Model;
use super::noise::{NoiseEstimate, NoiseMethod};
use super::record::Record;
use crate::effects::Effect;

/// Fewest periods in the part that is fitted.
const PERIODS: usize = 3;
/// What does not repeat must be this many times the noise: a machine that repeats is explained in time or not at all.
const RESTLESS: f64 = 10.0;

/// A linear cause named at the lines.
#[derive(Debug, Clone)]
pub struct Found {
    choice: Choice,
    lines: Lines,
    held: Option<Lines>,
}

impl Found {
    /// The model with the causes named.
    #[must_use]
    pub const fn improved(&self) -> &Model {
        &self.choice.chosen.model
    }

    /// The causes named, in the order in which they were found.
    #[must_use]
    pub fn effects(&self) -> &[Effect] {
        &self.choice.chosen.effects
    }

    /// Pairs that close the gap alike: the cause named, the other.
    #[must_use]
    pub fn alike(&self) -> Vec<[Effect; 2]> {
        self.choice.alike.iter().map(|(named, other, ..)| [*named, *other]).collect()
    }

    /// Share of the re-identified model's gap at the lines that closes: where it was fitted, and on held-out periods,
    /// where there are two.
    #[must_use]
    pub fn closure(&self) -> [f64; 2] {
        [self.choice.closure, self.closes(&self.choice.base.model, self.improved())]
    }

    /// Share of the gap at the lines that a model closes, from another: on held-out periods where there are two.
    fn closes(&self, from: &Model, to: &Model) -> f64 {
        let lines = self.held.as_ref().unwrap_or(&self.lines);
        let cost = |m: &Model| cost_of(lines, m).unwrap_or(f64::INFINITY);
        let noise = cost_of_noise(lines, to);
        1.0 - (cost(to) - noise).max(0.0) / (cost(from) - noise).max(f64::MIN_POSITIVE)
    }
}

/// Whether what does not repeat with the excitation outweighs the noise on every position.
fn restless(noise: &NoiseEstimate) -> bool {
    [0, 2]
        .into_iter()
        .filter(|c| noise.method[*c] != NoiseMethod::Absent)
        .all(|c| noise.scatter[c].is_some_and(|s| s > RESTLESS * noise.std[c]))
}

/// Looks for a linear cause at the lines of the excitation; `train` and `held` are the parts of the record that the fits
/// see and do not see. `None` without periods, without a gap there, or without a cause that may be named.
#[must_use]
pub fn examine(case: &Case<'_>, train: &Record, held: &Record) -> Option<Found> {
    let period = case.noise.period?;
    if train.len() < PERIODS * period || !restless(case.noise) {
        return None;
    }
    let rho = case.nominal.parameters.rho;
    let lines = Lines::new(&response(train, period)?, rho);
    let choice = choose(&lines, &case.nominal, &case.suspects)?;
    let held = response(held, period).map(|r| Lines::new(&r, rho)).filter(|h| h.channels == lines.channels);
    Some(Found { choice, lines, held })
}

/// What a periodic record says against its own speeds.
#[must_use]
pub fn warnings(record: &Record, noise: &NoiseEstimate) -> Vec<String> {
    let measured = noise.period.and_then(|period| response(record, period));
    measured.map_or_else(Vec::new, |m| late_speeds(&m))
}
