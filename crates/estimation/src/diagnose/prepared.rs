//! A record made ready for the search: in the band of its motion, at the rate of that band, its noise seen through the axis as it is.

use std::f64::consts::FRAC_PI_2;

use rayon::prelude::*;

use super::assess::Case;
use super::gap::Gap;
use super::overlay::Overlay;
use super::search::Search;
use crate::axis::Structure;
use crate::conditioning::{Rate, Record, TORQUE, decimate, smooth};
use crate::effects::Effect;
use crate::hypothesis::band::{self, Reach};
use crate::hypothesis::discrepancy::Discrepancy;
use crate::hypothesis::fit::{Fit, STEPS};
use crate::hypothesis::likelihood::{Band, NEAR_THE_NOISE};
use crate::hypothesis::model::Model;
use crate::hypothesis::problem::{Problem, Work, largest};
use crate::numerics::level::deviation;

/// Samples, at the rate of the band, that a search works on at most: the first of the record.
const SEARCHED: usize = 16_384;

/// A record ready for the search: in the band of its motion, with that band.
pub struct Prepared {
    pub record: Record,
    pub band: Band,
    /// The axis' own parameters as they follow the record the best: through them the band sees its noise.
    pub reference: Model,
    pub rate: Rate,
    /// Upper end of the band, Hz.
    pub limit: f64,
    /// Torque that shares are told of, rms about its mean, N.m.
    pub torque_rms: f64,
    /// Largest torque of the log, N.m.
    pub peak: f64,
}

/// The record in the band of its motion, as fast as it can be searched; and as exact as it can be, where accounts near the noise are
/// settled, if that is something else.
pub fn prepared(record: &Record, nominal: &Model, reach: Reach) -> (Prepared, Option<Prepared>) {
    let whole = record.part(0..smooth(record.len()));
    let limit = band::limit(&whole, &band::mask(&whole, nominal.structure), reach);
    let [exact, fast] = match nominal.structure {
        Structure::Rigid => [false, true].map(|straight| Rate { longest: f64::INFINITY, straight }),
        // Both sides can be held to a record in which the axis' own vibration turns by up to a quarter in a sample.
        Structure::TwoInertia => {
            [0.0, FRAC_PI_2 / nominal.parameters.modal().wn].map(|longest| Rate { longest, straight: false })
        }
    };
    let peak = largest(&record.torque);
    let at = |rate: Rate| {
        let r = decimate(&whole, limit, rate);
        r.part(0..smooth(r.len().min(SEARCHED)))
    };
    let [own, slow] = [exact, fast].map(at);
    let alike = slow.len() == own.len() && slow.instants() == own.instants();
    let referred = |record, rate, known: Option<&Model>| referred(record, nominal, known, limit, rate, peak);
    let (own, left) = referred(own, exact, None);
    // A record that the parameters alone follow is searched at its own rate: the one of the band is not that exact.
    if alike || left < NEAR_THE_NOISE {
        return (own, None);
    }
    let (slow, left) = referred(slow, fast, Some(&own.reference));
    if left.is_finite() { (slow, Some(own)) } else { (own, None) }
}

/// A record with its band, whose noise is seen through the axis as it is, not as its data sheet has it; and what its parameters leave,
/// in noises.
fn referred(
    record: Record,
    nominal: &Model,
    known: Option<&Model>,
    limit: f64,
    rate: Rate,
    peak: f64,
) -> (Prepared, f64) {
    let mask = band::mask(&record, nominal.structure);
    let plain = Band::new(&record, nominal, limit, &mask);
    let problem = Problem::new(&record, &plain, *nominal);
    let fit = match known {
        Some(known) => problem.parameters(known, [f64::MAX; 2], STEPS),
        None => problem.parameters_of_any_stiffness([f64::MAX; 2], STEPS),
    };
    let left = fit.as_ref().map_or(f64::INFINITY, |f| plain.noise_multiple(&f.rows));
    let reference = fit.map_or(*nominal, |f| f.model);
    let band = Band::new(&record, &reference, limit, &mask);
    let torque_rms = deviation(&record.torque);
    (Prepared { record, band, reference, rate, limit, torque_rms, peak }, left)
}

impl Prepared {
    /// The same with the motion given, its noise seen through the axis as it is given: parameters alone follow no torque that friction takes.
    #[must_use]
    pub fn with_motion_given(self, nominal: &Model) -> Self {
        let mask = band::mask(&self.record, nominal.structure);
        let band = Band::new(&self.record, nominal, self.limit, &mask).with_motion_given();
        Self { band, reference: *nominal, ..self }
    }

    /// A search in it for some effects, its work counted with that of other looks.
    pub fn search<'a>(
        &'a self,
        case: &Case<'_>,
        suspects: Vec<Effect>,
        work: &Work,
        progress: &'a (dyn Fn(&str) + Sync),
    ) -> Search<'a> {
        let problem = self.problem(case.nominal).counted_in(work);
        let reference = self.reference;
        Search { problem, reference, suspects, gap: [0.0; 2], cut_short: false.into(), progress }
    }

    /// The record in its band, to which models are held that a nominal one is known of.
    pub fn problem(&self, nominal: Model) -> Problem<'_> {
        Problem::of(&self.record, &self.band, nominal, self.peak).along_what_is_given()
    }

    /// Share of the torque that a fit leaves.
    pub fn left(&self, fit: &Fit) -> f64 {
        self.band.torque_share(fit.discrepancy, &self.record)
    }

    /// The part of a record, as long as the one searched and beyond it, in which a model lacks the most, with what it lacks there; `None` where
    /// the record goes on for less than half of such a part.
    pub fn worst_beyond(&self, record: &Record, case: &Case<'_>, model: &Model) -> Option<(Self, Discrepancy)> {
        let n = self.record.len();
        if record.len() as f64 * record.dt < 1.5 * n as f64 * self.record.dt {
            return None;
        }
        let slow = self.at_its_rate(record);
        // The last part overlaps the one before it.
        let parts = slow.len().div_ceil(n);
        let measured = (1..parts).into_par_iter().filter_map(|i| {
            let start = (i * n).min(slow.len() - n);
            let part = self.of_another(slow.part(start..start + n), model);
            let lacks = Problem::of(&part.record, &part.band, case.nominal, self.peak).given(model)?.discrepancy;
            Some((part, lacks))
        });
        let measured: Vec<(Self, Discrepancy)> = measured.collect();
        measured.into_iter().max_by(|a, b| a.1.iter().sum::<f64>().total_cmp(&b.1.iter().sum::<f64>()))
    }

    /// Another record in the same band, its noise seen through a model.
    pub fn alike(&self, record: &Record, model: &Model) -> Self {
        let slow = self.at_its_rate(record);
        self.of_another(slow.part(0..smooth(slow.len())), model)
    }

    /// Another record at the rate of this one.
    fn at_its_rate(&self, record: &Record) -> Record {
        decimate(&record.part(0..smooth(record.len())), self.limit, self.rate)
    }

    /// A record at the same rate and in the same band. A torque that stands there is no measure of what is lacking.
    fn of_another(&self, record: Record, model: &Model) -> Self {
        let band = Band::new(&record, model, self.limit, &band::mask(&record, model.structure));
        let band = if self.band.motion_is_given() { band.with_motion_given() } else { band };
        let torque_rms = deviation(&record.torque).max(self.torque_rms);
        Self { record, band, torque_rms, ..*self }
    }

    /// The torque that moved the axis and what each model needs for that motion, in the band, where the window is open by half
    /// at least.
    pub fn torque_overlay(&self, gap: &Gap) -> Overlay {
        let (record, taper) = (&self.record, &self.band.taper);
        let torque = self.band.filtered(&record.torque);
        let mut o = Overlay {
            channel: TORQUE,
            time: Vec::new(),
            measured: Vec::new(),
            before: Vec::new(),
            after: Vec::new(),
            noise: self.band.noise_rms(),
        };
        let half = 0.5 * taper.iter().copied().fold(0.0, f64::max);
        for (k, w) in taper.iter().enumerate() {
            let [before, after] = [0, 1].map(|m: usize| gap.runs[m][k][0] + gap.runs[m][k][1]);
            let values = [torque[k], torque[k] + before, torque[k] + after];
            let [measured, before, after] = if *w > half { values.map(|v| v / w) } else { [f64::NAN; 3] };
            o.push([record.time(k), measured, before, after]);
        }
        o
    }
}
