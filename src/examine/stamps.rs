//! The time stamps as they were logged: order, lost samples, jitter, rounding.

use super::Input;
use super::finding::{Finding, Severity, runs};
use super::robust::quantile;

/// Distance from even spacing, in intervals, that is worth a word.
const JITTER: f64 = 0.02;
/// A step of so many intervals has lost samples (as [`crate::trace::grid`] counts them).
const LOST: f64 = 1.5;

pub(super) fn examine(input: &Input<'_>, findings: &mut Vec<Finding>) {
    let Some(stamps) = input.stamps.filter(|s| s.len() >= 3) else { return };
    let n = stamps.len();
    let steps = || stamps.windows(2).map(|w| w[1] - w[0]);
    let middle = quantile(stamps.windows(2).map(|w| w[1] - w[0]), 0.5);
    // Stamps that a computer took come in clusters: the mean of the steps without lost samples is the rate.
    let single = || steps().filter(|s| *s > 0.0 && *s <= 2.5 * middle);
    let usual = (single().sum::<f64>() / single().count().max(1) as f64).max(middle);
    let back = runs(n, |k| k > 0 && stamps[k] <= stamps[k - 1]);
    if !back.is_empty() {
        let count: usize = back.iter().map(ExactSizeIterator::len).sum();
        findings.push(
            Finding::new(
                "time_order",
                Severity::Refuse,
                "time",
                format!("The time stamps run backwards or stand still at {count} of {n} samples."),
                "Which torque belongs to which motion is not known there.",
                "Sort the rows, write the time with more digits, or give the interval as dt in [signals].",
            )
            .at(input, back),
        );
        return;
    }
    if usual <= 0.0 {
        return;
    }
    let lost = runs(n, |k| k > 0 && stamps[k] - stamps[k - 1] > LOST * usual);
    if !lost.is_empty() {
        let missing: f64 = steps().filter(|s| *s > LOST * usual).map(|s| (s / usual).round() - 1.0).sum();
        findings.push(
            Finding::new(
                "lost_samples",
                Severity::Warn,
                "time",
                format!(
                    "{missing:.0} samples are missing in {} gaps, {:.2} % of the record.",
                    lost.len(),
                    100.0 * missing / (n as f64 + missing)
                ),
                "Speeds and accelerations across a gap are not measured.",
                "Log over a bus that keeps up, or lower the rate; the pieces between gaps can be used (--from, --to).",
            )
            .at(input, lost),
        );
    }
    let uneven = quantile(stamps.windows(2).map(|w| w[1] - w[0] - usual), 0.9) / usual;
    if uneven > JITTER {
        let decimals = (0..9).find(|d| {
            let scale = 10_f64.powi(*d);
            stamps
                .iter()
                .take(1000)
                .all(|t| ((t * scale) - (t * scale).round()).abs() < 1e-6 * (t * scale).abs().max(1.0))
        });
        let rounded = decimals.filter(|d| 10_f64.powi(-d) > 0.05 * usual);
        findings.push(match rounded {
            Some(d) => Finding::new(
                "time_rounded",
                Severity::Warn,
                "time",
                format!("The time stamps are rounded to {:e} s, {:.0} % of a sample.", 10_f64.powi(-d), 100.0 * 10_f64.powi(-d) / usual),
                "The sampling itself may be even; the stamps cannot tell.",
                "Write the time with more digits, or give the interval as dt in [signals] and leave the time out.",
            ),
            None => Finding::new(
                "time_jitter",
                Severity::Warn,
                "time",
                format!("One step in ten between time stamps is off by {:.0} % of a sample or more.", 100.0 * uneven),
                "A computer took the times, not the drive: the torque may be off in time by as much.",
                "Log with the drive's own clock; if the sampling is even and only its stamps are not, give dt in [signals].",
            ),
        });
    }
}
