//! Where the gap lies, whatever its cause: in the chain, in time, in frequency, in state.
//!
//! The linear axis with an unknown input that walks at random is filtered along the record, the input in one place at a
//! time; the place under which the record is most likely holds the gap ([`places`]). With unknown torques on both
//! inertias the smoother gives the residual torques `r1`, `r2`, in the sign of `I1*a1 + B*(w1 - w2) + K*(th1 - th2) - T`
//! and `I2*a2 - B*(w1 - w2) - K*(th1 - th2)`: positive where a torque drives the axis that the model does not know.

mod by_frequency;
mod by_state;
mod by_time;
mod fit;
mod follows;
mod kalman;
mod places;
mod plant;
pub(super) mod words;

use serde::Serialize;

pub use by_frequency::FrequencyPart;
pub use by_state::{Bin, StateCurve};
pub use by_time::{Spread, TimeSlot};
pub use fit::{Fitted, Motion};
pub use places::PlaceEvidence;
pub use plant::Port;

use std::ops::Range;

use super::noise::{find_period, quantum};
use super::record::Record;
use crate::axis::{Parameters, Structure};
use crate::effects::Place;
use fit::Setting;

/// Samples that are filtered at one time: the evidence of a longer record is that of its worst section of so many, and
/// its residual torques are those of its sections, one after the other. Keeps time and memory of a long record in bounds.
const SECTION: usize = 32_768;
/// Samples that a section is smoothed beyond its ends.
const MARGIN: usize = 1024;

/// Where the gap lies.
#[derive(Debug, Clone, Serialize)]
pub struct Location {
    /// The place; `None` where nothing but parameters and initial state is needed.
    #[serde(skip)]
    pub place: Option<Place>,
    /// Evidence for every place the record can speak for.
    pub by_place: Vec<PlaceEvidence>,
    /// Why the place is weak, if it is.
    pub weak: Option<String>,
    /// Step of the values of each channel, rad or rad/s, where its resolution makes most of its noise: no gap that a
    /// torque or a slow error could close, but one of the encoder's.
    pub coarse: [Option<f64>; 4],
    /// How the gap spreads over the record.
    pub spread: Spread,
    /// Rms in slots of time.
    pub by_time: Vec<TimeSlot>,
    /// Parts by frequency.
    pub by_frequency: Vec<FrequencyPart>,
    /// Residuals against the state.
    pub by_state: Vec<StateCurve>,
    /// In a sentence.
    pub summary: String,
    /// The residual torques and the states by sample.
    #[serde(skip)]
    pub residual: Residual,
}

/// Residual torques and smoothed states, by sample.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Residual {
    /// Torque on the motor that the model does not know, N.m.
    pub r1: Vec<f64>,
    /// Its standard deviation, N.m.
    pub r1_std: Vec<f64>,
    /// The same on the table; empty for a rigid axis.
    pub r2: Vec<f64>,
    /// Its standard deviation, N.m.
    pub r2_std: Vec<f64>,
    /// The unknown input at the place found: N.m, or rad of the table's encoder; zero where there is none.
    pub at_place: Vec<f64>,
    /// Smoothed `[theta1, omega1, theta2, omega2]`.
    pub states: Vec<[f64; 4]>,
    /// Base parameters that were estimated together with the residual torques.
    pub parameters: Option<Parameters>,
}

/// Locates the gap between the axis with `parameters` and the record, all channels with white noise of known size.
///
/// The base parameters are re-estimated within every hypothesis (prior: 5 % about those given).
#[must_use]
pub fn locate(record: &Record, parameters: &Parameters, structure: Structure) -> Location {
    let record = &without_offset(record, parameters, structure);
    let section = worst_section(record, parameters, structure);
    let part = section.map(|s| cut(record, s));
    let setting = Setting::new(part.as_ref().unwrap_or(record), parameters, structure);
    let flexible = structure == Structure::TwoInertia;
    let mut by_place = places::evidence(&setting);
    let mut place = places::likeliest(&by_place);
    let residual = residual_torques(&setting, record, &by_place, place);
    let by_state = state_curves(record, &residual, place, flexible);
    if places::closed_loop(&mut by_place, &by_state) {
        place = places::likeliest(&by_place);
    }
    let slots = by_time::by_time(
        record.start,
        record.dt,
        &residual.r1,
        flexible.then_some(&residual.r2[..]),
        &residual.at_place,
    );
    let spread = by_time::spread(&slots);
    let by_frequency = frequency_parts(record, &residual, place);
    let coarse = std::array::from_fn(|c| {
        // Half of the noise's variance is the lattice's own, step^2/12.
        let step = record.channels[c].as_deref().and_then(quantum)?;
        (step * step / 12.0 > 0.5 * record.noise[c].powi(2)).then_some(step)
    });
    let weak = words::weakness(record, structure, &by_place, place);
    let summary = words::summary(&words::Findings {
        place,
        weak: weak.as_deref(),
        coarse: &coarse,
        spread,
        residual: &residual,
        frequency: &by_frequency,
        state: &by_state,
    });
    Location { place, by_place, weak, coarse, spread, by_time: slots, by_frequency, by_state, summary, residual }
}

/// Where a residual torque on the one inertia of a rigid axis shows: in time, frequency and state.
#[must_use]
pub fn along(record: &Record, residual: Residual) -> Location {
    let by_state = state_curves(record, &residual, None, false);
    let by_frequency = frequency_parts(record, &residual, None);
    let slots = by_time::by_time(record.start, record.dt, &residual.r1, None, &residual.r1);
    Location {
        place: None,
        by_place: Vec::new(),
        weak: None,
        coarse: [None; 4],
        spread: by_time::spread(&slots),
        by_time: slots,
        by_frequency,
        by_state,
        summary: String::new(),
        residual,
    }
}

/// States of the axis given the record, unknown torques on both inertias allowed, with their standard deviations.
///
/// For a start of other fits: robust against whatever effect there is, at the price of the parameters given.
#[must_use]
pub fn smooth_states(record: &Record, parameters: &Parameters, structure: Structure) -> Motion {
    let record = &without_offset(record, parameters, structure);
    let section = worst_section(record, parameters, structure);
    let part = section.map(|s| cut(record, s));
    let setting = Setting::new(part.as_ref().unwrap_or(record), parameters, structure);
    smooth(&setting, record, &setting.walks(&both(structure)))
}

/// The samples in `range`, with noise and hold as they are.
fn cut(record: &Record, range: Range<usize>) -> Record {
    Record {
        start: record.time(range.start),
        torque: record.torque[range.clone()].to_vec(),
        channels: record.channels.each_ref().map(|c| c.as_ref().map(|c| c[range.clone()].to_vec())),
        ..*record
    }
}

/// Equal sections of at most [`SECTION`] samples.
fn sections(n: usize) -> Vec<Range<usize>> {
    let count = n.div_ceil(SECTION).max(1);
    (0..count).map(|i| i * n / count..(i + 1) * n / count).collect()
}

/// The section of a long record that the axis without effects explains worst, by likelihood with default walks.
fn worst_section(record: &Record, parameters: &Parameters, structure: Structure) -> Option<Range<usize>> {
    let all = sections(record.len());
    if all.len() < 2 {
        return None;
    }
    let value = |range: &Range<usize>| {
        let part = cut(record, range.clone());
        Setting::new(&part, parameters, structure).likelihood_at_default(&both(structure)) / range.len() as f64
    };
    all.into_iter().map(|r| (value(&r), r)).min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, r)| r)
}

/// Smoothed motion along the whole record, section by section.
fn smooth(setting: &Setting<'_>, record: &Record, fitted: &Fitted) -> Motion {
    if setting.record.len() == record.len() {
        return setting.smooth(fitted);
    }
    let mut whole = Motion::default();
    for range in sections(record.len()) {
        let wide = range.start.saturating_sub(MARGIN)..(range.end + MARGIN).min(record.len());
        let part = cut(record, wide.clone());
        let prior = plant::Prior::new(&part, &setting.parameters, setting.structure);
        let motion = Setting { record: &part, prior, ..setting.clone() }.smooth(fitted);
        whole.append(&motion, range.start - wide.start..range.end - wide.start);
    }
    whole
}

/// The ports of the residual torques.
fn both(structure: Structure) -> Vec<Port> {
    match structure {
        Structure::TwoInertia => vec![Port::Motor, Port::Table],
        Structure::Rigid => vec![Port::Motor],
    }
}

/// The record with the table's angle moved to the motor's, where the two start farther apart than the coupling could
/// twist: encoders have their own zeros.
#[must_use]
pub fn without_offset(record: &Record, p: &Parameters, structure: Structure) -> Record {
    let mut record = record.clone();
    if let [Some(motor), _, Some(table), _] = &mut record.channels {
        let n = motor.len().max(1) as f64;
        let offset = motor.iter().zip(table.iter()).map(|(a, b)| a - b).sum::<f64>() / n;
        let peak = record.torque.iter().fold(0.0_f64, |m, t| m.max(t.abs()));
        let flexible = structure == Structure::TwoInertia && p.k > 0.0;
        let reach = if flexible { 5.0 * peak / p.k } else { 0.0 };
        if offset.abs() > reach {
            for v in table {
                *v += offset;
            }
        }
    }
    record
}

fn residual_torques(
    setting: &Setting<'_>,
    record: &Record,
    by_place: &[PlaceEvidence],
    place: Option<Place>,
) -> Residual {
    let ports = both(setting.structure);
    let fit_of = |place: Place| by_place.iter().find(|e| e.place == Some(place)).map(|e| &e.fitted);
    // Start from the walks of the single places, and from the parameters of the best.
    let best = by_place.iter().find(|e| e.place == place).map(|e| &e.fitted);
    let parameters = best.map_or(setting.parameters, |f| f.parameters);
    let of = |p: Place, chosen: bool| {
        let step = fit_of(p).and_then(|f| f.steps.first().copied()).unwrap_or(0.0);
        // A place that is not the one takes a small part.
        if chosen { step } else { 1e-2 * step }
    };
    let motor = matches!(place, Some(Place::Motor | Place::Input | Place::Coupling));
    let table = matches!(place, Some(Place::Table | Place::Coupling));
    let steps = match ports.len() {
        1 => vec![of(Place::Motor, true)],
        _ => vec![of(Place::Motor, motor || !table), of(Place::Table, table)],
    };
    let fitted = setting.fit_at(&ports, steps, &parameters);
    let motion = smooth(setting, record, &fitted);
    let n = record.len();
    let mut inputs = motion.inputs.into_iter();
    let mut stds = motion.input_std.into_iter();
    let mut residual = Residual {
        r1: inputs.next().unwrap_or_default(),
        r1_std: stds.next().unwrap_or_default(),
        r2: inputs.next().unwrap_or_default(),
        r2_std: stds.next().unwrap_or_default(),
        at_place: vec![0.0; n],
        states: motion.states,
        parameters: Some(fitted.parameters),
    };
    if let Some(best) = best.filter(|f| !f.ports.is_empty()) {
        let motion = smooth(setting, record, best);
        residual.at_place = motion.inputs.into_iter().next().unwrap_or_default();
        if best.ports[0] == Port::TableAngle {
            // The whole error of the encoder: its pitch and its delay beside the walk.
            let [scale, delay] = [best.sensor[0], best.sensor[1] * setting.record.dt];
            for (e, s) in residual.at_place.iter_mut().zip(&motion.states) {
                *e += scale * s[2] - delay * s[3];
            }
        }
    }
    residual
}

/// What the series at the place found is called, with its unit.
fn name_of(place: Option<Place>) -> Option<(&'static str, &'static str)> {
    match place {
        Some(Place::Coupling) => Some(("coupling", "N.m")),
        Some(Place::Sensor) => Some(("sensor", "rad")),
        _ => None,
    }
}

/// The series to look at: both residual torques, and the input at the place where it is neither.
fn series<'a>(residual: &'a Residual, place: Option<Place>) -> Vec<((&'static str, &'static str), &'a [f64])> {
    let mut all: Vec<((&'static str, &'static str), &'a [f64])> = vec![(("r1", "N.m"), &residual.r1)];
    if !residual.r2.is_empty() {
        all.push((("r2", "N.m"), &residual.r2));
    }
    if let Some(name) = name_of(place) {
        all.push((name, &residual.at_place));
    }
    all
}

fn frequency_parts(record: &Record, residual: &Residual, place: Option<Place>) -> Vec<FrequencyPart> {
    let period = find_period(&record.torque);
    let theta1: Vec<f64> = residual.states.iter().map(|s| s[0]).collect();
    series(residual, place)
        .into_iter()
        .flat_map(|((name, _), r)| by_frequency::by_frequency(name, r, &record.torque, &theta1, record.dt, period))
        .collect()
}

fn state_curves(record: &Record, residual: &Residual, place: Option<Place>, flexible: bool) -> Vec<StateCurve> {
    let column = |f: &dyn Fn(&[f64; 4]) -> f64| residual.states.iter().map(f).collect::<Vec<_>>();
    let mut variables: Vec<by_state::Variable<'_>> = vec![
        ("omega1", "rad/s", column(&|s| s[1])),
        ("theta1 within the turn", "rad", by_state::within_turn(&column(&|s| s[0]))),
        ("theta1", "rad", column(&|s| s[0])),
        ("T", "N.m", record.torque.clone()),
    ];
    if flexible {
        variables.extend([
            ("omega2", "rad/s", column(&|s| s[3])),
            ("theta2 within the turn", "rad", by_state::within_turn(&column(&|s| s[2]))),
            ("theta2", "rad", column(&|s| s[2])),
            ("twist", "rad", column(&|s| s[0] - s[2])),
            ("twist rate", "rad/s", column(&|s| s[1] - s[3])),
        ]);
    }
    series(residual, place)
        .into_iter()
        .flat_map(|(name, r)| variables.iter().filter_map(move |v| by_state::curve(name, r, v)).collect::<Vec<_>>())
        .collect()
}

#[cfg(test)]
mod tests;
