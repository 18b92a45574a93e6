//! FMUs from the outside: archive and description, the host that loads and runs them in a process of its own, the rules that they are
//! validated by, their simulation, comparison with reference results. It knows FMI 2.0 and 3.0 and nothing of this project's axis:
//! of [`eixo_records`] it takes the table of a file and the XML reader.

pub mod archive;
pub(crate) mod behaviour;
pub mod contained;
pub mod description;
pub mod host;
pub mod isolation;
pub mod output;
pub mod reference;
pub mod rules;
pub mod simulate;
pub mod validation;

use eixo_records as trace;
pub use eixo_records::xml;

// One macro for all tests that need something a machine may lack.
#[cfg(test)]
#[path = "../../../tests/program/skip.rs"]
mod skip;
