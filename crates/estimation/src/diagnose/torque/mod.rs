//! A rigid axis diagnosed by the torque that its model lacks to follow the record.
//!
//! [`search`] is the procedure, top to bottom, [`material`] what counts as a cause in it, [`conclusion`] its end; [`likelihood`] the one
//! evidence, with sensor noise and model discrepancy in it; [`tracking`] what a model lacks; [`fit`] a hypothesis fitted; [`gap`] how far
//! the gap shrinks on data that no fit has seen. A
//! machine's log is made under control, its model never complete: its verdict must not be sought at the noise floor of a simulation
//! (Gautier, Khalil, and the inverse dynamics of robot identification; Kennedy, O'Hagan, JRSS B 63(3), 2001, for the discrepancy).
//!
//! On a rigid axis motor, coupling and table are one place, called `axis`.

mod band;
mod conclusion;
mod descent;
mod determined;
mod discrepancy;
mod fit;
mod gap;
mod hidden;
mod likelihood;
mod material;
mod octaves;
mod parameters;
mod pool;
mod race;
mod scales;
mod scatter;
mod search;
mod series;
mod starts;
#[cfg(test)]
mod tests;
mod tracking;

use rayon::prelude::*;

use super::assess::{Case, HELD_OUT, Outcome, Replay};
use super::diagnosis::{
    AxisParameter, Cause, ClosureOf, Diagnosis, Estimate, GapReport, HeldOut, Ranked, Remainder, Site, Where,
};
use super::location::{Location, Residual, along, without_offset};
use super::model::{BaseParameter, Free, Model};
use super::overlay::Overlay;
use super::quantisation;
use super::record::{CHANNELS, Record, TORQUE};
use super::repair::bridged;
use super::verdict::Verdict;
use crate::axis::{Motion, Structure};
use crate::effects::{Effect, Place};
use crate::numerics::level::deviation;
use band::{Rate, Reach};
use conclusion::LIKELY;
pub use conclusion::{Confusable, Decision, UNCAUSED, Weighed};
pub use fit::Fit;
use fit::{Problem, largest};
use gap::{Gap, Gaps};
use likelihood::Band;
use material::NEGLIGIBLE;
use search::{Search, decide, decide_further};
use tracking::{Resolution, Tracked, track};

/// Samples, at the rate of the band, that a search works on at most: the first of the record.
const SEARCHED: usize = 16_384;

/// Noises that an account at the rate of the band may leave for it to be settled at the record's own.
const NEAR: f64 = 30.0;
/// Share of the torque that an account of a rigid axis leaves at most where the band that its motion rules is understood so far that what
/// it lacks may be the edge of a cause that lies beyond.
const UNDERSTOOD: f64 = 0.1;
/// Steps of the fit through which a band sees its noise.
const REFERRED: usize = 24;

/// Share of a window's height from which what it shows is drawn.
const OPEN: f64 = 0.5;

/// Hypotheses that are told, each with its own run over the held-out data.
const TOLD: usize = 12;

/// A record ready for the search: in the band of its motion, with that band.
struct Prepared {
    record: Record,
    band: Band,
    /// The axis' own parameters as they follow the record the best: through them the band sees its noise.
    reference: Model,
    rate: Rate,
    /// Upper end of the band, Hz.
    limit: f64,
    /// Torque that shares are told of, rms about its mean, N.m.
    torque_rms: f64,
    /// Largest torque of the log, N.m.
    peak: f64,
}

/// Diagnoses a record of a rigid axis.
#[must_use]
pub fn diagnose(case: &Case<'_>, progress: &(dyn Fn(&str) + Sync)) -> Outcome {
    let (train, held) = split(case);
    let may = |e: &Effect| e.may_be_named(case.nominal.structure, case.motion) && !case.nominal.effects.is_on(*e);
    let suspects: Vec<Effect> = case.suspects.iter().copied().filter(may).collect();
    // What leaves so little that the error of the band's rate counts is settled at the record's own.
    let near = |d: &Decision, p: &Prepared| !d.chosen.terms.is_empty() && p.band.noise_multiple(&d.chosen.rows) < NEAR;
    let settled = |searched: Prepared, own: Option<Prepared>, decision: Decision| {
        let Some(own) = own.filter(|_| near(&decision, &searched)) else { return (searched, decision) };
        progress("at the record's own rate");
        let decision = decide(own.search(case, likely(&decision), progress), Some(&decision.chosen));
        (own, decision)
    };
    // A rigid axis is taken to be under control.
    let rigid = case.nominal.structure == Structure::Rigid;
    let (searched, own) = prepared(&train, &case.nominal, if rigid { Reach::Ruled } else { Reach::Shown });
    let decision = decide(searched.search(case, suspects.clone(), progress), None);
    let (mut searched, mut decision) = settled(searched, own, decision);
    let left = searched.left(&decision.chosen);
    if rigid && (NEGLIGIBLE..UNDERSTOOD).contains(&left) && !searched.band.at_floor(&decision.chosen.rows) {
        progress("beyond the band that the motion rules");
        let (wide, own) = prepared(&train, &case.nominal, Reach::Whole);
        let further = decide_further(wide.search(case, suspects, progress), &decision.chosen);
        if let Some((wide, other)) = further.map(|d| settled(wide, own, d))
            // More to explain and less left of it: what was missing is there.
            && wide.left(&other.chosen) < left
        {
            (searched, decision) = (wide, other);
        }
    }
    progress("held-out data");
    let fits = [&decision.given, &decision.parameters, &decision.chosen];
    let models = fits.map(|f| f.model);
    let seen = searched.alike(&held, &models[2]);
    let on_train = Gaps::measure(&searched.record, &searched, fits);
    let on_held = Gaps::measure(&held, &seen, fits);
    progress("where");
    let located = located(&searched, &models[1], decision.parameters.bandwidth);
    let closure = |of, fit: &Fit| gap::closure_by(of, &held, &seen, [fits[0], fits[1], fit]);
    let mut diagnosis = build(case, &decision, &searched, &closure, &on_train, &on_held, located);
    quantisation::attribute(case, &mut diagnosis);
    let mut overlays = overlays(&held, on_held.shown());
    let of_torque = seen.torque_overlay(on_held.by(ClosureOf::Torque));
    let first = if on_held.headline().of == ClosureOf::Torque { 0 } else { overlays.len() };
    overlays.insert(first, of_torque);
    let replay = Replay { initial: on_held.shown().initial, record: held };
    Outcome { diagnosis, improved: models[2], models, decision, overlays, replay }
}

/// What a model lacks along the record, in the band, and where that shows.
fn residual_torque(p: &Prepared, model: &Model, bandwidth: [f64; 2]) -> (Tracked, [Vec<f64>; 2], Site) {
    let tracked =
        track(model, &p.record, bandwidth, Resolution::Full).unwrap_or_else(|| Tracked::nothing(p.record.len()));
    let series = [0, 1].map(|i| p.band.filtered(&tracked.torque[i]));
    let site = where_by_torque(&series, model.structure == Structure::Rigid);
    (tracked, series, site)
}

fn remains(p: &Prepared, fit: &Fit) -> Remainder {
    let (tracked, series, site) = residual_torque(p, &fit.model, fit.bandwidth);
    let shown = &series[usize::from(site == Site::At(Place::Table))];
    Remainder {
        torque_rms: p.band.torque_rms(fit.discrepancy),
        share: p.left(fit),
        noise_multiple: p.band.noise_multiple(&fit.rows),
        site,
        looks: along(&p.record, &residual(shown, &tracked), site).looks,
    }
}

fn residual(series: &[f64], tracked: &Tracked) -> Residual {
    Residual { r1: series.to_vec(), states: tracked.motion.clone(), ..Residual::default() }
}

/// The record that the fits see, and the one that they do not.
fn split(case: &Case<'_>) -> (Record, Record) {
    let n = case.train.len();
    let own = |r: &Record| without_offset(&bridged(r).0, &case.nominal.parameters, case.nominal.structure);
    match case.holdout {
        Some(other) => (own(case.train), own(other)),
        None => {
            let split = n - (n as f64 * HELD_OUT) as usize;
            let whole = own(case.train);
            (whole.part(0..split), whole.part(split..n))
        }
    }
}

/// Noises up to which the parameters alone follow a record that is searched at its own rate: the one of the band is not that exact.
const EXACT: f64 = 10.0;

/// Turn of the axis' own vibration in a sample, rad, up to which both of its sides can be held to a record: a quarter.
const QUARTER: f64 = std::f64::consts::FRAC_PI_2;

/// The record in the band of its motion, as fast as it can be searched; and as exact as it can be, where accounts near the noise are
/// settled, if that is something else.
fn prepared(record: &Record, nominal: &Model, reach: Reach) -> (Prepared, Option<Prepared>) {
    let whole = record.part(0..band::smooth(record.len()));
    let limit = band::limit(&whole, &band::mask(&whole, nominal.structure), reach);
    let [exact, fast] = match nominal.structure {
        Structure::Rigid => [false, true].map(|straight| Rate { longest: f64::INFINITY, straight }),
        Structure::TwoInertia => {
            [0.0, QUARTER / nominal.parameters.modal().wn].map(|longest| Rate { longest, straight: false })
        }
    };
    let peak = largest(&record.torque);
    let at = |rate: Rate| {
        let r = band::decimate(&whole, limit, rate);
        r.part(0..band::smooth(r.len().min(SEARCHED)))
    };
    let [own, slow] = [exact, fast].map(at);
    let alike = slow.len() == own.len() && slow.instants() == own.instants();
    let referred = |record, rate, known: Option<&Model>| referred(record, nominal, known, limit, rate, peak);
    let (own, left) = referred(own, exact, None);
    if alike || left < EXACT {
        return (own, None);
    }
    let (slow, left) = referred(slow, fast, Some(&own.reference));
    if left.is_finite() { (slow, Some(own)) } else { (own, None) }
}

/// The effects of the likeliest hypotheses.
fn likely(decision: &Decision) -> Vec<Effect> {
    let mut effects: Vec<Effect> =
        decision.ranking.iter().take(TOLD).flat_map(|w| w.fit.terms.iter().map(|t| t.0)).collect();
    effects.sort_unstable();
    effects.dedup();
    effects
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
        Some(known) => problem.parameters(known, [f64::MAX; 2], REFERRED),
        None => problem.parameters_of_any_stiffness([f64::MAX; 2], REFERRED),
    };
    let left = fit.as_ref().map_or(f64::INFINITY, |f| plain.noise_multiple(&f.rows));
    let reference = fit.map_or(*nominal, |f| f.model);
    let band = Band::new(&record, &reference, limit, &mask);
    let torque_rms = deviation(&record.torque);
    (Prepared { record, band, reference, rate, limit, torque_rms, peak }, left)
}

impl Prepared {
    /// A search in it for some effects.
    fn search<'a>(&'a self, case: &Case<'_>, suspects: Vec<Effect>, progress: &'a (dyn Fn(&str) + Sync)) -> Search<'a> {
        let problem = Problem::of(&self.record, &self.band, case.nominal, self.peak);
        let reference = self.reference;
        Search { problem, reference, suspects, gap: [0.0; 2], cut_short: false.into(), progress }
    }

    /// Share of the torque that a fit leaves.
    fn left(&self, fit: &Fit) -> f64 {
        self.band.torque_share(fit.discrepancy, &self.record)
    }

    /// Another record in the same band, its noise seen through a model. A torque that stands there is no measure of what is lacking.
    fn alike(&self, record: &Record, model: &Model) -> Self {
        let whole = record.part(0..band::smooth(record.len()));
        let slow = band::decimate(&whole, self.limit, self.rate);
        let record = slow.part(0..band::smooth(slow.len()));
        let band = Band::new(&record, model, self.limit, &band::mask(&record, model.structure));
        let torque_rms = deviation(&record.torque).max(self.torque_rms);
        Self { record, band, torque_rms, ..*self }
    }
}

impl Prepared {
    /// The torque that moved the axis and what each model needs for that motion, in the band, where the window is open.
    fn torque_overlay(&self, gap: &Gap) -> Overlay {
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
        let open = OPEN * taper.iter().copied().fold(0.0, f64::max);
        for (k, w) in taper.iter().enumerate() {
            let [before, after] = [0, 1].map(|m: usize| gap.runs[m][k][0] + gap.runs[m][k][1]);
            let values = [torque[k], torque[k] + before, torque[k] + after];
            let [measured, before, after] = if *w > open { values.map(|v| v / w) } else { [f64::NAN; 3] };
            o.push([record.time(k), measured, before, after]);
        }
        o
    }
}

/// Where the torque that a model lacks shows along the record.
fn located(p: &Prepared, model: &Model, bandwidth: [f64; 2]) -> Location {
    let (tracked, series, site) = residual_torque(p, model, bandwidth);
    let mut residual = residual(&series[0], &tracked);
    if model.structure == Structure::TwoInertia {
        let [_, r2] = series;
        residual.r2 = r2;
    }
    along(&p.record, &residual, site)
}

fn build(
    case: &Case<'_>,
    decision: &Decision,
    searched: &Prepared,
    closure: &(dyn Fn(ClosureOf, &Fit) -> f64 + Sync),
    train: &Gaps,
    held: &Gaps,
    located: Location,
) -> Diagnosis {
    let holdout = held.headline();
    let structure = case.nominal.structure;
    let best = decision.ranking.first().map_or(0.0, |w| w.evidence);
    let ranking = decision
        .ranking
        .par_iter()
        .take(TOLD)
        .map(|w| Ranked {
            hypothesis: w.fit.hypothesis(),
            site: w.fit.terms.first().map(|t| Site::of(t.0.info().place, structure)),
            probability: w.probability,
            delta_bic: 2.0 * (best - w.evidence),
            chi2: searched.band.noise_multiple(&w.fit.rows).powi(2),
            closure_holdout: closure(holdout.of, &w.fit),
        })
        .collect();
    let causes = match decision.torque_gain().zip(Effect::of_gain()) {
        Some(((gain, std), (effect, parameter))) if decision.verdict == Verdict::Parameters => {
            vec![Cause::alone(effect, parameter, gain, std, case.motion)]
        }
        _ => causes(decision, case.motion),
    };
    let verdict = decision.verdict;
    Diagnosis {
        machine: case.machine.clone(),
        verdict,
        chosen: decision.chosen.hypothesis(),
        location: location(&causes, verdict, located, structure),
        causes,
        ranking,
        confusable: decision.confusable.clone(),
        undecided: decision.undecided.clone(),
        remainder: remains(searched, &decision.chosen),
        gap: GapReport {
            closure: holdout.closure,
            closure_of_effect: holdout.closure_of_effect,
            interval: holdout.interval,
            closure_of: holdout.of,
            ways: held.all().map(Gap::way),
            train: train.by(holdout.of).figures.clone(),
            holdout: holdout.figures.clone(),
            holdout_is: if case.holdout.is_some() { HeldOut::SecondRecord } else { HeldOut::LastThird },
        },
        parameters: parameters(case, decision),
        rounding: None,
        cut_short: decision.cut_short,
        closed_loop: None,
    }
}

fn causes(decision: &Decision, motion: Motion) -> Vec<Cause> {
    let fit = &decision.chosen;
    let mut causes: Vec<Cause> = fit
        .terms
        .iter()
        .enumerate()
        .map(|(i, (effect, form))| {
            let info = effect.info();
            let parameters = info.variants[*form].free.iter().map(|&p| {
                let value = fit.model.effects.of(*effect)[p];
                (p, estimate(decision, Free::Effect(*effect, p), value, info.parameters[p].unit_on(motion)))
            });
            Cause {
                effect: *effect,
                site: Site::of(info.place, fit.model.structure),
                variant: info.variants[*form].name,
                probability: decision.probabilities[i],
                share_of_gap: decision.shares[i],
                parameters: parameters.collect(),
            }
        })
        .collect();
    // An unlikely one stands in the ranking alone.
    causes.retain(|c| c.probability >= LIKELY);
    causes.sort_by(|a, b| b.share_of_gap.total_cmp(&a.share_of_gap));
    causes
}

/// Share of a value by which the method itself may be off, whatever the noise: where a record without noise is read, the simulation's steps
/// and the rate of the band leave up to that.
const NUMERICAL: f64 = 5e-4;

/// A value of the chosen fit with its standard error, which counts the independent samples alone.
fn estimate(decision: &Decision, free: Free, value: f64, unit: &'static str) -> Estimate {
    let fit = &decision.chosen;
    let at = fit.coordinates.iter().position(|c| c.free == free);
    let std = at.and_then(|i| fit.std.get(i)).map(|s| (s / decision.independent.sqrt()).hypot(NUMERICAL * value));
    Estimate { value, std: std.filter(|s| s.is_finite()), unit }
}

/// Correlation of the two residual torques below which they are one, equal and opposite: in the coupling.
const OPPOSITE: f64 = -0.8;

/// Where residual torques show, without knowing any cause.
fn where_by_torque(series: &[Vec<f64>; 2], rigid: bool) -> Site {
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let [motor, table] = [0, 1].map(|i: usize| dot(&series[i], &series[i]).sqrt());
    if rigid {
        Site::Axis
    } else if dot(&series[0], &series[1]) < OPPOSITE * motor * table {
        Site::At(Place::Coupling)
    } else if table > motor {
        Site::At(Place::Table)
    } else {
        Site::At(Place::Motor)
    }
}

fn location(causes: &[Cause], verdict: Verdict, shown: Location, structure: Structure) -> Where {
    let share = |site: &Site| -> f64 {
        if causes.is_empty() {
            f64::from(u8::from(*site == shown.site && verdict == Verdict::Unexplained))
        } else {
            causes.iter().filter(|c| c.site == *site).map(|c| c.share_of_gap).sum()
        }
    };
    let shares = Site::all(structure).iter().map(|site| (*site, share(site))).collect();
    let site = match verdict {
        Verdict::Effect => causes.first().map(|c| c.site),
        Verdict::Unexplained => Some(shown.site),
        Verdict::Parameters | Verdict::NoGap => None,
    };
    Where { site, shares, shown }
}

fn parameters(case: &Case<'_>, decision: &Decision) -> Vec<AxisParameter> {
    let of = |p: &BaseParameter| {
        let value = p.value(&decision.chosen.model.parameters);
        AxisParameter {
            parameter: *p,
            nominal: p.value(&case.nominal.parameters),
            reidentified: p.value(&decision.parameters.model.parameters),
            fitted: estimate(decision, Free::Base(*p), value, case.motion.unit(p.unit())),
        }
    };
    BaseParameter::of(case.nominal.structure).iter().map(of).collect()
}

fn overlays(record: &Record, gap: &Gap) -> Vec<Overlay> {
    (0..CHANNELS.len())
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
            let mut last = None;
            let samples = gap.covered.iter().flat_map(|r| r.clone());
            for (k, (before, after)) in samples.zip(gap.runs[0].iter().zip(&gap.runs[1])) {
                if last.is_some_and(|l| l + 1 != k) {
                    o.push([record.time(k), f64::NAN, f64::NAN, f64::NAN]);
                }
                last = Some(k);
                o.push([record.time(k), channel[k], before[c], after[c]]);
            }
            Some(o)
        })
        .collect()
}
