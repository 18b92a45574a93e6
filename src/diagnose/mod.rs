//! The gap between model and machine: where, which, how far.

mod assess;
mod closed_loop;
mod decide;
mod diagnosis;
mod evidence;
mod features;
mod fit;
mod gap;
mod lattice;
mod lines;
pub mod location;
mod model;
mod noise;
mod one_more;
mod record;
mod response;
mod screen;
mod search;
mod states;
mod tones;
mod windows;
mod words;

pub use assess::{Case, Outcome, Replay, diagnose};
pub use closed_loop::{ClosedLoop, Commands, LoopErrors, LoopRanked, Sample, UnderControl};
pub use decide::{Decision, Verdict};
pub use diagnosis::{Cause, Diagnosis, GapReport, Ranked, SCHEMA, Where};
pub use evidence::{Evidence, Overlay};
pub use fit::{Data, predict};
pub use gap::{Figures, Levels};
pub use lines::{Found as LinearCause, examine as linear_cause, warnings as speed_warnings};
pub use location::Location;
pub use model::{BaseParameter, Model};
pub use noise::{NoiseEstimate, NoiseMethod, estimate_noise, find_period};
pub use record::{CHANNELS, Record};
pub use search::Tested;
pub use windows::{Window, cut};
