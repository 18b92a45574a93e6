//! Averaged cross spectra of a few columns (Welch's method: P. D. Welch, IEEE Trans. Audio Electroacoustics 15, 1967): Hann
//! windows, overlapping by half, means taken off.

use rustfft::FftPlanner;
use rustfft::num_complex::Complex;

/// Most segments that are averaged; of a longer record they are spread evenly.
const SEGMENTS: usize = 96;

/// Cross spectra of columns: `of(i, j, f)` is the average of `conj(X_i)*X_j` at line `f`.
pub(super) struct Spectra {
    columns: usize,
    /// Lines, those of 0 and of the Nyquist frequency left out.
    pub lines: usize,
    /// Distance of the lines, rad/s.
    pub resolution: f64,
    /// Independent averages: half-overlapping Hann segments share a sixth of their information (Welch 1967).
    pub averages: f64,
    values: Vec<Complex<f64>>,
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
        let mut values = vec![Complex::new(0.0, 0.0); m * m * lines];
        let mut buffers = vec![vec![Complex::new(0.0, 0.0); length]; m];
        let mut scratch = vec![Complex::new(0.0, 0.0); plan.get_inplace_scratch_len()];
        for s in 0..count {
            let first = if count > 1 { s * (n - length) / (count - 1) } else { 0 };
            for (buffer, column) in buffers.iter_mut().zip(columns) {
                let part = &column[first..first + length];
                let mean = part.iter().sum::<f64>() / length as f64;
                for ((b, v), w) in buffer.iter_mut().zip(part).zip(&window) {
                    *b = Complex::new((v - mean) * w, 0.0);
                }
                plan.process_with_scratch(buffer, &mut scratch);
            }
            for i in 0..m {
                for j in 0..m {
                    let out = &mut values[(i * m + j) * lines..][..lines];
                    for ((o, a), b) in out.iter_mut().zip(&buffers[i][1..]).zip(&buffers[j][1..]) {
                        *o += a.conj() * b;
                    }
                }
            }
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
        self.values[(i * self.columns + j) * self.lines + f]
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
