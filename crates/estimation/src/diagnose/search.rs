//! How a verdict is reached, top to bottom.
//!
//! A hypothesis is a set of effects in their forms beside the axis' own parameters. One function, [`Problem::evidence`], says how
//! well the record speaks for it. One search raises it: from the axis alone, or from the several effects that one regression finds at
//! once where no single one explains it, and from the best of the textbook's combinations (bias, Coulomb, viscous and their asymmetry,
//! all of them compared), an effect is added, dropped or exchanged as long as that helps; then several at once, because of several large
//! causes none helps alone; then beside what was passed by; last the one that leaves the noise alone of less than a drive is true to. The
//! verdict is the hypothesis at the end ([`super::conclusion`]); what it leaves is the remainder. ([`super::steps`] has the single steps,
//! [`super::moves`] what a step may lead to.)
//!
//! Held-out data have no part in it.

use std::sync::atomic::{AtomicBool, Ordering};

use rayon::prelude::*;

use super::decision::Decision;
use super::moves::{MOVED, MOVED_FAR};
use super::pool::Pool;
use crate::axis::Structure;
use crate::effects::Effect;
use crate::hypothesis::discrepancy::Discrepancy;
use crate::hypothesis::fit::{Fit, STEPS};
use crate::hypothesis::likelihood::Band;
use crate::hypothesis::model::Model;
use crate::hypothesis::problem::Problem;
use crate::hypothesis::scales::Scales;

/// Most causes looked for.
pub const MOST: usize = 5;
/// Simulated steps, of all looks at a record, after which what was found is only added to, and after half as many more not even that: ten to
/// seventeen seconds on two cores for the slowest of the blind sets. Ways that were passed by have half of them.
const BUDGET: u64 = 45_000_000;
/// Difference of log evidence below which two hypotheses are alike.
pub const ALIKE: f64 = 3.0;

/// A search over hypotheses.
pub struct Search<'a> {
    /// The record and how it is compared.
    pub problem: Problem<'a>,
    /// Parameters that are known to follow the record.
    pub reference: Model,
    /// Effects that may be named.
    pub suspects: Vec<Effect>,
    /// Discrepancy of the axis with its parameters alone: the gap.
    pub gap: Discrepancy,
    /// Whether something was left untried for want of work.
    pub cut_short: AtomicBool,
    /// Told what is being done.
    pub progress: &'a (dyn Fn(&str) + Sync),
}

/// Finds the hypothesis of largest evidence; from the one that is `known` from another look at the record, where there is one.
#[must_use]
pub fn decide(mut search: Search<'_>, known: Option<&Fit>) -> Decision {
    let baseline = search.baseline();
    let known = known.and_then(|k| search.resumed(k));
    decide_from(search, baseline, known)
}

/// The same where a cause joins those of the hypothesis that is `known` from another look; `None` where none does, or too little is left.
#[must_use]
pub fn decide_further(mut search: Search<'_>, known: &Fit) -> Option<Decision> {
    let mut baseline = search.baseline();
    let known = search.resumed(known)?;
    if search.leaves_nothing(&known) {
        return None;
    }
    search.joined(&known, &mut baseline.pool)?;
    Some(decide_from(search, baseline, Some(known)))
}

/// The axis without any effect.
struct Baseline {
    given: Fit,
    parameters: Fit,
    pool: Pool,
}

fn decide_from(search: Search<'_>, baseline: Baseline, known: Option<Fit>) -> Decision {
    let mut ascent = Ascent::begun(search, baseline, known);
    ascent.beside_the_textbook();
    ascent.several_at_once();
    ascent.what_was_passed_by();
    ascent.down_to_the_noise();
    ascent.ended()
}

/// A search on its way: the hypothesis chosen so far, and all that were fitted.
struct Ascent<'a> {
    search: Search<'a>,
    given: Fit,
    parameters: Fit,
    chosen: Fit,
    pool: Pool,
}

impl<'a> Ascent<'a> {
    /// As far as single steps lead from the parameters alone, or from the hypothesis that is `known`.
    fn begun(search: Search<'a>, baseline: Baseline, known: Option<Fit>) -> Self {
        let Baseline { given, parameters, mut pool } = baseline;
        let known = known.map(|k| search.pruned(k, &mut pool));
        if known.is_some() {
            // What it is likelier than must be known.
            search.extended(&parameters, 0, &mut pool);
        }
        let start = known.unwrap_or_else(|| search.beginning(&given, &parameters, &mut pool));
        let chosen = search.stepwise(start, &mut pool);
        Self { search, given, parameters, chosen, pool }
    }

    /// All of the textbook's combinations, however long it took so far, and whatever else helps beside the best of them: where nothing is
    /// left, as long as there is work left.
    fn beside_the_textbook(&mut self) {
        let (search, chosen) = (&self.search, &self.chosen);
        let leaves_nothing = search.leaves_nothing(chosen);
        // One effect that leaves nothing needs no rival, several of the textbook's own are one of them; a form that says two things at once
        // has one by two effects.
        let is_plain = chosen.terms.iter().all(|(e, form)| !e.info().is_richer(*form));
        let is_textbook = chosen.terms.iter().all(|t| t.0.info().textbook);
        if leaves_nothing && is_plain && (chosen.terms.len() == 1 || is_textbook) {
            return;
        }
        (search.progress)("the textbook's friction");
        // Of accounts that leave next to nothing the shorter is told: a lone effect that does has no rival of two.
        let most = if chosen.terms.len() == 1 && is_plain { search.longest_rival(chosen) } else { MOST };
        let textbook = search.textbook(&self.parameters, chosen);
        self.pool.extend(textbook.iter().cloned());
        let share = search.independent(&textbook);
        let rivals: Vec<Fit> = textbook.into_iter().filter(|f| f.terms.len() <= most).collect();
        let goes_on = |f: &&Fit| f.terms != chosen.terms && !(leaves_nothing && search.is_over_budget());
        if let Some(first) = search.best(&rivals, share).filter(goes_on).cloned() {
            let other = search.stepwise(first, &mut self.pool);
            if search.is_likelier(&other, chosen) {
                self.chosen = other;
            }
        }
    }

    /// Several at once follow any torque by some way: they are believed where they explain it.
    fn several_at_once(&mut self) {
        let search = &self.search;
        let forward = search.forward(self.chosen.clone(), &mut self.pool);
        if search.is_exact(&forward) && search.is_likelier(&forward, &self.chosen) {
            self.chosen = search.stepwise(forward, &mut self.pool);
        }
    }

    /// What was fitted along the way, and is likelier than where the way led, is gone on from: where no work is left, to its end alone.
    fn what_was_passed_by(&mut self) {
        let (search, pool) = (&self.search, &mut self.pool);
        for _ in 0..MOST {
            let has_work_left = !search.is_over_budget();
            if has_work_left {
                search.extend_rivals(&self.chosen, pool);
            }
            let Some(better) = search.better_in_pool(&self.chosen, pool) else { break };
            let terms = better.terms.clone();
            let better = search.pruned(better, pool);
            let other = if has_work_left { search.stepwise(better, pool) } else { better };
            if search.is_likelier_by(search.independent([&self.chosen]), &other, &self.chosen) {
                self.chosen = other;
            } else {
                // It was likelier by what is no cause alone.
                pool.give_up(&terms);
            }
        }
    }

    /// What is less than drives are true to is a cause all the same where one effect leaves no more than the encoders' noise of it: then the
    /// torque of this log is as true as that.
    fn down_to_the_noise(&mut self) {
        let (search, chosen) = (&self.search, &self.chosen);
        if !search.is_negligible(chosen)
            || search.at_floor(chosen)
            || chosen.terms.len() >= MOST
            || search.is_over_budget()
        {
            return;
        }
        let mut all = search.extended(chosen, chosen.terms.len(), &mut self.pool);
        all.retain(|f| search.at_floor(f) && search.leaves_materially_less(&chosen.discrepancy, f));
        if let Some(best) = search.likeliest_account(&all).filter(|f| search.is_likelier(f, chosen)) {
            self.chosen = best;
        }
    }

    /// The decision for what was found, in its best form and pruned once more.
    fn ended(self) -> Decision {
        let Self { search, given, parameters, chosen, mut pool } = self;
        (search.progress)("the forms of what was found");
        let chosen = search.in_best_form(chosen, &mut pool);
        // What was fitted without an effect before the others were there may have ended elsewhere.
        let anew: Vec<Fit> =
            (0..chosen.terms.len()).into_par_iter().filter_map(|i| search.refitted(&chosen, i)).collect();
        pool.extend(anew);
        let chosen = search.pruned(chosen, &mut pool);
        // The parameters alone, too, may have ended elsewhere than where an effect led that is none.
        let parameters = likeliest_parameters(parameters, &pool);
        let parameters = search.told_alone(parameters);
        search.conclude(given, parameters, chosen, pool.into_fits())
    }
}

/// The parameters alone as they were fitted first, or on the way back from an effect where they are likelier there and not alike.
fn likeliest_parameters(first: Fit, pool: &Pool) -> Fit {
    let likelier = |f: &&Fit| !f.coordinates.is_empty() && f.log_likelihood > first.log_likelihood + ALIKE;
    pool.converged(&[]).filter(likelier).cloned().unwrap_or(first)
}

impl Search<'_> {
    /// Fits the axis without any effect, which everything else is measured by.
    fn baseline(&mut self) -> Baseline {
        (self.progress)("the model as given");
        let nominal = self.problem.nominal;
        let given = self.problem.given(&nominal).unwrap_or_else(|| self.problem.nothing());
        let parameters = self.problem.parameters(&self.reference, given.discrepancy, STEPS);
        let parameters = parameters.unwrap_or_else(|| given.clone());
        self.problem.scales = Scales::new(&self.problem, &parameters);
        let mut pool = Pool::default();
        pool.extend([given.clone(), parameters.clone()]);
        self.gap = self.dynamic_gap(&parameters);
        Baseline { given, parameters, pool }
    }

    /// Where single steps begin: at the parameters alone, or at several effects that are found at once where they are likelier than any
    /// of them alone. Parameters that are fitted before all large causes are there run off with what these do: those of two inertias along
    /// valleys in which none has gone far, the one of a rigid axis where it has.
    fn beginning(&self, given: &Fit, parameters: &Fit, pool: &mut Pool) -> Fit {
        let is_coupled = self.problem.nominal.structure == Structure::TwoInertia;
        let run_off = is_coupled || self.have_moved(parameters, MOVED_FAR);
        if !run_off || self.leaves_nothing(parameters) {
            return parameters.clone();
        }
        let mut alone = self.extended(parameters, 0, pool);
        alone.push(parameters.clone());
        let Some(alone) = self.likeliest_account(&alone).filter(|f| !self.leaves_nothing(f) && !self.is_enough(f))
        else {
            return parameters.clone();
        };
        (self.progress)("several causes at once");
        let several = self.several(given);
        pool.extend(several.iter().cloned());
        let likelier = self.likeliest_account(&several).filter(|f| self.is_likelier(f, &alone));
        likelier.map_or_else(|| parameters.clone(), |f| self.pruned(f, pool))
    }

    #[cfg(test)]
    pub fn only_begun(&mut self) -> Fit {
        let Baseline { given, parameters, mut pool } = self.baseline();
        self.beginning(&given, &parameters, &mut pool)
    }

    /// What the axis' parameters alone are told to be: where they have gone far and that leaves less of the torque, as the motion has them.
    fn told_alone(&self, parameters: Fit) -> Fit {
        let by_motion = self.have_moved(&parameters, MOVED).then(|| {
            let told = self.problem.parameters_with_motion_given(parameters.discrepancy, STEPS);
            told.filter(|f| self.left(f) < self.left(&parameters))
        });
        by_motion.flatten().unwrap_or(parameters)
    }

    /// A fit from another look at the record, or begun from another's values, made to its end.
    pub fn resumed(&self, known: &Fit) -> Option<Fit> {
        let fit = self.problem.fit(&known.model, &known.terms, known.discrepancy, STEPS)?;
        self.problem.deepen(&fit)
    }

    pub fn band(&self) -> &Band {
        self.problem.band
    }

    /// Whether enough was simulated for what was found to be only added to. Asked between two looks alone, where it is the same on any
    /// number of threads.
    pub fn is_over_budget(&self) -> bool {
        let over = self.problem.steps() > BUDGET;
        self.cut_short.fetch_or(over, Ordering::Relaxed);
        over
    }

    /// Whether enough was simulated for no further way to be gone that was passed by.
    pub fn is_over_half_of_budget(&self) -> bool {
        self.problem.steps() > BUDGET / 2
    }

    /// Whether enough was simulated for nothing to be added either.
    pub fn is_far_over_budget(&self) -> bool {
        self.problem.steps() > BUDGET + BUDGET / 2
    }

    pub fn evidence(&self, fit: &Fit, independent: f64) -> f64 {
        self.problem.evidence(fit, independent)
    }

    /// Share of independent values of the residual of the likeliest.
    pub fn independent<'f>(&self, fits: impl IntoIterator<Item = &'f Fit>) -> f64 {
        let best = fits.into_iter().max_by(|a, b| a.log_likelihood.total_cmp(&b.log_likelihood));
        best.map_or(1.0, |f| self.band().independent(&f.rows, f.discrepancy))
    }

    /// Whether a fit is likelier than another, with as much of its residual independent as the one that fits better leaves so.
    pub fn is_likelier(&self, fit: &Fit, than: &Fit) -> bool {
        self.is_likelier_by(self.independent([fit, than]), fit, than)
    }

    /// The same with a share of its residual independent.
    pub fn is_likelier_by(&self, share: f64, fit: &Fit, than: &Fit) -> bool {
        self.evidence(fit, share) > self.evidence(than, share)
    }

    /// The likeliest of several accounts, with as much of the residual independent as the one that fits best leaves so.
    pub fn likeliest_account(&self, fits: &[Fit]) -> Option<Fit> {
        self.best(fits, self.independent(fits)).cloned()
    }

    pub fn best<'f>(&self, fits: &'f [Fit], independent: f64) -> Option<&'f Fit> {
        let admitted = fits.iter().filter(|f| !f.at_bound);
        admitted.max_by(|a, b| self.evidence(a, independent).total_cmp(&self.evidence(b, independent)))
    }
}

/// Whether a fit has all effects of another, and more.
pub fn is_extension(fit: &Fit, than: &Fit) -> bool {
    fit.terms.len() > than.terms.len() && than.terms.iter().all(|t| fit.terms.iter().any(|o| o.0 == t.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::axis::Parameters;
    use crate::effects::Settings;
    use crate::hypothesis::fit::Term;

    fn fit(terms: &[Term]) -> Fit {
        Fit::of_likelihood(Model::new(Parameters::PAPER, Structure::TwoInertia, Settings::default()), terms, 0.0)
    }

    #[test]
    fn of_the_parameters_alone_the_likeliest_that_were_fitted_are_told() {
        let at = |log_likelihood: f64, free: bool| {
            let fit = Fit { log_likelihood, ..fit(&[]) };
            if free { fit } else { Fit { coordinates: Vec::new(), ..fit } }
        };
        let told = |others: &[Fit]| {
            let mut pool = Pool::default();
            pool.extend(others.iter().cloned());
            likeliest_parameters(at(1.0, true), &pool).log_likelihood
        };
        assert_eq!(told(&[at(0.0, false), at(1.0, true), at(1.0 + ALIKE, true)]), 1.0);
        assert_eq!(
            told(&[at(1.0, true), at(7.0, true), Fit { log_likelihood: 9.0, ..fit(&[(Effect::Delay, 0)]) }]),
            7.0
        );
        // The model as given has none free.
        assert_eq!(told(&[at(8.0, false)]), 1.0);
    }

    #[test]
    fn a_fit_is_more_than_another_when_it_has_all_its_effects_in_any_form_and_further_ones() {
        let (coulomb, viscous) = (Effect::CoulombMotor, Effect::ViscousMotor);
        assert!(is_extension(&fit(&[(coulomb, 1), (viscous, 0)]), &fit(&[(coulomb, 0)])));
        assert!(!is_extension(&fit(&[(coulomb, 1)]), &fit(&[(coulomb, 0)])));
        assert!(!is_extension(&fit(&[(coulomb, 0), (viscous, 0)]), &fit(&[(Effect::Delay, 0)])));
    }
}
