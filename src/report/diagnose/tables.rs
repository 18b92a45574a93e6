//! The tables of a diagnosis.

use super::naming::{improved, title, way};
use super::sentences;
use crate::diagnose::{AxisParameter, Diagnosis, Estimate, Hypothesis, Levels, Verdict};
use crate::report::{Cell, Table};

fn estimate(e: &Estimate, unit: &str) -> Cell {
    Cell::Estimate(e.value, e.std.unwrap_or(f64::NAN), unit.to_owned())
}

/// The causes with their parameters.
pub fn causes(d: &Diagnosis) -> Table {
    let caption = match d.verdict {
        Verdict::Unexplained => "What comes nearest, and does not explain the gap",
        Verdict::Effect | Verdict::Parameters | Verdict::NoGap => "What the model leaves out",
    };
    let mut table = Table::new(caption, ["cause", "place", "share of the gap", "parameter", "value"]);
    for c in &d.causes {
        let name = title(&Hypothesis::Effects(vec![c.effect]));
        let mut head = vec![Cell::text(name), Cell::text(c.site.as_str()), Cell::Bar(c.share_of_gap)];
        for (name, e) in c.named() {
            head.push(Cell::text(format!("{}.{name}", c.effect.info().id)));
            head.push(estimate(e, e.unit));
            table.row(std::mem::replace(&mut head, vec![Cell::Empty; 3]));
        }
        if c.parameters.is_empty() {
            head.extend([Cell::Empty, Cell::Empty]);
            table.row(head);
        }
    }
    if let Some(open) = d.undecided.as_ref().filter(|_| d.verdict == Verdict::Effect) {
        let name = Cell::text(format!("Not told: {}", sentences::names_of(open)));
        table.row(vec![name, Cell::Empty, Cell::Bar(open.share_of_gap), Cell::Empty, Cell::Empty]);
    }
    table
}

/// A model in the table of errors: its name, its level, whether it is the verdict's.
type Line = (&'static str, fn(&Levels) -> f64, bool);

/// The models that the table lists.
fn lines(d: &Diagnosis) -> Vec<Line> {
    let mut lines: Vec<Line> =
        vec![("as given", |l| l.before, false), ("parameters re-identified", |l| l.reidentified, false)];
    match d.verdict {
        Verdict::Effect | Verdict::Unexplained => lines.push((improved(d), |l| l.after, d.verdict == Verdict::Effect)),
        Verdict::Parameters | Verdict::NoGap => {}
    }
    lines.push(("noise floor", |l| l.noise_floor, false));
    lines
}

/// The errors of the models on both records: on the held-out one by every way of measuring them.
pub fn levels(d: &Diagnosis) -> Table {
    let gap = &d.gap;
    let heads = ["model".to_owned(), format!("fitted trace, {}", way(gap.closure_of))]
        .into_iter()
        .chain(gap.ways.iter().map(|w| format!("held out, {}", way(w.of))));
    let mut table = Table::new("Error of the model, rms over rms of signal or torque", heads);
    for (name, of, strong) in lines(d) {
        let held = gap.ways.iter().map(|w| Cell::Percent(of(&w.levels)));
        let cells = [Cell::text(name), Cell::Percent(of(&gap.train.combined))].into_iter().chain(held).collect();
        if strong { table.strong_row(cells) } else { table.row(cells) }
    }
    if matches!(d.verdict, Verdict::Effect | Verdict::Parameters | Verdict::Unexplained) {
        let closed = gap.ways.iter().map(|w| Cell::Percent(w.closure));
        table.row([Cell::text("gap closed"), Cell::Empty].into_iter().chain(closed).collect());
    }
    table
}

/// The axis' own parameters.
pub fn parameters(all: &[AxisParameter]) -> Table {
    let mut table = Table::new("Parameters of the axis", ["parameter", "as given", "re-identified", "now", "change"]);
    for p in all {
        table.row(vec![
            Cell::text(p.parameter.name()),
            Cell::quantity(p.nominal, p.fitted.unit),
            Cell::quantity(p.reidentified, p.fitted.unit),
            estimate(&p.fitted, p.fitted.unit),
            Cell::Percent(p.fitted.value / p.nominal - 1.0),
        ]);
    }
    table
}

/// The hypotheses tried, so many at most.
pub fn ranking(d: &Diagnosis, most: usize) -> Table {
    let mut table = Table::new(
        "Causes tried, the best first (weight: how the evidence divides among these)",
        ["cause", "place", "model weight", "delta BIC", "chi2 a sample", "gap closed, held out"],
    );
    for (i, h) in d.ranking.iter().take(most).enumerate() {
        let cells = vec![
            Cell::text(title(&h.hypothesis)),
            Cell::text(super::json::site(h.site)),
            Cell::Bar(h.probability),
            Cell::Number(h.delta_bic, 3, String::new()),
            Cell::Number(h.chi2, 3, String::new()),
            Cell::Percent(h.closure_holdout),
        ];
        if i == 0 && d.verdict != Verdict::Unexplained { table.strong_row(cells) } else { table.row(cells) }
    }
    table
}
