//! Trace files out: written beside the target and renamed, so that no half file is left behind.

use std::io::Write;
use std::path::Path;

use super::error::TraceError;
use super::signal::Motion;
use super::{Signal, Trace};

/// Writes a trace with units in the header, numbers with all their digits.
///
/// # Errors
/// [`TraceError::Write`] when the folder or the file cannot be written.
pub fn write_csv(path: &Path, trace: &Trace, motion: Motion) -> Result<(), TraceError> {
    let time: Vec<f64> = (0..trace.len()).map(|k| trace.time(k)).collect();
    let mut columns: Vec<(String, &[f64])> = vec![("time [s]".to_owned(), &time)];
    for signal in Signal::ALL {
        if let Some(values) = trace.get(signal) {
            columns.push((format!("{} [{}]", signal.name(), signal.unit(motion)), values));
        }
    }
    let borrowed: Vec<(&str, &[f64])> = columns.iter().map(|(name, values)| (name.as_str(), *values)).collect();
    write_columns(path, &borrowed)
}

/// Writes named columns of equal length as CSV (shorter ones end in empty cells).
///
/// # Errors
/// [`TraceError::Write`] when the folder or the file cannot be written.
pub fn write_columns(path: &Path, columns: &[(&str, &[f64])]) -> Result<(), TraceError> {
    let rows = columns.iter().map(|(_, v)| v.len()).max().unwrap_or(0);
    let mut text = String::with_capacity((rows + 1) * columns.len() * 20);
    text.push_str(&columns.iter().map(|(name, _)| *name).collect::<Vec<_>>().join(","));
    text.push('\n');
    for row in 0..rows {
        for (k, (_, values)) in columns.iter().enumerate() {
            if k > 0 {
                text.push(',');
            }
            if let Some(value) = values.get(row) {
                append_number(&mut text, *value);
            }
        }
        text.push('\n');
    }
    write_text(path, text.as_bytes())
}

/// Appends the shortest text that reads back as the same number.
pub(crate) fn append_number(text: &mut String, value: f64) {
    use std::fmt::Write as _;
    let size = value.abs();
    let written =
        if size != 0.0 && !(1e-4..1e15).contains(&size) { write!(text, "{value:e}") } else { write!(text, "{value}") };
    debug_assert!(written.is_ok(), "writing to a string");
}

/// Writes a whole file at once: beside the target first, then renamed.
///
/// # Errors
/// [`TraceError::Write`] when the folder or the file cannot be written.
pub fn write_text(path: &Path, bytes: &[u8]) -> Result<(), TraceError> {
    let failed = |reason| TraceError::Write { path: path.to_owned(), reason };
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or_else(|| Path::new("."));
    let mut builder = tempfile::Builder::new();
    #[cfg(unix)]
    {
        // A temporary file is private by default; a result is not: the usual permissions, less the user's mask.
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(std::fs::Permissions::from_mode(0o666));
    }
    let mut file = builder.prefix(".eixo-").tempfile_in(folder).map_err(failed)?;
    file.write_all(bytes).map_err(failed)?;
    file.persist(path).map_err(|e| failed(e.error))?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::super::{Hold, Mapping, load};
    use super::*;

    #[test]
    fn a_trace_reads_back_bit_for_bit() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("trace.csv");
        let values: Vec<f64> = (0..64).map(|k| (f64::from(k) * 0.7).sin() * 10f64.powi(k % 40 - 20)).collect();
        let trace = Trace::new(0.0, 0.25, Hold::Zoh)
            .with(Signal::T, values.clone())
            .and_then(|t| t.with(Signal::Theta2, values))
            .unwrap();
        write_csv(&path, &trace, Motion::Rotary).unwrap();
        assert_eq!(load(&path, &Mapping::default()).unwrap().trace, trace);
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn an_unwritable_place_is_named_and_nothing_is_left() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("no/such/folder/trace.csv");
        let error = write_columns(&path, &[("a", &[1.0])]).unwrap_err().to_string();
        assert!(error.contains("trace.csv") && error.contains("cannot write"), "{error}");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
    }
}
