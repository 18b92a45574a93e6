//! Dry friction around one position: a tight spot of the screw, with exact stick as Coulomb's.
//!
//! `f = sgn(v)*level*exp(-((theta1 - centre)/width)^2)`.

use super::family::Family;
use super::info::{EffectInfo, ParameterInfo, Place, Scale, Start, Variant};
use super::shapes::{DryFriction, Level, Slip};
use crate::scalar::Scalar;

/// A tight spot of the screw.
pub struct PositionFriction;

impl DryFriction for PositionFriction {
    const INFO: EffectInfo = EffectInfo {
        id: "position_friction",
        place: Place::Motor,
        family: Family::PositionFriction,
        title: "Friction around one position: a tight spot of the screw",
        equation: "f = sgn(v)*level*exp(-((theta1 - centre)/width)^2); |f| <= level*... at v = 0",
        signature: "r1 a square of the sign of omega1 around one theta1, nothing elsewhere",
        reference: "Armstrong, Control of Machines with Friction, 1991, section 3.4 (position dependence)",
        parameters: &[
            ParameterInfo::size("level", "N.m", 0.0, 1e6, "Friction torque in the middle of the spot").nominal(1e-2),
            ParameterInfo::shape("centre", "rad", 0.0, -1e6, 1e6, "Angle of the motor in the middle of the spot")
                .start(Start::Grid(Scale::Travel, &[0.1, 0.3, 0.5, 0.7, 0.9])),
            ParameterInfo::shape("width", "rad", 1.0, 1e-9, 1e6, "Distance from it where 1/e of the level is left")
                .start(Start::Grid(Scale::Rotation, &[0.1, 0.3, 1.0])),
        ],
        memory: 0,
        named: true,
        textbook: false,
        odds: 1.0,
        bounds: |p, x| {
            p[0] <= x.torque
                && p[2] <= 0.25 * x.travel()
                // Seen by some samples of a crossing.
                && p[2] >= 2.0 * x.speed * x.dt
                && p[1] >= x.positions[0]
                && p[1] <= x.positions[x.positions.len() - 1]
        },
        example: &[6e-3, 0.2, 0.3],
        variants: &[Variant { name: "", free: &[0, 1, 2] }],
    };

    fn level<S: Scalar>(p: &[S], slip: &Slip<S>) -> Level<S> {
        let off = (slip.position - p[1]) / p[2];
        let level = p[0] * (-off.squared()).exp();
        let per_position = -2.0 * off.re() / p[2].re() * level.re();
        Level { per_position, constant: false, ..Level::constant(level) }
    }
}
