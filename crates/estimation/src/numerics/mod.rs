//! Numerics that know neither axis nor record: levels, spectra, distributions. Everything above uses these, each once.

pub mod distribution;
pub mod level;
pub mod spectrum;
