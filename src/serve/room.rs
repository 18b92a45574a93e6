//! The logs that were brought, each with a folder of its own below the one that the user named, and the diagnosis that works on it.

use std::collections::BTreeMap;
use std::fs::{self, OpenOptions};
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use serde_json::{Value, json};

use super::columns::described;
use super::http::{Refusal, Request, Response};
use super::job::{Job, State, run};

/// Files that may be fetched: name, type, and whether it is a page.
const FILES: [(&str, &str); 7] = [
    ("inspection.html", "text/html; charset=utf-8"),
    ("report.html", "text/html; charset=utf-8"),
    ("circle.html", "text/html; charset=utf-8"),
    ("axis.toml", "text/plain; charset=utf-8"),
    ("diagnosis.json", "application/json"),
    ("improved.fmu", "application/octet-stream"),
    ("inspection.json", "application/json"),
];
/// Most logs of one run of the page.
const MOST_LOGS: usize = 1000;
/// Most diagnoses at a time: each uses every core.
const MOST_JOBS: usize = 2;

/// Whether the page is being closed: what examines a log then ends.
static CLOSING: AtomicBool = AtomicBool::new(false);

/// A log with its folder.
#[derive(Debug)]
struct Log {
    folder: PathBuf,
    /// Its path below the folder.
    file: String,
    job: Mutex<Option<Arc<Job>>>,
    /// Held while the record is examined.
    examined: Mutex<()>,
}

/// All of them.
#[derive(Debug)]
pub struct Room {
    folder: PathBuf,
    most: u64,
    logs: Mutex<BTreeMap<String, Arc<Log>>>,
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Letters, digits, `-` and `_` of a name, at most 40 of them.
fn plain(name: &str) -> String {
    name.chars().filter(|c| c.is_ascii_alphanumeric() || "-_".contains(*c)).take(40).collect()
}

/// The name of a file as it is kept: nothing of it leads anywhere, and no shell or option sees more in it than a name.
fn kept(name: &str) -> (String, String) {
    let last = name.rsplit(['/', '\\']).next().unwrap_or_default();
    let (stem, end) = last.rsplit_once('.').unwrap_or((last, ""));
    let stem = Some(plain(stem))
        .map(|s| s.trim_start_matches('-').to_owned())
        .filter(|s| !s.is_empty())
        .unwrap_or_else(|| "log".to_owned());
    let end: String = plain(end).chars().take(8).collect();
    let file = if end.is_empty() { stem.clone() } else { format!("{stem}.{end}") };
    (stem, file)
}

impl Room {
    /// A room over a folder; logs of at most so many bytes.
    pub fn new(folder: PathBuf, most: u64) -> Self {
        Self { folder, most, logs: Mutex::new(BTreeMap::new()) }
    }

    /// The response to a request about the logs.
    ///
    /// # Errors
    /// [`Refusal`].
    pub fn respond(&self, path: &str, request: &mut Request) -> Result<Response, Refusal> {
        let parts: Vec<&str> = path.split('/').collect();
        match (request.method.as_str(), parts.as_slice()) {
            ("GET", ["settings"]) => {
                Ok(Response::json(200, &json!({ "most": self.most, "folder": self.folder.display().to_string() })))
            }
            ("POST", ["logs"]) => self.take(request),
            ("POST", ["logs", id, "columns"]) => self.log(id)?.columns(&request.json()?),
            ("POST", ["logs", id, "run"]) => self.run(id, &request.json()?),
            ("POST", ["logs", id, "stop"]) => {
                if let Some(job) = lock(&self.log(id)?.job).as_ref() {
                    job.stop();
                }
                Ok(Response::json(200, &json!({})))
            }
            ("GET", ["logs", id, "state"]) => Ok(Response::json(200, &self.log(id)?.state())),
            ("GET", ["logs", id, "files", name]) => self.log(id)?.file(name, request.asked("save").is_some()),
            ("GET" | "POST", _) => Err(Refusal::new(404, "not found")),
            _ => Err(Refusal::new(405, "GET and POST are understood")),
        }
    }

    fn log(&self, id: &str) -> Result<Arc<Log>, Refusal> {
        lock(&self.logs).get(id).cloned().ok_or_else(|| Refusal::new(404, "there is no such log; bring it again"))
    }

    /// Stores a log and describes its columns.
    fn take(&self, request: &mut Request) -> Result<Response, Refusal> {
        if lock(&self.logs).len() >= MOST_LOGS {
            return Err(Refusal::new(409, format!("{MOST_LOGS} logs were brought; start `eixo serve` again")));
        }
        let name = request.asked("name").unwrap_or_default();
        let (stem, file) = kept(&name);
        let id = super::random_hex(8);
        let folder = self.folder.join(format!("{stem}-{}", &id[..6]));
        fs::create_dir(&folder).and_then(|()| fs::create_dir(folder.join("log")))?;
        let file = format!("log/{file}");
        let path = folder.join(&file);
        let taken = OpenOptions::new()
            .write(true)
            .create_new(true)
            .open(&path)
            .map_err(Refusal::from)
            .and_then(|mut out| request.body_to(&mut out, self.most))
            .and_then(|()| described(&path));
        let mut reply = match taken {
            Ok(reply) => reply,
            Err(refusal) => {
                // What cannot be read is not kept.
                let _ = fs::remove_dir_all(&folder);
                return Err(refusal);
            }
        };
        reply["id"] = json!(id);
        reply["name"] = json!(name);
        reply["folder"] = json!(folder.display().to_string());
        lock(&self.logs).insert(id, Arc::new(Log { folder, file, job: Mutex::new(None), examined: Mutex::new(()) }));
        Ok(Response::json(201, &reply))
    }

    fn run(&self, id: &str, asked: &Value) -> Result<Response, Refusal> {
        let log = self.log(id)?;
        if !log.folder.join("axis.toml").is_file() {
            return Err(Refusal::new(409, "confirm the columns first"));
        }
        // Held until the new one is there, so that no two requests both find room.
        let logs = lock(&self.logs);
        let runs = |l: &Log| lock(&l.job).as_ref().is_some_and(|j| j.status().state == State::Running);
        if runs(&log) {
            return Err(Refusal::new(409, "a diagnosis of this log runs already"));
        }
        if logs.values().filter(|l| runs(l)).count() >= MOST_JOBS {
            return Err(Refusal::new(409, format!("{MOST_JOBS} diagnoses run already; wait for one, or stop it")));
        }
        // As the program takes it of a terminal.
        let width = asked["width"].as_u64().map(|w| w.clamp(60, 200));
        *lock(&log.job) = Some(Job::start(log.folder.clone(), log.file.clone(), asked["trust"] == true, width));
        Ok(Response::json(200, &log.state()))
    }

    /// Ends every diagnosis and waits for it.
    pub fn close(&self) {
        CLOSING.store(true, Ordering::SeqCst);
        let jobs: Vec<Arc<Job>> = lock(&self.logs).values().filter_map(|l| lock(&l.job).clone()).collect();
        jobs.iter().for_each(|j| j.stop());
        jobs.iter().for_each(|j| j.join());
    }
}

impl Log {
    /// Writes the axis file from what was confirmed, and examines the record with it.
    fn columns(&self, asked: &Value) -> Result<Response, Refusal> {
        if lock(&self.job).as_ref().is_some_and(|j| j.status().state == State::Running) {
            return Err(Refusal::new(409, "a diagnosis runs on these columns; stop it first"));
        }
        // One after the other: both write the same files.
        let _examining = lock(&self.examined);
        let mut init = vec!["init".to_owned(), self.file.clone(), "--yes".to_owned(), "--force".to_owned()];
        init.extend(["--output", "axis.toml", "--report", "inspection.html"].map(str::to_owned));
        for (key, option) in [("columns", "--column"), ("units", "--unit")] {
            for (signal, value) in asked[key].as_object().into_iter().flatten() {
                init.push(format!("{option}={signal}={}", value.as_str().unwrap_or_default()));
            }
        }
        for (key, option) in [("torque_constant", "--torque-constant"), ("dt", "--dt")] {
            if let Some(value) = asked[key].as_f64() {
                init.push(format!("{option}={value}"));
            }
        }
        let printed = self.eixo(&init)?;
        let inspect = ["inspect", &self.file, "--axis", "axis.toml", "--json", "inspection.json"].map(str::to_owned);
        self.eixo(&inspect)?;
        let text = fs::read(self.folder.join("inspection.json"))?;
        let found: Value = serde_json::from_slice(&text).map_err(|e| Refusal::new(500, e.to_string()))?;
        let axis = fs::read_to_string(self.folder.join("axis.toml"))?;
        Ok(Response::json(200, &json!({ "found": found, "axis": axis, "said": printed })))
    }

    /// Runs this program in the log's folder and gives what it printed.
    fn eixo(&self, arguments: &[String]) -> Result<String, Refusal> {
        let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
        match run(&self.folder, &arguments, None, &CLOSING, &|_| ())? {
            (Some(0 | 1), output, _) => Ok(output),
            (_, _, errors) => {
                let line = errors.lines().rev().find_map(|l| l.strip_prefix("error: "));
                Err(Refusal::new(422, line.unwrap_or("the log could not be examined").to_owned()))
            }
        }
    }

    fn state(&self) -> Value {
        let files: Vec<&str> = FILES.iter().map(|(n, _)| *n).filter(|n| self.folder.join(n).is_file()).collect();
        let status = lock(&self.job).as_ref().map(|j| j.status());
        status.map_or_else(
            || json!({ "state": "idle", "files": files }),
            |t| {
                let (state, seconds) = (t.state.name(), (10.0 * t.seconds).round() / 10.0);
                json!({ "state": state, "steps": t.steps, "said": t.output, "aside": t.aside, "seconds": seconds, "files": files })
            },
        )
    }

    /// One of the files of the list: no other name leads anywhere.
    fn file(&self, name: &str, save: bool) -> Result<Response, Refusal> {
        let unknown = || Refusal::new(404, format!("there is no file {name:?} of this log"));
        let (name, kind) = FILES.iter().find(|(n, _)| *n == name).ok_or_else(unknown)?;
        let path = self.folder.join(name);
        if !path.is_file() {
            return Err(unknown());
        }
        Ok(Response::file(&path, kind, save.then(|| (*name).to_owned())))
    }
}

#[cfg(test)]
mod tests {
    use super::kept;

    #[test]
    fn no_name_leads_out_of_the_folder() {
        for (name, file) in [
            ("servo log.csv", "servolog.csv"),
            ("../../etc/passwd", "passwd"),
            ("..\\..\\boot.ini", "boot.ini"),
            ("--report=x.csv", "reportxcsv.csv"),
            ("..", "log"),
            ("", "log"),
            ("a\0b.c/d\n", "d"),
            (".csv", "log.csv"),
        ] {
            let (_, kept) = kept(name);
            assert!(!kept.contains(['/', '\\', '\0']) && !kept.starts_with(['-', '.']), "{name:?}: {kept:?}");
            if name != "--report=x.csv" {
                assert_eq!(kept, file, "{name:?}");
            }
        }
    }
}
