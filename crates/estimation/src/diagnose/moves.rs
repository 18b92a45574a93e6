//! The ways from one fit to others: with an effect more, less, or in another's place or form.

use std::sync::atomic::{AtomicUsize, Ordering};

use itertools::Itertools;
use rayon::prelude::*;

use super::pool::Pool;
use super::race::RACING;
use super::search::{MOST, Search};
use crate::effects::Effect;
use crate::hypothesis::determined::is_simpler;
use crate::hypothesis::fit::{Fit, PROBE, Term};
use crate::hypothesis::likelihood::NEAR_THE_NOISE;
use crate::hypothesis::model::{Coordinate, Model};
use crate::hypothesis::starts::{Screening, StartPoint};

/// The best that are gone on with: effects, in their richer forms, and twice as many in one; hypotheses of each size, beside the chosen way.
pub const PROMISING: usize = 4;
/// The best of a regression of several effects: starts of each form that enter it, sets of each size that are fitted, those that go on.
const BEST: usize = 3;
/// Change of a parameter, in its logarithm, from which effects are looked for beside the nominal ones, too.
pub const MOVED: f64 = 0.2;
/// The same beside effects, which let most parameters be what they are, and from which one inertia has taken what they do: a factor of two.
pub const MOVED_FAR: f64 = 0.7;

impl Search<'_> {
    /// Every combination of the textbook's effects at the motor, each from its own regression.
    pub fn textbook(&self, parameters: &Fit, chosen: &Fit) -> Vec<Fit> {
        let own: Vec<Effect> = self.suspects.iter().copied().filter(|e| e.info().textbook).collect();
        // A set begins with a shorter one, which is fitted before it.
        let mut all: Vec<Fit> = Vec::new();
        let mut shorter = vec![(parameters.clone(), 0)];
        while !shorter.is_empty() {
            let longer: Vec<(Fit, usize)> = shorter
                .par_iter()
                .filter_map(|(fit, next)| Some((fit, next, Screening::of(&self.problem, fit)?)))
                .flat_map(|(fit, next, screening)| {
                    let fitted = |(next, start): (usize, StartPoint)| -> Option<(Fit, usize)> {
                        Some((screening.fitted(&start, fit.terms.len(), fit.discrepancy)?, next))
                    };
                    let joining =
                        own.par_iter().enumerate().skip(*next).filter(|(_, e)| self.may_join(&fit.terms, **e));
                    let starts: Vec<(usize, StartPoint)> = joining
                        .flat_map_iter(|(i, e)| {
                            let simple: Vec<usize> = (0..e.info().variants.len().min(2)).collect();
                            let of_forms = screening.starts(*e, &simple).into_iter();
                            of_forms.filter_map(move |starts| Some((i + 1, starts.into_iter().next()?)))
                        })
                        .collect();
                    starts.into_par_iter().filter_map(fitted).collect::<Vec<_>>()
                })
                .collect();
            all.extend(longer.iter().map(|(fit, _)| fit).filter(|f| f.terms.len() > 1).cloned());
            shorter = longer;
        }
        self.raced(all, None, Some(chosen))
    }

    /// Whether an effect may stand beside these.
    fn may_join(&self, terms: &[Term], effect: Effect) -> bool {
        terms.iter().all(|(e, _)| *e != effect && !e.excludes(effect))
    }

    /// The fits with one effect more, each looked for once; anew beside a fit that leaves materially less than the one beside which they
    /// were looked for, which is not what they would have to explain.
    pub fn extended(&self, fit: &Fit, keep: usize, pool: &mut Pool) -> Vec<Fit> {
        if let Some(known) = pool.extensions(&fit.terms, |left| !self.leaves_materially_less(left, fit)) {
            return known;
        }
        let mut added = self.added(fit, keep);
        added.extend(self.put_back(fit).iter().flat_map(|f| self.added(f, keep)));
        let added = self.raced(added, Some(fit), None);
        pool.extend_all(fit, &added);
        added
    }

    /// Whether an axis' own parameter is that far from its nominal value in a fit, in its logarithm.
    pub fn have_moved(&self, fit: &Fit, far: f64) -> bool {
        let nominal = &self.problem.nominal;
        let moved = |c: &Coordinate| c.is_base() && (c.value(&fit.model) / c.value(nominal)).ln().abs() >= far;
        fit.coordinates.iter().any(moved)
    }

    /// The fit with its parameters back at their nominal values, held there and free, where they have gone far: they may have taken what
    /// an effect does, and free beside it take it again.
    fn put_back(&self, fit: &Fit) -> Vec<Fit> {
        let nominal = &self.problem.nominal;
        if !self.have_moved(fit, if fit.terms.is_empty() { MOVED } else { MOVED_FAR }) {
            return Vec::new();
        }
        let back = self.problem.given(&Model { parameters: nominal.parameters, ..fit.model });
        let held = back.map(|given| Fit { terms: fit.terms.clone(), ..given });
        let freed = held.as_ref().filter(|f| f.terms.is_empty()).and_then(|f| self.problem.freed(f));
        held.into_iter().chain(freed).collect()
    }

    /// The fit with each effect that may join it, a few steps from the best starts of all ([`gone_on_from`]).
    fn added(&self, fit: &Fit, keep: usize) -> Vec<Fit> {
        let Some(screening) = Screening::of(&self.problem, fit) else { return Vec::new() };
        let suspects: Vec<Effect> = self.suspects.iter().copied().filter(|e| self.may_join(&fit.terms, *e)).collect();
        let of = |effects: &[Effect], richer: bool| -> Vec<StartPoint> {
            let best = |starts: Vec<StartPoint>| starts.into_iter().take(2);
            let of_effect = |e: &Effect| screening.starts(*e, &forms(*e, richer)).into_iter().flat_map(best);
            effects.par_iter().flat_map_iter(of_effect).collect()
        };
        // Forms that free more than another are looked at where that other is among the best.
        let mut points = of(&suspects, false);
        points.sort_by(|a, b| b.gain.total_cmp(&a.gain));
        let promising: Vec<Effect> = points.iter().map(|p| p.term.0).unique().take(PROMISING).collect();
        points.extend(of(&promising, true));
        points.sort_by(|a, b| b.gain.total_cmp(&a.gain));
        let points = gone_on_from(points, |p| p.term.0);
        let from = screening.fit.discrepancy;
        let done = AtomicUsize::new(0);
        let probe = |start: &StartPoint| {
            let fitted = screening.fitted(start, keep, from);
            let n = done.fetch_add(1, Ordering::Relaxed) + 1;
            (self.progress)(&format!("{n} of {} fits of a cause beside {}", points.len(), fit.terms.len()));
            fitted
        };
        points.par_iter().filter_map(probe).collect()
    }

    /// Accounts by several effects beside the model as given, each a few steps on from one regression of all of them, and on as they
    /// keep up with one another.
    pub fn several(&self, given: &Fit) -> Vec<Fit> {
        let freed = self.problem.freed(given);
        let Some(screening) = freed.and_then(|fit| Screening::of(&self.problem, &fit)) else { return Vec::new() };
        let starts = |e: &Effect| {
            let forms: Vec<usize> = (0..e.info().variants.len()).collect();
            screening.starts(*e, &forms).into_iter().flat_map(|of_form| of_form.into_iter().take(BEST))
        };
        let points: Vec<StartPoint> = self.suspects.par_iter().flat_map_iter(starts).collect();
        let subsets = screening.best_subsets(&points, MOST, BEST);
        let coarse = self.problem.coarse();
        let mut probed: Vec<Fit> = Vec::new();
        for size in 2..=MOST {
            if self.is_over_budget() {
                break;
            }
            let of_size = subsets.par_iter().filter(|s| s.terms.len() == size);
            probed.par_extend(of_size.filter_map(|s| coarse.fit(&s.model, &s.terms, s.discrepancy, PROBE)));
        }
        let share = self.independent(&probed);
        probed.sort_by(|a, b| self.evidence(b, share).total_cmp(&self.evidence(a, share)));
        probed.truncate(BEST);
        self.raced(probed, None, None)
    }

    /// The fit without one of its effects: the known one, unless the richer fit as it stands is likelier without that effect already,
    /// which has then shown it a better place only.
    pub fn without(&self, fit: &Fit, i: usize, pool: &Pool) -> Option<Fit> {
        let mut terms = fit.terms.clone();
        terms.remove(i);
        let bare = || {
            let at = self.problem.along(&self.bare(fit, i), fit.bandwidth)?;
            Some(self.band().log_likelihood(&at.rows, at.s))
        };
        let known = pool.converged(&terms).filter(|k| bare().is_none_or(|l| k.log_likelihood >= l));
        known.cloned().or_else(|| self.refitted(fit, i))
    }

    /// The fit's model without one of its effects, all else as it is.
    fn bare(&self, fit: &Fit, i: usize) -> Model {
        let (gone, _) = fit.terms[i];
        let mut model = fit.model;
        model.effects.of_mut(gone).copy_from_slice(self.problem.nominal.effects.of(gone));
        model
    }

    /// The fit without one of its effects, from where it stands.
    pub fn refitted(&self, fit: &Fit, i: usize) -> Option<Fit> {
        let mut terms = fit.terms.clone();
        terms.remove(i);
        let plain = self.problem.coarse().fit(&self.bare(fit, i), &terms, fit.discrepancy, PROBE)?;
        self.problem.deepen(&plain)
    }

    /// What an effect is looked for in: the fit without one of its effects, everything else from where it stands.
    fn screening_without(&self, fit: &Fit, i: usize) -> Option<Screening<'_>> {
        let mut terms = fit.terms.clone();
        terms.remove(i);
        let held = Fit { terms, ..self.problem.given(&self.bare(fit, i))? };
        Screening::of(&self.problem, &self.problem.freed(&held)?)
    }

    /// The fit with another effect in the place of one of its own; `None` where that leaves far more from the start.
    pub fn with_another(&self, fit: &Fit, i: usize, other: Term) -> Option<Fit> {
        let screening = self.screening_without(fit, i)?;
        let start = screening.best_start(other)?;
        let at = self.problem.along(&start.model, screening.fit.bandwidth)?;
        let [begins, own] = [&at.rows, &fit.rows].map(|rows| self.band().noise_multiple(rows));
        if begins > NEAR_THE_NOISE * own.max(1.0) {
            return None;
        }
        self.problem.deepen(&screening.fitted(&start, i, screening.fit.discrepancy)?)
    }

    /// The fit with one of its effects in each form that frees more, everything else from where it stands: what the plain form lacks the
    /// others may have taken, and without it they would stand elsewhere.
    pub fn reformed(&self, fit: &Fit, i: usize) -> Vec<Fit> {
        let (effect, form) = fit.terms[i];
        let info = effect.info();
        let richer: Vec<usize> = (0..info.variants.len()).filter(|v| info.frees_more(*v, form)).collect();
        let Some(screening) = (!richer.is_empty()).then(|| self.screening_without(fit, i)).flatten() else {
            return Vec::new();
        };
        let best = |starts: Vec<StartPoint>| starts.into_iter().take(2);
        let points: Vec<StartPoint> = screening.starts(effect, &richer).into_iter().flat_map(best).collect();
        let probed = points.par_iter().filter_map(|start| screening.fitted(start, i, fit.discrepancy)).collect();
        self.raced(probed, None, Some(fit))
    }

    /// The likelier fit with the simpler law of the same thing in place of an effect that stands where it is that law: a known one, or else
    /// from where that stands.
    pub fn simplified(&self, fit: &Fit, independent: f64, pool: &[Fit]) -> Option<Fit> {
        let at = (0..fit.terms.len()).find(|i| is_simpler(fit, fit.terms[*i].0, independent))?;
        let gone = fit.terms[at].0.info();
        let is_simple = |e: &Effect| {
            let info = e.info();
            e.simpler_at_zero().is_none() && (info.family, info.place) == (gone.family, gone.place)
        };
        let simple = self.suspects.iter().copied().find(is_simple)?;
        let same = |f: &&Fit| {
            let others = || fit.terms.iter().enumerate().filter(|(i, _)| *i != at).map(|(_, t)| t);
            f.terms.len() == fit.terms.len()
                && others().all(|t| f.terms.contains(t))
                && f.terms.iter().any(|t| t.0 == simple)
        };
        let is_likelier = |f: &Fit| !f.at_bound && self.is_likelier_by(independent, f, fit);
        let known: Vec<Fit> = pool.iter().filter(same).cloned().collect();
        let known = self.best(&known, independent).filter(|f| is_likelier(f)).cloned();
        known.or_else(|| self.as_simpler(fit, at, simple).filter(is_likelier))
    }

    /// The fit with the simpler law in the place of an effect that has its size first, too, from where that stands.
    fn as_simpler(&self, fit: &Fit, at: usize, simple: Effect) -> Option<Fit> {
        let mut model = self.bare(fit, at);
        model.effects.of_mut(simple)[0] = fit.model.effects.of(fit.terms[at].0)[0];
        let mut terms = fit.terms.clone();
        terms[at] = (simple, 0);
        self.resumed(&Fit { model, terms, ..fit.clone() })
    }
}

/// Of starts, best first, two for each place in the race, and the first of every promising effect beside those: what a regression promises
/// of the forms of one friction differs by less than what the fits come to.
fn gone_on_from<P>(starts: Vec<P>, effect: impl Fn(&P) -> Effect) -> Vec<P> {
    let first: Vec<usize> = (0..starts.len()).unique_by(|&at| effect(&starts[at])).take(2 * PROMISING).collect();
    let is_gone_on_from = |(at, start): (usize, P)| (at < 2 * RACING || first.contains(&at)).then_some(start);
    starts.into_iter().enumerate().filter_map(is_gone_on_from).collect()
}

/// Forms of an effect: those that free all that an earlier one does and more, or the others.
fn forms(effect: Effect, richer: bool) -> Vec<usize> {
    let info = effect.info();
    (0..info.variants.len()).filter(|v| info.is_richer(*v) == richer).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::EFFECTS;

    #[test]
    fn many_starts_of_one_effect_leave_the_first_of_others_in_and_no_more() {
        let crowd = [Effect::CoulombMotor; 2 * RACING];
        let others = [Effect::ViscousMotor, Effect::ViscousMotor, Effect::CoulombMotor, Effect::Delay];
        let starts: Vec<Effect> = crowd.iter().chain(&others).copied().collect();
        let on = gone_on_from(starts, |e| *e);
        assert_eq!(on[..2 * RACING], crowd);
        assert_eq!(on[2 * RACING..], [Effect::ViscousMotor, Effect::Delay]);
        // Of effects that each have one the best.
        let on = gone_on_from(EFFECTS.to_vec(), |e| *e);
        assert_eq!(on, EFFECTS[..2 * RACING]);
    }

    #[test]
    fn every_form_of_an_effect_is_looked_at_once_the_plain_ones_first() {
        for &e in EFFECTS {
            let mut all = forms(e, false);
            assert!(all.contains(&0), "{e:?}");
            all.extend(forms(e, true));
            all.sort_unstable();
            assert_eq!(all, (0..e.info().variants.len()).collect::<Vec<usize>>());
        }
    }
}
