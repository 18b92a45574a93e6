//! End stop: a stiff one-sided spring at each end of the travel.

use super::info::{EffectInfo, Family, ParameterInfo, Place, Scale, Start, Variant};
use super::shapes::{Base, Force, Moment, Reaction};
use crate::scalar::Scalar;

/// Travel limit of the table.
pub struct EndStop;

impl Force for EndStop {
    const INFO: EffectInfo = EffectInfo {
        id: "end_stop",
        place: Place::Table,
        family: Family::EndStop,
        title: "The table touches the end of its travel",
        equation: "f = stiffness*(theta2 - upper) above upper, stiffness*(theta2 - lower) below lower, else 0",
        reference: "Brogliato, Nonsmooth Mechanics, 2016, section 2.1 (compliant contact)",
        parameters: &[
            ParameterInfo::size("stiffness", "N.m/rad", 0.0, 1e9, "Stiffness of the stop").nominal(1.0),
            ParameterInfo::shape("upper", "rad", 1e6, -1e6, 1e6, "Angle of the table at the upper stop")
                .start(Start::Grid(Scale::Travel, &[0.7, 0.85, 0.92, 0.97])),
            ParameterInfo::shape("lower", "rad", -1e6, -1e6, 1e6, "Angle of the table at the lower stop")
                .start(Start::Grid(Scale::Travel, &[0.3, 0.15, 0.08, 0.03])),
        ],
        memory: 0,
        variants: &[
            Variant { name: "upper", free: &[0, 1] },
            Variant { name: "lower", free: &[0, 2] },
            Variant { name: "both", free: &[0, 1, 2] },
        ],
    };

    #[inline]
    fn torque<S: Scalar>(p: &[S], _base: &Base<S>, m: &Moment<S>, _memory: &mut [S]) -> Reaction<S> {
        let x = m.end.x;
        let depth = if x.re() > p[1].re() {
            x - p[1]
        } else if x.re() < p[2].re() {
            x - p[2]
        } else {
            return Reaction::default();
        };
        Reaction { torque: p[0] * depth, stiffness: p[0].re(), damping: 0.0 }
    }
}
