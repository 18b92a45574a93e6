//! Output error over windows: the parameters and every window's initial state, by Levenberg-Marquardt with exact
//! derivatives (forward mode), under priors on the nominal parameters.

use nalgebra::{DMatrix, DVector};

use super::model::{Coordinate, Free, LOOPS, Model};
use super::record::Record;
use super::windows::{self, Initial, Window, local_indices, local_state};
use crate::effects::Effect;
use crate::identify::levenberg::{self, Normal, Options, Problem, Termination};
use crate::scalar::Dual;

/// Prior standard deviation of the logarithm of a nominal parameter: a machine's data sheet is seldom off by more than
/// a factor of two.
const PRIOR: f64 = 0.5;
/// Share of the cost that the initial states must bring to be moved.
const SETTLED: f64 = 1e-3;
/// Longest step of a parameter's logarithm: far off, the model's linearisation says nothing.
const STRIDE: f64 = 1.0;
/// Share of the cost by which two steps running must lower it to go on, in fits that explore,
const CRAWL: f64 = 1e-3;
/// and in fits whose likelihoods are compared.
const CLOSE: f64 = 1e-5;
/// Weight of the prior that ties I2, B and K together (their common factor is weakly determined; PAPER, 4.3).
const SCALE_PRIOR: f64 = 0.3;

/// Data of a fit: the record and its windows.
#[derive(Debug, Clone, Copy)]
pub struct Data<'a> {
    /// The record.
    pub record: &'a Record,
    /// The windows compared.
    pub windows: &'a [Window],
}

impl Data<'_> {
    /// Number of compared values.
    #[must_use]
    pub fn values(&self) -> usize {
        let channels = self.record.channels.iter().flatten().count();
        self.windows.iter().map(|w| w.compared.len()).sum::<usize>() * channels
    }
}

/// A fitted model.
#[derive(Debug, Clone)]
pub struct Fitted {
    /// The model at the minimum.
    pub model: Model,
    /// What was free, with its coordinate.
    pub coordinates: Vec<Coordinate>,
    /// Standard error of each free value, in its unit, at unit noise.
    pub std: Vec<f64>,
    /// Initial state of each window.
    pub initial: Vec<Initial>,
    /// Sum of squared residuals in units of the noise, without the prior.
    pub chi2: f64,
    /// Squared residuals of each channel, summed, in its unit.
    pub squares: [f64; 4],
    /// How the minimisation ended.
    pub termination: Termination,
    /// Linearisations it took.
    pub iterations: usize,
}

/// Curvature and gradient over a window's own directions.
type Small<const N: usize> = ([[f64; N]; N], [f64; N]);

/// Sum of squares by channel, and in units of the noise.
#[derive(Debug, Clone, Copy, Default)]
struct Sum {
    chi2: f64,
    squares: [f64; 4],
}

struct Shooting<'a> {
    data: Data<'a>,
    start: Model,
    coordinates: &'a [Coordinate],
    also: Vec<Effect>,
    per: usize,
    locals: &'static [usize],
    /// Prior mean of each coordinate that has one, in x.
    prior: Vec<Option<f64>>,
    /// Squared residual per value that the model cannot remove: the priors count as much as data of that quality.
    misfit: f64,
}

impl Shooting<'_> {
    fn local<'v>(&self, p: &'v DVector<f64>, w: usize) -> &'v [f64] {
        let from = self.coordinates.len() + w * self.locals.len();
        &p.as_slice()[from..from + self.locals.len()]
    }

    fn sum(&self, p: &DVector<f64>) -> Sum {
        let x = &p.as_slice()[..self.coordinates.len()];
        let model = self.start.at(self.coordinates, x);
        let record = self.data.record;
        let weight = record.noise.map(|s| 1.0 / s);
        let mut sum = Sum::default();
        windows::run(
            &model,
            &self.also,
            self.per,
            record,
            self.data.windows,
            |w| local_state(model.structure, self.locals, self.local(p, w)),
            |m| m,
            |_, k, reading| {
                let model = [reading.theta1, reading.omega1, reading.theta2, reading.omega2];
                for (c, channel) in record.channels.iter().enumerate() {
                    if let Some(channel) = channel {
                        let r = model[c] - channel[k];
                        sum.squares[c] += r * r;
                        sum.chi2 += (r * weight[c]) * (r * weight[c]);
                    }
                }
            },
        );
        sum
    }

    /// Residuals of the prior: each nominal parameter's, and the common factor of I2, B, K.
    fn prior_rows(&self, x: &[f64]) -> Vec<(f64, Vec<f64>)> {
        let n = self.coordinates.len();
        let mut rows = Vec::new();
        let mut common = (0.0, vec![0.0; n], 0);
        for (i, mean) in self.prior.iter().enumerate() {
            let Some(mean) = mean else { continue };
            let mut row = vec![0.0; n];
            let strength = self.misfit.sqrt() / PRIOR;
            row[i] = strength;
            rows.push(((x[i] - mean) * strength, row));
            use super::model::BaseParameter::{B, I2, K};
            if matches!(self.coordinates[i].free, Free::Base(I2 | B | K)) {
                let strength = self.misfit.sqrt() / (3.0 * SCALE_PRIOR);
                common.0 += (x[i] - mean) * strength;
                common.1[i] = strength;
                common.2 += 1;
            }
        }
        if common.2 == 3 {
            rows.push((common.0, common.1));
        }
        rows
    }

    /// Runs the model at p with derivatives to `n` shared coordinates and each window's own initial state.
    ///
    /// One small matrix and gradient a window, over both, and the cost without the prior.
    fn by_window<const N: usize>(&self, p: &DVector<f64>, n: usize) -> (Vec<Small<N>>, f64) {
        let x: Vec<Dual<N>> = (0..self.coordinates.len())
            .map(|i| if i < n { Dual::variable(p[i], i) } else { Dual::from(p[i]) })
            .collect();
        let model = self.start.at(self.coordinates, &x);
        let record = self.data.record;
        let weight = record.noise.map(|s| 1.0 / s);
        let locals = self.locals.len();
        let m = n + locals;
        let mut small = vec![([[0.0; N]; N], [0.0; N]); self.data.windows.len()];
        let mut chi2 = 0.0;
        windows::run(
            &model,
            &self.also,
            self.per,
            record,
            self.data.windows,
            |w| {
                let own = self.local(p, w);
                let own: Vec<Dual<N>> = (0..locals).map(|i| Dual::variable(own[i], n + i)).collect();
                local_state(model.structure, self.locals, &own)
            },
            |mut d| {
                d.eps[n..m].fill(0.0);
                d
            },
            |w, k, reading| {
                let model = [reading.theta1, reading.omega1, reading.theta2, reading.omega2];
                let (matrix, gradient) = &mut small[w];
                for (c, channel) in record.channels.iter().enumerate() {
                    if let Some(channel) = channel {
                        let r = (model[c].re - channel[k]) * weight[c];
                        let row = model[c].eps.map(|e| e * weight[c]);
                        chi2 += r * r;
                        for i in 0..N {
                            let a = row[i];
                            gradient[i] += a * r;
                            for (to, b) in matrix[i].iter_mut().zip(&row) {
                                *to += a * b;
                            }
                        }
                    }
                }
            },
        );
        (small, chi2)
    }

    fn linearise_with<const N: usize>(&self, p: &DVector<f64>) -> Normal {
        let n = self.coordinates.len();
        let locals = self.locals.len();
        let m = n + locals;
        let (small, chi2) = self.by_window::<N>(p, n);
        let total = n + locals * self.data.windows.len();
        let mut normal =
            Normal { cost: 0.5 * chi2, gradient: DVector::zeros(total), curvature: DMatrix::zeros(total, total) };
        for (w, (matrix, gradient)) in small.iter().enumerate() {
            let at = |i: usize| if i < n { i } else { n + w * locals + (i - n) };
            for (i, (row, slope)) in matrix.iter().zip(gradient).enumerate().take(m) {
                normal.gradient[at(i)] += slope;
                for (j, value) in row.iter().enumerate().take(m) {
                    normal.curvature[(at(i), at(j))] += value;
                }
            }
        }
        for (r, row) in self.prior_rows(&p.as_slice()[..n]) {
            normal.cost += 0.5 * r * r;
            for i in 0..n {
                normal.gradient[i] += row[i] * r;
                for j in 0..n {
                    normal.curvature[(i, j)] += row[i] * row[j];
                }
            }
        }
        normal
    }
}

impl Problem for Shooting<'_> {
    fn cost(&self, p: &DVector<f64>) -> Option<f64> {
        let prior: f64 = self.prior_rows(&p.as_slice()[..self.coordinates.len()]).iter().map(|(r, _)| r * r).sum();
        Some(0.5 * (self.sum(p).chi2 + prior))
    }

    /// Moves the windows' initial states, in which a linear axis is linear, to where they are best: what is left is a
    /// problem in the shared coordinates alone, with far straighter valleys (Golub, Pereyra, SIAM J. Numer. Anal. 10(2),
    /// 1973: variable projection).
    fn settle(&self, p: &mut DVector<f64>) -> Option<f64> {
        let (n, locals) = (self.coordinates.len(), self.locals.len());
        let (small, chi2) = self.by_window::<6>(p, 0);
        let prior: f64 = self.prior_rows(&p.as_slice()[..n]).iter().map(|(r, _)| r * r).sum();
        let mut promised = 0.0;
        let mut settled = p.clone();
        for (w, (matrix, gradient)) in small.iter().enumerate() {
            let scale: Vec<f64> = (0..locals).map(|i| matrix[i][i].max(f64::MIN_POSITIVE).sqrt()).collect();
            let scaled = DMatrix::from_fn(locals, locals, |i, j| {
                matrix[i][j] / (scale[i] * scale[j]) + if i == j { 1e-12 } else { 0.0 }
            });
            let right = DVector::from_fn(locals, |i, _| -gradient[i] / scale[i]);
            let step = scaled.cholesky()?.solve(&right);
            promised += right.dot(&step);
            for i in 0..locals {
                settled[n + w * locals + i] += step[i] / scale[i];
            }
        }
        let cost = 0.5 * (chi2 + prior);
        if promised > SETTLED * chi2 {
            let better = self.cost(&settled)?;
            if better < cost {
                *p = settled;
                return Some(better);
            }
        }
        Some(cost)
    }

    fn linearise(&self, p: &DVector<f64>) -> Option<Normal> {
        // The derivative directions are a compile-time number: the next size up.
        match self.coordinates.len() + self.locals.len() {
            0..=8 => Some(self.linearise_with::<8>(p)),
            9..=10 => Some(self.linearise_with::<10>(p)),
            11..=12 => Some(self.linearise_with::<12>(p)),
            13..=14 => Some(self.linearise_with::<14>(p)),
            15..=16 => Some(self.linearise_with::<16>(p)),
            17..=20 => Some(self.linearise_with::<20>(p)),
            21..=24 => Some(self.linearise_with::<24>(p)),
            _ => None,
        }
    }
}

/// How a fit is run.
#[derive(Debug, Clone, Copy)]
pub struct Effort {
    /// Linearisations at most.
    pub iterations: usize,
    /// Squared residual per value to be expected, in units of the noise; at least 1.
    pub misfit: f64,
    /// Share of the cost below which steps are no longer worth taking.
    pub tolerance: f64,
    /// Given up when after so many steps the sum of squares, in units of the noise, is above this.
    pub hopeless: [(usize, f64); 2],
}

impl Effort {
    /// To where likelihoods can be compared.
    #[must_use]
    pub const fn to_the_end(iterations: usize, misfit: f64) -> Self {
        Self { iterations, misfit, tolerance: CLOSE, hopeless: [(0, f64::INFINITY); 2] }
    }

    /// To where it crawls: a fit slower than that does not reach the floor in the linearisations it has.
    #[must_use]
    pub const fn exploring(iterations: usize, misfit: f64) -> Self {
        Self { tolerance: CRAWL, ..Self::to_the_end(iterations, misfit) }
    }

    /// The same, given up when after so many steps the sum of squares is above a bar; the last two such bars count.
    #[must_use]
    pub const fn unless(self, steps: usize, bar: f64) -> Self {
        Self { hopeless: [self.hopeless[1], (steps, bar)], ..self }
    }
}

/// Fits the free numbers of `start`, and the windows' initial states from `initial`; where an effect that loops stands
/// when the record begins is such a state, too.
///
/// `nominal` gives the priors' means.
#[must_use]
pub fn fit(
    data: Data<'_>,
    nominal: &Model,
    start: &Model,
    free: &[Free],
    initial: &[Initial],
    effort: Effort,
) -> Fitted {
    let loops = LOOPS
        .iter()
        .enumerate()
        .filter(|(_, e)| {
            start.effects.is_on(**e) || free.iter().any(|f| matches!(f, Free::Effect(own, _) if own == *e))
        })
        .map(|(i, _)| Free::Loop(i));
    let coordinates: Vec<Coordinate> = free.iter().copied().chain(loops).map(|f| Coordinate::new(f, start)).collect();
    let prior = coordinates.iter().map(|c| matches!(c.free, Free::Base(_)).then(|| c.x(nominal))).collect();
    let mut also: Vec<Effect> = free
        .iter()
        .filter_map(|f| match f {
            Free::Effect(e, _) => Some(*e),
            Free::Base(_) | Free::Loop(_) => None,
        })
        .collect();
    also.dedup();
    let flexible = also.contains(&Effect::FlexibleMode) || start.effects.is_on(Effect::FlexibleMode);
    let locals = local_indices(start.structure, flexible);
    let problem = Shooting {
        data,
        start: *start,
        coordinates: &coordinates,
        also,
        per: windows::steps(start, data.record),
        locals,
        prior,
        misfit: effort.misfit.max(1.0),
    };
    let n = coordinates.len();
    let total = n + locals.len() * data.windows.len();
    let mut p = DVector::zeros(total);
    for (i, c) in coordinates.iter().enumerate() {
        p[i] = c.x(start);
    }
    for (w, s) in initial.iter().enumerate() {
        for (i, local) in locals.iter().enumerate() {
            p[n + w * locals.len() + i] = s[*local];
        }
    }
    let options = Options {
        iterations: effort.iterations,
        cost: effort.tolerance,
        hopeless: effort.hopeless.iter().map(|(steps, bar)| (*steps, 0.5 * bar)).collect(),
        step: 1e-9,
        gradient: 1e-9,
        stride: coordinates.iter().map(|c| if c.log { STRIDE } else { f64::INFINITY }).collect(),
        lower: (0..total).map(|i| coordinates.get(i).map_or(f64::NEG_INFINITY, |c| c.bounds[0])).collect(),
        upper: (0..total).map(|i| coordinates.get(i).map_or(f64::INFINITY, |c| c.bounds[1])).collect(),
        ..Options::default()
    };
    problem.settle(&mut p);
    let report = levenberg::minimise(&problem, &p, &options);
    let sum = problem.sum(&report.parameters);
    let std = shared_std(&report.normal.curvature, n, &coordinates, report.parameters.as_slice());
    let x = &report.parameters.as_slice()[..n];
    Fitted {
        model: start.at(&coordinates, x),
        std,
        initial: (0..data.windows.len())
            .map(|w| local_state(start.structure, locals, problem.local(&report.parameters, w)))
            .collect(),
        chi2: sum.chi2,
        squares: sum.squares,
        termination: report.termination,
        iterations: report.iterations,
        coordinates,
    }
}

/// Standard errors of the shared parameters, the windows' initial states marginalised.
fn shared_std(curvature: &DMatrix<f64>, n: usize, coordinates: &[Coordinate], x: &[f64]) -> Vec<f64> {
    let (covariance, _) = levenberg::covariance(curvature);
    (0..n).map(|i| covariance[(i, i)].max(0.0).sqrt() * coordinates[i].slope(x[i]).abs()).collect()
}

/// The model's readings at every compared sample of the windows, from the given initial states: window, sample,
/// readings.
#[must_use]
pub fn predict(data: Data<'_>, model: &Model, initial: &[Initial]) -> Vec<(usize, usize, [f64; 4])> {
    let mut out = Vec::with_capacity(data.windows.iter().map(|w| w.compared.len()).sum());
    windows::run(
        model,
        &[],
        windows::steps(model, data.record),
        data.record,
        data.windows,
        |w| initial[w],
        |m: f64| m,
        |w, k, r| out.push((w, k, [r.theta1, r.omega1, r.theta2, r.omega2])),
    );
    out
}
