//! FMU archives from the outside: packaging, import host, validation rules, simulation.

pub mod archive;
pub(crate) mod behaviour;
pub mod contained;
pub mod description;
pub mod host;
pub mod isolation;
pub mod output;
pub mod package;
pub mod reference;
pub mod rules;
pub mod simulate;
pub mod validation;

pub use eixo_records::xml;
