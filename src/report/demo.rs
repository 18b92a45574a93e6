//! The report of the demonstration: a machine that disagrees with its model, what that does to a circle, and, folded, the
//! paper's experiment through the FMU with its figures and tables.

use super::format::capital;
use super::identify;
use super::{Block, Cell, Report, Section, Summary, Table, Tone};
use crate::identify::joined::Joined;
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

/// The pages of the demonstration, by file and what each shows.
const PAGES: [(&str, &str); 3] = [
    (
        "report.html",
        "the demonstration: where the gap lies, what causes it, what it does to a circle; the paper's experiment",
    ),
    ("diagnosis.html", "the whole diagnosis: evidence, every cause that was tried, what to do next"),
    ("circle.html", "the whole circular test: what each effect takes, the trace over the angle, the drives"),
];

/// A page with links to the others.
#[must_use]
pub fn linked(mut page: Report, own: &str) -> Report {
    let mut table = Table::new("Pages of this demonstration", ["page", "what it shows"]);
    for (file, what) in PAGES.into_iter().filter(|(file, _)| *file != own) {
        table.row(vec![Cell::Link(file.to_owned(), file.to_owned()), Cell::text(what)]);
    }
    page.sections.push(Section::new("The other pages", vec![Block::Table(table)]));
    page
}

/// What the demonstration's machine is, and what it is diagnosed with.
pub const PLAYED: &str = "an FMU plays a machine with play in its nut, with friction, and with a torque that nothing accounts for; its log, \
                          with noise, is diagnosed with a model that knows of none of them.";

/// Sections of the diagnosis on where the gap lies, what causes it and how far it shrinks.
const DIAGNOSIS: usize = 3;

/// The whole report, from the reports of the diagnosis and of the circle.
#[must_use]
pub fn report(f: &Findings, diagnosis: &Report, circle: &Report) -> Report {
    let mut sections: Vec<Section> = diagnosis.sections.iter().take(DIAGNOSIS).cloned().collect();
    if let Some(first) = sections.first_mut() {
        first.blocks.insert(0, Block::Paragraph(capital(PLAYED)));
    }
    if let Some(first) = circle.sections.first() {
        sections.push(Section::new("What it does to a circle", first.blocks.clone()));
    }
    let mut paper = paper(f);
    let mut folded = Vec::new();
    for (k, section) in paper.sections.drain(..).enumerate() {
        if k == 0 {
            folded.extend(section.blocks);
        } else {
            folded.push(Block::Details(section.heading, section.blocks));
        }
    }
    sections.push(Section::new("The paper's experiment, from FMU to parameters", folded));
    let page = Report {
        title: "A machine that disagrees with its model".to_owned(),
        subject: "where, what, how far, and what a part would show of it; then the paper's own experiment".to_owned(),
        sections,
        footer: paper.footer,
    };
    linked(page, "report.html")
}

/// The paper's experiment.
fn paper(f: &Findings) -> Report {
    let mut report = identify::report(&f.consistent, Some(&Joined::one(&f.record)));
    report.title = "The XY table's axis, from FMU to parameters".to_owned();
    let mut sections = vec![Section::new("", vec![Block::Summary(verdict(f)), Block::KeyValues(experiment(f))])];
    // The identification's own head becomes a section like the others.
    for (k, mut section) in report.sections.into_iter().enumerate() {
        if k == 0 {
            section.heading = "What was identified".to_owned();
            section.blocks.retain(|b| !matches!(b, Block::Summary(_)));
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
        Block::Summary(verdict(f)),
        Block::KeyValues(experiment(f)),
        Block::Table(identify::compare(&f.consistent)),
        Block::Table(identify::errors(&f.consistent)),
        Block::Table(euler),
        Block::Table(identify::excitation_errors(&f.consistent)),
    ]
}

/// The paper's tables and the text about them.
#[must_use]
pub fn tables(tables: &PaperTables) -> Vec<Block> {
    let mut blocks: Vec<Block> = tables.words.iter().cloned().map(Block::Paragraph).collect();
    for t in &tables.tables {
        let mut table = Table::new(format!("Table {}. {}", t.number, t.title), t.columns.clone());
        for row in &t.rows {
            table.row(row.iter().zip(&t.columns).map(|(text, column)| paper_cell(text, column)).collect());
        }
        blocks.push(Block::Table(table));
        blocks.push(Block::Paragraph(t.verdict.clone()));
    }
    blocks
}

/// A cell of the paper's tables: its figures with the digits that they have, so that all numbers of a page are written alike.
fn paper_cell(text: &str, column: &str) -> Cell {
    match text.parse::<f64>() {
        // The unit of a number without one.
        Ok(_) if column == "unit" => Cell::Empty,
        Ok(value) => {
            let mantissa = text.split(['e', 'E']).next().unwrap_or(text);
            let digits = mantissa.trim_start_matches(['+', '-', '0', '.']).chars().filter(char::is_ascii_digit).count();
            Cell::Number(value, digits.max(1), String::new())
        }
        Err(_) => Cell::text(text),
    }
}

/// Largest error of the four parameters, as a share.
fn worst(m: &MethodResult) -> Option<f64> {
    m.parameters.iter().filter_map(|e| e.error_percent).map(|e| e.abs() / 100.0).reduce(f64::max)
}

fn verdict(f: &Findings) -> Summary {
    let of = |found: &Identification| -> Vec<(String, Cell)> {
        let errors = found.methods.iter().filter_map(|m| Some((m.method.to_uppercase(), Cell::Percent(worst(m)?))));
        errors.collect()
    };
    let largest = f.consistent.methods.iter().filter_map(worst).reduce(f64::max);
    let sentence = match largest {
        Some(e) if e < 1e-6 => "Every method finds the parameters of the FMU again from its trace.",
        Some(_) => "The parameters of the FMU are found again from its trace, some methods less exactly.",
        None => "No method found the parameters of the FMU again.",
    };
    Summary {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::format::{Medium, cell};

    #[test]
    fn figures_of_the_paper_keep_their_digits_and_are_written_as_all_others() {
        let written = |text: &str| cell(&paper_cell(text, "paper"), Medium::Page);
        let cases = [
            ("2.0480e3", "2048.0"),
            ("5.88e+1", "58.8"),
            ("1.14e-14", "1.14×10⁻¹⁴"),
            ("2.3700e-4", "2.3700×10⁻⁴"),
            ("0.00e0", "0"),
            ("-0.042", "−0.042"),
            ("+0.368", "0.368"),
            ("I2 = Mm*rho*psi", "I2 = Mm*rho*psi"),
        ];
        for (text, expected) in cases {
            assert_eq!(written(text), expected);
        }
        assert_eq!(paper_cell("1", "unit"), Cell::Empty);
        assert_eq!(cell(&paper_cell("kg.m2", "unit"), Medium::Page), "kg·m²");
    }
}
