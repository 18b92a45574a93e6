//! A cause that explains the record to the noise, but not the one held out: the held-out record has no part in the verdict, and the
//! sentence says that it contradicts it.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use serde_json::Value;

#[path = "program/run.rs"]
mod run;

use run::answered_in;

const AXIS: &str = "[parameters]\nI1 = 2.37e-4\nI2 = 6.07e-6\nB = 5.4e-4\nK = 1.76e-2\n";

#[test]
fn a_load_that_hangs_on_the_other_side_in_the_held_out_record_is_said_to_be_contradicted() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let done = |arguments: &[&str]| answered_in(at, arguments);
    std::fs::write(at.join("axis.toml"), AXIS).unwrap();
    done(&["export", "axis.fmu"]);
    done(&["excite", "-o", "u.csv", "--samples", "2048"]);
    for (name, load, seed) in [("train.csv", "3e-3", "1"), ("same.csv", "3e-3", "2"), ("other.csv", "-3e-3", "3")] {
        let load = format!("load_motor.torque={load}");
        let record = ["simulate", "axis.fmu", "-i", "u.csv", "-o", name, "--outputs", "theta1,theta2", "--set", &load];
        let noise = ["--noise", "theta1=1e-4", "--noise", "theta2=1e-4", "--seed", seed];
        done(&[&record[..], &noise[..]].concat());
    }
    let verdict = |holdout: &str| {
        done(&["diagnose", "train.csv", "--axis", "axis.toml", "--holdout", holdout, "--json", "found.json"]);
        let found: Value = serde_json::from_slice(&std::fs::read(at.join("found.json")).unwrap()).unwrap();
        assert_eq!(found["ranking"][0]["id"], "load_motor");
        assert_eq!(found["verdict"], "effect");
        found["sentence"].as_str().unwrap().contains("contradicts")
    };
    assert!(!verdict("same.csv"));
    assert!(verdict("other.csv"));
}
