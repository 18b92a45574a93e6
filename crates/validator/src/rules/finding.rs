//! What a validation finds, as data; see [`super::super::output`] for how it is written.

use serde::{Deserialize, Serialize};

use super::super::description::Fmi;
use super::super::xml::Position;
use super::{Id, Rule, Severity, id};

/// Where a finding is.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Place {
    /// Entry of the archive.
    pub file: String,
    /// Line and column, for text.
    #[serde(flatten, skip_serializing_if = "Option::is_none")]
    pub position: Option<Position>,
}

/// One thing found.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Finding {
    /// Id of the rule.
    pub rule: String,
    /// What is wrong, with the names and numbers.
    pub message: String,
    /// Where, for static rules.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub place: Option<Place>,
    /// The FMI function at fault, for behavioural rules.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub call: Option<String>,
    /// What to do, where the rule's own advice does not fit.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub advice: Option<String>,
}

/// The result of a rule.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum RuleStatus {
    /// Tested, nothing found.
    Passed,
    /// Tested, with findings.
    Failed,
    /// Not tested, and why. Not tested is not passed.
    NotTested(String),
    /// Does not apply to this FMU, and why: it lacks what the rule is about.
    NotApplicable(String),
    /// Left out by `--only` or `--skip`.
    Skipped,
}

/// The result of a validation.
#[derive(Debug, Clone)]
pub struct Report {
    /// The file validated, as given.
    pub file: String,
    /// Model name, where one could be read.
    pub model: Option<String>,
    /// The version of FMI whose rules were tested.
    pub fmi: Fmi,
    /// Every rule of that version and its result, in the order of the list.
    pub rules: Vec<(&'static Rule, RuleStatus)>,
    /// The findings, in the order of the rules.
    pub findings: Vec<Finding>,
    /// Sentences about the FMU as a whole, such as that a model exchange FMU's behaviour was not tested.
    pub remarks: Vec<String>,
    /// The lines of `modelDescription.xml`, for quoting.
    pub source: Vec<String>,
    /// Whether it was selected that nothing of the FMU is run.
    pub static_only: bool,
}

/// The overall result of a report.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// Nothing that counts was found; unless it was not selected for, the FMU's behaviour was tested.
    Passes,
    /// Something was found that counts.
    Fails,
    /// Nothing that counts was found, but the FMU's behaviour could not be tested.
    NotTested,
}

impl Report {
    /// The number of findings of a severity.
    #[must_use]
    pub fn count(&self, severity: Severity) -> usize {
        self.findings.iter().filter(|f| super::rule(&f.rule).is_some_and(|r| r.severity == severity)).count()
    }

    /// The overall result; with `strict`, warnings count as errors. Notes never count.
    #[must_use]
    pub fn outcome(&self, strict: bool) -> Outcome {
        if self.count(Severity::Error) > 0 || strict && self.count(Severity::Warning) > 0 {
            return Outcome::Fails;
        }
        let selected = || self.rules.iter().filter(|(r, v)| !r.is_static() && *v != RuleStatus::Skipped);
        let untested = |(_, status): &(&Rule, RuleStatus)| matches!(status, RuleStatus::NotTested(_));
        // Without the default experiment nothing of the FMU has been seen at work.
        let idle = selected().any(|rule| rule.0.is(id::SIMULATE) && untested(rule));
        if !self.static_only && selected().next().is_some() && (idle || selected().all(untested)) {
            return Outcome::NotTested;
        }
        Outcome::Passes
    }

    /// Whether the FMU passes: see [`Report::outcome`].
    #[must_use]
    pub fn passes(&self, strict: bool) -> bool {
        self.outcome(strict) == Outcome::Passes
    }
}

/// Collects findings.
#[derive(Debug, Default)]
pub(crate) struct Findings {
    pub list: Vec<Finding>,
}

impl Findings {
    /// A finding at a place of `modelDescription.xml`.
    pub fn at(&mut self, rule: Id, position: Position, message: impl Into<String>) {
        self.push(rule, Some(Place { file: "modelDescription.xml".into(), position: Some(position) }), message.into());
    }

    /// A finding on an entry of the archive.
    pub fn entry(&mut self, rule: Id, file: &str, message: impl Into<String>) {
        self.push(rule, Some(Place { file: file.to_owned(), position: None }), message.into());
    }

    /// A finding on the FMU as a whole.
    pub fn whole(&mut self, rule: Id, message: impl Into<String>) {
        self.push(rule, None, message.into());
    }

    fn push(&mut self, rule: Id, place: Option<Place>, message: String) {
        self.list.push(Finding { rule: rule.text().into(), message, place, call: None, advice: None });
    }

    /// Whether a rule has a finding.
    pub fn has(&self, rule: Id) -> bool {
        self.list.iter().any(|f| f.rule == rule.text())
    }
}
