//! Quantisation: rounding has no derivative to fit, but leaves its lattice in the readings.
//!
//! Rounding to a step `q` adds an error of variance `q^2/12` (Widrow & Kollar, Quantization Noise, 2008, chapter 5). It
//! is named as the cause when the readings lie on a lattice whose error makes the better part of the noise floor, and
//! nothing else explains the record better.

use serde_json::json;

use super::assess::Case;
use super::diagnosis::{Cause, Diagnosis};
use super::noise::NoiseEstimate;
use super::torque::Decision;
use super::verdict::Verdict;
use crate::effects::{Effect, Place};

/// Share of the step within which a model's own rounding is the record's.
const SAME: f64 = 0.1;

/// Whether rounding makes the better part of the noise of a channel.
fn dominates(noise: &NoiseEstimate) -> bool {
    noise.quantum.iter().zip(&noise.std).any(|(q, std)| q.is_some_and(|q| q * q / 12.0 > 0.5 * std * std))
}

/// Names quantisation where the record is at the floor and the lattice is what the floor is made of; where it may not be
/// named, rounding is no noise that would explain the record.
pub fn judge(case: &Case<'_>, decision: &Decision, diagnosis: &mut Diagnosis) {
    let quantum = case.noise.quantum.iter().flatten().copied().fold(0.0, f64::max);
    // A model that rounds as the record does has no gap there.
    let known = case.nominal.effects.of(Effect::EncoderQuantisation)[0];
    if quantum <= 0.0 || (known - quantum).abs() < SAME * quantum {
        return;
    }
    let seen: Vec<usize> = (0..4).filter(|c| case.noise.quantum[*c].is_some()).collect();
    diagnosis.warnings.push(format!(
        "{} read in steps of {quantum:.3e}; the noise floor holds their rounding.",
        seen.iter().map(|c| super::record::CHANNELS[*c]).collect::<Vec<_>>().join(" and "),
    ));
    if !matches!(decision.verdict, Verdict::NoGap | Verdict::Parameters) || !dominates(case.noise) {
        return;
    }
    diagnosis.location.place = Place::Sensor.as_str().to_owned();
    for (place, share) in &mut diagnosis.location.by_place {
        *share = json!(f64::from(u8::from(place == Place::Sensor.as_str())));
    }
    if !case.suspects.contains(&Effect::EncoderQuantisation) {
        diagnosis.verdict = Verdict::Unexplained;
        return;
    }
    diagnosis.verdict = Verdict::Effect;
    diagnosis.causes = vec![Cause::alone(Effect::EncoderQuantisation, "step", quantum, 0.0, case.motion.unit("rad"))];
}
