//! The gap in figures: rms error over rms signal, before, re-identified and after, on training and held-out windows.

/// rms errors over the rms of the signal; `noise_floor` likewise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Levels {
    /// The model as given.
    pub before: f64,
    /// Its parameters fitted.
    pub reidentified: f64,
    /// With the effect.
    pub after: f64,
    /// Noise of the encoders.
    pub noise_floor: f64,
}

/// Levels combined over the signals and of each.
#[derive(Debug, Clone, PartialEq)]
pub struct Figures {
    /// All signals, each in units of its rms.
    pub combined: Levels,
    /// Each signal, see [`CHANNELS`](super::CHANNELS).
    pub signals: Vec<(&'static str, Levels)>,
    /// The same errors as multiples of the noise floor: before, re-identified, after.
    pub multiples: [f64; 3],
}

/// `1 - (after - floor)/(before - floor)` of mean squares; one when there is no gap to close and none is left.
#[must_use]
pub fn closure(before: f64, after: f64, floor: f64) -> f64 {
    let gap = before - floor;
    if gap <= 1e-3 * floor {
        return if after <= before { 1.0 } else { 0.0 };
    }
    1.0 - (after - floor).max(0.0) / gap
}
