//! Samples that a log lost: spikes of a disturbed line, and samples that repeat the one before.
//!
//! A reading with noise hardly ever repeats by chance: one that repeats although the others interpolate to another value
//! ([`super::autoregressive`]) was held.
//!
//! Other lost samples are found by a cubic through their neighbours: a position is smooth from sample to sample, and after an impact its slope
//! changes for good. One sample, or two near each other, are lost where they deviate from the cubic and their neighbours fit it. They
//! are replaced by the cubic's values (Savitzky, Golay, Analytical Chemistry 36(8), 1964). Values are in the position's unit.

use std::ops::Range;

use rayon::prelude::*;

use crate::autoregressive::expected;

/// The passes of the search, each with the number of intervals from a lost sample to a second one (0 for a single sample) and the number
/// of neighbours on each side. A lost sample distorts the cubic at another one near it: the second is found once the first is replaced,
/// or both in a pass for two.
const PASSES: [(usize, usize); 8] = [(0, MANY), (0, MANY), (0, 3), (0, 3), (1, MANY), (1, 3), (2, MANY), (3, MANY)];
/// Neighbours on each side for a slow motion.
const MANY: usize = 6;
/// Neighbours on each side for a motion of the record's highest frequencies.
const NEAREST: usize = 3;
/// Deviation of a sample from the cubic from which it is lost, over the rms residual of the cubic, over its median in the block and over the
/// noise: with Gaussian noise one sample in five hundred million is beyond it.
const FAR: f64 = 6.0;
/// Rms residual of the cubic, over its median in the block, up to which the neighbours fit it.
const AGREE: f64 = 2.5;
/// Deviation of a held sample from the cubic, over the rms residual, from which it is lost whatever the residual is: an impact leaves a
/// residual at the neighbours as large as at the sample itself.
const CLEAR: f64 = 20.0;
/// Samples of a block, over which the median residual is taken.
const BLOCK: usize = 256;
/// Share of the samples that may be lost: more are the signal.
const MOST: f64 = 0.02;

/// Samples at which the cubic is evaluated together, for vector instructions.
const LANES: usize = 8;

/// Two neighbours at the same distance from the middle: their offsets from the first neighbour, and the distance in samples with its cube.
struct Pair {
    before: usize,
    after: usize,
    x: f64,
    x3: f64,
}

/// The least-squares cubic through the neighbours of a sample and of the one `span` intervals later: the terms common to all samples. `neighbours` is
/// their number on each side.
struct Cubic {
    span: usize,
    neighbours: usize,
    pairs: Vec<Pair>,
    /// Sums over the neighbours: of one, of x^2, x^4 and x^6.
    s: f64,
    s2: f64,
    s4: f64,
    s6: f64,
}

/// The cubic at a sample: its values there and `span` intervals later, and its rms residual.
#[derive(Clone, Copy)]
struct CubicValue {
    expected: [f64; 2],
    residual: f64,
}

impl Cubic {
    fn new((span, neighbours): (usize, usize)) -> Self {
        let outside = (1..=neighbours).map(|j| (neighbours - j, neighbours + span + j));
        // Those between the two; of an odd number the one in the middle is left out, which has no other.
        let between = (1..).take_while(|j| 2 * j < span).map(|j| (neighbours + j, neighbours + span - j));
        let (mut s, mut s2, mut s4, mut s6) = (0.0, 0.0, 0.0, 0.0);
        let pairs = outside.chain(between).map(|(before, after)| {
            let x = 0.5 * after.abs_diff(before) as f64;
            s += 2.0;
            s2 += 2.0 * x * x;
            s4 += 2.0 * x.powi(4);
            s6 += 2.0 * x.powi(6);
            Pair { before, after, x, x3: x.powi(3) }
        });
        let pairs = pairs.collect();
        Self { span, neighbours, pairs, s, s2, s4, s6 }
    }

    /// At `N` samples in a row from `k` on.
    fn at<const N: usize>(&self, y: &[f64], k: usize) -> [CubicValue; N] {
        let lanes = |at: usize| -> &[f64] { &y[k - self.neighbours + at..][..N] };
        let own = lanes(self.neighbours);
        // The even and the odd coefficients about the middle separate.
        let ([mut a, mut a2], [mut b, mut b3], mut squares) = ([[0.0; N]; 2], [[0.0; N]; 2], [0.0; N]);
        for pair in &self.pairs {
            let (before, after) = (lanes(pair.before), lanes(pair.after));
            for i in 0..N {
                let (before, after) = (before[i] - own[i], after[i] - own[i]);
                let (even, odd) = (before + after, after - before);
                a[i] += even;
                a2[i] += even * pair.x * pair.x;
                b[i] += odd * pair.x;
                b3[i] += odd * pair.x3;
                squares[i] += before * before + after * after;
            }
        }
        let &Self { s, s2, s4, s6, .. } = self;
        let middle = 0.5 * self.span as f64;
        let (even, odd) = (s * s4 - s2 * s2, s2 * s6 - s4 * s4);
        std::array::from_fn(|i| {
            let (c0, c2) = ((s4 * a[i] - s2 * a2[i]) / even, (s * a2[i] - s2 * a[i]) / even);
            let (c1, c3) = ((s6 * b[i] - s4 * b3[i]) / odd, (s2 * b3[i] - s4 * b[i]) / odd);
            let left = squares[i] - c0 * a[i] - c2 * a2[i] - c1 * b[i] - c3 * b3[i];
            let expected = [-middle, middle].map(|x| own[i] + c0 + x * (c1 + x * (c2 + x * c3)));
            CubicValue { expected, residual: (left.max(0.0) / (s - 4.0)).sqrt() }
        })
    }

    /// At the samples of a range.
    fn along(&self, y: &[f64], range: Range<usize>) -> Vec<CubicValue> {
        let mut all = Vec::with_capacity(range.len());
        let mut k = range.start;
        while k + LANES <= range.end {
            all.extend(self.at::<LANES>(y, k));
            k += LANES;
        }
        all.extend((k..range.end).flat_map(|k| self.at::<1>(y, k)));
        all
    }
}

/// Whether a sample equals the one before: a reading with noise does so only where it is held.
fn repeats(y: &[f64], k: usize) -> bool {
    y[k] == y[k - 1]
}

/// A lost sample (of a pass for two the first), the cubic's values there and `span` intervals later, and its rms residual.
type Lost = (usize, [f64; 2], f64);

/// Lost samples of a position whose noise has a standard deviation of `noise`.
fn lost(y: &[f64], noise: f64, pass: (usize, usize)) -> Vec<Lost> {
    let (span, neighbours) = pass;
    if y.len() < BLOCK {
        return Vec::new();
    }
    let cubic = Cubic::new(pass);
    let end = y.len() - neighbours - span;
    let of_block = |first: usize| {
        let block = first..(first + BLOCK).min(end);
        let held = |k: usize| repeats(y, k) && repeats(y, k + span);
        // Two far from each other are lost only where both are held.
        if span >= 2 && !block.clone().any(held) {
            return Vec::new();
        }
        let cubics = cubic.along(y, block.clone());
        let mut residuals: Vec<f64> = cubics.iter().map(|c| c.residual).collect();
        let median = *residuals.select_nth_unstable_by(block.len() / 2, f64::total_cmp).1;
        let is_lost = |(k, c): &(usize, CubicValue)| {
            // A fast motion is no cubic: a residual is compared with the median of the block.
            let off = (y[*k] - c.expected[0]).abs().max((y[k + span] - c.expected[1]).abs());
            let clear = off > CLEAR * c.residual && held(*k);
            let agree = c.residual <= AGREE * median.max(noise);
            off > FAR * c.residual.max(median).max(noise) && (clear || agree && span < 2)
        };
        let estimates = block.zip(cubics).filter(is_lost);
        estimates.map(|(k, c)| (k, c.expected, c.residual)).collect::<Vec<Lost>>()
    };
    let blocks: Vec<usize> = (neighbours..end).step_by(BLOCK).collect();
    let found: Vec<Vec<Lost>> = blocks.into_par_iter().map(of_block).collect();
    let mut out: Vec<Lost> = Vec::new();
    for one in found.into_iter().flatten() {
        if out.last().is_none_or(|(last, ..)| last + span < one.0) {
            out.push(one);
        }
    }
    out
}

/// Samples that repeat the one before and are interpolated to another value, with that value; none where more than [`MOST`] repeat.
fn repeated(y: &[f64], noise: f64) -> Vec<(usize, f64)> {
    let repeats: Vec<usize> = (1..y.len()).filter(|k| repeats(y, *k)).collect();
    if repeats.len() as f64 > MOST * y.len() as f64 {
        return Vec::new();
    }
    let estimates = expected(y, &repeats).into_iter();
    estimates.filter(|e| (y[e.at] - e.value).abs() > FAR * e.error.max(noise)).map(|e| (e.at, e.value)).collect()
}

/// Replaces the samples that repeat the one before by their interpolated values, whatever the noise of the position is.
pub fn restore(y: &mut [f64]) {
    repeated(y, 0.0).into_iter().for_each(|(k, expected)| y[k] = expected);
}

/// Interpolates the lost samples of a position whose noise has a standard deviation of `noise`, in its unit, and returns their number. Where
/// more than one sample in fifty seems lost, it is the signal itself, and nothing is changed.
pub fn bridge(y: &mut [f64], noise: f64) -> usize {
    bridged(y, noise).len()
}

/// The same; returns the indices of the samples in the order of the passes, some more than once.
fn bridged(y: &mut [f64], noise: f64) -> Vec<usize> {
    let mut all = Vec::new();
    for (k, expected) in repeated(y, noise) {
        all.push(k);
        y[k] = expected;
    }
    let mut last = None;
    for pass in PASSES {
        // The same pass over the same samples finds nothing again.
        if last == Some(pass) {
            continue;
        }
        let (span, found) = (pass.0, lost(y, noise, pass));
        last = found.is_empty().then_some(pass);
        let nearest = Cubic::new((span, NEAREST));
        let each = if span == 0 { 1 } else { 2 };
        if (all.len() + each * found.len()) as f64 > MOST * y.len() as f64 {
            break;
        }
        for (k, expected, residual) in found {
            all.push(k);
            all.extend((span > 0).then_some(k + span));
            // For a fast motion the nearest neighbours give the best value, where none of them is lost.
            let [nearer] = nearest.at::<1>(y, k);
            let expected = if nearer.residual < residual { nearer.expected } else { expected };
            (y[k], y[k + span]) = (expected[0], expected[1]);
        }
    }
    all
}

/// Change of the position after a sample that was held, in steps of the encoder, from which on the axis was moving: a slow position, which
/// repeats as well, changes by one step.
const MOVING: f64 = 1.5;

/// Indices of those samples that [`bridge`] replaces that repeat the one before, in order: the log held them while the axis moved.
#[must_use]
pub fn held(y: &[f64], noise: f64) -> Vec<usize> {
    // Most records have none: nothing is fitted there.
    let step = (1..y.len()).filter(|k| !repeats(y, *k)).map(|k| (y[k] - y[k - 1]).abs()).fold(f64::INFINITY, f64::min);
    if !(1..y.len().saturating_sub(1)).any(|k| repeats(y, k) && (y[k + 1] - y[k]).abs() >= MOVING * step) {
        return Vec::new();
    }
    let mut held = bridged(&mut y.to_vec(), noise);
    held.retain(|k| *k > 0 && repeats(y, *k));
    held.sort_unstable();
    held.dedup();
    held
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A motion with a rounding of the encoder.
    fn motion(step: f64) -> Vec<f64> {
        (0..4096).map(|k| ((0.05 * f64::from(k)).sin() / step).round() * step).collect()
    }

    #[test]
    fn held_samples_are_found_where_they_are_and_a_spike_is_none() {
        let mut y = motion(1e-6);
        assert!(held(&y, 0.0).is_empty());
        y[700] += 1e-2;
        for k in [500, 3001, 3005] {
            y[k] = y[k - 1];
        }
        assert_eq!(held(&y, 0.0), [500, 3001, 3005]);
    }

    #[test]
    fn an_encoder_that_repeats_because_the_axis_is_slow_holds_nothing() {
        let coarse = motion(1e-2);
        assert!(coarse.windows(2).filter(|w| w[0] == w[1]).count() > 100);
        assert!(held(&coarse, 0.0).is_empty());
        assert!(held(&[], 0.0).is_empty());
        assert!(held(&[0.0; 600], 0.0).is_empty());
    }
}
