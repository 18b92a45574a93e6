//! The report of the demonstration: the paper's experiment through the FMU, its figures and its tables.

use super::identify;
use super::{Block, Cell, Report, Section, Table, Tone, Verdict};
use crate::identify::result::{Identification, MethodResult};
use crate::identify::tables::PaperTables;
use crate::trace::Trace;

/// What the demonstration found.
#[derive(Debug, Clone)]
pub struct Findings {
    /// The record.
    pub record: Trace,
    /// Identified by regressions that are consistent with the simulation.
    pub consistent: Identification,
    /// Identified by the paper's Euler regression.
    pub euler: Identification,
    /// The paper's tables, computed again.
    pub tables: PaperTables,
    /// Crest factor of the excitation.
    pub crest_factor: f64,
    /// Its lines.
    pub lines: usize,
}

/// The whole report.
#[must_use]
pub fn report(f: &Findings) -> Report {
    let mut report = identify::report(&f.consistent, Some(&f.record));
    report.title = "The XY table's axis, from FMU to parameters".to_owned();
    let mut sections = vec![Section::new("", vec![Block::Verdict(verdict(f)), Block::KeyValues(experiment(f))])];
    // The identification's own head becomes a section like the others.
    for (k, mut section) in report.sections.into_iter().enumerate() {
        if k == 0 {
            section.heading = "What was identified".to_owned();
            section.blocks.retain(|b| !matches!(b, Block::Verdict(_)));
        }
        sections.push(section);
    }
    let mut euler = vec![Block::Paragraph(
        "The paper regresses Euler's difference (eq. 6) on data of the trapezoidal rule. The two do not fit together: the \
         estimates are biased whatever the estimator, as below. The tables and plots above use the regression that fits."
            .to_owned(),
    )];
    euler.push(Block::Table(identify::errors(&f.euler)));
    euler.extend(identify::histories(&f.euler));
    sections.push(Section::new("The same trace by the paper's Euler regression", euler));
    sections.push(Section::new("The paper's tables, computed again", tables(&f.tables)));
    report.sections = sections;
    report
}

/// The short form for the terminal.
#[must_use]
pub fn short(f: &Findings) -> Vec<Block> {
    let mut euler = identify::errors(&f.euler);
    euler.caption = "Error against the reference, by the paper's Euler regression".to_owned();
    vec![
        Block::Verdict(verdict(f)),
        Block::KeyValues(experiment(f)),
        Block::Table(identify::compare(&f.consistent)),
        Block::Table(identify::errors(&f.consistent)),
        Block::Table(euler),
        Block::Table(identify::excitation_errors(&f.consistent)),
    ]
}

/// The paper's tables with what is said of them.
#[must_use]
pub fn tables(tables: &PaperTables) -> Vec<Block> {
    let mut blocks: Vec<Block> = tables.words.iter().cloned().map(Block::Paragraph).collect();
    for t in &tables.tables {
        let mut table = Table::new(format!("Table {}. {}", t.number, t.title), t.columns.clone());
        for row in &t.rows {
            table.row(row.iter().map(|c| Cell::text(&**c)).collect());
        }
        blocks.push(Block::Table(table));
        blocks.push(Block::Paragraph(t.verdict.clone()));
    }
    blocks
}

/// Largest error of the four parameters, as a share.
fn worst(m: &MethodResult) -> Option<f64> {
    m.parameters.iter().filter_map(|e| e.error_percent).map(|e| e.abs() / 100.0).reduce(f64::max)
}

fn verdict(f: &Findings) -> Verdict {
    let of = |found: &Identification| -> Vec<(String, Cell)> {
        let judged = found.methods.iter().filter_map(|m| Some((m.method.to_uppercase(), Cell::Percent(worst(m)?))));
        judged.collect()
    };
    let largest = f.consistent.methods.iter().filter_map(worst).reduce(f64::max);
    let sentence = match largest {
        Some(e) if e < 1e-6 => "Every method finds the parameters of the FMU again from its trace.",
        Some(_) => "The parameters of the FMU are found again from its trace, some methods less exactly.",
        None => "No method found the parameters of the FMU again.",
    };
    Verdict {
        tone: if largest.is_some_and(|e| e < 1e-6) { Tone::Good } else { Tone::Unsure },
        sentence: sentence.to_owned(),
        detail: "The axis was exported as an FMU, driven by a Schroeder signal through the FMI, and identified from what it \
                 answered. Largest error of I1, I2, B and K:"
            .to_owned(),
        figures: of(&f.consistent),
    }
}

fn experiment(f: &Findings) -> Vec<(String, Cell)> {
    let t = &f.consistent.trace;
    vec![
        ("samples".to_owned(), Cell::Count(t.samples as u64)),
        ("sampling interval".to_owned(), Cell::quantity(t.dt, "s")),
        ("record".to_owned(), Cell::quantity(t.duration, "s")),
        ("lines of the excitation".to_owned(), Cell::Count(f.lines as u64)),
        ("crest factor".to_owned(), Cell::number(f.crest_factor)),
    ]
}
