//! Just as much HTTP/1.1 as one page on this computer needs: one request a connection, a body of a known length, bounds on all of it
//! (RFC 9112). What a request says is parsed by httparse.

use std::fs::File;
use std::io::{self, Read, Write};
use std::net::TcpStream;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Largest head of a request, bytes.
const MOST_HEAD: usize = 16 << 10;
/// Most header fields of a request.
const MOST_FIELDS: usize = 64;
/// Longest wait for the other side, s.
const PATIENCE: Duration = Duration::from_secs(30);

/// A request, its body still unread.
pub struct Request {
    /// `GET`, `POST`, ...
    pub method: String,
    /// The path, as sent.
    pub path: String,
    /// What stands behind the question mark, as sent.
    pub query: String,
    fields: Vec<(String, String)>,
    /// What of the body came with the head.
    begun: Vec<u8>,
    stream: TcpStream,
}

/// Why a request is refused: status and a sentence.
#[derive(Debug)]
pub struct Refusal(pub u16, pub String);

impl Refusal {
    /// A refusal.
    pub fn new(status: u16, why: impl Into<String>) -> Self {
        Self(status, why.into())
    }
}

impl From<io::Error> for Refusal {
    fn from(error: io::Error) -> Self {
        Self(500, error.to_string())
    }
}

/// A response.
pub struct Response {
    status: u16,
    kind: &'static str,
    body: Body,
    policy: &'static str,
    save_as: Option<String>,
}

enum Body {
    Bytes(Vec<u8>),
    File(PathBuf),
}

/// What our own page may do: run our script, talk to us, and nothing else.
const OWN: &str = "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; img-src 'self' data:; \
                   form-action 'none'; base-uri 'none'; frame-ancestors 'none'";
/// What a report may do: its own policy, and no more; in particular it is another origin than the page.
const REPORT: &str = "sandbox allow-scripts allow-modals; default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; \
                      img-src data:; form-action 'none'; base-uri 'none'; frame-ancestors 'none'";

impl Response {
    /// Text of a kind, part of our own page.
    pub fn own(kind: &'static str, text: impl Into<Vec<u8>>) -> Self {
        Self { status: 200, kind, body: Body::Bytes(text.into()), policy: OWN, save_as: None }
    }

    /// JSON.
    pub fn json(status: u16, value: &serde_json::Value) -> Self {
        let body = Body::Bytes(value.to_string().into_bytes());
        Self { status, kind: "application/json", body, policy: OWN, save_as: None }
    }

    /// A file, shown, or saved under a name.
    pub fn file(path: &Path, kind: &'static str, save_as: Option<String>) -> Self {
        Self { status: 200, kind, body: Body::File(path.to_owned()), policy: REPORT, save_as }
    }
}

impl From<Refusal> for Response {
    fn from(Refusal(status, why): Refusal) -> Self {
        Self::json(status, &serde_json::json!({ "error": why }))
    }
}

const fn reason(status: u16) -> &'static str {
    match status {
        200 => "OK",
        201 => "Created",
        400 => "Bad Request",
        403 => "Forbidden",
        404 => "Not Found",
        405 => "Method Not Allowed",
        409 => "Conflict",
        411 => "Length Required",
        413 => "Content Too Large",
        422 => "Unprocessable Content",
        431 => "Request Header Fields Too Large",
        _ => "Internal Server Error",
    }
}

/// Reads the head of a request.
///
/// # Errors
/// [`Refusal`] with the response to send, `None` where the connection is closed.
pub fn read(mut stream: TcpStream) -> Result<Request, Option<(TcpStream, Refusal)>> {
    if stream.set_read_timeout(Some(PATIENCE)).and_then(|()| stream.set_write_timeout(Some(PATIENCE))).is_err() {
        return Err(None);
    }
    let mut bytes = Vec::new();
    let mut part = [0; 4096];
    loop {
        match stream.read(&mut part) {
            Ok(n) if n > 0 => bytes.extend_from_slice(&part[..n]),
            _ => return Err(None),
        }
        let mut fields = [httparse::EMPTY_HEADER; MOST_FIELDS];
        let mut head = httparse::Request::new(&mut fields);
        match head.parse(&bytes) {
            Ok(httparse::Status::Complete(length)) => {
                let target = head.path.unwrap_or_default();
                let (path, query) = target.split_once('?').unwrap_or((target, ""));
                let (method, path, query) =
                    (head.method.unwrap_or_default().to_owned(), path.to_owned(), query.to_owned());
                let text = |v: &[u8]| String::from_utf8_lossy(v).into_owned();
                let fields = head.headers.iter().map(|f| (f.name.to_ascii_lowercase(), text(f.value))).collect();
                return Ok(Request { method, path, query, fields, begun: bytes.split_off(length), stream });
            }
            Ok(httparse::Status::Partial) if bytes.len() < MOST_HEAD => {}
            Ok(httparse::Status::Partial) => {
                return Err(Some((stream, Refusal::new(431, "the head of the request is too long"))));
            }
            Err(error) => return Err(Some((stream, Refusal::new(400, format!("no HTTP request: {error}"))))),
        }
    }
}

impl Request {
    /// A header field, by its name in small letters; `None` when it is missing or there more than once.
    pub fn field(&self, name: &str) -> Option<&str> {
        let mut all = self.fields.iter().filter(|(n, _)| n == name).map(|(_, v)| v.as_str());
        all.next().filter(|_| all.next().is_none())
    }

    /// Whether a header field is there at all.
    pub fn has(&self, name: &str) -> bool {
        self.fields.iter().any(|(n, _)| n == name)
    }

    /// A value of the query, decoded (RFC 3986, section 2.1).
    pub fn asked(&self, name: &str) -> Option<String> {
        self.query.split('&').find_map(|pair| {
            let (n, v) = pair.split_once('=').unwrap_or((pair, ""));
            (n == name).then(|| decoded(v))
        })
    }

    fn length(&self, most: u64) -> Result<u64, Refusal> {
        if self.has("transfer-encoding") {
            return Err(Refusal::new(411, "a body is sent with its Content-Length"));
        }
        let length = self.field("content-length").and_then(|v| v.parse().ok());
        let length: u64 = length.ok_or_else(|| Refusal::new(411, "a body is sent with its Content-Length"))?;
        if length > most {
            let why = format!("{:.1} MB are more than the {:.0} MB that are taken (--most)", mega(length), mega(most));
            return Err(Refusal::new(413, why));
        }
        Ok(length)
    }

    /// Writes the body where it goes.
    ///
    /// # Errors
    /// When it is longer than allowed, ends early, or cannot be written.
    pub fn body_to(&mut self, out: &mut impl Write, most: u64) -> Result<(), Refusal> {
        let length = self.length(most)?;
        if self.field("expect").is_some_and(|v| v.eq_ignore_ascii_case("100-continue")) {
            self.stream.write_all(b"HTTP/1.1 100 Continue\r\n\r\n")?;
        }
        let begun = &self.begun[..self.begun.len().min(usize::try_from(length).unwrap_or(usize::MAX))];
        out.write_all(begun)?;
        let left = length - begun.len() as u64;
        let copied = io::copy(&mut (&mut self.stream).take(left), out)?;
        if copied < left {
            return Err(Refusal::new(400, "the upload broke off"));
        }
        Ok(())
    }

    /// The body as JSON of at most 64 KiB.
    ///
    /// # Errors
    /// When it is none.
    pub fn json(&mut self) -> Result<serde_json::Value, Refusal> {
        let mut bytes = Vec::new();
        self.body_to(&mut bytes, 64 << 10)?;
        serde_json::from_slice(&bytes).map_err(|e| Refusal::new(400, format!("no JSON: {e}")))
    }

    /// Answers.
    pub fn respond(self, response: Response) {
        send(self.stream, response);
    }
}

fn mega(bytes: u64) -> f64 {
    bytes as f64 / 1e6
}

/// `%41` and `+` as they are meant.
fn decoded(text: &str) -> String {
    let bytes = text.as_bytes();
    let mut out = Vec::with_capacity(bytes.len());
    let mut k = 0;
    while k < bytes.len() {
        let code = bytes.get(k + 1..k + 3).and_then(|h| std::str::from_utf8(h).ok());
        match (bytes[k], code.and_then(|h| u8::from_str_radix(h, 16).ok())) {
            (b'%', Some(value)) => {
                out.push(value);
                k += 2;
            }
            (b'+', _) => out.push(b' '),
            (b, _) => out.push(b),
        }
        k += 1;
    }
    String::from_utf8_lossy(&out).into_owned()
}

/// Sends a response; a closed connection is no error.
pub fn send(mut stream: TcpStream, response: Response) {
    let _ = write(&mut stream, response);
    let _ = stream.shutdown(std::net::Shutdown::Write);
    // A part of what is still being sent is read, so that the response is not lost in a reset of the connection.
    let _ = stream.set_read_timeout(Some(Duration::from_millis(500)));
    let _ = io::copy(&mut stream.take(1 << 20), &mut io::sink());
}

fn write(stream: &mut TcpStream, response: Response) -> io::Result<()> {
    let (length, file) = match &response.body {
        Body::Bytes(bytes) => (bytes.len() as u64, None),
        Body::File(path) => {
            let file = File::open(path)?;
            (file.metadata()?.len(), Some(file))
        }
    };
    let disposition = response
        .save_as
        .map_or_else(String::new, |name| format!("Content-Disposition: attachment; filename=\"{name}\"\r\n"));
    let status = response.status;
    write!(
        stream,
        "HTTP/1.1 {status} {}\r\nContent-Type: {}\r\nContent-Length: {length}\r\nContent-Security-Policy: {}\r\n{disposition}\
         X-Content-Type-Options: nosniff\r\nReferrer-Policy: same-origin\r\nCross-Origin-Resource-Policy: same-origin\r\n\
         Cache-Control: no-store\r\nConnection: close\r\n\r\n",
        reason(status),
        response.kind,
        response.policy
    )?;
    match (response.body, file) {
        (Body::Bytes(bytes), _) => stream.write_all(&bytes)?,
        (Body::File(_), Some(file)) => {
            io::copy(&mut file.take(length), stream)?;
        }
        (Body::File(_), None) => {}
    }
    stream.flush()
}

#[cfg(test)]
mod tests {
    use super::decoded;

    #[test]
    fn names_are_decoded_and_a_broken_code_stays_as_it_is() {
        assert_eq!(decoded("a%20b+c%C3%A9"), "a b cé");
        assert_eq!(decoded("100%"), "100%");
        assert_eq!(decoded("%zz%2e%2e%2f"), "%zz../");
    }
}
