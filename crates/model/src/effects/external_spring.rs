//! A spring from the table to the frame: way cover, hose, gas spring. `f = stiffness*(theta2 - rest)`.

use super::family::Family;
use super::info::{EffectInfo, ONCE, ParameterInfo, Place, Scale, Start, Variant};
use super::shapes::{Base, Force, Internal, Moment, Reaction, natural_frequency};
use crate::scalar::Scalar;

/// A spring to the frame.
pub struct ExternalSpring;

impl Force for ExternalSpring {
    const INFO: EffectInfo = EffectInfo {
        id: "external_spring",
        place: Place::Table,
        family: Family::ExternalSpring,
        title: "A spring from the table to the frame: way cover, hose, gas spring",
        equation: "f = stiffness*(theta2 - rest)",
        signature: "r2 a straight line over theta2, with or without motion",
        reference: "Hooke, De Potentia Restitutiva, 1678",
        parameters: &[
            ParameterInfo::size("stiffness", "N.m/rad", 0.0, 1e9, "Stiffness of the spring").nominal(1e-2),
            // The middle of the travel.
            ParameterInfo::shape("rest", "rad", 0.0, -1e6, 1e6, "Angle of the table where it has no tension")
                .start(Start::Grid(Scale::Travel, &[0.5])),
        ],
        memory: 0,
        named: true,
        textbook: false,
        odds: ONCE,
        bounds: |p, x| x.is_pulled_back(0.25 * p[0] * x.travel(), p[0]),
        example: &[5e-3, 0.2],
        variants: &[Variant { name: "", free: &[0, 1] }],
    };
    const STATIC_LOAD: bool = true;

    fn pull(p: &[f64], inertia: f64) -> f64 {
        natural_frequency(p[0], inertia)
    }

    #[inline]
    fn torque<S: Scalar>(p: &[S], _base: &Base<S>, m: &Moment<S>, _memory: &mut [Internal<S>]) -> Reaction<S> {
        Reaction { torque: p[0] * (m.end.x - p[1]), stiffness: p[0].re(), damping: 0.0, curvature: 0.0 }
    }
}
