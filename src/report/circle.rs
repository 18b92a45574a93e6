//! The report of a circular test: the polar plot, its figures, and what they mean.

use std::sync::Arc;

use super::chart::{Axis, Chart, Colour, Dash, Series};
use super::format::{self, Medium};
use super::polar::{PolarPlot, PolarTrace};
use super::{Block, Cell, Figure, Report, Section, Table, Tone, Verdict};
use crate::circle::roundness::{Roundness, deviations};
use crate::circle::{CircleTest, Feedback, Path, Servo};

/// What a circular test found.
#[derive(Debug, Clone, PartialEq)]
pub struct Findings {
    /// The machine's name.
    pub machine: String,
    /// The circle.
    pub test: CircleTest,
    /// The drives of X and Y.
    pub servos: [Servo; 2],
    /// Runs to be compared: name, path and figures; the last is what the verdict speaks of.
    pub runs: Vec<(String, Path, Roundness)>,
    /// What acts on the axes in the last run.
    pub effects: Vec<String>,
}

/// The whole report.
#[must_use]
pub fn report(f: &Findings) -> Report {
    let radius = f.test.radius;
    let mut polar = PolarPlot { title: "Radial deviation, magnified".into(), unit: "m".into(), ..PolarPlot::default() };
    let mut unrolled =
        Chart::new("Radial deviation over the angle", Axis::linear("angle", "°"), Axis::linear("deviation", "m"));
    for (k, (name, path, _)) in f.runs.iter().enumerate() {
        let (angle, deviation) = deviations(path, radius);
        let colour = if k + 1 == f.runs.len() { Colour::Vermillion } else { Colour::Blue };
        let dash = if k + 1 == f.runs.len() { Dash::Solid } else { Dash::Dashed };
        let mut order: Vec<(f64, f64)> =
            angle.iter().zip(&deviation).map(|(a, d)| (a.to_degrees().rem_euclid(360.0), *d)).collect();
        order.sort_by(|a, b| a.0.total_cmp(&b.0));
        let (degrees, sorted): (Vec<f64>, Vec<f64>) = order.into_iter().unzip();
        unrolled.series.push(Series::line(&**name, degrees, sorted).in_colour(colour).with_dash(dash));
        let (angle, deviation): (Arc<[f64]>, Arc<[f64]>) = (angle.into(), deviation.into());
        polar.traces.push(PolarTrace { name: name.clone(), angle, deviation, colour: Some(colour), dash });
    }
    let direction = if f.test.clockwise { "clockwise" } else { "counter-clockwise" };
    Report {
        title: format!("Circular test of {}", f.machine),
        subject: format!(
            "radius {} mm, feed {} m/min, {direction}, in simulation",
            format::number(1e3 * radius, 4, Medium::Page),
            format::number(60.0 * f.test.feed, 4, Medium::Page)
        ),
        sections: vec![
            Section::new(
                "",
                vec![
                    Block::Verdict(verdict(f)),
                    Block::Figures(vec![
                        Figure::new(polar, "The grey circle is the programmed one."),
                        Figure::new(unrolled, ""),
                    ]),
                ],
            ),
            Section::new("Figures", vec![Block::Table(table(f)), Block::Paragraph(READING.to_owned())]),
            Section::new("The drives", vec![Block::Table(drives(f))]),
        ],
        footer: format!("eixo {}", env!("CARGO_PKG_VERSION")),
    }
}

const READING: &str = "A peak at a reversal is friction that the drive has not yet overcome; a step that stays is lost motion; an ellipse \
     along the axes is a scale, an ellipse at 45 degrees a difference of the loops (it turns with the direction) or axes that are not \
     square (it does not).";

/// The short form for the terminal.
#[must_use]
pub fn short(f: &Findings) -> Vec<Block> {
    vec![Block::Verdict(verdict(f)), Block::Table(table(f))]
}

/// Micrometres; a nanometre is below what such a test shows.
fn micro(metres: f64) -> Cell {
    Cell::Number(if metres.abs() < 1e-9 { 0.0 } else { 1e6 * metres }, 3, "µm".to_owned())
}

fn verdict(f: &Findings) -> Verdict {
    let text = |m: f64| format::cell(&micro(m), Medium::Page);
    let Some((_, _, last)) = f.runs.last() else {
        return Verdict { tone: Tone::Unsure, sentence: "No path.".into(), detail: String::new(), figures: Vec::new() };
    };
    let sentence = match f.runs.first() {
        Some((name, _, first)) if f.runs.len() > 1 => format!(
            "The circular deviation is {}; for the {name} it is {}.",
            text(last.deviation),
            text(first.deviation)
        ),
        _ => format!("The circular deviation is {}.", text(last.deviation)),
    };
    let detail = if f.effects.is_empty() {
        "No effect acts on the axes: what is left comes from the loops and the coupling.".to_owned()
    } else {
        format!("Effects on the axes: {}.", f.effects.join(", "))
    };
    Verdict { tone: Tone::Neutral, sentence, detail, figures: Vec::new() }
}

type Figures = fn(&Roundness) -> f64;
type Gain = fn(&Servo) -> f64;

fn table(f: &Findings) -> Table {
    let mut table =
        Table::new("Circular test", std::iter::once("figure").chain(f.runs.iter().map(|(name, ..)| name.as_str())));
    let rows: [(&str, Figures); 14] = [
        ("circular deviation G", |r| r.deviation),
        ("largest radial deviation", |r| r.largest),
        ("smallest radial deviation", |r| r.smallest),
        ("mean radial deviation", |r| r.mean),
        ("peak at +X", |r| r.reversals[0]),
        ("peak at +Y", |r| r.reversals[1]),
        ("peak at −X", |r| r.reversals[2]),
        ("peak at −Y", |r| r.reversals[3]),
        ("step at +X", |r| r.steps[0]),
        ("step at +Y", |r| r.steps[1]),
        ("step at −X", |r| r.steps[2]),
        ("step at −Y", |r| r.steps[3]),
        ("ellipse along the axes", |r| r.ellipse_axes),
        ("ellipse at 45 degrees", |r| r.ellipse_diagonal),
    ];
    for (name, value) in rows {
        table.row(std::iter::once(Cell::text(name)).chain(f.runs.iter().map(|(_, _, r)| micro(value(r)))).collect());
    }
    table
}

fn drives(f: &Findings) -> Table {
    let mut table = Table::new("Loops of the drives", ["gain", "X", "Y"]);
    let rows: [(&str, Gain, &str); 6] = [
        ("position gain kp", |s| s.gains.kp, "1/s"),
        ("velocity gain kv", |s| s.gains.kv, "N.m.s/rad"),
        ("integral gain ki", |s| s.gains.ki, "N.m/rad"),
        ("velocity fed forward", |s| s.gains.velocity_forward, ""),
        ("acceleration fed forward", |s| s.gains.acceleration_forward, ""),
        ("torque limit", |s| s.gains.limit, "N.m"),
    ];
    for (name, value, unit) in rows {
        table.row(
            std::iter::once(Cell::text(name)).chain(f.servos.iter().map(|s| Cell::quantity(value(s), unit))).collect(),
        );
    }
    let feedback = |s: &Servo| match s.feedback {
        Feedback::Motor => Cell::text("motor encoder"),
        Feedback::Table => Cell::text("table scale"),
    };
    table.row(std::iter::once(Cell::text("position from")).chain(f.servos.iter().map(feedback)).collect());
    table
}
