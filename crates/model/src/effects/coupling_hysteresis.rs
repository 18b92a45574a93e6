//! Hysteresis of the coupling: a rate-independent loop in parallel with the spring.
//!
//! `f = level*z`, `reach*dz = dd*(1 - |z|^sharpness*(1 + sgn(dd*z))/2)`: the Bouc-Wen loop with beta = gamma, which turns
//! with the stiffness `level/reach` and closes at `level`. Wen, J. Eng. Mech. 102(2), 1976; Ikhouane, Rodellar, Systems
//! with Hysteresis, Wiley 2007, chapter 2.

use super::family::Family;
use super::info::{EffectInfo, ParameterInfo, Place, Scale, Start, Variant};
use super::shapes::{Base, Force, Internal, Moment, Reaction};
use crate::scalar::Scalar;

/// Hysteresis of the coupling.
pub struct CouplingHysteresis;

/// `ds/dx` of a loop that opens, `s >= 0` the way it moves, x the twist in units of the reach.
fn slope<S: Scalar>(s: S, sharpness: S) -> S {
    S::from(1.0) - s.powf(sharpness)
}

/// The loop after a move `x` in units of the reach, and its derivative to that.
fn advance<S: Scalar>(z: S, x: S, sharpness: S) -> (S, f64) {
    let direction = x.re().signum();
    let (s, x) = (z * direction, x * direction);
    // Back to its middle the loop is a spring.
    let beyond = x + s;
    let (end, tangent) = if s.re() >= 0.0 {
        open(s, x, sharpness)
    } else if beyond.re() > 0.0 {
        open(S::default(), beyond, sharpness)
    } else {
        (beyond, 1.0)
    };
    (end * direction, tangent)
}

/// The loop opened by `x` from `s >= 0`, in parts of at most half a reach.
fn open<S: Scalar>(s: S, x: S, sharpness: S) -> (S, f64) {
    let mut at = (s, 0.0);
    let parts = (2.0 * x.re()).ceil().clamp(1.0, 32.0);
    let dx = if parts > 1.0 { x / parts } else { x };
    for _ in 0..parts as usize {
        let s = at.0;
        at = if SERIES * dx.re() * sharpness.re().max(1.0) < s.re() {
            by_series(s, dx, sharpness)
        } else {
            by_runge_kutta(s, dx, sharpness)
        };
        if at.0.re() > 1.0 {
            at = (S::from(1.0), 0.0);
        }
    }
    at
}

/// Moves in one of which the loop's series has terms that fall by this factor at least.
const SERIES: f64 = 4.0;

/// A part by the series of fourth order about its start: one power, where Runge and Kutta's four stages take one each.
fn by_series<S: Scalar>(s: S, x: S, n: S) -> (S, f64) {
    let per = S::from(1.0) / s;
    let power = s.powf(n);
    // The slope at the start and its derivatives to `s`.
    let g = S::from(1.0) - power;
    let g1 = -(n * power * per);
    let g2 = (n - 1.0) * g1 * per;
    let g3 = (n - 2.0) * g2 * per;
    let second = g1 * g;
    let third = (g2 * g + g1 * g1) * g;
    let fourth = ((g3 * g + g2 * g1 * 4.0) * g + g1 * g1 * g1) * g;
    let end = s + x * (g + x * (second * 0.5 + x * (third * (1.0 / 6.0) + x * fourth * (1.0 / 24.0))));
    let (x, third, fourth) = (x.re(), third.re(), fourth.re());
    (end, g.re() + x * (second.re() + x * (0.5 * third + x * fourth / 6.0)))
}

/// A part by the classical method of Runge and Kutta.
fn by_runge_kutta<S: Scalar>(s: S, x: S, sharpness: S) -> (S, f64) {
    let half = x * 0.5;
    let a = slope(s, sharpness);
    let b = slope(s + half * a, sharpness);
    let c = slope(s + half * b, sharpness);
    let d = slope(s + x * c, sharpness);
    let end = s + x * (1.0 / 6.0) * (a + b * 2.0 + c * 2.0 + d);
    (end, slope(end, sharpness).re())
}

impl Force for CouplingHysteresis {
    const INFO: EffectInfo = EffectInfo {
        id: "coupling_hysteresis",
        place: Place::Coupling,
        family: Family::Hysteresis,
        title: "A loop in the spring's characteristic that speed does not open",
        equation: "f = level*z; reach*dz = dd*(1 - |z|^sharpness*(1 + sgn(dd*z))/2)",
        signature: "r1 = -r2, a loop over the twist that slow motion does not close; odd lines",
        reference: "Wen, J. Eng. Mech. 102(2), 1976; Ikhouane, Rodellar, Systems with Hysteresis, 2007",
        parameters: &[
            ParameterInfo::size("level", "N.m", 0.0, 1e6, "Torque of the loop when it has closed").nominal(1e-2),
            ParameterInfo::shape("reach", "rad", 1e-2, 1e-9, 1e3, "Twist over which the loop closes")
                .start(Start::Grid(Scale::Twist, &[0.03, 0.1, 0.3, 1.0])),
            ParameterInfo::shape("sharpness", "1", 1.0, 0.2, 20.0, "How abruptly the loop yields"),
        ],
        memory: 1,
        named: true,
        textbook: false,
        odds: 1.0,
        // A loop that the twist does not close is a spring; a multisine's swings to and fro by four times its rms and more.
        bounds: |p, x| p[0] <= x.torque && p[1] <= 4.0 * x.twist,
        example: &[1e-3, 0.02, 1.5],
        variants: &[Variant { name: "", free: &[0, 1] }, Variant { name: "sharp", free: &[0, 1, 2] }],
    };

    #[inline]
    fn torque<S: Scalar>(p: &[S], _base: &Base<S>, m: &Moment<S>, z: &mut [Internal<S>]) -> Reaction<S> {
        let per_reach = S::from(1.0) / p[1];
        let dx = if m.h.re() == 0.0 { S::default() } else { (m.end.x - m.start.x) * per_reach };
        let (after, per_x) = advance(z[0].start, dx, p[2]);
        let tangent = per_x * per_reach.re();
        z[0].set_end(after, tangent, 0.0);
        Reaction { torque: p[0] * after, stiffness: p[0].re() * tangent, damping: 0.0, curvature: f64::INFINITY }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `s' = 1 - s` and `s' = 1 - s^2` have closed solutions.
    #[test]
    fn the_loop_follows_its_closed_solutions_and_comes_back_on_a_line() {
        // A move of a sample, and parts of half a reach, which are as coarse as that.
        let moves = [(0.0, 0.02, 1e-6), (0.02, 0.02, 1e-6), (0.5, 0.1, 1e-6), (0.99, 0.01, 1e-6), (0.2, 3.0, 1e-3)];
        for (from, x, bound) in moves {
            let exponential = 1.0 - (1.0 - from) * f64::exp(-x);
            let tanh = f64::tanh(x + f64::atanh(from));
            for (sharpness, expected) in [(1.0, exponential), (2.0, tanh)] {
                let (end, tangent) = advance(from, x, sharpness);
                assert!((end - expected).abs() < bound, "{from} {x} {sharpness}: {end} {expected}");
                let slope = 1.0 - expected.powf(sharpness);
                assert!((tangent - slope).abs() < 10.0 * bound, "{from} {x} {sharpness}: {tangent} {slope}");
                let (mirrored, same) = advance(-from, -x, sharpness);
                assert!((mirrored + end).abs() < 1e-15 && (same - tangent).abs() < 1e-15);
            }
        }
        assert_eq!(advance(0.5, -0.3, 1.7), (0.2, 1.0));
        let (beyond, _) = advance(0.1, -0.3, 1.0);
        assert!((beyond + 1.0 - f64::exp(-0.2)).abs() < 1e-5, "{beyond}");
    }

    /// The move that opens a loop to `s`: the integral of `1/(1 - s^n)`, term by term of its geometric series.
    fn opened_by(s: f64, n: f64) -> f64 {
        (0..1000).map(|k| n * f64::from(k) + 1.0).map(|power| s.powf(power) / power).sum()
    }

    #[test]
    fn a_move_as_small_as_one_of_a_sample_is_made_by_the_series_as_exactly_as_by_runge_and_kutta() {
        for (from, x, sharpness) in [(0.3_f64, 0.01, 1.7), (0.7, 0.02, 4.0), (0.95, 0.005, 20.0), (0.5, 0.1, 0.4)] {
            let off = |(end, tangent): (f64, f64)| {
                (tangent * (opened_by(end, sharpness) - opened_by(from, sharpness) - x)).abs()
            };
            assert!(off(by_series(from, x, sharpness)) < 1e-7, "{from} {x} {sharpness}");
            assert!(off(by_runge_kutta(from, x, sharpness)) < 1e-7, "{from} {x} {sharpness}");
        }
    }
}
