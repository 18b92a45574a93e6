//! The gap in figures: rms error over rms signal, before, re-identified and after, on training and held-out windows.

use nalgebra::Vector4;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::Serialize;

use super::fit::{Data, Effort, fit};
use super::model::Model;
use super::record::{CHANNELS, Record};
use super::windows::{Initial, Window};

/// Resamplings of the block bootstrap.
const RESAMPLINGS: usize = 400;
/// Its seed: the interval is the same from run to run.
const SEED: u64 = 20_060_718;

/// rms errors over the rms of the signal; `noise_floor` likewise.
#[derive(Debug, Clone, Serialize)]
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
#[derive(Debug, Clone, Serialize)]
pub struct Figures {
    /// All signals, each in units of its rms.
    #[serde(flatten)]
    pub combined: Levels,
    /// Each signal.
    pub signals: serde_json::Map<String, serde_json::Value>,
    /// The same errors as multiples of the noise floor: before, re-identified, after.
    pub multiples: [f64; 3],
}

/// Squared errors of one window by channel.
type Errors = Vector4<f64>;

/// Squared errors of a model over windows whose initial states are fitted, window by window, and the initial states.
#[must_use]
pub fn errors(data: Data<'_>, model: &Model, initial: &[Initial]) -> (Vec<Errors>, Vec<Initial>) {
    let fitted = fit(data, model, model, &[], initial, Effort::to_the_end(12, 1.0));
    let mut windows = vec![Errors::zeros(); data.windows.len()];
    for (w, k, r) in super::fit::predict(data, &fitted.model, &fitted.initial) {
        for (c, channel) in data.record.channels.iter().enumerate() {
            if let Some(channel) = channel {
                windows[w][c] += (r[c] - channel[k]).powi(2);
            }
        }
    }
    (windows, fitted.initial)
}

/// The three models' errors on one record, and what follows.
#[derive(Debug, Clone)]
pub struct Gap {
    /// Figures for people.
    pub figures: Figures,
    /// Closure of the gap from the model as given.
    pub closure: f64,
    /// Closure from the re-identified model.
    pub closure_of_effect: f64,
    /// 95 % interval of `closure`.
    pub interval: [f64; 2],
}

/// Measures the gap on a record.
#[must_use]
pub fn measure(record: &Record, windows: &[Window], models: [&[Errors]; 3]) -> Gap {
    let counts: f64 = windows.iter().map(|w| w.compared.len() as f64).sum();
    let scale: Vec<f64> = (0..4).map(|c| signal_rms(record, windows, c)).collect();
    let present: Vec<usize> = (0..4).filter(|c| record.channels[*c].is_some()).collect();
    let sum = |errors: &[Errors]| errors.iter().fold(Errors::zeros(), |a, b| a + b) / counts;
    let total = models.map(sum);
    let relative = |v: f64, c: usize| v.max(0.0).sqrt() / scale[c].max(f64::MIN_POSITIVE);
    let signals = present
        .iter()
        .map(|&c| {
            let [before, reidentified, after] = total.map(|t| relative(t[c], c));
            let noise_floor = relative(record.noise[c].powi(2), c);
            (CHANNELS[c].to_owned(), serde_json::json!(Levels { before, reidentified, after, noise_floor }))
        })
        .collect();
    let combine = |squares: &dyn Fn(usize) -> f64| {
        (present.iter().map(|&c| squares(c) / scale[c].max(f64::MIN_POSITIVE).powi(2)).sum::<f64>()
            / present.len() as f64)
            .sqrt()
    };
    let [before, reidentified, after] = [0, 1, 2].map(|m: usize| combine(&|c| total[m][c]));
    let noise_floor = combine(&|c| record.noise[c].powi(2));
    let floor = noise_floor * noise_floor * present.len() as f64;
    let weigh = |e: &Errors| present.iter().map(|&c| e[c] / scale[c].max(f64::MIN_POSITIVE).powi(2)).sum::<f64>();
    let closure_of = |from: &Errors, to: &Errors| closure(weigh(from), weigh(to), floor);
    let interval = bootstrap(windows, models, &closure_of);
    Gap {
        figures: Figures {
            combined: Levels { before, reidentified, after, noise_floor },
            signals,
            multiples: total.map(|t| (weigh(&t) / floor).sqrt()),
        },
        closure: closure_of(&total[0], &total[2]),
        closure_of_effect: closure_of(&total[1], &total[2]),
        interval,
    }
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

/// Block bootstrap over windows (Kunsch, Ann. Statist. 17(3), 1989): 95 % interval of the closure.
fn bootstrap(windows: &[Window], models: [&[Errors]; 3], closure_of: &dyn Fn(&Errors, &Errors) -> f64) -> [f64; 2] {
    let n = windows.len();
    let mut rng = ChaCha8Rng::seed_from_u64(SEED);
    let mut values: Vec<f64> = (0..RESAMPLINGS)
        .map(|_| {
            let (mut from, mut to, mut count) = (Errors::zeros(), Errors::zeros(), 0.0);
            for _ in 0..n {
                let w = rng.random_range(0..n);
                from += models[0][w];
                to += models[2][w];
                count += windows[w].compared.len() as f64;
            }
            closure_of(&(from / count), &(to / count))
        })
        .collect();
    values.sort_by(f64::total_cmp);
    let at = |q: f64| values[((values.len() - 1) as f64 * q).round() as usize];
    [at(0.025), at(0.975)]
}

fn signal_rms(record: &Record, windows: &[Window], c: usize) -> f64 {
    let Some(channel) = &record.channels[c] else { return 0.0 };
    let values = || windows.iter().flat_map(|w| channel[w.compared.clone()].iter());
    let n = values().count() as f64;
    let mean = values().sum::<f64>() / n;
    (values().map(|v| (v - mean).powi(2)).sum::<f64>() / n).sqrt()
}
