//! Finds the form of a text, and converts what is no plain CSV: UTF-16, the logs of LinuxCNC, columns separated by blanks.
//!
//! Sources: halscope's `write_log_file` (LinuxCNC, src/hal/utils/scope_files.c) writes the period in nanoseconds and then a
//! line a sample, each value behind the name of its channel; halsampler(1) writes the values alone, with `-t` the number of
//! the sample first.

use super::csv::cut::{cut_warning, excerpt, is_last_row_cut};
use super::error::TraceError;
use super::table::{Fault, Header, MAX_CELLS, MAX_COLUMNS, Table};
use super::vendors;

/// What the text of a file is.
pub(super) enum Form {
    /// A table.
    Table(Table),
    /// CSV, in other bytes than the file's.
    Csv(Vec<u8>),
    /// CSV as it is.
    Plain,
}

/// Finds the form of a text, and converts it to a table or to CSV where it is neither.
///
/// # Errors
/// When the bytes are no text of a known encoding, or are of a known form and damaged.
pub(super) fn of(bytes: &[u8], file: &str) -> Result<Form, TraceError> {
    if let [0xff, 0xfe, rest @ ..] = bytes {
        return utf16(rest, u16::from_le_bytes, file);
    }
    if let [0xfe, 0xff, rest @ ..] = bytes {
        return utf16(rest, u16::from_be_bytes, file);
    }
    let text = super::csv::unmarked(bytes);
    // UTF-16 without its mark: the other byte of a plain character is zero.
    let head = &text[..text.len().min(HEAD) / 2 * 2];
    let zeros = |from: usize| head.iter().skip(from).step_by(2).filter(|c| **c == 0).count();
    if head.len() >= 16 && zeros(1) * 10 > head.len() / 2 * 9 {
        return utf16(text, u16::from_le_bytes, file);
    }
    if head.len() >= 16 && zeros(0) * 10 > head.len() / 2 * 9 {
        return utf16(text, u16::from_be_bytes, file);
    }
    // A logger that lost its power leaves a few zeros, which errors of their cells name; with many of them it is no text.
    if (zeros(0) + zeros(1)) * 20 > head.len() {
        return Err(TraceError::Format {
            file: file.to_owned(),
            what: "it is neither text nor a form that is known (CSV, Excel, Parquet, MATLAB, NumPy .npz, JSON, HDF5); export the log as \
                   CSV"
                .to_owned(),
        });
    }
    // Text of one byte a letter, as Windows wrote it in the west, and lines that end as on old Macintoshes.
    if let Err(at) = std::str::from_utf8(head)
        && at.error_len().is_some()
    {
        let text: String = text.iter().map(|c| char::from(*c)).collect();
        return plain(of(text.as_bytes(), file)?, text.as_bytes());
    }
    if memchr::memchr(b'\n', text).is_none() && memchr::memchr(b'\r', text).is_some() {
        let text: Vec<u8> = text.iter().map(|c| if *c == b'\r' { b'\n' } else { *c }).collect();
        return plain(of(&text, file)?, &text);
    }
    let first = text.trim_ascii_start();
    if first.starts_with(b"{")
        || first.starts_with(b"[{")
        || (first.starts_with(b"[") && first.trim_ascii_end().ends_with(b"]"))
    {
        return super::json::read(text, file).map(Form::Table);
    }
    if vendors::is_xml(text) {
        return vendors::sinumerik(text, file).map(Form::Table);
    }
    if vendors::is_tncscope(text) {
        return vendors::tncscope(text, file).map(Form::Table);
    }
    if first.starts_with(b"Sampling period is") {
        return halscope(text, file).map(Form::Table);
    }
    Ok(blanks(text).map_or(Form::Plain, Form::Csv))
}

/// Bytes of a text by which its encoding is found.
const HEAD: usize = 1 << 16;

/// CSV in other bytes than the file's.
fn plain(form: Form, text: &[u8]) -> Result<Form, TraceError> {
    Ok(if matches!(form, Form::Plain) { Form::Csv(text.to_vec()) } else { form })
}

fn utf16(bytes: &[u8], unit: fn([u8; 2]) -> u16, file: &str) -> Result<Form, TraceError> {
    let units = bytes.chunks_exact(2).map(|b| unit([b[0], b[1]]));
    let text: Result<String, _> = char::decode_utf16(units).collect();
    let text = text.map_err(|_| TraceError::Format {
        file: file.to_owned(),
        what: "it begins as UTF-16 and is not; save it as UTF-8".to_owned(),
    })?;
    plain(of(text.as_bytes(), file)?, text.as_bytes())
}

/// Columns that are filled row by row, each by its name.
#[derive(Default)]
pub(super) struct Filled {
    headers: Vec<Header>,
    columns: Vec<Vec<f64>>,
    faults: Vec<Option<Fault>>,
    rows: usize,
}

impl Filled {
    /// Ends a row: what it did not have is missing.
    pub fn end(&mut self, line: usize) {
        self.rows += 1;
        for (column, fault) in self.columns.iter_mut().zip(&mut self.faults) {
            if column.len() < self.rows {
                column.push(f64::NAN);
                Fault { line, text: String::new() }.into_first(fault);
            }
        }
    }

    /// Puts a value into the row that is being filled; `text` is what stands there, for a fault.
    ///
    /// # Errors
    /// When there are more columns or numbers than are read.
    pub fn put(
        &mut self,
        name: &str,
        value: Option<f64>,
        text: impl FnOnce() -> String,
        line: usize,
        file: &str,
    ) -> Result<(), TraceError> {
        let limit = |what: String| TraceError::NoTable { file: file.to_owned(), what };
        let index = match self.headers.iter().position(|h| h.name == super::table::header(name).name) {
            Some(index) => index,
            None => {
                if self.headers.len() == MAX_COLUMNS {
                    return Err(limit(format!("more than {MAX_COLUMNS} columns")));
                }
                self.headers.push(super::table::header(name));
                // Rows before the first that names it have none of it.
                self.columns.push(vec![f64::NAN; self.rows]);
                self.faults.push((self.rows > 0).then(|| Fault { line: 1, text: String::new() }));
                self.headers.len() - 1
            }
        };
        if self.headers.len() * (self.rows + 1) > MAX_CELLS {
            return Err(limit(format!("more than {MAX_CELLS} numbers; cut the record into parts")));
        }
        if self.columns[index].len() > self.rows {
            return Ok(());
        }
        let number = value.filter(|v| v.is_finite());
        if number.is_none() {
            let mut text = text();
            text.truncate(text.char_indices().nth(40).map_or(text.len(), |(k, _)| k));
            Fault { line, text }.into_first(&mut self.faults[index]);
        }
        self.columns[index].push(number.unwrap_or(f64::NAN));
        Ok(())
    }

    /// Rows that were ended.
    pub const fn rows(&self) -> usize {
        self.rows
    }

    /// Whether no row named a column.
    pub const fn is_empty(&self) -> bool {
        self.headers.is_empty()
    }

    /// The table.
    pub fn table(self, file: &str, first_line: usize) -> Table {
        Table {
            file: file.to_owned(),
            headers: self.headers,
            columns: self.columns,
            faults: self.faults,
            lines: vec![(0, first_line)],
            bridge_warnings: Vec::new(),
            cut: None,
        }
    }
}

/// A saved log of halscope.
fn halscope(bytes: &[u8], file: &str) -> Result<Table, TraceError> {
    let wrong = |what: String| TraceError::Format { file: file.to_owned(), what };
    let text = String::from_utf8_lossy(bytes);
    let mut lines = text.lines().enumerate();
    let period = lines.next().and_then(|(_, l)| l.split_whitespace().nth(3)?.parse::<f64>().ok()).filter(|p| *p > 0.0);
    let period =
        period.ok_or_else(|| wrong("row 1: no sampling period, as in: Sampling period is 1000000 ns".to_owned()))?;
    let (numbers, mut rows): (Vec<usize>, Vec<&str>) =
        lines.filter(|(_, line)| !line.trim().is_empty()).map(|(k, line)| (k + 1, line)).unzip();
    let mut cut = None;
    if is_last_row_cut(&rows, text.ends_with('\n')) {
        cut = rows.pop().map(|row| cut_warning(file, numbers[rows.len()], &excerpt(row.trim().as_bytes())));
    }
    let mut filled = Filled::default();
    for (row, &line) in rows.iter().zip(&numbers) {
        let words: Vec<&str> = row.split_whitespace().collect();
        if !words.len().is_multiple_of(2) {
            let what =
                format!("row {line}: {} words; halscope writes a name and a value for each channel", words.len());
            return Err(wrong(what));
        }
        filled.put("time", Some(filled.rows as f64 * period * 1e-9), String::new, line, file)?;
        for pair in words.chunks_exact(2) {
            filled.put(pair[0], pair[1].parse().ok(), || pair[1].to_owned(), line, file)?;
        }
        filled.end(line);
    }
    Ok(Table { cut, ..filled.table(file, numbers.first().copied().unwrap_or(1)) })
}

/// Columns separated by blanks, as CSV; None where a comma, a semicolon or a tab separates, or there is one column. Without
/// a header (halsampler) the columns are `column 1`, `column 2`, ...
fn blanks(text: &[u8]) -> Option<Vec<u8>> {
    let content = |line: &&[u8]| !line.trim_ascii().is_empty() && !line.trim_ascii().starts_with(b"#");
    let head: Vec<&[u8]> = text.split(|b| *b == b'\n').filter(content).take(3).collect();
    let separated = |line: &[u8]| line.trim_ascii().iter().any(|c| matches!(c, b',' | b';' | b'\t' | b'"'));
    let words = |line: &[u8]| line.split(u8::is_ascii_whitespace).filter(|w| !w.is_empty()).count();
    let numbers = |line: &[u8]| {
        line.split(u8::is_ascii_whitespace).filter(|w| !w.is_empty()).all(|w| fast_float2::parse::<f64, _>(w).is_ok())
    };
    let last = head.last()?;
    if head.iter().any(|l| separated(l)) || head.len() < 2 || words(last) < 2 || !numbers(last) {
        return None;
    }
    let bare = numbers(head[0]);
    // A unit in brackets behind a blank is part of its column's name: `time [s]  T [N.m]`.
    let joined = |line: &[u8]| -> Vec<u8> {
        let mut out: Vec<u8> = Vec::with_capacity(line.len());
        for word in line.split(u8::is_ascii_whitespace).filter(|w| !w.is_empty()) {
            if !out.is_empty() {
                out.push(if word.starts_with(b"[") || word.starts_with(b"(") { b' ' } else { b'\t' });
            }
            out.extend_from_slice(word);
        }
        out
    };
    let width = if bare { words(head[0]) } else { joined(head[0]).split(|b| *b == b'\t').count() };
    if width != words(last) {
        return None;
    }
    let mut out = Vec::with_capacity(text.len() + 64);
    if bare {
        let names: Vec<String> = (1..=width).map(|k| format!("column {k}")).collect();
        out.extend_from_slice(names.join("\t").as_bytes());
        out.push(b'\n');
    }
    // The last line ends where it did: one without an end may be cut.
    for (k, line) in text.split(|b| *b == b'\n').enumerate() {
        if k > 0 {
            out.push(b'\n');
        }
        out.extend_from_slice(&joined(line));
    }
    Some(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table(text: &[u8]) -> Table {
        Table::parse(text, "log").unwrap_or_else(|e| panic!("{e}"))
    }

    #[test]
    fn halscope_and_halsampler_are_read_as_they_write() {
        let scope = b"Sampling period is 1000000 ns \n\njoint.0.pos-fb +1.00000000000000 pid.out -0.50000000000000 \njoint.0.pos-fb +2.0 pid.out -0.25 \n";
        let scope = table(scope);
        assert_eq!(scope.names(), "time, joint.0.pos-fb, pid.out");
        assert_eq!(scope.column(0).unwrap(), [0.0, 1e-3]);
        assert_eq!(scope.column(2).unwrap(), [-0.5, -0.25]);
        let sampler = table(b"0 123.55 33.4 0 -12 \n1 123.60 33.5 0 -11 \n");
        assert_eq!(sampler.names(), "column 1, column 2, column 3, column 4, column 5");
        assert_eq!(sampler.column(1).unwrap(), [123.55, 123.60]);
        // A logger that was stopped: in a name, behind a channel, in a number.
        let header = "Sampling period is 1000000 ns \n\n";
        let rows: String = (0..20).map(|k| format!("a +{k}.50000 b -0.25000 \n")).collect();
        for cut in ["a +20.50000 b -0.2", "a +20.50000 b", "a +20.50000 b ", "a +20.50000 ", "a +20.50000\n", "a"] {
            let table = table(format!("{header}{rows}{cut}").as_bytes());
            assert_eq!(table.rows(), 20, "{cut:?}");
            assert!(table.cut.as_ref().unwrap().contains("log: row 23, the last, is cut off"), "{:?}", table.cut);
        }
        let whole = table(format!("{header}{rows}a +20.50000 b -0.25000").as_bytes());
        assert_eq!((whole.rows(), whole.cut), (21, None));
        let damaged = format!("{header}{}", rows.replacen("a +7.50000 b", "a +7.50000", 1));
        let error = Table::parse(damaged.as_bytes(), "log").unwrap_err().to_string();
        assert!(error.contains("log: row 10: 3 words"), "{error}");
        let sampler: String = (0..20).map(|k| format!("{k} 0.50000 -0.25000 \n")).collect();
        for cut in ["20 0.50000 -0.2", "20 0.50000 ", "20"] {
            let table = table(format!("{sampler}{cut}").as_bytes());
            assert_eq!((table.rows(), table.cut.is_some()), (20, true), "{cut:?}");
        }
        let named = table(b"time [s]  T [N.m]\n0.0   1.5\n0.1  -2.5\n");
        assert_eq!((named.names(), named.headers[1].unit.as_deref()), ("time, T".to_owned(), Some("N.m")));
    }

    #[test]
    fn utf_16_of_either_order_is_read() {
        let text = "time [s];T [N.m]\r\n0;1,5\r\n0,1;-2,5\r\n";
        for order in [u16::to_le_bytes, u16::to_be_bytes] {
            let bytes: Vec<u8> = std::iter::once(0xfeff).chain(text.encode_utf16()).flat_map(order).collect();
            assert_eq!(table(&bytes).column(1).unwrap(), [1.5, -2.5]);
        }
    }

    #[test]
    fn text_without_a_mark_in_other_letters_or_line_ends_is_read() {
        let text = "time [s];T [N.m];temp [\u{b0}C]\n0;1,5;20\n0,1;-2,5;20\n";
        let wide: Vec<u8> = text.encode_utf16().flat_map(u16::to_le_bytes).collect();
        let latin: Vec<u8> = text.chars().map(|c| u8::try_from(u32::from(c)).unwrap()).collect();
        let old = text.replace('\n', "\r").into_bytes();
        for bytes in [wide, latin, old] {
            let table = table(&bytes);
            assert_eq!(table.column(1).unwrap(), [1.5, -2.5]);
            assert_eq!(table.headers[2].unit.as_deref(), Some("\u{b0}C"));
        }
    }

    #[test]
    fn a_few_zeros_in_a_log_stand_in_a_cell_and_many_are_no_text() {
        let rows: String = (0..40).map(|k| format!("{k},0.5\n")).collect();
        let mut log = format!("time [s],T [N.m]\n{rows}").into_bytes();
        let cell = log.len() - 4;
        log[cell..cell + 2].fill(0);
        let error = Table::parse(&log, "log").unwrap().column(1).unwrap_err().to_string();
        assert!(error.contains("41"), "{error}");
        log[..200].fill(0);
        let error = Table::parse(&log, "log").unwrap_err().to_string();
        assert!(error.contains("neither text"), "{error}");
    }
}
