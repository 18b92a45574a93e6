//! A hypothesis fitted: Gauss and Newton's method on what the model lacks, every column a simulation of its own.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use rustfft::FftPlanner;

use super::super::model::{BaseParameter, Coordinate, Free, Model};
use super::super::record::Record;
use super::likelihood::{Band, C, Discrepancy, Lacking, Motion};
use super::scales::Scales;
use super::tracking::{Bandwidth, track};
use crate::axis::Structure;
use crate::effects::{EFFECTS, Effect, Place, Scale, Start};

/// Prior standard deviation of the logarithm of a nominal parameter.
const PRIOR: f64 = 0.5;
/// Largest change of a nominal parameter, in its logarithm: a factor of ten.
const FARTHEST: f64 = 2.3;
/// What a form that adds to a plainer one costs beside it: as much as an effect of its own, and a little more, so that of two accounts of
/// one thing (an unlike friction either way, a bias) the one by effects of their own is told.
const RICHER: f64 = 2.2;
/// Cost of an effect in log evidence: one of some fifty.
pub const PRICE: f64 = 4.0;

/// Steps tried, each shorter than the one before, until one is better.
const TRIALS: usize = 7;
/// Steps in which the shapes of effects are held.
const SIZES_FIRST: usize = 1;
/// Largest step of a logarithm.
const FARTHEST_STEP: f64 = 0.5;
/// Share of a discrepancy's variance that is left at least from one step to the next.
const SHRINKS: f64 = 0.01;
/// Change of a discrepancy, in the logarithm of its variance, below which it is settled.
const SETTLED: f64 = 0.05;
/// Gain in log likelihood below which a fit is done.
const WORTH: f64 = 0.05;
/// Change of the feedback's bandwidth, in its logarithm, from which the motion is followed anew.
const ANOTHER: f64 = 0.4;

thread_local! { static PLANNER: std::cell::RefCell<FftPlanner<f64>> = std::cell::RefCell::new(FftPlanner::new()); }

/// An effect in one of its forms.
pub type Term = (Effect, usize);

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
    pub rows: Lacking,
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
}

impl Fit {
    /// Ids of its effects, joined by `+`; `parameters` or `no_gap` without any.
    #[must_use]
    pub fn id(&self) -> String {
        match (self.terms.is_empty(), self.coordinates.is_empty()) {
            (true, true) => "no_gap".to_owned(),
            (true, false) => "parameters".to_owned(),
            _ => self.terms.iter().map(|(e, _)| e.info().id).collect::<Vec<_>>().join("+"),
        }
    }
}

pub struct Problem<'a> {
    pub record: &'a Record,
    pub band: &'a Band,
    pub nominal: Model,
    /// Range of theta1 and theta2 over the record, and its length: what a period is told by.
    pub range: [f64; 2],
    pub scales: Option<Scales>,
    /// Spectra of the measured motion; `None` where it is not measured whole.
    motion: Option<Motion>,
}

impl<'a> Problem<'a> {
    /// A record compared in a band.
    #[must_use]
    pub fn new(record: &'a Record, band: &'a Band, nominal: Model) -> Self {
        let range = [0, 1].map(|i: usize| {
            let y = record.channels[2 * i].as_ref().or(record.channels[2 - 2 * i].as_ref());
            y.map_or(1.0, |y| {
                let (low, high) = y.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(*v), h.max(*v)));
                (high - low).max(1e-12)
            })
        });
        Self { record, band, nominal, range, scales: None, motion: band.motion(record) }
    }
}

impl Problem<'_> {
    pub fn base(&self) -> Vec<Free> {
        BaseParameter::of(self.nominal.structure).iter().map(|p| Free::Base(*p)).collect()
    }

    pub fn free(&self, terms: &[Term]) -> Vec<Free> {
        let mut free = self.base();
        for (e, v) in terms {
            free.extend(e.info().variants[*v].free.iter().map(|i| Free::Effect(*e, *i)));
        }
        free
    }

    /// Bandwidth of the feedback at a discrepancy.
    pub fn bandwidth(&self, s: Discrepancy) -> Bandwidth {
        let r = self.record;
        let p = &self.nominal.parameters;
        let high = self.band.omega.last().copied().unwrap_or(1.0).min(0.5 / r.dt);
        let low = (8.0 / (512.0 * r.dt)).min(high);
        let inertia =
            if p.i2 > 0.0 && self.nominal.structure == Structure::TwoInertia { [p.i1, p.i2] } else { [p.i1 + p.i2; 2] };
        [0, 1].map(|i| {
            let noise = r.noise[2 * i].max(f64::MIN_POSITIVE);
            (s[i].sqrt() / (inertia[i] * noise)).sqrt().clamp(low, high)
        })
    }

    pub fn rows(&self, model: &Model, bandwidth: Bandwidth) -> Option<Lacking> {
        let tracked = track(model, self.record, bandwidth)?;
        Some(PLANNER.with_borrow_mut(|planner| self.band.lacking(model, &tracked, planner)))
    }

    /// Step of a coordinate for its column.
    fn step(&self, c: &Coordinate, model: &Model) -> f64 {
        match c.free {
            Free::Base(_) => 1e-3,
            Free::Loop(_) => 0.1,
            Free::Effect(e, i) => {
                let info = &e.info().parameters[i];
                let value = model.effects.of(e)[i];
                match info.start {
                    Start::Grid(Scale::Order, _) => {
                        0.02 / (value.abs() * self.range[usize::from(e.info().place == Place::Table)]).max(1e-3)
                    }
                    Start::Grid(Scale::Frequency, _) => {
                        0.02 / (std::f64::consts::TAU * value.abs() * self.record.dt * self.record.len() as f64)
                            .max(1e-3)
                    }
                    _ => 1e-2,
                }
            }
        }
    }

    pub fn columns(
        &self,
        model: &Model,
        coordinates: &[Coordinate],
        lacking: &Lacking,
        bandwidth: Bandwidth,
    ) -> Option<Vec<[Vec<C>; 2]>> {
        let x: Vec<f64> = coordinates.iter().map(|c| c.x(model)).collect();
        // A coupling with play does not pull by its twist alone.
        let linear = !EFFECTS.iter().any(|e| e.info().place == Place::Coupling && model.effects.is_on(*e));
        (0..coordinates.len())
            .into_par_iter()
            .map(|i| {
                if let (Free::Base(p), Some(motion)) = (coordinates[i].free, &self.motion)
                    && (linear || matches!(p, BaseParameter::I1 | BaseParameter::I2))
                {
                    return Some(self.band.base_column(p, motion, coordinates[i].slope(x[i])));
                }
                let mut h = self.step(&coordinates[i], model);
                if x[i] + h > coordinates[i].bounds[1] {
                    h = -h;
                }
                let mut y = x.clone();
                y[i] += h;
                let moved = self.rows(&model.at(coordinates, &y), bandwidth)?;
                Some([0, 1].map(|e| moved.rows[e].iter().zip(&lacking.rows[e]).map(|(a, b)| (a - b) / h).collect()))
            })
            .collect()
    }

    fn log_prior(&self, coordinates: &[Coordinate], x: &[f64]) -> f64 {
        coordinates
            .iter()
            .zip(x)
            .map(|(c, x)| match c.free {
                Free::Base(_) => -0.5 * ((x - c.x(&self.nominal)) / PRIOR).powi(2),
                _ => 0.0,
            })
            .sum()
    }

    /// A model that cannot be run along the record lacks all of its torque.
    #[must_use]
    pub fn nothing(&self) -> Fit {
        let mut tracked = super::tracking::Tracked::nothing(self.record.len());
        tracked.torque[0].copy_from_slice(&self.record.torque);
        let rows = PLANNER.with_borrow_mut(|planner| self.band.lacking(&self.nominal, &tracked, planner));
        let s = self.band.discrepancy(&rows);
        Fit {
            terms: vec![],
            model: self.nominal,
            coordinates: vec![],
            std: vec![],
            columns: vec![],
            discrepancy: s,
            bandwidth: self.bandwidth(s),
            log_likelihood: self.band.log_likelihood(&rows, s),
            log_prior: 0.0,
            rows,
            iterations: 0,
        }
    }

    /// The hypothesis without anything fitted.
    pub fn given(&self, model: &Model) -> Option<Fit> {
        let mut bandwidth = self.bandwidth([f64::MAX; 2]);
        let mut rows = self.rows(model, bandwidth)?;
        let mut s = self.band.discrepancy(&rows);
        for _ in 0..2 {
            bandwidth = self.bandwidth(s);
            rows = self.rows(model, bandwidth)?;
            s = self.band.discrepancy(&rows);
        }
        Some(Fit {
            terms: vec![],
            model: *model,
            coordinates: vec![],
            std: vec![],
            columns: vec![],
            discrepancy: s,
            bandwidth,
            log_likelihood: self.band.log_likelihood(&rows, s),
            log_prior: 0.0,
            rows,
            iterations: 0,
        })
    }

    /// Fits the hypothesis from a start: likelier parameters at the present discrepancy (Levenberg and Marquardt's method), then
    /// the likeliest discrepancy at these, in turn. A discrepancy shrinks step by step, so that a fit from afar comes in along the
    /// motion as measured before the noise's own sharpness holds it in some valley.
    pub fn fit(&self, start: &Model, terms: &[Term], from: Discrepancy, effort: usize) -> Option<Fit> {
        let free = self.free(terms);
        let coordinates: Vec<Coordinate> =
            free.iter().map(|f| bounded(Coordinate::new(*f, start), &self.nominal)).collect();
        let mut at = self.along(start, self.bandwidth(from))?;
        let mut damping = 0.0;
        let mut std = Vec::new();
        let mut columns = Vec::new();
        let mut iterations = 0;
        while iterations < effort {
            iterations += 1;
            columns = self.columns(&at.model, &coordinates, &at.rows, at.bandwidth)?;
            let x: Vec<f64> = coordinates.iter().map(|c| c.x(&at.model)).collect();
            let base: Vec<(BaseParameter, f64, usize)> = coordinates
                .iter()
                .enumerate()
                .filter_map(|(i, c)| match c.free {
                    Free::Base(p) => Some((p, c.slope(x[i]), i)),
                    Free::Effect(..) | Free::Loop(_) => None,
                })
                .collect();
            let grows = self.band.score(&at.model, &at.rows, at.s, &base, &mut columns);
            let cost = |l: &Lacking, x: &[f64]| -self.band.log_likelihood(l, at.s) - self.log_prior(&coordinates, x);
            let before = cost(&at.rows, &x);
            let mut normal = self.normal(&coordinates, &x, &columns, &at.rows, at.s);
            for ((_, _, i), g) in base.iter().zip(&grows) {
                normal.g[*i] += g;
            }
            let mut next = None;
            // Sizes first, at the shapes of the start.
            let mut held: Vec<bool> = coordinates.iter().map(|c| iterations <= SIZES_FIRST && c.is_shape()).collect();
            for _ in 0..TRIALS {
                let (delta, errors) = normal.solve(&coordinates, &x, damping, &held)?;
                if std.is_empty() || damping == 0.0 {
                    std = errors;
                }
                let y: Vec<f64> = (0..x.len())
                    .map(|i| (x[i] + delta[i]).clamp(coordinates[i].bounds[0], coordinates[i].bounds[1]))
                    .collect();
                let model: Model = at.model.at(&coordinates, &y);
                if !self.admits(&model, terms) {
                    // What leaves physics' bounds stays where it is; the others move without it.
                    let alone = |i: usize| self.admits(&at.model.at(&coordinates[i..=i], &y[i..=i]), terms);
                    let leaving: Vec<usize> = (0..y.len()).filter(|&i| !held[i] && !alone(i)).collect();
                    if leaving.is_empty() {
                        damping = (10.0_f64 * damping).max(1e-3);
                    }
                    for i in leaving {
                        held[i] = true;
                    }
                    continue;
                }
                if let Some(rows) = self.rows(&model, at.bandwidth) {
                    let after = cost(&rows, &y);
                    if after < before {
                        next = Some((model, rows, before - after));
                        damping = if damping < 2e-4 { 0.0 } else { 0.1 * damping };
                        break;
                    }
                }
                damping = (10.0_f64 * damping).max(1e-3);
            }
            let moved = next.is_some();
            let mut gain = 0.0;
            if let Some((model, rows, less)) = next {
                (at.model, at.rows, gain) = (model, rows, less);
            }
            let found = self.band.discrepancy(&at.rows);
            let s = if self.band.log_likelihood(&at.rows, found) > self.band.log_likelihood(&at.rows, at.s) {
                found
            } else {
                at.s
            };
            let least = at.s.map(|v| SHRINKS * v);
            let settled = (0..self.band.equations()).all(|i| (s[i].max(1e-300) / at.s[i]).ln().abs() < SETTLED);
            at.s = [s[0].max(least[0]), s[1].max(least[1])];
            let wanted = self.bandwidth(at.s);
            let off = (0..2).map(|i| (wanted[i] / at.bandwidth[i]).ln().abs()).fold(0.0, f64::max);
            if off > ANOTHER {
                at = self.along(&at.model, wanted)?;
            } else if settled && (gain < WORTH || !moved) {
                break;
            }
            if !moved {
                damping = 0.0;
            }
        }
        let x: Vec<f64> = coordinates.iter().map(|c| c.x(&at.model)).collect();
        let log_prior = self.log_prior(&coordinates, &x);
        let std = std.iter().zip(&coordinates).zip(&x).map(|((s, c), x)| s * c.slope(*x)).collect();
        Some(Fit {
            terms: terms.to_vec(),
            model: at.model,
            coordinates,
            std,
            log_likelihood: self.band.log_likelihood(&at.rows, at.s),
            rows: at.rows,
            columns,
            discrepancy: at.s,
            bandwidth: at.bandwidth,
            log_prior,
            iterations,
        })
    }

    /// Whether physics lets the effects be what they are in a model.
    fn admits(&self, model: &Model, terms: &[Term]) -> bool {
        self.scales.as_ref().is_none_or(|s| s.admit(model, terms.iter().map(|t| t.0)))
    }

    /// A model along the record, and the discrepancy that it leaves.
    fn along(&self, model: &Model, bandwidth: Bandwidth) -> Option<Along> {
        let rows = self.rows(model, bandwidth)?;
        let s = self.band.discrepancy(&rows);
        Some(Along { model: *model, rows, s, bandwidth })
    }

    /// The normal equations of whitened columns, the prior in them.
    fn normal(
        &self,
        coordinates: &[Coordinate],
        x: &[f64],
        columns: &[[Vec<C>; 2]],
        lacking: &Lacking,
        s: Discrepancy,
    ) -> Normal {
        let k = coordinates.len();
        let z = self.band.whiten(&lacking.rows, &lacking.weights, s);
        let j: Vec<Vec<f64>> = columns.iter().map(|c| self.band.whiten(c, &lacking.weights, s)).collect();
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let mut a = DMatrix::from_fn(k, k, |p, q| if p <= q { dot(&j[p], &j[q]) } else { 0.0 });
        a.fill_lower_triangle_with_upper_triangle();
        let mut g = DVector::from_fn(k, |p, _| -dot(&j[p], &z));
        for i in 0..k {
            if let Free::Base(_) = coordinates[i].free {
                a[(i, i)] += 1.0 / (PRIOR * PRIOR);
                g[i] -= (x[i] - coordinates[i].x(&self.nominal)) / (PRIOR * PRIOR);
            }
        }
        Normal { a, g }
    }

    /// What an effect costs: one of some fifty, at one of so many lines.
    fn price(&self, (e, v): Term) -> f64 {
        let lines = e.info().variants[v]
            .free
            .iter()
            .any(|i| matches!(e.info().parameters[*i].start, Start::Grid(Scale::Order | Scale::Frequency, _)));
        let all = e.info().variants;
        let richer = all[..v].iter().any(|p| p.free.iter().all(|i| all[v].free.contains(i)));
        PRICE * if richer { RICHER } else { 1.0 } + if lines { (self.band.omega.len() as f64).ln() } else { 0.0 }
    }

    /// Log evidence with `share` of the values independent.
    pub fn evidence(&self, f: &Fit, share: f64) -> f64 {
        let n = share * self.band.values();
        share * f.log_likelihood + f.log_prior
            - 0.5 * f.coordinates.len() as f64 * n.ln()
            - f.terms.iter().map(|t| self.price(*t)).sum::<f64>()
    }
}

/// A model along the record.
struct Along {
    model: Model,
    rows: Lacking,
    s: Discrepancy,
    bandwidth: Bandwidth,
}

/// Normal equations `a*delta = g`.
struct Normal {
    a: DMatrix<f64>,
    g: DVector<f64>,
}

impl Normal {
    /// The step and the standard errors of its coordinates; what would leave its bounds stays, others move without it.
    fn solve(
        &self,
        coordinates: &[Coordinate],
        x: &[f64],
        damping: f64,
        held: &[bool],
    ) -> Option<(Vec<f64>, Vec<f64>)> {
        let k = coordinates.len();
        let mut fixed = held.to_vec();
        loop {
            let free: Vec<usize> = (0..k).filter(|i| !fixed[*i]).collect();
            let mut delta = vec![0.0; k];
            let mut std = vec![f64::INFINITY; k];
            if free.is_empty() {
                return Some((delta, std));
            }
            let scale: Vec<f64> = free.iter().map(|&i| self.a[(i, i)].max(1e-300).sqrt()).collect();
            let m = DMatrix::from_fn(free.len(), free.len(), |p, q| {
                self.a[(free[p], free[q])] / (scale[p] * scale[q]) + if p == q { 1e-10 + damping } else { 0.0 }
            });
            let r = DVector::from_fn(free.len(), |p, _| self.g[free[p]] / scale[p]);
            let inverse = m.cholesky()?.inverse();
            let step = &inverse * r;
            let mut again = false;
            for (p, &i) in free.iter().enumerate() {
                delta[i] = step[p] / scale[p];
                std[i] = inverse[(p, p)].max(0.0).sqrt() / scale[p];
                if coordinates[i].log {
                    delta[i] = delta[i].clamp(-FARTHEST_STEP, FARTHEST_STEP);
                }
                let to = x[i] + delta[i];
                let b = coordinates[i].bounds;
                if (x[i] <= b[0] + 1e-12 && to < b[0]) || (x[i] >= b[1] - 1e-12 && to > b[1]) {
                    fixed[i] = true;
                    again = true;
                }
            }
            if !again {
                return Some((delta, std));
            }
        }
    }
}

/// The coordinate of a nominal parameter, kept within a factor of its nominal value.
fn bounded(c: Coordinate, nominal: &Model) -> Coordinate {
    match c.free {
        Free::Base(_) => {
            let at = c.x(nominal);
            Coordinate { bounds: [at - FARTHEST, at + FARTHEST], ..c }
        }
        Free::Effect(..) | Free::Loop(_) => c,
    }
}
