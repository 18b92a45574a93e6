//! The report of an inspection: what was found on a record, and the record with the stretches marked.

use super::chart::{Axis, Chart, Colour, Mark, Series};
use super::format::{self, Medium};
use super::{Block, Cell, Figure, Report, Section, Summary, Table, Tone};
use crate::examine::{Examination, Finding, Severity};
use crate::identify::result::Series as Curve;
use crate::trace::{AxisKind, Signal, Trace};

/// Most stretches of one finding that are marked in a plot, and most rows of the table of pieces.
const MARKS: usize = 12;

/// An inspection as the report needs it.
#[derive(Debug, Clone, Copy)]
pub struct Inspected<'a> {
    /// What was found.
    pub examination: &'a Examination,
    /// The record.
    pub trace: &'a Trace,
    /// The file.
    pub file: &'a str,
    /// Rotary or linear.
    pub motion: AxisKind,
    /// The warnings of reading the file.
    pub warnings: &'a [String],
}

/// The result in one sentence.
#[must_use]
pub fn verdict(examination: &Examination) -> Summary {
    let count = |s: Severity| examination.findings.iter().filter(|f| f.severity == s).count();
    let (refused, warned) = (count(Severity::Refuse), count(Severity::Warn));
    let (tone, sentence) = match (refused, warned) {
        (0, 0) => (Tone::Good, "Nothing speaks against the record.".to_owned()),
        (0, 1) => (Tone::Finding, "The record can be used; one thing should be known of it.".to_owned()),
        (0, n) => (Tone::Finding, format!("The record can be used; {n} things should be known of it.")),
        (1, _) => (Tone::Unsure, "The record is not to be believed as it is, for one reason.".to_owned()),
        (n, _) => (Tone::Unsure, format!("The record is not to be believed as it is, for {n} reasons.")),
    };
    let detail = examination.band.map_or_else(String::new, |[low, high]| {
        let [low, high] = [low, high].map(|f| format::number(f, 3, Medium::Page));
        if low == high {
            return format!("The motion follows the torque at {low} Hz.");
        }
        format!("The motion follows the torque from {low} to {high} Hz.")
    });
    Summary { tone, sentence, detail, figures: Vec::new() }
}

/// The findings as blocks, the gravest first.
#[must_use]
pub fn findings(examination: &Examination) -> Vec<Block> {
    let mut table = Table::new("What was found", ["", "finding", "signal", "samples", "when"]);
    for f in &examination.findings {
        table.row(vec![
            Cell::text(f.severity.word()),
            Cell::text(f.id),
            Cell::text(f.signal),
            if f.samples == 0 { Cell::text("all") } else { Cell::Count(f.samples as u64) },
            Cell::text(when(f)),
        ]);
    }
    let mut blocks: Vec<Block> =
        examination
            .findings
            .iter()
            .map(|f| {
                if f.severity == Severity::Note { Block::Paragraph(f.sentence()) } else { Block::Warning(f.sentence()) }
            })
            .collect();
    if !examination.findings.is_empty() {
        blocks.push(Block::Table(table));
    }
    blocks
}

fn when(f: &Finding) -> String {
    let [Some(first), Some(last)] = [f.seconds.first(), f.seconds.last()] else { return String::new() };
    let s = |v: f64| format::number(v, 6, Medium::Page);
    match f.stretches.len() {
        1 if first[0] == first[1] => format!("{} s", s(first[0])),
        1 => format!("{} s to {} s", s(first[0]), s(first[1])),
        n => format!("{n} stretches from {} s to {} s", s(first[0]), s(last[1])),
    }
}

/// The pieces that can be used.
fn pieces(seen: &Inspected<'_>) -> Option<Block> {
    let usable = &seen.examination.usable;
    let n = seen.trace.len();
    if usable.len() == 1 && usable[0] == (0..n) {
        return None;
    }
    let mut table = Table::new("Pieces that can be used", ["from", "to", "samples", "share of the record"]);
    for r in usable.iter().take(MARKS) {
        table.row(vec![
            Cell::Number(seen.trace.time(r.start), 6, "s".to_owned()),
            Cell::Number(seen.trace.time(r.end.max(1) - 1), 6, "s".to_owned()),
            Cell::Count(r.len() as u64),
            Cell::Percent(r.len() as f64 / n.max(1) as f64),
        ]);
    }
    Some(Block::Table(table))
}

/// The short form for the terminal.
#[must_use]
pub fn short(seen: &Inspected<'_>) -> Vec<Block> {
    let mut blocks = vec![Block::Summary(verdict(seen.examination))];
    blocks.extend(seen.warnings.iter().cloned().map(Block::Warning));
    blocks.extend(findings(seen.examination));
    blocks.extend(pieces(seen));
    blocks
}

/// The whole report, with the record drawn and the stretches marked.
#[must_use]
pub fn report(seen: &Inspected<'_>) -> Report {
    let mut figures = Vec::new();
    for signal in Signal::ALL {
        let Some(values) = seen.trace.get(signal) else { continue };
        let unit = signal.unit(seen.motion);
        let curve = Curve::over_time(signal.name(), unit, seen.trace.start, seen.trace.dt, values);
        let mut chart = Chart::new(signal.name(), Axis::linear("time", "s"), Axis::linear(signal.name(), unit))
            .with(Series::line("", curve.x, curve.y).in_colour(Colour::Ink));
        let mut captions = Vec::new();
        for f in &seen.examination.findings {
            let about = f.signal.split(", ").any(|s| s == signal.name())
                || f.signal == "time"
                || f.id == "drive_off"
                || f.id == "standing";
            if !about {
                continue;
            }
            for (k, [from, to]) in f.seconds.iter().take(MARKS).enumerate() {
                let label = if k == 0 { f.id.to_owned() } else { String::new() };
                chart.marks.push(if from == to { Mark::X(*from, label) } else { Mark::Span(*from, *to, label) });
            }
            captions.push(f.seen.clone());
        }
        figures.push(Figure::new(chart, captions.join(" ")));
    }
    let mut top = vec![Block::Summary(verdict(seen.examination))];
    top.extend(seen.warnings.iter().cloned().map(Block::Warning));
    top.extend(findings(seen.examination));
    top.extend(pieces(seen));
    let sections =
        vec![Section::new("", top), Section::new("The record", figures.into_iter().map(Block::figure).collect())];
    Report {
        title: "Inspection of a record".to_owned(),
        subject: format!(
            "{}: {} samples, {} s to {} s",
            seen.file,
            format::count(seen.trace.len() as u64),
            format::number(seen.trace.start, 6, Medium::Page),
            format::number(seen.trace.time(seen.trace.len().max(1) - 1), 6, Medium::Page)
        ),
        sections,
        footer: format!("eixo {}", env!("CARGO_PKG_VERSION")),
    }
}
