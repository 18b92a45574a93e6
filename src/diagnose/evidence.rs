//! What the report draws: the location with its residual torques, and the held-out signals with the models' runs.

use super::fit::{Data, predict};
use super::gap;
use super::location::Location;
use super::model::Model;
use super::record::{CHANNELS, Record};
use super::windows::{Initial, Window};

/// What the report draws.
#[derive(Debug, Clone)]
pub struct Evidence {
    /// Where the gap lies, with the residual torques.
    pub located: Location,
    /// Held-out signals with the models' runs.
    pub held: Vec<Overlay>,
}

/// A measured channel and the models' runs, window by window; a missing value stands between two windows.
#[derive(Debug, Clone, PartialEq)]
pub struct Overlay {
    /// Name of the channel, see [`CHANNELS`].
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

/// Runs the first and the last of the models over held-out windows.
#[must_use]
pub fn gather(
    located: Location,
    record: &Record,
    windows: &[Window],
    initial: &[Initial],
    models: &[Model; 3],
) -> Evidence {
    let data = Data { record, windows };
    let [before, _, after] = models.map(|m| {
        let (_, initial) = gap::errors(data, &m, initial);
        predict(data, &m, &initial)
    });
    let held = (0..CHANNELS.len())
        .filter_map(|c| {
            let channel = record.channels[c].as_deref()?;
            let mut o = Overlay {
                channel: CHANNELS[c],
                time: Vec::new(),
                measured: Vec::new(),
                before: Vec::new(),
                after: Vec::new(),
                noise: record.noise[c],
            };
            let mut last = 0;
            for ((w, k, b), (_, _, a)) in before.iter().zip(&after) {
                if *w != last {
                    o.push([record.time(*k), f64::NAN, f64::NAN, f64::NAN]);
                    last = *w;
                }
                o.push([record.time(*k), channel[*k], b[c], a[c]]);
            }
            Some(o)
        })
        .collect();
    Evidence { located, held }
}

impl Overlay {
    pub(super) fn push(&mut self, [time, measured, before, after]: [f64; 4]) {
        self.time.push(time);
        self.measured.push(measured);
        self.before.push(before);
        self.after.push(after);
    }
}
