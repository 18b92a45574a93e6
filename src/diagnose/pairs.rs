//! Two effects looked for at once: screened together, looked at, fitted, each in its best form.

use rayon::prelude::*;

use super::screen::Screen;
use super::search::{NO_RIVAL, Search, Tested};

/// Pairs that are fitted at all: the best by the regression,
const LOOKED_AT: usize = 8;
/// of which so many are looked at before what they leave is compared with what the others promise.
const BATCH: usize = 4;
/// Pairs whose fits are taken to the end, at most.
const FINALISTS: usize = 4;

impl Search<'_> {
    /// Pairs of effects of the library, best first: from the nominal parameters and the motion as measured; `none`, the fit
    /// of the parameters alone, says what each must come below.
    #[must_use]
    pub fn two(&self, none: &Tested, progress: &(dyn Fn(&str) + Sync)) -> Vec<Tested> {
        progress("two effects at once");
        let initial = self.initial();
        let screen = Screen::new(&self.nominal, self.data, &initial, &self.states, &[]);
        let pairs = screen.pairs(&self.applicable(), LOOKED_AT);
        let mut glances: Vec<Tested> = Vec::new();
        for batch in pairs.chunks(BATCH) {
            let best = glances.iter().map(|t| t.fitted.chi2).fold(f64::INFINITY, f64::min);
            if batch[0].second.chi2 > self.bar(best, 1) {
                break;
            }
            glances.par_extend(batch.par_iter().map(|pair| {
                let (first, variant) = pair.first;
                progress(first.info().id);
                let mut alone = none.clone();
                alone.effects.push((first, variant));
                // What the parameters alone make of the initial states is as far off as they are.
                alone.fitted.initial.clone_from(&initial);
                self.glance(&alone, &pair.second)
            }));
        }
        glances.retain(|t| t.fitted.chi2.is_finite());
        glances.sort_by(|a, b| a.fitted.chi2.total_cmp(&b.fitted.chi2));
        let best = glances.first().map_or(f64::INFINITY, |t| t.fitted.chi2);
        glances.retain(|t| t.fitted.chi2 <= self.near(best));
        glances.truncate(FINALISTS);
        let mut tested: Vec<Tested> = glances
            .into_par_iter()
            .map(|glance| {
                let refitted = self.refit(&glance.fitted, glance.effects.clone(), self.exploring(&glance.fitted));
                if refitted.fitted.chi2.is_finite() { refitted } else { glance }
            })
            .collect();
        let best = tested.iter().map(|t| t.fitted.chi2).fold(f64::INFINITY, f64::min);
        tested = tested
            .into_par_iter()
            .map(|t| if t.fitted.chi2 <= NO_RIVAL * best { self.in_best_forms(t) } else { t })
            .collect();
        tested.retain(|t| t.fitted.chi2.is_finite() && self.is_genuine(t));
        tested.sort_by(|a, b| a.fitted.chi2.total_cmp(&b.fitted.chi2));
        tested
    }
}
