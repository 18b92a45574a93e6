//! Rules on the archive: paths, layout, and whether the binaries are what their folder says (FMI 2.0.4, section 2.3).

use std::collections::{BTreeMap, BTreeSet, HashSet};

use super::super::archive::{Archive, ArchiveError, Hazard};
use super::super::description::{Description, Fmi};
use super::finding::Findings;
use super::id;

/// A platform folder of the standard: name, file name extension, and what the binary must be.
struct Platform {
    folder: &'static str,
    extension: &'static str,
    format: Format,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Format {
    Elf {
        wide: bool,
    },
    Pe {
        wide: bool,
    },
    MachO {
        wide: bool,
    },
    /// Several architectures in one file, as macOS has them.
    Fat,
}

impl std::fmt::Display for Format {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let bits = |wide: bool| if wide { 64 } else { 32 };
        match *self {
            Self::Elf { wide } => write!(f, "a {}-bit ELF shared object", bits(wide)),
            Self::Pe { wide } => write!(f, "a {}-bit Windows DLL", bits(wide)),
            Self::MachO { wide } => write!(f, "a {}-bit Mach-O library", bits(wide)),
            Self::Fat => f.write_str("a universal Mach-O library"),
        }
    }
}

const PLATFORMS: [Platform; 6] = [
    Platform { folder: "linux64", extension: "so", format: Format::Elf { wide: true } },
    Platform { folder: "linux32", extension: "so", format: Format::Elf { wide: false } },
    Platform { folder: "win64", extension: "dll", format: Format::Pe { wide: true } },
    Platform { folder: "win32", extension: "dll", format: Format::Pe { wide: false } },
    Platform { folder: "darwin64", extension: "dylib", format: Format::MachO { wide: true } },
    Platform { folder: "darwin32", extension: "dylib", format: Format::MachO { wide: false } },
];

/// The platforms of FMI 3.0 (section 2.5.1) of which the format is known.
const PLATFORMS3: [Platform; 8] = [
    Platform { folder: "x86_64-linux", extension: "so", format: Format::Elf { wide: true } },
    Platform { folder: "x86-linux", extension: "so", format: Format::Elf { wide: false } },
    Platform { folder: "aarch64-linux", extension: "so", format: Format::Elf { wide: true } },
    Platform { folder: "x86_64-windows", extension: "dll", format: Format::Pe { wide: true } },
    Platform { folder: "x86-windows", extension: "dll", format: Format::Pe { wide: false } },
    Platform { folder: "aarch64-windows", extension: "dll", format: Format::Pe { wide: true } },
    Platform { folder: "x86_64-darwin", extension: "dylib", format: Format::MachO { wide: true } },
    Platform { folder: "aarch64-darwin", extension: "dylib", format: Format::MachO { wide: true } },
];

/// Checks the entries themselves; whether the archive can be extracted.
pub(super) fn entries(archive: &mut Archive, findings: &mut Findings) -> bool {
    let mut safe = true;
    let mut folded: BTreeMap<String, String> = BTreeMap::new();
    for entry in archive.entries() {
        match entry.hazard {
            Some(Hazard::Backslash) => {
                findings.entry(id::ARCHIVE_BACKSLASH, &entry.name, Hazard::Backslash.to_string())
            }
            Some(hazard) => findings.entry(id::ARCHIVE_PATH, &entry.name, hazard.to_string()),
            None => {}
        }
        safe &= entry.hazard.is_none();
        if entry.encrypted || !entry.common_method {
            let what = if entry.encrypted { "is encrypted" } else { "is neither stored nor deflated" };
            findings.entry(id::ARCHIVE_METHOD, &entry.name, format!("the entry {what}; importers cannot read it"));
            safe = false;
        }
        if let Some(other) = folded.insert(entry.name.to_lowercase(), entry.name.clone())
            && other != entry.name
        {
            let message =
                format!("differs from \"{other}\" in case alone: one overwrites the other on Windows and macOS");
            findings.entry(id::ARCHIVE_DUPLICATE, &entry.name, message);
        }
    }
    let files: HashSet<&str> = archive.entries().iter().filter(|e| !e.is_dir).map(|e| e.name.as_str()).collect();
    for entry in archive.entries() {
        let mut folders = entry.name.match_indices('/').map(|(at, _)| &entry.name[..at]);
        if let Some(folder) = folders.find(|folder| files.contains(folder)) {
            let message =
                format!("lies in the folder {folder}, which is a file of the archive too: only one can be unpacked");
            findings.entry(id::ARCHIVE_DUPLICATE, &entry.name, message);
            safe = false;
        }
    }
    if archive.has_duplicate_names() {
        findings.whole(id::ARCHIVE_DUPLICATE, "two entries of the archive have the same name");
    }
    if !safe {
        return false;
    }
    match archive.test() {
        Ok(()) => true,
        Err(error @ ArchiveError::TooLarge { .. }) => {
            findings.whole(id::ARCHIVE_BOMB, error.to_string());
            false
        }
        Err(ArchiveError::Entry { name, message }) => {
            findings.entry(id::ARCHIVE_DAMAGED, &name, message);
            false
        }
        Err(error) => {
            findings.whole(id::ARCHIVE_DAMAGED, error.to_string());
            false
        }
    }
}

/// Finds the description, or reports where it is instead.
pub(super) fn description(archive: &Archive, findings: &mut Findings) -> bool {
    if archive.contains("modelDescription.xml") {
        return true;
    }
    let near = archive.entries().iter().find(|e| e.name.to_lowercase().ends_with("modeldescription.xml"));
    let message = match near {
        Some(entry) => format!(
            "modelDescription.xml must be at the top of the archive under exactly this name; there is \"{}\"",
            entry.name
        ),
        None => "the archive has no modelDescription.xml".into(),
    };
    findings.whole(id::ARCHIVE_DESCRIPTION, message);
    false
}

/// Checks binaries and sources against the description.
pub(super) fn layout(archive: &mut Archive, d: &Description, findings: &mut Findings) {
    let names: Vec<String> = archive.entries().iter().filter(|e| !e.is_dir).map(|e| e.name.clone()).collect();
    let present: HashSet<&str> = names.iter().map(String::as_str).collect();
    let known: &[Platform] = if d.fmi == Fmi::Three { &PLATFORMS3 } else { &PLATFORMS };
    let has_sources = names.iter().any(|n| n.starts_with("sources/"));
    let folders: BTreeSet<&str> =
        names.iter().filter_map(|n| n.strip_prefix("binaries/")?.split_once('/').map(|(folder, _)| folder)).collect();
    for name in &names {
        if let Some(rest) = name.strip_prefix("binaries/")
            && !rest.contains('/')
        {
            let message = format!("a binary must be in a platform folder such as binaries/{}/", known[0].folder);
            findings.entry(id::BINARY_FOLDER, name, message);
        }
    }
    for folder in &folders {
        let folded = folder.to_lowercase();
        let old = d.fmi == Fmi::Three && PLATFORMS.iter().any(|p| p.folder == *folder);
        if old {
            let message = "the folder has a name of FMI 2.0; FMI 3.0 has platform tuples such as x86_64-linux";
            findings.entry(id::BINARY_FOLDER, &format!("binaries/{folder}/"), message);
        }
        if !known.iter().any(|p| p.folder == *folder) && known.iter().any(|p| p.folder == folded) {
            let message = format!("the platform folder is spelt {folded}");
            findings.entry(id::BINARY_FOLDER, &format!("binaries/{folder}/"), message);
        }
    }
    let identifiers: BTreeSet<&str> = [&d.co_simulation, &d.model_exchange]
        .into_iter()
        .flatten()
        .map(|interface| interface.model_identifier.as_str())
        .filter(|identifier| !identifier.is_empty())
        .collect();
    for platform in known.iter().filter(|p| folders.contains(p.folder)) {
        for identifier in &identifiers {
            let file = format!("binaries/{}/{identifier}.{}", platform.folder, platform.extension);
            if !present.contains(file.as_str()) {
                findings.entry(
                    id::BINARY_NAME,
                    &file,
                    format!("missing, although binaries/{}/ is there", platform.folder),
                );
                continue;
            }
            if let Ok(found) = format_in(archive, &file) {
                let size = archive.entries().iter().find(|e| e.name == file).map_or(0, |e| e.size);
                check_format(&file, found, size, platform, findings);
            }
        }
    }
    if folders.is_empty() && !has_sources && !findings.has(id::BINARY_FOLDER) {
        findings.whole(id::BINARY_MISSING, "the archive has neither binaries/<platform>/ nor sources/");
    }
    for interface in [&d.co_simulation, &d.model_exchange].into_iter().flatten() {
        for (file, position) in &interface.source_files {
            if !present.contains(format!("sources/{file}").as_str()) {
                findings.at(id::SOURCE_FILES, *position, format!("sources/{file} is not in the archive"));
            }
        }
    }
}

/// The format of an entry, by its start: inflating all of a large library takes longer than all static rules together.
fn format_in(archive: &mut Archive, file: &str) -> Result<Option<Format>, ArchiveError> {
    const START: u64 = 4096;
    let start = archive.start(file, START)?;
    match format(&start) {
        // The header of a DLL stands wherever the one of DOS says, in rare cases further in.
        None if start.starts_with(b"MZ") && start.len() as u64 == START => Ok(format(&archive.read(file)?)),
        found => Ok(found),
    }
}

fn check_format(file: &str, found: Option<Format>, size: u64, platform: &Platform, findings: &mut Findings) {
    let good = found == Some(platform.format) || found == Some(Format::Fat) && platform.extension == "dylib";
    if !good {
        let found = found.map_or("something else".to_owned(), |f| f.to_string());
        let message = format!("must be {}, but is {found} ({size} bytes)", platform.format);
        findings.entry(id::BINARY_FORMAT, file, message);
    }
}

/// The format by its magic numbers; offsets from the ELF, PE and Mach-O specifications.
fn format(bytes: &[u8]) -> Option<Format> {
    let u16_at = |at: usize| bytes.get(at..at + 2).map(|b| u16::from_le_bytes([b[0], b[1]]));
    match bytes.get(..4)? {
        [0x7F, b'E', b'L', b'F'] => match bytes.get(4)? {
            1 => Some(Format::Elf { wide: false }),
            2 => Some(Format::Elf { wide: true }),
            _ => None,
        },
        [b'M', b'Z', ..] => {
            let offset = usize::from(u16_at(0x3C)?) + (usize::from(u16_at(0x3E)?) << 16);
            if bytes.get(offset..offset.checked_add(4)?)? != b"PE\0\0" {
                return None;
            }
            match u16_at(offset + 24)? {
                0x10B => Some(Format::Pe { wide: false }),
                0x20B => Some(Format::Pe { wide: true }),
                _ => None,
            }
        }
        [0xCF, 0xFA, 0xED, 0xFE] => Some(Format::MachO { wide: true }),
        [0xCE, 0xFA, 0xED, 0xFE] => Some(Format::MachO { wide: false }),
        [0xCA, 0xFE, 0xBA, 0xBE | 0xBF] => Some(Format::Fat),
        _ => None,
    }
}
