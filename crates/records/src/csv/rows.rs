//! The rows of data, parsed in parallel.

use std::ops::Range;

use memchr::{memchr, memchr2};
use rayon::prelude::*;

use super::head::Format;
use super::{is_data, number, trim};
use crate::error::TraceError;
use crate::table::Fault;

/// Least bytes a thread is started for.
const CHUNK: usize = 1 << 18;

/// Rows of data, whole lines.
pub(crate) struct Rows {
    /// One a column.
    pub columns: Vec<Vec<f64>>,
    /// The first cell of each column that is no finite number.
    pub faults: Vec<Option<Fault>>,
    /// (row, line) where the line of a row is not one more than that of the row before.
    pub lines: Vec<(usize, usize)>,
    /// Lines, those without data too.
    pub passed: usize,
}

/// Parses whole lines, of which the first holds row `row` (from 0) or what stands before it, and is line `line` (from 1).
///
/// # Errors
/// [`Ragged`] of the first row with too few or too many fields.
pub(crate) fn rows(body: &[u8], format: &Format, row: usize, line: usize) -> Result<Rows, Ragged> {
    let chunks = chunks(body);
    let counts: Vec<Count> = chunks.par_iter().map(|range| count(&body[range.clone()])).collect();
    let rows: usize = counts.iter().map(|c| c.rows).sum();
    let passed = counts.iter().map(|c| c.lines).sum();
    let mut columns: Vec<Vec<f64>> = (0..format.columns).map(|_| vec![0.0; rows]).collect();

    let mut jobs = Vec::with_capacity(chunks.len());
    let mut rests: Vec<&mut [f64]> = columns.iter_mut().map(Vec::as_mut_slice).collect();
    let (mut row, mut line) = (row, line);
    for (range, count) in chunks.into_iter().zip(counts) {
        let mut out = Vec::with_capacity(format.columns);
        for rest in &mut rests {
            let (mine, others) = std::mem::take(rest).split_at_mut(count.rows);
            out.push(mine);
            *rest = others;
        }
        jobs.push(Job { bytes: &body[range], row, line, out });
        row += count.rows;
        line += count.lines;
    }
    let results: Vec<Result<Parsed, Ragged>> = jobs.into_par_iter().map(|job| job.run(format)).collect();

    let mut faults: Vec<Option<Fault>> = vec![None; format.columns];
    let mut lines: Vec<(usize, usize)> = Vec::new();
    for result in results {
        let parsed = result?;
        for (all, one) in faults.iter_mut().zip(parsed.faults) {
            if let Some(one) = one {
                one.into_first(all);
            }
        }
        lines.extend(parsed.lines);
    }
    Ok(Rows { columns, faults, lines, passed })
}

/// Cuts the body at line ends into about as many pieces as keep every thread busy.
pub(super) fn chunks(body: &[u8]) -> Vec<Range<usize>> {
    let pieces = (rayon::current_num_threads() * 4).min(body.len() / CHUNK + 1);
    let mut out = Vec::with_capacity(pieces);
    let mut start = 0;
    for piece in 1..=pieces {
        let goal = body.len() * piece / pieces;
        if goal <= start {
            continue;
        }
        let end = if piece == pieces {
            body.len()
        } else {
            memchr(b'\n', &body[goal..]).map_or(body.len(), |k| goal + k + 1)
        };
        out.push(start..end);
        start = end;
    }
    out
}

#[derive(Debug, Clone, Copy, Default)]
struct Count {
    rows: usize,
    lines: usize,
}

fn count(bytes: &[u8]) -> Count {
    let mut count = Count::default();
    let mut start = 0;
    for end in memchr::memchr_iter(b'\n', bytes) {
        count.lines += 1;
        count.rows += usize::from(is_data(&bytes[start..end]));
        start = end + 1;
    }
    if start < bytes.len() {
        count.lines += 1;
        count.rows += usize::from(is_data(&bytes[start..]));
    }
    count
}

struct Job<'a> {
    bytes: &'a [u8],
    /// First row and first line of the piece.
    row: usize,
    line: usize,
    out: Vec<&'a mut [f64]>,
}

struct Parsed {
    faults: Vec<Option<Fault>>,
    lines: Vec<(usize, usize)>,
}

/// A row with too few or too many fields.
pub(crate) struct Ragged {
    line: usize,
    found: usize,
}

impl Ragged {
    /// As an error of the file.
    pub fn named(self, file: &str, format: &Format) -> TraceError {
        TraceError::Ragged { file: file.to_owned(), line: self.line, found: self.found, expected: format.columns }
    }
}

impl Job<'_> {
    fn run(mut self, format: &Format) -> Result<Parsed, Ragged> {
        let mut faults: Vec<Option<Fault>> = vec![None; format.columns];
        let mut lines = Vec::new();
        let mut expected_line = 0;
        let (mut at, mut row, mut line) = (0, 0, self.line);
        let bytes = self.bytes;
        while at < bytes.len() {
            // A line is classified by its first byte alone where that is enough: it nearly always is.
            let skip = match bytes[at] {
                b'\n' | b'#' => true,
                c if c.is_ascii_whitespace() => {
                    let end = memchr(b'\n', &bytes[at..]).map_or(bytes.len(), |k| at + k);
                    !is_data(&bytes[at..end])
                }
                _ => false,
            };
            if skip {
                at = memchr(b'\n', &bytes[at..]).map_or(bytes.len(), |k| at + k + 1);
                line += 1;
                continue;
            }
            if line != expected_line {
                lines.push((self.row + row, line));
            }
            at = self.row(format, at, row, line, &mut faults)?;
            row += 1;
            line += 1;
            expected_line = line;
        }
        Ok(Parsed { faults, lines })
    }

    /// Parses one row that begins at `at`; gives where the next line begins.
    fn row(
        &mut self,
        format: &Format,
        mut at: usize,
        row: usize,
        line: usize,
        faults: &mut [Option<Fault>],
    ) -> Result<usize, Ragged> {
        let bytes = self.bytes;
        let mut field = 0;
        loop {
            let (value, end) = match fast_float2::parse_partial::<f64, _>(&bytes[at..]) {
                Ok((value, n)) if !format.decimal_comma && ends_field(bytes, at + n, format.separator) => {
                    (Some(value), at + n)
                }
                _ => {
                    // A separator within quotes belongs to the cell.
                    let line = || memchr(b'\n', &bytes[at..]).map_or(bytes.len(), |k| at + k);
                    let quoted = |k: usize| at + 1 + k;
                    let from = (bytes[at..].first() == Some(&b'"'))
                        .then(|| memchr(b'"', &bytes[at + 1..line()]).map(quoted))
                        .flatten()
                        .unwrap_or(at);
                    let end = memchr2(format.separator, b'\n', &bytes[from..]).map_or(bytes.len(), |k| from + k);
                    (number(&bytes[at..end], format.decimal_comma), end)
                }
            };
            if field < format.columns {
                let value = value.unwrap_or(f64::NAN);
                self.out[field][row] = value;
                if !value.is_finite() && faults[field].as_ref().is_none_or(Fault::missing) {
                    let mut text = String::from_utf8_lossy(trim(&bytes[at..end])).into_owned();
                    text.truncate(text.char_indices().nth(40).map_or(text.len(), |(k, _)| k));
                    Fault { line, text }.into_first(&mut faults[field]);
                }
            } else if !(field == format.columns && format.blank_last && trim(&bytes[at..end]).is_empty()) {
                let rest = memchr(b'\n', &bytes[at..]).map_or(bytes.len(), |k| at + k);
                let more = memchr::memchr_iter(format.separator, &bytes[at..rest]).count();
                return Err(Ragged { line, found: field + 1 + more });
            }
            field += 1;
            at = end;
            if bytes.get(at) == Some(&format.separator) {
                at += 1;
                continue;
            }
            if field < format.columns {
                return Err(Ragged { line, found: field });
            }
            if bytes.get(at) == Some(&b'\r') {
                at += 1;
            }
            return Ok((at + 1).min(bytes.len()));
        }
    }
}

/// Whether a field ends at `at`.
fn ends_field(bytes: &[u8], at: usize, separator: u8) -> bool {
    match bytes.get(at) {
        None | Some(b'\n') => true,
        Some(c) if *c == separator => true,
        Some(b'\r') => matches!(bytes.get(at + 1), None | Some(b'\n')),
        Some(_) => false,
    }
}
