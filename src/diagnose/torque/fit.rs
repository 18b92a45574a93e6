//! A hypothesis fitted: Gauss and Newton's method on what the model lacks, every column a simulation of its own.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use rustfft::FftPlanner;

use super::super::model::{BaseParameter, Coordinate, Free, Model};
use super::super::record::Record;
use super::likelihood::{Band, C, Discrepancy};
use super::scales::Scales;
use super::tracking::{Bandwidth, track};
use crate::axis::Structure;
use crate::effects::{Effect, Scale, Start};

/// Prior standard deviation of the logarithm of a nominal parameter.
const PRIOR: f64 = 0.5;
/// Largest change of a nominal parameter, in its logarithm: a factor of ten.
const FARTHEST: f64 = 2.3;
/// What a form that adds to a plainer one costs beside it: as much as an effect of its own, and a little more, so that of two accounts of
/// one thing (an unlike friction either way, a bias) the one by effects of their own is told.
const RICHER: f64 = 2.2;
/// Cost of an effect in log evidence: one of some fifty.
pub const PRICE: f64 = 4.0;

thread_local! { static PLANNER: std::cell::RefCell<FftPlanner<f64>> = std::cell::RefCell::new(FftPlanner::new()); }

pub type Term = (Effect, usize);

#[derive(Debug, Clone)]
pub struct Fit {
    pub terms: Vec<Term>,
    pub model: Model,
    pub coordinates: Vec<Coordinate>,
    pub std: Vec<f64>,
    pub rows: [Vec<C>; 2],
    /// Columns of the coordinates, unwhitened.
    pub columns: Vec<[Vec<C>; 2]>,
    pub discrepancy: Discrepancy,
    pub bandwidth: Bandwidth,
    pub log_likelihood: f64,
    pub log_prior: f64,
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
        Self { record, band, nominal, range, scales: None }
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

    pub fn rows(&self, model: &Model, bandwidth: Bandwidth) -> Option<[Vec<C>; 2]> {
        let tracked = track(model, self.record, bandwidth)?;
        Some(PLANNER.with_borrow_mut(|planner| self.band.rows(model, &tracked, planner)))
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
                        0.02 / (value.abs() * self.range[usize::from(e.info().place == crate::effects::Place::Table)])
                            .max(1e-3)
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
        rows: &[Vec<C>; 2],
        bandwidth: Bandwidth,
    ) -> Option<Vec<[Vec<C>; 2]>> {
        let x: Vec<f64> = coordinates.iter().map(|c| c.x(model)).collect();
        (0..coordinates.len())
            .into_par_iter()
            .map(|i| {
                let mut h = self.step(&coordinates[i], model);
                if x[i] + h > coordinates[i].bounds[1] {
                    h = -h;
                }
                let mut y = x.clone();
                y[i] += h;
                let moved = self.rows(&model.at(coordinates, &y), bandwidth)?;
                Some([0, 1].map(|e| moved[e].iter().zip(&rows[e]).map(|(a, b)| (a - b) / h).collect()))
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
        let rows = PLANNER.with_borrow_mut(|planner| self.band.rows(&self.nominal, &tracked, planner));
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

    /// Fits the hypothesis from a start.
    pub fn fit(&self, start: &Model, terms: &[Term], from: Discrepancy, effort: usize) -> Option<Fit> {
        let free = self.free(terms);
        let coordinates: Vec<Coordinate> =
            free.iter().map(|f| bounded(Coordinate::new(*f, start), &self.nominal)).collect();
        let mut model = *start;
        let mut bandwidth = self.bandwidth(from);
        let mut rows = self.rows(&model, bandwidth)?;
        let mut s = self.band.discrepancy(&rows);
        let mut value = self.band.log_likelihood(&rows, s);
        let mut columns = Vec::new();
        let mut iterations = 0;
        let mut stale = true;
        let mut rounds = 0;
        let mut damping = 0.0;
        let mut std = Vec::new();
        while iterations < effort {
            iterations += 1;
            if stale {
                columns = self.columns(&model, &coordinates, &rows, bandwidth)?;
                stale = false;
            }
            let x: Vec<f64> = coordinates.iter().map(|c| c.x(&model)).collect();
            let (delta, errors) = self.newton(&coordinates, &x, &columns, &rows, s, damping)?;
            std = errors;
            // Line search.
            let mut accepted = false;
            let mut share = 1.0;
            for _ in 0..4 {
                let y: Vec<f64> = (0..x.len())
                    .map(|i| (x[i] + share * delta[i]).clamp(coordinates[i].bounds[0], coordinates[i].bounds[1]))
                    .collect();
                let next: Model = model.at(&coordinates, &y);
                let allowed = self.scales.as_ref().is_none_or(|s| s.admit(&next, terms.iter().map(|t| t.0)));
                if let Some(r) = allowed.then(|| self.rows(&next, bandwidth)).flatten() {
                    let t = self.band.discrepancy(&r);
                    let v = self.band.log_likelihood(&r, t);
                    if v + self.log_prior(&coordinates, &y) > value + self.log_prior(&coordinates, &x) + 1e-9 {
                        let gain = v - value;
                        (model, rows, s, value) = (next, r, t, v);
                        accepted = true;
                        stale = true;
                        if gain < 0.05 {
                            accepted = false;
                        }
                        break;
                    }
                }
                share *= 0.3;
            }
            if share < 0.5 {
                damping = (damping * 5.0_f64).max(1e-3);
            } else {
                damping = 0.0;
            }
            if !accepted {
                let wanted = self.bandwidth(s);
                let off = (0..2).map(|i| (wanted[i] / bandwidth[i]).ln().abs()).fold(0.0, f64::max);
                if off > 0.4 && rounds < 3 {
                    rounds += 1;
                    bandwidth = wanted;
                    rows = self.rows(&model, bandwidth)?;
                    s = self.band.discrepancy(&rows);
                    value = self.band.log_likelihood(&rows, s);
                    stale = true;
                    continue;
                }
                break;
            }
        }
        let x: Vec<f64> = coordinates.iter().map(|c| c.x(&model)).collect();
        let log_prior = self.log_prior(&coordinates, &x);
        let std = std.iter().zip(&coordinates).zip(&x).map(|((s, c), x)| s * c.slope(*x)).collect();
        Some(Fit {
            terms: terms.to_vec(),
            model,
            coordinates,
            std,
            rows,
            columns,
            discrepancy: s,
            bandwidth,
            log_likelihood: value,
            log_prior,
            iterations,
        })
    }

    fn newton(
        &self,
        coordinates: &[Coordinate],
        x: &[f64],
        columns: &[[Vec<C>; 2]],
        rows: &[Vec<C>; 2],
        s: Discrepancy,
        damping: f64,
    ) -> Option<(Vec<f64>, Vec<f64>)> {
        let k = coordinates.len();
        if k == 0 {
            return Some((vec![], vec![]));
        }
        let z = self.band.whiten(rows, s);
        let j: Vec<Vec<f64>> = columns.iter().map(|c| self.band.whiten(c, s)).collect();
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let mut a = DMatrix::from_fn(k, k, |p, q| if p <= q { dot(&j[p], &j[q]) } else { 0.0 });
        for p in 0..k {
            for q in 0..p {
                a[(p, q)] = a[(q, p)];
            }
        }
        let mut g = DVector::from_fn(k, |p, _| -dot(&j[p], &z));
        for i in 0..k {
            if let Free::Base(_) = coordinates[i].free {
                a[(i, i)] += 1.0 / (PRIOR * PRIOR);
                g[i] -= (x[i] - coordinates[i].x(&self.nominal)) / (PRIOR * PRIOR);
            }
        }
        // What would leave its bounds stays; others move without it.
        let mut fixed = vec![false; k];
        loop {
            let idx: Vec<usize> = (0..k).filter(|i| !fixed[*i]).collect();
            if idx.is_empty() {
                return Some((vec![0.0; k], vec![f64::INFINITY; k]));
            }
            let scale: Vec<f64> = idx.iter().map(|&i| a[(i, i)].max(1e-300).sqrt()).collect();
            let m = DMatrix::from_fn(idx.len(), idx.len(), |p, q| {
                a[(idx[p], idx[q])] / (scale[p] * scale[q]) + if p == q { 1e-10 + damping } else { 0.0 }
            });
            let r = DVector::from_fn(idx.len(), |p, _| g[idx[p]] / scale[p]);
            let inverse = m.cholesky()?.inverse();
            let step = &inverse * r;
            let mut delta = vec![0.0; k];
            let mut std = vec![f64::INFINITY; k];
            let mut again = false;
            for (p, &i) in idx.iter().enumerate() {
                delta[i] = step[p] / scale[p];
                std[i] = inverse[(p, p)].max(0.0).sqrt() / scale[p];
                if coordinates[i].log {
                    delta[i] = delta[i].clamp(-1.0, 1.0);
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
