//! The circular test of machine tools in simulation (ISO 230-4): two axes under position control follow a circle, and
//! the path of the table shows what an unmodelled effect does to a part.
//!
//! Each axis has the usual [`crate::drive`], at the motor's encoder or at the table's. The torque of one sample acts from
//! the next on: the time that a drive needs to compute, and what a co-simulation master makes of the two as FMUs.
//!
//! Y is stacked on X. An axis is taken as identified in place: X carries Y, so X's I2 already contains Y's mass.

pub mod measured;
pub mod roundness;
pub mod trace;

use std::f64::consts::TAU;

use crate::axis::{Axis, Parameters, Scheme, State, Structure, substeps};
use crate::drive::{Drive, Gains};
use crate::effects::{Ramp, SensorHistory, Settings, TorqueHistory};
use crate::trace::number;

/// Which encoder closes the position loop.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Feedback {
    /// The motor's: what the coupling and the screw do stays outside the loop.
    #[default]
    Motor,
    /// The table's own scale.
    Table,
}

/// A drive's gains and its encoder.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Servo {
    /// The gains.
    pub gains: Gains,
    /// Which encoder closes the position loop; the velocity loop is closed at the motor.
    pub feedback: Feedback,
}

impl Servo {
    /// The gains of [`Gains::tuned`] for an axis of these parameters, at the motor's encoder.
    #[must_use]
    pub fn tuned(p: &Parameters, bandwidth: f64, kp: Option<f64>) -> Self {
        Self { gains: Gains::tuned(p.i1 + p.i2, bandwidth, kp), feedback: Feedback::Motor }
    }
}

/// An axis under control.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ServoAxis {
    /// The axis.
    pub parameters: Parameters,
    /// One inertia or two.
    pub structure: Structure,
    /// What acts on it.
    pub effects: Settings,
    /// Its drive.
    pub servo: Servo,
}

/// The circle to follow.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CircleTest {
    /// Radius, m.
    pub radius: f64,
    /// Feed along the path, m/s.
    pub feed: f64,
    /// Direction: clockwise, else counter-clockwise.
    pub clockwise: bool,
    /// Sampling interval of the drives, s.
    pub dt: f64,
}

/// The path that was followed over one turn.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Path {
    /// Table position in X, m, about the circle's centre.
    pub x: Vec<f64>,
    /// Table position in Y, m.
    pub y: Vec<f64>,
}

/// A circular test that cannot be run.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CircleError {
    /// A number that must be positive.
    #[error("{name} is {}: it must be finite and greater than zero", number(*value))]
    NotPositive {
        /// What.
        name: &'static str,
        /// The value.
        value: f64,
    },
    /// A circle that no table draws.
    #[error("radius is {0:e} m: a circle is drawn from {least:e} to {most:e} m", least = RADII.start(), most = RADII.end())]
    Radius(f64),
    /// Too few or too many samples on the circle.
    #[error(
        "one turn takes {} samples at dt = {} s; choose radius, feed and dt so that it takes {least} to {most}",
        number(*samples),
        number(*dt)
    )]
    Samples {
        /// Samples of a turn.
        samples: f64,
        /// The interval, s.
        dt: f64,
        /// Fewest.
        least: usize,
        /// Most.
        most: usize,
    },
    /// The loop runs away.
    #[error(
        "the {axis} axis leaves the path by more than the radius after {time:.3} s: its loop is unstable; lower the bandwidth"
    )]
    Unstable {
        /// X or Y.
        axis: &'static str,
        /// When, s.
        time: f64,
    },
}

/// Turns before the one that is recorded: half a turn to reach the feed, the rest to settle.
const RUN_IN: f64 = 1.5;
/// Radii that are drawn, m: beyond them a deviation is lost in the rounding of the path, or a plot has no scale.
const RADII: std::ops::RangeInclusive<f64> = 1e-9..=1e6;
const LEAST: usize = 360;
const MOST: usize = 20_000_000;

/// Angle on the circle at time `t`: the feed is reached over half a turn.
fn schedule(rate: f64, t: f64) -> f64 {
    // phi = rate*t^2/(2*ramp) until t = ramp, where phi is half a turn.
    let ramp = TAU / rate;
    if t < ramp { 0.5 * rate * t * t / ramp } else { rate * (t - 0.5 * ramp) }
}

/// Whether a circle of this radius can be drawn.
///
/// # Errors
/// When it is none, or far from all that a table can do.
pub fn check_radius(radius: f64) -> Result<(), CircleError> {
    if !(radius.is_finite() && radius > 0.0) {
        return Err(CircleError::NotPositive { name: "radius", value: radius });
    }
    if RADII.contains(&radius) { Ok(()) } else { Err(CircleError::Radius(radius)) }
}

/// Runs the test: the table's path over the last turn, starting on the +X side.
///
/// # Errors
/// When a number makes no sense or a loop is unstable.
pub fn run(x: &ServoAxis, y: &ServoAxis, test: &CircleTest) -> Result<Path, CircleError> {
    check_radius(test.radius)?;
    for (name, value) in [("feed", test.feed), ("dt", test.dt)] {
        if !(value.is_finite() && value > 0.0) {
            return Err(CircleError::NotPositive { name, value });
        }
    }
    for (name, value) in [("rho of X", x.parameters.rho), ("rho of Y", y.parameters.rho)] {
        if !(value.is_finite() && value > 0.0) {
            return Err(CircleError::NotPositive { name, value });
        }
    }
    let rate = test.feed / test.radius;
    let samples = TAU / rate / test.dt;
    if !(LEAST as f64..=MOST as f64).contains(&samples) {
        return Err(CircleError::Samples { samples, dt: test.dt, least: LEAST, most: MOST });
    }
    let sense = if test.clockwise { -1.0 } else { 1.0 };
    let mut path = Path::default();
    // The run-in's first half turn takes the time of a whole one.
    let first = ((RUN_IN + 0.5) * samples).ceil() as usize;
    let last = first + samples.ceil() as usize;
    let mut axes = [Loop::new(x, test.radius, test.dt), Loop::new(y, 0.0, test.dt)];
    for k in 0..=last {
        let time = k as f64 * test.dt;
        let (s, c) = schedule(rate, time).sin_cos();
        let r = test.radius;
        let goals = [r * c, sense * r * s];
        if k >= first {
            path.x.push(axes[0].position());
            path.y.push(axes[1].position());
        }
        for ((axis, goal), name) in axes.iter_mut().zip(goals).zip(["X", "Y"]) {
            axis.step(goal, time);
            let off = (axis.position() - goal).abs();
            if off.is_nan() || off > r {
                return Err(CircleError::Unstable { axis: name, time });
            }
        }
    }
    Ok(path)
}

/// One axis in its loop.
struct Loop<'a> {
    axis: Axis,
    set: &'a ServoAxis,
    state: State,
    drive: Drive,
    torque: f64,
    torques: TorqueHistory<f64>,
    seen: SensorHistory<f64>,
    per: usize,
    dt: f64,
}

impl<'a> Loop<'a> {
    fn new(set: &'a ServoAxis, at: f64, dt: f64) -> Self {
        let p = &set.parameters;
        let per = substeps(p, set.structure, &set.effects, dt);
        let axis = Axis::new(*p, set.structure, set.effects, Scheme::Exact, dt / per as f64);
        let theta = at / p.rho;
        let state = axis.state(theta, 0.0, theta, 0.0, 0.0);
        let seen = set.effects.initial_readings(axis.on(), state.reading(), dt);
        Self {
            axis,
            set,
            state,
            drive: Drive::default(),
            torque: 0.0,
            torques: TorqueHistory::default(),
            seen,
            per,
            dt,
        }
    }

    /// Where the table is, m.
    fn position(&self) -> f64 {
        self.set.parameters.rho * self.state.theta2()
    }

    /// One sample towards `goal`, m.
    fn step(&mut self, goal: f64, time: f64) {
        let servo = &self.set.servo;
        let read = if self.axis.on().sensors().is_empty() {
            self.state.reading()
        } else {
            self.set.effects.transform_sensor(self.axis.on(), &self.seen, self.dt)
        };
        let position = match servo.feedback {
            Feedback::Motor => read.theta1,
            Feedback::Table => read.theta2,
        };
        let torque = self.torque;
        self.torque = self.drive.sample(&servo.gains, goal / self.set.parameters.rho, position, read.omega1, self.dt);
        let h = self.dt / self.per as f64;
        for j in 0..self.per {
            let held = Ramp { start: torque, end: torque };
            let ramp = if self.axis.on().inputs().is_empty() {
                held
            } else {
                self.set.effects.transform_input(self.axis.on(), held, h, &mut self.torques)
            };
            self.state = self.axis.advance(&self.state, ramp, time + j as f64 * h);
        }
        self.set.effects.push_sensors(self.axis.on(), &mut self.seen, self.state.reading());
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Complex;

    use super::roundness::Roundness;
    use super::*;
    use crate::effects::Effect;

    const TEST: CircleTest = CircleTest { radius: 0.05, feed: 0.02, clockwise: false, dt: 1e-3 };

    fn axis(effects: Settings) -> ServoAxis {
        let parameters = Parameters::PAPER;
        ServoAxis {
            parameters,
            structure: Structure::TwoInertia,
            effects,
            servo: Servo::tuned(&parameters, 80.0, None),
        }
    }

    fn with(effect: Effect, value: f64) -> Settings {
        let mut s = Settings::default();
        s.of_mut(effect)[0] = value;
        s
    }

    #[test]
    fn two_equal_ideal_axes_draw_the_circle() {
        let path = run(&axis(Settings::default()), &axis(Settings::default()), &TEST).expect("a path");
        let r = Roundness::of(&path, TEST.radius).expect("a circle");
        assert!(r.deviation < 1e-7, "{r:?}");
        // The radius is the gain of the loop at the turning rate: the drive's differences and sums over its samples, the
        // sample in which it computes and half of the one over which it holds, the motor, and the table behind it.
        type C = Complex<f64>;
        let (p, g) = (Parameters::PAPER, axis(Settings::default()).servo.gains);
        let s = C::new(0.0, TEST.feed / TEST.radius);
        let late = |samples: f64| (-s * samples * TEST.dt).exp();
        let difference = (1.0 - late(1.0)) / TEST.dt;
        let speed_loop = g.kv + g.ki * TEST.dt * late(1.0) / (1.0 - late(1.0));
        let (table, coupling) = (s * s * p.i2 + s * p.b + p.k, s * p.b + p.k);
        let motor = table / (s * s * (table * p.i1 + coupling * p.i2));
        let command = speed_loop * (g.kp + difference) + g.inertia * difference * difference;
        let open = late(1.5) * motor;
        let gain = (open * command / (1.0 + open * speed_loop * (g.kp + s)) * coupling / table).norm();
        assert!((r.mean - TEST.radius * (gain - 1.0)).abs() < 1e-9, "{r:?} {gain}");
    }

    #[test]
    fn a_position_lag_without_feed_forward_shrinks_the_circle_by_its_frequency_response() {
        let mut a = axis(Settings::default());
        a.servo.gains.velocity_forward = 0.0;
        a.servo.gains.acceleration_forward = 0.0;
        a.servo.gains.ki = 0.0;
        a.structure = Structure::Rigid;
        let fast = CircleTest { feed: 0.4, dt: 2e-4, ..TEST };
        let r = Roundness::of(&run(&a, &a, &fast).expect("a path"), fast.radius).expect("a circle");
        // Rigid axis: J*s^2 + (kv*s + kv*kp)*exp(-s*d); the radius is the gain at the turning rate, and the delay d is the
        // sample in which the drive computes and half of the one over which it holds.
        let (w, j) = (fast.feed / fast.radius, a.parameters.i1 + a.parameters.i2);
        let (kv, kp, late) = (a.servo.gains.kv, a.servo.gains.kp, 1.5 * fast.dt * fast.feed / fast.radius);
        let (s, c) = late.sin_cos();
        let gain = kv * kp / (kv * kp * c + kv * w * s - j * w * w).hypot(kv * w * c - kv * kp * s);
        let expected = fast.radius * (gain - 1.0);
        assert!((r.mean - expected).abs() < 0.02 * expected.abs(), "{} against {expected}", r.mean);
    }

    #[test]
    fn friction_makes_peaks_at_the_reversals_and_nowhere_else() {
        let rough = axis(with(Effect::CoulombMotor, 4e-3));
        let smooth = axis(Settings::default());
        let path = run(&rough, &smooth, &TEST).expect("a path");
        let r = Roundness::of(&path, TEST.radius).expect("a circle");
        // X reverses where the path crosses the X axis: +X and -X.
        let [plus_x, plus_y, minus_x, minus_y] = r.reversals;
        assert!(plus_x > 1e-6 && minus_x > 1e-6, "{r:?}");
        assert!(plus_y.abs() < 0.1 * plus_x && minus_y.abs() < 0.1 * plus_x, "{r:?}");
    }

    #[test]
    fn backlash_behind_the_motor_encoder_steps_by_its_play_at_each_reversal() {
        let half_gap = 0.02;
        let loose = axis(with(Effect::Backlash, half_gap));
        // A guide with friction keeps the table on one side of the play.
        let friction = 2e-4;
        let mut effects = loose.effects;
        effects.of_mut(Effect::CoulombTable)[0] = friction;
        let loose = ServoAxis { effects, ..loose };
        let path = run(&loose, &axis(Settings::default()), &TEST).expect("a path");
        let play = 2.0 * half_gap * Parameters::PAPER.rho;
        // The table stays behind by half the play on either side: moving towards -X it lies at +play/2.
        let offset = |above: bool| {
            let mut sum = (0.0, 0.0);
            for (x, y) in path.x.iter().zip(&path.y).filter(|(x, y)| x.abs() < 5e-3 && (**y > 0.0) == above) {
                let ideal = x.signum() * (TEST.radius * TEST.radius - y * y).max(0.0).sqrt();
                sum = (sum.0 + x - ideal, sum.1 + 1.0);
            }
            sum.0 / sum.1
        };
        // Counter-clockwise: above, X moves towards -X; below, towards +X.
        let step = offset(true) - offset(false);
        let friction_windup = 2.0 * friction / Parameters::PAPER.k * Parameters::PAPER.rho;
        assert!((step - play - friction_windup).abs() < 0.1 * play, "{step} against {play}");
    }

    #[test]
    fn an_unstable_loop_and_senseless_numbers_are_refused() {
        let mut unstable_axis = axis(Settings::default());
        unstable_axis.servo = Servo::tuned(&unstable_axis.parameters, 1e5, None);
        let stable_axis = axis(Settings::default());
        assert!(matches!(run(&unstable_axis, &stable_axis, &TEST), Err(CircleError::Unstable { axis: "X", .. })));
        assert!(matches!(
            run(&stable_axis, &stable_axis, &CircleTest { feed: f64::NAN, ..TEST }),
            Err(CircleError::NotPositive { name: "feed", .. })
        ));
        assert!(matches!(
            run(&stable_axis, &stable_axis, &CircleTest { feed: 100.0, ..TEST }),
            Err(CircleError::Samples { .. })
        ));
    }
}
