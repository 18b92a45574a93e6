//! Cells without a number: where they are few and isolated they are interpolated linearly, in a table and in a stream by the same rule.

use super::error::TraceError;
use super::table::{Fault, line_of};

/// Largest share of a column's cells that may be missing for them to be interpolated.
const MISSING: f64 = 0.01;
/// Most consecutive cells that are interpolated.
const IN_A_ROW: usize = 3;

/// The missing cells of one column, counted block by block.
#[derive(Debug, Clone, Default)]
pub(super) struct Missing {
    /// Cells so far.
    rows: usize,
    /// Missing ones among them.
    count: usize,
    /// Missing ones at the end of the last block.
    run: usize,
    /// Most consecutive missing ones.
    longest: usize,
    /// Whether the first cell is missing: it has no neighbour before it to interpolate from.
    leads: bool,
    /// The first missing cell.
    first: Option<Fault>,
}

impl Missing {
    /// Counts the next cells; `fault` is the first among them that is no number.
    pub fn take(&mut self, values: &[f64], fault: Option<&Fault>) {
        if let Some(fault) = fault {
            fault.clone().into_first(&mut self.first);
            self.leads |= self.rows == 0 && !values[0].is_finite();
            for v in values {
                self.run = if v.is_finite() { 0 } else { self.run + 1 };
                self.count += usize::from(self.run > 0);
                self.longest = self.longest.max(self.run);
            }
        } else if !values.is_empty() {
            self.run = 0;
        }
        self.rows += values.len();
    }

    /// The first fault, where the column is refused whatever follows: a cell holds another text than one for a missing value, the first
    /// cell is missing, or more than [`IN_A_ROW`] consecutive ones are.
    pub fn beyond(&self) -> Option<&Fault> {
        self.first.as_ref().filter(|f| !f.missing() || self.leads || self.longest > IN_A_ROW)
    }

    /// At the end of the column: the warning that cells were interpolated; `None` where none is missing.
    ///
    /// # Errors
    /// The first cell without a number, where the column has too many of them or ends in one.
    pub fn ended(&self, file: &str, column: &str) -> Result<Option<String>, Fault> {
        let Some(fault) = &self.first else { return Ok(None) };
        if self.beyond().is_some() || self.run > 0 || self.count as f64 > MISSING * self.rows as f64 {
            return Err(fault.clone());
        }
        Ok(Some(format!(
            "{file}: column {column} has no number in {} of {} rows, the first row {} ({:?}); they were bridged by straight lines",
            self.count, self.rows, fault.line, fault.text
        )))
    }
}

/// Interpolates linearly between the finite values, over those that are not finite.
pub(super) fn bridge(values: &mut [f64]) {
    let mut last = 0;
    for k in 1..values.len() {
        if !values[k].is_finite() {
            continue;
        }
        for j in last + 1..k {
            let share = (j - last) as f64 / (k - last) as f64;
            values[j] = values[last] + share * (values[k] - values[last]);
        }
        last = k;
    }
}

/// Interpolates the missing cells of a stream. Where a column ends in a missing cell, the rows from the last complete one on are held
/// back until the next rows are there.
pub(super) struct Bridges {
    columns: Vec<Missing>,
    waiting: Option<Piece>,
}

/// Rows of some columns.
pub(super) struct Piece {
    /// Row of the first, from 0.
    pub first: usize,
    /// One a column.
    pub columns: Vec<Vec<f64>>,
    /// (row, line) as in a table.
    pub lines: Vec<(usize, usize)>,
}

impl Piece {
    /// Line in the file, from 1, of a row that is among them.
    pub fn line(&self, row: usize) -> usize {
        line_of(&self.lines, row)
    }
}

impl Bridges {
    /// For a stream of this many columns.
    pub fn new(columns: usize) -> Self {
        Self { columns: vec![Missing::default(); columns], waiting: None }
    }

    /// Takes the next rows, with the first cell of each column that is no number; gives the rows that are complete.
    ///
    /// # Errors
    /// The column, and its cell that is not bridged.
    pub fn take(&mut self, rows: Piece, faults: &[Option<Fault>]) -> Result<Option<Piece>, (usize, Fault)> {
        for (k, (missing, fault)) in self.columns.iter_mut().zip(faults).enumerate() {
            missing.take(&rows.columns[k], fault.as_ref());
            if let Some(fault) = missing.beyond() {
                return Err((k, fault.clone()));
            }
        }
        let waited = self.waiting.is_some();
        let mut rows = match self.waiting.take() {
            None => rows,
            Some(mut all) => {
                for (all, more) in all.columns.iter_mut().zip(rows.columns) {
                    all.extend_from_slice(&more);
                }
                all.lines.extend(rows.lines);
                all
            }
        };
        let count = rows.columns.first().map_or(0, Vec::len);
        let mut keep = count;
        if self.columns.iter().any(|c| c.run > 0) {
            // The rows held back begin with a complete one, as the first row of the file is.
            let whole = |row: &usize| rows.columns.iter().all(|c| c[*row].is_finite());
            keep = (0..count).rev().find(whole).unwrap_or(0);
            let line = |row: usize| (row, rows.line(row));
            let lines = (rows.first + keep..rows.first + count).map(line).collect();
            let columns = rows.columns.iter_mut().map(|c| c.split_off(keep)).collect();
            self.waiting = Some(Piece { first: rows.first + keep, columns, lines });
        }
        if waited || faults.iter().any(Option::is_some) {
            rows.columns.iter_mut().for_each(|c| bridge(c));
        }
        Ok((keep > 0).then_some(rows))
    }

    /// After the last rows: a warning for each column with interpolated cells; `name(k)` is the name of column `k`.
    ///
    /// # Errors
    /// When a column has more missing cells than are bridged, or ends in one.
    pub fn ended(self, file: &str, name: impl Fn(usize) -> String) -> Result<Vec<String>, TraceError> {
        let mut warnings = Vec::new();
        for (k, missing) in self.columns.iter().enumerate() {
            let name = name(k);
            let warning = missing.ended(file, &name).map_err(|fault| fault.named(file, &name))?;
            warnings.extend(warning.filter(|w| !warnings.contains(w)));
        }
        Ok(warnings)
    }
}
