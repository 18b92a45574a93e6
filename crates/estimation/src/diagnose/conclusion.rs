//! The verdict on the hypothesis that a search ended with: how likely each of its effects is, and whether they may be named.

use std::sync::atomic::Ordering;

use itertools::Itertools;

use super::diagnosis::Undecided;
use super::material::{MATERIAL, MINOR};
use super::moves::{MOVED, MOVED_FAR};
use super::pool::likeliest_of;
use super::search::{ALIKE, Search, is_extension};
use super::verdict::Verdict;
use super::weighing::{Confusable, Nested, Weighed, Weighing, has_one_like, instead, is_likely};
use crate::effects::{EFFECTS, Effect, Family, ONCE};
use crate::hypothesis::determined::{is_simpler, is_undetermined, steadiness};
use crate::hypothesis::fit::Fit;
use crate::hypothesis::likelihood::NEAR_THE_NOISE;
use crate::hypothesis::model::Model;
use crate::trace::machine::NOMINAL_OFF;

/// A gain counts as the cause of changed parameters when each of them changed by it, to this share.
const GAIN_LIKENESS: f64 = 0.25;
/// Smallest relative change of the parameters that is called one.
const GAIN_SEEN: f64 = 0.02;
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
/// Hypotheses that are told, each with its own run over the held-out data.
pub const REPORTED: usize = 12;
/// Share of independent values from which a residual counts as noise of its own: white in the band, as a noisy torque leaves it.
const WHITE: f64 = 0.8;
/// The same where next to nothing is left to explain, beside an encoder's noise of another colour: of all healthy axes but one it was
/// 0.65 and more, of those with a cause that the library lacks up to 0.5.
const HARDLY_COLOURED: f64 = 0.6;

/// The decision.
#[derive(Debug, Clone)]
pub struct Decision {
    /// The verdict.
    pub verdict: Verdict,
    /// Whether the search ended before every exchange was tried.
    pub cut_short: bool,
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
    fn named(&self) -> usize {
        if self.verdict == Verdict::Effect { self.probabilities.iter().filter(|p| is_likely(p)).count() } else { 0 }
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

impl Search<'_> {
    /// The verdict on the hypothesis at the end.
    pub fn conclude(&self, given: Fit, parameters: Fit, chosen: Fit, mut pool: Vec<Fit>) -> Decision {
        pool.push(chosen.clone());
        let independent = self.independent([&chosen]);
        let nominal = &self.problem.nominal;
        let is_off = self.are_off(&given, &parameters, independent);
        let plain = if is_off { parameters.clone() } else { given.clone() };
        let is_of_another_axis = |f: &Fit| !f.terms.is_empty() && is_run_off(f, nominal);
        if is_of_another_axis(&chosen) {
            // The likeliest that says something of this one.
            pool.retain(|f| !is_of_another_axis(f));
            let next = self.best(&pool, independent).filter(|f| !f.terms.is_empty()).unwrap_or(&plain).clone();
            return self.conclude(given, parameters, next, pool);
        }
        let chosen = if chosen.terms.is_empty() { plain.clone() } else { chosen };
        self.retain_rivals(&chosen, &mut pool, independent);
        let finished = self.problem.finished(&chosen, independent).unwrap_or_else(|| chosen.clone());
        if let Some(simple) = self.simplified(&finished, independent, &pool).cloned() {
            return self.conclude(given, parameters, simple, pool);
        }
        let mut weighing = self.weigh(&chosen, &finished, &parameters, pool, independent);
        // One that is not likely explains nothing that needs a cause.
        if let [only] = weighing.probabilities[..]
            && !is_likely(&only)
            && self.needs_no_cause(&plain)
        {
            return self.conclude(given, parameters, plain, weighing.into_fits());
        }
        weighing.share_with_twins();
        let mut open = weighing.open(&chosen);
        if let Some(shorter) = open.and_then(|i| weighing.instead_of_open(&chosen, i)) {
            return self.conclude(given, parameters, shorter, weighing.into_fits());
        }
        // Beside more of the torque than that the causes of the rest are suspects, however large the gap was.
        let is_understood = self.left(&chosen) <= MATERIAL;
        if open.is_none()
            && let Some(least) = weighing.least_likely().filter(|_| chosen.terms.len() > 1)
            && let Some(refitted) = weighing.refitted(least).or_else(|| self.refitted(&chosen, least))
        {
            let [with_it, without_it] = [&chosen, &refitted].map(|fit| self.confidence(&parameters, fit));
            let ranking = &weighing.ranking;
            let without = self.concluded_without(&chosen, least, refitted, ranking, [&given, &parameters], independent);
            // Beside what it leaves the others may be lost, which beside it are likely, or others take a part of that: then it stays, and is
            // not named.
            let others = weighing.likely();
            let is_its_own = inertia_off(&chosen, nominal) < MOVED_FAR;
            let keeps_the_others = without.named() >= others && is_extension(&chosen, &without.chosen);
            if others + 1 < chosen.terms.len() || !is_understood || !is_its_own || keeps_the_others {
                return without;
            }
            // As likely as it is none, the others are beside what is left without it.
            let there = weighing.probabilities[least];
            weighing.doubt_beside(least, there + (1.0 - there) * without_it / with_it);
            open = Some(least);
        }
        let are_likely = weighing.likely() + usize::from(open.is_some()) == chosen.terms.len();
        let verdict = match chosen.terms.is_empty() {
            false if are_likely && is_understood => Verdict::Effect,
            false => Verdict::Unexplained,
            true if is_run_off(&chosen, nominal) => Verdict::Unexplained,
            true if !self.needs_no_cause(&chosen) => Verdict::Unexplained,
            true if chosen.coordinates.is_empty() => Verdict::NoGap,
            true => Verdict::Parameters,
        };
        let chosen = finished;
        let Weighing { mut ranking, twins, probabilities, .. } = weighing;
        let shares = self.shares(&chosen);
        let effects = |i: usize| instead(&ranking, &chosen, i, twins[i]);
        let undecided = open.map(|i| Undecided { effects: effects(i), share_of_gap: shares[i] });
        let twins = twins.into_iter().flatten().filter(|t| t.difference < ALIKE);
        let confusable = confusable(&chosen, &ranking, self.evidence(&chosen, independent), twins);
        ranking.truncate(REPORTED);
        let cut_short = self.cut_short.load(Ordering::Relaxed);
        Decision {
            verdict,
            cut_short,
            given,
            parameters,
            chosen,
            ranking,
            shares,
            probabilities,
            independent,
            confusable,
            undecided,
        }
    }

    /// Whether the parameters alone are likelier than the nominal ones, with none as far off as it may be: one that is is not known.
    fn are_off(&self, given: &Fit, parameters: &Fit, independent: f64) -> bool {
        !parameters.coordinates.iter().any(|c| c.is_at_bound(&parameters.model))
            && self.evidence(parameters, independent) > self.evidence(given, independent)
    }

    /// Keeps the hypotheses that a chosen one is weighed against. What it lacks no material part of is no rival of it, only itself and
    /// something small; of accounts that leave next to nothing of the gap the shorter is told. A longer account doubts nothing in it where
    /// the chosen one with as many effects beside its own is likelier.
    fn retain_rivals(&self, chosen: &Fit, pool: &mut Vec<Fit>, independent: f64) {
        let most = self.longest_rival(chosen);
        let evidence = |f: &Fit| self.evidence(f, independent);
        let (more, mut others): (Vec<Fit>, Vec<Fit>) = pool.drain(..).partition(|f| is_extension(f, chosen));
        let likelier =
            |f: &Fit| more.iter().any(|m| !m.at_bound && m.terms.len() <= f.terms.len() && evidence(m) > evidence(f));
        others.retain(|f| f.terms.len() <= most && !(f.terms.len() > chosen.terms.len() && likelier(f)));
        *pool = others;
    }

    /// What the record says for each effect of a chosen hypothesis, which is `finished` along its own motion.
    fn weigh(&self, chosen: &Fit, finished: &Fit, parameters: &Fit, pool: Vec<Fit>, independent: f64) -> Weighing {
        // What is below two of its standard errors, everything free, is no cause.
        let is_determined = |i: usize| !is_undetermined(finished, chosen.terms[i].0, independent);
        let all = 0..chosen.terms.len();
        let nested: Vec<Option<Nested>> = all
            .clone()
            .map(|i| is_determined(i).then(|| self.nested(chosen, i, parameters, &pool)).flatten())
            .collect();
        let confidence = self.confidence(parameters, chosen);
        let standing = |i: usize| {
            let effect = chosen.terms[i].0;
            let decisive = match &nested[i] {
                Some(without) => self.decisive(chosen, &without.fit),
                None if is_determined(i) => 1.0,
                None => 0.0,
            };
            let repeats = self.problem.scales.as_ref().is_none_or(|s| s.repeats(effect, &chosen.model));
            let odds = if repeats { 1.0 } else { ONCE } * usual_odds(effect);
            discounted(odds, steadiness(finished, effect, independent) * decisive) * confidence
        };
        let standing: Vec<f64> = all.clone().map(standing).collect();
        let twins = all.map(|i| self.constant_instead(chosen, i, &pool, independent)).collect();
        let ranking = self.weighed(pool, independent);
        let probability = |((e, _), standing): (&(Effect, usize), &f64)| {
            let of: f64 = ranking.iter().filter(|w| has_one_like(&w.fit, *e)).map(|w| w.probability).sum();
            of * standing
        };
        let probabilities = chosen.terms.iter().zip(&standing).map(probability).collect();
        Weighing { nested, standing, twins, ranking, probabilities }
    }

    /// Confidence in the causes of a hypothesis beside what none of them explains.
    fn confidence(&self, parameters: &Fit, chosen: &Fit) -> f64 {
        let is_complete = self.at_floor(chosen) || self.independent([chosen]) > WHITE;
        let [left, before] = [chosen, parameters].map(|fit| self.left(fit));
        let unexplained = if is_complete { 0.0 } else { (left / before.max(f64::MIN_POSITIVE)).powi(2) };
        confidence_beside(left) * confidence_in_whole(unexplained)
    }

    /// The verdict without one of several effects, from the fit without it.
    fn concluded_without(
        &self,
        chosen: &Fit,
        gone: usize,
        refitted: Fit,
        ranking: &[Weighed],
        [given, parameters]: [&Fit; 2],
        independent: f64,
    ) -> Decision {
        // What is named without an effect has no rival that has another such effect in it.
        let pool: Vec<Fit> =
            ranking.iter().map(|w| &w.fit).filter(|f| f.terms.len() < chosen.terms.len()).cloned().collect();
        // The likeliest of the shorter: where one as good as it takes an effect's place it is another that is told, and no less explained.
        let known = nested_fit(chosen, gone, &pool).filter(|f| f.log_likelihood > refitted.log_likelihood);
        let plain = known.cloned().unwrap_or(refitted);
        let evidence = |f: &Fit| self.evidence(f, independent);
        let likelier = |f: &&Fit| !f.at_bound && !f.terms.is_empty() && evidence(f) > evidence(&plain);
        let other = pool.iter().filter(likelier).max_by(|a, b| evidence(a).total_cmp(&evidence(b)));
        let end = |fit: Fit, pool: Vec<Fit>| self.conclude(given.clone(), parameters.clone(), fit, pool);
        let effect = chosen.terms[gone].0;
        let has_it = |f: &Fit| f.terms.iter().any(|t| t.0 == effect);
        let without = end(other.unwrap_or(&plain).clone(), pool.clone());
        if !other.is_some_and(has_it) {
            return without;
        }
        // The likeliest of the shorter keeps what was not likely: where it loses more by it, it goes itself.
        let named = end(plain, pool.into_iter().filter(|f| !has_it(f)).collect());
        if named.named() > without.named() { named } else { without }
    }

    /// The fit without one of its effects: the known one, or else from where it stands.
    fn nested(&self, chosen: &Fit, i: usize, parameters: &Fit, pool: &[Fit]) -> Option<Nested> {
        let known = if chosen.terms.len() == 1 { Some(parameters) } else { nested_fit(chosen, i, pool) };
        match known {
            Some(fit) => Some(Nested { fit: fit.clone(), refitted: false }),
            None => Some(Nested { fit: self.refitted(chosen, i)?, refitted: true }),
        }
    }

    /// Whether what a fit leaves may be the error of a measured current, or the encoders' noise.
    fn needs_no_cause(&self, fit: &Fit) -> bool {
        let left = self.left(fit);
        let of_noise = self.band().torque_share([0, 1].map(|i| self.band().noise_power(i)), self.problem.record);
        left <= COLOURED
            || left <= UNCAUSED && self.independent([fit]) > HARDLY_COLOURED
            || left <= of_noise && self.band().noise_multiple(&fit.rows) < NEAR_THE_NOISE
    }

    /// Share of an effect in what it and the remainder make of the torque together, where that is largest, everything else fitted
    /// without it: what no effect explains may be what explains this one, too. Less of it where the effect hardly stands out of a
    /// remainder of any colour.
    fn decisive(&self, chosen: &Fit, plain: &Fit) -> f64 {
        let share = |e: usize| {
            let (without, with) = (plain.discrepancy[e], chosen.discrepancy[e]);
            if without > with { (without - with) / without } else { 0.0 }
        };
        (0..self.band().equations()).map(share).fold(0.0, f64::max) * self.stands_out(chosen, plain)
    }

    /// The constant torque that a friction may be as well: where the motion hardly goes back the law without any shape is one, and a shape
    /// may follow what else happens as the axis starts, unless it explains next to all that the constant torque leaves.
    fn constant_instead(&self, chosen: &Fit, i: usize, pool: &[Fit], independent: f64) -> Option<Confusable> {
        let (effect, _) = chosen.terms[i];
        let is_dry = |e: Effect| e.info().family == Family::DryFriction;
        let at_its_place = || self.suspects.iter().copied().filter(|e| e.info().place == effect.info().place);
        let shapeless = at_its_place().find(|e| is_dry(*e) && e.simpler_at_zero().is_none())?;
        let constant = at_its_place().find(|e| e.is_bias())?;
        if !is_dry(effect) || chosen.terms.iter().any(|t| t.0 == constant) {
            return None;
        }
        // What the search has of it may have ended elsewhere before the others were there.
        let with = |e: Effect| {
            if chosen.terms[i] == (e, 0) {
                return Some(chosen.clone());
            }
            let mut terms = chosen.terms.clone();
            terms[i] = (e, 0);
            let known = likeliest_of(&terms, pool).cloned();
            let all = known.into_iter().chain(self.with_another(chosen, i, (e, 0)));
            all.max_by(|a, b| a.log_likelihood.total_cmp(&b.log_likelihood))
        };
        let load = with(constant)?;
        let next_to_all = (0..self.band().equations()).all(|e| chosen.discrepancy[e] < MINOR * load.discrepancy[e]);
        if next_to_all && !self.is_negligible(&load) {
            return None;
        }
        let difference =
            with(shapeless).map_or(0.0, |f| self.evidence(&f, independent) - self.evidence(&load, independent));
        Some(Confusable { named: effect, other: constant, difference })
    }

    /// Each set of effects once, in its best forms, best first, with its probability.
    fn weighed(&self, pool: Vec<Fit>, independent: f64) -> Vec<Weighed> {
        let is_any_simpler = |f: &Fit| f.terms.iter().any(|t| is_simpler(f, t.0, independent));
        let mut all: Vec<Weighed> = pool
            .into_iter()
            .map(|fit| Weighed { evidence: self.evidence(&fit, independent), fit, probability: 0.0 })
            .filter(|w| w.evidence.is_finite() && !w.fit.at_bound && !is_any_simpler(&w.fit))
            .sorted_by(|a, b| b.evidence.total_cmp(&a.evidence))
            .unique_by(|w| (w.fit.effects(), w.fit.coordinates.is_empty()))
            .collect();
        let top = all.first().map_or(0.0, |w| w.evidence);
        let sum: f64 = all.iter().map(|w| (w.evidence - top).exp()).sum();
        for w in &mut all {
            w.probability = (w.evidence - top).exp() / sum;
        }
        all
    }

    /// Share of each effect: what comes back without it, everything else as it is.
    fn shares(&self, fit: &Fit) -> Vec<f64> {
        let own = self.band().discrepancy(&fit.rows);
        let lost: Vec<f64> = fit
            .terms
            .iter()
            .map(|(e, _)| {
                let mut model = fit.model;
                model.effects.of_mut(*e).copy_from_slice(self.problem.nominal.effects.of(*e));
                let Some(rows) = self.problem.rows(&model, fit.bandwidth, Some(fit.rows.weighed_at)) else {
                    return 1.0;
                };
                let without = self.band().discrepancy(&rows);
                (0..self.band().equations())
                    .map(|i| (without[i] - own[i]).max(0.0) / self.band().noise_power(i).max(f64::MIN_POSITIVE))
                    .sum::<f64>()
            })
            .collect();
        let sum: f64 = lost.iter().sum();
        lost.iter().map(|l| if sum > 0.0 { l / sum } else { 1.0 / lost.len() as f64 }).collect()
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
fn usual_odds(effect: Effect) -> f64 {
    let like = EFFECTS.iter().filter(|like| like.is_alternative_to(effect)).map(|like| like.info().odds);
    like.fold(effect.info().odds, f64::max)
}

/// Probability that an effect of such odds is there, and what no cause explains does not do as it would. Friction is named that explains
/// half of what is left without it, a spring is not.
fn discounted(odds: f64, decisive: f64) -> f64 {
    odds * decisive / (odds * decisive + (1.0 - decisive))
}

/// How far the inertia that moves is from the nominal one, in its logarithm.
fn inertia_off(fit: &Fit, nominal: &Model) -> f64 {
    let inertia = |m: &Model| m.parameters.i1 + m.parameters.i2;
    (inertia(&fit.model) / inertia(nominal)).ln().abs()
}

/// Whether that is nearly as far as it may be: what is fitted beside it says nothing of this axis.
fn is_run_off(fit: &Fit, nominal: &Model) -> bool {
    inertia_off(fit, nominal) > NOMINAL_OFF.ln() - MOVED
}

/// The likeliest fit of all effects of another but one, each in its form: another form of one may do what the missing one does, and
/// which of the two it is the evidence says.
fn nested_fit<'f>(fit: &Fit, i: usize, pool: &'f [Fit]) -> Option<&'f Fit> {
    let mut terms = fit.terms.clone();
    terms.remove(i);
    likeliest_of(&terms, pool)
}

/// Named effects that another family explains as well, beside those that are known to be such.
fn confusable(
    chosen: &Fit,
    ranking: &[Weighed],
    evidence: f64,
    known: impl Iterator<Item = Confusable>,
) -> Vec<Confusable> {
    let mut out: Vec<Confusable> = known.collect();
    for w in ranking.iter().filter(|w| evidence - w.evidence < ALIKE && w.fit.terms.len() == chosen.terms.len()) {
        let gone: Vec<Effect> =
            chosen.terms.iter().map(|t| t.0).filter(|e| w.fit.terms.iter().all(|t| t.0 != *e)).collect();
        let come: Vec<Effect> =
            w.fit.terms.iter().map(|t| t.0).filter(|e| chosen.terms.iter().all(|t| t.0 != *e)).collect();
        if let ([named], [other]) = (&gone[..], &come[..])
            && !out.iter().any(|c| c.named == *named && c.other == *other)
        {
            out.push(Confusable { named: *named, other: *other, difference: evidence - w.evidence });
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::super::weighing::LIKELY;
    use super::*;
    use crate::axis::{Parameters, Structure};
    use crate::effects::Settings;

    fn fit(effects: &[Effect], log_likelihood: f64) -> Fit {
        let terms: Vec<(Effect, usize)> = effects.iter().map(|e| (*e, 0)).collect();
        Fit::of_likelihood(
            Model::new(Parameters::PAPER, Structure::TwoInertia, Settings::default()),
            &terms,
            log_likelihood,
        )
    }

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

    fn decision(parameters: Fit) -> Decision {
        Decision {
            verdict: Verdict::Parameters,
            cut_short: false,
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

    fn scaled(by: [f64; 4]) -> Fit {
        let mut fit = fit(&[], 0.0);
        let p = &mut fit.model.parameters;
        for (value, by) in [&mut p.i1, &mut p.i2, &mut p.b, &mut p.k].into_iter().zip(by) {
            *value *= by;
        }
        fit
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

    #[test]
    fn an_inertia_ten_times_the_nominal_one_has_run_off_and_one_of_three_times_has_not() {
        let nominal = scaled([1.0; 4]).model;
        let run_off = |by: f64| is_run_off(&scaled([by, by, 1.0, 1.0]), &nominal);
        assert_eq!([0.1, 0.3, 1.0, 3.0, 10.0].map(run_off), [true, false, false, false, true]);
        // Of one encoder's record the share of the table may be anything while the whole is told.
        assert!(!is_run_off(&scaled([1.0, 0.1, 1.0, 1.0]), &nominal));
    }

    #[test]
    fn the_plainer_fit_lacks_one_effect_and_is_the_likeliest_of_its_kind() {
        use Effect::{CoulombMotor, Delay, ViscousMotor};
        let all = fit(&[CoulombMotor, ViscousMotor, Delay], 9.0);
        let pool = [
            fit(&[CoulombMotor, Delay], 3.0),
            fit(&[Delay, CoulombMotor], 5.0),
            fit(&[CoulombMotor, ViscousMotor], 7.0),
            fit(&[Delay], 8.0),
        ];
        let told = |i: usize| nested_fit(&all, i, &pool).map(|f| f.log_likelihood);
        assert_eq!((told(0), told(1), told(2)), (None, Some(5.0), Some(7.0)));
    }

    #[test]
    fn what_is_as_likely_with_another_effect_in_its_place_is_confusable_with_it() {
        use Effect::{CoulombMotor, CoulombTable, Delay, Latch, ViscousMotor};
        let chosen = fit(&[CoulombMotor, Delay], 0.0);
        let weighed =
            |effects: &[Effect], evidence: f64| Weighed { fit: fit(effects, 0.0), evidence, probability: 0.0 };
        let ranking = [
            weighed(&[CoulombMotor, Delay], 100.0),
            weighed(&[CoulombTable, Delay], 99.0),
            weighed(&[CoulombMotor, Latch], 98.0),
            weighed(&[ViscousMotor, Latch], 98.0),
            weighed(&[CoulombMotor, ViscousMotor], 100.0 - ALIKE),
            weighed(&[Delay], 99.0),
        ];
        let found = confusable(&chosen, &ranking, 100.0, std::iter::empty());
        let pairs: Vec<_> = found.iter().map(|c| (c.named, c.other, c.difference, c.is_of_place())).collect();
        assert_eq!(pairs, [(CoulombMotor, CoulombTable, 1.0, true), (Delay, Latch, 2.0, false)]);
    }
}
