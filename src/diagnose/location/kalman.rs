//! Kalman filter and fixed-interval smoother for the axis with unknown inputs, in square-root form.
//!
//! Measurement update one channel at a time by Potter (Bierman, Factorization Methods for Discrete Sequential
//! Estimation, 1977, ch. II.8), time update by a Householder triangularisation of `[F*S, W]`: both act on the rows of
//! the root `S` (`P = S*S'`), so that units as far apart as rad and N.m cost no digits. The axis does not change with
//! time, so the gains settle; from there on they are kept, and a sample costs one product with `F`.
//!
//! The smoother is the adjoint one (Bryson & Frazier; de Jong, Smoothing and interpolation with the state-space model,
//! JASA 84, 1989): `r <- F'*r`, per channel `r <- r + h*(e/s - k'*r)`, `x_s = x + P*r`, `V = P - P*N*P`. It inverts
//! nothing.

use nalgebra::{SMatrix, SVector};

use super::plant::Plant;
use crate::diagnose::Record;

/// Gains have settled when one sample changes each by less than this, relatively.
const SETTLED: f64 = 1e-7;
/// Most states and unknown inputs together.
const WIDTH: usize = 8;

/// Gains of the channels at one sample, and the root of the covariance after them.
#[derive(Debug, Clone, Copy)]
struct Gains<const N: usize> {
    gain: [SVector<f64, N>; 4],
    variance: [f64; 4],
    root: SMatrix<f64, N, N>,
}

/// The filter along a record, kept for smoothing.
#[derive(Debug, Clone)]
pub struct Track<const N: usize> {
    plant: Plant<N>,
    measured: [bool; 4],
    /// Gains by sample until they settle; the last serve all later samples.
    gains: Vec<Gains<N>>,
    /// States after the measurement.
    states: Vec<SVector<f64, N>>,
    /// Innovations; zero where a channel is not measured.
    innovations: Vec<[f64; 4]>,
    /// Log-likelihood of the record.
    pub log_likelihood: f64,
}

/// A torque at the first port that is known by now, one value a sample, held: the unknown input is what comes on top.
pub type Known<'a> = Option<&'a [f64]>;

/// The variance of a channel's noise; a channel said to be without noise has that of its rounding.
fn noise_variance(record: &Record, channel: usize) -> f64 {
    let scale = record.channels[channel].as_ref().map_or(0.0, |y| y.iter().fold(0.0_f64, |m, v| m.max(v.abs())));
    record.noise[channel].max(1e-12 * scale).max(1e-150).powi(2)
}

/// Log-likelihood of the record, without keeping anything.
#[must_use]
pub fn log_likelihood<const N: usize>(plant: &Plant<N>, record: &Record, known: Known<'_>) -> f64 {
    run(plant, record, known, None)
}

/// The filter along the record, ready to smooth.
#[must_use]
pub fn track<const N: usize>(plant: &Plant<N>, record: &Record, known: Known<'_>) -> Track<N> {
    let mut track = Track {
        plant: *plant,
        measured: record.channels.each_ref().map(Option::is_some),
        gains: Vec::new(),
        states: Vec::with_capacity(record.len()),
        innovations: Vec::with_capacity(record.len()),
        log_likelihood: 0.0,
    };
    track.log_likelihood = run(plant, record, known, Some(&mut track));
    track
}

fn run<const N: usize>(plant: &Plant<N>, record: &Record, known: Known<'_>, mut keep: Option<&mut Track<N>>) -> f64 {
    let port = plant.port();
    let noise: [f64; 4] = std::array::from_fn(|c| noise_variance(record, c));
    let channels: Vec<(usize, &[f64])> =
        record.channels.iter().enumerate().filter_map(|(c, y)| y.as_deref().map(|y| (c, y))).collect();
    let mut x = plant.mean;
    let mut root = SMatrix::<f64, N, N>::from_diagonal(&plant.std);
    let mut gains = Gains { gain: [SVector::zeros(); 4], variance: [1.0; 4], root };
    let mut settled = false;
    let mut log_determinant = 0.0;
    let (mut sum_log, mut sum_square) = (0.0, 0.0);
    for k in 0..record.len() {
        if !settled {
            let before = gains;
            for &(c, _) in &channels {
                (gains.gain[c], gains.variance[c]) = potter(&mut root, &plant.read[c], noise[c]);
            }
            gains.root = root;
            settled = k > 0 && channels.iter().all(|&(c, _)| unchanged(&before, &gains, c));
            log_determinant = channels.iter().map(|&(c, _)| gains.variance[c].ln()).sum();
            if let Some(track) = keep.as_deref_mut() {
                track.gains.push(gains);
            }
            if !settled {
                root = triangular(&(plant.f * root), &plant.walk);
            }
        }
        let mut innovation = [0.0; 4];
        for &(c, y) in &channels {
            let e = y[k] - plant.read[c].dot(&x);
            x += gains.gain[c] * e;
            sum_square += e * e / gains.variance[c];
            innovation[c] = e;
        }
        sum_log += log_determinant;
        if let Some(track) = keep.as_deref_mut() {
            track.states.push(x);
            track.innovations.push(innovation);
        }
        x = plant.step(&x, record, k);
        if let Some(known) = known {
            x += port * known[k];
        }
    }
    let count = (record.len() * channels.len()) as f64;
    -0.5 * (count * std::f64::consts::TAU.ln() + sum_log + sum_square)
}

fn unchanged<const N: usize>(before: &Gains<N>, after: &Gains<N>, channel: usize) -> bool {
    let close = |a: f64, b: f64| (a - b).abs() <= SETTLED * b.abs();
    close(before.variance[channel], after.variance[channel])
        && before.gain[channel].iter().zip(after.gain[channel].iter()).all(|(a, b)| close(*a, *b))
}

/// Potter's update of the root `S` by a reading `h'*x` with noise of variance `r`: the gain, and the innovation's variance.
fn potter<const N: usize>(root: &mut SMatrix<f64, N, N>, h: &SVector<f64, N>, r: f64) -> (SVector<f64, N>, f64) {
    let phi = root.tr_mul(h);
    let variance = phi.norm_squared() + r;
    let direction = *root * phi;
    root.ger(-1.0 / (variance + (r * variance).sqrt()), &direction, &phi, 1.0);
    (direction / variance, variance)
}

/// The lower triangular root of `A*A' + diag(walk)^2`, by Householder reflections from the right.
fn triangular<const N: usize>(a: &SMatrix<f64, N, N>, walk: &SVector<f64, N>) -> SMatrix<f64, N, N> {
    let mut rows = [[0.0; WIDTH]; N];
    let mut width = N;
    for i in 0..N {
        for j in 0..N {
            rows[i][j] = a[(i, j)];
        }
    }
    for i in 4..N {
        if walk[i] > 0.0 {
            rows[i][width] = walk[i];
            width += 1;
        }
    }
    for i in 0..N {
        let norm = rows[i][i..width].iter().map(|v| v * v).sum::<f64>().sqrt();
        if norm == 0.0 {
            continue;
        }
        let alpha = if rows[i][i] > 0.0 { -norm } else { norm };
        let mut v = [0.0; WIDTH];
        v[i..width].copy_from_slice(&rows[i][i..width]);
        v[i] -= alpha;
        let beta = 1.0 / (norm * (norm + rows[i][i].abs()));
        for row in &mut rows[i..] {
            let dot: f64 = row[i..width].iter().zip(&v[i..width]).map(|(a, b)| a * b).sum();
            for (a, b) in row[i..width].iter_mut().zip(&v[i..width]) {
                *a -= beta * dot * b;
            }
        }
    }
    SMatrix::from_fn(|i, j| if j <= i { rows[i][j] } else { 0.0 })
}

/// States given the whole record, and their standard deviations, by sample.
#[derive(Debug, Clone)]
pub struct Smoothed<const N: usize> {
    /// The states.
    pub states: Vec<SVector<f64, N>>,
    /// Their standard deviations.
    pub std: Vec<SVector<f64, N>>,
    /// Standard deviations of `[theta2, omega2]`.
    pub table_std: Vec<[f64; 2]>,
}

impl<const N: usize> Track<N> {
    /// Gains at sample `k`.
    fn gains(&self, k: usize) -> &Gains<N> {
        &self.gains[k.min(self.gains.len() - 1)]
    }

    /// The states given the whole record.
    #[must_use]
    pub fn smooth(&self) -> Smoothed<N> {
        let n = self.states.len();
        let mut states = self.states.clone();
        let mut std = vec![SVector::zeros(); n];
        let mut table_std = vec![[0.0; 2]; n];
        let mut r = SVector::<f64, N>::zeros();
        let mut information = SMatrix::<f64, N, N>::zeros();
        for k in (0..n).rev() {
            let gains = self.gains(k);
            let covariance = gains.root * gains.root.transpose();
            states[k] += covariance * r;
            // P - P*N*P in the form that keeps the digits of directions which the future alone makes known.
            let rest = SMatrix::<f64, N, N>::identity() - gains.root.tr_mul(&(information * gains.root));
            let variance = gains.root * rest * gains.root.transpose();
            std[k] = variance.diagonal().map(|v| v.max(0.0).sqrt());
            table_std[k] = [0, 1].map(|i| {
                let v = variance[(i, i)] + variance[(i + 2, i + 2)] - 2.0 * variance[(i, i + 2)];
                v.max(0.0).sqrt()
            });
            for c in (0..4).rev().filter(|c| self.measured[*c]) {
                let (h, gain, s) = (&self.plant.read[c], &gains.gain[c], gains.variance[c]);
                r += h * (self.innovations[k][c] / s - gain.dot(&r));
                // (I - k*h')'*N*(I - k*h') + h*h'/s.
                let nk = information * gain;
                let knk = gain.dot(&nk) + 1.0 / s;
                information += h * (h.transpose() * knk - nk.transpose()) - nk * h.transpose();
            }
            r = self.plant.f.tr_mul(&r);
            information = self.plant.f.tr_mul(&information) * self.plant.f;
            information = (information + information.transpose()) * 0.5;
        }
        Smoothed { states, std, table_std }
    }

    /// Innovations over their standard deviations, by channel measured, in the order of the channels.
    #[must_use]
    pub fn whitened(&self) -> Vec<f64> {
        let mut out = Vec::with_capacity(4 * self.innovations.len());
        for (k, e) in self.innovations.iter().enumerate() {
            let gains = self.gains(k);
            for c in (0..4).filter(|c| self.measured[*c]) {
                out.push(e[c] / gains.variance[c].sqrt());
            }
        }
        out
    }

    /// Whitened innovations of another plant with the gains and variances of this one.
    #[must_use]
    pub fn whitened_as(&self, plant: &Plant<N>, record: &Record, known: Known<'_>) -> Vec<f64> {
        let port = plant.port();
        let mut out = Vec::with_capacity(4 * self.innovations.len());
        let mut x = plant.mean;
        for k in 0..record.len() {
            let gains = self.gains(k);
            for (c, y) in record.channels.iter().enumerate() {
                if let Some(y) = y {
                    let e = y[k] - plant.read[c].dot(&x);
                    x += gains.gain[c] * e;
                    out.push(e / gains.variance[c].sqrt());
                }
            }
            x = plant.step(&x, record, k);
            if let Some(known) = known {
                x += port * known[k];
            }
        }
        out
    }

    /// How the whitened innovations answer to a torque at the first port, `n` values held over their samples, or, when
    /// `commanded`, to one added to the torque recorded.
    ///
    /// The reading of what the axis does under it is not in the record: the innovation is its negative.
    #[must_use]
    pub fn answer(&self, torque: &[f64], commanded: bool) -> Vec<f64> {
        let mut out = Vec::with_capacity(4 * self.innovations.len());
        let port = self.plant.port();
        let mut x = SVector::<f64, N>::zeros();
        for (k, t0) in torque.iter().enumerate() {
            let gains = self.gains(k);
            for c in (0..4).filter(|c| self.measured[*c]) {
                let e = -self.plant.read[c].dot(&x);
                x += gains.gain[c] * e;
                out.push(e / gains.variance[c].sqrt());
            }
            let t1 = torque.get(k + 1).copied().unwrap_or(*t0);
            x = self.plant.f * x;
            x += if commanded { self.plant.torque[0] * *t0 + self.plant.torque[1] * t1 } else { port * *t0 };
        }
        out
    }
}

/// Scalar product, in four sums side by side.
pub(super) fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0; 4];
    let (fours_a, fours_b) = (a.chunks_exact(4), b.chunks_exact(4));
    let rest: f64 = fours_a.remainder().iter().zip(fours_b.remainder()).map(|(x, y)| x * y).sum();
    for (x, y) in fours_a.zip(fours_b) {
        for i in 0..4 {
            sums[i] += x[i] * y[i];
        }
    }
    sums.iter().sum::<f64>() + rest
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::axis::{Hold, Parameters, Structure};
    use crate::diagnose::location::plant::{Port, Prior, Transition};

    #[test]
    fn filter_and_smoother_equal_the_dense_normal_distribution() {
        let oracle: Vec<f64> =
            include_str!("../../../scripts/oracles/unknown_input.txt").lines().map(|l| l.parse().unwrap()).collect();
        let n = 40;
        let at = |f: &dyn Fn(f64) -> f64| (0..n).map(|k| f(f64::from(k))).collect::<Vec<_>>();
        let record = Record {
            start: 0.0,
            dt: 5e-3,
            hold: Hold::Zoh,
            torque: at(&|k| 0.01 * (0.3 * k).cos()),
            channels: [
                Some(at(&|k| 0.05 + 0.02 * k.sqrt())),
                Some(at(&|k| 0.3 * (0.2 * k).sin())),
                Some(at(&|k| 0.05 + 0.019 * k.sqrt())),
                None,
            ],
            noise: [1e-3, 2e-2, 2e-3, 0.0],
        };
        let transition = Transition::new(&Parameters::PAPER, Structure::TwoInertia, record.hold, record.dt);
        let prior = Prior { mean: [0.05, 0.0, 0.0, 0.0], std: [0.2, 3.0, 0.5, 10.0], torque: 0.02 / 3.0, angle: 0.1 };
        let plant = Plant::<6>::new(&transition, &prior, &[Port::Motor, Port::Table], &[3e-4, 1e-4]);
        let track = track(&plant, &record, None);
        assert_eq!(log_likelihood(&plant, &record, None), track.log_likelihood);
        assert!((track.log_likelihood - oracle[0]).abs() < 1e-7 * oracle[0].abs(), "{}", track.log_likelihood);
        let smoothed = track.smooth();
        for (i, k) in [0, 20, 39].into_iter().enumerate() {
            let expected = &oracle[1 + 12 * i..13 + 12 * i];
            for j in 0..6 {
                let (state, std) = (smoothed.states[k][j], smoothed.std[k][j]);
                // The state to a millionth of what is not known of it; its uncertainty to a millionth of itself.
                assert!((state - expected[j]).abs() < 1e-6 * expected[6 + j], "{k} {j}: {state} {}", expected[j]);
                assert!((std / expected[6 + j] - 1.0).abs() < 1e-6, "{k} {j}: {std} {}", expected[6 + j]);
            }
        }
    }
}
