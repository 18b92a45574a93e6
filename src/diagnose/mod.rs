//! The gap between model and machine: where, which, how far.

pub mod location;
mod noise;
mod record;

pub use location::{Location, locate, smooth_states};
pub use noise::{NoiseEstimate, NoiseMethod, estimate_noise, find_period};
pub use record::{CHANNELS, Record};
