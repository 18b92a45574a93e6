//! The part of a file that is used: the rows between two times.

use super::columns::time;
use super::{MeasuredError, figure};
use crate::trace::Table;

/// First and last time used, s, as the file counts it.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Part {
    /// First time; the file's own without.
    pub from: Option<f64>,
    /// Last time; the file's own without.
    pub to: Option<f64>,
}

impl Part {
    /// The rows of a table within the part, from 0; none where all are wanted.
    ///
    /// # Errors
    /// When the table has no time, or none of its rows lies in the part.
    pub(super) fn rows(&self, table: &Table) -> Result<Option<Vec<usize>>, MeasuredError> {
        if *self == Self::default() {
            return Ok(None);
        }
        let failed = |what: String| MeasuredError::File { file: table.file.clone(), what };
        let Some((name, time)) = time(table)? else {
            return Err(failed(format!(
                "it has no column of time, which --from and --to count in; name it time [s], or cut the rows in the file. The \
                 columns are: {}",
                table.names()
            )));
        };
        // Half a row of tolerance, as stamps are written with few digits.
        let lowest = time.iter().copied().fold(f64::INFINITY, f64::min);
        let highest = time.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let slack = 0.5 * (highest - lowest).max(0.0) / time.len().max(1) as f64;
        let (from, to) = (self.from.unwrap_or(f64::NEG_INFINITY), self.to.unwrap_or(f64::INFINITY));
        let rows: Vec<usize> = (0..time.len()).filter(|k| (from - slack..=to + slack).contains(&time[*k])).collect();
        if rows.is_empty() {
            return Err(failed(format!(
                "--from and --to leave none of its {} rows: its {name} runs from {} s to {} s",
                time.len(),
                figure(lowest),
                figure(highest)
            )));
        }
        Ok(Some(rows))
    }
}
