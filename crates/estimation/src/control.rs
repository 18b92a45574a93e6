//! The loop around a model: the drive that made a record moves the model along the record's own reference.
//!
//! In a closed loop the position follows its reference whatever the model, so the position's error says little; the
//! command that the drive needs for it says what the model leaves out. This looks at a record from the other side than
//! free-running windows do: nothing but the reference is given to the model, and no initial state is fitted.

use crate::axis::{Axis, Scheme, substeps};
use crate::conditioning::Record;
use crate::effects::{Ramp, Reading, TorqueHistory};
use crate::hypothesis::model::Model;
use crate::trace::Controller;

/// A record under control.
#[derive(Debug, Clone, Copy)]
pub struct UnderControl<'a> {
    /// The record; its torque is what acts on the motor.
    pub record: &'a Record,
    /// The reference, rad, one value a sample.
    pub reference: &'a [f64],
    /// The drive's command, N.m, one value a sample.
    pub command: &'a [f64],
    /// The drive.
    pub controller: &'a Controller,
}

/// Errors of one model in the loop, rms over rms of the signal; the signal's mean is taken out of both.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoopErrors {
    /// Of the drive's command.
    pub command: f64,
    /// Of the position that the drive controls.
    pub position: f64,
}

/// One sample of a model in the loop.
#[derive(Debug, Clone, Copy)]
pub struct Sample {
    /// What the drive has computed, N.m.
    pub command: f64,
    /// What acts until the next sample, N.m.
    pub torque: f64,
    /// What the encoders read.
    pub reading: Reading<f64>,
}

impl UnderControl<'_> {
    /// Which channel the drive controls: theta1 or theta2.
    fn channel(&self) -> usize {
        if self.controller.table { 2 } else { 0 }
    }

    /// Command and position of a model in the loop, one value a sample.
    #[must_use]
    pub fn run(&self, model: &Model) -> (Vec<f64>, Vec<f64>) {
        let (mut commands, mut positions) = (Vec::new(), Vec::new());
        self.steps(model, |_, at| {
            commands.push(at.command);
            positions.push(if self.controller.table { at.reading.theta2 } else { at.reading.theta1 });
        });
        (commands, positions)
    }

    /// Runs a model in the loop, from the first measured position (the reference's, where none is), and shows every sample.
    pub fn steps(&self, model: &Model, mut visit: impl FnMut(usize, &Sample)) {
        let (record, dt) = (self.record, self.record.dt);
        let per = substeps(&model.parameters, model.structure, &model.effects, dt);
        let h = dt / per as f64;
        let axis = Axis::new(model.parameters, model.structure, model.effects, Scheme::Exact, h);
        let (on, effects) = (axis.on(), &model.effects);
        let [theta, omega] = self.start();
        let mut state = axis.state(theta, omega, theta, omega, record.start);
        let mut seen = effects.initial_readings(on, state.reading(), dt);
        let mut torques = TorqueHistory::default();
        let mut drive = crate::drive::Drive::default();
        let mut before = theta - omega * dt;
        let mut sent = [self.command.first().copied().unwrap_or_default(); Controller::MOST_DELAY + 1];
        for (k, &reference) in self.reference.iter().enumerate() {
            let reading =
                if on.sensors().is_empty() { state.reading() } else { effects.transform_sensor(on, &seen, dt) };
            let position = if self.controller.table { reading.theta2 } else { reading.theta1 };
            let speed = if self.controller.measured_speed { reading.omega1 } else { (position - before) / dt };
            before = position;
            sent.rotate_right(1);
            sent[0] = drive.sample(&self.controller.gains, reference, position, speed, dt);
            let torque = sent[self.controller.delay.min(Controller::MOST_DELAY)];
            visit(k, &Sample { command: sent[0], torque, reading });
            for j in 0..per {
                let held = Ramp { start: torque, end: torque };
                let ramp =
                    if on.inputs().is_empty() { held } else { effects.transform_input(on, held, h, &mut torques) };
                state = axis.advance(&state, ramp, record.time(k) + j as f64 * h);
            }
            effects.push_sensors(on, &mut seen, state.reading());
        }
    }

    /// Position and speed at the first sample, as measured.
    fn start(&self) -> [f64; 2] {
        let Some(measured) = &self.record.channels[self.channel()] else {
            return [self.reference.first().copied().unwrap_or_default(), 0.0];
        };
        match measured[..] {
            [] => [0.0, 0.0],
            [only] => [only, 0.0],
            [first, second, ..] => [first, (second - first) / self.record.dt],
        }
    }

    /// Errors of a model in the loop; infinite where the loop runs away.
    #[must_use]
    pub fn errors(&self, model: &Model) -> LoopErrors {
        let (commands, positions) = self.run(model);
        self.errors_of(&commands, &positions)
    }

    /// Errors of a run, its command and position one value a sample.
    #[must_use]
    pub fn errors_of(&self, commands: &[f64], positions: &[f64]) -> LoopErrors {
        let position =
            self.record.channels[self.channel()].as_ref().map_or(f64::NAN, |measured| relative(positions, measured));
        LoopErrors { command: relative(commands, self.command), position }
    }
}

/// rms of the difference over rms of the signal about its mean.
fn relative(own: &[f64], measured: &[f64]) -> f64 {
    let n = measured.len() as f64;
    let mean = measured.iter().sum::<f64>() / n;
    let squares = |f: &dyn Fn(usize) -> f64| (0..measured.len()).map(|k| f(k).powi(2)).sum::<f64>();
    let error = (squares(&|k| own[k] - measured[k]) / squares(&|k| measured[k] - mean)).sqrt();
    if error.is_finite() { error } else { f64::INFINITY }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::axis::{Hold, Parameters, Structure};
    use crate::drive::Gains;
    use crate::effects::{Effect, Settings};

    fn model(effects: Settings) -> Model {
        Model::new(Parameters::PAPER, Structure::TwoInertia, effects)
    }

    #[test]
    fn a_model_in_the_loop_that_made_the_record_repeats_it_and_one_without_its_friction_does_not() {
        let dt = 1e-3;
        let reference: Vec<f64> = (0..3000).map(|k| 2.0 * (1.0 - (0.004 * f64::from(k)).cos())).collect();
        let mut effects = Settings::default();
        effects.of_mut(Effect::CoulombMotor)[0] = 4e-3;
        let gains = Gains { limit: 0.1, ..Gains::tuned(2.43e-4, 80.0, None) };
        for (delay, measured_speed, table) in [(0, false, false), (1, true, false), (2, false, false), (1, true, true)]
        {
            let gains = if table { Gains { kp: 4.0, ..gains } } else { gains };
            let controller = Controller { gains, delay, measured_speed, table };
            let silent = |n: usize| vec![0.0; n];
            let channels = [Some(silent(3000)), None, Some(silent(3000)), None];
            let mut record = Record { noise: [1e-9; 4], ..Record::new(dt, Hold::Zoh, silent(3000), channels) };
            let nothing = silent(3000);
            let made =
                UnderControl { record: &record, reference: &reference, command: &nothing, controller: &controller };
            let (command, position) = made.run(&model(effects));
            record.channels[if table { 2 } else { 0 }] = Some(position);
            let seen =
                UnderControl { record: &record, reference: &reference, command: &command, controller: &controller };
            let right = seen.errors(&model(effects));
            let wrong = seen.errors(&model(Settings::default()));
            assert!(right.command < 1e-9 && right.position < 1e-9, "{delay} {right:?}");
            assert!(wrong.command > 0.1 && wrong.position < 0.1 * wrong.command, "{delay} {wrong:?}");
        }
    }
}
