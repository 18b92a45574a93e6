//! A file of named numeric columns. Its form is found by its first bytes, not by its name.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use super::error::TraceError;
use super::forms::Form;
use super::missing::{self, Missing};
use super::signal::Signal;
use super::units::Unit;
use super::{csv, forms, guess, hdf5, mat, packed, parquet};

/// Most columns a file may have.
pub(super) const MAX_COLUMNS: usize = 4096;
/// Most numbers that a packed file may unfold to (2 GiB of them): a small file can claim any size.
pub(super) const MAX_CELLS: usize = 1 << 28;
/// Most bytes that are read from standard input.
const MAX_INPUT: u64 = 4 << 30;
/// What standard input is called.
const INPUT: &str = "standard input";
pub(super) const EXAMPLE: &str =
    "a trace file begins with a header row such as: time [s],T [N.m],theta1 [rad],theta2 [rad]";

/// What a file is, by its first bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    /// Text.
    Csv,
    /// Apache Parquet.
    Parquet,
    /// MATLAB 5 to 7.2.
    Mat,
    /// HDF5, MATLAB 7.3 among them.
    Hdf5,
    /// An archive of NumPy arrays, or an Excel workbook.
    Packed,
}

impl Kind {
    /// The form of a file by its first 128 bytes (fewer of a shorter one).
    ///
    /// # Errors
    /// When the file is of a form that is not read.
    pub fn of(first: &[u8], file: &str) -> Result<Self, TraceError> {
        if first.starts_with(b"PAR1") {
            return Ok(Self::Parquet);
        }
        if first.starts_with(b"PK\x03\x04") {
            return Ok(Self::Packed);
        }
        for (magic, what) in [
            (&b"\x1f\x8b"[..], "it is compressed (gzip); unpack it first (gunzip)"),
            (b"\x28\xb5\x2f\xfd", "it is compressed (zstd); unpack it first (unzstd)"),
            (b"7z\xbc\xaf", "it is compressed (7z); unpack it first"),
            (
                b"\x93NUMPY",
                "a single NumPy array, whose columns have no names; save it as .npz: numpy.savez(\"log.npz\", time=t, T=T, theta1=q)",
            ),
            (b"\x89PNG", "it is a picture, not a record; give the log that it was drawn from"),
            (b"%PDF", "it is a document, not a record; give the log that it was made of"),
            (b"<html", "it is a web page, not a record; give the log itself"),
            (b"<!doctype html", "it is a web page, not a record; give the log itself"),
        ] {
            if first.get(..magic.len()).is_some_and(|f| f.eq_ignore_ascii_case(magic)) {
                return Err(TraceError::Format { file: file.to_owned(), what: what.to_owned() });
            }
        }
        if first.starts_with(b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1") {
            return Err(TraceError::Format {
                file: file.to_owned(),
                what: "an old Excel workbook (.xls); save it as .xlsx or CSV".to_owned(),
            });
        }
        if first.starts_with(b"\x89HDF\r\n\x1a\n") || first.starts_with(b"MATLAB 7.3") {
            return Ok(Self::Hdf5);
        }
        // The version and the mark of the byte order: MAT-File Format (MathWorks), table 1-1. Version 2 is HDF5 behind a head of
        // 512 bytes, whatever the text says: MATLAB 7.0 to 7.2 wrote it, too.
        if first.len() == 128 && matches!(&first[124..], [0, 2, b'I', b'M'] | [2, 0, b'M', b'I']) {
            return Ok(Self::Hdf5);
        }
        if first.len() == 128 && matches!(&first[124..], [0, 1, b'I', b'M'] | [1, 0, b'M', b'I']) {
            return Ok(Self::Mat);
        }
        Ok(Self::Csv)
    }

    /// Opens a file and finds its form.
    ///
    /// # Errors
    /// When the file cannot be read, or is of a form that is not read.
    pub fn open(path: &Path) -> Result<(Self, File), TraceError> {
        let failed = |reason| TraceError::Read { path: path.to_owned(), reason };
        let mut first = Vec::with_capacity(128);
        let file = File::open(path).map_err(failed)?;
        (&file).take(128).read_to_end(&mut first).map_err(failed)?;
        Ok((Self::of(&first, &path.display().to_string())?, file))
    }
}

/// The name of a column, and its unit where the header has one in brackets.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Header {
    /// Name without the unit.
    pub name: String,
    /// Text between the brackets.
    pub unit: Option<String>,
}

/// A cell that is no finite number.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Fault {
    /// Line in the file, from 1; the row, from 1, where a file has no lines.
    pub line: usize,
    /// What stands there.
    pub text: String,
}

/// What loggers write where there is no value, in small letters.
const NO_VALUE: [&str; 12] = ["", "nan", "na", "n/a", "#n/a", "null", "none", "nil", "-", "--", "---", "missing"];

impl Fault {
    /// Whether the cell says that there is no value, and not something else than a number.
    pub fn missing(&self) -> bool {
        NO_VALUE.contains(&self.text.trim_matches('"').trim().to_lowercase().as_str())
    }

    /// Becomes the first fault of a column where there is none yet, or only a missing value while this is another text.
    pub fn into_first(self, first: &mut Option<Self>) {
        if first.as_ref().is_none_or(|f| f.missing() && !self.missing()) {
            *first = Some(self);
        }
    }

    /// As an error of a column of a file.
    pub fn named(&self, file: &str, column: &str) -> TraceError {
        TraceError::Cell { file: file.to_owned(), line: self.line, column: column.to_owned(), text: self.text.clone() }
    }
}

/// The columns of a file.
#[derive(Debug, Clone)]
pub struct Table {
    /// The file's name, for messages.
    pub file: String,
    /// One a column.
    pub headers: Vec<Header>,
    pub(super) columns: Vec<Vec<f64>>,
    pub(super) faults: Vec<Option<Fault>>,
    /// (row, line) where the line of a row is not one more than that of the row before.
    pub(super) lines: Vec<(usize, usize)>,
    /// For each column with interpolated cells: its index, and the warning.
    pub(super) bridge_warnings: Vec<(usize, String)>,
    /// Warning of a last row that was left out.
    pub(super) cut: Option<String>,
}

impl Table {
    /// Interpolates cells without a number where they are few and isolated; the warning is given when the column is used.
    fn bridged(mut self) -> Self {
        let rows = self.rows();
        for index in 0..self.columns.len() {
            if self.faults[index].is_none() || self.columns[index].len() < rows {
                continue;
            }
            let mut missing = Missing::default();
            missing.take(&self.columns[index], self.faults[index].as_ref());
            if let Ok(Some(warning)) = missing.ended(&self.file, &self.headers[index].name) {
                missing::bridge(&mut self.columns[index]);
                self.faults[index] = None;
                self.bridge_warnings.push((index, warning));
            }
        }
        self
    }

    /// Warning of a column with interpolated cells.
    pub(super) fn bridge_warning(&self, index: usize) -> Option<&str> {
        self.bridge_warnings.iter().find(|(k, _)| *k == index).map(|(_, warning)| warning.as_str())
    }

    /// The finite values of a column, in its own unit.
    pub(super) fn finite(&self, index: usize) -> Vec<f64> {
        self.columns[index].iter().copied().filter(|v| v.is_finite()).collect()
    }

    /// Reads a file of any form; `-` is standard input.
    ///
    /// # Errors
    /// When it cannot be read, has no header, or a row has too few or too many fields.
    pub fn read(path: &Path) -> Result<Self, TraceError> {
        let file = path.display().to_string();
        let failed = |reason| TraceError::Read { path: path.to_owned(), reason };
        if path == Path::new("-") {
            let mut bytes = Vec::new();
            std::io::stdin().lock().take(MAX_INPUT + 1).read_to_end(&mut bytes).map_err(failed)?;
            if bytes.len() as u64 > MAX_INPUT {
                let what = format!("more than {MAX_INPUT} bytes; give the record as a file");
                return Err(TraceError::Format { file: INPUT.to_owned(), what });
            }
            return Self::parse(&bytes, INPUT);
        }
        let no_record = |what: &str| Err(TraceError::Format { file: file.clone(), what: what.to_owned() });
        if path.is_dir() {
            return no_record(
                "it is a folder; give a trace in it, or all of them to identify or diagnose with --output",
            );
        }
        if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("toml")) {
            return no_record("it is an axis file, not a record; it goes behind --axis");
        }
        let (kind, open) = Kind::open(path)?;
        match kind {
            Kind::Parquet => parquet::read(open, &file).map(Self::bridged),
            _ => Self::parse(&std::fs::read(path).map_err(failed)?, &file),
        }
    }

    /// Reads the bytes of a file that is no Parquet; `file` names it in messages.
    ///
    /// # Errors
    /// When there is no header, or a row has too few or too many fields.
    pub fn parse(bytes: &[u8], file: &str) -> Result<Self, TraceError> {
        match Kind::of(&bytes[..bytes.len().min(128)], file)? {
            Kind::Csv => match forms::of(bytes, file)? {
                Form::Plain => csv::parse(bytes, file),
                Form::Csv(text) => csv::parse(&text, file),
                Form::Table(table) => Ok(table),
            },
            Kind::Mat => mat::parse(bytes, file),
            Kind::Hdf5 => hdf5::read(bytes, file),
            Kind::Packed => packed::read(bytes, file),
            Kind::Parquet => Err(TraceError::Format {
                file: file.to_owned(),
                what: "a Parquet file where text is expected; give it by its path".to_owned(),
            }),
        }
        .map(Self::bridged)
    }

    /// Number of rows of data.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.columns.iter().map(Vec::len).max().unwrap_or(0)
    }

    /// Line in the file, from 1, of a row of data, from 0.
    #[must_use]
    pub fn line(&self, row: usize) -> usize {
        line_of(&self.lines, row)
    }

    /// The column of that name; with its unit behind it, as the file writes it, it is the same.
    #[must_use]
    pub fn position(&self, name: &str) -> Option<usize> {
        let at = |name: &str| self.headers.iter().position(|h| h.name == name);
        at(name).or_else(|| {
            let parsed = written(name);
            parsed.unit.as_ref()?;
            at(&parsed.name)
        })
    }

    /// The column that has a signal's own name, a unit behind it or not: `theta1`, `Theta1`, `theta1_deg`.
    #[must_use]
    pub(super) fn own(&self, signal: Signal) -> Option<usize> {
        let name = signal.name();
        self.position(name).or_else(|| {
            // T and t are two things; a longer name is one however it is written.
            let alike = |given: &str| given == name || (name.len() > 1 && given.eq_ignore_ascii_case(name));
            let with_unit = |h: &Header| guess::suffix(&h.name).is_some_and(|(stem, _)| alike(stem));
            self.headers.iter().position(|h| alike(&h.name) || with_unit(h))
        })
    }

    /// The values of a column, all finite.
    ///
    /// # Errors
    /// [`TraceError::Cell`] when a cell of it is no finite number.
    pub fn column(&self, index: usize) -> Result<&[f64], TraceError> {
        match &self.faults[index] {
            None => Ok(&self.columns[index]),
            Some(fault) => Err(fault.named(&self.file, &self.headers[index].name)),
        }
    }

    /// The values of some rows of a column, all finite.
    ///
    /// # Errors
    /// [`TraceError::Cell`] when a cell among them is no finite number.
    pub(super) fn part(&self, index: usize, rows: &std::ops::Range<usize>) -> Result<&[f64], TraceError> {
        let values = &self.columns[index][rows.clone()];
        let Some(fault) = &self.faults[index] else { return Ok(values) };
        let Some(first) = values.iter().position(|v| !v.is_finite()) else { return Ok(values) };
        let line = self.line(rows.start + first);
        let text = if line == fault.line { fault.text.clone() } else { "that cell".to_owned() };
        Err(Fault { line, text }.named(&self.file, &self.headers[index].name))
    }

    /// The names of all columns, for a message.
    #[must_use]
    pub fn names(&self) -> String {
        self.headers.iter().map(|h| h.name.as_str()).collect::<Vec<_>>().join(", ")
    }
}

/// Line in the file, from 1, of a row of data, from 0. `lines`: in order, (row, line) wherever the line of a row is not one more than that of
/// the row before; without any the first row is line 1.
pub(super) fn line_of(lines: &[(usize, usize)], row: usize) -> usize {
    let after = lines.partition_point(|(first, _)| *first <= row);
    after.checked_sub(1).map_or(row + 1, |i| lines[i].1 + row - lines[i].0)
}

/// Names for the counts of an encoder or converter, which have no unit: the user gives their scale.
const COUNTS: [&str; 12] =
    ["count", "counts", "cts", "cnt", "inc", "incr", "increments", "pulse", "pulses", "ticks", "lsb", "raw"];

/// The name of a column, and its unit; that of a count is none.
pub(super) fn header(field: &str) -> Header {
    let found = written(field);
    let counts = found.unit.as_ref().is_some_and(|u| COUNTS.contains(&u.to_lowercase().as_str()));
    if counts { Header { unit: None, ..found } } else { found }
}

/// `theta1 [rad]` into name and unit; `theta1 (rad)` and `theta1/rad` where what is behind is a unit.
fn written(field: &str) -> Header {
    let field = field.trim();
    let parted = |name: &str, unit: &str| Header { name: name.trim().to_owned(), unit: Some(unit.trim().to_owned()) };
    let inner =
        |text: &str| text.trim().strip_prefix('(').and_then(|t| t.strip_suffix(')')).unwrap_or(text.trim()).to_owned();
    if let Some((name, rest)) = field.split_once('(')
        && let Some(unit) = rest.trim_end().strip_suffix(')')
        && !name.trim().is_empty()
        && Unit::parse(unit).is_some()
    {
        return parted(name.trim_end().trim_end_matches('/'), unit);
    }
    if let Some((name, unit)) = field.split_once('/')
        && !field.contains('[')
        && Unit::parse(name).is_none()
        && !name.trim().is_empty()
        && Unit::parse(&inner(unit)).is_some()
    {
        return parted(name, &inner(unit));
    }
    if let Some((name, rest)) = field.split_once('[')
        && let Some(unit) = rest.trim_end().strip_suffix(']')
    {
        return Header { name: name.trim().to_owned(), unit: Some(unit.trim().to_owned()) };
    }
    Header { name: field.to_owned(), unit: None }
}
