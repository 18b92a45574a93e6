//! Slow changes over the record: warming, wear.
//!
//! What changes at a rate at first may come to rest, as a part that warms up does: after a first-order lag of rate
//! `fade` it has changed by `rate*s`, `s = (1 - exp(-fade*t))/fade`; `fade = 0` is the straight line `s = t`.

use super::family::Family;
use super::info::{EffectInfo, ParameterInfo, Place, Variant};
use super::shapes::{Base, DryFriction, Force, Internal, Level, Moment, Reaction, Slip, mean_decay};
use crate::scalar::Scalar;

/// How fast a drift comes to rest.
const FADE: ParameterInfo =
    ParameterInfo::shape("fade", "1/s", 0.0, 0.0, 1e3, "Rate at which the change comes to rest; 0: it goes on");

/// Whether a change is under way over a good part of a record of that length, s: with a time constant below a tenth of it, it is over in
/// half of the record and was there nearly all the time, which is no drift.
fn is_slow(fade: f64, length: f64) -> bool {
    fade * length <= 10.0
}

/// The time that a steady drift would have needed to come as far.
fn drifted<S: Scalar>(fade: S, time: f64) -> S {
    mean_decay(fade * time) * time
}

/// Drift of the coupling's stiffness: `K*(1 + rate*s)`.
pub struct StiffnessDrift;

impl Force for StiffnessDrift {
    const INFO: EffectInfo = EffectInfo {
        id: "stiffness_drift",
        place: Place::Coupling,
        family: Family::Drift,
        title: "A stiffness that changes slowly over the record",
        equation: "f = K*rate*s*d, s = (1 - exp(-fade*t))/fade",
        signature: "r1 = -r2 proportional to the twist, growing over the record; lines split",
        reference: "First-order term of any slow change of K",
        parameters: &[
            ParameterInfo::size("rate", "1/s", -1e3, 1e3, "Relative change of K per second").nominal(1e-2),
            FADE,
        ],
        memory: 0,
        named: true,
        textbook: false,
        odds: 0.05,
        bounds: |p, x| (p[0] * x.length).abs() <= 0.95 && is_slow(p[1], x.length),
        example: &[0.3, 0.5],
        variants: &[Variant { name: "", free: &[0] }, Variant { name: "that comes to rest", free: &[0, 1] }],
    };

    #[inline]
    fn torque<S: Scalar>(p: &[S], base: &Base<S>, m: &Moment<S>, _memory: &mut [Internal<S>]) -> Reaction<S> {
        let k = base.k * p[0] * drifted(p[1], m.time);
        Reaction { torque: k * m.end.x, stiffness: k.re(), damping: 0.0, curvature: 0.0 }
    }
}

/// Drift of the motor's friction: a level and a viscous coefficient that grow from zero with time.
pub struct FrictionDrift;

impl DryFriction for FrictionDrift {
    const INFO: EffectInfo = EffectInfo {
        id: "friction_drift",
        place: Place::Motor,
        family: Family::Drift,
        title: "A friction of the motor that changes slowly over the record",
        equation: "f = sgn(v)*s*(level_rate + viscous_rate*|v|), s = (1 - exp(-fade*t))/fade",
        signature: "r1 a square of the sign of omega1 that grows over the record",
        reference: "First-order term of any slow change of friction",
        parameters: &[
            ParameterInfo::size("level_rate", "N.m/s", -1e6, 1e6, "Change of the Coulomb level per second")
                .nominal(1e-3),
            ParameterInfo::size("viscous_rate", "N.m/rad", -1e6, 1e6, "Change of the viscous coefficient per second")
                .nominal(1e-4),
            FADE,
        ],
        memory: 0,
        named: true,
        textbook: false,
        odds: 0.05,
        bounds: |p, x| {
            let most = x.torque / drifted(p[2], x.length);
            p[0].abs() <= most && p[1].abs() * x.speed <= most && is_slow(p[2], x.length)
        },
        example: &[4e-3, 1e-4, 0.5],
        variants: &[
            Variant { name: "dry", free: &[0] },
            Variant { name: "viscous", free: &[1] },
            Variant { name: "dry and viscous", free: &[0, 1] },
            Variant { name: "dry, coming to rest", free: &[0, 2] },
            Variant { name: "viscous, coming to rest", free: &[1, 2] },
        ],
    };
    const CHANGES: bool = true;

    fn level<S: Scalar>(p: &[S], slip: &Slip<S>) -> Level<S> {
        let s = drifted(p[2], slip.time);
        let per_speed = p[1].re() * s.re();
        Level { per_speed, constant: per_speed == 0.0, ..Level::constant((p[0] + p[1] * slip.speed) * s) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_change_with_a_time_constant_below_a_tenth_of_the_record_is_no_drift() {
        // 99 % of the change is over after 4.6 of its time constants: of a fast one within half of the record.
        assert!([0.0, 0.05, 0.5, 0.99].iter().all(|fade| is_slow(*fade, 10.0)));
        assert!(![1.01, 193.0].iter().any(|fade| is_slow(*fade, 10.0)));
    }
}
