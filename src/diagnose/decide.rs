//! From fits to a verdict: evidence, materiality, further causes, abstention.

use serde::Serialize;

use super::search::{Search, Tested};
use crate::effects::Effect;

/// Difference of BIC that an effect must bring over a simpler hypothesis: odds of 400 to 1, which also pays for the
/// number of effects and starts that were looked at.
const DECISIVE: f64 = 12.0;
/// Difference of BIC below which two hypotheses count as confusable.
const CONFUSABLE: f64 = 10.0;
/// Squared residual per value up to which a fit counts as at the floor: the floor itself is an estimate.
const AT_FLOOR: f64 = 1.1;
/// Share of the gap that a single effect must close to be named while a remainder stays.
const CLOSES: f64 = 0.95;
/// Share of the remainder that a further effect must close.
const FURTHER: f64 = 0.5;
/// Share of the whole gap that a further effect must close.
const FURTHER_OF_ALL: f64 = 2e-3;
/// Most effects at once.
const MOST: usize = 4;
/// A gain counts as the cause of changed parameters when each of them changed by it, to this share.
const GAIN_LIKENESS: f64 = 0.25;
/// Smallest relative change of the parameters that is called one.
const GAIN_SEEN: f64 = 0.02;

/// What the diagnosis comes to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// One or more effects of the library.
    Effect,
    /// The nominal parameters are off.
    Parameters,
    /// The model as given explains the record.
    NoGap,
    /// Nothing in the library brings the residual to the floor.
    Unexplained,
}

/// A hypothesis with its evidence.
#[derive(Debug, Clone)]
pub struct Weighed {
    /// What was fitted.
    pub tested: Tested,
    /// Bayesian information criterion, lower is better, at the noise the best hypothesis leaves.
    pub bic: f64,
    /// Posterior probability under equal priors.
    pub probability: f64,
}

/// The decision.
#[derive(Debug, Clone)]
pub struct Decision {
    /// The verdict.
    pub verdict: Verdict,
    /// Model as given.
    pub given: Tested,
    /// Its parameters fitted.
    pub parameters: Tested,
    /// The hypothesis decided for; the nominal structure when there is no effect in it.
    pub chosen: Tested,
    /// Every hypothesis, best first: no gap, parameters, single effects, and the combination if there is one.
    pub ranking: Vec<Weighed>,
    /// Share of the gap of each effect of the chosen hypothesis.
    pub shares: Vec<f64>,
    /// Number of values that the fits compared.
    pub values: f64,
    /// Hypotheses that the record cannot tell from the chosen one.
    pub confusable: Vec<(Tested, f64)>,
}

impl Decision {
    /// True if the parameters all changed by one factor: a wrong torque constant.
    #[must_use]
    pub fn torque_gain(&self) -> Option<(f64, f64)> {
        let f = &self.parameters.fitted;
        let change = |i: usize| (f.coordinates[i].value(&f.model) / f.coordinates[i].unit).ln();
        let first = change(0);
        // A rigid axis has one parameter: its change and a gain are the same thing.
        let alike = f.coordinates.len() > 1
            && (1..f.coordinates.len()).all(|i| {
                let std = f.std[i] / f.coordinates[i].value(&f.model);
                (change(i) - first).abs() <= GAIN_LIKENESS * first.abs() + 2.0 * std.min(0.2)
            });
        let std = f.std[0] / f.coordinates[0].value(&f.model);
        (alike && first.abs() > GAIN_SEEN).then(|| ((-first).exp(), (-first).exp() * std))
    }
}

/// BIC of a fit when the best hypothesis leaves `floor` squared residual per value.
fn bic(t: &Tested, values: f64, floor: f64) -> f64 {
    t.fitted.chi2 / floor + t.freedom as f64 * values.ln()
}

/// Searches and decides.
#[must_use]
pub fn decide(search: &Search<'_>, progress: &(dyn Fn(&str) + Sync)) -> Decision {
    let values = search.data.values() as f64;
    let given = search.as_given();
    let parameters = search.parameters_only(&given);
    let singles = search.one_more(&Tested { effects: Vec::new(), ..parameters.clone() }, progress);
    let mut chosen = nominal_structure(&given, &parameters, values);
    let mut shares = Vec::new();
    if let Some(best) = singles.first().filter(|best| better(best, &chosen, values)) {
        let best = alike(&singles, best, values);
        chosen = best.clone();
        shares = vec![1.0];
        if unexplained_part(&chosen, values) > 0.0 {
            let gap = parameters.fitted.chi2 - values;
            chosen = further(search, chosen, gap, values, progress);
            shares = shares_of(&chosen, &singles, search);
        }
    }
    let verdict = verdict(&given, &parameters, singles.first(), &chosen, values);
    let ranking = rank(&given, &parameters, &singles, &chosen, values);
    let confusable = confusable(&chosen, &singles, values);
    Decision { verdict, given, parameters, chosen, ranking, shares, values, confusable }
}

/// No gap, or parameters only.
fn nominal_structure(given: &Tested, parameters: &Tested, values: f64) -> Tested {
    if better(parameters, given, values) { parameters.clone() } else { given.clone() }
}

/// Whether the richer hypothesis is decisively better.
fn better(rich: &Tested, plain: &Tested, values: f64) -> bool {
    let floor = (rich.fitted.chi2 / values).max(1.0);
    bic(plain, values, floor) - bic(rich, values, floor) > DECISIVE
}

/// Squared residual per value above the floor, zero when at the floor.
fn unexplained_part(t: &Tested, values: f64) -> f64 {
    let per = t.fitted.chi2 / values;
    if per > AT_FLOOR { per - 1.0 } else { 0.0 }
}

/// The simplest of the hypotheses that the record cannot tell from the best by more than chance.
fn alike<'a>(singles: &'a [Tested], best: &'a Tested, values: f64) -> &'a Tested {
    let floor = (best.fitted.chi2 / values).max(1.0);
    singles
        .iter()
        .filter(|t| bic(t, values, floor) - bic(best, values, floor) < 2.0)
        .min_by(|a, b| bic(a, values, floor).total_cmp(&bic(b, values, floor)))
        .unwrap_or(best)
}

/// Adds effects while a material remainder is closed by one more; each addition re-opens the choice of the others.
fn further(search: &Search<'_>, first: Tested, gap: f64, values: f64, progress: &(dyn Fn(&str) + Sync)) -> Tested {
    let mut chosen = first;
    while chosen.effects.len() < MOST && unexplained_part(&chosen, values) > 0.0 {
        let Some(next) = search.one_more(&chosen, progress).into_iter().next() else { break };
        let gain = chosen.fitted.chi2 - next.fitted.chi2;
        let rest = chosen.fitted.chi2 - values;
        if !better(&next, &chosen, values) || gain < FURTHER * rest || gain < FURTHER_OF_ALL * gap {
            break;
        }
        chosen = next;
        // With the new effect in, was the one before the right partner?
        if chosen.effects.len() == 2 {
            let (newest, variant) = chosen.effects[1];
            let alone = search.only(&chosen, newest, variant);
            if let Some(other) = search.one_more(&alone, progress).into_iter().next()
                && other.fitted.chi2 < chosen.fitted.chi2 - DECISIVE * (other.fitted.chi2 / values).max(1.0)
            {
                chosen = other;
            }
        }
    }
    chosen
}

/// Share of each effect: how much of the gap comes back without it.
fn shares_of(chosen: &Tested, singles: &[Tested], search: &Search<'_>) -> Vec<f64> {
    if chosen.effects.len() < 2 {
        return vec![1.0; chosen.effects.len()];
    }
    let back: Vec<f64> = (0..chosen.effects.len())
        .map(|i| {
            let without: Vec<(Effect, usize)> =
                chosen.effects.iter().enumerate().filter(|(j, _)| *j != i).map(|(_, e)| *e).collect();
            let known = singles.iter().find(|t| t.effects == without).map(|t| t.fitted.chi2);
            let chi2 = known.unwrap_or_else(|| search.without(chosen, &without).fitted.chi2);
            (chi2 - chosen.fitted.chi2).max(0.0)
        })
        .collect();
    let sum: f64 = back.iter().sum();
    back.iter().map(|b| if sum > 0.0 { b / sum } else { 1.0 / back.len() as f64 }).collect()
}

fn verdict(given: &Tested, parameters: &Tested, single: Option<&Tested>, chosen: &Tested, values: f64) -> Verdict {
    let left = unexplained_part(chosen, values);
    if chosen.effects.is_empty() {
        return if left > 0.0 {
            Verdict::Unexplained
        } else if better(parameters, given, values) {
            Verdict::Parameters
        } else {
            Verdict::NoGap
        };
    }
    let gap = (parameters.fitted.chi2 - values).max(f64::MIN_POSITIVE);
    let closes = |t: &Tested| 1.0 - (t.fitted.chi2 - values).max(0.0) / gap;
    // Several effects fit anything better than one: where no single one closes the gap, together they must come closer.
    let alone = single.is_some_and(|t| closes(t) >= CLOSES);
    let together = closes(chosen) >= 1.0 - (1.0 - CLOSES) / (chosen.effects.len() as f64).powi(2);
    if left > 0.0 && !alone && !together { Verdict::Unexplained } else { Verdict::Effect }
}

fn rank(given: &Tested, parameters: &Tested, singles: &[Tested], chosen: &Tested, values: f64) -> Vec<Weighed> {
    let mut all: Vec<Tested> = vec![given.clone(), parameters.clone()];
    all.extend(singles.iter().cloned());
    if chosen.effects.len() > 1 {
        all.push(chosen.clone());
    }
    let floor = all.iter().map(|t| t.fitted.chi2).fold(f64::INFINITY, f64::min).max(values) / values;
    let scores: Vec<f64> = all.iter().map(|t| bic(t, values, floor)).collect();
    let best = scores.iter().copied().fold(f64::INFINITY, f64::min);
    let sum: f64 = scores.iter().map(|s| (-0.5 * (s - best)).exp()).sum();
    let mut ranking: Vec<Weighed> = all
        .into_iter()
        .zip(scores)
        .map(|(tested, s)| Weighed { tested, bic: s, probability: (-0.5 * (s - best)).exp() / sum })
        .collect();
    ranking.sort_by(|a, b| a.bic.total_cmp(&b.bic));
    ranking
}

fn confusable(chosen: &Tested, singles: &[Tested], values: f64) -> Vec<(Tested, f64)> {
    if chosen.effects.len() != 1 {
        return Vec::new();
    }
    let floor = (chosen.fitted.chi2 / values).max(1.0);
    singles
        .iter()
        .filter(|t| t.effects[0].0 != chosen.effects[0].0)
        .map(|t| (t, bic(t, values, floor) - bic(chosen, values, floor)))
        .filter(|(_, d)| *d < CONFUSABLE)
        .map(|(t, d)| (t.clone(), d))
        .collect()
}
