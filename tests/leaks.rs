//! A thousand instantiate and free cycles under valgrind, driven from C: no leak, no bad access, every status as it should
//! be. Skipped, and said so, where there is no C compiler or no valgrind.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::path::Path;
use std::process::Command;

use eixo::fmu::package::Package;
use eixo::variables::guid;

#[path = "program/skip.rs"]
mod skip;

use skip::{Lack, skipped};

#[test]
fn a_thousand_cycles_leak_nothing_and_touch_nothing_they_may_not() {
    let folder = tempfile::tempdir().unwrap();
    let package = Package::default();
    let library = folder.path().join("eixo.so");
    std::fs::write(&library, package.binary().unwrap()).unwrap();
    let driver = folder.path().join("leaks");
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/importers/leaks.c");
    match Command::new("cc").arg("-g").arg(&source).arg("-o").arg(&driver).arg("-ldl").output() {
        Err(error) => return skipped(Lack::CCompiler, error),
        Ok(done) => assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr)),
    }
    let guid = guid(&package.starts).to_string();
    let run =
        |command: &mut Command, cycles: &str| command.arg(&driver).arg(&library).args([guid.as_str(), cycles]).output();
    // Without valgrind first: then a failure is one of the statuses.
    let done = run(&mut Command::new("env"), "50").unwrap();
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    let mut valgrind = Command::new("valgrind");
    valgrind.args([
        "--quiet",
        "--leak-check=full",
        "--show-leak-kinds=definite,indirect,possible",
        "--error-exitcode=9",
    ]);
    match run(&mut valgrind, "1000") {
        Err(error) => skipped(Lack::Valgrind, error),
        Ok(done) => assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr)),
    }
}
