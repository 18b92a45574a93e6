//! The axis along a trace: torque in, encoder readings out.

use super::axis_model::{Axis, State};
use super::oscillator::Scheme;
use super::parameters::{Parameters, Structure};
use crate::effects::{Place, Ramp, Reading, Settings, TorqueHistory};
use crate::scalar::Scalar;

/// What the torque does between two samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Hold {
    /// Held over the sample: a drive's command, an FMI master's input.
    #[default]
    Zoh,
    /// A straight line between samples: the paper's own simulation.
    Linear,
}

impl Hold {
    /// The torque over the sample after `k`; the last sample is held.
    #[must_use]
    pub fn ramp<S: Scalar>(self, torque: &[f64], k: usize) -> Ramp<S> {
        let start = torque[k];
        let end = match self {
            Self::Zoh => start,
            Self::Linear => torque.get(k + 1).copied().unwrap_or(start),
        };
        Ramp { start: start.into(), end: end.into() }
    }
}

/// How a trace is simulated.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SimulateOptions {
    /// Time of the first sample, s.
    pub start: f64,
    /// Sampling interval, s.
    pub dt: f64,
    /// What the torque does between samples.
    pub hold: Hold,
    /// Integration of the linear part.
    pub scheme: Scheme,
    /// Steps per sample.
    pub substeps: usize,
}

/// The simulated axis at every sample.
#[derive(Debug, Clone, Default)]
pub struct Response<S = f64> {
    /// What the encoders read.
    pub readings: Vec<Reading<S>>,
    /// Accelerations of motor and table, rad/s2.
    pub accelerations: Vec<[S; 2]>,
}

/// Steps per sample of `dt` s for the effects at hand: one for the linear axis under [`Scheme::Exact`]; with effects on the
/// motion, so many that the fastest mode turns by no more than a quarter of a radian per step.
#[must_use]
pub fn substeps(p: &Parameters<f64>, structure: Structure, effects: &Settings<f64>, dt: f64) -> usize {
    substeps_at_speed(p, structure, effects, dt, [0.0; 2])
}

/// The same where motor and table are known to turn at some speed, rad/s: a torque that repeats with the angle then repeats in time.
#[must_use]
pub fn substeps_at_speed(
    p: &Parameters<f64>,
    structure: Structure,
    effects: &Settings<f64>,
    dt: f64,
    speed: [f64; 2],
) -> usize {
    let on = effects.active();
    if on.motion_is_linear() {
        return 1;
    }
    let mut rate: f64 = 0.0;
    if structure == Structure::TwoInertia {
        // The absolute value of what swings, which a friction that grows with its load sees, swings twice as fast.
        let times = if on.dry().iter().any(|e| effects.is_loaded(*e)) { 2.0 } else { 1.0 };
        rate = rate.max(times * (p.k * p.twist_mobility()).sqrt());
    }
    for &effect in on.forces() {
        let side = usize::from(effect.info().place == Place::Table);
        rate = rate.max(effect.rate(effects.of(effect), p.inertias(structure)[side]));
        if let Some(order) = effect.order(effects.of(effect)) {
            rate = rate.max(order * speed[side]);
        }
    }
    ((rate * dt / 0.25).ceil() as usize).clamp(1, 16)
}

/// Simulates the axis from `initial`, `[theta1, omega1, theta2, omega2]` in rad and rad/s, under `torque` (one value a sample, N.m).
///
/// The readings hold one entry per sample, the first of them the initial state.
#[must_use]
pub fn simulate<S: Scalar>(
    parameters: &Parameters<S>,
    structure: Structure,
    effects: &Settings<S>,
    initial: [S; 4],
    torque: &[f64],
    options: &SimulateOptions,
) -> Response<S> {
    let n = torque.len();
    let per = options.substeps.max(1);
    let h = options.dt / per as f64;
    let axis = Axis::new(*parameters, structure, *effects, options.scheme, h);
    let mut state: State<S> = axis.state(initial[0], initial[1], initial[2], initial[3], options.start);
    let mut history = TorqueHistory::default();
    let mut seen = effects.initial_readings(axis.on(), state.reading(), options.dt);
    let mut response = Response { readings: Vec::with_capacity(n), accelerations: Vec::with_capacity(n) };
    for k in 0..n {
        let sample: Ramp<S> = options.hold.ramp(torque, k);
        let mut after = state;
        for j in 0..per {
            let part = |i: usize| sample.start + (sample.end - sample.start) * (i as f64 / per as f64);
            let ramp = Ramp { start: part(j), end: part(j + 1) };
            let ramp = if axis.on().inputs().is_empty() {
                ramp
            } else {
                effects.transform_input(axis.on(), ramp, h.into(), &mut history)
            };
            let time = options.start + (k * per + j) as f64 * h;
            if j == 0 {
                response.accelerations.push(axis.accelerations(&state, ramp.start, time));
            }
            if k + 1 < n {
                after = axis.advance(&after, ramp, time);
            }
        }
        response.readings.push(if axis.on().sensors().is_empty() {
            state.reading()
        } else {
            effects.transform_sensor(axis.on(), &seen, options.dt)
        });
        state = after;
        effects.push_sensors(axis.on(), &mut seen, state.reading());
    }
    response
}
