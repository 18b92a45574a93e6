//! Instrumental variables: `p = inv(Z'X)*Z'y` on the rows of S4, the instruments from a simulation.
//!
//! ```text
//! S4   torque = I1*a1 + B*rate + K*twist ;  0 = I2*a2 - B*rate - K*twist
//! ```
//!
//! X holds the measured rows, Z the same rows of a noise-free simulation with the parameters so far: the noise of X
//! does not correlate with Z, so that the estimate has no bias (L. Ljung, System Identification, 2nd ed., 7.6). Its
//! covariance is `inv(Z'X)*Omega*inv(Z'X)'`, Omega from the scores `z*e` ([`super::long_run`]), and no smaller than that of
//! white residuals.

use nalgebra::{Matrix4, Vector4};

use super::long_run::Scores;
use super::output_error::{Free, OutputError};
use super::parameters::{Estimated, wider};
use super::record::{RegressionRecord, Row};
use super::regression::RegressionError;
use crate::axis::{Parameters, Scheme};

/// Most rounds.
const ROUNDS: usize = 30;

fn motor(r: &Row) -> Vector4<f64> {
    Vector4::new(r.a1, 0.0, r.rate, r.twist)
}

fn table(r: &Row) -> Vector4<f64> {
    Vector4::new(0.0, r.a2, -r.rate, -r.twist)
}

/// Instrumental-variable estimate from `start`; the rounds it took are the second value.
///
/// # Errors
/// When the record is too short, the rounds do not converge, or leave physical values.
pub fn instrumental(
    record: &RegressionRecord,
    outputs: &OutputError,
    start: &Parameters,
) -> Result<(Estimated, usize), RegressionError> {
    let n = record.rows();
    if n < 16 {
        return Err(RegressionError::TooShort { rows: n, unknowns: 4 });
    }
    let diverged = || RegressionError::Diverged { what: "IV" };
    let mut p = *start;
    for round in 1..=ROUNDS {
        // The initial state of the simulation is the one that fits the outputs with these parameters.
        let fit = outputs.fit(&p, Scheme::NEWMARK, Free { parameters: false, offset: false, bias: false });
        let readings = outputs.simulated(&fit, &p);
        let column = |f: fn(&crate::effects::Reading<f64>) -> f64| readings.iter().map(f).collect::<Vec<f64>>();
        let (theta1, omega1) = (column(|r| r.theta1), column(|r| r.omega1));
        let (theta2, omega2) = (column(|r| r.theta2), column(|r| r.omega2));
        let clean = RegressionRecord {
            torque: record.torque,
            theta1: &theta1,
            theta2: theta2.as_slice().into(),
            omega: record.omega.map(|_| (omega1.as_slice(), omega2.as_slice())),
            pieces: record.pieces.clone(),
            ..*record
        };
        let mut zx = Matrix4::zeros();
        let mut zz = Matrix4::zeros();
        let mut zy = Vector4::zeros();
        for k in 0..n {
            let (x, z) = (record.row(k), clean.row(k));
            zx += motor(&z) * motor(&x).transpose() + table(&z) * table(&x).transpose();
            zz += motor(&z) * motor(&z).transpose() + table(&z) * table(&z).transpose();
            zy += motor(&z) * x.torque;
        }
        // Scaled to unit diagonal before the inverse.
        let scale = Vector4::from_fn(|i, _| 1.0 / zz[(i, i)].sqrt());
        let scaled = Matrix4::from_fn(|i, j| zx[(i, j)] * scale[i] * scale[j]);
        let inverse = scaled.try_inverse().ok_or_else(diverged)?;
        let inverse = Matrix4::from_fn(|i, j| inverse[(i, j)] * scale[i] * scale[j]);
        let values = inverse * zy;
        let mut estimated = Estimated { values, covariance: None };
        if !estimated.is_physical() {
            return Err(diverged());
        }
        let next = estimated.parameters(p.rho);
        let moved = [(next.i1, p.i1), (next.i2, p.i2), (next.k, p.k)]
            .iter()
            .map(|(a, b)| (a / b - 1.0).abs())
            .fold((next.b - p.b).abs() / p.b.abs().max(f64::MIN_POSITIVE), f64::max);
        p = Parameters { b: next.b.max(0.0), ..next };
        if moved < 1e-7 || round == ROUNDS {
            if moved > 1e-2 {
                return Err(diverged());
            }
            let mut sum = 0.0;
            let mut scores = Scores::new(n, 4);
            for k in 0..n {
                let (x, z) = (record.row(k), clean.row(k));
                let (em, et) = (x.torque - motor(&x).dot(&values), -table(&x).dot(&values));
                sum += em.powi(2) + et.powi(2);
                let score = motor(&z) * em + table(&z) * et;
                score.iter().enumerate().for_each(|(i, s)| scores.add(k, i, *s));
            }
            let variance = sum / (2 * n - 4) as f64;
            let plain = inverse * zz * inverse.transpose() * variance;
            let coloured = inverse * scores.omega_of::<4>() * inverse.transpose();
            estimated.covariance = Some(wider(&plain, &coloured));
            return Ok((estimated, round));
        }
    }
    Err(diverged())
}
