//! A diagnosis in the closed loop of the drive: the command that each model needs, compared with the measured one.

use std::sync::Arc;

use super::naming::{improved, title};
use super::sentences;
use crate::control::LoopErrors;
use crate::diagnose::{Diagnosis, Verdict};
use crate::report::chart::{Axis, Chart, Colour, Dash, Series};
use crate::report::{Block, Cell, Figure, Table};
use crate::trace::{AxisKind, Signal};

/// Hypotheses in the table.
const MOST: usize = 6;

/// A table of models in the loop, each with its name; a strong row where it is the one diagnosed.
#[must_use]
pub fn errors<'a>(models: impl IntoIterator<Item = (&'a str, LoopErrors, bool)>) -> Table {
    let title = "In the drive's loop, driven by the reference alone: error, rms over rms of the signal";
    let mut table = Table::new(title, ["model", "command", "position"]);
    for (name, e, strong) in models {
        let cells = vec![Cell::text(name), Cell::Percent(e.command), Cell::Percent(e.position)];
        if strong { table.strong_row(cells) } else { table.row(cells) }
    }
    table
}

/// The table and the sentence; nothing where the loop was not simulated.
pub(super) fn short(d: &Diagnosis) -> Vec<Block> {
    let Some(l) = &d.closed_loop else { return Vec::new() };
    let after = match d.verdict {
        Verdict::Effect | Verdict::Unexplained => Some((improved(d), l.after, d.verdict == Verdict::Effect)),
        Verdict::Parameters | Verdict::NoGap => None,
    };
    let models = [("as given", l.before, false), ("parameters re-identified", l.reidentified, false)];
    vec![Block::Table(errors(models.into_iter().chain(after))), Block::Paragraph(sentences::in_the_loop(l))]
}

/// The same with the commands over time, and every hypothesis.
pub(super) fn blocks(d: &Diagnosis, motion: AxisKind) -> Vec<Block> {
    let mut blocks = short(d);
    let Some(l) = &d.closed_loop else { return blocks };
    let unit = Signal::Command.unit(motion);
    let after = improved(d);
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
        table.row(vec![Cell::text(title(&r.hypothesis)), Cell::Percent(r.errors.command), Cell::Percent(r.closure)]);
    }
    blocks.push(Block::Table(table));
    blocks
}
