//! Samples that a log lost: spikes of a disturbed line, and samples that repeat the one before.
//!
//! A position runs smoothly from sample to sample, at a blow with a kink that stays; lost is one, or two in a row, that its neighbours,
//! which agree with each other, do not expect. It is bridged by the cubic through them (Savitzky, Golay, Analytical Chemistry 36(8),
//! 1964).

/// Samples lost in a row and neighbours on each side of them, pass by pass: a lost sample hides another near it until it is bridged, and
/// of two the nearer neighbours may be free.
const PASSES: [(usize, usize); 6] = [(1, 6), (1, 6), (1, 3), (1, 3), (2, 6), (2, 3)];
/// Neighbours on each side that a motion of the record's highest frequencies is told by.
const NEAREST: usize = 3;
/// Most samples lost in a row that are bridged.
const ROW: usize = 2;
/// Error of the cubic, in rms of its residual here and about and in noise of the channel, from which a sample is lost: Gaussian noise
/// makes one in five hundred million.
const FAR: f64 = 6.0;
/// Residual of the cubic over the usual one about it up to which the neighbours agree with each other.
const AGREE: f64 = 2.5;
/// Samples in which the residual is a usual one.
const BLOCK: usize = 256;
/// Share of the samples that may be lost: more are the signal.
const MOST: f64 = 0.02;

/// The cubic through the neighbours of `row` samples from `k`: what it expects at them, and the rms of its residual.
fn cubic(y: &[f64], k: usize, (row, reach): (usize, usize)) -> ([f64; ROW], f64) {
    // Even powers about the middle of the row tell the value there, odd ones belong to the slope.
    let (mut s, mut s2, mut s4, mut s6) = (0.0, 0.0, 0.0, 0.0);
    let (mut a, mut a2, mut b, mut b3) = (0.0, 0.0, 0.0, 0.0);
    let middle = 0.5 * (row as f64 - 1.0);
    let mut squares = 0.0;
    for j in 1..=reach {
        let (before, after) = (y[k - j] - y[k], y[k + row - 1 + j] - y[k]);
        let x = j as f64 + middle;
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
    }
    let even = s * s4 - s2 * s2;
    let (c0, c2) = ((s4 * a - s2 * a2) / even, (s * a2 - s2 * a) / even);
    let odd = s2 * s6 - s4 * s4;
    let (c1, c3) = ((s6 * b - s4 * b3) / odd, (s2 * b3 - s4 * b) / odd);
    let left = squares - c0 * a - c2 * a2 - c1 * b - c3 * b3;
    let freedom = 2.0 * reach as f64 - 4.0;
    let expected = std::array::from_fn(|i| {
        let x = i as f64 - middle;
        y[k] + c0 + x * (c1 + x * (c2 + x * c3))
    });
    (expected, (left.max(0.0) / freedom).sqrt())
}

/// Lost samples of a position whose noise has a standard deviation of `noise`: rows of them, each with what its neighbours expect and the
/// rms by which these disagree.
fn lost(y: &[f64], noise: f64, pass: (usize, usize)) -> Vec<(usize, [f64; ROW], f64)> {
    let (row, reach) = pass;
    if y.len() < BLOCK {
        return Vec::new();
    }
    let inside: Vec<usize> = (reach..=y.len() - reach - row).collect();
    let mut out: Vec<(usize, [f64; ROW], f64)> = Vec::new();
    for block in inside.chunks(BLOCK) {
        let cubics: Vec<([f64; ROW], f64)> = block.iter().map(|k| cubic(y, *k, pass)).collect();
        let mut residuals: Vec<f64> = cubics.iter().map(|c| c.1).collect();
        let usual = *residuals.select_nth_unstable_by(block.len() / 2, f64::total_cmp).1;
        for (&k, (expected, residual)) in block.iter().zip(&cubics) {
            // A fast motion is no cubic: what it leaves now and then is measured by what it leaves as a rule.
            let agree = *residual <= AGREE * usual.max(noise);
            let off = y[k..k + row].iter().zip(expected).map(|(y, e)| (y - e).abs()).fold(0.0, f64::max);
            if agree
                && off > FAR * residual.max(usual).max(noise)
                && out.last().is_none_or(|(last, ..)| last + row <= k)
            {
                out.push((k, *expected, *residual));
            }
        }
    }
    out
}

/// Bridges the lost samples of a position whose noise has a standard deviation of `noise`, in its unit, and tells how many they were. Where
/// they would be more than one in fifty, they are the signal and stay.
pub fn bridge(y: &mut [f64], noise: f64) -> usize {
    let mut count = 0;
    for pass in PASSES {
        let (row, found) = (pass.0, lost(y, noise, pass));
        if (count + row * found.len()) as f64 > MOST * y.len() as f64 {
            break;
        }
        count += row * found.len();
        for (k, expected, residual) in found {
            // The nearest neighbours tell a fast motion best, where they are sound.
            let (nearer, left) = cubic(y, k, (row, NEAREST));
            let expected = if left < residual { nearer } else { expected };
            y[k..k + row].copy_from_slice(&expected[..row]);
        }
    }
    count
}
