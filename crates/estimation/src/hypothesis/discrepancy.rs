//! The size of what a model lacks beyond the noise: the one of largest likelihood.
//!
//! It is white in the band, though a remainder seldom is. With a power that falls with frequency, as friction's own does, a cause that is
//! not in the model yet passes for noise: fits then follow the upper end of the band and leave more of the torque, and fewer whole machines
//! are told right (`scripts/blind/RESULT.md`). How few values a coloured remainder has of its own is counted instead
//! ([`Band::independent`]), and whether a cause stands out of one of any colour is asked at the end (`diagnose/octaves.rs`).

use super::likelihood::{Band, Sight, TorqueResidual};
use super::model::Model;

/// Variances of the discrepancy of each equation.
pub type Discrepancy = [f64; 2];

/// Decades of variance below the residual's that a discrepancy is looked for in.
const DECADES: i32 = 12;
/// Steps of scoring.
const SCORINGS: usize = 30;
/// Least variance of one equation's discrepancy over that of the other's, as accelerations.
const CORNER: f64 = 2.5e-3;

impl Band {
    /// The discrepancy of largest likelihood: the best of some sizes of it for both equations alike, then scoring for each as long as
    /// that helps.
    pub fn discrepancy(&self, l: &TorqueResidual) -> Discrepancy {
        let rows = &l.rows;
        let eqs = self.equations();
        let most = (0..eqs).map(|i| self.power(&rows[i]) / l.alike[i]).fold(f64::MIN_POSITIVE, f64::max);
        let alike = |v: f64| l.alike.map(|a| a * v);
        let mut s = alike(most);
        let mut value = self.log_likelihood(l, s);
        for i in 1..DECADES {
            let t = alike(most * 0.1_f64.powi(i));
            let v = self.log_likelihood(l, t);
            if v > value {
                (s, value) = (t, v);
            }
        }
        for _ in 0..SCORINGS {
            let next = self.scored(l, s);
            let v = self.log_likelihood(l, next);
            if v.is_nan() || v <= value {
                break;
            }
            let gain = v - value;
            (s, value) = (next, v);
            if gain < 1e-3 {
                break;
            }
        }
        s
    }

    /// The discrepancy of a model at another one: the table's, where both sides are measured, is that of an acceleration.
    ///
    /// No torque that is known acts on the table, so that its equation tells its parameters up to a common factor, and its discrepancy as a
    /// torque grows with that factor. Held as a torque it would hold the factor, which the motor's equation alone tells.
    pub fn rescaled(&self, s: Discrepancy, from: &Model, to: &Model) -> Discrepancy {
        let grown = if self.sight == Sight::Both { to.parameters.i2 / from.parameters.i2 } else { 1.0 };
        [s[0], s[1] * grown * grown]
    }

    /// A step of scoring from a discrepancy.
    fn scored(&self, l: &TorqueResidual, s: Discrepancy) -> Discrepancy {
        let rows = &l.rows;
        let eqs = self.equations();
        let (mut num, mut den) = ([0.0; 2], [0.0; 2]);
        for (m, (&first, &w)) in rows[0].iter().zip(&self.weight).enumerate() {
            let (a, b, c, _) = self.factor(l.weights[m], s);
            let z0 = first * a;
            if eqs == 1 {
                let p = a * a;
                num[0] += w * (z0.norm_sqr() * p - p);
                den[0] += w * p * p;
            } else {
                let z1 = b * first + rows[1][m] * c;
                // P R = L^-H z, P = L^-H L^-1
                let pr = [z0 * a + b.conj() * z1, z1 * c];
                let p = [a * a + b.norm_sqr(), c * c];
                for i in 0..2 {
                    num[i] += w * (pr[i].norm_sqr() - p[i]);
                    den[i] += w * p[i] * p[i];
                }
            }
        }
        let mut next = s;
        for i in 0..eqs {
            if den[i] > 0.0 {
                next[i] = (s[i] + num[i] / den[i]).clamp(0.1 * s[i], 10.0 * s[i]);
            }
        }
        // An equation without any discrepancy beside one with much is a corner of the likelihood, not a finding.
        let most = (0..eqs).map(|i| next[i] / l.alike[i]).fold(0.0, f64::max);
        for (v, alike) in next.iter_mut().zip(&l.alike).take(eqs) {
            *v = v.max(CORNER * most * alike);
        }
        next
    }
}
