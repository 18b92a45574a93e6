//! A record on its way to a verdict: cut, read, examined, and refused where it cannot carry one.

use std::ops::Range;
use std::path::Path;

use crate::examine::{Examination, Input, Severity, examine};
use crate::report::Block;
use crate::report::examine::{findings, verdict};
use crate::trace::{Loaded, Machine, Signal, Trace, load};

/// Which part of a record is used, and whether it is believed.
#[derive(Debug, Clone, Copy, Default, clap::Args)]
#[command(next_help_heading = "The record")]
pub struct Believed {
    /// First time used, s, as the file counts it
    #[arg(long, allow_negative_numbers = true, value_name = "S", value_parser = finite)]
    pub from: Option<f64>,
    /// Last time used, s
    #[arg(long, allow_negative_numbers = true, value_name = "S", value_parser = finite)]
    pub to: Option<f64>,
    /// Give a verdict though the examination of the record speaks against it
    #[arg(long)]
    pub trust: bool,
}

/// A finite number.
pub fn finite(text: &str) -> Result<f64, String> {
    text.parse().ok().filter(|v: &f64| v.is_finite()).ok_or_else(|| "give a finite number".to_owned())
}

/// A record that was examined.
pub struct Examined {
    /// The longest usable piece; or all from the first usable sample to the last.
    pub trace: Trace,
    /// Stretches of that which are not usable.
    pub idle: Vec<Range<usize>>,
    /// What the user should know: of the reading, and of the record.
    pub warnings: Vec<String>,
}

/// A record that cannot carry a verdict.
#[derive(Debug, thiserror::Error)]
#[error("{file}: {}", words(.examination))]
pub struct Refused {
    /// The file.
    pub file: String,
    /// What was found.
    pub examination: Examination,
}

fn words(examination: &Examination) -> String {
    let refused = examination.findings.iter().filter(|f| f.severity == Severity::Refuse);
    refused.map(|f| f.seen.as_str()).collect::<Vec<_>>().join(" ")
}

impl Refused {
    /// What is said of it in place of a verdict.
    pub fn blocks(&self) -> Vec<Block> {
        let mut blocks = vec![Block::Verdict(verdict(&self.examination))];
        blocks.extend(findings(&self.examination));
        blocks.push(Block::Paragraph(format!(
            "No verdict is given on {}. Mend what stands above, or say --trust to have one all the same; `eixo inspect` draws \
             the record.",
            self.file
        )));
        blocks
    }

    /// The same for programs.
    pub fn json(&self) -> serde_json::Value {
        serde_json::json!({ "schema": "eixo.examination/1", "trace": self.file, "examination": self.examination })
    }
}

/// Reads and examines a record, from its first usable sample to the last; `known`: the machine's parameters are given and not the
/// default.
///
/// # Errors
/// When it cannot be read; [`Refused`] when it cannot be believed and the user does not say so.
pub fn examined(path: &Path, machine: &Machine, known: bool, believed: Believed) -> anyhow::Result<Examined> {
    let mut mapping = machine.signals.clone();
    (mapping.from, mapping.to) = (believed.from.or(mapping.from), believed.to.or(mapping.to));
    let loaded = load(path, &mapping)?;
    judged(loaded, path, machine, known, believed.trust, Extent::Whole)
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
pub fn judged(
    loaded: Loaded,
    path: &Path,
    machine: &Machine,
    known: bool,
    trust: bool,
    extent: Extent,
) -> anyhow::Result<Examined> {
    let Loaded { mut trace, stamps, mut warnings } = loaded;
    // The table's position is its angle, where the lead of the screw is known.
    if let (false, Some(x2)) = (trace.has(Signal::Theta2), trace.get(Signal::X2))
        && machine.parameters.rho > 0.0
    {
        let theta2 = x2.iter().map(|x| x / machine.parameters.rho).collect();
        trace.set(Signal::Theta2, theta2)?;
        trace.remove(Signal::X2);
    }
    let examination = examine(&Input::of(&trace, stamps.as_deref()).against(machine, known));
    if examination.refuses() && !trust {
        return Err(Refused { file: path.display().to_string(), examination }.into());
    }
    warnings.extend(
        examination
            .findings
            .iter()
            .filter(|f| f.severity != Severity::Note)
            .map(|f| format!("[{}] {}", f.id, f.sentence())),
    );
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
    Ok(Examined { trace, idle, warnings })
}
