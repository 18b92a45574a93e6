//! A record on its way to a verdict: cut, read, examined, and refused where it does not allow one.

use std::ops::Range;
use std::path::Path;

use crate::axis::Hold;
use crate::examine::{Examination, Input, Severity, examine};
use crate::report::Block;
use crate::report::driven::Driven;
use crate::report::examine::{findings, verdict};
use crate::trace::{Loaded, LoadedPieces, Machine, Mapping, Signal, Trace, load};

/// Which part of a record is used, and at which steps.
#[derive(Debug, Clone, Copy, Default, clap::Args)]
#[command(next_help_heading = "The record")]
pub struct Part {
    /// First time used, s, as the file counts it
    #[arg(long, allow_negative_numbers = true, value_name = "S", value_parser = finite)]
    pub from: Option<f64>,
    /// Last time used, s
    #[arg(long, allow_negative_numbers = true, value_name = "S", value_parser = finite)]
    pub to: Option<f64>,
    /// Bring the record to even steps of so many seconds, whatever its time stamps; what that leaves of the band is said
    #[arg(long, value_name = "S", value_parser = positive)]
    pub resample: Option<f64>,
}

/// Which part of a record is used, and whether it is believed.
#[derive(Debug, Clone, Copy, Default, clap::Args)]
#[command(next_help_heading = "The record")]
pub struct Believed {
    #[command(flatten)]
    pub part: Part,
    /// Give a verdict though the examination of the record speaks against it
    #[arg(long)]
    pub trust: bool,
}

/// A finite number.
pub fn finite(text: &str) -> Result<f64, String> {
    text.parse().ok().filter(|v: &f64| v.is_finite()).ok_or_else(|| "give a finite number".to_owned())
}

/// A finite number above zero.
pub fn positive(text: &str) -> Result<f64, String> {
    finite(text).ok().filter(|v| *v > 0.0).ok_or_else(|| "give a number above zero".to_owned())
}

impl Part {
    /// A log's columns, with the part and the interval that were asked for.
    pub fn of(&self, mut mapping: Mapping) -> Mapping {
        (mapping.from, mapping.to) = (self.from.or(mapping.from), self.to.or(mapping.to));
        mapping.resample = self.resample.or(mapping.resample);
        mapping
    }
}

/// A record that was examined.
pub struct Examined {
    /// The longest usable piece; or all from the first usable sample to the last.
    pub trace: Trace,
    /// Stretches of that which are not usable.
    pub idle: Vec<Range<usize>>,
    /// What the user should know: of the reading, and of the record.
    pub warnings: Vec<String>,
    /// Why no model without a delay is the axis, each a sentence.
    pub doubts: Vec<String>,
    /// What drives the axis.
    pub driven: Driven,
}

/// A record that does not allow a verdict.
#[derive(Debug, thiserror::Error)]
#[error("{file}: {}", reasons(.examination))]
pub struct Refused {
    /// The file.
    pub file: String,
    /// What was found.
    pub examination: Examination,
    /// What was found on reading it.
    pub warnings: Vec<String>,
    /// What drives the axis.
    pub driven: Driven,
}

/// Why a record is refused.
fn reasons(examination: &Examination) -> String {
    let refused = examination.findings.iter().filter(|f| f.severity == Severity::Refuse);
    refused.map(|f| f.seen.as_str()).collect::<Vec<_>>().join(" ")
}

impl Refused {
    /// What is shown in place of a verdict.
    pub fn blocks(&self) -> Vec<Block> {
        let mut blocks = vec![Block::Summary(verdict(&self.examination))];
        blocks.extend(findings(&self.examination));
        blocks.extend(self.warnings.iter().cloned().map(Block::Warning));
        blocks.push(Block::Paragraph(format!(
            "No verdict is given on {}. Mend what stands above, or say --trust to have one all the same; `eixo inspect` draws \
             the record.",
            self.file
        )));
        self.driven.blocks(blocks)
    }

    /// The same for programs.
    pub fn json(&self) -> serde_json::Value {
        serde_json::json!({ "schema": "eixo.examination/1", "trace": self.file, "warnings": self.warnings, "examination": self.examination })
    }
}

/// Reads and examines a record, from its first usable sample to the last; `known`: the machine's parameters are given and not the
/// default.
///
/// # Errors
/// When it cannot be read; [`Refused`] when it cannot be believed and the user does not say so.
pub fn examined(path: &Path, machine: &Machine, known: bool, believed: Believed) -> anyhow::Result<Examined> {
    let loaded = load(path, &believed.part.of(machine.signals.clone()))?;
    examined_log(loaded, path, machine, known, believed.trust, Extent::Whole)
}

/// What is taken of a record that has stretches of no use.
pub enum Extent {
    /// Its longest usable piece.
    Longest,
    /// All from the first usable sample to the last.
    Whole,
}

/// Examines a record that was read.
///
/// # Errors
/// [`Refused`].
pub fn examined_log(
    loaded: Loaded,
    path: &Path,
    machine: &Machine,
    known: bool,
    trust: bool,
    extent: Extent,
) -> anyhow::Result<Examined> {
    let Loaded { trace, stamps, mut warnings, drive } = loaded;
    let driven = Driven { motion: machine.signals.motion, unit: drive };
    let Seen { trace, examination } = seen(trace, stamps.as_deref(), machine, known)?;
    if examination.refuses() && !trust {
        return Err(Refused { file: path.display().to_string(), examination, warnings, driven }.into());
    }
    warnings.extend(noted(&examination));
    let mut trace = trace;
    warnings.extend(acting(&mut trace, &examination, machine));
    let usable = &examination.usable;
    let taken = match extent {
        Extent::Longest => examination.longest(),
        Extent::Whole => usable.first().zip(usable.last()).map(|(first, last)| first.start..last.end),
    };
    let mut idle = Vec::new();
    if let (Extent::Whole, Some(taken), false) = (&extent, &taken, trust) {
        idle.extend(usable.windows(2).map(|w| w[0].end - taken.start..w[1].start - taken.start));
    }
    if let Some(piece) = taken.filter(|p| p.len() < trace.len() && p.len() >= 64 && !trust) {
        warnings.push(format!(
            "{}: {} of {} samples are used, {:.6} s to {:.6} s; another part is taken with --from and --to",
            path.display(),
            piece.len(),
            trace.len(),
            trace.time(piece.start),
            trace.time(piece.end - 1)
        ));
        trace = trace.slice(piece);
    }
    let doubts = doubts(&examination, trust);
    Ok(Examined { trace, idle, warnings, doubts, driven })
}

/// Takes the torque as the record shows it to act, where nobody says what it does between samples; says so.
fn acting(trace: &mut Trace, examination: &Examination, machine: &Machine) -> Option<String> {
    (machine.signals.hold.is_none() && examination.runs_straight).then(|| {
        trace.hold = Hold::Linear;
        "Nothing says what the torque does between two samples, and the motion follows one that runs straight at least twice as well as \
         one that is held: it is taken as straight. hold = \"linear\" or \"zoh\" at T in [signals] of an axis file, or --hold of identify, \
         says what it is."
            .to_owned()
    })
}

/// The pieces of a record that were examined.
pub struct ExaminedPieces {
    /// What is usable, to be used together.
    pub pieces: Vec<Trace>,
    /// What the user should know: of the reading, and of the record.
    pub warnings: Vec<String>,
    /// Why no model without a delay is the axis, each a sentence.
    pub doubts: Vec<String>,
    /// What drives the axis.
    pub driven: Driven,
}

/// Least samples of a piece that is used together with others.
const LEAST_PIECE: usize = 64;
/// Most pieces of a record that are used together, the longest ones: each has an initial state of its own to be fitted.
const MOST_PIECES: usize = 64;

/// Examines every piece of a record that was read, and gives what is usable of it, to be used together.
///
/// # Errors
/// [`Refused`], when the longest piece cannot be believed; a shorter one is left out with a word.
pub fn examined_pieces(
    loaded: LoadedPieces,
    path: &Path,
    machine: &Machine,
    known: bool,
    trust: bool,
) -> anyhow::Result<ExaminedPieces> {
    let LoadedPieces { longest: Loaded { trace, stamps, mut warnings, drive }, others } = loaded;
    let driven = Driven { motion: machine.signals.motion, unit: drive };
    let file = path.display();
    let mut first = seen(trace, stamps.as_deref(), machine, known)?;
    if first.examination.refuses() && !trust {
        let (file, examination) = (file.to_string(), first.examination);
        return Err(Refused { file, examination, warnings, driven }.into());
    }
    warnings.extend(noted(&first.examination));
    warnings.extend(acting(&mut first.trace, &first.examination, machine));
    let hold = first.trace.hold;
    let doubts = doubts(&first.examination, trust);
    let mut total = 0;
    let mut pieces = Vec::new();
    let mut take = |seen: &Seen| {
        let whole = std::iter::once(0..seen.trace.len()).collect();
        let usable = if trust { &whole } else { &seen.examination.usable };
        total += seen.trace.len();
        let long_enough = usable.iter().filter(|r| r.len() >= LEAST_PIECE.min(seen.trace.len()));
        pieces.extend(long_enough.map(|r| seen.trace.slice(r.clone())));
    };
    take(&first);
    for (trace, stamps) in others {
        let (start, end) = (trace.start, trace.time(trace.len() - 1));
        let mut other = seen(trace, stamps.as_deref(), machine, known)?;
        other.trace.hold = hold;
        if other.examination.refuses() && !trust {
            warnings.push(format!(
                "{file}: the piece from {start:.6} s to {end:.6} s is left out: {}",
                reasons(&other.examination)
            ));
            continue;
        }
        let new = other.examination.findings.iter().filter(|f| first.examination.find(f.id).is_none());
        warnings.extend(new.filter(|f| f.severity != Severity::Note).map(|f| format!("[{}] {}", f.id, f.sentence())));
        take(&other);
    }
    if pieces.is_empty() {
        // Nothing is long enough: the estimators say what is missing.
        pieces.push(first.trace);
    }
    if pieces.len() > MOST_PIECES {
        pieces.sort_by_key(|p| std::cmp::Reverse(p.len()));
        pieces.truncate(MOST_PIECES);
        warnings
            .push(format!("{file}: only the {MOST_PIECES} longest pieces are used; take a part with --from and --to"));
    }
    pieces.sort_by(|a, b| a.start.total_cmp(&b.start));
    let used: usize = pieces.iter().map(Trace::len).sum();
    match &pieces[..] {
        [piece] if used < total => warnings.push(format!(
            "{file}: {used} of {total} samples are used, {:.6} s to {:.6} s; another part is taken with --from and --to",
            piece.start,
            piece.time(piece.len() - 1)
        )),
        [_] => {}
        many => warnings.push(format!(
            "{file}: {used} of {total} samples are used, {} pieces together ({}); no difference is taken and nothing is simulated \
             across what lies between them",
            many.len(),
            spans(many)
        )),
    }
    Ok(ExaminedPieces { pieces, warnings, doubts, driven })
}

/// When the pieces are, in words; of many the first ones.
fn spans(pieces: &[Trace]) -> String {
    const NAMED: usize = 4;
    let mut named: Vec<String> =
        pieces.iter().take(NAMED).map(|p| format!("{:.6} s to {:.6} s", p.start, p.time(p.len() - 1))).collect();
    if pieces.len() > NAMED {
        named.push("...".to_owned());
    }
    named.join(", ")
}

/// A piece without gaps, and what was found in it.
struct Seen {
    trace: Trace,
    examination: Examination,
}

/// The table's position is its angle, where the lead of the screw is known.
pub fn table_as_angle(trace: &mut Trace, machine: &Machine) -> anyhow::Result<()> {
    if let (false, Some(x2)) = (trace.has(Signal::Theta2), trace.get(Signal::X2))
        && machine.parameters.rho > 0.0
    {
        let theta2 = x2.iter().map(|x| x / machine.parameters.rho).collect();
        trace.set(Signal::Theta2, theta2)?;
        trace.remove(Signal::X2);
    }
    Ok(())
}

fn seen(mut trace: Trace, stamps: Option<&[f64]>, machine: &Machine, known: bool) -> anyhow::Result<Seen> {
    table_as_angle(&mut trace, machine)?;
    let examination = examine(&Input::of(&trace, stamps).against(machine, known));
    Ok(Seen { trace, examination })
}

/// Why no estimate of a model without a delay is reliable on this record.
fn doubts(examination: &Examination, trust: bool) -> Vec<String> {
    let apart = examination.find("misaligned").filter(|_| !trust);
    let consequence = "Inertia, damping and stiffness would make up for that: their errors do not tell by how much.";
    apart.map(|found| format!("{} {consequence}", found.seen)).into_iter().collect()
}

/// The warnings about a record that is used.
fn noted(examination: &Examination) -> impl Iterator<Item = String> + '_ {
    let material = examination.findings.iter().filter(|f| f.severity != Severity::Note);
    material.map(|f| format!("[{}] {}", f.id, f.sentence()))
}
