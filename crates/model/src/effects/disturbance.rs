//! An external torque on the table at a fixed frequency: chatter, a neighbouring machine.

use std::f64::consts::TAU;

use super::family::Family;
use super::info::{EffectInfo, ParameterInfo, Place, Scale, Start, Variant};
use super::shapes::{Base, Force, Internal, Moment, Reaction};
use crate::scalar::Scalar;

/// A periodic torque from outside.
pub struct Disturbance;

impl Force for Disturbance {
    const INFO: EffectInfo = EffectInfo {
        id: "disturbance",
        place: Place::Table,
        family: Family::Disturbance,
        title: "External periodic torque on the table at a fixed frequency",
        equation: "f = -amplitude*sin(2*pi*frequency*t + phase)",
        signature: "r2 at a fixed frequency, on or off the excitation's lines, whatever the motion does",
        reference: "Bodson, Douglas, Automatica 33(12), 1997",
        parameters: &[
            ParameterInfo::size("amplitude", "N.m", -1e6, 1e6, "Amplitude of the torque").nominal(1e-2),
            ParameterInfo::shape("frequency", "Hz", 10.0, 1e-6, 1e6, "Frequency of the torque")
                .start(Start::Grid(Scale::Frequency, &[1.0])),
            ParameterInfo::shape("phase", "rad", 0.0, -1e3, 1e3, "Phase at time zero").start(Start::Phase),
        ],
        memory: 0,
        named: true,
        textbook: false,
        odds: 1.0,
        bounds: |p, x| x.has_amplitude(p[0]) && x.holds(std::f64::consts::TAU * p[1]),
        example: &[1e-3, 7.0, 0.4],
        variants: &[Variant { name: "", free: &[0, 1, 2] }],
    };

    fn rate(p: &[f64], _inertia: f64) -> f64 {
        TAU * p[1]
    }

    #[inline]
    fn torque<S: Scalar>(p: &[S], _base: &Base<S>, m: &Moment<S>, _memory: &mut [Internal<S>]) -> Reaction<S> {
        let angle = p[1] * (TAU * m.time) + p[2];
        Reaction::given(-(p[0] * angle.sin()))
    }
}
