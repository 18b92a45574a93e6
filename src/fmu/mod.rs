//! FMU archives from the outside: packaging, import host, validation rules, simulation.

pub mod archive;
pub mod description;
pub mod host;
pub mod xml;
