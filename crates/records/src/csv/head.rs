//! What stands before the data: the header, its separator and names, and how numbers are written.

use memchr::memchr;

use super::preamble::Preamble;
use super::{number, trim};
use crate::Signal;
use crate::error::TraceError;
use crate::table::{EXAMPLE, Header, MAX_COLUMNS, header};

/// Longest header line, bytes.
pub(super) const MAX_HEADER: usize = 1 << 20;

/// What stands before the data.
pub(crate) struct Head {
    pub headers: Vec<Header>,
    pub(super) separator: u8,
    /// The header ends in a separator: an empty last field is allowed.
    pub(super) blank_last: bool,
    /// Where the data begins, bytes.
    pub body: usize,
    /// Lines before it.
    pub lines: usize,
}

impl Head {
    /// The header of a file without byte order mark; `file` names it in messages.
    ///
    /// # Errors
    /// When there is no header, it is too long, or two columns have one name.
    pub fn find(bytes: &[u8], file: &str) -> Result<Self, TraceError> {
        let none = |what: String| TraceError::NoTable { file: file.to_owned(), what };
        let (mut at, mut lines) = (0, 0);
        let mut comment: Option<&[u8]> = None;
        while at < bytes.len() {
            let end = memchr(b'\n', &bytes[at..]).map_or(bytes.len(), |k| at + k);
            let next = (end + 1).min(bytes.len());
            let text = trim(&bytes[at..end]);
            if text.len() > MAX_HEADER {
                return Err(none(format!("line {} is longer than {MAX_HEADER} bytes; {EXAMPLE}", lines + 1)));
            }
            if let Some(stripped) = text.strip_prefix(b"#") {
                comment = Some(trim(stripped));
            } else if !text.is_empty() {
                let separator = separator(text);
                let (mut fields, mut blank_last) = split(text, separator);
                let mut body = next;
                let mut counted = lines + 1;
                if let Some(found) = Preamble::find(bytes, at, lines, fields.len(), separator) {
                    return found.head(file);
                }
                if fields.iter().all(|f| number(f.as_bytes(), separator == b';').is_some()) {
                    // The first row is data: numpy writes the header as a comment above it.
                    let Some(above) = comment else {
                        return Err(none(format!("row {}: there is no header row; {EXAMPLE}", lines + 1)));
                    };
                    let (names, blank) = split(above, separator);
                    if names.len() != fields.len() {
                        return Err(none(format!(
                            "row {}: there is no header row (the comment above it has {} fields, the row {}); {EXAMPLE}",
                            lines + 1,
                            names.len(),
                            fields.len()
                        )));
                    }
                    (fields, blank_last) = (names, blank);
                    (body, counted) = (at, lines);
                }
                if fields.len() > MAX_COLUMNS {
                    return Err(none(format!("{} columns; at most {MAX_COLUMNS} are read", fields.len())));
                }
                let mut headers: Vec<Header> = fields.iter().map(|f| header(f)).collect();
                distinct(&mut headers, file)?;
                return Ok(Self { headers, separator, blank_last, body, lines: counted });
            }
            at = next;
            lines += 1;
        }
        Err(none(format!("the file is empty; {EXAMPLE}")))
    }
}

/// Refuses a name that two columns have. A quantity may be given in several units, one column for each, as in the summary of rotary and
/// linear machines: each of these columns gets its unit into its name. Two columns with the name of a signal are always refused.
///
/// # Errors
/// [`TraceError::TwiceNamed`] when two columns have one name.
pub(super) fn distinct(headers: &mut [Header], file: &str) -> Result<(), TraceError> {
    let signal = |name: &str| name.eq_ignore_ascii_case("time") || Signal::from_name(name).is_some();
    let several = |h: &Header| {
        let same_name = || headers.iter().filter(|o| o.name == h.name);
        let same_unit = same_name().filter(|o| o.unit == h.unit).count();
        same_name().count() > 1 && same_unit == 1 && same_name().all(|o| o.unit.is_some()) && !signal(&h.name)
    };
    let several: Vec<bool> = headers.iter().map(several).collect();
    for (header, _) in headers.iter_mut().zip(several).filter(|(_, several)| *several) {
        if let Some(unit) = &header.unit {
            header.name = format!("{} [{unit}]", header.name);
        }
    }
    for (k, one) in headers.iter().enumerate() {
        if let Some(other) = headers[..k].iter().position(|h| h.name == one.name && !one.name.is_empty()) {
            return Err(TraceError::TwiceNamed {
                file: file.to_owned(),
                column: one.name.clone(),
                first: other + 1,
                second: k + 1,
            });
        }
    }
    Ok(())
}

/// Whether a cell is a number.
pub(super) fn number_of(cell: &str, decimal_comma: bool) -> bool {
    number(cell.as_bytes(), decimal_comma).is_some()
}

/// The separator that the header has most of, outside quotes.
pub(super) fn separator(line: &[u8]) -> u8 {
    let mut quoted = false;
    let mut counts = [0_usize; 3];
    for &c in line {
        match c {
            b'"' => quoted = !quoted,
            b';' if !quoted => counts[0] += 1,
            b'\t' if !quoted => counts[1] += 1,
            b',' if !quoted => counts[2] += 1,
            _ => {}
        }
    }
    // A semicolon or tab wins over commas, which may be decimal commas or part of a unit.
    match counts {
        [s, t, _] if s > 0 && s >= t => b';',
        [_, t, _] if t > 0 => b'\t',
        _ => b',',
    }
}

/// Fields of a header line, quotes taken off (RFC 4180, by csv-core), and whether it ended in a separator.
pub(super) fn split(line: &[u8], separator: u8) -> (Vec<String>, bool) {
    let mut reader = csv_core::ReaderBuilder::new().delimiter(separator).build();
    let mut output = vec![0; line.len() + 1];
    let mut ends = vec![0; line.len() + 2];
    let (_, _, written, mut count) = reader.read_record(line, &mut output, &mut ends);
    let (_, _, more, extra) = reader.read_record(&[], &mut output[written..], &mut ends[count..]);
    count += extra;
    let text = &output[..written + more];
    let mut fields = Vec::with_capacity(count);
    let mut start = 0;
    for &end in &ends[..count] {
        fields.push(String::from_utf8_lossy(trim(&text[start..end])).into_owned());
        start = end;
    }
    let blank = fields.len() > 1 && fields.last().is_some_and(String::is_empty);
    if blank {
        fields.pop();
    }
    (fields, blank)
}

/// Whether numbers are written with a decimal comma, from the first rows of a file separated by semicolons or tabs. Points and commas of
/// time stamps say nothing; of a number with both the last one is the decimal sign.
fn decimal_comma(body: &[u8], separator: u8) -> bool {
    let first = &body[..body.len().min(4096)];
    let (mut comma, mut point) = (false, false);
    for cell in first.split(|c| *c == separator || *c == b'\n').filter(|c| memchr(b':', c).is_none()) {
        if number(cell, true).is_none() && number(cell, false).is_none() {
            continue;
        }
        match cell.iter().rfind(|c| matches!(c, b',' | b'.')) {
            Some(b',') => comma = true,
            Some(_) => point = true,
            None => {}
        }
    }
    comma && !point
}

/// How rows are written.
pub(crate) struct Format {
    pub(super) separator: u8,
    pub(super) columns: usize,
    pub(super) decimal_comma: bool,
    pub(super) blank_last: bool,
}

impl Format {
    /// From the header and the first rows.
    pub fn of(head: &Head, body: &[u8]) -> Self {
        Self {
            separator: head.separator,
            columns: head.headers.len(),
            decimal_comma: head.separator != b',' && decimal_comma(body, head.separator),
            blank_last: head.blank_last,
        }
    }
}
