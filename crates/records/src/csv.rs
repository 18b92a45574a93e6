//! CSV: its own chunked reader, one thread a chunk.
//!
//! Comma, semicolon or tab; decimal comma where the separator is a semicolon; blank lines and lines that begin with `#`
//! are skipped; a byte order mark is skipped; the header may stand in the last comment line (as numpy writes it). A
//! cell that is no finite number is remembered and only an error when its column is used, so that a log may carry
//! text beside its signals.

pub(super) mod cut;
mod preamble;
mod stamp;

use std::ops::Range;

use memchr::{memchr, memchr2};
use rayon::prelude::*;

use super::Signal;
use super::error::TraceError;
use preamble::Preamble;
use stamp::stamp;

use super::table::{EXAMPLE, Fault, Header, MAX_COLUMNS, Table, header};

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
    let body = &bytes[head.body..];
    let format = Format::of(&head, body);
    let (end, cut) = cut::whole(body, &format, true);
    let rows = rows(&body[..end], &format, 0, head.lines + 1).map_err(|r| r.named(file, &format))?;
    Ok(Table {
        mended: Vec::new(),
        cut: cut.map(|text| cut::word(file, head.lines + rows.passed + 1, &text)),
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
            if let Some(one) = one {
                one.into_first(all);
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

/// Refuses a name that two columns have. Of a quantity that stands in several units, each in a column of its own, as in the summary of
/// rotary and linear machines, every column keeps its unit in its name; of a signal one is meant, and which is not guessed.
fn distinct(headers: &mut [Header], file: &str) -> Result<(), TraceError> {
    let signal = |name: &str| name.eq_ignore_ascii_case("time") || Signal::from_name(name).is_some();
    let several = |h: &Header| {
        let namesakes = || headers.iter().filter(|o| o.name == h.name);
        let alike = namesakes().filter(|o| o.unit == h.unit).count();
        namesakes().count() > 1 && alike == 1 && namesakes().all(|o| o.unit.is_some()) && !signal(&h.name)
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
            decimal_comma: head.separator != b',' && decimal_comma(body, head.separator),
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
        // A cell that is no number is worse than one without a value, which may be bridged.
        let error = table.column(1).unwrap_err().to_string();
        assert!(error.contains("row 6, column T") && error.contains("\"x\""), "{error}");
        assert!(table.column(2).unwrap_err().to_string().contains("row 2, column note"));
        assert_eq!([table.line(0), table.line(1), table.line(2)], [2, 5, 6]);
    }

    #[test]
    fn a_decimal_comma_is_told_from_the_points_of_dates_and_from_thousands() {
        for (text, expected) in [
            ("time;T\n01.03.2026 12:00:00,5;1,5\n01.03.2026 12:00:01,5;2,5\n", [1.5, 2.5]),
            ("time;T\n0;1.250,5\n1;2,5\n", [1250.5, 2.5]),
            ("time,T\n0,\"1,5\"\n1,\"2,5\"\n", [1.5, 2.5]),
        ] {
            assert_eq!(parse(text).unwrap().column(1).unwrap(), expected, "{text:?}");
        }
        // 1,250 in quotes may be either: it is refused, not guessed.
        assert!(parse("time,T\n0,\"1,250\"\n1,\"2,500\"\n").unwrap().column(1).is_err());
    }

    #[test]
    fn a_row_with_missing_or_extra_fields_is_named_by_its_line() {
        for (text, line, found) in [
            ("time,T\n0,1\n1\n2,1\n", 3, 1),
            ("time,T\n0\n", 2, 1),
            ("time,T\n0,1\n1,2,3,4\n", 3, 4),
            ("time,T,U\n0,1,2\n1,2\n2,0.\n3", 3, 2),
        ] {
            match parse(text) {
                Err(TraceError::Ragged { line: l, found: f, .. }) => assert_eq!((l, f), (line, found), "{text:?}"),
                other => panic!("{text:?}: {other:?}"),
            }
        }
    }

    #[test]
    fn a_last_row_that_is_cut_is_left_out_with_a_word() {
        let fixed: String = (0..20).map(|k| format!("{k},{k}.250\n")).collect();
        for (text, rows, line) in [
            ("time,T\n0,1\n1,2\n2".to_owned(), 2, Some(4)),
            ("time,T\n0,1\n# stopped\n1,2\n2\n\n".to_owned(), 2, Some(5)),
            ("time,T\n0,1\n1,2\n2,".to_owned(), 2, Some(4)),
            ("time,T\n0,1\n1,2\n2,-".to_owned(), 2, Some(4)),
            ("time\tT\n0\t1\n1\t2\n2\t".to_owned(), 2, Some(4)),
            ("time,T,\n0,1,\n1,25,\n2,2".to_owned(), 2, Some(4)),
            (format!("time,T\n{fixed}20,20.2"), 20, Some(22)),
            // Whole as far as can be told: a line end is not needed, and a cell that has none has a value missing.
            (format!("time,T\n{fixed}20,20.250"), 21, None),
            (format!("time,T\n{fixed}20,20.2\n"), 21, None),
            ("time,T\n0,1\n1,2\n2,5".to_owned(), 3, None),
            ("time,T\n0,1\n1,2\n2,\n".to_owned(), 3, None),
            ("time,T\n0,1\n1,2\nEOF\n".to_owned(), 2, None),
        ] {
            let table = parse(&text).unwrap_or_else(|e| panic!("{text:?}: {e}"));
            assert_eq!((table.rows(), table.cut.is_some()), (rows, line.is_some()), "{text:?}: {:?}", table.cut);
            if let Some(line) = line {
                let said = table.cut.unwrap();
                assert!(said.contains(&format!("a.csv: row {line}, the last, is cut off")), "{said}");
            }
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
    fn a_quantity_in_two_units_has_a_column_in_each_and_a_signal_has_one() {
        let table = parse("machine,K [N.m/rad],K_std,K [N/m],K_change\nx,1,0.1,,0\ny,,,3,0\n").unwrap();
        assert_eq!([table.position("K [N.m/rad]"), table.position("K [N/m]")], [Some(1), Some(3)]);
        assert_eq!(table.position("K"), None, "which of the two is not guessed");
        assert_eq!(table.headers[3].unit.as_deref(), Some("N/m"));
        for twice in ["a,K [N/m],K [N/m]\n0,1,2\n", "a,K,K [N/m]\n0,1,2\n", "a,theta1 [rad],theta1 [deg]\n0,1,2\n"] {
            assert!(parse(twice).unwrap_err().to_string().contains("fields 2 and 3"), "{twice}");
        }
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
