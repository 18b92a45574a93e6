//! Output error: the simulation that follows the measured outputs best.
//!
//! ```text
//! min over p, x0 (, offset, bias) of sum over outputs and samples ((y - simulate(p, x0, T + bias))/sigma)^2
//! ```
//!
//! by Levenberg-Marquardt over `ln I1, ln I2, B, ln K` and the initial state, with the exact derivatives of the
//! simulation (forward-mode dual numbers). The offset (of the encoders' zeros) and the bias (of the torque) join where
//! they are asked for. The weights are the residuals' own levels, found by repeating the fit.
//!
//! Source: L. Ljung, System Identification, 2nd ed., 7.4 (prediction error with an output-error model); paper eq. 2.

mod coloured;

use std::borrow::Cow;

use nalgebra::{DVector, Matrix4, Vector4};

use super::levenberg::{self, Normal, Problem, Termination};
use super::lsq::triangularise;
use super::parameters::Estimated;
use super::statistics::{noise_level, rms};
use crate::axis::{Parameters, Response, Scheme, SimulateOptions, Structure, simulate, substeps};
use crate::effects::{Reading, Settings};
use crate::scalar::{Dual, Scalar};
use crate::trace::{Signal, Trace, TraceError};

/// Parameters and initial state: what the simulation is derived to.
const DERIVED: usize = 8;
/// And the two that enter linearly: offset of theta2, bias of the torque.
const ALL: usize = DERIVED + 2;
const OFFSET: usize = 8;
const BIAS: usize = 9;
/// Most steps of one fit.
const ITERATIONS: usize = 60;
/// Rounds of weighing.
const ROUNDS: usize = 3;

/// What a simulation is compared with.
#[derive(Debug, Clone)]
pub struct OutputError<'a> {
    torque: &'a [f64],
    /// The measured outputs, each with its column of a reading (theta1, omega1, theta2, omega2).
    outputs: Vec<(Signal, usize, Cow<'a, [f64]>)>,
    options: SimulateOptions,
    effects: Settings,
    structure: Structure,
    rho: f64,
    sigma: Vec<f64>,
    /// Unit of B, so that it may be zero or change sign on the way.
    damping_unit: f64,
    free: [bool; ALL],
    /// Fixed values of what is not free.
    fixed: [f64; ALL],
}

/// Which unknowns are fitted beside the initial state.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Free {
    /// I1, I2, B, K.
    pub parameters: bool,
    /// A constant difference of the encoders' zeros.
    pub offset: bool,
    /// A constant torque.
    pub bias: bool,
}

/// What the fit came to.
#[derive(Debug, Clone)]
pub struct Fit {
    /// I1, I2, B, K with their covariance.
    pub estimated: Estimated,
    /// theta1, omega1, theta2, omega2 at the first sample.
    pub initial: [f64; 4],
    /// Offset of theta2, rad.
    pub offset: f64,
    /// Constant torque, N.m.
    pub bias: f64,
    /// Weighted sum of squares over its degrees of freedom, before the last re-weighting; its square root is in `sigma`.
    pub chi2: f64,
    /// Weighted sum of squares at the weights given.
    pub cost: f64,
    /// Level of the residual of each output.
    pub sigma: Vec<f64>,
    /// How it ended.
    pub termination: Termination,
    /// Steps taken.
    pub iterations: usize,
    /// The integration.
    pub scheme: Scheme,
}

const fn column(signal: Signal) -> Option<usize> {
    match signal {
        Signal::Theta1 => Some(0),
        Signal::Omega1 => Some(1),
        Signal::Theta2 | Signal::X2 => Some(2),
        Signal::Omega2 => Some(3),
        _ => None,
    }
}

fn pick<S: Scalar>(r: &Reading<S>, column: usize) -> S {
    [r.theta1, r.omega1, r.theta2, r.omega2][column]
}

impl<'a> OutputError<'a> {
    /// Takes the torque and every measured angle and speed of a trace; accelerations are left out, since a position
    /// says more. The weights begin at the measured noise.
    ///
    /// # Errors
    /// When the torque or any output is missing.
    pub fn new(trace: &'a Trace, rho: f64, structure: Structure, effects: Settings) -> Result<Self, TraceError> {
        let torque = trace.require(Signal::T)?;
        let mut outputs = Vec::new();
        for signal in [Signal::Theta1, Signal::Omega1, Signal::Theta2, Signal::Omega2] {
            if let (Some(values), Some(c)) = (trace.get(signal), column(signal)) {
                outputs.push((signal, c, Cow::Borrowed(values)));
            }
        }
        if !trace.has(Signal::Theta2)
            && rho != 0.0
            && let Some(x2) = trace.get(Signal::X2)
        {
            outputs.push((Signal::X2, 2, Cow::Owned(x2.iter().map(|x| x / rho).collect())));
        }
        if outputs.is_empty() {
            trace.require(Signal::Theta1)?;
        }
        let sigma = outputs.iter().map(|(_, _, v)| level(noise_level(v), v)).collect();
        let options =
            SimulateOptions { start: trace.start, dt: trace.dt, hold: trace.hold, scheme: Scheme::Exact, substeps: 1 };
        Ok(Self {
            torque,
            outputs,
            options,
            effects,
            structure,
            rho,
            sigma,
            damping_unit: 1.0,
            free: [true; ALL],
            fixed: [0.0; ALL],
        })
    }

    /// The measured outputs.
    pub fn outputs(&self) -> impl Iterator<Item = (Signal, &[f64])> {
        self.outputs.iter().map(|(s, _, v)| (*s, v.as_ref()))
    }

    /// Overrides the weights with known noise levels, one an output.
    pub fn weigh(&mut self, sigma: &[f64]) {
        self.sigma = sigma.to_vec();
    }

    /// Measured first sample as a starting point for the initial state.
    fn first_state(&self) -> [f64; 4] {
        let mut state = [0.0; 4];
        let mut known = [false; 4];
        for (_, c, v) in &self.outputs {
            state[*c] = v[0];
            known[*c] = true;
        }
        for (position, speed) in [(0, 1), (2, 3)] {
            let values = self.outputs.iter().find(|(_, c, _)| *c == position).map(|(_, _, v)| v);
            if let (false, Some(v)) = (known[speed], values) {
                // Over a few samples, so that noise does not make it large.
                let span = 8.min(v.len() - 1);
                state[speed] = (v[span] - v[0]) / (span as f64 * self.options.dt);
            }
        }
        if !known[2] {
            (state[2], state[3]) = (state[0], state[1]);
        }
        if !known[0] {
            (state[0], state[1]) = (state[2], state[3]);
        }
        state
    }

    /// Fits from `start` under one integration scheme; weights are re-found from the residuals.
    #[must_use]
    pub fn fit(&self, start: &Parameters, scheme: Scheme, free: Free) -> Fit {
        let mut problem = self.clone();
        problem.options.scheme = scheme;
        problem.options.substeps = substeps(start, self.structure, &self.effects, self.options.dt);
        let mobility = 1.0 / start.i1 + 1.0 / start.i2;
        // Two per cent of critical damping as the unit where the start has none.
        problem.damping_unit = if start.b > 0.0 { start.b } else { 0.04 * (start.k / mobility).sqrt() };
        for i in 0..4 {
            problem.free[i] = free.parameters;
        }
        let rigid = self.structure == Structure::Rigid;
        if rigid {
            // One inertia: nothing of the coupling, and no motion of the table of its own.
            for i in [1, 2, 3, 6, 7] {
                problem.free[i] = false;
            }
        }
        problem.free[OFFSET] = free.offset;
        problem.free[BIAS] = free.bias;
        let x0 = self.first_state();
        let log = |v: f64| if v > 0.0 { v.ln() } else { -700.0 };
        let p = [log(start.i1), log(start.i2), start.b / problem.damping_unit, log(start.k)];
        let mut q: [f64; ALL] = [p[0], p[1], p[2], p[3], x0[0], x0[1], x0[2], x0[3], 0.0, 0.0];
        let mut fixed = q;
        fixed[OFFSET] = 0.0;
        fixed[BIAS] = 0.0;
        problem.fixed = fixed;

        // First what enters linearly, so that the parameters do not run off to mend a wrong initial state.
        let linear = self.effects.active().motion_is_linear();
        if linear {
            problem.solve_state(&mut q);
            if !free.parameters {
                // Nothing else is free, and the linear solution is the whole fit.
                for _ in 0..ROUNDS {
                    problem.sigma = problem.levels(&q);
                    problem.solve_state(&mut q);
                }
                problem.sigma = problem.levels(&q);
                let normal = Normal { cost: 0.5 * problem.degrees(), ..Normal::zeros(0) };
                let report = levenberg::Report {
                    parameters: DVector::zeros(0),
                    cost: normal.cost,
                    normal,
                    iterations: 1,
                    evaluations: 1,
                    termination: Termination::Gradient,
                };
                return problem.finish(&q, &report, 1.0, scheme);
            }
        } else if free.parameters {
            let mut state_only = problem.clone();
            for i in 0..4 {
                state_only.free[i] = false;
            }
            q = state_only.run(&q, 20).0;
        }
        let mut report = problem.run(&q, ITERATIONS);
        let mut chi2 = 1.0;
        for _ in 0..ROUNDS {
            let sigma = problem.levels(&report.0);
            chi2 = 2.0 * report.1.cost / problem.degrees();
            let settled = sigma.iter().zip(&problem.sigma).all(|(a, b)| (a / b - 1.0).abs() < 1e-3);
            problem.sigma = sigma;
            report = problem.run(&report.0, ITERATIONS);
            if settled {
                break;
            }
        }
        problem.finish(&report.0, &report.1, chi2, scheme)
    }

    /// Fits with the weights as given and no re-weighting: the covariance is for those weights.
    #[must_use]
    pub fn fit_weighted(&self, start: &Parameters, scheme: Scheme, free: Free) -> Fit {
        let mut problem = self.clone();
        problem.options.scheme = scheme;
        problem.damping_unit = if start.b > 0.0 { start.b } else { 1.0 };
        problem.free[OFFSET] = free.offset;
        problem.free[BIAS] = free.bias;
        let x0 = self.first_state();
        let p = [start.i1.ln(), start.i2.ln(), start.b / problem.damping_unit, start.k.ln()];
        let mut q = [p[0], p[1], p[2], p[3], x0[0], x0[1], x0[2], x0[3], 0.0, 0.0];
        // Speeds from positions alone are poor: the linear part first. A second start clears what damping the first
        // has gathered in the valley that I2, B and K share.
        problem.solve_state(&mut q);
        let first = problem.run(&q, ITERATIONS);
        let mut q = first.0;
        problem.solve_state(&mut q);
        let report = problem.run(&q, ITERATIONS);
        problem.finish(&report.0, &report.1, 1.0, scheme)
    }

    /// The initial state, offset and bias that fit best with the parameters as they are: on a linear axis the outputs
    /// are linear in them. Unknowns that the outputs do not determine keep their values.
    fn solve_state(&self, q: &mut [f64; ALL]) {
        let unknowns: Vec<usize> = (4..ALL).filter(|i| self.free[*i]).collect();
        if unknowns.is_empty() {
            return;
        }
        let p: Parameters = self.axis(&q[..DERIVED]);
        let n = self.torque.len();
        let run = |initial: [f64; 4], torque: &[f64]| {
            simulate(&p, self.structure, &Settings::default(), initial, torque, &self.options)
        };
        let rest = vec![0.0; n];
        let mut base = *q;
        for i in &unknowns {
            base[*i] = 0.0;
        }
        let bias = base[BIAS];
        let torque: Vec<f64> = self.torque.iter().map(|t| t + bias).collect();
        let forced = run([base[4], base[5], base[6], base[7]], &torque);
        let columns: Vec<Option<Response>> = unknowns
            .iter()
            .map(|i| match *i {
                OFFSET => None,
                BIAS => Some(run([0.0; 4], &vec![1.0; n])),
                i => {
                    let mut unit = [0.0; 4];
                    unit[i - 4] = 1.0;
                    Some(run(unit, &rest))
                }
            })
            .collect();
        let width = unknowns.len();
        let outputs = &self.outputs;
        let triangle = triangularise(n * outputs.len(), width, 1, |row, out| {
            let (channel, k) = (row % outputs.len(), row / outputs.len());
            let (_, c, measured) = &outputs[channel];
            let weight = 1.0 / self.sigma[channel];
            for (out, column) in out.iter_mut().zip(&columns) {
                *out = weight
                    * match column {
                        Some(response) => pick(&response.readings[k], *c),
                        None => f64::from(u8::from(*c == 2)),
                    };
            }
            let offset = if *c == 2 { base[OFFSET] } else { 0.0 };
            out[width] = weight * (measured[k] - pick(&forced.readings[k], *c) - offset);
        });
        if let Ok(solution) = triangle.solve() {
            for (j, i) in unknowns.iter().enumerate() {
                q[*i] = solution.phi[(j, 0)];
            }
        }
    }

    fn degrees(&self) -> f64 {
        let unknowns = self.free.iter().filter(|f| **f).count();
        ((self.torque.len() * self.outputs.len()) as f64 - unknowns as f64).max(1.0)
    }

    fn run(&self, q: &[f64; ALL], iterations: usize) -> ([f64; ALL], levenberg::Report) {
        let free: Vec<usize> = (0..ALL).filter(|i| self.free[*i]).collect();
        let start = DVector::from_iterator(free.len(), free.iter().map(|i| q[*i]));
        let mut lower = vec![f64::NEG_INFINITY; free.len()];
        for (bound, i) in lower.iter_mut().zip(&free) {
            if *i == 2 {
                *bound = 0.0;
            }
        }
        // Parameters in logarithms: a step of more than a factor e^3 from the start is a fit gone astray.
        let options = levenberg::Options { iterations, lower, ..levenberg::Options::default() };
        let mut fixed = self.clone();
        fixed.fixed = *q;
        let report = levenberg::minimise(&fixed, &start, &options);
        (fixed.expand(&report.parameters), report)
    }

    /// All unknowns from the free ones.
    fn expand(&self, q: &DVector<f64>) -> [f64; ALL] {
        let mut all = self.fixed;
        let mut next = q.iter();
        for (value, free) in all.iter_mut().zip(self.free) {
            if free && let Some(v) = next.next() {
                *value = *v;
            }
        }
        all
    }

    fn axis<S: Scalar>(&self, q: &[S]) -> Parameters<S> {
        Parameters {
            i1: q[0].exp(),
            i2: if self.structure == Structure::Rigid { S::from(0.0) } else { q[1].exp() },
            b: q[2] * self.damping_unit,
            k: q[3].exp(),
            rho: S::from(self.rho),
        }
    }

    fn respond<S: Scalar>(&self, q: &[S], bias: f64) -> Response<S> {
        let torque: Cow<[f64]> = if bias == 0.0 {
            Cow::Borrowed(self.torque)
        } else {
            Cow::Owned(self.torque.iter().map(|t| t + bias).collect())
        };
        let initial = [q[4], q[5], q[6], q[7]];
        simulate(&self.axis(q), self.structure, &Settings::lift(&self.effects), initial, &torque, &self.options)
    }

    /// Measured minus simulated, one vector an output.
    #[must_use]
    pub fn residuals(&self, fit: &Fit) -> Vec<(Signal, Vec<f64>)> {
        let mut problem = self.clone();
        problem.options.scheme = fit.scheme;
        let p = fit.estimated.parameters(self.rho);
        problem.options.substeps = substeps(&p, self.structure, &self.effects, self.options.dt);
        let torque: Vec<f64> = self.torque.iter().map(|t| t + fit.bias).collect();
        let response = simulate(&p, self.structure, &self.effects, fit.initial, &torque, &problem.options);
        self.outputs
            .iter()
            .map(|(signal, c, measured)| {
                let offset = if *c == 2 { fit.offset } else { 0.0 };
                let values = measured.iter().zip(&response.readings).map(|(y, r)| y - pick(r, *c) - offset).collect();
                (*signal, values)
            })
            .collect()
    }

    fn levels(&self, q: &[f64; ALL]) -> Vec<f64> {
        let response = self.respond(&q[..DERIVED], q[BIAS]);
        self.outputs
            .iter()
            .map(|(_, c, measured)| {
                let offset = if *c == 2 { q[OFFSET] } else { 0.0 };
                let r: Vec<f64> =
                    measured.iter().zip(&response.readings).map(|(y, r)| y - pick(r, *c) - offset).collect();
                level(rms(&r), measured)
            })
            .collect()
    }

    fn finish(&self, q: &[f64; ALL], report: &levenberg::Report, chi2: f64, scheme: Scheme) -> Fit {
        let p: Parameters = self.axis(&q[..DERIVED]);
        let relative = report.covariance();
        let free: Vec<usize> = (0..ALL).filter(|i| self.free[*i]).collect();
        let unit = [p.i1, p.i2, self.damping_unit, p.k];
        let mut covariance = Matrix4::zeros();
        for (a, i) in free.iter().enumerate().filter(|(_, i)| **i < 4) {
            for (b, j) in free.iter().enumerate().filter(|(_, j)| **j < 4) {
                covariance[(*i, *j)] = relative[(a, b)] * unit[*i] * unit[*j];
            }
        }
        Fit {
            estimated: Estimated {
                values: Vector4::new(p.i1, p.i2, p.b, p.k),
                covariance: self.free[0].then_some(covariance),
            },
            initial: [q[4], q[5], q[6], q[7]],
            offset: q[OFFSET],
            bias: q[BIAS],
            chi2,
            cost: report.cost,
            sigma: self.sigma.clone(),
            termination: report.termination,
            iterations: report.iterations,
            scheme,
        }
    }
}

/// A level of noise kept above what rounding leaves of the signal.
fn level(sigma: f64, values: &[f64]) -> f64 {
    sigma.max(1e-13 * rms(values)).max(f64::MIN_POSITIVE.sqrt())
}

impl Problem for OutputError<'_> {
    fn cost(&self, q: &DVector<f64>) -> Option<f64> {
        let q = self.expand(q);
        let response = self.respond(&q[..DERIVED], q[BIAS]);
        let mut sum = 0.0;
        for ((_, c, measured), sigma) in self.outputs.iter().zip(&self.sigma) {
            let offset = if *c == 2 { q[OFFSET] } else { 0.0 };
            for (y, r) in measured.iter().zip(&response.readings) {
                sum += ((y - pick(r, *c) - offset) / sigma).powi(2);
            }
        }
        sum.is_finite().then_some(0.5 * sum)
    }

    fn linearise(&self, q: &DVector<f64>) -> Option<Normal> {
        let q = self.expand(q);
        let dual: [Dual<DERIVED>; DERIVED] = std::array::from_fn(|i| Dual::variable(q[i], i));
        let response = self.respond(&dual, q[BIAS]);
        // The response to a constant torque: the derivative to the bias, exact for the linear axis.
        let step = self.free[BIAS].then(|| {
            let p: Parameters = self.axis(&q[..DERIVED]);
            let ones = vec![1.0; self.torque.len()];
            simulate(&p, self.structure, &Settings::default(), [0.0; 4], &ones, &self.options)
        });
        let free: Vec<usize> = (0..ALL).filter(|i| self.free[*i]).collect();
        let mut normal = Normal::zeros(free.len());
        let mut row = vec![0.0; free.len()];
        for ((_, c, measured), sigma) in self.outputs.iter().zip(&self.sigma) {
            let offset = if *c == 2 { q[OFFSET] } else { 0.0 };
            for (k, (y, reading)) in measured.iter().zip(&response.readings).enumerate() {
                let value = pick(reading, *c);
                for (out, i) in row.iter_mut().zip(&free) {
                    let derivative = match *i {
                        OFFSET => f64::from(u8::from(*c == 2)),
                        BIAS => step.as_ref().map_or(0.0, |s| pick(&s.readings[k], *c)),
                        i => value.eps[i],
                    };
                    *out = -derivative / sigma;
                }
                normal.add((y - value.re - offset) / sigma, &row);
            }
        }
        Some(normal)
    }
}
