//! The covariance of a sum of scores that are not independent of each other.
//!
//! ```text
//! covariance = H^-1 * Omega * H^-1,   Omega = n * long-run covariance of the scores (regressor times residual)
//! ```
//!
//! The long-run covariance is the mean of the outer products of the first B cosine transforms of the scores
//! (E. Lazarus, D. J. Lewis, J. H. Stock, M. W. Watson, HAR inference, J. Business & Economic Statistics 36, 2018; their
//! B = 0.4*n^(2/3)). Of a long record the scores are summed over short blocks first: the fastest of the cosines hardly
//! changes over one.

use nalgebra::{DMatrix, DVector, SMatrix};

/// Most cosine transforms.
const MOST: usize = 64;
/// Most blocks: 128 to a half-wave of the fastest cosine.
const BLOCKS: usize = 128 * MOST;

/// Scores, summed over blocks of samples.
#[derive(Debug, Clone)]
pub(crate) struct Scores {
    sums: Vec<f64>,
    width: usize,
    samples: usize,
    block: usize,
}

/// Samples of a block of a record of so many.
pub(crate) fn block(samples: usize) -> usize {
    samples.div_ceil(BLOCKS).max(1)
}

impl Scores {
    /// Of `samples` samples and `width` unknowns, zero so far.
    pub fn new(samples: usize, width: usize) -> Self {
        Self::in_blocks(samples, width, block(samples))
    }

    /// The same in blocks of so many samples.
    pub fn in_blocks(samples: usize, width: usize, block: usize) -> Self {
        Self { sums: vec![0.0; samples.div_ceil(block) * width], width, samples, block }
    }

    /// Adds to the score of an unknown at sample `k`.
    #[inline]
    pub fn add(&mut self, k: usize, unknown: usize, value: f64) {
        self.sums[k / self.block * self.width + unknown] += value;
    }

    /// Adds to the score of an unknown what a whole block of samples has.
    pub fn add_block(&mut self, block: usize, unknown: usize, value: f64) {
        self.sums[block * self.width + unknown] += value;
    }

    /// Their sum.
    pub fn total<const N: usize>(&self) -> [f64; N] {
        std::array::from_fn(|i| self.sums.iter().skip(i).step_by(self.width).sum())
    }

    /// Omega of `N` unknowns.
    pub fn omega_of<const N: usize>(&self) -> SMatrix<f64, N, N> {
        let omega = self.omega();
        SMatrix::from_fn(|i, j| omega[(i, j)])
    }

    /// Omega, width x width.
    pub fn omega(&self) -> DMatrix<f64> {
        let n = self.samples as f64;
        let transforms = ((0.4 * n.powf(2.0 / 3.0)) as usize).clamp(4, MOST);
        let mut omega = DMatrix::<f64>::zeros(self.width, self.width);
        for j in 1..=transforms {
            let mut x = DVector::<f64>::zeros(self.width);
            for (b, sums) in self.sums.chunks_exact(self.width).enumerate() {
                let first = b * self.block;
                let middle = 0.5 * (first + (first + self.block).min(self.samples)) as f64;
                let psi = (std::f64::consts::PI * j as f64 * middle / n).cos();
                for (x, s) in x.iter_mut().zip(sums) {
                    *x += psi * s;
                }
            }
            omega += &x * x.transpose() * 2.0;
        }
        omega / transforms as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};

    /// A first-order autoregression of unit innovations: its long-run variance is `1/(1 - a)^2`.
    fn omega(n: usize, a: f64, seed: u64) -> f64 {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
        let mut scores = Scores::new(n, 1);
        let mut e = 0.0;
        for k in 0..n {
            let w: f64 = StandardNormal.sample(&mut rng);
            e = a * e + w;
            scores.add(k, 0, e);
        }
        scores.omega()[(0, 0)] / n as f64
    }

    #[test]
    fn the_long_run_variance_of_an_autoregression_is_that_of_its_formula() {
        for (n, a) in [(4000, 0.0), (4000, 0.9), (4000, -0.5), (100_000, 0.9)] {
            // 64 transforms: a standard error of sqrt(2/64) = 18 % a run, 4 % over twenty.
            let mean = (0..20).map(|seed| omega(n, a, seed)).sum::<f64>() / 20.0;
            let expected = 1.0 / (1.0_f64 - a).powi(2);
            assert!((mean / expected - 1.0).abs() < 0.15, "{n} {a}: {mean} instead of {expected}");
        }
    }
}
