//! What a search has fitted so far, so that nothing is fitted twice.

use crate::hypothesis::discrepancy::Discrepancy;
use crate::hypothesis::fit::{Fit, Term};

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

    /// The fits with one effect more than these, where all of them were looked for beside a fit that left what counts `as_good`.
    pub fn extensions(&self, terms: &[Term], as_good: impl Fn(&Discrepancy) -> bool) -> Option<Vec<Fit>> {
        let sorted = sorted(terms);
        self.extended.iter().any(|(t, s)| *t == sorted && as_good(s)).then(|| {
            let is = |f: &&Fit| f.terms.len() == terms.len() + 1 && terms.iter().all(|t| f.terms.contains(t));
            self.fits.iter().filter(is).cloned().collect()
        })
    }

    /// The likeliest fit of these effects in these forms that was made to its end.
    pub fn converged(&self, terms: &[Term]) -> Option<&Fit> {
        likeliest_of(terms, self.fits.iter().filter(|f| f.converged))
    }

    /// Takes the fits of these effects in these forms out.
    pub fn give_up(&mut self, terms: &[Term]) {
        self.fits.retain(|f| !has_just(f, terms));
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

/// The likeliest fit of these effects in these forms, in any order.
pub fn likeliest_of<'f>(terms: &[Term], fits: impl IntoIterator<Item = &'f Fit>) -> Option<&'f Fit> {
    fits.into_iter().filter(|f| has_just(f, terms)).max_by(|a, b| a.log_likelihood.total_cmp(&b.log_likelihood))
}

/// Whether a fit is of these effects in these forms, in any order.
fn has_just(fit: &Fit, terms: &[Term]) -> bool {
    fit.terms.len() == terms.len() && terms.iter().all(|t| fit.terms.contains(t))
}

fn sorted(terms: &[Term]) -> Vec<Term> {
    let mut terms = terms.to_vec();
    terms.sort_unstable();
    terms
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::axis::{Parameters, Structure};
    use crate::effects::{Effect, Settings};
    use crate::hypothesis::model::Model;

    #[test]
    fn what_is_given_up_goes_in_any_order_and_other_forms_stay() {
        let (coulomb, drift) = (Effect::CoulombMotor, Effect::FrictionDrift);
        let model = Model::new(Parameters::PAPER, Structure::TwoInertia, Settings::default());
        let all: [Vec<Term>; 4] = [
            vec![(coulomb, 0), (drift, 1)],
            vec![(drift, 1), (coulomb, 0)],
            vec![(coulomb, 0)],
            vec![(coulomb, 1), (drift, 1)],
        ];
        let mut pool = Pool::default();
        pool.extend(all.iter().map(|terms| Fit::of_likelihood(model, terms, 0.0)));
        pool.give_up(&all[0]);
        let left: Vec<&Vec<Term>> = pool.fits().iter().map(|f| &f.terms).collect();
        assert_eq!(left, [&all[2], &all[3]]);
    }
}
