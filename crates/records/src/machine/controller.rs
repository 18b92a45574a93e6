//! `[controller]` of an axis file: the drive that a log was made under.
//!
//! ```toml
//! [controller]
//! reference = "q_ref_m"        # column of the reference: the angle (or position) that the drive follows
//! command = "u_V"              # column of the command, where T is something else; scale, offset, unit as in [signals]
//! kp = 160.18                  # 1/s
//! kv = 0.02                    # N.m.s/rad (N.s/m): in the units of T
//! ki = 0.0                     # N.m/rad
//! velocity_forward = 0.0       # shares
//! acceleration_forward = 0.0
//! inertia = 2.4e-4             # that the acceleration is fed forward with; the axis' own without
//! limit = 0.5                  # N.m
//! delay = 1                    # samples from a command as logged to its torque
//! feedback = "motor"           # or "table"
//! speed = "measured"           # or "difference" of the position; measured where [signals] has omega1
//! ```

use super::super::signal::Signal;
use super::reader::{Reader, Section};
use super::{MachineError, column};
use crate::Mapping;
use crate::drive::Gains;

/// The drive that a log was made under.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Controller {
    /// Its gains, in the units of the axis.
    pub gains: Gains,
    /// Samples from a command as logged to its torque.
    pub delay: usize,
    /// Position from the table's encoder instead of the motor's.
    pub table: bool,
    /// Speed as measured instead of as a difference of positions.
    pub measured_speed: bool,
}

impl Controller {
    /// Longest delay, samples.
    pub const MOST_DELAY: usize = 16;
}

const NUMBERS: [&str; 7] = ["kp", "kv", "ki", "velocity_forward", "acceleration_forward", "inertia", "limit"];

/// Reads the section; its columns go into the mapping.
///
/// # Errors
/// When a key is unknown, or a value not of its type or out of its range.
pub(super) fn controller(
    reader: &Reader,
    section: &Section,
    inertia: f64,
    mapping: &mut Mapping,
) -> Result<Controller, MachineError> {
    let mut allowed = vec!["reference", "command", "delay", "feedback", "speed"];
    allowed.extend(NUMBERS);
    reader.only(section, &allowed, "[controller]")?;
    for (name, signal) in [("reference", Signal::Reference), ("command", Signal::Command)] {
        match section.get(name) {
            Some(value) => {
                let (of, _) = column(reader, name, value, section.line(name), false)?;
                mapping.signals.retain(|(s, _)| *s != signal);
                mapping.signals.push((signal, of));
            }
            None if signal == Signal::Reference && !mapping.signals.iter().any(|(s, _)| *s == signal) => {
                return Err(reader
                    .error(section.own_line, "[controller] names no column of the reference: reference = \"...\""));
            }
            None => {}
        }
    }
    mapping.signals.sort_by_key(|(signal, _)| *signal);
    let number = |name: &str, or: Option<f64>| -> Result<f64, MachineError> {
        let value = match section.get(name) {
            Some(value) => reader.number(value, name)?,
            None => or.ok_or_else(|| reader.error(section.own_line, &format!("[controller] has no {name}")))?,
        };
        if value >= 0.0 {
            Ok(value)
        } else {
            Err(reader.error(section.line(name), &format!("{name} is {value}: it must be zero or more")))
        }
    };
    let gains = Gains {
        kp: number("kp", None)?,
        kv: number("kv", None)?,
        ki: number("ki", Some(0.0))?,
        velocity_forward: number("velocity_forward", Some(0.0))?,
        acceleration_forward: number("acceleration_forward", Some(0.0))?,
        inertia: number("inertia", Some(inertia))?,
        limit: number("limit", Some(f64::INFINITY))?,
    };
    let delay = number("delay", Some(0.0))?;
    if delay.fract() != 0.0 || delay > Controller::MOST_DELAY as f64 {
        let most = Controller::MOST_DELAY;
        return Err(reader.error(
            section.line("delay"),
            &format!("delay is {delay}: it must be a whole number of samples, at most {most}"),
        ));
    }
    let speed_known = mapping.signals.iter().any(|(s, _)| *s == Signal::Omega1);
    let choice = |name: &str, no: &'static str, yes: &'static str, or: bool| {
        section.get(name).map_or(Ok(or), |v| reader.choice(v, name, &[(no, false), (yes, true)]))
    };
    Ok(Controller {
        gains,
        delay: delay as usize,
        table: choice("feedback", "motor", "table", false)?,
        measured_speed: choice("speed", "difference", "measured", speed_known)?,
    })
}

impl Controller {
    /// The lines of the section but for its columns.
    pub(super) fn lines(&self) -> String {
        let g = &self.gains;
        let values = [g.kp, g.kv, g.ki, g.velocity_forward, g.acceleration_forward, g.inertia, g.limit];
        let finite = NUMBERS.iter().zip(values).filter(|(_, value)| value.is_finite());
        let mut text: String = finite.map(|(name, value)| format!("{name} = {value:?}\n")).collect();
        text.push_str(&format!(
            "delay = {}\nfeedback = \"{}\"\nspeed = \"{}\"\n",
            self.delay,
            if self.table { "table" } else { "motor" },
            if self.measured_speed { "measured" } else { "difference" }
        ));
        text
    }
}
