//! Backlash: a dead zone of the spring; in the gap nothing, in contact the spring and damper, and contact cannot pull.
//!
//! With `d` the twist and `g` the half gap: force zero while `|d| < g`; at the side `s = +-1`,
//! `K*(d - s*g) + B*d'`, released when it would pull. The side is a discrete state that the step locates in time
//! ([`Moment::contact`]); here is the force of a given side, less the `K*d + B*d'` that the linear axis already has.
//! Nordin, Gutman, Automatica 38(10), 2002 (the physical model of backlash).

use super::family::Family;
use super::info::{EffectInfo, ParameterInfo, Place, Scale, Start, Variant};
use super::shapes::{Base, Force, Internal, Length, Moment, Reaction};
use crate::scalar::Scalar;

/// Backlash of the coupling.
pub struct Backlash;

impl Force for Backlash {
    const INFO: EffectInfo = EffectInfo {
        id: "backlash",
        place: Place::Coupling,
        family: Family::Backlash,
        title: "Play in coupling or nut: a dead zone of the spring; contact cannot pull",
        equation: "f = max(0, K*(d - g) + B*d') at d > g, mirrored at d < -g, else 0",
        signature: "r1 = -r2, flat over the middle of the twist; odd lines; its share falls as the amplitude grows",
        reference: "Nordin, Gutman, Automatica 38(10), 2002",
        parameters: &[ParameterInfo::size("half_gap", "rad", 0.0, 1e3, "Half of the play, on the motor side")
            .nominal(1e-3)
            .start(Start::Grid(Scale::Twist, &[0.03, 0.1, 0.2, 0.4, 0.7, 1.2]))],
        memory: 0,
        named: true,
        textbook: false,
        odds: 1.0,
        bounds: |p, x| p[0] <= 4.0 * x.twist && x.closes(p[0]),
        example: &[0.02],
        variants: &[Variant { name: "", free: &[0] }],
    };
    const LENGTH: Option<Length> = Some(Length::HalfPlay(0));

    #[inline]
    fn torque<S: Scalar>(p: &[S], base: &Base<S>, m: &Moment<S>, _memory: &mut [Internal<S>]) -> Reaction<S> {
        if p[0].re() <= 0.0 {
            // The derivative at a closed gap: the dead zone grows on the side that is in contact.
            let side = if m.end.x.re() < 0.0 { -1.0 } else { 1.0 };
            return Reaction::given(-(base.k * p[0] * side));
        }
        if m.contact == 0 {
            let torque = -(base.k * m.end.x + base.b * m.end.v);
            Reaction { torque, stiffness: -base.k.re(), damping: -base.b.re(), curvature: 0.0 }
        } else {
            Reaction::given(-(base.k * p[0] * f64::from(m.contact)))
        }
    }
}
