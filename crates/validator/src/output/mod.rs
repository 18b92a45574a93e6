//! A validation report written down: for people, for programs, for continuous integration.

mod compared;
mod json;
mod junit;
mod sarif;
mod text;

pub use compared::{compared, compared_json};
pub use json::json;
pub use junit::junit;
pub use sarif::sarif;
pub use text::{rules_json, rules_text, text};
