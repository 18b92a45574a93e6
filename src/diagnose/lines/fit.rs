//! A linear hypothesis fitted to the lines: relative errors under a robust loss, so that a resonance a little beside the
//! model's does not decide.
//!
//! ```text
//! e = ln(model/measured)            relative error and phase, complex
//! z = |e| / sqrt(f^2 + s^2)         f: what is forgiven of a model, s: relative scatter of the measured response
//! cost = sum f^2*(sqrt(1 + z^2) - 1)
//! ```
//!
//! Sources: R. Pintelon, J. Schoukens, System Identification: A Frequency Domain Approach, 2nd ed., 2012, 9.8.3
//! (logarithmic least squares); P. J. Huber, Robust Statistics, 1981, 7.6 (standard errors).

use nalgebra::{DMatrix, DVector};

use super::data::{C, FORGIVEN, Lines};
use crate::diagnose::model::{Coordinate, Free, Model};
use crate::effects::Effect;
use crate::identify::levenberg::{self, Normal, Options, Problem};

/// Step of a difference quotient.
const STEP: f64 = 1e-6;
/// Longest step of a logarithm.
const STRIDE: f64 = 1.0;

/// A linear hypothesis at its minimum.
#[derive(Debug, Clone)]
pub struct Hypothesis {
    /// Its effects beside those of the nominal model.
    pub effects: Vec<Effect>,
    /// The model.
    pub model: Model,
    /// What was free.
    pub coordinates: Vec<Coordinate>,
    /// Standard error of each, in its unit.
    pub std: Vec<f64>,
    /// The robust cost.
    pub cost: f64,
}

impl Hypothesis {
    /// A model as it is.
    #[must_use]
    pub fn fixed(lines: &Lines, model: &Model) -> Self {
        let cost = cost_of(lines, model).unwrap_or(f64::INFINITY);
        Self { effects: Vec::new(), model: *model, coordinates: Vec::new(), std: Vec::new(), cost }
    }
}

/// The robust loss of an error at a line.
fn loss(e: C, relative: f64) -> f64 {
    let z2 = e.norm_sqr() / (FORGIVEN * FORGIVEN + relative * relative);
    FORGIVEN * FORGIVEN * ((1.0 + z2).sqrt() - 1.0)
}

/// The robust cost of a model.
#[must_use]
pub fn cost_of(lines: &Lines, model: &Model) -> Option<f64> {
    Some(lines.errors(model)?.iter().map(|(e, s)| loss(*e, *s)).sum())
}

/// What the scatter of the measured response costs a perfect model, at most.
#[must_use]
pub fn cost_of_noise(lines: &Lines, model: &Model) -> f64 {
    let errors = lines.errors(model).unwrap_or_default();
    errors.iter().map(|(_, s)| loss(C::new(*s, 0.0), *s)).sum()
}

struct RobustFit<'a> {
    lines: &'a Lines,
    start: &'a Model,
    coordinates: &'a [Coordinate],
}

impl RobustFit<'_> {
    /// Errors over what is forgiven and scattered: real and imaginary parts in turn.
    fn residuals(&self, x: &DVector<f64>) -> Option<Vec<f64>> {
        let errors = self.lines.errors(&self.start.at(self.coordinates, x.as_slice()))?;
        let parts = |(e, s): &(C, f64)| {
            let scale = FORGIVEN / (FORGIVEN * FORGIVEN + s * s).sqrt();
            [e.re * scale, e.im * scale]
        };
        Some(errors.iter().flat_map(parts).collect())
    }

    fn jacobian(&self, x: &DVector<f64>, centre: &[f64]) -> Option<DMatrix<f64>> {
        let mut jacobian = DMatrix::zeros(centre.len(), x.len());
        for i in 0..x.len() {
            let h = STEP * x[i].abs().max(1.0);
            let mut beside = x.clone();
            beside[i] += h;
            for (row, (up, at)) in self.residuals(&beside)?.iter().zip(centre).enumerate() {
                jacobian[(row, i)] = (up - at) / h;
            }
        }
        Some(jacobian)
    }
}

/// `z^2` of a pair of parts.
fn excess(pair: &[f64]) -> f64 {
    (pair[0] * pair[0] + pair[1] * pair[1]) / (FORGIVEN * FORGIVEN)
}

impl Problem for RobustFit<'_> {
    fn cost(&self, x: &DVector<f64>) -> Option<f64> {
        let residuals = self.residuals(x)?;
        Some(residuals.chunks_exact(2).map(|p| FORGIVEN * FORGIVEN * ((1.0 + excess(p)).sqrt() - 1.0)).sum())
    }

    fn linearise(&self, x: &DVector<f64>) -> Option<Normal> {
        let centre = self.residuals(x)?;
        let mut jacobian = self.jacobian(x, &centre)?;
        // Iteratively reweighted: the derivative of the loss is the residual times this weight.
        let mut weighted = DVector::from_column_slice(&centre);
        for (k, pair) in centre.chunks_exact(2).enumerate() {
            let root = (1.0 + excess(pair)).powf(-0.25);
            for row in [2 * k, 2 * k + 1] {
                weighted[row] *= root;
                jacobian.row_mut(row).scale_mut(root);
            }
        }
        let mut normal = Normal::new(&weighted, &jacobian);
        normal.cost = centre.chunks_exact(2).map(|p| FORGIVEN * FORGIVEN * ((1.0 + excess(p)).sqrt() - 1.0)).sum();
        Some(normal)
    }
}

/// Fits what is free from a start.
#[must_use]
pub fn fit(lines: &Lines, start: &Model, free: &[Free], effects: &[Effect], iterations: usize) -> Hypothesis {
    let coordinates: Vec<Coordinate> = free.iter().map(|f| Coordinate::new(*f, start)).collect();
    let x = DVector::from_iterator(coordinates.len(), coordinates.iter().map(|c| c.x(start)));
    let options = Options {
        iterations,
        cost: 1e-9,
        step: 1e-7,
        gradient: 1e-7,
        stride: coordinates.iter().map(|c| if c.log { STRIDE } else { f64::INFINITY }).collect(),
        lower: coordinates.iter().map(|c| c.bounds[0]).collect(),
        upper: coordinates.iter().map(|c| c.bounds[1]).collect(),
        ..Options::default()
    };
    let problem = RobustFit { lines, start, coordinates: &coordinates };
    let report = levenberg::minimise(&problem, &x, &options);
    let model = start.at(&coordinates, report.parameters.as_slice());
    Hypothesis {
        effects: effects.to_vec(),
        model,
        std: vec![f64::NAN; coordinates.len()],
        coordinates,
        cost: report.cost,
    }
}

/// Standard errors by the sandwich `A^-1*S*A^-1`, which does not take the error for noise of a known law; neighbouring
/// lines that err together count as one (`together` of them).
pub fn standard_errors(lines: &Lines, h: &mut Hypothesis, together: f64) {
    let n = h.coordinates.len();
    let x = DVector::from_iterator(n, h.coordinates.iter().map(|c| c.x(&h.model)));
    let problem = RobustFit { lines, start: &h.model, coordinates: &h.coordinates };
    let Some(centre) = problem.residuals(&x) else { return };
    let Some(jacobian) = problem.jacobian(&x, &centre) else { return };
    let (mut bread, mut filling) = (DMatrix::zeros(n, n), DMatrix::zeros(n, n));
    for (k, pair) in centre.chunks_exact(2).enumerate() {
        let weight = (1.0 + excess(pair)).powf(-0.5);
        let row = |i: usize| jacobian.row(2 * k + i).transpose();
        let score = (row(0) * pair[0] + row(1) * pair[1]) * weight;
        filling += &score * score.transpose();
        bread += (row(0) * row(0).transpose() + row(1) * row(1).transpose()) * weight;
    }
    let (inverse, _) = levenberg::covariance(&bread);
    let covariance = &inverse * filling * &inverse * together;
    h.std = (0..n).map(|i| covariance[(i, i)].max(0.0).sqrt() * h.coordinates[i].slope(x[i])).collect();
}

/// How many errors go together: along the lines, and from channel to channel; as the robust loss sees them.
#[must_use]
pub fn together(lines: &Lines, model: &Model) -> f64 {
    let errors = lines.errors(model).unwrap_or_default();
    let channels = lines.channels.len();
    let seen: Vec<C> = errors
        .iter()
        .map(|(e, s)| {
            let level = FORGIVEN * FORGIVEN + s * s;
            e / (level + e.norm_sqr()).sqrt()
        })
        .collect();
    let power: f64 = seen.iter().map(|e| e.norm_sqr()).sum();
    if power <= 0.0 {
        return 1.0;
    }
    let along = |lag: usize| {
        let pairs = seen.iter().zip(&seen[lag * channels..]);
        pairs.map(|(a, b)| (a * b.conj()).re).sum::<f64>() / power
    };
    // The sum of the autocorrelation up to its first zero (initial positive sequence: Geyer, Statist. Sci. 7(4), 1992).
    let count = (1..lines.len() / 2).map(along).take_while(|r| *r > 0.0).sum::<f64>().mul_add(2.0, 1.0);
    let across = match channels {
        2 => (2.0 * seen.chunks_exact(2).map(|p| (p[0] * p[1].conj()).re).sum::<f64>() / power).abs(),
        _ => 0.0,
    };
    count * (1.0 + across)
}
