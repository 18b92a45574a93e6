//! A machine as the text of an axis file.

use std::fmt::Write;

use super::super::signal::AxisKind;
use super::Machine;
use crate::Column;
use crate::axis::{Hold, Structure};
use crate::effects::EFFECTS;

fn quoted(text: &str) -> String {
    toml::Value::String(text.to_owned()).to_string()
}

fn column(c: &Column) -> String {
    let mut parts = vec![format!("column = {}", quoted(&c.column))];
    if let Some(unit) = &c.unit {
        parts.push(format!("unit = {}", quoted(unit)));
    }
    if c.scale != 1.0 {
        parts.push(format!("scale = {:?}", c.scale));
    }
    if c.offset != 0.0 {
        parts.push(format!("offset = {:?}", c.offset));
    }
    if parts.len() == 1 { quoted(&c.column) } else { format!("{{ {} }}", parts.join(", ")) }
}

impl Machine {
    /// The text of an axis file that reads back as this machine.
    #[must_use]
    pub fn to_toml(&self) -> String {
        let mut out = format!("name = {}\n", quoted(&self.name));
        if self.structure == Structure::Rigid {
            out.push_str("structure = \"rigid\"\n");
        }
        let p = &self.parameters;
        let mut line = |text: &str| {
            out.push_str(text);
            out.push('\n');
        };
        line("\n[parameters]");
        for (name, value) in [("I1", p.i1), ("I2", p.i2), ("B", p.b), ("K", p.k), ("rho", p.rho)] {
            line(&format!("{name} = {value:?}"));
        }
        if self.signals.motion == AxisKind::Linear {
            line("\n[units]\nmotion = \"linear\"");
        }
        let mapping = &self.signals;
        let plain = mapping.signals.is_empty() && mapping.dt.is_none();
        if !plain || mapping.hold.is_some() || mapping.time != Column::named("time") {
            line("\n[signals]");
            match mapping.hold {
                Some(Hold::Zoh) => line("hold = \"zoh\""),
                Some(Hold::Linear) => line("hold = \"linear\""),
                None => {}
            }
            if let Some(dt) = mapping.dt {
                line(&format!("dt = {dt:?}"));
            }
            line(&format!("time = {}", column(&mapping.time)));
            for (signal, c) in &mapping.signals {
                line(&format!("{} = {}", signal.name(), column(c)));
            }
        }
        if let Some(controller) = &self.controller {
            // Its columns stand in [signals].
            out.push_str("\n[controller]\n");
            out.push_str(&controller.lines());
        }
        for &effect in EFFECTS {
            if self.effects.is_on(effect) {
                let info = effect.info();
                let written = writeln!(out, "\n[effects.{}]", info.id);
                debug_assert!(written.is_ok(), "writing to a string");
                for (parameter, value) in info.parameters.iter().zip(self.effects.of(effect)) {
                    let written = writeln!(out, "{} = {value:?}", parameter.name);
                    debug_assert!(written.is_ok(), "writing to a string");
                }
            }
        }
        out
    }
}
