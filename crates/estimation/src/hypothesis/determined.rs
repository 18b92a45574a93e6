//! What a record does not know of a fit's effects: their sizes and shapes beside the standard errors.

use super::evidence::PRICE;
use super::fit::Fit;
use super::model::{Coordinate, Free};
use super::scatter;
use crate::effects::Effect;

/// Standard errors below which a value is no more than its error.
const ERRORS: f64 = 2.0;

/// Whether a coordinate of a fit is known, and within [`ERRORS`] of zero; of a fit whose values are `independent` only in part its errors
/// are so much larger.
fn is_zero(fit: &Fit, (coordinate, std): (&Coordinate, &f64), independent: f64) -> bool {
    coordinate.value(&fit.model).abs() < ERRORS * std / independent.sqrt()
}

/// The coordinates of an effect in a fit, each with its standard error.
fn own(fit: &Fit, effect: Effect) -> impl Iterator<Item = (&Coordinate, &f64)> {
    let is_own = move |c: &Coordinate| matches!(c.free, Free::Effect(e, _) if e == effect);
    fit.coordinates.iter().zip(&fit.std).filter(move |(c, _)| is_own(c))
}

/// Whether a parameter of an effect is free in a fit and within its errors of zero. One that was held says nothing, nor one without an error.
fn vanishes(fit: &Fit, effect: Effect, parameter: usize, independent: f64) -> bool {
    own(fit, effect)
        .any(|at| at.0.free == Free::Effect(effect, parameter) && at.1.is_finite() && is_zero(fit, at, independent))
}

/// Whether an effect of a fit stands where it is a simpler one: the shape that it has beyond that one's vanishes.
pub fn is_simpler(fit: &Fit, effect: Effect, independent: f64) -> bool {
    effect.simpler_at_zero().is_some_and(|shape| vanishes(fit, effect, shape, independent))
}

/// Whether the effect that the nested fit lacks is not determined in the richer fit.
pub fn is_lost(plain: &Fit, rich: &Fit, independent: f64) -> bool {
    rich.terms.iter().filter(|t| !plain.terms.contains(t)).all(|t| is_undetermined(rich, t.0, independent))
}

/// Whether every size of an effect of a fit is within its errors of zero, or what tells it from a change of the axis' own parameters is.
pub fn is_undetermined(fit: &Fit, effect: Effect, independent: f64) -> bool {
    own(fit, effect).filter(|(c, _)| !c.is_shape()).all(|at| is_zero(fit, at, independent))
        || effect.identifying_parameter().is_some_and(|i| vanishes(fit, effect, i, independent))
}

/// Probability that an effect of a fit has its size in every stretch of the record: by the best known of its sizes.
pub fn steadiness(fit: &Fit, effect: Effect, independent: f64) -> f64 {
    let known = own(fit, effect).filter(|(c, std)| !c.is_shape() && std.is_finite());
    let errors = known.map(|(c, std)| c.value(&fit.model).abs() * independent.sqrt() / std);
    errors.reduce(f64::max).map_or(1.0, |errors| scatter::steadiness(errors, PRICE))
}

#[cfg(test)]
mod tests {
    use super::super::fit::Term;
    use super::super::model::Model;
    use super::*;
    use crate::axis::{Parameters, Structure};
    use crate::effects::Settings;

    fn fit(terms: &[Term]) -> Fit {
        Fit::of_likelihood(Model::new(Parameters::PAPER, Structure::TwoInertia, Settings::default()), terms, 0.0)
    }

    #[test]
    fn an_effect_below_two_standard_errors_of_its_independent_values_is_lost() {
        let term = (Effect::LoadMotor, 0);
        let plain = fit(&[]);
        let mut rich = fit(&[term]);
        rich.model.effects.of_mut(term.0)[0] = 0.3;
        rich.coordinates.push(Coordinate::new(Free::Effect(term.0, 0), &rich.model));
        rich.std.push(0.1);
        assert!(!is_lost(&plain, &rich, 1.0));
        // A quarter of the values: twice the standard error.
        assert!(is_lost(&plain, &rich, 0.25));
    }

    #[test]
    fn a_mode_whose_stiffness_is_not_known_is_none() {
        let effect = Effect::FlexibleMode;
        let of = |errors: [f64; 2]| {
            let mut fit = fit(&[(effect, 0)]);
            fit.model.effects.of_mut(effect)[..2].copy_from_slice(&[1e-3, 100.0]);
            fit.coordinates.extend([0, 1].map(|i| Coordinate::new(Free::Effect(effect, i), &fit.model)));
            fit.std.extend(errors);
            fit
        };
        assert!(!is_undetermined(&of([1e-4, 10.0]), effect, 1.0));
        assert!(is_undetermined(&of([1e-4, 60.0]), effect, 1.0) && is_undetermined(&of([1e-3, 10.0]), effect, 1.0));
    }

    #[test]
    fn a_bristle_whose_reach_is_below_two_of_its_errors_is_a_simpler_friction() {
        let effect = Effect::PreslidingMotor;
        let reach = effect.simpler_at_zero().expect("Coulomb's friction");
        let of = |value: f64| {
            let mut fit = fit(&[(effect, 0)]);
            fit.model.effects.of_mut(effect)[reach] = value;
            fit.coordinates.push(Coordinate::new(Free::Effect(effect, reach), &fit.model));
            fit.std.push(0.1);
            fit
        };
        assert!(is_simpler(&of(0.19), effect, 1.0) && !is_simpler(&of(0.21), effect, 1.0));
        // A quarter of the values: twice the standard error.
        assert!(is_simpler(&of(0.39), effect, 0.25) && !is_simpler(&of(0.41), effect, 0.25));
        // One that could not be told says nothing.
        let mut unknown = of(0.01);
        unknown.std.pop();
        unknown.std.push(f64::INFINITY);
        assert!(!is_simpler(&unknown, effect, 1.0));
    }

    #[test]
    fn an_effect_is_as_steady_as_the_best_known_of_its_sizes_says() {
        let term = (Effect::LoadMotor, 0);
        let of = |error: f64| {
            let mut fit = fit(&[term]);
            fit.model.effects.of_mut(term.0)[0] = 0.3;
            fit.coordinates.push(Coordinate::new(Free::Effect(term.0, 0), &fit.model));
            fit.std.push(error);
            fit
        };
        assert!(steadiness(&of(0.03), term.0, 1.0) > 0.99);
        assert!(steadiness(&of(0.15), term.0, 1.0) < 0.2);
        // A quarter of the values: half as many errors.
        assert!((steadiness(&of(0.03), term.0, 0.25) - steadiness(&of(0.06), term.0, 1.0)).abs() < 1e-12);
        // Of one whose error is not known nothing is said.
        assert_eq!(steadiness(&of(f64::INFINITY), term.0, 1.0), 1.0);
    }
}
