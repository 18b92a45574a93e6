//! One step of `y'' + b*y' + k*y = u`, as a linear map: by Newmark's method, or exactly.
//!
//! The twist of the axis obeys this equation with `b = B*(1/I1 + 1/I2)`, `k = K*(1/I1 + 1/I2)`; its centre of inertia
//! obeys it with `b = k = 0`. Newmark's method is linear, so stepping the two modes is stepping the axis.

use crate::scalar::Scalar;

/// Most halvings of a step: one that turns by more than 2^64 radians has no digit of its phase left.
const HALVINGS: u32 = 64;

/// How the linear part of the axis is stepped.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Scheme {
    /// Newmark's method in acceleration form (paper, appendix 1, eq. a to c):
    /// `v+ = v + h*((1 - delta)*a + delta*a+)`, `x+ = x + h*v + h^2*((1/2 - alpha)*a + alpha*a+)`.
    Newmark {
        /// Weight of the new acceleration in the position; 1/4 in the paper.
        alpha: f64,
        /// Weight of the new acceleration in the velocity; 1/2 in the paper.
        delta: f64,
    },
    /// The exact response to an input linear over the step (matrix exponential with first-order hold).
    Exact,
}

impl Scheme {
    /// The paper's choice: alpha 1/4, delta 1/2, which is the trapezoidal rule.
    pub const NEWMARK: Self = Self::Newmark { alpha: 0.25, delta: 0.5 };
}

/// Coefficients of one step: `y+ = yy*y + yv*v + y0*u0 + y1*u1` and `v+ = vy*y + vv*v + v0*u0 + v1*u1`.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct OscillatorStep<S> {
    pub yy: S,
    pub yv: S,
    pub y0: S,
    pub y1: S,
    pub vy: S,
    pub vv: S,
    pub v0: S,
    pub v1: S,
}

impl<S: Scalar> OscillatorStep<S> {
    /// The step of length `h` for damping `b` and stiffness `k`, both per unit inertia.
    pub fn new(scheme: Scheme, b: S, k: S, h: S) -> Self {
        match scheme {
            Scheme::Newmark { alpha, delta } => Self::newmark(alpha, delta, b, k, h),
            Scheme::Exact => Self::exact(b, k, h),
        }
    }

    /// The same without damping and stiffness.
    pub fn free(scheme: Scheme, h: S) -> Self {
        let one = S::from(1.0);
        let (alpha, delta) = match scheme {
            Scheme::Newmark { alpha, delta } => (alpha, delta),
            Scheme::Exact => (1.0 / 6.0, 0.5),
        };
        Self {
            yy: one,
            yv: h,
            y0: h * h * (0.5 - alpha),
            y1: h * h * alpha,
            vy: S::default(),
            vv: one,
            v0: h * (1.0 - delta),
            v1: h * delta,
        }
    }

    fn newmark(alpha: f64, delta: f64, b: S, k: S, h: S) -> Self {
        let one = S::from(1.0);
        let effective = one / (one + h * b * delta + h * h * k * alpha);
        // Predictors: yp = y + h*v + (1/2 - alpha)*h^2*a, vp = v + (1 - delta)*h*a, with a = u0 - b*v - k*y.
        let py = h * h * (0.5 - alpha);
        let pv = h * (1.0 - delta);
        let row = |yp: S, vp: S, u1: S| {
            let a = (u1 - b * vp - k * yp) * effective;
            (yp + h * h * a * alpha, vp + h * a * delta)
        };
        let (yy, vy) = row(one - py * k, -(pv * k), S::default());
        let (yv, vv) = row(h - py * b, one - pv * b, S::default());
        let (y0, v0) = row(py, pv, S::default());
        let (y1, v1) = row(S::default(), S::default(), one);
        Self { yy, yv, y0, y1, vy, vv, v0, v1 }
    }

    /// By the power series of the impulse response `q`: `q'' + b*q' + k*q = 0`, `q(0) = 0`, `q'(0) = 1`. Its terms
    /// `c_n*h^n` follow from `c_(n+2) = -(b*(n+1)*c_(n+1) + k*c_n)/((n+1)*(n+2))`; the step and ramp responses are its
    /// first and second integral, term by term. A long step is halved first and squared back.
    fn exact(b: S, k: S, h: S) -> Self {
        let mut size = (b.re() * h.re()).abs() + k.re().abs().sqrt() * h.re().abs();
        let (mut h, mut halvings) = (h, 0);
        while size > 1.0 && halvings < HALVINGS {
            (size, h, halvings) = (0.5 * size, h * 0.5, halvings + 1);
        }
        (0..halvings).fold(Self::short(b, k, h), |step, _| step.doubled())
    }

    /// The same of a step that turns by no more than a radian.
    fn short(b: S, k: S, h: S) -> Self {
        let (bh, kh) = (b * h, k * h * h);
        // In units of the step: terms t_n = c_n*h^(n-1).
        let (mut previous, mut term) = (S::default(), S::from(1.0));
        let (mut q, mut dq, mut q1, mut q2) = (term, term, term * 0.5, term * (1.0 / 6.0));
        for n in 1..40_u32 {
            let n = f64::from(n);
            let next = -(bh * term * n + kh * previous) / (n * (n + 1.0));
            previous = term;
            term = next;
            q += term;
            dq += term * (n + 1.0);
            q1 += term * (1.0 / (n + 2.0));
            q2 += term * (1.0 / ((n + 2.0) * (n + 3.0)));
            if term.re().abs() < 1e-18 && previous.re().abs() < 1e-18 {
                break;
            }
        }
        let one = S::from(1.0);
        let h2 = h * h;
        Self {
            yy: one - kh * q1,
            yv: h * q,
            y0: h2 * (q1 - q2),
            y1: h2 * q2,
            vy: -(k * h * q),
            vv: dq,
            v0: h * (q - q1),
            v1: h * q1,
        }
    }

    /// Two such steps as one of twice the length; the input in the middle is the mean of its ends.
    fn doubled(&self) -> Self {
        let c = self;
        let through = |y: S, v: S| (c.yy * y + c.yv * v, c.vy * y + c.vv * v);
        let (yy, vy) = through(c.yy, c.vy);
        let (yv, vv) = through(c.yv, c.vv);
        let (a0, b0) = through(c.y0 + c.y1 * 0.5, c.v0 + c.v1 * 0.5);
        let (a1, b1) = through(c.y1 * 0.5, c.v1 * 0.5);
        Self {
            yy,
            yv,
            vy,
            vv,
            y0: a0 + c.y0 * 0.5,
            v0: b0 + c.v0 * 0.5,
            y1: a1 + c.y0 * 0.5 + c.y1,
            v1: b1 + c.v0 * 0.5 + c.v1,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{OscillatorStep, Scheme};

    #[test]
    fn the_exact_step_is_the_closed_form_of_a_damped_oscillator() {
        let (wn, zeta, h) = (54.5_f64, 0.3_f64, 7.0e-3_f64);
        let c = OscillatorStep::new(Scheme::Exact, 2.0 * zeta * wn, wn * wn, h);
        let wd = wn * (1.0 - zeta * zeta).sqrt();
        let e = (-zeta * wn * h).exp();
        let (s, co) = (wd * h).sin_cos();
        assert!((c.yy - e * (co + zeta * wn / wd * s)).abs() < 1e-14);
        assert!((c.yv - e * s / wd).abs() < 1e-15);
        assert!((c.vv - e * (co - zeta * wn / wd * s)).abs() < 1e-14);
        // A constant input reaches (1 - yy)/k.
        assert!((c.y0 + c.y1 - (1.0 - c.yy) / (wn * wn)).abs() < 1e-17);
    }

    #[test]
    fn a_long_step_equals_many_short_ones() {
        let (b, k) = (40.0, 3.0e4);
        let long = OscillatorStep::new(Scheme::Exact, b, k, 0.05);
        let short = OscillatorStep::new(Scheme::Exact, b, k, 0.05 / 50.0);
        let (mut y, mut v) = (0.3, -2.0);
        for n in 0..50 {
            let u = |j: i32| 1.0 + 4.0 * f64::from(j) / 50.0;
            let (u0, u1) = (u(n), u(n + 1));
            (y, v) = (
                short.yy * y + short.yv * v + short.y0 * u0 + short.y1 * u1,
                short.vy * y + short.vv * v + short.v0 * u0 + short.v1 * u1,
            );
        }
        let yl = long.yy * 0.3 + long.yv * -2.0 + long.y0 + long.y1 * 5.0;
        let vl = long.vy * 0.3 + long.vv * -2.0 + long.v0 + long.v1 * 5.0;
        assert!((y - yl).abs() < 1e-13 && (v - vl).abs() < 1e-11, "{y} {yl} {v} {vl}");
    }
}
