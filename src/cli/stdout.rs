//! Writing to standard output, which a reader such as `head` may close before the end: what a command was asked to do goes
//! on, its files are written, its exit code stays.

use std::io::{Error, ErrorKind, IsTerminal, Result, Write};
use std::sync::atomic::{AtomicBool, Ordering};

use crate::report::terminal::Layout;

/// Whether a result goes to standard output: text for people then goes to standard error.
static RESULT_ON_OUTPUT: AtomicBool = AtomicBool::new(false);

/// Whether text for people is left out.
static QUIET: AtomicBool = AtomicBool::new(false);

/// Leaves out text for people from here on.
pub fn be_quiet() {
    QUIET.store(true, Ordering::Relaxed);
}

/// Whether text for people is left out.
pub fn is_quiet() -> bool {
    QUIET.load(Ordering::Relaxed)
}

/// Sends text for people to standard error from here on.
pub fn to_stderr() {
    RESULT_ON_OUTPUT.store(true, Ordering::Relaxed);
}

/// Characters a line where neither the terminal nor `COLUMNS` sets them.
pub const WIDTH: u16 = 100;

/// How tables are laid out: as wide as the terminal or `COLUMNS` says, 60 to 200 characters; `otherwise` where output goes elsewhere.
pub fn layout(otherwise: u16) -> Layout {
    let given = std::env::var("COLUMNS").ok().and_then(|c| c.trim().parse().ok());
    let seen = || terminal_size::terminal_size_of(std::io::stdout()).map(|(width, _)| width.0);
    let width = given.or_else(seen).map_or(otherwise, |w: u16| w.clamp(60, 200));
    Layout { width, colour: std::io::stdout().is_terminal() }
}

/// Writes to standard output; a closed pipe is no error.
///
/// # Errors
/// When the output cannot be written for another reason, as to a full disk.
pub fn write(text: std::fmt::Arguments<'_>) -> Result<()> {
    if is_quiet() {
        return Ok(());
    }
    let written = if RESULT_ON_OUTPUT.load(Ordering::Relaxed) {
        std::io::stderr().write_fmt(text)
    } else {
        std::io::stdout().write_fmt(text)
    };
    match written {
        Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(()),
        written => written.map_err(|e| Error::new(e.kind(), format!("standard output: cannot write: {e}"))),
    }
}

/// As `print!`, with the result of [`write()`].
macro_rules! out {
    ($($text:tt)*) => { $crate::cli::stdout::write(format_args!($($text)*)) };
}

/// As `println!`, with the result of [`write()`].
macro_rules! out_line {
    () => { $crate::cli::stdout::write(format_args!("\n")) };
    ($($text:tt)+) => { $crate::cli::stdout::write(format_args!("{}\n", format_args!($($text)+))) };
}

pub(crate) use {out, out_line};
