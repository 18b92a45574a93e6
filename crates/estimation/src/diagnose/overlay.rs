//! Held-out signals with the models' runs: what the report draws.

/// A measured channel and the models' runs, window by window, or the torque and what each model needs for the measured motion; a missing
/// value stands where nothing is told.
#[derive(Debug, Clone, PartialEq)]
pub struct Overlay {
    /// Name of the channel, see [`CHANNELS`](super::CHANNELS), or [`TORQUE`](super::TORQUE).
    pub channel: &'static str,
    /// Time of each sample, s.
    pub time: Vec<f64>,
    /// What was measured.
    pub measured: Vec<f64>,
    /// The nominal model, its initial states fitted.
    pub before: Vec<f64>,
    /// The improved model, its initial states fitted.
    pub after: Vec<f64>,
    /// Standard deviation of the noise.
    pub noise: f64,
}

impl Overlay {
    pub(super) fn push(&mut self, [time, measured, before, after]: [f64; 4]) {
        self.time.push(time);
        self.measured.push(measured);
        self.before.push(before);
        self.after.push(after);
    }
}
