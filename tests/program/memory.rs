//! The memory that a program takes.

use std::process::{Command, ExitStatus, Stdio};
use std::time::Duration;

/// Runs a program to its end: how it ended, and its largest resident memory, bytes, as the kernel last told while it ran.
pub fn peak(program: &mut Command) -> (ExitStatus, u64) {
    let mut child = program.stdout(Stdio::null()).stderr(Stdio::null()).spawn().expect("the program starts");
    let status = format!("/proc/{}/status", child.id());
    let mut peak = 0;
    loop {
        let text = std::fs::read_to_string(&status).unwrap_or_default();
        let line = text.lines().find_map(|l| l.strip_prefix("VmHWM:"));
        if let Some(kib) = line.and_then(|l| l.trim().strip_suffix("kB")).and_then(|n| n.trim().parse::<u64>().ok()) {
            peak = peak.max(kib << 10);
        }
        if let Some(ended) = child.try_wait().expect("the process") {
            return (ended, peak);
        }
        std::thread::sleep(Duration::from_millis(5));
    }
}
