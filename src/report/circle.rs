//! The report of a circular test: the polar plots, their figures, and what they mean.

use std::sync::Arc;

use super::ballbar::{self, micro};
use super::chart::{Axis, Chart, Colour, DEGREES, Dash, Range, Series, When};
use super::format::{self, Medium, capital};
use super::polar::{PolarPlot, PolarTrace, Ring};
use super::{Block, Cell, Figure, Report, Section, Summary, Table, Tone};
use crate::circle::roundness::{Roundness, SHOWN, deviations};
use crate::circle::trace::Analysis;
use crate::circle::{CircleTest, Feedback, Path, Servo};
use crate::trace::AxisKind;

/// A pair of axes turned through the circle in both directions.
#[derive(Debug, Clone, PartialEq)]
pub struct Run {
    /// Name of the pair.
    pub name: String,
    /// The path in the direction of the test, and the other way round.
    pub paths: [Path; 2],
    /// Their figures.
    pub roundness: [Roundness; 2],
    /// Bi-directional circular deviation G(b), m.
    pub both: f64,
}

/// What a circular test found.
#[derive(Debug, Clone, PartialEq)]
pub struct Findings {
    /// The machine's name.
    pub machine: String,
    /// The circle.
    pub test: CircleTest,
    /// The drives of X and Y.
    pub servos: [Servo; 2],
    /// How X and Y move: the units of their gains.
    pub motion: [AxisKind; 2],
    /// Runs to be compared; the last is what the verdict speaks of.
    pub runs: Vec<Run>,
    /// The last run without one of what it has beyond the first, for each such thing.
    pub without: Vec<Run>,
    /// What the last run's trace shows.
    pub analysis: Option<Analysis>,
    /// What acts on the axes in the last run.
    pub effects: Vec<String>,
}

/// Colours of a run: in the direction of the test, and the other way round.
const NOMINAL: [Colour; 2] = [Colour::Blue, Colour::Sky];
const LAST: [Colour; 2] = [Colour::Vermillion, Colour::Purple];

impl Findings {
    fn directions(&self) -> [&'static str; 2] {
        if self.test.clockwise { ["clockwise", "counter-clockwise"] } else { ["counter-clockwise", "clockwise"] }
    }

    /// Largest deviation of any run, m: all plots have one scale.
    fn full_scale(&self) -> f64 {
        let all = self.runs.iter().chain(&self.without).flat_map(|r| &r.roundness);
        all.fold(0.0, |m: f64, r| m.max(r.largest.abs()).max(r.smallest.abs()))
    }

    fn polar(&self, run: &Run, colours: [Colour; 2], title: &str) -> PolarPlot {
        let radius = self.test.radius;
        let traces = run.paths.iter().zip(self.directions()).zip(colours).zip([Dash::Solid, Dash::Dashed]);
        let traces = traces.map(|(((path, name), colour), dash)| {
            let (angle, deviation) = deviations(path, radius);
            let (angle, deviation): (Arc<[f64]>, Arc<[f64]>) = (angle.into(), deviation.into());
            PolarTrace { name: name.to_owned(), angle, deviation, colour: Some(colour), dash }
        });
        let r = &run.roundness[0];
        PolarPlot {
            title: title.to_owned(),
            unit: "m".into(),
            traces: traces.collect(),
            full_scale: Some(self.full_scale()),
            radius: Some(radius),
            ring: Some(Ring { centre: r.centre, low: r.low - radius, high: r.high - radius, colour: colours[0] }),
        }
    }
}

/// The whole report.
#[must_use]
pub fn report(f: &Findings) -> Report {
    let radius = f.test.radius;
    let mut unrolled = Chart::new(
        "Radial deviation over the angle",
        Axis::linear("angle", "°").over(Range::Fixed(0.0, 360.0)).by(&DEGREES),
        Axis::linear("deviation", "m"),
    );
    for (k, run) in f.runs.iter().enumerate() {
        let (angle, deviation) = deviations(&run.paths[0], radius);
        let last = k + 1 == f.runs.len();
        let (colour, dash) = if last { (LAST[0], Dash::Solid) } else { (NOMINAL[0], Dash::Dashed) };
        let mut order: Vec<(f64, f64)> =
            angle.iter().zip(&deviation).map(|(a, d)| (a.to_degrees().rem_euclid(360.0), *d)).collect();
        order.sort_by(|a, b| a.0.total_cmp(&b.0));
        let (degrees, mut sorted): (Vec<f64>, Vec<f64>) = order.into_iter().unzip();
        if run.roundness[0].deviation < SHOWN {
            // What varies less is the rounding of the simulation.
            sorted.fill(run.roundness[0].mean);
        }
        let line = Series::line(&*run.name, degrees, sorted).in_colour(colour).with_dash(dash);
        unrolled.series.push(line.of_model(if last { When::After } else { When::Before }));
    }
    let polars = f.runs.iter().enumerate().map(|(k, run)| {
        let last = k + 1 == f.runs.len();
        let title = format!("{}: radial deviation, magnified", capital(&run.name));
        Figure::new(f.polar(run, if last { LAST } else { NOMINAL }, &title), caption(run))
    });
    let mut sections = vec![Section::new(
        "",
        vec![
            Block::Summary(verdict(f)),
            Block::Figures(polars.collect()),
            Block::figure(Figure::new(unrolled, format!("Turning {}.", f.directions()[0]))),
        ],
    )];
    if !f.without.is_empty() {
        let each = f.without.iter().map(|run| {
            Figure::new(
                f.polar(run, LAST, &format!("{} {}", capital(f.runs.last().map_or("", |r| &r.name)), run.name)),
                caption(run),
            )
        });
        sections.push(Section::new(
            "What each takes",
            vec![Block::Table(takes(f)), Block::Paragraph(LEFT_OUT.to_owned()), Block::Figures(each.collect())],
        ));
    }
    if let Some(a) = &f.analysis {
        sections.extend(ballbar::shown(a, None));
    }
    sections.push(Section::new("Figures", vec![Block::Table(table(f)), Block::Paragraph(READING.to_owned())]));
    sections.push(Section::new("The drives", vec![Block::Table(drives(f)), Block::Paragraph(STACKED.to_owned())]));
    Report {
        title: format!("Circular test of {}", f.machine),
        subject: format!(
            "radius {} mm, feed {} m/min, both directions, in simulation",
            format::number(1e3 * radius, 4, Medium::Page),
            format::number(60.0 * f.test.feed, 4, Medium::Page)
        ),
        sections,
        footer: format!("eixo {}", env!("CARGO_PKG_VERSION")),
    }
}

fn caption(run: &Run) -> String {
    format!(
        "Circular deviation G = {}: the width of the shaded ring. Grey: the programmed circle.",
        format::cell(&micro(run.roundness[0].deviation), Medium::Page)
    )
}

const READING: &str = "A peak at a reversal is friction that the drive has not yet overcome; a step that stays is lost motion; an ellipse \
     along the axes is a scale, an ellipse at 45 degrees a difference of the loops (it turns with the direction) or axes that are not \
     square (it does not).";

const LEFT_OUT: &str = "One cause is left out at a time, and all others stay: what acts only beside another (play needs the friction that holds the \
     table at one side of it) is told by what goes with it. The shares do not add up to one. The plots have one scale.";

const STACKED: &str = "Y is stacked on X: X carries the mass of Y, which X's I2 contains as it was identified in place, or with --carried.";

/// The short form for the terminal.
#[must_use]
pub fn short(f: &Findings) -> Vec<Block> {
    let mut blocks = vec![Block::Summary(verdict(f)), Block::Table(table(f))];
    if !f.without.is_empty() {
        blocks.push(Block::Table(takes(f)));
    }
    blocks.extend(f.analysis.as_ref().map(|a| Block::Table(ballbar::ranking(a, None, Medium::Terminal))));
    blocks
}

/// What the circularity loses without each of what the last run has beyond the first.
fn takes(f: &Findings) -> Table {
    let mut table = Table::new(
        "What each takes, left out of all",
        ["left out", "G(b) without it", "takes", "share of the circularity"],
    );
    let whole = f.runs.last().map_or(0.0, |r| r.both);
    let mut each: Vec<&Run> = f.without.iter().collect();
    each.sort_by(|a, b| a.both.total_cmp(&b.both));
    for run in each {
        let taken = whole - run.both;
        let share = if whole > 0.0 { Cell::Bar((taken / whole).max(0.0)) } else { Cell::Empty };
        let name = run.name.strip_prefix("without ").unwrap_or(&run.name);
        table.row(vec![Cell::text(name), micro(run.both), micro(taken), share]);
    }
    table
}

fn verdict(f: &Findings) -> Summary {
    let text = |m: f64| format::cell(&micro(m), Medium::Page);
    let Some(run) = f.runs.last() else {
        return Summary { tone: Tone::Unsure, sentence: "No path.".into(), detail: String::new(), figures: Vec::new() };
    };
    let last = &run.roundness[0];
    let sentence = match f.runs.first() {
        Some(first) if f.runs.len() > 1 => format!(
            "The circular deviation is {}; for the {} it is {}.",
            text(last.deviation),
            first.name,
            text(first.roundness[0].deviation)
        ),
        _ => format!("The circular deviation is {}.", text(last.deviation)),
    };
    let detail = if f.effects.is_empty() {
        "No effect acts on the axes: what is left comes from the loops and the coupling.".to_owned()
    } else {
        format!("Effects on the axes: {}.", f.effects.join(", "))
    };
    Summary { tone: Tone::Neutral, sentence, detail, figures: Vec::new() }
}

type Figures = fn(&Run) -> f64;
type Gain = fn(&Servo) -> f64;

fn table(f: &Findings) -> Table {
    let names = f.runs.iter().chain(&f.without).map(|run| run.name.as_str());
    let mut table = Table::new("Circular test", std::iter::once("figure").chain(names));
    let rows: [(&str, Figures); 16] = [
        ("circular deviation G", |r| r.roundness[0].deviation),
        ("bi-directional deviation G(b)", |r| r.both),
        ("radial deviation, largest", |r| r.roundness[0].largest),
        ("radial deviation, smallest", |r| r.roundness[0].smallest),
        ("radial deviation, mean", |r| r.roundness[0].mean),
        ("peak at +X", |r| r.roundness[0].reversals[0]),
        ("peak at +Y", |r| r.roundness[0].reversals[1]),
        ("peak at −X", |r| r.roundness[0].reversals[2]),
        ("peak at −Y", |r| r.roundness[0].reversals[3]),
        ("step at +X", |r| r.roundness[0].steps[0]),
        ("step at +Y", |r| r.roundness[0].steps[1]),
        ("step at −X", |r| r.roundness[0].steps[2]),
        ("step at −Y", |r| r.roundness[0].steps[3]),
        ("ellipse along the axes", |r| r.roundness[0].ellipse_axes),
        ("ellipse at 45 degrees", |r| r.roundness[0].ellipse_diagonal),
        ("  the other way round", |r| r.roundness[1].ellipse_diagonal),
    ];
    for (name, value) in rows {
        let cells = f.runs.iter().chain(&f.without).map(|run| micro(value(run)));
        table.row(std::iter::once(Cell::text(name)).chain(cells).collect());
    }
    table
}

fn drives(f: &Findings) -> Table {
    let mut table = Table::new("Loops of the drives", ["gain", "X", "Y"]);
    let rows: [(&str, Gain, [&str; 2]); 6] = [
        ("position gain kp", |s| s.gains.kp, ["1/s"; 2]),
        ("velocity gain kv", |s| s.gains.kv, ["N.m.s/rad", "N.s/m"]),
        ("integral gain ki", |s| s.gains.ki, ["N.m/rad", "N/m"]),
        ("velocity fed forward", |s| s.gains.velocity_forward, [""; 2]),
        ("acceleration fed forward", |s| s.gains.acceleration_forward, [""; 2]),
        ("limit of torque or force", |s| s.gains.limit, ["N.m", "N"]),
    ];
    for (name, value, units) in rows {
        let cell = |(s, motion): (&Servo, &AxisKind)| {
            let value = value(s);
            // A drive without a limit shows none.
            if value.is_finite() {
                Cell::quantity(value, units[usize::from(*motion == AxisKind::Linear)])
            } else {
                Cell::text("none")
            }
        };
        table.row(std::iter::once(Cell::text(name)).chain(f.servos.iter().zip(&f.motion).map(cell)).collect());
    }
    let feedback = |s: &Servo| match s.feedback {
        Feedback::Motor => Cell::text("motor encoder"),
        Feedback::Table => Cell::text("table scale"),
    };
    table.row(std::iter::once(Cell::text("position from")).chain(f.servos.iter().map(feedback)).collect());
    table
}
