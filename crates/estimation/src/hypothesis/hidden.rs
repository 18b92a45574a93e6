//! Inertias that no encoder shows: the other side of a coupling, a third inertia on a spring.
//!
//! Held at its place, such an inertia swings freely with `I y'' + B y' + K y = 0`, `y` its position relative to the place. How it swung
//! when the record began is not known: its torque then has two decaying sines in it, whose sizes belong to the record and to no
//! hypothesis. What the residual torque has of those is taken out of it (variable projection: Golub, Pereyra, SIAM J. Numer. Anal. 10, 1973).

use rustfft::FftPlanner;

use super::discrepancy::Discrepancy;
use super::likelihood::{Band, C, Weight, mode_inertia, square};
use super::model::Model;
use super::problem::largest;
use crate::axis::Structure;
use crate::effects::{EFFECTS, Effect};
use crate::trace::numerics::dot;

/// Share of the second sine that must be left beside the first for it to be another one.
const OWN: f64 = 1e-3;

/// An inertia without an encoder.
pub struct Hidden {
    /// The measured side that it pulls at.
    pub side: usize,
    inertia: f64,
    stiffness: f64,
    damping: f64,
}

impl Hidden {
    /// The other side of the coupling, where one side of a model is measured.
    fn across(model: &Model, sides: &[usize]) -> Option<Self> {
        let p = &model.parameters;
        let &[side] = sides else { return None };
        let inertia = if side == 0 { p.i2 } else { p.i1 };
        (model.structure == Structure::TwoInertia).then_some(Self { side, inertia, stiffness: p.k, damping: p.b })
    }

    /// Third inertias of a model of which these sides are measured.
    pub fn modes(model: &Model, sides: &[usize]) -> impl Iterator<Item = Self> {
        EFFECTS.iter().filter_map(move |e| Self::of_effect(*e, model, sides))
    }

    /// The third inertia that an effect is, where it is on and at a side that is measured: on a rigid axis any is the first.
    pub fn of_effect(effect: Effect, model: &Model, sides: &[usize]) -> Option<Self> {
        if !effect.is_mode() || !model.effects.is_on(effect) {
            return None;
        }
        let rigid = model.structure == Structure::Rigid;
        let side = if rigid { 0 } else { effect.info().place.side() };
        let of = model.effects.of(effect);
        (rigid || sides.contains(&side)).then_some(Self { side, inertia: of[0], stiffness: of[1], damping: of[2] })
    }

    /// All of a model of which these sides are measured.
    pub fn of(model: &Model, sides: &[usize]) -> Vec<Self> {
        Self::across(model, sides).into_iter().chain(Self::modes(model, sides)).collect()
    }

    /// The inertia that it adds to its place at an angular frequency, kg.m2.
    pub fn effective_inertia(&self, w: f64, dt: f64) -> C {
        mode_inertia([self.inertia, self.stiffness, self.damping], w, dt)
    }

    /// What that gains with its inertia, its stiffness (kg.m2 per N.m/rad) and its damping (kg.m2 per N.m.s/rad).
    pub fn inertia_gains(&self, w: f64, dt: f64) -> [C; 3] {
        let rate = C::new(0.0, (w * dt).sin() / dt);
        let pull = rate * self.damping + self.stiffness;
        let inertial = square(w, dt) * self.inertia;
        let whole = (pull + inertial) * (pull + inertial);
        let of_pull = C::new(inertial * self.inertia, 0.0) / whole;
        [pull * pull / whole, of_pull, of_pull * rate]
    }

    /// Decay and angular frequency of its free vibration; `None` where it does not swing.
    fn vibration(&self) -> Option<C> {
        let decay = 0.5 * self.damping / self.inertia;
        let squared = self.stiffness / self.inertia - decay * decay;
        (squared > 0.0).then(|| C::new(-decay, squared.sqrt()))
    }

    /// Its torque against its place where that moves by `e`, straight from sample to sample, from rest: at every sample a jump of the
    /// relative speed, between them a free vibration.
    pub fn pull(&self, e: &[f64], dt: f64) -> Vec<f64> {
        let mut pull = vec![0.0; e.len()];
        // What is damped to death goes along.
        let Some(of) = self.vibration() else {
            for k in 1..e.len().saturating_sub(1) {
                pull[k] = self.inertia * (e[k + 1] - 2.0 * e[k] + e[k - 1]) / (dt * dt);
            }
            return pull;
        };
        let step = (of * dt).exp();
        let (decay, frequency) = (-of.re, of.im);
        let (mut y, mut rate) = (0.0, 0.0);
        for k in 1..e.len().saturating_sub(1) {
            let cosine = step.re;
            let sine = step.im / frequency;
            (y, rate) = (
                y * (cosine + decay * sine) + rate * sine,
                rate * (cosine - decay * sine) - y * sine * self.stiffness / self.inertia,
            );
            let jump = -(e[k + 1] - 2.0 * e[k] + e[k - 1]) / dt;
            pull[k] = -self.stiffness * y - self.damping * (rate + 0.5 * jump);
            rate += jump;
        }
        pull
    }
}

/// A free vibration from the record's first sample on.
#[derive(Debug, Clone)]
pub struct Vibration {
    /// Its rows as a decaying cosine and as a decaying sine of one N.m.
    parts: [[Vec<C>; 2]; 2],
    /// Its largest torque there, N.m.
    most: f64,
}

/// What the inertias without an encoder of a model may have begun with. A third inertia is no part of the axis, but an effect: it swings at
/// most as it does later along the motion, lest the smallest explain anything that dies away.
pub fn vibrations(band: &Band, model: &Model, motion: &[[f64; 4]], planner: &mut FftPlanner<f64>) -> Vec<Vibration> {
    let across = Hidden::across(model, band.sides()).map(|hidden| (hidden, f64::INFINITY));
    let mode = |hidden: Hidden| {
        let along: Vec<f64> = motion.iter().map(|m| m[2 * hidden.side]).collect();
        let most = largest(&hidden.pull(&along, band.dt));
        (hidden, most)
    };
    let modes = Hidden::modes(model, band.sides()).map(mode);
    across.into_iter().chain(modes).filter_map(|(hidden, most)| Vibration::of(&hidden, most, band, planner)).collect()
}

/// The same without bound: on a record that no fit has seen a model may have been swinging in any way.
pub fn any_vibrations(band: &Band, model: &Model, planner: &mut FftPlanner<f64>) -> Vec<Vibration> {
    let hidden = Hidden::of(model, band.sides());
    hidden.iter().filter_map(|hidden| Vibration::of(hidden, f64::INFINITY, band, planner)).collect()
}

impl Vibration {
    /// That of an inertia, its torque at most so large, N.m; `None` of one that does not swing.
    fn of(hidden: &Hidden, most: f64, band: &Band, planner: &mut FftPlanner<f64>) -> Option<Self> {
        // Faster than the record shows it is no part of the band.
        let of = hidden.vibration().filter(|of| of.im * band.dt < std::f64::consts::PI)?;
        let step = (of * band.dt).exp();
        let mut at = C::new(1.0, 0.0);
        let mut z: Vec<C> = Vec::with_capacity(band.n);
        for w in &band.taper {
            z.push(at * w);
            at *= step;
        }
        planner.plan_fft_forward(band.n).process(&mut z);
        let scale = 1.0 / (band.n as f64).sqrt();
        let parts = [(1.0, C::new(0.5, 0.0)), (-1.0, C::new(0.0, -0.5))].map(|(sign, turn)| {
            let spectrum = |m: usize| (z[m] + z[(band.n - m) % band.n].conj() * sign) * turn * scale;
            band.at_side(hidden.side, &(0..band.omega.len()).map(spectrum).collect::<Vec<C>>())
        });
        Some(Self { parts, most })
    }

    /// Takes it out of rows where that is likeliest: weighed as the likelihood does, for the torque of the noise grows with the square of
    /// the frequency, and fitted to that of the band's upper end a vibration would leave a multiple of the noise at its lower.
    pub fn take_out(&self, band: &Band, weights: &[Weight], s: Discrepancy, rows: &mut [Vec<C>; 2]) {
        let white = |rows: &[Vec<C>; 2]| band.whiten(rows, weights, s);
        let [cosine, sine] = self.parts.each_ref().map(white);
        let rest = white(rows);
        let (cc, ss, cs) = (dot(&cosine, &cosine), dot(&sine, &sine), dot(&cosine, &sine));
        let (cr, sr) = (dot(&cosine, &rest), dot(&sine, &rest));
        let determinant = cc * ss - cs * cs;
        // Of a vibration that is one curve within the record, one part.
        let (a, b) = if determinant > OWN * OWN * cc * ss {
            ((ss * cr - cs * sr) / determinant, (cc * sr - cs * cr) / determinant)
        } else {
            (cr / cc.max(f64::MIN_POSITIVE), 0.0)
        };
        let size = a.hypot(b);
        let share = if size > self.most { self.most / size } else { 1.0 };
        for (e, row) in rows.iter_mut().enumerate() {
            for (r, (c, s)) in row.iter_mut().zip(self.parts[0][e].iter().zip(&self.parts[1][e])) {
                *r -= (c * a + s * b) * share;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HIDDEN: Hidden = Hidden { side: 0, inertia: 2e-3, stiffness: 50.0, damping: 0.02 };

    #[test]
    fn it_pulls_as_its_transfer_says_once_it_has_swung_in() {
        // Den Hartog: the torque of a damped vibration absorber on its base, (k + jwb) I w^2/(k + jwb - I w^2) of the base's motion.
        let (dt, n) = (1e-4, 40_000);
        for w in [60.0, 140.0, 250.0] {
            let e: Vec<f64> = (0..n).map(|k| (w * dt * k as f64).sin()).collect();
            let spring = C::new(HIDDEN.stiffness, w * HIDDEN.damping);
            let transfer = -spring * HIDDEN.inertia * w * w / (spring - HIDDEN.inertia * w * w);
            let pull = HIDDEN.pull(&e, dt);
            for (k, pull) in pull.iter().enumerate().take(n - 1).skip(n - 2000) {
                let (sine, cosine) = (w * dt * k as f64).sin_cos();
                let exact = transfer.re * sine + transfer.im * cosine;
                assert!((pull - exact).abs() < 1e-3 * transfer.norm(), "{w} {k} {pull} {exact}");
            }
        }
    }

    #[test]
    fn what_it_adds_grows_with_its_parameters_as_differences_say() {
        let (w, dt) = (120.0, 1e-3);
        let at = |h: &Hidden| h.effective_inertia(w, dt);
        let moved = |f: fn(&mut Hidden) -> &mut f64| {
            let mut other = HIDDEN;
            let h = 1e-6 * *f(&mut other);
            *f(&mut other) += h;
            (at(&other) - at(&HIDDEN)) / h
        };
        let found = HIDDEN.inertia_gains(w, dt);
        for (found, of) in
            found.into_iter().zip([moved(|h| &mut h.inertia), moved(|h| &mut h.stiffness), moved(|h| &mut h.damping)])
        {
            assert!((found - of).norm() < 1e-4 * of.norm(), "{found} {of}");
        }
    }

    #[test]
    fn what_is_damped_to_death_goes_along() {
        let stiff = Hidden { damping: 10.0, ..HIDDEN };
        let pull = stiff.pull(&[0.0, 0.0, 0.5, 2.0, 4.5], 1.0);
        assert_eq!(pull, [0.0, 1e-3, 2e-3, 2e-3, 0.0]);
    }
}
