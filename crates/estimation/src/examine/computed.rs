//! A torque that was not measured: an inertia times the acceleration of a column of the same record.
//!
//! ```text
//! T(k) = a*(x(k + s) - 2*x(k) + x(k - s)) + b      of a position, s = 1 (differences) or 2 (gradients of gradients)
//! T(k) = a*(v(k + s) - v(k - 1)) + b                of a speed,    s = 0 (a difference) or 1 (a gradient)
//! ```
//!
//! with a delay or lead of some samples. The motion of an axis without friction that is simulated from its torque fulfils the same equation,
//! so the equation alone is no criterion. The noise distinguishes the two: the power of differences of a sensor's noise or quantisation grows
//! with the frequency, and a computed torque is mostly that noise. A torque of a drive is not, and differs by the sensor's noise from the
//! differences of the position.

use super::Input;
use super::finding::{Finding, Severity};
use super::least::Line;
use super::robust::span;
use super::spectra::Spectra;

/// Share of the torque's deviation up to which what the differences do not explain of it is rounding: a log of six digits is far below it,
/// the noise of a sensor far above.
const ROUNDING: f64 = 1e-3;
/// Samples that the differences may be late or early.
const LATE: usize = 3;
/// Samples that are compared first, all over the record: nearly every torque differs in those.
const FIRST: usize = 256;
/// Samples of a segment of the spectra.
const SEGMENT: usize = 256;
/// Power of the torque in the octave below the highest, over that in the highest, up to which it rises as differences of noise do: white noise
/// of a position has 0.06, the steps of an encoder in slow motion, whose power falls with the square of the frequency, have 0.25, and a flat
/// torque has 1. Below these octaves is the motion, which says nothing.
const RISES: f64 = 0.5;

/// A kind of differences: the column's value at some samples about this one, each with its weight.
struct Differences {
    weights: &'static [(i32, f64)],
    /// Samples between the values: half the sampling rate is theirs at that many.
    apart: usize,
    name: &'static str,
}

const OF_POSITION: [Differences; 2] = [
    Differences { weights: &[(-1, 1.0), (0, -2.0), (1, 1.0)], apart: 1, name: "second differences" },
    Differences { weights: &[(-2, 1.0), (0, -2.0), (2, 1.0)], apart: 2, name: "second differences over two samples" },
];
const OF_SPEED: [Differences; 2] = [
    Differences { weights: &[(-1, -1.0), (0, 1.0)], apart: 1, name: "differences" },
    Differences { weights: &[(-1, -1.0), (1, 1.0)], apart: 2, name: "differences over two samples" },
];

/// How the torque is made of differences, `late` samples later: the share of its deviation that they leave, at every `stride`-th sample.
fn left(t: &[f64], differences: impl Fn(usize) -> f64, late: i32, stride: usize) -> f64 {
    let of = |k: usize| (differences(k.wrapping_add_signed(-late as isize)), t[k]);
    let line = Line::through(|| (LATE..t.len() - LATE).step_by(stride).map(of));
    let moves = line.slope.is_finite() && line.squares[1] > 0.0;
    if moves { (line.left / line.squares[1]).sqrt() } else { f64::INFINITY }
}

/// Whether a torque rises towards the highest frequency that differences over so many samples pass.
fn rises(t: &[f64], apart: usize, dt: f64) -> bool {
    let spectra = Spectra::new(&[t], SEGMENT, dt);
    let octave = |highest: usize| {
        let lines = highest / 2 - 1..highest - 1;
        lines.clone().map(|f| spectra.power(0, f)).sum::<f64>() / lines.len() as f64
    };
    let highest = SEGMENT / 2 / apart;
    octave(highest / 2) < RISES * octave(highest)
}

/// Looks for a torque that is an inertia times the acceleration of a column.
pub(super) fn examine(input: &Input<'_>, findings: &mut Vec<Finding>) {
    let Some(t) = input.torque.filter(|t| t.len() >= SEGMENT && span(t) > 0.0) else { return };
    for channel in input.channels().filter(|c| c.name != "T") {
        let kinds = if channel.name.starts_with("theta") { &OF_POSITION } else { &OF_SPEED };
        for kind in kinds {
            let x = channel.values;
            // Away from the ends, where a program has differences of its own.
            let at =
                |k: usize| kind.weights.iter().map(|(i, w)| w * x[k.wrapping_add_signed(*i as isize)]).sum::<f64>();
            let some = (t.len() / FIRST).max(1);
            let made = |late: &i32| left(t, at, *late, some) < 10.0 * ROUNDING && left(t, at, *late, 1) < ROUNDING;
            let late = LATE as i32 - kind.apart as i32;
            if !(-late..=late).any(|l| made(&l)) || !rises(t, kind.apart, input.dt) {
                continue;
            }
            findings.push(Finding::new(
                "computed",
                Severity::Refuse,
                "T",
                format!(
                    "T is the {} of {} times a number, with the noise of that sensor in it: it was computed from the motion.",
                    kind.name, channel.name
                ),
                "It is no torque that was measured or commanded: the motion follows it whatever the machine is, and friction, play and every \
                 other effect are not in it.",
                "Map the column of the drive's torque or current in [signals]; where the log has none, log it.",
            ));
            return;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::level::noise;

    const DT: f64 = 1e-3;

    fn found(torque: &[f64], position: Option<&[f64]>, speed: Option<&[f64]>) -> bool {
        let input = Input { dt: DT, torque: Some(torque), theta1: position, omega1: speed, ..Input::default() };
        let mut findings = Vec::new();
        examine(&input, &mut findings);
        findings.iter().any(|f| f.id == "computed" && f.severity == Severity::Refuse)
    }

    /// A position under some moves, rad.
    fn motion(k: usize) -> f64 {
        let t = k as f64 * DT;
        0.4 * (7.0 * t).sin() + 0.05 * (61.0 * t).cos()
    }

    /// As `numpy.gradient` has it, per sample.
    fn gradient(x: &[f64]) -> Vec<f64> {
        let last = x.len() - 1;
        (0..=last)
            .map(|k| {
                let (a, b) = (k.saturating_sub(1), (k + 1).min(last));
                (x[b] - x[a]) / (b - a) as f64
            })
            .collect()
    }

    #[test]
    fn an_inertia_times_the_differentiated_position_is_found_and_named() {
        let noisy: Vec<f64> = noise(4000, 1).iter().enumerate().map(|(k, e)| motion(k) + 1e-5 * e).collect();
        let counted: Vec<f64> = (0..4000).map(|k| (motion(k) / 1e-4).round() * 1e-4).collect();
        for x in [&noisy, &counted] {
            let speed = gradient(x);
            let twice = gradient(&speed);
            let second: Vec<f64> =
                (0..4000).map(|k| if k < 2 { 0.0 } else { x[k] - 2.0 * x[k - 1] + x[k - 2] }).collect();
            for torque in [&twice, &second] {
                // Written with six digits, and with an offset.
                let largest = torque.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
                let written: Vec<f64> =
                    torque.iter().map(|v| (v / largest * 1e6).round() * 1e-6 * 0.3 + 0.01).collect();
                assert!(found(&written, Some(x), None));
                let friction: Vec<f64> = written.iter().zip(&speed).map(|(t, v)| t + 0.02 * v.signum()).collect();
                assert!(!found(&friction, Some(x), None), "a torque with friction in it is not of the motion alone");
            }
            assert!(found(&twice, None, Some(&speed)));
        }
    }

    #[test]
    fn the_motion_of_an_axis_without_friction_is_not_taken_for_the_torque_that_moves_it() {
        let white = noise(4000, 2);
        let slow: Vec<f64> = (0..4000).map(|k| (0.03 * k as f64).sin()).collect();
        let steps: Vec<f64> = (0..4000).map(|k| if (k * k / 7) % 11 < 5 { 1.0 } else { -1.0 }).collect();
        for torque in [&white, &slow, &steps] {
            // Whole steps of a scheme that holds the equation to the last bit, in either order.
            let (mut x, mut v) = (vec![0.0; 4000], vec![0.0; 4000]);
            for k in 1..4000 {
                v[k] = v[k - 1] + torque[k - 1] * DT;
                x[k] = x[k - 1] + v[k] * DT;
            }
            assert!(!found(torque, Some(&x), None));
            assert!(!found(torque, None, Some(&v)));
            // A sensor's noise beside it.
            let seen: Vec<f64> = x.iter().zip(noise(4000, 3)).map(|(x, e)| x + 1e-7 * e).collect();
            assert!(!found(torque, Some(&seen), None));
        }
    }
}
