//! The command line on input that nobody meant: files of every form, changed, cut and filled with extreme numbers, under every
//! command that reads them. It may refuse; it may not panic, die of a signal, run without end, leave half an output or a file
//! of its own behind, or put NaN where a person reads.
//!
//! `EIXO_FUZZ_RUNS` sets the number of runs (2,000), `EIXO_FUZZ_SEED` the seed.

#![allow(clippy::unwrap_used, reason = "a test may")]

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use rand::seq::IndexedRandom;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// A run that takes longer runs without end.
const LONGEST: Duration = Duration::from_secs(120);

const EXTREMES: [&str; 14] = [
    "1e308",
    "-1e308",
    "5e-324",
    "1e300",
    "1e-300",
    "0",
    "-0",
    "4294967296",
    "9223372036854775807",
    "1e18",
    "nan",
    "inf",
    "-inf",
    "1e400",
];

fn variable(name: &str, otherwise: usize) -> usize {
    std::env::var(name).ok().and_then(|text| text.parse().ok()).unwrap_or(otherwise)
}

const AXIS: &str =
    "name = \"axis\"\n[parameters]\nI1 = 2.37e-4\nI2 = 6.07e-6\nB = 5.4e-4\nK = 1.76e-2\nrho = 3.18e-4\n";

/// A short record of some shape.
fn record(rng: &mut ChaCha8Rng) -> String {
    let headers = [
        "time,T,theta1,theta2",
        "time [ms],T [mN.m],theta1 [deg],omega1",
        "t_s,iq_A,pos_rad,speed_rad_s",
        "time;T;theta1;theta2",
    ];
    let header = headers.choose(rng).unwrap();
    let separator = if header.contains(';') { ';' } else { ',' };
    let mut text = format!("{header}\n");
    for k in 0..rng.random_range(0..300) {
        let t = f64::from(k) * 1e-3;
        let mut cells =
            [t, 0.01 * (37.0 * t).sin() + 0.01 * (111.0 * t).sin(), (30.0 * t).cos(), (30.0 * t).cos() * 0.9]
                .map(|v| v.to_string());
        if rng.random_ratio(1, 150) {
            let at = rng.random_range(0..4);
            (*EXTREMES.choose(rng).unwrap()).clone_into(&mut cells[at]);
        }
        text.push_str(&cells.join(&separator.to_string()));
        text.push('\n');
    }
    text
}

/// Changes some bytes, or cuts.
fn spoil(bytes: &mut Vec<u8>, rng: &mut ChaCha8Rng) {
    for _ in 0..rng.random_range(0..4) {
        if bytes.is_empty() {
            return;
        }
        let at = rng.random_range(0..bytes.len());
        match rng.random_range(0..4) {
            0 => bytes[at] = rng.random(),
            1 => bytes.truncate(at),
            2 => drop(bytes.splice(at..at, EXTREMES.choose(rng).unwrap().bytes())),
            _ => {
                let end = (at + rng.random_range(0..20)).min(bytes.len());
                bytes.drain(at..end);
            }
        }
    }
}

/// An axis file with a number that is extreme now and then.
fn axis(rng: &mut ChaCha8Rng) -> String {
    let mut text = AXIS.to_owned();
    if rng.random_ratio(1, 2) {
        let numbers = ["2.37e-4", "6.07e-6", "5.4e-4", "1.76e-2", "3.18e-4"];
        text = text.replace(numbers.choose(rng).unwrap(), EXTREMES.choose(rng).unwrap());
    }
    if rng.random_ratio(1, 3) {
        text.push_str("[signals]\ntime = \"t_s\"\nT = { column = \"iq_A\", scale = 0.5 }\ntheta1 = \"pos_rad\"\n");
    }
    if rng.random_ratio(1, 3) {
        text = format!("structure = \"rigid\"\n{text}");
    }
    if rng.random_ratio(1, 6) {
        text.push_str(&format!("[effects.gravity]\nsine = {}\n", EXTREMES.choose(rng).unwrap()));
    }
    if rng.random_ratio(1, 4) {
        text.push_str(&format!("[effects.coulomb_motor]\nlevel = {}\n", EXTREMES.choose(rng).unwrap()));
    }
    text
}

/// What is typed in a run; outputs are named out.*.
fn typed(rng: &mut ChaCha8Rng, log: &str) -> Vec<String> {
    let mut number = || (*EXTREMES.choose(rng).unwrap()).to_owned();
    let (a, b, c) = (number(), number(), number());
    let line = match rng.random_range(0..19) {
        0 => format!("inspect {log} --axis axis.toml --report out.html --json out.json"),
        1 => format!("inspect {log} --from {a} --to {b} --report out.html"),
        2 => format!("identify {log} --axis axis.toml --method ls,rls --report out.html --json out.json"),
        3 => format!("identify {log} --axis axis.toml --method oe --trust --report out.html --axis-out out.toml"),
        4 => format!("identify {log} --method all --trust --forgetting {a} --p0 {b} --json out.json"),
        5 => format!("identify {log} --stream --method ls --trust --json out.json"),
        6 => format!("init {log} --yes -o out.toml --report out.html"),
        7 => format!("excite -o out.csv --samples {} --dt {a} --rms {b} --offset {c}", rng.random_range(0..4000)),
        8 => format!("excite -o out.parquet --band {a}:{b} --slope {c}"),
        9 => format!("simulate axis.toml --input {log} -o out.csv --set K={a}"),
        10 => format!("simulate axis.toml -o out.csv --start {a} --stop {b} --step {c}"),
        11 => format!("circle --measured {log} --report out.html --json out.json"),
        12 => format!("circle axis.toml --measured {log} --radius {a} --feed {b} --report out.html"),
        13 => format!("identify {log} --axis axis.toml --resample {a} --method ls,oe --trust --json out.json"),
        14 => format!("simulate axis.toml --input {log} -o out.csv --from {a} --to {b} --resample {c}"),
        15 => format!("init {log} --yes -o out.toml --from {a} --resample {b}"),
        16 => format!("info {log}"),
        17 => format!("validate {log} --static --format json"),
        18 => format!("circle axis.toml --radius {a} --feed {b} --report out.html -o out.csv"),
        _ => format!("diagnose {log} --axis axis.toml --json out.json --report out.html"),
    };
    line.split_whitespace().map(str::to_owned).collect()
}

/// What is wrong with a run, in words.
fn defect(folder: &Path, typed: &[String]) -> Option<String> {
    let started = Instant::now();
    let said = std::fs::File::create(folder.join("said")).unwrap();
    let mut child = Command::new(env!("CARGO_BIN_EXE_eixo"))
        .args(typed)
        .current_dir(folder)
        .env("RAYON_NUM_THREADS", "1")
        .env("RUST_BACKTRACE", "0")
        .stdin(Stdio::null())
        .stdout(said.try_clone().unwrap())
        .stderr(said)
        .spawn()
        .unwrap();
    let ended = loop {
        if let Some(status) = child.try_wait().unwrap() {
            break status;
        }
        if started.elapsed() > LONGEST {
            let _ = child.kill();
            let _ = child.wait();
            return Some("it runs without end".to_owned());
        }
        std::thread::sleep(Duration::from_millis(2));
    };
    let said = String::from_utf8_lossy(&std::fs::read(folder.join("said")).unwrap()).into_owned();
    if said.contains("panicked") || said.contains("RUST_BACKTRACE") {
        return Some(said);
    }
    let most = if typed[0] == "validate" { 3 } else { 2 };
    if ended.code().is_none_or(|code| !(0..=most).contains(&code)) {
        return Some(format!("it ends with {ended}: {said}"));
    }
    // A number that is none, where a person reads: what was typed and what a file holds are repeated in quotes.
    let unbounded = |text: &str| {
        text.split(|c: char| c.is_whitespace() || "(),;<>".contains(c))
            .any(|w| matches!(w, "NaN" | "inf" | "-inf" | "∞" | "-∞"))
    };
    if ended.code() != Some(2) && unbounded(&said) {
        return Some(format!("a number without bound is said: {said}"));
    }
    for entry in std::fs::read_dir(folder).unwrap() {
        let path: PathBuf = entry.unwrap().path();
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        if name.starts_with(".eixo") {
            return Some(format!("{name} is left behind"));
        }
        if !name.starts_with("out.") {
            continue;
        }
        let bytes = std::fs::read(&path).unwrap();
        let text = String::from_utf8_lossy(&bytes);
        let whole = match name.rsplit('.').next().unwrap() {
            "html" => text.trim_end().ends_with("</html>") && !unbounded(&text),
            "json" => serde_json::from_slice::<serde_json::Value>(&bytes).is_ok(),
            "csv" => text.ends_with('\n') && !unbounded(&text.replace(',', " ")),
            "parquet" => bytes.ends_with(b"PAR1"),
            _ => !bytes.is_empty(),
        };
        if !whole {
            return Some(format!("{name} is torn, or holds a number without bound: {said}"));
        }
    }
    None
}

#[test]
fn no_run_panics_dies_hangs_or_leaves_half_an_output() {
    let runs = variable("EIXO_FUZZ_RUNS", 2000);
    let seed = variable("EIXO_FUZZ_SEED", 1) as u64;
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/formats");
    let mut seeds: Vec<(String, Vec<u8>)> = [
        "plain.mat",
        "matlab73.mat",
        "snappy.parquet",
        "logs/sheet.xlsx",
        "logs/arrays.npz",
        "logs/lines.jsonl",
        "logs/halscope.log",
        "logs/twincat.csv",
        "logs/stamps.csv",
        "logs/utf16.csv",
        "logs/sinumerik.xml",
        "logs/tncscope.sco",
        "../ballbar_ccw.txt",
    ]
    .iter()
    .map(|name| (name.rsplit('/').next().unwrap().to_owned(), std::fs::read(root.join(name)).unwrap()))
    .collect();
    let made = tempfile::tempdir().unwrap();
    let fmu = made.path().join("axis.fmu");
    assert!(Command::new(env!("CARGO_BIN_EXE_eixo")).arg("export").arg(&fmu).output().unwrap().status.success());
    seeds.push(("axis.fmu".to_owned(), std::fs::read(&fmu).unwrap()));
    let next = AtomicUsize::new(0);
    let wrong = Mutex::new(Vec::new());
    std::thread::scope(|scope| {
        for _ in 0..std::thread::available_parallelism().map_or(1, usize::from) {
            scope.spawn(|| {
                let folder = tempfile::tempdir().unwrap();
                loop {
                    let run = next.fetch_add(1, Ordering::Relaxed);
                    if run >= runs {
                        return;
                    }
                    let mut rng = ChaCha8Rng::seed_from_u64(seed);
                    rng.set_stream(run as u64);
                    for entry in std::fs::read_dir(folder.path()).unwrap() {
                        std::fs::remove_file(entry.unwrap().path()).unwrap();
                    }
                    let (name, mut bytes) = if rng.random_ratio(2, 3) {
                        ("log.csv".to_owned(), record(&mut rng).into_bytes())
                    } else {
                        seeds.choose(&mut rng).unwrap().clone()
                    };
                    spoil(&mut bytes, &mut rng);
                    std::fs::write(folder.path().join(&name), &bytes).unwrap();
                    let mut axis = axis(&mut rng).into_bytes();
                    if rng.random_ratio(1, 5) {
                        spoil(&mut axis, &mut rng);
                    }
                    std::fs::write(folder.path().join("axis.toml"), &axis).unwrap();
                    let typed = typed(&mut rng, &name);
                    if let Some(words) = defect(folder.path(), &typed) {
                        wrong
                            .lock()
                            .unwrap()
                            .push(format!("run {run} of seed {seed}: eixo {}: {words}", typed.join(" ")));
                    }
                }
            });
        }
    });
    let wrong = wrong.into_inner().unwrap();
    assert!(wrong.is_empty(), "{} of {runs}: {:#?}", wrong.len(), &wrong[..wrong.len().min(8)]);
}

/// What was found once stays mended: the shortest input of each kind.
#[test]
fn what_was_found_once_stays_mended() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let log = |blow: f64| -> String {
        let rows = (0..400).map(|k| {
            let t = f64::from(k) * 1e-3;
            let torque = if k == 5 { blow } else { 0.01 * (37.0 * t).sin() };
            format!("{t},{torque},{},{}\n", (30.0 * t).cos(), 0.9 * (30.0 * t).cos())
        });
        std::iter::once("time,T,theta1,theta2\n".to_owned()).chain(rows).collect()
    };
    std::fs::write(at("log.csv"), log(0.0)).unwrap();
    // A motion whose square no number holds.
    std::fs::write(at("blow.csv"), log(1e308)).unwrap();
    // A natural frequency without bound.
    std::fs::write(at("stiff.toml"), AXIS.replace("1.76e-2", "1e308").replace("2.37e-4", "5e-324")).unwrap();
    // An inertia that no number stands beside.
    std::fs::write(at("heavy.toml"), AXIS.replace("2.37e-4", "1e308")).unwrap();
    std::fs::write(at("axis.toml"), AXIS).unwrap();
    let mut cases = vec![
        "inspect log.csv --axis heavy.toml --report out.html --json out.json",
        "inspect log.csv --axis stiff.toml --report out.html --json out.json",
        "identify log.csv --axis stiff.toml --method oe --trust --report out.html",
        "identify blow.csv --method oe --trust --json out.json",
        // A circle that no plot has a scale for.
        "circle axis.toml --radius 1e-300 --feed 1e-300 --report out.html -o out.csv",
        "circle axis.toml --radius 1e300 --feed 1e300 --report out.html",
    ];
    if cfg!(feature = "parquet") {
        let whole = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/formats/snappy.parquet");
        let mut bytes = std::fs::read(whole).unwrap();
        // An offset in the footer that is negative: the library panics on it, which is caught, and not printed.
        let footer = bytes.len() - 8 - u32::from_le_bytes(bytes[bytes.len() - 8..][..4].try_into().unwrap()) as usize;
        bytes[footer + 118] = 0x7f;
        std::fs::write(at("log.parquet"), &bytes).unwrap();
        cases.push("inspect log.parquet --report out.html");
    }
    for case in cases {
        let typed: Vec<String> = case.split_whitespace().map(str::to_owned).collect();
        assert_eq!(defect(folder.path(), &typed), None, "eixo {case}");
        for name in ["out.html", "out.json", "out.csv"] {
            let _ = std::fs::remove_file(at(name));
        }
    }
}
