//! The unmodelled effects: one ordered, append-only list.
