//! Broken records: none of them is identified, none is given a cause. What is wrong is named, and the exit code is 1.

#![allow(clippy::unwrap_used, reason = "a test may")]

use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};

use log::{ALL, Log, POSITIONS};

mod broken;
mod log;
#[path = "../program/run.rs"]
mod run;

const AXIS: &str =
    "name = \"axis\"\n[parameters]\nI1 = 2.37e-4\nI2 = 6.07e-6\nB = 5.4e-4\nK = 1.76e-2\nrho = 3.18e-4\n";

#[test]
fn a_torque_that_was_logged_early_identifies_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    std::fs::write(at("axis.toml"), AXIS).unwrap();
    let mut log = Log::with_friction(1, 0.0);
    log.0[1].rotate_left(4);
    log.write(&at("log.csv"), POSITIONS);
    for extra in [&["--method", "oe"][..], &["--stream", "--method", "ls"]] {
        let done = run::eixo_in(folder.path(), &[&["identify", "log.csv", "--axis", "axis.toml"], extra].concat());
        let said = String::from_utf8_lossy(&done.stdout).split_whitespace().collect::<Vec<_>>().join(" ");
        assert_eq!(done.status.code(), Some(1), "{extra:?}: {said} {}", String::from_utf8_lossy(&done.stderr));
        assert!(!said.contains("identifies the axis"), "{extra:?}: {said}");
        assert!(said.contains("4 samples") && said.contains("behind its torque"), "{extra:?}: {said}");
    }
}

#[test]
fn a_refusal_says_what_reading_the_record_found_too() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    std::fs::write(at("axis.toml"), AXIS).unwrap();
    let mut log = Log::new(1);
    log.0[2].fill(0.25);
    log.write(&at("log.csv"), POSITIONS);
    // A cell of the torque is lost.
    let text = std::fs::read_to_string(at("log.csv")).unwrap();
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    let mut cells: Vec<&str> = lines[100].split(',').collect();
    cells[1] = "";
    lines[100] = cells.join(",");
    std::fs::write(at("log.csv"), lines.join("\n")).unwrap();
    let done = run::eixo_in(folder.path(), &["identify", "log.csv", "--axis", "axis.toml", "--json", "seen.json"]);
    let said = String::from_utf8_lossy(&done.stdout).split_whitespace().collect::<Vec<_>>().join(" ");
    assert_eq!(done.status.code(), Some(1), "{said}");
    assert!(said.contains("No verdict is given") && said.contains("has no number in 1 of"), "{said}");
    let json: serde_json::Value = serde_json::from_slice(&std::fs::read(at("seen.json")).unwrap()).unwrap();
    assert!(json["warnings"][0].as_str().unwrap().contains("has no number in 1 of"), "{json}");
}

#[test]
fn the_record_that_they_were_made_of_is_believed() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    std::fs::write(at("axis.toml"), AXIS).unwrap();
    for (seed, keep) in [(1, ALL), (2, ALL), (1, POSITIONS)] {
        Log::new(seed).write(&at("log.csv"), keep);
        let done = run::eixo_in(
            folder.path(),
            &["inspect", "log.csv", "--axis", "axis.toml", "--report", "seen.html", "--json", "seen.json"],
        );
        let said = String::from_utf8_lossy(&done.stdout).into_owned();
        assert_eq!(done.status.code(), Some(0), "{said}");
        let page = std::fs::read_to_string(at("seen.html")).unwrap();
        assert!(page.contains("Inspection of a record") && page.ends_with("</html>"), "the page");
        let json: serde_json::Value = serde_json::from_slice(&std::fs::read(at("seen.json")).unwrap()).unwrap();
        assert_eq!(json["schema"], "eixo.examination/1");
    }
}

#[test]
fn samples_that_the_log_held_are_counted_and_dated_by_the_inspection() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    std::fs::write(at("axis.toml"), AXIS).unwrap();
    let mut log = Log::new(1);
    // Where the motor is fastest in each third of the record.
    let third = log.0[3].len() / 3;
    let fastest =
        |range: std::ops::Range<usize>| range.max_by(|a, b| log.0[3][*a].abs().total_cmp(&log.0[3][*b].abs())).unwrap();
    let held = [fastest(10..third), fastest(third..2 * third), fastest(2 * third..3 * third - 10)];
    held.iter().for_each(|k| log.hold(2, *k - 1..*k + 1));
    log.write(&at("log.csv"), POSITIONS);
    let done = run::eixo_in(folder.path(), &["inspect", "log.csv", "--axis", "axis.toml", "--json", "seen.json"]);
    let said = String::from_utf8_lossy(&done.stdout).into_owned();
    assert_eq!(done.status.code(), Some(0), "{said}");
    assert!(said.contains("3 samples of theta1 repeat the one before while the axis goes on."), "{said}");
    let json: serde_json::Value = serde_json::from_slice(&std::fs::read(at("seen.json")).unwrap()).unwrap();
    let all = json["examination"]["findings"].as_array().unwrap();
    let notes: Vec<_> = all.iter().filter(|f| f["id"] == "held_samples").collect();
    assert_eq!(notes.len(), 1, "theta2 has none: {all:?}");
    assert_eq!((&notes[0]["severity"], &notes[0]["signal"]), (&"note".into(), &"theta1".into()));
    assert_eq!(notes[0]["samples"], 3);
    for (told, k) in notes[0]["seconds"].as_array().unwrap().iter().zip(held) {
        assert!((told[0].as_f64().unwrap() - log.0[0][k]).abs() < 1e-9, "{told} {k}");
    }
}

#[test]
fn white_noise_identifies_nothing_in_memory_or_streamed() {
    let folder = tempfile::tempdir().unwrap();
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(3);
    let mut log = Log((0..6).map(|_| (0..20_000).map(|_| StandardNormal.sample(&mut rng)).collect()).collect());
    log.0[0] = (0..20_000).map(|k| f64::from(k) * 1e-3).collect();
    log.write(&folder.path().join("log.csv"), POSITIONS);
    for extra in [&["--method", "ls"][..], &["--method", "ls", "--trust"], &["--stream"], &["--stream", "--trust"]] {
        let done = run::eixo_in(folder.path(), &[&["identify", "log.csv"], extra].concat());
        let said = String::from_utf8_lossy(&done.stdout).into_owned();
        assert_eq!(done.status.code(), Some(1), "{extra:?}: {said} {}", String::from_utf8_lossy(&done.stderr));
        assert!(!said.contains("identifies the axis"), "{extra:?}: {said}");
    }
}

#[test]
fn the_pieces_between_gaps_are_identified_together_and_no_counter_needs_to_go_on() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("axis.toml"), AXIS).unwrap();
    let mut log = Log::with_friction(1, 0.0);
    // The table's counter was set anew in the second gap.
    log.0[4][4900..].iter_mut().for_each(|v| *v += 30.0);
    for column in &mut log.0 {
        column.drain(4000..4900);
        column.drain(2000..2100);
    }
    for (keep, methods) in [(ALL, "ls,rls,els,iv,oe"), (POSITIONS, "oe")] {
        log.write(&folder.path().join("log.csv"), keep);
        let typed = [
            "identify",
            "log.csv",
            "--axis",
            "axis.toml",
            "--method",
            methods,
            "--json",
            "out.json",
            "--report",
            "out.html",
        ];
        let done = run::eixo_in(folder.path(), &typed);
        let said = String::from_utf8_lossy(&done.stdout).into_owned();
        assert_eq!(done.status.code(), Some(0), "{said} {}", String::from_utf8_lossy(&done.stderr));
        assert!(said.contains("3 pieces"), "{said}");
        let json: serde_json::Value =
            serde_json::from_slice(&std::fs::read(folder.path().join("out.json")).unwrap()).unwrap();
        assert_eq!((json["trace"]["pieces"].as_u64(), json["trace"]["samples"].as_u64()), (Some(3), Some(5000)));
        let of = |name: &str| json["methods"].as_array().unwrap().iter().find(|m| m["method"] == name).unwrap().clone();
        for p in of("oe")["parameters"].as_array().unwrap() {
            let number = |key: &str| p[key].as_f64().unwrap();
            let off = (number("value") - number("reference")) / number("std");
            assert!(off.abs() < 4.0 && number("std") < 0.05 * number("value"), "{p}");
        }
        if keep.len() == ALL.len() {
            for name in ["ls", "rls", "els", "iv"] {
                let found = of(name);
                assert!(found["failure"].is_null(), "{found}");
                // A difference across a gap would be an acceleration of thousands of rad/s2, and the inertia nothing.
                let i1 = found["parameters"][0]["value"].as_f64().unwrap();
                assert!((i1 / 2.37e-4 - 1.0).abs() < 0.1, "{name}: {i1}");
            }
        }
    }
}

#[test]
fn a_part_of_a_record_is_taken_and_resampled_by_every_command_that_reads_one() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    std::fs::write(at("axis.toml"), AXIS).unwrap();
    let mut log = Log::with_friction(1, 0.0);
    log.write(&at("log.csv"), ALL);
    let said = |typed: &[&str]| {
        let done = run::eixo_in(folder.path(), typed);
        assert!(matches!(done.status.code(), Some(0 | 1)), "{typed:?}: {}", String::from_utf8_lossy(&done.stderr));
        format!("{}{}", String::from_utf8_lossy(&done.stdout), String::from_utf8_lossy(&done.stderr))
    };
    let part = ["--from", "1", "--to", "3"];
    let times = || {
        let text = std::fs::read_to_string(at("out.csv")).unwrap();
        let time = |line: &str| line.split(',').next().unwrap().parse::<f64>().unwrap();
        let rows: Vec<f64> = text.lines().skip(1).map(time).collect();
        (rows.len(), rows[0], rows[rows.len() - 1])
    };
    run::fine(&["export", at("axis.fmu").to_str().unwrap()]);
    for model in ["axis.toml", "axis.fmu"] {
        said(&[&["simulate", model, "--input", "log.csv", "-o", "out.csv"][..], &part].concat());
        let (rows, first, last) = times();
        assert!(
            rows == 2001 && (first - 1.0).abs() < 1e-9 && (last - 3.0).abs() < 1e-6,
            "{model}: {rows} {first} {last}"
        );
        let words = said(
            &[&["simulate", model, "--input", "log.csv", "-o", "out.csv", "--resample", "0.002"][..], &part].concat(),
        );
        assert!(words.contains("resampled to dt") && times().0 == 1001, "{model}: {words}");
    }
    let words = said(&[&["init", "log.csv", "--yes", "-o", "made.toml", "--resample", "2e-3"][..], &part].concat());
    assert!(words.contains("1001 samples"), "{words}");
    // Stamps as a computer takes them.
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(4);
    log.0[0].iter_mut().for_each(|t| {
        let e: f64 = StandardNormal.sample(&mut rng);
        *t += 2e-4 * e.clamp(-2.0, 2.0);
    });
    log.write(&at("log.csv"), ALL);
    for command in ["identify", "inspect"] {
        let words = said(&[command, "log.csv", "--axis", "axis.toml", "--resample", "0.002"]);
        // Lines are broken where the width of the terminal is.
        let words = words.split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(!words.contains("lost_samples"), "{command}: {words}");
        assert!(words.contains("the motion is kept up to about") && words.contains("Hz"), "{command}: {words}");
    }
    let done = run::eixo_in(folder.path(), &["inspect", "log.csv", "--resample", "5"]);
    let error = String::from_utf8_lossy(&done.stderr).into_owned();
    assert!(done.status.code() == Some(2) && error.contains("--resample another interval"), "{error}");
}
