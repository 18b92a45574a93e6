//! Hysteresis of the coupling: a rate-independent loop beside the spring.
//!
//! `f = level*z/reach`, `dz = dd*(1 - sgn(dd)*z/reach)`: Dahl's curve over the twist, the Bouc-Wen loop with beta =
//! 1/reach, gamma = 0, n = 1. Dahl 1968; Ikhouane, Rodellar, Systems with Hysteresis, Wiley 2007.

use super::info::{EffectInfo, Family, ParameterInfo, Place, Scale, Start, Variant};
use super::presliding::bristle;
use super::shapes::{Base, Force, Moment, Reaction};
use crate::scalar::Scalar;

/// Hysteresis of the coupling.
pub struct CouplingHysteresis;

impl Force for CouplingHysteresis {
    const INFO: EffectInfo = EffectInfo {
        id: "coupling_hysteresis",
        place: Place::Coupling,
        family: Family::Hysteresis,
        title: "A loop in the spring's characteristic that speed does not open",
        equation: "f = level*z/reach; dz = dd*(1 - sgn(dd)*z/reach)",
        reference: "Dahl, Aerospace Corp. TOR-158, 1968; Ikhouane, Rodellar, Systems with Hysteresis, 2007",
        parameters: &[
            ParameterInfo::size("level", "N.m", 0.0, 1e6, "Torque of the loop when it has closed").nominal(1e-2),
            ParameterInfo::shape("reach", "rad", 1e-2, 1e-9, 1e3, "Twist over which the loop closes")
                .start(Start::Grid(Scale::Twist, &[0.03, 0.1, 0.3, 1.0])),
        ],
        memory: 1,
        variants: &[Variant { name: "", free: &[0, 1] }],
    };

    #[inline]
    fn torque<S: Scalar>(p: &[S], _base: &Base<S>, m: &Moment<S>, z: &mut [S]) -> Reaction<S> {
        let dx = if m.h.re() == 0.0 { S::default() } else { m.end.x - m.start.x };
        let (after, slope) = bristle(z[0], dx, p[1]);
        z[0] = after;
        let stiffness = p[0] / p[1];
        Reaction { torque: stiffness * after, stiffness: stiffness.re() * slope, damping: 0.0 }
    }
}
