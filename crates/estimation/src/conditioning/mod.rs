//! A record as estimators compare it: its samples without those that the log lost, and the noise of its encoders.

mod colour;
mod decimation;
mod jitter;
mod noise;
mod record;
mod repair;

pub use decimation::{Rate, decimate, smooth};
pub use noise::{NoiseEstimate, NoiseMethod, estimate_noise, find_period};
pub use record::{CHANNELS, Record, TORQUE};
pub(crate) use repair::bridged;
