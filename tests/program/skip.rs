//! What a machine lacks for a test: said, counted, and a failure where it was not expected.
//!
//! A test that returns early counts as passed, and its harness hides what it printed. So each skip also adds a line to the file
//! `EIXO_SKIPPED`, which `scripts/test.sh` shows at its end; and where `EIXO_SKIPS` is set, as `.ci/run` does, what it does not name
//! may not be missing.

#![allow(dead_code, reason = "every test file uses its part")]

use std::fmt::Display;
use std::io::Write;
use std::path::{Path, PathBuf};

/// What may be missing.
#[derive(Debug, Clone, Copy)]
pub enum Lack {
    /// The measured traces, in `EIXO_DATA` (default `../shared/data`).
    Traces,
    /// The Reference FMUs, in `EIXO_FMUS` (default `../shared/fmus`).
    ReferenceFmus,
    /// `.venv` with the packages of `scripts/requirements.txt`.
    Python,
    /// The shared library of the Python interpreter.
    PythonLibrary,
    /// A C compiler, `cc`, on Linux.
    CCompiler,
    /// `valgrind`.
    Valgrind,
    /// Landlock and seccomp in the kernel.
    Sandbox,
    /// `/proc`.
    Processes,
}

impl Lack {
    /// The name in `EIXO_SKIPS`.
    const fn name(self) -> &'static str {
        match self {
            Self::Traces => "traces",
            Self::ReferenceFmus => "reference-fmus",
            Self::Python => "python",
            Self::PythonLibrary => "python-library",
            Self::CCompiler => "c-compiler",
            Self::Valgrind => "valgrind",
            Self::Sandbox => "sandbox",
            Self::Processes => "processes",
        }
    }
}

/// Says that a test, or a part of it, is not run.
///
/// # Panics
/// Where `EIXO_SKIPS` is set and does not name what is missing.
#[track_caller]
pub fn skipped(lack: Lack, why: impl Display) {
    without(lack.name(), why);
}

/// Passes on which importers a script of the project left out: rows `NAME ... SKIPPED: why`, by their first word.
#[track_caller]
pub fn passed_on(printed: &str) {
    for row in printed.lines().filter(|row| row.contains("SKIPPED")) {
        without(row.split_whitespace().next().unwrap_or_default(), row);
    }
}

#[track_caller]
fn without(name: &str, why: impl Display) {
    let test = std::thread::current().name().unwrap_or("a test").to_owned();
    let line = format!("SKIPPED: {test}: {name}: {why}").replace('\n', " ");
    eprintln!("{line}");
    if let Some(path) = std::env::var_os("EIXO_SKIPPED") {
        // One write a line: tests run side by side.
        let file = std::fs::OpenOptions::new().create(true).append(true).open(&path);
        file.and_then(|mut f| f.write_all(format!("{line}\n").as_bytes())).expect("EIXO_SKIPPED can be written");
    }
    if let Ok(expected) = std::env::var("EIXO_SKIPS") {
        let listed = expected.split_whitespace().any(|e| e == name);
        assert!(listed, "{line}\nEIXO_SKIPS=\"{expected}\" does not expect it; with {name} in it the test is left out");
    }
}

/// The project's folder, of the program's tests and of those of the crates below it: where the lock file stands.
fn root() -> &'static Path {
    let own = Path::new(env!("CARGO_MANIFEST_DIR"));
    own.ancestors().find(|folder| folder.join("Cargo.lock").is_file()).unwrap_or(own)
}

fn folder(variable: &str, usual: &str) -> PathBuf {
    std::env::var_os(variable).map_or_else(|| root().join(usual), PathBuf::from)
}

/// A file or folder of the measured traces; said where it is missing.
#[track_caller]
pub fn traces(name: &str) -> Option<PathBuf> {
    let path = folder("EIXO_DATA", "../shared/data").join(name);
    if !path.exists() {
        skipped(Lack::Traces, format_args!("no {}; EIXO_DATA names the folder of the measured traces", path.display()));
        return None;
    }
    Some(path)
}

/// The folder of the Reference FMUs of a version, `fmi2` or `fmi3`; said where it is missing.
#[track_caller]
pub fn reference_fmus(version: &str) -> Option<PathBuf> {
    let path = folder("EIXO_FMUS", "../shared/fmus").join(version);
    if !path.is_dir() {
        skipped(Lack::ReferenceFmus, format_args!("no {}; EIXO_FMUS names the folder", path.display()));
        return None;
    }
    Some(path)
}

/// The Python of `.venv` that can import a module; said where there is none.
#[track_caller]
pub fn python(module: &str) -> Option<PathBuf> {
    let python = root().join(".venv/bin/python");
    let import = format!("import {module}");
    let there = std::process::Command::new(&python).args(["-c", &import]).output().is_ok_and(|o| o.status.success());
    if !there {
        skipped(Lack::Python, format_args!("no {module} in .venv; scripts/venv.sh installs it"));
        return None;
    }
    Some(python)
}
