//! A hypothesis fitted, and the ways to a fit.

use super::Hypothesis;
use super::descent::{Along, Descent, differ};
use super::discrepancy::Discrepancy;
use super::likelihood::{C, TorqueResidual};
use super::model::{Coordinate, Model};
use super::problem::{Columns, Problem};
use super::secant::Secant;
use super::tracking::{Bandwidth, Resolution, Tracked};
use crate::effects::Effect;

/// Steps of a fit at most.
pub const STEPS: usize = 40;
/// Steps of a fit that is looked at.
pub const PROBE: usize = 5;

/// An effect in one of its forms.
pub type Term = (Effect, usize);

/// Their effects in the order of the list, in whatever forms and however they were found.
#[must_use]
pub fn effects_of(terms: &[Term]) -> Vec<Effect> {
    let mut effects: Vec<Effect> = terms.iter().map(|t| t.0).collect();
    effects.sort_unstable();
    effects
}

/// A hypothesis fitted.
#[derive(Debug, Clone)]
pub struct Fit {
    /// Its effects and their forms, in the order they were found.
    pub terms: Vec<Term>,
    /// The model at its best.
    pub model: Model,
    /// What was free.
    pub coordinates: Vec<Coordinate>,
    /// Standard error of each free value, in its unit, every value of the record taken as independent.
    pub std: Vec<f64>,
    /// What it lacks.
    pub rows: TorqueResidual,
    /// Columns of the coordinates, not whitened.
    pub columns: Vec<[Vec<C>; 2]>,
    /// Variance of what each equation lacks beyond the noise, (N.m)^2 a sample of the band.
    pub discrepancy: Discrepancy,
    /// Bandwidth at which it followed the record, rad/s.
    pub bandwidth: Bandwidth,
    /// Log likelihood at that discrepancy.
    pub log_likelihood: f64,
    /// Log density of its nominal parameters.
    pub log_prior: f64,
    /// Steps that the fit took.
    pub iterations: usize,
    /// Whether it was made to its end.
    pub converged: bool,
    /// Whether an effect stands where physics would not let it go on to where the record wants it: at the limit where it is another.
    pub at_bound: bool,
}

impl Fit {
    /// What it is a fit of.
    #[must_use]
    pub fn hypothesis(&self) -> Hypothesis {
        match (self.terms.is_empty(), self.coordinates.is_empty()) {
            (true, true) => Hypothesis::NoGap,
            (true, false) => Hypothesis::Parameters,
            _ => Hypothesis::Effects(self.terms.iter().map(|(e, _)| *e).collect()),
        }
    }

    /// Its effects ([`effects_of`]).
    #[must_use]
    pub fn effects(&self) -> Vec<Effect> {
        effects_of(&self.terms)
    }

    /// Whether it is the same hypothesis as another, every free value within a standard error of both.
    #[must_use]
    pub fn has_come_to(&self, other: &Self) -> bool {
        let values = |fit: &Self| fit.coordinates.iter().map(|c| c.value(&fit.model)).collect::<Vec<f64>>();
        let errors = self.std.iter().zip(&other.std).map(|(a, b)| a.min(*b));
        // What was held has no error.
        let is_near = |((a, b), std): ((f64, f64), f64)| a == b || (std.is_finite() && (a - b).abs() <= std);
        self.terms == other.terms
            && errors.len() == self.coordinates.len()
            && values(self).into_iter().zip(values(other)).zip(errors).all(is_near)
    }
}

impl Problem<'_> {
    /// A model that cannot be run along the record lacks all of its torque.
    #[must_use]
    pub fn nothing(&self) -> Fit {
        let mut tracked = Tracked::nothing(self.record.len());
        tracked.torque[0].copy_from_slice(&self.record.torque);
        let rows = self.residual(&self.nominal, &tracked, None);
        let s = self.band.discrepancy(&rows);
        self.unfitted(Along { model: self.nominal, rows, columns: Columns::Simulated, s, bandwidth: self.bandwidth(s) })
    }

    /// The hypothesis without anything fitted.
    pub fn given(&self, model: &Model) -> Option<Fit> {
        let mut at = self.along(model, self.bandwidth([f64::MAX; 2]))?;
        for _ in 0..2 {
            at = self.along(model, self.bandwidth(at.s))?;
        }
        Some(self.unfitted(at))
    }

    /// A fit with what it lacks along the motion as measured, as far as its discrepancy asks: there effects are looked for, which the
    /// model's own motion may have passed by.
    pub fn along_the_record(&self, fit: &Fit) -> Fit {
        let bandwidth = self.bandwidth(fit.discrepancy);
        let followed = || {
            let at = self.along(&fit.model, bandwidth)?;
            let columns = Secant::simulated(self, &at, &fit.coordinates)?.columns;
            Some(Fit { discrepancy: at.s, rows: at.rows, columns, bandwidth: at.bandwidth, ..fit.clone() })
        };
        if self.resolution == Resolution::Coarse || differ(bandwidth, fit.bandwidth) {
            followed().unwrap_or_else(|| fit.clone())
        } else {
            fit.clone()
        }
    }

    /// The same model with its parameters free, which have not moved.
    pub fn freed(&self, held: &Fit) -> Option<Fit> {
        let descent = Descent::new(self, &held.model, &held.terms, held.discrepancy)?;
        let columns = descent.columns()?;
        Some(Fit { columns, ..descent.done() })
    }

    fn unfitted(&self, at: Along) -> Fit {
        Fit {
            terms: vec![],
            model: at.model,
            coordinates: vec![],
            std: vec![],
            columns: vec![],
            discrepancy: at.s,
            bandwidth: at.bandwidth,
            log_likelihood: self.band.log_likelihood(&at.rows, at.s),
            log_prior: 0.0,
            rows: at.rows,
            iterations: 0,
            converged: false,
            at_bound: false,
        }
    }

    /// Fits the hypothesis from a start and a discrepancy in at most so many steps.
    pub fn fit(&self, start: &Model, terms: &[Term], from: Discrepancy, effort: usize) -> Option<Fit> {
        let mut descent = Descent::new(self, start, terms, from)?;
        descent.run(effort)?;
        Some(descent.done())
    }

    /// Fits the hypothesis on from where a fit of it ended, to the end: as near to the model's own motion as the record allows.
    pub fn deepen(&self, fit: &Fit) -> Option<Fit> {
        let exact = self.exact();
        let mut descent = Descent::new(&exact, &fit.model, &fit.terms, fit.discrepancy)?;
        descent.run(STEPS)?;
        descent.sharpen(false)?;
        descent.try_noise_alone()?;
        Some(Fit { converged: true, ..descent.done() })
    }

    /// The fit decided for, along the model's own motion as far as that is likelier, with its standard errors. Below the floor of the noise no
    /// verdict changes by it; the parameters do by many standard errors, where an effect is bent and its torque along the measured motion
    /// leans with the noise.
    pub fn finished(&self, fit: &Fit, independent: f64) -> Option<Fit> {
        let exact = self.exact();
        let mut descent = Descent::resumed(&exact, fit);
        descent.sharpen(true)?;
        let std = descent.standard_errors(independent)?;
        Some(Fit { std, converged: fit.converged, at_bound: fit.at_bound, ..descent.done() })
    }
}

#[cfg(test)]
impl Fit {
    /// A fit of effects that is as likely as told, of a model with its base parameters free.
    pub fn of_likelihood(model: Model, terms: &[Term], log_likelihood: f64) -> Self {
        use super::model::{BaseParameter, Free};
        let base = BaseParameter::of(model.structure);
        let coordinates: Vec<Coordinate> = base.iter().map(|p| Coordinate::new(Free::Base(*p), &model)).collect();
        Self {
            terms: terms.to_vec(),
            model,
            std: vec![0.0; coordinates.len()],
            coordinates,
            rows: TorqueResidual::nothing(),
            columns: Vec::new(),
            discrepancy: [1.0; 2],
            bandwidth: [1.0; 2],
            log_likelihood,
            log_prior: 0.0,
            iterations: 1,
            converged: true,
            at_bound: false,
        }
    }
}
