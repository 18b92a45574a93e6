//! One step of the linear axis: its centre of inertia and its twist, each an oscillator.
//!
//! With `M = I1 + I2`, `r = I2/M`, twist `d = th1 - th2`: the centre `c = th1 - r*d` obeys `c'' = (tau1 + tau2)/M`, the
//! twist `d'' + (B/mu)*d' + (K/mu)*d = tau1/I1 - tau2/I2`, `1/mu = 1/I1 + 1/I2`. The state keeps `th1` and `d`, so that
//! a turning axis loses no digits of the twist.

use super::oscillator::{OscillatorStep, Scheme};
use super::parameters::{Parameters, Structure};
use crate::scalar::Scalar;

/// Positions and velocities: `[th1, w1, d, d']`, rad and rad/s.
pub type Linear<S> = [S; 4];

/// The linear step of one length.
#[derive(Debug, Clone, Copy)]
pub struct Propagator<S = f64> {
    h: S,
    structure: Structure,
    scheme: Scheme,
    /// Damping and stiffness of the twist, per unit of its inertia.
    damping: S,
    stiffness: S,
    /// `I2/M`.
    share: S,
    inverse_total: S,
    inverse_1: S,
    inverse_2: S,
    centre: OscillatorStep<S>,
    twist: OscillatorStep<S>,
}

impl<S: Scalar> Propagator<S> {
    /// The step of length `h` seconds.
    pub fn new(p: &Parameters<S>, structure: Structure, scheme: Scheme, h: S) -> Self {
        let one = S::from(1.0);
        let total = p.i1 + p.i2;
        let inverse_total = one / total;
        let zero = S::default();
        // Rigid: every coefficient of the twist is zero, and both inertias move as one.
        let (share, inverse_1, inverse_2, damping, stiffness) = match structure {
            Structure::TwoInertia => {
                let mobility = p.twist_mobility();
                (p.i2 * inverse_total, one / p.i1, one / p.i2, p.b * mobility, p.k * mobility)
            }
            Structure::Rigid => (zero, zero, zero, zero, zero),
        };
        let still = OscillatorStep::default();
        Self {
            h,
            structure,
            scheme,
            damping,
            stiffness,
            share,
            inverse_total,
            inverse_1,
            inverse_2,
            centre: still,
            twist: still,
        }
        .of_length(h)
    }

    /// The same of another length.
    pub(super) fn of_length(&self, h: S) -> Self {
        let twist = match self.structure {
            Structure::TwoInertia => OscillatorStep::new(self.scheme, self.damping, self.stiffness, h),
            Structure::Rigid => OscillatorStep::default(),
        };
        Self { h, centre: OscillatorStep::free(self.scheme, h), twist, ..*self }
    }

    /// Length of the step, s.
    pub fn h(&self) -> S {
        self.h
    }

    /// The state after the step, under torques on motor and table that run linearly from `tau0` to `tau1`, N.m.
    #[inline]
    pub fn apply(&self, s: &Linear<S>, tau0: [S; 2], tau1: [S; 2]) -> Linear<S> {
        let a0 = (tau0[0] + tau0[1]) * self.inverse_total;
        let a1 = (tau1[0] + tau1[1]) * self.inverse_total;
        let u0 = tau0[0] * self.inverse_1 - tau0[1] * self.inverse_2;
        let u1 = tau1[0] * self.inverse_1 - tau1[1] * self.inverse_2;
        let t = &self.twist;
        let d = t.yy * s[2] + t.yv * s[3] + t.y0 * u0 + t.y1 * u1;
        let v = t.vy * s[2] + t.vv * s[3] + t.v0 * u0 + t.v1 * u1;
        [
            s[0] + self.h * s[1]
                + (self.centre.y0 * a0 + self.centre.y1 * a1)
                + self.share * (d - s[2] - self.h * s[3]),
            s[1] + (self.centre.v0 * a0 + self.centre.v1 * a1) + self.share * (v - s[3]),
            d,
            v,
        ]
    }

    /// The end of a step with `torque` less on motor and table at its end.
    #[inline]
    pub(super) fn less(&self, end: &Linear<S>, torque: [S; 2]) -> Linear<S> {
        let a = (torque[0] + torque[1]) * self.inverse_total;
        let u = torque[0] * self.inverse_1 - torque[1] * self.inverse_2;
        let (d, v) = (self.twist.y1 * u, self.twist.v1 * u);
        [
            end[0] - (self.centre.y1 * a + self.share * d),
            end[1] - (self.centre.v1 * a + self.share * v),
            end[2] - d,
            end[3] - v,
        ]
    }

    /// Compliance of the velocity of inertia `i` at the end to a torque on inertia `j` that is constant over the step, rad/(N.m.s).
    pub(super) fn velocity_per_constant_torque(&self) -> [[S; 2]; 2] {
        self.gain(|c| c.v0 + c.v1)
    }

    /// Compliance of position and velocity at the end to the torque at the end: the real parts, row = inertia that moves.
    pub(super) fn compliance(&self) -> Compliance {
        let re = |g: [[S; 2]; 2]| g.map(|row| row.map(S::re));
        Compliance {
            position: re(self.gain(|c| c.y1)),
            velocity: re(self.gain(|c| c.v1)),
            constant_position: re(self.gain(|c| c.y0 + c.y1)),
            constant_velocity: re(self.gain(|c| c.v0 + c.v1)),
        }
    }

    fn gain(&self, coefficient: impl Fn(&OscillatorStep<S>) -> S) -> [[S; 2]; 2] {
        let centre = coefficient(&self.centre) * self.inverse_total;
        let twist = coefficient(&self.twist);
        let (d1, d2) = (twist * self.inverse_1, -(twist * self.inverse_2));
        let other = self.share - 1.0;
        let second = |d: S| if self.inverse_2.re() == 0.0 { S::default() } else { other * d };
        [[centre + self.share * d1, centre + self.share * d2], [centre + second(d1), centre + second(d2)]]
    }
}

/// Real 2 x 2 compliances of the end of the step to torques; row = inertia that moves, column = inertia under the torque.
#[derive(Debug, Clone, Copy)]
pub(super) struct Compliance {
    pub position: [[f64; 2]; 2],
    pub velocity: [[f64; 2]; 2],
    pub constant_position: [[f64; 2]; 2],
    pub constant_velocity: [[f64; 2]; 2],
}
