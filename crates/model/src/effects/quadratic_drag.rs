//! Quadratic drag: `f = coefficient*w2*|w2|`, the churning of oil or air.

use super::family::Family;
use super::info::{EffectInfo, ParameterInfo, Place, Variant};
use super::shapes::{Base, Force, Internal, Moment, Reaction};
use crate::scalar::Scalar;

/// Quadratic drag on the table.
pub struct QuadraticDrag;

impl Force for QuadraticDrag {
    const INFO: EffectInfo = EffectInfo {
        id: "quadratic_drag",
        place: Place::Table,
        family: Family::ViscousFriction,
        title: "Drag that grows with the square of the speed",
        equation: "f = coefficient*w2*|w2|",
        signature: "r2 with omega2 times its size; odd lines; its share grows with the amplitude",
        reference: "Batchelor, An Introduction to Fluid Dynamics, 1967, section 5.11",
        parameters: &[
            ParameterInfo::size("coefficient", "N.m.s2/rad2", 0.0, 1e6, "Drag torque per speed squared").nominal(1e-4)
        ],
        memory: 0,
        named: true,
        textbook: false,
        odds: 0.3,
        bounds: |p, x| x.can_dissipate(p[0], 2),
        example: &[1e-5],
        variants: &[Variant { name: "", free: &[0] }],
    };

    #[inline]
    fn torque<S: Scalar>(p: &[S], _base: &Base<S>, m: &Moment<S>, _memory: &mut [Internal<S>]) -> Reaction<S> {
        let speed = m.end.v.abs();
        let damping = 2.0 * p[0].re() * speed.re();
        Reaction { torque: p[0] * m.end.v * speed, stiffness: 0.0, damping, curvature: f64::INFINITY }
    }
}
