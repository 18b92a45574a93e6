//! The way down from a start to the likeliest parameters of a hypothesis.
//!
//! Levenberg and Marquardt's method on what the model lacks; in turn with it the likeliest
//! discrepancy at these parameters, and the likeliest bandwidth at which the model follows the record. A discrepancy shrinks step by
//! step, so that a fit from afar comes in along the motion as measured before the noise's own sharpness holds it in some valley. Near
//! the noise the motion as measured has reversals and blows of the noise in it: there the model is let go along its own motion, as far
//! as that is likelier.

use nalgebra::{DMatrix, DVector};

use super::discrepancy::Discrepancy;
use super::evidence::PRIOR;
use super::fit::{Fit, Term};
use super::likelihood::{Band, C, Sight, TorqueResidual};
use super::model::{BaseParameter, Coordinate, Free, Model};
use super::problem::{Columns, Problem};
use super::scatter;
use super::secant::Secant;
use super::tracking::Bandwidth;
use crate::axis::Structure;
use crate::trace::machine::NOMINAL_OFF;
use crate::trace::numerics::dot;

/// Largest factor by which stiffness and damping of a coupling are off: a data sheet seldom has them.
const COUPLING_OFF: f64 = 10.0;
/// Steps tried, each shorter than the one before, until one is better.
const TRIALS: usize = 7;
/// Steps in which something is held.
const FIRST_STEPS: usize = 1;
/// Largest step of a logarithm.
const FARTHEST_STEP: f64 = 0.5;
/// Share of a discrepancy's variance that is left at least from one step to the next.
const SHRINKS: f64 = 0.01;
/// Change of a discrepancy, in the logarithm of its variance, below which it is converged.
const CONVERGED: f64 = 0.05;
/// Gain in log likelihood below which a fit is done.
const WORTH: f64 = 0.05;
/// Change of the feedback's bandwidth, in its logarithm, from which the motion is followed anew.
const ANOTHER: f64 = 0.4;
/// Share of the feedback's bandwidth at which a fit looks whether it is likelier.
const LOOSER: f64 = 0.4;
/// Share of a discrepancy's variance that is none.
const NOISE_ALONE: f64 = 1e-12;
/// Share of the bandwidth of a fit at its end at which another is tried, and its steps.
const SHARPER: f64 = 0.25;
const SHARPENING: usize = 6;

/// A model along the record.
#[derive(Debug, Clone)]
pub struct Along {
    pub model: Model,
    pub rows: TorqueResidual,
    /// How what its free values change is told.
    pub columns: Columns,
    pub s: Discrepancy,
    pub bandwidth: Bandwidth,
}

/// A hypothesis on its way to the likeliest parameters.
#[derive(Clone)]
pub struct Descent<'a> {
    problem: &'a Problem<'a>,
    terms: &'a [Term],
    coordinates: Vec<Coordinate>,
    at: Along,
    std: Vec<f64>,
    columns: Vec<[Vec<C>; 2]>,
    iterations: usize,
    /// Whether the last step would have taken an effect out of what physics lets it be.
    leaves: bool,
    /// What is held in the first steps.
    first: First,
    /// The bandwidth from which a looser one was no likelier, and the discrepancy's own that was not.
    tight: Option<Bandwidth>,
    passed_by: Option<Bandwidth>,
    /// Columns brought along from the step before; none where they are to be simulated.
    secant: Option<Secant>,
    /// Whether the last step was made by such.
    is_by_secant: bool,
}

/// What a descent holds in its first steps: what its start was not found with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum First {
    /// The shapes of effects: their sizes were found beside the axis' parameters.
    Sizes,
    /// The axis' parameters: the effect was found beside an axis as given.
    Effects,
    /// The stiffness, in all steps: the inertias come to it.
    Inertias,
}

impl First {
    fn holds(self, c: &Coordinate) -> bool {
        match self {
            Self::Sizes => c.is_shape(),
            Self::Effects => c.is_base(),
            Self::Inertias => c.free == Free::Base(BaseParameter::K),
        }
    }
}

impl<'a> Descent<'a> {
    pub fn new(problem: &'a Problem<'a>, start: &Model, terms: &'a [Term], from: Discrepancy) -> Option<Self> {
        let free = problem.free(terms);
        let coordinates: Vec<Coordinate> =
            free.iter().map(|f| bounded(Coordinate::new(*f, start), &problem.nominal)).collect();
        let at = problem.along(start, problem.bandwidth(from))?;
        Some(Self {
            problem,
            terms,
            coordinates,
            at,
            std: Vec::new(),
            columns: Vec::new(),
            iterations: 0,
            leaves: false,
            first: First::Sizes,
            tight: None,
            passed_by: None,
            secant: None,
            is_by_secant: false,
        })
    }

    /// On from where a fit ended.
    pub fn resumed(problem: &'a Problem<'a>, fit: &'a Fit) -> Self {
        Self {
            problem,
            terms: &fit.terms,
            coordinates: fit.coordinates.clone(),
            at: Along {
                model: fit.model,
                rows: fit.rows.clone(),
                columns: Columns::Simulated,
                s: fit.discrepancy,
                bandwidth: fit.bandwidth,
            },
            std: fit.std.clone(),
            columns: fit.columns.clone(),
            iterations: fit.iterations,
            leaves: fit.at_bound,
            first: First::Sizes,
            tight: None,
            passed_by: None,
            secant: None,
            is_by_secant: false,
        }
    }

    /// With other things held first.
    pub fn holding(self, first: First) -> Self {
        Self { first, ..self }
    }

    /// At most so many steps, each followed at the likeliest bandwidth.
    pub fn run(&mut self, effort: usize) -> Option<()> {
        self.steps(effort, true)
    }

    /// Steps at lower and lower bandwidths, as long as they end likelier: the likeliest parameters along the measured motion are off by
    /// what its noise does to the effects, and there the model drifts away from the record. At the floor of the noise on request alone.
    pub fn sharpen(&mut self, at_floor: bool) -> Option<()> {
        while at_floor || !self.problem.band.at_floor(&self.at.rows) {
            let bandwidth = lowered(self.at.bandwidth, SHARPER, self.problem.loosest(&self.at.model, &self.at.rows));
            if !differ(bandwidth, self.at.bandwidth) {
                break;
            }
            let mut other = Self { at: self.problem.along(&self.at.model, bandwidth)?, ..self.clone() };
            other.steps(SHARPENING, false)?;
            if other.log_likelihood() <= self.log_likelihood() + WORTH {
                break;
            }
            *self = other;
        }
        Some(())
    }

    /// Near the noise, steps along the measured motion from where the noise is all that is left, kept where they end likelier: a discrepancy,
    /// at which every frequency counts alike, holds itself up by what the noise of the fast ones does to the parameters.
    pub fn try_noise_alone(&mut self) -> Option<()> {
        let (problem, band) = (self.problem, self.problem.band);
        if band.at_floor(&self.at.rows) || !band.is_near_the_noise(&self.at.rows) {
            return Some(());
        }
        let at = problem.along(&self.at.model, problem.bandwidth(self.at.s))?;
        let mut other =
            Self { at: Along { s: self.at.s.map(|s| NOISE_ALONE * s), ..at }, secant: None, ..self.clone() };
        band.weigh(&mut other.at.rows, other.at.s);
        other.steps(SHARPENING, false)?;
        if other.log_likelihood() > self.log_likelihood() + WORTH {
            *self = other;
        }
        Some(())
    }

    fn log_likelihood(&self) -> f64 {
        self.problem.band.log_likelihood(&self.at.rows, self.at.s)
    }

    fn steps(&mut self, effort: usize, adapts: bool) -> Option<()> {
        let band = self.problem.band;
        let mut damping = 0.0;
        for i in 0..effort {
            self.iterations += 1;
            let gained = self.step(&mut damping, i < FIRST_STEPS || self.first == First::Inertias)?;
            let found = band.discrepancy(&self.at.rows);
            let likelier = band.log_likelihood(&self.at.rows, found) > self.log_likelihood();
            let s = if likelier { found } else { self.at.s };
            let least = self.at.s.map(|v| SHRINKS * v);
            let converged = (0..band.equations()).all(|i| (s[i].max(1e-300) / self.at.s[i]).ln().abs() < CONVERGED);
            self.at.s = [s[0].max(least[0]), s[1].max(least[1])];
            band.weigh(&mut self.at.rows, self.at.s);
            let adapted = adapts && self.adapt_bandwidth();
            if converged && !adapted && gained.is_none_or(|g| g < WORTH) {
                if !(self.is_by_secant && self.problem.exact) {
                    break;
                }
                self.secant = None;
            }
            if gained.is_none() {
                damping = 0.0;
            }
        }
        Some(())
    }

    /// One of Levenberg's steps at the present discrepancy; the gain in log likelihood, if there was one.
    ///
    /// The axis' own parameters, whose bounds and prior are those of logarithms, go straight ahead in their values: what the axis lacks
    /// is linear in them, and the sum of inertias is often known a thousand times better than each. Along a curve of logarithms that
    /// valley would be left after a thousandth of its length.
    fn step(&mut self, damping: &mut f64, begins: bool) -> Option<Option<f64>> {
        let (problem, band) = (self.problem, self.problem.band);
        let x: Vec<f64> = self.coordinates.iter().map(|c| c.x(&self.at.model)).collect();
        let share = self.share();
        let normal = self.normal(&x, share)?;
        let (coordinates, at) = (&self.coordinates, &self.at);
        let cost = |l: &TorqueResidual, s: Discrepancy, x: &[f64]| {
            -band.log_likelihood(l, s) - problem.log_prior(coordinates, x) / share
        };
        let before = cost(&at.rows, at.s, &x);
        let mut held: Vec<bool> = coordinates.iter().map(|c| begins && self.first.holds(c)).collect();
        let (mut next, mut leaves) = (None, false);
        for _ in 0..TRIALS {
            let (delta, errors) = normal.solve(coordinates, &x, *damping, &held)?;
            if self.std.is_empty() || *damping == 0.0 {
                self.std = errors;
            }
            let y: Vec<f64> = (0..x.len()).map(|i| coordinates[i].changed(x[i], delta[i])).collect();
            let model: Model = at.model.at(coordinates, &y);
            if !problem.admits(&model, self.terms) {
                // What leaves physics' bounds stays where it is; the others move without it.
                let alone = |i: usize| problem.admits(&at.model.at(&coordinates[i..=i], &y[i..=i]), self.terms);
                let leaving: Vec<usize> = (0..y.len()).filter(|&i| !held[i] && !alone(i)).collect();
                if leaving.is_empty() {
                    *damping = (10.0 * *damping).max(1e-3);
                }
                for i in leaving {
                    leaves |= matches!(coordinates[i].free, Free::Effect(..));
                    held[i] = true;
                }
                continue;
            }
            let weighed_at = Some(at.rows.weighed_at);
            if let Some((rows, columns)) = problem.rows_with_columns(&model, at.bandwidth, weighed_at) {
                let s = band.rescaled(at.s, &at.model, &model);
                let after = cost(&rows, s, &y);
                if after < before {
                    *damping = if *damping < 2e-4 { 0.0 } else { 0.1 * *damping };
                    next = Some((model, rows, columns, s, before - after, y));
                    break;
                }
            }
            *damping = (10.0 * *damping).max(1e-3);
        }
        self.leaves = leaves;
        // Columns with which no step is better are not brought anywhere.
        let mut secant = self.secant.take();
        Some(next.map(|(model, rows, columns, s, gain, y)| {
            if let Some(secant) = &mut secant {
                let step: Vec<f64> =
                    self.coordinates.iter().zip(&x).zip(&y).map(|((c, x), y)| c.change(*x, *y)).collect();
                secant.follow([&self.at.rows.rows, &rows.rows], &step, normal.a.diagonal().as_slice());
            }
            self.secant = secant;
            self.at = Along { model, rows, columns, s, bandwidth: self.at.bandwidth };
            gain
        }))
    }

    /// Share of the values that count beside what was known of the parameters, as in the evidence; without any effect all do: what the axis
    /// alone explains at its best is what effects are measured by.
    fn share(&self) -> f64 {
        if self.terms.is_empty() || self.problem.nominal.structure == Structure::Rigid {
            1.0
        } else {
            self.problem.band.independent(&self.at.rows, self.at.s)
        }
    }

    /// Normal equations at x, with columns of their own.
    fn normal(&mut self, x: &[f64], share: f64) -> Option<Normal> {
        Some(self.normal_with_growth(x, share)?.0)
    }

    /// The same, and how the density of readings grows with each coordinate at each bin; nothing with those that no stiffness has in it.
    fn normal_with_growth(&mut self, x: &[f64], share: f64) -> Option<(Normal, Vec<Vec<f64>>)> {
        let (problem, band, coordinates, at) = (self.problem, self.problem.band, &self.coordinates, &self.at);
        let secant = match self.secant.take() {
            Some(secant) => {
                self.is_by_secant = true;
                secant.renewed(problem, at, coordinates)?
            }
            None => {
                self.is_by_secant = false;
                Secant::simulated(problem, at, coordinates)?
            }
        };
        self.secant = problem.may_follow().then(|| secant.clone());
        self.columns = secant.columns;
        scaled_with_the_table(band, coordinates, x, &at.rows, &mut self.columns);
        let stiffens = of_the_stiffness(coordinates, x);
        let grows = band.score(&at.model, &at.rows, at.s, &stiffens, &mut self.columns);
        let mut normal = Normal::new(problem, coordinates, x, &self.columns, at, share);
        let mut growth = vec![Vec::new(); x.len()];
        for ((_, _, i), g) in stiffens.iter().zip(grows) {
            normal.g[*i] += g.iter().sum::<f64>();
            growth[*i] = g;
        }
        Some((normal, growth))
    }

    /// Standard error of each free value, in its unit, everything free at once: what a step took them to be held some shapes. With a share of
    /// `independent` values they are as large as the score's scatter over the record and over the band asks.
    pub fn standard_errors(&mut self, independent: f64) -> Option<Vec<f64>> {
        let x: Vec<f64> = self.coordinates.iter().map(|c| c.x(&self.at.model)).collect();
        let share = self.share();
        self.secant = None;
        let (normal, growth) = self.normal_with_growth(&x, share)?;
        let (_, errors) = normal.solve(&self.coordinates, &x, 0.0, &vec![false; x.len()])?;
        let scatter = self.scatter(&normal, &growth);
        let largest = |i: usize| scatter.iter().flatten().map(|of| of[i]).fold(0.0, f64::max);
        let of = |i: usize| errors[i].max(largest(i) * independent.sqrt()) * self.coordinates[i].slope(x[i]);
        Some((0..x.len()).map(of).collect())
    }

    /// The same by how the score scatters between stretches of the record, and between stretches of the band.
    fn scatter(&self, normal: &Normal, growth: &[Vec<f64>]) -> [Option<Vec<f64>>; 2] {
        let (band, at) = (self.problem.band, &self.at);
        let white = |rows: &[Vec<C>; 2]| band.whiten(rows, &at.rows.weights, at.s);
        let columns: Vec<Vec<f64>> = self.columns.iter().map(white).collect();
        let residual = white(&at.rows.rows);
        let series: Vec<scatter::TimeSeries> = columns.iter().map(|c| band.whitened_in_time(c)).collect();
        let per_bin = 2 * band.equations();
        let by_bin = |a: &[f64], b: &[f64]| -> Vec<f64> {
            a.chunks_exact(per_bin).zip(b.chunks_exact(per_bin)).map(|(a, b)| dot(a, b)).collect()
        };
        let information: Vec<Vec<f64>> = columns.iter().map(|c| by_bin(c, c)).collect();
        let mut scores: Vec<Vec<f64>> = columns.iter().map(|c| by_bin(c, &residual)).collect();
        for (score, growth) in scores.iter_mut().zip(growth) {
            score.iter_mut().zip(growth).for_each(|(s, g)| *s -= g);
        }
        [scatter::in_time(&series, &band.whitened_in_time(&residual)), scatter::in_frequency(&scores, &information)]
            .map(|scores| scatter::standard_errors(scores, &normal.a))
    }

    /// Follows the record at another bandwidth where that is likelier: at a looser one, tried once from each, or at that of the discrepancy,
    /// tried once, too.
    fn adapt_bandwidth(&mut self) -> bool {
        let (problem, at) = (self.problem, &mut self.at);
        if problem.is_without_simulation(&at.model) {
            return false;
        }
        let least = problem.loosest(&at.model, &at.rows);
        let own = problem.band.log_likelihood(&at.rows, at.s);
        let looser = looser(at.bandwidth, least);
        let told = problem.bandwidth(at.s);
        let is_new = |known: Option<Bandwidth>, of: Bandwidth| known.is_none_or(|known| differ(known, of));
        let tries = [(is_new(self.tight, at.bandwidth), looser), (is_new(self.passed_by, told), told)];
        for bandwidth in tries.into_iter().filter_map(|(is_new, bandwidth)| is_new.then_some(bandwidth)) {
            let weighed_at = Some(at.rows.weighed_at);
            if differ(bandwidth, at.bandwidth)
                && let Some((rows, columns)) = problem.rows_with_columns(&at.model, bandwidth, weighed_at)
                && problem.band.log_likelihood(&rows, at.s) > own + WORTH
            {
                (at.rows, at.columns, at.bandwidth) = (rows, columns, bandwidth);
                return true;
            }
        }
        (self.tight, self.passed_by) = (Some(at.bandwidth), Some(told));
        false
    }

    /// What each coordinate changes of what the model lacks here.
    pub fn columns(&self) -> Option<Vec<[Vec<C>; 2]>> {
        Some(Secant::simulated(self.problem, &self.at, &self.coordinates)?.columns)
    }

    pub fn done(self) -> Fit {
        let x: Vec<f64> = self.coordinates.iter().map(|c| c.x(&self.at.model)).collect();
        let std = self.std.iter().zip(&self.coordinates).zip(&x).map(|((s, c), x)| s * c.slope(*x)).collect();
        let at_bound = self.leaves || self.stands_for_the_coupling(&x);
        Fit {
            terms: self.terms.to_vec(),
            log_likelihood: self.log_likelihood(),
            log_prior: self.problem.log_prior(&self.coordinates, &x),
            model: self.at.model,
            coordinates: self.coordinates,
            std,
            columns: self.columns,
            discrepancy: self.at.s,
            bandwidth: self.at.bandwidth,
            rows: self.at.rows,
            iterations: self.iterations,
            converged: false,
            at_bound,
        }
    }

    /// Whether a third inertia on a spring is there beside a coupling as stiff as it may be: it is the table, the two inertias are one.
    fn stands_for_the_coupling(&self, x: &[f64]) -> bool {
        let is_stiff = |(c, x): (&Coordinate, &f64)| c.free == Free::Base(BaseParameter::K) && c.is_most(*x);
        self.terms.iter().any(|t| t.0.is_mode()) && self.coordinates.iter().zip(x).any(is_stiff)
    }
}

/// Whether two bandwidths are so unlike that the motion is followed anew.
pub fn differ(a: Bandwidth, b: Bandwidth) -> bool {
    (0..2).any(|i| (a[i] / b[i]).ln().abs() > ANOTHER)
}

/// The next bandwidth below another, down to the least.
pub fn looser(bandwidth: Bandwidth, least: Bandwidth) -> Bandwidth {
    lowered(bandwidth, LOOSER, least)
}

/// A share of a bandwidth, down to the least; one below that stays.
fn lowered(bandwidth: Bandwidth, share: f64, least: Bandwidth) -> Bandwidth {
    [0, 1].map(|i| (share * bandwidth[i]).max(least[i]).min(bandwidth[i]))
}

/// What the stiffness that the equations show has in it, among the coordinates at x: parameters of the axis and of third inertias; which,
/// its slope, its index.
fn of_the_stiffness(coordinates: &[Coordinate], x: &[f64]) -> Vec<(Free, f64, usize)> {
    let is_in_it = |f: Free| match f {
        Free::Base(_) => true,
        Free::Effect(e, _) => e.is_mode(),
        Free::Loop(_) => false,
    };
    let of = |(i, c): (usize, &Coordinate)| is_in_it(c.free).then(|| (c.free, c.slope(x[i]), i));
    coordinates.iter().enumerate().filter_map(of).collect()
}

/// Makes the columns agree on what the table's equation does when all torques in it grow alike: it grows with them (Euler's theorem on
/// homogeneous functions).
///
/// No torque that is known acts on the table: where both sides are measured its equation tells its parameters up to a common factor,
/// as exactly as the encoders read, and the motor's equation alone tells the factor. Columns along the measured motion beside others
/// along the model's own are not exact enough for a step along so narrow a valley: the table's inertia takes what they differ by.
fn scaled_with_the_table(
    band: &Band,
    coordinates: &[Coordinate],
    x: &[f64],
    residual: &TorqueResidual,
    columns: &mut [[Vec<C>; 2]],
) {
    if band.sight != Sight::Both {
        return;
    }
    let of = |i: &usize| coordinates[*i].free == Free::Base(BaseParameter::I2);
    let Some(inertia) = (0..x.len()).find(of) else { return };
    let mut rest = residual.rows[1].clone();
    for i in (0..x.len()).filter(|&i| i != inertia && coordinates[i].scales_with_the_table()) {
        let rate = if coordinates[i].log { 1.0 } else { x[i] };
        for (rest, column) in rest.iter_mut().zip(&columns[i][1]) {
            *rest -= column * rate;
        }
    }
    columns[inertia][1] = rest;
}

/// Normal equations `a*delta = g`.
struct Normal {
    a: DMatrix<f64>,
    g: DVector<f64>,
}

impl Normal {
    /// Of whitened columns, the prior in them.
    fn new(
        problem: &Problem<'_>,
        coordinates: &[Coordinate],
        x: &[f64],
        columns: &[[Vec<C>; 2]],
        at: &Along,
        share: f64,
    ) -> Self {
        let k = coordinates.len();
        let whiten = |rows: &[Vec<C>; 2]| problem.band.whiten(rows, &at.rows.weights, at.s);
        let z = whiten(&at.rows.rows);
        let j: Vec<Vec<f64>> = columns.iter().map(whiten).collect();
        let mut a = DMatrix::from_fn(k, k, |p, q| if p <= q { dot(&j[p], &j[q]) } else { 0.0 });
        a.fill_lower_triangle_with_upper_triangle();
        let mut g = DVector::from_fn(k, |p, _| -dot(&j[p], &z));
        for i in 0..k {
            if let Free::Base(_) = coordinates[i].free {
                a[(i, i)] += 1.0 / (PRIOR * PRIOR * share);
                g[i] -= (x[i] - coordinates[i].x(&problem.nominal)) / (PRIOR * PRIOR * share);
            }
        }
        Self { a, g }
    }

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
                if coordinates[i].log && !coordinates[i].is_base() {
                    delta[i] = delta[i].clamp(-FARTHEST_STEP, FARTHEST_STEP);
                }
                let (at, to) = (&coordinates[i], x[i] + delta[i]);
                if at.is_least(x[i]) && to < at.bounds[0] || at.is_most(x[i]) && to > at.bounds[1] {
                    fixed[i] = true;
                    again = true;
                }
            }
            if !again {
                let farthest = coordinates.iter().zip(&delta).filter(|(c, _)| c.is_base()).map(|(_, d)| d.abs());
                let shorter = FARTHEST_STEP / farthest.fold(FARTHEST_STEP, f64::max);
                delta.iter_mut().for_each(|d| *d *= shorter);
                return Some((delta, std));
            }
        }
    }
}

/// The coordinate of a nominal parameter, its logarithm kept as near to the nominal value's as a data sheet has it.
fn bounded(c: Coordinate, nominal: &Model) -> Coordinate {
    let farthest = match c.free {
        // Where much of the torque is not understood yet, as under a drive's control, an inertia of any size follows the motion.
        Free::Base(BaseParameter::I1 | BaseParameter::I2) => NOMINAL_OFF.ln(),
        Free::Base(BaseParameter::B | BaseParameter::K) => COUPLING_OFF.ln(),
        Free::Effect(..) | Free::Loop(_) => return c,
    };
    let at = c.x(nominal);
    Coordinate { bounds: [at - farthest, at + farthest], ..c }
}
