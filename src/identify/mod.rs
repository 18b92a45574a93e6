//! From traces to parameters: excitation signals, regressions, estimators and their figures of merit.

pub mod excitation;
pub mod frequency;
pub mod instrumental;
pub mod levenberg;
pub mod lsq;
pub mod output_error;
pub mod parameters;
pub mod record;
pub mod recursive;
pub mod regression;
pub mod result;
pub mod statistics;

#[cfg(test)]
mod tests;
