//! `eixo serve`: a page on this computer alone, from a log to its diagnosis.
//!
//! What the page shows is made by the commands of this program, run as processes of their own in a folder for each log; the page itself
//! is three files without any library. It is bound to 127.0.0.1, and replies only to requests with the token in its address (see [`guard`]).

mod columns;
mod guard;
mod http;
mod job;
mod room;

use std::net::{Ipv4Addr, TcpListener, TcpStream};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

use anyhow::Context;
use rand::Rng;

use guard::Guard;
use http::{Refusal, Request, Response, read, send};
pub use job::PROGRESS;
use room::Room;

const PAGE: &str = include_str!("page.html");
const STYLE: &str = include_str!("page.css");
const SCRIPT: &str = include_str!("page.js");

/// Most requests at a time: a browser opens six connections.
const MOST_AT_ONCE: usize = 64;

/// What is asked for.
#[derive(Debug, Clone)]
pub struct Settings {
    /// The folder that keeps the logs and what is made of them.
    pub folder: PathBuf,
    /// The port; any free one for 0.
    pub port: u16,
    /// Largest log that is taken, bytes.
    pub most: u64,
}

/// So many random bytes in hexadecimal.
fn random_hex(bytes: usize) -> String {
    let mut all = vec![0; bytes];
    rand::rng().fill_bytes(&mut all);
    all.iter().map(|b| format!("{b:02x}")).collect()
}

/// Serves the page until the program is ended; `ready` gets its address.
///
/// # Errors
/// When the folder cannot be made or the port is taken.
pub fn serve(settings: Settings, ready: impl FnOnce(&str) -> anyhow::Result<()>) -> anyhow::Result<()> {
    std::fs::create_dir_all(&settings.folder).with_context(|| settings.folder.display().to_string())?;
    let folder = settings.folder.canonicalize().with_context(|| settings.folder.display().to_string())?;
    let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, settings.port))
        .with_context(|| format!("port {} of this computer cannot be used; give another (--port)", settings.port))?;
    let guard = Guard { token: random_hex(16), port: listener.local_addr()?.port() };
    let room = Arc::new(Room::new(folder, settings.most));
    let closing = Arc::clone(&room);
    ctrlc::set_handler(move || {
        closing.close();
        std::process::exit(0);
    })?;
    ready(&format!("http://127.0.0.1:{}/{}/", guard.port, guard.token))?;
    let at_once = Arc::new(AtomicUsize::new(0));
    for stream in listener.incoming() {
        let Ok(stream) = stream else {
            // As when the process has no file left to open: the next one may.
            std::thread::sleep(Duration::from_millis(50));
            continue;
        };
        if at_once.fetch_add(1, Ordering::SeqCst) >= MOST_AT_ONCE {
            at_once.fetch_sub(1, Ordering::SeqCst);
            continue;
        }
        let (room, guard, at_once) = (Arc::clone(&room), guard.clone(), Arc::clone(&at_once));
        std::thread::spawn(move || {
            let _leaving = Leaving(at_once);
            respond(stream, &guard, &room);
        });
    }
    Ok(())
}

/// Counts a request out, whatever becomes of it.
struct Leaving(Arc<AtomicUsize>);

impl Drop for Leaving {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::SeqCst);
    }
}

fn respond(stream: TcpStream, guard: &Guard, room: &Room) {
    let mut request = match read(stream) {
        Ok(request) => request,
        Err(Some((stream, refusal))) => return send(stream, refusal.into()),
        Err(None) => return,
    };
    let response = found(&mut request, guard, room).unwrap_or_else(Response::from);
    request.respond(response);
}

fn found(request: &mut Request, guard: &Guard, room: &Room) -> Result<Response, Refusal> {
    let path = guard.admit(request)?.to_owned();
    match (request.method.as_str(), path.as_str()) {
        ("GET", "") => Ok(Response::own("text/html; charset=utf-8", PAGE)),
        ("GET", "page.css") => Ok(Response::own("text/css; charset=utf-8", STYLE)),
        ("GET", "page.js") => Ok(Response::own("text/javascript; charset=utf-8", SCRIPT)),
        _ => room.respond(&path, request),
    }
}
