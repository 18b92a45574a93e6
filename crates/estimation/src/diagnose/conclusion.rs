//! The verdict on the hypothesis that a search ended with: how likely each of its effects is, and whether they may be named.

use std::ops::ControlFlow::{self, Break, Continue};
use std::sync::atomic::Ordering;

use itertools::Itertools;

use super::confidence::{discounted, usual_odds};
use super::decision::Decision;
use super::diagnosis::Undecided;
use super::material::{MATERIAL, MINOR};
use super::moves::{MOVED, MOVED_FAR};
use super::pool::likeliest_of;
use super::search::{ALIKE, Search, is_extension};
use super::verdict::Verdict;
use super::weighing::{Confusable, Nested, Weighed, Weighing, has_one_like, instead, is_likely};
use crate::effects::{Effect, Family, ONCE};
use crate::hypothesis::determined::{is_simpler, is_undetermined, steadiness};
use crate::hypothesis::fit::{Fit, Term};
use crate::hypothesis::model::Model;
use crate::trace::machine::NOMINAL_OFF;

/// Hypotheses that are told, each with its own run over the held-out data.
pub const REPORTED: usize = 12;

/// A hypothesis that may be told, weighed among its rivals.
struct Account {
    chosen: Fit,
    /// The same along its own motion.
    finished: Fit,
    /// Share of the values that are independent.
    independent: f64,
    weighing: Weighing,
    /// The one of several effects that stays open beside those that are told.
    open: Option<usize>,
}

impl Search<'_> {
    /// The verdict on the hypothesis at the end.
    pub fn conclude(&self, given: Fit, parameters: Fit, chosen: Fit, pool: Vec<Fit>) -> Decision {
        let axis = [&given, &parameters];
        let mut next = (chosen, pool);
        let mut passed: Vec<Vec<Term>> = Vec::new();
        let mut account = loop {
            // Of two that lead to one another the one that is come back to is told.
            let is_settled = passed.contains(&next.0.terms);
            passed.push(next.0.terms.clone());
            match self.account(axis, next, is_settled) {
                Break(account) => break account,
                Continue(other) => next = other,
            }
        };
        self.without_the_least_likely(&mut account, axis).unwrap_or_else(|| self.told(account, given, parameters))
    }

    /// What may be told of a hypothesis among all that were fitted, or that in its place.
    fn account(
        &self,
        [given, parameters]: [&Fit; 2],
        (chosen, mut pool): (Fit, Vec<Fit>),
        is_settled: bool,
    ) -> ControlFlow<Account, (Fit, Vec<Fit>)> {
        pool.push(chosen.clone());
        let independent = self.independent([&chosen]);
        let plain = if self.are_off(given, parameters, independent) { parameters } else { given };
        let is_of_another_axis = |f: &Fit| !f.terms.is_empty() && is_run_off(f, &self.problem.nominal);
        if is_of_another_axis(&chosen) {
            // The likeliest that says something of this one.
            pool.retain(|f| !is_of_another_axis(f));
            let next = self.best(&pool, independent).filter(|f| !f.terms.is_empty()).unwrap_or(plain).clone();
            return Continue((next, pool));
        }
        let chosen = if chosen.terms.is_empty() { plain.clone() } else { chosen };
        self.retain_rivals(&chosen, &mut pool, independent);
        let finished = self.problem.finished(&chosen, independent).unwrap_or_else(|| chosen.clone());
        if !is_settled && let Some(simple) = self.simplified(&finished, independent, &pool) {
            return Continue((simple, pool));
        }
        let mut weighing = self.weigh(&chosen, &finished, parameters, pool, independent);
        // One that is not likely explains nothing that needs a cause, but where it alone leaves the noise of many times that.
        if let [only] = weighing.probabilities[..]
            && !is_likely(&only)
            && self.needs_no_cause(plain)
            && (!self.at_floor(&chosen) || self.band().is_near_the_noise(&plain.rows))
        {
            return Continue((plain.clone(), weighing.into_fits()));
        }
        weighing.share_with_twins();
        let open = weighing.open(&chosen);
        if let Some(shorter) = open.and_then(|i| weighing.instead_of_open(&chosen, i)).filter(|_| !is_settled) {
            return Continue((shorter, weighing.into_fits()));
        }
        Break(Account { chosen, finished, independent, weighing, open })
    }

    /// The verdict without the one of several effects that is not likely; `None` where there is none such, or it stays open.
    fn without_the_least_likely(&self, account: &mut Account, axis: [&Fit; 2]) -> Option<Decision> {
        let Account { chosen, weighing, independent, open, .. } = account;
        let least = weighing.least_likely().filter(|_| open.is_none() && chosen.terms.len() > 1)?;
        let refitted = weighing.refitted(least).or_else(|| self.refitted(chosen, least))?;
        let [with_it, without_it] = [&*chosen, &refitted].map(|fit| self.confidence(axis[1], fit));
        let without = self.concluded_without(chosen, least, refitted, &weighing.ranking, axis, *independent);
        // Beside what it leaves the others may be lost, which beside it are likely, or others take a part of that: then it stays, and is
        // not named.
        let others = weighing.likely();
        let is_its_own = inertia_off(chosen, &self.problem.nominal) < MOVED_FAR;
        let keeps_the_others = without.named() >= others && is_extension(chosen, &without.chosen);
        if others + 1 < chosen.terms.len() || !self.is_understood(chosen) || !is_its_own || keeps_the_others {
            return Some(without);
        }
        // As likely as it is none, the others are beside what is left without it.
        let there = weighing.probabilities[least];
        weighing.doubt_beside(least, there + (1.0 - there) * without_it / with_it);
        *open = Some(least);
        None
    }

    /// The decision for an account of which an effect may stay open.
    fn told(&self, account: Account, given: Fit, parameters: Fit) -> Decision {
        let verdict = self.verdict(&account);
        let Account { finished, independent, weighing, open, .. } = account;
        let Weighing { mut ranking, twins, probabilities, .. } = weighing;
        let shares = self.shares(&finished);
        let effects = |i: usize| instead(&ranking, &finished, i, twins[i]);
        let undecided = open.map(|i| Undecided { effects: effects(i), share_of_gap: shares[i] });
        let twins = twins.into_iter().flatten().filter(|t| t.difference < ALIKE);
        let confusable = confusable(&finished, &ranking, self.evidence(&finished, independent), twins);
        ranking.truncate(REPORTED);
        Decision {
            verdict,
            cut_short: self.cut_short.load(Ordering::Relaxed),
            motion_is_given: self.band().motion_is_given(),
            given,
            parameters,
            chosen: finished,
            ranking,
            shares,
            probabilities,
            independent,
            confusable,
            undecided,
        }
    }

    fn verdict(&self, Account { chosen, weighing, open, .. }: &Account) -> Verdict {
        let are_likely = weighing.likely() + usize::from(open.is_some()) == chosen.terms.len();
        match chosen.terms.is_empty() {
            false if are_likely && self.is_understood(chosen) => Verdict::Effect,
            false => Verdict::Unexplained,
            true if is_run_off(chosen, &self.problem.nominal) => Verdict::Unexplained,
            true if !self.needs_no_cause(chosen) => Verdict::Unexplained,
            true if chosen.coordinates.is_empty() => Verdict::NoGap,
            true => Verdict::Parameters,
        }
    }

    /// Whether a hypothesis leaves no more of the torque than that its causes are none of suspects, however large the gap was.
    fn is_understood(&self, chosen: &Fit) -> bool {
        self.left(chosen) <= MATERIAL
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

    fn scaled(by: [f64; 4]) -> Fit {
        let mut fit = fit(&[], 0.0);
        let p = &mut fit.model.parameters;
        for (value, by) in [&mut p.i1, &mut p.i2, &mut p.b, &mut p.k].into_iter().zip(by) {
            *value *= by;
        }
        fit
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
