//! The axis file as text, with comments.

use std::fmt::Write as _;
use std::path::Path;

use super::columns::Made;
use super::estimates::Rough;
use crate::trace::guess::{Guess, Role};
use crate::trace::{AxisKind, COUNTS, Quantity, Signal, Table};

/// Number with four digits, as a person would write it into the file.
fn four(value: f64) -> String {
    let text = format!("{value:.3e}");
    text.parse::<f64>()
        .map_or(text, |v| if (1e-3..1e4).contains(&v.abs()) || v == 0.0 { v.to_string() } else { format!("{v:e}") })
}

/// What is estimated of the axis from the numbers of the log.
#[derive(Default)]
pub(super) struct Read {
    /// Inertias, damping and stiffness, roughly.
    pub rough: Option<Rough>,
    /// The lead of the screw over 2*pi, m/rad.
    pub rho: Option<f64>,
    /// The torque acts as if it ran straight from sample to sample.
    pub runs_straight: bool,
    /// The log cannot be believed as it is.
    pub refused: bool,
}

/// The axis file, with comments.
pub(super) fn write(made: &Made, table: &Table, read: &Read, file: &str) -> String {
    let Read { rough, rho, runs_straight, refused } = *read;
    let mut out = String::new();
    let text = |s: &str| toml::Value::String(s.to_owned()).to_string();
    let plain = |s: &str| s.chars().map(|c| if c.is_control() { ' ' } else { c }).collect::<String>();
    let stem = Path::new(file).file_stem().map_or_else(|| "axis".to_owned(), |s| plain(&s.to_string_lossy()));
    let folder = Path::new(file).parent().and_then(Path::file_name).map(|s| plain(&s.to_string_lossy()));
    // A log that is called by its date is one of a machine that its folder is called by.
    let name = if stem.chars().any(char::is_alphabetic) { stem } else { folder.unwrap_or(stem) };
    let linear = made.motion == AxisKind::Linear;
    let [inertia, damping, stiffness, torque] =
        if linear { ["kg", "N.s/m", "N/m", "N"] } else { ["kg.m2", "N.m.s/rad", "N.m/rad", "N.m"] };
    // A current without its torque constant, or a number of the drive, has units of its own.
    let own =
        made.of(Signal::T).filter(|g| made.torque_scale == 1.0 && g.unit.is_none_or(|u| u.quantity == Quantity::Drive));
    let own = own.filter(|g| g.column != Signal::T.name()).map(|g| match g.unit {
        Some(unit) => unit.symbol.to_owned(),
        None if made.counts() => COUNTS.to_owned(),
        None => plain(&g.column),
    });
    let angle = if linear { "m" } else { "rad" };
    let of_own =
        |si: &str, times: &str| own.as_ref().map_or_else(|| si.to_owned(), |own| format!("{own}{times}/{angle}"));
    let (inertia, damping, stiffness) = (of_own(inertia, ".s2"), of_own(damping, ".s"), of_own(stiffness, ""));
    let _ = writeln!(out, "# Made by `eixo init` from {}.", plain(file));
    let _ = writeln!(out, "name = {}", text(&name));
    let [i1, i2, b, k] = rough.map_or([1.0, 1.0, 1.0, 1000.0], |r| r.values);
    let origin = if refused {
        "# Placeholders: the log has a defect that `eixo inspect` names. Put in the values of the data sheet."
    } else if rough.is_some_and(|r| !r.is_shown) {
        "# The log hardly shows the inertia beside the other torques: a guess. Put in the value of the data sheet."
    } else if rough.is_some() {
        "# Rough values, read from the log itself: put in those of the data sheet where you have them."
    } else {
        "# Placeholders: the log did not say. Put in the values of the data sheet, or those that `eixo identify` finds."
    };
    if made.is_rigid() {
        let _ =
            writeln!(out, "structure = \"rigid\"               # one encoder: the flexible mode is out of its reach");
        let _ = writeln!(
            out,
            "\n[parameters]\n{origin}\n{:<34} # {inertia}, motor and all that it moves",
            format!("I1 = {}", four(i1))
        );
    } else {
        let _ = writeln!(out, "\n[parameters]\n{origin}");
        let _ = writeln!(out, "{:<34} # {inertia}, motor side", format!("I1 = {}", four(i1)));
        let _ = writeln!(out, "{:<34} # {inertia}, table side", format!("I2 = {}", four(i2)));
        let _ = writeln!(out, "{:<34} # {damping}, damping of the coupling", format!("B = {}", four(b)));
        let _ = writeln!(out, "{:<34} # {stiffness}, stiffness of the coupling", format!("K = {}", four(k)));
    }
    if made.of(Signal::X2).is_some() {
        let _ = match rho {
            Some(rho) => writeln!(
                out,
                "{:<34} # m/rad, the lead of the screw over 2*pi, as the log has it: x2 = rho*theta2",
                format!("rho = {}", four(rho))
            ),
            None => writeln!(
                out,
                "{:<34} # m/rad, the lead of the screw over 2*pi: x2 = rho*theta2. PUT IT IN",
                "rho = 1.0"
            ),
        };
    }
    let _ = writeln!(out, "\n[units]\nmotion = \"{}\"", if linear { "linear" } else { "rotary" });
    let _ = writeln!(out, "\n[signals]                          # column of the log for each signal; \"\" for none");
    match (made.guesses.iter().find(|g| g.role == Role::Time), made.dt) {
        (Some(time), _) => {
            let _ = writeln!(out, "time = {}", entry(time, table, 1.0, &text, ""));
        }
        (None, dt) => {
            let _ = writeln!(out, "{:<34} # s, sampling interval", format!("dt = {}", dt.unwrap_or(1e-3)));
        }
    }
    for signal in Signal::ALL {
        let Some(g) = made.of(signal) else { continue };
        if signal == Signal::Reference {
            let _ = writeln!(
                out,
                "# {} looks like the reference of the drive: with its gains it belongs into [controller].",
                g.column
            );
            continue;
        }
        let scale = if signal == Signal::T { made.torque_scale } else { 1.0 };
        let hold = match (signal, if runs_straight { "linear" } else { "zoh" }) {
            (Signal::T, hold) if made.counts() => format!(", unit = \"{COUNTS}\", hold = \"{hold}\""),
            (Signal::T, hold) => format!(", hold = \"{hold}\""),
            _ => String::new(),
        };
        let _ = writeln!(out, "{} = {}", signal.name(), entry(g, table, scale, &text, &hold));
        if signal == Signal::T && runs_straight {
            out.push_str("# hold: running straight between samples the torque leaves less than half the power that it does held.\n");
        }
        if signal == Signal::T && g.unit.is_none_or(|u| u.quantity == Quantity::Drive) && scale == 1.0 {
            let unit = match g.unit {
                Some(unit) => unit.symbol.to_owned(),
                None if made.counts() => format!("{COUNTS} (the column {} has no unit)", g.column),
                None => format!("the unit of the column {}", g.column),
            };
            let _ = writeln!(out, "# scale is 1: all inertias and stiffnesses come out in {unit} instead of {torque}.");
        }
    }
    out
}

/// The entry of one column.
fn entry(g: &Guess, table: &Table, scale: f64, text: &dyn Fn(&str) -> String, hold: &str) -> String {
    let in_header = table.position(&g.column).and_then(|k| table.headers[k].unit.as_ref()).is_some();
    let column = text(&g.column);
    let needs_unit = g.unit.filter(|u| !in_header && u.factor != 1.0);
    if needs_unit.is_none() && scale == 1.0 && hold.is_empty() {
        return column;
    }
    let unit = needs_unit.map_or_else(String::new, |u| format!(", unit = {}", text(u.symbol)));
    let scale = if scale == 1.0 { String::new() } else { format!(", scale = {scale}") };
    format!("{{ column = {column}{unit}{scale}{hold} }}")
}
