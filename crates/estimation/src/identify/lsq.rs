//! Linear least squares by orthogonal triangularisation, in blocks of rows and never through `X'X`.
//!
//! Each block of `[X | Y]` (rows x (p + q)) is reduced to its triangle by Householder reflections, and the triangles
//! are stacked and reduced again (TSQR): one pass over the rows, no matrix of all of them, any number of threads with
//! the same result. The columns of the final triangle are scaled to unit norm before the rank is judged and the system
//! solved.
//!
//! Sources: G. H. Golub, C. F. Van Loan, Matrix Computations, 4th ed., 5.2.2 and 5.3; J. Demmel et al.,
//! Communication-optimal parallel and sequential QR, SIAM J. Sci. Comput. 34 (2012).

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use crate::trace::numerics::dot;

/// Rows of a block: with a handful of columns it stays in the first-level cache.
pub const BLOCK: usize = 512;
/// Smallest singular value of the unit-norm triangle, relative to the largest, that counts as rank.
pub const RANK_TOLERANCE: f64 = 1e-12;

/// The triangle of `[X | Y]`: all that least squares needs to know of the data.
#[derive(Debug, Clone, PartialEq)]
pub struct Triangle {
    /// Upper triangle, (p + q) x (p + q).
    r: DMatrix<f64>,
    regressors: usize,
    rows: usize,
}

/// The solution of a least-squares problem with q right-hand sides.
#[derive(Debug, Clone, PartialEq)]
pub struct Solution {
    /// p x q.
    pub phi: DMatrix<f64>,
    /// Residual cross products `E'E`, q x q.
    pub residual: DMatrix<f64>,
    /// `inv(X'X)`, p x p.
    pub inverse: DMatrix<f64>,
    /// Factor `R` with `R'R = X'X`, p x p.
    pub factor: DMatrix<f64>,
    /// Rows of data.
    pub rows: usize,
    /// Largest over smallest singular value of X with unit-norm columns.
    pub condition: f64,
}

impl Solution {
    /// Unbiased variance of the residual of one right-hand side.
    #[must_use]
    pub fn variance(&self, output: usize) -> f64 {
        self.residual[(output, output)] / (self.rows as f64 - self.phi.nrows() as f64).max(1.0)
    }
}

/// The data do not determine every unknown.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("the data do not determine the unknowns {columns:?} (singular value {smallest:.1e} of the scaled regressors)")]
pub struct Deficient {
    /// Columns that take part in the undetermined directions.
    pub columns: Vec<usize>,
    /// Smallest singular value relative to the largest.
    pub smallest: f64,
}

/// Reduces `rows` rows of `regressors + outputs` numbers, each written by `fill(row, numbers)`.
pub fn triangularise<F>(rows: usize, regressors: usize, outputs: usize, fill: F) -> Triangle
where
    F: Fn(usize, &mut [f64]) + Sync,
{
    let mut triangle = Triangle::empty(regressors, outputs);
    triangle.extend(rows, fill);
    triangle
}

/// Householder triangularisation of a column-major m x w block, in place; gives the w x w triangle.
fn reduce(block: &mut [f64], m: usize, width: usize) -> Vec<f64> {
    let mut triangle = vec![0.0; width * width];
    for k in 0..width {
        let (left, right) = block.split_at_mut((k + 1) * m);
        let column = &mut left[k * m..];
        for i in 0..k.min(m) {
            triangle[k * width + i] = column[i];
        }
        if k >= m {
            continue;
        }
        let v = &mut column[k..];
        let norm = dot(v, v).sqrt();
        if norm == 0.0 {
            continue;
        }
        let alpha = if v[0] > 0.0 { -norm } else { norm };
        triangle[k * width + k] = alpha;
        // H = I - v*v'/(v'v/2), v = x - alpha*e1; v'v/2 = norm^2 - alpha*x1.
        let half = norm * norm - alpha * v[0];
        v[0] -= alpha;
        for other in right.chunks_exact_mut(m) {
            let other = &mut other[k..];
            let factor = dot(v, other) / half;
            for (o, a) in other.iter_mut().zip(v.iter()) {
                *o -= factor * a;
            }
        }
    }
    triangle
}

impl Triangle {
    /// Of no rows yet.
    #[must_use]
    pub fn empty(regressors: usize, outputs: usize) -> Self {
        Self { r: DMatrix::zeros(regressors + outputs, regressors + outputs), regressors, rows: 0 }
    }

    /// Takes `rows` more rows, each written by `fill(row, numbers)` with `row` from 0. The result is that of all rows at
    /// once, to the bit, where every part but the last has a multiple of [`BLOCK`] rows.
    pub fn extend<F>(&mut self, rows: usize, fill: F)
    where
        F: Fn(usize, &mut [f64]) + Sync,
    {
        debug_assert!(self.rows.is_multiple_of(BLOCK), "parts of whole blocks");
        let width = self.r.ncols();
        let blocks = rows.div_ceil(BLOCK);
        let triangles: Vec<Vec<f64>> = (0..blocks)
            .into_par_iter()
            .map_init(
                || (vec![0.0; BLOCK * width], vec![0.0; width]),
                |(block, row), b| {
                    let first = b * BLOCK;
                    let count = BLOCK.min(rows - first);
                    for i in 0..count {
                        fill(first + i, row);
                        for (j, value) in row.iter().enumerate() {
                            block[j * count + i] = *value;
                        }
                    }
                    reduce(&mut block[..count * width], count, width)
                },
            )
            .collect();
        // The order of merging is that of the blocks, whichever thread made them.
        let mut total = self.r.as_slice().to_vec();
        let mut stacked = vec![0.0; 2 * width * width];
        for triangle in triangles {
            for j in 0..width {
                stacked[j * 2 * width..][..width].copy_from_slice(&total[j * width..][..width]);
                stacked[j * 2 * width + width..][..width].copy_from_slice(&triangle[j * width..][..width]);
            }
            total = reduce(&mut stacked, 2 * width, width);
        }
        self.r.copy_from_slice(&total);
        self.rows += rows;
    }

    /// Root mean square of a column of `[X | Y]`.
    #[must_use]
    pub fn rms(&self, column: usize) -> f64 {
        self.r.column(column).norm() / (self.rows as f64).sqrt()
    }

    /// Solves for all right-hand sides.
    ///
    /// # Errors
    /// [`Deficient`], naming the columns of X that the data do not determine.
    pub fn solve(&self) -> Result<Solution, Deficient> {
        let (p, q) = (self.regressors, self.r.ncols() - self.regressors);
        let factor = self.r.view((0, 0), (p, p)).into_owned();
        let norms = DVector::from_fn(p, |j, _| factor.column(j).norm());
        let zero: Vec<usize> = (0..p).filter(|j| norms[*j] == 0.0 || !norms[*j].is_finite()).collect();
        if !zero.is_empty() {
            return Err(Deficient { columns: zero, smallest: 0.0 });
        }
        let scaled = DMatrix::from_fn(p, p, |i, j| factor[(i, j)] / norms[j]);
        let svd = scaled.clone().svd(false, true);
        let (largest, smallest) = (svd.singular_values.max(), svd.singular_values.min());
        if smallest <= RANK_TOLERANCE * largest || self.rows < p {
            let vt = svd.v_t.as_ref();
            let columns = (0..p)
                .filter(|j| {
                    (0..p).any(|k| {
                        svd.singular_values[k] <= RANK_TOLERANCE * largest
                            && vt.is_some_and(|vt| vt[(k, *j)].abs() > 0.1)
                    })
                })
                .collect();
            return Err(Deficient { columns, smallest: smallest / largest });
        }
        let right = self.r.view((0, p), (p, q)).into_owned();
        let deficient = || Deficient { columns: Vec::new(), smallest: 0.0 };
        let mut phi = scaled.solve_upper_triangular(&right).ok_or_else(deficient)?;
        let mut root = scaled.solve_upper_triangular(&DMatrix::identity(p, p)).ok_or_else(deficient)?;
        for j in 0..p {
            phi.row_mut(j).unscale_mut(norms[j]);
            root.row_mut(j).unscale_mut(norms[j]);
        }
        let rest = self.r.view((p, p), (q, q)).into_owned();
        Ok(Solution {
            phi,
            residual: rest.tr_mul(&rest),
            inverse: &root * root.transpose(),
            factor,
            rows: self.rows,
            condition: largest / smallest,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Longley's data (JASA 62, 1967), the classic ill-conditioned regression; certified values by NIST
    /// (Statistical Reference Datasets, Longley, 15 digits).
    const LONGLEY: [[f64; 7]; 16] = [
        [83.0, 234_289.0, 2356.0, 1590.0, 107_608.0, 1947.0, 60_323.0],
        [88.5, 259_426.0, 2325.0, 1456.0, 108_632.0, 1948.0, 61_122.0],
        [88.2, 258_054.0, 3682.0, 1616.0, 109_773.0, 1949.0, 60_171.0],
        [89.5, 284_599.0, 3351.0, 1650.0, 110_929.0, 1950.0, 61_187.0],
        [96.2, 328_975.0, 2099.0, 3099.0, 112_075.0, 1951.0, 63_221.0],
        [98.1, 346_999.0, 1932.0, 3594.0, 113_270.0, 1952.0, 63_639.0],
        [99.0, 365_385.0, 1870.0, 3547.0, 115_094.0, 1953.0, 64_989.0],
        [100.0, 363_112.0, 3578.0, 3350.0, 116_219.0, 1954.0, 63_761.0],
        [101.2, 397_469.0, 2904.0, 3048.0, 117_388.0, 1955.0, 66_019.0],
        [104.6, 419_180.0, 2822.0, 2857.0, 118_734.0, 1956.0, 67_857.0],
        [108.4, 442_769.0, 2936.0, 2798.0, 120_445.0, 1957.0, 68_169.0],
        [110.8, 444_546.0, 4681.0, 2637.0, 121_950.0, 1958.0, 66_513.0],
        [112.6, 482_704.0, 3813.0, 2552.0, 123_366.0, 1959.0, 68_655.0],
        [114.2, 502_601.0, 3931.0, 2514.0, 125_368.0, 1960.0, 69_564.0],
        [115.7, 518_173.0, 4806.0, 2572.0, 127_852.0, 1961.0, 69_331.0],
        [116.9, 554_894.0, 4007.0, 2827.0, 130_081.0, 1962.0, 70_551.0],
    ];

    #[test]
    fn longleys_ill_conditioned_regression_has_nists_certified_values() {
        let solution = triangularise(16, 7, 1, |i, row| {
            row[0] = 1.0;
            row[1..].copy_from_slice(&LONGLEY[i]);
        })
        .solve()
        .unwrap();
        let certified = [
            -3_482_258.634_595_82,
            15.061_872_271_373_3,
            -0.358_191_792_925_910e-1,
            -2.020_229_803_816_83,
            -1.033_226_867_173_59,
            -0.511_041_056_535_807e-1,
            1_829.151_464_613_55,
        ];
        let deviations = [
            890_420.383_607_373,
            84.914_925_774_766_9,
            0.334_910_077_722_432e-1,
            0.488_399_681_651_699,
            0.214_274_163_161_675,
            0.226_073_200_069_370,
            455.478_499_142_212,
        ];
        let variance = solution.variance(0);
        assert!((variance.sqrt() / 304.854_073_561_965 - 1.0).abs() < 1e-9);
        for k in 0..7 {
            // The columns' condition is 4e9 unscaled: seven digits is what doubles allow; most certified programs reach it.
            assert!((solution.phi[(k, 0)] / certified[k] - 1.0).abs() < 1e-7, "{k}: {}", solution.phi[(k, 0)]);
            let deviation = (variance * solution.inverse[(k, k)]).sqrt();
            assert!((deviation / deviations[k] - 1.0).abs() < 1e-7, "{k}: {deviation}");
        }
    }

    #[test]
    fn an_undetermined_column_is_named() {
        let error = triangularise(5000, 3, 1, |i, row| {
            let t = i as f64 * 0.01;
            row.copy_from_slice(&[t.sin(), t.cos(), -2.0 * t.cos(), 1.0]);
        })
        .solve()
        .unwrap_err();
        assert_eq!(error.columns, [1, 2]);
        let zero = triangularise(5000, 2, 1, |i, row| row.copy_from_slice(&[0.0, i as f64, 1.0])).solve().unwrap_err();
        assert_eq!(zero.columns, [0]);
    }

    #[test]
    fn the_blocks_and_threads_do_not_change_the_result() {
        let run = |threads: usize| {
            rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(|| {
                triangularise(20_000, 2, 2, |i, row| {
                    let t = i as f64 * 0.013;
                    row.copy_from_slice(&[t.sin(), (1.7 * t).cos(), 2.0 * t.sin() - 3.0 * (1.7 * t).cos(), t.sin()]);
                })
            })
        };
        let one = run(1);
        assert_eq!(one, run(3));
        let solution = one.solve().unwrap();
        for (k, expected) in [2.0, -3.0, 1.0, 0.0].into_iter().enumerate() {
            assert!((solution.phi.as_slice()[k] - expected).abs() < 1e-13);
        }
    }
}
