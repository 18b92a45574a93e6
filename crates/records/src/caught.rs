//! Runs readers of other crates on files that may be damaged in any way: a panic in one of them becomes an error of the file, and its
//! message is not printed.

use std::cell::Cell;
use std::panic::{AssertUnwindSafe, catch_unwind, set_hook, take_hook};
use std::sync::Once;

thread_local! {
    /// Whether this thread is within [`caught`].
    static WITHIN: Cell<bool> = const { Cell::new(false) };
}

/// Runs a reader. Panics outside of it are printed as usual.
///
/// # Errors
/// The error of `run` as a text, or that the reader panicked.
pub(super) fn caught<T, E: std::fmt::Display>(run: impl FnOnce() -> Result<T, E>) -> Result<T, String> {
    static QUIET: Once = Once::new();
    QUIET.call_once(|| {
        let usual = take_hook();
        set_hook(Box::new(move |info| {
            if !WITHIN.get() {
                usual(info);
            }
        }));
    });
    let outer = WITHIN.replace(true);
    let outcome = catch_unwind(AssertUnwindSafe(run));
    WITHIN.set(outer);
    outcome.map_or_else(|_| Err("the reader gave up on it".to_owned()), |read| read.map_err(|e| e.to_string()))
}
