//! What a search has fitted so far, so that nothing is fitted twice.

use super::fit::{Fit, Term};

/// Hypotheses fitted, in the order they were.
#[derive(Default)]
pub struct Pool {
    fits: Vec<Fit>,
    /// Sets of effects beside which every one that may join was looked for.
    extended: Vec<Vec<Term>>,
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

    /// Adds every effect looked for beside these, in the fits with it.
    pub fn extend_all(&mut self, terms: &[Term], fits: &[Fit]) {
        self.extended.push(sorted(terms));
        self.fits.extend_from_slice(fits);
    }

    /// The fits with one effect more than these, where all of them were looked for.
    pub fn extensions(&self, terms: &[Term]) -> Option<Vec<Fit>> {
        self.extended.contains(&sorted(terms)).then(|| {
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
