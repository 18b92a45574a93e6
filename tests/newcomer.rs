//! The mistakes of a first day, each answered with what to do. What is printed is checked word by word where the way out stands.

#![allow(clippy::unwrap_used, reason = "a test may")]

use std::fmt::Write;
use std::path::Path;

#[path = "program/run.rs"]
mod run;

const AXIS: &str =
    "name = \"axis\"\n[parameters]\nI1 = 2.37e-4\nI2 = 6.07e-6\nB = 5.4e-4\nK = 1.76e-2\nrho = 3.18e-4\n";

/// Rows of a motion that no one could mistake: the cells of row k.
fn rows(count: usize, cells: impl Fn(usize) -> String) -> String {
    (0..count).fold(String::new(), |mut text, k| {
        writeln!(text, "{}", cells(k)).unwrap();
        text
    })
}

/// Time, torque and two angles of row k.
fn plain(k: usize) -> String {
    let t = k as f64 * 1e-3;
    format!("{t},{},{},{}", 0.01 * (t * 40.0).sin(), (t * 40.0).cos(), (t * 40.0).cos())
}

/// What is typed, what the exit code is, and what the answer says.
struct Mistake {
    what: &'static str,
    typed: &'static [&'static str],
    code: i32,
    says: &'static [&'static str],
}

fn prepare(folder: &Path) {
    let write = |name: &str, text: &str| std::fs::write(folder.join(name), text).unwrap();
    let head = "time,T,theta1,theta2\n";
    write("axis.toml", AXIS);
    write("log.csv", &(head.to_owned() + &rows(400, plain)));
    write(
        "foreign.csv",
        &("t_s,iq_A,pos_rad\n".to_owned() + &rows(400, |k| format!("{},{},{}", k as f64 * 1e-3, k % 7, k % 5))),
    );
    write(
        "one.csv",
        &("time,T,theta1\n".to_owned() + &rows(400, |k| format!("{},{},{}", k as f64 * 1e-3, k % 7, k % 5))),
    );
    write("commas.csv", &("time,T,theta1\n".to_owned() + &rows(40, |k| format!("0,{k:03},1,5,2,5"))));
    write("bare.csv", &rows(40, plain));
    write("cut.csv", &(head.to_owned() + &rows(40, plain) + "0.04,1\n"));
    write("short.csv", &(head.to_owned() + &rows(40, |k| if k == 20 { "0.02,1".to_owned() } else { plain(k) })));
    write("text.csv", &(head.to_owned() + &rows(40, |k| if k == 9 { "0.009,on,1,1".to_owned() } else { plain(k) })));
    write("words.csv", &("time,phase\n".to_owned() + &rows(40, |k| format!("{},on", k as f64 * 1e-3))));
    write("gap.csv", &(head.to_owned() + &rows(40, |k| plain(if k < 20 { k } else { k + 5 }))));
    write("back.csv", &(head.to_owned() + &rows(40, |k| plain(if k == 30 { 3 } else { k }))));
    write("unit.csv", &("time,T,theta1 [grads],theta2\n".to_owned() + &rows(40, plain)));
    write("force.csv", &("time,T [N],theta1,theta2\n".to_owned() + &rows(40, plain)));
    write("still.csv", &(head.to_owned() + &rows(400, |k| format!("{},{},0,0", k as f64 * 1e-3, k % 7))));
    write("old.xls", "\u{0}");
    std::fs::write(folder.join("old.xls"), b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1").unwrap();
    std::fs::write(folder.join("new.mat"), b"\x89HDF\r\n\x1a\n").unwrap();
    write("negative.toml", &AXIS.replace("I1 = 2.37e-4", "I1 = -2.37e-4"));
    write("misspelt.toml", &AXIS.replace("[parameters]", "[parameter]"));
    write("columns.toml", &format!("{AXIS}[signals]\nT = \"iq_A\"\ntheta1 = \"pos_rat\"\n"));
    std::fs::create_dir(folder.join("logs")).unwrap();
}

const MISTAKES: [Mistake; 32] = [
    Mistake {
        what: "a file that is not there",
        typed: &["identify", "lgo.csv"],
        code: 2,
        says: &["lgo.csv", "cannot read"],
    },
    Mistake { what: "a folder as a record", typed: &["inspect", "logs"], code: 2, says: &["logs", "folder"] },
    Mistake {
        what: "the axis file as the record",
        typed: &["inspect", "axis.toml"],
        code: 2,
        says: &["axis.toml", "behind --axis"],
    },
    Mistake {
        what: "the record as the axis file",
        typed: &["identify", "log.csv", "--axis", "log.csv"],
        code: 2,
        says: &["log.csv"],
    },
    Mistake {
        what: "a foreign log without an axis file",
        typed: &["identify", "foreign.csv"],
        code: 2,
        says: &["no column has a signal's name", "iq_A", "eixo init"],
    },
    Mistake {
        what: "one encoder for two inertias",
        typed: &["identify", "one.csv"],
        code: 2,
        says: &["theta2", "rigid"],
    },
    Mistake {
        what: "decimal commas between commas",
        typed: &["inspect", "commas.csv"],
        code: 2,
        says: &["decimal commas", "semicolons"],
    },
    Mistake { what: "no header", typed: &["inspect", "bare.csv"], code: 2, says: &["header row such as"] },
    Mistake {
        what: "the last row cut off",
        typed: &["inspect", "cut.csv"],
        code: 1,
        says: &["row 42, the last, is cut off", "left out"],
    },
    Mistake {
        what: "a row cut off among others",
        typed: &["inspect", "short.csv"],
        code: 2,
        says: &["row 22", "complete or delete"],
    },
    Mistake {
        what: "a word among numbers",
        typed: &["inspect", "text.csv"],
        code: 2,
        says: &["row 11, column T", "\"on\"", "--from"],
    },
    Mistake { what: "a gap", typed: &["inspect", "gap.csv"], code: 2, says: &["row 22", "missing samples", "--from"] },
    Mistake {
        what: "time that runs backwards",
        typed: &["inspect", "back.csv"],
        code: 2,
        says: &["row 32", "must increase", "sort"],
    },
    Mistake { what: "an unknown unit", typed: &["inspect", "unit.csv"], code: 2, says: &["[grads]", "deg"] },
    Mistake {
        what: "a force on a rotary axis",
        typed: &["inspect", "force.csv"],
        code: 2,
        says: &["a force", "[units] motion"],
    },
    Mistake {
        what: "an axis that stands",
        typed: &["identify", "still.csv"],
        code: 1,
        says: &["theta1", "in every sample", "[signals]"],
    },
    Mistake { what: "an old workbook", typed: &["inspect", "old.xls"], code: 2, says: &[".xlsx or CSV"] },
    Mistake { what: "MATLAB 7.3", typed: &["inspect", "new.mat"], code: 2, says: &["-v7"] },
    Mistake {
        what: "a negative inertia",
        typed: &["identify", "log.csv", "--axis", "negative.toml"],
        code: 2,
        says: &["line 3", "I1", "greater than zero"],
    },
    Mistake {
        what: "a misspelt section",
        typed: &["identify", "log.csv", "--axis", "misspelt.toml"],
        code: 2,
        says: &["did you mean \"parameters\""],
    },
    Mistake {
        what: "a misspelt column",
        typed: &["identify", "foreign.csv", "--axis", "columns.toml"],
        code: 2,
        says: &["did you mean \"pos_rad\""],
    },
    Mistake {
        what: "a diagnosis without a model",
        typed: &["diagnose", "log.csv"],
        code: 2,
        says: &["--axis axis.toml"],
    },
    Mistake {
        what: "a misspelt effect",
        typed: &["diagnose", "log.csv", "--axis", "axis.toml", "--without", "coulom_motor"],
        code: 2,
        says: &["coulom_motor", "coulomb_motor"],
    },
    Mistake { what: "two records at once", typed: &["identify", "log.csv", "one.csv"], code: 2, says: &["--output"] },
    Mistake {
        what: "the record as the output",
        typed: &["identify", "log.csv", "--json", "log.csv"],
        code: 2,
        says: &["is the input", "another name"],
    },
    Mistake {
        what: "the axis file as the output",
        typed: &["simulate", "axis.toml", "--input", "log.csv", "-o", "axis.toml"],
        code: 2,
        says: &["is the input", "another name"],
    },
    Mistake {
        what: "one file for two outputs",
        typed: &["inspect", "log.csv", "--json", "a", "--report", "./a"],
        code: 2,
        says: &["two outputs"],
    },
    Mistake {
        what: "a folder that is not there",
        typed: &["excite", "-o", "out/u.csv"],
        code: 2,
        says: &["out/u.csv", "folder that exists"],
    },
    Mistake {
        what: "a part that holds nothing",
        typed: &["inspect", "log.csv", "--from", "99"],
        code: 2,
        says: &["--from and --to leave 0 samples of 400"],
    },
    Mistake {
        what: "an infinite time",
        typed: &["inspect", "log.csv", "--to", "inf"],
        code: 2,
        says: &["finite number"],
    },
    Mistake {
        what: "a log of nothing that init knows",
        typed: &["init", "words.csv", "--yes", "-o", "x.toml"],
        code: 2,
        says: &["words.csv", "[signals]", "column phase"],
    },
    Mistake {
        what: "a log with a word among its numbers, given to init",
        typed: &["init", "text.csv", "--yes", "-o", "x.toml"],
        code: 2,
        says: &["text.csv", "row 11, column T", "\"on\"", "--from"],
    },
];

#[test]
fn each_mistake_is_answered_with_what_to_do_and_nothing_is_written() {
    let folder = tempfile::tempdir().unwrap();
    prepare(folder.path());
    let before = std::fs::read_dir(folder.path()).unwrap().count();
    let mut wrong = Vec::new();
    for m in &MISTAKES {
        let done = run::eixo_in(folder.path(), m.typed);
        let said = String::from_utf8_lossy(&done.stdout).into_owned() + &String::from_utf8_lossy(&done.stderr);
        // The terminal's lines are broken where they are full.
        let said = said.split_whitespace().collect::<Vec<_>>().join(" ");
        let missing: Vec<&&str> = m.says.iter().filter(|part| !said.contains(**part)).collect();
        if done.status.code() != Some(m.code) || !missing.is_empty() || said.contains("panicked") {
            wrong.push(format!("{}: {:?}, without {missing:?}: {said}", m.what, done.status.code()));
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), before, "a file was left behind");
    assert_eq!(std::fs::read_to_string(folder.path().join("axis.toml")).unwrap(), AXIS);
}

#[test]
fn a_foreign_log_goes_from_init_to_a_verdict_without_an_editor() {
    let folder = tempfile::tempdir().unwrap();
    let mut text = String::from("Servo log 7\nt (ms);Iq_meas (A);Pos_act (deg);Pos_set (deg)\n");
    for k in 0..4000 {
        let t = f64::from(k) * 1e-3;
        // 2e-3 kg.m2 and 1e-2 N.m.s/rad under three tones, 0.5 N.m/A.
        let (mut x, mut v, mut a) = (0.0, 0.0, 0.0);
        for (amplitude, w) in [(0.5, 3.0), (0.1, 11.0), (0.03, 37.0)] {
            let (s, c) = f64::sin_cos(w * t);
            x += amplitude * s;
            v += amplitude * w * c;
            a -= amplitude * w * w * s;
        }
        let torque = 2e-3 * a + 1e-2 * v + 5e-3 * v.signum();
        let line = format!("{k};{:.6};{:.5};{:.5}", torque / 0.5, x.to_degrees(), x.to_degrees());
        writeln!(text, "{}", line.replace('.', ",")).unwrap();
    }
    std::fs::write(folder.path().join("servo.csv"), text).unwrap();
    let done = run::eixo_in(folder.path(), &["init", "servo.csv", "--yes"]);
    let said = String::from_utf8_lossy(&done.stdout).into_owned();
    assert_eq!(done.status.code(), Some(0), "{said}{}", String::from_utf8_lossy(&done.stderr));
    assert!(said.contains("next: eixo identify servo.csv --axis axis.toml"), "{said}");
    let axis = std::fs::read_to_string(folder.path().join("axis.toml")).unwrap();
    assert!(axis.contains("structure = \"rigid\"") && axis.contains("Iq_meas") && axis.contains("Pos_act"), "{axis}");
    assert!(folder.path().join("axis.html").is_file());
    let done = run::eixo_in(folder.path(), &["identify", "servo.csv", "--axis", "axis.toml", "--json", "found.json"]);
    let said = String::from_utf8_lossy(&done.stdout).into_owned();
    assert_eq!(done.status.code(), Some(0), "{said}{}", String::from_utf8_lossy(&done.stderr));
    let found: serde_json::Value =
        serde_json::from_slice(&std::fs::read(folder.path().join("found.json")).unwrap()).unwrap();
    // In amperes: 2e-3 kg.m2 over 0.5 N.m/A.
    let inertia = found["methods"][0]["parameters"][0]["value"].as_f64().unwrap();
    assert!((inertia / 4e-3 - 1.0).abs() < 0.02, "{inertia}");
    // A second time it asks for another name.
    let done = run::eixo_in(folder.path(), &["init", "servo.csv", "--yes"]);
    assert_eq!(done.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&done.stderr).contains("--force"));
}

#[test]
fn the_axis_file_of_a_slow_log_says_whether_its_torque_runs_straight_between_samples() {
    let folder = tempfile::tempdir().unwrap();
    // An axis of 2e-3 kg.m2 and 1e-2 N.m.s/rad under three tones, read every 20 ms.
    let dt = 2e-2;
    let at = |t: f64| {
        let (mut x, mut torque) = (0.0, 0.0);
        for (amplitude, w) in [(0.5, 3.0), (0.1, 11.0), (0.03, 37.0)] {
            let (s, c) = f64::sin_cos(w * t);
            x += amplitude * s;
            torque += amplitude * w * (1e-2 * c - 2e-3 * w * s);
        }
        (x, torque)
    };
    // A torque that was measured at each sample, and one that stands from each to the next, where its mean is the one in the middle.
    for (name, later, hold) in [("straight", 0.0, "linear"), ("held", 0.5, "zoh")] {
        let row = |k: usize| {
            let t = k as f64 * dt;
            format!("{t:.2},{:.6},{:.6}", at(t + later * dt).1, at(t).0)
        };
        std::fs::write(folder.path().join(format!("{name}.csv")), format!("t_s,T,theta1\n{}", rows(1000, row)))
            .unwrap();
        let (log, file) = (format!("{name}.csv"), format!("{name}.toml"));
        let done = run::eixo_in(folder.path(), &["init", &log, "--yes", "-o", &file]);
        assert_eq!(done.status.code(), Some(0), "{}", String::from_utf8_lossy(&done.stderr));
        let axis = std::fs::read_to_string(folder.path().join(file)).unwrap();
        assert!(axis.contains(&format!("hold = \"{hold}\"")), "{axis}");
        assert_eq!(axis.contains("# hold: running straight"), hold == "linear", "{axis}");
        // Where the file says nothing the record does; where it says another thing it counts, and is doubted.
        for (given, said) in [("", "it is taken as straight"), (", hold = \"zoh\"", "[hold] ")] {
            let axis = axis.replace(&format!(", hold = \"{hold}\""), given).replace(", hold = \"linear\"", given);
            std::fs::write(folder.path().join("axis.toml"), &axis).unwrap();
            for command in [&["diagnose"][..], &["identify"]] {
                let done = run::eixo_in(folder.path(), &[command, &[&log, "--axis", "axis.toml"]].concat());
                let warned = String::from_utf8_lossy(&[done.stdout, done.stderr].concat()).replace('\n', " ");
                assert_eq!(done.status.code(), Some(0), "{warned}");
                assert_eq!(warned.contains(said), hold == "linear", "{command:?} {axis} {warned}");
            }
        }
    }
}

#[test]
fn a_number_of_the_drive_without_a_unit_is_in_counts_and_never_in_newton_metres() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir(folder.path().join("arm")).unwrap();
    let mut text = String::from("t_s,load_raw,pos_rad\n");
    for k in 0..4000 {
        let t = f64::from(k) * 1e-3;
        let (mut v, mut x, mut a) = (0.0, 0.0, 0.0);
        for (amplitude, w) in [(0.5, 3.0), (0.1, 11.0), (0.03, 37.0)] {
            let (s, c) = f64::sin_cos(w * t);
            x += amplitude * s;
            v += amplitude * w * c;
            a -= amplitude * w * w * s;
        }
        writeln!(text, "{t:.3},{:.2},{x:.7}", 7.0 * a + 58.0 * v).unwrap();
    }
    std::fs::write(folder.path().join("arm/2026-03-01.csv"), text).unwrap();
    let done = run::eixo_in(folder.path(), &["init", "arm/2026-03-01.csv", "--yes"]);
    let said = String::from_utf8_lossy(&done.stdout).into_owned();
    assert_eq!(done.status.code(), Some(0), "{said}{}", String::from_utf8_lossy(&done.stderr));
    assert!(said.contains("not given: counts"), "{said}");
    let axis = std::fs::read_to_string(folder.path().join("arm/axis.toml")).unwrap();
    assert!(axis.contains("column = \"load_raw\", unit = \"counts\"") && axis.contains("counts.s2/rad"), "{axis}");
    assert!(axis.contains("come out in counts (the column load_raw has no unit) instead of N.m."), "{axis}");
    // The machine of a log that is called by its date is the folder.
    assert!(axis.contains("name = \"arm\""), "{axis}");
    let done = run::eixo_in(
        folder.path(),
        &[
            "identify",
            "arm/2026-03-01.csv",
            "--axis",
            "arm/axis.toml",
            "--report",
            "found.html",
            "--json",
            "found.json",
        ],
    );
    let said = String::from_utf8_lossy(&done.stdout).into_owned();
    assert!(said.contains("counts.s2/rad") && !said.contains("kg.m2"), "{said}");
    let read = |name: &str| std::fs::read_to_string(folder.path().join(name)).unwrap();
    assert!(read("found.html").contains("counts·s²/rad") && !read("found.html").contains("kg·m²"));
    assert!(read("found.json").contains("\"counts.s2/rad\"") && !read("found.json").contains("kg.m2"));
}
