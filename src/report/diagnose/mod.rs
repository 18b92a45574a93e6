//! The report of a diagnosis: verdict, place, shrinkage, evidence, what to do; read in a minute from the top.
//!
//! Everything here is a pure function of the typed result: [`sentences`] its sentences, [`json`] the file for programs.

mod controlled;
pub mod json;
mod naming;
mod residual;
mod sentences;
mod tables;
mod verdict;

use super::chain::{ChainDiagram, Symbol};
use super::chart::{Axis, Chart, Mark, Series, Shape};
use super::format::{self, Medium};
use super::{Block, Figure, Report, Section, chain};
use crate::diagnose::{Diagnosis, Overlay, Site, Verdict};
use crate::effects::Place;
use crate::trace::AxisKind;
pub use controlled::errors as errors_in_the_loop;
use naming::improved;
pub use sentences::warnings;
use verdict::verdict;

/// A diagnosis with what is drawn of it.
#[derive(Debug, Clone, Copy)]
pub struct Findings<'a> {
    /// The diagnosis.
    pub diagnosis: &'a Diagnosis,
    /// Held-out signals with the models' runs.
    pub overlays: &'a [Overlay],
    /// What was diagnosed: file, samples, rate.
    pub trace: &'a str,
    /// Rotary or linear.
    pub motion: AxisKind,
    /// What is to be known of the record: from its reading, its examination and its noise.
    pub warnings: &'a [String],
}

/// The report.
#[must_use]
pub fn report(f: &Findings) -> Report {
    let d = f.diagnosis;
    let mut top = vec![Block::Summary(verdict(d))];
    top.push(Block::figure(Figure::new(chain(d), sentences::gap_shows(&d.location.shown, Some(f.motion)))));
    // Behind the picture: a log has several of them, and the verdict comes first.
    top.extend(f.warnings.iter().cloned().chain(sentences::warnings(d, Some(f.motion))).map(Block::Warning));
    let mut sections = vec![Section::new("", top)];
    if !d.causes.is_empty() {
        let heading = if d.verdict == Verdict::Unexplained { "What comes nearest" } else { "What it is" };
        sections.push(Section::new(heading, what(d)));
    }
    sections.push(Section::new("How far the gap shrinks", how_far(f)));
    let in_the_loop = controlled::blocks(d, f.motion);
    if !in_the_loop.is_empty() {
        sections.push(Section::new("In the drive's loop", in_the_loop));
    }
    sections.push(Section::new("Where the gap shows", residual::blocks(&d.location, f.motion)));
    sections.push(Section::new("Every cause that was tried", which(d)));
    sections.push(Section::new("What to do next", vec![Block::Steps(sentences::steps(d))]));
    Report {
        title: format!("Diagnosis of {}", d.machine),
        subject: f.trace.to_owned(),
        sections,
        footer: format!("eixo {}", env!("CARGO_PKG_VERSION")),
    }
}

/// The short form for the terminal: verdict, causes, levels, the head of the ranking, what to do next.
#[must_use]
pub fn short(f: &Findings) -> Vec<Block> {
    let d = f.diagnosis;
    let mut blocks = vec![Block::Summary(verdict(d))];
    blocks.extend(sentences::warnings(d, Some(f.motion)).into_iter().map(Block::Warning));
    blocks.push(Block::Paragraph(sentences::gap_shows(&d.location.shown, Some(f.motion))));
    if !d.causes.is_empty() {
        blocks.push(Block::Table(tables::causes(d)));
    }
    blocks.push(Block::Table(tables::levels(d)));
    blocks.extend(sentences::why_this_way(d).map(Block::Paragraph));
    blocks.extend(sentences::remainder(d, f.motion).map(Block::Paragraph));
    blocks.extend(controlled::short(d));
    blocks.push(Block::Table(tables::ranking(d, 5)));
    blocks.push(Block::Steps(sentences::steps(d)));
    blocks
}

/// A share in per cent.
fn percent(share: f64) -> String {
    format::percent(share, Medium::Page)
}

fn chain(d: &Diagnosis) -> ChainDiagram {
    let place = |&(site, share): &(Site, f64)| {
        let (symbol, parts) = match site {
            Site::At(Place::Input) => (Symbol::Input, "drive, command"),
            Site::At(Place::Motor) => (Symbol::Motor, "motor and screw"),
            Site::At(Place::Coupling) => (Symbol::Coupling, "K, B"),
            Site::At(Place::Table) => (Symbol::Table, "table, guideways"),
            Site::At(Place::Sensor) => (Symbol::Sensor, "encoders"),
            Site::Axis => (Symbol::Axis, "all that moves"),
        };
        let found: Vec<&str> = d.causes.iter().filter(|c| c.site == site).map(|c| c.effect.info().id).collect();
        chain::Place {
            name: site.as_str().to_owned(),
            symbol,
            note: if found.is_empty() { parts.to_owned() } else { found.join(", ") },
            share: Some(share),
            marked: !found.is_empty() || (d.causes.is_empty() && d.location.site == Some(site)),
        }
    };
    ChainDiagram { title: String::new(), places: d.location.shares.iter().map(place).collect() }
}

fn what(d: &Diagnosis) -> Vec<Block> {
    let mut blocks = vec![Block::Table(tables::causes(d))];
    blocks.extend(
        d.causes
            .iter()
            .map(|c| c.effect.info())
            .map(|i| Block::Paragraph(format!("{}. In the model: {}. {}", i.title, i.equation, i.family.meaning()))),
    );
    blocks.extend(d.confusable.iter().map(|c| Block::Warning(sentences::not_distinguished(c))));
    blocks
}

fn how_far(f: &Findings) -> Vec<Block> {
    let d = f.diagnosis;
    let mut blocks = vec![Block::Table(tables::levels(d))];
    blocks.extend(sentences::why_this_way(d).map(Block::Paragraph));
    blocks.extend(sentences::remainder(d, f.motion).map(Block::Paragraph));
    blocks.extend(sentences::beyond_parameters(d).map(Block::Paragraph));
    for o in f.overlays {
        blocks.extend(residual::overlay(o, d.gap.closure_of, improved(d), f.motion));
    }
    if !d.parameters.is_empty() {
        blocks.push(Block::Table(tables::parameters(&d.parameters)));
    }
    blocks
}

fn which(d: &Diagnosis) -> Vec<Block> {
    let mut chart = Chart::new(
        "Noise-scaled error of each cause",
        Axis::linear("place in the ranking", "").by(&[1.0]),
        Axis::log("chi2 a sample", ""),
    );
    let chi2: Vec<f64> = d.ranking.iter().map(|h| h.chi2).collect();
    let order: Vec<f64> = (1..=chi2.len()).map(|k| k as f64).collect();
    chart.series.push(Series::new("", Shape::Stem, order, chi2));
    chart.marks.push(Mark::Y(1.0, "noise".into()));
    vec![
        Block::Paragraph(
            "Each cause was fitted together with the parameters of the axis. BIC weighs the error against the number of parameters: a \
             distance of 10 is strong evidence. A chi2 of 1 a sample is the noise itself: nothing is left to explain."
                .to_owned(),
        ),
        Block::Table(tables::ranking(d, usize::MAX)),
        Block::figure(Figure::new(chart, "The nearer to the noise, the more of the gap the cause explains.")),
    ]
}
