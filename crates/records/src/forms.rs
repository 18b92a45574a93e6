//! Text that is no plain CSV, brought to it: UTF-16, JSON, the logs of LinuxCNC, columns set apart by blanks.
//!
//! Sources: halscope's `write_log_file` (LinuxCNC, src/hal/utils/scope_files.c) writes the period in nanoseconds and then a
//! line a sample, each value behind the name of its channel; halsampler(1) writes the values alone, with `-t` the number of
//! the sample first. JSON Lines: jsonlines.org.

use serde_json::Value;

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

/// Tells what the text is, and brings it to a table or to CSV where it is neither.
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
    // A few zeros are what a logger leaves that lost its power, and stand in cells that are named; many are no text.
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
        return json(text, file).map(Form::Table);
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

/// Bytes of a text that tell how its letters are written.
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

    /// The table.
    pub fn table(self, file: &str, first_line: usize) -> Table {
        Table {
            file: file.to_owned(),
            headers: self.headers,
            columns: self.columns,
            faults: self.faults,
            lines: vec![(0, first_line)],
            mended: Vec::new(),
            cut: None,
        }
    }
}

/// JSON Lines, an array of objects, or an object of arrays.
fn json(bytes: &[u8], file: &str) -> Result<Table, TraceError> {
    let wrong = |what: String| TraceError::Format { file: file.to_owned(), what };
    let mut filled = Filled::default();
    let mut cut = None;
    let row = |filled: &mut Filled, value: &Value, line: usize| -> Result<(), TraceError> {
        let Value::Object(object) = value else {
            return Err(wrong(format!("row {line}: not an object such as {{\"time\": 0.0, \"T\": 0.1}}")));
        };
        for (name, value) in object {
            cell(filled, name, value, line, file)?;
        }
        filled.end(line);
        Ok(())
    };
    match serde_json::from_slice::<Value>(bytes) {
        Ok(Value::Array(rows)) => {
            for (k, value) in rows.iter().enumerate() {
                row(&mut filled, value, k + 1)?;
            }
        }
        // An array of objects beside what the logger says of itself.
        Ok(Value::Object(object)) if object.values().filter(|v| is_rows(v)).count() == 1 => {
            for value in object.values().filter(|v| is_rows(v)).filter_map(Value::as_array) {
                for (k, value) in value.iter().enumerate() {
                    row(&mut filled, value, k + 1)?;
                }
            }
        }
        Ok(Value::Object(object)) if object.values().any(Value::is_array) => {
            let rows = object.values().filter_map(Value::as_array).map(Vec::len).max().unwrap_or(0);
            for k in 0..rows {
                for (name, values) in &object {
                    let Some(value) = values.as_array().and_then(|v| v.get(k)) else { continue };
                    cell(&mut filled, name, value, k + 1, file)?;
                }
                filled.end(k + 1);
            }
        }
        _ => {
            let last = bytes.trim_ascii_end().split(|b| *b == b'\n').count();
            for (k, line) in bytes.split(|b| *b == b'\n').enumerate() {
                let line = line.trim_ascii();
                if line.is_empty() {
                    continue;
                }
                match serde_json::from_slice(line) {
                    Ok(value) => row(&mut filled, &value, k + 1)?,
                    // An object that ends before it is closed, behind whole ones.
                    Err(e) if e.is_eof() && k + 1 == last && filled.rows > 0 => {
                        let text: String = String::from_utf8_lossy(line).chars().take(40).collect();
                        cut = Some(super::csv::cut::word(file, last, &text));
                    }
                    Err(e) => {
                        return Err(wrong(format!("row {}: not JSON ({e}); a record is one object a line", k + 1)));
                    }
                }
            }
        }
    }
    if filled.headers.is_empty() {
        return Err(wrong("the file holds no columns; a record is one object of numbers a line".to_owned()));
    }
    Ok(Table { cut, ..filled.table(file, 1) })
}

/// Whether a value is an array of objects.
fn is_rows(value: &Value) -> bool {
    value.as_array().and_then(|a| a.first()).is_some_and(Value::is_object)
}

/// A value of a row: a number, the text of a number or of a time stamp; of an object each of its values, as `axis.torque`.
fn cell(filled: &mut Filled, name: &str, value: &Value, line: usize, file: &str) -> Result<(), TraceError> {
    match value {
        Value::Object(inner) => inner.iter().try_for_each(|(part, value)| match value {
            // No deeper: a name of three parts is no channel.
            Value::Object(_) => Ok(()),
            value => cell(filled, &format!("{name}.{part}"), value, line, file),
        }),
        Value::String(text) => {
            filled.put(name, super::csv::number(text.as_bytes(), false), || text.clone(), line, file)
        }
        _ => filled.put(name, value.as_f64(), || value.to_string(), line, file),
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
    let mut filled = Filled::default();
    let mut first = 0;
    for (k, line) in lines {
        let words: Vec<&str> = line.split_whitespace().collect();
        if words.is_empty() {
            continue;
        }
        if !words.len().is_multiple_of(2) {
            return Err(wrong(format!(
                "row {}: {} words; halscope writes a name and a value for each channel",
                k + 1,
                words.len()
            )));
        }
        if first == 0 {
            first = k + 1;
        }
        filled.put("time", Some(filled.rows as f64 * period * 1e-9), String::new, k + 1, file)?;
        for pair in words.chunks_exact(2) {
            filled.put(pair[0], pair[1].parse().ok(), || pair[1].to_owned(), k + 1, file)?;
        }
        filled.end(k + 1);
    }
    Ok(filled.table(file, first.max(1)))
}

/// Columns set apart by blanks, made CSV; None where a comma, a semicolon or a tab separates, or there is one column. Without
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
    for line in text.split(|b| *b == b'\n') {
        out.extend_from_slice(&joined(line));
        out.push(b'\n');
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
    fn json_in_its_three_forms_is_one_table() {
        for text in [
            "{\"time\": 0, \"T [mN.m]\": 1.5}\n{\"time\": 0.1, \"T [mN.m]\": -2}\n",
            "[{\"time\": 0, \"T [mN.m]\": 1.5}, {\"time\": 0.1, \"T [mN.m]\": -2}]",
            "{\"time\": [0, 0.1], \"T [mN.m]\": [1.5, -2]}",
        ] {
            let table = table(text.as_bytes());
            assert_eq!(table.rows(), 2, "{text}");
            let at = table.position("T").unwrap();
            assert_eq!(table.column(at).unwrap(), [1.5, -2.0]);
            assert_eq!(table.headers[at].unit.as_deref(), Some("mN.m"));
        }
        let table = table(b"{\"time\": 0, \"T\": 1}\n{\"time\": 1}\n");
        assert!(table.column(table.position("T").unwrap()).unwrap_err().to_string().contains("row 2"));
        let error = Table::parse(b"{\"time\": 0}\n{\"time\": \n{\"time\": 2}\n", "log").unwrap_err().to_string();
        assert!(error.contains("row 2") && error.contains("not JSON"), "{error}");
        // The last object was never closed: the logger was stopped.
        let table = Table::parse(b"{\"time\": 0}\n{\"time\": 1}\n{\"time\": ", "log").unwrap();
        assert_eq!(table.rows(), 2);
        assert!(table.cut.unwrap().contains("log: row 3, the last, is cut off"));
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

    #[test]
    fn json_of_nested_objects_and_rows_beside_other_things_is_a_table() {
        let text = br#"{"logger": "x", "rows": [
            {"t": "2026-03-01T12:00:00Z", "axis": {"T": 1.5, "q": 0.1}}, {"t": "2026-03-01T12:00:01Z", "axis": {"T": -2.5, "q": 0.2}}]}"#;
        let table = table(text);
        assert_eq!(table.names(), "t, axis.T, axis.q");
        assert_eq!(table.column(1).unwrap(), [1.5, -2.5]);
        assert_eq!(table.column(0).unwrap()[1] - table.column(0).unwrap()[0], 1.0);
    }
}
