//! Writing to standard output, which a reader such as `head` may close before the end: what a command was asked to do goes
//! on, its files are written, its exit code stays.

use std::io::{ErrorKind, Result, Write};
use std::sync::atomic::{AtomicBool, Ordering};

/// Whether a result goes to standard output: what is said to people then goes to standard error.
static RESULT_ON_OUTPUT: AtomicBool = AtomicBool::new(false);

/// From here on what is said goes to standard error.
pub fn to_stderr() {
    RESULT_ON_OUTPUT.store(true, Ordering::Relaxed);
}

/// Writes to standard output; a reader that has gone is no error.
///
/// # Errors
/// When the output cannot be written for another reason, as to a full disk.
pub fn write(text: std::fmt::Arguments<'_>) -> Result<()> {
    let written = if RESULT_ON_OUTPUT.load(Ordering::Relaxed) {
        std::io::stderr().write_fmt(text)
    } else {
        std::io::stdout().write_fmt(text)
    };
    match written {
        Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(()),
        other => other,
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
