//! From fits to a verdict: evidence, materiality, further causes, abstention.

use serde::Serialize;

use super::gap::{Gap, Levels};
use super::one_more::takes;
use super::search::{Search, Tested};
use crate::effects::Effect;

/// Difference of BIC that an effect must bring over a simpler hypothesis: odds of 400 to 1, which also pays for the
/// number of effects and starts that were looked at.
pub const DECISIVE: f64 = 12.0;
/// Difference of BIC below which two hypotheses count as confusable.
const CONFUSABLE: f64 = 10.0;
/// Squared residual per value up to which a fit counts as at the floor: the floor itself is an estimate.
const AT_FLOOR: f64 = 1.1;
/// Share of the gap that a single effect must close to be named while a remainder stays.
const CLOSES: f64 = 0.95;
/// Squared residual per value above the floor, of an effect that closes the gap, in which no further effect is looked for:
/// its error would be below the noise.
const BELOW_NOISE: f64 = 0.5;
/// Share of the remainder that a further effect must close.
const FURTHER: f64 = 0.5;
/// Share of the whole gap that a further effect must close.
const FURTHER_OF_ALL: f64 = 2e-3;
/// Squared residual per value that a model may take away from an error that is mostly rounding by following its pattern.
const GRAIN: f64 = 0.05;
/// Single effects that are given a partner, the best first.
const BEAM: usize = 3;
/// How many times less than one effect two must leave for a third to be looked for.
const WORTH_A_THIRD: f64 = 3.0;
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

/// An effect named, and another that explains the record as well in its place.
#[derive(Debug, Clone, Copy)]
pub struct Confusable {
    /// The one named.
    pub named: Effect,
    /// The other.
    pub other: Effect,
    /// BIC with the other in its place, less the BIC as named.
    pub delta_bic: f64,
}

impl Confusable {
    /// Whether the two are the same but for where they act.
    #[must_use]
    pub fn is_of_place(&self) -> bool {
        let (named, other) = (self.named.info(), self.other.info());
        named.family == other.family && named.place != other.place
    }
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
    /// Effects that the record cannot tell from chosen ones.
    pub confusable: Vec<Confusable>,
}

impl Decision {
    /// Takes back or gives the verdict that an effect is the cause by what it closes of the gap on data that no fit has
    /// seen. A fit at the floor stands if its error there is below the noise, too.
    pub fn confirm(&mut self, held: &Gap) {
        let Levels { after, noise_floor, .. } = held.figures.combined;
        let below_noise = after.powi(2) <= (1.0 + BELOW_NOISE) * noise_floor.powi(2);
        let at_floor = below_noise && unexplained_part(&self.chosen, self.values) == 0.0;
        if self.chosen.effects.is_empty() || at_floor {
            return;
        }
        if held.closure < CLOSES {
            self.verdict = Verdict::Unexplained;
        } else if held.closure_of_effect >= CLOSES {
            self.verdict = Verdict::Effect;
        }
    }

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
    let mut parameters = search.parameters_only(&given);
    let alone = |parameters: &Tested, rival: f64| {
        let none = Tested { effects: Vec::new(), ..parameters.clone() };
        search.one_more(&none, rival, progress)
    };
    let mut singles = alone(&parameters, f64::INFINITY);
    // Weakly determined parameters: the fit of another hypothesis may have found the way.
    if let Some(best) = singles.first() {
        let again = search.parameters_again(best);
        if again.fitted.chi2 < parameters.fitted.chi2 {
            parameters = again;
        }
    }
    let least = |singles: &[Tested]| singles.first().map_or(0.0, |t| t.fitted.chi2);
    // No effect leaves more than none does: they were looked for from the wrong place.
    if least(&singles) > parameters.fitted.chi2 {
        let again = alone(&parameters, parameters.fitted.chi2);
        if least(&again) < least(&singles) {
            singles = again;
        }
    }
    let mut chosen = nominal_structure(&given, &parameters, values);
    let mut shares = Vec::new();
    let grain = if search.coarse { GRAIN * values } else { 0.0 };
    let beyond_rounding = |t: &Tested| chosen.fitted.chi2 - t.fitted.chi2 > grain;
    if let Some(best) = singles.first().filter(|best| better(best, &chosen, values) && beyond_rounding(best)) {
        let best = alike(&singles, best, values);
        chosen = best.clone();
        shares = vec![1.0];
        if unexplained_part(&chosen, values) > 0.0 {
            let gap = parameters.fitted.chi2 - values;
            chosen = search.among_kin(chosen);
            adopt(&mut singles, &chosen);
            chosen = further(search, &parameters, &singles, chosen, gap, values, progress);
            (chosen, shares) = pruned(search, search.closely(&chosen), &mut singles, gap, values);
        }
    }
    let verdict = verdict(&given, &parameters, singles.first(), &chosen, values);
    let ranking = rank(&given, &parameters, &singles, &chosen, values);
    let confusable = confusable(search, &chosen, &singles, values);
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

/// Whether a hypothesis leaves nothing to look for.
fn suffices(t: &Tested, gap: f64, values: f64) -> bool {
    let left = unexplained_part(t, values);
    left == 0.0 || (left < BELOW_NOISE && left * values < (1.0 - CLOSES) * gap)
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

/// A second and a third effect, where a material remainder is closed by them.
///
/// Two at once are looked for as two: the best single effect may be the one that imitates both. Where the regression over
/// pairs does not lead to the floor, the best few singles are each given a partner.
fn further(
    search: &Search<'_>,
    parameters: &Tested,
    singles: &[Tested],
    first: Tested,
    gap: f64,
    values: f64,
    progress: &(dyn Fn(&str) + Sync),
) -> Tested {
    let material = |t: &Tested| unexplained_part(t, values) > 0.0;
    let closes_more = |next: &Tested, chosen: &Tested| {
        let gain = chosen.fitted.chi2 - next.fitted.chi2;
        let rest = chosen.fitted.chi2 - values;
        better(next, chosen, values) && gain >= FURTHER * rest && counts(gain, rest, gap)
    };
    let closer = |a: &Tested, b: &Tested| {
        let floor = (a.fitted.chi2.min(b.fitted.chi2) / values).max(1.0);
        bic(a, values, floor).total_cmp(&bic(b, values, floor))
    };
    let best_partner = |of: &Tested, rival: f64| {
        let pairs = search.one_more(of, rival, progress);
        pairs.first().map(|best| alike(&pairs, best, values).clone())
    };
    let left = |pair: &Option<Tested>| pair.as_ref().map_or(f64::INFINITY, |p| p.fitted.chi2);
    let mut chosen = first;
    if suffices(&chosen, gap, values) {
        return chosen;
    }
    // Where the first is all but everything, a partner may sharpen it; without it no two would come near it.
    let first_is_most = chosen.fitted.chi2 - values < FURTHER_OF_ALL * gap;
    let beam = if first_is_most { 1 } else { BEAM };
    let mut pair: Option<Tested> =
        if first_is_most { None } else { search.two(parameters, progress).into_iter().min_by(closer) };
    for single in singles.iter().take(beam) {
        if pair.as_ref().is_some_and(|p| !material(p)) {
            break;
        }
        let partnered = best_partner(single, left(&pair));
        pair = pair.into_iter().chain(partnered).min_by(closer);
    }
    // A partner of what is all but everything must close nearly all that is left: half of it, when it is found.
    let half_way = |p: &Tested| chosen.fitted.chi2 - p.fitted.chi2 >= FURTHER * (chosen.fitted.chi2 - values);
    let promises = |p: &Tested| if first_is_most { half_way(p) } else { takes(&chosen, p, values) };
    if let Some(found) = pair.as_ref().filter(|p| material(p) && promises(p)) {
        // With the partner in, was the first the right one? And with the first where it is then, the partner?
        let found = found.clone();
        for &(kept, variant) in found.effects.iter().rev() {
            let turned = best_partner(&search.only(&found, kept, variant), left(&pair));
            pair = pair.into_iter().chain(turned).min_by(closer);
        }
    }
    let Some(pair) = pair.filter(|p| promises(p)).map(|p| search.among_kin(p)) else { return chosen };
    let third = if suffices(&pair, gap, values) || chosen.fitted.chi2 < WORTH_A_THIRD * pair.fitted.chi2 {
        None
    } else {
        best_partner(&pair, f64::INFINITY).map(|t| if material(&t) { search.among_kin(t) } else { t })
    };
    // Beside a cause that is all but everything two more may count together where neither does alone.
    for next in [Some(pair), third].into_iter().flatten() {
        if closes_more(&next, &chosen) {
            chosen = next;
        }
    }
    chosen
}

/// Whether what an effect takes away counts: a share of the whole gap or, where the first cause is all but everything,
/// what was left of it.
fn counts(gain: f64, rest: f64, gap: f64) -> bool {
    gain >= FURTHER_OF_ALL * gap || gain >= CLOSES * rest
}

/// Drops effects that the others, fitted again from where the combination ended, do without; and the share of each that
/// stays: how much of the gap comes back without it.
///
/// A further effect may be no more than the way by which the first came out of a local minimum.
fn pruned(
    search: &Search<'_>,
    combination: Tested,
    singles: &mut Vec<Tested>,
    gap: f64,
    values: f64,
) -> (Tested, Vec<f64>) {
    let mut chosen = combination;
    loop {
        if chosen.effects.len() < 2 {
            let shares = vec![1.0; chosen.effects.len()];
            return (chosen, shares);
        }
        let without: Vec<Tested> = (0..chosen.effects.len())
            .map(|i| {
                let keep: Vec<(Effect, usize)> =
                    chosen.effects.iter().enumerate().filter(|(j, _)| *j != i).map(|(_, e)| *e).collect();
                let again = search.without(&chosen, &keep);
                let known = singles.iter().find(|t| t.effects == keep);
                known.filter(|t| t.fitted.chi2 < again.fitted.chi2).cloned().unwrap_or(again)
            })
            .collect();
        let back: Vec<f64> = without.iter().map(|t| (t.fitted.chi2 - chosen.fitted.chi2).max(0.0)).collect();
        let idle = (0..back.len()).min_by(|a, b| back[*a].total_cmp(&back[*b])).unwrap_or(0);
        let rest = without[idle].fitted.chi2 - values;
        let needed = !suffices(&without[idle], gap, values) && counts(back[idle], rest, gap);
        if needed && better(&chosen, &without[idle], values) {
            let sum: f64 = back.iter().sum();
            return (chosen, back.iter().map(|b| b / sum).collect());
        }
        chosen = without[idle].clone();
        if chosen.effects.len() == 1 {
            adopt(singles, &chosen);
        }
    }
}

/// Puts a single effect's better fit in the place of the one known.
fn adopt(singles: &mut Vec<Tested>, better: &Tested) {
    singles.retain(|t| t.effects[0].0 != better.effects[0].0);
    singles.push(better.clone());
    singles.sort_by(|a, b| a.fitted.chi2.total_cmp(&b.fitted.chi2));
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

/// Effects that explain the record as well in the place of one named: of a single effect all that were fitted, of
/// each of several its kin.
fn confusable(search: &Search<'_>, chosen: &Tested, singles: &[Tested], values: f64) -> Vec<Confusable> {
    let floor = (chosen.fitted.chi2 / values).max(1.0);
    let rivals = |at: usize| match chosen.effects.len() {
        1 => singles.iter().filter(|t| t.effects[0].0 != chosen.effects[0].0).cloned().collect(),
        _ => search.kin(chosen, at),
    };
    (0..chosen.effects.len())
        .flat_map(|at| rivals(at).into_iter().map(move |t| (at, t)))
        .map(|(at, t)| Confusable {
            named: chosen.effects[at].0,
            other: t.effects[at].0,
            delta_bic: bic(&t, values, floor) - bic(chosen, values, floor),
        })
        .filter(|c| c.delta_bic < CONFUSABLE)
        .collect()
}
