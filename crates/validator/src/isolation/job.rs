//! What goes to a child and comes back: JSON, and behind it columns of numbers as they are in memory.

use std::io::{self, Read, Write};
use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use super::super::behaviour::probe::Learned;
use super::super::simulate::{Column, Inputs, Options, SimulationResult};
use super::Fence;

/// Longest JSON that either side reads, in bytes.
const LONGEST: u64 = 256 << 20;

/// The number that goes with a reply.
pub(super) type Nonce = [u8; 16];

/// A behavioural rule to test.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct Task {
    pub rule: String,
    pub folder: PathBuf,
    pub binary_path: PathBuf,
    pub workplace: PathBuf,
    pub learned: Learned,
}

/// A simulation to run.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct RunTask {
    pub folder: PathBuf,
    pub options: Options,
    /// Without its numbers, which travel behind the JSON.
    pub inputs: Inputs,
}

/// What a child is to do.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) enum Job {
    Rule(Task),
    Simulate(RunTask),
}

/// A job with all that a child needs to know.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct Order {
    pub nonce: Nonce,
    pub job: Job,
    /// The shared page.
    pub page: PathBuf,
    /// Process id of the parent, whose end is the child's.
    pub parent: u32,
    pub memory: Option<u64>,
    /// Largest file, in bytes.
    pub file: u64,
    pub fence: Option<Fence>,
    /// Number of columns that follow.
    columns: Vec<usize>,
}

/// What a child found.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub(crate) struct Reply {
    /// Findings, each with the call at fault.
    pub findings: Vec<(String, Option<String>)>,
    pub not_tested: Option<String>,
    pub not_applicable: Option<String>,
    pub learned: Learned,
    /// Why a simulation ended, where it failed.
    pub error: Option<String>,
    /// A simulation's record, without its numbers.
    pub record: Option<Head>,
    /// A panic of this program's own code in the child, as text: nothing is known of the FMU then.
    pub fault: Option<String>,
}

impl Reply {
    /// The fault as a sentence; `None` where the child's own code did what it should.
    pub fn internal_error(&self) -> Option<String> {
        let fault = self.fault.as_ref()?;
        Some(format!("internal error of eixo {}, not of the FMU: {fault}; please report it", env!("CARGO_PKG_VERSION")))
    }
}

/// A record without its numbers.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub(crate) struct Head {
    pub step: f64,
    pub notes: Vec<String>,
    /// Name, unit, and whether it is an input.
    columns: Vec<(String, Option<String>, bool)>,
    rows: usize,
}

impl Head {
    pub fn of(record: &SimulationResult) -> Self {
        let columns = record.columns.iter().map(|c| (c.name.clone(), c.unit.clone(), c.input)).collect();
        Self { step: record.step, notes: record.notes.clone(), columns, rows: record.time.len() }
    }

    /// The record, from the numbers of [`numbers`].
    pub fn record(self, mut bytes: &[u8]) -> Option<SimulationResult> {
        let rows = self.rows;
        if bytes.len() as u64 != (self.columns.len() as u64 + 1) * rows as u64 * 8 {
            return None;
        }
        let mut next = || {
            let (column, rest) = bytes.split_at(8 * rows);
            bytes = rest;
            column.as_chunks().0.iter().map(|eight| f64::from_ne_bytes(*eight)).collect()
        };
        let time = next();
        let columns = self.columns.into_iter().map(|(name, unit, input)| Column { name, unit, values: next(), input });
        let columns = columns.collect();
        Some(SimulationResult { time, step: self.step, columns, notes: self.notes })
    }
}

/// A column as bytes.
fn bytes(column: &[f64]) -> Vec<u8> {
    let mut out = vec![0; 8 * column.len()];
    out.as_chunks_mut().0.iter_mut().zip(column).for_each(|(eight, x)| *eight = x.to_ne_bytes());
    out
}

impl Order {
    pub fn new(job: Job, page: PathBuf, memory: Option<u64>, file: u64, fence: Option<Fence>) -> Self {
        let parent = std::process::id();
        Self { nonce: rand::random(), job, page, parent, memory, file, fence, columns: Vec::new() }
    }

    /// Sends the order.
    pub fn send(&mut self, out: &mut impl Write) -> io::Result<()> {
        let mut numbers = Vec::new();
        if let Job::Simulate(task) = &mut self.job {
            numbers.push(std::mem::take(&mut task.inputs.time));
            numbers.extend(task.inputs.signals.iter_mut().map(|(_, values)| std::mem::take(values)));
        }
        self.columns = numbers.iter().map(Vec::len).collect();
        let json = serde_json::to_vec(self)?;
        out.write_all(&(json.len() as u64).to_ne_bytes())?;
        out.write_all(&json)?;
        numbers.iter().try_for_each(|column| out.write_all(&bytes(column)))
    }

    /// Receives an order.
    pub fn receive(input: &mut impl Read) -> io::Result<Self> {
        let mut length = [0; 8];
        input.read_exact(&mut length)?;
        let length = u64::from_ne_bytes(length);
        if length > LONGEST {
            return Err(io::Error::other("too long an order"));
        }
        let mut json = vec![0; length as usize];
        input.read_exact(&mut json)?;
        let mut order: Self = serde_json::from_slice(&json)?;
        let mut columns = Vec::new();
        for &length in &order.columns {
            let mut raw = vec![0; 8 * length];
            input.read_exact(&mut raw)?;
            columns.push(raw.as_chunks().0.iter().map(|eight| f64::from_ne_bytes(*eight)).collect::<Vec<f64>>());
        }
        if let Job::Simulate(task) = &mut order.job {
            let mut columns = columns.into_iter();
            task.inputs.time = columns.next().unwrap_or_default();
            task.inputs.signals.iter_mut().zip(columns).for_each(|((_, values), column)| *values = column);
        }
        Ok(order)
    }
}

impl Reply {
    /// The reply's head: the number, and the lengths of JSON and numbers.
    pub fn encode(&self, nonce: &Nonce, numbers: u64) -> io::Result<Vec<u8>> {
        let json = serde_json::to_vec(self)?;
        let mut out = nonce.to_vec();
        out.extend((json.len() as u64).to_ne_bytes());
        out.extend(numbers.to_ne_bytes());
        out.extend(json);
        Ok(out)
    }

    /// Reads a reply, and the numbers behind it; `None` when it is not complete.
    pub fn decode(bytes: &[u8]) -> Option<(Self, &[u8])> {
        let (lengths, rest) = bytes.get(size_of::<Nonce>()..)?.split_at_checked(16)?;
        let json = u64::from_ne_bytes(lengths[..8].try_into().ok()?);
        let (json, numbers) = rest.split_at_checked(usize::try_from(json).ok()?)?;
        Some((serde_json::from_slice(json).ok()?, numbers))
    }
}

/// The state of a reply of which some bytes have been received.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum Received {
    /// More is to come.
    Partial,
    /// A complete reply.
    Complete,
    /// No reply to this order.
    Forged,
}

/// How many bytes are still to come of a complete reply; 0 where that is not known yet.
pub(super) fn rest(bytes: &[u8], nonce: &Nonce) -> u64 {
    let length = |at: usize| bytes.get(at..at + 8).and_then(|b| b.try_into().ok()).map_or(0, u64::from_ne_bytes);
    match classify(bytes, nonce) {
        Received::Partial if bytes.len() >= 32 => {
            length(16).saturating_add(length(24)).saturating_add(32).saturating_sub(bytes.len() as u64)
        }
        _ => 0,
    }
}

/// Classifies the bytes received so far.
pub(super) fn classify(bytes: &[u8], nonce: &Nonce) -> Received {
    let head = bytes.len().min(nonce.len());
    if bytes[..head] != nonce[..head] {
        return Received::Forged;
    }
    let length = |at: usize| bytes.get(at..at + 8).and_then(|b| b.try_into().ok()).map(u64::from_ne_bytes);
    let (Some(json), Some(numbers)) = (length(16), length(24)) else { return Received::Partial };
    if json > LONGEST {
        return Received::Forged;
    }
    match (bytes.len() as u64).cmp(&json.saturating_add(numbers).saturating_add(32)) {
        std::cmp::Ordering::Less => Received::Partial,
        std::cmp::Ordering::Equal => Received::Complete,
        std::cmp::Ordering::Greater => Received::Forged,
    }
}

/// Writes the numbers of a record: the time, then each column.
pub(super) fn send_numbers(record: &SimulationResult, out: &mut impl Write) -> io::Result<()> {
    let columns = std::iter::once(&record.time).chain(record.columns.iter().map(|c| &c.values));
    for column in columns {
        for part in column.chunks(1 << 14) {
            out.write_all(&bytes(part))?;
        }
    }
    Ok(())
}

/// How many bytes [`send_numbers`] writes.
pub(super) fn numbers(record: &SimulationResult) -> u64 {
    (record.columns.len() as u64 + 1) * record.time.len() as u64 * 8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_order_and_a_record_come_out_as_they_went_in() {
        let inputs = Inputs {
            time: vec![0.0, 0.5, 1.5],
            signals: vec![("T".into(), vec![1.0, f64::MIN_POSITIVE, -0.0])],
            dt: None,
            notes: vec!["a note".into()],
        };
        let task = RunTask { folder: "/x".into(), options: Options::default(), inputs: inputs.clone() };
        let mut order = Order::new(Job::Simulate(task), "/page".into(), None, 1, None);
        let mut sent = Vec::new();
        order.send(&mut sent).unwrap();
        let received = Order::receive(&mut sent.as_slice()).unwrap();
        assert_eq!(received.nonce, order.nonce);
        let Job::Simulate(task) = received.job else { panic!("another job") };
        assert_eq!(task.inputs, inputs);

        let column =
            Column { name: "y".into(), unit: Some("m".into()), values: vec![3.0, f64::INFINITY], input: false };
        let record = SimulationResult { time: vec![0.0, 1.0], step: 1.0, columns: vec![column], notes: vec![] };
        let reply = Reply { record: Some(Head::of(&record)), ..Reply::default() };
        let mut bytes = reply.encode(&order.nonce, numbers(&record)).unwrap();
        assert_eq!(classify(&bytes, &order.nonce), Received::Partial);
        send_numbers(&record, &mut bytes).unwrap();
        assert_eq!(classify(&bytes, &order.nonce), Received::Complete);
        let (reply, rest) = Reply::decode(&bytes).unwrap();
        assert_eq!(reply.record.unwrap().record(rest).unwrap(), record);
        bytes.push(0);
        assert_eq!(classify(&bytes, &order.nonce), Received::Forged);
        assert_eq!(classify(b"{}", &order.nonce), Received::Forged);
    }
}
