//! What a residual torque looks like, in words.

use super::super::location::Location;
use super::super::location::words::{against, foreign, over_time, significant};

/// The residual on a rigid axis' one inertia.
const RESIDUAL: &str = "r1";

/// Where the gap shows, in a sentence.
#[must_use]
pub fn gap_shows(l: &Location) -> String {
    let rms = (l.residual.r1.iter().map(|r| r * r).sum::<f64>() / l.residual.r1.len().max(1) as f64).sqrt();
    format!("With its parameters fitted alone, the model lacks {} rms in torque, {}.", significant(rms), shows(l))
}

/// What the residual torque looks like.
#[must_use]
pub fn shows(l: &Location) -> String {
    let parts = against(&l.by_state, RESIDUAL).into_iter().chain(foreign(&l.by_frequency, RESIDUAL));
    parts.chain([over_time(l.spread).to_owned()]).collect::<Vec<_>>().join(", ")
}
