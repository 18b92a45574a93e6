//! What is diagnosed, and what comes of it.

use super::decision::Decision;
use super::diagnosis::Diagnosis;
use super::overlay::Overlay;
use crate::axis::AxisKind;
use crate::conditioning::{NoiseEstimate, Record};
use crate::effects::Effect;
use crate::hypothesis::model::Model;

/// Share of a single record that is held out.
pub(super) const HELD_OUT: f64 = 1.0 / 3.0;

/// What is diagnosed.
pub struct Case<'a> {
    /// The machine's name.
    pub machine: String,
    /// The nominal model.
    pub nominal: Model,
    /// What its numbers are units of.
    pub motion: AxisKind,
    /// Record that the fits see.
    pub train: &'a Record,
    /// What is known of its noise.
    pub noise: &'a NoiseEstimate,
    /// Record held out; without it the last third of the one given.
    pub holdout: Option<&'a Record>,
    /// Effects that may be named.
    pub suspects: Vec<Effect>,
}

/// The diagnosis, and the improved model.
pub struct Outcome {
    /// For files and people.
    pub diagnosis: Diagnosis,
    /// The nominal model with its parameters as fitted and the effects found.
    pub improved: Model,
    /// Model as given, re-identified, improved: for plots.
    pub models: [Model; 3],
    /// The decision with its fits.
    pub decision: Decision,
    /// Held-out signals with the models' runs.
    pub overlays: Vec<Overlay>,
    /// A stretch of held-out data for the improved model to be run on.
    pub replay: Replay,
}

/// The first held-out window, and the improved model's state at its beginning.
pub struct Replay {
    /// The stretch.
    pub record: Record,
    /// `[theta1, omega1, theta2, omega2]` at its first sample.
    pub initial: [f64; 4],
}
