//! The drives of a table's axes, as arguments.

use std::path::Path;

use crate::axis::Parameters;
use crate::circle::{Feedback, Servo, ServoAxis};
use crate::drive::Gains;
use crate::effects::Settings;
use crate::trace::Machine;

/// The drives, and what X carries.
#[derive(Debug, Clone, Copy, clap::Args)]
#[command(next_help_heading = "Drives of an XY table")]
pub struct Drives {
    /// Sampling interval of the drives, s
    #[arg(long, default_value_t = Drives::default().dt)]
    pub dt: f64,
    /// Bandwidth of the velocity loop, rad/s, where the axis file has no `[controller]`
    #[arg(long, default_value_t = Drives::default().bandwidth)]
    pub bandwidth: f64,
    /// Position gain, 1/s; a quarter of the bandwidth without
    #[arg(long)]
    pub kp: Option<f64>,
    /// Torque limit of the drives, N.m (N)
    #[arg(long, default_value_t = Drives::default().limit)]
    pub limit: f64,
    /// Feed nothing forward
    #[arg(long)]
    pub no_forward: bool,
    /// Close the position loop with the table's scale instead of the motor's encoder
    #[arg(long)]
    pub table_scale: bool,
    /// Mass of the Y axis with its motor, kg, where X was identified without it: it is added to X
    #[arg(long, value_name = "KG", default_value_t = Drives::default().carried)]
    pub carried: f64,
}

impl Default for Drives {
    fn default() -> Self {
        Self {
            dt: 1e-3,
            bandwidth: 80.0,
            kp: None,
            limit: f64::INFINITY,
            no_forward: false,
            table_scale: false,
            carried: 0.0,
        }
    }
}

impl Drives {
    /// X and Y under control, X carrying Y.
    ///
    /// # Errors
    /// When a number makes no sense.
    pub fn axes(&self, x: &Machine, y: &Machine) -> anyhow::Result<[ServoAxis; 2]> {
        for (name, value) in [("--bandwidth", self.bandwidth), ("--dt", self.dt)] {
            anyhow::ensure!(value.is_finite() && value > 0.0, "{name} is {value}: it must be greater than zero");
        }
        anyhow::ensure!(self.limit > 0.0, "--limit is {}: it must be greater than zero", self.limit);
        anyhow::ensure!(
            self.carried.is_finite() && self.carried >= 0.0,
            "--carried is {}: it must be zero or more",
            self.carried
        );
        let axis = |machine: &Machine, carried: f64| {
            let p = machine.parameters;
            let parameters = Parameters { i2: p.i2 + carried * p.rho * p.rho, ..p };
            let forward = if self.no_forward { 0.0 } else { 1.0 };
            // The drive of the machine's file, or one tuned for it.
            let own = machine.controller.map(|c| Gains { kp: self.kp.unwrap_or(c.gains.kp), ..c.gains });
            let gains = own.unwrap_or_else(|| Servo::tuned(&parameters, self.bandwidth, self.kp).gains);
            let gains = Gains {
                velocity_forward: forward * gains.velocity_forward,
                acceleration_forward: forward * gains.acceleration_forward,
                limit: self.limit.min(gains.limit),
                ..gains
            };
            let table = self.table_scale || machine.controller.is_some_and(|c| c.table);
            let feedback = if table { Feedback::Table } else { Feedback::Motor };
            let servo = Servo { gains, feedback };
            ServoAxis { parameters, structure: machine.structure, effects: machine.effects, servo }
        };
        Ok([axis(x, self.carried), axis(y, 0.0)])
    }
}

/// The same axis without its effects.
#[must_use]
pub fn ideal(axis: ServoAxis) -> ServoAxis {
    ServoAxis { effects: Settings::default(), ..axis }
}

/// The machine of an axis file; the paper's without one.
///
/// # Errors
/// When the file cannot be used.
pub fn machine(file: Option<&Path>) -> anyhow::Result<Machine> {
    Ok(match file {
        None => Machine::default(),
        Some(file) => Machine::read(file)?,
    })
}
