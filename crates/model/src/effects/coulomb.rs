//! Coulomb friction with exact stick, a Stribeck peak and a direction asymmetry.
//!
//! `f = sgn(v)*(level + load*|t|)*(1 + asymmetry*sgn(v))*(1 + peak*exp(-(v/speed)^2))`; at rest any torque up to the level
//! at zero speed. Armstrong-Helouvry, Dupont, Canudas de Wit, Automatica 30(7), 1994, eq. 3 and 6.
//!
//! `t` is the torque that the axis transmits: `K*(theta1 - theta2) + B*(omega1 - omega2)`; on a rigid axis, which transmits
//! none, what its guides carry: the sum of the weights and springs on it (gravity, external spring, unbalance, loads). It
//! is that of the same instant, solved with the step; at rest the level is that of the mean load over the step.

use std::marker::PhantomData;

use super::family::Family;
use super::info::{EffectInfo, ParameterInfo, Scale, Start, Variant};
use super::shapes::{DryFriction, Level, Slip};
use super::side::Side;
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
    ParameterInfo::size("load", "1", 0.0, 10.0, "Growth of the level with the torque transmitted, per torque")
        .nominal(0.1),
];
const VARIANTS: &[Variant] = &[
    Variant { name: "", free: &[0] },
    Variant { name: "asymmetric", free: &[0, 3] },
    Variant { name: "Stribeck", free: &[0, 1, 2] },
    Variant { name: "load-dependent", free: &[0, 4] },
];
/// The parameter `load`.
const LOAD: usize = 4;

/// Coulomb friction of one side.
pub struct Coulomb<I>(PhantomData<I>);

impl<I: Side> DryFriction for Coulomb<I> {
    const INFO: EffectInfo = EffectInfo {
        id: ["coulomb_motor", "coulomb_table"][I::INDEX],
        place: I::PLACE,
        family: Family::DryFriction,
        title: [
            "Coulomb friction of motor and screw, with exact stick and slip",
            "Coulomb friction of table and guideways, with exact stick and slip",
        ][I::INDEX],
        equation: "f = sgn(v)*(level + load*|t|)*(1 + asymmetry*sgn(v))*(1 + peak*exp(-(v/speed)^2)), t = \
                   K*(theta1 - theta2) + B*(w1 - w2), rigid: weights and springs; |f| <= level*... at v = 0",
        signature: [
            "r1 is a square of the sign of omega1; odd lines; its share falls as the amplitude grows",
            "r2 is a square of the sign of omega2; odd lines; its share falls as the amplitude grows",
        ][I::INDEX],
        reference: "Armstrong-Helouvry, Dupont, Canudas de Wit, Automatica 30(7), 1994",
        parameters: PARAMETERS,
        memory: 0,
        named: true,
        textbook: [true, false][I::INDEX],
        odds: 10.0,
        bounds: |p, x| {
            p[0] <= x.torque
                && x.can_dissipate_dry(p[0], 0.0)
                // Four times as large one way as the other: what differs by more is a torque of its own, constant as a
                // weight's is, which one of these levels would do for as well.
                && p[3].abs() <= 0.6
                && (p[1] == 0.0 || p[2] <= 0.7 * x.fastest)
        },
        example: [&[0.006, 0.4, 2.0, 0.1, 0.2], &[0.001, 0.4, 2.0, 0.1, 0.2]][I::INDEX],
        variants: VARIANTS,
    };

    const LOAD: Option<usize> = Some(LOAD);

    #[inline]
    fn level<S: Scalar>(p: &[S], slip: &Slip<S>) -> Level<S> {
        let factor = p[3] * slip.direction + 1.0;
        let loaded = p[LOAD].re() != 0.0;
        let level = if loaded || S::HAS_DERIVATIVES { p[0] + p[LOAD] * slip.load } else { p[0] } * factor;
        let per_load = if loaded { p[LOAD].re() * factor.re() } else { 0.0 };
        if p[1].re() == 0.0 && (level.re() == 0.0 || !S::HAS_DERIVATIVES) {
            return Level { per_load, constant: !loaded, ..Level::constant(level) };
        }
        let ratio = slip.speed / p[2];
        let peak = p[1] * (-ratio.squared()).exp();
        let per_speed = -2.0 * ratio.re() / p[2].re() * peak.re() * level.re();
        Level {
            level: level * (peak + 1.0),
            per_speed,
            per_position: 0.0,
            per_load: per_load * (peak.re() + 1.0),
            constant: !loaded && p[1].re() == 0.0,
        }
    }
}
