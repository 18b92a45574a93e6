//! The gap between model and machine: where, which, how far.
