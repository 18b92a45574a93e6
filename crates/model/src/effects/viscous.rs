//! Viscous friction to ground: `f = coefficient*(1 + asymmetry*sgn(v))*v`.

use super::family::Family;
use super::info::{EffectInfo, ParameterInfo, Place, Start, Variant};
use super::shapes::{Base, Force, Internal, Moment, Reaction};
use crate::scalar::Scalar;

const PARAMETERS: &[ParameterInfo] = &[
    ParameterInfo::size("coefficient", "N.m.s/rad", 0.0, 1e6, "Friction torque per speed").nominal(1e-3),
    ParameterInfo::shape("asymmetry", "1", 0.0, -1.0, 1.0, "Share by which forwards is more than the mean")
        .start(Start::Share),
];
const VARIANTS: &[Variant] = &[Variant { name: "", free: &[0] }, Variant { name: "asymmetric", free: &[0, 1] }];
const EQUATION: &str = "f = coefficient*(1 + asymmetry*sgn(v))*v";
const REFERENCE: &str = "Olsson, Astrom, Canudas de Wit, Gafvert, Lischinsky, European J. Control 4(3), 1998";

fn torque<S: Scalar>(p: &[S], m: &Moment<S>) -> Reaction<S> {
    let sign = if m.end.v.re() < 0.0 { -1.0 } else { 1.0 };
    let coefficient = p[0] * (p[1] * sign + 1.0);
    // Two straight lines that differ have a kink.
    let curvature = if p[1].re() == 0.0 { 0.0 } else { f64::INFINITY };
    Reaction { torque: coefficient * m.end.v, stiffness: 0.0, damping: coefficient.re(), curvature }
}

/// Viscous friction on the motor side.
pub struct ViscousMotor;

impl Force for ViscousMotor {
    const INFO: EffectInfo = EffectInfo {
        id: "viscous_motor",
        place: Place::Motor,
        family: Family::ViscousFriction,
        title: "Viscous friction of motor and screw",
        equation: EQUATION,
        signature: "r1 proportional to omega1; no new lines unless the two directions differ",
        reference: REFERENCE,
        parameters: PARAMETERS,
        memory: 0,
        named: true,
        textbook: true,
        odds: 1.0,
        bounds: |p, _| p[1].abs() <= 0.95,
        example: &[1e-3, 0.2],
        variants: VARIANTS,
    };

    #[inline]
    fn torque<S: Scalar>(p: &[S], _base: &Base<S>, m: &Moment<S>, _memory: &mut [Internal<S>]) -> Reaction<S> {
        torque(p, m)
    }
}

/// Viscous friction on the table side.
pub struct ViscousTable;

impl Force for ViscousTable {
    const INFO: EffectInfo = EffectInfo {
        id: "viscous_table",
        place: Place::Table,
        family: Family::ViscousFriction,
        title: "Viscous friction of table and guideways",
        equation: EQUATION,
        signature: "r2 proportional to omega2; no new lines unless the two directions differ",
        reference: REFERENCE,
        parameters: PARAMETERS,
        memory: 0,
        named: true,
        textbook: false,
        odds: 1.0,
        bounds: |p, _| p[1].abs() <= 0.95,
        example: &[1e-4, 0.2],
        variants: VARIANTS,
    };

    #[inline]
    fn torque<S: Scalar>(p: &[S], _base: &Base<S>, m: &Moment<S>, _memory: &mut [Internal<S>]) -> Reaction<S> {
        torque(p, m)
    }
}
