//! How well a record speaks for a hypothesis: the log evidence of its fit, and what is known of an axis and of its effects before any record.

use super::fit::{Fit, Term};
use super::model::{Coordinate, Free};
use super::problem::Problem;
use crate::effects::{Scale, Start};

/// Prior standard deviation of the logarithm of a nominal parameter.
pub const PRIOR: f64 = 0.5;
/// Cost of an effect in log evidence: one of some fifty.
pub const PRICE: f64 = 4.0;
/// What a form that adds to a nested one costs beside it: as much as an effect of its own, and a little more, so that of two accounts of
/// one thing (an unlike friction either way, a bias) the one by effects of their own is told.
const RICHER: f64 = 2.2;
/// Least degrees of freedom that are counted: with fewer any account follows the record.
const FEWEST: f64 = 0.1;

impl Problem<'_> {
    pub fn log_prior(&self, coordinates: &[Coordinate], x: &[f64]) -> f64 {
        coordinates
            .iter()
            .zip(x)
            .map(|(c, x)| match c.free {
                Free::Base(_) => -0.5 * ((x - c.x(&self.nominal)) / PRIOR).powi(2),
                _ => 0.0,
            })
            .sum()
    }

    /// What an effect costs: one of some fifty, at one of so many lines.
    pub(super) fn price(&self, (e, v): Term) -> f64 {
        let is_of_line =
            |i: &usize| matches!(e.info().parameters[*i].start, Start::Grid(Scale::Order | Scale::Frequency, _));
        let lines = e.is_mode() || e.info().variants[v].free.iter().any(is_of_line);
        PRICE * if e.info().is_richer(v) { RICHER } else { 1.0 } - e.info().odds.ln()
            + if lines { (self.band.omega.len() as f64).ln() } else { 0.0 }
    }

    /// Log evidence with `share` of the values independent: Schwarz's, with the term by which a small sample is followed by many parameters
    /// whatever it is of (Hurvich, Tsai, Biometrika 76, 1989).
    pub fn evidence(&self, f: &Fit, share: f64) -> f64 {
        let n = share * self.band.values();
        // How a third inertia swung at first is fitted, too: two values, which are taken out of what is left.
        let swung = 2 * f.terms.iter().filter(|(e, _)| e.is_mode()).count();
        let k = (f.coordinates.len() + swung) as f64;
        share * f.log_likelihood + f.log_prior
            - 0.5 * k * n.ln()
            - k * (k + 1.0) / (n - k - 1.0).max(FEWEST)
            - f.terms.iter().map(|t| self.price(*t)).sum::<f64>()
    }
}
