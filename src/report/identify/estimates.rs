//! Estimates with their errors: of one method, and of all side by side.

use super::{has_estimates, has_reference};
use crate::identify::result::{Estimate, Identification, MethodResult};
use crate::report::{Block, Cell, Table};

/// The estimate with its standard error, in words where it is none.
pub fn value(e: &Estimate, unit: &str) -> Cell {
    if !e.is_determined() {
        return Cell::text("not determined");
    }
    match e.std {
        Some(std) => Cell::Estimate(e.value, std, unit.to_owned()),
        None => Cell::Number(e.value, 5, unit.to_owned()),
    }
}

/// How far the estimate is from its reference: nothing where it is none.
fn error(e: &Estimate) -> Cell {
    e.error_percent.filter(|_| e.is_determined()).map_or(Cell::Empty, |p| Cell::Percent(p / 100.0))
}

/// Parameters and modal parameters of one method.
pub fn estimates(m: &MethodResult) -> Table {
    let all: Vec<&Estimate> = m.parameters.iter().chain(&m.modal).collect();
    let reference = all.iter().any(|e| e.reference.is_some());
    let mut columns = vec!["parameter", "estimate", "standard error"];
    if reference {
        columns.extend(["reference", "error"]);
    }
    let mut table = Table::new(format!("Estimates of {} ({})", m.title, m.formulation), columns);
    for e in all {
        let mut cells = vec![
            Cell::text(e.name),
            value(e, e.unit),
            e.std
                .filter(|_| e.is_determined() && e.value != 0.0)
                .map_or(Cell::Empty, |s| Cell::Percent((s / e.value).abs())),
        ];
        if reference {
            cells.push(e.reference.map_or(Cell::Empty, |r| Cell::Number(r, 5, e.unit.to_owned())));
            cells.push(error(e));
        }
        table.row(cells);
    }
    table
}

/// Names of all that was estimated, in the order of first appearance.
pub fn names(found: &Identification) -> Vec<(&'static str, &'static str)> {
    let mut out: Vec<(&str, &str)> = Vec::new();
    for e in
        found.methods.iter().flat_map(|m| m.parameters.iter()).chain(found.methods.iter().flat_map(|m| m.modal.iter()))
    {
        if !out.iter().any(|(n, _)| *n == e.name) {
            out.push((e.name, e.unit));
        }
    }
    out
}

/// One row a parameter, one column a method; `cell` of the method's estimate.
fn matrix(found: &Identification, caption: &str, units: bool, cell: impl Fn(&Estimate) -> Cell) -> Table {
    let methods: Vec<&MethodResult> = found.methods.iter().filter(|m| m.failure.is_none()).collect();
    let mut table = Table::new(caption, std::iter::once("parameter").chain(methods.iter().map(|m| m.method)));
    for (name, unit) in names(found) {
        let label = if units && !unit.is_empty() && unit != "1" { format!("{name} [{unit}]") } else { name.to_owned() };
        let mut cells = vec![Cell::Text(label)];
        cells.extend(
            methods
                .iter()
                .map(|m| m.parameters.iter().chain(&m.modal).find(|e| e.name == name).map_or(Cell::Empty, &cell)),
        );
        table.row(cells);
    }
    table
}

pub fn compare(found: &Identification) -> Table {
    matrix(found, "Estimates by method", true, |e| value(e, ""))
}

pub fn errors(found: &Identification) -> Table {
    matrix(found, "Error against the reference", false, error)
}

pub fn side_by_side(found: &Identification) -> Vec<Block> {
    let mut blocks = Vec::new();
    if has_estimates(found) {
        blocks.push(Block::Table(compare(found)));
    }
    if has_reference(found) {
        blocks.push(Block::Table(errors(found)));
    }
    let mut table = Table::new("What each method is", ["method", "in words", "regression or model", "remarks"]);
    for m in &found.methods {
        let mut remarks = m.notes.clone();
        if let Some(failure) = &m.failure {
            remarks.insert(0, format!("no estimate: {failure}"));
        }
        if let Some(n) = m.iterations {
            remarks.push(if n == 1 { "1 iteration".to_owned() } else { format!("{n} iterations") });
        }
        table.row(vec![
            Cell::text(m.method),
            Cell::text(&*m.title),
            Cell::text(&*m.formulation),
            Cell::text(remarks.join("; ")),
        ]);
    }
    blocks.push(Block::Table(table));
    blocks
}
