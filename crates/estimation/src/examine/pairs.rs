//! A speed against its angle: the difference of the angle over some samples is the integral of the speed.

use super::Input;
use super::finding::{Finding, Severity};
use super::robust::step;
use crate::numerics::level::rms;

/// Factors between units that are taken for one another, and what to say of them.
pub(super) const FACTORS: [(f64, &str); 7] = [
    (180.0 / std::f64::consts::PI, "57.3, degrees for radians"),
    (1000.0, "1000, thousandths (mN.m, mrad, ms) for the unit"),
    (30.0 / std::f64::consts::PI, "9.55, turns a minute for rad/s"),
    (std::f64::consts::TAU, "6.28, turns for radians"),
    (60.0, "60, minutes for seconds"),
    (360.0, "360, degrees for turns"),
    (1e6, "1e6, milliseconds for seconds (squared), or millionths"),
];
/// A ratio this near to a factor is that factor.
pub(super) const NEAR: f64 = 0.12;

/// The factor that a ratio, or its inverse, is near to.
pub(super) fn factor(ratio: f64) -> Option<&'static str> {
    factor_within(ratio, NEAR)
}

/// The factor that a ratio, or its inverse, is as near to as told, in their logarithms.
pub(super) fn factor_within(ratio: f64, near: f64) -> Option<&'static str> {
    let size = ratio.abs().ln().abs();
    FACTORS.iter().find(|(f, _)| (size - f.ln()).abs() < near).map(|(_, meaning)| *meaning)
}

/// Regression of the differences of an angle on the integral of a speed over as many samples, `dt` in s: the gain (1 where both are in one unit)
/// and the square of their correlation. `None` where one of them does not change.
fn against(angle: &[f64], speed: &[f64], dt: f64) -> Option<(f64, f64)> {
    let n = angle.len();
    let fine = step(angle);
    let mut best: Option<(f64, f64)> = None;
    let mut integral = Vec::with_capacity(n);
    let mut sum = 0.0;
    for k in 0..n {
        integral.push(sum);
        if k + 1 < n {
            sum += 0.5 * dt * (speed[k] + speed[k + 1]);
        }
    }
    let mut length = 4;
    while length <= n / 8 {
        let stride = (length / 2).max(n / 100_000).max(1);
        let (mut ww, mut wi, mut ii) = (0.0, 0.0, 0.0);
        let (mut w1, mut i1, mut count) = (0.0, 0.0, 0.0);
        for k in (0..n - length).step_by(stride) {
            let way = angle[k + length] - angle[k];
            let by_speed = integral[k + length] - integral[k];
            ww += way * way;
            wi += way * by_speed;
            ii += by_speed * by_speed;
            w1 += way;
            i1 += by_speed;
            count += 1.0;
        }
        // About the mean, so that an offset of the speed does not lower the correlation.
        let (vw, cov, vi) = (ww - w1 * w1 / count, wi - w1 * i1 / count, ii - i1 * i1 / count);
        if vw > 0.0 && vi > 0.0 {
            let alike = cov * cov / (vw * vi);
            let counted = (vw / count).sqrt() > 8.0 * fine;
            if best.is_none_or(|(_, b)| alike > b) {
                best = Some((cov / vi, alike));
            }
            if counted && alike > 0.98 {
                break;
            }
        }
        length *= 2;
    }
    best
}

/// Squared correlation from which a speed is the derivative of its angle.
const COHERENT: f64 = 0.8;
/// Squared correlation below which it is another signal.
const FOREIGN: f64 = 0.3;

/// Looks at the speeds that are logged beside their angles.
pub(super) fn speeds(input: &Input<'_>, findings: &mut Vec<Finding>) {
    let pairs = [("theta1", input.theta1, "omega1", input.omega1), ("theta2", input.theta2, "omega2", input.omega2)];
    let misfit = |x: Option<&[f64]>, v: Option<&[f64]>| {
        x.zip(v)
            .and_then(|(x, v)| against(x, v, input.dt))
            .map(|(gain, alike)| if gain > 0.0 { 1.0 - alike } else { 1.0 })
    };
    let [(_, x1, _, v1), (_, x2, _, v2)] = pairs;
    if let (Some(own1), Some(own2), Some(cross1), Some(cross2)) =
        (misfit(x1, v1), misfit(x2, v2), misfit(x1, v2), misfit(x2, v1))
        && cross1 < 0.2 * own1
        && cross2 < 0.2 * own2
    {
        findings.push(Finding::new(
            "swapped",
            Severity::Refuse,
            "omega1, omega2",
            "omega1 is the derivative of theta2, and omega2 that of theta1.",
            "The columns are mapped to the wrong signals.",
            "Exchange the two speeds (or the two angles) in [signals] of the axis file.",
        ));
        return;
    }
    for (angle, x, speed, v) in pairs {
        let (Some(x), Some(v)) = (x, v) else { continue };
        let Some((gain, alike)) = against(x, v, input.dt) else { continue };
        let add = |findings: &mut Vec<Finding>, id, severity, seen: String, means: &str, remedy: &str| {
            findings.push(Finding::new(id, severity, speed, seen, means, remedy));
        };
        let leave = "Leave the column out of [signals], or map the right one.";
        if alike >= COHERENT {
            if (gain + 1.0).abs() < 0.3 {
                add(
                    findings,
                    "sign",
                    Severity::Refuse,
                    format!("{speed} runs against {angle}: it is minus its derivative."),
                    "One of the two columns has its sign turned.",
                    "Give the turned column scale = -1 in [signals] of the axis file.",
                );
            } else if let Some(meaning) = factor(gain) {
                add(
                    findings,
                    "units",
                    Severity::Refuse,
                    format!(
                        "{angle} changes {gain:.4} times as fast as {speed} says, which looks like a factor of {meaning}."
                    ),
                    "One of the two columns is in another unit than the file says.",
                    "Give the unit in the header or in [signals] (unit = \"deg\", \"rpm\", ...).",
                );
            } else if !(0.75..1.33).contains(&gain) {
                add(
                    findings,
                    "scale",
                    Severity::Warn,
                    format!("{angle} changes {gain:.4} times as fast as {speed} says."),
                    "The scale of one of them is off, or a gear lies between the two.",
                    "Give the right scale in [signals], or leave the speed out.",
                );
            }
            continue;
        }
        if against(v, x, input.dt).is_some_and(|(gain, r)| gain > 0.0 && r > 0.9 && r > alike + 0.2) {
            add(
                findings,
                "swapped",
                Severity::Refuse,
                format!("{angle} is the derivative of {speed}: the two columns are exchanged."),
                "The columns are mapped to the wrong signals.",
                "Exchange them in [signals] of the axis file.",
            );
        } else if alike < FOREIGN && rms(v) > 0.0 {
            add(
                findings,
                "foreign",
                Severity::Refuse,
                format!(
                    "{speed} is not the speed of {angle}: {:.0} % of the one's motion shows in the other.",
                    100.0 * alike
                ),
                "It comes from another axis or another time, or a sensor is broken.",
                leave,
            );
        } else {
            add(
                findings,
                "filtered",
                Severity::Note,
                format!("{speed} follows the derivative of {angle} to {:.0} %.", 100.0 * alike),
                "It is filtered, late, or coarse.",
                "It is of little use beside the angle: leave it out of [signals] where estimates with and without it differ.",
            );
        }
    }
}
