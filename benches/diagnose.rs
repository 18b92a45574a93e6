//! Wall time and memory of `eixo diagnose`, all effects and two encoders: `cargo bench --bench diagnose`.
//!
//! Aims: 8192 samples with a single cause in at most 10 s on two cores; under 500 MB for a million samples.

use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant};

#[path = "../tests/program/memory.rs"]
mod memory;

/// A hidden effect of the paper's axis by a parameter that switches it on.
const HIDDEN: [(&str, &str); 4] = [
    ("coulomb_motor", "coulomb_motor.level=0.004"),
    ("backlash", "backlash.half_gap=0.005"),
    ("actuator_lag", "actuator_lag.time_constant=0.002"),
    ("disturbance", "disturbance.amplitude=0.002"),
];

fn main() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = folder.path();
    eixo(at, &["export", "axis.fmu"]);
    std::fs::write(
        at.join("axis.toml"),
        "name = \"bench\"\n[parameters]\nI1 = 2.37e-4\nI2 = 6.07e-6\nB = 5.4e-4\nK = 1.76e-2\nrho = 3.18e-4\n",
    )
    .expect("axis.toml");
    for (name, set) in HIDDEN {
        record(at, 4, set);
        let (took, peak) = diagnose(at);
        println!("{name:<16} 8192 samples: {:6.2} s, peak {:4} MB", took.as_secs_f64(), peak >> 20);
    }
    record(at, 489, HIDDEN[0].1);
    let (took, peak) = diagnose(at);
    println!("{:<16} 1 001 472 samples: {:6.2} s, peak {:4} MB", HIDDEN[0].0, took.as_secs_f64(), peak >> 20);
}

fn record(at: &Path, periods: usize, set: &str) {
    eixo(at, &["excite", "-o", "u.csv", "--periods", &periods.to_string(), "--kind", "odd"]);
    let noise = ["--noise", "theta1=1e-4", "--noise", "theta2=1e-4", "--seed", "7"];
    let simulate =
        ["simulate", "axis.fmu", "--input", "u.csv", "-o", "y.csv", "--outputs", "theta1,theta2", "--set", set];
    eixo(at, &[&simulate[..], &noise[..]].concat());
}

fn eixo(at: &Path, args: &[&str]) {
    let output = Command::new(env!("CARGO_BIN_EXE_eixo")).current_dir(at).args(args).output().expect("eixo runs");
    assert!(output.status.success(), "{args:?}: {}", String::from_utf8_lossy(&output.stderr));
}

/// Wall time, and the largest memory, bytes.
fn diagnose(at: &Path) -> (Duration, u64) {
    let begin = Instant::now();
    let mut program = Command::new(env!("CARGO_BIN_EXE_eixo"));
    program.current_dir(at).args(["diagnose", "y.csv", "--axis", "axis.toml", "--json", "diagnosis.json"]);
    let (_, peak) = memory::peak(&mut program);
    (begin.elapsed(), peak)
}
