//! What the drive's loop says of a diagnosis: the command that each model asks for, beside the measured one.

use std::sync::Arc;

use super::chart::{Axis, Chart, Colour, Dash, Series};
use super::diagnose::{Findings, improved, percent, title};
use super::{Block, Cell, Figure, Table};
use crate::diagnose::{LoopErrors, Verdict as Answer};
use crate::trace::Signal;

/// Hypotheses in the table.
const MOST: usize = 6;

/// The table and the sentence; nothing where the loop was not simulated.
pub(super) fn short(f: &Findings) -> Vec<Block> {
    let Some(l) = &f.diagnosis.closed_loop else { return Vec::new() };
    let mut table = Table::new(LoopErrors::TITLE, ["model", "command", "position"]);
    let cells =
        |name: &str, e: &LoopErrors| vec![Cell::text(name), Cell::Percent(e.command), Cell::Percent(e.position)];
    table.row(cells("as given", &l.before));
    table.row(cells("parameters re-identified", &l.reidentified));
    let after = cells(improved(f.diagnosis), &l.after);
    match f.diagnosis.verdict {
        Answer::Effect => table.strong_row(after),
        Answer::Unexplained => table.row(after),
        Answer::Parameters | Answer::NoGap => {}
    }
    let others = l.ranking.iter().find(|r| r.closure < l.closure && !r.id.is_empty() && r.errors != l.after);
    let sentence = match (l.agrees, l.ranking.first()) {
        (false, Some(best)) => format!(
            "The loop does not agree: {} closes {} of the command's gap, this {}.",
            title(&best.id),
            percent(best.closure),
            percent(l.closure)
        ),
        _ => format!(
            "The loop agrees: this closes {} of the command's gap, and nothing that was tried closes more{}.",
            percent(l.closure),
            others.map_or_else(String::new, |o| format!("; next comes {} with {}", title(&o.id), percent(o.closure)))
        ),
    };
    vec![Block::Table(table), Block::Paragraph(sentence)]
}

/// The same with the commands over time, and every hypothesis.
pub(super) fn blocks(f: &Findings) -> Vec<Block> {
    let mut blocks = short(f);
    let Some(l) = &f.diagnosis.closed_loop else { return blocks };
    let unit = Signal::Command.unit(f.motion);
    let after = improved(f.diagnosis);
    let time: Arc<[f64]> = l.commands.time.as_slice().into();
    let line = |name: &str, values: &[f64]| Series::line(name, time.clone(), values);
    let measured = line("measured", &l.commands.measured).in_colour(Colour::Ink).with_dash(Dash::Broad);
    let chart = |name: &str, model: Series| {
        Chart::new(name, Axis::linear("time", "s"), Axis::linear("command", unit)).with(measured.clone()).with(model)
    };
    let given = line("model as given", &l.commands.before).in_colour(Colour::Vermillion);
    let found = line(after, &l.commands.after).in_colour(Colour::Blue);
    blocks.push(Block::Figures(vec![
        Figure::new(chart("The drive's command: model as given", given), ""),
        Figure::new(chart(&format!("The drive's command: {after}"), found), ""),
    ]));
    let mut table =
        Table::new("Every cause in the loop", ["cause", "error of the command", "gap of the command closed"]);
    for r in l.ranking.iter().take(MOST) {
        table.row(vec![Cell::text(title(&r.id)), Cell::Percent(r.errors.command), Cell::Percent(r.closure)]);
    }
    blocks.push(Block::Table(table));
    blocks
}
