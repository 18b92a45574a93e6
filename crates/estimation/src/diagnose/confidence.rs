//! How much what no cause explains doubts those that are found beside it, and how much of it needs no cause.

use super::search::Search;
use crate::effects::{EFFECTS, Effect};
use crate::hypothesis::fit::Fit;

/// Doubt in a cause beside what no cause explains, times the root of that's share of the torque: beside a hundredth of the torque one
/// cause in thirty is none, beside a tenth one in nine (both blind sets, whole and with the family of a cause withheld).
const DOUBT: f64 = 0.35;
/// Share of the gap's power that no cause explains beside which a cause is as likely none: where the library lacks what a machine has, what
/// does a part of the same is found in its place (the same sets).
const PART: f64 = 0.2;
/// Share of the torque that may be left white where no cause is named: the error of a measured current (one to five per cent).
pub const UNCAUSED: f64 = 0.05;
/// The same of any colour: what does not come and go as noise does has a cause, known or not. Of 240 healthy axes one leaves more.
const COLOURED: f64 = 0.01;
/// Share of independent values from which a residual counts as noise of its own: white in the band, as a noisy torque leaves it.
const WHITE: f64 = 0.8;
/// The same where next to nothing is left to explain, beside an encoder's noise of another colour: of all healthy axes but one it was
/// 0.65 and more, of those with a cause that the library lacks up to 0.5.
const HARDLY_COLOURED: f64 = 0.6;

impl Search<'_> {
    /// Confidence in the causes of a hypothesis beside what none of them explains.
    pub fn confidence(&self, parameters: &Fit, chosen: &Fit) -> f64 {
        let is_complete = self.at_floor(chosen) || self.independent([chosen]) > WHITE;
        let [left, before] = [chosen, parameters].map(|fit| self.left(fit));
        let unexplained = if is_complete { 0.0 } else { (left / before.max(f64::MIN_POSITIVE)).powi(2) };
        confidence_beside(left) * confidence_in_whole(unexplained)
    }

    /// Whether what a fit leaves may be the error of a measured current, or the encoders' noise.
    pub fn needs_no_cause(&self, fit: &Fit) -> bool {
        let left = self.left(fit);
        let of_noise = self.band().torque_share([0, 1].map(|i| self.band().noise_power(i)), self.problem.record);
        left <= COLOURED
            || left <= UNCAUSED && self.independent([fit]) > HARDLY_COLOURED
            || left <= of_noise && self.band().is_near_the_noise(&fit.rows)
    }

    /// Share of an effect in what it and the remainder make of the torque together, where that is largest, everything else fitted
    /// without it: what no effect explains may be what explains this one, too. Less of it where the effect hardly stands out of a
    /// remainder of any colour.
    pub fn decisive(&self, chosen: &Fit, plain: &Fit) -> f64 {
        let share = |e: usize| {
            let (without, with) = (plain.discrepancy[e], chosen.discrepancy[e]);
            if without > with { (without - with) / without } else { 0.0 }
        };
        (0..self.band().equations()).map(share).fold(0.0, f64::max) * self.stands_out(chosen, plain)
    }
}

/// Confidence in a cause beside a share of the torque that no cause explains ([`DOUBT`]).
fn confidence_beside(left: f64) -> f64 {
    (1.0 - DOUBT * left.sqrt()).max(0.0)
}

/// Confidence that what explains all but a share of the gap's power is the whole of it, and does no part of something else ([`PART`]).
fn confidence_in_whole(unexplained: f64) -> f64 {
    1.0 / (1.0 + (unexplained / PART).powi(2))
}

/// How often machines have the like of an effect, whatever its law.
pub fn usual_odds(effect: Effect) -> f64 {
    let like = EFFECTS.iter().filter(|like| like.is_alternative_to(effect)).map(|like| like.info().odds);
    like.fold(effect.info().odds, f64::max)
}

/// Probability that an effect of such odds is there, and what no cause explains does not do as it would. Friction is named that explains
/// half of what is left without it, a spring is not.
pub fn discounted(odds: f64, decisive: f64) -> f64 {
    odds * decisive / (odds * decisive + (1.0 - decisive))
}

#[cfg(test)]
mod tests {
    use super::super::weighing::LIKELY;
    use super::*;

    #[test]
    fn a_cause_is_believed_less_the_more_of_the_torque_and_of_the_gap_no_cause_explains() {
        // One in thirty is none beside a hundredth of the torque, one in nine beside a tenth, and all are beside nine times it.
        for (left, none) in [(0.0, 0.0), (0.01, 0.035), (0.1, 0.1107), (9.0, 1.0)] {
            assert!((confidence_beside(left) - (1.0 - none)).abs() < 1e-3, "{left}");
        }
        // Half of them are beside the part of the gap that doubts as much, a tenth beside a third of that.
        for (unexplained, none) in [(PART, 0.5), (PART / 3.0, 0.1), (3.0 * PART, 0.9)] {
            assert!((confidence_in_whole(unexplained) - (1.0 - none)).abs() < 1e-12, "{unexplained}");
        }
    }

    #[test]
    fn friction_needs_less_beside_a_remainder_than_what_few_machines_have() {
        let of = |effect, decisive| discounted(usual_odds(effect), decisive);
        // Odds of ten to one, whatever the law: 0.6 of it is 6/6.4.
        for friction in [Effect::CoulombMotor, Effect::PreslidingMotor] {
            assert!((of(friction, 0.6) - 6.0 / 6.4).abs() < 1e-12);
        }
        let spring = Effect::ExternalSpring.info().odds;
        assert!((of(Effect::ExternalSpring, 0.6) - 0.6 * spring / (0.6 * spring + 0.4)).abs() < 1e-12);
        assert!(of(Effect::ExternalSpring, 0.6) < LIKELY && LIKELY < of(Effect::ViscousTable, 0.5));
        assert_eq!([0.0, 1.0].map(|p| of(Effect::ExternalSpring, p)), [0.0, 1.0]);
    }
}
