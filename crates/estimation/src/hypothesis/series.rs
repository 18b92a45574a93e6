//! Spectra of the band as series in time, and series in the band.

use rustfft::FftPlanner;

use super::likelihood::{Band, C};

impl Band {
    /// Whitened rows of each equation as series in time, whose products over the whole record are those of the rows.
    pub fn whitened_in_time(&self, whitened: &[f64]) -> Vec<Vec<f64>> {
        let n = 2 * self.omega.len();
        let equations = self.equations();
        let series = |i: usize| {
            let mut z = vec![C::default(); n];
            for (z, row) in z.iter_mut().zip(whitened.chunks_exact(2 * equations)) {
                *z = C::new(row[2 * i], row[2 * i + 1]);
            }
            FftPlanner::new().plan_fft_inverse(n).process(&mut z);
            let scale = (n as f64).sqrt();
            z.iter().flat_map(|v| [v.re / scale, v.im / scale]).collect()
        };
        (0..equations).map(series).collect()
    }

    /// A spectrum of an equation as a series in time; nothing of an equation that the record has not.
    pub fn in_time(&self, row: &[C]) -> Vec<f64> {
        if row.is_empty() {
            return Vec::new();
        }
        let mut z = vec![C::default(); self.n];
        for (m, v) in row.iter().enumerate() {
            z[m] = *v;
            z[(self.n - m) % self.n] = v.conj();
        }
        FftPlanner::new().plan_fft_inverse(self.n).process(&mut z);
        z.iter().map(|v| v.re / (self.n as f64).sqrt()).collect()
    }

    /// A series in the band, in time.
    pub fn filtered(&self, series: &[f64]) -> Vec<f64> {
        let mut planner = FftPlanner::new();
        let mut z: Vec<C> = series.iter().zip(&self.taper).map(|(r, w)| C::new(r * w, 0.0)).collect();
        planner.plan_fft_forward(self.n).process(&mut z);
        let count = self.omega.len();
        for (m, v) in z.iter_mut().enumerate() {
            if m >= count && self.n - m >= count {
                *v = C::default();
            }
        }
        planner.plan_fft_inverse(self.n).process(&mut z);
        z.iter().map(|v| v.re / self.n as f64).collect()
    }
}
