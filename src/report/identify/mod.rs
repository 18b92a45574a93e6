//! The report of an identification: estimates with their errors, how well they fit, how they were reached.

mod estimates;
mod excitation;
mod fit;
mod frequency;
mod history;
mod verdict;

use super::chart::{Dash, Series};
use super::format::{self, Medium};
use super::{Block, Report, Section};
use crate::identify::joined::Joined;
use crate::identify::result::{Identification, MethodResult, Series as Curve};
pub(super) use estimates::{compare, errors};
use estimates::{estimates, side_by_side};
use excitation::excitation;
pub(super) use excitation::excitation_errors;
use fit::{fit, fits, measured_and_simulated};
use frequency::{frequency_response, resonances};
pub(super) use history::histories;
use verdict::verdict;

/// Dashes of series that may lie on one another.
const DASHES: [Dash; 3] = [Dash::Solid, Dash::Dashed, Dash::Dotted];

/// The whole report; with the record it opens with what was measured and what the estimates make of it.
#[must_use]
pub fn report(found: &Identification, record: Option<&Joined>) -> Report {
    let mut top = vec![Block::Summary(verdict(found))];
    top.extend(found.warnings.iter().cloned().map(Block::Warning));
    top.extend(measured_and_simulated(found, record));
    if let Some(best) = recommended(found) {
        top.push(Block::Table(estimates(best)));
    }
    let mut sections = vec![Section::new("", top)];
    if is_compared(found) {
        sections.push(Section::new("How well the model follows the machine", fit(found)));
    }
    if let Some(frf) = &found.frequency_response {
        sections.push(Section::new("Frequency response", frequency_response(frf)));
    }
    if found.methods.len() > 1 {
        sections.push(Section::new("The methods side by side", side_by_side(found)));
    }
    if found.methods.iter().any(|m| m.history.is_some()) {
        sections.push(Section::new("How the estimates were reached", histories(found)));
    }
    sections.push(Section::new("The excitation, and what the model makes of it", excitation(found)));
    Report {
        title: format!("Identification of {}", found.machine),
        subject: subject(found),
        sections,
        footer: format!("eixo {}", env!("CARGO_PKG_VERSION")),
    }
}

/// The short form for the terminal.
#[must_use]
pub fn short(found: &Identification) -> Vec<Block> {
    let mut blocks = vec![Block::Summary(verdict(found))];
    blocks.extend(found.warnings.iter().cloned().map(Block::Warning));
    if let Some(best) = recommended(found) {
        blocks.push(Block::Table(estimates(best)));
    }
    if found.methods.len() > 1 && has_estimates(found) {
        blocks.push(Block::Table(compare(found)));
    }
    if has_reference(found) {
        blocks.push(Block::Table(errors(found)));
    }
    if is_compared(found) {
        blocks.push(Block::Table(fits(found)));
    }
    if let Some(frf) = &found.frequency_response {
        blocks.push(Block::Table(resonances(frf)));
    }
    blocks
}

/// Whether a simulation was compared with the record: not with a streamed one.
fn is_compared(found: &Identification) -> bool {
    found.methods.iter().any(|m| !m.outputs.is_empty())
}

fn subject(found: &Identification) -> String {
    let t = &found.trace;
    let rate = if t.dt > 0.0 { format::number(1.0 / t.dt, 4, Medium::Page) } else { "?".to_owned() };
    let mut out = format!(
        "{}: {} samples at {rate} Hz, {} s",
        t.file,
        format::count(t.samples as u64),
        format::number(t.duration, 4, Medium::Page)
    );
    if let Some(period) = t.period {
        out.push_str(&format!(", period {} samples", format::count(period as u64)));
    }
    out
}

/// The method to trust, else the first that has an estimate.
fn recommended(found: &Identification) -> Option<&MethodResult> {
    match &found.recommended {
        Some(r) => found.methods.get(r.method),
        None => found.methods.iter().find(|m| m.failure.is_none()),
    }
}

/// Whether any method has an estimate: refused ones are none.
fn has_estimates(found: &Identification) -> bool {
    found.methods.iter().any(|m| !m.parameters.is_empty())
}

fn has_reference(found: &Identification) -> bool {
    found.methods.iter().flat_map(|m| m.parameters.iter().chain(&m.modal)).any(|e| e.reference.is_some())
}

fn line(name: &str, curve: &Curve) -> Series {
    Series::line(name, curve.x.as_slice(), curve.y.as_slice())
}
