//! Coulomb friction with exact stick, a Stribeck peak and a direction asymmetry.
//!
//! `f = sgn(v)*level*(1 + asymmetry*sgn(v))*(1 + peak*exp(-(v/speed)^2))`; at rest any torque up to the level at zero
//! speed. Armstrong-Helouvry, Dupont, Canudas de Wit, Automatica 30(7), 1994, eq. 3 and 6.

use super::info::{EffectInfo, Family, ParameterInfo, Place, Scale, Start, Variant};
use super::shapes::DryFriction;
use crate::scalar::Scalar;

const PARAMETERS: &[ParameterInfo] = &[
    ParameterInfo::size("level", "N.m", 0.0, 1e6, "Coulomb level: friction torque while moving").nominal(1e-2),
    ParameterInfo::shape("peak", "1", 0.0, 0.0, 10.0, "Stribeck peak: breakaway above the level, as a share of it")
        .start(Start::Grid(Scale::One, &[0.3, 1.0])),
    ParameterInfo::shape("speed", "rad/s", 1.0, 1e-9, 1e6, "Stribeck speed: where the peak has fallen to 1/e")
        .start(Start::Grid(Scale::Speed, &[0.05, 0.2, 0.6])),
    ParameterInfo::shape(
        "asymmetry",
        "1",
        0.0,
        -1.0,
        1.0,
        "Direction asymmetry: level is level*(1 + asymmetry) forwards and level*(1 - asymmetry) backwards",
    )
    .start(Start::Share),
];
const VARIANTS: &[Variant] = &[
    Variant { name: "", free: &[0] },
    Variant { name: "asymmetric", free: &[0, 3] },
    Variant { name: "Stribeck", free: &[0, 1, 2] },
];
const EQUATION: &str =
    "f = sgn(v)*level*(1 + asymmetry*sgn(v))*(1 + peak*exp(-(v/speed)^2)); |f| <= level*... at v = 0";
const REFERENCE: &str = "Armstrong-Helouvry, Dupont, Canudas de Wit, Automatica 30(7), 1994";

#[inline]
fn level<S: Scalar>(p: &[S], direction: f64, speed: S) -> (S, f64) {
    let level = p[0] * (p[3] * direction + 1.0);
    if p[1].re() == 0.0 && (level.re() == 0.0 || !S::HAS_DERIVATIVES) {
        return (level, 0.0);
    }
    let ratio = speed / p[2];
    let peak = p[1] * (-ratio.squared()).exp();
    let slope = -2.0 * ratio.re() / p[2].re() * peak.re() * level.re();
    (level * (peak + 1.0), slope)
}

/// Coulomb friction on the motor side.
pub struct CoulombMotor;

impl DryFriction for CoulombMotor {
    const INFO: EffectInfo = EffectInfo {
        id: "coulomb_motor",
        place: Place::Motor,
        family: Family::DryFriction,
        title: "Coulomb friction of motor and screw, with exact stick and slip",
        equation: EQUATION,
        signature: "r1 is a square of the sign of omega1; odd lines; its share falls as the amplitude grows",
        reference: REFERENCE,
        parameters: PARAMETERS,
        memory: 0,
        variants: VARIANTS,
    };

    fn level<S: Scalar>(p: &[S], direction: f64, speed: S, _at: f64) -> (S, f64) {
        level(p, direction, speed)
    }
}

/// Coulomb friction on the table side.
pub struct CoulombTable;

impl DryFriction for CoulombTable {
    const INFO: EffectInfo = EffectInfo {
        id: "coulomb_table",
        place: Place::Table,
        family: Family::DryFriction,
        title: "Coulomb friction of table and guideways, with exact stick and slip",
        equation: EQUATION,
        signature: "r2 is a square of the sign of omega2; odd lines; its share falls as the amplitude grows",
        reference: REFERENCE,
        parameters: PARAMETERS,
        memory: 0,
        variants: VARIANTS,
    };

    fn level<S: Scalar>(p: &[S], direction: f64, speed: S, _at: f64) -> (S, f64) {
        level(p, direction, speed)
    }
}
