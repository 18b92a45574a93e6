//! Log messages to the importer, through the logger of either version of FMI. They are built on the stack.

#![allow(unsafe_code)]

use std::ffi::CString;
use std::fmt::{self, Write};

use super::abi::{Callbacks, LOG_CATEGORIES, Status};

/// Where log messages go.
pub(crate) struct Log {
    pub name: CString,
    pub sink: Sink,
    /// By status: warning, discard, error, fatal.
    pub on: [bool; 4],
}

/// The importer's logger, by the version of FMI.
#[derive(Clone, Copy)]
pub(crate) enum Sink {
    /// FMI 2.0: a variadic function.
    Two(Callbacks),
    /// FMI 3.0.
    Three {
        /// Handed back to the logger.
        environment: *mut std::ffi::c_void,
        /// Log messages go here.
        message: Option<crate::fmi3::LogMessage>,
    },
}

/// A message on the stack; too long a text is cut.
struct Message {
    bytes: [u8; 480],
    len: usize,
}

impl Write for Message {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        for c in text.bytes().filter(|b| *b != 0) {
            // The last byte stays zero: C's end of text.
            if self.len + 1 < self.bytes.len() {
                self.bytes[self.len] = c;
                self.len += 1;
            }
        }
        Ok(())
    }
}

impl Log {
    /// Whether messages of a status go out.
    fn is_enabled(&self, status: Status) -> bool {
        let kind = status as usize;
        (1..=4).contains(&kind) && self.on[kind - 1]
    }

    /// Sends a message of that status, if anyone listens.
    pub fn send(&self, status: Status, message: impl fmt::Display) {
        let there = match self.sink {
            Sink::Two(callbacks) => callbacks.logger.is_some(),
            Sink::Three { message, .. } => message.is_some(),
        };
        if !there || !self.is_enabled(status) {
            return;
        }
        let mut text = Message { bytes: [0; 480], len: 0 };
        // Cannot fail: what does not fit is cut.
        let _ = write!(text, "{message}");
        let mut category = Message { bytes: [0; 480], len: 0 };
        let _ = category.write_str(LOG_CATEGORIES[status as usize - 1].0);
        let category = category.bytes.as_ptr().cast();
        // SAFETY: the logger has the signature of its version; all texts end in zero and live through the call; in FMI 2.0
        // the message goes through "%s", so that no sign in it is taken for a format.
        unsafe {
            match self.sink {
                Sink::Two(Callbacks { logger: Some(logger), environment, .. }) => {
                    let text = text.bytes.as_ptr();
                    logger(environment, self.name.as_ptr(), status as i32, category, c"%s".as_ptr(), text);
                }
                Sink::Three { environment, message: Some(message) } => {
                    message(environment, status as i32, category, text.bytes.as_ptr().cast());
                }
                _ => {}
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_message_is_cut_and_ends_in_zero() {
        let mut message = Message { bytes: [0; 480], len: 0 };
        assert!(write!(message, "{}\0{}", "a".repeat(300), "b".repeat(300)).is_ok());
        assert_eq!(message.len, 479);
        assert_eq!(message.bytes[479], 0);
        assert_eq!(message.bytes[300], b'b');
    }
}
