//! A file of named numeric columns: CSV, Parquet or MATLAB 5, told apart by its first bytes and not by its name.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use super::error::TraceError;
use super::{csv, mat, parquet};

/// Most columns a file may have.
pub(super) const MAX_COLUMNS: usize = 4096;
/// Most numbers that a packed file may unfold to (2 GiB of them): a small file can claim any size.
pub(super) const MAX_CELLS: usize = 1 << 28;
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
}

impl Kind {
    /// Tells from a file's first 128 bytes (fewer for a shorter one).
    pub fn of(first: &[u8], file: &str) -> Result<Self, TraceError> {
        if first.starts_with(b"PAR1") {
            return Ok(Self::Parquet);
        }
        if first.starts_with(b"\x89HDF\r\n\x1a\n") || first.starts_with(b"MATLAB 7.3") {
            return Err(TraceError::Format {
                file: file.to_owned(),
                what: "an HDF5 (MATLAB 7.3) file; save it in MATLAB with -v7, or as CSV or Parquet".to_owned(),
            });
        }
        // The version and the mark of the byte order: MAT-File Format (MathWorks), table 1-1.
        if first.len() == 128 && matches!(&first[124..], [0, 1, b'I', b'M'] | [1, 0, b'M', b'I']) {
            return Ok(Self::Mat);
        }
        Ok(Self::Csv)
    }

    /// Opens a file and tells what it is.
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

impl Fault {
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
}

impl Table {
    /// Reads a file: CSV, Parquet or MATLAB 5.
    ///
    /// # Errors
    /// When it cannot be read, has no header, or a row has too few or too many fields.
    pub fn read(path: &Path) -> Result<Self, TraceError> {
        let file = path.display().to_string();
        let failed = |reason| TraceError::Read { path: path.to_owned(), reason };
        let (kind, open) = Kind::open(path)?;
        match kind {
            Kind::Parquet => parquet::read(open, &file),
            Kind::Csv => csv::parse(&std::fs::read(path).map_err(failed)?, &file),
            Kind::Mat => mat::parse(&std::fs::read(path).map_err(failed)?, &file),
        }
    }

    /// Reads the bytes of a CSV or MATLAB 5 file; `file` names it in messages.
    ///
    /// # Errors
    /// When there is no header, or a row has too few or too many fields.
    pub fn parse(bytes: &[u8], file: &str) -> Result<Self, TraceError> {
        match Kind::of(&bytes[..bytes.len().min(128)], file)? {
            Kind::Csv => csv::parse(bytes, file),
            Kind::Mat => mat::parse(bytes, file),
            Kind::Parquet => Err(TraceError::Format {
                file: file.to_owned(),
                what: "a Parquet file where text is expected; give it by its path".to_owned(),
            }),
        }
    }

    /// Number of rows of data.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.columns.iter().map(Vec::len).max().unwrap_or(0)
    }

    /// Line in the file, from 1, of a row of data, from 0.
    #[must_use]
    pub fn line(&self, row: usize) -> usize {
        let last = self.lines.partition_point(|(first, _)| *first <= row);
        last.checked_sub(1).map_or(row + 1, |i| self.lines[i].1 + row - self.lines[i].0)
    }

    /// The column of that name.
    #[must_use]
    pub fn position(&self, name: &str) -> Option<usize> {
        self.headers.iter().position(|h| h.name == name)
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

    /// The names of all columns, for a message.
    #[must_use]
    pub fn names(&self) -> String {
        self.headers.iter().map(|h| h.name.as_str()).collect::<Vec<_>>().join(", ")
    }
}

/// `theta1 [rad]` into name and unit.
pub(super) fn header(field: &str) -> Header {
    let field = field.trim();
    if let Some((name, rest)) = field.split_once('[')
        && let Some(unit) = rest.trim_end().strip_suffix(']')
    {
        return Header { name: name.trim().to_owned(), unit: Some(unit.trim().to_owned()) };
    }
    Header { name: field.to_owned(), unit: None }
}
