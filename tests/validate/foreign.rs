//! FMUs of other tools, where their tools are installed in the project's `.venv`.

use std::path::{Path, PathBuf};
use std::process::Command;

use super::corpus;
use eixo::fmu::rules::Severity;

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

fn python() -> Option<PathBuf> {
    let python = Path::new(env!("CARGO_MANIFEST_DIR")).join(".venv/bin/python");
    let there = Command::new(&python).args(["-c", "import pythonfmu"]).output().is_ok_and(|o| o.status.success());
    if !there {
        eprintln!("skipped: PythonFMU is not installed in .venv; see scripts/venv.sh");
    }
    there.then_some(python)
}

#[test]
fn an_fmu_of_pythonfmu_has_no_error() {
    let Some(python) = python() else { return };
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("spring.py"), SCRIPT).unwrap();
    let mut build = Command::new(&python);
    build.args(["-m", "pythonfmu", "build", "-f", "spring.py"]).current_dir(folder.path());
    let output = build.output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let report = corpus::validate_file(&folder.path().join("Spring.fmu"), false);
    assert_eq!(report.count(Severity::Error), 0, "{:#?}", report.findings);
}
