//! Quantisation: rounding has no derivative to fit, but leaves its lattice in the readings.
//!
//! Rounding to a step `q` adds an error of variance `q^2/12` (Widrow & Kollar, Quantization Noise, 2008, chapter 5). It
//! is named as the cause when the readings lie on a lattice whose error makes the better part of the noise floor, and
//! nothing else explains the record better.

use super::assess::Case;
use super::diagnosis::{Cause, Diagnosis, Rounding, RoundingRole, Site};
use super::verdict::Verdict;
use crate::conditioning::CHANNELS;
use crate::conditioning::NoiseEstimate;
use crate::effects::{Effect, Place};

/// Share of the step within which a model's own rounding is the record's.
const SAME: f64 = 0.1;

/// Whether rounding makes the better part of the noise of a channel.
fn dominates(noise: &NoiseEstimate) -> bool {
    noise.quantum.iter().zip(&noise.std).any(|(q, std)| q.is_some_and(|q| q * q / 12.0 > 0.5 * std * std))
}

/// Names quantisation where the record is at the floor and the lattice is what the floor is made of; where it may not be
/// named, rounding is no noise that would explain the record.
pub fn attribute(case: &Case<'_>, diagnosis: &mut Diagnosis) {
    let Some((effect, parameter)) = Effect::of_rounding() else { return };
    let step = case.noise.quantum.iter().flatten().copied().fold(0.0, f64::max);
    // A model that rounds as the record does has no gap there.
    let known = case.nominal.effects.of(effect)[parameter];
    if step <= 0.0 || (known - step).abs() < SAME * step {
        return;
    }
    let seen = CHANNELS.iter().zip(case.noise.quantum).filter(|(_, q)| q.is_some());
    let channels = seen.map(|(name, _)| *name).collect();
    let at_floor = matches!(diagnosis.verdict, Verdict::NoGap | Verdict::Parameters) && dominates(case.noise);
    let role = match case.suspects.contains(&effect) {
        _ if !at_floor => RoundingRole::Noise,
        true => RoundingRole::Cause,
        false => RoundingRole::Withheld,
    };
    diagnosis.rounding = Some(Rounding { step, channels, role });
    match role {
        RoundingRole::Noise => return,
        RoundingRole::Cause => {
            diagnosis.verdict = Verdict::Effect;
            diagnosis.causes = vec![Cause::sole(effect, parameter, step, 0.0, case.motion)];
        }
        RoundingRole::Withheld => diagnosis.verdict = Verdict::Unexplained,
    }
    let at = Site::At(Place::Sensor);
    diagnosis.location.site = Some(at);
    for (site, share) in &mut diagnosis.location.shares {
        *share = f64::from(u8::from(*site == at));
    }
}
