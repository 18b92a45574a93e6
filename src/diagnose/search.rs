//! The search: no gap, parameters only, every single effect, then more effects beside the best.

use rayon::prelude::*;

use super::fit::{Data, Effort, Fitted, fit};
use super::model::{BaseParameter, Free, Model};
use super::response::States;
use super::screen::{Candidate, Screen};
use super::states;
use super::windows::Initial;
use crate::axis::Structure;
use crate::effects::{Effect, Place, Settings, Variant};

/// Linearisations of a first look at a start.
const GLANCE: usize = 6;
/// Linearisations of a fit that counts.
const FULL: usize = 40;
/// Linearisations of the fit that every other is measured against.
const LONG: usize = 120;
/// Share of the cost by which two steps running must lower it to go on: a fit that crawls slower does not reach the
/// floor in the linearisations it has.
const CRAWL: f64 = 1e-3;
/// The same for fits whose likelihoods are compared.
const CLOSE: f64 = 1e-5;
/// Squared residual per value up to which likelihoods are compared, not only ranked.
const COMPARED: f64 = 3.0;
/// Starts of an effect, each smaller than the one before, that are tried until one is good.
const SMALLER: usize = 3;
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

/// A hypothesis that was fitted.
#[derive(Debug, Clone)]
pub struct Tested {
    /// Its effects with their variants, in the order they were found; empty for the nominal structure.
    pub effects: Vec<(Effect, usize)>,
    /// The fit.
    pub fitted: Fitted,
    /// Number of free parameters; of the initial states only those that the effects bring.
    pub freedom: usize,
}

impl Tested {
    /// Its effects.
    pub fn ids(&self) -> Vec<&'static str> {
        self.effects.iter().map(|(e, _)| e.info().id).collect()
    }
}

/// What is searched through.
pub struct Search<'a> {
    /// Training data.
    pub data: Data<'a>,
    /// The model as given.
    pub nominal: Model,
    /// Whether the noise is mostly rounding, which is not white.
    pub coarse: bool,
    /// Effects that may be named.
    pub suspects: Vec<Effect>,
    /// Motion along the record.
    pub states: States,
}

impl Search<'_> {
    fn initial(&self) -> Vec<Initial> {
        self.data.windows.iter().map(|w| self.states.initial(w.begin)).collect()
    }

    fn base(&self) -> Vec<Free> {
        BaseParameter::of(self.nominal.structure).iter().map(|p| Free::Base(*p)).collect()
    }

    /// The nominal model, only the windows' initial states fitted.
    #[must_use]
    pub fn as_given(&self) -> Tested {
        let effort = Effort { iterations: FULL, misfit: 1.0, tolerance: CLOSE };
        self.test(&self.nominal, &[], &self.initial(), Vec::new(), effort)
    }

    /// The nominal structure with its parameters fitted.
    #[must_use]
    pub fn parameters_only(&self, given: &Tested) -> Tested {
        let free = self.base();
        let first = Effort { iterations: FULL / 2, misfit: self.misfit(given.fitted.chi2), tolerance: CLOSE };
        let look = self.test(&self.nominal, &free, &given.fitted.initial, Vec::new(), first);
        let long = Effort { iterations: LONG, misfit: self.misfit(look.fitted.chi2), tolerance: CLOSE };
        self.test(&look.fitted.model, &free, &look.fitted.initial, Vec::new(), long)
    }

    fn misfit(&self, chi2: f64) -> f64 {
        (chi2 / self.data.values() as f64).max(1.0)
    }

    fn test(
        &self,
        start: &Model,
        free: &[Free],
        initial: &[Initial],
        effects: Vec<(Effect, usize)>,
        effort: Effort,
    ) -> Tested {
        let fitted = fit(self.data, &self.nominal, start, free, initial, effort);
        // A third inertia brings its own initial state into every window: so much noise can be followed with it.
        let flexible = effects.iter().any(|(e, _)| *e == Effect::FlexibleMode);
        let swinging = if flexible { 2 * self.data.windows.len() } else { 0 };
        Tested { effects, fitted, freedom: free.len() + swinging }
    }

    /// Every effect of the library beside those of `beside`, best first: one [`Tested`] per effect, its best variant
    /// by [`simplest`].
    #[must_use]
    pub fn one_more(&self, beside: &Tested, progress: &(dyn Fn(&str) + Sync)) -> Vec<Tested> {
        let stage = usize::from(!beside.effects.is_empty());
        let found: Vec<Effect> = beside.effects.iter().map(|(e, _)| *e).collect();
        // What is missing makes the parameters lean: once from where they are known to be, once from where they lean.
        let leaning = beside.fitted.model;
        let upright = Model { parameters: self.nominal.parameters, ..leaning };
        let initial = self.initial();
        let mut screens = vec![Screen::new(&upright, self.data, &initial, &self.states, &beside.effects)];
        let own_motion =
            (stage > 0).then(|| states::of_model(self.data, &leaning, &beside.fitted.initial, &self.states));
        if let Some(motion) = &own_motion {
            screens.push(Screen::new(&leaning, self.data, &beside.fitted.initial, motion, &beside.effects));
        }
        let suspects: Vec<Effect> =
            self.suspects.iter().copied().filter(|e| !found.contains(e) && self.applies(*e)).collect();
        let starts = if stage == 0 { STARTS } else { STARTS_BESIDE };
        let mut screened: Vec<(usize, Vec<Candidate>)> = Vec::new();
        for screen in &screens {
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
        let mut screened: Vec<Vec<Candidate>> = screened.into_iter().map(|(_, starts)| starts).collect();
        screened.truncate(LOOKED_AT[stage]);
        // The regression's favourites first; when they reach the floor, the others need not be looked at.
        let mut glances: Vec<(Tested, Candidate)> = Vec::new();
        for batch in screened.chunks(BATCH) {
            let best = glances.iter().map(|g| g.0.fitted.chi2).fold(f64::INFINITY, f64::min);
            let promised = batch.iter().flatten().map(|c| c.chi2).fold(f64::INFINITY, f64::min);
            if best < REACHED * self.data.values() as f64 && promised > HOPELESS * best {
                break;
            }
            glances.par_extend(batch.par_iter().flat_map_iter(|starts| {
                progress(starts[0].effect.info().id);
                starts
                    .iter()
                    .map(|c| (self.glance(beside, c), c.clone()))
                    .min_by(|a, b| a.0.fitted.chi2.total_cmp(&b.0.fitted.chi2))
            }));
        }
        glances.sort_by(|a, b| a.0.fitted.chi2.total_cmp(&b.0.fitted.chi2));
        let best = glances.first().map_or(0.0, |g| g.0.fitted.chi2);
        let near = best * if best < REACHED * self.data.values() as f64 { NEAR_THE_FLOOR } else { NEAR };
        let mut tested: Vec<Tested> = glances
            .par_iter()
            .enumerate()
            .map(|(rank, (glance, candidate))| {
                progress(candidate.effect.info().id);
                if rank < FINALISTS[stage] && (rank < 1 || glance.fitted.chi2 < near) {
                    self.best_variant(beside, glance, candidate, &screens[0])
                } else {
                    glance.clone()
                }
            })
            .collect();
        tested.retain(|t| t.fitted.chi2.is_finite() && self.swings(t));
        tested.sort_by(|a, b| a.fitted.chi2.total_cmp(&b.fitted.chi2));
        tested
    }

    /// Takes an effect to its minimum in the form it was looked at, then tries its other forms from there.
    fn best_variant(&self, beside: &Tested, glance: &Tested, candidate: &Candidate, screen: &Screen<'_>) -> Tested {
        let effect = candidate.effect;
        let first = self.refit(beside, &glance.fitted, effect, candidate.variant, FULL);
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
            let mut starts = vec![restricted(&forms[0].fitted.model.effects, effect, form, &self.nominal.effects)];
            starts.extend(screen.starts(effect, variant, 1).iter().map(|c| c.settings));
            let best = starts
                .iter()
                .filter(|s| s.is_on(effect))
                .map(|settings| {
                    let mut model = forms[0].fitted.model;
                    model.effects.of_mut(effect).copy_from_slice(settings.of(effect));
                    let start = Fitted { model, ..forms[0].fitted.clone() };
                    self.refit(beside, &start, effect, variant, FULL)
                })
                .min_by(|a, b| a.fitted.chi2.total_cmp(&b.fitted.chi2));
            forms.extend(best);
        }
        forms.retain(|t| t.fitted.chi2.is_finite());
        forms.sort_by_key(|t| t.freedom);
        if forms.is_empty() { glance.clone() } else { simplest(&forms, values).clone() }
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

    /// The nominal structure with its parameters fitted, from where another hypothesis has them.
    #[must_use]
    pub fn parameters_again(&self, from: &Tested) -> Tested {
        let start = Model { effects: self.nominal.effects, ..from.fitted.model };
        let effort = Effort { iterations: LONG, misfit: self.misfit(from.fitted.chi2), tolerance: CLOSE };
        self.test(&start, &self.base(), &from.fitted.initial, Vec::new(), effort)
    }

    /// One of a combination's effects alone, as it was fitted there: a start for other partners.
    #[must_use]
    pub fn only(&self, combination: &Tested, effect: Effect, variant: usize) -> Tested {
        let mut model = Model { effects: self.nominal.effects, ..combination.fitted.model };
        model.effects.of_mut(effect).copy_from_slice(combination.fitted.model.effects.of(effect));
        let fitted = Fitted { model, ..combination.fitted.clone() };
        Tested { effects: vec![(effect, variant)], fitted, freedom: combination.freedom }
    }

    /// A combination without some of its effects, fitted again.
    #[must_use]
    pub fn without(&self, combination: &Tested, keep: &[(Effect, usize)]) -> Tested {
        let mut start = combination.fitted.model;
        for (effect, _) in &combination.effects {
            if !keep.iter().any(|(e, _)| e == effect) {
                start.effects.of_mut(*effect).copy_from_slice(self.nominal.effects.of(*effect));
            }
        }
        let effort = Effort { iterations: FULL, misfit: self.misfit(combination.fitted.chi2), tolerance: CLOSE };
        self.test(&start, &self.free(keep), &combination.fitted.initial, keep.to_vec(), effort)
    }

    fn free(&self, effects: &[(Effect, usize)]) -> Vec<Free> {
        let mut free = self.base();
        for (e, v) in effects {
            free.extend(e.info().variants[*v].free.iter().map(|i| Free::Effect(*e, *i)));
        }
        free
    }

    fn refit(&self, beside: &Tested, from: &Fitted, effect: Effect, variant: usize, iterations: usize) -> Tested {
        let effects: Vec<(Effect, usize)> = beside.effects.iter().copied().chain([(effect, variant)]).collect();
        let effort = Effort { iterations, misfit: self.misfit(from.chi2), tolerance: CRAWL };
        let tested = self.test(&from.model, &self.free(&effects), &from.initial, effects, effort);
        let compared = tested.fitted.chi2 < COMPARED * self.data.values() as f64;
        if iterations > GLANCE && compared { self.closely(&tested) } else { tested }
    }

    /// A fit taken on from where it stands, to where likelihoods can be compared.
    #[must_use]
    pub fn closely(&self, from: &Tested) -> Tested {
        let effort = Effort { iterations: FULL, misfit: self.misfit(from.fitted.chi2), tolerance: CLOSE };
        self.test(&from.fitted.model, &self.free(&from.effects), &from.fitted.initial, from.effects.clone(), effort)
    }

    /// A first look at a start, beside others with the axis' parameters as the regression has them; where the model runs away from it (a spring
    /// that softens beyond its range), or comes out no better than without the effect, from the start alone, then smaller.
    fn glance(&self, beside: &Tested, candidate: &Candidate) -> Tested {
        let alone = beside.effects.is_empty();
        let good = |t: &Tested| t.fitted.chi2.is_finite() && (alone || t.fitted.chi2 < beside.fitted.chi2);
        let mut starts = if alone { Vec::new() } else { vec![candidate.moved()] };
        let mut smaller = candidate.clone();
        for _ in 0..SMALLER {
            starts.push(smaller.clone());
            smaller.shrink();
        }
        let mut best: Option<Tested> = None;
        for start in &starts {
            let tested = self.look(beside, start, GLANCE);
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

    fn look(&self, beside: &Tested, candidate: &Candidate, iterations: usize) -> Tested {
        let Candidate { parameters, settings: effects, .. } = *candidate;
        let model = Model { parameters, effects, ..beside.fitted.model };
        // The states as measured until a model has come near them.
        let initial = if beside.effects.is_empty() { self.initial() } else { beside.fitted.initial.clone() };
        let start = Fitted { model, initial, ..beside.fitted.clone() };
        self.refit(beside, &start, candidate.effect, candidate.variant, iterations)
    }
}

/// The settings with the parameters that a form does not free put back.
fn restricted(settings: &Settings, effect: Effect, form: &Variant, off: &Settings) -> Settings {
    let mut s = *settings;
    for i in 0..effect.info().parameters.len() {
        if !form.free.contains(&i) {
            s.of_mut(effect)[i] = off.of(effect)[i];
        }
    }
    s
}

/// Share of the excess over the simplest form's that a richer form must take away to be preferred.
const MATERIAL: f64 = 0.02;

/// Of forms that close the gap alike, the one with the fewest free parameters.
#[must_use]
pub fn simplest(forms: &[Tested], values: f64) -> &Tested {
    let best = forms.iter().map(|t| t.fitted.chi2).fold(f64::INFINITY, f64::min);
    let mut chosen = &forms[0];
    for form in forms {
        let gain = chosen.fitted.chi2 - form.fitted.chi2;
        let excess = (chosen.fitted.chi2 - values).max(best * 1e-3);
        let extra = form.freedom.saturating_sub(chosen.freedom) as f64;
        // More freedom must pay its price, and close a material share of what was left.
        if gain > extra * values.ln() * (best / values).max(1.0) && gain > MATERIAL * excess {
            chosen = form;
        }
    }
    chosen
}
