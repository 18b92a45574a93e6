//! How likely each place is, whatever the effect: an unknown input in one place at a time.

use rayon::prelude::*;
use serde::{Serialize, Serializer};

use super::StateCurve;
use super::fit::{Fitted, Setting};
use super::follows::{follow, of_the_command, of_the_motion};
use super::plant::Port;
use crate::axis::Structure;
use crate::effects::Place;

/// What a place must gain in log-likelihood over "nowhere" to be believed, beyond the price of its walk (BIC).
const MATERIAL: f64 = 10.0;
/// The walk is only a stand-in for the effect: a gap between two places counts against this share of the number of
/// readings, or of the gap between the best place and none where that is less.
const TEMPER: f64 = 0.02;

/// A place is sure from this share of the evidence on, and a curve that explains this share of a torque stands for it.
pub(super) const SURE: f64 = 0.9;

/// What speaks for a place.
#[derive(Debug, Clone, Serialize)]
pub struct PlaceEvidence {
    /// The place; `None` is nowhere: parameters and initial state alone.
    #[serde(serialize_with = "place_name")]
    pub place: Option<Place>,
    /// Log-likelihood of the record with an unknown input there, less the price of what is free (BIC).
    pub log_likelihood: f64,
    /// Share of the evidence, 0 to 1; all places sum to 1.
    pub share: f64,
    /// The fit behind it.
    #[serde(skip)]
    pub fitted: Fitted,
}

fn place_name<S: Serializer>(place: &Option<Place>, s: S) -> Result<S::Ok, S::Error> {
    s.serialize_str(place.map_or("nowhere", Place::as_str))
}

/// Evidence for every place that the record can speak for, in the order of the chain, "nowhere" first.
#[must_use]
pub fn evidence(setting: &Setting<'_>) -> Vec<PlaceEvidence> {
    let record = setting.record;
    let flexible = setting.structure == Structure::TwoInertia;
    let mut hypotheses: Vec<(Option<Place>, Vec<Port>)> = vec![(Some(Place::Motor), vec![Port::Motor])];
    if flexible {
        hypotheses.push((Some(Place::Coupling), vec![Port::Coupling]));
        hypotheses.push((Some(Place::Table), vec![Port::Table]));
    }
    if record.sees_motor() && record.sees_table() {
        let ports = [(2, Port::TableAngle), (3, Port::TableSpeed)];
        let ports = ports.into_iter().filter(|(c, _)| record.channels[*c].is_some()).map(|(_, p)| p).collect();
        hypotheses.push((Some(Place::Sensor), ports));
    }
    let samples = (record.len() * record.channels.iter().flatten().count()) as f64;
    let price = |fitted: &Fitted| {
        let free = fitted.ports.len() as f64 * 2.0 + if fitted.ports.contains(&Port::TableAngle) { 2.0 } else { 0.0 };
        0.5 * free * samples.ln()
    };
    let nowhere = setting.fit(&[]);
    let fit = |(place, ports): &(Option<Place>, Vec<Port>)| {
        let fitted = setting.fit(ports);
        if matches!(place, Some(Place::Sensor | Place::Coupling)) {
            let other = setting.fit_slow(ports);
            if other.log_likelihood > fitted.log_likelihood {
                return other;
            }
        }
        fitted
    };
    let fits: Vec<Fitted> = hypotheses.par_iter().map(fit).collect();
    let mut all = vec![PlaceEvidence {
        place: None,
        log_likelihood: nowhere.log_likelihood + MATERIAL,
        share: 0.0,
        fitted: nowhere,
    }];
    for ((place, _), fitted) in hypotheses.into_iter().zip(fits) {
        all.push(PlaceEvidence { place, log_likelihood: fitted.log_likelihood - price(&fitted), share: 0.0, fitted });
    }
    follow_torques(setting, &mut all, samples);
    share(&mut all, samples);
    all
}

/// Lets dictionaries explain the unknown torques of the likeliest places, and splits the one on the motor into one that
/// follows the command (the input) and one that follows the motion.
fn follow_torques(setting: &Setting<'_>, all: &mut Vec<PlaceEvidence>, samples: f64) {
    let best = all.iter().map(|e| e.log_likelihood).fold(f64::NEG_INFINITY, f64::max);
    let near = |e: &&PlaceEvidence| e.log_likelihood > best - 5.0 * TEMPER * samples;
    let mut work: Vec<(Place, Fitted, bool)> = Vec::new();
    for e in all.iter().filter(near) {
        match e.place {
            Some(Place::Motor) => {
                work.push((Place::Input, e.fitted.clone(), true));
                work.push((Place::Motor, e.fitted.clone(), false));
            }
            Some(place @ (Place::Coupling | Place::Table)) => work.push((place, e.fitted.clone(), false)),
            _ => {}
        }
    }
    let value = |(_, plain, commanded): &(Place, Fitted, bool)| {
        let words = if *commanded {
            of_the_command(&setting.record.torque)
        } else {
            of_the_motion(&setting.smooth(plain).states, plain.ports[0], setting.prior.torque)
        };
        let followed = follow(setting, plain, &words, *commanded);
        followed.fitted.log_likelihood - 0.5 * (2.0 + followed.words as f64) * samples.ln()
    };
    let values: Vec<f64> = work.par_iter().map(value).collect();
    for ((place, plain, _), value) in work.into_iter().zip(values) {
        match all.iter_mut().find(|e| e.place == Some(place)) {
            Some(e) => e.log_likelihood = e.log_likelihood.max(value),
            None => all.push(PlaceEvidence { place: Some(place), log_likelihood: value, share: 0.0, fitted: plain }),
        }
    }
}

/// The likeliest place.
#[must_use]
pub fn likeliest(all: &[PlaceEvidence]) -> Option<Place> {
    all.iter().max_by(|a, b| a.log_likelihood.total_cmp(&b.log_likelihood)).and_then(|e| e.place)
}

/// Gives the motor the evidence of the input, and the other way round, where the dictionaries hardly tell them apart and
/// one curve of the motion explains the torque that the command does not: in a closed loop the command follows the
/// motion too. True if it did.
pub fn closed_loop(all: &mut [PlaceEvidence], curves: &[StateCurve]) -> bool {
    let at = |place: Place| all.iter().position(|e| e.place == Some(place));
    let (Some(input), Some(motor)) = (at(Place::Input), at(Place::Motor)) else { return false };
    let explained = |against: &[&str]| {
        let own = curves.iter().filter(|c| c.residual == "r1" && against.contains(&c.against));
        own.map(|c| c.explained).fold(0.0, f64::max)
    };
    let motion = explained(&["omega1", "theta1 within the turn"]);
    let near = likeliest(all) == Some(Place::Input) && all[motor].share > 1.0 - SURE;
    if !near || motion < SURE || motion < explained(&["T"]) + 0.1 {
        return false;
    }
    let (low, high) = (all[motor].log_likelihood, all[input].log_likelihood);
    (all[motor].log_likelihood, all[input].log_likelihood) = (high, low);
    let (less, more) = (all[motor].share, all[input].share);
    (all[motor].share, all[input].share) = (more, less);
    true
}

/// Shares from the log-likelihoods, tempered.
pub(super) fn share(all: &mut [PlaceEvidence], samples: f64) {
    let best = all.iter().map(|e| e.log_likelihood).fold(f64::NEG_INFINITY, f64::max);
    let none = all.iter().find(|e| e.place.is_none()).map_or(best, |e| e.log_likelihood);
    let scale = (TEMPER * (best - none).min(samples)).max(1.0);
    for e in all.iter_mut() {
        e.share = ((e.log_likelihood - best) / scale).exp();
    }
    let sum: f64 = all.iter().map(|e| e.share).sum();
    for e in all.iter_mut() {
        e.share /= sum;
    }
}
