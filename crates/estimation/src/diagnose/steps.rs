//! The steps of a search: an effect is added, dropped or exchanged, or several are added at once.

use itertools::Itertools;
use rayon::prelude::*;

use super::moves::PROMISING;
use super::pool::Pool;
use super::search::{ALIKE, MOST, Search, is_extension};
use crate::axis::Structure;
use crate::hypothesis::determined::is_lost;
use crate::hypothesis::fit::{Fit, Term};

impl Search<'_> {
    /// Adds, drops and exchanges effects as long as the evidence grows.
    pub fn stepwise(&self, from: Fit, pool: &mut Pool) -> Fit {
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
            if other.terms == best.terms {
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

    /// The hypothesis of largest evidence, where it is another than the chosen one and not that with something small beside it: several effects
    /// may each be worth nothing without the others, and together explain next to all that it leaves.
    pub fn better_in_pool(&self, chosen: &Fit, pool: &Pool) -> Option<Fit> {
        let share = self.independent([chosen]);
        let most = self.longest_rival(chosen);
        let [at_floor, leaves_nothing] = [self.at_floor(chosen), self.leaves_nothing(chosen)];
        let is_rival = |f: &&Fit| {
            // Noise tells no two accounts of one length apart, and what a torque is not true to does where one explains it alone.
            if leaves_nothing {
                let is_as_long = f.terms.len() == chosen.terms.len();
                return f.terms.len() < chosen.terms.len()
                    || is_as_long && !at_floor && self.explains_next_to_all(chosen, f);
            }
            // A longer account is believed, as several at once are, where it explains the torque.
            let is_another = !is_extension(f, chosen) || self.explains_next_to_all(chosen, f);
            is_another && (f.terms.len() <= most || self.is_exact(f))
        };
        let rivals: Vec<Fit> = pool.fits().iter().filter(is_rival).cloned().collect();
        let best = self.best(&rivals, share)?;
        (self.evidence(best, share) > self.evidence(chosen, share) + ALIKE).then(|| best.clone())
    }

    /// The fit with the effect that explains the most beside it; `None` where none is a material cause.
    pub fn joined(&self, best: &Fit, pool: &mut Pool) -> Option<Fit> {
        if best.terms.len() >= MOST || self.is_far_over_budget() {
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

    /// Effects added as long as the evidence grows with all that is left taken as independent, and dropped at the end where it is not: each of
    /// several large causes leaves what the others do, beside which it earns next to nothing on its own.
    pub fn forward(&self, from: Fit, pool: &mut Pool) -> Fit {
        let by = |f: &Fit| self.evidence(f, 1.0);
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
    /// are each a poor account alone are found beside one another only. Where nothing is left, beside parts of the chosen one, too: one effect
    /// may leave nothing in the place of several.
    pub fn extend_rivals(&self, chosen: &Fit, pool: &mut Pool) {
        let share = self.independent([chosen]);
        let leaves_nothing = self.leaves_nothing(chosen);
        // Of one inertia a further cause costs little, and of many small ones none helps much before the others are there.
        let rigid = self.problem.nominal.structure == Structure::Rigid;
        let deepest = if leaves_nothing {
            chosen.terms.len().saturating_sub(2)
        } else if rigid && !self.is_exact(chosen) {
            MOST - 1
        } else {
            chosen.terms.len().max(1)
        };
        let is_part = |f: &Fit| f.terms.iter().all(|t| chosen.terms.iter().any(|of| of.0 == t.0));
        for size in 1..=deepest {
            let mut from = self.likeliest(size, share, pool, |_| true);
            if leaves_nothing {
                from.extend(self.likeliest(size, share, pool, is_part));
            }
            for fit in from {
                if self.is_over_half_of_budget() {
                    return;
                }
                self.extended(&fit, size, pool);
            }
        }
    }

    /// The likeliest hypotheses of so many effects that may be gone on from, in one form each.
    fn likeliest(&self, size: usize, share: f64, pool: &Pool, may: impl Fn(&Fit) -> bool) -> Vec<Fit> {
        let is_of_size = |f: &&Fit| f.terms.len() == size && !f.at_bound && may(f);
        let mut of_size: Vec<&Fit> = pool.fits().iter().filter(is_of_size).collect();
        of_size.sort_by(|a, b| self.evidence(b, share).total_cmp(&self.evidence(a, share)));
        of_size.into_iter().unique_by(|f| f.effects()).take(PROMISING).cloned().collect()
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
    pub fn in_best_form(&self, fit: Fit, pool: &mut Pool) -> Fit {
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
    pub fn pruned(&self, fit: Fit, pool: &mut Pool) -> Fit {
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
