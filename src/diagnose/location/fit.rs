//! The most likely walks of the unknown inputs, together with the base parameters under a prior.
//!
//! The parameters of an axis with an effect, re-identified as if there were none, carry part of the effect. Here the
//! unknown input takes the effect, and the parameters are those of least innovations (prediction-error method: Ljung,
//! System Identification, 1999, ch. 7): Gauss-Newton on the whitened innovations with the gains held, between searches
//! for the walks.

use std::ops::Range;

use nalgebra::{SMatrix, SVector};

use super::kalman::{self, Track};
use super::plant::{Plant, Port, Prior, Transition};
use crate::axis::{Parameters, Structure};
use crate::diagnose::Record;

/// Standard deviation of the logarithm of a base parameter about the value given.
const PRIOR: f64 = 0.05;
/// The same of the pitch error of the table's encoder, and of its delay in samples; both are off unless the table's
/// encoder is what is doubted.
const SENSOR_PRIOR: [f64; 2] = [0.3, 30.0];
/// Decades of the walk, as a share of the port's scale, that are searched.
const DECADES: (f64, f64) = (-6.0, 0.5);

/// A record with what every hypothesis about it shares.
#[derive(Debug, Clone)]
pub struct Setting<'a> {
    /// The record.
    pub record: &'a Record,
    /// The parameters given.
    pub parameters: Parameters,
    /// One inertia or two.
    pub structure: Structure,
    /// What is known before the record.
    pub prior: Prior,
    /// A torque at the first port that is known by now.
    pub known: Option<Vec<f64>>,
}

/// The axis with unknown inputs, fitted to a record.
#[derive(Debug, Clone, PartialEq)]
pub struct Fitted {
    /// Where they enter.
    pub ports: Vec<Port>,
    /// Standard deviation of each walk, per sample.
    pub steps: Vec<f64>,
    /// The base parameters.
    pub parameters: Parameters,
    /// Pitch error of the table's encoder, and its delay in samples; zero unless a port doubts it.
    pub sensor: [f64; 2],
    /// Log-likelihood of the record, with the parameters' prior.
    pub log_likelihood: f64,
}

/// States and unknown inputs given the whole record, by sample.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Motion {
    /// `[theta1, omega1, theta2, omega2]`.
    pub states: Vec<[f64; 4]>,
    /// Standard deviations of the same.
    pub state_std: Vec<[f64; 4]>,
    /// The unknown inputs, one series a port.
    pub inputs: Vec<Vec<f64>>,
    /// Their standard deviations.
    pub input_std: Vec<Vec<f64>>,
}

impl Motion {
    /// Appends the samples in `range` of another.
    pub(super) fn append(&mut self, other: &Self, range: Range<usize>) {
        self.states.extend_from_slice(&other.states[range.clone()]);
        self.state_std.extend_from_slice(&other.state_std[range.clone()]);
        for (own, other) in [(&mut self.inputs, &other.inputs), (&mut self.input_std, &other.input_std)] {
            own.resize(other.len(), Vec::new());
            for (own, other) in own.iter_mut().zip(other) {
                own.extend_from_slice(&other[range.clone()]);
            }
        }
    }
}

/// Calls a function generic over the number of states for as many ports as there are.
macro_rules! with_states {
    ($ports:expr, $N:ident => $call:expr) => {
        match $ports {
            0 => {
                const $N: usize = 4;
                $call
            }
            1 => {
                const $N: usize = 5;
                $call
            }
            _ => {
                const $N: usize = 6;
                $call
            }
        }
    };
}

impl<'a> Setting<'a> {
    /// The setting of a record.
    #[must_use]
    pub fn new(record: &'a Record, parameters: &Parameters, structure: Structure) -> Self {
        Self {
            record,
            parameters: *parameters,
            structure,
            prior: Prior::new(record, parameters, structure),
            known: None,
        }
    }

    /// The plant of a hypothesis.
    #[must_use]
    pub fn plant<const N: usize>(&self, h: &Fitted) -> Plant<N> {
        let transition = Transition::new(&h.parameters, self.structure, self.record.hold, self.record.dt);
        let mut plant = Plant::<N>::new(&transition, &self.prior, &h.ports, &h.steps);
        let [scale, delay] = [h.sensor[0], h.sensor[1] * self.record.dt];
        if self.structure == Structure::TwoInertia {
            // theta2 read is (1 + scale)*theta2 - delay*omega2, omega2 read likewise; alpha2 = (K*d + B*d')/I2.
            let p = &h.parameters;
            for (channel, slope) in [(2, [0.0, 1.0, 0.0, -1.0]), (3, [0.0, 0.0, p.k / p.i2, p.b / p.i2])] {
                for (row, slope) in plant.read[channel].iter_mut().zip(slope) {
                    *row = *row * (1.0 + scale) - delay * slope;
                }
            }
        }
        plant
    }

    fn likelihood(&self, h: &Fitted) -> f64 {
        let data = with_states!(h.ports.len(), N => kalman::log_likelihood(&self.plant::<N>(h), self.record, self.known.as_deref()));
        data - self.penalty(h)
    }

    /// Scale of a port's input.
    fn scale(&self, port: Port) -> f64 {
        match port {
            Port::Motor | Port::Table | Port::Coupling => self.prior.torque,
            Port::MotorAngle | Port::TableAngle => self.prior.angle,
            Port::MotorSpeed | Port::TableSpeed => self.prior.std[1] / 3.0,
        }
    }

    /// What a hypothesis leaves free: 0 to 3 the base parameters as logarithms of their ratio to the values given, 4 and
    /// 5 the table's encoder.
    fn free(&self, h: &Fitted) -> Vec<usize> {
        let base = values(&self.parameters);
        let doubted = h.ports.contains(&Port::TableAngle) || h.ports.contains(&Port::TableSpeed);
        (0..6)
            .filter(|&i| match self.structure {
                Structure::Rigid => i == 0,
                Structure::TwoInertia if i < 4 => base[i] > 0.0,
                Structure::TwoInertia => doubted,
            })
            .collect()
    }

    /// The free value and its standard deviation before the record.
    fn value(&self, h: &Fitted, index: usize) -> (f64, f64) {
        match index {
            0..4 => ((values(&h.parameters)[index] / values(&self.parameters)[index]).ln(), PRIOR),
            _ => (h.sensor[index - 4], SENSOR_PRIOR[index - 4]),
        }
    }

    fn penalty(&self, h: &Fitted) -> f64 {
        let square = |i: &usize| {
            let (value, std) = self.value(h, *i);
            0.5 * (value / std).powi(2)
        };
        self.free(h).iter().map(square).sum()
    }

    /// The hypothesis with one free value moved.
    fn moved(&self, mut h: Fitted, index: usize, step: f64) -> Fitted {
        if index >= 4 {
            h.sensor[index - 4] += step;
            return h;
        }
        let mut v = values(&h.parameters);
        v[index] *= step.exp();
        if self.structure == Structure::Rigid {
            // One inertia: both parts grow alike.
            v[1] *= step.exp();
        }
        h.parameters = Parameters { i1: v[0], i2: v[1], b: v[2], k: v[3], rho: h.parameters.rho };
        h
    }

    /// The most likely walks and parameters for unknown inputs at `ports`, from scratch.
    #[must_use]
    pub fn fit(&self, ports: &[Port]) -> Fitted {
        let steps = ports.iter().map(|p| 1e-2 * self.scale(*p)).collect();
        let mut best = self.at(ports, steps, self.parameters);
        self.search_walks(&mut best, true);
        self.refine(&mut best);
        best
    }

    /// The same from walks too small to hide what the free values explain, and from there on.
    #[must_use]
    pub fn fit_slow(&self, ports: &[Port]) -> Fitted {
        let steps = ports.iter().map(|p| 10.0_f64.powf(DECADES.0) * self.scale(*p)).collect();
        let mut best = self.at(ports, steps, self.parameters);
        for _ in 0..8 {
            let before = best.log_likelihood;
            self.improve_parameters(&mut best);
            if best.log_likelihood - before < 0.5 {
                break;
            }
        }
        self.search_walks(&mut best, true);
        self.refine(&mut best);
        best
    }

    /// The most likely walks and parameters for unknown inputs that start at given walks.
    #[must_use]
    pub fn fit_at(&self, ports: &[Port], steps: Vec<f64>, parameters: &Parameters) -> Fitted {
        let mut best = self.at(ports, steps, *parameters);
        self.search_walks(&mut best, false);
        self.refine(&mut best);
        best
    }

    /// The most likely walks at the parameters given.
    #[must_use]
    pub fn walks(&self, ports: &[Port]) -> Fitted {
        let steps = ports.iter().map(|p| 1e-2 * self.scale(*p)).collect();
        let mut best = self.at(ports, steps, self.parameters);
        self.search_walks(&mut best, true);
        best
    }

    /// Log-likelihood of the record with the parameters given and walks of a usual size.
    #[must_use]
    pub fn likelihood_at_default(&self, ports: &[Port]) -> f64 {
        let steps = ports.iter().map(|p| 1e-2 * self.scale(*p)).collect();
        self.at(ports, steps, self.parameters).log_likelihood
    }

    fn at(&self, ports: &[Port], steps: Vec<f64>, parameters: Parameters) -> Fitted {
        let mut h = Fitted { ports: ports.to_vec(), steps, parameters, sensor: [0.0; 2], log_likelihood: 0.0 };
        h.log_likelihood = self.likelihood(&h);
        h
    }

    fn refine(&self, best: &mut Fitted) {
        let rounds = if best.ports.is_empty() { 8 } else { 4 };
        for _ in 0..rounds {
            let before = best.log_likelihood;
            self.improve_parameters(best);
            if best.log_likelihood - before < 0.5 {
                break;
            }
            self.search_walks(best, false);
        }
    }

    /// One walk after the other: over all decades, or about the present value.
    fn search_walks(&self, best: &mut Fitted, wide: bool) {
        for j in 0..best.ports.len() {
            let scale = self.scale(best.ports[j]);
            let mut trial = best.clone();
            let mut f = |decade: f64| {
                trial.steps[j] = scale * 10.0_f64.powf(decade);
                self.likelihood(&trial)
            };
            let (low, high) = if wide {
                let grid: Vec<f64> =
                    (0..=6).map(|i| DECADES.0 + (DECADES.1 - DECADES.0) * f64::from(i) / 6.0).collect();
                let values: Vec<f64> = grid.iter().map(|d| f(*d)).collect();
                let top = (0..grid.len()).fold(0, |m, i| if values[i] > values[m] { i } else { m });
                (grid[top.saturating_sub(1)], grid[(top + 1).min(grid.len() - 1)])
            } else {
                let now = (best.steps[j] / scale).log10();
                ((now - 0.5).max(DECADES.0), (now + 0.5).min(DECADES.1))
            };
            let (decade, value) = golden(&mut f, low, high, if wide { 8 } else { 5 });
            if value > best.log_likelihood {
                best.steps[j] = scale * 10.0_f64.powf(decade);
                best.log_likelihood = value;
            }
        }
    }

    /// One Gauss-Newton step of the parameters, halved until it helps.
    fn improve_parameters(&self, best: &mut Fitted) {
        let step = with_states!(best.ports.len(), N => self.newton_step::<N>(best));
        let Some(step) = step else { return };
        let mut share = 1.0;
        for _ in 0..6 {
            let mut trial = step.iter().fold(best.clone(), |h, (index, s)| {
                let most = if *index < 4 { 0.5 } else { f64::INFINITY };
                self.moved(h, *index, (share * s).clamp(-most, most))
            });
            trial.log_likelihood = self.likelihood(&trial);
            if trial.log_likelihood > best.log_likelihood {
                *best = trial;
                return;
            }
            share *= 0.3;
        }
    }

    fn newton_step<const N: usize>(&self, best: &Fitted) -> Option<Vec<(usize, f64)>> {
        let track = self.track::<N>(best);
        let base = track.whitened();
        let (columns, priors) = self.directions(best, &track, &base);
        let mut normal = SMatrix::<f64, 6, 6>::identity();
        let mut right = SVector::<f64, 6>::zeros();
        for (a, ca) in columns.iter().enumerate() {
            for (b, cb) in columns.iter().enumerate() {
                normal[(a, b)] = kalman::dot(ca, cb);
            }
            let (value, std) = priors[a];
            normal[(a, a)] += std.powi(-2);
            right[a] = -kalman::dot(ca, &base) - value * std.powi(-2);
        }
        let solution = normal.cholesky()?.solve(&right);
        Some(self.free(best).into_iter().zip(solution.iter().copied()).collect())
    }

    /// How the whitened innovations change with each free value, the gains held; and where each value stands with the
    /// standard deviation it had before the record.
    pub(super) fn directions<const N: usize>(
        &self,
        h: &Fitted,
        track: &Track<N>,
        base: &[f64],
    ) -> (Vec<Vec<f64>>, Vec<(f64, f64)>) {
        const DELTA: f64 = 1e-4;
        let free = self.free(h);
        let column = |i: &usize| {
            let mut column = track.whitened_as(
                &self.plant::<N>(&self.moved(h.clone(), *i, DELTA)),
                self.record,
                self.known.as_deref(),
            );
            for (c, b) in column.iter_mut().zip(base) {
                *c = (*c - b) / DELTA;
            }
            column
        };
        (free.iter().map(column).collect(), free.iter().map(|i| self.value(h, *i)).collect())
    }

    /// The hypothesis with its free values moved.
    pub(super) fn stepped(&self, h: &Fitted, steps: &[f64]) -> Fitted {
        self.free(h).into_iter().zip(steps).fold(h.clone(), |h, (i, s)| self.moved(h, i, s.clamp(-0.5, 0.5)))
    }

    /// The most likely walks of a hypothesis that was changed, its parameters kept.
    pub(super) fn settle(&self, h: &mut Fitted) {
        h.log_likelihood = self.likelihood(h);
        self.search_walks(h, true);
    }

    /// The filter of a fitted hypothesis along the record.
    #[must_use]
    pub fn track<const N: usize>(&self, fitted: &Fitted) -> Track<N> {
        kalman::track(&self.plant::<N>(fitted), self.record, self.known.as_deref())
    }

    /// Smoothed states and unknown inputs of a fitted hypothesis.
    #[must_use]
    pub fn smooth(&self, fitted: &Fitted) -> Motion {
        with_states!(fitted.ports.len(), N => motion(&self.track::<N>(fitted)))
    }
}

fn motion<const N: usize>(track: &Track<N>) -> Motion {
    let smoothed = track.smooth();
    let inputs = |v: &[SVector<f64, N>]| (4..N).map(|j| v.iter().map(|x| x[j]).collect()).collect();
    Motion {
        states: smoothed.states.iter().map(|x| [x[0], x[1], x[0] - x[2], x[1] - x[3]]).collect(),
        state_std: smoothed.std.iter().zip(&smoothed.table_std).map(|(s, t)| [s[0], s[1], t[0], t[1]]).collect(),
        inputs: inputs(&smoothed.states),
        input_std: inputs(&smoothed.std),
    }
}

fn values(p: &Parameters) -> [f64; 4] {
    [p.i1, p.i2, p.b, p.k]
}

/// The highest value of `f` between `low` and `high` by golden section.
fn golden(f: &mut impl FnMut(f64) -> f64, mut low: f64, mut high: f64, rounds: usize) -> (f64, f64) {
    let ratio = (5.0_f64.sqrt() - 1.0) / 2.0;
    let (mut a, mut b) = (high - ratio * (high - low), low + ratio * (high - low));
    let (mut fa, mut fb) = (f(a), f(b));
    for _ in 0..rounds {
        if fa > fb {
            high = b;
            (b, fb) = (a, fa);
            a = high - ratio * (high - low);
            fa = f(a);
        } else {
            low = a;
            (a, fa) = (b, fb);
            b = low + ratio * (high - low);
            fb = f(b);
        }
    }
    if fa > fb { (a, fa) } else { (b, fb) }
}
