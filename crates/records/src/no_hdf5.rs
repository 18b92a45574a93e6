//! Replaces the module `hdf5` in a build without that feature: the error says how to get it.

use super::error::TraceError;
use super::table::Table;

/// Refuses the file.
///
/// # Errors
/// Always: the feature is off.
pub(super) fn read(_bytes: &[u8], file: &str) -> Result<Table, TraceError> {
    let what = "an HDF5 (MATLAB 7.3) file, and this eixo was built without HDF5; build it with `--features hdf5`, save the \
                file in MATLAB with -v7, or use CSV";
    Err(TraceError::Format { file: file.to_owned(), what: what.to_owned() })
}
