//! What stands above the data where that is more than a header row.

use memchr::memchr;

use super::super::error::TraceError;
use super::super::table::{Header, MAX_COLUMNS, header};
use super::super::units::Unit;
use super::head::{Head, MAX_HEADER, distinct, number_of, separator, split};
use super::trim;

/// Whether a field can stand in a row of units.
fn is_unit(field: &str) -> bool {
    let inner = field.trim().trim_start_matches(['[', '(']).trim_end_matches([']', ')']);
    inner.is_empty() || inner == "-" || Unit::parse(inner).is_some()
}

/// Most lines before the data.
const MAX_PREAMBLE: usize = 400;

/// Lines above the data other than a single header row: metadata of the logger, a row of units, the channel heads of
/// TwinCAT Scope (Beckhoff Information System, TE13xx, Export in csv: name and value side by side, then a column of time in
/// milliseconds and one of values for each channel).
pub(super) struct Preamble {
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
    pub fn find(bytes: &[u8], at: usize, lines: usize, first: usize, separator_of_first: u8) -> Option<Self> {
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
            let more_data = k + 1 >= found.len() || data_at(k + 1) == Some(one) || trim(found[k + 1].text) == b"EOF";
            more_data.then_some((k, one))
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

    /// As the head of a file.
    ///
    /// # Errors
    /// When there are too many columns, or two of one name.
    pub fn head(self, file: &str) -> Result<Head, TraceError> {
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
        distinct(&mut headers, file)?;
        Ok(Head { headers, separator: self.separator, blank_last: self.blank_last, body: self.body, lines: self.lines })
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::table::{Header, Table};
    use super::*;

    fn parse(text: &str) -> Result<Table, TraceError> {
        super::super::parse(text.as_bytes(), "a.csv")
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
}
