//! Hysteresis of the coupling: a rate-independent loop in parallel with the spring.
//!
//! `f = level*z`, `reach*dz = dd*(1 - |z|^sharpness*(1 + sgn(dd*z))/2)`: the Bouc-Wen loop with beta = gamma, which turns
//! with the stiffness `level/reach` and closes at `level`. Wen, J. Eng. Mech. 102(2), 1976; Ikhouane, Rodellar, Systems
//! with Hysteresis, Wiley 2007, chapter 2.

use super::family::Family;
use super::info::{EffectInfo, ParameterInfo, Place, Scale, Start, Variant};
use super::shapes::{Base, Force, Internal, Moment, Reaction};
use crate::scalar::Scalar;

/// Hysteresis of the coupling.
pub struct CouplingHysteresis;

/// `dz/dx` of the loop, x the twist in units of the reach, moving in `direction`.
fn slope<S: Scalar>(z: S, direction: f64, sharpness: S) -> S {
    if z.re() * direction > 0.0 { S::from(1.0) - z.abs().powf(sharpness) } else { S::from(1.0) }
}

/// The loop after a move `x` in units of the reach: classical Runge-Kutta, in parts of at most half a reach.
fn advance<S: Scalar>(z: S, x: S, sharpness: S) -> S {
    let direction = x.re().signum();
    let (mut dx, mut parts) = (x, 1);
    if x.re().abs() > 0.5 {
        let many = (2.0 * x.re().abs()).ceil().min(32.0);
        (dx, parts) = (x / many, many as usize);
    }
    let (half, sixth) = (dx * 0.5, dx * (1.0 / 6.0));
    let mut z = z;
    for _ in 0..parts {
        let a = slope(z, direction, sharpness);
        let b = slope(z + half * a, direction, sharpness);
        let c = slope(z + half * b, direction, sharpness);
        let d = slope(z + dx * c, direction, sharpness);
        z += sixth * (a + b * 2.0 + c * 2.0 + d);
        if z.re().abs() > 1.0 {
            z = S::from(z.re().signum());
        }
    }
    z
}

impl Force for CouplingHysteresis {
    const INFO: EffectInfo = EffectInfo {
        id: "coupling_hysteresis",
        place: Place::Coupling,
        family: Family::Hysteresis,
        title: "A loop in the spring's characteristic that speed does not open",
        equation: "f = level*z; reach*dz = dd*(1 - |z|^sharpness*(1 + sgn(dd*z))/2)",
        signature: "r1 = -r2, a loop over the twist that slow motion does not close; odd lines",
        reference: "Wen, J. Eng. Mech. 102(2), 1976; Ikhouane, Rodellar, Systems with Hysteresis, 2007",
        parameters: &[
            ParameterInfo::size("level", "N.m", 0.0, 1e6, "Torque of the loop when it has closed").nominal(1e-2),
            ParameterInfo::shape("reach", "rad", 1e-2, 1e-9, 1e3, "Twist over which the loop closes")
                .start(Start::Grid(Scale::Twist, &[0.03, 0.1, 0.3, 1.0])),
            ParameterInfo::shape("sharpness", "1", 1.0, 0.2, 20.0, "How abruptly the loop yields"),
        ],
        memory: 1,
        named: true,
        textbook: false,
        odds: 1.0,
        // A loop that the twist does not close is a spring; a multisine's swings to and fro by four times its rms and more.
        bounds: |p, x| p[0] <= x.torque && p[1] <= 4.0 * x.twist,
        example: &[1e-3, 0.02, 1.5],
        variants: &[Variant { name: "", free: &[0, 1] }, Variant { name: "sharp", free: &[0, 1, 2] }],
    };

    #[inline]
    fn torque<S: Scalar>(p: &[S], _base: &Base<S>, m: &Moment<S>, z: &mut [Internal<S>]) -> Reaction<S> {
        let per_reach = S::from(1.0) / p[1];
        let dx = if m.h.re() == 0.0 { S::default() } else { (m.end.x - m.start.x) * per_reach };
        let after = advance(z[0].start, dx, p[2]);
        let tangent = slope(after, if dx.re() < 0.0 { -1.0 } else { 1.0 }, p[2]).re() * per_reach.re();
        z[0].set_end(after, tangent, 0.0);
        Reaction { torque: p[0] * after, stiffness: p[0].re() * tangent, damping: 0.0, curvature: f64::INFINITY }
    }
}
