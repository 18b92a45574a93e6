//! A comparison with reference results, for people and for programs.

use std::fmt::Write as _;

use serde_json::{Value, json};

use super::super::reference::Comparison;

/// A line a variable.
#[must_use]
pub fn compared(c: &Comparison) -> String {
    let share = |x: f64| format!("{:.3} %", 100.0 * x);
    let mut out = format!("{}: reference results, within {} of the range\n", c.file, share(c.tolerance));
    let width = c.variables.iter().map(|v| v.name.chars().count()).max().unwrap_or(0);
    // The rounding of an accumulated time is not shown.
    let nanoseconds = |t: f64| (t * 1e9).round() / 1e9;
    for v in &c.variables {
        let verdict = if v.passes(c.tolerance) { "within" } else { "OUTSIDE" };
        let name: String = v.name.chars().map(|c| if c.is_control() { '\u{FFFD}' } else { c }).collect();
        let _ = writeln!(out, "  {name:<width$}  {verdict:<7}  {:>10} at {} s", share(v.worst), nanoseconds(v.at));
    }
    for note in &c.notes {
        let _ = writeln!(out, "  note: {note}");
    }
    out.push('\n');
    out
}

/// The comparison as JSON; a distance that is no number is null.
#[must_use]
pub fn compared_json(c: &Comparison) -> Value {
    let variables: Vec<Value> = c
        .variables
        .iter()
        .map(|v| json!({ "name": v.name, "unit": v.unit, "passes": v.passes(c.tolerance), "worst": v.worst, "at": v.at }))
        .collect();
    json!({ "file": c.file, "tolerance": c.tolerance, "passes": c.passes(), "variables": variables, "notes": c.notes })
}
