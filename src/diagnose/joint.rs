//! Two effects at once, by regression: every effect at its best start beside every other at every shape that is tried.
//!
//! One effect fitted alone leans towards what another does, and may end where no partner brings it back from. Along the
//! measured motion both are sized at once, whichever is larger. What a trial has in common with all others is computed
//! once; a pair then costs the solution of one small system.

use std::collections::BTreeMap;

use nalgebra::DMatrix;
use rayon::prelude::*;

use super::response::Column;
use super::screen::{Block, Candidate, Screen, products};
use super::trials::{Trial, is_sine};
use crate::effects::{Effect, Variant};

/// First effects, the best alone, beside which the line of a sine is looked for.
const TONED: usize = 8;
/// Lines of a sine that are first effects.
const LINES: usize = 3;

/// Two effects, sized together.
#[derive(Debug, Clone)]
pub struct Pair {
    /// The one that was there first.
    pub first: (Effect, usize),
    /// The other, with both in its settings.
    pub second: Candidate,
}

/// An effect at a trial.
struct Probe {
    effect: Effect,
    variant: usize,
    trial: Trial,
    block: Block,
}

impl Probe {
    fn form(&self) -> &'static Variant {
        &self.effect.info().variants[self.variant]
    }
}

/// What a pair leaves: the sum of squares, which first, which second.
type Left = (f64, usize, usize);

impl Screen<'_> {
    /// Pairs of different effects, at most `most`, those first that leave least for the freedom they take.
    #[must_use]
    pub fn pairs(&self, suspects: &[Effect], most: usize) -> Vec<Pair> {
        let (firsts, columns) = self.firsts(suspects);
        let seconds = self.seconds(suspects, &firsts, &columns);
        // Products with the columns of every first, side by side.
        let crosses: Vec<(Probe, Vec<DMatrix<f64>>)> = seconds
            .into_par_iter()
            .map(|(effect, variant, trial)| {
                let own = self.columns(effect, &effect.info().variants[variant], &trial);
                let crosses = columns.iter().map(|first| products(first, &own)).collect();
                (Probe { effect, variant, trial, block: self.block(&own) }, crosses)
            })
            .collect();
        let together = |i: usize, j: usize| firsts[i].block.beside(&crosses[j].0.block, &crosses[j].1[i]);
        let left: Vec<Left> = crosses
            .par_iter()
            .enumerate()
            .flat_map_iter(|(j, (second, _))| {
                let others = (0..firsts.len()).filter(|&i| firsts[i].effect != second.effect);
                others.map(|i| (self.solve(&together(i, j)).0, i, j)).collect::<Vec<Left>>()
            })
            .collect();
        let values = self.values() as f64;
        let floor = left.iter().map(|l| l.0 / values).fold(f64::INFINITY, f64::min).max(1.0);
        let price = |&(chi2, i, j): &Left| {
            let freedom = firsts[i].form().free.len() + crosses[j].0.form().free.len();
            chi2 / floor + freedom as f64 * values.ln()
        };
        let mut best: BTreeMap<(Effect, Effect), Left> = BTreeMap::new();
        for l in left.into_iter().filter(|l| l.0.is_finite()) {
            let (a, b) = (firsts[l.1].effect, crosses[l.2].0.effect);
            let known = best.entry((a.min(b), a.max(b))).or_insert(l);
            if price(&l) < price(known) {
                *known = l;
            }
        }
        let mut ranked: Vec<Left> = best.into_values().collect();
        ranked.sort_by(|a, b| price(a).total_cmp(&price(b)));
        ranked
            .into_iter()
            .filter_map(|(_, i, j)| {
                let (first, second) = (&firsts[i], &crosses[j].0);
                let (chi2, x) = self.solve(&together(i, j));
                let (of_first, of_second) = x[self.common.len()..].split_at(columns[i].len());
                let settings = self.resized(self.model.effects, first.effect, first.form(), &first.trial, of_first);
                let settings = self.resized(settings, second.effect, second.form(), &second.trial, of_second);
                let on = settings.is_on(first.effect);
                let second = self.candidate(second.effect, second.variant, &second.trial, settings, chi2, &x);
                second.filter(|_| on).map(|second| Pair { first: (first.effect, first.variant), second })
            })
            .take(most)
            .collect()
    }

    /// Every effect at its best start, a sine at several lines, best first; and the columns of each.
    fn firsts(&self, suspects: &[Effect]) -> (Vec<Probe>, Vec<Vec<Column>>) {
        let mut found: Vec<Candidate> = suspects
            .par_iter()
            .flat_map_iter(|&effect| {
                let most = if is_sine(effect) { LINES } else { 1 };
                let mut starts: Vec<Candidate> =
                    (0..effect.info().variants.len()).flat_map(|v| self.starts(effect, v, most)).collect();
                starts.sort_by(|a, b| a.chi2.total_cmp(&b.chi2));
                starts.truncate(most);
                starts
            })
            .collect();
        found.sort_by(|a, b| a.chi2.total_cmp(&b.chi2));
        found
            .into_iter()
            .map(|Candidate { effect, variant, trial, .. }| {
                let columns = self.columns(effect, &effect.info().variants[variant], &trial);
                (Probe { effect, variant, trial, block: self.block(&columns) }, columns)
            })
            .unzip()
    }

    /// Every effect in every shape that is tried; sines at the lines of their own and at those beside the best of the others.
    fn seconds(&self, suspects: &[Effect], firsts: &[Probe], columns: &[Vec<Column>]) -> Vec<(Effect, usize, Trial)> {
        let (sines, others): (Vec<Effect>, Vec<Effect>) = suspects.iter().partition(|e| is_sine(**e));
        let mut seconds: Vec<(Effect, usize, Trial)> = Vec::new();
        for effect in others {
            for (variant, form) in effect.info().variants.iter().enumerate() {
                seconds.extend(self.scales.trials(effect, form, &[]).into_iter().map(|trial| (effect, variant, trial)));
            }
        }
        seconds.extend(firsts.iter().filter(|f| is_sine(f.effect)).map(|f| (f.effect, f.variant, f.trial.clone())));
        let beside: Vec<(Effect, usize, Trial)> = columns[..TONED.min(columns.len())]
            .par_iter()
            .flat_map_iter(|first| {
                let screen = self.given(first);
                let starts = sines.iter().flat_map(|&sine| {
                    (0..sine.info().variants.len()).flat_map(|v| screen.starts(sine, v, 1)).collect::<Vec<_>>()
                });
                starts.map(|c| (c.effect, c.variant, c.trial)).collect::<Vec<_>>()
            })
            .collect();
        seconds.extend(beside);
        seconds
    }
}

#[cfg(test)]
mod tests {
    use super::super::fit::Data;
    use super::super::model::Model;
    use super::super::record::Record;
    use super::super::states;
    use super::super::windows::cut;
    use super::*;
    use crate::axis::{Hold, Parameters, Scheme, SimulateOptions, Structure, simulate};
    use crate::effects::Settings;

    /// Viscous friction and a load, both on the motor of a stiff ball screw: each alone is best imitated on the table.
    #[test]
    fn the_pair_that_made_the_record_leaves_least() {
        let parameters = Parameters { i1: 1.8e-3, i2: 1.9e-3, b: 0.06, k: 166.0, rho: 1.6e-3 };
        let mut effects = Settings::default();
        effects.of_mut(Effect::ViscousMotor)[0] = 3e-3;
        effects.of_mut(Effect::LoadMotor)[0] = 0.017;
        let (n, dt) = (2048, 6e-4);
        let sine = |k: usize, line: f64| (std::f64::consts::TAU * line * k as f64 / n as f64 + line * line * 0.3).sin();
        let torque: Vec<f64> = (0..n).map(|k| (1..60).map(|l| 0.03 * sine(k, f64::from(l))).sum()).collect();
        let options = SimulateOptions { start: 0.0, dt, hold: Hold::Zoh, scheme: Scheme::Exact, substeps: 1 };
        let trace = simulate(&parameters, Structure::TwoInertia, &effects, [0.0; 4], &torque, &options);
        let noise = 2e-5;
        // No pattern and no randomness: the sine of a square.
        let read =
            |angle: f64, k: usize, seed: f64| angle + noise * 2.0_f64.sqrt() * ((k * k) as f64 * 0.37 + seed).sin();
        let channel = |angle: fn(&crate::effects::Reading<f64>) -> f64, seed: f64| {
            Some(trace.readings.iter().take(n).enumerate().map(|(k, r)| read(angle(r), k, seed)).collect::<Vec<f64>>())
        };
        let record = Record {
            start: 0.0,
            dt,
            hold: Hold::Zoh,
            torque,
            channels: [channel(|r| r.theta1, 0.0), None, channel(|r| r.theta2, 1.0), None],
            noise: [noise, 1.0, noise, 1.0],
        };
        let nominal = Model::new(parameters, Structure::TwoInertia, Settings::default());
        let windows = cut(0..n);
        let states = states::along(&record, &nominal);
        let initial: Vec<_> = windows.iter().map(|w| states.initial(w.begin)).collect();
        let screen = Screen::new(&nominal, Data { record: &record, windows: &windows }, &initial, &states, &[]);
        let suspects = [
            Effect::CoulombTable,
            Effect::ViscousMotor,
            Effect::ViscousTable,
            Effect::LoadMotor,
            Effect::LoadTable,
            Effect::Disturbance,
            Effect::Backlash,
        ];
        let pairs = screen.pairs(&suspects, 3);
        let named = |p: &Pair| {
            let mut both = [p.first.0, p.second.effect];
            both.sort();
            both
        };
        assert_eq!(named(&pairs[0]), [Effect::ViscousMotor, Effect::LoadMotor]);
        let [best, next] = [&pairs[0], &pairs[1]].map(|p| p.second.chi2 / screen.values() as f64);
        assert!(best < 1.1 && next > 2.0 * best, "{best} {next}");
        let found = pairs[0].second.settings;
        assert!((found.of(Effect::LoadMotor)[0] / 0.017 - 1.0).abs() < 0.02, "{:?}", found.of(Effect::LoadMotor));
        assert!((found.of(Effect::ViscousMotor)[0] / 3e-3 - 1.0).abs() < 0.02, "{:?}", found.of(Effect::ViscousMotor));
    }
}
