//! Which traces: files, folders and patterns to a list without duplicates, in the order of their names.

use std::cmp::Ordering;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use super::FleetError;

/// Extensions of traces in a folder; a file that is named is taken whatever its name.
const EXTENSIONS: [&str; 9] = ["csv", "tsv", "txt", "parquet", "pq", "mat", "xlsx", "npz", "jsonl"];
/// Most traces of a run.
const MOST: usize = 1_000_000;
/// Deepest folder below the one that is named.
const DEEPEST: usize = 32;
/// The axis file that is looked for in the folder of a trace and in those above it.
const AXIS: &str = "axis.toml";

/// A trace and the axis file that goes with it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Item {
    /// The trace.
    pub path: PathBuf,
    /// The axis file.
    pub axis: Option<PathBuf>,
}

impl Item {
    /// The trace as it is written in the summary. Spreadsheets take a cell that begins with one of `=+-@` for a formula.
    #[must_use]
    pub fn name(&self) -> String {
        let name = self.path.display().to_string();
        if name.starts_with(['=', '+', '-', '@']) { format!("./{name}") } else { name }
    }
}

/// Whether the arguments mean more than one file.
#[must_use]
pub fn is_many(traces: &[PathBuf]) -> bool {
    match traces {
        [one] => one.is_dir() || (!one.exists() && is_pattern(one)),
        _ => true,
    }
}

fn is_pattern(path: &Path) -> bool {
    path.to_string_lossy().contains(['*', '?', '['])
}

/// The traces of the arguments. `axis`: the axis file of all of them; without it, each trace's own is the `axis.toml` in its
/// folder or the nearest one above. The folder `output` is left out.
///
/// # Errors
/// When an argument gives no trace, or a folder cannot be read.
pub fn find(arguments: &[PathBuf], axis: Option<&Path>, output: &Path) -> Result<Vec<Item>, FleetError> {
    let output = output.canonicalize().ok();
    let mut paths = BTreeSet::new();
    for argument in arguments {
        let mut own = BTreeSet::new();
        let nothing = |why: &str| FleetError::Nothing { what: argument.display().to_string(), why: why.to_owned() };
        if argument.is_dir() {
            collect_below(argument, output.as_deref(), 0, &mut own)?;
            if own.is_empty() {
                return Err(nothing(&format!("no trace in this folder (files that end in {})", EXTENSIONS.join(", "))));
            }
        } else if argument.exists() || !is_pattern(argument) {
            // A named file that is not there is a row that says so.
            own.insert(argument.clone());
        } else {
            let text = argument.to_string_lossy();
            let matches = glob::glob(&text).map_err(|e| nothing(&format!("not a pattern: {e}")))?;
            for found in matches {
                let found = found.map_err(|e| {
                    let path = e.path().to_owned();
                    FleetError::Read { path, reason: e.into() }
                })?;
                if found.is_dir() {
                    collect_below(&found, output.as_deref(), 0, &mut own)?;
                } else if !is_axis(&found) {
                    own.insert(found);
                }
            }
            if own.is_empty() {
                return Err(nothing("no file matches this pattern"));
            }
        }
        paths.append(&mut own);
        if paths.len() > MOST {
            return Err(nothing(&format!("more than {MOST} traces; run it folder by folder")));
        }
    }
    let mut items: Vec<Item> = paths
        .into_iter()
        .map(|path| {
            let axis = axis.map(Path::to_owned).or_else(|| nearest(&path));
            Item { path, axis }
        })
        .collect();
    items.sort_by(|a, b| natural(&a.path.to_string_lossy(), &b.path.to_string_lossy()));
    Ok(items)
}

fn is_axis(path: &Path) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case("toml"))
}

/// The axis file in the folder of a trace or above it.
fn nearest(path: &Path) -> Option<PathBuf> {
    path.ancestors().skip(1).map(|folder| folder.join(AXIS)).find(|file| file.is_file())
}

fn collect_below(
    folder: &Path,
    output: Option<&Path>,
    depth: usize,
    paths: &mut BTreeSet<PathBuf>,
) -> Result<(), FleetError> {
    let failed = |reason| FleetError::Read { path: folder.to_owned(), reason };
    if depth > DEEPEST || paths.len() > MOST || output.is_some_and(|o| folder.canonicalize().is_ok_and(|f| f == o)) {
        return Ok(());
    }
    for entry in std::fs::read_dir(folder).map_err(failed)? {
        let entry = entry.map_err(failed)?;
        let name = entry.file_name();
        if name.to_string_lossy().starts_with('.') {
            continue;
        }
        let kind = entry.file_type().map_err(failed)?;
        let path = entry.path();
        if kind.is_dir() {
            collect_below(&path, output, depth + 1, paths)?;
        } else if path.extension().is_some_and(|e| EXTENSIONS.iter().any(|known| e.eq_ignore_ascii_case(known)))
            && path.is_file()
        {
            paths.insert(path);
        }
    }
    Ok(())
}

/// The folder a file stands in, by its name.
pub(super) fn folder(path: &Path) -> String {
    let parent = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or_else(|| Path::new("."));
    let named = |p: &Path| p.file_name().map(|n| n.to_string_lossy().into_owned());
    named(parent).or_else(|| parent.canonicalize().ok().as_deref().and_then(named)).unwrap_or_else(|| "/".to_owned())
}

/// Order of names as people have it: runs of digits by their number (`run2` before `run10`), the rest by its characters.
pub(super) fn natural(a: &str, b: &str) -> Ordering {
    let (mut left, mut right) = (a.as_bytes(), b.as_bytes());
    while let (Some(x), Some(y)) = (left.first(), right.first()) {
        if x.is_ascii_digit() && y.is_ascii_digit() {
            let digits = |text: &[u8]| text.iter().take_while(|c| c.is_ascii_digit()).count();
            let (m, n) = (digits(left), digits(right));
            let value = |text: &'_ [u8]| -> Vec<u8> { text.iter().copied().skip_while(|c| *c == b'0').collect() };
            let (p, q) = (value(&left[..m]), value(&right[..n]));
            let order = p.len().cmp(&q.len()).then_with(|| p.cmp(&q));
            if order != Ordering::Equal {
                return order;
            }
            (left, right) = (&left[m..], &right[n..]);
        } else if x == y {
            (left, right) = (&left[1..], &right[1..]);
        } else {
            return x.cmp(y);
        }
    }
    left.len().cmp(&right.len()).then_with(|| a.cmp(b))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_with_numbers_stand_in_the_order_of_the_numbers() {
        let mut names = ["run10.csv", "run2.csv", "run2b.csv", "Run1.csv", "run02.csv", "run.csv"];
        names.sort_by(|a, b| natural(a, b));
        assert_eq!(names, ["Run1.csv", "run.csv", "run02.csv", "run2.csv", "run2b.csv", "run10.csv"]);
    }

    #[test]
    fn files_folders_and_patterns_give_each_trace_once_with_the_nearest_axis_file() {
        let root = tempfile::tempdir().unwrap();
        let at = |name: &str| root.path().join(name);
        for folder in ["a/deep", "b", "out", ".git"] {
            std::fs::create_dir_all(at(folder)).unwrap();
        }
        for file in ["a/1.csv", "a/deep/2.parquet", "a/notes.md", "b/3.mat", "out/4.csv", ".git/5.csv"] {
            std::fs::write(at(file), "").unwrap();
        }
        std::fs::write(at("axis.toml"), "").unwrap();
        std::fs::write(at("a/axis.toml"), "").unwrap();
        let arguments = [root.path().to_owned(), at("a/*.csv"), at("b/3.mat"), at("b/missing.csv")];
        let items = find(&arguments, None, &at("out")).unwrap();
        let found: Vec<_> = items
            .iter()
            .map(|i| (i.path.strip_prefix(root.path()).unwrap().to_str().unwrap(), i.axis.clone().unwrap()))
            .collect();
        let (outer, inner) = (at("axis.toml"), at("a/axis.toml"));
        assert_eq!(
            found,
            [
                ("a/1.csv", inner.clone()),
                ("a/deep/2.parquet", inner),
                ("b/3.mat", outer.clone()),
                ("b/missing.csv", outer)
            ]
        );
        let none = find(&[at("b/*.xyz")], None, &at("out")).unwrap_err().to_string();
        assert!(none.contains("b/*.xyz") && none.contains("matches"), "{none}");
        std::fs::create_dir(at("empty")).unwrap();
        let none = find(&[at("empty")], None, &at("out")).unwrap_err().to_string();
        assert!(none.contains("empty") && none.contains("no trace"), "{none}");
    }
}
