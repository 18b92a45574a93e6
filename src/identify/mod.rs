//! From traces to parameters: excitation signals, regressions, estimators and their figures of merit.

pub mod excitation;
pub mod levenberg;
pub mod lsq;
pub mod recursive;
