//! `scripts/dask_fleet.py`: the same command under Dask distributed, on a local cluster of two workers.

use std::path::Path;
use std::process::Command;

#[path = "fleet/machines.rs"]
mod machines;
#[path = "program/skip.rs"]
mod skip;

#[test]
fn two_dask_workers_write_the_same_summary_and_index_to_the_byte() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let Some(python) = skip::python("dask.distributed") else { return };
    let folder = tempfile::tempdir().unwrap();
    machines::machines(folder.path());
    let eixo = env!("CARGO_BIN_EXE_eixo");
    // Where the results lie is no part of them.
    let run = |output: &str, dask: bool| {
        let command = ["diagnose", "machines", "--output", output];
        let done = if dask {
            Command::new(&python)
                .arg(root.join("scripts/dask_fleet.py"))
                .args(["--workers", "2", "--batch", "2", "--eixo", eixo, "--"])
                .args(command)
                .current_dir(folder.path())
                .output()
        } else {
            Command::new(eixo).args(command).current_dir(folder.path()).output()
        };
        let done = done.expect("the run");
        (done.status.code(), String::from_utf8_lossy(&done.stderr).into_owned())
    };
    let (one, words) = run("one", false);
    assert_eq!(one, Some(1), "{words}");
    let (two, words) = run("two", true);
    assert_eq!(two, one, "{words}");
    assert!(words.contains("8 traces in 4 tasks on 2 workers"), "{words}");
    assert!(words.contains("8 of 8 traces were done by an earlier run"), "{words}");
    for file in ["summary.csv", "index.html"] {
        let read = |run: &str| std::fs::read(folder.path().join(run).join(file)).unwrap();
        assert!(!read("one").is_empty());
        assert_eq!(read("one"), read("two"), "{file}");
    }
}
