//! What is reported of a decision: causes with their sizes, places, the ranking, the gap and the remainder.

use rayon::prelude::*;

use super::assess::Case;
use super::decision::Decision;
use super::diagnosis::{AxisParameter, Cause, ClosureOf, Diagnosis, Estimate, GapReport, HeldOut, Ranked, Site, Where};
use super::gap::{Gap, Gaps};
use super::location::Location;
use super::overlay::Overlay;
use super::prepared::Prepared;
use super::residual::remains;
use super::verdict::Verdict;
use super::weighing::LIKELY;
use crate::axis::{AxisKind, Structure};
use crate::conditioning::{CHANNELS, Record};
use crate::effects::Effect;
use crate::hypothesis::fit::Fit;
use crate::hypothesis::model::{BaseParameter, Free};

/// The diagnosis that a decision is reported as.
pub fn build(
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
            vec![Cause::sole(effect, parameter, gain, std, case.motion)]
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
        remainder: remains(searched, decision),
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
        motion_is_given: decision.motion_is_given,
        closed_loop: None,
    }
}

fn causes(decision: &Decision, motion: AxisKind) -> Vec<Cause> {
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

/// Traces of every measured channel beside those of the model before and after, over the stretches of a gap.
pub fn overlays(record: &Record, gap: &Gap) -> Vec<Overlay> {
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
