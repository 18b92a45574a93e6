//! Which column is the angle, the radius, its deviation, X, Y, the time and the direction.

use std::f64::consts::PI;

use super::MeasuredError;
use crate::trace::guess::suffix;
use crate::trace::{Quantity, Table, Unit};

/// Points of a turn, SI.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Points {
    /// Positions, m, and the time, s.
    Cartesian { x: Vec<f64>, y: Vec<f64>, time: Option<Vec<f64>> },
    /// Angle, rad, and radius, m.
    Radius { angle: Vec<f64>, radius: Vec<f64> },
    /// Angle, rad, and radius less the nominal one, m.
    Deviation { angle: Vec<f64>, deviation: Vec<f64> },
}

impl Points {
    /// Angle about the middle of the points, rad.
    pub fn angle(&self) -> Vec<f64> {
        match self {
            Self::Cartesian { x, y, .. } => super::angles(x, y),
            Self::Radius { angle, .. } | Self::Deviation { angle, .. } => angle.clone(),
        }
    }

    pub fn part(&self, from: usize, to: usize) -> Self {
        self.each(|v| v[from..to].to_vec())
    }

    /// The same points with something done to each of their columns.
    fn each(&self, change: impl Fn(&[f64]) -> Vec<f64>) -> Self {
        match self {
            Self::Cartesian { x, y, time } => {
                Self::Cartesian { x: change(x), y: change(y), time: time.as_deref().map(&change) }
            }
            Self::Radius { angle, radius } => Self::Radius { angle: change(angle), radius: change(radius) },
            Self::Deviation { angle, deviation } => {
                Self::Deviation { angle: change(angle), deviation: change(deviation) }
            }
        }
    }
}

impl Picked {
    /// The same of these rows alone.
    pub fn of_rows(self, rows: &[usize]) -> Self {
        let taken = |v: &[f64]| rows.iter().map(|k| v[*k]).collect::<Vec<f64>>();
        Self { points: self.points.each(taken), direction: self.direction.as_deref().map(taken), ..self }
    }
}

/// What was made of a table, or of one of its columns of deviations.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Picked {
    pub points: Points,
    /// A number for each point, from a column: another number is another turn.
    pub direction: Option<Vec<f64>>,
    /// Whether its sign is the direction: negative clockwise. The numbers of runs do not have it.
    pub signed: bool,
    /// As the column's name has it.
    pub clockwise: Option<bool>,
    pub notes: Vec<String>,
}

/// What a column may be.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Role {
    X,
    Y,
    Angle,
    Radius,
    Deviation,
    Time,
    Direction,
}

/// Words of a name in small letters.
fn tokens(name: &str) -> Vec<String> {
    name.to_lowercase().split(|c: char| !c.is_alphanumeric()).filter(|w| !w.is_empty()).map(str::to_owned).collect()
}

/// The direction that a word names: true for clockwise.
pub(super) fn sense(word: &str) -> Option<bool> {
    match word.to_lowercase().as_str() {
        "cw" | "clockwise" | "g2" | "g02" => Some(true),
        "ccw" | "acw" | "anticlockwise" | "counterclockwise" | "g3" | "g03" => Some(false),
        _ => None,
    }
}

/// The direction that a text names, true for clockwise: `Run 1 CCW`, `counter-clockwise`.
pub(super) fn sense_of(text: &str) -> Option<bool> {
    let tokens = tokens(text);
    let counter = tokens.windows(2).any(|w| matches!(w[0].as_str(), "counter" | "anti") && w[1] == "clockwise");
    if counter { Some(false) } else { tokens.iter().find_map(|w| sense(w)) }
}

/// Units of ballbar software in addition to those of a trace.
pub(super) fn unit(text: &str) -> Option<&'static Unit> {
    let plain = text.trim().trim_matches(|c| "()[]".contains(c)).trim();
    Unit::parse(plain).or_else(|| {
        Unit::parse(match plain.to_lowercase().as_str() {
            "micron" | "microns" | "micrometer" | "micrometre" | "micrometers" | "micrometres" => "um",
            "millimeter" | "millimetre" | "millimeters" | "millimetres" => "mm",
            "degree" | "degrees" | "grad" => "deg",
            "sec" | "seconds" => "s",
            _ => return None,
        })
    })
}

fn role(name: &str, unit: Option<Quantity>) -> Option<Role> {
    let tokens = tokens(name);
    let has = |list: &[&str]| tokens.iter().any(|w| list.contains(&w.as_str()));
    if has(&["cmd", "command", "commanded", "set", "setpoint", "nominal", "soll", "target", "ref", "reference"]) {
        return None;
    }
    // A length is no direction, whatever else it says: "deviation CW [um]".
    let length = unit == Some(Quantity::Length);
    if has(&["deviation", "dev", "error", "abweichung", "dr", "delta"]) {
        return Some(Role::Deviation);
    }
    if has(&["radius", "r", "radial"]) {
        return Some(Role::Radius);
    }
    if has(&["angle", "angular", "phi", "theta", "winkel", "azimuth"]) || unit == Some(Quantity::Angle) {
        return Some(Role::Angle);
    }
    if has(&["x", "x1", "xpos"]) {
        return Some(Role::X);
    }
    if has(&["y", "y1", "ypos"]) {
        return Some(Role::Y);
    }
    if has(&["direction", "dir", "richtung", "sense", "run"]) && !length {
        return Some(Role::Direction);
    }
    if has(&["time", "t", "zeit"]) || unit == Some(Quantity::Time) {
        return Some(Role::Time);
    }
    (sense_of(name).is_some() && length).then_some(Role::Deviation)
}

/// What each column of a table may be, and its unit where that is known.
fn roles(table: &Table) -> Vec<(Option<Role>, Option<&'static Unit>)> {
    let known = table.headers.iter().map(|h| {
        let (stem, own) = suffix(&h.name).map_or((h.name.as_str(), None), |(stem, unit)| (stem, Some(unit)));
        (stem.to_owned(), h.unit.as_deref().and_then(unit).or(own))
    });
    known.map(|(stem, unit)| (role(&stem, unit.map(|u| u.quantity)), unit)).collect()
}

/// The name of the column of time and its values, s; none where no column has the name or the unit of a time.
///
/// # Errors
/// When its unit is no time, or a cell of it no number.
pub(super) fn time(table: &Table) -> Result<Option<(&str, Vec<f64>)>, MeasuredError> {
    let columns = roles(table);
    let Some(at) = columns.iter().position(|(r, _)| *r == Some(Role::Time)) else { return Ok(None) };
    let header = &table.headers[at];
    let per = match (columns[at].1, &header.unit) {
        (Some(u), _) if u.quantity == Quantity::Time => u.factor,
        (None, None) => 1.0,
        (known, written) => {
            let unit = known.map_or_else(|| written.as_deref().unwrap_or_default(), |u| u.symbol);
            return Err(MeasuredError::File {
                file: table.file.clone(),
                what: format!("column {}: [{unit}] is no unit of time; use s, ms or us", header.name),
            });
        }
    };
    Ok(Some((header.name.as_str(), table.column(at)?.iter().map(|t| t * per).collect())))
}

/// The columns of a table as points; `radius` is the nominal one where it is known, m.
pub(super) fn pick(table: &Table, radius: Option<f64>) -> Result<Vec<Picked>, MeasuredError> {
    let failed = |what: String| MeasuredError::File { file: table.file.clone(), what };
    let columns = roles(table);
    for (header, (role, unit)) in table.headers.iter().zip(&columns) {
        if let (Some(_), Some(text), None) = (role, &header.unit, unit) {
            return Err(failed(format!(
                "column {}: the unit [{text}] is not known; use mm, um or m, deg or rad, s or ms",
                header.name
            )));
        }
    }
    // A file of arrays may hold some of other lengths.
    let rows = table.rows();
    for (c, header) in table.headers.iter().enumerate().filter(|(c, _)| columns[*c].0.is_some()) {
        if let Ok(values) = table.column(c)
            && values.len() != rows
        {
            return Err(failed(format!(
                "column {} has {} values and another {rows}; a circular test needs as many of each",
                header.name,
                values.len()
            )));
        }
    }
    let find = |wanted: Role| columns.iter().position(|(r, _)| *r == Some(wanted));
    let mut notes = Vec::new();
    let direction = find(Role::Direction).map(|c| table.column(c)).transpose()?.map(<[f64]>::to_vec);
    let signed = direction.as_ref().is_some_and(|v| v.iter().all(|d| d.abs() == 1.0) && v.iter().any(|d| *d < 0.0));
    let length = |c: usize, deviation: bool| -> Result<Vec<f64>, MeasuredError> {
        let values = table.column(c)?;
        let name = &table.headers[c].name;
        let factor = match columns[c].1 {
            Some(u) if u.quantity == Quantity::Length => u.factor,
            Some(u) => {
                return Err(failed(format!(
                    "column {name}: [{}] is {}, a length is needed: mm, um or m",
                    u.symbol,
                    u.quantity.name()
                )));
            }
            None if deviation => {
                return Err(failed(format!(
                    "column {name} has no unit, and a deviation may be in um, mm or m: write it behind the name, {name} [um]"
                )));
            }
            // A circular test has a radius between a millimetre and some metres.
            None => {
                let range = values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(*v), h.max(*v)));
                let size = (range.1 - range.0).max(range.1.abs());
                if size > 3.0 { 1e-3 } else { 1.0 }
            }
        };
        Ok(values.iter().map(|v| v * factor).collect())
    };
    if let (Some(x), Some(y)) = (find(Role::X), find(Role::Y)) {
        let time = find(Role::Time)
            .and_then(|c| Some((c, table.column(c).ok()?)))
            .map(|(c, v)| v.iter().map(|t| t * columns[c].1.map_or(1.0, |u| u.factor)).collect());
        let points = Points::Cartesian { x: length(x, false)?, y: length(y, false)?, time };
        return Ok(vec![Picked { points, direction, signed, clockwise: None, notes }]);
    }
    let example = "it needs columns such as: angle [deg],radius [mm]; angle [deg],deviation [um]; or x [mm],y [mm]";
    let Some(at) = find(Role::Angle) else {
        return Err(failed(format!(
            "no column for the angle or for X and Y; {example}; the columns are: {}",
            table.names()
        )));
    };
    let raw = table.column(at)?;
    let per = match columns[at].1 {
        Some(u) if u.quantity == Quantity::Angle => u.factor,
        Some(u) => {
            return Err(failed(format!(
                "column {}: [{}] is no angle; use deg or rad",
                table.headers[at].name, u.symbol
            )));
        }
        None if raw.iter().any(|a| a.abs() > 7.0) => PI / 180.0,
        None => 1.0,
    };
    let angle: Vec<f64> = raw.iter().map(|a| a * per).collect();
    let lengths: Vec<usize> =
        (0..columns.len()).filter(|c| matches!(columns[*c].0, Some(Role::Radius | Role::Deviation))).collect();
    if lengths.is_empty() {
        return Err(failed(format!(
            "no column for the radius or its deviation; {example}; the columns are: {}",
            table.names()
        )));
    }
    let mut all = Vec::new();
    // Two columns that name unlike directions are two turns; of others the first is meant, a deviation before a radius.
    let turned: Vec<usize> = lengths.iter().copied().filter(|c| sense_of(&table.headers[*c].name).is_some()).collect();
    let chosen = if turned.len() >= 2 {
        turned
    } else {
        let by = |wanted: Role| lengths.iter().copied().find(|c| columns[*c].0 == Some(wanted));
        by(Role::Deviation).or(by(Role::Radius)).into_iter().collect()
    };
    for c in chosen {
        let names_deviation = columns[c].0 == Some(Role::Deviation);
        let values = length(c, names_deviation)?;
        let mut sorted: Vec<f64> = values.iter().map(|v| v.abs()).collect();
        sorted.sort_by(f64::total_cmp);
        let middle = sorted.get(sorted.len() / 2).copied().unwrap_or(0.0);
        // A radius that is next to nothing is a deviation, whatever its name.
        let small = middle < radius.map_or(5e-4, |r| 0.05 * r);
        let points = if small {
            Points::Deviation { angle: angle.clone(), deviation: values }
        } else {
            if names_deviation {
                notes.push(format!(
                    "The column {} is taken as the radius: its values are too large for a deviation.",
                    table.headers[c].name
                ));
            }
            Points::Radius { angle: angle.clone(), radius: values }
        };
        all.push(Picked {
            points,
            direction: direction.clone(),
            signed,
            clockwise: sense_of(&table.headers[c].name),
            notes: notes.clone(),
        });
    }
    Ok(all)
}
