//! A constant torque: gravity on a tilted axis, the offset of an amplifier. `f = torque`.

use std::marker::PhantomData;

use super::family::Family;
use super::info::{EffectInfo, ParameterInfo, Variant};
use super::shapes::{Base, Force, Internal, Moment, Reaction};
use super::side::Side;
use crate::scalar::Scalar;

/// Constant load of one side.
pub struct Load<I>(PhantomData<I>);

impl<I: Side> Force for Load<I> {
    const INFO: EffectInfo = EffectInfo {
        id: ["load_motor", "load_table"][I::INDEX],
        place: I::PLACE,
        family: Family::LoadTorque,
        title: [
            "Constant torque on the motor: amplifier offset, weight",
            "Constant torque on the table: gravity on a tilted axis",
        ][I::INDEX],
        equation: "f = torque",
        signature: ["r1 has a mean; only the line at zero frequency", "r2 has a mean; only the line at zero frequency"]
            [I::INDEX],
        reference: "Paper, section 2: T = Tm - Tc",
        parameters: &[
            ParameterInfo::size("torque", "N.m", -1e6, 1e6, "Torque that resists positive motion").nominal(1e-2)
        ],
        memory: 0,
        named: true,
        textbook: [true, false][I::INDEX],
        // Every axis has friction, few carry a weight. Above a half: with less, a symmetric friction together with a weight would be
        // named one asymmetric friction, which is rarer still.
        odds: 2.0,
        bounds: |p, x| p[0].abs() <= 20.0 * x.torque,
        example: &[3e-3],
        variants: &[Variant { name: "", free: &[0] }],
    };

    const STATIC_LOAD: bool = true;

    #[inline]
    fn torque<S: Scalar>(p: &[S], _base: &Base<S>, _m: &Moment<S>, _memory: &mut [Internal<S>]) -> Reaction<S> {
        Reaction::given(p[0])
    }
}
