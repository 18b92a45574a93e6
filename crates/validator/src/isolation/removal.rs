//! Removes what an FMU left in its folder, even where it is nested deeper than a path may be long, or closed to its owner.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

/// How deep a folder is walked into by its path: each level is a descriptor while it is removed, and a part of a path that has
/// an end.
pub(super) const DEPTH: usize = 64;
/// Most rounds, each of which moves up what is nested deeper than [`DEPTH`]; a later run removes what is left after them.
const ROUNDS: usize = 1 << 14;

/// Removes a folder with all that is in it; symbolic links are removed, not followed. One that is not there is no error.
///
/// # Errors
/// The system's, where something stays.
pub(super) fn remove(folder: &Path) -> io::Result<()> {
    match fs::remove_dir_all(folder) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => {}
        _ => return Ok(()),
    }
    make_removable(folder)?;
    fs::remove_dir_all(folder)
}

/// Makes a folder removable: opens all in it to its owner, and moves up what is nested deeply.
///
/// # Errors
/// The system's, where something stays as it is.
pub(super) fn make_removable(folder: &Path) -> io::Result<()> {
    let mut names = 0;
    for _ in 0..ROUNDS {
        if !raise(folder, &mut names)? {
            break;
        }
    }
    Ok(())
}

/// Opens all folders to their owner, and moves those that lie deep into the uppermost one; whether there were any.
fn raise(folder: &Path, names: &mut usize) -> io::Result<bool> {
    let mut moved = false;
    let mut open = vec![(folder.to_owned(), 0)];
    while let Some((path, depth)) = open.pop() {
        if depth == DEPTH {
            fs::rename(&path, free(folder, names))?;
            moved = true;
            continue;
        }
        let _ = give_back(&path);
        for entry in fs::read_dir(&path)?.flatten() {
            if entry.file_type().is_ok_and(|kind| kind.is_dir()) {
                // What is moved is written to: its parent is another folder then.
                let _ = give_back(&entry.path());
                open.push((entry.path(), depth + 1));
            }
        }
    }
    Ok(moved)
}

/// A name in the folder that nothing has.
fn free(folder: &Path, names: &mut usize) -> PathBuf {
    loop {
        *names += 1;
        let path = folder.join(format!("raised-{names}"));
        if path.symlink_metadata().is_err() {
            return path;
        }
    }
}

#[cfg(unix)]
fn give_back(folder: &Path) -> io::Result<()> {
    use std::os::unix::fs::PermissionsExt;
    let mode = fs::symlink_metadata(folder)?.permissions().mode();
    if mode & 0o700 == 0o700 { Ok(()) } else { fs::set_permissions(folder, fs::Permissions::from_mode(0o700)) }
}

#[cfg(not(unix))]
fn give_back(_folder: &Path) -> io::Result<()> {
    Ok(())
}

#[cfg(all(test, unix))]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    /// Folders in one another, of which the lowest is closed to its owner.
    fn chain(top: &Path, levels: usize) -> PathBuf {
        let mut bottom = top.to_owned();
        bottom.extend(std::iter::repeat_n("a", levels));
        fs::create_dir_all(&bottom).unwrap();
        fs::write(bottom.join("file"), "x").unwrap();
        std::os::unix::fs::symlink("/usr", bottom.join("link")).unwrap();
        bottom
    }

    #[test]
    fn folders_deeper_than_a_path_is_long_go_and_what_a_link_names_stays() {
        use std::os::unix::fs::PermissionsExt;
        let root = tempfile::tempdir().unwrap();
        let (upper, lower) = (root.path().join("upper"), root.path().join("lower"));
        let bottom = chain(&upper, 1800);
        let closed = chain(&lower, 1800);
        fs::set_permissions(closed, fs::Permissions::from_mode(0o000)).unwrap();
        fs::rename(&lower, bottom.join("b")).unwrap();
        assert!(raise(&upper, &mut 0).unwrap());
        remove(&upper).unwrap();
        assert!(!upper.exists() && Path::new("/usr").exists());
    }

    #[test]
    fn a_folder_that_is_not_there_is_no_error() {
        remove(Path::new("/nowhere/at/all")).unwrap();
    }
}
