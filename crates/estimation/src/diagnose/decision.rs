//! What a diagnosis decides: the verdict, and the hypotheses that it was reached among.

use super::diagnosis::Undecided;
use super::verdict::Verdict;
use super::weighing::{Confusable, Weighed, likely};
use crate::hypothesis::fit::Fit;

/// A gain counts as the cause of changed parameters when each of them changed by it, to this share.
const GAIN_LIKENESS: f64 = 0.25;
/// Smallest relative change of the parameters that is called one.
const GAIN_SEEN: f64 = 0.02;

/// The decision.
#[derive(Debug, Clone)]
pub struct Decision {
    /// The verdict.
    pub verdict: Verdict,
    /// Whether the search ended before every exchange was tried.
    pub cut_short: bool,
    /// Whether the motion was taken as given, and not the torque.
    pub motion_is_given: bool,
    /// Model as given.
    pub given: Fit,
    /// Its parameters fitted.
    pub parameters: Fit,
    /// The hypothesis decided for.
    pub chosen: Fit,
    /// Every hypothesis that was fitted, best first.
    pub ranking: Vec<Weighed>,
    /// Share of the gap of each effect of the chosen hypothesis.
    pub shares: Vec<f64>,
    /// Probability of each.
    pub probabilities: Vec<f64>,
    /// Share of the values that are independent.
    pub independent: f64,
    /// Effects that the record cannot tell from chosen ones.
    pub confusable: Vec<Confusable>,
    /// What of the chosen hypothesis is not told, where it is one of several effects.
    pub undecided: Option<Undecided>,
}

impl Decision {
    /// Causes that are named.
    pub fn named(&self) -> usize {
        if self.verdict == Verdict::Effect { likely(&self.probabilities) } else { 0 }
    }

    /// True if the parameters all changed by one factor: a wrong torque constant.
    #[must_use]
    pub fn torque_gain(&self) -> Option<(f64, f64)> {
        let f = &self.parameters;
        if f.coordinates.is_empty() {
            return None;
        }
        let change = |i: usize| (f.coordinates[i].value(&f.model) / f.coordinates[i].unit).ln();
        let first = change(0);
        // A rigid axis has one parameter: its change and a gain are the same thing.
        let alike = f.coordinates.len() > 1
            && (1..f.coordinates.len()).all(|i| {
                let std = f.std[i] / f.coordinates[i].value(&f.model);
                (change(i) - first).abs() <= GAIN_LIKENESS * first.abs() + 2.0 * std.min(0.2)
            });
        let std = f.std[0] / f.coordinates[0].value(&f.model);
        (alike && first.abs() > GAIN_SEEN).then(|| ((-first).exp(), (-first).exp() * std))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::axis::{Parameters, Structure};
    use crate::effects::Settings;
    use crate::hypothesis::model::Model;

    fn scaled(by: [f64; 4]) -> Fit {
        let model = Model::new(Parameters::PAPER, Structure::TwoInertia, Settings::default());
        let mut fit = Fit::of_likelihood(model, &[], 0.0);
        let p = &mut fit.model.parameters;
        for (value, by) in [&mut p.i1, &mut p.i2, &mut p.b, &mut p.k].into_iter().zip(by) {
            *value *= by;
        }
        fit
    }

    fn decision(parameters: Fit) -> Decision {
        Decision {
            verdict: Verdict::Parameters,
            cut_short: false,
            motion_is_given: false,
            given: parameters.clone(),
            chosen: parameters.clone(),
            parameters,
            ranking: Vec::new(),
            shares: Vec::new(),
            probabilities: Vec::new(),
            independent: 1.0,
            confusable: Vec::new(),
            undecided: None,
        }
    }

    #[test]
    fn parameters_that_all_changed_by_one_factor_are_a_gain_of_its_inverse() {
        let (gain, _) = decision(scaled([1.25; 4])).torque_gain().expect("one factor");
        assert!((gain - 0.8).abs() < 1e-12, "{gain}");
        assert!(decision(scaled([1.25, 1.2, 1.3, 1.25])).torque_gain().is_some());
        assert!(decision(scaled([1.25, 1.0, 1.25, 1.25])).torque_gain().is_none());
        assert!(decision(scaled([1.01; 4])).torque_gain().is_none());
    }

    #[test]
    fn causes_are_named_where_they_are_likely_and_the_verdict_is_theirs() {
        let of = |verdict| Decision { verdict, probabilities: vec![0.9, 0.5, 0.7], ..decision(scaled([1.0; 4])) };
        assert_eq!([Verdict::Effect, Verdict::Unexplained].map(|v| of(v).named()), [2, 0]);
    }
}
