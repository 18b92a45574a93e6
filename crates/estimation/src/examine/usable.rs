//! Where the drive is on and the axis is not merely standing.

use std::ops::Range;

use super::Input;
use super::finding::{Finding, Severity};
use super::robust::{noise, quantile, span, step};
use crate::numerics::level::deviation;

/// Blocks that a record is cut into to look for stretches without drive.
const BLOCKS: usize = 100;
/// Standard deviation of the torque, or span of the position, in a block over its upper quartile, up to which the drive is off or the axis at
/// rest.
const QUIET: f64 = 0.02;
/// Mean torque of a block, over the upper quartile of the standard deviations, above which the drive holds a constant torque.
const HOLDS: f64 = 0.1;
/// Standstill between motions is left in up to this share of the record: an axis that rests between moves is not cut to pieces.
const REST: f64 = 0.2;

/// Mean of a block; zero of an empty one.
pub(super) fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}

/// The usable pieces, as ranges of samples; what is left out is a finding. `bad`: stretches that are not usable for another reason.
pub(super) fn examine(input: &Input<'_>, bad: &[Range<usize>], findings: &mut Vec<Finding>) -> Vec<Range<usize>> {
    let n = input.len();
    let size = (n / BLOCKS).max(16);
    let blocks: Vec<Range<usize>> =
        (0..n / size).map(|b| b * size..if (b + 2) * size > n { n } else { (b + 1) * size }).collect();
    let Some(position) = input.theta1.or(input.theta2).filter(|v| span(v) > 0.0) else {
        return std::iter::once(0..n).collect();
    };
    let quantum = step(position);
    if span(position) < 4.0 * quantum {
        findings.push(Finding::new(
            "standstill",
            Severity::Refuse,
            "theta1",
            format!("The position stays within {:.0} of its steps throughout.", (span(position) / quantum).ceil()),
            "The axis stands: neither its inertia nor its friction shows.",
            "Record while the axis moves: at least some hundred steps of the encoder, in both directions.",
        ));
    }
    let ways: Vec<f64> = blocks.iter().map(|b| span(&position[b.clone()])).collect();
    let way = quantile(ways.iter().copied(), 0.75);
    let rests = |b: usize, within: f64| ways[b] <= (QUIET * way).max(within) && ways[b] < 0.5 * way;
    let still = |b: usize| rests(b, 2.0 * quantum);
    // Of so many values of a normal noise nearly all lie so many standard deviations about the mean (the largest of n: sqrt(2 ln n)).
    let noise = noise(position);
    let is_noise = |b: usize| rests(b, 2.0 * noise * (2.0 * (blocks[b].len() as f64).ln()).sqrt());
    let drives: Option<Vec<f64>> = input.torque.map(|t| blocks.iter().map(|b| deviation(&t[b.clone()])).collect());
    let drive = drives.as_ref().map_or(0.0, |d| quantile(d.iter().copied(), 0.75));
    // A constant torque that does not move the axis is of a drive that is on: friction balances it.
    let held = |b: usize| input.torque.is_some_and(|t| mean(&t[blocks[b].clone()]).abs() > HOLDS * drive);
    let off = |b: usize| drives.as_ref().is_some_and(|d| d[b] <= QUIET * drive && drive > 0.0) && !held(b);

    let join = |holds: &dyn Fn(usize) -> bool| -> Vec<Range<usize>> {
        super::finding::runs(blocks.len(), holds)
            .into_iter()
            .map(|r| blocks[r.start].start..blocks[r.end - 1].end)
            .collect()
    };
    // Without a torque an axis that shows no more than its encoder's noise rests; under one it may be held, or reverse slowly.
    let dead = join(&|b| off(b) && (still(b) || is_noise(b)));
    let mut standing = join(&|b| still(b) && !off(b));
    // Rest at the ends, or for a large part of the record.
    standing.retain(|r| r.start == 0 || r.end == n || r.len() as f64 > REST * n as f64);
    let whole = |ranges: &[Range<usize>]| ranges.iter().map(Range::len).sum::<usize>();
    for (id, ranges, seen, means) in [
        ("drive_off", &dead, "the drive is off and the axis stands", "Nothing of the machine shows there but noise."),
        (
            "standing",
            &standing,
            "the axis stands",
            "A torque below breakaway tells of friction alone, and only that it is larger.",
        ),
    ] {
        let samples = whole(ranges);
        if samples * 50 < n {
            continue;
        }
        findings.push(
            Finding::new(
                id,
                Severity::Warn,
                "T",
                format!("For {:.0} % of the record {seen}.", 100.0 * samples as f64 / n as f64),
                means,
                "These stretches are left out.",
            )
            .at(input, ranges.clone()),
        );
    }
    let mut out: Vec<bool> = vec![true; n];
    for range in dead.iter().chain(&standing).chain(bad) {
        out[range.clone()].fill(false);
    }
    let pieces: Vec<Range<usize>> =
        super::finding::runs(n, |k| out[k]).into_iter().filter(|r| r.len() >= 2 * size.min(64)).collect();
    if pieces.is_empty() && span(position) >= 4.0 * quantum {
        return std::iter::once(0..n).collect();
    }
    pieces
}
