//! Many traces in one run: found, worked on by every core, kept one by one, and put together in one summary.
//!
//! ```text
//! OUT/results/<trace>.json    one a trace, written when it is done: its row, its full result, the key of its making
//! OUT/reports/<trace>.html    its report
//! OUT/summary.csv             a row a trace (or Parquet, by the extension)
//! OUT/index.html              a row a machine and a row a trace, with links to the reports
//! ```
//!
//! A result is used again when its key is the same: the hash of trace, axis file, settings and of the program itself. So a
//! run that was interrupted goes on where it stopped, and parts of a run may be done by other processes or machines that
//! share the folder (`--part`). Summary and index follow from the kept results alone, in an order of their own: they are the
//! same to the byte for any number of threads, processes or interruptions.

mod find;
mod index;
mod store;
mod summary;
mod trend;
mod when;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::report::{Block, Report, html};
use crate::trace::{Machine, TraceError, write_text};

pub use find::{Item, find, is_many};
pub use when::When;

/// What cannot be done.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FleetError {
    /// No trace where one should be.
    #[error("{what}: {why}")]
    Nothing {
        /// The argument.
        what: String,
        /// Why, and the way out.
        why: String,
    },
    /// A folder or file cannot be read.
    #[error("{path}: cannot read: {reason}")]
    Read {
        /// Which.
        path: PathBuf,
        /// Why.
        reason: std::io::Error,
    },
    /// A folder cannot be made.
    #[error("{path}: cannot make the folder: {reason}; choose another with --output")]
    Folder {
        /// Which.
        path: PathBuf,
        /// Why.
        reason: std::io::Error,
    },
    /// An output cannot be written.
    #[error(transparent)]
    Write(#[from] TraceError),
    /// The summary cannot be written as Parquet.
    #[error("{path}: cannot write the summary: {reason}")]
    Parquet {
        /// The file.
        path: PathBuf,
        /// Why.
        reason: String,
    },
}

/// A parameter that is followed over time.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Tracked {
    /// Its name: `K`, `coulomb_motor.level`.
    pub name: String,
    /// Its unit.
    pub unit: String,
    /// The estimate.
    pub value: f64,
    /// Its standard error.
    pub std: Option<f64>,
}

/// What the work on one trace gives.
pub struct Found {
    /// Values of [`Plan::facts`], in that order.
    pub facts: Vec<Value>,
    /// Parameters, in the order of their columns.
    pub parameters: Vec<Tracked>,
    /// What the user should know.
    pub warnings: Vec<String>,
    /// The full result.
    pub result: Value,
    /// The report.
    pub report: Report,
}

/// One trace in the summary: what is kept of it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// The trace, as it was found.
    pub trace: String,
    /// Values of the facts; empty for a trace that could not be used.
    pub facts: Vec<Value>,
    /// Parameters.
    pub parameters: Vec<Tracked>,
    /// Warnings; for a trace that could not be used, why.
    pub message: String,
    /// Whether the trace could be used.
    pub done: bool,
}

/// A row in its place.
struct Placed<'a> {
    row: &'a Row,
    item: &'a Item,
    machine: String,
    when: Option<When>,
}

/// What is to be done.
pub struct Plan<'a> {
    /// `diagnose` or `identify`.
    pub command: &'static str,
    /// Names of the facts, the columns of the summary.
    pub facts: &'static [&'static str],
    /// Everything that the results depend on, other than trace and axis file.
    pub settings: String,
    /// The traces.
    pub items: &'a [Item],
    /// The folder that the results are kept in.
    pub output: &'a Path,
    /// The summary, CSV or Parquet by its extension; none: `summary.csv` in the folder.
    pub summary: Option<&'a Path>,
    /// Only keep the results: the summary is put together by another run.
    pub part: bool,
}

/// The number of a trace, and its row or why nothing could be kept; whether the row was kept by an earlier run.
type Rows = BTreeMap<usize, Result<(Row, bool), FleetError>>;

/// How a run went.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Outcome {
    /// Traces that could be used.
    pub done: usize,
    /// Traces that could not.
    pub failed: usize,
    /// How many of all were done by an earlier run.
    pub reused: usize,
    /// What the terminal shows.
    pub short: Vec<Block>,
}

/// Does the work on every trace that is not done yet, then writes summary and index. `finished(trace, outcome)` is called for
/// each trace, from any thread.
///
/// # Errors
/// When the folder or an output cannot be written. A trace that cannot be used is a row that says why.
pub fn run(
    plan: &Plan,
    work: &(dyn Fn(&Item) -> Result<Found, String> + Sync),
    finished: &(dyn Fn(&Item, &str) + Sync),
) -> Result<Outcome, FleetError> {
    if let Some(path) = plan.summary.filter(|_| !plan.part) {
        summary::check(path)?;
    }
    let store = store::Store::open(plan)?;
    let next = AtomicUsize::new(0);
    let rows: Mutex<Rows> = Mutex::new(Rows::new());
    let worker = || {
        loop {
            let at = next.fetch_add(1, Ordering::Relaxed);
            let Some(item) = plan.items.get(at) else { return };
            let row = one(&store, item, work);
            finished(item, &outcome_text(&row));
            if let Ok(mut rows) = rows.lock() {
                rows.insert(at, row);
            }
        }
    };
    // Threads of our own, so that one trace's parallel parts, which share the pool, never begin another trace in their midst.
    let threads = rayon::current_num_threads().min(plan.items.len()).max(1);
    std::thread::scope(|scope| {
        for _ in 0..threads {
            scope.spawn(worker);
        }
    });
    let mut outcome = Outcome::default();
    let mut all = Vec::with_capacity(plan.items.len());
    for (_, row) in rows.into_inner().unwrap_or_default() {
        let (row, reused) = row?;
        outcome.reused += usize::from(reused);
        if row.done {
            outcome.done += 1;
        } else {
            outcome.failed += 1;
        }
        all.push(row);
    }
    let placed = place(plan.items, &all);
    if !plan.part {
        let report = index::report(plan, &placed);
        outcome.short = index::short(plan, &placed);
        let fallback = plan.output.join("summary.csv");
        summary::write(plan.summary.unwrap_or(&fallback), plan.facts, &placed)?;
        write_text(&plan.output.join("index.html"), html::page(&report).as_bytes())?;
    }
    Ok(outcome)
}

fn outcome_text(row: &Result<(Row, bool), FleetError>) -> String {
    match row {
        Ok((row, true)) if row.done => "done by an earlier run".to_owned(),
        Ok((row, _)) if row.done => row.facts.first().and_then(Value::as_str).unwrap_or("done").to_owned(),
        // The line begins with the file, as the message does.
        Ok((row, _)) => row.message.strip_prefix(&format!("{}: ", row.trace)).unwrap_or(&row.message).to_owned(),
        Err(error) => error.to_string(),
    }
}

/// The kept row of a trace, or the one that the work gives; whether it was kept.
fn one(
    store: &store::Store,
    item: &Item,
    work: &(dyn Fn(&Item) -> Result<Found, String> + Sync),
) -> Result<(Row, bool), FleetError> {
    let key = match store.key(item) {
        Ok(key) => key,
        // Unreadable now may be readable next time: not kept.
        Err(message) => return Ok((failed(item, message), false)),
    };
    if let Some(row) = store.kept(item, &key) {
        return Ok((row, true));
    }
    let found = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| work(item)))
        .unwrap_or_else(|_| Err("the program failed on this trace; please report it with the trace".to_owned()));
    let (row, result, page) = match found {
        Err(message) => (failed(item, message), Value::Null, None),
        Ok(found) => {
            let row = Row {
                trace: item.name(),
                facts: found.facts,
                parameters: found.parameters.into_iter().filter(|p| p.value.is_finite()).collect(),
                message: sentences(&found.warnings),
                done: true,
            };
            (row, found.result, Some(html::page(&found.report)))
        }
    };
    store.keep(item, &key, &row, &result, page.as_deref())?;
    Ok((row, false))
}

/// Warnings one after the other, each with its stop.
fn sentences(all: &[String]) -> String {
    let stopped = all.iter().map(|w| if w.ends_with('.') { w.clone() } else { format!("{w}.") });
    stopped.collect::<Vec<_>>().join(" ")
}

fn failed(item: &Item, message: String) -> Row {
    Row { trace: item.name(), facts: Vec::new(), parameters: Vec::new(), message, done: false }
}

/// Machine and time of each row, in the order of the summary: by machine, by time, by name.
fn place<'a>(items: &'a [Item], rows: &'a [Row]) -> Vec<Placed<'a>> {
    let mut names: BTreeMap<&Path, String> = BTreeMap::new();
    for axis in items.iter().filter_map(|i| i.axis.as_deref()) {
        names.entry(axis).or_insert_with(|| Machine::read(axis).map_or_else(|_| find::folder(axis), |m| m.name));
    }
    let folders: std::collections::BTreeSet<_> = items.iter().map(|i| i.path.parent()).collect();
    let machine = |item: &Item| match item.axis.as_deref() {
        None => find::folder(&item.path),
        // One axis file for traces of several folders: a folder a machine.
        Some(_) if names.len() == 1 && folders.len() > 1 => find::folder(&item.path),
        Some(axis) => {
            let name = names.get(axis).cloned().unwrap_or_default();
            let same_name = names.values().filter(|n| **n == name).count();
            if same_name > 1 { format!("{name} ({})", find::folder(axis)) } else { name }
        }
    };
    let mut placed: Vec<Placed> = items
        .iter()
        .zip(rows)
        .map(|(item, row)| Placed { row, item, machine: machine(item), when: When::of(&item.path) })
        .collect();
    placed.sort_by(|a, b| {
        let time = |p: &Placed| p.when.as_ref().map_or(f64::INFINITY, |w| w.days);
        let by_name = || find::natural(&a.row.trace, &b.row.trace);
        find::natural(&a.machine, &b.machine).then(time(a).total_cmp(&time(b))).then_with(by_name)
    });
    placed
}
