//! The text of an export, made into what the reader of traces takes: columns set by spaces get separators, words of
//! direction get signs, and header lines give radius, feed and direction.

use std::path::Path;

use super::columns::{sense, sense_of, unit};
use crate::trace::Quantity;

/// What header lines declare.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Declared {
    /// Nominal radius, m.
    pub radius: Option<f64>,
    /// Feed, m/s.
    pub feed: Option<f64>,
    /// Direction.
    pub clockwise: Option<bool>,
}

impl Declared {
    /// This, and where it is silent the other.
    pub fn or(self, other: Self) -> Self {
        Self {
            radius: self.radius.or(other.radius),
            feed: self.feed.or(other.feed),
            clockwise: self.clockwise.or(other.clockwise),
        }
    }
}

/// What a file's name declares.
pub(super) fn of_name(file: &Path) -> Declared {
    let stem = file.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
    Declared { clockwise: sense_of(&stem), ..Declared::default() }
}

/// A text as columns, and what its header declares.
pub(super) struct Export {
    pub table: String,
    pub declared: Declared,
}

/// Most lines of a header.
const HEADER: usize = 400;

/// The text of a file; none where it is no text.
pub(super) fn of(bytes: &[u8]) -> Option<Export> {
    if bytes.contains(&0) {
        return None;
    }
    let text = match std::str::from_utf8(bytes) {
        Ok(text) => text.to_owned(),
        // Windows' Western letters, of which micro and degree are what matters.
        Err(_) => bytes.iter().map(|b| char::from(*b)).collect(),
    };
    let text = text.trim_start_matches('\u{feff}');
    let first = text.trim_start().chars().next()?;
    if matches!(first, '{' | '[' | '<') {
        return None;
    }
    let lines: Vec<&str> = text.lines().collect();
    let data = lines.iter().take(HEADER).position(|l| is_data(l)).unwrap_or(0);
    let declared = header(&lines[..data]);
    let spaced = lines.get(data).is_some_and(|l| by_spaces(l).is_some());
    let mut table = String::with_capacity(text.len());
    for (k, line) in lines.iter().enumerate() {
        if spaced && k + 1 == data {
            table.push_str(&names(line, lines[data]));
        } else if spaced && let Some(fields) = by_spaces(line) {
            table.push_str(&fields.join(";"));
        } else if k >= data && !line.trim_start().starts_with('#') {
            table.push_str(&signs(line));
        } else {
            table.push_str(line);
        }
        table.push('\n');
    }
    Some(Export { table, declared })
}

/// A number with a decimal point or a decimal comma.
fn number(field: &str) -> Option<f64> {
    let plain = field.trim().trim_matches('"');
    let digit = |c: char| c.is_ascii_digit();
    if !plain.starts_with(|c: char| digit(c) || "+-.".contains(c)) || plain.ends_with(',') {
        return None;
    }
    plain.replacen(',', ".", 1).parse().ok()
}

/// Whether a line is a row of numbers, in which a word may be.
fn is_data(line: &str) -> bool {
    let line = line.trim();
    if line.is_empty() || line.starts_with('#') {
        return false;
    }
    let numbers = |fields: Vec<&str>| {
        let filled: Vec<&str> = fields.into_iter().map(str::trim).filter(|f| !f.is_empty()).collect();
        let count = filled.iter().filter(|f| number(f).is_some()).count();
        count >= 2 && filled.iter().all(|f| number(f).is_some() || sense(f.trim_matches('"')).is_some())
    };
    numbers(line.split([';', '\t']).collect())
        || numbers(line.split([',', ';', '\t']).collect())
        || by_spaces(line).is_some()
}

/// The fields of a row that is set by spaces alone.
fn by_spaces(line: &str) -> Option<Vec<String>> {
    if line.contains([';', '\t']) {
        return None;
    }
    let fields: Vec<&str> = line.split_whitespace().collect();
    let count = fields.iter().filter(|f| number(f).is_some()).count();
    let all = fields.iter().all(|f| number(f).is_some() || sense(f).is_some());
    (count >= 2 && all).then(|| fields.iter().map(|f| sign(f)).collect())
}

/// A word of direction as a sign.
fn sign(field: &str) -> String {
    match sense(field.trim().trim_matches('"')) {
        Some(true) => "-1".to_owned(),
        Some(false) => "1".to_owned(),
        None => field.to_owned(),
    }
}

/// A row with signs for its words of direction.
fn signs(line: &str) -> String {
    let mut out = String::with_capacity(line.len());
    for piece in line.split_inclusive([',', ';', '\t']) {
        let (field, end) = match piece.char_indices().last() {
            Some((k, ',' | ';' | '\t')) => piece.split_at(k),
            _ => (piece, ""),
        };
        out.push_str(&sign(field));
        out.push_str(end);
    }
    out
}

/// The header of columns set by spaces: names may hold single spaces where columns are set apart by more.
fn names(line: &str, data: &str) -> String {
    let wanted = data.split_whitespace().count();
    let line = line.trim().trim_start_matches('#').trim();
    let wide: Vec<&str> = line.split("  ").map(str::trim).filter(|f| !f.is_empty()).collect();
    if wide.len() == wanted || line.contains([';', '\t']) {
        return wide.join(";");
    }
    let mut fields: Vec<String> = Vec::new();
    for word in line.split_whitespace() {
        match fields.last_mut() {
            // A unit belongs to the name before it.
            Some(last) if word.starts_with(['(', '[']) => *last = format!("{last} {word}"),
            _ => fields.push(word.to_owned()),
        }
    }
    fields.join(";")
}

/// Radius, feed and direction from lines such as `Radius: 100 mm`, `Feedrate;1000;mm/min`, `Run 1 CCW`.
fn header(lines: &[&str]) -> Declared {
    let mut declared = Declared::default();
    // The last line names the columns, where CW and CCW are not the direction of the whole.
    for line in lines.iter().take(lines.len().saturating_sub(1)) {
        let lower = line.to_lowercase();
        let fields: Vec<&str> = line
            .split(|c: char| c.is_whitespace() || ":;=\t,".contains(c))
            .map(|f| f.trim_matches(|c| "()[]\"#".contains(c)))
            .filter(|f| !f.is_empty())
            .collect();
        let quantity = |wanted: Quantity, default: f64| {
            let at = fields.iter().position(|f| number(f).is_some())?;
            let value = number(fields[at])?;
            let factor = fields.get(at + 1).or_else(|| fields[..at].last()).and_then(|f| unit(f));
            let factor = factor.filter(|u| u.quantity == wanted).map_or(default, |u| u.factor);
            Some(value * factor).filter(|v| v.is_finite() && *v > 0.0)
        };
        if lower.contains("radius") && declared.radius.is_none() {
            declared.radius = quantity(Quantity::Length, 1e-3);
        } else if lower.contains("feed") && declared.feed.is_none() {
            declared.feed = quantity(Quantity::Velocity, 1e-3 / 60.0);
        }
        if declared.clockwise.is_none() && (lower.contains("dir") || lower.contains("run") || lower.contains("sense")) {
            declared.clockwise = sense_of(line);
        }
    }
    declared
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_set_by_spaces_and_words_of_direction_become_a_table() {
        let text = "Ballbar export\nRadius: 150.0 mm\nFeedrate: 1000 mm/min\nRun 1 CCW\n\nAngle (deg)   Deviation (um)\n  0.0   1.5\n  0.1   1.6\n";
        let plain = of(text.as_bytes()).expect("text");
        assert_eq!(plain.declared, Declared { radius: Some(0.15), feed: Some(1.0 / 60.0), clockwise: Some(false) });
        assert!(plain.table.ends_with("Angle (deg);Deviation (um)\n0.0;1.5\n0.1;1.6\n"), "{}", plain.table);
        let plain = of(b"angle [deg],deviation [um],direction\n0,1,CCW\n1,2,\"cw\"\n").expect("text");
        assert!(plain.table.ends_with("0,1,1\n1,2,-1\n"), "{}", plain.table);
        let plain = of("Winkel Radius\n0,0 100,01\n0,5 100,02\n".as_bytes()).expect("text");
        assert!(plain.table.ends_with("Winkel;Radius\n0,0;100,01\n0,5;100,02\n"), "{}", plain.table);
        assert!(of(b"PK\x03\x04\0").is_none());
    }
}
