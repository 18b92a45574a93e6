//! Running an FMU in a child process, and getting its record: what every command does that simulates.

use std::path::{Path, PathBuf};
use std::time::Duration;

use super::archive::Archive;
use super::description::Description;
use super::host::{self, HostError};
use super::isolation::{self, Bounds, Ended, Fence, Job, Outcome, Place, Reply, RunTask, Strength, sandbox, temporary};
use super::simulate::{self, Inputs, Options, SimulateError, SimulationResult};

/// How the child is kept.
#[derive(Debug, Clone)]
pub struct Host {
    /// This program, which is started again as `program validate --child`.
    pub program: PathBuf,
    /// Whether the FMU runs behind a fence.
    pub sandbox: bool,
    /// Longest time that one call may take; no limit where `None`.
    pub call: Option<Duration>,
    /// Address space, in bytes; no limit where `None`.
    pub memory: Option<u64>,
}

impl Host {
    /// This program as it runs, without a fence and without limits.
    ///
    /// # Errors
    /// When the program's own file cannot be found.
    pub fn new() -> std::io::Result<Self> {
        Ok(Self { program: std::env::current_exe()?, sandbox: false, call: None, memory: None })
    }
}

/// An FMU's description, read without running anything of it.
///
/// # Errors
/// When the archive or the description cannot be used.
pub fn describe(path: &Path) -> Result<Description, HostError> {
    Ok(Description::parse(&Archive::open(path)?.read("modelDescription.xml")?)?)
}

/// Runs an FMU from start to end in a child process. Whatever it does there, this process goes on.
///
/// # Errors
/// See [`SimulateError`]; an FMU that crashes, ends its process or hangs is [`SimulateError::Child`].
pub fn simulate(
    path: &Path,
    inputs: &Inputs,
    options: &Options,
    keep: &Host,
) -> Result<SimulationResult, SimulateError> {
    let mut archive = Archive::open(path).map_err(HostError::from)?;
    let xml = archive.read("modelDescription.xml").map_err(HostError::from)?;
    let description = Description::parse(&xml).map_err(HostError::from)?;
    let Some(interface) = &description.co_simulation else {
        return Err(HostError::NoCoSimulation(path.to_owned()).into());
    };
    simulate::check(&description, inputs, options)?;
    let folder = archive.extract().map_err(HostError::from)?;
    host::binary_file(folder.path(), description.fmi, interface)?;
    let child = |reason: std::io::Error| SimulateError::Child(format!("cannot start a process for the FMU: {reason}"));
    let scratch = temporary::folder().map_err(child)?;
    let fence = keep.sandbox.then(|| Fence { read: sandbox::configured(), write: vec![folder.path().to_owned()] });
    // What an FMU writes for its user is its own matter, unless it is fenced.
    let disk = if keep.sandbox { 1 << 30 } else { u64::MAX };
    let bounds = Bounds { call: keep.call, total: None, memory: keep.memory, disk };
    let place = Place { program: &keep.program, scratch: scratch.path().to_owned(), fence, bounds, exact_heap: false };
    let task = RunTask { folder: folder.path().to_owned(), options: options.clone(), inputs: inputs.clone() };
    let outcome = isolation::run(&place, Job::Simulate(task)).map_err(child)?;
    let shown = folder.path().display().to_string();
    record(outcome, keep).map_err(|error| match error {
        // The temporary folder's name is of no use.
        SimulateError::Child(text) => SimulateError::Child(text.replace(&format!("{shown}/"), "")),
        other => other,
    })
}

fn record(outcome: Outcome, keep: &Host) -> Result<SimulationResult, SimulateError> {
    let fail = |text: String| Err(SimulateError::Child(text));
    let within = match (outcome.call, outcome.last) {
        (call, _) if call != host::abi::CALLS[0] => format!(" in {call}"),
        (_, last) if last != host::abi::CALLS[0] => format!(" after {last}"),
        _ => String::new(),
    };
    let printed = outcome.stderr.lines().rfind(|line| !line.trim().is_empty());
    let printed = printed.map_or(String::new(), |line| format!("; it printed: {line}"));
    let refused = outcome.refused.map_or(String::new(), |what| {
        format!("; it asked for {what}, which the sandbox refuses: run it without --sandbox if you trust its maker")
    });
    let reply = outcome.reply.as_deref().and_then(Reply::decode);
    if let Some(internal) = reply.as_ref().and_then(|(reply, _)| reply.internal_error()) {
        return fail(format!("{internal}{within}"));
    }
    // Before the library is loaded, nothing of the FMU has run.
    if outcome.last == host::abi::CALLS[0] && outcome.reply.is_none() {
        return fail(format!("no process could be had to run the FMU in: {}", outcome.stderr.trim()));
    }
    match &outcome.ended {
        Ended::Signal(signal) => {
            return fail(format!("the FMU crashed{within}: {}{printed}{refused}", isolation::signal_name(*signal)));
        }
        Ended::Exited(code) => {
            return fail(format!("the FMU ended its host's process{within} with exit code {code}{printed}{refused}"));
        }
        Ended::Hangs(limit) => return fail(format!("the FMU hangs{within}: no end after {} s", limit.as_secs_f64())),
        Ended::Slow(limit) => return fail(format!("the FMU was not done after {} s", limit.as_secs_f64())),
        Ended::Disk(bytes) => return fail(format!("the FMU wrote {} MB to the disk{within}", bytes / 1_000_000)),
        Ended::Forges => return fail(format!("the FMU wrote to its host's own descriptor{within}")),
        Ended::Well => {}
    }
    let Some((Reply { error, record, .. }, numbers)) = reply else {
        return fail(format!("the FMU ended its host's process{within} with exit code 0"));
    };
    if let Some(error) = error {
        return fail(format!("{error}{refused}"));
    }
    let record = record.and_then(|head| head.record(numbers));
    let Some(mut record) = record else { return fail("the record of the run is not whole".to_owned()) };
    if let Some(line) = outcome.stdout.lines().find(|line| !line.trim().is_empty()) {
        let line: String = line.chars().map(|c| if c.is_control() { '\u{FFFD}' } else { c }).take(200).collect();
        record.notes.push(format!("the FMU printed: {line}"));
    }
    if keep.sandbox && outcome.strength != Strength::Full {
        record.notes.extend(outcome.strength.gap().map(str::to_owned));
    }
    Ok(record)
}
