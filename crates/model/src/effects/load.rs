//! A constant torque: gravity on a tilted axis, the offset of an amplifier. `f = torque`.

use super::family::Family;
use super::info::{EffectInfo, ParameterInfo, Place, Variant};
use super::shapes::{Base, Force, Internal, Moment, Reaction};
use crate::scalar::Scalar;

const PARAMETERS: &[ParameterInfo] =
    &[ParameterInfo::size("torque", "N.m", -1e6, 1e6, "Torque that resists positive motion").nominal(1e-2)];
const VARIANTS: &[Variant] = &[Variant { name: "", free: &[0] }];
const EQUATION: &str = "f = torque";
const REFERENCE: &str = "Paper, section 2: T = Tm - Tc";

/// Constant load on the motor side.
pub struct LoadMotor;

impl Force for LoadMotor {
    const INFO: EffectInfo = EffectInfo {
        id: "load_motor",
        place: Place::Motor,
        family: Family::LoadTorque,
        title: "Constant torque on the motor: amplifier offset, weight",
        equation: EQUATION,
        signature: "r1 has a mean; only the line at zero frequency",
        reference: REFERENCE,
        parameters: PARAMETERS,
        memory: 0,
        named: true,
        textbook: true,
        odds: 1.0,
        bounds: |_, _| true,
        example: &[3e-3],
        variants: VARIANTS,
    };

    const CARRIED: bool = true;

    #[inline]
    fn torque<S: Scalar>(p: &[S], _base: &Base<S>, _m: &Moment<S>, _memory: &mut [Internal<S>]) -> Reaction<S> {
        Reaction::given(p[0])
    }
}

/// Constant load on the table side.
pub struct LoadTable;

impl Force for LoadTable {
    const INFO: EffectInfo = EffectInfo {
        id: "load_table",
        place: Place::Table,
        family: Family::LoadTorque,
        title: "Constant torque on the table: gravity on a tilted axis",
        equation: EQUATION,
        signature: "r2 has a mean; only the line at zero frequency",
        reference: REFERENCE,
        parameters: PARAMETERS,
        memory: 0,
        named: true,
        textbook: false,
        odds: 1.0,
        bounds: |_, _| true,
        example: &[3e-3],
        variants: VARIANTS,
    };

    const CARRIED: bool = true;

    #[inline]
    fn torque<S: Scalar>(p: &[S], _base: &Base<S>, _m: &Moment<S>, _memory: &mut [Internal<S>]) -> Reaction<S> {
        Reaction::given(p[0])
    }
}
