//! The index of a run: what was found, machine by machine and trace by trace.

use std::collections::BTreeMap;

use serde_json::Value;

use super::trend::{Moved, Trend};
use super::{Placed, Plan, store};
use crate::report::{Axis, Block, Cell, Chart, Colour, Figure, Report, Section, Series, Summary, Table, Tone};

/// Most plots of drifts, those that stand out first.
const PLOTS: usize = 24;
/// Most parameters with a column of their own: with more the tables are cut on paper and run out of the screen.
const COLUMNS: usize = 4;

/// Shown for a drift that is within the errors of the estimates.
const WITHIN: &str = "within its error";

/// The report of a run.
pub(super) fn report(plan: &Plan, rows: &[Placed]) -> Report {
    let trends = Trend::all(rows);
    let mut sections = vec![Section::new("", vec![Block::Summary(verdict(rows, &trends))])];
    sections.push(Section::new("Machines", vec![Block::Table(machines(plan, rows, &trends, true))]));
    if !trends.is_empty() {
        sections.push(Section::new("Drift of the parameters", drifts(&trends)));
    }
    let mut of_traces = vec![Block::Table(traces(plan, rows, &trends))];
    if trends.iter().any(|t| !names(&trends).contains(&t.parameter.name.as_str())) {
        let rest = "The other parameters did not drift, or had no room here: each with its change since the first is in the summary.";
        of_traces.push(Block::Paragraph(rest.to_owned()));
    }
    sections.push(Section::new("Traces", of_traces));
    if let Some(table) = failures(rows) {
        sections.push(Section::new("What could not be used", vec![Block::Table(table)]));
    }
    let machines = rows.chunk_by(|a, b| a.machine == b.machine).count();
    Report {
        title: format!("{} of {}", title(plan.command), counted(rows.len(), "trace")),
        subject: counted(machines, "machine"),
        sections,
        footer: format!("eixo {} {}", env!("CARGO_PKG_VERSION"), plan.command),
    }
}

/// What the terminal shows: the verdict, the machines, what could not be used.
pub(super) fn short(plan: &Plan, rows: &[Placed]) -> Vec<Block> {
    let trends = Trend::all(rows);
    let mut blocks = vec![Block::Summary(verdict(rows, &trends)), Block::Table(machines(plan, rows, &trends, false))];
    blocks.extend(failures(rows).map(Block::Table));
    blocks
}

fn failures(rows: &[Placed]) -> Option<Table> {
    let mut table = Table::new("Traces that could not be used", ["machine", "trace", "why"]);
    for p in rows.iter().filter(|p| !p.row.done) {
        // The message begins with the file, which stands beside it.
        let why = p.row.message.strip_prefix(&format!("{}: ", p.row.trace)).unwrap_or(&p.row.message);
        table.row(vec![Cell::text(&*p.machine), Cell::text(&*p.row.trace), Cell::text(why)]);
    }
    (!table.rows.is_empty()).then_some(table)
}

/// A date that is not broken at its hyphens.
fn date(p: &Placed) -> Cell {
    p.when.as_ref().map_or(Cell::Empty, |w| Cell::text(w.text.replace('T', " ").replace('-', "\u{2011}")))
}

fn title(command: &str) -> &'static str {
    if command == "diagnose" { "Diagnosis" } else { "Identification" }
}

fn counted(n: usize, what: &str) -> String {
    if n == 1 { format!("1 {what}") } else { format!("{n} {what}s") }
}

/// The first fact of a row: its verdict.
fn verdict_of<'a>(p: &'a Placed) -> &'a str {
    p.row.facts.first().and_then(Value::as_str).unwrap_or(if p.row.done { "" } else { "failed" })
}

fn verdict(rows: &[Placed], trends: &[Trend]) -> Summary {
    let mut counts: BTreeMap<&str, u64> = BTreeMap::new();
    for p in rows {
        *counts.entry(verdict_of(p)).or_default() += 1;
    }
    let failed = rows.iter().filter(|p| !p.row.done).count();
    let out: Vec<String> = trends
        .iter()
        .filter(|t| t.is_significant())
        .map(|t| format!("{} of {}", t.parameter.name, t.machine))
        .collect();
    let (tone, sentence) = match (failed, out.len()) {
        (0, 0) => (Tone::Neutral, "Every trace was used.".to_owned()),
        (0, n) => (Tone::Finding, format!("Every trace was used; {}.", drifting(n))),
        (f, 0) => (Tone::Unsure, format!("{} could not be used.", counted(f, "trace"))),
        (f, n) => (Tone::Finding, format!("{} could not be used; {}.", counted(f, "trace"), drifting(n))),
    };
    let detail = if out.is_empty() {
        String::new()
    } else {
        let more = if out.len() > 6 { format!(" and {} more", out.len() - 6) } else { String::new() };
        format!("Beyond four standard errors: {}{more}.", out[..out.len().min(6)].join(", "))
    };
    let figures = counts.into_iter().map(|(name, n)| (verdict_text(name).to_owned(), Cell::Count(n))).collect();
    Summary { tone, sentence, detail, figures }
}

fn drifting(n: usize) -> String {
    if n == 1 { "1 parameter drifts".to_owned() } else { format!("{n} parameters drift") }
}

/// The name of a verdict, for people.
fn verdict_text(verdict: &str) -> &str {
    match verdict {
        "no_gap" => "no gap",
        "effect" => "an effect",
        "explained" => "explained down to the noise",
        "not_explained" => "not fully explained",
        "not_compared" => "not compared with a simulation",
        other => other,
    }
}

/// A fact as a cell: shares in per cent.
fn cell(name: &str, value: Option<&Value>) -> Cell {
    let share = |name: &str| {
        name.starts_with("closure")
            || name.starts_with("error_")
            || matches!(name, "probability" | "noise_floor" | "fit")
    };
    match value {
        Some(Value::String(text)) => Cell::text(verdict_text(text)),
        Some(v) => v.as_f64().map_or(Cell::Empty, |v| if share(name) { Cell::Percent(v) } else { Cell::number(v) }),
        None => Cell::Empty,
    }
}

/// The facts that fit on a page; the others are in the summary.
fn shown<'a>(plan: &'a Plan) -> impl Iterator<Item = (usize, &'static str)> + 'a {
    let on_page = |name: &str| matches!(name, "verdict" | "place" | "cause" | "closure" | "method" | "white" | "fit");
    plan.facts.iter().copied().enumerate().filter(move |(_, name)| on_page(name))
}

/// The names of the parameters that have a column, in the order of their first appearance: all, or where they are many those that
/// drift.
fn names<'a>(trends: &'a [Trend]) -> Vec<&'a str> {
    let named = |of: &mut dyn Iterator<Item = &'a Trend<'a>>| {
        let mut names: Vec<&str> = Vec::new();
        for t in of {
            if !names.contains(&t.parameter.name.as_str()) {
                names.push(&t.parameter.name);
            }
        }
        names
    };
    let all = named(&mut trends.iter());
    if all.len() <= COLUMNS {
        return all;
    }
    let mut drifting = named(&mut trends.iter().filter(|t| t.is_significant()));
    drifting.truncate(COLUMNS);
    drifting
}

/// One row a machine; the drift of each parameter where there is room for it.
fn machines(plan: &Plan, rows: &[Placed], trends: &[Trend], wide: bool) -> Table {
    let names = if wide { names(trends) } else { Vec::new() };
    let mut head = vec!["machine".to_owned(), "traces".to_owned(), "last used".to_owned()];
    head.extend(shown(plan).map(|(_, name)| name.to_owned()));
    head.extend(names.iter().map(|n| format!("drift of {n}")));
    let caption = if wide {
        "What its last usable trace shows, and the drift over all of them where it is more than two standard errors"
    } else {
        "What the last usable trace of each machine shows"
    };
    let mut table = Table::new(caption, head);
    let by_name: BTreeMap<(&str, &str), &Trend> =
        trends.iter().map(|t| ((t.machine, t.parameter.name.as_str()), t)).collect();
    for of in rows.chunk_by(|a, b| a.machine == b.machine) {
        let Some(first) = of.first() else { continue };
        let last = of.iter().rfind(|p| p.row.done);
        let mut cells = vec![
            last.map_or_else(|| Cell::text(&*first.machine), |p| link(p, first.machine.clone())),
            Cell::Count(of.len() as u64),
            last.map_or(Cell::Empty, date),
        ];
        cells.extend(shown(plan).map(|(k, name)| cell(name, last.and_then(|p| p.row.facts.get(k)))));
        let own = |name: &&str| by_name.get(&(first.machine.as_str(), *name)).copied();
        cells.extend(names.iter().map(|name| {
            own(name).and_then(Trend::moved).map_or(Cell::Empty, |moved| match moved {
                Moved::By(drift) => Cell::Percent(drift),
                Moved::WithinItsError => Cell::text(WITHIN),
            })
        }));
        if trends.iter().any(|t| t.machine == first.machine && t.is_significant()) {
            table.strong_row(cells);
        } else {
            table.row(cells);
        }
    }
    table
}

/// The drift over the period in per cent, with its standard error.
fn drift(trend: &Trend) -> Cell {
    match trend.drift() {
        Some((drift, std)) if std > 0.0 => Cell::Estimate(100.0 * drift, 100.0 * std, "%".to_owned()),
        Some((drift, _)) => Cell::Percent(drift),
        None => Cell::Empty,
    }
}

fn link(p: &Placed, text: String) -> Cell {
    if p.row.done { Cell::Link(text, format!("reports/{}", store::report(p.item))) } else { Cell::Text(text) }
}

fn traces(plan: &Plan, rows: &[Placed], trends: &[Trend]) -> Table {
    let names = names(trends);
    let mut head = vec!["machine".to_owned(), "trace".to_owned(), "when".to_owned()];
    head.extend(shown(plan).map(|(_, name)| name.to_owned()));
    head.extend(names.iter().map(|n| format!("{n} since the first")));
    let mut table = Table::new("One row a trace, each with its report", head);
    let of: BTreeMap<(&str, &str), &Trend> =
        trends.iter().map(|t| ((t.machine, t.parameter.name.as_str()), t)).collect();
    for p in rows {
        let file = p.item.path.file_name().map_or_else(|| p.row.trace.clone(), |n| n.to_string_lossy().into_owned());
        let mut cells = vec![Cell::text(&*p.machine), link(p, file), date(p)];
        for (k, name) in shown(plan) {
            let value = p.row.facts.get(k);
            cells.push(if k == 0 && !p.row.done { Cell::text("could not be used") } else { cell(name, value) });
        }
        for name in &names {
            let own = p.row.parameters.iter().find(|t| t.name == *name);
            let change = own.zip(of.get(&(p.machine.as_str(), name))).and_then(|(own, trend)| trend.since_first(own));
            cells.push(change.map_or(Cell::Empty, Cell::Percent));
        }
        table.row(cells);
    }
    table
}

fn drifts(trends: &[Trend]) -> Vec<Block> {
    let mut table = Table::new(
        "First and last estimate, and the rise of the line through all of them, relative to their mean",
        ["machine", "parameter", "records", "drift over the period", "first", "last"],
    );
    for t in trends {
        let estimate = |v: Option<&(f64, Option<f64>)>| match v {
            Some((value, Some(std))) if *std > 0.0 => Cell::Estimate(*value, *std, t.parameter.unit.clone()),
            Some((value, _)) => Cell::quantity(*value, t.parameter.unit.clone()),
            None => Cell::Empty,
        };
        let cells = vec![
            Cell::text(t.machine),
            Cell::text(&*t.parameter.name),
            Cell::Count(t.at.len() as u64),
            if t.drift().is_some() { drift(t) } else { t.change().map_or(Cell::Empty, Cell::Percent) },
            estimate(t.values.first()),
            estimate(t.values.last()),
        ];
        if t.is_significant() { table.strong_row(cells) } else { table.row(cells) }
    }
    let mut order: Vec<&Trend> = trends.iter().filter(|t| t.at.len() > 2).collect();
    order.sort_by_key(|t| !t.is_significant());
    let left_out = order.len().saturating_sub(PLOTS);
    let figures: Vec<Figure> = order.into_iter().take(PLOTS).map(|t| Figure::new(plot(t), "")).collect();
    let mut blocks = vec![Block::Table(table)];
    if !figures.is_empty() {
        blocks.push(Block::Figures(figures));
    }
    if left_out > 0 {
        blocks.push(Block::Paragraph(format!("{left_out} more parameters are in the table above and in the summary.")));
    }
    blocks
}

fn plot(t: &Trend) -> Chart {
    let values: Vec<f64> = t.values.iter().map(|(v, _)| *v).collect();
    let x = if t.days { Axis::linear("time since the first record", "d") } else { Axis::linear("record", "") };
    let mut chart = Chart::new(
        format!("{} of {}", t.parameter.name, t.machine),
        x,
        Axis::linear(&*t.parameter.name, &*t.parameter.unit),
    );
    if t.values.iter().all(|(_, std)| std.is_some()) {
        let edge =
            |sign: f64| -> Vec<f64> { t.values.iter().map(|(v, s)| v + sign * 2.0 * s.unwrap_or_default()).collect() };
        chart = chart
            .with(Series::band("two standard errors", t.at.as_slice(), edge(-1.0), edge(1.0)).in_colour(Colour::Blue));
    }
    chart
        .with(Series::line("", t.at.as_slice(), values.as_slice()).in_colour(Colour::Blue))
        .with(Series::points("estimate", t.at.as_slice(), values.as_slice()).in_colour(Colour::Ink))
}
