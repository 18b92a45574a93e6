//! Replaces the module `parquet` in a build without that feature: the errors say how to get it.

use std::convert::Infallible;
use std::fs::File;
use std::path::Path;

use super::WITHOUT_PARQUET;
use super::error::TraceError;
use super::table::{Fault, Header, Table};

/// An open file: there is none.
pub(super) struct Source {
    /// One a column.
    pub headers: Vec<Header>,
    none: Infallible,
}

impl Source {
    /// Refuses the file.
    ///
    /// # Errors
    /// Always: the feature is off.
    pub fn open(_open: File, file: &str) -> Result<Self, TraceError> {
        Err(refused(file.to_owned()))
    }

    /// Reads what [`Source::open`] has opened.
    ///
    /// # Errors
    /// Always: the feature is off.
    pub fn batches(
        &self,
        _wanted: &[usize],
        _take: impl FnMut(usize, Vec<Vec<f64>>, &[Option<Fault>]) -> Result<(), TraceError>,
    ) -> Result<(), TraceError> {
        match self.none {}
    }
}

/// Refuses the file.
///
/// # Errors
/// Always: the feature is off.
pub(super) fn read(_open: File, file: &str) -> Result<Table, TraceError> {
    Err(refused(file.to_owned()))
}

/// Refuses to make the file.
///
/// # Errors
/// Always: the feature is off.
pub(super) fn pack(_columns: &[(&str, &[f64])], path: &Path) -> Result<Vec<u8>, TraceError> {
    Err(refused(path.display().to_string()))
}

fn refused(file: String) -> TraceError {
    TraceError::Format { file, what: WITHOUT_PARQUET.to_owned() }
}
