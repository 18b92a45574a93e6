//! One more effect, alone or beside others: screened by regression, looked at, fitted, in its best form.

use rayon::prelude::*;

use super::fit::{Effort, Fitted};
use super::model::Model;
use super::screen::{Candidate, Screen};
use super::search::{COMPARED, NO_RIVAL, Search, Tested, WAY, inherited, simplest_of};
use super::states;
use super::trials::tone;
use crate::axis::Structure;
use crate::effects::{Effect, Place, Scale};

/// Linearisations of a first look at a start.
const GLANCE: usize = 6;
/// Starts of an effect, each smaller than the one before, that are tried until one is good.
const SMALLER: usize = 3;
/// Only a start beside another whose regression leaves less than this share of what is left without it: it must close
/// half of that to count.
const PROMISING: f64 = 0.7;
/// Starts looked at per effect alone,
const STARTS: usize = 3;
/// and beside another, from each of two places.
const STARTS_BESIDE: usize = 1;
/// Periods of a flexible mode that a record must hold.
const SWINGS: f64 = 2.0;
/// Damping ratio that a flexible mode must have,
const DECAYS: f64 = 1e-3;
/// and must not reach.
const CREEPS: f64 = 1.0;
/// Effects fitted at a time.
const BATCH: usize = 4;
/// Squared residual per value at which a fit counts as having reached the floor,
const REACHED: f64 = 1.3;
/// or having nearly reached it.
const REACHED_NEARLY: f64 = 1.02;
/// An effect beside another whose regression leaves this many times the best is not looked at.
const FAR: [f64; 2] = [f64::INFINITY, 30.0];
/// A first look beside another is given up where the model runs away to this many times what is left without the effect.
const RUN_AWAY: f64 = 30.0;
/// Steps after which that is seen.
const BEARINGS: usize = 2;
/// An effect whose regression leaves this many times a fit at the floor is not looked at.
const HOPELESS: f64 = 3.0;
/// Effects that are fitted at all: the best by the regression, alone and beside another.
const LOOKED_AT: [usize; 2] = [10, 6];
/// Effects whose fits are taken to the end, at most, alone and beside another.
const FINALISTS: [usize; 2] = [6, 3];
/// And only those within this factor of the best at first look,
const NEAR: f64 = 10.0;
/// or within this one when the best has reached the floor.
const NEAR_THE_FLOOR: f64 = 3.0;
/// Share of what is left above the floor that a further effect must take for anything more to be tried with it.
const SEEN: f64 = 0.1;

/// Whether a further effect takes a share of what is left above the floor without it.
pub fn takes(without: &Tested, with: &Tested, values: f64) -> bool {
    without.fitted.chi2 - with.fitted.chi2 >= SEEN * (without.fitted.chi2 - values)
}

impl Search<'_> {
    /// Every effect of the library beside those of `beside`, best first: one [`Tested`] per effect, its best variant
    /// by [`simplest_of`]. Beside another, none that promises to stay far above `rival`, the sum of squares that as many
    /// effects are known to leave; alone, with a rival, from the leaning parameters too.
    #[must_use]
    pub fn one_more(&self, beside: &Tested, rival: f64, progress: &(dyn Fn(&str) + Sync)) -> Vec<Tested> {
        let stage = usize::from(!beside.effects.is_empty());
        // What is missing makes the parameters lean: once from where they are known to be, once from where they lean.
        let leaning = beside.fitted.model;
        let upright = Model { parameters: self.nominal.parameters, ..leaning };
        let initial = self.initial();
        let mut screens = vec![Screen::new(&upright, self.data, &initial, &self.states, &beside.effects)];
        let own_motion = (stage > 0 || rival.is_finite())
            .then(|| states::of_model(self.data, &leaning, &beside.fitted.initial, &self.states));
        if let Some(motion) = &own_motion {
            screens.push(Screen::new(&leaning, self.data, &beside.fitted.initial, motion, &beside.effects));
        }
        let values = self.data.values() as f64;
        // Near the floor what is missing is small, and a first look sees it.
        let small = stage > 0 && beside.fitted.chi2 < COMPARED * values;
        let screened = self.screened(beside, &screens, progress);
        let glances = self.glances(beside, rival, &screened, progress);
        let finalist = |rank: usize, glance: &Tested| {
            let best = glances.first().map_or(rival, |(best, _)| best.fitted.chi2.min(rival));
            rank < FINALISTS[stage]
                && ((rank == 0 && stage == 0) || glance.fitted.chi2 < self.near(best))
                && (!small || takes(beside, glance, values))
        };
        let firsts: Vec<Tested> = glances
            .par_iter()
            .enumerate()
            .map(|(rank, (glance, candidate))| {
                progress(candidate.effect.info().id);
                if finalist(rank, glance) {
                    let effects = beside.with(candidate.effect, candidate.variant);
                    let first = self.refit(&glance.fitted, effects, self.exploring(&glance.fitted));
                    if first.fitted.chi2.is_finite() { first } else { glance.clone() }
                } else {
                    glance.clone()
                }
            })
            .collect();
        let best = firsts.iter().map(|t| t.fitted.chi2).fold(rival, f64::min);
        let mut tested: Vec<Tested> = firsts
            .into_par_iter()
            .zip(&glances)
            .enumerate()
            .map(|(rank, (first, (glance, candidate)))| {
                // Beside another, the other forms of the best alone, if it takes anything.
                let tried = stage == 0 || (first.fitted.chi2 <= best && takes(beside, &first, values));
                if tried && finalist(rank, glance) {
                    self.best_variant(beside, first, candidate, &screens[0])
                } else {
                    first
                }
            })
            .collect();
        tested.retain(|t| t.fitted.chi2.is_finite() && self.is_genuine(t));
        tested.sort_by(|a, b| a.fitted.chi2.total_cmp(&b.fitted.chi2));
        tested
    }

    /// The starts of the effects that are looked at, those that any of the regressions ranks high first.
    fn screened(
        &self,
        beside: &Tested,
        screens: &[Screen<'_>],
        progress: &(dyn Fn(&str) + Sync),
    ) -> Vec<Vec<Candidate>> {
        let stage = usize::from(!beside.effects.is_empty());
        let starts = if stage == 0 { STARTS } else { STARTS_BESIDE };
        let mut suspects = self.applicable();
        suspects.retain(|e| beside.effects.iter().all(|(found, _)| found != e));
        let mut screened: Vec<(usize, Vec<Candidate>)> = Vec::new();
        for screen in screens {
            let mut of_screen: Vec<Vec<Candidate>> = suspects
                .iter()
                .map(|&effect| {
                    progress(effect.info().id);
                    let variants = 0..effect.info().variants.len();
                    let mut found: Vec<Candidate> = variants.flat_map(|v| screen.starts(effect, v, starts)).collect();
                    found.sort_by(|a, b| a.chi2.total_cmp(&b.chi2));
                    found.truncate(starts);
                    found
                })
                .filter(|starts| !starts.is_empty())
                .collect();
            of_screen.sort_by(|a, b| a[0].chi2.total_cmp(&b[0].chi2));
            for (rank, mut found) in of_screen.into_iter().enumerate() {
                match screened.iter_mut().find(|(_, known)| known[0].effect == found[0].effect) {
                    Some((best, known)) => {
                        *best = rank.min(*best);
                        known.append(&mut found);
                    }
                    None => screened.push((rank, found)),
                }
            }
        }
        screened.sort_by_key(|(rank, _)| *rank);
        screened.truncate(LOOKED_AT[stage]);
        screened.into_iter().map(|(_, starts)| starts).collect()
    }

    /// A first look at each effect from its best start, best first. The regression's favourites are looked at first: when
    /// they reach the floor, or come far below what the others promise, these need not be looked at.
    fn glances(
        &self,
        beside: &Tested,
        rival: f64,
        screened: &[Vec<Candidate>],
        progress: &(dyn Fn(&str) + Sync),
    ) -> Vec<(Tested, Candidate)> {
        let stage = usize::from(!beside.effects.is_empty());
        let mut glances: Vec<(Tested, Candidate)> = Vec::new();
        for batch in screened.chunks(BATCH) {
            let best = glances.iter().map(|g| g.0.fitted.chi2).fold(rival, f64::min);
            let promised = batch.iter().flatten().map(|c| c.chi2).fold(f64::INFINITY, f64::min);
            if promised > self.bar(best, stage) {
                break;
            }
            glances.par_extend(batch.par_iter().flat_map_iter(|starts| {
                progress(starts[0].effect.info().id);
                self.best_glance(beside, starts)
            }));
        }
        glances.retain(|(t, _)| t.fitted.chi2.is_finite());
        glances.sort_by(|a, b| a.0.fitted.chi2.total_cmp(&b.0.fitted.chi2));
        glances
    }

    /// The best of an effect's starts; beside another effect, one whose regression leaves far more than another start's first
    /// look is not looked at.
    fn best_glance(&self, beside: &Tested, starts: &[Candidate]) -> Option<(Tested, Candidate)> {
        let mut starts: Vec<&Candidate> = starts.iter().collect();
        starts.sort_by(|a, b| a.chi2.total_cmp(&b.chi2));
        let mut best: Option<(Tested, Candidate)> = None;
        for start in starts {
            let so_far = best.as_ref().map_or(f64::INFINITY, |(t, _)| t.fitted.chi2);
            if !beside.effects.is_empty() && start.chi2 > HOPELESS * so_far {
                break;
            }
            let glance = self.glance(beside, start);
            if best.is_none() || glance.fitted.chi2 < so_far {
                best = Some((glance, start.clone()));
            }
        }
        best
    }

    /// What a regression may leave to be looked at when the best fit leaves `best`, alone or beside another effect.
    pub(super) fn bar(&self, best: f64, stage: usize) -> f64 {
        best * if self.at_floor(best) { HOPELESS } else { FAR[stage] }
    }

    /// What a first look may leave to be taken to its end when the best one leaves `best`.
    pub(super) fn near(&self, best: f64) -> f64 {
        best * if self.at_floor(best) { NEAR_THE_FLOOR } else { NEAR }
    }

    fn at_floor(&self, chi2: f64) -> bool {
        chi2 < REACHED * self.data.values() as f64
    }

    /// The best of an effect's forms, tried from the minimum of the `first`, in which it was looked at.
    fn best_variant(&self, beside: &Tested, first: Tested, candidate: &Candidate, screen: &Screen<'_>) -> Tested {
        let effect = candidate.effect;
        let values = self.data.values() as f64;
        let mut forms = vec![first];
        for (variant, form) in effect.info().variants.iter().enumerate() {
            if variant == candidate.variant {
                continue;
            }
            // A richer form than one that is at the floor has nothing left to explain.
            let richer = form.free.len() > effect.info().variants[candidate.variant].free.len();
            if richer && forms[0].fitted.chi2 < REACHED_NEARLY * values {
                continue;
            }
            let mut starts =
                vec![inherited(&forms[0].fitted.model.effects, effect, effect, form, &self.nominal.effects)];
            starts.extend(screen.starts(effect, variant, 1).iter().map(|c| c.settings));
            let best = starts
                .iter()
                .filter(|s| s.is_on(effect))
                .map(|settings| {
                    let mut model = forms[0].fitted.model;
                    model.effects.of_mut(effect).copy_from_slice(settings.of(effect));
                    let start = Fitted { model, ..forms[0].fitted.clone() };
                    let effort = self.exploring(&start).unless(WAY, NO_RIVAL * start.chi2);
                    self.refit(&start, beside.with(effect, variant), effort)
                })
                .min_by(|a, b| a.fitted.chi2.total_cmp(&b.fitted.chi2));
            forms.extend(best);
        }
        let first = forms[0].clone();
        simplest_of(forms, values).unwrap_or(first)
    }

    /// The suspects that can act on this axis and be fitted.
    pub(super) fn applicable(&self) -> Vec<Effect> {
        self.suspects.iter().copied().filter(|e| self.applies(*e)).collect()
    }

    /// Whether the effect can act on this axis and be fitted: a rigid axis has no coupling; rounding has no derivative
    /// and is judged by its lattice; a torque constant is a common factor of the nominal parameters.
    fn applies(&self, effect: Effect) -> bool {
        let rigid = self.nominal.structure == Structure::Rigid;
        let info = effect.info();
        let beyond_a_rigid_axis = info.place == Place::Coupling
            || (info.place == Place::Table && effect != Effect::FlexibleMode)
            || (info.place == Place::Sensor);
        let unfit = matches!(effect, Effect::EncoderQuantisation | Effect::TorqueGain);
        !unfit && (!rigid || !beyond_a_rigid_axis)
    }

    /// Whether its effects are what they are called.
    pub(super) fn is_genuine(&self, t: &Tested) -> bool {
        self.swings(t) && self.turns(t)
    }

    /// Whether every sine comes round within the record: a slower one is a constant or a drift.
    fn turns(&self, t: &Tested) -> bool {
        t.effects.iter().all(|&(effect, form)| {
            let Some((i, scale)) = tone(effect, &effect.info().variants[form]) else { return true };
            let span = match scale {
                Scale::Frequency => std::f64::consts::TAU * self.data.record.len() as f64 * self.data.record.dt,
                _ => self.states.travel(usize::from(effect.info().place != Place::Motor)),
            };
            t.fitted.model.effects.of(effect)[i] * span >= std::f64::consts::TAU
        })
    }

    /// Whether a flexible mode, if there is one, is one: slower than the record, it is a wall with spring and damper; free
    /// of damping, a foreign sine that no motion excites; beyond critical damping, a force that every window sets anew with
    /// its initial state and that fades within it: any friction looks like that.
    fn swings(&self, t: &Tested) -> bool {
        let p = t.fitted.model.effects.of(Effect::FlexibleMode);
        let length = self.data.record.len() as f64 * self.data.record.dt;
        let flexible = t.effects.iter().any(|(e, _)| *e == Effect::FlexibleMode);
        let swings = p[1] > p[0] * (SWINGS * std::f64::consts::TAU / length).powi(2);
        let critical = 2.0 * (p[0] * p[1]).sqrt();
        let decays = (DECAYS * critical..CREEPS * critical).contains(&p[2]);
        !flexible || (swings && decays)
    }

    /// A first look at a start, beside others with the axis' parameters as the regression has them; where the model runs away from it (a spring
    /// that softens beyond its range), or comes out no better than without the effect, from the start alone, then smaller.
    pub(super) fn glance(&self, beside: &Tested, candidate: &Candidate) -> Tested {
        let alone = beside.effects.is_empty();
        let good = |t: &Tested| t.fitted.chi2.is_finite() && (alone || t.fitted.chi2 < beside.fitted.chi2);
        let mut starts = if alone { Vec::new() } else { vec![candidate.moved()] };
        if alone || candidate.chi2 < PROMISING * beside.fitted.chi2 {
            let mut smaller = candidate.clone();
            for _ in 0..SMALLER {
                starts.push(smaller.clone());
                smaller.shrink();
            }
        }
        let mut best: Option<Tested> = None;
        for start in &starts {
            let tested = self.look(beside, start);
            let better = best.as_ref().is_none_or(|b| !b.fitted.chi2.is_finite() || tested.fitted.chi2 < b.fitted.chi2);
            if better {
                best = Some(tested);
            }
            if best.as_ref().is_some_and(&good) {
                break;
            }
        }
        best.unwrap_or_else(|| beside.clone())
    }

    fn look(&self, beside: &Tested, candidate: &Candidate) -> Tested {
        let Candidate { effect, variant, parameters, settings: effects, .. } = *candidate;
        let model = Model { parameters, effects, ..beside.fitted.model };
        // The states as measured until a model has come near them.
        let upright = beside.effects.is_empty() && parameters == self.nominal.parameters;
        let initial = if upright { self.initial() } else { beside.fitted.initial.clone() };
        let start = Fitted { model, initial, ..beside.fitted.clone() };
        let effort = Effort::exploring(GLANCE, self.misfit(start.chi2));
        let effort =
            if beside.effects.is_empty() { effort } else { effort.unless(BEARINGS, RUN_AWAY * beside.fitted.chi2) };
        let effects = beside.with(effect, variant);
        self.test(&start.model, &self.free(&effects), &start.initial, effects, effort)
    }
}
