//! README.md as a reader uses it: every command block of it, in order, in a fresh folder, with its output compared where it is shown.
//!
//! A command is a line `$ ...`. What cannot run in a test, and what is no command, stands in [`NOT_RUN`] with its reason: a block that
//! is neither run nor listed fails, and so does an entry of the list that the README no longer has.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
// It writes and reads Parquet, and shows the help of the whole program.
#![cfg(feature = "parquet")]

use std::path::{Path, PathBuf};
use std::process::Command;

#[path = "readme/compare.rs"]
mod compare;
#[path = "readme/prepare.rs"]
mod prepare;
#[path = "program/skip.rs"]
mod skip;

/// How a block begins that is not run, and why.
const NOT_RUN: &[(&str, &str)] = &[
    ("command --> [input]", "the equations of the axis"),
    ("cargo run --release -- demo", "builds with full optimisation; tests/demo.rs runs `eixo demo`"),
    ("cargo install --path .", "builds and installs the program; the tests run the one just built"),
    ("scripts/test.sh", "runs these tests"),
    ("- uses: OWNER/eixo@main", "a pipeline's file; tests/validate/pipeline.rs runs the action's steps"),
    ("[controller]", "part of a file: that of tests/data/emps.toml"),
    ("name = \"X axis\"", "a file; the next test reads it"),
    ("$ eixo serve", "runs until it is ended; tests/serve.rs and scripts/serve_in_chromium.py drive it"),
    ("$ .venv/bin/python scripts/dask_fleet.py", "a scheduler on another computer; tests/dask.rs runs it on this one"),
    ("$ scripts/venv.sh", "installs from the network; tests/importers.rs runs what it shows"),
    ("importer               difference", "the output of scripts/table.py, which tests/table.rs runs"),
    ("$ python3 scripts/wheels.py", "builds with full optimisation and installs; python/tests runs the module"),
    ("$ python3 scripts/platforms.py", "builds with zig and mingw; .ci/run runs it"),
    ("scripts/blind/full.sh", "hours; a small sealed set runs with the tests of scripts/blind"),
    (".venv/bin/python scripts/blind/conditions.py", "hours"),
    ("cargo bench --bench do_step", "measures for minutes"),
];

/// The headings behind which a part of the README begins in a fresh folder of its own, so that parts can run at one time.
const PARTS: [&str; 4] = [
    "# eixo",
    "## Install, run the demo, run the tests",
    "## Many machines, long logs",
    "## The effects and their signatures",
];

/// A command, and what the README shows of its output.
struct Shown {
    line: usize,
    command: String,
    output: Vec<String>,
}

fn readme() -> String {
    std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("README.md")).unwrap()
}

/// The indented blocks: the line each begins at, and its lines without the indent. An empty line between two indented ones is part
/// of the block.
fn blocks(text: &str) -> Vec<(usize, Vec<&str>)> {
    let mut found: Vec<(usize, Vec<&str>)> = Vec::new();
    let mut open = false;
    let mut before = "";
    for (k, line) in text.lines().enumerate() {
        let code = line.strip_prefix("    ");
        match code {
            Some(code) if open => found.last_mut().unwrap().1.push(code),
            // Behind a list's item an indented line is its text.
            Some(code) if before.is_empty() => {
                found.push((k + 1, vec![code]));
                open = true;
            }
            None if open && line.is_empty() => found.last_mut().unwrap().1.push(""),
            _ => open = false,
        }
        before = line;
    }
    for (_, lines) in &mut found {
        while lines.last().is_some_and(|l| l.is_empty()) {
            lines.pop();
        }
    }
    found
}

/// The commands of a block.
fn commands(first: usize, lines: &[&str]) -> Vec<Shown> {
    let mut all: Vec<Shown> = Vec::new();
    let mut continued = false;
    for (k, line) in lines.iter().enumerate() {
        if let Some(command) = line.strip_prefix("$ ") {
            all.push(Shown { line: first + k, command: command.to_owned(), output: Vec::new() });
        } else if continued {
            let last = &mut all.last_mut().unwrap().command;
            last.push('\n');
            last.push_str(line);
        } else if let Some(last) = all.last_mut() {
            last.output.push((*line).to_owned());
        }
        continued = line.ends_with('\\');
    }
    for shown in &mut all {
        while shown.output.last().is_some_and(String::is_empty) {
            shown.output.pop();
        }
    }
    all
}

/// A folder as a reader has it who stands in the project's: scripts and tests beside what the commands write.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    #[cfg(unix)]
    for name in ["scripts", "tests"] {
        std::os::unix::fs::symlink(Path::new(env!("CARGO_MANIFEST_DIR")).join(name), folder.path().join(name)).unwrap();
    }
    folder
}

/// Runs a command in a shell that finds the program and, as behind `pip install`, its Python module: exit code, what it said (with its errors where it could not run).
fn shell(folder: &Path, command: &str) -> (Option<i32>, String) {
    let program = PathBuf::from(env!("CARGO_BIN_EXE_eixo"));
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut path = program.parent().unwrap().as_os_str().to_owned();
    for folder in [root.join(".venv/bin").into_os_string(), std::env::var_os("PATH").unwrap_or_default()] {
        path.push(":");
        path.push(folder);
    }
    let mut bash = Command::new("bash");
    bash.args(["-c", command])
        .current_dir(folder)
        .env("PATH", path)
        .env("EIXO_PROGRAM", &program)
        .env("PYTHONPATH", root.join("python"))
        .env_remove("COLUMNS")
        .stdin(std::process::Stdio::null());
    let done = bash.output().unwrap();
    let mut said = String::from_utf8_lossy(&done.stdout).into_owned();
    if done.status.code() == Some(2) {
        said.push_str(&String::from_utf8_lossy(&done.stderr));
    }
    (done.status.code(), said)
}

/// Runs a part of the README.
fn follow(part: usize) {
    let text = readme();
    let start = |k: usize| {
        PARTS.get(k).map_or(usize::MAX, |h| 1 + text.lines().position(|l| l == *h).unwrap_or_else(|| panic!("no {h}")))
    };
    let (from, to) = (start(part), start(part + 1));
    let folder = folder();
    let mut wrong = Vec::new();
    for (first, lines) in blocks(&text).into_iter().filter(|(first, _)| (from..to).contains(first)) {
        let listed = NOT_RUN.iter().find(|(begins, _)| lines[0].starts_with(begins)).map(|(begins, _)| *begins);
        if listed.is_some_and(|begins| begins.starts_with("$ ")) {
            continue;
        }
        // What is listed and no command is the file or the text above commands that are run.
        if listed.is_none() && !lines[0].starts_with("$ ") {
            wrong.push(format!("README.md:{first}: neither run (no line begins with `$ `) nor listed: {:?}", lines[0]));
        }
        for shown in commands(first, &lines) {
            if let Some(skipped) = prepare::before(folder.path(), &shown.command, &shown.output, &shell) {
                eprintln!("SKIPPED: README.md:{}: {}: {skipped}", shown.line, shown.command);
                continue;
            }
            if shown.command.starts_with("python3 ") && skip::python("pandas").is_none() {
                continue;
            }
            let began = std::time::Instant::now();
            let (code, said) = shell(folder.path(), &shown.command);
            eprintln!("README.md:{}: {:.1} s: {}", shown.line, began.elapsed().as_secs_f64(), shown.command);
            let refused = shown.output.first().is_some_and(|l| l.starts_with("error:"));
            if !matches!((code, refused), (Some(0 | 1), false) | (Some(2), true)) {
                wrong.push(format!("README.md:{}: {}: exit code {code:?}: {said}", shown.line, shown.command));
            } else if let Err(difference) = compare::same(&shown.output, &said) {
                wrong.push(format!("README.md:{}: {}: {difference}", shown.line, shown.command));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n\n"));
}

#[test]
fn the_first_screen_runs() {
    follow(0);
}

#[test]
fn the_worked_example_runs_and_prints_what_is_shown() {
    follow(1);
}

#[test]
fn many_machines_and_a_machines_file_run_and_print_what_is_shown() {
    follow(2);
}

#[test]
fn what_follows_the_effects_runs_and_prints_what_is_shown() {
    follow(3);
}

#[test]
fn what_is_not_run_is_there() {
    let text = readme();
    let blocks = blocks(&text);
    for (begins, _) in NOT_RUN {
        assert!(blocks.iter().any(|(_, lines)| lines[0].starts_with(begins)), "{begins}: no such block in README.md");
    }
}

#[test]
fn the_machines_file_that_is_shown_is_one() {
    let text = readme();
    let (_, lines) = blocks(&text).into_iter().find(|(_, lines)| lines[0].starts_with("name = \"X axis\"")).unwrap();
    let machine = eixo::trace::Machine::parse(&lines.join("\n"), "README.md").unwrap();
    assert!(machine.controller.is_some());
}

#[test]
fn files_and_chapters_that_it_names_are_there() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    for page in ["README.md", "docs/simulink.md", "docs/openmodelica.md", "docs/twincat.md"] {
        let text = std::fs::read_to_string(root.join(page)).unwrap();
        let chapters: Vec<String> = text.lines().filter(|l| l.starts_with('#')).map(anchor).collect();
        for target in text.split("](").skip(1).map(|t| t.split(')').next().unwrap()) {
            if let Some(chapter) = target.strip_prefix('#') {
                assert!(chapters.iter().any(|c| c == chapter), "{page}: no chapter #{chapter} in {chapters:?}");
            } else if !target.starts_with("http") {
                let file = root.join(page).parent().unwrap().join(target.split('#').next().unwrap());
                assert!(file.is_file(), "{page}: no file {target}");
            }
        }
    }
}

/// A heading as links name it.
fn anchor(heading: &str) -> String {
    let text = heading.trim_start_matches('#').trim().to_lowercase();
    text.chars().filter(|c| c.is_alphanumeric() || " -_".contains(*c)).map(|c| if c == ' ' { '-' } else { c }).collect()
}
