//! CSV: its own chunked reader, one thread a chunk.
//!
//! Comma, semicolon or tab; decimal comma where the separator is a semicolon; blank lines and lines that begin with `#`
//! are skipped; a byte order mark is skipped; the header may stand in the last comment line (as numpy writes it). A
//! cell that is no finite number is remembered and only an error when its column is used, so that a log may carry
//! text beside its signals.

pub(super) mod cut;
mod head;
mod preamble;
mod rows;
mod stamp;

#[cfg(test)]
mod tests;

use memchr::memchr;

use super::error::TraceError;
use super::table::Table;
use stamp::stamp;

pub(super) use head::{Format, Head};
pub(super) use rows::rows;

/// The whole of a file. `file` names it in messages.
///
/// # Errors
/// When there is no header, or a row has too few or too many fields.
pub(super) fn parse(bytes: &[u8], file: &str) -> Result<Table, TraceError> {
    let bytes = unmarked(bytes);
    let head = Head::find(bytes, file)?;
    let body = &bytes[head.body..];
    let format = Format::of(&head, body);
    let (end, cut) = cut::whole(body, &format, true);
    let rows = rows(&body[..end], &format, 0, head.lines + 1).map_err(|r| r.named(file, &format))?;
    Ok(Table {
        bridge_warnings: Vec::new(),
        cut: cut.map(|text| cut::cut_warning(file, head.lines + rows.passed + 1, &text)),
        file: file.to_owned(),
        headers: head.headers,
        columns: rows.columns,
        faults: rows.faults,
        lines: rows.lines,
    })
}

/// The bytes without a byte order mark.
pub(super) fn unmarked(bytes: &[u8]) -> &[u8] {
    bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes)
}

/// Whether a line (without its line end) holds data.
fn is_data(line: &[u8]) -> bool {
    match line.first() {
        None | Some(b'#') => false,
        Some(c) if !c.is_ascii_whitespace() => true,
        Some(_) => trim(line).first().is_some_and(|c| *c != b'#'),
    }
}

/// A number with blanks or quotes around it.
pub(super) fn number(field: &[u8], decimal_comma: bool) -> Option<f64> {
    let mut text = trim(field);
    let mut decimal_comma = decimal_comma;
    if text.len() >= 2 && text[0] == b'"' && text[text.len() - 1] == b'"' {
        text = trim(&text[1..text.len() - 1]);
        // A number stands in quotes for the comma in it, which in groups of three may mean thousands: then it is not told.
        decimal_comma |= memchr(b',', text).is_some() && !thousands(text);
    }
    if decimal_comma && memchr(b',', text).is_some() {
        // Points before the comma part thousands.
        let grouped = |c: u8| c == b'.' && memchr(b':', text).is_none();
        let dotted: Vec<u8> =
            text.iter().filter(|c| !grouped(**c)).map(|c| if *c == b',' { b'.' } else { *c }).collect();
        return fast_float2::parse(&dotted).ok().or_else(|| stamp(text));
    }
    fast_float2::parse(text).ok().or_else(|| stamp(text))
}

/// Whether a text is one to three digits, the first of them no zero, and groups of three behind commas.
fn thousands(text: &[u8]) -> bool {
    let digits = text.strip_prefix(b"-").unwrap_or(text);
    let mut groups = digits.split(|c| *c == b',');
    let first = groups.next().unwrap_or_default();
    (1..=3).contains(&first.len()) && first[0] != b'0' && groups.all(|g| g.len() == 3)
}

fn trim(bytes: &[u8]) -> &[u8] {
    bytes.trim_ascii()
}
