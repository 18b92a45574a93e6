//! Outputs are checked before the work: none is an input, no two are one file, each can be written.

use std::path::{Path, PathBuf};

use anyhow::bail;

use crate::trace::writable;

/// A file by what it is, not by its name: links lead to it, hard links are it.
#[derive(Debug, PartialEq, Eq)]
enum Identity {
    #[cfg(unix)]
    Inode(u64, u64),
    Path(PathBuf),
}

fn identity(path: &Path) -> Option<Identity> {
    if path == Path::new("-") {
        return None;
    }
    match std::fs::metadata(path) {
        // A terminal, a pipe or /dev/null may serve many times.
        Ok(there) if !there.is_file() => None,
        #[cfg(unix)]
        Ok(there) => {
            use std::os::unix::fs::MetadataExt;
            Some(Identity::Inode(there.dev(), there.ino()))
        }
        #[cfg(not(unix))]
        Ok(_) => path.canonicalize().ok().map(Identity::Path),
        Err(_) => {
            let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or_else(|| Path::new("."));
            Some(Identity::Path(folder.canonicalize().ok()?.join(path.file_name()?)))
        }
    }
}

/// Extensions of formats that are not written: a text of such a name would be taken for a damaged file.
const FOREIGN: [&str; 12] =
    ["xlsx", "xlsm", "xls", "ods", "mat", "h5", "hdf5", "npz", "npy", "feather", "arrow", "pdf"];

/// Checks the outputs of a command against its inputs: its tables, which are CSV or Parquet by their ending, and the others.
///
/// # Errors
/// When an output is an input or another output, cannot be written, or has the ending of a form that it is not written in.
pub fn check<'a>(
    inputs: impl IntoIterator<Item = &'a Path>,
    tables: impl IntoIterator<Item = Option<&'a PathBuf>>,
    others: impl IntoIterator<Item = Option<&'a PathBuf>>,
) -> anyhow::Result<()> {
    let inputs: Vec<(&Path, Option<Identity>)> = inputs.into_iter().map(|p| (p, identity(p))).collect();
    let mut seen: Vec<(&Path, Identity)> = Vec::new();
    let tables = tables.into_iter().flatten().map(|path| (path, true));
    for (path, table) in tables.chain(others.into_iter().flatten().map(|path| (path, false))) {
        if path == Path::new("-") {
            super::stdout::to_stderr();
        }
        if path.extension().is_some_and(|end| FOREIGN.iter().any(|f| end.eq_ignore_ascii_case(f))) {
            bail!(
                "{}: this form is not written; tables end in .csv or .parquet, pages in .html, results in .json",
                path.display()
            );
        }
        if !table && path.extension().is_some_and(|end| end.eq_ignore_ascii_case("parquet")) {
            bail!(
                "{}: this output is no table and is not written as Parquet: give it the ending of what it is",
                path.display()
            );
        }
        if let Some(own) = identity(path) {
            if let Some((input, _)) = inputs.iter().find(|(_, i)| i.as_ref() == Some(&own)) {
                bail!(
                    "{}: this output is the input {}; inputs are never written over: give another name",
                    path.display(),
                    input.display()
                );
            }
            if let Some((other, _)) = seen.iter().find(|(_, i)| *i == own) {
                bail!("{} and {}: two outputs are one file; give each its own name", other.display(), path.display());
            }
            seen.push((path, own));
        }
        writable(path)?;
    }
    Ok(())
}

/// From here on a file that grows beyond the limit of the process (`ulimit -f`) is an error of the write, not the end of the
/// program with a torn file beside it.
pub fn survive_limits() {
    #[cfg(unix)]
    {
        use nix::sys::signal::{SigSet, Signal};
        let mut set = SigSet::empty();
        set.add(Signal::SIGXFSZ);
        // Without it the program ends as before: no reason not to run.
        let _ = set.thread_block();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_output_that_is_an_input_by_name_link_or_hard_link_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        std::fs::write(at("log.csv"), "x").unwrap();
        std::fs::hard_link(at("log.csv"), at("hard.csv")).unwrap();
        #[cfg(unix)]
        std::os::unix::fs::symlink("log.csv", at("soft.csv")).unwrap();
        let input = at("log.csv");
        let dotted = folder.path().join(".").join("log.csv");
        for name in [Some(at("log.csv")), Some(at("hard.csv")), cfg!(unix).then(|| at("soft.csv")), Some(dotted)] {
            let Some(output) = name else { continue };
            let error = check([input.as_path()], [Some(&output)], []).unwrap_err().to_string();
            assert!(error.contains("is the input"), "{error}");
        }
        let (a, b) = (at("new.csv"), folder.path().join("./new.csv"));
        assert!(check([input.as_path()], [Some(&a)], []).is_ok());
        assert!(check([input.as_path()], [Some(&a)], [Some(&b)]).unwrap_err().to_string().contains("two outputs"));
        assert!(check([input.as_path()], [Some(&at("no/new.csv"))], []).is_err());
        let error = check([], [Some(&at("new.XLSX"))], []).unwrap_err().to_string();
        assert!(error.contains("new.XLSX") && error.contains(".csv or .parquet"), "{error}");
        let parquet = at("new.Parquet");
        assert!(check([], [Some(&parquet)], []).is_ok());
        let error = check([], [], [Some(&parquet)]).unwrap_err().to_string();
        assert!(error.contains("new.Parquet") && error.contains("no table"), "{error}");
        let null = PathBuf::from("/dev/null");
        assert!(!null.exists() || check([input.as_path()], [Some(&null)], [Some(&null)]).is_ok());
    }
}
