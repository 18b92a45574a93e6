//! An amplifier that does not respond to small commands: `T = command - min(max(command, -width), width)`.
//!
//! A ramp that crosses the edge within a step has a kink there. What is left of it is taken with its mean and its first
//! moment (see [`Ramp`]), so that its momentum is exact wherever in the step the edge lies.

use super::family::Family;
use super::info::{EffectInfo, ParameterInfo, Place, Scale, Start, Variant};
use super::input::{Ramp, TorqueHistory};
use super::shapes::Input;
use crate::scalar::Scalar;

/// The amplifier's dead zone.
pub struct DeadZone;

/// What of a torque lies above zero.
fn above<S: Scalar>(torque: S) -> S {
    if torque.re() > 0.0 { torque } else { S::default() }
}

/// Mean and first moment, over a step of unit length, of what of a ramp lies above zero.
fn moments_above<S: Scalar>(a: S, b: S) -> [S; 2] {
    if a.re() <= 0.0 && b.re() <= 0.0 {
        return [S::default(); 2];
    }
    if a.re() >= 0.0 && b.re() >= 0.0 {
        return [(a + b) * 0.5, a * (1.0 / 6.0) + b * (1.0 / 3.0)];
    }
    let crossing = a / (a - b);
    if b.re() > 0.0 {
        // From zero at the crossing to b at the end.
        let rest = S::from(1.0) - crossing;
        [rest * b * 0.5, rest * (crossing * b * 0.5 + rest * b * (1.0 / 3.0))]
    } else {
        // From a at the start to zero at the crossing.
        [crossing * a * 0.5, crossing.squared() * a * (1.0 / 6.0)]
    }
}

impl Input for DeadZone {
    const INFO: EffectInfo = EffectInfo {
        id: "dead_zone",
        place: Place::Input,
        family: Family::DeadZone,
        title: "An amplifier that does not answer to small commands",
        equation: "T = command - min(max(command, -width), width)",
        signature: "r1 against the command: all of it while small, a constant of its sign beyond; falls with the amplitude",
        reference: "Tao, Kokotovic, Adaptive Control of Systems with Actuator and Sensor Nonlinearities, 1996, chapter 2",
        parameters: &[ParameterInfo::size("width", "N.m", 0.0, 1e6, "Largest command without an answer")
            .nominal(1e-3)
            .start(Start::Grid(Scale::Torque, &[0.01, 0.03, 0.1, 0.3]))],
        memory: 0,
        named: true,
        textbook: false,
        odds: 0.3,
        // A drive that swallows more than half of its largest command is broken, not imperfect.
        bounds: |p, x| p[0] <= 0.5 * x.torque,
        example: &[5e-3],
        variants: &[Variant { name: "", free: &[0] }],
    };
    const BENDS: bool = true;

    fn transform<S: Scalar>(p: &[S], ramp: Ramp<S>, _h: S, _history: &mut TorqueHistory<S>) -> Ramp<S> {
        let Ramp { start: a, end: b } = ramp;
        let ends = Ramp { start: above(a - p[0]) - above(-a - p[0]), end: above(b - p[0]) - above(-b - p[0]) };
        let same_side = |edge: S| (a.re() > edge.re()) == (b.re() > edge.re());
        if same_side(p[0]) && same_side(-p[0]) {
            return ends;
        }
        let ([up0, up1], [down0, down1]) = (moments_above(a - p[0], b - p[0]), moments_above(-a - p[0], -b - p[0]));
        Ramp::from_moments(up0 - down0, up1 - down1)
    }

    fn now<S: Scalar>(p: &[S], torque: S, _history: &TorqueHistory<f64>) -> S {
        above(torque - p[0]) - above(-torque - p[0])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Mean and first moment by the midpoint rule over many pieces, each without a kink but for one.
    fn summed(a: f64, b: f64, width: f64) -> [f64; 2] {
        const PIECES: u32 = 1_000_000;
        let mut sum = [0.0; 2];
        for k in 0..PIECES {
            let s = (f64::from(k) + 0.5) / f64::from(PIECES);
            let t = a + (b - a) * s;
            let left = t - t.clamp(-width, width);
            sum[0] += left / f64::from(PIECES);
            sum[1] += left * s / f64::from(PIECES);
        }
        sum
    }

    #[test]
    fn a_ramp_through_the_zone_keeps_mean_and_first_moment() {
        for (a, b) in [(0.3, 2.0), (2.0, -0.5), (-3.0, 2.0), (1.5, -4.0), (-0.2, -3.0), (-2.0, 0.1), (0.4, -0.7)] {
            let r = DeadZone::transform(&[1.0], Ramp { start: a, end: b }, 1e-3, &mut TorqueHistory::default());
            let [m0, m1] = summed(a, b, 1.0);
            assert!(((r.start + r.end) / 2.0 - m0).abs() < 1e-10, "{a} {b}");
            assert!((r.start / 6.0 + r.end / 3.0 - m1).abs() < 1e-10, "{a} {b}");
        }
    }

    #[test]
    fn a_ramp_on_one_side_loses_the_width_and_no_more() {
        let of = |a, b| DeadZone::transform(&[1.0], Ramp { start: a, end: b }, 1e-3, &mut TorqueHistory::default());
        assert_eq!(of(1.5, 4.0), Ramp { start: 0.5, end: 3.0 });
        assert_eq!(of(-4.0, -1.5), Ramp { start: -3.0, end: -0.5 });
        assert_eq!(of(-0.9, 1.0), Ramp { start: 0.0, end: 0.0 });
        assert_eq!(DeadZone::now(&[1.0], -1.25, &TorqueHistory::default()), -0.25);
    }
}
