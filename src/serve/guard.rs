//! Who may ask: only a browser of this computer that knows the address with its token, from our own page.
//!
//! A foreign page that the same browser shows could send requests to 127.0.0.1 too: under another name that leads here (which `Host`
//! tells), or from its own origin (which `Origin` and `Sec-Fetch-Site` tell). Neither knows the token.

use super::http::{Refusal, Request};

/// What requests are measured by.
#[derive(Debug, Clone)]
pub struct Guard {
    /// 128 random bits in hexadecimal.
    pub token: String,
    /// The port.
    pub port: u16,
}

impl Guard {
    /// The path behind the token.
    ///
    /// # Errors
    /// When the request is not from our own page.
    pub fn admit<'a>(&self, request: &'a Request) -> Result<&'a str, Refusal> {
        let hosts = [format!("127.0.0.1:{}", self.port), format!("localhost:{}", self.port)];
        if !request.field("host").is_some_and(|h| hosts.iter().any(|own| own == h)) {
            return Err(Refusal::new(403, "this page is served to this computer alone, under 127.0.0.1"));
        }
        if request.has("origin")
            && !request.field("origin").is_some_and(|o| hosts.iter().any(|h| o == format!("http://{h}")))
        {
            return Err(Refusal::new(403, "the request comes from another page"));
        }
        if request.method != "GET" && request.field("sec-fetch-site").is_some_and(|s| s != "same-origin") {
            return Err(Refusal::new(403, "the request comes from another page"));
        }
        let unknown =
            || Refusal::new(404, "not found; the address is the one that `eixo serve` printed, with its token");
        let (token, path) = request.path.strip_prefix('/').and_then(|p| p.split_once('/')).ok_or_else(unknown)?;
        if alike(token.as_bytes(), self.token.as_bytes()) { Ok(path) } else { Err(unknown()) }
    }
}

/// Whether they are equal, in a time that does not depend on where they differ.
fn alike(a: &[u8], b: &[u8]) -> bool {
    a.len() == b.len() && a.iter().zip(b).fold(0, |all, (x, y)| all | (x ^ y)) == 0
}
