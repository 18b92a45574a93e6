//! FMUs that mean harm (`tests/corpus/hostile.c`), in the sandbox: nothing outside is written or read, nothing is
//! connected to, no process and no folder is left, and the validation ends.

use std::collections::BTreeMap;
use std::net::{TcpListener, UdpSocket};
use std::os::unix::fs::MetadataExt;
use std::os::unix::net::{UnixDatagram, UnixListener};
use std::path::{Path, PathBuf};
use std::process::Command;

use super::corpus::{self, DESCRIPTION, files, pack, parallel};
use super::skip::{Lack, skipped};

const SOURCE: &str = include_str!("../corpus/hostile.c");

/// The acts, as the C source lists them.
fn acts() -> Vec<&'static str> {
    let list = SOURCE.split("enum {").nth(1).unwrap().split('}').next().unwrap();
    list.split(',').map(str::trim).filter(|name| !name.is_empty()).collect()
}

fn binary(act: &str, folder: &Path) -> Vec<u8> {
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/corpus/hostile.c");
    let file = folder.join("corpus.so");
    let mut command = Command::new("cc");
    command.args(["-shared", "-fPIC", "-O1", "-w", "-fvisibility=hidden"]).arg(format!("-DACT={act}")).arg("-o");
    let output = command.arg(&file).arg(&source).args(["-lm", "-lpthread"]).output().unwrap();
    assert!(output.status.success(), "{act}: {}", String::from_utf8_lossy(&output.stderr));
    std::fs::read(&file).unwrap()
}

/// Content, mode, owner and time of everything in a folder.
fn state(folder: &Path) -> BTreeMap<PathBuf, (Vec<u8>, u32, u32, i64)> {
    let entries = std::fs::read_dir(folder).unwrap().flatten();
    let of = |path: PathBuf| {
        let m = path.symlink_metadata().unwrap();
        let content = if m.is_file() { std::fs::read(&path).unwrap() } else { vec![] };
        (path, (content, m.mode(), m.uid(), m.mtime()))
    };
    entries.map(|e| of(e.path())).collect()
}

/// Whether this kernel has the whole fence.
fn fenced() -> bool {
    let folder = tempfile::tempdir().unwrap();
    let fmu = folder.path().join("sound.fmu");
    std::fs::write(&fmu, pack(&corpus::running(DESCRIPTION, "NONE"))).unwrap();
    let mut command = Command::new(corpus::program());
    let output = command.arg("validate").arg(&fmu).args(["--only", "simulate"]).output().unwrap();
    let said = String::from_utf8(output.stdout).unwrap();
    let whole = !said.contains("Landlock") && !said.contains("seccomp");
    if !whole {
        skipped(Lack::Sandbox, said);
    }
    whole
}

#[test]
fn thirty_and_more_hostile_fmus_do_no_harm() {
    if !corpus::compiler() || !fenced() {
        return;
    }
    let acts = acts();
    assert!(acts.len() >= 30, "{}", acts.len());
    let failures = parallel(&acts, |act| {
        let root = tempfile::tempdir().unwrap();
        let [canary, home, temporary, build] = ["canary", "home", "tmp", "build"].map(|name| {
            let folder = root.path().join(name);
            std::fs::create_dir(&folder).unwrap();
            folder
        });
        std::fs::write(canary.join("file"), "precious").unwrap();
        std::fs::write(home.join("file"), "precious").unwrap();
        let tcp = TcpListener::bind("127.0.0.1:0").unwrap();
        let port = tcp.local_addr().unwrap().port();
        let udp = UdpSocket::bind(("127.0.0.1", port)).unwrap();
        let local = UnixListener::bind(canary.join("s")).unwrap();
        tcp.set_nonblocking(true).unwrap();
        udp.set_nonblocking(true).unwrap();
        local.set_nonblocking(true).unwrap();
        let post = UnixDatagram::bind(canary.join("d")).unwrap();
        post.set_nonblocking(true).unwrap();
        let mut archive = files(DESCRIPTION);
        archive[1].1 = binary(act, &build);
        let fmu = root.path().join("hostile.fmu");
        std::fs::write(&fmu, pack(&archive)).unwrap();
        let before = (state(&canary), state(&home));

        let mut command = Command::new(corpus::program());
        command.arg("validate").arg(&fmu).args([
            "--format",
            "json",
            "--timeout",
            "2",
            "--budget",
            "40",
            "--memory",
            "1024",
        ]);
        command.args(["--only", "simulate,side-stdout"]);
        command.env("TMPDIR", &temporary).env("HOME", &home).env("EIXO_CANARY", &canary);
        command.env("EIXO_PORT", port.to_string());
        let output = command.output().unwrap();

        let mut wrong = Vec::new();
        if !matches!(output.status.code(), Some(0 | 1 | 3)) {
            wrong.push(format!("ended with {:?}: {}", output.status, String::from_utf8_lossy(&output.stderr)));
        }
        if serde_json::from_slice::<serde_json::Value>(&output.stdout).is_err() {
            wrong.push("the report is no JSON".to_owned());
        }
        if String::from_utf8_lossy(&output.stdout).contains("LEAK") {
            wrong.push("read what is not its own".to_owned());
        }
        if (state(&canary), state(&home)) != before {
            wrong.push("changed what is not its own".to_owned());
        }
        let datagram = udp.recv(&mut [0; 8]).is_ok() || post.recv(&mut [0; 8]).is_ok();
        if tcp.accept().is_ok() || datagram || local.accept().is_ok() {
            wrong.push("came through to a socket".to_owned());
        }
        if std::fs::read_dir(&temporary).unwrap().count() > 0 {
            wrong.push("left a folder".to_owned());
        }
        let survivors = super::cli::processes_with(&temporary);
        if !survivors.is_empty() {
            wrong.push(format!("left processes: {survivors:?}"));
        }
        (!wrong.is_empty()).then(|| format!("{act}: {}", wrong.join("; ")))
    });
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}
