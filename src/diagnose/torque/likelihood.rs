//! The likelihood of what a model lacks: sensor noise and model discrepancy, in the band of the motion.
//!
//! The lacking torques `r` of [`super::tracking`] are tapered and transformed. At a frequency their covariance is
//!
//! ```text
//! C = D diag(n1, n2) D^H + diag(s1^2, s2^2)
//! ```
//!
//! `n` the noise of the encoders seen as positions, `D` the axis' dynamic stiffness (of a reference model, the same for all
//! hypotheses), `s^2` the discrepancy of each equation, white in the band, of the size that makes the likelihood largest (Kennedy,
//! O'Hagan, JRSS B 63(3), 2001; Whittle, JRSS B 15, 1953). Without discrepancy this is the likelihood of output error, with a
//! large one that of inverse dynamics. A side that is not measured is eliminated.

use rustfft::{FftPlanner, num_complex::Complex};

use super::super::model::Model;
use super::super::record::Record;
use super::tracking::Tracked;
use crate::axis::{Parameters, Structure};
use crate::effects::{Family, Place};

/// Bins over which the window spreads the noise.
const SPREAD: f64 = 3.0;

pub type C = Complex<f64>;

/// Which equations the record has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sight {
    Rigid,
    Both,
    Motor,
    Table,
}

pub struct Band {
    pub n: usize,
    pub dt: f64,
    pub sight: Sight,
    /// Window, its mean square one.
    pub taper: Vec<f64>,
    /// Angular frequency of each bin.
    pub omega: Vec<f64>,
    /// Degrees of freedom of each bin over two.
    pub weight: Vec<f64>,
    /// `N` of each bin: [N11, N22, N12], or the scalar's in the first.
    noise: Vec<(f64, f64, C)>,
    /// Inertia of the reference, kg.m2.
    inertia: f64,
    /// Weights of the eliminated form q = u0 r1 + u1 r2.
    combine: Vec<[C; 2]>,
}

/// Variances of the discrepancy of each equation.
pub type Discrepancy = [f64; 2];

pub fn stiffness(p: &Parameters, structure: Structure, w: f64, dt: f64) -> [[C; 2]; 2] {
    let s2 = 2.0 * ((w * dt).cos() - 1.0) / (dt * dt);
    let s1 = C::new(0.0, (w * dt).sin() / dt);
    if structure == Structure::Rigid {
        let z = C::default();
        return [[C::new((p.i1 + p.i2) * s2, 0.0), z], [z, z]];
    }
    let c = s1 * p.b + p.k;
    [[c + p.i1 * s2, -c], [-c, c + p.i2 * s2]]
}

impl Band {
    pub fn new(record: &Record, reference: &Model, limit: f64, mask: &[f64]) -> Self {
        let n = record.len();
        let dt = record.dt;
        let has = |i: usize| record.channels[2 * i].is_some() || record.channels[2 * i + 1].is_some();
        let sight = match (reference.structure, has(0), has(1)) {
            (Structure::Rigid, ..) => Sight::Rigid,
            (_, true, true) => Sight::Both,
            (_, true, false) => Sight::Motor,
            _ => Sight::Table,
        };
        let mean = (mask.iter().map(|w| w * w).sum::<f64>() / n as f64).sqrt();
        let taper: Vec<f64> = mask.iter().map(|w| w / mean).collect();
        let step = std::f64::consts::TAU / (n as f64 * dt);
        let count = ((limit * std::f64::consts::TAU / step) as usize).clamp(4.min(n / 2), n / 2 - 1) + 1;
        let omega: Vec<f64> = (0..count).map(|m| m as f64 * step).collect();
        let weight = (0..count).map(|m| if m == 0 { 0.5 } else { 1.0 }).collect();
        let noise_of = |i: usize, w: f64| -> f64 {
            let (y, v) = (record.channels[2 * i].is_some(), record.channels[2 * i + 1].is_some());
            let (sy, sv) = (record.noise[2 * i].powi(2), record.noise[2 * i + 1].powi(2));
            let low = w.max(0.5 * step);
            match (y, v) {
                (true, true) => {
                    let c = record.noise[2 * i + 1] / record.noise[2 * i];
                    let c = c.min(1.0 / dt);
                    let f = c * c / (c * c + w * w);
                    sy * f + (1.0 - f) * sv / (low * low) * f64::from(w > 0.0)
                }
                (true, false) => sy,
                _ => sv / (low * low),
            }
        };
        let mut noise = Vec::with_capacity(count);
        let mut combine = Vec::with_capacity(count);
        for &w in &omega {
            // The window spreads what stands a few bins higher.
            let w = w.hypot(SPREAD * step);
            let d = stiffness(&reference.parameters, reference.structure, w, dt);
            let one = C::new(1.0, 0.0);
            match sight {
                Sight::Rigid => {
                    noise.push((d[0][0].norm_sqr() * noise_of(0, w), 0.0, C::default()));
                    combine.push([one, one]);
                }
                Sight::Both => {
                    let (n1, n2) = (noise_of(0, w), noise_of(1, w));
                    let n11 = d[0][0].norm_sqr() * n1 + d[0][1].norm_sqr() * n2;
                    let n22 = d[1][0].norm_sqr() * n1 + d[1][1].norm_sqr() * n2;
                    let n12 = d[0][0] * d[1][0].conj() * n1 + d[0][1] * d[1][1].conj() * n2;
                    noise.push((n11, n22, n12));
                    combine.push([one, one]);
                }
                Sight::Motor | Sight::Table => {
                    let (u, side) =
                        if sight == Sight::Motor { ([d[1][1], -d[0][1]], 0) } else { ([d[1][0], -d[0][0]], 1) };
                    let norm = (u[0].norm_sqr() + u[1].norm_sqr()).sqrt();
                    let u = u.map(|x| x / norm);
                    let det = u[0] * d[0][side] + u[1] * d[1][side];
                    noise.push((det.norm_sqr() * noise_of(side, w), 0.0, C::default()));
                    combine.push(u);
                }
            }
        }
        Self {
            n,
            dt,
            sight,
            taper,
            omega,
            weight,
            noise,
            inertia: reference.parameters.i1 + reference.parameters.i2,
            combine,
        }
    }

    pub fn equations(&self) -> usize {
        if self.sight == Sight::Both { 2 } else { 1 }
    }

    /// Spectra of the equations.
    pub fn rows(&self, model: &Model, tracked: &Tracked, planner: &mut FftPlanner<f64>) -> [Vec<C>; 2] {
        let torque = &tracked.torque;
        // A mode of its own answers the error, too.
        let mode = crate::effects::EFFECTS
            .iter()
            .copied()
            .find(|e| e.info().family == Family::FlexibleMode && model.effects.is_on(*e))
            .map(|effect| {
                let side = usize::from(self.sight != Sight::Rigid && effect.info().place == Place::Table);
                let mut e: Vec<C> =
                    tracked.error[side].iter().zip(&self.taper).map(|(e, w)| C::new(e * w, 0.0)).collect();
                planner.plan_fft_forward(self.n).process(&mut e);
                let p = model.effects.of(effect);
                (side, e, p[0], p[1], p[2])
            });

        let mut z: Vec<C> = (0..self.n).map(|k| C::new(torque[0][k], torque[1][k]) * self.taper[k]).collect();
        planner.plan_fft_forward(self.n).process(&mut z);
        // What is likely is the motion: a torque counts by the acceleration that it makes, else an axis of no inertia lacks none.
        let own = model.parameters.i1 + model.parameters.i2;
        let scale = self.inertia / own / (self.n as f64).sqrt();
        let count = self.omega.len();
        let mut rows = [Vec::with_capacity(count), Vec::with_capacity(count)];
        for m in 0..count {
            let (a, b) = (z[m], z[(self.n - m) % self.n].conj());
            let mut one = (a + b) * (0.5 * scale);
            let mut two = (a - b) * C::new(0.0, -0.5 * scale);
            if let Some((side, e, i3, k, b)) = &mode {
                let w = self.omega[m];
                let s2 = 2.0 * ((w * self.dt).cos() - 1.0) / (self.dt * self.dt);
                let pull = C::new(*k, b * (w * self.dt).sin() / self.dt);
                let z = pull * (i3 * s2) / (pull + i3 * s2) * e[m] * scale;
                if *side == 0 { one += z } else { two += z }
            }
            if self.sight == Sight::Both {
                rows[0].push(one);
                rows[1].push(two);
            } else {
                let [u, v] = self.combine[m];
                rows[0].push(u * one + v * two);
            }
        }
        rows
    }

    /// Inverse of the covariance's Cholesky factor at each bin: `z0 = a r1`, `z1 = b r1 + c r2`; and log det.
    fn factor(&self, m: usize, s: Discrepancy) -> (f64, C, f64, f64) {
        let (n11, n22, n12) = self.noise[m];
        let c11 = n11 + s[0];
        if self.sight != Sight::Both {
            return (1.0 / c11.sqrt(), C::default(), 0.0, c11.ln());
        }
        let c22 = n22 + s[1];
        let l11 = c11.sqrt();
        let l21 = n12.conj() / l11;
        let rest = (c22 - l21.norm_sqr()).max(1e-14 * c22);
        let l22 = rest.sqrt();
        (1.0 / l11, -l21 / (l11 * l22), 1.0 / l22, c11.ln() + rest.ln())
    }

    /// Rows as real numbers of unit variance.
    pub fn whiten(&self, rows: &[Vec<C>; 2], s: Discrepancy) -> Vec<f64> {
        let count = self.omega.len();
        let mut out = Vec::with_capacity(2 * count * self.equations());
        for (m, (&first, &weight)) in rows[0].iter().zip(&self.weight).enumerate() {
            let (a, b, c, _) = self.factor(m, s);
            let w = (2.0 * weight).sqrt();
            let z0 = first * (a * w);
            out.push(z0.re);
            out.push(z0.im);
            if self.sight == Sight::Both {
                let z1 = (b * first + rows[1][m] * c) * w;
                out.push(z1.re);
                out.push(z1.im);
            }
        }
        out
    }

    pub fn log_det(&self, s: Discrepancy) -> f64 {
        (0..self.omega.len()).map(|m| self.weight[m] * self.factor(m, s).3).sum()
    }

    /// The discrepancy of largest likelihood, by scoring.
    pub fn discrepancy(&self, rows: &[Vec<C>; 2]) -> Discrepancy {
        let eqs = self.equations();
        let mut s = [0.0; 2];
        for i in 0..eqs {
            let total: f64 = self.weight.iter().sum();
            s[i] = rows[i].iter().zip(&self.weight).map(|(r, w)| w * r.norm_sqr()).sum::<f64>() / total;
        }
        let floor = s.map(|v| v * 1e-12);
        for _ in 0..60 {
            let mut next = s;
            let mut moved = 0.0_f64;
            let (mut num, mut den) = ([0.0; 2], [0.0; 2]);
            for (m, (&first, &w)) in rows[0].iter().zip(&self.weight).enumerate() {
                let (a, b, c, _) = self.factor(m, s);
                let z0 = first * a;
                if eqs == 1 {
                    let p = a * a;
                    num[0] += w * (z0.norm_sqr() * p - p);
                    den[0] += w * p * p;
                } else {
                    let z1 = b * first + rows[1][m] * c;
                    // P R = L^-H z, P = L^-H L^-1
                    let pr = [z0 * a + b.conj() * z1, z1 * c];
                    let p = [a * a + b.norm_sqr(), c * c];
                    for i in 0..2 {
                        num[i] += w * (pr[i].norm_sqr() - p[i]);
                        den[i] += w * p[i] * p[i];
                    }
                }
            }
            for i in 0..eqs {
                if den[i] > 0.0 {
                    next[i] = (s[i] + num[i] / den[i]).clamp(floor[i].max(0.05 * s[i]), f64::INFINITY);
                    moved = moved.max((next[i] / s[i].max(f64::MIN_POSITIVE) - 1.0).abs());
                }
            }
            s = next;
            if moved < 1e-4 {
                break;
            }
        }
        s
    }

    /// Log likelihood at that discrepancy.
    pub fn log_likelihood(&self, rows: &[Vec<C>; 2], s: Discrepancy) -> f64 {
        let z = self.whiten(rows, s);
        -0.5 * z.iter().map(|v| v * v).sum::<f64>() - self.log_det(s)
    }

    /// Real values compared.
    pub fn values(&self) -> f64 {
        2.0 * self.weight.iter().sum::<f64>() * self.equations() as f64
    }

    /// Share of the values that are independent: of a residual whose power is spread unevenly fewer are.
    pub fn independent(&self, rows: &[Vec<C>; 2], s: Discrepancy) -> f64 {
        let z = self.whiten(rows, s);
        let per = 2 * self.equations();
        let mut share = 0.0;
        for i in 0..self.equations() {
            let (mut a, mut b, mut n) = (0.0, 0.0, 0.0);
            for row in z.chunks_exact(per).skip(1) {
                let p = 0.5 * (row[2 * i].powi(2) + row[2 * i + 1].powi(2));
                a += p;
                b += p * p;
                n += 1.0;
            }
            share += (2.0 * a * a / (n * b)).min(1.0);
        }
        share / self.equations() as f64
    }

    /// Power of each equation beyond the noise, N.m squared a sample of the band.
    pub fn excess(&self, rows: &[Vec<C>; 2]) -> Discrepancy {
        self.discrepancy(rows)
    }

    /// Mean power of the noise in an equation, N.m squared a sample of the band.
    pub fn noise_power(&self, i: usize) -> f64 {
        let total: f64 = self.weight.iter().sum();
        self.noise.iter().zip(&self.weight).map(|(n, w)| w * if i == 0 { n.0 } else { n.1 }).sum::<f64>() / total
    }

    /// Rms of the residual over that of the noise, each frequency at its weight.
    pub fn noise_multiple(&self, rows: &[Vec<C>; 2]) -> f64 {
        let z = self.whiten(rows, [0.0; 2]);
        (z.iter().map(|v| v * v).sum::<f64>() / self.values()).sqrt()
    }

    /// Rms of the first equation's residual in the band, N.m.
    pub fn torque_rms(&self, rows: &[Vec<C>; 2]) -> f64 {
        let sum: f64 = rows.iter().flat_map(|r| r.iter().zip(&self.weight)).map(|(r, w)| 2.0 * w * r.norm_sqr()).sum();
        (sum / self.n as f64).sqrt()
    }

    /// The same over the rms of the torque about its mean.
    pub fn torque_share(&self, rows: &[Vec<C>; 2], record: &Record) -> f64 {
        let n = record.torque.len() as f64;
        let mean = record.torque.iter().sum::<f64>() / n;
        let rms = (record.torque.iter().map(|t| (t - mean).powi(2)).sum::<f64>() / n).sqrt();
        self.torque_rms(rows) / rms.max(f64::MIN_POSITIVE)
    }

    /// A series in the band, in time.
    pub fn filtered(&self, series: &[f64]) -> Vec<f64> {
        let mut planner = FftPlanner::new();
        let mut z: Vec<C> = series.iter().zip(&self.taper).map(|(r, w)| C::new(r * w, 0.0)).collect();
        planner.plan_fft_forward(self.n).process(&mut z);
        let count = self.omega.len();
        for (m, v) in z.iter_mut().enumerate() {
            if m >= count && self.n - m >= count {
                *v = C::default();
            }
        }
        planner.plan_fft_inverse(self.n).process(&mut z);
        z.iter().map(|v| v.re / self.n as f64).collect()
    }
}
