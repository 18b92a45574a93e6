//! How a verdict is reached, top to bottom.
//!
//! A hypothesis is a set of effects in their forms beside the axis' own parameters. One function, [`Problem::evidence`], says how
//! well the record speaks for it. One search raises it: from the axis alone and from the best of the textbook's combinations
//! (bias, Coulomb, viscous and their asymmetry, all of them compared), an effect is added, dropped or exchanged as long as that
//! helps; then several at once, because of several large causes none helps alone. The verdict is the hypothesis at the end; what it
//! leaves is the remainder.
//!
//! Held-out data have no part in it.

use std::sync::atomic::{AtomicBool, Ordering};

use rayon::prelude::*;

use super::conclusion::Decision;
use super::moves::{MOVED, PROMISING};
use super::pool::Pool;
use crate::axis::Structure;
use crate::effects::Effect;
use crate::hypothesis::determined::is_lost;
use crate::hypothesis::discrepancy::Discrepancy;
use crate::hypothesis::fit::{Fit, STEPS, Term};
use crate::hypothesis::likelihood::Band;
use crate::hypothesis::model::Model;
use crate::hypothesis::problem::Problem;
use crate::hypothesis::scales::Scales;

/// Most causes looked for.
const MOST: usize = 5;
/// Simulated steps, of all looks at a record, after which what was found is only added to, and after half as many more not even that: ten to
/// seventeen seconds on two cores for the slowest of the blind sets. Ways that were passed by have half of them.
const BUDGET: u64 = 45_000_000;
/// Difference of log evidence below which two hypotheses are alike.
pub const ALIKE: f64 = 3.0;

/// What one fit is measured against another by: the larger, the better.
type Measure<'m> = &'m dyn Fn(&Fit) -> f64;

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
    let Baseline { given, parameters, mut pool } = baseline;
    let known = known.map(|k| search.pruned(k, &mut pool));
    if known.is_some() {
        // What it is likelier than must be known.
        search.extended(&parameters, 0, &mut pool);
    }
    let mut chosen = search.stepwise(known.unwrap_or_else(|| parameters.clone()), &mut pool);
    // A rigid axis has one inertia, which runs off with no more than a share of any cause.
    let coupled = search.problem.nominal.structure == Structure::TwoInertia;
    if coupled && !search.leaves_nothing(&chosen) && search.have_moved(&parameters, MOVED) {
        (search.progress)("near the data sheet's parameters");
        if let Some(other) = search.near_the_data_sheet(&given) {
            pool.push(other.clone());
            if search.is_likelier(&other, &chosen) {
                chosen = search.stepwise(other, &mut pool);
            }
        }
    }
    let leaves_nothing = search.leaves_nothing(&chosen);
    // One effect that leaves nothing needs no rival, several of the textbook's own are one of them.
    let is_short = chosen.terms.len() == 1 || chosen.terms.iter().all(|t| t.0.info().textbook);
    if !(leaves_nothing && is_short) {
        // All of the textbook's combinations, however long it took so far, and whatever else helps beside the best of them: where nothing is
        // left, as long as there is work left.
        (search.progress)("the textbook's friction");
        // Of accounts that leave next to nothing the shorter is told: a lone effect that does has no rival of two.
        let most = if chosen.terms.len() == 1 { search.longest_rival(&chosen) } else { MOST };
        let textbook = search.textbook(&parameters, &chosen);
        pool.extend(textbook.iter().cloned());
        let share = search.independent(&textbook);
        let rivals: Vec<Fit> = textbook.into_iter().filter(|f| f.terms.len() <= most).collect();
        let goes_on = |f: &&Fit| f.terms != chosen.terms && !(leaves_nothing && search.is_over_budget());
        if let Some(first) = search.best(&rivals, share).filter(goes_on).cloned() {
            let other = search.stepwise(first, &mut pool);
            if search.is_likelier(&other, &chosen) {
                chosen = other;
            }
        }
    }
    // Several at once follow any torque by some way: they are believed where they explain it. From the beginning by what a record of any
    // length would find: a form that earns its price only beside the next cause was passed by on the way.
    let evidence = |f: &Fit| search.evidence(f, 1.0);
    let ways: [(&Fit, Measure<'_>); 2] = [(&chosen.clone(), &evidence), (&parameters, &akaike)];
    for (from, by) in ways {
        let forward = search.forward(from.clone(), by, &mut pool);
        if search.is_exact(&forward) && search.is_likelier(&forward, &chosen) {
            chosen = search.stepwise(forward, &mut pool);
        }
        if search.at_floor(&chosen) || search.is_enough(&chosen) {
            break;
        }
    }
    // What was fitted along the way, and is likelier than where the way led, is gone on from.
    for _ in 0..MOST {
        if search.is_over_budget() {
            break;
        }
        search.extend_rivals(&chosen, &mut pool);
        let Some(better) = search.better_in_pool(&chosen, &pool) else { break };
        let terms = better.terms.clone();
        let better = search.pruned(better, &mut pool);
        let other = search.stepwise(better, &mut pool);
        if other.terms == chosen.terms {
            break;
        }
        if search.is_likelier_by(search.independent([&chosen]), &other, &chosen) {
            chosen = other;
        } else {
            // It was likelier by what is no cause alone.
            pool.give_up(&terms);
        }
    }
    (search.progress)("the forms of what was found");
    let chosen = search.in_best_form(chosen, &mut pool);
    // What was fitted without an effect before the others were there may have ended elsewhere.
    let anew: Vec<Fit> = (0..chosen.terms.len()).into_par_iter().filter_map(|i| search.refitted(&chosen, i)).collect();
    pool.extend(anew);
    let chosen = search.pruned(chosen, &mut pool);
    let parameters = search.told_alone(parameters);
    search.conclude(given, parameters, chosen, pool.into_fits())
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

    /// What the axis' parameters alone are told to be: where they have gone far and that leaves less of the torque, as the motion has them.
    fn told_alone(&self, parameters: Fit) -> Fit {
        let by_motion = self.have_moved(&parameters, MOVED).then(|| {
            let told = self.problem.parameters_with_motion_given(parameters.discrepancy, STEPS);
            told.filter(|f| self.left(f) < self.left(&parameters))
        });
        by_motion.flatten().unwrap_or(parameters)
    }

    /// A fit from another look at the record, made to its end.
    fn resumed(&self, known: &Fit) -> Option<Fit> {
        let fit = self.problem.fit(&known.model, &known.terms, known.discrepancy, STEPS)?;
        self.problem.deepen(&fit)
    }

    pub fn band(&self) -> &Band {
        self.problem.band
    }

    /// Whether enough was simulated for what was found to be only added to. Asked between two looks alone, where it is the same on any
    /// number of threads.
    fn is_over_budget(&self) -> bool {
        let over = self.problem.steps() > BUDGET;
        self.cut_short.fetch_or(over, Ordering::Relaxed);
        over
    }

    /// Whether enough was simulated for no further way to be gone that was passed by.
    fn is_over_half_of_budget(&self) -> bool {
        self.problem.steps() > BUDGET / 2
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
    fn is_likelier(&self, fit: &Fit, than: &Fit) -> bool {
        self.is_likelier_by(self.independent([fit, than]), fit, than)
    }

    /// The same with a share of its residual independent.
    fn is_likelier_by(&self, share: f64, fit: &Fit, than: &Fit) -> bool {
        self.evidence(fit, share) > self.evidence(than, share)
    }

    /// The likeliest of several accounts, with as much of the residual independent as the one that fits best leaves so.
    fn likeliest_account(&self, fits: &[Fit]) -> Option<Fit> {
        self.best(fits, self.independent(fits)).cloned()
    }

    fn best<'f>(&self, fits: &'f [Fit], independent: f64) -> Option<&'f Fit> {
        let admitted = fits.iter().filter(|f| !f.at_bound);
        admitted.max_by(|a, b| self.evidence(a, independent).total_cmp(&self.evidence(b, independent)))
    }

    /// Adds, drops and exchanges effects as long as the evidence grows.
    fn stepwise(&self, from: Fit, pool: &mut Pool) -> Fit {
        let mut best = from;
        let mut passed: Vec<Vec<Term>> = Vec::new();
        for _ in 0..2 * MOST {
            // What is likelier and explains no material part more is pruned again: the way goes round.
            if passed.contains(&best.terms) {
                break;
            }
            passed.push(best.terms.clone());
            if self.at_floor(&best) {
                break;
            }
            let enough = self.is_enough(&best);
            (self.progress)(&format!("{} hypotheses fitted", pool.fits().len()));
            // What is dropped again was no way on: an exchange may be.
            if !self.is_negligible(&best)
                && let Some(next) = self.joined(&best, pool).map(|next| self.pruned(next, pool))
                && !passed.contains(&next.terms)
            {
                best = next;
                continue;
            }
            // What was named first was named without the others, however little they leave together.
            let other = self.exchanged(best.clone(), pool);
            // Where next to nothing is left, a freer account only follows what no log is true to.
            let freer = enough && other.coordinates.len() > best.coordinates.len();
            if other.terms == best.terms || freer {
                break;
            }
            best = self.pruned(other, pool);
        }
        best
    }

    /// Effects that another account may have at most: of those that leave next to nothing the shorter is told.
    pub fn longest_rival(&self, chosen: &Fit) -> usize {
        if self.leaves_little(chosen) { chosen.terms.len() } else { MOST }
    }

    /// The hypothesis of largest evidence, where it is another than the chosen one and not that with something small beside it.
    fn better_in_pool(&self, chosen: &Fit, pool: &Pool) -> Option<Fit> {
        if self.leaves_nothing(chosen) {
            return None;
        }
        let share = self.independent([chosen]);
        let most = self.longest_rival(chosen);
        // A longer account is believed, as several at once are, where it explains the torque.
        let is_rival = |f: &&Fit| !is_extension(f, chosen) && (f.terms.len() <= most || self.is_exact(f));
        let rivals: Vec<Fit> = pool.fits().iter().filter(is_rival).cloned().collect();
        let best = self.best(&rivals, share)?;
        (self.evidence(best, share) > self.evidence(chosen, share) + ALIKE).then(|| best.clone())
    }

    /// The fit with the effect that explains the most beside it; `None` where none is a material cause.
    fn joined(&self, best: &Fit, pool: &mut Pool) -> Option<Fit> {
        if best.terms.len() >= MOST || self.problem.steps() > BUDGET + BUDGET / 2 {
            return None;
        }
        let added = self.extended(best, best.terms.len(), pool);
        let share = self.independent(&added);
        let all: Vec<Fit> =
            added.into_iter().filter(|f| self.is_material(best, f) && !is_lost(best, f, share)).collect();
        let share = self.independent(&all);
        let next = self.best(&all, share)?;
        self.is_likelier_by(share, next, best).then(|| next.clone())
    }

    /// Effects added as long as a measure grows that takes all that is left as independent, and dropped at the end where it is not: each of
    /// several large causes leaves what the others do, beside which it earns next to nothing on its own.
    fn forward(&self, from: Fit, by: Measure<'_>, pool: &mut Pool) -> Fit {
        let mut at = from;
        let ends = |f: &Fit| self.at_floor(f) || self.is_enough(f) || self.is_over_half_of_budget();
        while at.terms.len() < MOST && !ends(&at) {
            let mut all = self.extended(&at, at.terms.len(), pool);
            all.retain(|f| self.is_material(&at, f));
            let admitted = all.into_iter().filter(|f| !f.at_bound);
            match admitted.max_by(|a, b| by(a).total_cmp(&by(b))) {
                Some(next) if by(&next) > by(&at) => at = next,
                _ => break,
            }
        }
        self.pruned(at, pool)
    }

    /// Looks for one effect more beside the likeliest hypotheses that the chosen way passed by, as long as that is cheap: two causes that
    /// are each a poor account alone are found beside one another only.
    fn extend_rivals(&self, chosen: &Fit, pool: &mut Pool) {
        if self.leaves_nothing(chosen) {
            return;
        }
        let share = self.independent([chosen]);
        // Of one inertia a further cause costs little, and of many small ones none helps much before the others are there.
        let rigid = self.problem.nominal.structure == Structure::Rigid;
        let deepest = if rigid && !self.is_exact(chosen) { MOST - 1 } else { chosen.terms.len().max(1) };
        for size in 1..=deepest {
            for fit in self.likeliest(size, share, pool) {
                if self.is_over_half_of_budget() {
                    return;
                }
                self.extended(&fit, size, pool);
            }
        }
    }

    /// The likeliest hypotheses of so many effects, in one form each.
    fn likeliest(&self, size: usize, share: f64, pool: &Pool) -> Vec<Fit> {
        let mut of_size: Vec<&Fit> = pool.fits().iter().filter(|f| f.terms.len() == size && !f.at_bound).collect();
        of_size.sort_by(|a, b| self.evidence(b, share).total_cmp(&self.evidence(a, share)));
        let mut likeliest: Vec<Fit> = Vec::new();
        for fit in of_size {
            if likeliest.len() < PROMISING && likeliest.iter().all(|l| l.effects() != fit.effects()) {
                likeliest.push(fit.clone());
            }
        }
        likeliest
    }

    /// Effects added beside parameters near those of the data sheet, and only then these freed: of several causes each shows itself beside the
    /// true parameters, while free ones run off with what all of them do.
    fn near_the_data_sheet(&self, given: &Fit) -> Option<Fit> {
        let near = Search {
            problem: self.problem.near_the_data_sheet(),
            reference: self.reference,
            suspects: self.suspects.clone(),
            gap: self.gap,
            cut_short: AtomicBool::new(false),
            progress: self.progress,
        };
        let fit = near.forward(given.clone(), &|f| near.evidence(f, 1.0), &mut Pool::default());
        if fit.terms.is_empty() {
            return None;
        }
        let freed = self.problem.fit(&fit.model, &fit.terms, fit.discrepancy, STEPS)?;
        self.problem.deepen(&freed)
    }

    #[cfg(test)]
    pub fn only_near_the_data_sheet(&mut self) -> Option<Fit> {
        let baseline = self.baseline();
        self.near_the_data_sheet(&baseline.given)
    }

    /// Each effect in turn exchanged for another that explains the record better.
    fn exchanged(&self, fit: Fit, pool: &mut Pool) -> Fit {
        let mut best = fit;
        if best.terms.len() < 2 {
            return best;
        }
        for i in 0..best.terms.len() {
            if self.is_over_budget() {
                break;
            }
            let Some(without) = self.without(&best, i, pool) else { continue };
            let mut all = self.extended(&without, i, pool);
            pool.push(without);
            all.push(best.clone());
            best = self.likeliest_account(&all).unwrap_or(best);
        }
        best
    }

    /// The fit with its effects in the forms of largest evidence: a form that frees more is no further cause, however little it explains.
    fn in_best_form(&self, fit: Fit, pool: &mut Pool) -> Fit {
        let mut best = fit;
        if self.at_floor(&best) {
            return best;
        }
        for i in 0..best.terms.len() {
            let mut all = self.reformed(&best, i);
            pool.extend(all.iter().cloned());
            all.push(best.clone());
            best = self.likeliest_account(&all).unwrap_or(best);
        }
        best
    }

    /// Drops effects that the evidence does not need.
    fn pruned(&self, fit: Fit, pool: &mut Pool) -> Fit {
        let mut best = fit;
        while best.terms.len() > 1 {
            let mut all: Vec<Fit> =
                (0..best.terms.len()).into_par_iter().filter_map(|i| self.without(&best, i, pool)).collect();
            pool.extend(all.iter().cloned());
            let share = self.independent([&best]);
            all.retain(|plain| {
                !self.is_material(plain, &best)
                    || is_lost(plain, &best, share)
                    || !self.is_likelier_by(share, &best, plain)
            });
            match self.best(&all, share) {
                Some(plain) => best = plain.clone(),
                None => break,
            }
        }
        best
    }
}

/// Akaike's criterion, halved and turned: the likelihood expected on another record, with no price of an effect.
fn akaike(fit: &Fit) -> f64 {
    fit.log_likelihood - fit.coordinates.len() as f64
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

    fn fit(terms: &[Term]) -> Fit {
        Fit::of_likelihood(Model::new(Parameters::PAPER, Structure::TwoInertia, Settings::default()), terms, 0.0)
    }

    #[test]
    fn a_fit_is_more_than_another_when_it_has_all_its_effects_in_any_form_and_further_ones() {
        let (coulomb, viscous) = (Effect::CoulombMotor, Effect::ViscousMotor);
        assert!(is_extension(&fit(&[(coulomb, 1), (viscous, 0)]), &fit(&[(coulomb, 0)])));
        assert!(!is_extension(&fit(&[(coulomb, 1)]), &fit(&[(coulomb, 0)])));
        assert!(!is_extension(&fit(&[(coulomb, 0), (viscous, 0)]), &fit(&[(Effect::Delay, 0)])));
    }
}
