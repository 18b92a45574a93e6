//! A third inertia on a spring and a damper, behind the table or on the motor's side: one law at two places.
//!
//! `I3*a3 + damping*(w3 - w) + stiffness*(th3 - th) = 0`; the axis feels the spring. The third inertia is condensed out of
//! the step: trapezoidal rule for it alone, driven by the trial motion of its place.
//!
//! Memory: twist `th - th3` and its rate, relative so that a turning axis loses no digits, and the acceleration `a3`.

use std::marker::PhantomData;

use super::extent::Extent;
use super::family::Family;
use super::info::{EffectInfo, ParameterInfo, Start, Variant};
use super::shapes::{Base, Force, Internal, Moment, Reaction};
use super::side::Side;
use crate::scalar::Scalar;

/// Least damping ratio of a mode: that of bare steel. An undamped mode would vibrate on for the whole record from its start.
const UNDAMPED: f64 = 1e-3;

/// Frequency of a mode, over the end of the excited band, up to which it is one: there it swings twice as far as what it is attached to. One
/// far beyond follows that, and is a part of its inertia.
const BEYOND: f64 = std::f64::consts::SQRT_2;

/// The half-power band of the mode's peak comes that near to the excited band, computed against the inertia that the mode is attached to, the
/// record has periods of it, and the mode is damped, but not overdamped.
fn is_a_mode(p: &[f64], x: &Extent<'_>) -> bool {
    let (inertia, stiffness, damping) = (p[0], p[1], p[2]);
    let coupled = (stiffness * (1.0 / inertia + 1.0 / x.inertia[0])).sqrt();
    let own = (stiffness / inertia).sqrt();
    inertia > 0.0
        && inertia <= 4.0 * x.inertia[1]
        && own - 0.5 * damping / inertia <= BEYOND * x.band
        && x.has_periods(own)
        && coupled <= 2.0 * x.band
        && (2.0 * UNDAMPED..=0.5).contains(&(damping / (inertia * stiffness).sqrt()))
}

const PARAMETERS: &[ParameterInfo] = &[
    ParameterInfo::size("inertia", "kg.m2", 0.0, 1e6, "Inertia that swings").nominal(1e-6).start(Start::Mode),
    ParameterInfo::shape("stiffness", "N.m/rad", 1.0, 1e-9, 1e12, "Stiffness between the axis and it")
        .start(Start::Mode),
    ParameterInfo::shape("damping", "N.m.s/rad", 0.0, 0.0, 1e9, "Damping between the axis and it").start(Start::Mode),
];

/// A flexible mode of one side: on the motor's, or behind the table.
pub struct Mode<I>(PhantomData<I>);

impl<I: Side> Force for Mode<I> {
    const INFO: EffectInfo = EffectInfo {
        id: ["motor_mode", "flexible_mode"][I::INDEX],
        place: I::PLACE,
        family: Family::FlexibleMode,
        title: ["A third inertia on a spring on the motor's side", "A third inertia on a spring behind the table"]
            [I::INDEX],
        equation: [
            "I3*a3 + damping*(w3 - w1) + stiffness*(th3 - th1) = 0; f = damping*(w1 - w3) + stiffness*(th1 - th3)",
            "I3*a3 + damping*(w3 - w2) + stiffness*(th3 - th2) = 0; f = damping*(w2 - w3) + stiffness*(th2 - th3)",
        ][I::INDEX],
        signature: ["r1 linear, a peak in one band of frequencies", "r2 linear, a peak in one band of frequencies"]
            [I::INDEX],
        reference: "Den Hartog, Mechanical Vibrations, 1956, chapter 3",
        parameters: PARAMETERS,
        memory: 3,
        named: true,
        textbook: false,
        odds: 0.3,
        bounds: is_a_mode,
        example: [&[5e-5, 0.2, 1e-4], &[2e-6, 0.02, 1e-5]][I::INDEX],
        variants: &[Variant { name: "", free: &[0, 1, 2] }],
    };

    const IDENTIFYING: Option<usize> = Some(1);

    fn rate(p: &[f64], _inertia: f64) -> f64 {
        if p[0] > 0.0 { (p[1] / p[0]).sqrt() } else { 0.0 }
    }

    /// The third inertia keeps its speed when that of its place jumps.
    fn jumped<S: Scalar>(p: &[S], memory: &mut [S], jump: S) {
        memory[1] += jump;
        if p[0].re() > 0.0 {
            memory[2] += p[2] / p[0] * jump;
        }
    }

    #[inline]
    fn torque<S: Scalar>(p: &[S], _base: &Base<S>, m: &Moment<S>, memory: &mut [Internal<S>]) -> Reaction<S> {
        let (inertia, k, b) = (p[0], p[1], p[2]);
        if inertia.re() <= 0.0 && m.h.re() == 0.0 {
            return Reaction::given(S::default());
        }
        // Absolute motion of the third inertia, from the relative memory.
        let (e, rate) = (memory[0].start, memory[1].start);
        if m.h.re() == 0.0 {
            return Reaction { torque: k * e + b * rate, stiffness: k.re(), damping: b.re(), curvature: 0.0 };
        }
        let half = m.h * 0.5;
        let w3 = m.start.v - rate;
        // Trapezoid: w3+ = w3 + h/2*(a3 + a3+), e+ = e + (x2+ - x2) - h/2*(w3 + w3+), I3*a3 = b*(w2 - w3) + k*(th2 - th3).
        let a3 = memory[2].start;
        let free = w3 + half * a3;
        let dx = m.end.x - m.start.x;
        // I3*a3+ = b*(v2+ - w3+) + k*(e + dx - half*(w3 + w3+)), w3+ = free + half*a3+.
        let rhs = b * (m.end.v - free) + k * (e + dx - half * (w3 + free));
        let effective = inertia + half * b + half * half * k;
        let a = rhs / effective;
        let w = free + half * a;
        let torque = inertia * a;
        let [per_x, per_v] = [k, b].map(|c| c.re() / effective.re());
        let h2 = half.re();
        memory[0].set_end(e + dx - half * (w3 + w), 1.0 - h2 * h2 * per_x, -h2 * h2 * per_v);
        memory[1].set_end(m.end.v - w, -h2 * per_x, 1.0 - h2 * per_v);
        memory[2].set_end(a, per_x, per_v);
        let inertia = inertia.re();
        Reaction { torque, stiffness: inertia * per_x, damping: inertia * per_v, curvature: 0.0 }
    }
}
