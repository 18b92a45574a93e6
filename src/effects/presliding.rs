//! Presliding friction: the LuGre bristle, for displacement before breakaway.
//!
//! `z' = v - stiffness*|v|/level*z`, `f = stiffness*z + damping*z'`. Canudas de Wit, Olsson, Astrom, Lischinsky, IEEE
//! TAC 40(3), 1995, with a constant level (Dahl's curve). Over a step the bristle follows the mean velocity exactly:
//! `z+ = z*exp(-a) + dx*(1 - exp(-a))/a` with `dx = h*(v + v+)/2`, `a = stiffness*|dx|/level`.

use super::info::{EffectInfo, Family, ParameterInfo, Place, Scale, Start, Variant};
use super::shapes::{Base, Force, Moment, Reaction};
use crate::scalar::Scalar;

const PARAMETERS: &[ParameterInfo] = &[
    ParameterInfo::size("level", "N.m", 0.0, 1e6, "Friction torque once sliding").nominal(1e-2),
    ParameterInfo::shape("stiffness", "N.m/rad", 10.0, 1e-9, 1e12, "Stiffness of the bristle before breakaway")
        .start(Start::Grid(Scale::Stiffness, &[0.3, 1.0, 3.0, 10.0, 100.0])),
    ParameterInfo::shape("damping", "N.m.s/rad", 0.0, 0.0, 1e6, "Damping of the bristle"),
];
const VARIANTS: &[Variant] = &[Variant { name: "", free: &[0, 1] }, Variant { name: "damped", free: &[0, 1, 2] }];
const EQUATION: &str = "z' = v - stiffness*|v|*z/level; f = stiffness*z + damping*z'";
const REFERENCE: &str = "Canudas de Wit, Olsson, Astrom, Lischinsky, IEEE Trans. Automatic Control 40(3), 1995";

/// `(1 - exp(-a))/a`, with its limit at zero.
fn mean_decay<S: Scalar>(a: S) -> S {
    let re = a.re();
    if re.abs() < 1e-4 {
        return S::from(1.0) - a * 0.5 + a.squared() * (1.0 / 6.0);
    }
    (S::from(1.0) - (-a).exp()) / a
}

/// Advances a bristle of the given `level / stiffness` reach by `dx`; also its derivative to `dx`.
fn bristle<S: Scalar>(z: S, dx: S, reach: S) -> (S, f64) {
    let a = dx.abs() / reach;
    let decay = (-a).exp();
    let after = z * decay + dx * mean_decay(a);
    let sign = if dx.re() < 0.0 { -1.0 } else { 1.0 };
    // dz/dx = 1 - sgn(dx)*z/reach: the bristle's own equation.
    (after, 1.0 - sign * after.re() / reach.re())
}

fn torque<S: Scalar>(p: &[S], m: &Moment<S>, z: &mut [S]) -> Reaction<S> {
    if p[0].re() <= 0.0 {
        return Reaction::default();
    }
    let reach = p[0] / p[1];
    let dx = m.h * (m.start.v + m.end.v) * 0.5;
    let (after, slope) = bristle(z[0], dx, reach);
    z[0] = after;
    let v = m.end.v;
    let rate = v - v.abs() * after / reach;
    let sign = if v.re() < 0.0 { -1.0 } else { 1.0 };
    let per_v = slope * 0.5 * m.h.re();
    let rate_per_v = 1.0 - sign * after.re() / reach.re() - v.re().abs() / reach.re() * per_v;
    Reaction { torque: p[1] * after + p[2] * rate, stiffness: 0.0, damping: p[1].re() * per_v + p[2].re() * rate_per_v }
}

/// Presliding friction on the motor side.
pub struct PreslidingMotor;

impl Force for PreslidingMotor {
    const INFO: EffectInfo = EffectInfo {
        id: "presliding_motor",
        place: Place::Motor,
        family: Family::DryFriction,
        title: "Friction of motor and screw that yields before it breaks away",
        equation: EQUATION,
        signature: "r1 follows the displacement since the last reversal; seen where motion is small and slow",
        reference: REFERENCE,
        parameters: PARAMETERS,
        memory: 1,
        variants: VARIANTS,
    };

    #[inline]
    fn torque<S: Scalar>(p: &[S], _base: &Base<S>, m: &Moment<S>, memory: &mut [S]) -> Reaction<S> {
        torque(p, m, memory)
    }
}

/// Presliding friction on the table side.
pub struct PreslidingTable;

impl Force for PreslidingTable {
    const INFO: EffectInfo = EffectInfo {
        id: "presliding_table",
        place: Place::Table,
        family: Family::DryFriction,
        title: "Friction of table and guideways that yields before it breaks away",
        equation: EQUATION,
        signature: "r2 follows the displacement since the last reversal; seen where motion is small and slow",
        reference: REFERENCE,
        parameters: PARAMETERS,
        memory: 1,
        variants: VARIANTS,
    };

    #[inline]
    fn torque<S: Scalar>(p: &[S], _base: &Base<S>, m: &Moment<S>, memory: &mut [S]) -> Reaction<S> {
        torque(p, m, memory)
    }
}
