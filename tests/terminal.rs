//! What stands on a terminal: tables that fit its width, silence where it is asked for, names that are completed and mended.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::path::Path;
use std::process::{Command, Output};

#[path = "program/run.rs"]
mod run;

use run::{eixo, eixo_in};

const AXIS: &str =
    "name = \"axis\"\n[parameters]\nI1 = 2.37e-4\nI2 = 6.07e-6\nB = 5.4e-4\nK = 1.76e-2\nrho = 3.18e-4\n";

fn wide(folder: &Path, columns: usize, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_eixo"));
    command.args(arguments).current_dir(folder).env("COLUMNS", columns.to_string()).output().unwrap()
}

/// Trace and axis file of the worked example, with friction that the model lacks.
fn prepare(folder: &Path) {
    std::fs::write(folder.join("axis.toml"), AXIS).unwrap();
    let set = |arguments: &str| {
        let done = eixo_in(folder, &arguments.split(' ').collect::<Vec<_>>());
        assert!(done.status.success(), "{arguments}: {}", String::from_utf8_lossy(&done.stderr));
    };
    set("export axis.fmu --quiet");
    set("export axis3.fmu --fmi 3 --quiet");
    set("excite -o u.csv --samples 1024 --quiet");
    set(
        "simulate axis.toml -i u.csv -o trace.csv --start-value coulomb_motor.level=0.002 --noise theta1=1e-4,theta2=1e-4 --outputs theta1,theta2",
    );
}

#[test]
fn a_current_is_told_in_amperes_and_a_linear_axis_has_no_torque() {
    let folder = tempfile::tempdir().unwrap();
    prepare(folder.path());
    let log = std::fs::read_to_string(folder.path().join("trace.csv")).unwrap();
    std::fs::write(folder.path().join("amperes.csv"), log.replacen("T [N.m]", "T [A]", 1)).unwrap();
    let linear = log.replacen("N.m", "N", 1).replacen("[rad]", "[m]", 2);
    std::fs::write(folder.path().join("linear.csv"), linear).unwrap();
    std::fs::write(folder.path().join("linear.toml"), format!("{AXIS}[units]\nmotion = \"linear\"\n")).unwrap();
    for command in ["identify", "diagnose", "inspect"] {
        for (log, axis, never) in [
            ("amperes.csv", "axis.toml", ["N.m", "N·m", "kg"]),
            ("linear.csv", "linear.toml", [" torque", "N.m", "kg.m2"]),
        ] {
            let typed = [command, log, "--axis", axis, "--report", "page.html"];
            let done = wide(folder.path(), 200, &typed);
            let said = format!("{}{}", String::from_utf8_lossy(&done.stdout), String::from_utf8_lossy(&done.stderr));
            assert!(matches!(done.status.code(), Some(0 | 1)), "{typed:?}: {said}");
            let page = std::fs::read_to_string(folder.path().join("page.html")).unwrap();
            // What is seen of the page: neither its style nor its script.
            let seen = page.split("</style>").nth(1).unwrap().split("<script").next().unwrap();
            for text in [&said, seen] {
                for word in never {
                    let at = text.find(word);
                    let around = at.map(|at| text.get(at.saturating_sub(80)..(at + 80).min(text.len())));
                    assert_eq!(around, None, "{typed:?}: {word:?}");
                }
            }
            assert!(axis == "linear.toml" || said.contains("A.s2/rad") || command == "inspect", "{typed:?}: {said}");
        }
    }
}

#[test]
fn tables_fit_every_width_from_60_to_200() {
    let folder = tempfile::tempdir().unwrap();
    prepare(folder.path());
    let mut widest = Vec::new();
    for columns in [60, 80, 200] {
        let mut most = 0;
        for arguments in [
            &["identify", "trace.csv", "--axis", "axis.toml"][..],
            &["inspect", "trace.csv"],
            &["circle", "axis.toml"],
            &["init", "trace.csv", "--yes", "--force", "-o", "made.toml"],
            &["info", "axis.fmu"],
            &["info", "axis3.fmu"],
        ] {
            let done = wide(folder.path(), columns, arguments);
            assert!(
                matches!(done.status.code(), Some(0 | 1)),
                "{arguments:?}: {}",
                String::from_utf8_lossy(&done.stderr)
            );
            let said = String::from_utf8(done.stdout).unwrap();
            let long = said.lines().find(|l| l.chars().count() > columns);
            assert_eq!(long, None, "{arguments:?} at {columns}");
            most = most.max(said.lines().map(|l| l.chars().count()).max().unwrap());
        }
        widest.push(most);
    }
    // What is wide is used where it is there.
    assert!(widest[2] > 100, "{widest:?}");
    // Less than 60 is not laid out for: as for 60.
    assert_eq!(
        wide(folder.path(), 20, &["identify", "trace.csv", "--axis", "axis.toml"]).stdout,
        wide(folder.path(), 60, &["identify", "trace.csv", "--axis", "axis.toml"]).stdout
    );
}

#[test]
fn quiet_is_quiet_and_writes_all_the_same() {
    let folder = tempfile::tempdir().unwrap();
    prepare(folder.path());
    let said = eixo_in(folder.path(), &["identify", "trace.csv", "--axis", "axis.toml", "--json", "one.json"]);
    let quiet = eixo_in(folder.path(), &["-q", "identify", "trace.csv", "--axis", "axis.toml", "--json", "two.json"]);
    assert!(!said.stdout.is_empty() && quiet.stdout.is_empty(), "{}", String::from_utf8_lossy(&quiet.stdout));
    assert_eq!(said.status.code(), quiet.status.code());
    let read = |name: &str| std::fs::read(folder.path().join(name)).unwrap();
    assert_eq!(read("one.json"), read("two.json"));
    // A result on standard output is a file; an error is told.
    let piped = eixo_in(folder.path(), &["excite", "-o", "-", "--samples", "256", "--quiet"]);
    assert!(String::from_utf8_lossy(&piped.stdout).starts_with("time"), "{}", String::from_utf8_lossy(&piped.stdout));
    let failed = eixo_in(folder.path(), &["identify", "nothing.csv", "--quiet"]);
    assert!(failed.status.code() == Some(2) && !failed.stderr.is_empty());
}

#[test]
fn progress_is_told_in_lines_where_that_is_asked_for() {
    let folder = tempfile::tempdir().unwrap();
    prepare(folder.path());
    let diagnose = ["diagnose", "trace.csv", "--axis", "axis.toml", "--without", "backlash"];
    let told =
        |more: &[&str]| String::from_utf8(eixo_in(folder.path(), &[&diagnose[..], more].concat()).stderr).unwrap();
    let lines = told(&["--progress", "lines"]);
    for step in ["progress: the model as given", "progress: held-out data"] {
        assert!(lines.contains(step), "{lines}");
    }
    assert!(!told(&[]).contains("progress:"), "no terminal, no progress");
}

#[test]
fn the_words_of_other_fmi_tools_are_understood() {
    let folder = tempfile::tempdir().unwrap();
    prepare(folder.path());
    let run = |words: [&str; 4], output: &str| {
        let [set, start, stop, step] = words;
        let arguments = [
            "simulate",
            "axis.toml",
            "-i",
            "u.csv",
            "-o",
            output,
            set,
            "K=0.02",
            start,
            "0.01",
            stop,
            "0.2",
            step,
            "0.001",
        ];
        let done = eixo_in(folder.path(), &arguments);
        assert!(done.status.success(), "{words:?}: {}", String::from_utf8_lossy(&done.stderr));
        std::fs::read(folder.path().join(output)).unwrap()
    };
    assert_eq!(
        run(["--set", "--start", "--stop", "--step"], "own.csv"),
        run(["--start-value", "--start-time", "--stop-time", "--output-interval"], "theirs.csv")
    );
}

#[test]
fn what_is_misspelt_is_answered_with_what_was_meant() {
    let folder = tempfile::tempdir().unwrap();
    prepare(folder.path());
    let of = |section: &str| {
        std::fs::write(folder.path().join("bad.toml"), format!("{AXIS}{section}")).unwrap();
        &["identify", "trace.csv", "--axis", "bad.toml"][..]
    };
    let effects: [(&[&str], &str); 3] = [
        (&["effects", "coulom_motor"], "'coulomb_motor'"),
        (&["diagnose", "trace.csv", "--axis", "axis.toml", "--without", "backlsh"], "'backlash'"),
        (
            &["simulate", "axis.toml", "-i", "u.csv", "-o", "x.csv", "--set", "coulom_motor.level=1"],
            "\"coulomb_motor.level\"",
        ),
    ];
    let signals: [(&[&str], &str); 3] = [
        (&["simulate", "axis.toml", "-i", "u.csv", "-o", "x.csv", "--outputs", "thta1"], "\"theta1\""),
        (&["simulate", "axis.toml", "-i", "u.csv", "-o", "x.csv", "--noise", "thta1=1"], "\"theta1\""),
        (&["init", "trace.csv", "-o", "x.toml", "--column", "thta1=theta1"], "\"theta1\""),
    ];
    let check = |arguments: &[&str], meant: &str| {
        let done = eixo_in(folder.path(), arguments);
        let said = String::from_utf8(done.stderr).unwrap();
        assert!(done.status.code() == Some(2) && said.contains(meant), "{arguments:?}: {said}");
    };
    for (arguments, meant) in effects.into_iter().chain(signals) {
        check(arguments, meant);
    }
    check(of("[effects.coulom_motor]\nlevel = 1\n"), "\"coulomb_motor\"");
    check(of("[effects.coulomb_motor]\nlevl = 1\n"), "\"level\"");
}

#[test]
fn completion_knows_effects_parameters_and_signals() {
    for shell in ["bash", "zsh", "fish"] {
        let done = eixo(&["completions", shell]);
        let script = String::from_utf8(done.stdout).unwrap();
        for name in ["position_friction", "coulomb_motor.level", "theta2", "omega1", "output-interval"] {
            assert!(script.contains(name), "{shell}: {name}");
        }
    }
    // Bash asked as by the tabulator key.
    let script = String::from_utf8(eixo(&["completions", "bash"]).stdout).unwrap();
    let ask = |words: &str| {
        let line = format!(
            "{script}\nCOMP_WORDS=({words}); COMP_CWORD=$((${{#COMP_WORDS[@]}} - 1)); \
             _eixo eixo \"${{COMP_WORDS[-1]}}\" \"${{COMP_WORDS[-2]}}\"; echo \"${{COMPREPLY[@]}}\""
        );
        String::from_utf8(Command::new("bash").args(["--norc", "-c", &line]).output().unwrap().stdout).unwrap()
    };
    assert_eq!(ask("eixo diagnose --without backl").trim(), "backlash");
    assert_eq!(ask("eixo effects quadratic_").trim(), "quadratic_drag");
    assert!(ask("eixo simulate --set coulomb_motor.le").contains("coulomb_motor.level="));
    assert!(ask("eixo simulate --outputs theta").contains("theta1 theta2"));
}
