//! The rigid axis: inertia, viscous and dry friction and load from one encoder, in weak form.
//!
//! ```text
//! T = I*a + D*w + F*sign(w) + L
//! ```
//!
//! Multiplied by a test function psi that vanishes with its first derivatives at the ends of a window, and integrated
//! by parts, no measured signal is differentiated:
//!
//! ```text
//! int psi*T = I*int psi''*th - D*int psi'*th + F*int psi*sign(w) + L*int psi,   psi(s) = (1 - s^2)^4
//! ```
//!
//! The sign is taken from the speed smoothed over the same window; windows in which it changes keep its measured course.
//! Sources: A. Janot, M. Gautier, M. Brunot, EMPS benchmark, 2019 (model and friction terms); D. A. Messenger,
//! D. M. Bortz, Weak SINDy, Multiscale Model. Simul. 19 (2021) (test functions).

use std::ops::Range;

use nalgebra::{DMatrix, DVector, Vector4};

use super::assessment::output_fit;
use super::identifiability::{Evidence, Identifiability, SMALL_TORQUE};
use super::joined::Joined;
use super::known::Known;
use super::lsq::triangularise;
use super::result::{
    Estimate, ExcitationEstimate, Identification, MethodResult, OutputFit, Recommendation, SCHEMA, Series,
};
use super::run::{Request, summary};
use super::statistics::spectrum;
use crate::numerics::level::rms;
use crate::trace::{AxisKind, Machine, Signal, TraceError};

/// Least samples of half a window.
const LEAST_HALF: usize = 12;

/// psi and its first two derivatives on a window of 2*half + 1 samples; the derivatives per sample.
struct Window {
    psi: Vec<f64>,
    first: Vec<f64>,
    second: Vec<f64>,
}

impl Window {
    fn new(half: usize) -> Self {
        let h = half as f64;
        let grid = || (0..=2 * half).map(|k| (k as f64 - h) / h);
        Self {
            psi: grid().map(|s| (1.0 - s * s).powi(4)).collect(),
            first: grid().map(|s| -8.0 * s * (1.0 - s * s).powi(3) / h).collect(),
            second: grid()
                .map(|s| (-8.0 * (1.0 - s * s).powi(3) + 48.0 * s * s * (1.0 - s * s).powi(2)) / (h * h))
                .collect(),
        }
    }

    fn apply(weights: &[f64], values: &[f64]) -> f64 {
        weights.iter().zip(values).map(|(w, v)| w * v).sum()
    }
}

/// What the regression found: I, D, F, L and their covariance.
#[derive(Debug, Clone)]
pub struct Rigid {
    /// I, D, F, L.
    pub values: Vector4<f64>,
    /// Their standard errors.
    pub std: Vector4<f64>,
    /// Half a window, samples.
    pub half: usize,
    /// Times of the windows' centres, measured and modelled mean torque.
    pub fit: (Vec<f64>, Vec<f64>, Vec<f64>),
    /// The regression's rows: regressors of I, D, F, L, then the mean torque.
    rows: Vec<[f64; 5]>,
    /// The piece of the record that each row lies in.
    of_piece: Vec<usize>,
}

/// Why a rigid axis could not be identified.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RigidError {
    /// Too few samples.
    #[error("{samples} samples are too few for windows of {window}: record longer")]
    TooShort {
        /// Samples there are.
        samples: usize,
        /// Samples of a window.
        window: usize,
    },
    /// A direction without excitation.
    #[error("the record does not determine {0}: let the axis accelerate, move at different speeds and reverse")]
    Unexcited(String),
}

/// Torque and angle of a record in pieces.
#[derive(Clone, Copy)]
struct RigidRecord<'a> {
    /// N.m (or N), one value a sample.
    torque: &'a [f64],
    /// rad (or m), one value a sample.
    theta: &'a [f64],
    /// Interval, s.
    dt: f64,
    /// Samples of each piece.
    pieces: &'a [Range<usize>],
    /// Time of each piece's first sample, s.
    starts: &'a [f64],
}

impl<'a> RigidRecord<'a> {
    fn of(joined: &'a Joined) -> Result<Self, TraceError> {
        let trace = joined.samples();
        Ok(Self {
            torque: trace.require(Signal::T)?,
            theta: trace.require(Signal::Theta1)?,
            dt: trace.dt,
            pieces: joined.pieces(),
            starts: joined.starts(),
        })
    }

    /// Samples of the longest piece: windows must fit into it.
    fn longest(&self) -> usize {
        self.pieces.iter().map(ExactSizeIterator::len).max().unwrap_or(0)
    }
}

/// Identifies a rigid axis. No window reaches from one piece into the next.
///
/// # Errors
/// When the record is too short or a direction is not excited.
fn weak_in_pieces(record: &RigidRecord) -> Result<Rigid, RigidError> {
    let n = record.longest();
    if 8 * LEAST_HALF + 2 > n {
        return Err(RigidError::TooShort { samples: n, window: 2 * LEAST_HALF + 1 });
    }
    // Short windows let the noise of the acceleration in, long ones leave few rows: the window with the smallest standard
    // error of the inertia is taken.
    let mut best: Option<Rigid> = None;
    let mut half = LEAST_HALF;
    let mut failure = None;
    while 8 * half + 2 <= n {
        match in_windows(record, half) {
            Ok(found) => {
                let share = |r: &Rigid| r.std[0] / r.values[0].abs();
                if best.as_ref().is_none_or(|b| share(&found) < share(b)) {
                    best = Some(found);
                }
            }
            Err(e) => failure = Some(e),
        }
        half += half / 2;
    }
    best.ok_or_else(|| failure.unwrap_or(RigidError::TooShort { samples: n, window: 2 * LEAST_HALF + 1 }))
}

/// The regression in windows of `2*half + 1` samples.
fn in_windows(record: &RigidRecord, half: usize) -> Result<Rigid, RigidError> {
    let RigidRecord { torque, theta, dt, .. } = *record;
    let w = Window::new(half);
    let span = 2 * half + 1;
    let total: f64 = w.psi.iter().sum();
    // Speed smoothed by the same test function, for the sign of the dry friction.
    let mut speed = vec![0.0; theta.len()];
    for piece in record.pieces.iter().filter(|p| p.len() >= span) {
        for k in piece.clone() {
            let first = k.saturating_sub(half).clamp(piece.start, piece.end - span);
            speed[k] = -Window::apply(&w.first, &theta[first..first + span]) / (total * dt);
        }
    }
    let still = 1e-3 * rms(&speed);
    let sign: Vec<f64> = speed.iter().map(|v| if v.abs() <= still { 0.0 } else { v.signum() }).collect();
    let step = (half / 2).max(1);
    let mut centres = Vec::new();
    let (mut times, mut of_piece) = (Vec::new(), Vec::new());
    let pieces = record.pieces.iter().zip(record.starts).enumerate();
    for (number, (piece, start)) in pieces.filter(|(_, (p, _))| p.len() >= span) {
        let own = (piece.start + half..piece.end - half).step_by(step);
        times.extend(own.clone().map(|k| start + (k - piece.start) as f64 * dt));
        of_piece.extend(own.clone().map(|_| number));
        centres.extend(own);
    }
    if centres.len() < 8 {
        return Err(RigidError::TooShort { samples: theta.len(), window: span });
    }
    let row = |i: usize| {
        let range = centres[i] - half..centres[i] + half + 1;
        let angle = &theta[range.clone()];
        [
            Window::apply(&w.second, angle) / (total * dt * dt),
            -Window::apply(&w.first, angle) / (total * dt),
            Window::apply(&w.psi, &sign[range.clone()]) / total,
            1.0,
            Window::apply(&w.psi, &torque[range]) / total,
        ]
    };
    let names = ["the inertia", "viscous friction", "dry friction", "the load"];
    let solution = triangularise(centres.len(), 4, 1, |i, out| out.copy_from_slice(&row(i))).solve().map_err(|e| {
        let which: Vec<&str> = e.columns.iter().filter_map(|c| names.get(*c).copied()).collect();
        RigidError::Unexcited(which.join(" and "))
    })?;
    let values = Vector4::from_fn(|i, _| solution.phi[(i, 0)]);
    let rows: Vec<[f64; 5]> = (0..centres.len()).map(row).collect();
    let modelled: Vec<f64> = rows.iter().map(|r| (0..4).map(|j| r[j] * values[j]).sum()).collect();
    let residual: Vec<f64> = rows.iter().zip(&modelled).map(|(r, m)| r[4] - m).collect();
    let std = robust(&rows, &residual, &of_piece, &solution.inverse);
    Ok(Rigid { values, std, half, fit: (times, rows.iter().map(|r| r[4]).collect(), modelled), rows, of_piece })
}

/// The rows of the piece that has most.
fn longest_run(of_piece: &[usize]) -> Range<usize> {
    let mut first = 0;
    let runs = of_piece.chunk_by(|a, b| a == b).map(|run| {
        first += run.len();
        first - run.len()..first
    });
    runs.max_by_key(ExactSizeIterator::len).unwrap_or(0..0)
}

/// Standard errors that allow for overlapping windows and autocorrelated residuals: Newey-West with a lag of eight windows
/// (W. K. Newey, K. D. West, Econometrica 55, 1987).
fn robust(rows: &[[f64; 5]], residual: &[f64], of_piece: &[usize], inverse: &DMatrix<f64>) -> Vector4<f64> {
    const LAGS: usize = 8;
    let score = |k: usize| DVector::from_iterator(4, (0..4).map(|j| rows[k][j] * residual[k]));
    let scores: Vec<DVector<f64>> = (0..rows.len()).map(score).collect();
    let mut middle = DMatrix::<f64>::zeros(4, 4);
    for lag in 0..=LAGS.min(rows.len() - 1) {
        let weight = 1.0 - lag as f64 / (LAGS + 1) as f64;
        for k in (lag..rows.len()).filter(|k| of_piece[*k] == of_piece[k - lag]) {
            let product = &scores[k] * scores[k - lag].transpose();
            if lag == 0 {
                middle += product;
            } else {
                middle += (&product + product.transpose()) * weight;
            }
        }
    }
    let covariance = inverse * middle * inverse;
    Vector4::from_fn(|i, _| covariance[(i, i)].max(0.0).sqrt())
}

fn units(motion: AxisKind) -> [&'static str; 4] {
    match motion {
        AxisKind::Rotary => ["kg.m2", "N.m.s/rad", "N.m", "N.m"],
        AxisKind::Linear => ["kg", "N.s/m", "N", "N"],
    }
}

/// Torques at one unit of viscous friction, dry friction and load, as shares of the torque's size.
fn shares(record: &RigidRecord) -> [f64; 3] {
    let size = rms(record.torque).max(f64::MIN_POSITIVE);
    let span = 8.min(record.longest().saturating_sub(1)).max(1);
    let windows = record.pieces.iter().flat_map(|p| record.theta[p.clone()].windows(span + 1));
    let speed: Vec<f64> = windows.map(|w| (w[span] - w[0]) / (span as f64 * record.dt)).collect();
    [rms(&speed) / size, 1.0 / size, 1.0 / size]
}

/// The estimates, where an axis can have them. A friction that is negative within its error is set to zero.
fn physical(mut found: Rigid, shares: &[f64; 3]) -> Result<Rigid, String> {
    let (v, s) = (&found.values, &found.std);
    if !v.iter().chain(s.iter()).all(|v| v.is_finite()) || v[0] <= 0.0 {
        return Err("the inertia comes out negative or without bound: the torque of this record does not accelerate this axis, or \
                    another torque that the model lacks (gravity, a spring, a second inertia) rules it. One that is known goes \
                    into [effects] of the axis file (a weight on a hinge is [effects.gravity]) and is taken off; otherwise look \
                    at the record (`eixo inspect`, `eixo diagnose`)"
            .to_owned());
    }
    for (i, name) in [(1, "viscous friction"), (2, "dry friction")] {
        let material = -v[i] * shares[i - 1] > SMALL_TORQUE;
        if v[i] + 3.0 * s[i] < 0.0 && material {
            return Err(format!(
                "the {name} comes out negative: something else moves the axis with its motion (gravity, a spring, another drive), \
                 or torque and position are not of the same instant. Look at the record (`eixo inspect`, `eixo diagnose`)"
            ));
        }
    }
    for i in [1, 2] {
        found.values[i] = found.values[i].max(0.0);
    }
    Ok(found)
}

/// Fit of the torque of the last third of the record with the estimates from the first two thirds, per cent.
fn held_out(joined: &Joined) -> Option<f64> {
    let n = joined.len();
    let (first, rest) = (joined.part(0..2 * n / 3), joined.part(2 * n / 3..n));
    let first = weak_in_pieces(&RigidRecord::of(&first).ok()?).ok()?;
    // The same windows on the rest: the regression's rows there, with the first part's estimates.
    let rest = in_windows(&RigidRecord::of(&rest).ok()?, first.half).ok()?;
    let error: Vec<f64> =
        rest.rows.iter().map(|r| r[4] - (0..4).map(|j| r[j] * first.values[j]).sum::<f64>()).collect();
    let size = rms(&rest.fit.1);
    (size > 0.0).then(|| 100.0 * (1.0 - rms(&error) / size))
}

/// `eixo identify` for a rigid axis.
///
/// # Errors
/// When the record lacks the torque or the motor angle.
pub(super) fn identify(
    joined: &Joined,
    machine: &Machine,
    request: &Request,
    file: &str,
    progress: &mut dyn FnMut(&str),
) -> Result<Identification, TraceError> {
    let known = Known::of(machine);
    let taken_off = known.taken_off(joined, machine)?;
    let regressed = taken_off.as_ref().unwrap_or(joined);
    let trace = joined.samples();
    let record = RigidRecord::of(regressed)?;
    let motion = machine.signals.motion;
    progress("weak-form least squares");
    let mut result = MethodResult::empty("ls", "Least squares, weak form");
    result.formulation = "T = I*a + D*w + F*sign(w) + L".to_owned();
    let unit = Signal::T.unit(motion);
    let mut recommended = None;
    let mut evidence = Evidence::default();
    let found = weak_in_pieces(&record).map_err(|e| e.to_string());
    match found.and_then(|f| physical(f, &shares(&record))) {
        Ok(found) => {
            let window = (2 * found.half + 1) as f64 * trace.dt;
            result.formulation =
                format!("{} in windows of {window:.4} s, theta1 not differentiated", result.formulation);
            let reference = request.reference.then_some(machine.parameters.i1 + machine.parameters.i2);
            let names = ["I", "viscous_motor.coefficient", "coulomb_motor.level", "load_motor.torque"];
            evidence = Evidence { held_out: held_out(regressed), shares: Some(shares(&record)), ..Evidence::default() };
            for (i, name) in names.into_iter().enumerate() {
                let r = if i == 0 { reference } else { None };
                result.parameters.push(Estimate::new(name, units(motion)[i], found.values[i], Some(found.std[i]), r));
            }
            let (time, measured, modelled) = found.fit;
            let error: Vec<f64> = modelled.iter().zip(&measured).map(|(a, b)| a - b).collect();
            let dt = (found.half / 2).max(1) as f64 * trace.dt;
            let longest = longest_run(&found.of_piece);
            let percent = 100.0 * rms(&error) / rms(&measured).max(f64::MIN_POSITIVE);
            let at = |k: usize| time[k];
            let residual: Vec<f64> = error.iter().map(|e| -e).collect();
            result
                .outputs
                .push(OutputFit { signal: Signal::T, ..output_fit(Signal::T, &measured, &residual, at, motion) });
            result.excitation = Some(ExcitationEstimate {
                formulation: "I*a + D*w + F*sign(w) + L, means over the windows",
                error_percent: percent,
                estimate: Series::over("estimated T", unit, at, &modelled),
                error: Series::over("error of T", unit, at, &error),
                spectrum: spectrum("estimated T", unit, dt, &modelled[longest]),
            });
            recommended = Some(Recommendation {
                method: 0,
                why: "the torque is compared, not the position: in a closed loop the position follows for any model"
                    .to_owned(),
            });
        }
        Err(why) => result.failure = Some(why),
    }
    let identifiability = Identifiability::of(&[], recommended.as_ref().map(|_| &result), evidence);
    let torque = trace.require(Signal::T)?;
    Ok(Identification {
        schema: SCHEMA,
        machine: machine.name.clone(),
        structure: "rigid",
        trace: summary(joined, file, None),
        methods: vec![result],
        recommended,
        identifiability,
        torque: Series::over("T", unit, |k| joined.time(k), torque),
        torque_spectrum: spectrum("T", unit, trace.dt, &torque[joined.longest()]),
        frequency_response: None,
        warnings: known.warnings(machine.structure),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};

    /// Of a record in one piece that starts at zero.
    fn identified(torque: &[f64], theta: &[f64], dt: f64) -> Result<Rigid, RigidError> {
        let pieces = std::iter::once(0..theta.len()).collect::<Vec<_>>();
        weak_in_pieces(&RigidRecord { torque, theta, dt, pieces: &pieces, starts: &[0.0] })
    }

    #[test]
    fn inertia_and_friction_of_a_rigid_axis_are_found_within_their_standard_errors() {
        // theta given in closed form, so that the torque follows from it exactly: no simulator is involved.
        let (i, d, f, l) = (95.0, 200.0, 20.0, -3.0);
        let dt = 1e-3;
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(5);
        let (mut torque, mut theta) = (Vec::new(), Vec::new());
        for k in 0..20_000 {
            let t = k as f64 * dt;
            let (mut x, mut v, mut a) = (0.0, 0.0, 0.0);
            for (amplitude, w) in [(0.05, 2.0), (0.01, 9.0), (0.002, 31.0)] {
                let (s, c) = f64::sin_cos(w * t);
                x += amplitude * s;
                v += amplitude * w * c;
                a -= amplitude * w * w * s;
            }
            let e: f64 = StandardNormal.sample(&mut rng);
            theta.push(x + 1e-7 * e);
            let e: f64 = StandardNormal.sample(&mut rng);
            torque.push(i * a + d * v + f * v.signum() + l + 2.0 * e);
        }
        let found = identified(&torque, &theta, dt).unwrap();
        for (k, truth) in [i, d, f, l].into_iter().enumerate() {
            let error = (found.values[k] - truth).abs();
            assert!(error < 4.0 * found.std[k] + 1e-3 * truth.abs(), "{k}: {} +- {}", found.values[k], found.std[k]);
        }
        assert!(found.std[0] < 0.01 * i);
    }

    #[test]
    fn an_axis_that_only_stands_is_refused_by_name() {
        let error = identified(&[1.0; 500], &[0.5; 500], 1e-3).unwrap_err().to_string();
        assert!(error.contains("the inertia"), "{error}");
    }
}
