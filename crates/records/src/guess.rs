//! Which column of a log is which signal: by its name, its unit and its values.
//!
//! A name is split into words where a character is no letter or digit, at `camelCase`, and between letters and digits. Each role has a
//! score for a column: some words, units and values add to it, others take from it. The pairs of role and column are taken from the
//! highest score down, each role and each column once.

use super::signal::{Quantity, Signal};
use super::table::Table;
use super::units::Unit;

/// What a column may be.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    /// The time.
    Time,
    /// A signal.
    Signal(Signal),
}

/// A column, and the role that it is taken for.
#[derive(Debug, Clone, PartialEq)]
pub struct Guess {
    /// What it is taken for.
    pub role: Role,
    /// Its name in the file.
    pub column: String,
    /// Its unit, from the header or the end of its name.
    pub unit: Option<&'static Unit>,
    /// Score of the role for this column; below [`SURE`] the user should check the guess.
    pub score: i32,
}

/// Score from which a guess needs no check.
pub const SURE: i32 = 6;

/// A name without the unit at its end, and that unit: `theta_rad` is `theta` in rad, `speed_rad_s` is `speed` in rad/s. `None` where
/// the name ends in no unit.
#[must_use]
pub fn suffix(name: &str) -> Option<(&str, &'static Unit)> {
    let cuts: Vec<usize> = name.match_indices('_').map(|(k, _)| k).collect();
    for parts in [2, 1] {
        let Some(cut) = cuts.len().checked_sub(parts).map(|k| cuts[k]) else { continue };
        let end = &name[cut + 1..];
        let spelled = [end.replace('_', "/"), end.replace('_', ".")];
        if cut > 0
            && let Some(unit) = spelled.iter().find_map(|s| Unit::parse(s))
        {
            return Some((&name[..cut], unit));
        }
    }
    None
}

/// Words of a name, in lower case.
fn words(name: &str) -> Vec<String> {
    let mut out: Vec<String> = vec![String::new()];
    let mut before = ' ';
    for c in name.chars() {
        let boundary = !c.is_alphanumeric()
            || (c.is_uppercase() && before.is_lowercase())
            || (c.is_ascii_digit() != before.is_ascii_digit() && before.is_alphanumeric());
        if boundary && out.last().is_some_and(|w| !w.is_empty()) {
            out.push(String::new());
        }
        if c.is_alphanumeric()
            && let Some(last) = out.last_mut()
        {
            last.extend(c.to_lowercase());
        }
        before = c;
    }
    out.retain(|w| !w.is_empty());
    out
}

const REFERENCE: &[&str] =
    &["ref", "reference", "goal", "target", "soll", "desired", "set", "setpoint", "cmd", "command", "des"];
const MEASURED: &[&str] = &["meas", "measured", "act", "actual", "ist", "fb", "feedback", "enc", "encoder"];
const POSITION: &[&str] = &[
    "pos",
    "position",
    "theta",
    "angle",
    "phi",
    "q",
    "x",
    "winkel",
    "lage",
    "posición",
    "posição",
    "posizione",
    "angolo",
    "ángulo",
    "way",
    "weg",
    "displacement",
    "enc",
    "encoder",
];
const SPEED: &[&str] = &[
    "speed",
    "vel",
    "velocity",
    "omega",
    "w",
    "v",
    "drehzahl",
    "geschwindigkeit",
    "vitesse",
    "velocidad",
    "velocidade",
    "velocità",
    "rpm",
    "dq",
    "qd",
    "n",
];
const TORQUE: &[&str] = &[
    "couple",
    "coppia",
    "par",
    "torque",
    "force",
    "moment",
    "drehmoment",
    "kraft",
    "tau",
    "trq",
    "effort",
    "t",
    "m",
    "f",
];
const CURRENT: &[&str] = &["current", "iq", "i", "strom", "amps", "cur"];
const DRIVE: &[&str] = &["load", "input", "u", "voltage", "pwm", "duty", "control", "out", "output", "last"];
const TIME: &[&str] =
    &["time", "t", "timestamp", "zeit", "zeitstempel", "temps", "tiempo", "tempo", "stamp", "sec", "seconds", "clock"];
const MOTOR: &[&str] = &["motor", "mot", "m", "1", "drive", "rotor"];
const TABLE: &[&str] =
    &["load", "table", "tisch", "last", "2", "scale", "linear", "direct", "slide", "ext", "external", "second"];
const ACCELERATION: &[&str] =
    &["acc", "accel", "acceleration", "alpha", "ddq", "jerk", "error", "err", "deviation", "lag"];

/// The roles of a log's columns: the time first, then the signals in their order.
#[must_use]
pub fn guess(table: &Table) -> Vec<Guess> {
    let mut candidates: Vec<(Guess, usize)> = Vec::new();
    for (index, header) in table.headers.iter().enumerate() {
        // A column where a few cells are no numbers is a candidate, too: an error of reading it names the cell.
        let values = table.finite(index);
        if values.is_empty() || 2 * values.len() < table.rows() {
            continue;
        }
        let given = header.unit.as_deref().and_then(Unit::parse);
        let (stem, unit) = match (given, suffix(&header.name)) {
            (Some(unit), _) => (header.name.as_str(), Some(unit)),
            (None, Some((stem, unit))) => (stem, Some(unit)),
            (None, None) => (header.name.as_str(), None),
        };
        let words = words(stem);
        for (role, score) in scores(&header.name, &words, unit.map(|u| u.quantity), &values) {
            candidates.push((Guess { role, column: header.name.clone(), unit, score }, index));
        }
    }
    // The highest score first; of equal scores the column further to the left.
    candidates.sort_by(|a, b| b.0.score.cmp(&a.0.score).then(a.1.cmp(&b.1)));
    let mut found: Vec<Guess> = Vec::new();
    for (candidate, _) in candidates {
        if !found.iter().any(|f| f.role == candidate.role || f.column == candidate.column) {
            found.push(candidate);
        }
    }
    let order = |role: &Role| match role {
        Role::Time => 0,
        Role::Signal(s) => 1 + s.index(),
    };
    found.sort_by_key(|f| order(&f.role));
    found
}

/// The first column whose name or unit is that of a time, whatever its values.
#[must_use]
pub fn time_by_name(table: &Table) -> Option<Guess> {
    table.headers.iter().find_map(|header| {
        let given = header.unit.as_deref().and_then(Unit::parse);
        let unit = given.or_else(|| suffix(&header.name).map(|(_, u)| u));
        let timed = unit.map_or_else(|| super::load::time_name(&header.name), |u| u.quantity == Quantity::Time);
        timed.then(|| Guess { role: Role::Time, column: header.name.clone(), unit, score: 0 })
    })
}

/// The roles that a column may have, each with its score.
fn scores(name: &str, words: &[String], quantity: Option<Quantity>, values: &[f64]) -> Vec<(Role, i32)> {
    let has = |list: &[&str]| words.iter().any(|w| list.contains(&w.as_str()));
    let rises = values.len() > 2 && values.windows(2).all(|w| w[1] > w[0]);
    let moves = values.iter().any(|v| *v != values[0]);
    let mut out = Vec::new();
    let mut add = |role: Role, score: i32| {
        if score > 2 {
            out.push((role, score + if moves { 1 } else { -4 }));
        }
    };
    // A signal's own name decides.
    if let Some(signal) = Signal::from_name(name).or_else(|| suffix(name).and_then(|(stem, _)| Signal::from_name(stem)))
    {
        add(Role::Signal(signal), 20);
    }
    let is = |q: Quantity| quantity == Some(q);
    let other = |q: &[Quantity]| quantity.is_some_and(|own| !q.contains(&own));
    let (time, signal) = (Role::Time, Role::Signal);
    add(
        time,
        5 * i32::from(is(Quantity::Time)) + 4 * i32::from(has(TIME)) + 2 * i32::from(rises)
            - 20 * i32::from(!rises || other(&[Quantity::Time])),
    );
    let length = is(Quantity::Angle) || is(Quantity::Length);
    let rate = is(Quantity::AngularVelocity) || is(Quantity::Velocity);
    let against = 8 * i32::from(has(ACCELERATION));
    let position = 4 * i32::from(has(POSITION)) + 4 * i32::from(length)
        - 12 * i32::from(other(&[Quantity::Angle, Quantity::Length]) || has(SPEED) || rate)
        - against;
    let speed = 4 * i32::from(has(SPEED)) + 5 * i32::from(rate)
        - 12 * i32::from(other(&[Quantity::AngularVelocity, Quantity::Velocity]))
        - against;
    let (reference, measured) = (i32::from(has(REFERENCE)), i32::from(has(MEASURED)));
    let (motor, table) = (i32::from(has(MOTOR)), i32::from(has(TABLE)));
    if position > 2 {
        add(signal(Signal::Theta1), position + 2 + 2 * measured + 2 * motor - 6 * reference - 5 * table);
        if table > 0 {
            add(signal(Signal::Theta2), position + 1 + 2 * measured + 3 * table - 6 * reference - 5 * motor);
        }
        if reference > 0 {
            add(signal(Signal::Reference), position + 4 * reference - 2 * measured);
        }
    }
    if speed > 2 {
        add(signal(Signal::Omega1), speed + 2 + 2 * measured + 2 * motor - 6 * reference - 5 * table);
        if table > 0 {
            add(signal(Signal::Omega2), speed + 1 + 2 * measured + 3 * table - 6 * reference - 5 * motor);
        }
    }
    let force = is(Quantity::Torque) || is(Quantity::Force);
    let drive = is(Quantity::Drive);
    let wrong =
        other(&[Quantity::Torque, Quantity::Force, Quantity::Drive]) || position > 2 || (speed > 2 && !force) || rises;
    let torque = 5 * i32::from(has(TORQUE))
        + 6 * i32::from(force)
        + 4 * i32::from(has(CURRENT))
        + 3 * i32::from(has(DRIVE))
        + 2 * i32::from(drive)
        + measured
        + i32::from(has(&["input", "plant"]))
        - 2 * i32::from(reference > 0 && !force)
        - 20 * i32::from(wrong);
    // The voltage of a supply is nearly constant; that of a drive is not.
    let steady = {
        let (low, high) = values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(*v), b.max(*v)));
        low > 0.0 && high < 2.0 * low
    };
    add(signal(Signal::T), torque - 8 * i32::from(steady));
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    fn guessed(header: &str) -> Vec<String> {
        let width = header.split(',').count();
        let mut text = format!("{header}\n");
        for k in 0..20_i32 {
            let cells: Vec<String> = (0..width as i32)
                .map(
                    |c| if c == 0 { format!("{}", f64::from(k) * 0.001) } else { format!("{}", (k * (c + 1)) % 7 - 3) },
                )
                .collect();
            text.push_str(&format!("{}\n", cells.join(",")));
        }
        let table = Table::parse(text.as_bytes(), "log.csv").unwrap();
        let name = |g: &Guess| match g.role {
            Role::Time => "time".to_owned(),
            Role::Signal(s) => s.name().to_owned(),
        };
        guess(&table).iter().map(|g| format!("{}={}", name(g), g.column)).collect()
    }

    #[test]
    fn logs_of_real_machines_are_understood_by_their_headers() {
        for (header, expected) in [
            (
                "t_s,iq_ref_A,iq_meas_A,vdc_V,theta_motor_rad,omega_motor_rad_s,theta_load_rad,omega_load_rad_s",
                &[
                    "time=t_s",
                    "T=iq_meas_A",
                    "theta1=theta_motor_rad",
                    "omega1=omega_motor_rad_s",
                    "theta2=theta_load_rad",
                    "omega2=omega_load_rad_s",
                ][..],
            ),
            (
                "t_s,q_ref_m,q_meas_m,u_V,force_cmd_N",
                &["time=t_s", "T=force_cmd_N", "theta1=q_meas_m", "reference=q_ref_m"],
            ),
            (
                "t_s,goal_rad,pos_rad,speed_rad_s,load_raw,volts",
                &["time=t_s", "T=load_raw", "theta1=pos_rad", "omega1=speed_rad_s"],
            ),
            (
                "Time,ActTorque,ActPosition,SetPosition,ActVelocity",
                &["time=Time", "T=ActTorque", "theta1=ActPosition", "omega1=ActVelocity"],
            ),
            (
                "time [ms],Torque [Nm],Motor angle [deg],Table position [mm]",
                &["time=time", "T=Torque", "theta1=Motor angle", "theta2=Table position"],
            ),
        ] {
            let found = guessed(header);
            for one in expected {
                assert!(found.iter().any(|f| f == one), "{header}: {one} is not among {found:?}");
            }
        }
    }

    #[test]
    fn the_unit_at_the_end_of_a_name_is_found() {
        for (name, stem, symbol) in [
            ("t_s", "t", "s"),
            ("omega_load_rad_s", "omega_load", "rad/s"),
            ("force_cmd_N", "force_cmd", "N"),
            ("x2_mm", "x2", "mm"),
        ] {
            assert_eq!(suffix(name).map(|(s, u)| (s, u.symbol)), Some((stem, symbol)), "{name}");
        }
        assert_eq!(suffix("load_raw"), None);
    }
}
