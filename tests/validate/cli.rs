//! The command line of `eixo validate`.

use std::process::{Command, Output};

use super::corpus::{self, DESCRIPTION, description, files, pack, running};
use super::skip;
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
    // Notes are no matter even then.
    let noted = || {
        let dependency = [("dependencies=\"2 6\"", "dependencies=\"2 9\"")];
        pack(&files(&description(&dependency)))
    };
    let output = eixo(&["--static", "--strict"], &noted());
    assert!(output.status.code() == Some(0) && text(&output).contains("1 note"), "{}", text(&output));
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

/// Number of rules of FMI 2.0.
fn rules_of_two() -> usize {
    eixo::fmu::rules::of(eixo::fmu::description::Fmi::Two).count()
}

#[test]
fn json_names_every_rule_and_its_verdict() {
    let json: serde_json::Value = serde_json::from_str(&text(&eixo(&["--format", "json"], &failing()))).unwrap();
    assert_eq!(json["schema"], "eixo.validation/1");
    assert_eq!(json["passes"], false);
    assert_eq!(json["rules"].as_array().unwrap().len(), rules_of_two());
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
    assert_eq!(suite.get("tests"), Some(rules_of_two().to_string().as_str()));
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
pub fn processes_with(path: &std::path::Path) -> Vec<std::path::PathBuf> {
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

#[test]
fn not_tested_is_no_pass_and_another_version_of_fmi_is_one_sentence() {
    // A binary of another platform, as far as its head tells: nothing of it can be run.
    let mut foreign = files(DESCRIPTION);
    let mut dll = vec![0; 256];
    dll[..2].copy_from_slice(b"MZ");
    dll[0x3C] = 0x80;
    dll[0x80..0x84].copy_from_slice(b"PE\0\0");
    dll[0x98..0x9A].copy_from_slice(&0x20B_u16.to_le_bytes());
    foreign[1] = ("binaries/win64/corpus.dll".into(), dll);
    let output = eixo(&[], &pack(&foreign));
    assert_eq!(output.status.code(), Some(3), "{}", text(&output));
    assert!(text(&output).contains("was not tested beyond its archive and XML"), "{}", text(&output));
    let output = eixo(&["--static"], &pack(&foreign));
    assert_eq!(output.status.code(), Some(0), "{}", text(&output));
    assert!(text(&output).contains("--static"), "{}", text(&output));
    for version in ["1.0", "4.0-alpha"] {
        let fmu = pack(&files(&description(&[("fmiVersion=\"2.0\"", &format!("fmiVersion=\"{version}\""))])));
        let output = eixo(&[], &fmu);
        let said = String::from_utf8(output.stderr.clone()).unwrap();
        assert_eq!(output.status.code(), Some(2), "{said}");
        assert!(said.contains(&format!("FMI {version}")) && said.lines().count() == 1, "{said}");
    }
}

#[test]
fn findings_of_one_cause_are_one_line_unless_all_are_asked_for() {
    let three = [
        ("name=\"x\" valueReference=\"1\"", "name=\"x y\" valueReference=\"1\""),
        ("name=\"v\" valueReference=\"2\"", "name=\"v y\" valueReference=\"2\""),
        ("name=\"k\" valueReference=\"8\"", "name=\"k\ty\" valueReference=\"8\""),
    ];
    let fmu = pack(&files(&description(&three)));
    let output = text(&eixo(&["--static", "--only", "variable-name"], &fmu));
    assert_eq!(output.matches("[variable-name]").count(), 1, "{output}");
    assert!(output.contains("and 2 more like it") && output.contains("3 warnings"), "{output}");
    assert!(!output.contains('\u{FFFD}'), "a tab is a blank: {output}");
    let output = text(&eixo(&["--static", "--only", "variable-name", "--all"], &fmu));
    assert_eq!(output.matches("[variable-name]").count(), 3, "{output}");
    let json = text(&eixo(&["--static", "--only", "variable-name", "--format", "json"], &fmu));
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert_eq!(json["findings"].as_array().unwrap().len(), 3);
}

#[test]
fn a_run_is_compared_with_reference_results_and_the_page_shows_it() {
    if !corpus::compiler() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).display().to_string();
    std::fs::write(path("model.fmu"), pack(&running(DESCRIPTION, "NONE"))).unwrap();
    let run = |args: &[&str]| {
        let mut command = Command::new(corpus::program());
        let output = command.args(args).current_dir(folder.path()).output().unwrap();
        (output.status.code(), text(&output), String::from_utf8(output.stderr).unwrap())
    };
    // The spring without its force, from the exact solution of x'' = -10 x - 0.5 x' - 0.2 w, w' = x' - w: by the same
    // equations in a finer step, so that the reference is not this program's.
    let (mut x, mut v, mut w, h) = (1.0_f64, 0.0_f64, 0.0_f64, 1e-5);
    let mut rows = String::from("time,y,z\n");
    for k in 0..=100_000 {
        if k % 1000 == 0 {
            rows += &format!("{},{x},{v}\n", f64::from(k) * h);
        }
        // The midpoint rule: second order, an error of about h^2.
        let rate = |x: f64, v: f64, w: f64| (v, -10.0 * x - 0.5 * v - 0.2 * w, v - w);
        let (a, b, c) = rate(x, v, w);
        let (a, b, c) = rate(x + 0.5 * h * a, v + 0.5 * h * b, w + 0.5 * h * c);
        (x, v, w) = (x + h * a, v + h * b, w + h * c);
    }
    std::fs::write(path("good.csv"), &rows).unwrap();
    std::fs::write(path("bad.csv"), rows.replace("time,y,z", "time,z,y")).unwrap();
    let only = ["--only", "simulate"];
    let (code, said, _) =
        run(&[&["validate", "model.fmu", "--reference", "good.csv", "--report", "page.html"][..], &only].concat());
    assert!(code == Some(0) && said.matches("within ").count() >= 2, "{said}");
    let page = std::fs::read_to_string(path("page.html")).unwrap();
    assert!(page.contains("The FMU passes.") && page.contains("good.csv") && page.contains("<svg"), "{}", page.len());
    let (code, said, _) =
        run(&[&["validate", "model.fmu", "--reference", "bad.csv", "--report", "page.html"][..], &only].concat());
    assert!(code == Some(1) && said.contains("OUTSIDE"), "{said}");
    let page = std::fs::read_to_string(path("page.html")).unwrap();
    assert!(page.contains("but not to its reference results"), "{}", page.len());
    let (code, said, _) =
        run(&[&["validate", "model.fmu", "--reference", "bad.csv", "--format", "json"][..], &only].concat());
    let json: serde_json::Value = serde_json::from_str(&said).unwrap();
    assert!(code == Some(1) && json["reference"]["passes"] == false && json["outcome"] == "passes", "{said}");
    std::fs::write(path("none.csv"), "time,q\n0,1\n1,1\n").unwrap();
    let (code, _, said) = run(&[&["validate", "model.fmu", "--reference", "none.csv"][..], &only].concat());
    assert!(code == Some(2) && said.contains("none.csv") && said.contains("y, z"), "{said}");
}

/// Reference-FMUs of the Modelica Association, where they lie beside the project.
#[test]
fn the_reference_fmus_have_no_error_and_no_warning() {
    let Some(folder) = skip::reference_fmus("fmi2") else { return };
    let mut count = 0;
    for path in std::fs::read_dir(&folder)
        .unwrap()
        .flatten()
        .map(|e| e.path())
        .filter(|p| p.extension().is_some_and(|e| e == "fmu"))
    {
        let output = Command::new(corpus::program()).arg("validate").arg(&path).arg("--strict").output().unwrap();
        assert_eq!(output.status.code(), Some(0), "{}", text(&output));
        count += 1;
    }
    assert!(count > 0, "no FMU in {}", folder.display());
}

#[test]
fn info_reads_fmi_3_with_arrays_and_all_types() {
    let xml = r#"<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="3.0" modelName="Three" instantiationToken="{1}">
  <CoSimulation modelIdentifier="three" hasEventMode="true" fixedInternalStepSize="0.5" canGetAndSetFMUState="false"/>
  <DefaultExperiment startTime="0" stopTime="10"/>
  <ModelVariables>
    <UInt64 name="n" valueReference="2" causality="structuralParameter" start="3"/>
    <Float64 name="A" valueReference="4" causality="parameter" variability="tunable" start="1 0 0">
      <Dimension valueReference="2"/><Dimension start="1"/>
    </Float64>
    <Float32 name="y" valueReference="5" causality="output" unit="m"/>
    <Clock name="tick" valueReference="6" causality="input" intervalVariability="triggered"/>
    <String name="s" valueReference="7" causality="parameter"><Start value="hello"/></String>
  </ModelVariables>
</fmiModelDescription>"#;
    let folder = tempfile::tempdir().unwrap();
    let fmu = folder.path().join("three.fmu");
    let archive =
        vec![("modelDescription.xml".into(), xml.into()), ("binaries/x86_64-linux/three.so".into(), vec![0; 1500])];
    std::fs::write(&fmu, pack(&archive)).unwrap();
    let info = |args: &[&str]| {
        let output = Command::new(corpus::program()).arg("info").arg(&fmu).args(args).output().unwrap();
        assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
        text(&output)
    };
    let out = info(&[]);
    for part in [
        "FMI            3.0",
        "hasEventMode, fixedInternalStepSize 0.5\n",
        "x86_64-linux: three.so (2 kB)",
        "Float64[n, 1]  parameter            tunable      1 0 0",
        "Float32        output               continuous          m",
        "hello",
        "Clock          input                discrete",
        "5 of 5",
    ] {
        assert!(out.contains(part), "{part}: {out}");
    }
    assert!(info(&["--causality", "output"]).contains("1 of 5"));
    let json: serde_json::Value = serde_json::from_str(&info(&["--json"])).unwrap();
    assert_eq!(json["variables"][1]["dimensions"], "[n, 1]");
    assert_eq!(json["interfaces"]["CoSimulation"]["modelIdentifier"], "three");
}
