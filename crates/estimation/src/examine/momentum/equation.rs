//! The momentum equation at the lines of the spectra: its regressors, its normal equations and their solution.

use rustfft::num_complex::Complex;

use super::{MAIN, SIGN, T, TABLE};
use crate::examine::least::{bounded, standard_error};
use crate::examine::spectra::Spectra;

/// The momentum equation of one record, as a least-squares problem over the lines of its spectra.
pub(super) struct MomentumEquation<'a> {
    pub(super) s: &'a Spectra,
    pub(super) lines: &'a [usize],
    pub(super) collocated: bool,
    /// Antiresonance of the table against the motor, rad/s, for a record without an encoder on the table.
    pub(super) table: Option<f64>,
    pub(super) total: f64,
}

/// A solution of the momentum equation.
pub(super) struct Found {
    /// M1, M2 (kg.m2), c (N.m.s/rad), F (N.m), k and -k (N.m/rad); for a linear axis kg, N.s/m, N, N/m.
    pub(super) x: Vec<f64>,
    /// Explained share of the torque's power.
    pub(super) share: f64,
    /// Share that the inertias alone explain.
    pub(super) inertial: f64,
}

impl MomentumEquation<'_> {
    /// The regressors at a line: the column of the spectra, and the complex factor on it.
    fn regressors(&self, f: usize) -> [(usize, Complex<f64>); 6] {
        let w = self.s.omega(f);
        let j = Complex::new(0.0, w);
        let one = Complex::new(1.0, 0.0);
        let second = if self.s.has(TABLE) {
            (TABLE, j)
        } else if self.collocated {
            let wa = self.table.unwrap_or(f64::INFINITY);
            let r = w / wa;
            // A damping ratio of 0.02 keeps the regressor finite at the antiresonance.
            (MAIN, if wa.is_finite() { j / Complex::new(1.0 - r * r, 0.04 * r) } else { Complex::new(0.0, 0.0) })
        } else {
            (MAIN, j * j * j)
        };
        [(MAIN, j), second, (MAIN, one), (SIGN, one), (MAIN, one / j), (MAIN, -one / j)]
    }

    pub(super) fn gram(&self) -> Vec<Vec<f64>> {
        let mut gram = vec![vec![0.0; 6]; 6];
        for &f in self.lines {
            let of = self.regressors(f);
            for i in 0..6 {
                for k in 0..6 {
                    gram[i][k] += (of[i].1.conj() * of[k].1 * self.s.of(of[i].0, of[k].0, f)).re;
                }
            }
        }
        gram
    }

    /// Right-hand side of the normal equations for a motion that is delayed by `late`, s.
    pub(super) fn right(&self, late: f64) -> Vec<f64> {
        let mut right = vec![0.0; 6];
        for &f in self.lines {
            let turn = Complex::from_polar(1.0, -self.s.omega(f) * late);
            for (r, (column, factor)) in right.iter_mut().zip(self.regressors(f)) {
                *r += (factor.conj() * self.s.of(column, T, f) * turn).re;
            }
        }
        right
    }

    /// [`Self::right`] for a motion that is late by `-most` to `most` samples of `dt`, each: from one to the next the phase of a
    /// line turns by the same angle, so that a line's sines and cross spectra are asked for once; as far before as behind, the
    /// sine alone changes its sign.
    pub(super) fn right_sides(&self, dt: f64, most: usize) -> Vec<[f64; 6]> {
        let mut right_sides = vec![[0.0; 6]; 2 * most + 1];
        // From the middle outwards, before and behind.
        let (before, rest) = right_sides.split_at_mut(most);
        let Some((middle, behind)) = rest.split_first_mut() else { return right_sides };
        for &f in self.lines {
            let terms = self.regressors(f).map(|(column, factor)| factor.conj() * self.s.of(column, T, f));
            let turn = Complex::from_polar(1.0, self.s.omega(f) * dt);
            let mut phase = turn;
            for (r, term) in middle.iter_mut().zip(&terms) {
                *r += term.re;
            }
            for (early, late) in before.iter_mut().rev().zip(behind.iter_mut()) {
                for ((e, l), term) in early.iter_mut().zip(late.iter_mut()).zip(&terms) {
                    let (even, odd) = (term.re * phase.re, term.im * phase.im);
                    *e += even - odd;
                    *l += even + odd;
                }
                phase *= turn;
            }
        }
        right_sides
    }

    /// Standard error of a solution's inertia, the sum of the coefficients `of`, kg.m2 (kg), for a motion that is delayed by `late`, s.
    pub(super) fn error(&self, gram: &[Vec<f64>], found: &Found, of: &[usize], late: f64) -> f64 {
        let mut omega = vec![vec![0.0; 6]; 6];
        for &f in self.lines {
            let turn = Complex::from_polar(1.0, -self.s.omega(f) * late);
            let columns = self.regressors(f);
            let product =
                |i: usize, k: usize| columns[i].1.conj() * columns[k].1 * self.s.of(columns[i].0, columns[k].0, f);
            // Power of what the solution leaves of the torque at the line.
            let mut left = self.s.power(T, f);
            for (i, x) in found.x.iter().enumerate() {
                left -= 2.0 * x * (columns[i].1.conj() * self.s.of(columns[i].0, T, f) * turn).re;
                left += found.x.iter().enumerate().map(|(k, y)| x * y * product(i, k).re).sum::<f64>();
            }
            for (i, row) in omega.iter_mut().enumerate() {
                for (k, o) in row.iter_mut().enumerate() {
                    *o += left.max(0.0) * self.s.variance_of_sums() * product(i, k).re;
                }
            }
        }
        let free: Vec<usize> = (0..6).filter(|i| found.x[*i] > 0.0).collect();
        standard_error(gram, &omega, &free, of)
    }

    pub(super) fn solve(&self, gram: &[Vec<f64>], right: &[f64]) -> Found {
        self.within(gram, right, [[0.0, f64::INFINITY]; 2])
    }

    /// The solution with M1 and M2 within bounds, kg.m2 (kg) each.
    pub(super) fn within(&self, gram: &[Vec<f64>], right: &[f64], inertias: [[f64; 2]; 2]) -> Found {
        // Columns of unit size, so that one bound serves all.
        let size: Vec<f64> = (0..6).map(|i| gram[i][i].sqrt().max(f64::MIN_POSITIVE)).collect();
        let scaled: Vec<Vec<f64>> = (0..6).map(|i| (0..6).map(|k| gram[i][k] / size[i] / size[k]).collect()).collect();
        let right: Vec<f64> = (0..6).map(|i| right[i] / size[i]).collect();
        let (mut low, mut high) = ([0.0; 6], [f64::INFINITY; 6]);
        for (i, [least, most]) in inertias.into_iter().enumerate() {
            (low[i], high[i]) = (least * size[i], most * size[i]);
        }
        let (x, explained) = bounded(&scaled, &right, &low, &high);
        let inertia: f64 = (0..2).map(|i| (0..2).map(|k| x[i] * scaled[i][k] * x[k]).sum::<f64>()).sum();
        Found {
            x: (0..6).map(|i| x[i] / size[i]).collect(),
            share: explained / self.total,
            inertial: inertia / self.total,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_delay_of_many_is_that_of_one() {
        let n = 512;
        let torque: Vec<f64> = (0..n).map(|k| (0.3 * k as f64).sin() + (0.05 * (k * k % 97) as f64)).collect();
        let speed: Vec<f64> =
            (0..n).map(|k| torque[usize::saturating_sub(k, 3)] + 0.2 * (0.7 * k as f64).cos()).collect();
        let sign: Vec<f64> = speed.iter().copied().map(f64::signum).collect();
        let dt = 1e-3;
        let spectra = Spectra::new(&[&torque, &speed, &sign], 128, dt);
        let lines: Vec<usize> = (2..50).collect();
        let balance = MomentumEquation { s: &spectra, lines: &lines, collocated: true, table: Some(700.0), total: 1.0 };
        for (right, late) in balance.right_sides(dt, 5).into_iter().zip(-5..=5) {
            let one = balance.right(f64::from(late) * dt);
            let size = one.iter().fold(0.0_f64, |a, b| a.max(b.abs()));
            for (a, b) in right.iter().zip(&one) {
                assert!((a - b).abs() < 1e-12 * size, "{late}: {right:?} against {one:?}");
            }
        }
    }
}
