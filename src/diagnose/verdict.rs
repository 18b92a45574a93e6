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

impl Verdict {
    /// Its name in files.
    #[must_use]
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::Effect => "effect",
            Self::Parameters => "parameters",
            Self::NoGap => "no_gap",
            Self::Unexplained => "unexplained",
        }
    }
}
