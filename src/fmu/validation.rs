//! A whole validation: the static rules here, then each behavioural rule in a child process.

use std::collections::HashMap;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, OnceLock};
use std::time::{Duration, Instant};

use super::behaviour::probe::Learned;
use super::description::Description;
use super::host;
use super::isolation::{self, Bounds, Ended, Outcome, Task};
use super::rules::{self, Check, Finding, RULES, Report, Rule, Verdict};

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
    /// Limits of each behavioural rule.
    pub bounds: Bounds,
    /// This program, which tests a rule when called as `program validate --child <task>`.
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
    /// The system refused something that the child processes need.
    #[error("cannot run the rules: {0}")]
    Io(#[from] io::Error),
}

impl Options {
    fn wants(&self, rule: &Rule) -> bool {
        let named = |list: &[String]| list.iter().any(|id| id == rule.id);
        (self.only.is_empty() || named(&self.only)) && !named(&self.skip)
    }
}

/// Validates a file. `progress` is told of each behavioural rule that is done, and how many there are.
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
    let mut verdicts: HashMap<&str, Verdict> = HashMap::new();
    let mut remarks = Vec::new();
    for rule in RULES.iter().filter(|r| r.check.is_static()) {
        let untested = result.untested.iter().find(|(id, _)| *id == rule.id);
        let verdict = match untested {
            _ if result.findings.has(rule.id) => Verdict::Failed,
            Some((_, why)) => Verdict::NotTested(why.clone()),
            None => Verdict::Passed,
        };
        verdicts.insert(rule.id, verdict);
    }
    let mut findings = std::mem::take(&mut result.findings.list);
    let model = result.description.as_ref().map(|d| d.model_name.clone());
    match prepare(&mut result, options) {
        Ok((description, folder)) => {
            let bench = Bench::new(&description, folder.path(), options, progress)?;
            for (rule, verdict, found) in bench.run()? {
                verdicts.insert(rule.id, verdict);
                findings.extend(found);
            }
        }
        Err(why) => {
            if why.starts_with("this is a model exchange FMU") {
                remarks.push(
                    "This is a model exchange FMU: its behaviour was not tested, only its archive and XML.".into(),
                );
            }
            for rule in RULES.iter().filter(|r| !r.check.is_static()) {
                verdicts.insert(rule.id, Verdict::NotTested(why.clone()));
            }
        }
    }
    let rules: Vec<_> = RULES
        .iter()
        .map(|rule| {
            let verdict = verdicts.remove(rule.id).unwrap_or(Verdict::Skipped);
            (rule, if options.wants(rule) { verdict } else { Verdict::Skipped })
        })
        .collect();
    findings.retain(|f| rules::rule(&f.rule).is_some_and(|r| options.wants(r)));
    findings.sort_by_key(|f| RULES.iter().position(|r| r.id == f.rule));
    Ok(Report { file: path.display().to_string(), model, rules, findings, remarks, source: result.source })
}

/// Extracts the FMU for the behavioural rules, or says why they are not tested.
fn prepare(result: &mut rules::Static, options: &Options) -> Result<(Description, tempfile::TempDir), String> {
    let description = result.description.take().ok_or("modelDescription.xml must be in order first")?;
    if options.static_only {
        return Err("only the archive and the XML were to be tested".into());
    }
    let Some(interface) = &description.co_simulation else {
        return Err("this is a model exchange FMU".into());
    };
    let archive = result.archive.as_mut().ok_or("the archive must be safe to extract first")?;
    let folder = archive.extract().map_err(|error| error.to_string())?;
    host::binary_file(folder.path(), interface).map_err(|error| error.to_string())?;
    Ok((description, folder))
}

/// Rules that must pass before the others make sense, in order.
const GATES: [&str; 9] = [
    "binary-load",
    "binary-symbols",
    "instantiate",
    "initialise",
    "variable-readable",
    "simulate",
    "step-status",
    "terminate",
    "determinism",
];

type Tested = (&'static Rule, Verdict, Vec<Finding>);

struct Bench<'a> {
    folder: &'a Path,
    binary_path: PathBuf,
    scratch: tempfile::TempDir,
    options: &'a Options,
    progress: &'a (dyn Fn(&str, usize) + Sync),
    total: usize,
    /// Whether the FMU says that it needs its tool to run.
    needs_tool: bool,
    /// Time limit that an FMU as slow as this one needs.
    slow: OnceLock<Duration>,
}

/// Time limit of a rule, in times that the default experiment takes.
const SLOWNESS: u32 = 15;

impl<'a> Bench<'a> {
    fn new(
        description: &Description,
        folder: &'a Path,
        options: &'a Options,
        progress: &'a (dyn Fn(&str, usize) + Sync),
    ) -> Result<Self, ValidationError> {
        let interface = description.co_simulation.as_ref().expect("`prepare` lets co-simulation through alone");
        let binary_path = host::binary_file(folder, interface).map_err(io::Error::other)?;
        let scratch = tempfile::Builder::new().prefix("eixo-validate-").tempdir()?;
        let total = RULES.iter().filter(|r| !r.check.is_static()).count();
        Ok(Self {
            folder,
            binary_path,
            scratch,
            options,
            progress,
            total,
            needs_tool: interface.needs_execution_tool,
            slow: OnceLock::new(),
        })
    }

    fn run(&self) -> Result<Vec<Tested>, ValidationError> {
        let mut tested = Vec::new();
        let mut learned = Learned::default();
        let mut blocked: Option<String> = None;
        let gates = GATES.iter().filter_map(|id| rules::rule(id));
        for rule in gates {
            if let Some(why) = &blocked {
                tested.push((rule, Verdict::NotTested(why.clone()), vec![]));
                continue;
            }
            let (mut result, more) = self.test(rule, &learned)?;
            if let Some(more) = more {
                learned = more;
            }
            if self.needs_tool && result.1 == Verdict::Failed && ["binary-load", "instantiate"].contains(&rule.id) {
                // The tool may not be here, which is no fault of the FMU.
                let first = result.2.first().map_or(String::new(), |f| format!(": {}", f.message));
                let why = format!("the FMU needs its tool to run (needsExecutionTool){first}");
                result = (rule, Verdict::NotTested(why.clone()), vec![]);
                blocked = Some(why);
            }
            // A run that differs from its like is compared no more, but what else it does is tested.
            if result.1 == Verdict::Failed && rule.id != "determinism" {
                blocked = Some(format!("{} must pass first", rule.id));
            }
            tested.push(result);
        }
        let rest: Vec<&'static Rule> = RULES
            .iter()
            .filter(|r| !r.check.is_static() && !GATES.contains(&r.id))
            .filter(|r| self.options.wants(r))
            .collect();
        if let Some(why) = blocked {
            tested.extend(rest.into_iter().map(|rule| (rule, Verdict::NotTested(why.clone()), vec![])));
            return Ok(tested);
        }
        let next = AtomicUsize::new(0);
        let results = Mutex::new(Vec::new());
        std::thread::scope(|scope| {
            for _ in 0..self.options.jobs.max(1) {
                scope.spawn(|| {
                    while let Some(rule) = rest.get(next.fetch_add(1, Ordering::Relaxed)) {
                        let result = self.test(rule, &learned);
                        results.lock().unwrap_or_else(std::sync::PoisonError::into_inner).push(result);
                    }
                });
            }
        });
        for result in results.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner) {
            tested.push(result?.0);
        }
        Ok(tested)
    }

    /// Tests one rule in a child process.
    fn test(&self, rule: &'static Rule, learned: &Learned) -> Result<(Tested, Option<Learned>), ValidationError> {
        let scratch = self.scratch.path().join(rule.id);
        let workplace = scratch.join("workplace");
        fs::create_dir_all(&workplace)?;
        let task = Task {
            rule: rule.id.to_owned(),
            folder: self.folder.to_owned(),
            binary_path: self.binary_path.clone(),
            workplace,
            slot: scratch.join("slot"),
            result: scratch.join("result.json"),
            memory: self.options.bounds.memory,
            learned: learned.clone(),
        };
        let bounds = Bounds {
            time: self.options.bounds.time.max(self.slow.get().copied().unwrap_or_default()),
            ..self.options.bounds
        };
        let begin = Instant::now();
        let mut outcome = isolation::run(&self.options.program, &task, &scratch, bounds)?;
        if outcome.ended.is_from_outside() {
            // Someone ended the process, or the FMU does so itself: again, to tell.
            outcome = isolation::run(&self.options.program, &task, &scratch, bounds)?;
        }
        if rule.id == "simulate" {
            // What is slow is given time in proportion.
            let _ = self.slow.set(SLOWNESS * begin.elapsed());
        }
        let learned = outcome.answer.as_ref().map(|a| a.learned.clone());
        let (verdict, findings) = self.judge(rule, outcome);
        (self.progress)(rule.id, self.total);
        Ok(((rule, verdict, findings), learned))
    }

    fn judge(&self, rule: &'static Rule, outcome: Outcome) -> (Verdict, Vec<Finding>) {
        // The temporary folder's name says nothing, and would differ from run to run.
        let folder = format!("{}/", self.folder.display());
        let finding = |message: String, call: Option<String>| Finding {
            rule: rule.id.into(),
            message: message.replace(&folder, ""),
            place: None,
            call,
        };
        let call = outcome.call.to_owned();
        let within = Some(call).filter(|c| c != host::abi::CALLS[0]);
        let said = outcome.stderr.lines().last().filter(|l| !l.trim().is_empty());
        let said = said.map_or(String::new(), |line| format!("; it printed: {line}"));
        let died = match &outcome.ended {
            Ended::Signal(signal) => Some(format!("the FMU crashed: {}{said}", isolation::signal_name(*signal))),
            Ended::TimedOut => {
                Some(format!("the FMU hangs: no end after {} s", self.options.bounds.time.as_secs_f64()))
            }
            Ended::Exited(code) => Some(format!("the FMU ended its host's process with exit code {code}{said}")),
            Ended::Well if outcome.answer.is_none() => Some("the FMU ended its host's process with exit code 0".into()),
            Ended::Well => None,
        };
        if let Some(message) = died {
            return (Verdict::Failed, vec![finding(message, within)]);
        }
        let Some(answer) = outcome.answer else { return (Verdict::NotTested("no answer".into()), vec![]) };
        let mut findings: Vec<Finding> = answer.findings.into_iter().map(|(m, call)| finding(m, call)).collect();
        if rule.id == "side-stdout" && !outcome.stdout.is_empty() {
            let line = outcome.stdout.lines().next().unwrap_or("").chars().take(80).collect::<String>();
            findings.push(finding(format!("the FMU prints to standard output: {line:?}"), None));
        }
        let verdict = match (answer.not_tested, answer.not_applicable) {
            _ if !findings.is_empty() => Verdict::Failed,
            (Some(why), _) => Verdict::NotTested(why),
            (_, Some(why)) => Verdict::NotApplicable(why),
            _ => Verdict::Passed,
        };
        (verdict, findings)
    }
}

impl Check {
    /// Whether the rule is tested without running the FMU.
    #[must_use]
    pub fn is_static(self) -> bool {
        matches!(self, Self::Static)
    }
}
