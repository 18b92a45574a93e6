//! A diagnosis in a process of its own, this program again: so that it can be stopped, and that what it does cannot end the page.

use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// What stands before a line of progress.
pub const PROGRESS: &str = "progress: ";
/// Interval at which a process is polled.
const LOOK: Duration = Duration::from_millis(40);
/// From asking a process to end to ending it.
const GRACE: Duration = Duration::from_secs(2);

/// How far a diagnosis is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum State {
    /// It works.
    Running,
    /// It has ended with a diagnosis.
    Done,
    /// The record does not allow a diagnosis.
    Refused,
    /// It could not run.
    Failed,
    /// It was stopped.
    Stopped,
}

impl State {
    /// Its name.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Running => "running",
            Self::Done => "done",
            Self::Refused => "refused",
            Self::Failed => "failed",
            Self::Stopped => "stopped",
        }
    }
}

/// The status of a job.
#[derive(Debug, Clone)]
pub struct JobStatus {
    /// How far it is.
    pub state: State,
    /// The steps behind it, the present one last: the progress lines of the diagnosis itself.
    pub steps: Vec<String>,
    /// What it printed, or why it could not run.
    pub output: String,
    /// What failed apart from the diagnosis, such as a circle that could not be drawn.
    pub aside: Option<String>,
    /// How long it took, s.
    pub seconds: f64,
}

/// A diagnosis.
#[derive(Debug)]
pub struct Job {
    status: Mutex<JobStatus>,
    stop: AtomicBool,
    began: Instant,
}

impl Job {
    /// Starts one in a folder that holds `axis.toml` and the log. What it prints has lines of so many characters, as many as the
    /// page has room for, where that is known.
    pub fn start(folder: PathBuf, log: String, trust: bool, width: Option<u64>) -> Arc<Self> {
        let status = JobStatus {
            state: State::Running,
            steps: vec!["reading the log".to_owned()],
            output: String::new(),
            aside: None,
            seconds: 0.0,
        };
        let job = Arc::new(Self { status: Mutex::new(status), stop: AtomicBool::new(false), began: Instant::now() });
        let own = Arc::clone(&job);
        std::thread::spawn(move || {
            let state = own.work(&folder, &log, trust, width);
            let mut status = own.lock();
            status.seconds = own.began.elapsed().as_secs_f64();
            status.state = state;
        });
        job
    }

    fn lock(&self) -> MutexGuard<'_, JobStatus> {
        self.status.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Its status now.
    pub fn status(&self) -> JobStatus {
        let mut status = self.lock().clone();
        if status.state == State::Running {
            status.seconds = self.began.elapsed().as_secs_f64();
        }
        status
    }

    /// Ends it.
    pub fn stop(&self) {
        self.stop.store(true, Ordering::SeqCst);
    }

    /// Waits until its process has ended.
    pub fn join(&self) {
        while self.lock().state == State::Running {
            std::thread::sleep(LOOK);
        }
    }

    fn work(&self, folder: &Path, log: &str, trust: bool, width: Option<u64>) -> State {
        let mut diagnose =
            vec!["diagnose", log, "--axis", "axis.toml", "--json", "diagnosis.json", "--report", "report.html"];
        diagnose.extend(["--fmu", "improved.fmu", "--progress", "lines"]);
        if trust {
            diagnose.push("--trust");
        }
        for old in ["diagnosis.json", "report.html", "improved.fmu", "circle.html"] {
            let _ = std::fs::remove_file(folder.join(old));
        }
        let ended = self.run(folder, &diagnose, width);
        if self.stop.load(Ordering::SeqCst) {
            return State::Stopped;
        }
        match ended {
            Ok((Some(0), output, _)) => self.lock().output = output,
            Ok((Some(1), output, _)) => {
                self.lock().output = output;
                return State::Refused;
            }
            Ok((_, _, errors)) => {
                self.lock().output = errors;
                return State::Failed;
            }
            Err(error) => {
                self.lock().output = error.to_string();
                return State::Failed;
            }
        }
        self.lock().steps.push("the circular test".to_owned());
        let circle = ["circle", "axis.toml", "--diagnosed", "diagnosis.json", "--report", "circle.html"];
        match self.run(folder, &circle, width) {
            _ if self.stop.load(Ordering::SeqCst) => return State::Stopped,
            Ok((Some(0 | 1), _, _)) => {}
            Ok((_, _, errors)) => self.lock().aside = Some(errors),
            Err(error) => self.lock().aside = Some(error.to_string()),
        }
        State::Done
    }

    /// Runs this program for the diagnosis.
    fn run(&self, folder: &Path, arguments: &[&str], width: Option<u64>) -> std::io::Result<Ended> {
        run(folder, arguments, width, &self.stop, &|step| self.step(step))
    }

    /// The next step.
    fn step(&self, step: &str) {
        // A count that goes on is one step.
        let counted =
            |s: &str| s.split_once(' ').filter(|(n, _)| n.parse::<u64>().is_ok()).map(|(_, what)| what.to_owned());
        let mut status = self.lock();
        if status.steps.last().is_some_and(|last| counted(last).is_some() && counted(last) == counted(step)) {
            status.steps.pop();
        }
        if status.steps.last().is_none_or(|last| last != step) {
            status.steps.push(step.to_owned());
        }
    }
}

/// How a process ended: exit code, what it printed, its errors.
pub type Ended = (Option<i32>, String, String);

/// Runs this program in a folder until it ends or is to stop; `step` gets its lines of progress. What it prints has lines of `width`
/// characters, where that is given.
///
/// # Errors
/// When it cannot be started, or what it prints not be kept.
pub fn run(
    folder: &Path,
    arguments: &[&str],
    width: Option<u64>,
    stop: &AtomicBool,
    step: &(dyn Fn(&str) + Sync),
) -> std::io::Result<Ended> {
    let printed = folder.join("printed.txt");
    let mut command = Command::new(std::env::current_exe()?);
    command.args(arguments).current_dir(folder).stdin(Stdio::null());
    command.stdout(File::create(&printed)?).stderr(Stdio::piped());
    // Not that of the terminal in which this was started.
    command.env_remove("COLUMNS").envs(width.map(|w| ("COLUMNS", w.to_string())));
    #[cfg(unix)]
    {
        use std::os::unix::process::CommandExt;
        command.process_group(0);
    }
    let mut child = command.spawn()?;
    let errors = child.stderr.take();
    let (status, errors) = std::thread::scope(|scope| {
        let reader = scope.spawn(|| listen(errors, step));
        let status = wait(&mut child, stop);
        (status, reader.join().unwrap_or_default())
    });
    Ok((status?.code(), std::fs::read_to_string(&printed)?, errors))
}

/// Hands on the lines of progress, keeps the others.
fn listen(errors: Option<std::process::ChildStderr>, step: &(dyn Fn(&str) + Sync)) -> String {
    let mut kept = String::new();
    for line in errors.into_iter().flat_map(|e| BufReader::new(e).lines()).map_while(Result::ok) {
        if let Some(what) = line.strip_prefix(PROGRESS) {
            step(what);
        } else if kept.len() < 16 << 10 {
            kept.push_str(&line);
            kept.push('\n');
        }
    }
    kept
}

/// Waits for the process, or ends it when that is asked for.
fn wait(child: &mut Child, stop: &AtomicBool) -> std::io::Result<ExitStatus> {
    let mut asked: Option<Instant> = None;
    loop {
        if let Some(status) = child.try_wait()? {
            return Ok(status);
        }
        if stop.load(Ordering::SeqCst) {
            match asked {
                None => {
                    end(child, false);
                    asked = Some(Instant::now());
                }
                Some(at) if at.elapsed() > GRACE => end(child, true),
                Some(_) => {}
            }
        }
        std::thread::sleep(LOOK);
    }
}

/// Ends a process and those of its group: first so that it can clear up, then at once.
fn end(child: &mut Child, at_once: bool) {
    #[cfg(unix)]
    if let Ok(id) = i32::try_from(child.id()) {
        use nix::sys::signal::{Signal, killpg};
        let signal = if at_once { Signal::SIGKILL } else { Signal::SIGTERM };
        if killpg(nix::unistd::Pid::from_raw(id), signal).is_ok() {
            return;
        }
    }
    let _ = at_once;
    let _ = child.kill();
}
