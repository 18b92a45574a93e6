//! FMUs of other tools, where their tools are installed in the project's `.venv`.

use std::path::{Path, PathBuf};
use std::process::Command;

use super::corpus;
use super::skip::{self, Lack, skipped};
use eixo::fmu::rules::{RuleStatus, Severity};

const SCRIPT: &str = r#"
from pythonfmu import Fmi2Slave, Fmi2Causality, Fmi2Variability, Real, Integer, Boolean, String

class Spring(Fmi2Slave):
    author = "eixo"
    description = "mass on a spring"

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.x = 1.0
        self.v = 0.0
        self.force = 0.0
        self.k = 10.0
        self.register_variable(Real("x", causality=Fmi2Causality.output))
        self.register_variable(Real("v", causality=Fmi2Causality.output))
        self.register_variable(Real("force", causality=Fmi2Causality.input))
        self.register_variable(Real("k", causality=Fmi2Causality.parameter, variability=Fmi2Variability.tunable))

    def do_step(self, current_time, step_size):
        self.v += step_size * (self.force - self.k * self.x)
        self.x += step_size * self.v
        return True
"#;

/// The library of the interpreter, which such an FMU expects its host to have loaded.
fn python_library(python: &Path) -> Option<PathBuf> {
    let ask = "import sysconfig as s; print(s.get_config_var('LIBDIR') + '/' + (s.get_config_var('INSTSONAME') or ''))";
    let output = Command::new(python).args(["-c", ask]).output().ok()?;
    let file = PathBuf::from(String::from_utf8(output.stdout).ok()?.trim());
    (file.is_file() && file.to_string_lossy().contains(".so")).then_some(file)
}

#[test]
fn an_fmu_of_pythonfmu_has_no_error() {
    let Some(python) = skip::python("pythonfmu") else { return };
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("spring.py"), SCRIPT).unwrap();
    let mut build = Command::new(&python);
    build.args(["-m", "pythonfmu", "build", "-f", "spring.py"]).current_dir(folder.path());
    let output = build.output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let fmu = folder.path().join("Spring.fmu");
    // By itself it cannot be loaded, and says that it needs its tool.
    let report = corpus::validate_file(&fmu, false);
    assert_eq!(report.count(Severity::Error), 0, "{:#?}", report.findings);
    let Some(library) = python_library(&python) else {
        return skipped(Lack::PythonLibrary, "this Python has no shared library to run the FMU with");
    };
    let mut command = Command::new(corpus::program());
    command.arg("validate").arg(&fmu).args(["--format", "json", "--timeout", "30"]).env("LD_PRELOAD", library);
    let output = command.output().unwrap();
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(json["counts"]["error"], 0, "{json:#}");
    let ran = json["rules"].as_array().unwrap().iter().any(|r| r["id"] == "simulate" && r["verdict"] == "passed");
    assert!(ran, "{json:#}");
}

#[test]
fn our_own_fmu_is_clean_under_strict() {
    let folder = tempfile::tempdir().unwrap();
    let fmu = folder.path().join("axis.fmu");
    let output = Command::new(corpus::program()).arg("export").arg(&fmu).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let report = corpus::validate_file(&fmu, false);
    assert!(report.passes(true), "{:#?}", report.findings);
    let untested: Vec<_> = report.rules.iter().filter(|(_, v)| matches!(v, RuleStatus::NotTested(_))).collect();
    assert!(untested.is_empty(), "{untested:#?}");
}
