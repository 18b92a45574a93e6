//! Output error: the simulation that follows the measured outputs best.
//!
//! ```text
//! min over p, x0 (, offset, bias) of sum over outputs and samples ((y - simulate(p, x0, T + bias))/sigma)^2
//! ```
//!
//! by Levenberg-Marquardt over `ln I1, ln I2, B, ln K` and the initial state, with the exact derivatives of the
//! simulation (forward-mode dual numbers). The offset (of the encoders' zeros) and the bias (of the torque) join where
//! they are asked for. The weights are the residuals' own levels, found by repeating the fit. A record in pieces is
//! simulated piece by piece: each has an initial state and an offset of its own, the parameters and the bias are common.
//!
//! Source: L. Ljung, System Identification, 2nd ed., 7.4 (prediction error with an output-error model); paper eq. 2.

mod coloured;
mod linear;

use std::borrow::Cow;
use std::ops::Range;

use nalgebra::{DVector, Matrix4, Vector4};

use super::joined::{Joined, noise_in_pieces};
use super::levenberg::{self, Normal, Problem, Termination};
use super::parameters::Estimated;
use crate::axis::{Parameters, Response, Scheme, SimulateOptions, Structure, simulate, substeps};
use crate::effects::{Reading, Settings};
use crate::numerics::level::rms;
use crate::scalar::{Dual, Scalar};
use crate::trace::{Signal, Trace, TraceError};

/// Number of quantities that the simulation of a piece is differentiated by: the parameters and the initial state.
const DERIVED: usize = 8;
/// Number of parameters: I1, I2, B, K.
const PARAMETERS: usize = 4;
/// Index of the torque's bias among the unknowns: after the parameters, before the unknowns of each piece.
const BIAS: usize = PARAMETERS;
/// Number of unknowns of each piece: its initial state and its offset of theta2.
const OWN: usize = 5;
/// Index of the first piece's first unknown.
const FIRST: usize = BIAS + 1;
/// Most Levenberg-Marquardt steps of one fit.
const ITERATIONS: usize = 60;
/// Most rounds of re-weighting.
const ROUNDS: usize = 3;

/// The problem of output error: the torque, the measured outputs, and the weights and unknowns of the fit.
#[derive(Debug, Clone)]
pub struct OutputError<'a> {
    /// N.m, one value a sample.
    torque: &'a [f64],
    /// The measured outputs (rad, rad/s), each with its column of a reading (theta1, omega1, theta2, omega2).
    outputs: Vec<(Signal, usize, Cow<'a, [f64]>)>,
    /// Samples of each piece.
    pieces: Vec<Range<usize>>,
    /// Time of each piece's first sample, s.
    starts: Vec<f64>,
    options: SimulateOptions,
    effects: Settings,
    structure: Structure,
    /// Travel of the table per angle, m/rad.
    rho: f64,
    /// Level of each output's residual, in the output's unit: the weight is `1/sigma^2`.
    sigma: Vec<f64>,
    /// B is fitted in multiples of this, N.m.s/rad, and not as a logarithm: it may be zero.
    damping_unit: f64,
    /// Which unknowns are fitted: the parameters, the bias, then state and offset of each piece.
    free: Vec<bool>,
    /// Values of the unknowns that are not fitted.
    fixed: Vec<f64>,
}

/// Which unknowns are fitted in addition to the initial state.
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
pub struct OutputErrorFit {
    /// I1, I2, B, K with their covariance.
    pub estimated: Estimated,
    /// theta1, omega1, theta2, omega2 at the first sample of each piece.
    pub initial: Vec<[f64; 4]>,
    /// Offset of theta2 in each piece, rad.
    pub offset: Vec<f64>,
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

/// The column of a reading that a signal is measured by: theta1, omega1, theta2, omega2.
const fn column(signal: Signal) -> Option<usize> {
    match signal {
        Signal::Theta1 => Some(0),
        Signal::Omega1 => Some(1),
        Signal::Theta2 | Signal::X2 => Some(2),
        Signal::Omega2 => Some(3),
        _ => None,
    }
}

/// The value in a column of a reading, rad or rad/s.
fn pick<S: Scalar>(r: &Reading<S>, column: usize) -> S {
    [r.theta1, r.omega1, r.theta2, r.omega2][column]
}

/// Index of an unknown of a piece: 0 to 3 its initial state, 4 its offset.
const fn own(piece: usize, unknown: usize) -> usize {
    FIRST + piece * OWN + unknown
}

impl<'a> OutputError<'a> {
    /// Takes the torque and every measured angle and speed of a trace (SI units); `rho` (m/rad) turns x2 into theta2 where only x2 is
    /// measured. Accelerations are left out: they add little to the positions. The first weights are those of the measured noise.
    ///
    /// # Errors
    /// When the torque or any output is missing.
    pub fn new(trace: &'a Trace, rho: f64, structure: Structure, effects: Settings) -> Result<Self, TraceError> {
        Self::in_pieces(trace, std::iter::once(0..trace.len()).collect(), vec![trace.start], rho, structure, effects)
    }

    /// The same with another torque, N.m, one value a sample.
    #[must_use]
    pub fn driven_by(&self, torque: &'a [f64]) -> Self {
        Self { torque, ..self.clone() }
    }

    /// Takes a record in pieces, see [`OutputError::new`].
    ///
    /// # Errors
    /// As [`OutputError::new`].
    pub fn of(joined: &'a Joined, rho: f64, structure: Structure, effects: Settings) -> Result<Self, TraceError> {
        let (pieces, starts) = (joined.pieces().to_vec(), joined.starts().to_vec());
        Self::in_pieces(joined.samples(), pieces, starts, rho, structure, effects)
    }

    fn in_pieces(
        trace: &'a Trace,
        pieces: Vec<Range<usize>>,
        starts: Vec<f64>,
        rho: f64,
        structure: Structure,
        effects: Settings,
    ) -> Result<Self, TraceError> {
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
        let sigma = outputs.iter().map(|(_, _, v)| level(noise_in_pieces(v, &pieces), v)).collect();
        let options =
            SimulateOptions { start: trace.start, dt: trace.dt, hold: trace.hold, scheme: Scheme::Exact, substeps: 1 };
        let unknowns = own(pieces.len(), 0);
        Ok(Self {
            torque,
            outputs,
            pieces,
            starts,
            options,
            effects,
            structure,
            rho,
            sigma,
            damping_unit: 1.0,
            free: vec![true; unknowns],
            fixed: vec![0.0; unknowns],
        })
    }

    /// The measured outputs.
    pub fn outputs(&self) -> impl Iterator<Item = (Signal, &[f64])> {
        self.outputs.iter().map(|(s, _, v)| (*s, v.as_ref()))
    }

    /// Overrides the weights with known noise levels, one for each output, in its unit.
    #[cfg(test)]
    pub(super) fn weigh(&mut self, sigma: &[f64]) {
        self.sigma = sigma.to_vec();
    }

    /// Start for the initial state of a piece, rad and rad/s: its first measured sample.
    fn first_state(&self, piece: &Range<usize>) -> [f64; 4] {
        let mut state = [0.0; 4];
        let mut known = [false; 4];
        for (_, c, v) in &self.outputs {
            state[*c] = v[piece.start];
            known[*c] = true;
        }
        for (position, speed) in [(0, 1), (2, 3)] {
            let values = self.outputs.iter().find(|(_, c, _)| *c == position).map(|(_, _, v)| v);
            if let (false, Some(v)) = (known[speed], values) {
                // Over a few samples, to reduce the effect of the noise.
                let span = 8.min(piece.len() - 1);
                state[speed] = (v[piece.start + span] - v[piece.start]) / (span as f64 * self.options.dt);
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

    /// All unknowns at the start: the parameters, no bias, and of each piece the measured first state and no offset.
    fn unknowns(&self, parameters: [f64; PARAMETERS]) -> Vec<f64> {
        let mut q = parameters.to_vec();
        q.push(0.0);
        for piece in &self.pieces {
            q.extend(self.first_state(piece));
            q.push(0.0);
        }
        q
    }

    /// Sets whether the offset of each piece is fitted.
    fn free_offsets(&mut self, free: bool) {
        for piece in 0..self.pieces.len() {
            self.free[own(piece, 4)] = free;
        }
    }

    /// Fits from `start` under one integration scheme; the weights are found from the residuals, by repeating the fit.
    #[must_use]
    pub fn fit(&self, start: &Parameters, scheme: Scheme, free: Free) -> OutputErrorFit {
        let mut problem = self.clone();
        problem.options.scheme = scheme;
        problem.options.substeps = substeps(start, self.structure, &self.effects, self.options.dt);
        let mobility = 1.0 / start.i1 + 1.0 / start.i2;
        // Two per cent of critical damping as the unit where the start has none.
        problem.damping_unit = if start.b > 0.0 { start.b } else { 0.04 * (start.k / mobility).sqrt() };
        problem.free[..PARAMETERS].fill(free.parameters);
        if self.structure == Structure::Rigid {
            // One inertia: nothing of the coupling, and no motion of the table of its own.
            problem.free[1..PARAMETERS].fill(false);
            for piece in 0..self.pieces.len() {
                problem.free[own(piece, 2)] = false;
                problem.free[own(piece, 3)] = false;
            }
        }
        problem.free_offsets(free.offset);
        problem.free[BIAS] = free.bias;
        let log = |v: f64| if v > 0.0 { v.ln() } else { -700.0 };
        let mut q = self.unknowns([log(start.i1), log(start.i2), start.b / problem.damping_unit, log(start.k)]);
        problem.fixed.clone_from(&q);

        // First the unknowns that enter linearly: else the parameters would diverge to make up for a wrong initial state.
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
            state_only.free[..PARAMETERS].fill(false);
            q = state_only.run(&q, 20).0;
        }
        let mut report = problem.run(&q, ITERATIONS);
        let mut chi2 = 1.0;
        for _ in 0..ROUNDS {
            let sigma = problem.levels(&report.0);
            chi2 = 2.0 * report.1.cost / problem.degrees();
            let converged = sigma.iter().zip(&problem.sigma).all(|(a, b)| (a / b - 1.0).abs() < 1e-3);
            problem.sigma = sigma;
            report = problem.run(&report.0, ITERATIONS);
            if converged {
                break;
            }
        }
        problem.finish(&report.0, &report.1, chi2, scheme)
    }

    /// Fits with the weights as given and no re-weighting: the covariance is for those weights.
    #[cfg(test)]
    pub(super) fn fit_weighted(&self, start: &Parameters, scheme: Scheme, free: Free) -> OutputErrorFit {
        let mut problem = self.clone();
        problem.options.scheme = scheme;
        problem.damping_unit = if start.b > 0.0 { start.b } else { 1.0 };
        problem.free_offsets(free.offset);
        problem.free[BIAS] = free.bias;
        let mut q = self.unknowns([start.i1.ln(), start.i2.ln(), start.b / problem.damping_unit, start.k.ln()]);
        // First the unknowns that enter linearly, as initial speeds from positions alone are inaccurate. The second run begins with the
        // small damping of Levenberg-Marquardt again, which the first raises in the narrow valley along I2, B and K.
        problem.solve_state(&mut q);
        let first = problem.run(&q, ITERATIONS);
        let mut q = first.0;
        problem.solve_state(&mut q);
        let report = problem.run(&q, ITERATIONS);
        problem.finish(&report.0, &report.1, 1.0, scheme)
    }

    /// Degrees of freedom of the residuals, at least one.
    fn degrees(&self) -> f64 {
        let unknowns = self.free.iter().filter(|f| **f).count();
        ((self.torque.len() * self.outputs.len()) as f64 - unknowns as f64).max(1.0)
    }

    /// Minimises over the free unknowns from `q`, which holds all of them: all unknowns at the minimum, and how it was reached.
    fn run(&self, q: &[f64], iterations: usize) -> (Vec<f64>, levenberg::Report) {
        let free: Vec<usize> = (0..q.len()).filter(|i| self.free[*i]).collect();
        let start = DVector::from_iterator(free.len(), free.iter().map(|i| q[*i]));
        let mut lower = vec![f64::NEG_INFINITY; free.len()];
        for (bound, i) in lower.iter_mut().zip(&free) {
            // B is not negative.
            if *i == 2 {
                *bound = 0.0;
            }
        }
        // Parameters in logarithms: a step of more than a factor e^3 from the start is a divergent fit.
        let options = levenberg::Options { iterations, lower, ..levenberg::Options::default() };
        let mut fixed = self.clone();
        fixed.fixed = q.to_vec();
        let report = levenberg::minimise(&fixed, &start, &options);
        (fixed.expand(&report.parameters), report)
    }

    /// All unknowns from the free ones.
    fn expand(&self, q: &DVector<f64>) -> Vec<f64> {
        let mut all = self.fixed.clone();
        let mut next = q.iter();
        for (value, free) in all.iter_mut().zip(&self.free) {
            if *free && let Some(v) = next.next() {
                *value = *v;
            }
        }
        all
    }

    /// The parameters of the axis at unknowns `q`, SI units.
    fn axis<S: Scalar>(&self, q: &[S]) -> Parameters<S> {
        Parameters {
            i1: q[0].exp(),
            i2: if self.structure == Structure::Rigid { S::from(0.0) } else { q[1].exp() },
            b: q[2] * self.damping_unit,
            k: q[3].exp(),
            rho: S::from(self.rho),
        }
    }

    /// The simulation of piece `index`: `parameters` as unknowns, `initial` in rad and rad/s, `bias` in N.m.
    fn respond<S: Scalar>(&self, index: usize, parameters: &[S], initial: [S; 4], bias: f64) -> Response<S> {
        let torque = &self.torque[self.pieces[index].clone()];
        let torque: Cow<[f64]> =
            if bias == 0.0 { Cow::Borrowed(torque) } else { Cow::Owned(torque.iter().map(|t| t + bias).collect()) };
        let options = SimulateOptions { start: self.starts[index], ..self.options };
        simulate(&self.axis(parameters), self.structure, &Settings::lift(&self.effects), initial, &torque, &options)
    }

    /// Measured minus simulated at unknowns `q`, one vector for each output, in its unit.
    fn differences(&self, q: &[f64]) -> Vec<Vec<f64>> {
        let mut out: Vec<Vec<f64>> = vec![Vec::with_capacity(self.torque.len()); self.outputs.len()];
        for (index, piece) in self.pieces.iter().enumerate() {
            let state = [0, 1, 2, 3].map(|i| q[own(index, i)]);
            let response = self.respond(index, &q[..PARAMETERS], state, q[BIAS]);
            for ((_, c, measured), out) in self.outputs.iter().zip(&mut out) {
                let offset = if *c == 2 { q[own(index, 4)] } else { 0.0 };
                let measured = &measured[piece.clone()];
                out.extend(measured.iter().zip(&response.readings).map(|(y, r)| y - pick(r, *c) - offset));
            }
        }
        out
    }

    /// The unknowns of a fit, at this problem's unit of damping.
    fn of_fit(&self, fit: &OutputErrorFit) -> Vec<f64> {
        let v = &fit.estimated.values;
        let log = |v: f64| if v > 0.0 { v.ln() } else { -700.0 };
        let mut q = vec![log(v[0]), log(v[1]), v[2] / self.damping_unit, log(v[3]), fit.bias];
        for (initial, offset) in fit.initial.iter().zip(&fit.offset) {
            q.extend(initial);
            q.push(*offset);
        }
        q
    }

    /// Measured minus simulated at a fit, one vector for each output, in its unit.
    #[must_use]
    pub fn residuals(&self, fit: &OutputErrorFit) -> Vec<(Signal, Vec<f64>)> {
        let mut problem = self.clone();
        problem.options.scheme = fit.scheme;
        let p = fit.estimated.parameters(self.rho);
        problem.options.substeps = substeps(&p, self.structure, &self.effects, self.options.dt);
        let values = problem.differences(&problem.of_fit(fit));
        self.outputs.iter().zip(values).map(|((signal, _, _), values)| (*signal, values)).collect()
    }

    /// The readings of all pieces, one after the other, with parameters `p` from the initial states of a fit, without effects.
    #[must_use]
    pub fn simulated(&self, fit: &OutputErrorFit, p: &Parameters) -> Vec<Reading<f64>> {
        let mut readings = Vec::with_capacity(self.torque.len());
        for (index, piece) in self.pieces.iter().enumerate() {
            let options = SimulateOptions { start: self.starts[index], scheme: fit.scheme, ..self.options };
            let torque = &self.torque[piece.clone()];
            readings.extend(
                simulate(p, self.structure, &Settings::default(), fit.initial[index], torque, &options).readings,
            );
        }
        readings
    }

    /// Level of each output's residual at unknowns `q`, in its unit.
    fn levels(&self, q: &[f64]) -> Vec<f64> {
        self.differences(q).iter().zip(&self.outputs).map(|(r, (_, _, measured))| level(rms(r), measured)).collect()
    }

    /// The fit at unknowns `q`, with the covariance of its parameters in SI units.
    fn finish(&self, q: &[f64], report: &levenberg::Report, chi2: f64, scheme: Scheme) -> OutputErrorFit {
        let p: Parameters = self.axis(&q[..PARAMETERS]);
        let relative = report.covariance();
        let free: Vec<usize> = (0..q.len()).filter(|i| self.free[*i]).collect();
        let unit = [p.i1, p.i2, self.damping_unit, p.k];
        let mut covariance = Matrix4::zeros();
        for (a, i) in free.iter().enumerate().filter(|(_, i)| **i < PARAMETERS) {
            for (b, j) in free.iter().enumerate().filter(|(_, j)| **j < PARAMETERS) {
                covariance[(*i, *j)] = relative[(a, b)] * unit[*i] * unit[*j];
            }
        }
        let pieces = 0..self.pieces.len();
        OutputErrorFit {
            estimated: Estimated {
                values: Vector4::new(p.i1, p.i2, p.b, p.k),
                covariance: self.free[0].then_some(covariance),
            },
            initial: pieces.clone().map(|k| [0, 1, 2, 3].map(|i| q[own(k, i)])).collect(),
            offset: pieces.map(|k| q[own(k, 4)]).collect(),
            bias: q[BIAS],
            chi2,
            cost: report.cost,
            sigma: self.sigma.clone(),
            termination: report.termination,
            iterations: report.iterations,
            scheme,
        }
    }

    /// Passes each row of the weighted problem to `take(sample, unknowns, derivatives, residual)`: the derivatives of one simulated output
    /// by the unknowns (as indices among the free ones), and its residual, both divided by the output's level.
    fn rows(&self, q: &[f64], mut take: impl FnMut(usize, &[usize], &[f64], f64)) {
        let free: Vec<usize> = (0..q.len()).filter(|i| self.free[*i]).collect();
        let among = |unknown: usize| free.binary_search(&unknown).ok();
        for (index, piece) in self.pieces.iter().enumerate() {
            let at = |i: usize| if i < PARAMETERS { q[i] } else { q[own(index, i - PARAMETERS)] };
            let dual: [Dual<DERIVED>; DERIVED] = std::array::from_fn(|i| Dual::variable(at(i), i));
            let initial = [dual[4], dual[5], dual[6], dual[7]];
            let response = self.respond(index, &dual[..PARAMETERS], initial, q[BIAS]);
            // The response to a constant torque: the derivative to the bias, exact for the linear axis.
            let step = self.free[BIAS].then(|| {
                let p: Parameters = self.axis(&q[..PARAMETERS]);
                let ones = vec![1.0; piece.len()];
                simulate(&p, self.structure, &Settings::default(), [0.0; 4], &ones, &self.options)
            });
            // The free unknowns that this piece's outputs depend on: index among the free ones, and which derivative.
            let mut unknowns: Vec<(usize, usize)> = (0..DERIVED)
                .filter_map(|i| Some((among(if i < PARAMETERS { i } else { own(index, i - PARAMETERS) })?, i)))
                .collect();
            unknowns.extend(among(own(index, 4)).map(|k| (k, DERIVED)));
            unknowns.extend(among(BIAS).map(|k| (k, DERIVED + 1)));
            let numbers: Vec<usize> = unknowns.iter().map(|(k, _)| *k).collect();
            let mut row = vec![0.0; unknowns.len()];
            for ((_, c, measured), sigma) in self.outputs.iter().zip(&self.sigma) {
                let is_table = f64::from(u8::from(*c == 2));
                let offset = is_table * q[own(index, 4)];
                for (k, (y, reading)) in measured[piece.clone()].iter().zip(&response.readings).enumerate() {
                    let value = pick(reading, *c);
                    for (out, (_, i)) in row.iter_mut().zip(&unknowns) {
                        let derivative = match *i {
                            DERIVED => is_table,
                            i if i > DERIVED => step.as_ref().map_or(0.0, |s| pick(&s.readings[k], *c)),
                            i => value.eps[i],
                        };
                        *out = derivative / sigma;
                    }
                    take(piece.start + k, &numbers, &row, (y - value.re - offset) / sigma);
                }
            }
        }
    }
}

/// A noise level, at least the rounding error of the signal.
fn level(sigma: f64, values: &[f64]) -> f64 {
    sigma.max(1e-13 * rms(values)).max(f64::MIN_POSITIVE.sqrt())
}

impl Problem for OutputError<'_> {
    fn cost(&self, q: &DVector<f64>) -> Option<f64> {
        let q = self.expand(q);
        let mut sum = 0.0;
        for (values, sigma) in self.differences(&q).iter().zip(&self.sigma) {
            sum += values.iter().map(|v| (v / sigma).powi(2)).sum::<f64>();
        }
        sum.is_finite().then_some(0.5 * sum)
    }

    fn linearise(&self, q: &DVector<f64>) -> Option<Normal> {
        let mut normal = Normal::zeros(q.len());
        self.rows(&self.expand(q), |_, numbers, row, residual| {
            normal.cost += 0.5 * residual * residual;
            // The residual falls as the output rises.
            for (j, a) in numbers.iter().zip(row) {
                normal.gradient[*j] -= a * residual;
                for (i, b) in numbers.iter().zip(row) {
                    normal.curvature[(*i, *j)] += a * b;
                }
            }
        });
        Some(normal)
    }
}
