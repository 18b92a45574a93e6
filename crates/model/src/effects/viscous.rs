//! Viscous friction to ground: `f = coefficient*(1 + asymmetry*sgn(v))*v`.

use std::marker::PhantomData;

use super::family::Family;
use super::info::{EffectInfo, ParameterInfo, Start, Variant};
use super::shapes::{Base, Force, Internal, Moment, Reaction};
use super::side::Side;
use crate::scalar::Scalar;

const PARAMETERS: &[ParameterInfo] = &[
    ParameterInfo::size("coefficient", "N.m.s/rad", 0.0, 1e6, "Friction torque per speed").nominal(1e-3),
    ParameterInfo::shape("asymmetry", "1", 0.0, -1.0, 1.0, "Share by which forwards is more than the mean")
        .start(Start::Share),
];
const VARIANTS: &[Variant] = &[Variant { name: "", free: &[0] }, Variant { name: "asymmetric", free: &[0, 1] }];

/// Viscous friction of one side.
pub struct Viscous<I>(PhantomData<I>);

impl<I: Side> Force for Viscous<I> {
    const INFO: EffectInfo = EffectInfo {
        id: ["viscous_motor", "viscous_table"][I::INDEX],
        place: I::PLACE,
        family: Family::ViscousFriction,
        title: ["Viscous friction of motor and screw", "Viscous friction of table and guideways"][I::INDEX],
        equation: "f = coefficient*(1 + asymmetry*sgn(v))*v",
        signature: [
            "r1 proportional to omega1; no new lines unless the two directions differ",
            "r2 proportional to omega2; no new lines unless the two directions differ",
        ][I::INDEX],
        reference: "Olsson, Astrom, Canudas de Wit, Gafvert, Lischinsky, European J. Control 4(3), 1998",
        parameters: PARAMETERS,
        memory: 0,
        named: true,
        textbook: [true, false][I::INDEX],
        odds: 10.0,
        bounds: |p, x| p[1].abs() <= 0.95 && x.can_dissipate(p[0], 1),
        example: [&[1e-3, 0.2], &[1e-4, 0.2]][I::INDEX],
        variants: VARIANTS,
    };

    #[inline]
    fn torque<S: Scalar>(p: &[S], _base: &Base<S>, m: &Moment<S>, _memory: &mut [Internal<S>]) -> Reaction<S> {
        let sign = if m.end.v.re() < 0.0 { -1.0 } else { 1.0 };
        let coefficient = p[0] * (p[1] * sign + 1.0);
        // Two straight lines that differ have a kink.
        let curvature = if p[1].re() == 0.0 { 0.0 } else { f64::INFINITY };
        Reaction { torque: coefficient * m.end.v, stiffness: 0.0, damping: coefficient.re(), curvature }
    }
}
