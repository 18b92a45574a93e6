//! The summary: a row a trace, as CSV or Parquet.

#[cfg(feature = "parquet")]
mod packed;
#[cfg(not(feature = "parquet"))]
mod packed {
    //! What stands in its place in a build without Parquet.

    /// Says how to get it.
    pub(super) fn pack(_columns: &[(String, super::Column)], _rows: usize) -> Result<Vec<u8>, &'static str> {
        Err(crate::trace::WITHOUT_PARQUET)
    }
}

use std::collections::BTreeMap;
use std::path::Path;

use serde_json::Value;

use super::{FleetError, Placed, store};
use crate::report::format::printable;
use crate::trace::{append_number, write_text};

/// A column of the summary.
enum Column {
    Text(Vec<Option<String>>),
    Number(Vec<Option<f64>>),
}

/// The columns: what it is, the facts, each parameter with its standard error and its change since the machine's first
/// record, what is to be known, where the report is.
fn columns(facts: &[&str], rows: &[Placed]) -> Vec<(String, Column)> {
    let text = |of: &dyn Fn(&Placed) -> Option<String>| Column::Text(rows.iter().map(of).collect());
    let mut columns = vec![
        ("machine".to_owned(), text(&|p| Some(p.machine.clone()))),
        ("trace".to_owned(), text(&|p| Some(p.row.trace.clone()))),
        ("when".to_owned(), text(&|p| p.when.as_ref().map(|w| w.text.clone()))),
        ("status".to_owned(), text(&|p| Some(if p.row.done { "done" } else { "failed" }.to_owned()))),
    ];
    for (k, fact) in facts.iter().enumerate() {
        let values = || rows.iter().map(|p| p.row.facts.get(k));
        let numeric = values().flatten().any(Value::is_number);
        let column = if numeric {
            Column::Number(values().map(|v| v.and_then(Value::as_f64)).collect())
        } else {
            Column::Text(values().map(|v| v.and_then(Value::as_str).map(str::to_owned)).collect())
        };
        columns.push(((*fact).to_owned(), column));
    }
    // A parameter of machines that log torques and of others that log currents has a column in each unit.
    let mut names: Vec<(&str, Vec<&str>)> = Vec::new();
    for parameter in rows.iter().flat_map(|p| &p.row.parameters) {
        match names.iter_mut().find(|(name, _)| *name == parameter.name) {
            None => names.push((&parameter.name, vec![&parameter.unit])),
            Some((_, units)) if !units.contains(&parameter.unit.as_str()) => units.push(&parameter.unit),
            Some(_) => {}
        }
    }
    for (name, units) in names {
        let of = |p: &Placed| p.row.parameters.iter().find(|t| t.name == name).cloned();
        // The first of each machine: the rows stand in the order of time.
        let mut firsts: BTreeMap<&str, f64> = BTreeMap::new();
        for p in rows {
            if let Some(own) = of(p) {
                firsts.entry(&p.machine).or_insert(own.value);
            }
        }
        let change = |p: &Placed| {
            let first = *firsts.get(p.machine.as_str())?;
            (first != 0.0).then_some(of(p)?.value / first - 1.0)
        };
        for unit in &units {
            let own = |p: &Placed| of(p).filter(|t| t.unit == *unit);
            let titled = |name: &str| {
                if unit.is_empty() || *unit == "1" { name.to_owned() } else { format!("{name} [{unit}]") }
            };
            let std = format!("{name}_std");
            let std = if units.len() > 1 { titled(&std) } else { std };
            columns.push((titled(name), Column::Number(rows.iter().map(|p| own(p).map(|t| t.value)).collect())));
            columns.push((std, Column::Number(rows.iter().map(|p| own(p)?.std).collect())));
        }
        columns.push((format!("{name}_change"), Column::Number(rows.iter().map(change).collect())));
    }
    columns.push(("message".to_owned(), text(&|p| Some(p.row.message.clone()).filter(|m| !m.is_empty()))));
    columns.push(("report".to_owned(), text(&|p| p.row.done.then(|| format!("reports/{}", store::report(p.item))))));
    columns
}

/// Whether a summary is written as Parquet.
fn is_packed(path: &Path) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case("parquet") || e.eq_ignore_ascii_case("pq"))
}

/// That this build can write such a summary, before any work is done for it.
///
/// # Errors
/// For Parquet in a build without it.
pub(super) fn check(path: &Path) -> Result<(), FleetError> {
    if is_packed(path) && cfg!(not(feature = "parquet")) {
        return Err(FleetError::Parquet { path: path.to_owned(), reason: crate::trace::WITHOUT_PARQUET.to_owned() });
    }
    Ok(())
}

/// Writes the summary: Parquet where the name ends so, else CSV.
pub(super) fn write(path: &Path, facts: &[&str], rows: &[Placed]) -> Result<(), FleetError> {
    let columns = columns(facts, rows);
    let bytes = if is_packed(path) {
        packed::pack(&columns, rows.len())
            .map_err(|e| FleetError::Parquet { path: path.to_owned(), reason: e.to_string() })?
    } else {
        csv(&columns, rows.len()).into_bytes()
    };
    write_text(path, &bytes)?;
    Ok(())
}

/// Text from outside as a cell: nothing in it steers a terminal or the direction of text, and no spreadsheet takes it for a
/// formula (OWASP, CSV Injection: an apostrophe before `=`, `+`, `-`, `@`).
fn plain(text: &str) -> String {
    let text = printable(text);
    if text.starts_with(['=', '+', '-', '@', '\u{fffd}']) { format!("'{text}") } else { text.into_owned() }
}

/// RFC 4180.
fn csv(columns: &[(String, Column)], rows: usize) -> String {
    let quoted = |text: &str| {
        let text = plain(text);
        if text.contains([',', '"', '\n', '\r']) { format!("\"{}\"", text.replace('"', "\"\"")) } else { text }
    };
    let mut out = columns.iter().map(|(name, _)| quoted(name)).collect::<Vec<_>>().join(",");
    out.push('\n');
    for row in 0..rows {
        for (k, (_, column)) in columns.iter().enumerate() {
            if k > 0 {
                out.push(',');
            }
            match column {
                Column::Text(values) => out.push_str(&quoted(values[row].as_deref().unwrap_or_default())),
                Column::Number(values) => {
                    if let Some(value) = values[row] {
                        append_number(&mut out, value);
                    }
                }
            }
        }
        out.push('\n');
    }
    out
}
