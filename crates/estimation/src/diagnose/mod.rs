//! The gap between model and machine: where, which, how far.

mod assess;
mod closed_loop;
mod conclusion;
mod confidence;
mod decision;
mod diagnosis;
mod gap;
pub mod location;
mod material;
mod moves;
mod octaves;
mod overlay;
mod pool;
mod prepared;
mod procedure;
mod quantisation;
mod race;
mod residual;
mod search;
mod steps;
mod summary;
#[cfg(test)]
mod tests;
mod verdict;
mod weighing;

// What a diagnosis takes and gives stands with it.
pub use crate::conditioning::{CHANNELS, NoiseEstimate, NoiseMethod, Record, TORQUE, estimate_noise, find_period};
pub use crate::hypothesis::{BaseParameter, Fit, Hypothesis, Model};
pub use assess::{Case, Outcome, Replay};
pub use closed_loop::{ClosedLoop, Commands, LoopRanked, verified};
pub use confidence::UNCAUSED;
pub use decision::Decision;
pub use diagnosis::{
    AxisParameter, Cause, ClosureOf, Diagnosis, Estimate, Figures, GapReport, HeldOut, Levels, Ranked, Remainder,
    Rounding, RoundingRole, Site, Undecided, Way, Where,
};
pub use location::Location;
pub use overlay::Overlay;
pub use procedure::diagnose;
pub use verdict::Verdict;
pub use weighing::{Confusable, Weighed};
