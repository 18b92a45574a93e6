//! A validation: the static rules here, then each behavioural rule in a child process.

mod bench;

use std::collections::HashMap;
use std::io;
use std::path::{Path, PathBuf};
use std::time::Duration;

use super::description::{Description, Fmi};
use super::host;
use super::rules::{self, Report, Rule, RuleStatus, wording};
use bench::Bench;

/// What to validate and how.
#[derive(Debug, Clone)]
pub struct Options {
    /// Only these rules, when there are any.
    pub only: Vec<String>,
    /// None of these rules.
    pub skip: Vec<String>,
    /// No behavioural rules: nothing of the FMU is run.
    pub static_only: bool,
    /// Rules tested at the same time.
    pub jobs: usize,
    /// Longest time that a call of an FMI function may take; an FMU that is slow by itself is given more.
    pub call: Duration,
    /// Longest time of the validation; rules left after it are not tested.
    pub budget: Duration,
    /// Address space of each behavioural rule, in bytes.
    pub memory: u64,
    /// Whether the FMU runs behind the fence of [`super::isolation::sandbox`].
    pub sandbox: bool,
    /// Files and folders that the FMU may read in addition to the system's.
    pub allow: Vec<PathBuf>,
    /// This program, which tests a rule when called as `program validate --child`.
    pub program: PathBuf,
}

/// Why a validation could not run.
#[derive(Debug, thiserror::Error)]
pub enum ValidationError {
    /// The file cannot be read.
    #[error(transparent)]
    Archive(#[from] super::archive::ArchiveError),
    /// No rule of that name.
    #[error("there is no rule {0}; `eixo validate --rules` lists them")]
    NoRule(String),
    /// Another version of FMI.
    #[error("{}: this FMU is of FMI {version}, and the rules are those of FMI 2.0 and 3.0: nothing was tested", file.display())]
    Version {
        /// The file.
        file: PathBuf,
        /// What it says.
        version: String,
    },
    /// The system refused something that the child processes need.
    #[error("cannot run the rules: {0}")]
    Io(#[from] io::Error),
}

impl Options {
    /// Every rule, in the sandbox, as many at a time as there are processors.
    #[must_use]
    pub fn new(program: PathBuf) -> Self {
        Self {
            only: Vec::new(),
            skip: Vec::new(),
            static_only: false,
            jobs: std::thread::available_parallelism().map_or(1, usize::from),
            call: Duration::from_secs(10),
            budget: Duration::from_secs(60),
            memory: 8 << 30,
            sandbox: true,
            allow: Vec::new(),
            program,
        }
    }

    fn selects(&self, rule: &Rule) -> bool {
        let named = |list: &[String]| list.iter().any(|id| id == rule.id);
        (self.only.is_empty() || named(&self.only)) && !named(&self.skip)
    }
}

/// Validates a file. `progress` is called after each behavioural rule with how many are done, and how many there are.
///
/// # Errors
/// When the file cannot be read, a rule does not exist, or no child process can be started.
pub fn validate(
    path: &Path,
    options: &Options,
    progress: &(dyn Fn(&str, usize) + Sync),
) -> Result<Report, ValidationError> {
    if let Some(id) = options.only.iter().chain(&options.skip).find(|id| rules::rule(id).is_none()) {
        return Err(ValidationError::NoRule(id.clone()));
    }
    let mut result = rules::check_file(path)?;
    if let Some(version) = result.foreign.take() {
        return Err(ValidationError::Version { file: path.to_owned(), version });
    }
    let mut statuses: HashMap<&str, RuleStatus> = HashMap::new();
    let mut remarks = Vec::new();
    let fmi = result.fmi;
    for rule in rules::of(fmi).filter(|r| r.is_static()) {
        let untested = result.untested.iter().find(|(id, _)| *id == rule.id);
        let status = match untested {
            _ if result.findings.list.iter().any(|f| f.rule == rule.id) => RuleStatus::Failed,
            Some((_, why)) => RuleStatus::NotTested(why.clone()),
            None => RuleStatus::Passed,
        };
        statuses.insert(rule.id, status);
    }
    let mut findings = std::mem::take(&mut result.findings.list);
    let model = result.description.as_ref().map(|d| d.model_name.clone());
    match prepare(&mut result, options) {
        Ok((description, folder)) => {
            let bench = Bench::new(&description, folder.path(), options, progress)?;
            for (rule, status, found) in bench.run()? {
                statuses.insert(rule.id, status);
                findings.extend(found);
            }
            remarks.extend(bench.faults());
            remarks.extend(bench.gap().map(str::to_owned));
            remarks.extend(untested(&description));
            if options.sandbox && bench::NEEDY.iter().any(|id| statuses.get(id.text()) == Some(&RuleStatus::Failed)) {
                remarks.push("It failed in the sandbox; --no-sandbox, for an FMU that you trust, tells whether it does outside too.".into());
            }
        }
        Err(why) => {
            if why.starts_with("this is a scheduled execution FMU") {
                remarks.push(
                    "This is a scheduled execution FMU: its behaviour was not tested, only its archive and XML.".into(),
                );
            }
            if why.starts_with("this is a model exchange FMU") {
                remarks.push(
                    "This is a model exchange FMU: its behaviour was not tested, only its archive and XML.".into(),
                );
            }
            for rule in rules::of(fmi).filter(|r| !r.is_static()) {
                statuses.insert(rule.id, RuleStatus::NotTested(why.clone()));
            }
        }
    }
    let rules: Vec<_> = rules::of(fmi)
        .map(|rule| {
            let status = statuses.remove(rule.id).unwrap_or(RuleStatus::Skipped);
            (rule, if options.selects(rule) { status } else { RuleStatus::Skipped })
        })
        .collect();
    findings.retain(|f| rules::rule(&f.rule).is_some_and(|r| options.selects(r)));
    findings.sort_by_key(|f| rules::of(fmi).position(|r| r.id == f.rule));
    for finding in findings.iter_mut().filter(|_| fmi == Fmi::Three) {
        finding.message = wording::in_fmi3(&finding.message);
        finding.advice = finding.advice.as_deref().map(wording::in_fmi3);
    }
    Ok(Report {
        file: path.display().to_string(),
        model,
        fmi,
        rules,
        findings,
        remarks,
        source: result.source,
        static_only: options.static_only,
    })
}

/// What an FMU of FMI 3.0 declares to offer, and no rule tests.
fn untested(d: &Description) -> Option<String> {
    let mut what: Vec<String> =
        d.co_simulation.iter().flat_map(|i| &i.untested).map(|what| (*what).to_owned()).collect();
    if !d.clocks.is_empty() {
        what.push("clocks and the variables that belong to them, beyond their declaration (2.2.8)".into());
    }
    (!what.is_empty()).then(|| format!("Offered by the FMU and not tested: {}.", what.join(", ")))
}

/// Extracts the FMU for the behavioural rules, or returns why they are not tested.
fn prepare(result: &mut rules::Static, options: &Options) -> Result<(Description, tempfile::TempDir), String> {
    let description = result.description.take().ok_or("modelDescription.xml must be in order first")?;
    if options.static_only {
        return Err("only the archive and the XML were to be tested".into());
    }
    let Some(interface) = &description.co_simulation else {
        let kind = if description.model_exchange.is_some() { "model exchange" } else { "scheduled execution" };
        return Err(format!("this is a {kind} FMU"));
    };
    let archive = result.archive.as_mut().ok_or("the archive must be safe to extract first")?;
    let folder = archive.extract().map_err(|error| error.to_string())?;
    host::binary_file(folder.path(), description.fmi, interface).map_err(|error| error.to_string())?;
    Ok((description, folder))
}
