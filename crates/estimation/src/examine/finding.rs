//! A finding: what was seen, where, what it means and what to do.

use std::ops::Range;

use super::Input;

/// How grave a finding is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Severity {
    /// No verdict may be given on this record, unless the user says that it is to be trusted.
    Refuse,
    /// The record can be used, and the user should know.
    Warn,
    /// A fact about the record.
    Note,
}

impl Severity {
    /// The word for it, as in the JSON.
    #[must_use]
    pub const fn word(self) -> &'static str {
        match self {
            Self::Refuse => "refuse",
            Self::Warn => "warn",
            Self::Note => "note",
        }
    }
}

/// Most stretches that one finding names.
const MOST: usize = 64;

/// One finding on a record.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Finding {
    /// What it is, one word for programs. Of numbers and time: `magnitude`, `interval`, `time_order`, `lost_samples`,
    /// `time_rounded`, `time_jitter`. Of one channel: `constant`, `stuck`, `jump`, `wrapped`, `spikes`, `held`, `clipped`. Of
    /// channels beside each other: `sign`, `units`, `scale`, `swapped`, `foreign`, `filtered`, `copy`, `computed`. Of torque and motion:
    /// `not_followed`, `misaligned`, `inertia`, `one_direction`, `no_excitation`, `too_short`. Of stretches: `standstill`,
    /// `standing`, `drive_off`.
    pub id: &'static str,
    /// How grave it is.
    pub severity: Severity,
    /// The channel, or channels, it is about.
    pub signal: &'static str,
    /// How many samples it concerns; all of them where there are no stretches.
    pub samples: usize,
    /// The first stretches of samples it concerns; none where it is about the whole record.
    pub stretches: Vec<Range<usize>>,
    /// The same in seconds, each from its first to its last sample.
    pub seconds: Vec<[f64; 2]>,
    /// What was seen.
    pub seen: String,
    /// What it means.
    pub means: String,
    /// What to do.
    pub remedy: String,
}

impl Finding {
    /// A finding about a whole record.
    #[must_use]
    pub fn new(
        id: &'static str,
        severity: Severity,
        signal: &'static str,
        seen: impl Into<String>,
        means: impl Into<String>,
        remedy: impl Into<String>,
    ) -> Self {
        Self {
            id,
            severity,
            signal,
            samples: 0,
            stretches: Vec::new(),
            seconds: Vec::new(),
            seen: seen.into(),
            means: means.into(),
            remedy: remedy.into(),
        }
    }

    /// With the stretches that it concerns.
    #[must_use]
    pub(super) fn at(mut self, input: &Input<'_>, stretches: Vec<Range<usize>>) -> Self {
        self.samples = stretches.iter().map(Range::len).sum();
        self.seconds =
            stretches.iter().take(MOST).map(|r| [input.time(r.start), input.time(r.end.max(1) - 1)]).collect();
        self.stretches = stretches;
        self.stretches.truncate(MOST);
        self
    }

    /// The finding in one line: what, what it means, what to do.
    #[must_use]
    pub fn sentence(&self) -> String {
        format!("{} {} {}", self.seen, self.means, self.remedy)
    }
}

/// The gravest first; else as found.
pub(super) fn sort(findings: &mut [Finding]) {
    findings.sort_by_key(|f| f.severity);
}

/// Stretches of samples for which something holds.
pub(super) fn runs(n: usize, holds: impl Fn(usize) -> bool) -> Vec<Range<usize>> {
    let mut out: Vec<Range<usize>> = Vec::new();
    for k in (0..n).filter(|k| holds(*k)) {
        match out.last_mut() {
            Some(last) if last.end == k => last.end = k + 1,
            _ => out.push(k..k + 1),
        }
    }
    out
}

/// A size in a sentence: four digits behind the point where that reads well, else with its power of ten; never a number
/// without bound, which extreme parameters lead to.
pub(super) fn rounded(value: f64) -> String {
    match value.abs() {
        size if size > 1e300 => "more than 1e300".to_owned(),
        size if size == 0.0 || (1e-2..1e5).contains(&size) => format!("{value:.4}"),
        _ => format!("{value:.3e}"),
    }
}
