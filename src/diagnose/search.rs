//! What is searched through, and the fits of given hypotheses: no gap, parameters only, combinations of effects.

use rayon::prelude::*;

use super::fit::{Data, Effort, Fitted, fit};
use super::model::{BaseParameter, Free, Model};
use super::response::States;
use super::windows::Initial;
use crate::effects::{Effect, Settings, Variant};

/// Linearisations of a fit that counts.
const FULL: usize = 40;
/// Linearisations of the fit that every other is measured against.
const LONG: usize = 120;
/// Squared residual per value up to which likelihoods are compared, not only ranked.
pub const COMPARED: f64 = 3.0;
/// A rival start or form that after so many steps
pub const WAY: usize = 8;
/// leaves this many times the first is given up.
pub const NO_RIVAL: f64 = 1.5;
/// Another law of the same thing starts beside its minimum, in a valley that events make rough: it has longer,
const WAY_OF_KIN: usize = 3 * WAY;
/// but not where it is still this many times as far off.
const ASTRAY: f64 = 1e3;

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

    /// Its effects and one more.
    #[must_use]
    pub fn with(&self, effect: Effect, variant: usize) -> Vec<(Effect, usize)> {
        self.effects.iter().copied().chain([(effect, variant)]).collect()
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
    /// The windows' initial states as measured.
    #[must_use]
    pub fn initial(&self) -> Vec<Initial> {
        self.data.windows.iter().map(|w| self.states.initial(w.begin)).collect()
    }

    fn base(&self) -> Vec<Free> {
        BaseParameter::of(self.nominal.structure).iter().map(|p| Free::Base(*p)).collect()
    }

    /// The nominal model, only the windows' initial states fitted.
    #[must_use]
    pub fn as_given(&self) -> Tested {
        let effort = Effort::to_the_end(FULL, 1.0);
        self.test(&self.nominal, &[], &self.initial(), Vec::new(), effort)
    }

    /// The nominal structure with its parameters fitted.
    #[must_use]
    pub fn parameters_only(&self, given: &Tested) -> Tested {
        let free = self.base();
        let first = Effort::to_the_end(FULL / 2, self.misfit(given.fitted.chi2));
        let look = self.test(&self.nominal, &free, &given.fitted.initial, Vec::new(), first);
        let long = Effort::to_the_end(LONG, self.misfit(look.fitted.chi2));
        self.test(&look.fitted.model, &free, &look.fitted.initial, Vec::new(), long)
    }

    /// Squared residual per value, at least that of noise.
    #[must_use]
    pub fn misfit(&self, chi2: f64) -> f64 {
        (chi2 / self.data.values() as f64).max(1.0)
    }

    /// Fits a hypothesis from a start.
    #[must_use]
    pub fn test(
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

    /// The nominal structure with its parameters fitted, from where another hypothesis has them.
    #[must_use]
    pub fn parameters_again(&self, from: &Tested) -> Tested {
        let start = Model { effects: self.nominal.effects, ..from.fitted.model };
        let effort = Effort::to_the_end(LONG, self.misfit(from.fitted.chi2));
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
        let from = Fitted { model: start, ..combination.fitted.clone() };
        self.refit(&from, keep.to_vec(), self.exploring(&from))
    }

    /// The combination with each of its effects in turn replaced by its kin, in every form, from where it stands, where that
    /// leaves less: an effect may have found its size under a wrong law, or on the wrong side of the coupling.
    #[must_use]
    pub fn among_kin(&self, combination: Tested) -> Tested {
        let mut best = combination;
        for i in 0..best.effects.len() {
            let replaced = self.kin(&best, i).into_iter().min_by(|a, b| a.fitted.chi2.total_cmp(&b.fitted.chi2));
            if let Some(replaced) = replaced.filter(|r| r.fitted.chi2 < best.fitted.chi2) {
                best = replaced;
            }
        }
        best
    }

    /// The combination with one of its effects replaced by each of its kin in its best form, from where it stands.
    #[must_use]
    pub fn kin(&self, combination: &Tested, at: usize) -> Vec<Tested> {
        let (effect, _) = combination.effects[at];
        let known = combination.ids();
        let kin = self.suspects.iter().copied().filter(|k| effect.is_kin_of(*k) && !known.contains(&k.info().id));
        let kin: Vec<Effect> = kin.collect();
        kin.into_par_iter()
            .filter_map(|kin| {
                let forms = (0..kin.info().variants.len()).into_par_iter();
                let forms = forms.map(|form| self.replaced(combination, at, (kin, form), WAY_OF_KIN)).collect();
                simplest_of(forms, self.data.values() as f64)
            })
            .collect()
    }

    /// The combination with each of its effects in turn in the form that suits it best, from where it stands.
    #[must_use]
    pub fn in_best_forms(&self, combination: Tested) -> Tested {
        let mut best = combination;
        for i in 0..best.effects.len() {
            let (effect, form) = best.effects[i];
            let others = (0..effect.info().variants.len()).filter(|other| *other != form);
            let mut forms: Vec<Tested> = others.map(|other| self.replaced(&best, i, (effect, other), WAY)).collect();
            forms.push(best.clone());
            best = simplest_of(forms, self.data.values() as f64).unwrap_or(best);
        }
        best
    }

    /// A combination with one of its effects replaced by a form of its kin, or of itself, from where it stands; given up
    /// where it is no rival after so many steps.
    fn replaced(&self, combination: &Tested, at: usize, (kin, form): (Effect, usize), way: usize) -> Tested {
        let (effect, _) = combination.effects[at];
        let mut model = combination.fitted.model;
        model.effects = inherited(&model.effects, effect, kin, &kin.info().variants[form], &self.nominal.effects);
        let mut effects = combination.effects.clone();
        effects[at] = (kin, form);
        let from = Fitted { model, ..combination.fitted.clone() };
        let effort = self.exploring(&from).unless(WAY, ASTRAY * from.chi2).unless(way, NO_RIVAL * from.chi2);
        self.refit(&from, effects, effort)
    }

    /// What is free when these effects are on.
    #[must_use]
    pub fn free(&self, effects: &[(Effect, usize)]) -> Vec<Free> {
        let mut free = self.base();
        for (e, v) in effects {
            free.extend(e.info().variants[*v].free.iter().map(|i| Free::Effect(*e, *i)));
        }
        free
    }

    /// Fits a combination from where another fit stands; near the floor, to where its likelihood can be compared.
    #[must_use]
    pub fn refit(&self, from: &Fitted, effects: Vec<(Effect, usize)>, effort: Effort) -> Tested {
        let tested = self.test(&from.model, &self.free(&effects), &from.initial, effects, effort);
        let compared = tested.fitted.chi2 < COMPARED * self.data.values() as f64;
        if compared { self.closely(&tested) } else { tested }
    }

    /// The effort of a fit that takes a hypothesis to its minimum as far as it does not crawl.
    #[must_use]
    pub fn exploring(&self, from: &Fitted) -> Effort {
        Effort::exploring(FULL, self.misfit(from.chi2))
    }

    /// A fit taken on from where it stands, to where likelihoods can be compared.
    #[must_use]
    pub fn closely(&self, from: &Tested) -> Tested {
        let effort = Effort::to_the_end(FULL, self.misfit(from.fitted.chi2));
        self.test(&from.fitted.model, &self.free(&from.effects), &from.fitted.initial, from.effects.clone(), effort)
    }
}

/// The settings with an effect replaced by a form of its kin, or of itself, that takes over what the two share and the form
/// frees; the rest as in `off`.
#[must_use]
pub fn inherited(settings: &Settings, from: Effect, to: Effect, form: &Variant, off: &Settings) -> Settings {
    let mut s = *settings;
    for effect in [from, to] {
        s.of_mut(effect).copy_from_slice(off.of(effect));
    }
    for (i, j) in from.shared(to).filter(|(_, j)| form.free.contains(j)) {
        s.of_mut(to)[j] = settings.of(from)[i];
    }
    s
}

/// Share of the excess over the simplest form's that a richer form must take away to be preferred.
const MATERIAL: f64 = 0.02;

/// Of forms that close the gap alike, the one with the fewest free parameters; None if none could be fitted.
#[must_use]
pub fn simplest_of(mut forms: Vec<Tested>, values: f64) -> Option<Tested> {
    forms.retain(|t| t.fitted.chi2.is_finite());
    forms.sort_by_key(|t| t.freedom);
    let best = forms.iter().map(|t| t.fitted.chi2).fold(f64::INFINITY, f64::min);
    let mut chosen = forms.first()?;
    for form in &forms {
        let gain = chosen.fitted.chi2 - form.fitted.chi2;
        let excess = (chosen.fitted.chi2 - values).max(best * 1e-3);
        let extra = form.freedom.saturating_sub(chosen.freedom) as f64;
        // More freedom must pay its price, and close a material share of what was left.
        if gain > extra * values.ln() * (best / values).max(1.0) && gain > MATERIAL * excess {
            chosen = form;
        }
    }
    Some(chosen.clone())
}
