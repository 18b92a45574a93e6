//! Averaged cross spectra of a few columns (Welch's method: P. D. Welch, IEEE Trans. Audio Electroacoustics 15, 1967): Hann
//! windows, overlapping by half, means taken off.

use rayon::prelude::*;
use rustfft::num_complex::Complex;
use rustfft::{Fft, FftPlanner};

use crate::numerics::level::deviation;

/// Most segments that are averaged; of a longer record they are spread evenly.
const SEGMENTS: usize = 96;

/// Variance of a sum of products of two columns over neighbouring lines, over that of as many independent lines: under a Hann window a line
/// shares 2/3 of its amplitude with the next one and 1/6 with the one after, so 1 + 2*(4/9 + 1/36).
const NEIGHBOURS: f64 = 35.0 / 18.0;

/// Cross spectra of columns: `of(i, j, f)` is the average of `conj(X_i)*X_j` at line `f`.
pub(super) struct Spectra {
    columns: usize,
    /// Lines, those of 0 and of the Nyquist frequency left out.
    pub lines: usize,
    /// Distance of the lines, rad/s.
    pub resolution: f64,
    /// Independent averages: half-overlapping Hann segments share a sixth of their information (Welch 1967).
    pub averages: f64,
    /// The lines of every pair `i <= j`, in the order (0, 0), (0, 1), ..., (1, 1), ...
    values: Vec<Complex<f64>>,
}

/// Segments that are transformed at a time.
const BATCH: usize = 2;

const ZERO: Complex<f64> = Complex::new(0.0, 0.0);

/// The transforms of one segment of all columns.
struct Segment {
    /// Of each column, its lines.
    spectra: Vec<Vec<Complex<f64>>>,
    buffer: Vec<Complex<f64>>,
    scratch: Vec<Complex<f64>>,
}

impl Segment {
    fn new(columns: usize, length: usize, scratch: usize) -> Self {
        let spectra = vec![vec![ZERO; length / 2 - 1]; columns];
        Self { spectra, buffer: vec![ZERO; length], scratch: vec![ZERO; scratch] }
    }

    /// Transforms `parts`, one of each column, less their means, by the window, over the columns' `sizes`.
    fn transform(&mut self, parts: &[&[f64]], window: &[f64], sizes: &[f64], plan: &dyn Fft<f64>) {
        let Self { spectra, buffer, scratch } = self;
        let (length, lines) = (buffer.len(), buffer.len() / 2 - 1);
        let means: Vec<f64> = parts.iter().map(|part| part.iter().sum::<f64>() / length as f64).collect();
        let value = |c: usize, k: usize| (parts[c][k] - means[c]) * window[k] / sizes[c];
        // Two real columns are one complex one: x + j*y, whose transform Z gives
        // X(f) = (Z(f) + conj Z(-f))/2 and Y(f) = (Z(f) - conj Z(-f))/2j.
        for x in (0..parts.len()).step_by(2) {
            let y = (x + 1 < parts.len()).then_some(x + 1);
            for (k, z) in buffer.iter_mut().enumerate() {
                *z = Complex::new(value(x, k), y.map_or(0.0, |y| value(y, k)));
            }
            plan.process_with_scratch(buffer, scratch);
            for f in 1..=lines {
                let (z, mirrored) = (buffer[f], buffer[length - f].conj());
                spectra[x][f - 1] = (z + mirrored) * (0.5 * sizes[x]);
                if let Some(y) = y {
                    let twice = z - mirrored;
                    spectra[y][f - 1] = Complex::new(twice.im, -twice.re) * (0.5 * sizes[y]);
                }
            }
        }
    }
}

impl Spectra {
    /// Spectra of `columns` (one length, at least 32) in segments of `length` samples, sampled every `dt` seconds.
    pub fn new(columns: &[&[f64]], length: usize, dt: f64) -> Self {
        let n = columns[0].len();
        let length = length.min(n);
        let possible = 1 + 2 * (n - length) / length;
        let count = possible.min(SEGMENTS);
        let lines = length / 2 - 1;
        let plan = FftPlanner::new().plan_fft_forward(length);
        let window: Vec<f64> =
            (0..length).map(|k| 0.5 - 0.5 * (std::f64::consts::TAU * (k as f64 + 0.5) / length as f64).cos()).collect();
        let m = columns.len();
        // Powers of two that bring the columns to about one size: in one transform of two the smaller one is not lost in the rounding
        // of the larger one.
        let sizes: Vec<f64> = columns.par_iter().map(|c| power_of_two_above(deviation(c))).collect();
        let pairs: Vec<(usize, usize)> = (0..m).flat_map(|i| (i..m).map(move |j| (i, j))).collect();
        let mut values = vec![ZERO; pairs.len() * lines];
        let mut segments: Vec<Segment> =
            (0..BATCH.min(count)).map(|_| Segment::new(m, length, plan.get_inplace_scratch_len())).collect();
        for batch in (0..count).step_by(BATCH) {
            let batch = batch..(batch + BATCH).min(count);
            let transforms = &mut segments[..batch.len()];
            transforms.par_iter_mut().zip(batch).for_each(|(segment, s)| {
                let first = if count > 1 { s * (n - length) / (count - 1) } else { 0 };
                let parts: Vec<&[f64]> = columns.iter().map(|column| &column[first..first + length]).collect();
                segment.transform(&parts, &window, &sizes, plan.as_ref());
            });
            let transforms = &*transforms;
            // In the order of the segments, whichever was transformed first.
            values.par_chunks_mut(lines).zip(&pairs).for_each(|(out, (i, j))| {
                for segment in transforms {
                    for ((o, a), b) in out.iter_mut().zip(&segment.spectra[*i]).zip(&segment.spectra[*j]) {
                        *o += a.conj() * b;
                    }
                }
            });
        }
        let scale = 1.0 / count as f64;
        values.iter_mut().for_each(|v| *v *= scale);
        let overlapping = if possible > count { 1.0 } else { 11.0 / 18.0 };
        Self {
            columns: m,
            lines,
            resolution: std::f64::consts::TAU / (length as f64 * dt),
            averages: (count as f64 * overlapping).max(1.0),
            values,
        }
    }

    /// Average of `conj(X_i)*X_j` at line `f`, from 0.
    pub fn of(&self, i: usize, j: usize, f: usize) -> Complex<f64> {
        if i > j {
            return self.of(j, i, f).conj();
        }
        self.values[(i * (2 * self.columns - i - 1) / 2 + j) * self.lines + f]
    }

    /// Variance of a real cross spectrum that is summed over lines, over the sum of the products of the two columns' powers: real and
    /// imaginary part share a product, and every average holds another one.
    pub const fn variance_of_sums(&self) -> f64 {
        0.5 * NEIGHBOURS / self.averages
    }

    /// Whether there is a column of that index.
    pub const fn has(&self, i: usize) -> bool {
        i < self.columns
    }

    /// Power of a column at a line.
    pub fn power(&self, i: usize, f: usize) -> f64 {
        self.of(i, i, f).re
    }

    /// Coherence of two columns at a line, 0 to 1.
    pub fn coherence(&self, i: usize, j: usize, f: usize) -> f64 {
        let both = self.power(i, f) * self.power(j, f);
        if both > 0.0 { (self.of(i, j, f).norm_sqr() / both).min(1.0) } else { 0.0 }
    }

    /// Frequency of a line, rad/s.
    pub fn omega(&self, f: usize) -> f64 {
        (f + 1) as f64 * self.resolution
    }

    /// Coherence that unrelated columns exceed at one line of three hundred.
    pub fn by_chance(&self) -> f64 {
        if self.averages <= 1.5 { 1.0 } else { 1.0 - (1.0_f64 / 300.0).powf(1.0 / (self.averages - 1.0)) }
    }
}

/// The power of two that is at least so large, within the range of normal numbers; one of zero.
fn power_of_two_above(size: f64) -> f64 {
    if size.is_normal() { size.log2().ceil().clamp(-1000.0, 1000.0).exp2() } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::level::noise;

    #[test]
    fn the_spectra_of_columns_of_any_size_are_those_of_each_alone() {
        let columns: Vec<Vec<f64>> = [1.0, 1e9, 1e-12]
            .iter()
            .zip(1..)
            .map(|(size, seed)| noise(256, seed).iter().map(|e| size * e).collect())
            .collect();
        let slices: Vec<&[f64]> = columns.iter().map(Vec::as_slice).collect();
        let all = Spectra::new(&slices, 64, 1e-3);
        for (i, j) in [(0, 0), (0, 1), (1, 2), (2, 1), (2, 2)] {
            let alone = [i, j].map(|c| Spectra::new(&[slices[c], &[0.0; 256]], 64, 1e-3));
            for f in 0..all.lines {
                let power = alone.each_ref().map(|s| s.power(0, f));
                assert!((all.power(i, f) / power[0] - 1.0).abs() < 1e-12);
                // Hermitian, and no larger than the two powers allow.
                assert!((all.of(i, j, f) - all.of(j, i, f).conj()).norm() <= 1e-12 * (power[0] * power[1]).sqrt());
                assert!(all.of(i, j, f).norm() <= (1.0 + 1e-12) * (power[0] * power[1]).sqrt());
            }
        }
        // A column a quarter of a turn later: the phase of the cross spectrum.
        let wave = |shift: f64| -> Vec<f64> {
            (0..256).map(|k| (std::f64::consts::TAU * (8.0 * k as f64 / 64.0 - shift)).cos()).collect()
        };
        let two = Spectra::new(&[&wave(0.0), &wave(0.25)], 64, 1e-3);
        let cross = two.of(0, 1, 7);
        assert!((cross.arg() + std::f64::consts::FRAC_PI_2).abs() < 1e-9, "{cross}");
    }
}
