//! Reading an FMU's ZIP archive, which is untrusted: every size is bounded, no path leaves the target folder.
//!
//! Sizes are checked against the bytes that are really inflated, not against the headers.

use std::fs::{self, File};
use std::io::{self, Cursor, Read, Seek, Write};
use std::path::{Path, PathBuf};

use tempfile::TempDir;
use zip::{CompressionMethod, ZipArchive, result::ZipError};

/// Bounds on what is read from an archive.
#[derive(Debug, Clone, Copy)]
pub struct Limits {
    /// Largest number of entries.
    pub entries: usize,
    /// Largest inflated size of one entry, in bytes.
    pub entry: u64,
    /// Largest inflated size of all entries together, in bytes.
    pub total: u64,
    /// Largest ratio of inflated to stored size, for entries above [`Limits::ratio_from`].
    pub ratio: u64,
    /// Inflated size from which the ratio counts, in bytes: small files of one character compress beyond any ratio.
    pub ratio_from: u64,
    /// Largest `modelDescription.xml`, in bytes.
    pub xml: u64,
}

impl Default for Limits {
    fn default() -> Self {
        Self { entries: 50_000, entry: 2 << 30, total: 4 << 30, ratio: 250, ratio_from: 8 << 20, xml: 256 << 20 }
    }
}

/// Why an archive could not be read.
#[derive(Debug, thiserror::Error)]
pub enum ArchiveError {
    /// The file itself cannot be opened or read.
    #[error("{path}: {reason}")]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system says.
        reason: io::Error,
    },
    /// Not a ZIP archive, or a damaged one.
    #[error("{path}: not a readable ZIP archive: {reason}")]
    Zip {
        /// The file.
        path: PathBuf,
        /// What the reader says.
        reason: ZipError,
    },
    /// No such entry.
    #[error("the archive has no entry {0}")]
    Missing(String),
    /// An entry that cannot be read: damaged, encrypted, or compressed by a method other than deflate.
    #[error("entry {name}: {message}")]
    Entry {
        /// The entry.
        name: String,
        /// What is wrong.
        message: String,
    },
    /// An entry, or the archive, that is larger than the limits allow.
    #[error("{what}: {size} is more than the limit of {limit}")]
    TooLarge {
        /// Which size.
        what: String,
        /// The size found, or the part of it that was read.
        size: u64,
        /// The limit.
        limit: u64,
    },
    /// An entry whose path leads out of the archive.
    #[error("entry {name}: {hazard}; nothing was extracted")]
    Unsafe {
        /// The entry.
        name: String,
        /// Why it is refused.
        hazard: Hazard,
    },
}

/// Why an entry's name is refused or questionable.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Hazard {
    /// The path climbs out with `..`.
    Traversal,
    /// The path is absolute or names a drive.
    Absolute,
    /// The path uses backslashes as separators.
    Backslash,
    /// The entry is a symbolic link.
    Symlink,
    /// The name is empty or holds a control character.
    BadName,
}

impl std::fmt::Display for Hazard {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Traversal => "the path climbs out of the archive with `..`",
            Self::Absolute => "the path is absolute",
            Self::Backslash => "the path uses backslashes as separators",
            Self::Symlink => "the entry is a symbolic link",
            Self::BadName => "the name is empty or holds a control character",
        })
    }
}

/// One entry, as the central directory describes it.
#[derive(Debug, Clone)]
pub struct Entry {
    /// The name as stored, lossily decoded.
    pub name: String,
    /// Inflated size according to the header, in bytes.
    pub size: u64,
    /// Stored size, in bytes.
    pub stored: u64,
    /// Whether the entry is a folder.
    pub is_dir: bool,
    /// Whether the entry is encrypted.
    pub encrypted: bool,
    /// Whether the entry is stored or deflated, the only methods that importers read.
    pub common_method: bool,
    /// What makes the entry unsafe, if anything.
    pub hazard: Option<Hazard>,
    mode: Option<u32>,
}

trait Source: Read + Seek + Send {}
impl<T: Read + Seek + Send> Source for T {}

/// An open archive.
pub struct Archive {
    path: PathBuf,
    zip: ZipArchive<Box<dyn Source>>,
    entries: Vec<Entry>,
    limits: Limits,
}

impl std::fmt::Debug for Archive {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Archive").field("path", &self.path).field("entries", &self.entries).finish_non_exhaustive()
    }
}

impl Archive {
    /// Opens an archive with the default limits.
    ///
    /// # Errors
    /// When the file cannot be read, is no ZIP archive, or has too many entries.
    pub fn open(path: &Path) -> Result<Self, ArchiveError> {
        let io = |reason| ArchiveError::Io { path: path.to_owned(), reason };
        let file = File::open(path).map_err(io)?;
        if file.metadata().map_err(io)?.is_dir() {
            return Err(io(io::Error::new(io::ErrorKind::IsADirectory, "is a folder, not an FMU archive")));
        }
        Self::with_source(path, Box::new(io::BufReader::new(file)), Limits::default())
    }

    /// Reads an archive from memory.
    ///
    /// # Errors
    /// As [`Archive::open`].
    pub fn from_bytes(bytes: Vec<u8>, limits: Limits) -> Result<Self, ArchiveError> {
        Self::with_source(Path::new("(memory)"), Box::new(Cursor::new(bytes)), limits)
    }

    fn with_source(path: &Path, source: Box<dyn Source>, limits: Limits) -> Result<Self, ArchiveError> {
        let zip_error = |reason| ArchiveError::Zip { path: path.to_owned(), reason };
        let zip = ZipArchive::new(source).map_err(zip_error)?;
        if zip.len() > limits.entries {
            return Err(ArchiveError::TooLarge {
                what: "number of entries".into(),
                size: zip.len() as u64,
                limit: limits.entries as u64,
            });
        }
        let mut entries = Vec::with_capacity(zip.len());
        for index in 0..zip.len() {
            let file = zip.by_index_data(index).map_err(zip_error)?;
            let name = match file.name() {
                Ok(name) => name.into_owned(),
                Err(_) => String::from_utf8_lossy(file.name_raw()).into_owned(),
            };
            let symlink = file.unix_mode().is_some_and(|mode| mode & 0o170_000 == 0o120_000);
            entries.push(Entry {
                hazard: if symlink { Some(Hazard::Symlink) } else { hazard(&name) },
                is_dir: name.ends_with(['/', '\\']),
                size: file.size(),
                stored: file.compressed_size(),
                encrypted: file.encrypted(),
                common_method: matches!(file.compression(), CompressionMethod::Stored | CompressionMethod::Deflated),
                mode: file.unix_mode(),
                name,
            });
        }
        Ok(Self { path: path.to_owned(), zip, entries, limits })
    }

    /// The entries, in the order of the central directory.
    #[must_use]
    pub fn entries(&self) -> &[Entry] {
        &self.entries
    }

    /// Whether two entries have the same name.
    #[must_use]
    pub fn has_duplicate_names(&self) -> bool {
        self.zip.has_duplicate_names()
    }

    /// Whether a file of this name is there.
    #[must_use]
    pub fn contains(&self, name: &str) -> bool {
        self.entries.iter().any(|entry| entry.name == name)
    }

    /// Inflates one entry.
    ///
    /// # Errors
    /// When there is no such entry, it cannot be inflated, its checksum is wrong, or it is too large.
    pub fn read(&mut self, name: &str) -> Result<Vec<u8>, ArchiveError> {
        let index = self.entries.iter().position(|entry| entry.name == name);
        let index = index.ok_or_else(|| ArchiveError::Missing(name.to_owned()))?;
        let mut bytes = Vec::new();
        self.inflate(index, self.limits.xml, &mut bytes)?;
        Ok(bytes)
    }

    /// The first bytes of one entry, `length` or fewer. Its checksum is not compared: [`Archive::test`] does that.
    ///
    /// # Errors
    /// When there is no such entry, or it cannot be inflated.
    pub fn start(&mut self, name: &str, length: u64) -> Result<Vec<u8>, ArchiveError> {
        let index = self.entries.iter().position(|entry| entry.name == name);
        let index = index.ok_or_else(|| ArchiveError::Missing(name.to_owned()))?;
        let fail = |message: String| ArchiveError::Entry { name: name.to_owned(), message };
        let file = self.zip.by_index(index).map_err(|error| fail(error.to_string()))?;
        let mut bytes = Vec::new();
        file.take(length).read_to_end(&mut bytes).map_err(|error| fail(error.to_string()))?;
        Ok(bytes)
    }

    /// Inflates every entry and discards the bytes, so that damage is found: wrong checksums, truncated data, wrong sizes.
    ///
    /// # Errors
    /// The first entry that is damaged or too large.
    pub fn test(&mut self) -> Result<(), ArchiveError> {
        self.for_all(|archive, index, budget| archive.inflate(index, budget, &mut io::sink()))
    }

    /// Extracts everything into a fresh temporary folder, which is deleted when the value is dropped.
    ///
    /// # Errors
    /// When an entry is unsafe, damaged or too large; nothing stays on disk then.
    pub fn extract(&mut self) -> Result<TempDir, ArchiveError> {
        for entry in &self.entries {
            if let Some(hazard) = entry.hazard {
                return Err(ArchiveError::Unsafe { name: entry.name.clone(), hazard });
            }
        }
        let folder = super::isolation::temporary::folder()
            .map_err(|reason| ArchiveError::Io { path: std::env::temp_dir(), reason })?;
        let root = folder.path().to_owned();
        self.for_all(|archive, index, budget| archive.extract_entry(&root, index, budget))?;
        Ok(folder)
    }

    fn for_all(
        &mut self,
        mut each: impl FnMut(&mut Self, usize, u64) -> Result<u64, ArchiveError>,
    ) -> Result<(), ArchiveError> {
        let mut total = 0;
        for index in 0..self.entries.len() {
            let left = self.limits.total - total;
            total += each(self, index, left.min(self.limits.entry))?;
        }
        Ok(())
    }

    fn extract_entry(&mut self, root: &Path, index: usize, budget: u64) -> Result<u64, ArchiveError> {
        let entry = self.entries[index].clone();
        let target = root.join(&entry.name);
        let io = |reason| ArchiveError::Io { path: target.clone(), reason };
        if entry.is_dir {
            fs::create_dir_all(&target).map_err(io)?;
            return Ok(0);
        }
        if let Some(parent) = target.parent() {
            fs::create_dir_all(parent).map_err(io)?;
        }
        let mut file = File::create(&target).map_err(io)?;
        let size = self.inflate(index, budget, &mut file)?;
        #[cfg(unix)]
        if let Some(mode) = entry.mode {
            use std::os::unix::fs::PermissionsExt;
            fs::set_permissions(&target, fs::Permissions::from_mode(mode & 0o755 | 0o600)).map_err(io)?;
        }
        Ok(size)
    }

    fn inflate(&mut self, index: usize, limit: u64, out: &mut dyn Write) -> Result<u64, ArchiveError> {
        let entry = &self.entries[index];
        let name = entry.name.clone();
        if entry.is_dir {
            return Ok(0);
        }
        let ratio_limit = entry.stored.saturating_mul(self.limits.ratio).max(self.limits.ratio_from);
        let limit = limit.min(ratio_limit);
        let fail = |message: String| ArchiveError::Entry { name: name.clone(), message };
        let file = self.zip.by_index(index).map_err(|error| fail(error.to_string()))?;
        let size = io::copy(&mut file.take(limit + 1), out).map_err(|error| fail(error.to_string()))?;
        if size > limit {
            return Err(ArchiveError::TooLarge { what: format!("entry {name}, inflated, in bytes"), size, limit });
        }
        Ok(size)
    }
}

fn hazard(name: &str) -> Option<Hazard> {
    let bytes = name.as_bytes();
    if name.is_empty() || name.chars().any(char::is_control) {
        return Some(Hazard::BadName);
    }
    let drive = bytes.len() > 1 && bytes[1] == b':' && bytes[0].is_ascii_alphabetic();
    if name.starts_with(['/', '\\']) || drive {
        return Some(Hazard::Absolute);
    }
    if name.split(['/', '\\']).any(|part| part == "..") {
        return Some(Hazard::Traversal);
    }
    name.contains('\\').then_some(Hazard::Backslash)
}

#[cfg(test)]
mod tests {
    use super::*;
    use zip::{ZipWriter, write::SimpleFileOptions};

    fn archive(files: &[(&str, &[u8])]) -> Vec<u8> {
        let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
        for (name, bytes) in files {
            zip.start_file(*name, SimpleFileOptions::default()).unwrap();
            zip.write_all(bytes).unwrap();
        }
        zip.finish().unwrap().into_inner()
    }

    #[test]
    fn an_archive_extracts_into_its_folder_and_the_folder_goes_with_the_value() {
        let bytes = archive(&[("modelDescription.xml", b"<x/>"), ("resources/a/b.txt", b"hello")]);
        let mut archive = Archive::from_bytes(bytes, Limits::default()).unwrap();
        let folder = archive.extract().unwrap();
        let path = folder.path().to_owned();
        assert_eq!(fs::read(path.join("resources/a/b.txt")).unwrap(), b"hello");
        drop(folder);
        assert!(!path.exists());
    }

    #[test]
    fn the_start_of_an_entry_is_that_of_the_whole() {
        let text = vec![b'x'; 100_000];
        let mut archive = Archive::from_bytes(archive(&[("a", &text), ("b", b"hello")]), Limits::default()).unwrap();
        assert_eq!(archive.start("a", 4096).unwrap(), &text[..4096]);
        assert_eq!(archive.start("b", 4096).unwrap(), b"hello");
        assert!(matches!(archive.start("c", 4096), Err(ArchiveError::Missing(_))));
    }

    #[test]
    fn paths_that_leave_the_archive_are_refused() {
        for (name, expected) in [
            ("../evil", Hazard::Traversal),
            ("a/../../evil", Hazard::Traversal),
            ("..\\evil", Hazard::Traversal),
            ("/etc/evil", Hazard::Absolute),
            ("C:/evil", Hazard::Absolute),
            ("binaries\\win64\\x.dll", Hazard::Backslash),
            ("a\u{1}", Hazard::BadName),
        ] {
            assert_eq!(hazard(name), Some(expected), "{name}");
        }
        assert_eq!(hazard("resources/..a/b..c"), None);
    }

    #[test]
    fn a_bomb_is_stopped_while_it_inflates() {
        let bytes = archive(&[("resources/zeros", &vec![0; 10 << 20])]);
        let mut bomb = Archive::from_bytes(bytes, Limits { ratio_from: 1 << 20, ..Limits::default() }).unwrap();
        assert!(matches!(bomb.extract(), Err(ArchiveError::TooLarge { .. })));
    }

    #[test]
    fn a_damaged_entry_is_named() {
        let mut bytes = archive(&[("modelDescription.xml", b"a text long enough to have a body of its own")]);
        let at = bytes.windows(4).position(|w| w == b".xml").unwrap() + 8;
        bytes[at] ^= 0xff;
        let mut damaged = Archive::from_bytes(bytes, Limits::default()).unwrap();
        let error = damaged.test().unwrap_err().to_string();
        assert!(error.contains("modelDescription.xml"), "{error}");
    }
}
