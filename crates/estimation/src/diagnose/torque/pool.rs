//! What a search has fitted so far, so that nothing is fitted twice.

use super::discrepancy::Discrepancy;
use super::fit::{Fit, Term};

/// Share of the variance that a fit leaves at most, over that of another fit of the same effects, for effects to be looked for beside it
/// anew: what the other left was not what they would have to explain.
const POORER: f64 = 0.75;

/// Hypotheses fitted, in the order they were.
#[derive(Default)]
pub struct Pool {
    fits: Vec<Fit>,
    /// Sets of effects beside which every one that may join was looked for, and what they left then.
    extended: Vec<(Vec<Term>, Discrepancy)>,
}

impl Pool {
    /// Adds a hypothesis.
    pub fn push(&mut self, fit: Fit) {
        self.fits.push(fit);
    }

    /// Adds hypotheses.
    pub fn extend(&mut self, fits: impl IntoIterator<Item = Fit>) {
        self.fits.extend(fits);
    }

    /// Adds every effect looked for beside a fit, in the fits with it.
    pub fn extend_all(&mut self, beside: &Fit, fits: &[Fit]) {
        self.extended.push((sorted(&beside.terms), beside.discrepancy));
        self.fits.extend_from_slice(fits);
    }

    /// The fits with one effect more than this one, where all of them were looked for beside one that is not poorer.
    pub fn extensions(&self, fit: &Fit) -> Option<Vec<Fit>> {
        let terms = sorted(&fit.terms);
        let is_poorer = |s: &Discrepancy| (0..2).any(|i| fit.discrepancy[i] < POORER * s[i]);
        self.extended.iter().any(|(t, s)| *t == terms && !is_poorer(s)).then(|| {
            let is = |f: &&Fit| f.terms.len() == terms.len() + 1 && terms.iter().all(|t| f.terms.contains(t));
            self.fits.iter().filter(is).cloned().collect()
        })
    }

    /// The likeliest fit of these effects in these forms that was made to its end.
    pub fn settled(&self, terms: &[Term]) -> Option<&Fit> {
        let terms = sorted(terms);
        let is = |f: &&Fit| f.settled && f.terms.len() == terms.len() && sorted(&f.terms) == terms;
        self.fits.iter().filter(is).max_by(|a, b| a.log_likelihood.total_cmp(&b.log_likelihood))
    }

    /// All of them.
    pub fn fits(&self) -> &[Fit] {
        &self.fits
    }

    /// All of them, the pool given up.
    pub fn into_fits(self) -> Vec<Fit> {
        self.fits
    }
}

fn sorted(terms: &[Term]) -> Vec<Term> {
    let mut terms = terms.to_vec();
    terms.sort_unstable();
    terms
}
