//! The torque that a model lacks to follow a record: its simulation, held to the measured motion by a feedback.
//!
//! At every sample the model's reading is compared with the measured one and each measured inertia gets the impulse
//! `d*dt`, `d = I*(g1*e + g2*(e - e_before))/dt^2`, `e = measured - read`. What the model lacks in all is then
//!
//! ```text
//! r_i(k) = d_i(k) + (D e)_i(k),   D = [[I1 s^2 + B s + K, -(B s + K)], [-(B s + K), I2 s^2 + B s + K]]
//! ```
//!
//! with central differences for `s` and `s^2`: exact for the linear axis whatever the feedback's bandwidth, because an impulse at a
//! sample is one in the second difference there. Where encoders are read late by `S` it is `r = d + D S^-1 e`, and where both are behind
//! one filter `r = S d + D e`: what the feedback pushed shows late, too. A side that is not measured goes along with the other
//! ([`super::hidden`]). The bandwidth only says along which motion the effects act: the model's own (low: output error) or the measured one
//! (high: inverse dynamics). It follows from the ratio of discrepancy and noise, as the gain of a Kalman filter does.

use super::arriving::Arriving;
use super::hidden::Hidden;
use super::model::Model;
use super::trajectory::Trajectory;
use crate::axis::{Axis, Scheme, Structure, substeps_at_speed};
use crate::conditioning::Record;
use crate::effects::Memory;

/// Torques at motor and table, N.m, one a sample each.
pub type Torques = [Vec<f64>; 2];

/// What the model lacks, and the motion it was lacking it along.
#[derive(Debug, Clone)]
pub struct Tracked {
    /// Residual torque at motor and table, N.m; the second is zero on a rigid axis.
    pub torque: Torques,
    /// Motion of the model: `[theta1, omega1, theta2, omega2]`.
    pub motion: Vec<[f64; 4]>,
}

impl Tracked {
    /// Of a model that could not be run.
    #[must_use]
    pub fn nothing(n: usize) -> Self {
        Self { torque: [vec![0.0; n], vec![0.0; n]], motion: vec![[0.0; 4]; n] }
    }

    /// Whether the squares of what is lacking are numbers.
    #[must_use]
    pub fn is_bounded(&self) -> bool {
        self.torque.iter().flatten().all(|t| t.abs() < LARGEST)
    }
}

/// Bandwidth of the feedback on each side, rad/s.
pub type Bandwidth = [f64; 2];

/// Largest torque and error that are told.
pub const LARGEST: f64 = 1e100;
/// Bandwidth times time with which the feedback starts: that of the straight line through all samples so far.
const GROWING: f64 = 2.5;
/// Damping ratio of the feedback.
const DAMPING: f64 = 0.7;

/// How finely effects are stepped.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Resolution {
    /// As the axis itself asks.
    Full,
    /// A quarter of that many steps, whatever the torque does within one: what a look needs that only ranks.
    Coarse,
}

/// Steps of [`Resolution::Full`] in one of [`Resolution::Coarse`]: the fastest motion then turns by one radian a step.
const COARSER: usize = 4;

/// Steps a sample: as many as effects and torque need.
#[must_use]
pub fn steps_per_sample(model: &Model, record: &Record) -> usize {
    steps_per_sample_at(model, record, record.speeds(), Resolution::Full)
}

/// The same at a resolution, where the record's speeds, rad/s, are known.
pub fn steps_per_sample_at(model: &Model, record: &Record, speeds: [f64; 2], resolution: Resolution) -> usize {
    let full = substeps_at_speed(&model.parameters, model.structure, &model.effects, record.dt, speeds);
    match resolution {
        Resolution::Full => full.next_multiple_of(record.instants()),
        Resolution::Coarse => full.div_ceil(COARSER),
    }
}

/// Simulates the model held to the record, in so many steps a sample ([`steps_per_sample`]); `None` when it leaves the finite numbers.
#[must_use]
pub fn track(model: &Model, record: &Record, bandwidth: Bandwidth, per: usize) -> Option<Tracked> {
    let held = Held { model, record, bandwidth, per };
    Some(held.track(&[], None)?.0)
}

/// The same with the motion step by step.
#[must_use]
pub fn track_step_by_step(
    model: &Model,
    record: &Record,
    bandwidth: Bandwidth,
    per: usize,
) -> Option<(Tracked, Trajectory)> {
    let held = Held { model, record, bandwidth, per };
    let mut trajectory = Trajectory::new(record, per);
    let (tracked, _) = held.track(&[], Some(&mut trajectory))?;
    Some((tracked, trajectory))
}

/// A model held to a record.
struct Held<'a> {
    model: &'a Model,
    record: &'a Record,
    bandwidth: Bandwidth,
    /// Steps a sample.
    per: usize,
}

impl Held<'_> {
    /// The torque that it lacks, with the effects' internal states at some samples, in order; its steps are added to a trajectory.
    fn track(&self, kept: &[usize], mut trajectory: Option<&mut Trajectory>) -> Option<(Tracked, Vec<Memory<f64>>)> {
        let &Self { model, record, bandwidth, per } = self;
        // What a log holds early is followed with the torque to come.
        let (model, ahead) = &model.on_time();
        let mut memories = Vec::with_capacity(kept.len());
        let n = record.len();
        if n == 0 {
            return None;
        }
        let dt = record.dt;
        let rigid = model.structure == Structure::Rigid;
        let h = dt / per as f64;
        let axis = Axis::new(model.parameters, model.structure, model.effects, Scheme::Exact, h);
        let p = &model.parameters;
        let inertia = if rigid { [p.i1 + p.i2, 0.0] } else { [p.i1, p.i2] };
        let position = [record.channels[0].as_deref(), record.channels[2].as_deref()];
        // A logged speed is mostly the position's difference, late: it adds nothing where the position itself is there.
        let speed = [record.channels[1].as_deref(), record.channels[3].as_deref()];
        let sides = measured_sides(record);
        // From a state that is little known the gain falls, as a Kalman filter's does, to what the bandwidth asks.
        let gains_at = |k: usize| {
            bandwidth.map(|w| {
                let x = (w * dt).max(GROWING / (k + 1) as f64).min(0.6);
                [x * x, 2.0 * DAMPING * x]
            })
        };
        let first = initial(record);
        let mut state = axis.resume(first, &model.memory, record.start + ahead);
        let mut arriving = Arriving::new(model, record, per, *ahead, 0);
        let sensed = !axis.on().sensors().is_empty();
        let mut history = sensed.then(|| model.effects.initial_readings(axis.on(), state.reading(), dt));
        let mut error = [vec![0.0; n], vec![0.0; n]];
        let mut given = [vec![0.0; n], vec![0.0; n]];
        let mut motion = Vec::with_capacity(n);
        let mut before = [f64::NAN; 2];
        for k in 0..n {
            let time = record.time(k) + ahead;
            let reading = match &history {
                Some(history) => model.effects.transform_sensor(axis.on(), history, dt),
                None => state.reading(),
            };
            let own = [[reading.theta1, reading.omega1], [reading.theta2, reading.omega2]];
            let now = state.reading();
            if kept.get(memories.len()) == Some(&k) {
                memories.push(*state.memory());
            }
            motion.push([now.theta1, now.omega1, now.theta2, now.omega2]);
            let mut push = [0.0; 2];
            let gains = gains_at(k);
            for &i in &sides {
                let [g1, g2] = gains[i];
                let d = match (position[i], speed[i]) {
                    (Some(y), _) => {
                        let e = y[k] - own[i][0];
                        let rate = if before[i].is_nan() { 0.0 } else { e - before[i] };
                        before[i] = e;
                        error[i][k] = e;
                        g1 * e + g2 * rate
                    }
                    (None, Some(v)) => {
                        let e = v[k] - own[i][1];
                        error[i][k] = if k == 0 { 0.0 } else { error[i][k - 1] + before[i] * dt };
                        before[i] = e;
                        0.5 * g2 * e * dt
                    }
                    (None, None) => 0.0,
                };
                push[i] = inertia[i] * d / (dt * dt);
            }
            if push != [0.0; 2] {
                push = axis.kick(&mut state, push.map(|d| d * dt), dt, time).map(|j| j / dt);
            }
            given[0][k] = push[0];
            given[1][k] = push[1];
            if k + 1 == n {
                break;
            }
            for j in 0..per {
                let begin = time + j as f64 * h;
                let next = axis.advance(&state, arriving.over(k, j), begin);
                if let Some(trajectory) = &mut trajectory {
                    trajectory.push(&axis, [&state, &next], begin + h);
                }
                state = next;
            }
            if let Some(history) = &mut history {
                model.effects.push_sensors(axis.on(), history, state.reading());
            }
            if !state.theta1().is_finite() || !state.omega2().is_finite() || state.omega1().abs() > 1e12 {
                return None;
            }
        }
        // An encoder that is read late, or behind a filter, shows the feedback's torque so, too.
        let mut torque = given.map(|given| filtered(given, model.effects.filter(axis.on()), dt));
        let late = model.effects.late(axis.on());
        let [motor, table] = error;
        let late_table = late + model.effects.late_of_table(axis.on());
        let error = [advanced(motor, late / dt), advanced(table, late_table / dt)];
        add_linear(model, record, &error, &mut torque);
        // Squares of what is larger than this are no numbers.
        let bounded = torque.iter().chain(&error).flatten().all(|v| v.abs() < LARGEST);
        bounded.then_some((Tracked { torque, motion }, memories))
    }
}

/// Torques that push a mass at each sample, as an encoder behind a filter of first order shows them in its second difference: a push at a
/// sample moves the reading by `t - time (1 - exp(-t/time))`.
fn filtered(mut torque: Vec<f64>, time: f64, dt: f64) -> Vec<f64> {
    if time <= 0.0 {
        return torque;
    }
    let (decay, samples) = ((-dt / time).exp(), time / dt);
    let (at_once, next) = (1.0 - samples * (1.0 - decay), samples * (1.0 - decay).powi(2));
    let mut after = 0.0;
    for torque in &mut torque {
        let push = *torque;
        *torque = at_once * push + after;
        after = decay * after + next * push;
    }
    torque
}

/// A series so many samples ahead, by Lagrange's interpolation of four.
fn advanced(series: Vec<f64>, by: f64) -> Vec<f64> {
    if by <= 0.0 {
        return series;
    }
    let (whole, x) = (by.floor() as usize, by.fract());
    let weights = [
        -x * (x - 1.0) * (x - 2.0) / 6.0,
        (x + 1.0) * (x - 1.0) * (x - 2.0) / 2.0,
        -(x + 1.0) * x * (x - 2.0) / 2.0,
        (x + 1.0) * x * (x - 1.0) / 6.0,
    ];
    let last = series.len().saturating_sub(1);
    let at = |k: usize| {
        weights.iter().enumerate().map(|(i, w)| w * series[(k + whole + i).saturating_sub(1).min(last)]).sum()
    };
    (0..series.len()).map(at).collect()
}

/// Sides of an axis whose motion a record has.
fn measured_sides(record: &Record) -> Vec<usize> {
    (0..2).filter(|&i| record.channels[2 * i].is_some() || record.channels[2 * i + 1].is_some()).collect()
}

/// Positions of both sides as measured, rad, by the speed's sum where that alone is; zero of a side that is not measured.
pub fn measured_positions(record: &Record) -> Torques {
    [0, 1].map(|i: usize| match (&record.channels[2 * i], &record.channels[2 * i + 1]) {
        (Some(position), _) => position.clone(),
        (None, Some(speed)) => {
            let sum = |at: &mut f64, v: &f64| Some(std::mem::replace(at, *at + v * record.dt));
            speed.iter().scan(0.0, sum).collect()
        }
        (None, None) => vec![0.0; record.len()],
    })
}

/// Adds `D e` of positions `e` to torques on motor and table, N.m: along the sides that are measured, what follows them without an
/// encoder goes along.
pub fn add_linear(model: &Model, record: &Record, e: &Torques, torque: &mut Torques) {
    let (n, dt) = (record.len(), record.dt);
    let p = &model.parameters;
    let coupled = model.structure == Structure::TwoInertia;
    let inertia = if coupled { [p.i1, p.i2] } else { [p.i1 + p.i2, 0.0] };
    let sides = measured_sides(record);
    for k in 1..n.saturating_sub(1) {
        let second = |e: &[f64]| (e[k + 1] - 2.0 * e[k] + e[k - 1]) / (dt * dt);
        let first = |e: &[f64]| (e[k + 1] - e[k - 1]) / (2.0 * dt);
        for &i in &sides {
            torque[i][k] += inertia[i] * second(&e[i]);
        }
        if coupled && sides.len() == 2 {
            let pull = p.b * (first(&e[0]) - first(&e[1])) + p.k * (e[0][k] - e[1][k]);
            torque[0][k] += pull;
            torque[1][k] -= pull;
        }
    }
    for hidden in Hidden::of(model, &sides) {
        for (torque, pull) in torque[hidden.side].iter_mut().zip(hidden.pull(&e[hidden.side], dt)) {
            *torque += pull;
        }
    }
}

/// The state at the first sample: positions as measured, speeds from the first samples; a side that is not measured moves with the other.
fn initial(record: &Record) -> [f64; 4] {
    let side = |i: usize| -> Option<[f64; 2]> {
        match &record.channels[2 * i] {
            Some(y) => {
                let m = y.len().min(6);
                let mean = (m as f64 - 1.0) / 2.0;
                let (mut a, mut b) = (0.0, 0.0);
                for (j, v) in y[..m].iter().enumerate() {
                    a += (j as f64 - mean) * (v - y[0]);
                    b += (j as f64 - mean).powi(2);
                }
                Some([y[0], if b > 0.0 { a / b / record.dt } else { 0.0 }])
            }
            None => record.channels[2 * i + 1].as_ref().map(|v| [0.0, v[0]]),
        }
    };
    let (motor, table) = (side(0), side(1));
    let [a, b] = [motor.or(table), table.or(motor)].map(|s| s.unwrap_or_default());
    [a[0], a[1], b[0], b[1]]
}

/// A state along a tracked motion, to run on from freely.
#[derive(Debug, Clone)]
pub struct FreeRun {
    /// `[theta1, omega1, theta2, omega2]`.
    pub motion: [f64; 4],
    memory: Memory<f64>,
    /// Steps a sample.
    per: usize,
}

/// Bandwidth of the feedback that finds the states at which runs start, as a share of the sampling rate.
const STARTING: f64 = 0.1;

/// States of a model held to the record, at some samples.
#[must_use]
pub fn start_states(model: &Model, record: &Record, samples: &[usize]) -> Vec<FreeRun> {
    let per = steps_per_sample(model, record);
    // Nothing after the last of them is asked.
    let needed = samples.iter().max().map_or(0, |last| last + WARM).min(record.len());
    let record = &record.part(0..needed);
    let held = Held { model, record, bandwidth: [STARTING / record.dt; 2], per };
    match held.track(samples, None) {
        Some((t, memories)) => {
            samples.iter().zip(memories).map(|(&k, memory)| FreeRun { motion: t.motion[k], memory, per }).collect()
        }
        None => {
            let motion = initial(record);
            samples.iter().map(|_| FreeRun { motion, memory: [0.0; crate::effects::MEMORY], per }).collect()
        }
    }
}

impl FreeRun {
    /// What the encoders read over a range of the record, from these positions and speeds at its first sample.
    #[must_use]
    pub fn from(
        &self,
        model: &Model,
        record: &Record,
        range: &std::ops::Range<usize>,
        motion: [f64; 4],
    ) -> Vec<[f64; 4]> {
        let (model, ahead) = &model.on_time();
        let per = self.per;
        let h = record.dt / per as f64;
        let axis = Axis::new(model.parameters, model.structure, model.effects, Scheme::Exact, h);
        let mut state = axis.resume(motion, &self.memory, record.time(range.start) + ahead);
        // What the torque's way in remembers comes from the samples before.
        let warm = range.start.saturating_sub(WARM);
        let mut arriving = Arriving::new(model, record, per, *ahead, warm);
        for k in warm..range.start {
            for j in 0..per {
                arriving.over(k, j);
            }
        }
        let sensed = !axis.on().sensors().is_empty();
        let mut history = sensed.then(|| model.effects.initial_readings(axis.on(), state.reading(), record.dt));
        let mut out = Vec::with_capacity(range.len());
        for k in range.clone() {
            let r = match &history {
                Some(history) => model.effects.transform_sensor(axis.on(), history, record.dt),
                None => state.reading(),
            };
            out.push([r.theta1, r.omega1, r.theta2, r.omega2]);
            for j in 0..per {
                state = axis.advance(&state, arriving.over(k, j), record.time(k) + ahead + j as f64 * h);
            }
            if let Some(history) = &mut history {
                model.effects.push_sensors(axis.on(), history, state.reading());
            }
        }
        out
    }
}

/// Samples before a run that the torque's way in is filled with.
const WARM: usize = 64;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pushes_of_a_mass_show_in_the_second_difference_of_a_filtered_reading_as_they_are_filtered() {
        let (time, dt) = (0.7, 0.3);
        let pushes: Vec<f64> = (0..40).map(|k| (1.7 * f64::from(k)).sin()).collect();
        // Of a mass that the pushes move from sample to sample on straight lines, behind the filter, exactly.
        let decay = f64::exp(-dt / time);
        let (mut position, mut speed, mut reading) = (0.0, 0.0, 0.0);
        let mut readings = vec![0.0; 2];
        for push in &pushes {
            speed += push * dt;
            reading = decay * reading + (1.0 - decay) * position + speed * (dt - time * (1.0 - decay));
            position += speed * dt;
            readings.push(reading);
        }
        for (k, shown) in filtered(pushes, time, dt).into_iter().enumerate() {
            let second = (readings[k + 2] - 2.0 * readings[k + 1] + readings[k]) / (dt * dt);
            assert!((shown - second).abs() < 1e-12, "{k}: {shown} {second}");
        }
    }

    #[test]
    fn a_cubic_is_advanced_exactly_and_the_last_value_stays() {
        let cubic = |t: f64| 0.3 * t * t * t - t * t + 2.0;
        let series: Vec<f64> = (0..20).map(|k| cubic(f64::from(k))).collect();
        let ahead = advanced(series.clone(), 2.3);
        for (k, told) in ahead.iter().enumerate().take(15) {
            assert!((told - cubic(k as f64 + 2.3)).abs() < 1e-9, "{k}");
        }
        assert!((ahead[19] - series[19]).abs() < 1e-9);
        assert_eq!(advanced(series.clone(), 0.0), series);
    }
}
