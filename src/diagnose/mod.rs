//! The gap between model and machine: where, which, how far.

mod features;
mod fit;
mod model;
mod noise;
mod record;
mod response;
mod screen;
mod search;
mod windows;

pub use fit::{Data, Fitted, fit, predict};
pub use model::{BaseParameter, Coordinate, Free, Model};
pub use noise::{NoiseEstimate, NoiseMethod, estimate_noise, find_period};
pub use record::{CHANNELS, Record};
pub use response::States;
pub use screen::{Candidate, Screen};
pub use search::{Search, Tested};
pub use windows::{Window, cut};
