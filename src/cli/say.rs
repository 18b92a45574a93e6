//! Writing to standard output, which a reader such as `head` may close before the end: what a command was asked to do goes
//! on, its files are written, its exit code stays.

use std::io::{ErrorKind, Result, Write};

/// Writes to standard output; a reader that has gone is no error.
///
/// # Errors
/// When the output cannot be written for another reason, as to a full disk.
pub fn write(text: std::fmt::Arguments<'_>) -> Result<()> {
    match std::io::stdout().write_fmt(text) {
        Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(()),
        other => other,
    }
}

/// As `print!`, with the result of [`write()`].
macro_rules! say {
    ($($text:tt)*) => { $crate::cli::say::write(format_args!($($text)*)) };
}

/// As `println!`, with the result of [`write()`].
macro_rules! say_line {
    () => { $crate::cli::say::write(format_args!("\n")) };
    ($($text:tt)+) => { $crate::cli::say::write(format_args!("{}\n", format_args!($($text)+))) };
}

pub(crate) use {say, say_line};
