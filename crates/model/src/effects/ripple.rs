//! Torques periodic in the angle: ripple of the motor, unbalance of the table.
//!
//! `f = -amplitude*sin(order*theta + phase)`: the sign makes the amplitude a torque that drives.

use super::family::Family;
use super::info::{EffectInfo, ParameterInfo, Place, Scale, Start, Variant};
use super::shapes::{Base, Force, Internal, Length, Moment, Reaction};
use crate::scalar::Scalar;

fn torque<S: Scalar>(amplitude: S, order: S, phase: S, x: S) -> Reaction<S> {
    let (sine, cosine) = (order * x + phase).sin_cos();
    let steepest = amplitude.re() * order.re();
    let curvature = (steepest * order.re()).abs();
    Reaction { torque: -(amplitude * sine), stiffness: -(steepest * cosine), damping: 0.0, curvature }
}

/// Torque ripple: cogging, commutation, screw eccentricity.
pub struct TorqueRipple;

impl Force for TorqueRipple {
    const INFO: EffectInfo = EffectInfo {
        id: "torque_ripple",
        place: Place::Motor,
        family: Family::TorqueRipple,
        title: "Torque periodic in the motor's angle: cogging, commutation, screw eccentricity",
        equation: "f = -amplitude*sin(order*theta1 + phase)",
        signature: "r1 periodic over the angle theta1, so at no fixed frequency",
        reference: "Proca, Keyhani, IEEE Trans. Energy Conversion 17(1), 2002; order-tracked, not at a fixed frequency",
        parameters: &[
            ParameterInfo::size("amplitude", "N.m", -1e6, 1e6, "Amplitude of the ripple").nominal(1e-2),
            ParameterInfo::shape(
                "order",
                "1/rad",
                1.0,
                1e-6,
                1e6,
                "Periods per radian of theta1: harmonic order of the turn",
            )
            .start(Start::Grid(Scale::Order, &[1.0])),
            ParameterInfo::shape("phase", "rad", 0.0, -1e3, 1e3, "Phase at theta1 = 0").start(Start::Phase),
        ],
        memory: 0,
        named: true,
        textbook: false,
        odds: 1.0,
        bounds: |p, x| x.has_amplitude(p[0]) && x.turns(p[1]) && !x.is_of_a_turn(p[1]),
        example: &[5e-3, 4.0, 0.3],
        variants: &[Variant { name: "", free: &[0, 1, 2] }],
    };
    const LENGTH: Option<Length> = Some(Length::Periods(1));

    #[inline]
    fn torque<S: Scalar>(p: &[S], _base: &Base<S>, m: &Moment<S>, _memory: &mut [Internal<S>]) -> Reaction<S> {
        torque(p[0], p[1], p[2], m.end.x)
    }
}

/// Unbalance: a torque once per turn of the table's shaft.
pub struct Unbalance;

impl Force for Unbalance {
    const INFO: EffectInfo = EffectInfo {
        id: "unbalance",
        place: Place::Table,
        family: Family::LoadTorque,
        title: "Torque once per turn on the table side: a mass off its axis",
        equation: "f = -amplitude*sin(theta2 + phase)",
        signature: "r2 periodic over one turn of theta2",
        reference: "Gravity on an eccentric mass: m*g*e*sin(theta2 + phase)",
        parameters: &[
            ParameterInfo::size("amplitude", "N.m", -1e6, 1e6, "Amplitude: mass times gravity times eccentricity")
                .nominal(1e-2),
            ParameterInfo::shape("phase", "rad", 0.0, -1e3, 1e3, "Phase at theta2 = 0").start(Start::Phase),
        ],
        memory: 0,
        named: true,
        textbook: false,
        odds: 1.0,
        bounds: |p, x| x.has_amplitude(p[0]) && x.turns(1.0),
        example: &[1e-3, 0.2],
        variants: &[Variant { name: "", free: &[0, 1] }],
    };
    const LENGTH: Option<Length> = Some(Length::Turn);

    const STATIC_LOAD: bool = true;

    #[inline]
    fn torque<S: Scalar>(p: &[S], _base: &Base<S>, m: &Moment<S>, _memory: &mut [Internal<S>]) -> Reaction<S> {
        torque(p[0], S::from(1.0), p[1], m.end.x)
    }
}
