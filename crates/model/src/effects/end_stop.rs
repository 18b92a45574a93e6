//! End stop: a stiff one-sided spring at each end of the travel, with the losses of an impact.
//!
//! `f = stiffness*depth*(1 + dissipation*rate)`, never pulling: the force of Hunt & Crossley, J. Applied Mechanics 42(2),
//! 1975 (exponent 1), which starts from zero at the touch whatever the speed.

use super::family::Family;
use super::info::{EffectInfo, ParameterInfo, Place, Scale, Start, Variant};
use super::shapes::{Base, Force, Internal, Moment, Reaction, natural_frequency};
use crate::scalar::Scalar;

/// Travel limit of the table.
pub struct EndStop;

impl Force for EndStop {
    const INFO: EffectInfo = EffectInfo {
        id: "end_stop",
        place: Place::Table,
        family: Family::EndStop,
        title: "The table touches the end of its travel",
        equation: "f = stiffness*(theta2 - upper)*max(0, 1 + dissipation*w2) above upper, mirrored below lower, else 0",
        signature: "r2 one-sided beyond a position theta2, zero elsewhere",
        reference: "Hunt, Crossley, J. Applied Mechanics 42(2), 1975",
        parameters: &[
            ParameterInfo::size("stiffness", "N.m/rad", 0.0, 1e9, "Stiffness of the stop").nominal(1.0),
            ParameterInfo::shape("upper", "rad", 1e6, -1e6, 1e6, "Angle of the table at the upper stop")
                .start(Start::Grid(Scale::Travel, &[1e-4, 3e-4, 1e-3, 3e-3, 0.01, 0.03, 0.1, 0.25])),
            ParameterInfo::shape("lower", "rad", -1e6, -1e6, 1e6, "Angle of the table at the lower stop")
                .start(Start::Grid(Scale::Travel, &[-1e-4, -3e-4, -1e-3, -3e-3, -0.01, -0.03, -0.1, -0.25])),
            ParameterInfo::shape(
                "dissipation",
                "s/rad",
                0.0,
                0.0,
                1e6,
                "Loss of an impact: share of the force per speed",
            )
            .nominal(1e-2),
        ],
        memory: 0,
        named: true,
        textbook: false,
        odds: 0.3,
        bounds: |p, x| {
            let touched = x.beyond(p[2], p[1]);
            // Harder than the coupling; on a rigid axis, than what holds the axis in place over the record.
            p[0] >= x.stiffness
                && p[0] >= 600.0 * x.inertia[1] / (x.length * x.length)
                && touched > 0.0
                && touched < 0.3
        },
        example: &[0.5, 0.3, -0.2, 0.02],
        variants: &[
            Variant { name: "upper", free: &[0, 1] },
            Variant { name: "lower", free: &[0, 2] },
            Variant { name: "both", free: &[0, 1, 2] },
            Variant { name: "upper, lossy", free: &[0, 1, 3] },
            Variant { name: "lower, lossy", free: &[0, 2, 3] },
            Variant { name: "both, lossy", free: &[0, 1, 2, 3] },
        ],
    };

    fn rate(p: &[f64], inertia: f64) -> f64 {
        natural_frequency(p[0], inertia)
    }

    #[inline]
    fn torque<S: Scalar>(p: &[S], _base: &Base<S>, m: &Moment<S>, _memory: &mut [Internal<S>]) -> Reaction<S> {
        let free = Reaction { curvature: f64::INFINITY, ..Reaction::given(S::default()) };
        let x = m.end.x;
        let (depth, inward) = if x.re() > p[1].re() {
            (x - p[1], 1.0)
        } else if x.re() < p[2].re() {
            (x - p[2], -1.0)
        } else {
            return free;
        };
        let push = p[3] * m.end.v * inward + 1.0;
        if push.re() <= 0.0 {
            return free;
        }
        Reaction {
            torque: p[0] * depth * push,
            stiffness: p[0].re() * push.re(),
            damping: p[0].re() * depth.re() * p[3].re() * inward,
            curvature: f64::INFINITY,
        }
    }
}
