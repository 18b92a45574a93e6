//! `eixo init`: from a foreign log to the axis.toml that reads it.

mod args;
mod asker;
mod axis_file;
mod columns;
mod estimates;

use std::path::Path;
use std::process::ExitCode;

use anyhow::Context;

pub use args::Args;
use asker::Asker;
use axis_file::{Read, write};
use columns::{Made, make};
use estimates::{lead, rough};

use super::outputs;
use super::stdout::{WIDTH, layout, out, out_line};
use crate::examine::{Input, examine};
use crate::report::driven::Driven;
use crate::report::examine::{Inspected, findings, report, verdict};
use crate::report::{Block, Cell, Table as Shown, html, terminal};
use crate::trace::guess::{Role, SURE};
use crate::trace::{Machine, Signal, Table, from_table, write_text};

/// Runs the command.
///
/// # Errors
/// When the log cannot be read, holds no torque and position, or the axis file cannot be written.
pub fn run(args: Args) -> anyhow::Result<ExitCode> {
    let folder = args.log.parent().unwrap_or(Path::new(""));
    let axis = args.output.clone().unwrap_or_else(|| folder.join("axis.toml"));
    let page = args.report.clone().unwrap_or_else(|| axis.with_extension("html"));
    outputs::check([args.log.as_path()], [], [Some(&axis), Some(&page)])?;
    for path in [&axis, &page] {
        anyhow::ensure!(
            args.force || !path.is_file(),
            "{}: it is there already; give another name (-o, --report) or say --force to write over it",
            path.display()
        );
    }
    let table = Table::read(&args.log)?;
    let file = args.log.display().to_string();
    let mut asker = Asker { yes: args.yes };
    let made = make(&table, &args, &mut asker)?;
    let text = write(&made, &table, &Read::default(), &file);
    let mut machine =
        Machine::parse(&text, &axis.display().to_string()).context("the axis file that was made does not read back")?;
    let mut loaded = from_table(&table, &args.part.of(machine.signals.clone()))?;
    let rho = lead(&loaded.trace);
    if let Some(rho) = rho {
        machine.parameters.rho = rho;
    }
    let shown = loaded.trace.clone();
    super::examined::table_as_angle(&mut loaded.trace, &machine)?;
    // A first idea of the parameters, from the log itself: it shows whether units and signs are right.
    let examination = examine(&Input::of(&loaded.trace, loaded.stamps.as_deref()).against(&machine, false));
    // Of a log that cannot be believed no number is written.
    let rough = if examination.refuses() { None } else { rough(&loaded.trace, &machine, &examination) };
    let text = write(
        &made,
        &table,
        &Read { rough, rho, runs_straight: examination.runs_straight, refused: examination.refuses() },
        &file,
    );
    let machine =
        Machine::parse(&text, &axis.display().to_string()).context("the axis file that was made does not read back")?;
    let seen = Inspected {
        examination: &examination,
        trace: &shown,
        file: &file,
        motion: machine.signals.motion,
        warnings: &loaded.warnings,
    };
    let driven = Driven { motion: machine.signals.motion, unit: loaded.drive.clone() };
    // The page is the larger: where there is no room for it, no axis file stands in the way of the next try.
    write_text(&page, html::page(&driven.report(report(&seen))).as_bytes())?;
    write_text(&axis, text.as_bytes())?;

    let mut blocks = vec![Block::Table(chosen(&made, &table)), Block::Summary(verdict(&examination))];
    if let (Some(dt), None) = (made.dt, args.dt) {
        let warning = format!(
            "No column is a time: {dt} s from row to row is assumed. All that is read from the log depends on it; give it with --dt."
        );
        blocks.push(Block::Warning(warning));
    }
    blocks.extend(loaded.warnings.iter().cloned().map(Block::Warning));
    blocks.extend(findings(&examination).into_iter().filter(|b| !matches!(b, Block::Table(_))));
    out!("{}", terminal::blocks(&driven.blocks(blocks), layout(WIDTH)))?;
    out_line!("\n{}: the axis file; look at [signals] and [parameters]", axis.display())?;
    out_line!("{}: the log, drawn", page.display())?;
    let what = format!("{} --axis {}", quoted(&file), quoted(&axis.display().to_string()));
    if examination.refuses() {
        out_line!(
            "first: mend what is told above, in the log or in [signals] of {}; until then no verdict is given",
            axis.display()
        )?;
    } else if !rough.is_some_and(|r| r.is_shown) {
        out_line!("first: put the inertia into [parameters], which the log does not tell")?;
    }
    out_line!("next: eixo identify {what}")?;
    out_line!("or:   eixo diagnose {what}")?;
    Ok(ExitCode::SUCCESS)
}

/// A name as a shell takes it.
fn quoted(name: &str) -> String {
    let plain = |c: char| c.is_alphanumeric() || "-_./,:+".contains(c);
    if name.chars().all(plain) && !name.is_empty() {
        name.to_owned()
    } else {
        format!("'{}'", name.replace('\'', "'\\''"))
    }
}

/// The table of what was made of the columns.
fn chosen(made: &Made, table: &Table) -> Shown {
    let mut shown = Shown::new("What the columns are taken for", ["signal", "column", "unit", ""]);
    let mut used = Vec::new();
    for g in &made.guesses {
        let name = match g.role {
            Role::Time => "time",
            Role::Signal(s) => s.name(),
        };
        used.push(g.column.as_str());
        let counts = g.role == Role::Signal(Signal::T) && made.counts();
        let unit = g.unit.map_or(if counts { "not given: counts" } else { "not given: SI" }, |u| u.symbol);
        let sure = if g.score >= SURE { "" } else { "please check" };
        shown.row(vec![Cell::text(name), Cell::text(g.column.as_str()), Cell::text(unit), Cell::text(sure)]);
    }
    for header in table.headers.iter().filter(|h| !used.contains(&h.name.as_str())) {
        shown.row(vec![Cell::text("not used"), Cell::text(header.name.as_str()), Cell::Empty, Cell::Empty]);
    }
    shown
}
