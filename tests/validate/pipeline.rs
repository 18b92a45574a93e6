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
    let sarif: serde_json::Value = serde_json::from_str(&read("a b--sound.sarif")).unwrap();
    assert!(sarif["runs"][0]["results"].as_array().unwrap().is_empty());
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
}
