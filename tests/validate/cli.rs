//! The command line of `eixo validate`.

use std::process::{Command, Output};

use super::corpus::{self, DESCRIPTION, description, files, pack, running};
use eixo::fmu::rules::RULES;

fn eixo(args: &[&str], fmu: &[u8]) -> Output {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("model.fmu");
    std::fs::write(&path, fmu).unwrap();
    Command::new(corpus::program()).arg("validate").arg(&path).args(args).output().unwrap()
}

fn text(output: &Output) -> String {
    String::from_utf8(output.stdout.clone()).unwrap()
}

fn warned() -> Vec<u8> {
    pack(&files(&description(&[("modelName=\"Corpus\"", "modelName=\"\"")])))
}

fn failing() -> Vec<u8> {
    pack(&files(&description(&[("start=\"9.81\"", "start=\"9,81\"")])))
}

#[test]
fn exit_codes_tell_passed_from_failed_from_could_not_run() {
    assert_eq!(eixo(&["--static"], &pack(&files(DESCRIPTION))).status.code(), Some(0));
    assert_eq!(eixo(&["--static"], &warned()).status.code(), Some(0));
    assert_eq!(eixo(&["--static", "--strict"], &warned()).status.code(), Some(1));
    assert_eq!(eixo(&["--static", "--strict", "--skip", "model-name"], &warned()).status.code(), Some(0));
    assert_eq!(eixo(&["--static"], &failing()).status.code(), Some(1));
    assert_eq!(eixo(&["--static", "--only", "guid"], &failing()).status.code(), Some(0));
    assert_eq!(eixo(&["--only", "no-such-rule"], &failing()).status.code(), Some(2));
    let missing = Command::new(corpus::program()).args(["validate", "/nowhere/model.fmu"]).output().unwrap();
    assert_eq!(missing.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&missing.stderr).contains("/nowhere/model.fmu"));
}

#[test]
fn text_quotes_the_line_and_says_what_was_not_tested() {
    let out = text(&eixo(&[], &failing()));
    assert!(out.contains("[schema-value]") && out.contains("start=\"9,81\"") && out.contains('^'), "{out}");
    assert!(out.contains("Not tested (which is not passed)"), "{out}");
    assert!(!out.contains('\u{1b}'), "colours in a pipe");
}

#[test]
fn json_names_every_rule_and_its_verdict() {
    let json: serde_json::Value = serde_json::from_str(&text(&eixo(&["--format", "json"], &failing()))).unwrap();
    assert_eq!(json["schema"], "eixo.validation/1");
    assert_eq!(json["passes"], false);
    assert_eq!(json["rules"].as_array().unwrap().len(), RULES.len());
    assert_eq!(json["findings"][0]["rule"], "schema-value");
    assert_eq!(json["findings"][0]["severity"], "error");
    let untested = json["rules"].as_array().unwrap().iter().filter(|r| r["verdict"] == "not_tested");
    assert!(untested.count() > 60);
}

#[test]
fn junit_and_sarif_hold_the_finding_and_what_was_not_tested() {
    let junit = text(&eixo(&["--format", "junit"], &failing()));
    let document = eixo::fmu::xml::Document::parse(junit.as_bytes()).unwrap();
    let suite = document.root.child("testsuite").unwrap();
    assert_eq!(suite.get("tests"), Some(RULES.len().to_string().as_str()));
    assert_eq!(suite.get("failures"), Some("1"));
    let failed = suite.children.iter().find(|case| case.child("failure").is_some()).unwrap();
    assert!(failed.get("name").unwrap().starts_with("schema-value"));
    assert!(suite.children.iter().any(|case| case.child("skipped").is_some()));

    let sarif: serde_json::Value = serde_json::from_str(&text(&eixo(&["--format", "sarif"], &failing()))).unwrap();
    let run = &sarif["runs"][0];
    assert_eq!(sarif["version"], "2.1.0");
    assert_eq!(run["results"][0]["ruleId"], "schema-value");
    let index = run["results"][0]["ruleIndex"].as_u64().unwrap() as usize;
    assert_eq!(run["tool"]["driver"]["rules"][index]["id"], "schema-value");
    assert!(run["results"][0]["locations"][0]["physicalLocation"]["region"]["startLine"].as_u64().unwrap() > 1);
    assert!(!run["invocations"][0]["toolExecutionNotifications"].as_array().unwrap().is_empty());
}

#[test]
fn the_list_of_rules_prints_every_rule() {
    let out = Command::new(corpus::program()).args(["validate", "--rules"]).output().unwrap();
    let out = String::from_utf8(out.stdout).unwrap();
    for rule in RULES {
        assert!(out.contains(&format!("| `{}` | {} | {} |", rule.id, rule.severity, rule.kind)), "{}", rule.id);
    }
}

#[test]
fn a_report_file_appears_whole_and_beside_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let (fmu, out) = (folder.path().join("model.fmu"), folder.path().join("report.json"));
    std::fs::write(&fmu, failing()).unwrap();
    let mut command = Command::new(corpus::program());
    command.arg("validate").arg(&fmu).args(["--static", "--format", "json", "-o"]).arg(&out);
    assert_eq!(command.status().unwrap().code(), Some(1));
    let json: serde_json::Value = serde_json::from_slice(&std::fs::read(&out).unwrap()).unwrap();
    assert_eq!(json["findings"][0]["rule"], "schema-value");
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 2);
}

#[test]
fn nothing_survives_the_run_and_nothing_printed_is_taken_for_a_result() {
    if !corpus::compiler() {
        return;
    }
    for defect in ["STEP_HANG", "STDOUT", "STEP_CRASH", "DAEMON"] {
        let folder = tempfile::tempdir().unwrap();
        let (fmu, temporary) = (folder.path().join("model.fmu"), folder.path().join("tmp"));
        std::fs::write(&fmu, pack(&running(DESCRIPTION, defect))).unwrap();
        std::fs::create_dir(&temporary).unwrap();
        let mut command = Command::new(corpus::program());
        command.arg("validate").arg(&fmu).args(["--format", "json", "--timeout", "2"]).env("TMPDIR", &temporary);
        let output = command.output().unwrap();
        let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        assert_eq!(json["findings"].as_array().unwrap().is_empty(), defect == "DAEMON", "{defect}");
        let survivors = processes_with(&temporary);
        assert!(survivors.is_empty(), "{defect}: {survivors:?}");
        assert_eq!(std::fs::read_dir(&temporary).unwrap().count(), 0, "{defect}");
    }
}

/// Processes whose environment names a path.
fn processes_with(path: &std::path::Path) -> Vec<std::path::PathBuf> {
    use std::os::unix::ffi::OsStrExt;
    let needle = path.as_os_str().as_bytes();
    let entries = std::fs::read_dir("/proc").unwrap().flatten().map(|e| e.path());
    let holds = |process: &std::path::PathBuf| {
        std::fs::read(process.join("environ")).is_ok_and(|e| e.windows(needle.len()).any(|w| w == needle))
    };
    entries.filter(holds).collect()
}

#[test]
fn the_documented_rules_are_the_rules() {
    let file = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/rules.md");
    let written = std::fs::read_to_string(&file).unwrap();
    let table = written.split_once("\n| rule |").map(|(_, rest)| format!("| rule |{rest}")).unwrap();
    let hint =
        "write it again: (sed '/^| rule/,$d' docs/rules.md; eixo validate --rules) > new && mv new docs/rules.md";
    assert_eq!(table, eixo::fmu::output::rules_text(), "{hint}");
}

#[test]
fn info_lists_platforms_capabilities_variables_and_units() {
    let folder = tempfile::tempdir().unwrap();
    let fmu = folder.path().join("model.fmu");
    std::fs::write(&fmu, pack(&files(DESCRIPTION))).unwrap();
    let info = |args: &[&str]| {
        let output = Command::new(corpus::program()).arg("info").arg(&fmu).args(args).output().unwrap();
        assert_eq!(output.status.code(), Some(0));
        text(&output)
    };
    let out = info(&[]);
    for part in
        ["Corpus", "linux64: corpus.so", "canGetAndSetFMUstate", "N = kg.m.s-2", "shown as mm", "18 of 18", "der(x)"]
    {
        assert!(out.contains(part), "{part}: {out}");
    }
    assert!(info(&["--causality", "output"]).contains("6 of 18"));
    let json: serde_json::Value = serde_json::from_str(&info(&["--json"])).unwrap();
    assert_eq!(json["variables"][1]["unit"], "m", "of its declared type");
    assert_eq!(json["units"][3]["base"]["exponents"]["s"], -2);
    assert_eq!(json["coSimulation"]["capabilities"]["canSerializeFMUstate"], true);
    assert_eq!(json["platforms"][0]["platform"], "linux64");
}
