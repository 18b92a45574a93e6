//! Traces in memory, and as CSV.
