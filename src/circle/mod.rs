//! The circular test of machine tools in simulation (ISO 230-4): two axes under position control follow a circle, and
//! the path of the table shows what an unmodelled effect does to a part.
//!
//! Each axis has the usual drive: a proportional position loop, a proportional-integral velocity loop, feed-forward of
//! velocity and acceleration, a torque limit:
//!
//! ```text
//! w* = kp*(th* - th) + fv*th*'        command of the velocity loop, rad/s
//! T  = kv*(w* - w) + ki*int(w* - w) + fa*(I1 + I2)*th*'',   |T| <= limit
//! ```
//!
//! `th*` is the circle's coordinate over the lead; th and w come from the motor's encoder or from the table's. The
//! drive computes once a sample and holds its torque; the integral stops while the torque is limited.
//! An axis is taken as identified in place: X carries Y, so X's I2 already contains Y's mass.

pub mod roundness;

use std::f64::consts::TAU;

use crate::axis::{Axis, Parameters, Scheme, State, Structure, substeps};
use crate::effects::{Ramp, SensorHistory, Settings, TorqueHistory};

/// Which encoder closes the position loop.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Feedback {
    /// The motor's: what the coupling and the screw do stays outside the loop.
    #[default]
    Motor,
    /// The table's own scale.
    Table,
}

/// A drive's position and velocity loops.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Servo {
    /// Position gain, 1/s.
    pub kp: f64,
    /// Velocity gain, N.m.s/rad.
    pub kv: f64,
    /// Integral gain of the velocity loop, N.m/rad.
    pub ki: f64,
    /// Share of the velocity fed forward.
    pub velocity_forward: f64,
    /// Share of the acceleration fed forward.
    pub acceleration_forward: f64,
    /// Torque limit, N.m.
    pub limit: f64,
    /// Which encoder closes the position loop; the velocity loop is closed at the motor.
    pub feedback: Feedback,
}

impl Servo {
    /// Loops for an axis of these parameters: velocity bandwidth `bandwidth` rad/s, position gain a quarter of it unless
    /// given, integral time four over the bandwidth, full feed-forward, no torque limit.
    #[must_use]
    pub fn tuned(p: &Parameters, bandwidth: f64, kp: Option<f64>) -> Self {
        let kv = (p.i1 + p.i2) * bandwidth;
        Self {
            kp: kp.unwrap_or(bandwidth / 4.0),
            kv,
            ki: kv * bandwidth / 4.0,
            velocity_forward: 1.0,
            acceleration_forward: 1.0,
            limit: f64::INFINITY,
            feedback: Feedback::Motor,
        }
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
    #[error("{name} is {value}: it must be finite and greater than zero")]
    NotPositive {
        /// What.
        name: &'static str,
        /// The value.
        value: f64,
    },
    /// Too few or too many samples on the circle.
    #[error(
        "one turn takes {samples} samples at dt = {dt} s; choose radius, feed and dt so that it takes {least} to {most}"
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
const LEAST: usize = 360;
const MOST: usize = 20_000_000;

/// Angle on the circle, its rate and its second derivative at time `t`: the feed is reached over half a turn.
fn schedule(rate: f64, t: f64) -> (f64, f64, f64) {
    // phi = rate*t^2/(2*ramp) until t = ramp, where phi is half a turn.
    let ramp = TAU / rate;
    if t < ramp {
        (0.5 * rate * t * t / ramp, rate * t / ramp, rate / ramp)
    } else {
        (rate * (t - 0.5 * ramp), rate, 0.0)
    }
}

/// Runs the test: the table's path over the last turn, starting on the +X side.
///
/// # Errors
/// When a number makes no sense or a loop is unstable.
pub fn run(x: &ServoAxis, y: &ServoAxis, test: &CircleTest) -> Result<Path, CircleError> {
    for (name, value) in [("radius", test.radius), ("feed", test.feed), ("dt", test.dt)] {
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
        let (phi, w, a) = schedule(rate, time);
        let (s, c) = phi.sin_cos();
        let r = test.radius;
        let goals = [
            [r * c, -r * s * w, -r * (c * w * w + s * a)],
            [sense * r * s, sense * r * c * w, sense * r * (c * a - s * w * w)],
        ];
        if k >= first {
            path.x.push(axes[0].position());
            path.y.push(axes[1].position());
        }
        for ((axis, goal), name) in axes.iter_mut().zip(goals).zip(["X", "Y"]) {
            axis.step(goal, time);
            let off = (axis.position() - goal[0]).abs();
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
    integral: f64,
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
        let seen = SensorHistory::settled(state.reading(), dt);
        Self { axis, set, state, integral: 0.0, torques: TorqueHistory::default(), seen, per, dt }
    }

    /// Where the table is, m.
    fn position(&self) -> f64 {
        self.set.parameters.rho * self.state.theta2()
    }

    /// One sample towards `goal`: position, velocity, acceleration of the table, m, m/s, m/s2.
    fn step(&mut self, goal: [f64; 3], time: f64) {
        let (p, servo) = (&self.set.parameters, &self.set.servo);
        let read = if self.axis.on().sensors().is_empty() {
            self.state.reading()
        } else {
            self.set.effects.transform_sensor(self.axis.on(), &self.seen, self.dt)
        };
        let [theta, omega, alpha] = goal.map(|g| g / p.rho);
        let position = match servo.feedback {
            Feedback::Motor => read.theta1,
            Feedback::Table => read.theta2,
        };
        let error = servo.kp * (theta - position) + servo.velocity_forward * omega - read.omega1;
        let wanted = servo.kv * error + self.integral + servo.acceleration_forward * (p.i1 + p.i2) * alpha;
        let torque = wanted.clamp(-servo.limit, servo.limit);
        if torque == wanted {
            self.integral += servo.ki * error * self.dt;
        }
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
        self.seen.push(self.state.reading());
    }
}

#[cfg(test)]
mod tests {
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
        // The motor follows its command; the table follows the motor through the coupling.
        let (p, w) = (Parameters::PAPER, TEST.feed / TEST.radius);
        let gain = p.k.hypot(p.b * w) / (p.k - p.i2 * w * w).hypot(p.b * w);
        assert!((r.mean - TEST.radius * (gain - 1.0)).abs() < 1e-9, "{r:?}");
    }

    #[test]
    fn a_position_lag_without_feed_forward_shrinks_the_circle_by_its_frequency_response() {
        let mut a = axis(Settings::default());
        a.servo.velocity_forward = 0.0;
        a.servo.acceleration_forward = 0.0;
        a.servo.ki = 0.0;
        a.structure = Structure::Rigid;
        let fast = CircleTest { feed: 0.4, dt: 2e-4, ..TEST };
        let r = Roundness::of(&run(&a, &a, &fast).expect("a path"), fast.radius).expect("a circle");
        // Rigid axis: J*s^2 + kv*s + kv*kp; the radius is the gain at the turning rate. The held torque adds half a
        // sample of delay, which this rate hardly sees.
        let (w, j) = (fast.feed / fast.radius, a.parameters.i1 + a.parameters.i2);
        let (kv, kp) = (a.servo.kv, a.servo.kp);
        let gain = kv * kp / (kv * kp - j * w * w).hypot(kv * w);
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
        let mut wild = axis(Settings::default());
        wild.servo = Servo::tuned(&wild.parameters, 1e5, None);
        let calm = axis(Settings::default());
        assert!(matches!(run(&wild, &calm, &TEST), Err(CircleError::Unstable { axis: "X", .. })));
        assert!(matches!(
            run(&calm, &calm, &CircleTest { feed: f64::NAN, ..TEST }),
            Err(CircleError::NotPositive { name: "feed", .. })
        ));
        assert!(matches!(run(&calm, &calm, &CircleTest { feed: 100.0, ..TEST }), Err(CircleError::Samples { .. })));
    }
}
