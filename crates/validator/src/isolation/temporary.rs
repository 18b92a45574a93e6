//! Temporary folders. Those of a process that was killed are removed by the next one.

use std::io;
use std::path::Path;
use std::sync::{Once, OnceLock};

use tempfile::TempDir;

/// Beginning of the name of every temporary folder; the system that the process numbers are of and the process' number follow.
const PREFIX: &str = "eixo-fmu-";
/// Age from which a folder belongs to no process, even where one has its number, s.
const ABANDONED: u64 = 24 * 3600;

/// Makes a temporary folder, which is removed with the value. The first call removes those of processes that were killed.
///
/// # Errors
/// When the system's folder for temporary files cannot be written.
pub fn folder() -> io::Result<TempDir> {
    static SWEPT: Once = Once::new();
    let root = std::env::temp_dir();
    SWEPT.call_once(|| sweep(&root));
    tempfile::Builder::new().prefix(&format!("{PREFIX}{}-{}-", processes(), std::process::id())).tempdir_in(root)
}

/// Where no list of processes is known.
const UNKNOWN: &str = "0";

/// Whose process numbers these are: of which start of the machine, and of which container on it. Containers and machines may
/// share a folder for temporary files, and each has a process 1.
fn processes() -> &'static str {
    static OWN: OnceLock<String> = OnceLock::new();
    OWN.get_or_init(|| {
        let boot = std::fs::read_to_string("/proc/sys/kernel/random/boot_id").ok();
        let space = std::fs::read_link("/proc/self/ns/pid").ok();
        let (Some(boot), Some(space)) = (boot, space) else { return UNKNOWN.to_owned() };
        let space = space.to_string_lossy();
        boot.chars().take(8).chain(space.chars().filter(char::is_ascii_digit)).collect()
    })
}

fn sweep(root: &Path) {
    for entry in std::fs::read_dir(root).into_iter().flatten().flatten() {
        let name = entry.file_name();
        let mut parts = name.to_str().and_then(|n| n.strip_prefix(PREFIX)).into_iter().flat_map(|n| n.splitn(3, '-'));
        let (Some(of), Some(number), Some(_)) = (parts.next(), parts.next(), parts.next()) else { continue };
        let Ok(number) = number.parse::<u32>() else { continue };
        let ended = of == processes() && of != UNKNOWN && !Path::new("/proc").join(number.to_string()).exists();
        let age = || entry.metadata().ok()?.modified().ok()?.elapsed().ok();
        // A symbolic link of that name is another's.
        let is_folder = entry.file_type().is_ok_and(|t| t.is_dir()) && own(&entry);
        if is_folder && (ended || age().is_some_and(|a| a.as_secs() > ABANDONED)) {
            let _ = super::removal::remove(&entry.path());
        }
    }
}

#[cfg(unix)]
#[allow(unsafe_code)]
fn own(entry: &std::fs::DirEntry) -> bool {
    use std::os::unix::fs::MetadataExt;
    // SAFETY: the call takes nothing and cannot fail.
    entry.metadata().is_ok_and(|m| m.uid() == unsafe { libc::geteuid() })
}

#[cfg(not(unix))]
fn own(_entry: &std::fs::DirEntry) -> bool {
    true
}

/// Bytes that a folder and all below it take on the disk; symbolic links count as themselves.
pub(super) fn size(folder: &Path) -> u64 {
    below(folder, 0)
}

/// As [`size`], of a folder that `depth` open handles lead to.
fn below(folder: &Path, handles: usize) -> u64 {
    /// Bytes that the name and the metadata of a file take, about.
    const ENTRY: u64 = 512;
    /// Handles that are open at once.
    const MOST: usize = 200;
    let mut total = 0;
    let mut open = vec![(folder.to_owned(), 0)];
    while let Some((folder, depth)) = open.pop() {
        if depth == super::removal::DEPTH && handles < MOST {
            // A path has an end, where folders have none: from here on by a handle.
            total += by_handle(&folder, handles).unwrap_or(0);
            continue;
        }
        for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
            total += ENTRY;
            let Ok(metadata) = entry.metadata() else { continue };
            if metadata.is_dir() {
                open.push((entry.path(), depth + 1));
            } else {
                // What is not written takes no room on the disk.
                #[cfg(unix)]
                let length = std::os::unix::fs::MetadataExt::blocks(&metadata) * 512;
                #[cfg(not(unix))]
                let length = metadata.len();
                total += length;
            }
        }
    }
    total
}

#[cfg(target_os = "linux")]
fn by_handle(folder: &Path, handles: usize) -> io::Result<u64> {
    use std::os::fd::AsRawFd;
    let handle = std::fs::File::open(folder)?;
    Ok(below(&Path::new("/proc/self/fd").join(handle.as_raw_fd().to_string()), handles + 1))
}

#[cfg(not(target_os = "linux"))]
fn by_handle(folder: &Path, handles: usize) -> io::Result<u64> {
    Ok(below(folder, handles + 1))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_killed_process_left_goes_and_what_a_running_one_has_stays() {
        if processes() == UNKNOWN {
            return crate::skip::skipped(crate::skip::Lack::Processes, "no list of processes here");
        }
        let root = tempfile::tempdir().unwrap();
        let mut ended = std::process::Command::new("true").spawn().unwrap();
        ended.wait().unwrap();
        let make = |name: String| {
            let path = root.path().join(name);
            std::fs::create_dir_all(path.join("binaries")).unwrap();
            path
        };
        let own = processes();
        let gone = make(format!("{PREFIX}{own}-{}-abc", ended.id()));
        let kept = [
            make(format!("{PREFIX}{own}-{}-abc", std::process::id())),
            // Of another container, which shares the folder.
            make(format!("{PREFIX}{own}1-{}-abc", ended.id())),
            make("eixo-fmu-other".into()),
            make("x".into()),
        ];
        sweep(root.path());
        assert!(!gone.exists());
        assert!(kept.iter().all(|path| path.exists()));
    }

    #[test]
    fn what_lies_deeper_than_a_path_is_long_is_counted_too() {
        let root = tempfile::tempdir().unwrap();
        let chain = |name: &str| {
            let mut bottom = root.path().join(name);
            bottom.extend(std::iter::repeat_n("a", 1500));
            std::fs::create_dir_all(&bottom).unwrap();
            bottom
        };
        let (upper, lower) = (chain("upper"), chain("lower"));
        std::fs::write(lower.join("file"), vec![1; 1 << 20]).unwrap();
        std::fs::rename(root.path().join("lower"), upper.join("b")).unwrap();
        assert!(size(root.path()) >= 1 << 20);
        super::super::removal::remove(&root.path().join("upper")).unwrap();
        assert_eq!(size(root.path()), 0);
    }
}
