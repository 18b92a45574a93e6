//! What is a cause, and what is a part of the remainder: by how much of the gap, of the torque and of the noise a fit leaves or explains.

use super::search::Search;
use crate::hypothesis::discrepancy::Discrepancy;
use crate::hypothesis::fit::{Fit, STEPS};
use crate::hypothesis::likelihood::Sight;
use crate::numerics::level::rms;

/// Share of the discrepancy's variance that a further cause must explain: less is a part of the remainder, not a main cause.
pub const MATERIAL: f64 = 0.25;
/// The same of the first: several causes share a gap.
const FIRST: f64 = 0.1;
/// Share of the gap's variance below which an effect is no main cause: a twentieth of its torque.
pub const MINOR: f64 = 0.0025;
/// Share of what was left below which a cause explains next to all of that: then it is one, however small beside the gap.
const NEXT_TO_ALL: f64 = 0.03;
/// Share of the torque that a gap must have for causes to be looked for in it: drives measure their current no better. A coupling with an
/// encoder on each side shows less of it in its twist.
pub const NEGLIGIBLE: f64 = 2e-3;
const NEGLIGIBLE_IN_TWIST: f64 = 3e-4;
/// Share of the torque up to which what a fit leaves tells it from another one: no drive knows its torque that well, so that no machine's
/// remainder is that small.
pub const DISTINCT: f64 = 5e-3;

impl Search<'_> {
    pub fn at_floor(&self, fit: &Fit) -> bool {
        self.problem.is_at_floor(fit)
    }

    /// Whether what a fit leaves is too little of the gap for any further cause in it.
    pub fn leaves_little(&self, fit: &Fit) -> bool {
        (0..self.band().equations()).all(|i| fit.discrepancy[i] < MINOR * self.gap[i])
    }

    /// Whether what a fit leaves is less than a log's torque is true to.
    pub fn is_negligible(&self, fit: &Fit) -> bool {
        self.band().torque_rms(fit.discrepancy) < self.negligible()
    }

    /// Torque below which nothing is a cause, N.m: what a drive is true to goes with all of its torque, a weight's with the rest.
    fn negligible(&self) -> f64 {
        let share = if self.band().sight == Sight::Both { NEGLIGIBLE_IN_TWIST } else { NEGLIGIBLE };
        share * rms(&self.problem.record.torque)
    }

    /// Whether a fit leaves nothing to look for: at the noise's floor, or next to none of the torque.
    pub fn leaves_nothing(&self, fit: &Fit) -> bool {
        self.at_floor(fit) || self.is_negligible(fit)
    }

    /// Whether what a fit leaves holds no further cause.
    pub fn is_enough(&self, fit: &Fit) -> bool {
        self.leaves_little(fit) || self.is_negligible(fit)
    }

    /// Whether a fit leaves so little of the torque that another account may be told from it.
    pub fn is_exact(&self, fit: &Fit) -> bool {
        self.left(fit) < DISTINCT
    }

    /// Share of the torque that a fit leaves.
    pub fn left(&self, fit: &Fit) -> f64 {
        self.band().torque_share(fit.discrepancy, self.problem.record)
    }

    /// Whether a fit leaves materially less than what another left.
    pub fn leaves_materially_less(&self, left: &Discrepancy, fit: &Fit) -> bool {
        (0..self.band().equations()).any(|i| is_materially_less(fit.discrepancy[i], left[i]))
    }

    /// Whether the richer explains a material part of what the nested one leaves, of the gap and of the torque.
    pub fn is_material(&self, plain: &Fit, rich: &Fit) -> bool {
        let (before, after) = (plain.discrepancy, rich.discrepancy);
        let share = if plain.terms.is_empty() { FIRST } else { MATERIAL };
        let explained = [0, 1].map(|i| (before[i] - after[i]).max(0.0));
        self.band().torque_rms(explained) >= self.negligible()
            && (0..self.band().equations()).any(|i| {
                after[i] <= (1.0 - share) * before[i]
                    && (explained[i] >= MINOR * self.gap[i] || is_next_to_none(after[i], before[i]))
            })
    }

    /// Whether a fit leaves next to none of what another does.
    pub fn explains_next_to_all(&self, other: &Fit, fit: &Fit) -> bool {
        (0..self.band().equations()).all(|i| is_next_to_none(fit.discrepancy[i], other.discrepancy[i]))
    }

    /// What causes are measured by: what the axis lacks with its parameters alone, but no more than the torque itself, and without a
    /// constant torque: beside a weight of many times the moving part everything else would be small.
    pub fn dynamic_gap(&self, parameters: &Fit) -> Discrepancy {
        let over = self.left(parameters).max(1.0);
        let mut gap = parameters.discrepancy.map(|s| s / (over * over));
        for bias in self.suspects.iter().filter(|e| e.is_bias()) {
            let fit = self.problem.fit(&parameters.model, &[(*bias, 0)], parameters.discrepancy, STEPS);
            let left = fit.map_or(gap, |f| f.discrepancy);
            gap = [gap[0].min(left[0]), gap[1].min(left[1])];
        }
        gap
    }
}

/// Whether a power is next to none of another.
fn is_next_to_none(power: f64, of: f64) -> bool {
    power <= NEXT_TO_ALL * of
}

/// Whether a power is materially less than another.
pub fn is_materially_less(power: f64, than: f64) -> bool {
    power < (1.0 - MATERIAL) * than
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn materially_less_is_less_than_three_quarters_of_the_power() {
        assert!(is_materially_less(0.74, 1.0) && !is_materially_less(0.76, 1.0));
        assert!(!is_materially_less(0.1, 0.1));
    }

    #[test]
    fn next_to_none_is_three_hundredths_of_the_power() {
        assert!(is_next_to_none(0.029, 1.0) && !is_next_to_none(0.031, 1.0) && is_next_to_none(0.0, 0.0));
    }
}
