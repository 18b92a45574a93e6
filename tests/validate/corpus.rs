//! Building and validating the corpus.

use std::io::{Cursor, Write};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::{Mutex, OnceLock};

use super::skip::{Lack, skipped};
use eixo::fmu::rules::Report;
use eixo::fmu::validation::{self, Options};
use zip::{ZipWriter, write::SimpleFileOptions};

/// The description that belongs to `fmu.c`.
pub const DESCRIPTION: &str = include_str!("../corpus/modelDescription.xml");
/// Path of the binary in the archive.
pub const BINARY: &str = "binaries/linux64/corpus.so";

/// An FMU in memory and the rule that must kill it.
pub struct Mutant {
    pub name: String,
    pub rule: &'static str,
    make: Box<dyn Fn() -> Vec<u8> + Send + Sync>,
}

impl Mutant {
    pub fn new(name: &str, rule: &'static str, make: impl Fn() -> Vec<u8> + Send + Sync + 'static) -> Self {
        Self { name: name.to_owned(), rule, make: Box::new(make) }
    }

    pub fn build(&self) -> Vec<u8> {
        (self.make)()
    }
}

/// Files of an archive in order.
pub type Files = Vec<(String, Vec<u8>)>;

/// The sound FMU with another description. Its binary does not matter to static rules: a bare ELF header.
pub fn files(description: &str) -> Files {
    let mut elf = vec![0; 64];
    elf[..5].copy_from_slice(b"\x7fELF\x02");
    vec![
        ("modelDescription.xml".into(), description.into()),
        (BINARY.into(), elf),
        ("resources/data.txt".into(), b"data that is long enough to be deflated, data, data, data".to_vec()),
    ]
}

/// Packs files into an archive.
pub fn pack(files: &Files) -> Vec<u8> {
    let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
    for (name, bytes) in files {
        zip.start_file(name.as_str(), SimpleFileOptions::default()).unwrap();
        zip.write_all(bytes).unwrap();
    }
    zip.finish().unwrap().into_inner()
}

/// The sound description with replacements, each of which must occur exactly once.
pub fn description(replacements: &[(&str, &str)]) -> String {
    let mut text = DESCRIPTION.to_owned();
    for (from, to) in replacements {
        assert_eq!(text.matches(from).count(), 1, "{from}");
        text = text.replace(from, to);
    }
    text
}

/// Whether there is a C compiler; says so when not.
pub fn compiler() -> bool {
    let there = Command::new("cc").arg("--version").output().is_ok_and(|o| o.status.success());
    let there = there && cfg!(target_os = "linux");
    if !there {
        skipped(Lack::CCompiler, "there is no C compiler `cc`, or this is not Linux");
    }
    there
}

fn scratch() -> &'static Path {
    static FOLDER: OnceLock<tempfile::TempDir> = OnceLock::new();
    FOLDER.get_or_init(|| tempfile::tempdir().unwrap()).path()
}

/// The binary with a defect.
pub fn binary(defect: &str) -> Vec<u8> {
    binary_of("fmu.c", defect, "")
}

/// The binary of a source with a defect, and one of FMI 3.0 alone where it is named.
pub fn binary_of(source: &str, defect: &str, own: &str) -> Vec<u8> {
    static LOCK: Mutex<()> = Mutex::new(());
    let file = scratch().join(format!("{source}-{defect}-{own}.so"));
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/corpus").join(source);
    // Tests of one process may ask for the same binary at the same time.
    let guard = (defect == "NONE" && own.is_empty()).then(|| LOCK.lock().unwrap());
    if !file.exists() {
        let part = file.with_extension("part");
        let output = Command::new("cc")
            .args(["-shared", "-fPIC", "-O1", "-w", "-fvisibility=hidden"])
            .args([
                format!("-DDEFECT={defect}"),
                format!("-DDEFECT_{defect}=1"),
                format!("-DDEFECT3_{own}=1"),
                "-o".into(),
            ])
            .args([&part, &source])
            .args(["-lm", "-lpthread"])
            .output()
            .unwrap();
        assert!(output.status.success(), "{defect}: {}", String::from_utf8_lossy(&output.stderr));
        std::fs::rename(&part, &file).unwrap();
    }
    drop(guard);
    std::fs::read(&file).unwrap()
}

/// An FMU that runs: a description, and the binary with a defect.
pub fn running(description: &str, defect: &str) -> Files {
    let mut files = files(description);
    files[1].1 = binary(defect);
    files
}

/// This package's program.
pub fn program() -> PathBuf {
    env!("CARGO_BIN_EXE_eixo").into()
}

/// Validates an archive in memory.
pub fn validate(bytes: &[u8], static_only: bool) -> Report {
    let mut file = tempfile::Builder::new().suffix(".fmu").tempfile_in(scratch()).unwrap();
    file.write_all(bytes).unwrap();
    validate_file(file.path(), static_only)
}

/// Validates a file.
pub fn validate_file(path: &Path, static_only: bool) -> Report {
    // A hang is told from a slow machine by a generous limit.
    let (call, budget) = (std::time::Duration::from_secs(8), std::time::Duration::from_secs(600));
    let options = Options { static_only, jobs: 2, call, budget, ..Options::new(program()) };
    validation::validate(path, &options, &|_, _| {}).unwrap()
}

/// Does something with each item on several threads and collects what it says.
pub fn parallel<T: Sync>(items: &[T], each: impl Fn(&T) -> Option<String> + Sync) -> Vec<String> {
    let next = std::sync::atomic::AtomicUsize::new(0);
    let said = Mutex::new(Vec::new());
    std::thread::scope(|scope| {
        for _ in 0..4 {
            scope.spawn(|| {
                while let Some(item) = items.get(next.fetch_add(1, std::sync::atomic::Ordering::Relaxed)) {
                    if let Some(what) = each(item) {
                        said.lock().unwrap().push(what);
                    }
                }
            });
        }
    });
    said.into_inner().unwrap()
}
