//! The page of a validation: its result, the findings by section of the standard, what was not tested, and the run
//! compared with reference results.

use std::sync::Arc;

use super::chart::{Axis, Chart, Colour, Dash, Series};
use super::{Block, Cell, Figure, Report, Section, Summary, Table, Tone};
use crate::fmu::reference::Comparison;
use crate::fmu::rules::{Outcome, Report as Validation, Rule, RuleStatus, Severity};

/// Findings of one rule that are listed; the rest are counted.
const MOST: usize = 200;

/// The report of a validation; `strict`, warnings count as errors.
#[must_use]
pub fn report(v: &Validation, comparison: Option<&Comparison>, strict: bool) -> Report {
    let mut sections = vec![Section::new("", vec![verdict(v, comparison, strict)])];
    if !v.remarks.is_empty() {
        sections.push(Section::new("", v.remarks.iter().cloned().map(Block::Warning).collect()));
    }
    sections.extend(comparison.map(against_reference));
    sections.push(findings(v));
    sections.push(by_section(v));
    sections.extend(untested(v));
    Report {
        title: "Validation".to_owned(),
        subject: v.model.as_ref().map_or_else(|| v.file.clone(), |model| format!("{model}, {}", v.file)),
        sections,
        footer: format!("eixo {}, rules of {}", env!("CARGO_PKG_VERSION"), v.fmi.standard()),
    }
}

fn count(v: &Validation, wanted: fn(&RuleStatus) -> bool) -> u64 {
    v.rules.iter().filter(|(_, verdict)| wanted(verdict)).count() as u64
}

fn verdict(v: &Validation, comparison: Option<&Comparison>, strict: bool) -> Block {
    let off = comparison.is_some_and(|c| !c.passes());
    let (tone, sentence) = match v.outcome(strict) {
        Outcome::Fails => (Tone::Finding, "The FMU fails."),
        _ if off => (Tone::Finding, "The FMU keeps the rules, but not to its reference results."),
        Outcome::NotTested => (Tone::Unsure, "The FMU was not tested beyond its archive and XML."),
        Outcome::Passes if v.static_only => (Tone::Good, "The FMU passes the rules on its archive and XML."),
        Outcome::Passes => (Tone::Good, "The FMU passes."),
    };
    let detail = match (v.static_only, strict) {
        (true, _) => "Nothing of it was run, as asked.",
        (false, true) => "Warnings count as errors.",
        (false, false) => "",
    };
    let number = |severity| Cell::Count(v.count(severity) as u64);
    Block::Summary(Summary {
        tone,
        sentence: sentence.to_owned(),
        detail: detail.to_owned(),
        figures: vec![
            ("errors".to_owned(), number(Severity::Error)),
            ("warnings".to_owned(), number(Severity::Warning)),
            ("notes".to_owned(), number(Severity::Note)),
            ("rules passed".to_owned(), Cell::Count(count(v, |r| *r == RuleStatus::Passed))),
            ("not tested".to_owned(), Cell::Count(count(v, |r| matches!(r, RuleStatus::NotTested(_))))),
        ],
    })
}

/// What was seen and what to do, the worst first.
fn findings(v: &Validation) -> Section {
    let mut blocks = Vec::new();
    for severity in [Severity::Error, Severity::Warning, Severity::Note] {
        for (rule, _) in v.rules.iter().filter(|(rule, _)| rule.severity == severity) {
            let found: Vec<_> = v.findings.iter().filter(|f| f.rule == rule.id).collect();
            let Some(first) = found.first() else { continue };
            let (title, standard, section) = (rule.title(v.fmi), v.fmi.standard(), of(v, rule));
            let caption = format!("{severity}: {title} ({}, {standard}, section {section}, {})", rule.id, rule.kind);
            let mut table = Table::new(caption, ["what was seen", "where"]);
            for finding in found.iter().take(MOST) {
                let place = finding.place.as_ref().map(|place| match place.position {
                    Some(position) => format!("{}:{position}", place.file),
                    None => place.file.clone(),
                });
                table.row(vec![
                    Cell::text(&finding.message),
                    place.or(finding.call.clone()).map_or(Cell::Empty, Cell::Text),
                ]);
            }
            if found.len() > MOST {
                table.row(vec![Cell::text(format!("and {} more", found.len() - MOST)), Cell::Empty]);
            }
            blocks.push(Block::Table(table));
            blocks.push(Block::Paragraph(format!(
                "To do: {}",
                first.advice.clone().unwrap_or_else(|| rule.advice(v.fmi))
            )));
        }
    }
    if blocks.is_empty() {
        blocks.push(Block::Paragraph("Nothing was found.".to_owned()));
    }
    Section::new("Findings", blocks)
}

/// The section of a rule in the standard that was tested.
fn of(v: &Validation, rule: &Rule) -> &'static str {
    rule.section(v.fmi).unwrap_or("-")
}

/// The status of a rule as the report names it, with its reason.
fn status_texts(rule: &Rule, status: &RuleStatus) -> (String, String) {
    match status {
        RuleStatus::Passed => ("passed".into(), String::new()),
        RuleStatus::Failed => (rule.severity.to_string(), String::new()),
        RuleStatus::NotTested(why) => ("not tested".into(), why.clone()),
        RuleStatus::NotApplicable(why) => ("not applicable".into(), why.clone()),
        RuleStatus::Skipped => ("left out".into(), String::new()),
    }
}

fn by_section(v: &Validation) -> Section {
    let mut names: Vec<&str> = v.rules.iter().map(|(rule, _)| of(v, rule)).collect();
    let key = |section: &str| section.split('.').map(|n| n.parse::<u32>().unwrap_or(0)).collect::<Vec<u32>>();
    names.sort_by_key(|section| key(section));
    names.dedup();
    let blocks = names.into_iter().map(|section| {
        let rules: Vec<_> = v.rules.iter().filter(|(rule, _)| of(v, rule) == section).collect();
        let found = rules.iter().filter(|(_, status)| *status == RuleStatus::Failed).count();
        let shown: Vec<_> = rules.iter().map(|(rule, status)| (rule, status_texts(rule, status))).collect();
        let explained = shown.iter().any(|(_, (_, why))| !why.is_empty());
        let mut columns = vec!["rule", "what holds when it passes", "verdict"];
        columns.extend(explained.then_some("why"));
        let mut table = Table::new("", columns);
        for (rule, (name, why)) in shown {
            let mut cells = vec![Cell::text(rule.id), Cell::text(rule.title(v.fmi)), Cell::text(name)];
            cells.extend(explained.then(|| Cell::text(why)));
            table.row(cells);
        }
        let of_all = if rules.len() == 1 { "1 rule".to_owned() } else { format!("{} rules", rules.len()) };
        let failed = if found == 0 { "no findings".to_owned() } else { format!("{found} with findings") };
        let label = format!("Section {section}: {of_all}, {failed}");
        Block::Details(label, vec![Block::Table(table)])
    });
    Section::new(format!("Rules by section of {}", v.fmi.standard()), blocks.collect())
}

fn untested(v: &Validation) -> Option<Section> {
    let mut reasons: Vec<(&str, Vec<&str>)> = Vec::new();
    for (rule, status) in &v.rules {
        if let RuleStatus::NotTested(why) = status {
            match reasons.iter_mut().find(|(reason, _)| reason == why) {
                Some((_, rules)) => rules.push(rule.id),
                None => reasons.push((why, vec![rule.id])),
            }
        }
    }
    let mut table = Table::new("Not tested is not passed", ["why", "rules"]);
    for (why, rules) in &reasons {
        table.row(vec![Cell::text(*why), Cell::text(rules.join(", "))]);
    }
    (!reasons.is_empty()).then(|| Section::new("Not tested", vec![Block::Table(table)]))
}

fn against_reference(c: &Comparison) -> Section {
    let mut table = Table::new(
        format!("{}: distance from a tube of {} % of the range", c.file, 100.0 * c.tolerance),
        ["variable", "verdict", "largest distance, of the range", "at [s]"],
    );
    let mut figures = Vec::new();
    let (reference_time, run_time): (Arc<[f64]>, Arc<[f64]>) =
        (c.reference_time.as_slice().into(), c.run_time.as_slice().into());
    for v in &c.variables {
        let verdict = if v.passes(c.tolerance) { "within" } else { "outside" };
        table.row(vec![Cell::text(&v.name), Cell::text(verdict), Cell::Percent(v.worst), Cell::number(v.at)]);
        let chart =
            Chart::new(&v.name, Axis::linear("time", "s"), Axis::linear(&v.name, v.unit.clone().unwrap_or_default()))
                .with(
                    Series::line("reference", reference_time.clone(), v.reference.as_slice())
                        .in_colour(Colour::Ink)
                        .with_dash(Dash::Broad),
                )
                .with(Series::line("this run", run_time.clone(), v.run.as_slice()).in_colour(Colour::Blue));
        figures.push(Figure::new(chart, ""));
    }
    let mut blocks = vec![Block::Table(table), Block::Figures(figures)];
    blocks.extend(c.notes.iter().cloned().map(Block::Paragraph));
    Section::new("Reference results", blocks)
}
