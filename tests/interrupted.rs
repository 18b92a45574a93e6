//! Killed at any moment, nothing is lost: inputs and earlier outputs are as they were, a file under a final name is complete, and
//! what stands beside it is taken away by Ctrl-C, or by the next run.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

#[path = "fleet/machines.rs"]
mod machines;

use rand::{Rng, RngExt, SeedableRng};

/// Every file below a folder, with its bytes.
fn files(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut all = BTreeMap::new();
    for entry in std::fs::read_dir(folder).expect("the folder") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            all.extend(files(&path));
        } else {
            all.insert(path.clone(), std::fs::read(&path).expect("the file"));
        }
    }
    all
}

fn is_stray(path: &Path) -> bool {
    path.file_name().is_some_and(|n| n.to_string_lossy().starts_with(".eixo-"))
}

fn start(arguments: &[&str], folder: &Path) -> Child {
    Command::new(env!("CARGO_BIN_EXE_eixo"))
        .args(arguments)
        .current_dir(folder)
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .expect("eixo")
}

/// Ends the process after a while, by `kill -9` or as Ctrl-C does. Whether it was still running, and its exit code.
fn end(mut child: Child, after: Duration, interrupt: bool) -> (bool, Option<i32>) {
    std::thread::sleep(after);
    let running = child.try_wait().expect("the process").is_none();
    if interrupt {
        let _ = Command::new("kill").args(["-INT", &child.id().to_string()]).stderr(Stdio::null()).status();
    } else {
        child.kill().expect("kill");
    }
    (running, child.wait().expect("the process").code())
}

fn duration(arguments: &[&str], folder: &Path) -> Duration {
    let begin = Instant::now();
    start(arguments, folder).wait().expect("the process");
    begin.elapsed()
}

/// A moment of a run of this length, from a little before its start to a little after its end.
fn moment(rng: &mut impl Rng, length: Duration) -> Duration {
    length.mul_f64(rng.random_range(0.0..1.1))
}

#[test]
fn an_output_is_the_earlier_one_or_the_whole_new_one_whenever_the_program_is_killed() {
    let root = tempfile::tempdir().unwrap();
    let folder = root.path();
    let large = ["excite", "-o", "large.csv", "--samples", "4096", "--dt", "0.0005", "--periods", "40"];
    let length = duration(&large, folder);
    let whole = std::fs::read(folder.join("large.csv")).unwrap();
    let small = ["excite", "-o", "large.csv", "--samples", "256", "--dt", "0.001"];
    duration(&small, folder);
    let earlier = std::fs::read(folder.join("large.csv")).unwrap();
    assert!(earlier != whole && whole.len() > 1 << 21);
    std::fs::write(folder.join("input.csv"), "time,T\n0,1\n").unwrap();

    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(20_261_121);
    let (mut killed, mut kept) = (0, 0);
    for round in 0..40 {
        let interrupt = round % 2 == 0;
        let child = start(&large, folder);
        let (running, code) = end(child, moment(&mut rng, length), interrupt);
        killed += usize::from(running);
        for (path, bytes) in files(folder) {
            let name = path.file_name().unwrap().to_string_lossy();
            match &*name {
                "input.csv" => assert_eq!(bytes, b"time,T\n0,1\n"),
                "large.csv" => {
                    assert!(bytes == earlier || bytes == whole, "round {round}: {} bytes of {name}", bytes.len());
                    kept += usize::from(bytes == earlier);
                }
                // Ctrl-C takes its own along (code 130); before the first output there is no handler, and nothing to take.
                _ => assert!(is_stray(&path) && !(interrupt && code == Some(130)), "round {round}: {name} is left"),
            }
        }
        // The next run takes away what a killed one left, and puts the earlier file there again.
        duration(&small, folder);
        let left: Vec<PathBuf> = files(folder).into_keys().filter(|p| is_stray(p)).collect();
        assert!(left.is_empty(), "round {round}: {left:?}");
    }
    assert!(killed >= 10 && kept >= 10, "{killed} of 40 were killed while they ran, {kept} before the file was there");
}

#[test]
fn a_fleet_that_is_killed_again_and_again_ends_with_the_same_summary() {
    let root = tempfile::tempdir().unwrap();
    let folder = root.path();
    let traces = machines::machines(folder);
    let inputs = files(&traces);
    let run = |output: &'static str| ["identify", "machines", "--method", "ls,oe", "--output", output];
    let length = duration(&run("whole"), folder);
    let expected = files(&folder.join("whole"));
    let relative = |all: BTreeMap<PathBuf, Vec<u8>>, below: &str| -> BTreeMap<PathBuf, Vec<u8>> {
        let below = folder.join(below);
        all.into_iter().map(|(p, b)| (p.strip_prefix(&below).expect("below it").to_owned(), b)).collect()
    };
    let expected = relative(expected, "whole");
    assert_eq!(expected.len(), 8 + 6 + 2);

    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(7);
    for round in 0..8 {
        let (_, code) = end(start(&run("parts"), folder), moment(&mut rng, length).mul_f64(0.5), round % 2 == 0);
        assert!(matches!(code, None | Some(1 | 130)), "round {round}: {code:?}");
        assert_eq!(files(&traces), inputs, "round {round}");
        if folder.join("parts").is_dir() {
            // Whatever is there is already what the whole run would have put there.
            for (path, bytes) in relative(files(&folder.join("parts")), "parts") {
                assert!(is_stray(&path) || expected.get(&path) == Some(&bytes), "round {round}: {}", path.display());
            }
        }
    }
    duration(&run("parts"), folder);
    assert_eq!(relative(files(&folder.join("parts")), "parts"), expected);
}

/// As `eixo ... | head -1`: the reader has gone before the first line.
#[test]
fn a_reader_that_leaves_stops_no_command_and_loses_no_file() {
    let folder = tempfile::tempdir().expect("a folder");
    for arguments in [&["excite", "--output", "torque.csv"][..], &["effects"], &["man"], &["completions", "bash"]] {
        let (reader, writer) = std::io::pipe().expect("a pipe");
        drop(reader);
        let done = Command::new(env!("CARGO_BIN_EXE_eixo"))
            .args(arguments)
            .current_dir(folder.path())
            .stdin(Stdio::null())
            .stdout(writer)
            .stderr(Stdio::piped())
            .output()
            .expect("eixo");
        let said = String::from_utf8_lossy(&done.stderr);
        assert_eq!(done.status.code(), Some(0), "{arguments:?}: {said}");
        assert_eq!(said, "", "{arguments:?}");
    }
    assert!(folder.path().join("torque.csv").is_file());
}
