//! CSV: its own chunked reader, one thread a chunk.
//!
//! Comma, semicolon or tab; decimal comma where the separator is a semicolon; blank lines and lines that begin with `#`
//! are skipped; a byte order mark is skipped; the header may stand in the last comment line (as numpy writes it). A
//! cell that is no finite number is remembered and only an error when its column is used, so that a log may carry
//! text beside its signals.

use std::ops::Range;

use memchr::{memchr, memchr2};
use rayon::prelude::*;

use super::error::TraceError;
use super::table::{EXAMPLE, Fault, Header, MAX_COLUMNS, Table, header};
use super::units::Unit;

/// Longest header line, bytes.
const MAX_HEADER: usize = 1 << 20;
/// Least bytes a thread is started for.
const CHUNK: usize = 1 << 18;

/// The whole of a file. `file` names it in messages.
///
/// # Errors
/// When there is no header, or a row has too few or too many fields.
pub(super) fn parse(bytes: &[u8], file: &str) -> Result<Table, TraceError> {
    let bytes = unmarked(bytes);
    let head = Head::find(bytes, file)?;
    let body = without_end_mark(&bytes[head.body..]);
    let format = Format::of(&head, body);
    let rows = rows(body, &format, 0, head.lines + 1).map_err(|r| r.named(file, &format))?;
    Ok(Table {
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

/// Rows of data, whole lines.
pub(super) struct Rows {
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
pub(super) fn rows(body: &[u8], format: &Format, row: usize, line: usize) -> Result<Rows, Ragged> {
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
            if all.is_none() {
                *all = one;
            }
        }
        lines.extend(parsed.lines);
    }
    Ok(Rows { columns, faults, lines, passed })
}

/// What stands before the data.
pub(super) struct Head {
    pub headers: Vec<Header>,
    separator: u8,
    /// The header ends in a separator: an empty last field is allowed.
    blank_last: bool,
    /// Where the data begins, bytes.
    pub body: usize,
    /// Lines before it.
    pub lines: usize,
}

impl Head {
    /// The header of a file without byte order mark; `file` names it in messages.
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
                let headers: Vec<Header> = fields.iter().map(|f| header(f)).collect();
                distinct(&headers, file)?;
                return Ok(Self { headers, separator, blank_last, body, lines: counted });
            }
            at = next;
            lines += 1;
        }
        Err(none(format!("the file is empty; {EXAMPLE}")))
    }
}

/// Refuses a name that two columns have.
fn distinct(headers: &[Header], file: &str) -> Result<(), TraceError> {
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

/// A body without the line `EOF` that some exports end in.
fn without_end_mark(body: &[u8]) -> &[u8] {
    body.trim_ascii_end().strip_suffix(b"EOF").filter(|b| b.is_empty() || b.ends_with(b"\n")).unwrap_or(body)
}

/// Whether a field can stand in a row of units.
fn is_unit(field: &str) -> bool {
    let inner = field.trim().trim_start_matches(['[', '(']).trim_end_matches([']', ')']);
    inner.is_empty() || inner == "-" || Unit::parse(inner).is_some()
}

/// Most lines before the data.
const MAX_PREAMBLE: usize = 400;

/// Lines above the data that are no header row alone: what the logger says of itself, a row of units, the channel heads of
/// TwinCAT Scope (Beckhoff Information System, TE13xx, Export in csv: name and value side by side, then a column of time in
/// milliseconds and one of values for each channel).
struct Preamble {
    names: Vec<String>,
    units: Option<Vec<String>>,
    separator: u8,
    blank_last: bool,
    body: usize,
    lines: usize,
}

impl Preamble {
    /// Looks for them from the first line with text, which is at `at`, has `lines` lines before it and `first` fields. None
    /// where that line is the header and the next one data.
    fn find(bytes: &[u8], at: usize, lines: usize, first: usize, separator_of_first: u8) -> Option<Self> {
        struct Line<'a> {
            text: &'a [u8],
            end: usize,
            number: usize,
        }
        let mut found: Vec<Line> = Vec::new();
        let (mut at, mut number) = (at, lines);
        while at < bytes.len() && found.len() < MAX_PREAMBLE {
            let end = memchr(b'\n', &bytes[at..]).map_or(bytes.len(), |k| at + k);
            let text = trim(&bytes[at..end]);
            number += 1;
            at = (end + 1).min(bytes.len());
            if text.len() > MAX_HEADER {
                return None;
            }
            if !text.is_empty() && !text.starts_with(b"#") {
                found.push(Line { text, end: at, number });
            }
            if found.len() == 2 {
                // The usual file: a header, then data of as many fields.
                let (cells, _) = split(found[1].text, separator_of_first);
                let comma = separator_of_first == b';';
                let data = cells.iter().any(|c| number_of(c, comma));
                if cells.len() == first && data {
                    return None;
                }
            }
        }
        let data_at = |k: usize| -> Option<(u8, usize)> {
            let separator = separator(found[k].text);
            let (cells, _) = split(found[k].text, separator);
            let numbers = cells.iter().filter(|c| number_of(c, true)).count();
            let leads = cells.iter().find(|c| !c.is_empty()).is_some_and(|c| number_of(c, true));
            (cells.len() >= 2 && leads && 2 * numbers >= cells.len()).then_some((separator, cells.len()))
        };
        let (k, (separator, width)) = (1..found.len()).find_map(|k| {
            let one = data_at(k)?;
            let follows = k + 1 >= found.len() || data_at(k + 1) == Some(one) || trim(found[k + 1].text) == b"EOF";
            follows.then_some((k, one))
        })?;
        let fields = |k: usize| split(found[k].text, separator);
        let fits = |k: usize| {
            let (cells, blank) = fields(k);
            (cells.len() == width || (cells.len() + 1 == width && blank)) && !cells.iter().all(|c| number_of(c, true))
        };
        let (body, lines) = (found[k - 1].end, found[k - 1].number);
        let paired = (0..k).any(|i| fields(i).0.first().is_some_and(|c| c.starts_with("SampleTime")));
        if paired {
            let (cells, _) = fields((0..k).rfind(|i| fits(*i) && fields(*i).0.first().is_some_and(|c| c == "Name"))?);
            let names = (0..width).map(|i| match (i % 2, i) {
                (1, i) => cells.get(i).cloned().unwrap_or_default(),
                (_, 0) => "time [ms]".to_owned(),
                (_, i) => format!("time {} [ms]", i / 2 + 1),
            });
            return Some(Self { names: names.collect(), units: None, separator, blank_last: true, body, lines });
        }
        let last = (0..k).rfind(|i| fits(*i))?;
        let (cells, blank_last) = fields(last);
        let above = (last > 0 && cells.iter().all(|c| is_unit(c)) && cells.iter().any(|c| !c.is_empty() && c != "-"))
            .then(|| (0..last).rfind(|i| fits(*i)))
            .flatten();
        let (names, units) = match above {
            Some(above) => (fields(above).0, Some(cells)),
            None => (cells, None),
        };
        Some(Self { names, units, separator, blank_last, body, lines })
    }

    fn head(self, file: &str) -> Result<Head, TraceError> {
        if self.names.len() > MAX_COLUMNS {
            let what = format!("{} columns; at most {MAX_COLUMNS} are read", self.names.len());
            return Err(TraceError::NoTable { file: file.to_owned(), what });
        }
        let mut headers: Vec<Header> = self.names.iter().map(|f| header(f)).collect();
        for (header, unit) in headers.iter_mut().zip(self.units.iter().flatten()) {
            let inner = unit.trim().trim_start_matches(['[', '(']).trim_end_matches([']', ')']);
            if header.unit.is_none() && !inner.is_empty() && inner != "-" {
                header.unit = Some(inner.to_owned());
            }
        }
        distinct(&headers, file)?;
        Ok(Head { headers, separator: self.separator, blank_last: self.blank_last, body: self.body, lines: self.lines })
    }
}

/// Whether a cell is a number.
fn number_of(cell: &str, decimal_comma: bool) -> bool {
    number(cell.as_bytes(), decimal_comma).is_some()
}

/// The separator that the header has most of, outside quotes.
fn separator(line: &[u8]) -> u8 {
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
fn split(line: &[u8], separator: u8) -> (Vec<String>, bool) {
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

/// Whether numbers are written with a decimal comma, from the first rows of a file separated by semicolons.
fn decimal_comma(body: &[u8]) -> bool {
    let first = &body[..body.len().min(4096)];
    memchr(b',', first).is_some() && memchr(b'.', first).is_none()
}

/// Cuts the body at line ends into about as many pieces as keep every thread busy.
fn chunks(body: &[u8]) -> Vec<Range<usize>> {
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

/// Whether a line (without its line end) holds data.
fn is_data(line: &[u8]) -> bool {
    match line.first() {
        None | Some(b'#') => false,
        Some(c) if !c.is_ascii_whitespace() => true,
        Some(_) => trim(line).first().is_some_and(|c| *c != b'#'),
    }
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

/// How rows are written.
pub(super) struct Format {
    separator: u8,
    columns: usize,
    decimal_comma: bool,
    blank_last: bool,
}

impl Format {
    /// From the header and the first rows.
    pub fn of(head: &Head, body: &[u8]) -> Self {
        Self {
            separator: head.separator,
            columns: head.headers.len(),
            decimal_comma: head.separator != b',' && decimal_comma(body),
            blank_last: head.blank_last,
        }
    }
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
pub(super) struct Ragged {
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
                    let end = memchr2(format.separator, b'\n', &bytes[at..]).map_or(bytes.len(), |k| at + k);
                    (number(&bytes[at..end], format.decimal_comma), end)
                }
            };
            if field < format.columns {
                let value = value.unwrap_or(f64::NAN);
                self.out[field][row] = value;
                if !value.is_finite() && faults[field].is_none() {
                    let mut text = String::from_utf8_lossy(trim(&bytes[at..end])).into_owned();
                    text.truncate(text.char_indices().nth(40).map_or(text.len(), |(k, _)| k));
                    faults[field] = Some(Fault { line, text });
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

/// A number with blanks or quotes around it.
fn number(field: &[u8], decimal_comma: bool) -> Option<f64> {
    let mut text = trim(field);
    if text.len() >= 2 && text[0] == b'"' && text[text.len() - 1] == b'"' {
        text = trim(&text[1..text.len() - 1]);
    }
    if decimal_comma && memchr(b',', text).is_some() {
        let dotted: Vec<u8> = text.iter().map(|c| if *c == b',' { b'.' } else { *c }).collect();
        return fast_float2::parse(&dotted).ok();
    }
    fast_float2::parse(text).ok().or_else(|| stamp(text))
}

/// A time of the calendar (ISO 8601, `2026-03-01T12:00:00.125Z`) as seconds since 2000, which leave a double a tenth of a
/// microsecond; a time of the day alone as seconds since midnight.
fn stamp(text: &[u8]) -> Option<f64> {
    // The length alone tells nearly every other text.
    if !(8..=40).contains(&text.len()) || !text[0].is_ascii_digit() {
        return None;
    }
    let text = std::str::from_utf8(text).ok()?;
    let (date, clock) = match text.split_once(['T', ' ']) {
        Some((date, clock)) => (Some(date), clock),
        None => (None, text),
    };
    let (clock, zone) = match clock.strip_suffix('Z') {
        Some(clock) => (clock, 0.0),
        None => match clock.rfind(['+', '-']) {
            Some(k) => {
                let (hours, minutes) = clock[k + 1..].split_once(':').unwrap_or((&clock[k + 1..], "0"));
                let size = hours.parse::<f64>().ok()? * 3600.0 + minutes.parse::<f64>().ok()? * 60.0;
                (&clock[..k], if clock[k..].starts_with('-') { -size } else { size })
            }
            None => (clock, 0.0),
        },
    };
    let mut parts = clock.splitn(3, ':');
    let mut next = |most: f64| parts.next()?.replace(',', ".").parse::<f64>().ok().filter(|v| (0.0..most).contains(v));
    let (h, m, s) = (next(24.0)?, next(60.0)?, next(61.0)?);
    let seconds = h * 3600.0 + m * 60.0 + s;
    let Some(date) = date else { return Some(seconds) };
    let mut parts = date.splitn(3, '-').map(|p| p.parse::<i64>().ok());
    let (y, month, d) = (parts.next()??, parts.next()??, parts.next()??);
    if !(1600..4000).contains(&y) || !(1..=12).contains(&month) || !(1..=31).contains(&d) {
        return None;
    }
    // Days of the civil calendar (H. Hinnant, chrono-compatible low-level date algorithms), counted from 2000-01-01.
    let (y, month) = if month <= 2 { (y - 1, month + 9) } else { (y, month - 3) };
    let era = y.div_euclid(400);
    let day =
        era * 146_097 + (y - era * 400) * 365 + (y - era * 400) / 4 - (y - era * 400) / 100 + (153 * month + 2) / 5 + d
            - 1;
    let from_2000 = day - 730_425;
    Some(from_2000 as f64 * 86_400.0 + seconds - zone)
}

fn trim(bytes: &[u8]) -> &[u8] {
    bytes.trim_ascii()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<Table, TraceError> {
        super::parse(text.as_bytes(), "a.csv")
    }

    #[test]
    fn separators_bom_quotes_crlf_and_decimal_commas_are_read() {
        let expected = [[0.0, 1.5], [0.1, -2.5e-3]];
        for text in [
            "time [s],T [N.m]\n0,1.5\n0.1,-2.5e-3\n",
            "\u{feff}time [s];T [N.m]\r\n0;1.5\r\n0.1;-2.5e-3",
            "time [s]\tT [N.m]\n0\t1.5\n\n0.1\t-2.5e-3\n",
            "time [s];T [N.m]\n0;1,5\n0,1;-2,5e-3\n",
            "\"time [s]\",\"T [N.m]\"\n\"0\", 1.5 \n 0.1,\"-2.5e-3\"\n",
            "# made by hand\ntime [s], T [N.m],\n0,1.5,\n# half way\n0.1,-2.5e-3,\n",
            "# time [s], T [N.m]\n0,1.5\n0.1,-2.5e-3\n",
        ] {
            let table = parse(text).unwrap_or_else(|e| panic!("{text:?}: {e}"));
            assert_eq!(table.headers[0], Header { name: "time".into(), unit: Some("s".into()) }, "{text:?}");
            assert_eq!(table.headers[1], Header { name: "T".into(), unit: Some("N.m".into()) }, "{text:?}");
            for (k, row) in expected.iter().enumerate() {
                assert_eq!([table.column(0).unwrap()[k], table.column(1).unwrap()[k]], *row, "{text:?}");
            }
            assert_eq!(table.rows(), 2);
        }
    }

    #[test]
    fn a_bad_cell_is_an_error_only_where_its_column_is_used_and_names_its_line() {
        let table = parse("time,T,note\n0,1,start\n\n# pause\n1,nan,go\n2,x,end\n").unwrap();
        assert_eq!(table.column(0).unwrap(), [0.0, 1.0, 2.0]);
        let error = table.column(1).unwrap_err().to_string();
        assert!(error.contains("row 5, column T") && error.contains("nan"), "{error}");
        assert!(table.column(2).unwrap_err().to_string().contains("row 2, column note"));
        assert_eq!([table.line(0), table.line(1), table.line(2)], [2, 5, 6]);
    }

    #[test]
    fn a_row_with_missing_or_extra_fields_is_named_by_its_line() {
        for (text, line, found) in [
            ("time,T\n0,1\n1\n", 3, 1),
            ("time,T\n0,1\n1,2,3,4\n", 3, 4),
            ("time,T\n0,1\n1,2\n2,", 4, 2),
            ("time,T,U\n0,1,2\n1,2,3\n2,0.", 4, 2),
        ] {
            match parse(text) {
                Err(TraceError::Ragged { line: l, found: f, .. }) => assert_eq!((l, f), (line, found), "{text:?}"),
                Ok(table) if line == 4 && found == 2 => assert!(table.column(1).is_err(), "{text:?}"),
                other => panic!("{text:?}: {other:?}"),
            }
        }
    }

    #[test]
    fn lines_above_the_header_a_row_of_units_and_a_mark_at_the_end_are_understood() {
        for text in [
            "Logger 7\nDate;2026-03-01\nRate;1000\n\ntime;T\ns;N.m\n0;1,5\n0,1;-2,5\n",
            "time,T\n[s],[N.m]\n0,1.5\n0.1,-2.5\nEOF\n",
            "time (s),T/(N.m)\n0,1.5\n0.1,-2.5\n",
            "machine: lathe\ntime [s]\tT [N.m]\n0\t1.5\n0.1\t-2.5\n",
        ] {
            let table = parse(text).unwrap_or_else(|e| panic!("{text:?}: {e}"));
            assert_eq!(table.headers[0], Header { name: "time".into(), unit: Some("s".into()) }, "{text:?}");
            assert_eq!(table.headers[1], Header { name: "T".into(), unit: Some("N.m".into()) }, "{text:?}");
            assert_eq!(table.column(1).unwrap(), [1.5, -2.5], "{text:?}");
        }
        // A second row of words is a bad row of data, not a header.
        assert!(parse("time,T\na,b\n0,1\n1,2\n").is_ok());
    }

    #[test]
    fn an_export_of_twincat_scope_is_read_with_a_column_of_time_for_each_channel() {
        let text = "Name\tScope01\r\nFile\t\r\nStartRecord\t128783093223690000\tThursday\t13:08:42\r\n\r\n\
                    Name\tActPos\tName\tTorque\r\nSampleTime[ms]\t1\tSampleTime[ms]\t1\r\nData-Type\tREAL64\tData-Type\tREAL64\r\n\
                    VariableSize\t8\tVariableSize\t8\r\n\r\n0\t-1,037\t0\t5,5\r\n1\t-1,035\t1\t5,25\r\n";
        let table = parse(text).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(table.names(), "time, ActPos, time 2, Torque");
        assert_eq!(table.headers[0].unit.as_deref(), Some("ms"));
        assert_eq!(table.column(3).unwrap(), [5.5, 5.25]);
    }

    #[test]
    fn times_of_the_calendar_and_of_the_day_are_seconds() {
        // Python: datetime.fromisoformat("2026-03-01T12:00:00.125+00:00").timestamp() - 946684800
        assert_eq!(stamp(b"2026-03-01T12:00:00.125Z"), Some(825_681_600.125));
        assert_eq!(stamp(b"2026-03-01 13:00:00.125+01:00"), Some(825_681_600.125));
        assert_eq!(stamp(b"2000-01-01T00:00:00"), Some(0.0));
        assert_eq!(stamp(b"01:02:03,5"), Some(3723.5));
        for text in ["2026-13-01T00:00:00", "25:00:00", "10.0.0.1", "12:30", "2026-03-01"] {
            assert_eq!(stamp(text.as_bytes()), None, "{text}");
        }
    }

    #[test]
    fn a_file_without_header_or_data_says_what_a_trace_looks_like() {
        for text in ["", "\n\n", "0,1\n1,2\n"] {
            assert!(parse(text).unwrap_err().to_string().contains("header row such as"), "{text:?}");
        }
        assert!(parse("T,T\n0,1\n").unwrap_err().to_string().contains("fields 1 and 2"));
    }

    #[test]
    fn many_chunks_give_the_same_table_as_one() {
        let mut text = String::from("time,a\n");
        for k in 0..200_000 {
            if k % 1000 == 7 {
                text.push_str("# a comment\n");
            }
            text.push_str(&format!("{k},{}\n", f64::from(k) * 0.25));
        }
        let table = parse(&text).unwrap();
        assert!(chunks(text.as_bytes()).len() > 1);
        assert_eq!(table.rows(), 200_000);
        assert!(table.column(1).unwrap().iter().enumerate().all(|(k, v)| *v == k as f64 * 0.25));
        // Row 150000 (k from 0) has the header and the comments of k = 7, 1007, .. 149007 before it.
        assert_eq!(table.line(150_000), 150_000 + 2 + 150);
    }
}
