//! The linear axis' answer to extra torques, as seen by the encoders, less what initial states can explain.
//!
//! `y = G*(T - f)`: with the true motion known, the torques `f` of an effect along it are known too, and what they do
//! to the readings is linear superposition, whatever their size. So a screening of effects is a linear regression of
//! what a model leaves on the columns `G*f`, each freed of the windows' initial states.

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

    /// Lowest and highest angle of motor (0) or table (1), rad.
    #[must_use]
    pub fn ends(&self, side: usize) -> [f64; 2] {
        let angles = self.motion.iter().map(|s| s[2 * side]);
        angles.fold([f64::MAX, f64::MIN], |[low, high], a| [low.min(a), high.max(a)])
    }

    /// Angle between the ends, rad.
    #[must_use]
    pub fn travel(&self, side: usize) -> f64 {
        let [low, high] = self.ends(side);
        high - low
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

    /// A column brought back to the torques that act at the samples, on motor and table: for every torque `u` given by
    /// its values at the samples, `<self.torques(u), column> = <u, self.adjoint(column)>`, if the column is free of
    /// initial states.
    #[must_use]
    pub fn adjoint(&self, column: &[f64]) -> Vec<[f64; 2]> {
        let still = [0.0; 4];
        let unit = |i: usize| std::array::from_fn::<f64, 4, _>(|j| f64::from(u8::from(i == j)));
        let step: [Linear<f64>; 4] = std::array::from_fn(|i| self.step.apply(&unit(i), [0.0; 2], [0.0; 2]));
        let torque = [[1.0, 0.0], [0.0, 1.0]];
        let start = torque.map(|t| self.step.apply(&still, t, [0.0; 2]));
        let end = torque.map(|t| self.step.apply(&still, [0.0; 2], t));
        let product = |a: &Linear<f64>, b: &Linear<f64>| a.iter().zip(b).map(|(x, y)| x * y).sum::<f64>();
        let mut back = vec![[0.0; 2]; self.record.len()];
        let mut from = 0;
        for window in self.windows {
            let to = from + window.compared.len() * self.present.len();
            let part = &column[from..to];
            // What a change of the state is worth from here to the window's end.
            let mut worth = [0.0; 4];
            for k in (window.begin..window.compared.end).rev() {
                if k + 1 < window.compared.end {
                    for i in 0..2 {
                        back[k][i] += product(&start[i], &worth);
                        back[k + 1][i] += product(&end[i], &worth);
                    }
                    worth = std::array::from_fn(|i| product(&step[i], &worth));
                }
                if k >= window.compared.start {
                    let at = (k - window.compared.start) * self.present.len();
                    for (value, &c) in part[at..].iter().zip(&self.present) {
                        let v = value * self.weight[c];
                        let side = c % 2;
                        worth[side] += v;
                        if c >= 2 {
                            worth[side + 2] -= v;
                        }
                    }
                }
            }
            from = to;
        }
        back
    }

    /// A column brought back to changes of one reading at the samples, as [`Responder::adjoint`]; zeros if it is not read.
    #[must_use]
    pub fn adjoint_of_reading(&self, column: &[f64], channel: usize) -> Vec<f64> {
        self.along(column, channel, |part| part.iter().map(|v| v * self.weight[channel]).collect())
    }

    /// One reading's part of a column, window by window through `change`, at the samples of the record; zeros between.
    #[must_use]
    pub fn along(&self, column: &[f64], channel: usize, change: impl Fn(&[f64]) -> Vec<f64>) -> Vec<f64> {
        let mut along = vec![0.0; self.record.len()];
        let Some(offset) = self.present.iter().position(|c| *c == channel) else { return along };
        let mut from = 0;
        for window in self.windows {
            let to = from + window.compared.len() * self.present.len();
            let part: Vec<f64> = column[from..to].iter().skip(offset).step_by(self.present.len()).copied().collect();
            along[window.compared.clone()].copy_from_slice(&change(&part));
            from = to;
        }
        along
    }

    /// A change of the readings themselves, freed of initial states.
    #[must_use]
    pub fn readings(&self, change: impl Fn(usize) -> [f64; 4]) -> Column {
        self.compared(self.windows.iter().flat_map(|w| w.compared.clone()).map(change))
    }

    /// Readings of every compared sample, window by window, freed of initial states.
    #[must_use]
    pub fn compared(&self, readings: impl Iterator<Item = [f64; 4]>) -> Column {
        let mut column = Vec::with_capacity(self.values());
        for reading in readings {
            column.extend(self.present.iter().map(|&c| reading[c] * self.weight[c]));
        }
        self.free_of_initial_states(&mut column);
        column
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

/// `a -= times*b`.
pub fn subtract(a: &mut [f64], b: &[f64], times: f64) {
    for (x, y) in a.iter_mut().zip(b) {
        *x -= times * y;
    }
}

#[cfg(test)]
mod tests {
    use super::super::windows::cut;
    use super::*;
    use crate::axis::{Hold, Parameters};
    use crate::effects::Settings;

    /// `<G*u, r> = <u, G'*r>` for torques and residuals of no pattern, both sides computed by their own runs.
    #[test]
    fn the_adjoint_is_one() {
        let n = 700;
        let wild = |k: usize, seed: f64| ((k as f64 + seed) * 12.9898 + (k as f64) * (k as f64) * 0.37).sin();
        let parameters = Parameters { i1: 2.37e-4, i2: 6.07e-5, b: 5.4e-3, k: 1.76, rho: 1.0 };
        let model = Model::new(parameters, Structure::TwoInertia, Settings::default());
        let channel = |seed: f64| Some((0..n).map(|k| wild(k, seed)).collect::<Vec<f64>>());
        let record = Record {
            start: 0.0,
            dt: 1e-3,
            hold: Hold::Zoh,
            torque: vec![0.0; n],
            channels: [channel(0.1), channel(0.2), channel(0.3), None],
            noise: [1.0, 20.0, 0.5, 1.0],
        };
        let windows = cut(0..n);
        let responder = Responder::new(&model, &record, &windows);
        let residual = responder.readings(|k| [wild(k, 3.0), wild(k, 4.0), wild(k, 5.0), 0.0]);
        let at: Vec<[f64; 2]> = (0..n).map(|k| [wild(k, 6.0), wild(k, 7.0)]).collect();
        let forward = dot(&responder.torques(&super::super::features::ramps(&at)), &residual);
        let back: f64 = responder.adjoint(&residual).iter().zip(&at).map(|(a, u)| a[0] * u[0] + a[1] * u[1]).sum();
        assert!((forward - back).abs() < 1e-9 * forward.abs(), "{forward} {back}");
    }
}
