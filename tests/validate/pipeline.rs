//! The script behind the GitHub action (`action.yml`), run as the action runs it.

use std::path::Path;
use std::process::{Command, Output};

use super::corpus::{self, DESCRIPTION, description, files, pack};

fn validate(folder: &Path, options: &[&str]) -> Output {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut command = Command::new(root.join("scripts/validate_fmus.sh"));
    command.arg(folder.join("build")).arg(folder.join("reports")).args(options);
    command.env("EIXO", corpus::program()).output().unwrap()
}

#[test]
fn every_fmu_of_a_build_gets_a_report_and_the_gravest_result_is_the_exit_code() {
    let folder = tempfile::tempdir().unwrap();
    let build = folder.path().join("build");
    std::fs::create_dir_all(build.join("a b")).unwrap();
    let sound = pack(&files(DESCRIPTION));
    let broken = pack(&files(&description(&[("start=\"9.81\"", "start=\"9,81\"")])));
    std::fs::write(build.join("a b/sound.fmu"), &sound).unwrap();
    let output = validate(folder.path(), &["--static"]);
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    std::fs::write(build.join("broken.fmu"), &broken).unwrap();
    let output = validate(folder.path(), &["--static"]);
    assert_eq!(output.status.code(), Some(1), "{}", String::from_utf8_lossy(&output.stderr));
    let read = |name: &str| std::fs::read_to_string(folder.path().join("reports").join(name)).unwrap();
    let sarif: serde_json::Value = serde_json::from_str(&read("broken.sarif")).unwrap();
    assert_eq!(sarif["runs"][0]["results"][0]["ruleId"], "schema-value");
    let sound: serde_json::Value = serde_json::from_str(&read("a b--sound.sarif")).unwrap();
    assert!(sound["runs"][0]["results"].as_array().unwrap().is_empty());
    // Uploaded together, two runs of one category would be refused; a category ends in a slash.
    let category = |of: &serde_json::Value| of["runs"][0]["automationDetails"]["id"].as_str().unwrap().to_owned();
    assert_ne!(category(&sarif), category(&sound));
    assert!(category(&sound).ends_with("build/a b/sound.fmu/"), "{}", category(&sound));
    assert!(read("broken.html").contains("The FMU fails.") && read("a b--sound.html").contains("passes the rules"));
    // One that cannot be read is graver than findings.
    std::fs::write(build.join("old.fmu"), pack(&files(&description(&[("fmiVersion=\"2.0\"", "fmiVersion=\"1.0\"")]))))
        .unwrap();
    assert_eq!(validate(folder.path(), &["--static"]).status.code(), Some(2));
    let empty = tempfile::tempdir().unwrap();
    std::fs::create_dir(empty.path().join("build")).unwrap();
    assert_eq!(validate(empty.path(), &[]).status.code(), Some(2));
}

#[test]
fn the_action_calls_the_script_and_names_its_exit_codes() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let action = std::fs::read_to_string(root.join("action.yml")).unwrap();
    for part in ["scripts/validate_fmus.sh", "sarif_file: ${{ inputs.reports }}", "using: composite", "3 not tested"] {
        assert!(action.contains(part), "{part}");
    }
    assert!(!action.contains("category:"), "one category for all SARIF files makes the upload fail");
}

/// The lines of a step's `run: |` in the action.
fn step(name: &str) -> String {
    let action = std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("action.yml")).unwrap();
    let step = action.split(&format!("- name: {name}\n")).nth(1).unwrap();
    let lines = step.split("run: |\n").nth(1).unwrap().lines();
    lines.take_while(|l| l.starts_with("        ")).map(|l| &l[8..]).collect::<Vec<_>>().join("\n")
}

/// The action's own steps, run by bash as the runner runs them: what they call, what they hand on, how they judge.
#[test]
fn the_steps_of_the_action_run_and_judge() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let folder = tempfile::tempdir().unwrap();
    let build = folder.path().join("build");
    std::fs::create_dir_all(&build).unwrap();
    let run = |options: &str| -> String {
        let told = folder.path().join("output");
        std::fs::write(&told, "").unwrap();
        let mut bash = Command::new("bash");
        bash.args(["--noprofile", "--norc", "-eo", "pipefail", "-c", &step("Validate")]);
        bash.env("GITHUB_ACTION_PATH", root).env("GITHUB_OUTPUT", &told).env("EIXO", corpus::program());
        bash.env("FOLDER", &build).env("REPORTS", folder.path().join("reports")).env("OPTIONS", options);
        let output = bash.output().unwrap();
        // Uploading comes first: this step never fails.
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        std::fs::read_to_string(told).unwrap()
    };
    std::fs::write(build.join("sound.fmu"), pack(&files(DESCRIPTION))).unwrap();
    assert_eq!(run("--static"), "code=0\n");
    // Nothing of an option is shell code.
    assert_eq!(run("--static --skip guid;touch${IFS}owned"), "code=2\n");
    assert!(!Path::new("owned").exists());
    std::fs::write(build.join("broken.fmu"), pack(&files(&description(&[("start=\"9.81\"", "start=\"9,81\"")]))))
        .unwrap();
    assert_eq!(run("--static"), "code=1\n");
    let judge = |code: &str, not_tested: &str| {
        let mut bash = Command::new("bash");
        bash.args(["-eo", "pipefail", "-c", &step("Judge")]).env("CODE", code).env("NOT_TESTED", not_tested);
        bash.status().unwrap().code()
    };
    assert_eq!([judge("0", "false"), judge("1", "false"), judge("2", "false")], [Some(0), Some(1), Some(2)]);
    assert_eq!([judge("3", "false"), judge("3", "true")], [Some(0), Some(3)]);
}
