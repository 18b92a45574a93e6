//! From traces to parameters: excitation signals, regressions, estimators and their figures of merit.

mod assessment;
mod bridged;
pub mod excitation;
pub mod extended;
pub mod frequency;
pub mod hold;
pub mod identifiability;
pub mod instrumental;
pub mod joined;
mod known;
pub mod levenberg;
pub(crate) mod long_run;
pub mod lsq;
mod methods;
pub mod output_error;
pub mod paper;
pub mod parameters;
pub mod record;
pub mod recursive;
pub mod regression;
pub mod result;
pub mod rigid;
pub mod run;
pub mod statistics;
pub mod stream;
pub mod tables;

#[cfg(test)]
mod coverage;
#[cfg(test)]
mod tests;
