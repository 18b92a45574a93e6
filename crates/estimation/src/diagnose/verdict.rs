//! The verdict.

/// What the diagnosis comes to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// One or more effects of the library.
    Effect,
    /// The nominal parameters are off.
    Parameters,
    /// The model as given explains the record.
    NoGap,
    /// Nothing in the library brings the residual to the floor.
    Unexplained,
}
