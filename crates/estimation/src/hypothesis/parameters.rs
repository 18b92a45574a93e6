//! The axis' own parameters, fitted without any effect: what effects are measured by.

use rayon::prelude::*;

use super::descent::{Descent, First};
use super::discrepancy::Discrepancy;
use super::fit::{Fit, PROBE};
use super::likelihood::Sight;
use super::model::Model;
use super::problem::{HELD, Problem};

/// Ratio of the stiffnesses that are tried one after the other: 3 % in the resonance's frequency, a cycle in some thirty. Fits from within
/// that came to the resonance of a record of forty cycles, one from 8 % off in stiffness did not.
const RATIO: f64 = 1.06;
/// Stiffnesses that are tried to either side of the nominal one: up to a factor of two and a half.
const TO_EITHER_SIDE: usize = 16;
/// Steps in which the inertias come from one stiffness to the next: the table's changes by 3 % between the two, one step of a fit nearly.
const FOLLOWING: usize = 3;
/// Stiffnesses that are gone on from: the likeliest and its neighbours, between which it lies.
const BEST: usize = 3;
/// Share of what the nearest hollow leaves that another one may leave for the record to tell it from the nearest.
const CLEARLY: f64 = 0.1;

impl Problem<'_> {
    /// The fit from the nominal parameters, or from `others` where the axis follows the record far better from there.
    pub fn parameters(&self, others: &Model, from: Discrepancy, effort: usize) -> Option<Fit> {
        let nominal = self.fit(&self.nominal, &[], from, effort);
        if others.parameters == self.nominal.parameters || nominal.as_ref().is_some_and(|f| self.is_at_floor(f)) {
            return nominal;
        }
        let is_it = |f: &Fit| self.is_at_floor(f) || self.leaves_clearly_less(f, nominal.as_ref());
        self.fit(others, &[], from, effort).filter(is_it).or(nominal)
    }

    /// The fit from the nominal parameters with the motion given. What effects do is mostly unlike an inertia's torque, as friction is: among
    /// the torque it makes no inertia, and where the torque is given, a heavy one.
    pub fn parameters_with_motion_given(&self, from: Discrepancy, effort: usize) -> Option<Fit> {
        let band = self.band.with_motion_given();
        let fit = self.compared_in(&band).fit(&self.nominal, &[], from, effort)?;
        Some(Fit { log_likelihood: self.band.log_likelihood(&fit.rows, fit.discrepancy), ..fit })
    }

    /// Whether the axis of the nominal model swings faster than a model with both sides measured can be held to.
    fn is_beyond_holding(&self) -> bool {
        self.band.sight == Sight::Both && self.nominal.parameters.modal().wn * self.record.dt > HELD
    }

    /// Whether a fit leaves so much less than another that the record tells it from that.
    fn leaves_clearly_less(&self, fit: &Fit, other: Option<&Fit>) -> bool {
        let left = |f: &Fit| self.band.noise_multiple(&f.rows);
        other.is_none_or(|other| left(fit) < CLEARLY * left(other))
    }

    /// The same from the nominal parameters, or from another stiffness where the axis follows the record far better from there. With an
    /// encoder on one side alone a record tells `I1 + I2` and, at first order, `I2^2/K`, and along that valley each resonance that the
    /// model may have beside the measured one ends in a hollow of its own; so it does with both, where the axis swings too fast between
    /// two samples to be held to them. Stiffnesses are held until the inertias have come to them. What
    /// leaves more than noise has effects in it: beside them the nearest hollow is as good as the deepest.
    pub fn parameters_of_any_stiffness(&self, from: Discrepancy, effort: usize) -> Option<Fit> {
        let fit = self.fit(&self.nominal, &[], from, effort);
        if !(self.band.sight.is_of_one_side() || self.is_beyond_holding())
            || fit.as_ref().is_some_and(|f| self.is_at_floor(f))
        {
            return fit;
        }
        let coarse = self.coarse();
        let mut held: Vec<Fit> =
            [RATIO, 1.0 / RATIO].par_iter().flat_map_iter(|ratio| coarse.held_stiffnesses(*ratio, from)).collect();
        held.sort_by(|a, b| (b.log_likelihood + b.log_prior).total_cmp(&(a.log_likelihood + a.log_prior)));
        held.truncate(BEST);
        let freed: Vec<Fit> = held.par_iter().filter_map(|f| self.fit(&f.model, &[], f.discrepancy, effort)).collect();
        freed.into_iter().find(|f| self.leaves_clearly_less(f, fit.as_ref())).or(fit)
    }

    /// Whether a fit leaves no more than the noise.
    pub fn is_at_floor(&self, fit: &Fit) -> bool {
        self.band.at_floor(&fit.rows)
    }

    /// Fits with the stiffness held, from the nominal one in steps of a ratio.
    pub fn held_stiffnesses(&self, ratio: f64, from: Discrepancy) -> Vec<Fit> {
        let mut model = self.nominal;
        let mut held: Vec<Fit> = Vec::new();
        for i in 0..=TO_EITHER_SIDE {
            let (from, effort) = held.last().map_or((from, PROBE), |f| (f.discrepancy, FOLLOWING));
            let fitted = Descent::new(self, &model, &[], from).and_then(|descent| {
                let mut descent = descent.holding(First::Inertias);
                descent.run(effort)?;
                Some(descent.done())
            });
            let Some(fit) = fitted else { break };
            model = Model { parameters: fit.model.parameters, ..model };
            model.parameters.k *= ratio;
            if i > 0 || ratio > 1.0 {
                held.push(fit);
            }
        }
        held
    }
}
