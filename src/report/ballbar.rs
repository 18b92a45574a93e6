//! What the trace of a circular test shows, ranked, and the page of a measured one.

use std::sync::Arc;

use super::chart::{Axis, Chart, Colour, DEGREES, Dash, Series};
use super::format::{self, Medium, capital};
use super::polar::{PolarPlot, PolarTrace};
use super::{Block, Cell, Figure, Report, Section, Summary, Table, Tone};
use crate::circle::measured::Measured;
use crate::circle::roundness::SHOWN;
use crate::circle::trace::{Analysis, Effect, Kind, Measure, Turn, remedy};

/// The figures of ISO 230-4 of a measured test, m.
#[derive(Debug, Clone, PartialEq)]
pub struct Norm {
    /// Whether each turn is clockwise.
    pub clockwise: Vec<bool>,
    /// Circular deviation G of each turn.
    pub deviation: Vec<f64>,
    /// Largest and smallest radial deviation F of each turn, about the least-squares centre of all.
    pub radial: Vec<(f64, f64)>,
    /// Bi-directional circular deviation G(b).
    pub both: Option<f64>,
    /// Circular hysteresis H.
    pub hysteresis: Option<f64>,
    /// Mean (bi-directional) radial deviation D.
    pub mean: f64,
}

/// A measured test with what it shows.
#[derive(Debug, Clone, PartialEq)]
pub struct Findings {
    /// The files.
    pub name: String,
    /// The turns.
    pub measured: Measured,
    /// The standard's figures.
    pub norm: Norm,
    /// What the trace shows.
    pub analysis: Analysis,
    /// The same circle with the model of the axes, where there is one.
    pub model: Option<Analysis>,
    /// What the sizes are as parameters of the model's effects, in sentences.
    pub as_parameters: Vec<String>,
}

/// A share of the circularity from which on something should be done.
const WORTH: f64 = 0.05;
/// Most deviations that are shown what to do about.
const MOST: usize = 5;

/// In millionths; what is below all that such a test shows is zero.
fn millionths(value: f64) -> f64 {
    if value.abs() < SHOWN { 0.0 } else { 1e6 * value }
}

/// Micrometres.
pub fn micro(metres: f64) -> Cell {
    Cell::Number(millionths(metres), 3, "µm".to_owned())
}

fn text(cell: &Cell) -> String {
    format::cell(cell, Medium::Page)
}

fn size(e: &Effect) -> Cell {
    match e.kind.measure() {
        Measure::Ratio => Cell::Number(millionths(e.size), 3, "µm/m".to_owned()),
        _ => micro(e.size),
    }
}

const fn way(clockwise: bool) -> &'static str {
    if clockwise { "clockwise" } else { "counter-clockwise" }
}

/// What belongs to the size, in words.
fn detail(e: &Effect, turns: &[Turn], medium: Medium) -> String {
    let um = |m: f64| format::number(millionths(m), 3, Medium::Page);
    if e.size.abs() < SHOWN && e.ends.is_none() {
        return "none".to_owned();
    }
    if e.error.is_some_and(|error| e.size.abs() < 2.0 * error) {
        return "within its error".to_owned();
    }
    let number = |v: f64, digits: usize| format::number(v, digits, Medium::Page);
    match e.kind {
        Kind::Backlash(axis) => e.ends.map_or_else(String::new, |[plus, minus]| {
            let name = axis.name();
            let over = if e.size < -2.0 * e.error.unwrap_or(0.0) { "; over-compensated" } else { "" };
            format!("play: +{name} {}, −{name} {} µm{over}", um(plus), um(minus))
        }),
        Kind::Spikes(axis) => {
            let quarters = if axis.name() == "X" { [0, 2] } else { [1, 3] };
            let each = turns.iter().zip(&e.heights).map(|(t, h)| {
                let [a, b] = quarters.map(|q| um(h[q]));
                let name = axis.name();
                // A height stays on the line of its reversal.
                let gap = format::space(medium);
                format!("{} +{name}{gap}{a}, −{name}{gap}{b}", if t.clockwise { "cw" } else { "ccw" })
            });
            format!("height: {} µm", each.collect::<Vec<_>>().join("; "))
        }
        Kind::Squareness => format!("+X and +Y enclose {} than 90°", if e.size > 0.0 { "more" } else { "less" }),
        Kind::Scaling => format!("X is {} than Y", if e.size > 0.0 { "longer" } else { "shorter" }),
        Kind::Servo => match e.late {
            Some(late) => {
                format!("amplitude; {} is {} ms later", if late > 0.0 { "X" } else { "Y" }, number(1e3 * late.abs(), 2))
            }
            None => format!("amplitude; {} is later; --feed gives the time", if e.size > 0.0 { "X" } else { "Y" }),
        },
        Kind::Cyclic(axis) => e
            .pitch
            .map_or_else(String::new, |p| format!("amplitude; every {} mm of {}", number(1e3 * p, 4), axis.name())),
        Kind::Vibration => match (e.frequency, e.per_turn) {
            (Some(f), _) => format!("amplitude; {} Hz", number(f, 3)),
            (None, Some(k)) => format!("amplitude; {} to the turn; --feed gives Hz", number(k, 4)),
            _ => String::new(),
        },
        Kind::Diagonal => "amplitude; the other direction tells which".to_owned(),
        kind => kind.measure().name().to_owned(),
    }
}

/// The deviations by what each contributes to the circularity, together with those of a model.
#[must_use]
pub fn ranking(a: &Analysis, model: Option<&Analysis>, medium: Medium) -> Table {
    let mut columns = vec!["deviation", "size", "±", "takes", "share", "X and Y"];
    // A terminal has no room for the errors beside what they belong to; a simulation has none.
    let error = |e: &Effect| e.error.filter(|error| *error >= SHOWN);
    let plain = medium == Medium::Terminal || !a.effects.iter().any(|e| error(e).is_some());
    if plain {
        columns.retain(|c| *c != "±");
    }
    if model.is_some() {
        columns.push("in the model");
    }
    columns.push("of which");
    let mut table = Table::new("What the trace shows", columns);
    let mut shown: Vec<Kind> = Vec::new();
    for e in &a.effects {
        let unseen = e.size.abs() < SHOWN || e.error.is_some_and(|error| e.size.abs() < 2.0 * error);
        if medium == Medium::Terminal && unseen && e.kind != Kind::Remainder {
            continue;
        }
        let mut cells = vec![
            Cell::text(e.kind.name()),
            size(e),
            error(e).map_or(Cell::Empty, |error| size(&Effect { size: error, ..e.clone() })),
            micro(e.contribution),
            if a.circularity > 0.0 { Cell::Bar((e.contribution / a.circularity).max(0.0)) } else { Cell::Empty },
            e.pair.filter(|_| e.size.abs() >= SHOWN).map_or(Cell::Empty, micro),
        ];
        if let Some(model) = model {
            let same = |m: &&Effect| {
                m.kind == e.kind
                    && match (m.pitch, e.pitch) {
                        (Some(a), Some(b)) => (a / b - 1.0).abs() < 0.05,
                        _ => true,
                    }
            };
            cells.push(model.effects.iter().find(same).map_or(Cell::Empty, size));
        }
        if plain {
            cells.remove(2);
        }
        cells.push(Cell::Text(detail(e, &a.turns, medium)));
        if shown.is_empty() && e.weight() > 0.0 {
            table.strong_row(cells)
        } else {
            table.row(cells)
        }
        shown.push(e.kind);
    }
    table
}

/// How the table is to be read.
pub(super) const READING: &str = "All deviations are fitted at once, over both directions. \"takes\" is what the circularity loses when that one \
     alone is taken out of the trace; as shapes overlap, the shares do not add up to one, and one that hides another takes less than \
     nothing. Where X and Y are alike, one alone takes next to nothing, as the other still holds the ring open: the column \
     \"X and Y\" is what both take together. The order is that of the larger: alone, or half of both.";

/// Whether an effect counts by what it takes together with the other axis'.
fn by_both(e: &Effect) -> bool {
    e.weight() > e.contribution
}

/// What to do about the deviations that take most; X and Y of one kind are one step.
#[must_use]
pub fn steps(a: &Analysis) -> Vec<String> {
    let worth = |e: &&Effect| e.weight() > WORTH * a.circularity && e.kind != Kind::Remainder;
    let mut shown: Vec<&str> = Vec::new();
    let one = |e: &Effect| {
        let r = remedy(e.kind);
        let named = [("Siemens", r.siemens), ("Heidenhain", r.heidenhain), ("Fanuc", r.fanuc)];
        let named: Vec<String> = named.iter().filter_map(|(who, what)| Some(format!("{who}: {}", (*what)?))).collect();
        let control = if named.is_empty() { String::new() } else { format!(" ({})", named.join("; ")) };
        let alike = |o: &&Effect| o.kind.of_both().is_some() && o.kind.of_both() == e.kind.of_both();
        let which: Vec<String> = a
            .effects
            .iter()
            .filter(|o| o.kind == e.kind || alike(o))
            .filter(worth)
            .map(|o| format!("{} {}", o.kind.name(), text(&size(o))))
            .collect();
        format!("{}. Machine: {}. Control: {}{control}.", capital(&which.join(", ")), r.mechanics, r.control)
    };
    let new = |e: &&Effect| {
        let name = e.kind.of_both().unwrap_or(e.kind.id());
        let first = !shown.contains(&name);
        shown.push(name);
        first
    };
    a.effects.iter().filter(worth).filter(new).take(MOST).map(one).collect()
}

fn figures(f: &Findings) -> Table {
    let n = &f.norm;
    let mut table = Table::new(
        "Figures of ISO 230-4",
        std::iter::once("figure".to_owned()).chain(n.clockwise.iter().map(|c| way(*c).to_owned())),
    );
    let each = |values: Vec<f64>| values.into_iter().map(micro).collect::<Vec<_>>();
    let mut row = |name: &str, cells: Vec<Cell>| table.row(std::iter::once(Cell::text(name)).chain(cells).collect());
    row("circular deviation G", each(n.deviation.clone()));
    row("radial deviation Fmax", each(n.radial.iter().map(|r| r.0).collect()));
    row("radial deviation Fmin", each(n.radial.iter().map(|r| r.1).collect()));
    let wide = |value: f64| {
        let mut cells = vec![micro(value)];
        cells.resize(n.clockwise.len(), Cell::Empty);
        cells
    };
    if let Some(both) = n.both {
        row("bi-directional deviation G(b)", wide(both));
    }
    if let Some(h) = n.hysteresis {
        row("hysteresis H", wide(h));
    }
    row(
        if n.both.is_some() { "mean bi-directional radial deviation D" } else { "mean radial deviation" },
        wide(n.mean),
    );
    table
}

fn verdict(f: &Findings) -> Summary {
    let a = &f.analysis;
    let what = if f.norm.both.is_some() { "The bi-directional circular deviation" } else { "The circular deviation" };
    let first = a.effects.first().filter(|e| e.weight() > 0.0);
    let sentence = match first {
        Some(e) if e.kind != Kind::Remainder => format!(
            "{what} is {}, of which {} go with {}.",
            text(&micro(a.circularity)),
            text(&micro(if by_both(e) { e.pair.unwrap_or(0.0) } else { e.contribution })),
            if by_both(e) { e.kind.of_both().unwrap_or_default() } else { e.kind.name() }
        ),
        _ => format!("{what} is {}; none of the known deviations takes most of it.", text(&micro(a.circularity))),
    };
    let mut detail = format!("Radius {} mm", format::number(1e3 * f.measured.radius, 4, Medium::Page));
    if let Some(feed) = f.measured.feed {
        detail += &format!(", feed {} mm/min", format::number(6e4 * feed, 4, Medium::Page));
    }
    detail += &format!("; the centre is taken off. What is not explained has {} rms.", text(&micro(a.left)));
    for note in &f.measured.notes {
        detail += &format!(" {note}");
    }
    Summary { tone: Tone::Neutral, sentence, detail, figures: Vec::new() }
}

fn polar(f: &Findings) -> PolarPlot {
    let colours = [Colour::Blue, Colour::Vermillion];
    let traces =
        f.measured.turns.iter().zip(colours).zip([Dash::Solid, Dash::Dashed]).map(|((t, colour), dash)| PolarTrace {
            name: way(t.clockwise).to_owned(),
            angle: t.angle.as_slice().into(),
            deviation: t.deviation.as_slice().into(),
            colour: Some(colour),
            dash,
        });
    PolarPlot {
        title: "Radial deviation, magnified".to_owned(),
        unit: "m".to_owned(),
        traces: traces.collect(),
        full_scale: None,
        radius: Some(f.measured.radius),
        ring: None,
    }
}

/// The trace over the angle with what was found in it, a figure for each direction.
pub(super) fn unrolled(a: &Analysis) -> Vec<Figure> {
    let both = || a.turns.iter().flat_map(|t| &t.deviation).chain(a.model.iter().flatten()).copied();
    let (low, high) = both().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h): (f64, f64), v| (l.min(v), h.max(v)));
    let margin = 0.05 * (high - low).max(SHOWN);
    let range = super::Range::Fixed(low - margin, high + margin);
    let figure = |(turn, model): (&Turn, &Vec<f64>)| {
        let mut order: Vec<(f64, f64, f64)> = turn
            .angle
            .iter()
            .zip(&turn.deviation)
            .zip(model)
            .map(|((angle, d), m)| (angle.to_degrees().rem_euclid(360.0), *d, *m))
            .collect();
        order.sort_by(|a, b| a.0.total_cmp(&b.0));
        let column = |pick: fn(&(f64, f64, f64)) -> f64| -> Arc<[f64]> { order.iter().map(pick).collect() };
        let (degrees, d, m) = (column(|o| o.0), column(|o| o.1), column(|o| o.2));
        let chart = Chart::new(
            capital(way(turn.clockwise)),
            Axis::linear("angle", "°").over(super::Range::Fixed(0.0, 360.0)).by(&DEGREES),
            Axis::linear("deviation", "m").over(range),
        )
        .with(Series::line("trace", degrees.clone(), d).in_colour(Colour::Ink).with_dash(Dash::Broad))
        .with(Series::line("sum of what was found", degrees, m).in_colour(Colour::Blue));
        Figure::new(chart, "")
    };
    a.turns.iter().zip(&a.model).map(figure).collect()
}

/// The whole page.
#[must_use]
pub fn report(f: &Findings) -> Report {
    let mut sections = vec![Section::new(
        "",
        vec![
            Block::Summary(verdict(f)),
            Block::figure(Figure::new(
                polar(f),
                "About the least-squares centre of all turns. Grey: the nominal circle.",
            )),
        ],
    )];
    sections.extend(shown(&f.analysis, f.model.as_ref()));
    if !f.as_parameters.is_empty() {
        let list = f.as_parameters.iter().cloned().map(Block::Paragraph).collect();
        sections.push(Section::new("As parameters of the model", list));
    }
    sections.push(Section::new("Figures", vec![Block::Table(figures(f))]));
    Report {
        title: "Measured circular test".to_owned(),
        subject: f.name.clone(),
        sections,
        footer: format!("eixo {}", env!("CARGO_PKG_VERSION")),
    }
}

/// The sections on what the trace shows: the ranking, what to do, the trace over the angle.
pub(super) fn shown(a: &Analysis, model: Option<&Analysis>) -> Vec<Section> {
    let mut blocks = vec![Block::Table(ranking(a, model, Medium::Page)), Block::Paragraph(READING.to_owned())];
    let steps = steps(a);
    let mut sections = Vec::new();
    blocks.push(Block::Figures(unrolled(a)));
    sections.push(Section::new("Deviations, ranked", blocks));
    if !steps.is_empty() {
        sections.push(Section::new("What to do", vec![Block::Steps(steps)]));
    }
    sections
}

/// The short form for the terminal.
#[must_use]
pub fn short(f: &Findings) -> Vec<Block> {
    let mut blocks = vec![
        Block::Summary(verdict(f)),
        Block::Table(figures(f)),
        Block::Table(ranking(&f.analysis, f.model.as_ref(), Medium::Terminal)),
    ];
    let steps = steps(&f.analysis);
    if !steps.is_empty() {
        blocks.push(Block::Steps(steps));
    }
    blocks.extend(f.as_parameters.iter().cloned().map(Block::Paragraph));
    blocks
}
