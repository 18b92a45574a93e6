//! The last row of a log whose writer was ended in the middle of it, and the mark that some exports end in.

use memchr::{memchr_iter, memrchr};

use super::{Format, is_data, number, trim};

/// Rows before the last by which it is found how many decimals the numbers have.
const ROWS: usize = 16;

/// Length of the complete rows of a body, bytes, and the text of the last row where it is cut off. `begins`: whether the body holds the
/// first row of the file.
pub(in super::super) fn whole(body: &[u8], format: &Format, begins: bool) -> (usize, Option<String>) {
    let mut end = body.trim_ascii_end().len();
    // Some exports end in a line of their own.
    let mark = body[..end].strip_suffix(b"EOF").filter(|b| b.is_empty() || b.ends_with(b"\n"));
    if let Some(before) = mark {
        return (before.len(), None);
    }
    let start = memrchr(b'\n', &body[..end]).map_or(0, |k| k + 1);
    // Tabs at its end are separators.
    end = memchr::memchr(b'\n', &body[end..]).map_or(body.len(), |k| end + k);
    let line = &body[start..end];
    let before: Vec<&[u8]> = body[..start].rsplit(|c| *c == b'\n').filter(|l| is_data(l)).take(ROWS).collect();
    if !is_data(line) || (begins && before.is_empty()) || !is_cut(line, end < body.len(), &before, format) {
        return (body.len(), None);
    }
    (start, Some(excerpt(trim(line))))
}

/// Whether the last of some rows with fields separated by blanks is cut off. `ended`: whether its line has an end.
pub(in super::super) fn is_last_row_cut(rows: &[&str], ended: bool) -> bool {
    let [before @ .., last] = rows else { return false };
    let joined = |row: &&str| row.split_whitespace().collect::<Vec<_>>().join(" ").into_bytes();
    let Some(columns) = before.first().map(|row| row.split_whitespace().count()) else { return false };
    let nearest: Vec<Vec<u8>> = before.iter().rev().take(ROWS).map(joined).collect();
    let nearest: Vec<&[u8]> = nearest.iter().map(Vec::as_slice).collect();
    let format = Format { separator: b' ', columns, decimal_comma: false, blank_last: false };
    is_cut(&joined(last), ended, &nearest, &format)
}

/// Whether a last row is cut off, compared with the rows before it (the nearest first): it has fewer fields or, where its line has no end,
/// a last number with fewer decimals.
fn is_cut(line: &[u8], ended: bool, before: &[&[u8]], format: &Format) -> bool {
    let fields = separators(line, format) + 1;
    if fields != format.columns {
        return fields < format.columns;
    }
    let Some(previous) = before.first().filter(|_| !ended) else { return false };
    // A row that ends in a separator, but for this one.
    if separators(previous, format) + 1 > fields {
        return true;
    }
    let last = |line: &[u8]| trim(memrchr(format.separator, line).map_or(line, |k| &line[k + 1..])).to_vec();
    let is_number = |cell: &[u8]| number(cell, format.decimal_comma).is_some();
    let cell = last(line);
    if !is_number(&cell) {
        return is_number(&last(previous));
    }
    // Numbers with one count of decimals, row for row, and this one with fewer: its other digits were not written.
    let decimals = |cell: &[u8]| {
        let point = if format.decimal_comma { b',' } else { b'.' };
        memrchr(point, cell).map_or(0, |k| cell.len() - k)
    };
    let usual = decimals(&last(previous));
    before.len() == ROWS && decimals(&cell) < usual && before.iter().all(|l| decimals(&last(l)) == usual)
}

/// Separators of a row, outside quotes.
fn separators(line: &[u8], format: &Format) -> usize {
    let quoted = |at: usize| memchr_iter(b'"', &line[..at]).count() % 2 == 1;
    memchr_iter(format.separator, line).filter(|at| !quoted(*at)).count()
}

/// Beginning of the text of a row that was left out, for the warning.
pub(in super::super) fn excerpt(row: &[u8]) -> String {
    String::from_utf8_lossy(row).chars().take(40).collect()
}

/// Warning of a last row that was left out; `line` counts from 1.
pub(in super::super) fn cut_warning(file: &str, line: usize, text: &str) -> String {
    format!(
        "{file}: row {line}, the last, is cut off ({text:?}): the logger was stopped while it wrote it; it is left out"
    )
}
