//! Writes files: under a temporary name next to the target, then renamed, so that no incomplete file is left.

use std::collections::HashSet;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, OnceLock, PoisonError};

use sha2::{Digest, Sha256};

use super::error::TraceError;
use super::signal::AxisKind;
use super::{Signal, Trace};

/// Writes a trace with units in the header, numbers with all their digits.
///
/// # Errors
/// [`TraceError::Write`] when the folder or the file cannot be written.
pub fn write_csv(path: &Path, trace: &Trace, motion: AxisKind) -> Result<(), TraceError> {
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
    // An infinite number is no result: a reader would refuse the file, a spreadsheet would not show why.
    for (name, values) in columns {
        if let Some(row) = values.iter().position(|v| !v.is_finite()) {
            return Err(TraceError::NotFinite {
                path: path.to_owned(),
                column: (*name).to_owned(),
                row: row + 1,
                value: values[row],
            });
        }
    }
    let end = path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
    if matches!(end.as_str(), "parquet" | "pq") {
        return write_text(path, &super::parquet::pack(columns, path)?);
    }
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

/// The shortest text that reads back as the same number, with its power of ten where it is far from one.
#[must_use]
pub fn number(value: f64) -> String {
    let mut text = String::new();
    append_number(&mut text, value);
    text
}

/// Appends the shortest text that reads back as the same number.
pub fn append_number(text: &mut String, value: f64) {
    use std::fmt::Write as _;
    let size = value.abs();
    let written =
        if size != 0.0 && !(1e-4..1e15).contains(&size) { write!(text, "{value:e}") } else { write!(text, "{value}") };
    debug_assert!(written.is_ok(), "writing to a string");
}

/// Writes a whole file at once: under a temporary name next to the target, then renamed. The file of the final name is complete, or as it
/// was before, whenever the process ends; temporary files of processes that ended are removed by the next one.
///
/// `-` is standard output. A device or a pipe is written through; a symbolic link is followed; a file that is there keeps its
/// mode.
///
/// # Errors
/// [`TraceError::Write`] when the folder or the file cannot be written.
pub fn write_text(path: &Path, bytes: &[u8]) -> Result<(), TraceError> {
    let failed = |reason| TraceError::Write { path: path.to_owned(), reason };
    match Target::of(path).map_err(failed)? {
        Target::Output => {
            let mut out = std::io::stdout().lock();
            out.write_all(bytes).and_then(|()| out.flush()).map_err(failed)
        }
        Target::Through(to) => {
            let mut file = std::fs::OpenOptions::new().write(true).open(to).map_err(failed)?;
            file.write_all(bytes).and_then(|()| file.flush()).map_err(failed)
        }
        Target::File(to) => {
            let mut pending = Pending::in_folder(folder_of(&to)).map_err(failed)?;
            pending.file.write_all(bytes).map_err(failed)?;
            if let Ok(before) = std::fs::metadata(&to) {
                pending.file.as_file().set_permissions(before.permissions()).map_err(failed)?;
            }
            pending.persist(&to).map_err(failed)
        }
    }
}

/// Whether an output could be written: its folder is there and takes a file, and it is no folder itself. Nothing is changed.
///
/// # Errors
/// [`TraceError::Write`].
pub fn writable(path: &Path) -> Result<(), TraceError> {
    let failed = |reason| TraceError::Write { path: path.to_owned(), reason };
    match Target::of(path).map_err(failed)? {
        Target::Output => Ok(()),
        // To open a pipe and close it again would tell its reader that there is no more to come.
        Target::Through(to) if is_pipe(&to) => Ok(()),
        Target::Through(to) => std::fs::OpenOptions::new().write(true).open(to).map(|_| ()).map_err(failed),
        Target::File(to) => Pending::in_folder(folder_of(&to)).map(Pending::forget).map_err(failed),
    }
}

/// Whether it is a named pipe.
fn is_pipe(path: &Path) -> bool {
    #[cfg(unix)]
    {
        use std::os::unix::fs::FileTypeExt;
        std::fs::metadata(path).is_ok_and(|there| there.file_type().is_fifo())
    }
    #[cfg(not(unix))]
    {
        let _ = path;
        false
    }
}

/// Where an output goes.
#[derive(Debug, PartialEq, Eq)]
enum Target {
    /// Standard output.
    Output,
    /// A device, a pipe, an open file of this process: written through.
    Through(PathBuf),
    /// A file, links followed.
    File(PathBuf),
}

impl Target {
    fn of(path: &Path) -> std::io::Result<Self> {
        if path == Path::new("-") {
            return Ok(Self::Output);
        }
        let mut at = path.to_owned();
        // As many links as Linux follows.
        for _ in 0..40 {
            let Ok(link) = std::fs::read_link(&at) else { break };
            // /dev/stdout and its like: what the shell opened must not be replaced by another file of that name.
            if at.starts_with("/proc") || at.starts_with("/dev/fd") {
                return Ok(Self::Through(path.to_owned()));
            }
            at = folder_of(&at).join(link);
        }
        match std::fs::metadata(&at) {
            Ok(there) if there.is_dir() => Err(std::io::Error::new(std::io::ErrorKind::IsADirectory, "it is a folder")),
            Ok(there) if !there.is_file() => Ok(Self::Through(at)),
            _ => Ok(Self::File(at)),
        }
    }
}

fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or_else(|| Path::new("."))
}

/// Why no file can be made in a folder, without the temporary name, which the user did not give.
fn refused(folder: &Path, error: &std::io::Error) -> std::io::Error {
    let there = folder.display();
    let reason = match std::fs::metadata(folder) {
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => format!("the folder {there} does not exist"),
        Ok(found) if !found.is_dir() => format!("{there} is no folder"),
        _ => error.get_ref().and_then(std::error::Error::source).map_or_else(|| error.to_string(), ToString::to_string),
    };
    std::io::Error::new(error.kind(), reason)
}

/// How the names of temporary files begin.
const PREFIX: &str = ".eixo-";
/// Age from which a temporary file belongs to no process, whatever machine made it, s.
const ABANDONED: u64 = 24 * 3600;

/// Temporary files of this process: an interrupt removes them before the process ends.
static PENDING: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// A temporary file.
struct Pending {
    file: tempfile::NamedTempFile,
}

impl Pending {
    fn in_folder(folder: &Path) -> std::io::Result<Self> {
        prepare(folder);
        let mut builder = tempfile::Builder::new();
        #[cfg(unix)]
        {
            // A temporary file is private by default; a result is not: the usual permissions, less the user's mask.
            use std::os::unix::fs::PermissionsExt;
            builder.permissions(std::fs::Permissions::from_mode(0o666));
        }
        let prefix = format!("{PREFIX}{}-{}-", processes(), std::process::id());
        // Made while the list is held, so that no interrupt comes between the file and its entry.
        let mut all = PENDING.lock().unwrap_or_else(PoisonError::into_inner);
        let file = builder.prefix(&prefix).tempfile_in(folder).map_err(|e| refused(folder, &e))?;
        all.push(file.path().to_owned());
        Ok(Self { file })
    }

    /// Removes the file.
    fn forget(self) {
        let temporary = self.file.path().to_owned();
        let mut all = PENDING.lock().unwrap_or_else(PoisonError::into_inner);
        drop(self.file);
        all.retain(|p| *p != temporary);
    }

    fn persist(self, path: &Path) -> std::io::Result<()> {
        // On the disk before it has its name, so that a power cut leaves no empty file under it.
        self.file.as_file().sync_all()?;
        let temporary = self.file.path().to_owned();
        let mut all = PENDING.lock().unwrap_or_else(PoisonError::into_inner);
        let done = self.file.persist(path).map(|_| ()).map_err(|e| e.error);
        all.retain(|p| *p != temporary);
        done
    }
}

/// Once a process: sets Ctrl-C and SIGTERM to remove the temporary files. Once a folder: removes those of processes that ended.
fn prepare(folder: &Path) {
    static SEEN: Mutex<Option<HashSet<PathBuf>>> = Mutex::new(None);
    let mut seen = SEEN.lock().unwrap_or_else(PoisonError::into_inner);
    let folders = seen.get_or_insert_with(|| {
        // Where a handler is set already, that one decides.
        let _ = ctrlc::try_set_handler(|| {
            let all = PENDING.lock().unwrap_or_else(PoisonError::into_inner);
            for path in all.iter() {
                let _ = std::fs::remove_file(path);
            }
            // 128 + SIGINT, as shells have it; with the list held, so that nothing is renamed any more.
            std::process::exit(130);
        });
        HashSet::new()
    });
    if folders.insert(folder.to_owned()) {
        sweep(folder);
    }
}

/// Removes the temporary files of processes that ended. A process that runs, here or on another machine that shares the folder,
/// keeps its own.
fn sweep(folder: &Path) {
    let Ok(entries) = std::fs::read_dir(folder) else { return };
    for entry in entries.flatten() {
        let name = entry.file_name();
        let name = name.to_string_lossy();
        let mut parts = name.strip_prefix(PREFIX).into_iter().flat_map(|rest| rest.splitn(3, '-'));
        let (Some(of), Some(process), Some(_)) = (parts.next(), parts.next(), parts.next()) else { continue };
        let Ok(process) = process.parse::<u32>() else { continue };
        let ended = of == processes() && of != UNKNOWN && !Path::new("/proc").join(process.to_string()).exists();
        let age = || entry.metadata().ok()?.modified().ok()?.elapsed().ok();
        if entry.file_type().is_ok_and(|t| t.is_file()) && (ended || age().is_some_and(|a| a.as_secs() > ABANDONED)) {
            let _ = std::fs::remove_file(entry.path());
        }
    }
}

/// Where no list of processes is known.
const UNKNOWN: &str = "0";

/// Whose process numbers these are: a hash of the machine's boot and of the container, or [`UNKNOWN`].
fn processes() -> &'static str {
    static OWN: OnceLock<String> = OnceLock::new();
    OWN.get_or_init(|| {
        let boot = std::fs::read("/proc/sys/kernel/random/boot_id").ok();
        let space = std::fs::read_link("/proc/self/ns/pid").ok();
        match (boot, space) {
            (Some(boot), Some(space)) => {
                let hash = Sha256::new().chain_update(boot).chain_update(space.to_string_lossy().as_bytes()).finalize();
                hash.iter().take(6).map(|b| format!("{b:02x}")).collect()
            }
            _ => UNKNOWN.to_owned(),
        }
    })
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
        write_csv(&path, &trace, AxisKind::Rotary).unwrap();
        assert_eq!(load(&path, &Mapping::default()).unwrap().trace, trace);
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn what_an_ended_process_left_is_taken_away_and_what_a_running_one_writes_is_not() {
        if processes() == UNKNOWN {
            return crate::skip::skipped(crate::skip::Lack::Processes, "no list of processes here");
        }
        let folder = tempfile::tempdir().unwrap();
        let mut ended = std::process::Command::new("true").spawn().unwrap();
        ended.wait().unwrap();
        let name = |of: &str, process: u32| folder.path().join(format!("{PREFIX}{of}-{process}-abc"));
        let gone = name(processes(), ended.id());
        let kept =
            [name(processes(), std::process::id()), name("0123456789ab", ended.id()), folder.path().join(".eixo-x")];
        std::fs::write(&gone, "half").unwrap();
        kept.iter().for_each(|path| std::fs::write(path, "half").unwrap());
        write_text(&folder.path().join("result.csv"), b"whole").unwrap();
        assert!(!gone.exists());
        kept.iter().for_each(|path| assert!(path.exists(), "{}", path.display()));
    }

    #[cfg(unix)]
    #[test]
    fn links_are_followed_modes_stay_and_devices_are_written_through() {
        use std::os::unix::fs::{MetadataExt, PermissionsExt, symlink};
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        std::fs::write(at("real.csv"), "old").unwrap();
        std::fs::set_permissions(at("real.csv"), std::fs::Permissions::from_mode(0o640)).unwrap();
        symlink("real.csv", at("link.csv")).unwrap();
        symlink("not-yet.csv", at("dangling.csv")).unwrap();
        write_text(&at("link.csv"), b"new").unwrap();
        write_text(&at("dangling.csv"), b"new").unwrap();
        assert!(std::fs::symlink_metadata(at("link.csv")).unwrap().is_symlink());
        assert_eq!(std::fs::read(at("real.csv")).unwrap(), b"new");
        assert_eq!(std::fs::read(at("not-yet.csv")).unwrap(), b"new");
        assert_eq!(std::fs::metadata(at("real.csv")).unwrap().mode() & 0o777, 0o640);
        write_text(Path::new("/dev/null"), b"gone").unwrap();
        assert!(!std::fs::metadata("/dev/null").unwrap().is_file());
        if Path::new("/dev/full").exists() {
            let full = write_text(Path::new("/dev/full"), b"x").unwrap_err().to_string();
            assert!(full.contains("/dev/full"), "{full}");
        }
        assert!(write_text(folder.path(), b"x").unwrap_err().to_string().contains("folder"));
        writable(&at("fresh.csv")).unwrap();
        assert!(!at("fresh.csv").exists() && writable(&at("no/fresh.csv")).is_err());
        let names = std::fs::read_dir(folder.path()).unwrap().count();
        assert_eq!(names, 4, "no file of its own is left");
    }

    #[test]
    fn numbers_without_bound_are_not_written() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        let error = write_columns(&at("a.csv"), &[("T", &[1.0, f64::NAN])]).unwrap_err().to_string();
        assert!(error.contains("column T") && error.contains("row 2"), "{error}");
        assert!(!at("a.csv").exists());
    }

    #[test]
    #[cfg(feature = "parquet")]
    fn a_parquet_name_makes_parquet() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        let values: Vec<f64> = (0..40).map(f64::from).collect();
        write_columns(&at("a.parquet"), &[("time [s]", &values), ("T [N.m]", &values)]).unwrap();
        let trace = load(&at("a.parquet"), &Mapping::default()).unwrap().trace;
        assert_eq!(trace.get(Signal::T).unwrap(), values);
    }

    #[test]
    #[cfg(not(feature = "parquet"))]
    fn without_parquet_reading_and_writing_say_how_to_get_it() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.parquet");
        let error = write_columns(&path, &[("T", &[1.0])]).unwrap_err().to_string();
        assert!(error.contains("a.parquet") && error.contains("--features parquet"), "{error}");
        assert!(!path.exists());
        std::fs::write(&path, "PAR1 and so on PAR1").unwrap();
        let error = load(&path, &Mapping::default()).unwrap_err().to_string();
        assert!(error.contains("a.parquet") && error.contains("--features parquet"), "{error}");
    }

    #[test]
    fn an_unwritable_place_is_named_and_nothing_is_left() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("no/such/folder/trace.csv");
        let error = write_columns(&path, &[("a", &[1.0])]).unwrap_err().to_string();
        let parent = path.parent().unwrap().display();
        let expected = format!(
            "{}: cannot write: the folder {parent} does not exist. Create the folder, or choose a folder that exists",
            path.display()
        );
        assert_eq!(error, expected);
        assert_eq!(writable(&path).unwrap_err().to_string(), expected);
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
        std::fs::write(folder.path().join("log.csv"), "x").unwrap();
        let below = write_text(&folder.path().join("log.csv/trace.csv"), b"x").unwrap_err().to_string();
        assert!(below.contains("log.csv is no folder") && !below.contains(PREFIX), "{below}");
    }
}
