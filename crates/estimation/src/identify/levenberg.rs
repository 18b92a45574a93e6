//! Bounded nonlinear least squares by Levenberg-Marquardt, on the normal equations.
//!
//! Minimises `cost(p) = |r(p)|^2 / 2`. A step solves `(H + mu*D)*s = -g` on the free parameters, with `H = J'J`,
//! `g = J'r` and `D` the running maximum of H's diagonal (More 1978); a parameter on its bound whose gradient points
//! outward is held. The damping follows Nielsen (1999): it shrinks by the gain ratio and grows by a doubling factor.
//!
//! A problem gives its own normal equations, so that one with a million residuals need not store a Jacobian and one
//! with nuisance parameters (initial states of windows) can eliminate them.
//!
//! Sources: K. Madsen, H. B. Nielsen, O. Tingleff, Methods for non-linear least squares problems, 2nd ed., IMM DTU
//! 2004, algorithm 3.16; J. J. More, The Levenberg-Marquardt algorithm, 1978 (scaling).

use nalgebra::{DMatrix, DVector};
use serde::Serialize;

/// A problem linearised at a point.
#[derive(Debug, Clone, PartialEq)]
pub struct Normal {
    /// `|r|^2 / 2`.
    pub cost: f64,
    /// `J'r`, n.
    pub gradient: DVector<f64>,
    /// `J'J`, n x n.
    pub curvature: DMatrix<f64>,
}

impl Normal {
    /// From residuals r (m) and their Jacobian J (m x n).
    #[must_use]
    pub fn new(residuals: &DVector<f64>, jacobian: &DMatrix<f64>) -> Self {
        Self {
            cost: 0.5 * residuals.norm_squared(),
            gradient: jacobian.tr_mul(residuals),
            curvature: jacobian.tr_mul(jacobian),
        }
    }

    /// Zero, for accumulating row by row.
    #[must_use]
    pub fn zeros(parameters: usize) -> Self {
        Self { cost: 0.0, gradient: DVector::zeros(parameters), curvature: DMatrix::zeros(parameters, parameters) }
    }

    /// Adds one residual and its row of the Jacobian.
    pub fn add(&mut self, residual: f64, row: &[f64]) {
        self.cost += 0.5 * residual * residual;
        for (j, a) in row.iter().enumerate() {
            self.gradient[j] += a * residual;
            for (i, b) in row.iter().enumerate() {
                self.curvature[(i, j)] += a * b;
            }
        }
    }

    fn is_finite(&self) -> bool {
        self.cost.is_finite()
            && self.gradient.iter().all(|v| v.is_finite())
            && self.curvature.iter().all(|v| v.is_finite())
    }
}

/// A nonlinear least-squares problem in n parameters.
pub trait Problem {
    /// `|r(p)|^2 / 2`; None where the model cannot be evaluated.
    fn cost(&self, p: &DVector<f64>) -> Option<f64>;

    /// The normal equations at p; None where the model cannot be evaluated.
    fn linearise(&self, p: &DVector<f64>) -> Option<Normal>;

    /// Called after each accepted step with the iteration, the cost and the parameters.
    fn progress(&self, _iteration: usize, _cost: f64, _p: &DVector<f64>) {}
}

/// When to stop, and where a parameter may go.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// Most linearisations.
    pub iterations: usize,
    /// Stop when the predicted and the actual reduction by a step are both less than this share of the cost.
    pub cost: f64,
    /// Stop when a step is smaller than this share of the parameters (plus the same share of `scale`).
    pub step: f64,
    /// Stop when no parameter's gradient is larger than this times `|r|*|J_j|`: the cosine of their angle.
    pub gradient: f64,
    /// Pairs of a number of steps and a cost: stop when the cost after so many steps is above it.
    pub abort_bounds: Vec<(usize, f64)>,
    /// First damping, relative to the scaled curvature.
    pub damping: f64,
    /// Longest step of each parameter, n; empty: none.
    pub stride: Vec<f64>,
    /// Lower bounds, n; empty: none.
    pub lower: Vec<f64>,
    /// Upper bounds, n; empty: none.
    pub upper: Vec<f64>,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            iterations: 100,
            cost: 1e-12,
            step: 1e-10,
            gradient: 1e-10,
            abort_bounds: Vec::new(),
            damping: 1e-3,
            stride: Vec::new(),
            lower: Vec::new(),
            upper: Vec::new(),
        }
    }
}

/// Why the iteration ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Termination {
    /// The residual is orthogonal to every free column of the Jacobian.
    Gradient,
    /// Steps became smaller than asked.
    Step,
    /// The cost no longer falls.
    Cost,
    /// The cost is zero.
    Exact,
    /// The limit of iterations was reached: the result is the best point so far.
    Iterations,
    /// The cost was above its bound after some steps: [`Options::abort_bounds`].
    #[serde(rename = "hopeless")]
    AbortBound,
    /// No damping makes the cost fall though the gradient is not zero: the derivatives and the cost disagree.
    NoProgress,
    /// The problem could not be evaluated at the start.
    BadStart,
}

impl Termination {
    /// Whether the point is a minimum as far as the tolerances tell.
    #[must_use]
    pub const fn is_converged(self) -> bool {
        matches!(self, Self::Gradient | Self::Step | Self::Cost | Self::Exact)
    }
}

/// What the iteration came to.
#[derive(Debug, Clone, PartialEq)]
pub struct Report {
    /// The best point.
    pub parameters: DVector<f64>,
    /// `|r|^2 / 2` there.
    pub cost: f64,
    /// The normal equations there, as last linearised.
    pub normal: Normal,
    /// Accepted steps.
    pub iterations: usize,
    /// Evaluations of cost and linearisations.
    pub evaluations: usize,
    /// Why it ended.
    pub termination: Termination,
}

impl Report {
    /// Covariance of the parameters, n x n, for residuals of unit variance: `inv(J'J)`, zero for parameters that the
    /// data do not determine at all.
    #[must_use]
    pub fn covariance(&self) -> DMatrix<f64> {
        covariance(&self.normal.curvature).0
    }
}

/// Damping above which a step is much shorter than the Gauss-Newton step.
const HELD_SHORT: f64 = 0.1;
/// Relative eigenvalue below which a direction of the scaled curvature counts as undetermined.
const RANK: f64 = 1e-13;

/// Inverse of a curvature matrix, scaled to unit diagonal first, and the parameters in its null directions.
#[must_use]
pub fn covariance(curvature: &DMatrix<f64>) -> (DMatrix<f64>, Vec<usize>) {
    let n = curvature.nrows();
    if n == 0 {
        return (curvature.clone(), Vec::new());
    }
    let scale = DVector::from_fn(n, |i, _| match curvature[(i, i)] {
        d if d > 0.0 => 1.0 / d.sqrt(),
        _ => 0.0,
    });
    let scaled = DMatrix::from_fn(n, n, |i, j| curvature[(i, j)] * scale[i] * scale[j]);
    let eigen = scaled.symmetric_eigen();
    let largest = eigen.eigenvalues.max().max(f64::MIN_POSITIVE);
    let mut covariance = DMatrix::zeros(n, n);
    let mut null = vec![false; n];
    for (k, &value) in eigen.eigenvalues.iter().enumerate() {
        let vector = eigen.eigenvectors.column(k);
        if value <= RANK * largest {
            for i in 0..n {
                null[i] |= vector[i].abs() > 0.1;
            }
        } else {
            covariance += vector * vector.transpose() / value;
        }
    }
    let covariance = DMatrix::from_fn(n, n, |i, j| covariance[(i, j)] * scale[i] * scale[j]);
    (covariance, (0..n).filter(|i| null[*i]).collect())
}

/// Minimises the problem from `start`, which is moved into the bounds first.
#[must_use]
pub fn minimise<P: Problem + ?Sized>(problem: &P, start: &DVector<f64>, options: &Options) -> Report {
    let n = start.len();
    let lower = |i: usize| options.lower.get(i).copied().unwrap_or(f64::NEG_INFINITY);
    let upper = |i: usize| options.upper.get(i).copied().unwrap_or(f64::INFINITY);
    let mut p = DVector::from_fn(n, |i, _| start[i].max(lower(i)).min(upper(i)));
    let mut evaluations = 1;
    let Some(mut normal) = problem.linearise(&p).filter(Normal::is_finite) else {
        let normal = Normal { cost: f64::INFINITY, ..Normal::zeros(n) };
        let cost = normal.cost;
        return Report { parameters: p, cost, normal, iterations: 0, evaluations, termination: Termination::BadStart };
    };
    let mut scale: DVector<f64> = DVector::zeros(n);
    let (mut damping, mut growth) = (options.damping, 2.0);
    let mut iterations = 0;
    let mut small_steps = 0;
    let termination = loop {
        for i in 0..n {
            scale[i] = scale[i].max(normal.curvature[(i, i)]);
        }
        let free: Vec<usize> = (0..n)
            .filter(|&i| {
                let g = normal.gradient[i];
                scale[i] > 0.0 && !(p[i] <= lower(i) && g > 0.0) && !(p[i] >= upper(i) && g < 0.0)
            })
            .collect();
        let length = (2.0 * normal.cost).sqrt();
        if length == 0.0 {
            break Termination::Exact;
        }
        let cosine = free
            .iter()
            .map(|&i| normal.gradient[i].abs() / (length * normal.curvature[(i, i)].sqrt()).max(f64::MIN_POSITIVE))
            .fold(0.0, f64::max);
        if cosine <= options.gradient {
            break Termination::Gradient;
        }
        if iterations >= options.iterations {
            break Termination::Iterations;
        }
        // Inner loop: raise the damping until a step lowers the cost.
        let outcome = loop {
            if damping > 1e20 {
                break Err(if small_steps > 0 || cosine < 1e-6 { Termination::Cost } else { Termination::NoProgress });
            }
            let Some(step) = step(&normal, &scale, &free, damping) else {
                damping *= growth;
                growth *= 2.0;
                continue;
            };
            let trial = DVector::from_fn(n, |i, _| (p[i] + step[i]).max(lower(i)).min(upper(i)));
            let moved = &trial - &p;
            if options.stride.iter().zip(moved.iter()).any(|(most, moved)| moved.abs() > *most) {
                damping *= growth;
                growth *= 2.0;
                continue;
            }
            let small = (0..n).all(|i| moved[i].abs() <= options.step * (p[i].abs() + options.step));
            let predicted = -(normal.gradient.dot(&moved) + 0.5 * moved.dot(&(&normal.curvature * &moved)));
            if small {
                break Err(Termination::Step);
            }
            evaluations += 1;
            let cost = problem.cost(&trial).filter(|c| c.is_finite()).unwrap_or(f64::INFINITY);
            let reduction = normal.cost - cost;
            if reduction > 0.0 && predicted > 0.0 {
                let gain = reduction / predicted;
                damping = (damping * (1.0 - (2.0 * gain - 1.0).powi(3)).max(1.0 / 3.0)).max(1e-15);
                growth = 2.0;
                break Ok((trial, reduction, predicted));
            }
            // Neither better nor worse than rounding: this is the bottom.
            if predicted <= options.cost * normal.cost && reduction.abs() <= 1e-10 * normal.cost {
                break Err(Termination::Cost);
            }
            damping *= growth;
            growth *= 2.0;
        };
        match outcome {
            Err(end) => break end,
            Ok((trial, reduction, predicted)) => {
                evaluations += 1;
                let before = normal.cost;
                let Some(next) = problem.linearise(&trial).filter(Normal::is_finite) else {
                    break Termination::NoProgress;
                };
                p = trial;
                normal = next;
                iterations += 1;
                problem.progress(iterations, normal.cost, &p);
                if options.abort_bounds.iter().any(|(steps, bar)| iterations == *steps && normal.cost > *bar) {
                    break Termination::AbortBound;
                }
                // A step that is short because of the damping has a small predicted reduction anywhere.
                let small = reduction.max(predicted) <= options.cost * before && damping <= HELD_SHORT;
                small_steps = if small { small_steps + 1 } else { 0 };
                if small_steps >= 2 {
                    break Termination::Cost;
                }
            }
        }
    };
    let cost = normal.cost;
    Report { parameters: p, cost, normal, iterations, evaluations, termination }
}

/// The damped step on the free parameters, zero on the others; None where the system is singular.
fn step(normal: &Normal, scale: &DVector<f64>, free: &[usize], damping: f64) -> Option<DVector<f64>> {
    let root = |k: usize| scale[free[k]].sqrt();
    let m = free.len();
    let mut matrix = DMatrix::from_fn(m, m, |i, j| normal.curvature[(free[i], free[j])] / (root(i) * root(j)));
    for i in 0..m {
        matrix[(i, i)] += damping;
    }
    let right = DVector::from_fn(m, |i, _| -normal.gradient[free[i]] / root(i));
    let solved = matrix.cholesky()?.solve(&right);
    let mut step = DVector::zeros(scale.len());
    for i in 0..m {
        step[free[i]] = solved[i] / root(i);
    }
    step.iter().all(|v| v.is_finite()).then_some(step)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A problem by residuals and Jacobian.
    struct Dense<F>(F);
    impl<F: Fn(&DVector<f64>) -> Evaluated> Problem for Dense<F> {
        fn cost(&self, p: &DVector<f64>) -> Option<f64> {
            Some(0.5 * (self.0)(p).0.norm_squared())
        }
        fn linearise(&self, p: &DVector<f64>) -> Option<Normal> {
            let (r, j) = (self.0)(p);
            Some(Normal::new(&r, &j))
        }
    }

    type Evaluated = (DVector<f64>, DMatrix<f64>);

    fn rosenbrock() -> Dense<fn(&DVector<f64>) -> Evaluated> {
        Dense(|p| {
            (
                DVector::from_vec(vec![10.0 * (p[1] - p[0] * p[0]), 1.0 - p[0]]),
                DMatrix::from_row_slice(2, 2, &[-20.0 * p[0], 10.0, -1.0, 0.0]),
            )
        })
    }

    #[test]
    fn rosenbrocks_valley_is_followed_to_its_minimum() {
        let report = minimise(&rosenbrock(), &DVector::from_vec(vec![-1.2, 1.0]), &Options::default());
        assert!(report.termination.is_converged(), "{report:?}");
        assert!((report.parameters[0] - 1.0).abs() < 1e-8 && (report.parameters[1] - 1.0).abs() < 1e-8, "{report:?}");
        // A count, so that a regression of the damping rule shows; MINPACK lmder takes 16 to 21 on this start.
        assert!(report.iterations <= 25, "{}", report.iterations);
    }

    #[test]
    fn a_fit_that_stays_above_its_bar_is_given_up_and_one_below_it_goes_on() {
        let start = DVector::from_vec(vec![-1.2, 1.0]);
        let after_two = |bar: f64| {
            minimise(
                &rosenbrock(),
                &start,
                &Options { abort_bounds: vec![(1, f64::INFINITY), (2, bar)], ..Options::default() },
            )
        };
        // Rosenbrock's cost at the start is 12.1; the valley is reached in a step, its end in some fifteen.
        let given_up = after_two(1e-3);
        assert_eq!((given_up.termination, given_up.iterations), (Termination::AbortBound, 2));
        assert!(given_up.cost < 12.1 && !given_up.termination.is_converged());
        assert!(after_two(12.1).termination.is_converged());
    }

    #[test]
    fn a_bound_holds_and_the_minimum_on_it_is_found() {
        let options = Options { upper: vec![0.5, f64::INFINITY], ..Options::default() };
        let report = minimise(&rosenbrock(), &DVector::from_vec(vec![-1.2, 1.0]), &options);
        // On p0 = 1/2 the minimum is p1 = 1/4 with cost (1/2)^2/2.
        assert!(report.termination.is_converged(), "{report:?}");
        assert_eq!(report.parameters[0], 0.5);
        assert!((report.parameters[1] - 0.25).abs() < 1e-8);
        assert!((report.cost - 0.125).abs() < 1e-12);
    }

    #[test]
    fn powells_singular_function_comes_to_its_rank_deficient_minimum() {
        let problem = Dense(|p: &DVector<f64>| {
            let (a, b, c, d) = (p[0], p[1], p[2], p[3]);
            let (s5, s10) = (5f64.sqrt(), 10f64.sqrt());
            (
                DVector::from_vec(vec![a + 10.0 * b, s5 * (c - d), (b - 2.0 * c).powi(2), s10 * (a - d).powi(2)]),
                DMatrix::from_row_slice(
                    4,
                    4,
                    &[
                        1.0,
                        10.0,
                        0.0,
                        0.0, //
                        0.0,
                        0.0,
                        s5,
                        -s5, //
                        0.0,
                        2.0 * (b - 2.0 * c),
                        -4.0 * (b - 2.0 * c),
                        0.0, //
                        2.0 * s10 * (a - d),
                        0.0,
                        0.0,
                        -2.0 * s10 * (a - d),
                    ],
                ),
            )
        });
        let report = minimise(&problem, &DVector::from_vec(vec![3.0, -1.0, 0.0, 1.0]), &Options::default());
        assert!(report.cost < 1e-18, "{report:?}");
    }

    #[test]
    fn an_undetermined_parameter_is_left_alone_and_named() {
        let problem = Dense(|p: &DVector<f64>| {
            let r = DVector::from_vec(vec![p[0] - 2.0, 2.0 * (p[0] - 2.0) + 0.1]);
            (r, DMatrix::from_row_slice(2, 2, &[1.0, 0.0, 2.0, 0.0]))
        });
        let report = minimise(&problem, &DVector::from_vec(vec![0.0, 7.0]), &Options::default());
        assert!(report.termination.is_converged());
        assert_eq!(report.parameters[1], 7.0);
        assert_eq!(covariance(&report.normal.curvature).1, [1]);
        // min (x-2)^2 + (2(x-2)+0.1)^2: x - 2 = -0.2/5; variance 1/(1 + 4).
        assert!((report.parameters[0] - 1.96).abs() < 1e-9);
        assert!((report.covariance()[(0, 0)] - 0.2).abs() < 1e-12);
    }

    #[test]
    fn a_start_that_cannot_be_evaluated_is_reported_as_such() {
        let problem = Dense(|_: &DVector<f64>| (DVector::from_vec(vec![f64::NAN]), DMatrix::from_element(1, 1, 1.0)));
        let report = minimise(&problem, &DVector::from_vec(vec![0.0]), &Options::default());
        assert_eq!(report.termination, Termination::BadStart);
    }
}
