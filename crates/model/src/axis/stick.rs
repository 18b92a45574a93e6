//! Dry friction at rest: the torques that keep a sticking inertia from moving over a segment of a step.

use super::parameters::Structure;
use super::propagator::{Compliance, Propagator};
use crate::scalar::Scalar;

/// The torques of sticking friction, N.m: constant over the step, and such that the sticking velocities are zero at its end.
pub(super) struct StickTorques<S> {
    sticks: [bool; 2],
    /// Inverse of the velocity compliance of the sticking inertias, N.m.s/rad.
    inverse: [[S; 2]; 2],
    c: Compliance,
}

impl<S: Scalar> StickTorques<S> {
    pub fn new(sticks: [bool; 2], step: &Propagator<S>, c: Compliance, structure: Structure) -> Self {
        let zero = S::default();
        let mut inverse = [[zero; 2]; 2];
        let mut sticks = sticks;
        if structure == Structure::Rigid && sticks == [true, true] {
            // One body: one holding torque.
            sticks[1] = false;
        }
        if sticks != [false, false] {
            let h = step.velocity_per_constant_torque();
            match sticks {
                [true, true] => {
                    let det = h[0][0] * h[1][1] - h[0][1] * h[1][0];
                    inverse = [[h[1][1] / det, -(h[0][1] / det)], [-(h[1][0] / det), h[0][0] / det]];
                }
                [true, false] => inverse[0][0] = S::from(1.0) / h[0][0],
                _ => inverse[1][1] = S::from(1.0) / h[1][1],
            }
        }
        Self { sticks, inverse, c }
    }

    /// The end of the step under the torques of sticking friction, and these torques, N.m.
    #[inline]
    pub fn apply(
        &self,
        step: &Propagator<S>,
        from: &[S; 4],
        tau0: [S; 2],
        tau1: [S; 2],
        free: [S; 4],
    ) -> ([S; 4], [S; 2]) {
        if self.sticks == [false, false] {
            return (free, [S::default(); 2]);
        }
        let v = [free[1], free[1] - free[3]];
        let mut hold = [S::default(); 2];
        for (i, row) in self.inverse.iter().enumerate() {
            for (j, g) in row.iter().enumerate() {
                if self.sticks[i] && self.sticks[j] {
                    hold[i] += *g * v[j];
                }
            }
        }
        let less = |t: [S; 2]| [t[0] - hold[0], t[1] - hold[1]];
        let mut held = step.apply(from, less(tau0), less(tau1));
        // Zero exactly, not to rounding, and no motion from rest to rest: a body that sticks does not creep.
        let table = from[0] - from[2];
        if self.sticks[0] {
            held[1] = S::default();
            if from[1].re() == 0.0 {
                held[2] -= held[0] - from[0];
                held[0] = from[0];
            }
        }
        if self.sticks[1] {
            held[3] = held[1];
            if (from[1] - from[3]).re() == 0.0 {
                held[2] = held[0] - table;
            }
        }
        (held, hold)
    }

    /// Jacobian of `force - found(force)`: `1 + stiffness*X + damping*V`, with the compliance of the axis as it sticks.
    pub fn jacobian(&self, tangent: &[[[f64; 2]; 2]; 2]) -> [[f64; 2]; 2] {
        let mut x = self.c.position;
        let mut v = self.c.velocity;
        if self.sticks != [false, false] {
            // The torques of sticking friction change as well: they cancel the velocities of what sticks.
            let (cx, cv) = (&self.c.constant_position, &self.c.constant_velocity);
            let v0 = v;
            for column in 0..2 {
                for i in 0..2 {
                    if !self.sticks[i] {
                        continue;
                    }
                    let hold: f64 =
                        (0..2).filter(|&j| self.sticks[j]).map(|j| self.inverse[i][j].re() * v0[j][column]).sum();
                    for row in 0..2 {
                        x[row][column] -= cx[row][i] * hold;
                        v[row][column] -= cv[row][i] * hold;
                    }
                }
            }
        }
        let mut j = [[1.0, 0.0], [0.0, 1.0]];
        for row in 0..2 {
            for column in 0..2 {
                for m in 0..2 {
                    j[row][column] += tangent[0][row][m] * x[m][column] + tangent[1][row][m] * v[m][column];
                }
            }
        }
        j
    }
}
