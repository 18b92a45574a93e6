//! Fits of a few steps go on side by side, and those that fall behind are given up.

use itertools::Itertools;
use rayon::prelude::*;

use super::search::{ALIKE, Search};
use crate::hypothesis::fit::{Fit, STEPS};

/// Fits that go on.
pub const RACING: usize = 6;
/// Variance of what a few steps leave, over that of the best, from which no further ones are made.
const OUT_OF_RACE: f64 = 30.0;
/// Steps between two looks at how a fit stands beside the others.
const ROUND: usize = 8;
/// Times the gain of its last steps that a fit may be behind the best: no further does it come.
const PATIENCE: f64 = 10.0;

impl Search<'_> {
    /// The same fits, best first, those that keep up with the best and with `rival` fitted to their end; beside `nested`, which all of them
    /// have in them, those that have come back to it after those that are still on their way.
    pub fn raced(&self, mut fits: Vec<Fit>, nested: Option<&Fit>, rival: Option<&Fit>) -> Vec<Fit> {
        let share = self.independent(&fits);
        let evidence = |f: &Fit| self.evidence(f, share);
        let idle = |f: &Fit| nested.is_some_and(|n| has_come_back(f, n));
        fits.sort_by(|a, b| idle(a).cmp(&idle(b)).then(evidence(b).total_cmp(&evidence(a))));
        let likeliest = || fits.iter().max_by(|a, b| evidence(a).total_cmp(&evidence(b)));
        let best = rival.or_else(likeliest).map_or([0.0; 2], |f| f.discrepancy);
        let is_out = |f: &Fit| (0..self.band().equations()).all(|i| f.discrepancy[i] > OUT_OF_RACE * best[i]);
        let mut racing: Vec<usize> =
            first_of_each(&fits).into_iter().take(RACING).filter(|i| !is_out(&fits[*i])).collect();
        let mut first = fits.iter().filter(|f| idle(f)).chain(rival).map(evidence).fold(f64::NEG_INFINITY, f64::max);
        for _ in 0..STEPS / ROUND {
            let on = |f: &Fit| self.problem.fit(&f.model, &f.terms, f.discrepancy, ROUND);
            let further: Vec<Option<Fit>> = racing.par_iter().map(|&i| on(&fits[i])).collect();
            first = further.iter().flatten().map(evidence).fold(first, f64::max);
            let mut still = Vec::new();
            for (i, further) in racing.into_iter().zip(further) {
                let Some(further) = further else { continue };
                let gain = (evidence(&further) - evidence(&fits[i])).max(0.0);
                if first - evidence(&further) <= PATIENCE * gain + ALIKE {
                    still.push(i);
                }
                fits[i] = further;
            }
            still.sort_by(|a, b| evidence(&fits[*b]).total_cmp(&evidence(&fits[*a])));
            racing = apart(&still, &fits);
            if racing.iter().all(|&i| fits[i].iterations < ROUND) {
                break;
            }
        }
        let ended: Vec<Option<Fit>> = racing.par_iter().map(|&i| self.problem.deepen(&fits[i])).collect();
        for (i, fit) in racing.into_iter().zip(ended) {
            if let Some(fit) = fit {
                fits[i] = fit;
            }
        }
        fits
    }
}

/// Fits, best first: the first of each set of effects, then the others. Several starts of one effect leave the others their places.
fn first_of_each(fits: &[Fit]) -> Vec<usize> {
    let first: Vec<usize> = (0..fits.len()).unique_by(|&i| fits[i].effects()).collect();
    first.iter().copied().chain((0..fits.len()).filter(|i| !first.contains(i))).collect()
}

/// Whether a fit has come back to the one that it has in it. One that is less likely than that has not: it ends no lower.
fn has_come_back(fit: &Fit, nested: &Fit) -> bool {
    (fit.log_likelihood - nested.log_likelihood).abs() < ALIKE
}

/// Those that go on, best first, without those that have come to where a better one is: they would end where that does.
fn apart(racing: &[usize], fits: &[Fit]) -> Vec<usize> {
    let mut apart: Vec<usize> = Vec::new();
    for &i in racing {
        if !apart.iter().any(|&better| fits[i].has_come_to(&fits[better])) {
            apart.push(i);
        }
    }
    apart
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::axis::{Parameters, Structure};
    use crate::effects::{Effect, Settings};
    use crate::hypothesis::model::Model;

    #[test]
    fn a_fit_that_gains_nothing_has_come_back_and_one_that_lies_below_is_on_its_way() {
        let at = |log_likelihood: f64| {
            let model = Model::new(Parameters::PAPER, Structure::TwoInertia, Settings::default());
            Fit::of_likelihood(model, &[(Effect::FlexibleMode, 0)], log_likelihood)
        };
        let nested = at(14117.1);
        assert!(has_come_back(&at(14116.2), &nested) && has_come_back(&at(14119.3), &nested));
        assert!(!has_come_back(&at(14024.3), &nested) && !has_come_back(&at(14197.1), &nested));
    }

    #[test]
    fn starts_of_one_effect_leave_the_others_their_places() {
        let of = |effect: Effect, form: usize| {
            let model = Model::new(Parameters::PAPER, Structure::TwoInertia, Settings::default());
            Fit::of_likelihood(model, &[(effect, form)], 0.0)
        };
        let fits = [
            of(Effect::CoulombMotor, 1),
            of(Effect::CoulombMotor, 0),
            of(Effect::Delay, 0),
            of(Effect::Delay, 0),
            of(Effect::MotorMode, 0),
        ];
        assert_eq!(first_of_each(&fits), [0, 2, 4, 1, 3]);
    }

    #[test]
    fn of_fits_of_the_same_effects_at_the_same_place_the_best_goes_on() {
        let at = |i1: f64, effect: Effect| {
            let parameters = Parameters { i1, ..Parameters::PAPER };
            let model = Model::new(parameters, Structure::TwoInertia, Settings::default());
            let fit = Fit::of_likelihood(model, &[(effect, 0)], 0.0);
            Fit { std: vec![1e-6; fit.coordinates.len()], ..fit }
        };
        let own = Parameters::PAPER.i1;
        let fits = [
            at(own + 5e-7, Effect::CoulombMotor),
            at(own, Effect::CoulombMotor),
            at(own + 5e-6, Effect::CoulombMotor),
            at(own, Effect::ViscousMotor),
        ];
        assert_eq!(apart(&[1, 0, 2, 3], &fits), [1, 2, 3]);
        assert_eq!(apart(&[3, 2], &fits), [3, 2]);
        // What was held has an infinite error, and may be anywhere.
        let held = fits.map(|fit| Fit { std: vec![f64::INFINITY; fit.std.len()], ..fit });
        assert_eq!(apart(&[1, 0], &held), [1, 0]);
    }
}
