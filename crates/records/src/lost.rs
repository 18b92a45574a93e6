//! Samples that a log lost: spikes of a disturbed line, and samples that repeat the one before.
//!
//! A reading with noise in it repeats by chance hardly ever: one that does, where the others expect another value
//! ([`super::autoregressive`]), was held.
//!
//! Else a position runs smoothly from sample to sample, at a blow with a kink that stays; lost is one, or two near each other, that their
//! neighbours, which agree with each other, do not expect. It is bridged by the cubic through them (Savitzky, Golay, Analytical Chemistry
//! 36(8), 1964).

use crate::autoregressive::expected;

/// Intervals from a lost sample to a second one, none where it is alone, and neighbours on each side of them, pass by pass: a lost sample
/// hides another near it until it is bridged, and two that hide each other are found together.
const PASSES: [(usize, usize); 8] = [(0, MANY), (0, MANY), (0, 3), (0, 3), (1, MANY), (1, 3), (2, MANY), (3, MANY)];
/// Neighbours on each side that tell a slow motion.
const MANY: usize = 6;
/// Neighbours on each side that a motion of the record's highest frequencies is told by.
const NEAREST: usize = 3;
/// Error of the cubic, in rms of its residual here and about and in noise of the channel, from which a sample is lost: Gaussian noise
/// makes one in five hundred million.
const FAR: f64 = 6.0;
/// Residual of the cubic over the usual one about it up to which the neighbours agree with each other.
const AGREE: f64 = 2.5;
/// Error of the cubic over its residual from which a held sample is lost however far its neighbours agree: a blow, which they do not agree
/// about, leaves as much at them as at the sample between them.
const CLEAR: f64 = 20.0;
/// Samples in which the residual is a usual one.
const BLOCK: usize = 256;
/// Share of the samples that may be lost: more are the signal.
const MOST: f64 = 0.02;

/// The cubic through the neighbours of a sample `k` and of the one `span` intervals on: what it expects at the two, and the rms of its
/// residual.
fn cubic(y: &[f64], k: usize, (span, reach): (usize, usize)) -> ([f64; 2], f64) {
    // Even powers about the middle tell the value there, odd ones belong to the slope.
    let (mut s, mut s2, mut s4, mut s6) = (0.0, 0.0, 0.0, 0.0);
    let (mut a, mut a2, mut b, mut b3) = (0.0, 0.0, 0.0, 0.0);
    let middle = 0.5 * span as f64;
    let mut squares = 0.0;
    let mut pair = |before: usize, after: usize| {
        let x = 0.5 * (after - before) as f64;
        let (before, after) = (y[before] - y[k], y[after] - y[k]);
        let (even, odd) = (before + after, after - before);
        s += 2.0;
        s2 += 2.0 * x * x;
        s4 += 2.0 * x.powi(4);
        s6 += 2.0 * x.powi(6);
        a += even;
        a2 += even * x * x;
        b += odd * x;
        b3 += odd * x.powi(3);
        squares += before * before + after * after;
    };
    (1..=reach).for_each(|j| pair(k - j, k + span + j));
    // Those between the two; of an odd number the one in the middle is left out, which has no other.
    (1..).take_while(|j| 2 * j < span).for_each(|j| pair(k + j, k + span - j));
    let even = s * s4 - s2 * s2;
    let (c0, c2) = ((s4 * a - s2 * a2) / even, (s * a2 - s2 * a) / even);
    let odd = s2 * s6 - s4 * s4;
    let (c1, c3) = ((s6 * b - s4 * b3) / odd, (s2 * b3 - s4 * b) / odd);
    let left = squares - c0 * a - c2 * a2 - c1 * b - c3 * b3;
    let expected = [-middle, middle].map(|x| y[k] + c0 + x * (c1 + x * (c2 + x * c3)));
    (expected, (left.max(0.0) / (s - 4.0)).sqrt())
}

/// Lost samples of a position whose noise has a standard deviation of `noise`: the first of each pass' two, with what the neighbours
/// expect and the rms by which these disagree.
fn lost(y: &[f64], noise: f64, pass: (usize, usize)) -> Vec<(usize, [f64; 2], f64)> {
    let (span, reach) = pass;
    if y.len() < BLOCK {
        return Vec::new();
    }
    let inside: Vec<usize> = (reach..y.len() - reach - span).collect();
    let mut out: Vec<(usize, [f64; 2], f64)> = Vec::new();
    for block in inside.chunks(BLOCK) {
        let cubics: Vec<([f64; 2], f64)> = block.iter().map(|k| cubic(y, *k, pass)).collect();
        let mut residuals: Vec<f64> = cubics.iter().map(|c| c.1).collect();
        let usual = *residuals.select_nth_unstable_by(block.len() / 2, f64::total_cmp).1;
        for (&k, (expected, residual)) in block.iter().zip(&cubics) {
            // A fast motion is no cubic: what it leaves now and then is measured by what it leaves as a rule.
            let off = (y[k] - expected[0]).abs().max((y[k + span] - expected[1]).abs());
            // A reading with noise in it repeats only where it is held.
            let held = y[k] == y[k - 1] && y[k + span] == y[k + span - 1];
            let clear = held && off > CLEAR * residual;
            let agree = *residual <= AGREE * usual.max(noise);
            if (clear || agree && span < 2)
                && off > FAR * residual.max(usual).max(noise)
                && out.last().is_none_or(|(last, ..)| last + span < k)
            {
                out.push((k, *expected, *residual));
            }
        }
    }
    out
}

/// Samples that repeat the one before and are expected to be something else, and what: as many as may be lost of a record at most.
fn repeated(y: &[f64], noise: f64) -> Vec<(usize, f64)> {
    let repeats: Vec<usize> = (1..y.len()).filter(|k| y[*k] == y[k - 1]).collect();
    if repeats.len() as f64 > MOST * y.len() as f64 {
        return Vec::new();
    }
    let told = expected(y, &repeats).into_iter();
    told.filter(|e| (y[e.at] - e.value).abs() > FAR * e.error.max(noise)).map(|e| (e.at, e.value)).collect()
}

/// Gives the samples that repeat the one before the values that the others expect there, whatever the noise of the position is.
pub fn restore(y: &mut [f64]) {
    repeated(y, 0.0).into_iter().for_each(|(k, expected)| y[k] = expected);
}

/// Bridges the lost samples of a position whose noise has a standard deviation of `noise`, in its unit, and tells how many they were. Where
/// they would be more than one in fifty, they are the signal and stay.
pub fn bridge(y: &mut [f64], noise: f64) -> usize {
    bridged(y, noise).len()
}

/// Bridges the lost samples as [`bridge`] does, and gives them as they were found, one twice where two passes bridged it.
fn bridged(y: &mut [f64], noise: f64) -> Vec<usize> {
    let mut all = Vec::new();
    for (k, expected) in repeated(y, noise) {
        all.push(k);
        y[k] = expected;
    }
    for pass in PASSES {
        let (span, found) = (pass.0, lost(y, noise, pass));
        let each = if span == 0 { 1 } else { 2 };
        if (all.len() + each * found.len()) as f64 > MOST * y.len() as f64 {
            break;
        }
        for (k, expected, residual) in found {
            all.push(k);
            all.extend((span > 0).then_some(k + span));
            // The nearest neighbours tell a fast motion best, where they are sound.
            let (nearer, left) = cubic(y, k, (span, NEAREST));
            let expected = if left < residual { nearer } else { expected };
            (y[k], y[k + span]) = (expected[0], expected[1]);
        }
    }
    all
}

/// Steps of the encoder from which a position goes on after a sample that was held: where it repeats because it is slow, it goes on by one.
const GOES_ON: f64 = 1.5;

/// The samples among those that [`bridge`] bridges that repeat the one before, in order: the log held them while the axis went on.
#[must_use]
pub fn held(y: &[f64], noise: f64) -> Vec<usize> {
    let repeats = |k: usize| y[k] == y[k - 1];
    // Most records have none: nothing is fitted there.
    let step = (1..y.len()).filter(|k| !repeats(*k)).map(|k| (y[k] - y[k - 1]).abs()).fold(f64::INFINITY, f64::min);
    if !(1..y.len().saturating_sub(1)).any(|k| repeats(k) && (y[k + 1] - y[k]).abs() >= GOES_ON * step) {
        return Vec::new();
    }
    let mut held = bridged(&mut y.to_vec(), noise);
    held.retain(|k| *k > 0 && repeats(*k));
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
