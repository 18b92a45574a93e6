//! The program as a user runs it.

#![allow(dead_code, reason = "every test file uses its part")]

use std::ffi::OsStr;
use std::path::Path;
use std::process::{Command, Output};

/// Runs the program where the test stands.
pub fn eixo(arguments: &[&str]) -> Output {
    eixo_in(Path::new("."), arguments)
}

/// Runs the program in a folder.
pub fn eixo_in(folder: &Path, arguments: &[impl AsRef<OsStr>]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_eixo")).current_dir(folder).args(arguments).output().expect("eixo runs")
}

/// Runs the program in a folder, which must answer, findings or none, and gives what it said.
#[track_caller]
pub fn answered_in(folder: &Path, arguments: &[impl AsRef<OsStr> + std::fmt::Debug]) -> String {
    let done = eixo_in(folder, arguments);
    assert!(matches!(done.status.code(), Some(0 | 1)), "{arguments:?}: {}", String::from_utf8_lossy(&done.stderr));
    String::from_utf8_lossy(&done.stdout).into_owned()
}

/// Runs the program, which must end well, and gives what it said.
#[track_caller]
pub fn fine(arguments: &[&str]) -> String {
    let done = eixo(arguments);
    assert!(done.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&done.stderr));
    String::from_utf8_lossy(&done.stdout).into_owned()
}
