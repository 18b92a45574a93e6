//! Cubic stiffness: the spring is `K*(d + k3*d^3)`, hardening (`k3 > 0`) or softening.

use super::family::Family;
use super::info::{EffectInfo, ParameterInfo, Place, Variant};
use super::shapes::{Base, Force, Internal, Moment, Reaction};
use crate::scalar::Scalar;

/// Cubic stiffness of the coupling.
pub struct CubicStiffness;

impl Force for CubicStiffness {
    const INFO: EffectInfo = EffectInfo {
        id: "cubic_stiffness",
        place: Place::Coupling,
        family: Family::NonlinearStiffness,
        title: "A spring that hardens or softens with the twist",
        equation: "f = K*k3*d^3",
        signature: "r1 = -r2 with the cube of the twist; odd lines; its share grows with the amplitude squared",
        reference: "Kovacic, Brennan, The Duffing Equation, Wiley 2011",
        parameters: &[ParameterInfo::size("k3", "1/rad2", -1e9, 1e9, "Cubic term as a share of K").nominal(1.0)],
        memory: 0,
        named: true,
        textbook: false,
        odds: 1.0,
        // At the rms twist no more than the linear part, or it is a play that closes; softer than none it holds nothing.
        bounds: |p, x| (-1.0 / 3.0..=1.0).contains(&(p[0] * x.twist.powi(2))),
        example: &[20.0],
        variants: &[Variant { name: "", free: &[0] }],
    };

    #[inline]
    fn torque<S: Scalar>(p: &[S], base: &Base<S>, m: &Moment<S>, _memory: &mut [Internal<S>]) -> Reaction<S> {
        let k3 = base.k * p[0];
        let square = m.end.x.squared();
        let stiffness = 3.0 * k3.re() * square.re();
        Reaction { torque: k3 * square * m.end.x, stiffness, damping: 0.0, curvature: f64::INFINITY }
    }
}
