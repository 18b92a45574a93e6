//! The gap between model and machine: where, which, how far.

mod assess;
mod closed_loop;
mod colour;
mod diagnosis;
mod jitter;
pub mod location;
mod model;
mod noise;
mod overlay;
mod quantisation;
mod record;
mod repair;
mod torque;
mod verdict;

pub use assess::{Case, Outcome, Replay};
pub use closed_loop::{ClosedLoop, Commands, LoopErrors, LoopRanked, Sample, UnderControl};
pub use diagnosis::{
    AxisParameter, Cause, ClosureOf, Diagnosis, Estimate, Figures, GapReport, HeldOut, Hypothesis, Levels, Ranked,
    Remainder, Rounding, RoundingRole, Site, Undecided, Way, Where,
};
pub use location::Location;
pub use model::{BaseParameter, Model};
pub use noise::{NoiseEstimate, NoiseMethod, estimate_noise, find_period};
pub use overlay::Overlay;
pub use record::{CHANNELS, Record, TORQUE};
pub use torque::{Confusable, Decision, Fit, UNCAUSED, Weighed, diagnose};
pub use verdict::Verdict;
