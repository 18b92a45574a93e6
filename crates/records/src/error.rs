//! The errors of a trace. Each names the place and what to do.

use std::path::PathBuf;

use super::signal::Quantity;
use super::units::Unit;

/// A trace, or its file, that cannot be used.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum TraceError {
    /// The file could not be read.
    #[error("{path}: cannot read: {reason}")]
    Read {
        /// The file.
        path: PathBuf,
        /// Why.
        reason: std::io::Error,
    },
    /// The file could not be written.
    #[error("{path}: cannot write: {reason}. {}", way_out(reason))]
    Write {
        /// The file.
        path: PathBuf,
        /// Why.
        reason: std::io::Error,
    },
    /// A result that is no number.
    #[error(
        "{path}: column {column}, row {row} would be {value}: nothing is written. A value without bound comes from a model \
             that ran away, or from settings too large for it"
    )]
    NotFinite {
        /// The file.
        path: PathBuf,
        /// The column.
        column: String,
        /// Row of data, from 1.
        row: usize,
        /// What it would be.
        value: f64,
    },
    /// There is no header row, or no data.
    #[error("{file}: {what}")]
    NoTable {
        /// The file.
        file: String,
        /// What is missing and what a trace file looks like.
        what: String,
    },
    /// A file of a form that is not read, or that is damaged.
    #[error("{file}: {what}")]
    Format {
        /// The file.
        file: String,
        /// What is wrong and the way out.
        what: String,
    },
    /// A row has too few or too many fields.
    #[error(
        "{file}: row {line}: {found} fields where the header has {expected}; {}",
        if *found > *expected {
            "take the extra separators out, or, where numbers have decimal commas, separate the columns with semicolons"
        } else {
            "complete or delete the row (a logger that was stopped often leaves its last row cut off)"
        }
    )]
    Ragged {
        /// The file.
        file: String,
        /// Line in the file, from 1.
        line: usize,
        /// Fields of the row.
        found: usize,
        /// Fields of the header.
        expected: usize,
    },
    /// A cell of a column in use is not a finite number.
    #[error(
        "{file}: row {line}, column {column}: {text:?} is not a finite number; cut the trace before or after that \
         row (--from, --to), or mend the value"
    )]
    Cell {
        /// The file.
        file: String,
        /// Line in the file, from 1.
        line: usize,
        /// Name of the column.
        column: String,
        /// What stands there.
        text: String,
    },
    /// A column that is asked for is not there.
    #[error("{file}: no column {wanted:?} for {signal}{hint}; the columns are: {present}")]
    MissingColumn {
        /// The file.
        file: String,
        /// The signal (or time) that needs it.
        signal: &'static str,
        /// The column's name.
        wanted: String,
        /// The nearest name, when one is near.
        hint: String,
        /// All names there are.
        present: String,
    },
    /// Two columns have the same name.
    #[error("{file}: two columns are named {column:?} (fields {first} and {second}); rename one")]
    TwiceNamed {
        /// The file.
        file: String,
        /// The name.
        column: String,
        /// Field of the first, from 1.
        first: usize,
        /// Field of the second, from 1.
        second: usize,
    },
    /// The unit in a header is not known.
    #[error("{file}: column {column}: the unit [{unit}] is not known; for {signal} use one of {}", Unit::of(*needed))]
    UnknownUnit {
        /// The file.
        file: String,
        /// The column.
        column: String,
        /// The unit as written.
        unit: String,
        /// The signal.
        signal: &'static str,
        /// What it measures.
        needed: Quantity,
    },
    /// The unit in a header measures something else.
    #[error(
        "{file}: column {column}: [{unit}] is {}, but {signal} is {}; use one of {}, or check [units] motion and \
         [signals] of the axis file",
        is.name(), needed.name(), Unit::of(*needed)
    )]
    WrongUnit {
        /// The file.
        file: String,
        /// The column.
        column: String,
        /// The unit as written.
        unit: String,
        /// What it measures.
        is: Quantity,
        /// The signal.
        signal: &'static str,
        /// What it should measure.
        needed: Quantity,
    },
    /// Time runs backwards or stands still.
    #[error(
        "{file}: row {line}: time goes from {before} s to {after} s, it must increase; sort the rows, or write time \
         with more digits"
    )]
    NotIncreasing {
        /// The file.
        file: String,
        /// Line in the file, from 1.
        line: usize,
        /// Time of the row before, s.
        before: f64,
        /// Time of the row, s.
        after: f64,
    },
    /// Samples are missing.
    #[error(
        "{file}: row {line}: a gap of {gap:.6} s, about {missing} missing samples at dt = {dt:.6e} s; use the part \
         before or after it (--from, --to), or record again"
    )]
    Gap {
        /// The file.
        file: String,
        /// Line in the file after the gap, from 1.
        line: usize,
        /// Length of the gap, s.
        gap: f64,
        /// Samples missing in it.
        missing: usize,
        /// The usual interval, s.
        dt: f64,
    },
    /// The sampling is so uneven that resampling would invent data.
    #[error(
        "{file}: row {line}: the time is {jitter:.0} % of a sample away from uniform sampling at dt = {dt:.6e} s \
         (up to {limit:.0} % is resampled); record with a fixed rate"
    )]
    Jitter {
        /// The file.
        file: String,
        /// Line of the worst sample, from 1.
        line: usize,
        /// Its distance, per cent of dt.
        jitter: f64,
        /// The limit, per cent of dt.
        limit: f64,
        /// The usual interval, s.
        dt: f64,
    },
    /// A resampling that leaves too little, or needs too much.
    #[error(
        "{file}: resampled to dt = {dt:e} s, {length:.6} s of record are {:.3e} samples; give --resample another interval \
         (s): a record has at least 16 samples and at most 1e8",
        length / dt + 1.0
    )]
    Resample {
        /// The file.
        file: String,
        /// The interval asked for, s.
        dt: f64,
        /// Length of the record, s.
        length: f64,
    },
    /// Fewer samples than any use needs.
    #[error("{file}: {found} samples, at least {needed} are needed; record longer or sample faster")]
    TooShort {
        /// The file.
        file: String,
        /// Samples there are.
        found: usize,
        /// Samples needed.
        needed: usize,
    },
    /// What `--from` and `--to` leave is too short.
    #[error(
        "{file}: --from and --to leave {found} samples of {rows}, at least {needed} are needed; take a longer part"
    )]
    Cut {
        /// The file.
        file: String,
        /// Samples that are left.
        found: usize,
        /// Samples of the file.
        rows: usize,
        /// Samples needed.
        needed: usize,
    },
    /// A signal that the caller cannot do without.
    #[error(
        "the trace has no signal {signal} (it has: {present}); add the column, map one to it in [signals] of the axis file, or, \
         with one encoder alone, describe the axis as structure = \"rigid\""
    )]
    MissingSignal {
        /// The signal.
        signal: &'static str,
        /// What the trace has.
        present: String,
    },
    /// A signal is not as long as the others.
    #[error("signal {signal} has {found} samples, the others have {expected}")]
    Length {
        /// The signal.
        signal: &'static str,
        /// Its samples.
        found: usize,
        /// The samples of the others.
        expected: usize,
    },
}

/// `; did you mean "theta1"?` when one of the names is near to `wanted`, else nothing.
#[must_use]
pub fn nearest<'a>(wanted: &str, names: impl IntoIterator<Item = &'a str>) -> String {
    names
        .into_iter()
        .map(|name| (strsim::damerau_levenshtein(&wanted.to_lowercase(), &name.to_lowercase()), name))
        .min_by_key(|(distance, _)| *distance)
        .filter(|(distance, name)| *distance <= 1 + name.len().max(wanted.len()) / 3)
        .map_or_else(String::new, |(_, name)| format!("; did you mean {name:?}?"))
}

/// What can be done about a file that cannot be written.
fn way_out(reason: &std::io::Error) -> &'static str {
    use std::io::ErrorKind::{BrokenPipe, FileTooLarge, NotFound, QuotaExceeded, StorageFull};
    match reason.kind() {
        StorageFull | QuotaExceeded => "Make room, or write to another disk",
        FileTooLarge => "Raise the limit of a file's size (`ulimit -f`), or write less",
        BrokenPipe => "What reads the output has ended before it had all of it",
        NotFound => "Create the folder, or choose a folder that exists",
        _ => "Choose a folder that exists and that you may write to",
    }
}
