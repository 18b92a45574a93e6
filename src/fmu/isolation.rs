//! Running one behavioural rule in a process of its own.
//!
//! The program starts itself again with a task file. The child limits its own memory and files, writes which FMI
//! function it is calling into a shared page, and its result into a file that only it knows of, so that nothing an FMU
//! prints is taken for a result. The parent sets a time limit, and afterwards kills the child's whole process group.

#![allow(unsafe_code)]

use std::fs::{self, File};
use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode, ExitStatus, Stdio};
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::{Duration, Instant};

use serde::{Deserialize, Serialize};

use super::behaviour::{self, Setup, Stop, probe::Learned};
use super::description::Description;
use super::host::{CALL_SLOT, HostError, abi::CALLS};

/// What a child is to do.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct Task {
    pub rule: String,
    pub folder: PathBuf,
    pub binary_path: PathBuf,
    pub workplace: PathBuf,
    pub slot: PathBuf,
    pub result: PathBuf,
    pub memory: u64,
    pub learned: Learned,
}

/// What a child found.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct Answer {
    /// Findings, each with the call at fault.
    pub findings: Vec<(String, Option<String>)>,
    pub not_tested: Option<String>,
    pub not_applicable: Option<String>,
    pub learned: Learned,
}

/// How a child ended.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Ended {
    Well,
    /// Left early with this exit code: the FMU called `exit`.
    Exited(i32),
    /// Killed by this signal.
    Signal(i32),
    TimedOut,
}

impl Ended {
    /// Whether a signal ended the process that people and systems send: SIGHUP, SIGINT, SIGTERM.
    pub fn is_from_outside(&self) -> bool {
        matches!(self, Self::Signal(1 | 2 | 15))
    }
}

/// What became of a child.
#[derive(Debug)]
pub(crate) struct Outcome {
    pub ended: Ended,
    pub answer: Option<Answer>,
    /// The FMI function under way at the end.
    pub call: &'static str,
    /// The beginning of what it printed.
    pub stdout: String,
    pub stderr: String,
}

/// Most that is kept of what a child prints, in bytes.
const MOST_OUTPUT: u64 = 4096;

/// Limits of a child.
#[derive(Debug, Clone, Copy)]
pub struct Bounds {
    /// Wall time.
    pub time: Duration,
    /// Address space, in bytes.
    pub memory: u64,
}

impl Default for Bounds {
    fn default() -> Self {
        Self { time: Duration::from_secs(10), memory: 8 << 30 }
    }
}

/// Runs a task in a child: `program` is this program, which hands the task to [`child`].
pub(crate) fn run(program: &Path, task: &Task, scratch: &Path, bounds: Bounds) -> io::Result<Outcome> {
    let file = scratch.join("task.json");
    fs::write(&file, serde_json::to_vec(task)?)?;
    fs::write(&task.slot, [0; 4])?;
    let (out, err) = (scratch.join("stdout"), scratch.join("stderr"));
    let mut command = Command::new(program);
    command.args(["validate", "--child"]).arg(&file).current_dir(&task.workplace);
    command.stdin(Stdio::null()).stdout(File::create(&out)?).stderr(File::create(&err)?);
    // Without its caches the C library tells exactly how much memory is in use.
    command.env("GLIBC_TUNABLES", "glibc.malloc.tcache_count=0");
    #[cfg(unix)]
    std::os::unix::process::CommandExt::process_group(&mut command, 0);
    let mut child = command.spawn()?;
    let status = wait(&mut child, bounds.time);
    #[cfg(unix)]
    // SAFETY: the group is the child's own, whatever is left in it; its id is not reused before the child is waited for
    // by us, and afterwards only while a member of the group lives.
    unsafe {
        libc::kill(-(child.id() as i32), libc::SIGKILL);
    }
    if status.is_none() {
        let _ = child.kill();
        child.wait()?;
    }
    let answer = fs::read(&task.result).ok().and_then(|bytes| serde_json::from_slice(&bytes).ok());
    let call = fs::read(&task.slot).ok().and_then(|b| Some(u32::from_ne_bytes(b.try_into().ok()?))).unwrap_or(0);
    Ok(Outcome {
        ended: status.map_or(Ended::TimedOut, ended),
        answer,
        call: CALLS.get(call as usize).copied().unwrap_or(CALLS[0]),
        stdout: beginning(&out),
        stderr: beginning(&err),
    })
}

fn wait(child: &mut std::process::Child, limit: Duration) -> Option<ExitStatus> {
    let end = Instant::now() + limit;
    let mut pause = Duration::from_micros(200);
    loop {
        if let Ok(Some(status)) = child.try_wait() {
            return Some(status);
        }
        if Instant::now() > end {
            return None;
        }
        std::thread::sleep(pause);
        pause = (pause * 2).min(Duration::from_millis(5));
    }
}

fn ended(status: ExitStatus) -> Ended {
    #[cfg(unix)]
    if let Some(signal) = std::os::unix::process::ExitStatusExt::signal(&status) {
        return Ended::Signal(signal);
    }
    match status.code() {
        Some(0) | None => Ended::Well,
        Some(code) => Ended::Exited(code),
    }
}

fn beginning(path: &Path) -> String {
    let mut bytes = Vec::new();
    if let Ok(file) = File::open(path) {
        let _ = file.take(MOST_OUTPUT).read_to_end(&mut bytes);
    }
    String::from_utf8_lossy(&bytes).into_owned()
}

/// Lets processes that an FMU leaves behind become this process' children, even those that left their group, so that
/// [`end_orphans`] finds them. For a program that has no other children.
pub fn adopt_orphans() {
    #[cfg(target_os = "linux")]
    // SAFETY: the option takes a flag.
    unsafe {
        libc::prctl(libc::PR_SET_CHILD_SUBREAPER, 1);
    }
}

/// Kills all children of this process, and theirs.
pub fn end_orphans() {
    #[cfg(target_os = "linux")]
    // Killing one hands its children to us: again until there are none, or none that can be killed.
    for _ in 0..100 {
        let children = children();
        if children.is_empty() {
            break;
        }
        for child in children {
            // SAFETY: the id is a child's, which cannot be reused before it is waited for.
            unsafe {
                libc::kill(child, libc::SIGKILL);
                libc::waitpid(child, std::ptr::null_mut(), 0);
            }
        }
    }
}

/// Ids of this process' children.
#[cfg(target_os = "linux")]
fn children() -> Vec<i32> {
    let own = std::process::id().to_string();
    let parent = |id: i32| {
        // The name, in brackets, may hold anything; state and parent follow it (proc(5)).
        let stat = fs::read_to_string(format!("/proc/{id}/stat")).ok()?;
        stat.rsplit_once(')')?.1.split_whitespace().nth(1).map(str::to_owned)
    };
    let entries = fs::read_dir("/proc").into_iter().flatten().flatten();
    let ids = entries.filter_map(|e| e.file_name().to_str()?.parse().ok());
    ids.filter(|&id| parent(id).as_deref() == Some(own.as_str())).collect()
}

/// The name of a signal that ends processes.
pub(crate) fn signal_name(signal: i32) -> String {
    let name = match signal {
        4 => "SIGILL, an illegal instruction",
        6 => "SIGABRT, an abort",
        7 => "SIGBUS, a bus error",
        8 => "SIGFPE, an arithmetic error",
        9 => "SIGKILL",
        11 => "SIGSEGV, an invalid memory access",
        13 => "SIGPIPE",
        14 => "SIGALRM",
        15 => "SIGTERM",
        24 => "SIGXCPU",
        25 => "SIGXFSZ, too large a file",
        31 => "SIGSYS",
        other => return format!("signal {other}"),
    };
    name.to_owned()
}

/// The child's side: reads the task, runs the rule, writes the answer, and leaves without running exit handlers.
pub fn child(task: &Path) -> ExitCode {
    match attempt(task) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{error}");
            ExitCode::from(2)
        }
    }
}

fn attempt(task: &Path) -> io::Result<()> {
    let task: Task = serde_json::from_slice(&fs::read(task)?)?;
    limit(task.memory);
    share(&task.slot)?;
    let xml = fs::read(task.folder.join("modelDescription.xml"))?;
    let description = Description::parse(&xml).map_err(io::Error::other)?;
    let test = behaviour::behaviour(&task.rule).ok_or_else(|| io::Error::other("no such rule"))?;
    let setup = Setup {
        description,
        folder: task.folder,
        binary_path: task.binary_path,
        workplace: task.workplace,
        learned: task.learned,
    };
    let (tested, learned) = behaviour::run(test, &setup);
    let mut answer = Answer { findings: vec![], not_tested: None, not_applicable: None, learned };
    match tested {
        Ok(findings) => answer.findings = findings.into_iter().map(|message| (message, None)).collect(),
        Err(Stop::NotApplicable(why)) => answer.not_applicable = Some(why),
        Err(Stop::NotTested(why)) => answer.not_tested = Some(why),
        Err(Stop::Host(error)) => {
            let call = match &error {
                HostError::Status { function, .. } | HostError::Missing(function) => Some((*function).to_owned()),
                HostError::Refused(_) => Some("fmi2Instantiate".to_owned()),
                _ => None,
            };
            answer.findings = vec![(error.to_string(), call)];
        }
    }
    let beside = task.result.with_extension("part");
    fs::write(&beside, serde_json::to_vec(&answer)?)?;
    fs::rename(&beside, &task.result)?;
    leave(task.rule != "unload")
}

/// Flushes what the FMU printed and ends the process; `at_once` without the exit handlers, which are a rule of their own.
fn leave(at_once: bool) -> io::Result<()> {
    unsafe extern "C" {
        fn fflush(stream: *mut std::ffi::c_void) -> i32;
    }
    // SAFETY: null flushes all of the C library's streams.
    unsafe { fflush(std::ptr::null_mut()) };
    if at_once {
        #[cfg(unix)]
        // SAFETY: nothing is left to clean up: all files are written and closed.
        unsafe {
            libc::_exit(0)
        };
    }
    Ok(())
}

/// Limits memory, core dumps and the size of files, and dies with the parent.
#[cfg(unix)]
fn limit(memory: u64) {
    let set = |resource, value| {
        let limit = libc::rlimit { rlim_cur: value, rlim_max: value };
        // SAFETY: the structure is valid; a refusal leaves the limit as it was.
        unsafe { libc::setrlimit(resource, &raw const limit) };
    };
    set(libc::RLIMIT_AS, memory);
    set(libc::RLIMIT_CORE, 0);
    set(libc::RLIMIT_FSIZE, 1 << 30);
    #[cfg(target_os = "linux")]
    // SAFETY: the option takes a signal number.
    unsafe {
        libc::prctl(libc::PR_SET_PDEATHSIG, libc::SIGKILL);
    }
}

#[cfg(not(unix))]
fn limit(_memory: u64) {}

/// Maps the slot for the number of the call under way.
#[cfg(unix)]
fn share(slot: &Path) -> io::Result<()> {
    use std::os::fd::AsRawFd;
    let file = File::options().read(true).write(true).open(slot)?;
    let size = size_of::<AtomicU32>();
    // SAFETY: the file is four bytes long and stays; the mapping is never undone.
    let page = unsafe {
        libc::mmap(
            std::ptr::null_mut(),
            size,
            libc::PROT_READ | libc::PROT_WRITE,
            libc::MAP_SHARED,
            file.as_raw_fd(),
            0,
        )
    };
    if page == libc::MAP_FAILED {
        return Err(io::Error::last_os_error());
    }
    CALL_SLOT.store(page.cast::<AtomicU32>(), Ordering::Relaxed);
    Ok(())
}

#[cfg(not(unix))]
fn share(_slot: &Path) -> io::Result<()> {
    let _: &std::sync::atomic::AtomicPtr<AtomicU32> = &CALL_SLOT;
    let _ = Ordering::Relaxed;
    Ok(())
}
