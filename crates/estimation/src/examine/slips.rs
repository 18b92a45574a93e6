//! Samples that a log dropped without a gap in its time stamps: the motion advances by several samples at once.
//!
//! Over a few samples on either side of a row a position is close to a cubic (see [`crate::trace::bridge`]). Where `m` samples are missing
//! before the row, one cubic fits both sides if the later samples are shifted by `m` sampling intervals, and none fits them without. An impact
//! changes the speed and a lost count offsets the position; neither equals a shift in time by `m` samples, the same for both encoders.

use std::ops::Range;

use super::Input;
use super::finding::{Finding, Severity};
use super::robust::{quantile, step};

/// Samples on either side of a row, and the most missing ones that a cubic over so many can span: few samples for a fast motion, many for one
/// near the noise, or for many missing samples.
const SIDES: [(usize, usize); 3] = [(3, 5), (6, 10), (12, 24)];
/// Samples on either side of the shortest, and of the longest.
const NEAR: usize = SIDES[0].0;
const WIDE: usize = SIDES[2].0;
/// Rms residual of the cubic, over its median in the block, from which a row does not continue the one before.
const FAR: f64 = 6.0;
/// The same ratio up to which the cubic with missing samples fits.
const AGREE: f64 = 2.5;
/// Samples of a block over which the median residual is taken, and the stride in it: coprime to two and four, as samples may be held in twos
/// or fours.
const BLOCK: usize = 256;
const EVERY: usize = 7;
/// Magnitude of a third difference, over its median, from which a row is a candidate: a step beyond [`FAR`] gives eight.
const STANDS: f64 = 6.0;
/// Places from which it is certain that rows were dropped: of some hundred sound records one has a place by chance, none has more.
const PLACES: usize = 3;

/// An orthonormal basis of the cubics at `2*side` times, the later half `missing` samples later: four vectors.
fn cubics(side: usize, missing: usize) -> Vec<Vec<f64>> {
    let middle = side as f64 - 0.5 + 0.5 * missing as f64;
    let times: Vec<f64> = (0..2 * side)
        .map(|k| (k as f64 + if k < side { 0.0 } else { missing as f64 } - middle) / (side + missing) as f64)
        .collect();
    let mut basis: Vec<Vec<f64>> = Vec::with_capacity(4);
    for power in 0..4 {
        let mut v: Vec<f64> = times.iter().map(|t| t.powi(power)).collect();
        for b in &basis {
            let along: f64 = v.iter().zip(b).map(|(v, b)| v * b).sum();
            v.iter_mut().zip(b).for_each(|(v, b)| *v -= along * b);
        }
        let size = v.iter().map(|v| v * v).sum::<f64>().sqrt();
        v.iter_mut().for_each(|v| *v /= size);
        basis.push(v);
    }
    basis
}

/// Mean square of the residual of the cubic fitted to some samples, rad^2 (m^2).
fn left(part: &[f64], basis: &[Vec<f64>]) -> f64 {
    let zero = part[part.len() / 2];
    let total: f64 = part.iter().map(|x| (x - zero).powi(2)).sum();
    let explained: f64 =
        basis.iter().map(|b| part.iter().zip(b).map(|(x, b)| (x - zero) * b).sum::<f64>().powi(2)).sum();
    (total - explained).max(0.0) / (part.len() - 4) as f64
}

/// The bases of the cubics over `side` samples on either side, one for each number of missing samples from 0.
struct Fits {
    side: usize,
    basis: Vec<Vec<Vec<f64>>>,
}

/// A position, rad (m), and the mean square of its quantisation error, the least residual that is assumed.
struct Position<'a> {
    values: &'a [f64],
    rounding: f64,
}

impl Fits {
    fn new((side, most): (usize, usize)) -> Self {
        Self { side, basis: (0..=most).map(|missing| cubics(side, missing)).collect() }
    }

    /// Mean square residual of the cubic about row `k` with so many samples missing before it.
    fn left(&self, x: &[f64], k: usize, missing: usize) -> f64 {
        left(&x[k - self.side..k + self.side], &self.basis[missing])
    }

    /// Median of that residual over some rows, none missing.
    fn median(&self, x: &Position<'_>, rows: Range<usize>) -> f64 {
        let asked: Vec<f64> = rows.step_by(EVERY).map(|k| self.left(x.values, k, 0)).collect();
        quantile(asked.into_iter(), 0.5).max(x.rounding)
    }

    /// The rows among the candidates before which samples are missing, and how many.
    fn slips(&self, x: &Position<'_>, rows: Range<usize>, candidates: &[usize]) -> Vec<(usize, usize)> {
        let median = self.median(x, rows);
        let slip = |k: &usize| {
            if self.left(x.values, *k, 0) <= FAR * FAR * median {
                return None;
            }
            let best =
                (1..self.basis.len()).map(|m| (m, self.left(x.values, *k, m))).min_by(|a, b| a.1.total_cmp(&b.1));
            best.filter(|(_, left)| *left <= AGREE * AGREE * median).map(|(missing, _)| (*k, missing))
        };
        candidates.iter().filter_map(slip).collect()
    }

    /// Whether the cubic with so many samples missing before a row fits this position.
    fn agrees(&self, x: &Position<'_>, (k, missing): (usize, usize)) -> bool {
        let from = (k / BLOCK * BLOCK).max(self.side);
        let rows = from..(from + BLOCK).min(x.values.len() - self.side);
        self.left(x.values, k, missing) <= AGREE * AGREE * self.median(x, rows)
    }
}

/// Rows before which samples are missing, and how many, where all positions agree.
fn slips(positions: &[Position<'_>]) -> Vec<(usize, usize)> {
    let margin = WIDE;
    let mut found: Vec<(usize, usize)> = Vec::new();
    let fits = SIDES.map(Fits::new);
    for (c, position) in positions.iter().enumerate() {
        let x = position.values;
        let n = x.len();
        let third = |k: usize| x[k + 1] - 3.0 * x[k] + 3.0 * x[k - 1] - x[k - 2];
        let mut start = margin;
        while start + margin < n {
            let rows = start..((start / BLOCK + 1) * BLOCK).min(n - margin);
            start = rows.end;
            let median = quantile(rows.clone().map(third), 0.5);
            // A repeated sample is held, or the axis is at rest: the step after it is no missing sample.
            let moves = |k: &usize| x[k - NEAR..k + NEAR].windows(2).all(|w| w[0] != w[1]);
            let stands = |k: &usize| third(*k).abs() > STANDS * median;
            let candidates: Vec<usize> = rows.clone().filter(stands).filter(moves).collect();
            if candidates.is_empty() {
                continue;
            }
            for fit in &fits {
                let others = |slip: &(usize, usize)| {
                    positions.iter().enumerate().all(|(o, other)| o == c || fit.agrees(other, *slip))
                };
                found.extend(fit.slips(position, rows.clone(), &candidates).into_iter().filter(others));
            }
        }
    }
    // The same place is found in both encoders, with several lengths and from neighbouring rows.
    found.sort_unstable();
    found.dedup_by(|next, first| next.0 - first.0 <= NEAR);
    found
}

/// Looks for samples that are missing under even stamps; stamps that are not even are another finding.
pub(super) fn examine(input: &Input<'_>, findings: &mut Vec<Finding>) {
    // A value that is rounded to steps of q is off by q/sqrt(12) rms.
    let positions: Vec<Position<'_>> = input
        .channels()
        .filter(|c| c.name.starts_with("theta"))
        .map(|c| Position { values: c.values, rounding: step(c.values).powi(2) / 12.0 })
        .collect();
    let n = input.len();
    if positions.is_empty() || n < BLOCK {
        return;
    }
    let found = slips(&positions);
    let Some(first) = found.first() else { return };
    let missing: usize = found.iter().map(|(_, m)| m).sum();
    let ends = std::iter::once(0).chain(found.iter().map(|s| s.0)).chain([n]);
    let whole = ends.clone().zip(ends.skip(1)).max_by_key(|(a, b)| b - a).unwrap_or((0, n));
    let (severity, meaning) = if found.len() < PLACES {
        (
            Severity::Warn,
            "The logger may have dropped rows and numbered the others through; so few places may also look so by chance.",
        )
    } else {
        (
            Severity::Refuse,
            "The logger dropped rows and numbered the others through. Where the axis moves slowly more may be missing that do not show.",
        )
    };
    let places = if found.len() == 1 { "1 place".to_owned() } else { format!("{} places", found.len()) };
    findings.push(
        Finding::new(
            "lost_samples",
            severity,
            "time",
            format!(
                "{missing} sample{} missing under even time stamps, at {places}, the first at {:.6} s: the motion goes on there as if \
                 they had been left out.",
                if missing == 1 { " is" } else { "s are" },
                input.time(first.0)
            ),
            meaning,
            format!(
                "Log the drive's own time stamps, over a bus that keeps up; the longest part without a loss that shows is --from {:.6} --to \
                 {:.6}.",
                input.time(whole.0),
                input.time(whole.1 - 1)
            ),
        )
        .at(input, found.iter().map(|(k, _)| *k..*k + 1).collect()),
    );
}
