//! Periodic records: frequency response averaged over the periods, its noise from their scatter, and the axis fitted
//! to it.
//!
//! ```text
//! G = sum_m Y_m*conj(T_m) / sum_m |T_m|^2        over the periods m, at each excited line
//! var(G) = sum_m |Y_m - G*T_m|^2 / ((M - 1)*sum_m |T_m|^2)
//! G(z) = e*(z*I - F)^-1*(G0 + G1*z)               the axis sampled, hold included, z = exp(j*w*dt)
//! ```
//!
//! The slow drift of a free axis over a period is taken off as a straight line first, so that it does not leak into the
//! lines. A real machine's response departs from any model by more than its noise: the fit weighs each line by its own
//! noise and by a relative model error common to all, which is estimated with the parameters.
//!
//! Source: R. Pintelon, J. Schoukens, System Identification: A Frequency Domain Approach, 2nd ed., 2.5 and 9.

use std::f64::consts::TAU;

use nalgebra::{DVector, Matrix4, SMatrix, Vector4};
use rustfft::FftPlanner;
use rustfft::num_complex::Complex;

use super::levenberg::{self, Normal, Problem, Termination};
use super::parameters::Estimated;
use super::result::{FrequencyResponse, ResponseOf};
use crate::axis::{Hold, Parameters, Scheme, SimulateOptions, Structure, simulate};
use crate::effects::Settings;
use crate::numerics::spectrum::dft;
use crate::trace::{Signal, Trace, TraceError};

type C = Complex<f64>;

/// Lines weaker than this share of the strongest are never excited.
const EXCITED: f64 = 1e-3;
/// Least ratio of a line's torque to its scatter between periods.
const CLEAR: f64 = 3.0;
/// Rounds of estimating the relative model error.
const ROUNDS: usize = 20;

/// Measured frequency response at the excited lines.
#[derive(Debug, Clone)]
pub struct Measured {
    /// Samples of a period.
    pub period: usize,
    /// Periods used.
    pub periods: usize,
    /// Interval, s.
    pub dt: f64,
    /// What the torque does between samples.
    pub hold: Hold,
    /// Harmonics of the excited lines.
    pub harmonics: Vec<usize>,
    /// One an output: signal, response, its variance.
    pub outputs: Vec<(Signal, Vec<C>, Vec<f64>)>,
}

/// The axis fitted to a measured frequency response.
#[derive(Debug, Clone)]
pub struct ResponseFit {
    /// I1, I2, B, K.
    pub estimated: Estimated,
    /// Relative error of the model, root mean square, beyond the noise.
    pub model_error: f64,
    /// How it ended.
    pub termination: Termination,
    /// Steps taken.
    pub iterations: usize,
}

/// The column of a reading that a signal is measured by.
const fn column(signal: Signal) -> Option<usize> {
    match signal {
        Signal::Theta1 => Some(0),
        Signal::Omega1 => Some(1),
        Signal::Theta2 => Some(2),
        Signal::Omega2 => Some(3),
        _ => None,
    }
}

/// The spectra of each whole period of a signal, a straight drift over each period taken off.
fn periods(values: &[f64], period: usize, skip: usize) -> Vec<Vec<C>> {
    (skip..values.len() / period)
        .map(|m| {
            let part = &values[m * period..(m + 1) * period];
            // The drift ends where the next period begins; at the end of the record, where the last one did.
            let slope = match values.get((m + 1) * period) {
                Some(next) => (next - part[0]) / period as f64,
                None => (part[0] - values[(m - 1) * period]) / period as f64,
            };
            let level: Vec<f64> = part.iter().enumerate().map(|(k, v)| v - slope * k as f64).collect();
            dft(&level)
        })
        .collect()
}

/// Measures the response of every angle and speed of a periodic trace; None with fewer than two whole periods or no
/// excited line. With four periods or more the first is left out, as it contains the transient.
#[must_use]
pub fn measure(trace: &Trace, period: usize) -> Option<Measured> {
    let torque = trace.get(Signal::T)?;
    let whole = torque.len() / period;
    if whole < 2 {
        return None;
    }
    let skip = usize::from(whole >= 4);
    let count = (whole - skip) as f64;
    let input = periods(torque, period, skip);
    let lines = period.div_ceil(2);
    let mean = |h: usize| input.iter().map(|t| t[h]).sum::<C>() / count;
    let strongest = (1..lines).map(|h| mean(h).norm()).fold(0.0, f64::max);
    let clear: Vec<(usize, f64)> = (1..lines)
        .map(|h| (h, mean(h)))
        .filter(|(h, centre)| {
            let scatter = (input.iter().map(|t| (t[*h] - centre).norm_sqr()).sum::<f64>() / count).sqrt();
            centre.norm() > EXCITED * strongest && centre.norm() > CLEAR * scatter
        })
        .map(|(h, centre)| (h, centre.norm()))
        .collect();
    // A drive's current loop repeats its own errors between the lines of the command: the excited lines are those above
    // the widest gap of the amplitudes.
    let mut sizes: Vec<f64> = clear.iter().map(|(_, size)| *size).collect();
    sizes.sort_by(|a, b| b.total_cmp(a));
    sizes.push(EXCITED * strongest);
    let least = sizes
        .windows(2)
        .map(|w| (w[0] / w[1], w[0]))
        .fold((0.0, 0.0), |widest, gap| if gap.0 > widest.0 { gap } else { widest })
        .1;
    let harmonics: Vec<usize> = clear.iter().filter(|(_, size)| *size >= least).map(|(h, _)| *h).collect();
    if harmonics.is_empty() {
        return None;
    }
    let mut outputs = Vec::new();
    for signal in [Signal::Theta1, Signal::Omega1, Signal::Theta2, Signal::Omega2] {
        let Some(values) = trace.get(signal) else { continue };
        let output = periods(values, period, skip);
        let (mut response, mut variance) = (Vec::new(), Vec::new());
        for &h in &harmonics {
            let power: f64 = input.iter().map(|t| t[h].norm_sqr()).sum();
            let g = input.iter().zip(&output).map(|(t, y)| y[h] * t[h].conj()).sum::<C>() / power;
            let rest: f64 = input.iter().zip(&output).map(|(t, y)| (y[h] - g * t[h]).norm_sqr()).sum();
            response.push(g);
            variance.push(rest / ((count - 1.0).max(1.0) * power));
        }
        outputs.push((signal, response, variance));
    }
    Some(Measured { period, periods: whole - skip, dt: trace.dt, hold: trace.hold, harmonics, outputs })
}

/// One period of a periodic trace, averaged over the periods and freed of everything between the excited lines, with
/// two samples more for the differences; the speeds are derivatives of the angles, line by line. What drifts, what is
/// not linear and most of the noise is gone from it.
///
/// # Errors
/// Never, as all signals have one length.
pub fn average(trace: &Trace, measured: &Measured) -> Result<Trace, TraceError> {
    let n = measured.period;
    let mut out = Trace::new(trace.start, trace.dt, trace.hold);
    let skip = trace.len() / n - measured.periods;
    let w0 = TAU / (n as f64 * trace.dt);
    let mut planner = FftPlanner::new();
    let inverse = planner.plan_fft_inverse(n);
    let synthesise = |lines: &[(usize, C)]| {
        let mut spectrum = vec![C::new(0.0, 0.0); n];
        for (h, x) in lines {
            spectrum[*h] = x * 0.5;
            spectrum[n - h] = x.conj() * 0.5;
        }
        inverse.process(&mut spectrum);
        (0..n + 2).map(|k| spectrum[k % n].re).collect::<Vec<f64>>()
    };
    for (signal, speed) in
        [(Signal::T, None), (Signal::Theta1, Some(Signal::Omega1)), (Signal::Theta2, Some(Signal::Omega2))]
    {
        let Some(values) = trace.get(signal) else { continue };
        let spectra = periods(values, n, skip);
        let count = spectra.len() as f64;
        let lines: Vec<(usize, C)> =
            measured.harmonics.iter().map(|h| (*h, spectra.iter().map(|s| s[*h]).sum::<C>() / count)).collect();
        out.set(signal, synthesise(&lines))?;
        if let Some(speed) = speed {
            let rates: Vec<(usize, C)> = lines.iter().map(|(h, x)| (*h, x * C::new(0.0, *h as f64 * w0))).collect();
            out.set(speed, synthesise(&rates))?;
        }
    }
    Ok(out)
}

/// The sampled axis: state transition and the two input columns.
struct Sampled {
    f: Matrix4<f64>,
    g0: Vector4<f64>,
    g1: Vector4<f64>,
}

impl Sampled {
    fn new(p: &Parameters, structure: Structure, dt: f64, hold: Hold, scheme: Scheme) -> Self {
        let options = SimulateOptions { start: 0.0, dt, hold, scheme, substeps: 1 };
        let after = |initial: [f64; 4], torque: [f64; 2]| {
            let r = simulate(p, structure, &Settings::default(), initial, &torque, &options).readings[1];
            Vector4::new(r.theta1, r.omega1, r.theta2, r.omega2)
        };
        let unit = |i: usize| std::array::from_fn(|j| f64::from(u8::from(i == j)));
        let columns: [Vector4<f64>; 4] = std::array::from_fn(|i| after(unit(i), [0.0; 2]));
        Self { f: Matrix4::from_columns(&columns), g0: after([0.0; 4], [1.0, 0.0]), g1: after([0.0; 4], [0.0, 1.0]) }
    }

    /// The response of all four states at an angle per sample.
    fn at(&self, angle: f64) -> Option<[C; 4]> {
        let z = C::from_polar(1.0, angle);
        let matrix = SMatrix::<nalgebra::Complex<f64>, 4, 4>::from_fn(|i, j| {
            let diagonal = if i == j { z } else { C::new(0.0, 0.0) };
            let v = diagonal - self.f[(i, j)];
            nalgebra::Complex::new(v.re, v.im)
        });
        let right = SMatrix::<nalgebra::Complex<f64>, 4, 1>::from_fn(|i, _| {
            let v = z * self.g1[i] + self.g0[i];
            nalgebra::Complex::new(v.re, v.im)
        });
        let x = matrix.lu().solve(&right)?;
        Some(std::array::from_fn(|i| C::new(x[i].re, x[i].im)))
    }
}

impl Measured {
    /// Frequencies of the lines, Hz.
    #[must_use]
    pub fn frequencies(&self) -> Vec<f64> {
        let resolution = 1.0 / (self.period as f64 * self.dt);
        self.harmonics.iter().map(|h| *h as f64 * resolution).collect()
    }

    /// The outputs that a fit uses: the angles, else the speeds (a logged speed is often a filtered difference).
    fn fitted(&self) -> Vec<&(Signal, Vec<C>, Vec<f64>)> {
        let angles: Vec<_> =
            self.outputs.iter().filter(|(s, _, _)| matches!(s, Signal::Theta1 | Signal::Theta2)).collect();
        if angles.is_empty() { self.outputs.iter().collect() } else { angles }
    }

    /// The model's response at every line, one an output asked for.
    #[must_use]
    pub fn model(&self, p: &Parameters, structure: Structure, scheme: Scheme, signal: Signal) -> Option<Vec<C>> {
        let sampled = Sampled::new(p, structure, self.dt, self.hold, scheme);
        let c = column(signal)?;
        self.harmonics.iter().map(|h| sampled.at(TAU * *h as f64 / self.period as f64).map(|x| x[c])).collect()
    }

    /// Fits I1, I2, B and K from `start`.
    #[must_use]
    pub fn fit(&self, start: &Parameters, scheme: Scheme) -> ResponseFit {
        let mobility = 1.0 / start.i1 + 1.0 / start.i2;
        let unit = if start.b > 0.0 { start.b } else { 0.04 * (start.k / mobility).sqrt() };
        let mut q = DVector::from_vec(vec![start.i1.ln(), start.i2.ln(), start.b.max(0.0) / unit, start.k.ln()]);
        let options = levenberg::Options {
            lower: vec![f64::NEG_INFINITY, f64::NEG_INFINITY, 0.0, f64::NEG_INFINITY],
            ..levenberg::Options::default()
        };
        // Ten per cent to begin with; then what the residual shows beyond the noise.
        let mut model_error: f64 = 0.1;
        let mut report = None;
        for _ in 0..ROUNDS {
            let problem = FrequencyFit { measured: self, scheme, unit, rho: start.rho, model_error };
            let found = levenberg::minimise(&problem, &q, &options);
            q.copy_from(&found.parameters);
            let before = model_error;
            model_error = problem.excess(&q).unwrap_or(model_error).max(1e-9);
            report = Some(found);
            if (model_error / before - 1.0).abs() < 1e-3 {
                break;
            }
        }
        let p = FrequencyFit { measured: self, scheme, unit, rho: start.rho, model_error }.parameters(&q);
        let (covariance, termination, iterations) = report.map_or((None, Termination::BadStart, 0), |r| {
            let relative = r.covariance();
            let units = [p.i1, p.i2, unit, p.k];
            (Some(Matrix4::from_fn(|i, j| relative[(i, j)] * units[i] * units[j])), r.termination, r.iterations)
        });
        let estimated = Estimated { values: Vector4::new(p.i1, p.i2, p.b, p.k), covariance };
        ResponseFit { estimated, model_error, termination, iterations }
    }

    /// Measured against modelled, for tables and plots.
    #[must_use]
    pub fn against(&self, p: &Parameters, structure: Structure, scheme: Scheme) -> FrequencyResponse {
        let frequency = self.frequencies();
        let outputs = self
            .outputs
            .iter()
            .filter_map(|(signal, g, variance)| {
                let model = self.model(p, structure, scheme, *signal)?;
                let error = g.iter().zip(&model).map(|(a, b)| (b - a).norm_sqr() / a.norm_sqr()).sum::<f64>();
                // Times the frequency to the power that makes a pure inertia flat: a resonance is then a peak.
                let power = if matches!(signal, Signal::Theta1 | Signal::Theta2) { 2 } else { 1 };
                let flat: Vec<f64> = g.iter().zip(&frequency).map(|(g, f)| g.norm() * f.powi(power)).collect();
                Some(ResponseOf {
                    signal: *signal,
                    magnitude: g.iter().map(|g| g.norm()).collect(),
                    phase: g.iter().map(|g| g.arg()).collect(),
                    std: variance.iter().map(|v| v.sqrt()).collect(),
                    model_magnitude: model.iter().map(|g| g.norm()).collect(),
                    model_phase: model.iter().map(|g| g.arg()).collect(),
                    error_percent: 100.0 * (error / g.len() as f64).sqrt(),
                    // The table's side has none: what is smallest there is noise.
                    antiresonance: interior(&flat, |a, b| a < b)
                        .filter(|_| matches!(signal, Signal::Theta1 | Signal::Omega1))
                        .map(|i| frequency[i]),
                    resonance: interior(&flat, |a, b| a > b).map(|i| frequency[i]),
                })
            })
            .collect();
        FrequencyResponse { frequency, outputs, periods: self.periods, period: self.period }
    }

    /// A start for the fit from the response alone: the mass line below the antiresonance, the antiresonance of the
    /// motor and the resonance. None where the response shows no pair of them.
    #[must_use]
    pub fn guess(&self, rho: f64) -> Option<Parameters> {
        let frequency = self.frequencies();
        let (_, g, _) = self.outputs.iter().find(|(s, _, _)| *s == Signal::Theta1)?;
        let flat: Vec<f64> = g.iter().zip(&frequency).map(|(g, f)| g.norm() * (TAU * f).powi(2)).collect();
        let peak = interior(&flat, |a, b| a > b)?;
        let antiresonance = interior(&flat[..peak], |a, b| a < b)?;
        let (anti, resonance) = (TAU * frequency[antiresonance], TAU * frequency[peak]);
        // Far above the resonance the motor moves alone: |theta1|*w^2 = 1/I1. The total inertia follows from the ratio
        // (resonance/antiresonance)^2 = 1 + I2/I1.
        let high = flat.iter().skip(peak + (flat.len() - peak) / 2).copied().collect::<Vec<_>>();
        let i1 = 1.0 / (high.iter().sum::<f64>() / high.len().max(1) as f64);
        let i2 = i1 * ((resonance / anti).powi(2) - 1.0);
        let k = i2 * anti * anti;
        let p = Parameters { i1, i2, b: 0.04 * (k * i2).sqrt(), k, rho };
        p.check(Structure::TwoInertia).is_ok().then_some(p)
    }
}

/// The extreme of a curve that is not at its ends.
fn interior(values: &[f64], better: fn(f64, f64) -> bool) -> Option<usize> {
    let best = (0..values.len()).reduce(|a, b| if better(values[b], values[a]) { b } else { a })?;
    (best > 0 && best + 1 < values.len()).then_some(best)
}

struct FrequencyFit<'a> {
    measured: &'a Measured,
    scheme: Scheme,
    unit: f64,
    rho: f64,
    model_error: f64,
}

impl FrequencyFit<'_> {
    fn parameters(&self, q: &DVector<f64>) -> Parameters {
        Parameters { i1: q[0].exp(), i2: q[1].exp(), b: q[2] * self.unit, k: q[3].exp(), rho: self.rho }
    }

    /// Weighted residuals, real and imaginary parts in turn.
    fn residuals(&self, q: &DVector<f64>) -> Option<Vec<f64>> {
        let p = self.parameters(q);
        let sampled = Sampled::new(&p, Structure::TwoInertia, self.measured.dt, self.measured.hold, self.scheme);
        let fitted = self.measured.fitted();
        let mut out = Vec::with_capacity(2 * fitted.len() * self.measured.harmonics.len());
        for (line, h) in self.measured.harmonics.iter().enumerate() {
            let model = sampled.at(TAU * *h as f64 / self.measured.period as f64)?;
            for (signal, g, variance) in &fitted {
                let level = variance[line] + self.model_error.powi(2) * g[line].norm_sqr();
                // Half of a complex variance belongs to each of its parts.
                let e = (g[line] - model[column(*signal)?]) / (0.5 * level).sqrt();
                out.extend([e.re, e.im]);
            }
        }
        out.iter().all(|v| v.is_finite()).then_some(out)
    }

    /// The relative error of the model beyond the noise, root mean square over lines and outputs; by the median, since
    /// a few lines where the response nearly vanishes must not rule it (for a complex normal error the median of its
    /// square is ln 2 of the mean).
    fn excess(&self, q: &DVector<f64>) -> Option<f64> {
        let p = self.parameters(q);
        let mut shares = Vec::new();
        for (signal, g, variance) in self.measured.fitted() {
            let model = self.measured.model(&p, Structure::TwoInertia, self.scheme, *signal)?;
            for ((g, m), v) in g.iter().zip(&model).zip(variance) {
                shares.push(((g - m).norm_sqr() - v) / g.norm_sqr());
            }
        }
        shares.sort_by(f64::total_cmp);
        let median = *shares.get(shares.len() / 2)?;
        Some((median / std::f64::consts::LN_2).max(0.0).sqrt())
    }
}

impl Problem for FrequencyFit<'_> {
    fn cost(&self, q: &DVector<f64>) -> Option<f64> {
        Some(0.5 * self.residuals(q)?.iter().map(|v| v * v).sum::<f64>())
    }

    fn linearise(&self, q: &DVector<f64>) -> Option<Normal> {
        let centre = DVector::from_vec(self.residuals(q)?);
        let mut jacobian = nalgebra::DMatrix::zeros(centre.len(), 4);
        for i in 0..4 {
            // Central differences: the cube root of the rounding of the response is the best step.
            let h = 1e-5 * q[i].abs().max(1.0);
            let (mut up, mut down) = (q.clone(), q.clone());
            up[i] += h;
            down[i] -= h;
            let (up, down) = (self.residuals(&up)?, self.residuals(&down)?);
            for (row, (u, d)) in up.iter().zip(&down).enumerate() {
                jacobian[(row, i)] = (u - d) / (2.0 * h);
            }
        }
        Some(Normal::new(&centre, &jacobian))
    }
}
