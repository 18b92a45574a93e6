//! `eixo simulate` beside FMUs that crash, exit, close what is not theirs or log through a pointer of their own: it goes
//! on, names the call, and leaves nothing behind. And commands that are interrupted.

use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

use rand::{RngExt, SeedableRng};

use super::corpus::{self, DESCRIPTION, pack, running};

fn simulate(folder: &Path, defect: &str, more: &[&str]) -> Output {
    let fmu = folder.join(format!("{defect}.fmu"));
    if !fmu.exists() {
        std::fs::write(&fmu, pack(&running(DESCRIPTION, defect))).unwrap();
    }
    let temporary = folder.join("tmp");
    std::fs::create_dir_all(&temporary).unwrap();
    let mut command = Command::new(corpus::program());
    command.arg("simulate").arg(&fmu).arg("-o").arg(folder.join(format!("{defect}.csv"))).args(more);
    command.env("TMPDIR", temporary).current_dir(folder).stdin(Stdio::null());
    command.output().unwrap()
}

fn said(output: &Output) -> String {
    String::from_utf8(output.stderr.clone()).unwrap()
}

#[test]
fn an_fmu_that_ends_its_process_ends_the_run_with_code_2_and_the_call_named() {
    if !corpus::compiler() {
        return;
    }
    let cases: &[(&str, &[&str], &str)] = &[
        ("STEP_CRASH", &[], "crashed in fmi2DoStep: SIGSEGV"),
        ("STEP_ABORT", &[], "crashed in fmi2DoStep: SIGABRT"),
        ("STEP_EXIT", &[], "process in fmi2DoStep with exit code 3"),
        ("STEP_EXIT_ZERO", &[], "process in fmi2DoStep with exit code 0"),
        ("STEP_STACK", &[], "crashed in fmi2DoStep"),
        ("INSTANTIATE_CRASH", &[], "crashed in fmi2Instantiate"),
        ("FREE_CRASH", &[], "crashed in fmi2FreeInstance"),
        ("STEP_HANG", &["--timeout", "1"], "hangs in fmi2DoStep: no end after 1 s"),
        ("FORGES", &[], "its host's own descriptor"),
        ("STEP_FAILS", &[], "the FMU stopped at 0.51 s: fmi2DoStep returned fmi2Error; its log: no convergence"),
    ];
    let folder = tempfile::tempdir().unwrap();
    for (defect, more, expected) in cases {
        let output = simulate(folder.path(), defect, more);
        assert_eq!(output.status.code(), Some(2), "{defect}: {}", said(&output));
        assert!(said(&output).contains(expected), "{defect}: {}", said(&output));
        assert!(said(&output).contains(&format!("{defect}.fmu")), "{defect}: {}", said(&output));
        assert!(!folder.path().join(format!("{defect}.csv")).exists(), "{defect}");
        assert_eq!(std::fs::read_dir(folder.path().join("tmp")).unwrap().count(), 0, "{defect}");
    }
}

#[test]
fn what_an_fmu_does_to_its_process_is_no_matter_to_the_run() {
    if !corpus::compiler() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let trace = |defect: &str, more: &[&str]| {
        let output = simulate(folder.path(), defect, more);
        assert_eq!(output.status.code(), Some(0), "{defect}: {}", said(&output));
        (std::fs::read(folder.path().join(format!("{defect}.csv"))).unwrap(), said(&output))
    };
    let (expected, _) = trace("NONE", &[]);
    assert_eq!(expected.iter().filter(|b| **b == b'\n').count(), 102);
    assert_eq!(trace("NONE", &["--sandbox"]), (expected.clone(), String::new()));
    for defect in ["DIRECTORY", "LOG_FOREIGN", "LEAK_THREAD", "LEAK_FILE", "UNLOAD", "LOCALE", "SIGNALS", "ENVIRONMENT"]
    {
        assert_eq!(trace(defect, &[]), (expected.clone(), String::new()), "{defect}");
    }
    // What it prints is told, not mixed with what the command prints.
    let (printed, note) = trace("STDOUT", &[]);
    assert!(printed == expected && note.contains("note: the FMU printed: step to 0.01"), "{note}");
    assert_eq!(std::fs::read_dir(folder.path().join("tmp")).unwrap().count(), 0);
}

#[test]
fn descriptors_that_the_fmu_closes_are_told() {
    if !corpus::compiler() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/corpus/hostile.c");
    let mut cc = Command::new("cc");
    cc.args(["-shared", "-fPIC", "-O1", "-w", "-fvisibility=hidden", "-DACT=CLOSE_ALL", "-o"]);
    let binary = folder.path().join("corpus.so");
    assert!(cc.arg(&binary).arg(&source).args(["-lm", "-lpthread"]).status().unwrap().success());
    let mut files = corpus::files(DESCRIPTION);
    files[1].1 = std::fs::read(&binary).unwrap();
    std::fs::write(folder.path().join("CLOSES.fmu"), pack(&files)).unwrap();
    let output = simulate(folder.path(), "CLOSES", &[]);
    assert_eq!(output.status.code(), Some(2), "{}", said(&output));
    assert!(said(&output).contains("closed descriptors of its host's process"), "{}", said(&output));
}

/// Starts a command again and again, ends it at a random moment by one of three signals, and looks what is left after
/// the next run that ends by itself.
fn interrupt(arguments: &[&str], rounds: u32) {
    let folder = tempfile::tempdir().unwrap();
    let temporary = folder.path().join("tmp");
    std::fs::create_dir(&temporary).unwrap();
    std::fs::write(folder.path().join("model.fmu"), pack(&running(DESCRIPTION, "NONE"))).unwrap();
    let start = || {
        let mut command = Command::new(corpus::program());
        command.args(arguments).current_dir(folder.path()).env("TMPDIR", &temporary);
        command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap()
    };
    let begin = Instant::now();
    assert_eq!(start().wait().unwrap().code(), Some(0));
    let length = begin.elapsed();
    let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(16);
    let mut ended = 0;
    for round in 0..rounds {
        let mut child = start();
        std::thread::sleep(length.mul_f64(random.random_range(0.0..1.0)));
        ended += u32::from(child.try_wait().unwrap().is_none());
        let signal = ["-INT", "-TERM", "-KILL"][round as usize % 3];
        let _ = Command::new("kill").args([signal, &child.id().to_string()]).stderr(Stdio::null()).status();
        child.wait().unwrap();
        // An FMU that is written has its name when it is whole.
        if let Ok(file) = std::fs::File::open(folder.path().join("written.fmu")) {
            let mut archive = zip::ZipArchive::new(file).unwrap();
            for at in 0..archive.len() {
                std::io::copy(&mut archive.by_index(at).unwrap(), &mut std::io::sink()).unwrap();
            }
        }
    }
    assert!(ended >= rounds / 3, "{ended} of {rounds} were ended while they ran");
    assert_eq!(start().wait().unwrap().code(), Some(0));
    let left: Vec<_> = std::fs::read_dir(&temporary).unwrap().flatten().map(|e| e.path()).collect();
    assert!(left.is_empty(), "{arguments:?} left {left:?}");
    let entries = std::fs::read_dir(folder.path()).unwrap().flatten().map(|e| e.file_name());
    let strays: Vec<_> = entries.filter(|name| name.to_string_lossy().starts_with(".eixo-")).collect();
    assert!(strays.is_empty(), "{arguments:?} left {strays:?}");
    // A child dies with its parent, if not in the same instant.
    for _ in 0..100 {
        if super::cli::processes_with(&temporary).is_empty() {
            break;
        }
        std::thread::sleep(Duration::from_millis(50));
    }
    assert!(super::cli::processes_with(&temporary).is_empty(), "{arguments:?} left processes");
}

#[test]
fn a_hundred_interruptions_of_simulate_leave_nothing_for_the_run_after() {
    if corpus::compiler() {
        interrupt(&["simulate", "model.fmu", "-o", "out.csv", "--step", "0.00002"], 100);
    }
}

#[test]
fn a_hundred_interruptions_of_validate_leave_nothing_for_the_run_after() {
    if corpus::compiler() {
        interrupt(&["validate", "model.fmu", "--only", "simulate,reset"], 100);
    }
}

/// Each takes most of a second here: thirty, or as many as the variable says.
#[test]
fn interruptions_of_export_leave_nothing_for_the_run_after() {
    if corpus::compiler() {
        let rounds = std::env::var("EIXO_INTERRUPTIONS").map_or(30, |n| n.parse().expect("a number"));
        interrupt(&["export", "written.fmu", "--check"], rounds);
    }
}
