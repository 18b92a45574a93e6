//! Outputs destroy nothing: no input is written over, by name, link or hard link, in any command; links are followed, devices and
//! pipes written through; a disk that is full or a limit of the file size leaves neither half a file nor one of our own.

#![allow(clippy::unwrap_used, reason = "a test may")]
#![cfg(unix)]

use std::io::Write;
use std::os::unix::fs::{PermissionsExt, symlink};
use std::path::Path;
use std::process::{Command, Stdio};

#[path = "program/run.rs"]
mod run;

use run::eixo_in;

const AXIS: &str =
    "name = \"axis\"\n[parameters]\nI1 = 2.37e-4\nI2 = 6.07e-6\nB = 5.4e-4\nK = 1.76e-2\nrho = 3.18e-4\n";

/// A folder with an axis, an excitation, a record and an FMU.
fn prepared() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("axis.toml"), AXIS).unwrap();
    for arguments in [
        &["excite", "-o", "u.csv", "--samples", "512"][..],
        &["simulate", "axis.toml", "--input", "u.csv", "-o", "log.csv"],
        &["export", "axis.fmu"],
    ] {
        let done = eixo_in(folder.path(), arguments);
        assert!(done.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&done.stderr));
    }
    folder
}

fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> =
        std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

#[test]
fn no_command_writes_over_an_input() {
    let folder = prepared();
    let at = |name: &str| folder.path().join(name);
    symlink("log.csv", at("soft.csv")).unwrap();
    std::fs::hard_link(at("log.csv"), at("hard.csv")).unwrap();
    symlink("axis.toml", at("soft.toml")).unwrap();
    let before = names(folder.path());
    for line in [
        "identify log.csv --json log.csv",
        "identify log.csv --report soft.csv",
        "identify log.csv --json hard.csv",
        "identify log.csv --axis axis.toml --axis-out soft.toml",
        "identify log.csv --axis axis.toml --report ./axis.toml",
        "diagnose log.csv --axis axis.toml --json log.csv",
        "diagnose log.csv --axis axis.toml --fmu hard.csv",
        "diagnose log.csv --axis axis.toml --holdout u.csv --report u.csv",
        "inspect log.csv --json soft.csv",
        "init log.csv --yes -o log.csv --force",
        "simulate axis.fmu --input u.csv -o u.csv",
        "simulate axis.fmu --input u.csv -o axis.fmu",
        "export axis.toml --axis axis.toml",
        "export soft.toml --axis axis.toml",
        "circle axis.toml -o axis.toml",
        "circle axis.toml --y soft.toml --report axis.toml",
        "validate axis.fmu -o axis.fmu",
        "validate axis.fmu --report axis.fmu",
        "validate axis.fmu --reference log.csv --report log.csv",
        "validate axis.fmu --reference log.csv --input u.csv -o u.csv",
    ] {
        let arguments: Vec<&str> = line.split(' ').collect();
        let kept = |name: &str| std::fs::read(at(name)).unwrap();
        let were = ["log.csv", "u.csv", "axis.toml", "axis.fmu"].map(kept);
        let done = eixo_in(folder.path(), &arguments);
        let said = String::from_utf8_lossy(&done.stderr).into_owned();
        assert_eq!(done.status.code(), Some(2), "{line}: {said}");
        assert!(said.contains("is the input"), "{line}: {said}");
        assert!(were == ["log.csv", "u.csv", "axis.toml", "axis.fmu"].map(kept), "{line}");
    }
    assert_eq!(names(folder.path()), before);
}

#[test]
fn a_summary_that_is_a_trace_is_refused() {
    let folder = prepared();
    let done =
        eixo_in(folder.path(), &["identify", ".", "--output", "found", "--method", "ls", "--summary", "log.csv"]);
    let said = String::from_utf8_lossy(&done.stderr).into_owned();
    assert_eq!(done.status.code(), Some(2), "{said}");
    assert!(said.contains("is the input"), "{said}");
}

#[test]
fn a_named_pipe_gives_its_reader_everything() {
    let folder = prepared();
    let pipe = folder.path().join("pipe");
    assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    let reader = std::thread::spawn(move || std::fs::read_to_string(pipe).unwrap());
    let done = eixo_in(folder.path(), &["identify", "log.csv", "--method", "ls", "--json", "pipe"]);
    assert!(matches!(done.status.code(), Some(0 | 1)), "{}", String::from_utf8_lossy(&done.stderr));
    let found: serde_json::Value = serde_json::from_str(&reader.join().unwrap()).unwrap();
    assert_eq!(found["schema"], "eixo.identification/1");
}

#[test]
fn devices_are_written_through_links_followed_and_modes_kept() {
    let folder = prepared();
    let at = |name: &str| folder.path().join(name);
    std::fs::write(at("kept.json"), "old").unwrap();
    std::fs::set_permissions(at("kept.json"), std::fs::Permissions::from_mode(0o604)).unwrap();
    symlink("kept.json", at("link.json")).unwrap();
    let done = eixo_in(
        folder.path(),
        &["identify", "log.csv", "--method", "ls", "--json", "link.json", "--report", "/dev/null"],
    );
    assert_eq!(done.status.code(), Some(0), "{}", String::from_utf8_lossy(&done.stderr));
    assert!(std::fs::symlink_metadata(at("link.json")).unwrap().is_symlink());
    assert!(std::fs::read_to_string(at("kept.json")).unwrap().contains("eixo.identification"));
    assert_eq!(std::fs::metadata(at("kept.json")).unwrap().permissions().mode() & 0o777, 0o604);
    // A result on standard output is that alone: what is said to people goes elsewhere.
    let done = eixo_in(folder.path(), &["identify", "log.csv", "--method", "ls", "--json", "-"]);
    let found: serde_json::Value = serde_json::from_slice(&done.stdout).unwrap();
    assert_eq!(found["schema"], "eixo.identification/1");
    assert!(String::from_utf8_lossy(&done.stderr).contains("identifies the axis"));
    // And a record may come from standard input.
    let mut child = Command::new(env!("CARGO_BIN_EXE_eixo"))
        .args(["inspect", "-"])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    child.stdin.take().unwrap().write_all(&std::fs::read(at("log.csv")).unwrap()).unwrap();
    let done = child.wait_with_output().unwrap();
    assert_eq!(done.status.code(), Some(0), "{}", String::from_utf8_lossy(&done.stdout));
}

#[test]
fn a_full_disk_and_a_limit_of_the_file_size_leave_nothing() {
    let folder = prepared();
    let before = names(folder.path());
    if Path::new("/dev/full").exists() {
        let done = eixo_in(folder.path(), &["identify", "log.csv", "--method", "ls", "--json", "/dev/full"]);
        assert_eq!(done.status.code(), Some(2));
        assert!(String::from_utf8_lossy(&done.stderr).contains("Make room"), "{done:?}");
    }
    // 8 blocks of 512 or 1024 bytes: less than the record.
    let script = format!("ulimit -f 8; exec {} excite -o big.csv --samples 4096", env!("CARGO_BIN_EXE_eixo"));
    let done = Command::new("sh").args(["-c", &script]).current_dir(folder.path()).output().unwrap();
    assert_eq!(done.status.code(), Some(2), "{done:?}");
    assert!(String::from_utf8_lossy(&done.stderr).contains("big.csv: cannot write"), "{done:?}");
    assert!(String::from_utf8_lossy(&done.stderr).contains("ulimit -f"), "{done:?}");
    assert_eq!(names(folder.path()), before);
}

#[test]
fn names_of_outputs_mean_what_they_say_and_numbers_without_bound_are_not_written() {
    let folder = prepared();
    let at = |name: &str| folder.path().join(name);
    let packed = eixo_in(folder.path(), &["excite", "-o", "u.parquet"]);
    if cfg!(feature = "parquet") {
        assert!(packed.status.success() && std::fs::read(at("u.parquet")).unwrap().starts_with(b"PAR1"), "{packed:?}");
    } else {
        assert!(String::from_utf8_lossy(&packed.stderr).contains("--features parquet"), "{packed:?}");
    }
    // A text under the name of another form is taken for a damaged file.
    for name in ["u.xlsx", "u.MAT", "u.npz"] {
        let done = eixo_in(folder.path(), &["excite", "-o", name]);
        let said = String::from_utf8_lossy(&done.stderr).into_owned();
        assert!(done.status.code() == Some(2) && said.contains(".csv or .parquet"), "{said}");
        assert!(!at(name).exists(), "{name}");
    }
    let done = eixo_in(folder.path(), &["excite", "-o", "nan.csv", "--rms", "1e308", "--offset", "1e308"]);
    assert_eq!(done.status.code(), Some(2), "{done:?}");
    assert!(!at("nan.csv").exists());
    let done = eixo_in(folder.path(), &["simulate", "axis.toml", "-o", "long.csv", "--stop", "1e9", "--step", "1e-6"]);
    let said = String::from_utf8_lossy(&done.stderr).into_owned();
    assert!(done.status.code() == Some(2) && (said.contains("memory") || said.contains("rows")), "{said}");
    // XML allows no control character, and no spreadsheet is handed a formula.
    std::fs::write(at("odd.toml"), AXIS.replace("\"axis\"", "\"a\\u0001b\"")).unwrap();
    let done = eixo_in(folder.path(), &["export", "odd.fmu", "--axis", "odd.toml"]);
    assert!(done.status.code() == Some(2) && !at("odd.fmu").exists(), "{done:?}");
    std::fs::create_dir(at("=cmd")).unwrap();
    std::fs::copy(at("log.csv"), at("=cmd/log.csv")).unwrap();
    std::fs::write(at("=cmd/axis.toml"), AXIS.replace("\"axis\"", "\"=1+1\"")).unwrap();
    let done = eixo_in(folder.path(), &["identify", "=cmd", "--output", "found", "--method", "ls"]);
    assert!(matches!(done.status.code(), Some(0 | 1)), "{}", String::from_utf8_lossy(&done.stderr));
    let summary = std::fs::read_to_string(at("found/summary.csv")).unwrap();
    let cells = summary.lines().flat_map(|l| l.split(','));
    assert!(cells.clone().count() > 10);
    cells.for_each(|c| assert!(!c.trim_start_matches('"').starts_with(['=', '+', '@']), "{c}"));
}
