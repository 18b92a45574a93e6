//! The linear axis with unknown inputs, as a state space sampled exactly.
//!
//! State `[theta1, omega1, d, d', u1, u2]`: motor, twist `d = theta1 - theta2` and its rate, and up to two unknown
//! inputs that walk at random, `u(k+1) = u(k) + w(k)`, held over the sample. Each enters at a [`Port`]. The step of the
//! first four states is that of [`crate::axis::simulate`] itself, read off its answers to unit states and torques.

use nalgebra::{SMatrix, SVector};

use crate::axis::{Hold, Parameters, Scheme, SimulateOptions, Structure, simulate};
use crate::diagnose::Record;
use crate::effects::{Reading, Settings};

/// Where an unknown input enters.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Port {
    /// A torque on the motor, N.m.
    Motor,
    /// A torque on the table, N.m.
    Table,
    /// A torque on the motor and its opposite on the table, N.m.
    Coupling,
    /// An error of the motor's encoder, rad.
    MotorAngle,
    /// An error of the motor's measured speed, rad/s.
    MotorSpeed,
    /// An error of the table's encoder, rad.
    TableAngle,
    /// An error of the table's measured speed, rad/s.
    TableSpeed,
}

impl Port {
    /// The channel an error enters, for the ports of sensors.
    const fn channel(self) -> Option<usize> {
        match self {
            Self::MotorAngle => Some(0),
            Self::MotorSpeed => Some(1),
            Self::TableAngle => Some(2),
            Self::TableSpeed => Some(3),
            Self::Motor | Self::Table | Self::Coupling => None,
        }
    }
}

/// How the four states of the axis go through one sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Transition {
    /// From state to state.
    pub f: SMatrix<f64, 4, 4>,
    /// From the sampled torque at the start and at the end of the sample.
    pub torque: [SVector<f64, 4>; 2],
    /// From a torque constant over the sample on the motor, and on the table.
    pub constant: [SVector<f64, 4>; 2],
}

impl Transition {
    /// The step of `dt` seconds.
    #[must_use]
    pub fn new(p: &Parameters, structure: Structure, hold: Hold, dt: f64) -> Self {
        let end = |p: &Parameters, hold: Hold, initial: [f64; 4], torque: [f64; 2]| {
            let options = SimulateOptions { start: 0.0, dt, hold, scheme: Scheme::Exact, substeps: 1 };
            simulate(p, structure, &Settings::default(), initial, &torque, &options).readings[1]
        };
        let own = |r: Reading<f64>| SVector::from([r.theta1, r.omega1, r.theta1 - r.theta2, r.omega1 - r.omega2]);
        let units = [[1.0, 0.0, 1.0, 0.0], [0.0, 1.0, 0.0, 1.0], [0.0, 0.0, -1.0, 0.0], [0.0, 0.0, 0.0, -1.0]];
        let columns = units.map(|u| own(end(p, hold, u, [0.0; 2])));
        let mut f = SMatrix::<f64, 4, 4>::from_columns(&columns);
        if structure == Structure::Rigid {
            // The axis has no twist, whatever the table was said to do.
            for j in 2..4 {
                f.column_mut(j).fill(0.0);
            }
        }
        // A torque on the table is one on the motor of the axis seen from its other end.
        let mirror = Parameters { i1: p.i2, i2: p.i1, ..*p };
        let table = match structure {
            Structure::TwoInertia => {
                let r = end(&mirror, Hold::Zoh, [0.0; 4], [1.0; 2]);
                own(Reading { theta1: r.theta2, omega1: r.omega2, theta2: r.theta1, omega2: r.omega1 })
            }
            Structure::Rigid => own(end(p, Hold::Zoh, [0.0; 4], [1.0; 2])),
        };
        Self {
            f,
            torque: [[1.0, 0.0], [0.0, 1.0]].map(|t| own(end(p, hold, [0.0; 4], t))),
            constant: [own(end(p, Hold::Zoh, [0.0; 4], [1.0; 2])), table],
        }
    }

    /// What a unit of the port's input, held over the sample, adds to the four states.
    #[must_use]
    pub fn port(&self, port: Port) -> SVector<f64, 4> {
        match port {
            Port::Motor => self.constant[0],
            Port::Table => self.constant[1],
            Port::Coupling => self.constant[0] - self.constant[1],
            Port::MotorAngle | Port::MotorSpeed | Port::TableAngle | Port::TableSpeed => SVector::zeros(),
        }
    }
}

/// What is known of the state before the record, and the size of things in it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Prior {
    /// Mean of the four states.
    pub mean: [f64; 4],
    /// Their standard deviations.
    pub std: [f64; 4],
    /// Rms of the torque, N.m: the scale of unknown torques.
    pub torque: f64,
    /// Rms of the twist, rad: the scale of unknown encoder errors.
    pub angle: f64,
}

impl Prior {
    /// From the record: wide against all that moves in it.
    #[must_use]
    pub fn new(record: &Record, p: &Parameters, structure: Structure) -> Self {
        let torque = rms(&record.torque).max(f64::MIN_POSITIVE);
        let position = record.channels[0].as_ref().or(record.channels[2].as_ref());
        let noise = record.noise[0].max(record.noise[2]);
        let duration = record.dt * record.len() as f64;
        // The fastest motion seen: over so many samples that the noise does not matter much.
        const LAG: usize = 16;
        let across = LAG as f64 * record.dt;
        let mut speed = position.map_or(0.0, |y| y.windows(LAG + 1).map(|w| (w[LAG] - w[0]).abs()).fold(0.0, f64::max));
        speed = speed / across + noise / across;
        for c in [1, 3] {
            if let Some(y) = &record.channels[c] {
                speed = y.iter().fold(speed, |m, v| m.max(v.abs()));
            }
        }
        if speed == 0.0 {
            speed = torque * duration / (p.i1 + p.i2);
        }
        let flexible = structure == Structure::TwoInertia;
        let static_twist = if flexible && p.k > 0.0 { torque / p.k } else { 0.0 };
        let seen = match (&record.channels[0], &record.channels[2]) {
            (Some(a), Some(b)) => rms(&a.iter().zip(b).map(|(a, b)| a - b).collect::<Vec<_>>()),
            _ => 0.0,
        };
        let angle = (3.0 * static_twist).max(seen).max(noise);
        let first = position.and_then(|y| y.first().copied()).unwrap_or(0.0);
        let rate =
            if flexible { angle * (p.k * p.twist_mobility()).sqrt().max(1.0 / duration.max(record.dt)) } else { 0.0 };
        Self {
            mean: [first, 0.0, 0.0, 0.0],
            std: [
                10.0 * (angle + noise).max(f64::MIN_POSITIVE),
                3.0 * speed.max(f64::MIN_POSITIVE),
                if flexible { 10.0 * angle } else { 0.0 },
                10.0 * rate,
            ],
            torque,
            angle,
        }
    }
}

/// Root mean square.
pub(super) fn rms(v: &[f64]) -> f64 {
    (v.iter().map(|x| x * x).sum::<f64>() / v.len().max(1) as f64).sqrt()
}

/// The axis with `N - 4` unknown inputs.
#[derive(Debug, Clone, Copy)]
pub struct Plant<const N: usize> {
    /// From state to state.
    pub f: SMatrix<f64, N, N>,
    /// From the torque at the start and the end of the sample.
    pub torque: [SVector<f64, N>; 2],
    /// Standard deviation of the walk of every state; the first four do not walk.
    pub walk: SVector<f64, N>,
    /// What each channel reads of the state.
    pub read: [SVector<f64, N>; 4],
    /// Mean of the state before the record.
    pub mean: SVector<f64, N>,
    /// Its standard deviations.
    pub std: SVector<f64, N>,
}

impl<const N: usize> Plant<N> {
    /// The axis with an unknown input at each port, walking by `steps` (standard deviation a sample).
    ///
    /// # Panics
    /// If there are not `N - 4` ports and as many steps.
    #[must_use]
    pub fn new(transition: &Transition, prior: &Prior, ports: &[Port], steps: &[f64]) -> Self {
        assert!(ports.len() + 4 == N && steps.len() == ports.len(), "{N} states take {} unknown inputs", N - 4);
        let widen = |v: &SVector<f64, 4>| SVector::<f64, N>::from_fn(|i, _| if i < 4 { v[i] } else { 0.0 });
        let mut f = SMatrix::<f64, N, N>::identity();
        f.fixed_view_mut::<4, 4>(0, 0).copy_from(&transition.f);
        let mut read = [SVector::zeros(); 4];
        for (c, rows) in [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [1.0, 0.0, -1.0, 0.0], [0.0, 1.0, 0.0, -1.0]]
            .into_iter()
            .enumerate()
        {
            read[c] = widen(&SVector::from(rows));
        }
        let mut walk = SVector::zeros();
        let mut mean = widen(&SVector::from(prior.mean));
        let mut std = widen(&SVector::from(prior.std));
        for (j, (port, step)) in ports.iter().zip(steps).enumerate() {
            let state = 4 + j;
            f.fixed_view_mut::<4, 1>(0, state).copy_from(&transition.port(*port));
            walk[state] = *step;
            mean[state] = 0.0;
            std[state] = match port {
                Port::Motor | Port::Table | Port::Coupling => 3.0 * prior.torque,
                Port::MotorAngle | Port::TableAngle => prior.angle,
                Port::MotorSpeed | Port::TableSpeed => prior.std[1],
            };
            if let Some(channel) = port.channel() {
                read[channel][state] = 1.0;
            }
        }
        Self { f, torque: transition.torque.each_ref().map(widen), walk, read, mean, std }
    }

    /// What a unit of the first unknown input, held over a sample, adds to the state; zero where there is none.
    #[must_use]
    pub fn port(&self) -> SVector<f64, N> {
        SVector::from_fn(|i, _| if N > 4 && i < 4 { self.f[(i, 4)] } else { 0.0 })
    }

    /// The state after sample `k` under the torque recorded.
    #[inline]
    #[must_use]
    pub fn step(&self, x: &SVector<f64, N>, record: &Record, k: usize) -> SVector<f64, N> {
        let (t0, t1) = (record.torque[k], record.torque.get(k + 1).copied().unwrap_or(record.torque[k]));
        self.f * x + self.torque[0] * t0 + self.torque[1] * t1
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_step_with_held_inputs_is_the_exponential_of_the_papers_matrices() {
        let p = Parameters::PAPER;
        let dt = 2e-3;
        let t = Transition::new(&p, Structure::TwoInertia, Hold::Zoh, dt);
        // d/dt [th1 w1 d d' tau1 tau2], nalgebra's Pade exponential.
        let mut a = SMatrix::<f64, 6, 6>::zeros();
        a[(0, 1)] = 1.0;
        a[(1, 2)] = -p.k / p.i1;
        a[(1, 3)] = -p.b / p.i1;
        a[(1, 4)] = 1.0 / p.i1;
        a[(2, 3)] = 1.0;
        let m = 1.0 / p.i1 + 1.0 / p.i2;
        a[(3, 2)] = -p.k * m;
        a[(3, 3)] = -p.b * m;
        a[(3, 4)] = 1.0 / p.i1;
        a[(3, 5)] = -1.0 / p.i2;
        let e = (a * dt).exp();
        let close = |x: f64, y: f64| (x - y).abs() <= 1e-12 * (1.0 + x.abs().max(y.abs()));
        for i in 0..4 {
            for j in 0..4 {
                assert!(close(t.f[(i, j)], e[(i, j)]), "{i} {j}: {} {}", t.f[(i, j)], e[(i, j)]);
            }
            for j in 0..2 {
                assert!(close(t.constant[j][i], e[(i, 4 + j)]), "{i} {j}: {} {}", t.constant[j][i], e[(i, 4 + j)]);
            }
            assert!(close(t.torque[0][i], e[(i, 4)]));
            assert_eq!(t.torque[1][i], 0.0);
        }
    }

    #[test]
    fn a_rigid_axis_has_no_twist_and_feels_both_torques_alike() {
        let t = Transition::new(&Parameters::PAPER, Structure::Rigid, Hold::Linear, 1e-3);
        assert_eq!(t.constant[0], t.constant[1]);
        assert_eq!(t.f.fixed_view::<2, 4>(2, 0).norm(), 0.0);
        assert_eq!(t.f.fixed_view::<4, 2>(0, 2).norm(), 0.0);
    }
}
