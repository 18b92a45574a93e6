//! Running an FMU in a process of its own.
//!
//! The program starts itself again and hands the child a job through a socket that the child inherits as its standard
//! input and moves out of the way before the FMU's library is loaded. The child leaves the terminal, limits its own
//! memory and files, raises the fence of [`sandbox`] where asked, notes in a page of shared memory which FMI function it
//! is calling ([`page`]), and replies through the socket with a number that it received once, so that nothing an FMU
//! prints, writes or sends is taken for a result by mistake. (Code in the child's own memory can find that number: what
//! stays possible inside one process is written in the README.) The parent reads, watches over time and disk ([`watch`]),
//! and afterwards kills the child's whole session.

mod child;
mod job;
mod orphans;
mod page;
mod removal;
pub mod sandbox;
pub mod temporary;
mod watch;

use std::io;
use std::path::{Path, PathBuf};
use std::time::Duration;

pub use child::child;
pub(crate) use job::{Job, Reply, RunTask, Task};
pub use orphans::{adopt_orphans, end_orphans};
pub(crate) use page::Page;
pub use sandbox::{Fence, Strength};

/// The command line by which a child of this program is known: it is to call [`child()`], before all else.
pub const CHILD: [&str; 2] = ["validate", "--child"];

/// How a child ended.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Ended {
    Well,
    /// Left early with this exit code: the FMU called `exit`.
    Exited(i32),
    /// Killed by this signal.
    Signal(i32),
    /// One call did not come back for this long.
    Hangs(Duration),
    /// Calls came back, but all of them together took longer than this.
    Slow(Duration),
    /// Wrote more to the disk than allowed, in bytes.
    Disk(u64),
    /// Wrote to the socket on which the reply is expected.
    Forges,
}

impl Ended {
    /// Whether a signal ended the process that people and systems send: SIGHUP, SIGINT, SIGTERM.
    pub fn is_from_outside(&self) -> bool {
        matches!(self, Self::Signal(1 | 2 | 15))
    }
}

/// How a child ended, and what it left.
#[derive(Debug)]
pub(crate) struct Outcome {
    pub ended: Ended,
    /// What it replied: as [`Reply`] is encoded.
    pub reply: Option<Vec<u8>>,
    /// The FMI function under way at the end.
    pub call: &'static str,
    /// The FMI function called last.
    pub last: &'static str,
    /// Whether the FMU ended while it had values that the validator chose.
    pub chosen_values: bool,
    /// Longest time that one call took, roughly.
    pub longest: Duration,
    /// What the sandbox refused first.
    pub refused: Option<&'static str>,
    /// How much of the sandbox was in force.
    pub strength: Strength,
    /// The beginning of what it printed.
    pub stdout: String,
    pub stderr: String,
}

/// Limits of a child.
#[derive(Debug, Clone, Copy)]
pub struct Bounds {
    /// Wall time of one call of an FMI function; no limit where `None`.
    pub call: Option<Duration>,
    /// Wall time of all of them; no limit where `None`.
    pub total: Option<Duration>,
    /// Address space, in bytes; no limit where `None`.
    pub memory: Option<u64>,
    /// What it may write to the disk, in bytes.
    pub disk: u64,
}

impl Default for Bounds {
    fn default() -> Self {
        Self { call: Some(Duration::from_secs(10)), total: None, memory: Some(8 << 30), disk: 512 << 20 }
    }
}

/// Where and how a child runs.
pub(crate) struct Place<'a> {
    /// This program, which calls [`child()`].
    pub program: &'a Path,
    /// A folder for this child alone, which the FMU cannot write to.
    pub scratch: PathBuf,
    /// What the FMU may touch; the child runs without a fence where `None`.
    pub fence: Option<Fence>,
    pub bounds: Bounds,
    /// Whether the C library must count exactly how much memory is in use.
    pub exact_heap: bool,
}

impl Place<'_> {
    /// The FMU's working directory.
    pub fn workplace(&self) -> PathBuf {
        self.scratch.join("workplace")
    }
}

/// Runs a job in a child.
///
/// # Errors
/// When the system refuses what a child needs; what the FMU does is in the outcome.
#[cfg(unix)]
pub(crate) fn run(place: &Place<'_>, job: Job) -> io::Result<Outcome> {
    watch::run(place, job)
}

/// There are no children on this system.
#[cfg(not(unix))]
pub(crate) fn run(_place: &Place<'_>, _job: Job) -> io::Result<Outcome> {
    Err(io::Error::new(io::ErrorKind::Unsupported, "foreign FMUs are run on Unix systems alone"))
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
