//! The report of a diagnosis: verdict, place, shrinkage, evidence, what to do; read in a minute from the top.

use serde_json::{Map, Value};

use super::chain::{ChainDiagram, Symbol};
use super::chart::{Axis, Chart, Mark, Series, Shape};
use super::format::{self, Medium};
use super::{Block, Cell, Figure, Report, Section, Table, Tone, Verdict, chain, controlled, residual};
use crate::diagnose::{Diagnosis, Evidence, Levels, Verdict as Answer};
use crate::effects::{EFFECTS, EffectInfo, Family, Place};
use crate::trace::Motion;

/// A diagnosis with what is drawn of it.
#[derive(Debug, Clone, Copy)]
pub struct Findings<'a> {
    /// The diagnosis.
    pub diagnosis: &'a Diagnosis,
    /// Residuals and overlays; without them the report has no plots of them.
    pub evidence: Option<&'a Evidence>,
    /// What was diagnosed: file, samples, rate.
    pub trace: &'a str,
    /// Rotary or linear.
    pub motion: Motion,
}

/// The report.
#[must_use]
pub fn report(f: &Findings) -> Report {
    let mut top = vec![Block::Verdict(verdict(f))];
    top.extend(f.diagnosis.warnings.iter().cloned().map(Block::Warning));
    top.push(Block::Figure(Figure::new(chain(f), &*f.diagnosis.location.summary)));
    let mut sections = vec![Section::new("", top)];
    if !f.diagnosis.causes.is_empty() {
        sections.push(Section::new("What it is", what(f)));
    }
    sections.push(Section::new("How far the gap shrinks", how_far(f)));
    let in_the_loop = controlled::blocks(f);
    if !in_the_loop.is_empty() {
        sections.push(Section::new("In the drive's loop", in_the_loop));
    }
    if let Some(e) = f.evidence {
        sections.push(Section::new("Where the gap shows", residual::blocks(&e.located, f.diagnosis, f.motion)));
    }
    sections.push(Section::new("Every cause that was tried", which(f)));
    sections.push(Section::new("What to do next", vec![Block::Steps(next(f))]));
    Report {
        title: format!("Diagnosis of {}", f.diagnosis.machine),
        subject: f.trace.to_owned(),
        sections,
        footer: format!("eixo {}", env!("CARGO_PKG_VERSION")),
    }
}

/// The short form for the terminal: verdict, causes, levels, the head of the ranking, what to do next.
#[must_use]
pub fn short(f: &Findings) -> Vec<Block> {
    let mut blocks = vec![Block::Verdict(verdict(f))];
    blocks.extend(f.diagnosis.warnings.iter().cloned().map(Block::Warning));
    if !f.diagnosis.location.summary.is_empty() {
        blocks.push(Block::Paragraph(f.diagnosis.location.summary.clone()));
    }
    if !f.diagnosis.causes.is_empty() {
        blocks.push(Block::Table(causes(f)));
    }
    blocks.push(Block::Table(levels(f)));
    blocks.extend(remainder(f).map(Block::Paragraph));
    blocks.extend(controlled::short(f));
    blocks.push(Block::Table(ranking(f, 5)));
    blocks.push(Block::Steps(next(f)));
    blocks
}

/// What is known of an effect by its id.
fn info(id: &str) -> Option<&'static EffectInfo> {
    EFFECTS.iter().map(|e| e.info()).find(|i| i.id == id)
}

/// A hypothesis in words.
pub(super) fn title(id: &str) -> String {
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

/// A share in per cent.
pub(super) fn percent(share: f64) -> String {
    format::percent(share, Medium::Page)
}

/// Error over noise below which a model explains a trace.
const TO_THE_NOISE: f64 = 1.2;

fn verdict(f: &Findings) -> Verdict {
    let d = f.diagnosis;
    let held = &d.gap.holdout.combined;
    let fall = format!(
        "On held-out data ({}) the model's error {} from {} of the signal to {}; the noise alone is {}.",
        d.gap.holdout_is,
        if held.after > held.before { "rises" } else { "falls" },
        percent(held.before),
        percent(held.after),
        percent(held.noise_floor)
    );
    let [low, high] = d.gap.interval;
    let mut figures = vec![
        ("gap closed, held out".to_owned(), Cell::Percent(d.gap.closure)),
        ("95 % interval".to_owned(), Cell::Text(format!("{} to {}", percent(low), percent(high)))),
    ];
    let (tone, sentence, detail) = match d.verdict {
        Answer::NoGap => {
            figures.clear();
            let levels = format!(
                "Its error on held-out data is {} of the signal, the noise {}.",
                percent(held.before),
                percent(held.noise_floor)
            );
            let sentence = match d.remainder.as_ref().filter(|r| r.noise_multiple > REMAINS) {
                Some(r) => format!(
                    "No gap: no cause stands out in the {} of the torque that the model leaves.",
                    percent(r.share)
                ),
                None => "No gap: the model explains this trace to within its noise.".to_owned(),
            };
            (Tone::Good, sentence, levels)
        }
        Answer::Parameters if !d.causes.is_empty() => (
            Tone::Finding,
            "Every parameter of the model is off by the same factor, as from a wrong torque constant.".to_owned(),
            fall,
        ),
        Answer::Parameters => {
            (Tone::Finding, "The structure of the model is right, its parameters are not.".to_owned(), fall)
        }
        Answer::Effect => {
            let named: Vec<String> = d
                .causes
                .iter()
                .map(|c| match info(&c.id) {
                    Some(i) => format!("{} (at the {})", lower(short_title(i)), c.place),
                    None => c.id.clone(),
                })
                .collect();
            if let Some(c) = d.causes.first() {
                figures.insert(0, ("probability".to_owned(), Cell::Percent(c.probability)));
            }
            let sentence = match named.as_slice() {
                [one] => format!("The model leaves out one thing: {one}."),
                _ => format!("The model leaves out {} things: {}.", named.len(), named.join("; ")),
            };
            (Tone::Finding, sentence, fall)
        }
        Answer::Unexplained => {
            let at = match d.location.place.as_str() {
                "none" | "" => "at no single place".to_owned(),
                place => format!("at the {place}"),
            };
            let fitted = &d.gap.train.combined;
            let only_there = !d.causes.is_empty() && fitted.after < TO_THE_NOISE * fitted.noise_floor;
            let nearest = d.ranking.first().filter(|r| r.id != "no_gap").map_or_else(String::new, |r| {
                let title = lower(&title(&r.id));
                if only_there {
                    format!("The nearest, {title}, explains the fitted trace alone: has the machine changed between the two? ")
                } else {
                    format!("The nearest, {title}, closes {} of it. ", percent(r.closure_holdout))
                }
            });
            (
                Tone::Unsure,
                format!("There is a gap {at}, and none of the known effects explains it."),
                format!("{nearest}{fall}"),
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
            let found: Vec<&str> = f
                .diagnosis
                .causes
                .iter()
                .filter(|c| info(&c.id).is_some_and(|i| i.place == p))
                .map(|c| c.id.as_str())
                .collect();
            let marked =
                !found.is_empty() || (f.diagnosis.causes.is_empty() && f.diagnosis.location.place == p.as_str());
            chain::Place {
                name: p.as_str().to_owned(),
                symbol,
                note: if found.is_empty() { parts.to_owned() } else { found.join(", ") },
                share: f.diagnosis.location.by_place.get(p.as_str()).and_then(Value::as_f64),
                marked,
            }
        })
        .collect();
    ChainDiagram { title: String::new(), places }
}

fn causes(f: &Findings) -> Table {
    let mut table =
        Table::new("What the model leaves out", ["cause", "place", "share of the gap", "parameter", "value"]);
    for c in &f.diagnosis.causes {
        let mut head = vec![Cell::text(title(&c.id)), Cell::text(&*c.place), Cell::Bar(c.share_of_gap)];
        for (name, p) in &c.parameters {
            head.push(Cell::text(format!("{}.{name}", c.id)));
            head.push(Cell::Estimate(
                number(p, "value"),
                number(p, "std"),
                p["unit"].as_str().unwrap_or("").to_owned(),
            ));
            table.row(std::mem::replace(&mut head, vec![Cell::Empty; 3]));
        }
        if c.parameters.is_empty() {
            head.extend([Cell::Empty, Cell::Empty]);
            table.row(head);
        }
    }
    table
}

/// A number of the JSON contract; not a number where it has none.
fn number(value: &Value, key: &str) -> f64 {
    value[key].as_f64().unwrap_or(f64::NAN)
}

fn what(f: &Findings) -> Vec<Block> {
    let mut blocks = vec![Block::Table(causes(f))];
    for c in &f.diagnosis.causes {
        if let Some(i) = info(&c.id) {
            blocks.push(Block::Paragraph(format!("{}. In the model: {}. {}", i.title, i.equation, meaning(i.family))));
        }
    }
    for [a, b, why] in &f.diagnosis.confusable {
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
        Family::Gravity => "On a machine: a weight on a hinge, an arm, or a counterweight that is not in balance.",
        Family::ExternalSpring => "On a machine: a way cover, hoses or cables, a gas spring.",
        Family::DeadZone => "On a machine: an amplifier or a valve that does not answer to small commands.",
        Family::PositionFriction => "On a machine: a tight spot of the screw, a damaged rail, a bent shaft.",
        Family::Latch => {
            "On a machine: torque and encoders logged at different instants of the cycle, or behind different filters."
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
    let gap = &f.diagnosis.gap;
    let mut row = |name: &str, of: fn(&Levels) -> f64, strong: bool| {
        let cells =
            vec![Cell::text(name), Cell::Percent(of(&gap.train.combined)), Cell::Percent(of(&gap.holdout.combined))];
        if strong { table.strong_row(cells) } else { table.row(cells) }
    };
    row("as given", |l| l.before, false);
    row("parameters re-identified", |l| l.reidentified, false);
    match f.diagnosis.verdict {
        Answer::Effect | Answer::Unexplained => {
            row(improved(f.diagnosis), |l| l.after, f.diagnosis.verdict == Answer::Effect);
        }
        Answer::Parameters | Answer::NoGap => {}
    }
    row("noise floor", |l| l.noise_floor, false);
    table
}

/// What the model at its best is called.
pub(super) fn improved(d: &Diagnosis) -> &'static str {
    match (d.verdict, d.causes.len()) {
        (Answer::Effect, 2..) => "with the effects",
        (Answer::Effect, _) => "with the effect",
        (Answer::Unexplained, 2..) => "with the nearest effects",
        (Answer::Unexplained, _) => "with the nearest effect",
        (Answer::Parameters | Answer::NoGap, _) => "re-identified",
    }
}

/// Multiple of the noise from which a remainder is worth a sentence.
const REMAINS: f64 = 1.5;

/// What no cause explains, in a sentence.
fn remainder(f: &Findings) -> Option<String> {
    let r = f.diagnosis.remainder.as_ref().filter(|r| r.noise_multiple > REMAINS)?;
    let beside = if f.diagnosis.causes.is_empty() { "No cause explains" } else { "Beside that no cause explains" };
    Some(format!(
        "{beside} {} {} rms of torque at the {} ({} of the torque, {} times what the encoders' noise makes): {}.",
        format::number(r.torque_rms, 3, Medium::Page),
        f.motion.unit("N.m"),
        r.place,
        percent(r.share),
        format::number(r.noise_multiple, 2, Medium::Page),
        r.summary
    ))
}

fn how_far(f: &Findings) -> Vec<Block> {
    let d = f.diagnosis;
    let mut blocks = vec![Block::Table(levels(f))];
    blocks.extend(remainder(f).map(Block::Paragraph));
    if d.verdict == Answer::Effect && d.gap.closure_of_effect.is_finite() {
        blocks.push(Block::Paragraph(format!(
            "Counted from the model whose parameters alone were fitted again, {} {} of what was left.",
            if d.causes.len() > 1 { "the effects close" } else { "the effect closes" },
            percent(d.gap.closure_of_effect)
        )));
    }
    for o in f.evidence.iter().flat_map(|e| &e.held) {
        blocks.extend(residual::overlay(o, d.gap.closure_of, improved(d), f.motion));
    }
    if !d.parameters.is_empty() {
        blocks.push(Block::Table(parameters(&d.parameters)));
    }
    blocks
}

fn parameters(all: &Map<String, Value>) -> Table {
    let mut table = Table::new("Parameters of the axis", ["parameter", "as given", "re-identified", "now", "change"]);
    for (name, p) in all {
        let (nominal, now) = (number(p, "nominal"), number(p, "fitted"));
        table.row(vec![
            Cell::text(&**name),
            Cell::number(nominal),
            Cell::number(number(p, "reidentified")),
            Cell::Estimate(now, number(p, "std"), String::new()),
            Cell::Percent(now / nominal - 1.0),
        ]);
    }
    table
}

fn ranking(f: &Findings, most: usize) -> Table {
    let mut table = Table::new(
        "Causes tried, the best first",
        ["cause", "place", "probability", "delta BIC", "chi2 a sample", "gap closed, held out"],
    );
    for (i, h) in f.diagnosis.ranking.iter().take(most).enumerate() {
        let cells = vec![
            Cell::text(title(&h.id)),
            Cell::text(&*h.place),
            Cell::Bar(h.probability),
            Cell::Number(h.delta_bic, 3, String::new()),
            Cell::Number(h.chi2, 3, String::new()),
            Cell::Percent(h.closure_holdout),
        ];
        if i == 0 && f.diagnosis.verdict != Answer::Unexplained { table.strong_row(cells) } else { table.row(cells) }
    }
    table
}

fn which(f: &Findings) -> Vec<Block> {
    let mut chart = Chart::new(
        "Noise-scaled error of each cause",
        Axis::linear("place in the ranking", ""),
        Axis::log("chi2 a sample", ""),
    );
    let chi2: Vec<f64> = f.diagnosis.ranking.iter().map(|h| h.chi2).collect();
    let order: Vec<f64> = (1..=chi2.len()).map(|k| k as f64).collect();
    chart.series.push(Series::new("", Shape::Stem, order, chi2));
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
    let d = f.diagnosis;
    match d.verdict {
        Answer::NoGap => steps.push("Use the model as it is. A gap that this excitation does not show may still be there: repeat with the amplitudes and speeds of the real work.".to_owned()),
        Answer::Parameters => steps.push("Put the re-identified parameters into the model.".to_owned()),
        Answer::Effect => {
            steps.push("Put the effect into the model: the table above has its parameters for [effects] of axis.toml.".to_owned());
            if !d.confusable.is_empty() {
                steps.push("Before you change the machine, tell the confusable causes apart.".to_owned());
            }
        }
        Answer::Unexplained => steps.push("Look at the machine at the place marked; compare the pictures of the residual with what moves there.".to_owned()),
    }
    if !d.next_experiment.is_empty() {
        steps.push(d.next_experiment.clone());
    }
    steps
}
