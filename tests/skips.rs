//! A test that leaves something out does so aloud, and fails where nobody expected it.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::process::Command;

#[path = "program/skip.rs"]
mod skip;

#[test]
#[ignore = "run by the test below, under its variables"]
fn without_traces() {
    assert!(skip::traces("there/is/no/such/trace.csv").is_none());
}

#[test]
fn a_skip_is_written_down_and_fails_where_it_is_not_expected() {
    let folder = tempfile::tempdir().unwrap();
    let written = folder.path().join("skipped");
    let passes = |expected: Option<&str>| {
        let mut run = Command::new(std::env::current_exe().unwrap());
        run.args(["--ignored", "--exact", "without_traces"]).env("EIXO_SKIPPED", &written).env_remove("EIXO_SKIPS");
        run.envs(expected.map(|names| ("EIXO_SKIPS", names)));
        run.output().unwrap().status.success()
    };
    let cases = [(None, true), (Some("python traces"), true), (Some(""), false), (Some("python"), false)];
    for (expected, allowed) in cases {
        assert_eq!(passes(expected), allowed, "{expected:?}");
    }
    let lines = std::fs::read_to_string(&written).unwrap();
    assert_eq!(lines.lines().filter(|l| l.starts_with("SKIPPED: without_traces: traces: no ")).count(), cases.len());
}
