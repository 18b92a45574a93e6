//! The time stamps as they were logged: order, lost samples, jitter, rounding.

use super::Input;
use super::finding::{Finding, Severity, runs};
use super::robust::quantile;

/// Deviation from even spacing that is reported, in sampling intervals.
const JITTER: f64 = 0.02;
/// A step of so many intervals has lost samples (as [`crate::trace::grid`] counts them).
const LOST: f64 = 1.5;
/// A step of so many intervals has lost samples whatever its neighbours say.
const LOST_FOR_SURE: f64 = 2.5;
/// Distance from a whole number of a stamp in units of its last digit.
const WHOLE: f64 = 1e-6;
/// Stamps on each side of a step that tell whether it is one sample too long or one stamp is late.
const NEIGHBOURS: usize = 5;

pub(super) fn examine(input: &Input<'_>, findings: &mut Vec<Finding>) {
    let Some(stamps) = input.stamps.filter(|s| s.len() >= 3) else { return };
    let n = stamps.len();
    let steps = || stamps.windows(2).map(|w| w[1] - w[0]);
    let middle = quantile(stamps.windows(2).map(|w| w[1] - w[0]), 0.5);
    // Stamps that a computer took come in clusters: the mean of the steps without lost samples is the rate.
    let single = || steps().filter(|s| *s > 0.0 && *s <= LOST_FOR_SURE * middle);
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
    let lost = runs(n, |k| k > 0 && lost_before(stamps, k, usual) > 0.0);
    if !lost.is_empty() {
        let missing: f64 = (1..n).map(|k| lost_before(stamps, k, usual)).sum();
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
            // But for what a number far from zero is rounded to itself.
            let is_whole = |t: f64| (t - t.round()).abs() < WHOLE + 4.0 * f64::EPSILON * t.abs();
            stamps.iter().take(1000).all(|t| is_whole(t * 10_f64.powi(*d)))
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

/// Samples lost between stamp `k - 1` and stamp `k`, at `usual` seconds a sample. One stamp late by half a sample is followed by
/// a short step: of a step that could be that, the stamps around it are compared with even ones.
fn lost_before(stamps: &[f64], k: usize, usual: f64) -> f64 {
    let step = |k: usize| (stamps[k] - stamps[k - 1]) / usual;
    if step(k) <= LOST {
        return 0.0;
    }
    if step(k) > LOST_FOR_SURE {
        return step(k).round() - 1.0;
    }
    let whole = |k: &usize| step(*k) <= LOST_FOR_SURE;
    let before = (k.saturating_sub(NEIGHBOURS).max(1)..k).rev().take_while(whole).count();
    let after = (k + 1..(k + NEIGHBOURS).min(stamps.len())).take_while(whole).count();
    let offset = |i: usize| stamps[i] / usual - i as f64;
    let middle = |range: std::ops::Range<usize>| {
        let mut offsets: Vec<f64> = range.map(offset).collect();
        offsets.sort_by(f64::total_cmp);
        offsets[offsets.len() / 2]
    };
    (middle(k..k + after + 1) - middle(k - 1 - before..k)).round().max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_late_stamp_is_no_lost_sample() {
        let even: Vec<f64> = (0..40).map(|k| 1e-3 * f64::from(k)).collect();
        let count = |stamps: &[f64]| (1..stamps.len()).map(|k| lost_before(stamps, k, 1e-3)).sum::<f64>();
        let mut late = even.clone();
        late[20] += 0.7e-3;
        late[30] -= 0.7e-3;
        assert!((count(&late) - 0.0).abs() < 1e-9);
        let mut lost = late.clone();
        lost.remove(10);
        assert!((count(&lost) - 1.0).abs() < 1e-9);
        lost.drain(22..25);
        assert!((count(&lost) - 4.0).abs() < 1e-9);
        lost.remove(1);
        assert!((count(&lost) - 5.0).abs() < 1e-9);
    }

    #[test]
    fn stamps_are_rounded_by_their_digits_however_late_the_clock_is() {
        for start in [0.0, 831.345, 1.7e9] {
            let even = |k: usize| start + 1.05e-2 * k as f64;
            let jittered: Vec<f64> = (0..400).map(|k| even(k) + 3.1e-4 * ((k * k % 7) as f64 - 3.0)).collect();
            let names = |stamps: &[f64]| {
                let mut findings = Vec::new();
                examine(&Input { stamps: Some(stamps), ..Input::default() }, &mut findings);
                findings.iter().map(|f| f.id).collect::<Vec<_>>()
            };
            assert_eq!(names(&jittered), ["time_jitter"], "{start}");
            let rounded: Vec<f64> = (0..400).map(|k| (even(k) * 1e3).round() / 1e3).collect();
            assert_eq!(names(&rounded), ["time_rounded"], "{start}");
        }
    }
}
