//! Wall time and memory of `eixo diagnose`, all effects suspected: `cargo bench --bench diagnose`.
//!
//! Aims on two cores: 2 s for 8192 samples of two encoders with a single cause, 3 s for 16 384 of a rigid axis, 10 s and 500 MB for a million.

use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant};

#[path = "../tests/program/memory.rs"]
mod memory;

/// Hidden effects of the paper's axis, one at a time, of every family; a gain of the torque is one of the parameters.
const HIDDEN: [&[&str]; 17] = [
    &["coulomb_motor.level=0.004"],
    &["coulomb_table.level=0.001", "coulomb_table.peak=0.5", "coulomb_table.speed=2"],
    &["presliding_motor.level=0.006", "presliding_motor.reach=0.012"],
    &["viscous_table.coefficient=1e-4"],
    &["load_motor.torque=3e-3"],
    &["torque_ripple.amplitude=5e-3", "torque_ripple.order=4"],
    &["backlash.half_gap=0.005"],
    &["cubic_stiffness.k3=20"],
    &["coupling_hysteresis.level=1e-3", "coupling_hysteresis.reach=0.02"],
    &["flexible_mode.inertia=2e-6", "flexible_mode.stiffness=0.02", "flexible_mode.damping=1e-5"],
    &["friction_drift.level_rate=4e-3"],
    &["end_stop.stiffness=0.5", "end_stop.upper=0.3"],
    &["saturation.limit=0.04"],
    &["actuator_lag.time_constant=0.002"],
    &["delay.time=0.002"],
    &["lead_error.scale=0.01"],
    &["disturbance.amplitude=0.002"],
];

/// The paper's axis, and the same as one inertia.
const TWO_INERTIAS: &str =
    "name = \"bench\"\n[parameters]\nI1 = 2.37e-4\nI2 = 6.07e-6\nB = 5.4e-4\nK = 1.76e-2\nrho = 3.18e-4\n";
const RIGID: &str = "name = \"bench\"\nstructure = \"rigid\"\n[parameters]\nI1 = 2.4307e-4\nI2 = 0.0\nrho = 3.18e-4\n";
/// Hidden effects of the rigid axis, one at a time and as machines have them.
const HIDDEN_OF_RIGID: [&[&str]; 4] = [
    &["coulomb_motor.level=0.004"],
    &["torque_ripple.amplitude=5e-3", "torque_ripple.order=4"],
    &["gravity.sine=5e-3"],
    &["coulomb_motor.level=0.004", "viscous_motor.coefficient=1e-4", "load_motor.torque=2e-3"],
];

fn main() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = folder.path();
    eixo(at, &["export", "axis.fmu"]);
    std::fs::write(at.join("axis.toml"), TWO_INERTIAS).expect("axis.toml");
    for settings in HIDDEN {
        record(at, 4, settings);
        report("8192", settings, diagnose(at));
    }
    record(at, 489, HIDDEN[0]);
    report("1 001 472", HIDDEN[0], diagnose(at));
    std::fs::write(at.join("axis.toml"), RIGID).expect("axis.toml");
    for settings in HIDDEN_OF_RIGID {
        record(at, 8, &[settings, &["structure=2"]].concat());
        report("16 384, rigid", settings, diagnose(at));
    }
}

fn report(samples: &str, settings: &[&str], (took, peak): (Duration, u64)) {
    let (took, peak, settings) = (took.as_secs_f64(), peak >> 20, settings.join(" "));
    println!("{samples:>13} samples: {took:6.2} s, peak {peak:4} MB  {settings}");
}

fn record(at: &Path, periods: usize, settings: &[&str]) {
    eixo(at, &["excite", "-o", "u.csv", "--periods", &periods.to_string(), "--kind", "odd"]);
    let noise = ["--noise", "theta1=1e-4", "--noise", "theta2=1e-4", "--seed", "7"];
    let simulate = ["simulate", "axis.fmu", "--input", "u.csv", "-o", "y.csv", "--outputs", "theta1,theta2"];
    let set: Vec<&str> = settings.iter().flat_map(|setting| ["--set", setting]).collect();
    eixo(at, &[&simulate[..], &noise[..], &set[..]].concat());
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
