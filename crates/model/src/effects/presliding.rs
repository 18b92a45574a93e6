//! Presliding friction: the LuGre bristle, for displacement before breakaway.
//!
//! `reach*z' = v - |v|*z`, `f = level*z + damping*reach*z'`: a bristle of stiffness `level/reach`. Canudas de Wit, Olsson,
//! Astrom, Lischinsky, IEEE TAC 40(3), 1995, with a constant level (Dahl's curve). Over a step the bristle follows the
//! mean velocity exactly: `z+ = s + (z - s)*exp(-|dx|/reach)` with `dx = h*(v + v+)/2`, `s = sgn(dx)`.

use std::marker::PhantomData;

use super::family::Family;
use super::info::{EffectInfo, ParameterInfo, Scale, Start, Variant};
use super::shapes::{Base, Force, Internal, Moment, Reaction};
use super::side::Side;
use crate::scalar::Scalar;

const PARAMETERS: &[ParameterInfo] = &[
    ParameterInfo::size("level", "N.m", 0.0, 1e6, "Friction torque once sliding").nominal(1e-2),
    ParameterInfo::shape("reach", "rad", 1e-3, 1e-9, 1e3, "Displacement in which the friction builds up")
        .start(Start::Grid(Scale::Rotation, &[3e-4, 1e-3, 3e-3, 1e-2, 3e-2, 0.1, 0.3, 1.0])),
    ParameterInfo::shape("damping", "N.m.s/rad", 0.0, 0.0, 1e6, "Damping of the bristle").start(Start::Linear),
];
const VARIANTS: &[Variant] = &[Variant { name: "", free: &[0, 1] }, Variant { name: "damped", free: &[0, 1, 2] }];

/// Presliding friction of one side.
pub struct Presliding<I>(PhantomData<I>);

impl<I: Side> Force for Presliding<I> {
    const INFO: EffectInfo = EffectInfo {
        id: ["presliding_motor", "presliding_table"][I::INDEX],
        place: I::PLACE,
        family: Family::DryFriction,
        title: [
            "Friction of motor and screw that yields before it breaks away",
            "Friction of table and guideways that yields before it breaks away",
        ][I::INDEX],
        equation: "reach*z' = v - |v|*z; f = level*z + damping*reach*z'",
        signature: [
            "r1 follows the displacement since the last reversal; seen where motion is small and slow",
            "r2 follows the displacement since the last reversal; seen where motion is small and slow",
        ][I::INDEX],
        reference: "Canudas de Wit, Olsson, Astrom, Lischinsky, IEEE Trans. Automatic Control 40(3), 1995",
        parameters: PARAMETERS,
        memory: 1,
        named: true,
        textbook: false,
        odds: 1.0,
        // A bristle that is more than critically damped on its own side's inertia is a dashpot: viscous friction by another name.
        bounds: |p, x| {
            let critical = 2.0 * (p[0] / p[1] * x.inertia[0]).sqrt();
            p[0] <= x.torque && x.can_dissipate_dry(p[0], p[1]) && p[1] <= 0.2 * x.travel() && p[2] <= critical
        },
        example: [&[0.006, 0.012, 1e-4], &[0.001, 0.01, 1e-5]][I::INDEX],
        variants: VARIANTS,
    };

    /// Without reach it is Coulomb's friction.
    const SIMPLER_AT_ZERO: Option<usize> = Some(1);

    #[inline]
    fn torque<S: Scalar>(p: &[S], _base: &Base<S>, m: &Moment<S>, memory: &mut [Internal<S>]) -> Reaction<S> {
        let z = &mut memory[0];
        let per_speed = m.h * 0.5 / p[1];
        let dx = per_speed * (m.start.v + m.end.v);
        let towards = if dx.re() < 0.0 { -1.0 } else { 1.0 };
        // Distance of the bristle from steady sliding in that direction: dz/dx = 1 - sgn(dx)*z.
        let lack = (S::from(1.0) - z.start * towards) * (-dx.abs()).exp();
        z.set_end(S::from(towards) - lack * towards, 0.0, lack.re() * per_speed.re());
        // The bristle's rate over the speed at the end; that may have turned since.
        let v = m.end.v;
        let rate = if v.re() * towards < 0.0 { S::from(2.0) - lack } else { lack };
        let (level, bristle) = (p[0] * towards, p[2] * v);
        let torque = level - level * lack + bristle * rate;
        let per_lack = (p[0].re() - p[2].re() * v.re().abs()) * per_speed.re();
        let damping = per_lack * lack.re() + p[2].re() * rate.re();
        Reaction { torque, stiffness: 0.0, damping, curvature: f64::INFINITY }
    }
}
