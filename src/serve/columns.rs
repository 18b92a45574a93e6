//! The columns of a log: what they are taken for, and enough of each to draw it.

use std::path::Path;

use serde_json::{Value, json};

use super::http::Refusal;
use crate::trace::guess::{Role, SURE, guess, suffix};
use crate::trace::{Signal, Table, Unit};

/// Stretches of a record of which the least and the greatest value are drawn.
const STRETCHES: usize = 300;
/// Most columns that are shown.
const MOST: usize = 64;

/// What a column may be taken for, as `eixo init --column` spells it.
fn name(role: Role) -> &'static str {
    match role {
        Role::Time => "time",
        Role::Signal(s) => s.name(),
    }
}

/// Least and greatest value of each stretch, in the order in which they stand: sample numbers and values.
fn drawn(values: &[f64]) -> Vec<(usize, f64)> {
    let n = values.len();
    if n <= 2 * STRETCHES {
        return values.iter().copied().enumerate().filter(|(_, v)| v.is_finite()).collect();
    }
    let mut out = Vec::with_capacity(2 * STRETCHES);
    for k in 0..STRETCHES {
        let range = k * n / STRETCHES..(k + 1) * n / STRETCHES;
        let finite = || range.clone().filter(|i| values[*i].is_finite());
        let least = finite().min_by(|a, b| values[*a].total_cmp(&values[*b]));
        let most = finite().max_by(|a, b| values[*a].total_cmp(&values[*b]));
        let (Some(least), Some(most)) = (least, most) else { continue };
        for i in [least.min(most), least.max(most)] {
            if out.last().is_none_or(|(last, _)| *last != i) {
                out.push((i, values[i]));
            }
        }
    }
    out
}

/// What a log holds.
///
/// # Errors
/// When it is no table of numbers.
pub fn described(path: &Path) -> Result<Value, Refusal> {
    let table = Table::read(path)
        .map_err(|e| Refusal::new(422, e.to_string().replace(&path.display().to_string(), "the log")))?;
    let guesses = guess(&table);
    let mut columns = Vec::new();
    for (index, header) in table.headers.iter().enumerate() {
        // A column that holds text is none that can be taken.
        let Ok(values) = table.column(index) else { continue };
        if columns.len() == MOST {
            break;
        }
        let taken = guesses.iter().find(|g| g.column == header.name);
        let in_name = suffix(&header.name).map(|(_, unit)| unit.symbol);
        let unit = header.unit.as_deref().and_then(Unit::parse).map(|u| u.symbol);
        columns.push(json!({
            "name": header.name,
            "role": taken.map(|g| name(g.role)),
            "sure": taken.is_none_or(|g| g.score >= SURE),
            "unit": unit.or(in_name).or_else(|| taken.and_then(|g| g.unit).map(|u| u.symbol)),
            "unit_in_header": unit.is_some(),
            "points": drawn(values),
        }));
    }
    if columns.is_empty() {
        return Err(Refusal::new(422, "the log has no column of numbers"));
    }
    let signals: Vec<&str> = std::iter::once("time").chain(Signal::ALL.iter().map(|s| s.name())).collect();
    Ok(json!({ "rows": table.rows(), "columns": columns, "signals": signals }))
}

#[cfg(test)]
mod tests {
    use super::{STRETCHES, drawn};

    #[test]
    fn a_spike_of_one_sample_is_drawn() {
        let mut values = vec![0.0; 100_000];
        values[77_777] = 5.0;
        let points = drawn(&values);
        assert!(points.contains(&(77_777, 5.0)) && points.len() <= 2 * STRETCHES);
        assert!(points.windows(2).all(|w| w[0].0 < w[1].0));
        assert_eq!(drawn(&[1.0, f64::NAN, 2.0]), [(0, 1.0), (2, 2.0)]);
    }
}
