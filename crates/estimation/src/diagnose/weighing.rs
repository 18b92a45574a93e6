//! What the record says for each effect of a hypothesis, weighed among all that were tried; and which of several effects stays open.

use super::search::ALIKE;
use crate::effects::Effect;
use crate::hypothesis::fit::Fit;
use crate::numerics::distribution::of_log_odds;

/// Probability from which an effect may be named: more likely than not, and by more than one of two that are alike is by rounding.
pub const LIKELY: f64 = 0.55;

/// A hypothesis with its evidence.
#[derive(Debug, Clone)]
pub struct Weighed {
    /// What was fitted.
    pub fit: Fit,
    /// Log evidence.
    pub evidence: f64,
    /// Posterior probability among the hypotheses tried.
    pub probability: f64,
}

/// An effect named, and another that explains the record as well in its place.
#[derive(Debug, Clone, Copy)]
pub struct Confusable {
    /// The one named.
    pub named: Effect,
    /// The other.
    pub other: Effect,
    /// Log evidence with the named one less that with the other.
    pub difference: f64,
}

impl Confusable {
    /// Whether the two are the same but for where they act.
    #[must_use]
    pub fn is_of_place(&self) -> bool {
        let (named, other) = (self.named.info(), self.other.info());
        named.family == other.family && named.place != other.place
    }
}

/// A hypothesis without one of its effects.
pub struct Nested {
    /// What was fitted without it.
    pub fit: Fit,
    /// Whether it was fitted for the verdict, from where the hypothesis stands.
    pub refitted: bool,
}

/// What the record says for each effect of a hypothesis.
pub struct Weighing {
    /// The hypothesis without it, where it is determined.
    pub nested: Vec<Option<Nested>>,
    /// Probability that it is there, and nothing that no cause explains does as it would.
    pub standing: Vec<f64>,
    /// The constant torque that it may be as well.
    pub twins: Vec<Option<Confusable>>,
    /// The hypotheses that it was weighed in.
    pub ranking: Vec<Weighed>,
    /// Its probability.
    pub probabilities: Vec<f64>,
}

impl Weighing {
    /// The fits that were weighed.
    pub fn into_fits(self) -> Vec<Fit> {
        self.ranking.into_iter().map(|w| w.fit).collect()
    }

    /// Effects that are likely.
    pub fn likely(&self) -> usize {
        likely(&self.probabilities)
    }

    /// The least likely effect, where it is not likely.
    pub fn least_likely(&self) -> Option<usize> {
        let p = &self.probabilities;
        (0..p.len()).min_by(|a, b| p[*a].total_cmp(&p[*b])).filter(|i| !is_likely(&p[*i]))
    }

    /// The probabilities of all others `times` what they are.
    pub fn doubt_beside(&mut self, effect: usize, times: f64) {
        let others = self.probabilities.iter_mut().enumerate().filter(|(i, _)| *i != effect);
        others.for_each(|(_, p)| *p *= times.min(1.0));
    }

    /// Of two that the record cannot tell apart one explains it.
    pub fn share_with_twins(&mut self) {
        for (p, twin) in self.probabilities.iter_mut().zip(&self.twins) {
            *p = twin.map_or(*p, |t| p.min(of_log_odds(t.difference)));
        }
    }

    /// The one of several effects that stays open, and the others are told: others do the same beside them.
    pub fn open(&self, chosen: &Fit) -> Option<usize> {
        self.least_likely().filter(|&i| {
            is_likely(&self.standing[i])
                && chosen.terms.len() > 1
                && self.likely() + 1 == chosen.terms.len()
                && is_likely(&one_instead(&self.ranking, chosen, i))
                && instead(&self.ranking, chosen, i, self.twins[i]).len() > 1
        })
    }

    /// Another hypothesis with one effect in the place of the open one, which is told, too: likelier than not.
    pub fn instead_of_open(&self, chosen: &Fit, open: usize) -> Option<Fit> {
        let best = with_one_instead(&self.ranking, chosen, open).next()?;
        let is_told = is_likely(&(best.probability * self.standing[open]));
        (is_told && best.fit.terms != chosen.terms && best.fit.converged).then(|| best.fit.clone())
    }

    /// The hypothesis without an effect, where it was fitted from where that stands.
    pub fn refitted(&self, without: usize) -> Option<Fit> {
        self.nested[without].as_ref().filter(|n| n.refitted).map(|n| n.fit.clone())
    }
}

/// Whether a probability is that from which an effect may be named.
pub fn is_likely(probability: &f64) -> bool {
    *probability >= LIKELY
}

/// How many of some effects are likely, by their probabilities.
pub fn likely(probabilities: &[f64]) -> usize {
    probabilities.iter().filter(|p| is_likely(p)).count()
}

/// Whether a fit has an effect of the family of this one.
pub fn has_one_like(fit: &Fit, effect: Effect) -> bool {
    fit.terms.iter().any(|(o, _)| o.info().family == effect.info().family)
}

/// The hypotheses with all effects of a fit but one, and some effect beside them in its place.
fn with_one_instead<'r>(ranking: &'r [Weighed], chosen: &'r Fit, i: usize) -> impl Iterator<Item = &'r Weighed> {
    ranking
        .iter()
        .filter(move |w| w.fit.terms.len() >= chosen.terms.len())
        .filter(move |w| others(chosen, i).all(|e| has_one_like(&w.fit, e)))
}

/// The effects of a fit but one.
fn others(fit: &Fit, i: usize) -> impl Iterator<Item = Effect> {
    fit.terms.iter().enumerate().filter(move |(k, _)| *k != i).map(|(_, t)| t.0)
}

/// Probability of these hypotheses.
fn one_instead(ranking: &[Weighed], chosen: &Fit, i: usize) -> f64 {
    with_one_instead(ranking, chosen, i).map(|w| w.probability).sum()
}

/// The effects that stand in the place of that one in the likely ones of these hypotheses or are its twin, and itself first.
pub fn instead(ranking: &[Weighed], chosen: &Fit, i: usize, twin: Option<Confusable>) -> Vec<Effect> {
    let mut effects = vec![chosen.terms[i].0];
    // One that falls short of certainty by no more than the difference of two that are alike.
    for w in with_one_instead(ranking, chosen, i).filter(|w| w.probability.ln() >= -ALIKE) {
        let like = |e: Effect, of: Effect| e.info().family == of.info().family;
        let other = |e: &Effect| others(chosen, i).all(|o| !like(*e, o)) && effects.iter().all(|k| !like(*e, *k));
        let found: Vec<Effect> = w.fit.terms.iter().map(|t| t.0).filter(other).collect();
        effects.extend(found);
    }
    effects.extend(twin.map(|t| t.other).filter(|e| !effects.contains(e)));
    effects
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::axis::{Parameters, Structure};
    use crate::effects::Settings;
    use crate::hypothesis::model::Model;

    fn fit(effects: &[Effect]) -> Fit {
        let terms: Vec<(Effect, usize)> = effects.iter().map(|e| (*e, 0)).collect();
        Fit::of_likelihood(Model::new(Parameters::PAPER, Structure::TwoInertia, Settings::default()), &terms, 0.0)
    }

    #[test]
    fn beside_one_that_is_not_named_the_others_are_doubted_and_none_is_believed_more() {
        let of = |times: f64| {
            let mut weighing = Weighing {
                nested: Vec::new(),
                standing: Vec::new(),
                twins: Vec::new(),
                ranking: Vec::new(),
                probabilities: vec![0.9, 0.3, 0.8],
            };
            weighing.doubt_beside(1, times);
            weighing.probabilities
        };
        assert_eq!(of(0.5), [0.45, 0.3, 0.4]);
        assert_eq!(of(1.2), [0.9, 0.3, 0.8]);
    }

    #[test]
    fn one_of_two_that_do_the_same_beside_a_third_leaves_that_third_as_likely_as_both_together() {
        use Effect::{CoulombMotor, Delay, Latch, PreslidingMotor, ViscousMotor};
        let chosen = fit(&[CoulombMotor, Delay]);
        let weighed = |effects: &[Effect], probability: f64| Weighed { fit: fit(effects), evidence: 0.0, probability };
        let ranking = [
            weighed(&[CoulombMotor, Latch], 0.5),
            weighed(&[Delay, CoulombMotor], 0.2),
            weighed(&[PreslidingMotor, ViscousMotor], 0.1),
            weighed(&[ViscousMotor, Delay], 0.1),
            weighed(&[CoulombMotor], 0.1),
        ];
        assert!((one_instead(&ranking, &chosen, 1) - 0.8).abs() < 1e-12);
        assert!((one_instead(&ranking, &chosen, 0) - 0.3).abs() < 1e-12);
        assert_eq!(instead(&ranking, &chosen, 1, None), [Delay, Latch, ViscousMotor]);
        let twin = Confusable { named: Delay, other: Effect::LoadMotor, difference: 0.0 };
        assert_eq!(instead(&ranking, &chosen, 1, Some(twin)), [Delay, Latch, ViscousMotor, Effect::LoadMotor]);
    }
}
