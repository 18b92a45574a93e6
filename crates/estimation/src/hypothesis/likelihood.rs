//! The likelihood of what a model lacks: sensor noise and model discrepancy, in the band of the motion.
//!
//! The residual torques `r` of [`super::tracking`] are tapered and transformed. At a frequency their covariance is
//!
//! ```text
//! C = D N D^H + diag(s1^2, s2^2),   N = diag(n1, n2) + n12 [1 1; 1 1]
//! ```
//!
//! `n` the noise of the encoders seen as positions, beside it what both have in common of samples taken late, `D` each model's own
//! dynamic stiffness (with the density of readings over torques, `ln |det D|^2`, in the likelihood), `s^2` the discrepancy of each
//! equation, white in the band, of the size that makes the likelihood largest (Kennedy, O'Hagan, JRSS B 63(3), 2001; Whittle, JRSS B 15,
//! 1953). Without discrepancy this is the likelihood of output error, with a large one that of inverse dynamics. A side that is not
//! measured is eliminated.
//!
//! That density takes the torque as given: the discrepancy moves the axis. Where the motion is given, as far as a drive follows its
//! reference, the discrepancy is in the torque that it took, and the readings have the density that the reference model gives them:
//! `ln det C` at the reference's stiffness ([`Band::with_motion_given`]). A torque that does not act as it was logged then has its own
//! density ([`Band::density_of_torques`]): else what a lag takes out of it would count as explained.

mod acting;
mod score;

use rustfft::{FftPlanner, num_complex::Complex};

use super::discrepancy::Discrepancy;
use super::hidden::{Hidden, Vibration, vibrations};
use super::model::{BaseParameter, Model};
use super::tracking::Torques;
use crate::axis::{Parameters, Structure};
use crate::conditioning::Record;
use crate::numerics::level::deviation;

/// Noises up to which what is left may be the encoders' own: of another colour than the one that is told at the sampling rate (1/f) a noise
/// has several times as much at the motion's.
pub const NEAR_THE_NOISE: f64 = 10.0;
/// Squared residual per value, in units of the noise, up to which a hypothesis is at the floor.
const AT_FLOOR: f64 = 1.15;

pub type C = Complex<f64>;

/// Spectra of the equations, of the second nothing where there is one.
pub type Spectra = [Vec<C>; 2];

/// Which equations the record has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sight {
    Rigid,
    Both,
    Motor,
    Table,
}

impl Sight {
    /// Of what a record has measured of an axis.
    pub fn of(record: &Record, structure: Structure) -> Self {
        let has = |i: usize| record.channels[2 * i].is_some() || record.channels[2 * i + 1].is_some();
        match (structure, has(0), has(1)) {
            (Structure::Rigid, ..) => Self::Rigid,
            (_, true, true) => Self::Both,
            (_, true, false) => Self::Motor,
            _ => Self::Table,
        }
    }

    /// Whether one of two inertias shows in the other's motion alone.
    pub fn is_of_one_side(self) -> bool {
        matches!(self, Self::Motor | Self::Table)
    }
}

#[derive(Clone)]
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
    /// Noise of each encoder alone, as a position, at each bin, and of both together.
    noise: Vec<[f64; 2]>,
    common: f64,
    /// Weights of the eliminated form q = u0 r1 + u1 r2.
    combine: Vec<[C; 2]>,
    /// Angular frequency at which the axis answers the noise of each bin.
    spread: Vec<f64>,
    /// What the noise makes of the reference.
    reference: Vec<Weight>,
    /// Share of the record that is weighed.
    weighed: f64,
    /// Whether the motion is given, and what is lacking is in the torque that it took.
    motion_is_given: bool,
}

/// What the encoders' noise makes in the equations of a model at a bin, and how dense its readings lie.
#[derive(Debug, Clone, Copy)]
pub struct Weight {
    /// Variance of the noise in each equation, and between them.
    noise: (f64, f64, C),
    /// `ln |det V|^2` of the visible stiffness `V` beyond the reference's: the density of readings over that of torques.
    density: f64,
}

/// What a model lacks, with how its own stiffness shows the noise in it.
#[derive(Debug, Clone)]
pub struct TorqueResidual {
    /// Spectra of the equations, without what inertias that no encoder shows began with.
    pub rows: [Vec<C>; 2],
    /// What the noise makes in them.
    pub weights: Vec<Weight>,
    /// The discrepancy beside the noise at which that was taken out.
    pub weighed_at: Discrepancy,
    /// The spectra with it, where there is any.
    whole: [Vec<C>; 2],
    vibrations: Vec<Vibration>,
    /// `ln |dT'/dT|^2` of the torque `T'` that acts over the logged one, of all bins, where the motion is given, else zero: the density of
    /// logged torques over that of acting ones.
    pub(super) acts: f64,
    /// Square of the inertia of each equation over the larger one's: torques of one acceleration.
    pub(super) alike: [f64; 2],
}

/// Spectra of the motion as measured: accelerations, twist and its rate.
pub struct MotionSpectra {
    acceleration: [Vec<C>; 2],
    twist: Vec<C>,
    rate: Vec<C>,
}

/// Dynamic stiffness in central differences: torque on each side over position of each, N.m/rad.
pub fn stiffness(p: &Parameters, structure: Structure, w: f64, dt: f64) -> [[C; 2]; 2] {
    let s2 = square(w, dt);
    let s1 = C::new(0.0, (w * dt).sin() / dt);
    if structure == Structure::Rigid {
        let z = C::default();
        return [[C::new((p.i1 + p.i2) * s2, 0.0), z], [z, z]];
    }
    let c = s1 * p.b + p.k;
    [[c + p.i1 * s2, -c], [-c, c + p.i2 * s2]]
}

/// The square of the differential operator in central differences, 1/s^2.
pub fn square(w: f64, dt: f64) -> f64 {
    2.0 * ((w * dt).cos() - 1.0) / (dt * dt)
}

/// The inertia that a third inertia on a spring, `[inertia, stiffness, damping]`, adds to its place at a frequency, kg.m2.
pub fn mode_inertia([inertia, stiffness, damping]: [f64; 3], w: f64, dt: f64) -> C {
    let pull = C::new(stiffness, damping * (w * dt).sin() / dt);
    pull * inertia / (pull + inertia * square(w, dt))
}

/// Angular frequency at which the noise of each bin stands. A window `w` spreads the second derivative of a white noise: of its power
/// `mean |d^2/dt^2 (w exp(-jwt))|^2 = w^4 + 6 w^2 mean w'^2 + mean w''^2` (by parts) comes into a bin.
fn spread(omega: &[f64], taper: &[f64], dt: f64) -> Vec<f64> {
    let mean = |terms: f64| terms / taper.len() as f64;
    let first = mean(taper.windows(2).map(|w| ((w[1] - w[0]) / dt).powi(2)).sum());
    let second = mean(taper.windows(3).map(|w| ((w[2] - 2.0 * w[1] + w[0]) / (dt * dt)).powi(2)).sum());
    omega.iter().map(|w| (w.powi(4) + 6.0 * w * w * first + second).powf(0.25)).collect()
}

impl Band {
    pub fn new(record: &Record, reference: &Model, limit: f64, mask: &[f64]) -> Self {
        let n = record.len();
        let dt = record.dt;
        let sight = Sight::of(record, reference.structure);
        let mean = (mask.iter().map(|w| w * w).sum::<f64>() / n as f64).sqrt();
        let taper: Vec<f64> = mask.iter().map(|w| w / mean).collect();
        let weighed = 1.0 - record.idle.iter().map(std::ops::Range::len).sum::<usize>() as f64 / n as f64;
        let step = std::f64::consts::TAU / (n as f64 * dt);
        let count = ((limit * std::f64::consts::TAU / step) as usize).clamp(4.min(n / 2), n / 2 - 1) + 1;
        let omega: Vec<f64> = (0..count).map(|m| m as f64 * step).collect();
        let weight = (0..count).map(|m| if m == 0 { 0.5 } else { 1.0 }).collect();
        let common = if sight == Sight::Both { record.common_noise } else { 0.0 };
        let noise_of = |i: usize, w: f64| -> f64 {
            match record.channels[2 * i] {
                Some(_) => record.position_noise(i, w / std::f64::consts::TAU) - common,
                None => (record.noise[2 * i + 1] / w.max(0.5 * step)).powi(2),
            }
        };
        let spread = spread(&omega, &taper, dt);
        let noise = spread.iter().map(|&w| [noise_of(0, w), noise_of(1, w)]).collect();
        let one = C::new(1.0, 0.0);
        let combine = spread
            .iter()
            .map(|&w| {
                let d = stiffness(&reference.parameters, reference.structure, w, dt);
                match sight {
                    Sight::Rigid | Sight::Both => [one, one],
                    Sight::Motor | Sight::Table => {
                        let u = if sight == Sight::Motor { [d[1][1], -d[0][1]] } else { [d[1][0], -d[0][0]] };
                        let norm = (u[0].norm_sqr() + u[1].norm_sqr()).sqrt();
                        u.map(|x| x / norm)
                    }
                }
            })
            .collect();
        let mut band = Self {
            n,
            dt,
            sight,
            taper,
            omega,
            weight,
            noise,
            common,
            combine,
            spread,
            reference: Vec::new(),
            weighed,
            motion_is_given: false,
        };
        band.reference = band.weights(reference);
        band
    }

    /// The same with the motion given.
    #[must_use]
    pub fn with_motion_given(&self) -> Self {
        Self { motion_is_given: true, ..self.clone() }
    }

    /// Whether the motion is given, and not the torque.
    #[must_use]
    pub const fn motion_is_given(&self) -> bool {
        self.motion_is_given
    }

    /// The stiffness of parameters as the equations show it at a bin: of one equation its first entry. There the side without an encoder
    /// follows the other as it does in a `model`: `x11 - 2 a x12 + a^2 x22`, `a = d12/d22` of that, for the model itself the Schur
    /// complement `d11 - d12^2/d22`, and for a part of it what the complement gains by that part.
    fn visible(&self, part: &Parameters, model: &Parameters, m: usize) -> [[C; 2]; 2] {
        let structure = if self.sight == Sight::Rigid { Structure::Rigid } else { Structure::TwoInertia };
        let of = |p: &Parameters| stiffness(p, structure, self.spread[m], self.dt);
        let x = of(part);
        let (side, hidden) = match self.sight {
            Sight::Rigid | Sight::Both => return x,
            Sight::Motor => (0, 1),
            Sight::Table => (1, 0),
        };
        let d = of(model);
        let transfer = d[side][hidden] / d[hidden][hidden];
        let mut seen = [[C::default(); 2]; 2];
        seen[0][0] = self.combine[m][side]
            * (x[side][side] - x[side][hidden] * transfer * 2.0 + x[hidden][hidden] * transfer * transfer);
        seen
    }

    /// The stiffness of a model as the equations show it at a bin, with its third inertias in it.
    fn visible_of(&self, model: &Model, modes: &[Hidden], m: usize) -> [[C; 2]; 2] {
        let mut v = self.visible(&model.parameters, &model.parameters, m);
        for mode in modes {
            let (i, by) = self.entry(mode.side, m);
            v[i][i] += mode.effective_inertia(self.spread[m], self.dt) * by;
        }
        v
    }

    /// Where an inertia at a side stands in the stiffness that the equations show at a bin, and the stiffness there of one kg.m2.
    fn entry(&self, side: usize, m: usize) -> (usize, C) {
        let s2 = square(self.spread[m], self.dt);
        if self.sight == Sight::Both { (side, C::new(s2, 0.0)) } else { (0, self.combine[m][side] * s2) }
    }

    /// Noise of each encoder that the equations see.
    fn seen(&self, m: usize) -> [f64; 2] {
        let [n1, n2] = self.noise[m];
        if self.sight == Sight::Table { [n2, 0.0] } else { [n1, n2] }
    }

    /// What the noise makes in the equations of a model.
    pub fn weights(&self, model: &Model) -> Vec<Weight> {
        let modes: Vec<Hidden> = Hidden::modes(model, self.sides()).collect();
        (0..self.omega.len())
            .map(|m| {
                let v = self.visible_of(model, &modes, m);
                let [n1, n2] = self.seen(m);
                let (noise, det) = if self.sight == Sight::Both {
                    // Moved together the sides do not strain the spring.
                    let in_phase = v.map(|row| row[0] + row[1]);
                    let of = |i: usize, j: usize| {
                        v[i][0] * v[j][0].conj() * n1
                            + v[i][1] * v[j][1].conj() * n2
                            + in_phase[i] * in_phase[j].conj() * self.common
                    };
                    ((of(0, 0).re, of(1, 1).re, of(0, 1)), v[0][0] * v[1][1] - v[0][1] * v[1][0])
                } else {
                    ((v[0][0].norm_sqr() * n1, 0.0, C::default()), v[0][0])
                };
                let before = self.reference.get(m).map_or(0.0, |r| r.density);
                Weight { noise, density: det.norm_sqr().max(f64::MIN_POSITIVE).ln() - before }
            })
            .collect()
    }

    /// The sides that are measured; the first stands for both of a rigid axis.
    pub const fn sides(&self) -> &'static [usize] {
        match self.sight {
            Sight::Rigid | Sight::Motor => &[0],
            Sight::Table => &[1],
            Sight::Both => &[0, 1],
        }
    }

    pub fn equations(&self) -> usize {
        if self.sight == Sight::Both { 2 } else { 1 }
    }

    /// Spectra of the equations of torques on motor and table, times a factor.
    pub fn rows(&self, torque: &Torques, factor: f64, planner: &mut FftPlanner<f64>) -> [Vec<C>; 2] {
        let mut z: Vec<C> = (0..self.n).map(|k| C::new(torque[0][k], torque[1][k]) * self.taper[k]).collect();
        planner.plan_fft_forward(self.n).process(&mut z);
        let scale = factor / (self.n as f64).sqrt();
        let count = self.omega.len();
        let mut rows = [Vec::with_capacity(count), Vec::with_capacity(count)];
        for m in 0..count {
            let (a, b) = (z[m], z[(self.n - m) % self.n].conj());
            let one = (a + b) * (0.5 * scale);
            let two = (a - b) * C::new(0.0, -0.5 * scale);
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

    /// Spectra of the torque on motor and table that a model lacks along a motion, `[theta1, omega1, theta2, omega2]` a sample. What hidden
    /// inertias began with is taken out at a discrepancy; at the rows' own power where none is known.
    pub fn torque_residual(
        &self,
        model: &Model,
        torque: &Torques,
        motion: &[[f64; 4]],
        weighed_at: Option<Discrepancy>,
        planner: &mut FftPlanner<f64>,
    ) -> TorqueResidual {
        let rows = self.rows(torque, 1.0, planner);
        let p = &model.parameters;
        let most = p.i1.max(p.i2);
        let alike = if self.sight == Sight::Both { [p.i1, p.i2].map(|i| (i / most).powi(2)) } else { [1.0, 0.0] };
        let vibrations = vibrations(self, model, motion, planner);
        let whole = if vibrations.is_empty() { [Vec::new(), Vec::new()] } else { rows.clone() };
        let weights = self.weights(model);
        let known = weighed_at.is_some();
        let weighed_at = weighed_at.unwrap_or_else(|| [0, 1].map(|i| self.power(&rows[i])));
        let mut residual = TorqueResidual { rows, weights, weighed_at, whole, vibrations, acts: 0.0, alike };
        self.weigh(&mut residual, weighed_at);
        if !known && !residual.vibrations.is_empty() {
            let s = self.discrepancy(&residual);
            self.weigh(&mut residual, s);
        }
        residual
    }

    /// Takes out anew what hidden inertias began with, at another discrepancy.
    pub fn weigh(&self, residual: &mut TorqueResidual, s: Discrepancy) {
        if residual.vibrations.is_empty() {
            return;
        }
        residual.weighed_at = s;
        residual.rows.clone_from(&residual.whole);
        for vibration in &residual.vibrations {
            vibration.take_out(self, &residual.weights, s, &mut residual.rows);
        }
    }

    /// Mean power of rows, N.m squared a sample of the band.
    pub(super) fn power(&self, rows: &[C]) -> f64 {
        let total: f64 = self.weight.iter().sum();
        rows.iter().zip(&self.weight).map(|(r, w)| w * r.norm_sqr()).sum::<f64>() / total
    }

    /// Rows of a torque on one side.
    pub fn at_side(&self, side: usize, torque: &[C]) -> [Vec<C>; 2] {
        if self.sight != Sight::Both {
            return [torque.iter().zip(&self.combine).map(|(t, c)| c[side] * t).collect(), Vec::new()];
        }
        let none = vec![C::default(); torque.len()];
        if side == 1 { [none, torque.to_vec()] } else { [torque.to_vec(), none] }
    }

    /// Spectra of the measured motion, which the torque of a base parameter follows; `None` where a position is missing.
    pub fn motion(&self, record: &Record) -> Option<MotionSpectra> {
        let side = |i: usize| record.channels[2 * i].as_deref();
        let sides = match self.sight {
            Sight::Both => [side(0)?, side(1)?],
            Sight::Rigid => {
                let y = match (side(0), side(1)) {
                    (Some(_), Some(_)) => return None,
                    (a, b) => a.or(b)?,
                };
                [y, y]
            }
            Sight::Motor | Sight::Table => return None,
        };
        let twist: Vec<f64> = sides[0].iter().zip(sides[1]).map(|(a, b)| a - b).collect();
        Some(MotionSpectra {
            acceleration: sides.map(|y| self.acceleration(y)),
            rate: self.spectrum(|k| (twist[k + 1] - twist[k - 1]) / (2.0 * self.dt)),
            twist: self.spectrum(|k| twist[k]),
        })
    }

    /// What a step of a base parameter adds to the rows, along the motion as measured: the linear axis' own torque.
    pub fn base_column(&self, p: BaseParameter, motion: &MotionSpectra, slope: f64) -> [Vec<C>; 2] {
        let by = slope / (self.n as f64).sqrt();
        let of = |series: &[C], by: f64| -> Vec<C> { series.iter().map(|s| *s * by).collect() };
        let none = || vec![C::default(); self.omega.len()];
        match p {
            BaseParameter::I1 => [of(&motion.acceleration[0], by), none()],
            BaseParameter::I2 if self.sight == Sight::Rigid => [of(&motion.acceleration[0], by), none()],
            BaseParameter::I2 => [none(), of(&motion.acceleration[1], by)],
            BaseParameter::B => [of(&motion.rate, by), of(&motion.rate, -by)],
            BaseParameter::K => [of(&motion.twist, by), of(&motion.twist, -by)],
        }
    }

    /// Spectrum of the acceleration of a motion.
    pub fn acceleration(&self, y: &[f64]) -> Vec<C> {
        self.spectrum(|k| (y[k + 1] - 2.0 * y[k] + y[k - 1]) / (self.dt * self.dt))
    }

    /// Spectrum in the band of a series that is told inside the record alone.
    fn spectrum(&self, inside: impl Fn(usize) -> f64) -> Vec<C> {
        let at = |k: usize| if k == 0 || k + 1 >= self.n { 0.0 } else { inside(k) * self.taper[k] };
        let mut z: Vec<C> = (0..self.n).map(|k| C::new(at(k), 0.0)).collect();
        FftPlanner::new().plan_fft_forward(self.n).process(&mut z);
        z.truncate(self.omega.len());
        z
    }

    /// What a third inertia on a spring, `[inertia, stiffness, damping]`, on one side adds to the rows along an acceleration.
    pub fn mode_column(&self, side: usize, acceleration: &[C], mode: [f64; 3]) -> [Vec<C>; 2] {
        let by = 1.0 / (self.n as f64).sqrt();
        let torque = |m: usize| mode_inertia(mode, self.omega[m], self.dt) * acceleration[m] * by;
        self.at_side(side, &(0..self.omega.len()).map(torque).collect::<Vec<C>>())
    }

    /// Inverse of the covariance's Cholesky factor at each bin: `z0 = a r1`, `z1 = b r1 + c r2`; and log det.
    pub(super) fn factor(&self, weight: Weight, s: Discrepancy) -> (f64, C, f64, f64) {
        let (n11, n22, n12) = weight.noise;
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
    pub fn whiten(&self, rows: &[Vec<C>; 2], weights: &[Weight], s: Discrepancy) -> Vec<f64> {
        let count = self.omega.len();
        let mut out = Vec::with_capacity(2 * count * self.equations());
        for (m, (&first, &weight)) in rows[0].iter().zip(&self.weight).enumerate() {
            let (a, b, c, _) = self.factor(weights[m], s);
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

    /// Log likelihood at that discrepancy, per density of readings.
    pub fn log_likelihood(&self, l: &TorqueResidual, s: Discrepancy) -> f64 {
        let both = self.sight == Sight::Both;
        let bin = |(m, (noise, weight)): (usize, (&Weight, &f64))| {
            let (a, b, c, log_det) = self.factor(*noise, s);
            let first = l.rows[0][m];
            let second = if both { (b * first + l.rows[1][m] * c).norm_sqr() } else { 0.0 };
            let density =
                if self.motion_is_given { log_det - self.factor(self.reference[m], s).3 } else { noise.density };
            weight * ((first * a).norm_sqr() + second + log_det - density)
        };
        l.acts - l.weights.iter().zip(&self.weight).enumerate().map(bin).sum::<f64>()
    }

    /// Real values compared.
    pub fn values(&self) -> f64 {
        2.0 * self.weight.iter().sum::<f64>() * self.equations() as f64
    }

    /// Share of the values that are independent: of a residual whose power is spread unevenly fewer are.
    pub fn independent(&self, l: &TorqueResidual, s: Discrepancy) -> f64 {
        let z = self.whiten(&l.rows, &l.weights, s);
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
        self.weighed * share / self.equations() as f64
    }

    /// Mean power of the noise in an equation, N.m squared a sample of the band.
    pub fn noise_power(&self, i: usize) -> f64 {
        let total: f64 = self.weight.iter().sum();
        self.reference
            .iter()
            .zip(&self.weight)
            .map(|(n, w)| w * if i == 0 { n.noise.0 } else { n.noise.1 })
            .sum::<f64>()
            / total
    }

    /// Rms of the residual over that of the noise, each frequency at its weight.
    pub fn noise_multiple(&self, l: &TorqueResidual) -> f64 {
        let z = self.whiten(&l.rows, &l.weights, [0.0; 2]);
        (z.iter().map(|v| v * v).sum::<f64>() / self.values()).sqrt()
    }

    /// Whether a residual is no more than some noises.
    pub fn is_near_the_noise(&self, l: &TorqueResidual) -> bool {
        self.noise_multiple(l) < NEAR_THE_NOISE
    }

    /// Whether a residual is at the noise's floor, which is an estimate itself.
    pub fn at_floor(&self, l: &TorqueResidual) -> bool {
        self.noise_multiple(l).powi(2) < AT_FLOOR
    }

    /// Rms in the band of the residual torque beyond what the noise makes, N.m; of two equations together.
    pub fn torque_rms(&self, s: Discrepancy) -> f64 {
        let samples = 2.0 * self.weight.iter().sum::<f64>() / self.n as f64;
        (s.iter().take(self.equations()).sum::<f64>() * samples).sqrt()
    }

    /// The same over the rms of the torque about its mean.
    pub fn torque_share(&self, s: Discrepancy, record: &Record) -> f64 {
        self.torque_rms(s) / deviation(&record.torque).max(f64::MIN_POSITIVE)
    }

    /// Rms in the band of the torque that the noise makes, N.m; of two equations together.
    pub fn noise_rms(&self) -> f64 {
        let noise = [0, 1].map(|i| if i < self.equations() { self.noise_power(i) } else { 0.0 });
        self.torque_rms(noise)
    }
}

#[cfg(test)]
impl TorqueResidual {
    /// Nothing lacking in no band.
    pub fn nothing() -> Self {
        Self {
            rows: [Vec::new(), Vec::new()],
            weights: Vec::new(),
            weighed_at: [0.0; 2],
            whole: [Vec::new(), Vec::new()],
            vibrations: Vec::new(),
            acts: 0.0,
            alike: [1.0; 2],
        }
    }
}
