//! Tests the behavioural rules: each in a child process, the first ones in order, the rest in parallel.

use std::io;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use super::super::behaviour::probe::Learned;
use super::super::description::{BaseType, Description, Fmi};
use super::super::host;
use super::super::isolation::{
    self, Bounds, Ended, Fence, Job, Outcome, Place, Reply, Strength, Task, sandbox, temporary,
};
use super::super::rules::{self, Finding, Id, Rule, RuleStatus, id};
use super::{Options, ValidationError};

/// Rules that must pass before the others make sense, in order.
const GATES: [Id; 13] = [
    id::BINARY_LOAD,
    id::BINARY_SYMBOLS,
    id::INSTANTIATE,
    id::INITIALISE,
    id::SETUP_ENDLESS,
    id::VARIABLE_READABLE,
    id::ARRAY_BOUNDS,
    id::SIMULATE,
    id::STEP_STATUS,
    id::INSTANCES_REPEATED,
    id::TERMINATE,
    id::STRING_VALUES,
    id::DETERMINISM,
];
/// Those of them that the others make sense without: what fails is compared no more, but what else the FMU does is tested.
const OPEN: [Id; 2] = [id::STRING_VALUES, id::DETERMINISM];

/// Rules whose failure may be the sandbox's doing.
pub(super) const NEEDY: [Id; 5] =
    [id::BINARY_LOAD, id::INSTANTIATE, id::INITIALISE, id::VARIABLE_READABLE, id::SIMULATE];

/// A call may take this many times what the longest call of the default experiment took.
const PATIENCE: u32 = 20;
/// Before that is known, this many times the limit of a call.
const FIRST: u32 = 2;
/// What is left of the budget must be this much for a rule to be tried.
const LEAST: Duration = Duration::from_millis(50);

fn is_one_of(rule: &Rule, ids: &[Id]) -> bool {
    ids.iter().any(|id| rule.is(*id))
}

pub(super) type Tested = (&'static Rule, RuleStatus, Vec<Finding>);

pub(super) struct Bench<'a> {
    folder: &'a Path,
    binary_path: PathBuf,
    scratch: tempfile::TempDir,
    options: &'a Options,
    progress: &'a (dyn Fn(&str, usize) + Sync),
    fmi: Fmi,
    total: usize,
    /// References of all Strings.
    strings: Vec<u32>,
    /// Whether the FMU declares that it needs its tool to run.
    needs_tool: bool,
    begin: Instant,
    /// Longest call so far, and whether the default experiment has been run.
    longest: Mutex<(Duration, bool)>,
    /// The weakest sandbox of all children.
    strength: Mutex<Option<Strength>>,
    /// Panics of the validator's own code, each with its rule.
    faults: Mutex<Vec<String>>,
}

impl<'a> Bench<'a> {
    pub fn new(
        description: &Description,
        folder: &'a Path,
        options: &'a Options,
        progress: &'a (dyn Fn(&str, usize) + Sync),
    ) -> Result<Self, ValidationError> {
        let interface = description.co_simulation.as_ref().expect("`prepare` lets co-simulation through alone");
        let binary_path = host::binary_file(folder, description.fmi, interface).map_err(io::Error::other)?;
        Ok(Self {
            folder,
            binary_path,
            scratch: temporary::folder()?,
            options,
            progress,
            fmi: description.fmi,
            total: rules::of(description.fmi).filter(|r| !r.is_static()).count(),
            strings: description
                .variables
                .iter()
                .filter(|v| v.base() == BaseType::String)
                .map(|v| v.value_reference)
                .collect(),
            needs_tool: interface.needs_execution_tool,
            begin: Instant::now(),
            longest: Mutex::new((Duration::ZERO, false)),
            strength: Mutex::new(None),
            faults: Mutex::default(),
        })
    }

    /// What is to be printed of the sandbox.
    pub fn gap(&self) -> Option<&'static str> {
        self.strength.lock().unwrap_or_else(PoisonError::into_inner).filter(|_| self.options.sandbox)?.gap()
    }

    /// Which rules the validator's own code failed in.
    pub fn faults(&self) -> Vec<String> {
        self.faults.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    pub fn run(&self) -> Result<Vec<Tested>, ValidationError> {
        let mut tested = Vec::new();
        let mut learned = Learned::default();
        let mut blocked: Option<String> = None;
        let gates = GATES.iter().filter_map(|id| rules::rule(id.text())).filter(|r| r.section(self.fmi).is_some());
        for rule in gates {
            if let Some(why) = &blocked {
                tested.push((rule, RuleStatus::NotTested(why.clone()), vec![]));
                continue;
            }
            let (mut result, more) = self.test(rule, &learned)?;
            match more {
                Some(more) => learned = more,
                // The process ended over a text: which one is not known.
                None if rule.is(id::STRING_VALUES) && result.1 == RuleStatus::Failed => {
                    learned.no_texts.clone_from(&self.strings);
                }
                None => {}
            }
            if self.needs_tool && result.1 == RuleStatus::Failed && is_one_of(rule, &[id::BINARY_LOAD, id::INSTANTIATE])
            {
                // The tool may not be here, which is no fault of the FMU.
                let first = result.2.first().map_or(String::new(), |f| format!(": {}", f.message));
                let why = format!("the FMU needs its tool to run (needsExecutionTool){first}");
                result = (rule, RuleStatus::NotTested(why.clone()), vec![]);
            }
            match &result.1 {
                _ if is_one_of(rule, &OPEN) => {}
                RuleStatus::Failed => blocked = Some(format!("{} must pass first", rule.id)),
                RuleStatus::NotTested(why) => blocked = Some(why.clone()),
                _ => {}
            }
            tested.push(result);
        }
        let rest: Vec<&'static Rule> = rules::of(self.fmi)
            .filter(|r| !r.is_static() && !is_one_of(r, &GATES))
            .filter(|r| self.options.selects(r))
            .collect();
        if let Some(why) = blocked {
            tested.extend(rest.into_iter().map(|rule| (rule, RuleStatus::NotTested(why.clone()), vec![])));
            return Ok(tested);
        }
        let next = AtomicUsize::new(0);
        let results = Mutex::new(Vec::new());
        std::thread::scope(|scope| {
            for _ in 0..self.options.jobs.max(1) {
                scope.spawn(|| {
                    while let Some(rule) = rest.get(next.fetch_add(1, Ordering::Relaxed)) {
                        let result = self.test(rule, &learned);
                        results.lock().unwrap_or_else(PoisonError::into_inner).push(result);
                    }
                });
            }
        });
        for result in results.into_inner().unwrap_or_else(PoisonError::into_inner) {
            tested.push(result?.0);
        }
        Ok(tested)
    }

    fn out_of_budget(&self) -> RuleStatus {
        let budget = self.options.budget.as_secs_f64();
        RuleStatus::NotTested(format!("the budget of {budget} s was used up; --budget gives more"))
    }

    /// Tests one rule in a child process.
    fn test(&self, rule: &'static Rule, learned: &Learned) -> Result<(Tested, Option<Learned>), ValidationError> {
        let left = self.options.budget.saturating_sub(self.begin.elapsed());
        if left < LEAST {
            (self.progress)(rule.id, self.total);
            return Ok(((rule, self.out_of_budget(), vec![]), None));
        }
        let (longest, known) = *self.longest.lock().unwrap_or_else(PoisonError::into_inner);
        let call = if known { self.options.call.max(PATIENCE * longest) } else { FIRST * self.options.call };
        let fence = self.options.sandbox.then(|| Fence {
            read: self.options.allow.iter().cloned().chain(sandbox::configured()).collect(),
            write: vec![self.folder.to_owned()],
        });
        let place = Place {
            program: &self.options.program,
            scratch: self.scratch.path().join(rule.id),
            fence,
            bounds: Bounds {
                call: Some(call),
                total: Some(left),
                memory: Some(self.options.memory),
                ..Bounds::default()
            },
            exact_heap: true,
        };
        let job = |learned: &Learned| {
            Job::Rule(Task {
                rule: rule.id.to_owned(),
                folder: self.folder.to_owned(),
                binary_path: self.binary_path.clone(),
                workplace: place.workplace(),
                learned: learned.clone(),
            })
        };
        let mut outcome = isolation::run(&place, job(learned))?;
        if outcome.ended.is_from_outside() {
            // Someone ended the process, or the FMU does so itself: run again to distinguish them.
            outcome = isolation::run(&place, job(learned))?;
        }
        if rule.is(id::INSTANCES_REPEATED) && outcome.chosen_values && outcome.ended != Ended::Well {
            // It fails with inputs that vary; with constant ones it can be tested all the same.
            let tame = Learned { tame: true, ..learned.clone() };
            outcome = isolation::run(&place, job(&tame))?;
        }
        if is_one_of(rule, &GATES) {
            // What is slow is given time in proportion.
            let mut longest = self.longest.lock().unwrap_or_else(PoisonError::into_inner);
            longest.0 = longest.0.max(outcome.longest);
            longest.1 |= rule.is(id::SIMULATE);
        }
        {
            let mut strength = self.strength.lock().unwrap_or_else(PoisonError::into_inner);
            if strength.is_none_or(|s| s.gap().is_none()) {
                *strength = Some(outcome.strength);
            }
        }
        let (status, findings, learned) = self.status_of(rule, outcome);
        (self.progress)(rule.id, self.total);
        Ok(((rule, status, findings), learned))
    }

    fn status_of(&self, rule: &'static Rule, outcome: Outcome) -> (RuleStatus, Vec<Finding>, Option<Learned>) {
        // The temporary folder's name is of no use, and would differ from run to run.
        let folders = [self.folder, self.scratch.path()].map(|folder| format!("{}/", folder.display()));
        let finding = |message: String, call: Option<String>| Finding {
            rule: rule.id.into(),
            message: folders.iter().fold(message, |text, folder| text.replace(folder, "")),
            place: None,
            call,
            advice: None,
        };
        let none = host::abi::CALLS[0];
        let within = Some(outcome.call).filter(|c| *c != none).map(str::to_owned);
        let printed = outcome.stderr.lines().rfind(|line| !line.trim().is_empty());
        let printed = printed.map_or(String::new(), |line| format!("; it printed: {line}"));
        let after = || match outcome.last {
            last if last == none || within.is_some() => String::new(),
            last => format!(", after {last}"),
        };
        let reply = outcome.reply.as_deref().and_then(Reply::decode).map(|(reply, _)| reply);
        if let Some(internal) = reply.as_ref().and_then(Reply::internal_error) {
            self.faults.lock().unwrap_or_else(PoisonError::into_inner).push(format!("{}: {internal}", rule.id));
            return (RuleStatus::NotTested(internal), vec![], None);
        }
        // Before the library is loaded, nothing of the FMU has run.
        let idle = outcome.last == none && outcome.reply.is_none();
        let died = match &outcome.ended {
            Ended::Exited(_) | Ended::Signal(_) if idle => {
                let why = format!("no process could be had to test in: {}", outcome.stderr.trim());
                return (RuleStatus::NotTested(why), vec![], None);
            }
            Ended::Slow(_) => return (self.out_of_budget(), vec![], reply.map(|a| a.learned)),
            Ended::Signal(signal) => {
                Some(format!("the FMU crashed: {}{}{printed}", isolation::signal_name(*signal), after()))
            }
            Ended::Hangs(limit) => Some(format!("the FMU hangs: no end after {} s", limit.as_secs_f64())),
            Ended::Exited(code) => {
                Some(format!("the FMU ended its host's process with exit code {code}{}{printed}", after()))
            }
            Ended::Disk(bytes) => Some(format!("the FMU wrote {} MB to the disk", bytes / 1_000_000)),
            Ended::Forges => Some(format!("the FMU wrote to its host's own descriptor{}", after())),
            Ended::Well if reply.is_none() => {
                Some(format!("the FMU ended its host's process with exit code 0{}", after()))
            }
            Ended::Well => None,
        };
        if let Some(message) = died.as_ref().filter(|_| outcome.chosen_values) {
            // Nothing declares that the model allows these values.
            let why = format!("with other parameters and start values than its own, {message}");
            return (RuleStatus::NotTested(why), vec![], reply.map(|a| a.learned));
        }
        if let Some(message) = died.as_ref().filter(|_| rule.is_aside()) {
            return (RuleStatus::NotTested(message.clone()), vec![], reply.map(|a| a.learned));
        }
        if died.is_some() && rule.is(id::REFERENCE_BITS) {
            let why = "reading an unknown value reference ends the process".to_owned();
            return (RuleStatus::NotTested(why), vec![], reply.map(|a| a.learned));
        }
        if let Some(message) = died {
            let advice = Some(match &outcome.ended {
                Ended::Signal(_) => {
                    "Find the fault in the call named, with a debugger or a sanitizer: the host dies with it."
                }
                Ended::Hangs(_) => "Bound loops and waits, and return fmi2Error or fmi2Discard when they do not end.",
                Ended::Disk(_) => "Write less, to a temporary folder, and remove it in fmi2FreeInstance.",
                Ended::Forges => "Write to descriptors that the FMU has opened, and close no others.",
                _ => "Never call exit in an FMU: return fmi2Error or fmi2Fatal, and leave the process to its host.",
            });
            // A rule on what an FMU survives has its own.
            let advice = advice.filter(|_| is_one_of(rule, &GATES)).map(str::to_owned);
            let finding = Finding { advice, ..finding(message, within) };
            return self.allowing_for_the_sandbox(rule, vec![finding], outcome.refused, None);
        }
        let Some(reply) = reply else { return (RuleStatus::NotTested("no answer".into()), vec![], None) };
        let mut findings: Vec<Finding> = reply.findings.into_iter().map(|(m, call)| finding(m, call)).collect();
        if rule.is(id::SIDE_STDOUT) && !outcome.stdout.is_empty() {
            let line = outcome.stdout.lines().next().unwrap_or("").chars().take(80).collect::<String>();
            findings.push(finding(format!("the FMU prints to standard output: {line:?}"), None));
        }
        let learned = Some(reply.learned);
        if !findings.is_empty() {
            return self.allowing_for_the_sandbox(rule, findings, outcome.refused, learned);
        }
        let status = match (reply.not_tested, reply.not_applicable) {
            (Some(why), _) => RuleStatus::NotTested(why),
            (_, Some(why)) => RuleStatus::NotApplicable(why),
            _ => RuleStatus::Passed,
        };
        (status, findings, learned)
    }

    /// An FMU that does not start because the sandbox refuses what it asks for has not been tested.
    fn allowing_for_the_sandbox(
        &self,
        rule: &Rule,
        findings: Vec<Finding>,
        refused: Option<&'static str>,
        learned: Option<Learned>,
    ) -> (RuleStatus, Vec<Finding>, Option<Learned>) {
        let denied = || findings.iter().any(|f| f.message.contains("Permission denied"));
        let first = findings.first().map_or("", |f| f.message.as_str());
        let why = match refused {
            _ if !self.options.sandbox || !is_one_of(rule, &NEEDY) => None,
            Some(what) => Some(format!("the FMU asked for {what}, which the sandbox refuses ({first})")),
            None if denied() => Some(format!("the sandbox keeps files from the FMU ({first})")),
            None => None,
        };
        match why {
            Some(why) => {
                let why = format!("{why}; --allow FOLDER opens a folder, --no-sandbox runs the FMU with your rights");
                (RuleStatus::NotTested(why), vec![], learned)
            }
            None => (RuleStatus::Failed, findings, learned),
        }
    }
}

#[cfg(all(test, target_os = "linux"))]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    const NAME: &str = "validation::bench::tests::a_child";

    fn described(interface: &str) -> String {
        format!(
            "<fmiModelDescription fmiVersion=\"2.0\" modelName=\"m\" guid=\"g\"><{interface} modelIdentifier=\"m\"/>\
             <ModelVariables/><ModelStructure/></fmiModelDescription>"
        )
    }

    /// The child of the test below: this test's program, started again.
    #[test]
    #[ignore = "is the child process of another test"]
    fn a_child() {
        let _ = isolation::child();
    }

    #[test]
    fn a_panic_of_the_validator_is_told_as_its_own_and_not_as_the_fmus() {
        let folder = tempfile::tempdir().unwrap();
        // Any library that can be loaded: the C library, which this process has already.
        let maps = std::fs::read_to_string("/proc/self/maps").unwrap();
        let library =
            maps.lines().filter_map(|line| line.split_whitespace().nth(5)).find(|path| path.contains("libc."));
        let binaries = folder.path().join("binaries/linux64");
        std::fs::create_dir_all(&binaries).unwrap();
        std::fs::copy(library.unwrap(), binaries.join("m.so")).unwrap();
        let description = Description::parse(described("CoSimulation").as_bytes()).unwrap();
        // The child finds another description than the parent: one that no rule is ever run on.
        std::fs::write(folder.path().join("modelDescription.xml"), described("ModelExchange")).unwrap();

        // `sh validate --child` in the child's working directory starts this test's program again.
        let options = Options { sandbox: false, ..Options::new("/bin/sh".into()) };
        let bench = Bench::new(&description, folder.path(), &options, &|_, _| {}).unwrap();
        let workplace = bench.scratch.path().join(id::BINARY_SYMBOLS.text()).join("workplace");
        std::fs::create_dir_all(&workplace).unwrap();
        let program = std::env::current_exe().unwrap();
        let script = format!("exec '{}' --exact {NAME} --ignored --nocapture\n", program.display());
        std::fs::write(workplace.join("validate"), script).unwrap();

        let rule = rules::rule(id::BINARY_SYMBOLS.text()).unwrap();
        let ((_, status, findings), _) = bench.test(rule, &Learned::default()).unwrap();
        assert!(findings.is_empty(), "{findings:?}");
        let RuleStatus::NotTested(why) = status else { panic!("{status:?}") };
        for part in ["internal error of eixo", "not of the FMU", "only co-simulation FMUs are probed", "probe.rs"] {
            assert!(why.contains(part), "{part}: {why}");
        }
        assert_eq!(bench.faults(), [format!("{}: {why}", rule.id)]);
    }
}
