//! The linear axis' answer to extra torques, as seen by the encoders, less what initial states can explain.
//!
//! `y = G*(T - f)`: with the true motion known, the torques `f` of an effect along it are known too, and what they do
//! to the readings is linear superposition, whatever their size. So a screening of effects is a linear regression of
//! `y - G*T` on the columns `G*f`, each freed of the windows' initial states.

use super::model::Model;
use super::record::Record;
use super::windows::{Initial, Window};
use crate::axis::{Linear, Propagator, Scheme, Structure};
use crate::effects::Ramp;

/// Motion of the axis at every sample of a record: `[theta1, omega1, theta2, omega2]` and `[alpha1, alpha2]`.
#[derive(Debug, Clone, Default)]
pub struct States {
    /// Angles and speeds.
    pub motion: Vec<[f64; 4]>,
    /// Accelerations, rad/s2.
    pub acceleration: Vec<[f64; 2]>,
}

impl States {
    /// The state of a window that begins at the sample; a third inertia moves with the table.
    #[must_use]
    pub fn initial(&self, sample: usize) -> Initial {
        let [theta1, omega1, theta2, omega2] = self.motion[sample];
        [theta1, omega1, theta2, omega2, 0.0, 0.0]
    }
}

/// Extra torque on motor and table over each sample.
pub type Torques = Vec<[Ramp<f64>; 2]>;

/// A column of the regression: weighted readings of every compared sample, window by window, channel inside sample.
pub type Column = Vec<f64>;

/// The linear axis over the windows of a record.
pub struct Responder<'a> {
    record: &'a Record,
    windows: &'a [Window],
    step: Propagator,
    structure: Structure,
    weight: [f64; 4],
    present: Vec<usize>,
    /// Orthonormal columns of each window's initial states.
    bases: Vec<Vec<Column>>,
}

impl<'a> Responder<'a> {
    /// Prepares the linear part of the model over the windows.
    #[must_use]
    pub fn new(model: &Model, record: &'a Record, windows: &'a [Window]) -> Self {
        let step = Propagator::new(&model.parameters, model.structure, Scheme::Exact, record.dt);
        let present: Vec<usize> = (0..4).filter(|c| record.channels[*c].is_some()).collect();
        let mut responder = Self {
            record,
            windows,
            step,
            structure: model.structure,
            weight: record.noise.map(|s| 1.0 / s),
            present,
            bases: Vec::new(),
        };
        let mut known: Vec<((usize, usize), Vec<Column>)> = Vec::new();
        responder.bases = windows
            .iter()
            .map(|w| {
                let shape = (w.compared.start - w.begin, w.compared.len());
                if let Some((_, basis)) = known.iter().find(|(s, _)| *s == shape) {
                    return basis.clone();
                }
                let basis = responder.initial_basis(shape);
                known.push((shape, basis.clone()));
                basis
            })
            .collect();
        responder
    }

    fn initial_basis(&self, (warm, length): (usize, usize)) -> Vec<Column> {
        let directions: &[Linear<f64>] = match self.structure {
            Structure::TwoInertia => {
                &[[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]]
            }
            Structure::Rigid => &[[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0]],
        };
        let mut basis: Vec<Column> = Vec::new();
        for start in directions {
            let mut s = *start;
            let mut column = Vec::with_capacity(length * self.present.len());
            for k in 0..warm + length {
                if k >= warm {
                    self.push(&mut column, &s);
                }
                s = self.step.apply(&s, [0.0; 2], [0.0; 2]);
            }
            // Gram-Schmidt, twice for rounding.
            let before = norm(&column);
            for _ in 0..2 {
                for b in &basis {
                    let along = dot(b, &column);
                    subtract(&mut column, b, along);
                }
            }
            let size = norm(&column);
            if size > 1e-9 * before && size > 0.0 {
                column.iter_mut().for_each(|v| *v /= size);
                basis.push(column);
            }
        }
        basis
    }

    fn push(&self, column: &mut Column, s: &Linear<f64>) {
        let reading = [s[0], s[1], s[0] - s[2], s[1] - s[3]];
        column.extend(self.present.iter().map(|&c| reading[c] * self.weight[c]));
    }

    /// Number of compared values.
    #[must_use]
    pub fn values(&self) -> usize {
        self.windows.iter().map(|w| w.compared.len()).sum::<usize>() * self.present.len()
    }

    /// What extra torques do to the readings, freed of initial states.
    #[must_use]
    pub fn torques(&self, torque: &[[Ramp<f64>; 2]]) -> Column {
        let mut column = Vec::with_capacity(self.values());
        for window in self.windows {
            let mut s = [0.0; 4];
            for (k, [motor, table]) in torque.iter().enumerate().take(window.compared.end).skip(window.begin) {
                if k >= window.compared.start {
                    self.push(&mut column, &s);
                }
                s = self.step.apply(&s, [motor.start, table.start], [motor.end, table.end]);
            }
        }
        self.free_of_initial_states(&mut column);
        column
    }

    /// A change of the readings themselves, freed of initial states.
    #[must_use]
    pub fn readings(&self, change: impl Fn(usize) -> [f64; 4]) -> Column {
        let mut column = Vec::with_capacity(self.values());
        for window in self.windows {
            for k in window.compared.clone() {
                let change = change(k);
                column.extend(self.present.iter().map(|&c| change[c] * self.weight[c]));
            }
        }
        self.free_of_initial_states(&mut column);
        column
    }

    /// What was read, less what the linear axis makes of the torque, freed of initial states.
    #[must_use]
    pub fn residual(&self) -> Column {
        let zero = Ramp::default();
        let torque: Torques =
            (0..self.record.len()).map(|k| [self.record.hold.ramp(&self.record.torque, k), zero]).collect();
        let answer = self.torques(&torque);
        let mut read = self.readings(|k| {
            let value = |c: usize| self.record.channels[c].as_ref().map_or(0.0, |v| v[k]);
            [value(0), value(1), value(2), value(3)]
        });
        subtract(&mut read, &answer, 1.0);
        read
    }

    fn free_of_initial_states(&self, column: &mut Column) {
        let mut from = 0;
        for (window, basis) in self.windows.iter().zip(&self.bases) {
            let to = from + window.compared.len() * self.present.len();
            let part = &mut column[from..to];
            for b in basis {
                let along = dot(b, part);
                subtract(part, b, along);
            }
            from = to;
        }
    }
}

/// Scalar product.
#[must_use]
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    // Four sums: the compiler may not reorder one.
    let mut sums = [0.0; 4];
    let (ca, cb) = (a.chunks_exact(4), b.chunks_exact(4));
    let rest: f64 = ca.remainder().iter().zip(cb.remainder()).map(|(x, y)| x * y).sum();
    for (x, y) in ca.zip(cb) {
        for i in 0..4 {
            sums[i] += x[i] * y[i];
        }
    }
    sums[0] + sums[1] + sums[2] + sums[3] + rest
}

fn norm(a: &[f64]) -> f64 {
    dot(a, a).sqrt()
}

fn subtract(a: &mut [f64], b: &[f64], times: f64) {
    for (x, y) in a.iter_mut().zip(b) {
        *x -= times * y;
    }
}
