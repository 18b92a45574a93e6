//! Columns that are no measurement of their own: another column of the record, scaled, shifted or some samples later.
//!
//! ```text
//! y(k) = a*x(k - l) + b      but for rounding
//! y(k) = x(k)                at one sample of m, and not at the others
//! ```
//!
//! Two sensors, or a sensor and a torque, never agree to a millionth at every sample: they differ by noise, quantisation and the twist of the
//! coupling. On an axis that goes far in one direction these may be less than a millionth of its way: a copy has the other's noise, too.

use super::finding::{Finding, Severity, rounded};
use super::least::Line;
use super::{Channel, Input};

/// Residual over a column's standard deviation up to which it is rounding and the column a copy.
const ROUNDING: f64 = 1e-6;
/// Share of a column's second differences that is its rounding where it is a copy. Two sensors' noise is all of it and more, beside a motion that
/// turns within a sample a tenth.
const APART: f64 = 0.02;
/// Largest delay or lead of a copy, samples: a cycle or two of a slower task.
const LATE: usize = 10;
/// Samples, evenly spaced over the record, that are compared first and second: nearly every pair differs in the first ones; of those that
/// do not, as two encoders on one shaft that moved far, most differ in the second ones.
const FIRST: usize = 256;
const THEN: usize = 64 * FIRST;

/// Most columns that a logger multiplexes.
const TURNS: usize = 8;
/// Samples of one column in which two columns cannot agree by chance, however coarse their quantisation is.
const LEAST: usize = 64;

/// The number of multiplexed columns, where `x` and `y` are equal at one sample of so many and differ at half of the others or more.
fn multiplexed(x: &[f64], y: &[f64]) -> Option<usize> {
    let one = |k: &usize| x[*k] == y[*k];
    (2..=TURNS.min(x.len() / LEAST)).find(|turns| {
        (0..*turns).any(|own| {
            let others = || (0..x.len()).filter(|k| k % turns != own);
            (own..x.len()).step_by(*turns).all(|k| one(&k)) && 2 * others().filter(one).count() <= others().count()
        })
    })
}

/// The factor `a` of `y = a*x + b` (unit of `y` over that of `x`), where `y` is a copy of `x`.
fn copy(x: &[f64], y: &[f64]) -> Option<f64> {
    let every = |samples: usize| (x.len() / samples).max(1);
    slope(x, y, every(FIRST), 100.0 * ROUNDING)?;
    slope(x, y, every(THEN), 10.0 * ROUNDING)?;
    slope(x, y, 1, ROUNDING).filter(|a| shares_noise(x, y, *a))
}

/// Whether what is fast in `y`, and of no motion, is that of `a*x`: what second differences have apart is small beside their own.
fn shares_noise(x: &[f64], y: &[f64], a: f64) -> bool {
    let fast = |v: &[f64], k: usize| v[k + 1] - 2.0 * v[k] + v[k - 1];
    let squares = |of: &dyn Fn(usize) -> f64| (1..y.len().max(1) - 1).map(|k| of(k).powi(2)).sum::<f64>();
    squares(&|k| fast(y, k) - a * fast(x, k)) <= APART * APART * squares(&|k| fast(y, k))
}

/// The slope of `y` over `x` at every `stride`-th sample, where the residual is at most `rounding` times the standard deviation of `y`.
fn slope(x: &[f64], y: &[f64], stride: usize, rounding: f64) -> Option<f64> {
    let line = Line::through(|| x.iter().copied().zip(y.iter().copied()).step_by(stride));
    // The deviation of a constant from its mean is rounding.
    let moves = |i: usize| line.squares[i] > line.count * (1e-12 * line.means[i]).powi(2);
    let is_all = moves(0) && moves(1) && line.slope.is_finite() && line.left <= rounding * rounding * line.squares[1];
    is_all.then_some(line.slope)
}

/// The speed, rad/s (m/s), of a position by central differences: two samples fewer.
fn speed(x: &[f64], dt: f64) -> Vec<f64> {
    x.windows(3).map(|w| (w[2] - w[0]) / (2.0 * dt)).collect()
}

/// Looks for a torque that is a copy of a motion, and a table's encoder that is one of the motor's or takes turns with it.
pub(super) fn examine(input: &Input<'_>, findings: &mut Vec<Finding>) {
    let channel = |name: &str| input.channels().find(|c| c.name == name);
    let late = |x: Channel<'_>, y: Channel<'_>| {
        let n = x.values.len();
        (0..=LATE.min(n / 8)).find_map(|lag| {
            let (head, tail) = (..n - lag, lag..);
            let behind = copy(&x.values[head], &y.values[tail.clone()]).map(|a| (a, lag as i64));
            behind.or_else(|| copy(&x.values[tail], &y.values[head]).map(|a| (a, -(lag as i64))))
        })
    };
    let report = |signal: &'static str, other: &str, factor: f64, lag: i64, means: &str, remedy: &str| {
        let by = if (factor - 1.0).abs() < 1e-9 { String::new() } else { format!(" times {}", rounded(factor)) };
        let when = match lag {
            0 => String::new(),
            1.. => format!(", {lag} samples later"),
            _ => format!(", {} samples earlier", -lag),
        };
        Finding::new(
            "copy",
            Severity::Refuse,
            signal,
            format!("{signal} is a copy of {other}{by}{when}: the two agree to a millionth at every sample."),
            means,
            remedy,
        )
    };
    if let Some(t) = channel("T") {
        let means = "It is no torque that was measured or commanded: nothing of the machine can be read from it.";
        let remedy = "Map the column of the torque or current in [signals]; a drive whose command is its position alone needs a reference \
                      that moves.";
        for other in ["theta1", "omega1", "theta2", "omega2"].into_iter().filter_map(channel) {
            if let Some((factor, lag)) = late(other, t) {
                findings.push(report("T", other.name, factor, lag, means, remedy));
                return;
            }
            if other.name.starts_with("theta") && t.values.len() > 2 {
                let rate = speed(other.values, input.dt);
                if let Some(factor) = copy(&rate, &t.values[1..t.values.len() - 1]) {
                    findings.push(report("T", &format!("the speed of {}", other.name), factor, 0, means, remedy));
                    return;
                }
            }
        }
    }
    for (one, two, signal) in [("theta1", "theta2", "theta2"), ("omega1", "omega2", "omega2")] {
        let (Some(x), Some(y)) = (channel(one), channel(two)) else { continue };
        // One turned round, or in another unit, is told as that where the table has a motion of its own; here it has none.
        if let Some((factor, lag)) = late(x, y) {
            findings.push(report(
                signal,
                one,
                factor,
                lag,
                "One sensor was logged twice: the coupling between the two does not show.",
                "Map the column of the table's own encoder in [signals], or leave it out and describe the axis as structure = \"rigid\".",
            ));
        } else if let Some(turns) = multiplexed(x.values, y.values) {
            let share = if turns == 2 { "Every other sample".to_owned() } else { format!("One sample of {turns}") };
            findings.push(Finding::new(
                "copy",
                Severity::Refuse,
                signal,
                format!("{share} of {two} and of {one} is one value, and the others differ."),
                "The logger took turns between two sensors and wrote one's samples into the other's column.",
                "Log both columns at every sample, or cut the record to where they are (--from, --to).",
            ));
        }
    }
}
