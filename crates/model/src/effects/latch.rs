//! Both encoders logged at another instant than the torque, or behind a filter that the torque has not.
//!
//! `theta read at t = theta(t - delay)`, and behind the anti-alias filter `filter*y' = theta - y`. What a log holds late is
//! looked up in the motion so far, by cubic interpolation. What it holds early (`delay < 0`) a simulation that goes forwards
//! cannot know: the axis is then taken to coast on at its present speed, which is right to `alpha*delay^2/2`. Both act
//! before every other effect of the encoders, which are late with them.

use super::family::Family;
use super::info::{EffectInfo, ParameterInfo, Place, Scale, Start, Variant};
use super::sensor::{Reading, Seen};
use super::shapes::Sensor;
use crate::scalar::Scalar;

/// Both encoders late or early against the torque, or filtered.
pub struct Latch;

impl Sensor for Latch {
    const INFO: EffectInfo = EffectInfo {
        id: "latch",
        place: Place::Sensor,
        family: Family::Latch,
        title: "Both encoders logged late or early against the torque, or behind a filter",
        equation: "theta read at t is theta(t - delay), early by coasting; filter*y' = theta - y",
        signature: "r1 and r2 late or early by one time; with a filter, gain falls and phase bends with frequency",
        reference: "Janot, Vandanjon, Gautier, IEEE Trans. Control Systems Technology 22(1), 2014 (data filtering in parallel)",
        parameters: &[
            ParameterInfo::size("delay", "s", -0.1, 0.1, "Age of both readings against the torque; negative: early")
                .nominal(1e-3)
                .start(Start::Grid(Scale::Sample, &[-2.0, -1.0, -0.5, 0.5, 1.0, 2.0])),
            ParameterInfo::size("filter", "s", 0.0, 0.1, "Time constant of the filter before both encoders are read")
                .nominal(1e-3)
                .start(Start::Grid(Scale::Sample, &[0.3, 1.0, 3.0, 10.0])),
        ],
        memory: 0,
        named: true,
        textbook: false,
        odds: 0.1,
        bounds: |p, x| {
            let early = p[0] <= 0.0 && x.is_some_samples(-p[0]) && x.passes_the_band(p[1]);
            early && (x.turns_phase(p[0]) || x.turns_phase(p[1]))
        },
        example: &[2.3e-3, 1.5e-3],
        variants: &[Variant { name: "", free: &[0] }, Variant { name: "filtered", free: &[1] }],
    };
    const MOTOR: bool = true;
    const DELAY: Option<usize> = Some(0);

    fn transform<S: Scalar>(_p: &[S], reading: Reading<S>, _seen: &Seen<'_, S>) -> Reading<S> {
        reading
    }

    fn late<S: Scalar>(p: &[S]) -> S {
        p[0]
    }

    fn filter<S: Scalar>(p: &[S]) -> S {
        p[1]
    }
}
