//! The score of the likelihood of errors in variables: the noise is in the measured motion as it is in the residual.

use super::{Band, C, Sight, TorqueResidual};
use crate::axis::Parameters;
use crate::hypothesis::discrepancy::Discrepancy;
use crate::hypothesis::hidden::Hidden;
use crate::hypothesis::model::{BaseParameter, Free, Model};

impl Band {
    /// Corrects the columns of base parameters for the noise that is in the measured motion as it is in the rows, and tells how the
    /// density of readings grows with each: the score of the likelihood of errors in variables.
    pub fn score(
        &self,
        model: &Model,
        residual: &TorqueResidual,
        s: Discrepancy,
        stiffens: &[(Free, f64, usize)],
        columns: &mut [[Vec<C>; 2]],
    ) -> Vec<Vec<f64>> {
        let both = self.sight == Sight::Both;
        let one = C::new(1.0, 0.0);
        let mut grows = vec![vec![0.0; self.omega.len()]; stiffens.len()];
        let modes: Vec<Hidden> = Hidden::modes(model, self.sides()).collect();
        for (m, weight) in self.weight.iter().enumerate() {
            let (a, b, c, _) = self.factor(residual.weights[m], s);
            let v = self.visible_of(model, &modes, m);
            // C^-1 r = L^-H L^-1 r, and the readings' share of it: with N the readings' noise
            // E = V^-1 (V N V^H) C^-1 r = N V^H C^-1 r.
            let r0 = residual.rows[0][m];
            let z0 = r0 * a;
            let z1 = if both { b * r0 + residual.rows[1][m] * c } else { C::default() };
            let y = [z0 * a + b.conj() * z1, z1 * c];
            let n = self.seen(m);
            let e = if both {
                let seen = [0, 1].map(|i: usize| v[0][i].conj() * y[0] + v[1][i].conj() * y[1]);
                [0, 1].map(|i: usize| seen[i] * n[i] + (seen[0] + seen[1]) * self.common)
            } else {
                [v[0][0].conj() * y[0] * n[0], C::default()]
            };
            // V^-1 (1 - N C^-1) = V^-1 S C^-1.
            let p = if both {
                [[one * (a * a + b.norm_sqr()), b.conj() * c], [b * c, one * (c * c)]]
            } else {
                [[one * (a * a), C::default()], [C::default(), C::default()]]
            };
            let sc = [[p[0][0] * s[0], p[0][1] * s[0]], [p[1][0] * s[1], p[1][1] * s[1]]];
            let det = if both { v[0][0] * v[1][1] - v[0][1] * v[1][0] } else { v[0][0] };
            let inverse = if both {
                [[v[1][1] / det, -v[0][1] / det], [-v[1][0] / det, v[0][0] / det]]
            } else {
                [[one / det, C::default()], [C::default(), C::default()]]
            };
            let of = |x: &[[C; 2]; 2], y: &[[C; 2]; 2], i: usize, j: usize| x[i][0] * y[0][j] + x[i][1] * y[1][j];
            let vs = [
                [of(&inverse, &sc, 0, 0), of(&inverse, &sc, 0, 1)],
                [of(&inverse, &sc, 1, 0), of(&inverse, &sc, 1, 1)],
            ];
            for (i, (parameter, slope, column)) in stiffens.iter().enumerate() {
                let Some(d) = self.stiffened(*parameter, model, m) else { continue };
                let column = &mut columns[*column];
                if both && *parameter == Free::Base(BaseParameter::I2) {
                    // The table's discrepancy grows with its inertia (`Band::rescaled`).
                    let grown = slope / model.parameters.i2 * s[1];
                    column[1][m] -= y[1] * grown;
                    grows[i][m] -= 2.0 * weight * grown * c * c;
                }
                column[0][m] -= (d[0][0] * e[0] + d[0][1] * e[1]) * *slope;
                if both {
                    column[1][m] -= (d[1][0] * e[0] + d[1][1] * e[1]) * *slope;
                }
                if !self.motion_is_given {
                    grows[i][m] += 2.0 * weight * slope * (of(&d, &vs, 0, 0) + of(&d, &vs, 1, 1)).re;
                }
            }
        }
        grows
    }

    /// What the stiffness that the equations show at a bin gains with a parameter of the axis or of a third inertia; `None` where it has none of it.
    fn stiffened(&self, parameter: Free, model: &Model, m: usize) -> Option<[[C; 2]; 2]> {
        match parameter {
            Free::Base(p) => {
                let mut unit = Parameters { i1: 0.0, i2: 0.0, b: 0.0, k: 0.0, rho: model.parameters.rho };
                *p.slot(&mut unit) = 1.0;
                Some(self.visible(&unit, &model.parameters, m))
            }
            Free::Effect(effect, i) => {
                let mode = Hidden::of_effect(effect, model, self.sides())?;
                let (at, by) = self.entry(mode.side, m);
                let mut gains = [[C::default(); 2]; 2];
                gains[at][at] = *mode.inertia_gains(self.spread[m], self.dt).get(i)? * by;
                Some(gains)
            }
            Free::Loop(_) => None,
        }
    }
}
