//! `eixo serve` over plain HTTP: upload, confirm, run, fetch; wrong file, too large, wrong token and foreign pages, two at a time, stop.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::fmt::Write as _;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use serde_json::{Value, json};

/// The page under test, ended when it is dropped.
struct Served {
    child: Child,
    port: u16,
    token: String,
    folder: tempfile::TempDir,
}

impl Drop for Served {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Status, header lines, body.
struct Answer {
    status: u16,
    head: String,
    body: Vec<u8>,
}

impl Answer {
    fn json(&self) -> Value {
        serde_json::from_slice(&self.body).unwrap_or_else(|e| panic!("{e}: {}", self.text()))
    }

    fn text(&self) -> String {
        String::from_utf8_lossy(&self.body).into_owned()
    }
}

impl Served {
    fn start(more: &[&str]) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let mut child = Command::new(env!("CARGO_BIN_EXE_eixo"))
            .args(["serve", "--folder", "logs"])
            .args(more)
            .current_dir(folder.path())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let mut line = String::new();
        BufReader::new(child.stdout.take().unwrap()).read_line(&mut line).unwrap();
        let address = line.trim().strip_prefix("http://127.0.0.1:").unwrap_or_else(|| panic!("{line:?}"));
        let (port, token) = address.trim_end_matches('/').split_once('/').unwrap();
        assert!(token.len() == 32 && token.bytes().all(|b| b.is_ascii_hexdigit()), "{token}");
        Self { child, port: port.parse().unwrap(), token: token.to_owned(), folder }
    }

    /// Sends bytes as they are.
    fn raw(&self, head: &str, body: &[u8]) -> Answer {
        let mut stream = TcpStream::connect(("127.0.0.1", self.port)).unwrap();
        stream.set_read_timeout(Some(Duration::from_secs(400))).unwrap();
        stream.write_all(head.as_bytes()).unwrap();
        let _ = stream.write_all(body);
        let mut bytes = Vec::new();
        stream.read_to_end(&mut bytes).unwrap();
        let cut = bytes.windows(4).position(|w| w == b"\r\n\r\n").unwrap_or_else(|| panic!("no answer to {head}")) + 4;
        let head = String::from_utf8_lossy(&bytes[..cut]).into_owned();
        let status = head.split(' ').nth(1).unwrap().parse().unwrap();
        Answer { status, head, body: bytes[cut..].to_vec() }
    }

    fn send(&self, method: &str, path: &str, body: &[u8]) -> Answer {
        let (port, token, length) = (self.port, &self.token, body.len());
        self.raw(
            &format!("{method} /{token}/{path} HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nContent-Length: {length}\r\n\r\n"),
            body,
        )
    }

    fn get(&self, path: &str) -> Answer {
        self.send("GET", path, b"")
    }

    fn post(&self, path: &str, body: &Value) -> Answer {
        self.send("POST", path, body.to_string().as_bytes())
    }

    /// Brings a log and confirms what was guessed: its id.
    fn bring(&self, name: &str, text: &str) -> String {
        let told = self.send("POST", &format!("logs?name={name}"), text.as_bytes());
        assert_eq!(told.status, 201, "{}", told.text());
        let told = told.json();
        let mut columns = serde_json::Map::new();
        for c in told["columns"].as_array().unwrap() {
            if let Some(role) = c["role"].as_str() {
                columns.insert(role.to_owned(), c["name"].clone());
            }
        }
        let id = told["id"].as_str().unwrap().to_owned();
        let confirmed =
            self.post(&format!("logs/{id}/columns"), &json!({ "columns": columns, "torque_constant": 0.5 }));
        assert_eq!(confirmed.status, 200, "{}", confirmed.text());
        id
    }

    fn state(&self, id: &str) -> Value {
        self.get(&format!("logs/{id}/state")).json()
    }

    /// Waits until a diagnosis does not run any more.
    #[track_caller]
    fn end(&self, id: &str) -> Value {
        let began = Instant::now();
        loop {
            let state = self.state(id);
            if state["state"] != "running" {
                return state;
            }
            assert!(began.elapsed() < Duration::from_secs(500), "{state}");
            std::thread::sleep(Duration::from_millis(100));
        }
    }

    /// Processes that this page has started, by their folder.
    fn children(&self) -> Vec<PathBuf> {
        let logs = self.folder.path().join("logs").canonicalize().unwrap();
        let all = std::fs::read_dir("/proc").into_iter().flatten().filter_map(Result::ok);
        let cwd = all.filter_map(|p| std::fs::read_link(p.path().join("cwd")).ok());
        cwd.filter(|c| c.starts_with(&logs)).collect()
    }
}

/// A servo's log: 2e-3 kg.m2, viscous and Coulomb friction under three tones, 0.5 N.m/A, seeded rounding of an encoder of 16 bits.
fn servo(rows: u32) -> String {
    let mut text = String::from("Servo log 7\nt (ms);Iq_meas (A);Pos_act (deg);Note\n");
    for k in 0..rows {
        let t = f64::from(k) * 1e-3;
        let (mut x, mut v, mut a) = (0.0, 0.0, 0.0);
        for (amplitude, w) in [(0.5, 3.0), (0.1, 11.0), (0.03, 37.0)] {
            let (s, c) = f64::sin_cos(w * t);
            x += amplitude * s;
            v += amplitude * w * c;
            a -= amplitude * w * w * s;
        }
        let torque = 2e-3 * a + 1e-2 * v + 5e-3 * v.signum();
        let step = std::f64::consts::TAU / 65536.0;
        let line = format!("{k};{:.6};{:.5};x", torque / 0.5, ((x / step).round() * step).to_degrees());
        writeln!(text, "{}", line.replace('.', ",")).unwrap();
    }
    text
}

#[test]
fn a_log_goes_from_upload_to_report_and_two_work_at_a_time() {
    let page = Served::start(&[]);
    let told = page.send("POST", "logs?name=..%2f..%2fservo%20log.csv", servo(1500).as_bytes());
    assert_eq!(told.status, 201, "{}", told.text());
    let told = told.json();
    assert_eq!(told["rows"], 1500);
    let column = |name: &str| told["columns"].as_array().unwrap().iter().find(|c| c["name"] == name).unwrap().clone();
    assert_eq!((&column("t")["role"], &column("t")["unit"]), (&json!("time"), &json!("ms")));
    assert_eq!((&column("Iq_meas")["role"], &column("Iq_meas")["unit"]), (&json!("T"), &json!("A")));
    assert_eq!((&column("Pos_act")["role"], &column("Pos_act")["sure"]), (&json!("theta1"), &json!(true)));
    assert!(column("Pos_act")["points"].as_array().unwrap().len() > 300);
    let id = told["id"].as_str().unwrap();
    // The folder that was named holds it, under a name that leads nowhere else.
    let kept = Path::new(told["folder"].as_str().unwrap());
    assert_eq!(kept.parent().unwrap(), page.folder.path().join("logs").canonicalize().unwrap());
    assert!(kept.join("log/servolog.csv").is_file());
    assert_eq!(page.post(&format!("logs/{id}/run"), &json!({})).status, 409, "columns are confirmed first");
    // A misspelt column is told, with what is there.
    let wrong = page.post(&format!("logs/{id}/columns"), &json!({ "columns": { "T": "Iq_maes" } }));
    assert!(wrong.status == 422 && wrong.text().contains("did you mean"), "{}", wrong.text());
    let columns = json!({ "time": "t", "T": "Iq_meas", "theta1": "Pos_act", "theta2": "" });
    let confirmed = page.post(&format!("logs/{id}/columns"), &json!({ "columns": columns, "torque_constant": 0.5 }));
    assert_eq!(confirmed.status, 200, "{}", confirmed.text());
    let confirmed = confirmed.json();
    let axis = confirmed["axis"].as_str().unwrap();
    assert!(axis.contains("scale = 0.5") && axis.contains("Pos_act") && axis.contains("rigid"), "{axis}");
    assert!(confirmed["found"]["examination"]["findings"].is_array());
    let drawn = page.get(&format!("logs/{id}/files/inspection.html"));
    assert!(drawn.status == 200 && drawn.text().contains("<svg"));

    let other = page.bring("other.csv", &servo(1200));
    let began = page.post(&format!("logs/{id}/run"), &json!({}));
    assert_eq!((began.status, began.json()["state"].as_str()), (200, Some("running")), "{}", began.text());
    assert_eq!(page.post(&format!("logs/{id}/run"), &json!({})).status, 409, "one at a time for each log");
    assert_eq!(page.post(&format!("logs/{other}/run"), &json!({})).status, 200, "two logs at a time");
    let third = page.bring("third.csv", &servo(1200));
    let refused = page.post(&format!("logs/{third}/run"), &json!({}));
    assert!(refused.status == 409 && refused.text().contains("2 diagnoses run"), "{}", refused.text());
    for id in [id, &other] {
        let end = page.end(id);
        assert_eq!(end["state"], "done", "{end}");
        let steps: Vec<&str> = end["steps"].as_array().unwrap().iter().map(|s| s.as_str().unwrap()).collect();
        assert!(steps.contains(&"the model as given") && steps.contains(&"held-out data"), "{steps:?}");
        assert!(end["said"].as_str().unwrap().contains("What the model leaves out"), "{end}");
        let report = page.get(&format!("logs/{id}/files/report.html"));
        assert!(report.status == 200 && report.text().contains("friction"));
        let policy = report.head.lines().find(|l| l.starts_with("Content-Security-Policy: ")).unwrap();
        assert!(policy.contains("sandbox") && !policy.contains("allow-same-origin"), "{policy}");
        for name in ["axis.toml", "diagnosis.json", "improved.fmu", "circle.html"] {
            let saved = page.get(&format!("logs/{id}/files/{name}?save"));
            assert_eq!(saved.status, 200, "{name}: {}", saved.text());
            assert!(saved.head.contains(&format!("attachment; filename=\"{name}\"")), "{}", saved.head);
        }
    }
    let found = page.get(&format!("logs/{id}/files/diagnosis.json")).json();
    assert_eq!(found["schema"], "eixo.diagnosis/1");
}

#[test]
fn a_diagnosis_is_stopped_and_leaves_no_process() {
    let page = Served::start(&[]);
    let id = page.bring("servo.csv", &servo(6000));
    assert_eq!(page.post(&format!("logs/{id}/run"), &json!({})).status, 200);
    let began = Instant::now();
    while page.children().is_empty() {
        assert!(began.elapsed() < Duration::from_secs(60), "no process: {}", page.state(&id));
        std::thread::sleep(Duration::from_millis(20));
    }
    let asked = Instant::now();
    assert_eq!(page.post(&format!("logs/{id}/stop"), &json!({})).status, 200);
    let end = page.end(&id);
    assert_eq!(end["state"], "stopped", "{end}");
    assert!(asked.elapsed() < Duration::from_secs(15), "{:?}", asked.elapsed());
    assert_eq!(page.children(), Vec::<PathBuf>::new());
    assert!(!end["files"].as_array().unwrap().contains(&json!("report.html")), "{end}");
    // It can be begun again, and ends with the page.
    assert_eq!(page.post(&format!("logs/{id}/run"), &json!({})).status, 200);
    std::thread::sleep(Duration::from_millis(300));
    let status = Command::new("kill").args(["-INT", &page.child.id().to_string()]).status().unwrap();
    assert!(status.success());
    let began = Instant::now();
    while !page.children().is_empty() || TcpStream::connect(("127.0.0.1", page.port)).is_ok() {
        assert!(began.elapsed() < Duration::from_secs(15), "{:?}", page.children());
        std::thread::sleep(Duration::from_millis(50));
    }
}

#[test]
fn what_is_no_log_is_refused_and_not_kept() {
    let page = Served::start(&["--most", "1"]);
    let (port, token) = (page.port, &page.token);
    for (name, bytes) in [
        ("picture.png", &b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0\0\x01"[..]),
        ("notes.txt", b"this is no log\nat all\n"),
        ("empty.csv", b""),
        ("old.xls", b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1"),
        ("new.mat", b"\x89HDF\r\n\x1a\n"),
    ] {
        let told = page.send("POST", &format!("logs?name={name}"), bytes);
        assert!(
            told.status == 422 && !told.json()["error"].as_str().unwrap().is_empty(),
            "{name}: {} {}",
            told.status,
            told.text()
        );
        // The page says what is wrong with the log, not where it lies.
        assert!(!told.text().contains(&*page.folder.path().to_string_lossy()), "{}", told.text());
    }
    let head =
        |length: &str| format!("POST /{token}/logs?name=a.csv HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\n{length}\r\n\r\n");
    let large = page.raw(&head("Content-Length: 2000000"), b"");
    assert!(large.status == 413 && large.text().contains("--most"), "{}", large.text());
    let whole = page.raw(&head("Content-Length: 1020000"), &vec![b'1'; 1_020_000]);
    assert_eq!(whole.status, 413);
    assert_eq!(page.raw(&head("Transfer-Encoding: chunked"), b"0\r\n\r\n").status, 411);
    assert_eq!(page.raw(&head("X: y"), b"").status, 411);
    assert_eq!(page.raw("nonsense\r\n\r\n", b"").status, 400);
    let long = format!("GET /{token}/ HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nX: {}\r\n", "x".repeat(20_000));
    assert_eq!(page.raw(&long, b"").status, 431);
    // A log without a torque can be brought, but not confirmed without one.
    let told = page.send("POST", "logs?name=a.csv", b"time,a,b\n0,1,2\n1,2,3\n2,3,4\n");
    assert_eq!(told.status, 201, "{}", told.text());
    let id = told.json()["id"].as_str().unwrap().to_owned();
    let none =
        page.post(&format!("logs/{id}/columns"), &json!({ "columns": { "time": "time", "T": "", "theta1": "a" } }));
    assert!(none.status == 422 && none.text().contains("torque"), "{}", none.text());
    assert_eq!(std::fs::read_dir(page.folder.path().join("logs")).unwrap().count(), 1, "what was refused is not kept");
}

#[test]
fn only_the_pages_own_requests_are_answered() {
    let page = Served::start(&[]);
    let (port, token) = (page.port, page.token.clone());
    let ask = |path: &str, fields: &str| page.raw(&format!("GET {path} HTTP/1.1\r\n{fields}\r\n"), b"");
    let host = format!("Host: 127.0.0.1:{port}\r\n");
    let own = ask(&format!("/{token}/"), &host);
    assert_eq!(own.status, 200);
    for part in ["default-src 'none'", "script-src 'self'", "frame-ancestors 'none'"] {
        assert!(own.head.contains(part), "{}", own.head);
    }
    assert!(own.head.contains("nosniff") && own.head.contains("no-store"));
    for (path, fields, status) in [
        ("/".to_owned(), host.clone(), 404),
        (format!("/{}/", "0".repeat(32)), host.clone(), 404),
        (format!("/{}/", &token[..31]), host.clone(), 404),
        (format!("/{token}/"), String::new(), 403),
        (format!("/{token}/"), format!("Host: evil.example:{port}\r\n"), 403),
        (format!("/{token}/"), format!("{host}{host}"), 403),
        (format!("/{token}/"), format!("{host}Origin: http://evil.example\r\n"), 403),
        (format!("/{token}/"), format!("{host}Origin: null\r\n"), 403),
        (format!("/{token}/"), format!("{host}Origin: http://127.0.0.1:{port}\r\n"), 200),
        (format!("/{token}/../../etc/passwd"), host.clone(), 404),
        (format!("/{token}/logs/..%2f..%2fetc/files/passwd"), host.clone(), 404),
    ] {
        let answer = ask(&path, &fields);
        assert_eq!(answer.status, status, "{path} {fields}: {}", answer.text());
    }
    let id = page.bring("servo.csv", &servo(800));
    for name in
        ["../log/servo.csv", "..%2faxis.toml", "log", "log/servo.csv", "printed.txt", "/etc/passwd", "", "axis.toml/"]
    {
        assert_eq!(page.get(&format!("logs/{id}/files/{name}")).status, 404, "{name}");
    }
    assert_eq!(page.get(&format!("logs/{id}/files/axis.toml")).status, 200);
    assert_eq!(page.send("DELETE", &format!("logs/{id}"), b"").status, 405);
    // Nothing of a confirmation is an option or a path of its own.
    let columns = json!({ "columns": { "T": "Iq_meas", "theta1 --report /tmp/x": "Pos_act" } });
    assert_eq!(page.post(&format!("logs/{id}/columns"), &columns).status, 422);
    let foreign = format!(
        "POST /{token}/logs/{id}/run HTTP/1.1\r\n{host}Sec-Fetch-Site: cross-site\r\nContent-Length: 2\r\n\r\n"
    );
    assert_eq!(page.raw(&foreign, b"{}").status, 403);
    // The page's own files fetch nothing from elsewhere.
    for name in ["", "page.js", "page.css"] {
        let text = page.get(name).text();
        let foreign = text.replace("http://www.w3.org/2000/svg", "");
        assert!(!foreign.contains("http://") && !foreign.contains("https://") && !foreign.contains("//cdn"), "{name}");
    }
}
