//! Validation rules: what each is ([`list`]), the static ones, and running them.

mod clocks;
mod date;
mod document;
pub mod finding;
#[cfg(test)]
mod fuzz;
pub mod list;
mod names;
mod package;
mod schema;
mod schema2;
mod schema3;
mod structure;
mod three;
mod units;
mod variables;
pub mod wording;

use std::path::Path;

use super::archive::Archive;
use super::behaviour::Behaviour;
use super::description::{Description, Fmi};
use super::xml::Document;
use finding::Findings;
pub use finding::{Finding, Outcome, Place, Report, RuleStatus};
pub use list::RULES;
pub(crate) use list::{Id, id};

/// How bad a finding is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Severity {
    /// Worth knowing.
    Note,
    /// Some importers or uses fail.
    Warning,
    /// The FMU is wrong, or does harm.
    Error,
}

/// What a rule rests on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// The standard asks for it.
    Conformance,
    /// The standard leaves it open; hosts and users suffer all the same.
    Robustness,
    /// Makes the FMU better to use.
    Quality,
}

/// How a rule is tested.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Check {
    /// On the archive and the XML.
    Static,
    /// On the loaded binary, in a process of its own.
    Behaviour(Behaviour),
}

/// A rule.
#[derive(Debug, Clone, Copy)]
pub struct Rule {
    /// Name for `--only`, `--skip` and reports.
    pub id: &'static str,
    /// What holds when it passes.
    pub title: &'static str,
    /// How bad a finding is.
    pub severity: Severity,
    /// What it rests on.
    pub kind: Kind,
    /// Section of FMI 2.0.4 and of FMI 3.0; `-` where the version has none, or the rule is not tested for it.
    pub sections: [&'static str; 2],
    /// What to do about a finding.
    pub advice: &'static str,
    /// How it is tested.
    pub(crate) check: Check,
}

impl Rule {
    /// Whether it is the rule of a name.
    pub(crate) fn is(&self, id: Id) -> bool {
        self.id == id.text()
    }

    /// Whether it is tested without running the FMU.
    #[must_use]
    pub fn is_static(&self) -> bool {
        matches!(self.check, Check::Static)
    }

    /// Whether it only observes calls whose success is tested by another rule, an end of the process in them included.
    pub(crate) fn is_aside(&self) -> bool {
        self.severity == Severity::Note && matches!(self.check, Check::Behaviour(Behaviour::Indirect(_)))
    }

    /// The section of a version of the standard; none where the rule is not one of that version.
    #[must_use]
    pub fn section(&self, fmi: Fmi) -> Option<&'static str> {
        Some(self.sections[fmi as usize]).filter(|section| *section != "-")
    }

    /// What holds when it passes, in the terms of a version.
    #[must_use]
    pub fn title(&self, fmi: Fmi) -> String {
        wording::title(self, fmi)
    }

    /// What to do about a finding, in the terms of a version.
    #[must_use]
    pub fn advice(&self, fmi: Fmi) -> String {
        wording::advice(self, fmi)
    }
}

/// The rules of a version of FMI.
pub fn of(fmi: Fmi) -> impl Iterator<Item = &'static Rule> {
    RULES.iter().filter(move |r| r.section(fmi).is_some())
}

macro_rules! display {
    ($name:ident { $($variant:ident = $text:literal),* }) => {
        impl std::fmt::Display for $name {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.pad(match self { $(Self::$variant => $text),* })
            }
        }
    };
}
display!(Severity { Note = "note", Warning = "warning", Error = "error" });
display!(Kind { Conformance = "conformance", Robustness = "robustness", Quality = "quality" });

/// A rule by its id.
#[must_use]
pub fn rule(id: &str) -> Option<&'static Rule> {
    RULES.iter().find(|r| r.id == id)
}

/// What the static rules leave behind for the behavioural ones.
pub(crate) struct Static {
    /// The findings.
    pub findings: Findings,
    /// The archive, when it is safe to extract.
    pub archive: Option<Archive>,
    /// The description, when it is fit to be relied on.
    pub description: Option<Description>,
    /// The lines of the description.
    pub source: Vec<String>,
    /// Static rules that were not tested, and why.
    pub untested: Vec<(&'static str, String)>,
    /// The version of FMI whose rules are tested.
    pub fmi: Fmi,
    /// The version of FMI, where it is neither 2 nor 3.
    pub foreign: Option<String>,
}

/// Runs every static rule on a file.
pub(crate) fn check_file(path: &Path) -> Result<Static, super::archive::ArchiveError> {
    match Archive::open(path) {
        Ok(archive) => Ok(check_archive(archive)),
        Err(error @ super::archive::ArchiveError::Io { .. }) => Err(error),
        Err(error) => {
            let mut result = Static::empty();
            result.findings.whole(id::ARCHIVE_READABLE, error.to_string());
            result.stop(id::ARCHIVE_PATH, "the archive cannot be read");
            Ok(result)
        }
    }
}

impl Static {
    fn empty() -> Self {
        let findings = Findings::default();
        Self {
            findings,
            archive: None,
            description: None,
            source: Vec::new(),
            untested: Vec::new(),
            fmi: Fmi::Two,
            foreign: None,
        }
    }

    /// Notes that the static rules from this one on were not tested.
    fn stop(&mut self, from: Id, why: &str) {
        let rest = RULES.iter().skip_while(|r| !r.is(from)).filter(|r| r.is_static());
        self.untested.extend(rest.map(|r| (r.id, why.to_owned())));
    }
}

/// Runs every static rule on an open archive.
pub(crate) fn check_archive(mut archive: Archive) -> Static {
    let mut result = Static::empty();
    let safe = package::entries(&mut archive, &mut result.findings);
    if !safe {
        let why = "the entries were not inflated because of the findings above";
        result.untested.extend([id::ARCHIVE_DAMAGED, id::ARCHIVE_BOMB].map(|id| (id.text(), why.to_owned())));
    }
    if !package::description(&archive, &mut result.findings) {
        result.stop(id::XML_WELL_FORMED, "there is no modelDescription.xml");
        return result;
    }
    let Ok(bytes) = archive.read("modelDescription.xml") else {
        // The entry's damage is reported already.
        result.stop(id::XML_WELL_FORMED, "modelDescription.xml cannot be read");
        return result;
    };
    let Some(description) = check_description(&bytes, &mut result) else { return result };
    package::layout(&mut archive, &description, &mut result.findings);
    result.description = Some(description);
    result.archive = safe.then_some(archive);
    result
}

/// Runs the rules on `modelDescription.xml`; the description, when it is fit to be relied on.
pub(crate) fn check_description(bytes: &[u8], result: &mut Static) -> Option<Description> {
    let document = match Document::parse(bytes) {
        Ok(document) => document,
        Err(error) => {
            result.source = String::from_utf8_lossy(bytes).lines().map(str::to_owned).collect();
            result.findings.at(id::XML_WELL_FORMED, error.position, error.message);
            result.stop(id::FMI_VERSION, "modelDescription.xml is not well-formed");
            return None;
        }
    };
    result.source = document.source.lines().map(str::to_owned).collect();
    let findings = &mut result.findings;
    if let Some(version) = document::foreign(&document.root) {
        result.foreign = Some(version.to_owned());
        result.stop(id::FMI_VERSION, "this is neither FMI 2.0 nor 3.0");
        return None;
    }
    result.fmi = document.root.get("fmiVersion").and_then(Fmi::of).unwrap_or_default();
    if !document::root(&document.root, findings) {
        result.stop(id::INTERFACE_MISSING, "this is no model description of FMI");
        return None;
    }
    match result.fmi {
        Fmi::Two => schema2::check(&document.root, findings),
        Fmi::Three => schema3::check(&document.root, findings),
    }
    // What the schema refuses reads as its default below; findings that follow from that would mislead.
    if [id::SCHEMA_ELEMENT, id::SCHEMA_REQUIRED, id::SCHEMA_VALUE, id::INTERFACE_MISSING]
        .iter()
        .any(|r| findings.has(*r))
    {
        result.stop(id::GUID, "the schema's findings come first");
        return None;
    }
    let description = Description::from_document(&document);
    document::check(&description, &document.root, findings);
    units::check(&description, findings);
    variables::check(&description, findings);
    structure::check(&description, findings);
    if result.fmi == Fmi::Three {
        three::check(&document.root, findings);
        clocks::check(&document.root, findings);
    }
    Some(description)
}
