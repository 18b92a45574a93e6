//! The report of a diagnosis: verdict, place, shrinkage, evidence, what to do; read in a minute from the top.

use std::sync::Arc;

use super::chain::{ChainDiagram, Symbol};
use super::chart::{Axis, Chart, Colour, Dash, Mark, Range, Series, Shape};
use super::format::{self, Medium};
use super::{Block, Cell, Figure, Report, Section, Table, Tone, Verdict, chain};
use crate::effects::{EFFECTS, EffectInfo, Family, Place};

/// What a diagnosis found, as the report needs it. Angles and torques in SI, shares in 0..=1.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Findings {
    /// The machine's name.
    pub machine: String,
    /// What was diagnosed: file, samples, rate.
    pub trace: String,
    /// The answer.
    pub answer: Answer,
    /// Causes, strongest first; none unless the answer is [`Answer::Effect`].
    pub causes: Vec<Cause>,
    /// Every hypothesis tried, best first.
    pub ranking: Vec<Hypothesis>,
    /// Pairs that these data cannot tell apart, and why.
    pub confusable: Vec<(String, String, String)>,
    /// The experiment that would tell more; may be empty.
    pub next_experiment: String,
    /// The place of the gap; none when there is no gap or it cannot be told.
    pub place: Option<Place>,
    /// Share of each place.
    pub by_place: Vec<(Place, f64)>,
    /// Where, in words.
    pub where_summary: String,
    /// Gap on the trace that was fitted.
    pub train: Levels,
    /// Gap on the trace that was held out.
    pub holdout: Levels,
    /// Share of the gap that is closed on the held-out trace.
    pub closure: f64,
    /// The same counted from the re-identified model.
    pub closure_of_effect: f64,
    /// Interval of the closure.
    pub interval: Option<(f64, f64)>,
    /// Base parameters: name, unit, nominal, with the effect, standard error.
    pub parameters: Vec<(String, String, f64, f64, f64)>,
    /// Signals of the held-out trace with the models' runs.
    pub overlays: Vec<Overlay>,
    /// Pictures of the residual in time, frequency and state.
    pub residual: Vec<Picture>,
    /// What the reader must know before trusting the figures.
    pub warnings: Vec<String>,
}

/// The answer of a diagnosis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Answer {
    /// One or more effects are missing from the model.
    Effect,
    /// Only the parameters are off.
    Parameters,
    /// The model explains the trace to within its noise.
    NoGap,
    /// There is a gap that nothing known explains.
    #[default]
    Unexplained,
}

/// A cause that was found.
#[derive(Debug, Clone, PartialEq)]
pub struct Cause {
    /// Id of the effect.
    pub id: String,
    /// Its probability.
    pub probability: f64,
    /// Its share of the gap.
    pub share: f64,
    /// Parameters: name, value, standard error, unit.
    pub parameters: Vec<(String, f64, f64, String)>,
}

/// A hypothesis that was tried.
#[derive(Debug, Clone, PartialEq)]
pub struct Hypothesis {
    /// Id of the effect, or ids joined by `+`, or `no_gap`, `parameters`.
    pub id: String,
    /// Family in files.
    pub family: String,
    /// Place in files.
    pub place: String,
    /// Its probability.
    pub probability: f64,
    /// Distance in BIC from the best.
    pub delta_bic: f64,
    /// Chi-square a sample; 1 at the noise floor.
    pub chi2: f64,
    /// Closure on the held-out trace.
    pub closure: f64,
}

/// Root-mean-square errors over root-mean-square signals.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Levels {
    /// The nominal model.
    pub before: f64,
    /// The same structure, its parameters fitted.
    pub reidentified: f64,
    /// The model with the effect.
    pub after: f64,
    /// The noise.
    pub floor: f64,
}

/// A measured signal and the models' runs.
#[derive(Debug, Clone, PartialEq)]
pub struct Overlay {
    /// Name of the signal.
    pub signal: String,
    /// Its unit.
    pub unit: String,
    /// Time, s.
    pub time: Arc<[f64]>,
    /// What was measured.
    pub measured: Arc<[f64]>,
    /// The nominal model's run.
    pub before: Arc<[f64]>,
    /// The run with the effect.
    pub after: Arc<[f64]>,
    /// Standard deviation of the signal's noise.
    pub noise: f64,
}

/// A picture of the residual, before and after.
#[derive(Debug, Clone, PartialEq)]
pub struct Picture {
    /// Heading.
    pub title: String,
    /// What the reader should see in it.
    pub caption: String,
    /// Abscissa: label and unit.
    pub x: (String, String),
    /// Ordinate: label and unit.
    pub y: (String, String),
    /// Whether the abscissa, and the ordinate, are logarithmic.
    pub log: (bool, bool),
    /// How the values are drawn.
    pub shape: Shape,
    /// Abscissae and values of the nominal model's residual.
    pub before: (Arc<[f64]>, Arc<[f64]>),
    /// Abscissae and values of the residual with the effect; may be empty.
    pub after: (Arc<[f64]>, Arc<[f64]>),
}

/// The report.
#[must_use]
pub fn report(f: &Findings) -> Report {
    let mut top = vec![Block::Verdict(verdict(f))];
    top.extend(f.warnings.iter().cloned().map(Block::Warning));
    top.push(Block::Figure(Figure::new(chain(f), f.where_summary.clone())));
    let mut sections = vec![Section::new("", top)];
    if !f.causes.is_empty() {
        sections.push(Section::new("What it is", what(f)));
    }
    sections.push(Section::new("How far the gap shrinks", how_far(f)));
    if !f.residual.is_empty() {
        let figures = f.residual.iter().map(picture).collect();
        sections.push(Section::new("Where the gap shows", vec![Block::Figures(figures)]));
    }
    sections.push(Section::new("Every cause that was tried", which(f)));
    sections.push(Section::new("What to do next", vec![Block::Steps(next(f))]));
    Report { title: format!("Diagnosis of {}", f.machine), subject: f.trace.clone(), sections, footer: footer() }
}

/// The short form for the terminal: verdict, causes, levels, the head of the ranking, what to do next.
#[must_use]
pub fn short(f: &Findings) -> Vec<Block> {
    let mut blocks = vec![Block::Verdict(verdict(f))];
    blocks.extend(f.warnings.iter().cloned().map(Block::Warning));
    if !f.where_summary.is_empty() {
        blocks.push(Block::Paragraph(f.where_summary.clone()));
    }
    if !f.causes.is_empty() {
        blocks.push(Block::Table(causes(f)));
    }
    blocks.push(Block::Table(levels(f)));
    blocks.push(Block::Table(ranking(f, 5)));
    blocks.push(Block::Steps(next(f)));
    blocks
}

fn footer() -> String {
    format!("eixo {}", env!("CARGO_PKG_VERSION"))
}

/// What is known of an effect by its id.
fn info(id: &str) -> Option<&'static EffectInfo> {
    EFFECTS.iter().map(|e| e.info()).find(|i| i.id == id)
}

/// A hypothesis in words.
fn title(id: &str) -> String {
    let one = |id: &str| match id {
        "no_gap" => "nothing: the model as it is".to_owned(),
        "parameters" => "parameters only".to_owned(),
        _ => info(id).map_or_else(|| id.to_owned(), |i| short_title(i).to_owned()),
    };
    id.split('+').map(|part| one(part.trim())).collect::<Vec<_>>().join(" and ")
}

/// The title up to its first colon or comma.
fn short_title(info: &EffectInfo) -> &'static str {
    info.title.split([':', ',']).next().unwrap_or(info.title)
}

fn percent(share: f64) -> String {
    format::percent(share, Medium::Page)
}

fn verdict(f: &Findings) -> Verdict {
    let fall = format!(
        "On the held-out trace the model's error falls from {} of the signal to {}; the noise alone is {}.",
        percent(f.holdout.before),
        percent(f.holdout.after),
        percent(f.holdout.floor)
    );
    let mut figures = vec![("gap closed, held out".to_owned(), Cell::Percent(f.closure))];
    if let Some((low, high)) = f.interval {
        figures.push(("95 % interval".to_owned(), Cell::Text(format!("{} to {}", percent(low), percent(high)))));
    }
    let (tone, sentence, detail) = match f.answer {
        Answer::NoGap => {
            let levels = format!(
                "Its error on the held-out trace is {} of the signal, the noise {}.",
                percent(f.holdout.before),
                percent(f.holdout.floor)
            );
            figures.clear();
            (Tone::Good, "No gap: the model explains this trace to within its noise.".to_owned(), levels)
        }
        Answer::Parameters => {
            (Tone::Finding, "The structure of the model is right, its parameters are not.".to_owned(), fall)
        }
        Answer::Effect => {
            let named: Vec<String> = f
                .causes
                .iter()
                .map(|c| match info(&c.id) {
                    Some(i) => format!("{} (at the {})", lower(short_title(i)), i.place.as_str()),
                    None => c.id.clone(),
                })
                .collect();
            if let Some(c) = f.causes.first() {
                figures.insert(0, ("probability".to_owned(), Cell::Percent(c.probability)));
            }
            let sentence = match named.as_slice() {
                [one] => format!("The model leaves out one thing: {one}."),
                _ => format!("The model leaves out {} things: {}.", named.len(), named.join("; ")),
            };
            (Tone::Finding, sentence, fall)
        }
        Answer::Unexplained => {
            let at = f.place.map_or_else(|| "at no single place".to_owned(), |p| format!("at the {}", p.as_str()));
            (
                Tone::Unsure,
                format!("There is a gap {at}, and none of the known effects explains it."),
                format!(
                    "The best of them leaves {} of the signal; the noise alone is {}.",
                    percent(f.holdout.after),
                    percent(f.holdout.floor)
                ),
            )
        }
    };
    Verdict { tone, sentence, detail, figures }
}

fn lower(text: &str) -> String {
    let mut chars = text.chars();
    let first_word_is_a_name = text.starts_with("Coulomb");
    match chars.next() {
        Some(c) if !first_word_is_a_name => c.to_lowercase().chain(chars).collect(),
        _ => text.to_owned(),
    }
}

fn chain(f: &Findings) -> ChainDiagram {
    let places = Place::ALL
        .into_iter()
        .map(|p| {
            let (symbol, parts) = match p {
                Place::Input => (Symbol::Input, "drive, command"),
                Place::Motor => (Symbol::Motor, "motor and screw"),
                Place::Coupling => (Symbol::Coupling, "K, B"),
                Place::Table => (Symbol::Table, "table, guideways"),
                Place::Sensor => (Symbol::Sensor, "encoders"),
            };
            let found: Vec<&str> =
                f.causes.iter().filter(|c| info(&c.id).is_some_and(|i| i.place == p)).map(|c| c.id.as_str()).collect();
            let marked = !found.is_empty() || (f.causes.is_empty() && f.place == Some(p));
            chain::Place {
                name: p.as_str().to_owned(),
                symbol,
                note: if found.is_empty() { parts.to_owned() } else { found.join(", ") },
                share: f.by_place.iter().find(|(q, _)| *q == p).map(|(_, s)| *s),
                marked,
            }
        })
        .collect();
    ChainDiagram { title: String::new(), places }
}

fn causes(f: &Findings) -> Table {
    let mut table =
        Table::new("What the model leaves out", ["cause", "place", "share of the gap", "parameter", "value"]);
    for c in &f.causes {
        let place = info(&c.id).map_or("", |i| i.place.as_str());
        for (k, (name, value, std, unit)) in c.parameters.iter().enumerate() {
            let first = k == 0;
            table.row(vec![
                if first { Cell::text(title(&c.id)) } else { Cell::Empty },
                if first { Cell::text(place) } else { Cell::Empty },
                if first { Cell::Bar(c.share) } else { Cell::Empty },
                Cell::text(format!("{}.{name}", c.id)),
                Cell::Estimate(*value, *std, unit.clone()),
            ]);
        }
    }
    table
}

fn what(f: &Findings) -> Vec<Block> {
    let mut blocks = vec![Block::Table(causes(f))];
    for c in &f.causes {
        if let Some(i) = info(&c.id) {
            blocks.push(Block::Paragraph(format!("{}. In the model: {}. {}", i.title, i.equation, meaning(i.family))));
        }
    }
    for (a, b, why) in &f.confusable {
        blocks.push(Block::Warning(format!(
            "These data do not tell {} from {}: {why}",
            lower(&title(a)),
            lower(&title(b))
        )));
    }
    blocks
}

/// What a cause usually means on a machine.
fn meaning(family: Family) -> &'static str {
    match family {
        Family::DryFriction => {
            "On a machine: bearings, seals, guideway pads and their preload; it makes the quadrant glitches of a circle, and friction compensation in the drive removes them."
        }
        Family::ViscousFriction => {
            "On a machine: grease, oil and speed; it changes with temperature, so identify it warm."
        }
        Family::LoadTorque => {
            "On a machine: weight on a tilted axis, an unbalanced load, or an offset of the amplifier."
        }
        Family::TorqueRipple => {
            "On a machine: cogging or commutation of the motor (its order is a multiple of the pole pairs) or an eccentric screw (order one)."
        }
        Family::Backlash => {
            "On a machine: lost preload of the nut, a worn coupling or key; it shows as a step at each reversal."
        }
        Family::NonlinearStiffness => {
            "On a machine: contact stiffness of nut and bearings, or a coupling with an elastomer."
        }
        Family::Hysteresis => "On a machine: micro-slip in a clamped joint, an elastomer coupling, or a belt.",
        Family::Drift => "On a machine: warming up, or wear; repeat the measurement warm, and trend it.",
        Family::FlexibleMode => "On a machine: the workpiece, a spindle head or the frame swinging behind the table.",
        Family::Disturbance => {
            "On a machine: chatter, a pump, a neighbouring machine; look for what turns at this frequency."
        }
        Family::EndStop => "On a machine: the travel limit or a bellows that touches; move the test away from it.",
        Family::Saturation => "On a machine: the torque limit of the drive; drive less, or raise the limit.",
        Family::ActuatorLag => "On a machine: the bandwidth of the current loop.",
        Family::Delay => "On a machine: cycles of the bus and the controller between command and torque.",
        Family::Parameters => "On a machine: a torque constant from the data sheet that the motor does not have.",
        Family::Sensor => {
            "On a machine: the measurement, not the motion: encoder interpolation, pitch error, or when the value is read."
        }
    }
}

fn levels(f: &Findings) -> Table {
    let mut table =
        Table::new("Error of the model, rms over rms of the signal", ["model", "fitted trace", "held-out trace"]);
    let both = |t: f64, h: f64| [Cell::Percent(t), Cell::Percent(h)];
    let mut row = |name: &str, t: f64, h: f64, strong: bool| {
        let mut cells = vec![Cell::text(name)];
        cells.extend(both(t, h));
        if strong { table.strong_row(cells) } else { table.row(cells) }
    };
    row("as given", f.train.before, f.holdout.before, false);
    row("parameters re-identified", f.train.reidentified, f.holdout.reidentified, false);
    if f.answer == Answer::Effect {
        row("with the effect", f.train.after, f.holdout.after, true);
    }
    row("noise floor", f.train.floor, f.holdout.floor, false);
    table
}

fn how_far(f: &Findings) -> Vec<Block> {
    let mut blocks = vec![Block::Table(levels(f))];
    if f.answer == Answer::Effect && f.closure_of_effect.is_finite() {
        blocks.push(Block::Paragraph(format!(
            "Counted from the model whose parameters alone were fitted again, the effect closes {} of what was left.",
            percent(f.closure_of_effect)
        )));
    }
    let after_name = if f.answer == Answer::Effect { "with the effect" } else { "re-identified" };
    for o in &f.overlays {
        let chart = Chart::new(
            format!("{} on the held-out trace", o.signal),
            Axis::linear("time", "s"),
            Axis::linear(&*o.signal, &*o.unit),
        )
        .with(
            Series::line("measured", o.time.clone(), o.measured.clone()).in_colour(Colour::Ink).with_dash(Dash::Broad),
        )
        .with(
            Series::line("model as given", o.time.clone(), o.before.clone())
                .in_colour(Colour::Vermillion)
                .with_dash(Dash::Dashed),
        )
        .with(Series::line(after_name, o.time.clone(), o.after.clone()).in_colour(Colour::Blue));
        let minus = |model: &[f64]| -> Arc<[f64]> { o.measured.iter().zip(model).map(|(y, m)| y - m).collect() };
        let error = |title: &str| {
            Chart::new(
                format!("{title} of {}", o.signal),
                Axis::linear("time", "s"),
                Axis::linear(format!("measured minus model, {}", o.signal), &*o.unit),
            )
        };
        let left = Series::line(after_name, o.time.clone(), minus(&o.after)).in_colour(Colour::Blue);
        let both = error("Error")
            .with(Series::line("model as given", o.time.clone(), minus(&o.before)).in_colour(Colour::Vermillion))
            .with(left.clone());
        let remainder = error("What is left")
            .with(left)
            .mark(Mark::Y(2.0 * o.noise, "2 standard deviations of the noise".into()))
            .mark(Mark::Y(-2.0 * o.noise, String::new()));
        blocks.push(Block::Figure(Figure::new(chart, "")));
        blocks.push(Block::Figures(vec![Figure::new(both, ""), Figure::new(remainder, "")]));
    }
    if !f.parameters.is_empty() {
        let mut table = Table::new("Parameters of the axis", ["parameter", "as given", "now", "change"]);
        for (name, unit, nominal, value, std) in &f.parameters {
            table.row(vec![
                Cell::text(&**name),
                Cell::quantity(*nominal, &**unit),
                Cell::Estimate(*value, *std, unit.clone()),
                Cell::Percent(value / nominal - 1.0),
            ]);
        }
        blocks.push(Block::Table(table));
    }
    blocks
}

fn picture(p: &Picture) -> Figure {
    let axis = |(label, unit): &(String, String), log: bool| {
        if log { Axis::log(&**label, &**unit) } else { Axis::linear(&**label, &**unit) }
    };
    let mut chart = Chart::new(&*p.title, axis(&p.x, p.log.0), axis(&p.y, p.log.1));
    if !p.log.1 {
        chart.y = chart.y.over(Range::WithZero);
    }
    let both = !p.after.0.is_empty();
    let mut add = |name: &str, data: &(Arc<[f64]>, Arc<[f64]>), colour| {
        let series = Series::new(if both { name } else { "" }, p.shape.clone(), data.0.clone(), data.1.clone());
        chart.series.push(series.in_colour(colour));
    };
    add("model as given", &p.before, Colour::Vermillion);
    if both {
        add("improved model", &p.after, Colour::Blue);
    }
    Figure::new(chart, &*p.caption)
}

fn ranking(f: &Findings, most: usize) -> Table {
    let mut table = Table::new(
        "Causes tried, the best first",
        ["cause", "place", "probability", "delta BIC", "chi2 a sample", "gap closed, held out"],
    );
    for (i, h) in f.ranking.iter().take(most).enumerate() {
        let cells = vec![
            Cell::text(title(&h.id)),
            Cell::text(&*h.place),
            Cell::Bar(h.probability),
            Cell::Number(h.delta_bic, 3, String::new()),
            Cell::Number(h.chi2, 3, String::new()),
            Cell::Percent(h.closure),
        ];
        if i == 0 && f.answer != Answer::Unexplained { table.strong_row(cells) } else { table.row(cells) }
    }
    table
}

fn which(f: &Findings) -> Vec<Block> {
    let mut chart = Chart::new(
        "Noise-scaled error of each cause",
        Axis::linear("place in the ranking", ""),
        Axis::log("chi2 a sample", ""),
    );
    let x: Vec<f64> = (1..=f.ranking.len()).map(|k| k as f64).collect();
    let y: Vec<f64> = f.ranking.iter().map(|h| h.chi2).collect();
    chart.series.push(Series::new("", Shape::Stem, x, y));
    chart.marks.push(Mark::Y(1.0, "noise".into()));
    vec![
        Block::Paragraph(
            "Each cause was fitted together with the parameters of the axis. BIC weighs the error against the number of parameters: a \
             distance of 10 is strong evidence. A chi2 of 1 a sample is the noise itself: nothing is left to explain."
                .to_owned(),
        ),
        Block::Table(ranking(f, usize::MAX)),
        Block::Figure(Figure::new(chart, "The nearer to the noise, the more of the gap the cause explains.")),
    ]
}

fn next(f: &Findings) -> Vec<String> {
    let mut steps = Vec::new();
    match f.answer {
        Answer::NoGap => steps.push("Use the model as it is. A gap that this excitation does not show may still be there: repeat with the amplitudes and speeds of the real work.".to_owned()),
        Answer::Parameters => steps.push("Put the re-identified parameters into the model: --fmu writes it.".to_owned()),
        Answer::Effect => {
            steps.push("Put the effect into the model: --fmu writes it with the parameters above.".to_owned());
            if !f.confusable.is_empty() {
                steps.push("Before you change the machine, tell the confusable causes apart.".to_owned());
            }
        }
        Answer::Unexplained => steps.push("Look at the machine at the place marked; compare the pictures of the residual with what moves there.".to_owned()),
    }
    if !f.next_experiment.is_empty() {
        steps.push(format!("Next experiment: {}", f.next_experiment));
    }
    steps
}
