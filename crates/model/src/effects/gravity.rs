//! A weight on a hinge, or a counterweight: `f = sine*sin(ratio*theta2) + cosine*cos(ratio*theta2)`.
//!
//! A mass `m` at the distance `l` and the angle `a` of its hinge gives `m*g*l*sin(ratio*theta2 + a)`: `sine` is that of
//! `a = 0`, hanging straight down at `theta2 = 0`, `cosine` that of a horizontal arm there.

use super::family::Family;
use super::info::{EffectInfo, ParameterInfo, Place, Variant};
use super::shapes::{Base, Force, Internal, Moment, Reaction, natural_frequency};
use crate::scalar::Scalar;

/// Gravity on a hinge.
pub struct Gravity;

impl Force for Gravity {
    const INFO: EffectInfo = EffectInfo {
        id: "gravity",
        place: Place::Table,
        family: Family::Gravity,
        title: "A weight on a hinge, or a counterweight",
        equation: "f = sine*sin(ratio*theta2) + cosine*cos(ratio*theta2)",
        signature: "r2 one slow sine of theta2, with or without motion",
        reference: "Craig, Introduction to Robotics, 2005, section 6.8: G(theta)",
        parameters: &[
            ParameterInfo::size("sine", "N.m", -1e6, 1e6, "Mass times gravity times lever, hanging at theta2 = 0")
                .nominal(1e-2),
            ParameterInfo::size("cosine", "N.m", -1e6, 1e6, "The same of a lever that is horizontal at theta2 = 0")
                .nominal(1e-2),
            ParameterInfo::shape("ratio", "1/rad", 1.0, 1e-6, 1e6, "Angle of the hinge per angle of the table side"),
        ],
        memory: 0,
        named: true,
        textbook: false,
        odds: 1.0,
        bounds: |p, x| {
            let weight = p[0].hypot(p[1]);
            x.is_pulled_back(weight * (0.25 * p[2] * x.travel()).min(1.0), weight * p[2])
                && p[2] * x.travel() >= 0.2
                && p[2] * x.travel() <= 0.75 * std::f64::consts::TAU
        },
        example: &[2e-3, 1e-3, 1.5],
        variants: &[Variant { name: "", free: &[0, 1] }],
    };
    const STATIC_LOAD: bool = true;

    fn pull(p: &[f64], inertia: f64) -> f64 {
        natural_frequency(p[0].hypot(p[1]) * p[2], inertia)
    }

    #[inline]
    fn torque<S: Scalar>(p: &[S], _base: &Base<S>, m: &Moment<S>, _memory: &mut [Internal<S>]) -> Reaction<S> {
        let angle = p[2] * m.end.x;
        let (sine, cosine) = angle.sin_cos();
        let (a, b, ratio) = (p[0].re(), p[1].re(), p[2].re());
        Reaction {
            torque: p[0] * sine + p[1] * angle.cos(),
            stiffness: ratio * (a * cosine - b * sine.re()),
            damping: 0.0,
            curvature: ratio * ratio * a.hypot(b),
        }
    }
}
