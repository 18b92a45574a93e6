//! Questions to the person at the terminal.

use std::io::{BufRead, Write as _};

use crate::trace::Table;

/// Asks a person, or takes the default.
pub(super) struct Asker {
    pub yes: bool,
}

impl Asker {
    pub fn ask(&mut self, question: &str, offered: &str) -> String {
        if self.yes {
            return offered.to_owned();
        }
        let shown = if offered.is_empty() { "none".to_owned() } else { offered.to_owned() };
        eprint!("{question} [{shown}] ");
        let _ = std::io::stderr().flush();
        let mut reply = String::new();
        match std::io::stdin().lock().read_line(&mut reply) {
            Ok(n) if n > 0 && !reply.trim().is_empty() => reply.trim().to_owned(),
            Ok(0) => {
                // End of input: nothing is asked again.
                self.yes = true;
                eprintln!();
                offered.to_owned()
            }
            _ => offered.to_owned(),
        }
    }

    /// A column by name; none for an empty reply or "none".
    pub fn column(&mut self, question: &str, offered: Option<&str>, table: &Table) -> Option<String> {
        loop {
            let reply = self.ask(question, offered.unwrap_or_default());
            if reply.is_empty() || reply == "none" || reply == "-" {
                return None;
            }
            if table.position(&reply).is_some() {
                return Some(reply);
            }
            if self.yes {
                return None;
            }
            eprintln!("there is no column {reply:?}; the columns are: {}", table.names());
        }
    }
}
