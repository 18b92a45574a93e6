//! Screening: every effect, at every start its parameters name, by linear regression along the measured motion.

use std::sync::Arc;

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::features;
use super::fit::{Data, predict};
use super::model::{BaseParameter, Model};
use super::parts::linear_parts;
use super::record::Record;
use super::response::{Column, Responder, States, dot, subtract};
use super::tones;
use super::trials::{Scales, Trial, tone};
use super::windows::Initial;
use crate::axis::Parameters;
use crate::effects::{Effect, Place, Role, Scale, Settings, Start, Variant};

/// Prior standard deviation of a relative error of a nominal parameter.
const PRIOR: f64 = 0.3;
/// The same of the size of an effect already found: without what is missing it leans far.
const FOUND: f64 = 1.0;
/// Times its value that a parameter's off must be to be no place to shrink to.
const OUT_OF_REACH: f64 = 1e3;
/// Relative errors of a nominal parameter that a regression may find.
const ERRORS: [f64; 2] = [-0.6, 1.5];
/// Half widths of the parabolas by which a residual torque is seen in a residual position, samples: noise asks for wide
/// ones, a high order for narrow ones.
const WIDTHS: [usize; 3] = [1, 3, 6];
/// Lines of a sine that a periodogram names, alone,
const NAMED: usize = 8;
/// and with another effect among what every hypothesis has.
const NAMED_BESIDE: usize = 3;
/// Part of a step within which two lines are one.
const SAME: f64 = 0.1;

/// An effect at a start that the regression found, and what the regression leaves.
#[derive(Debug, Clone)]
pub struct Candidate {
    /// The effect.
    pub effect: Effect,
    /// Which of its variants.
    pub variant: usize,
    /// Parameters of the axis that it was found with.
    pub parameters: Parameters,
    /// Its parameters, all other effects as in the model under test.
    pub settings: Settings,
    /// Sum of squares that the regression leaves, in units of the noise.
    pub chi2: f64,
    /// Relative changes of the axis' parameters beside it.
    moves: Vec<f64>,
    /// The shapes that it was found at.
    pub(super) trial: Trial,
}

impl Candidate {
    /// A start half as far from off, or twice as large where off is out of reach.
    pub fn shrink(&mut self) {
        for (value, info) in self.settings.of_mut(self.effect).iter_mut().zip(self.effect.info().parameters) {
            if info.role == Role::Size {
                let off_is_far = info.off.abs() > OUT_OF_REACH * value.abs();
                *value = if off_is_far { 2.0 * *value } else { info.off + 0.5 * (*value - info.off) };
            }
        }
    }

    /// The start with the parameters of the axis moved to where the regression has them beside it.
    #[must_use]
    pub fn moved(&self) -> Self {
        let mut moved = self.clone();
        let p = &mut moved.parameters;
        for (value, change) in [&mut p.i1, &mut p.i2, &mut p.b, &mut p.k].into_iter().zip(&self.moves) {
            *value *= 1.0 + change;
        }
        moved
    }
}

/// The regression along one record.
#[derive(Clone)]
pub struct Screen<'a> {
    pub(super) model: &'a Model,
    record: &'a Record,
    states: &'a States,
    responder: Arc<Responder<'a>>,
    residual: Column,
    /// Its sum of squares.
    total: f64,
    /// Columns that every hypothesis has: errors of the nominal parameters, and effects already found.
    pub(super) common: Vec<Column>,
    gram: DMatrix<f64>,
    right: DVector<f64>,
    /// The residual less what the common columns explain.
    remainder: Column,
    /// How many of the common columns are errors of nominal parameters.
    errors: usize,
    pub(super) scales: Arc<Scales>,
    /// Lines of a sine that each of its periodograms names.
    named: usize,
}

/// Products of some columns with those that every hypothesis has, with each other, and with the residual.
#[derive(Debug, Clone)]
pub(super) struct Block {
    common: DMatrix<f64>,
    own: DMatrix<f64>,
    right: DVector<f64>,
}

impl Block {
    /// Two blocks side by side; `cross`: the products of the first one's columns with the second one's.
    pub fn beside(&self, other: &Self, cross: &DMatrix<f64>) -> Self {
        let (n, a, b) = (self.common.nrows(), self.right.len(), other.right.len());
        let mut common = DMatrix::zeros(n, a + b);
        common.columns_mut(0, a).copy_from(&self.common);
        common.columns_mut(a, b).copy_from(&other.common);
        let mut own = DMatrix::zeros(a + b, a + b);
        own.view_mut((0, 0), (a, a)).copy_from(&self.own);
        own.view_mut((a, a), (b, b)).copy_from(&other.own);
        own.view_mut((0, a), (a, b)).copy_from(cross);
        own.view_mut((a, 0), (b, a)).copy_from(&cross.transpose());
        let mut right = DVector::zeros(a + b);
        right.rows_mut(0, a).copy_from(&self.right);
        right.rows_mut(a, b).copy_from(&other.right);
        Self { common, own, right }
    }
}

/// Products of the columns of one list with those of another.
pub(super) fn products(a: &[Column], b: &[Column]) -> DMatrix<f64> {
    DMatrix::from_fn(a.len(), b.len(), |i, j| dot(&a[i], &b[j]))
}

impl<'a> Screen<'a> {
    /// Prepares the regression of what `model` leaves, from its windows' initial states; `found` are its effects that
    /// are refitted beside each candidate.
    ///
    /// A model's own run knows what friction does while it sticks, which the measured motion does not tell: how an
    /// effect found acts is the difference of the runs with and without it.
    #[must_use]
    pub fn new(
        model: &'a Model,
        data: Data<'a>,
        initial: &[Initial],
        states: &'a States,
        found: &[(Effect, usize)],
    ) -> Self {
        let Data { record, windows } = data;
        let responder = Arc::new(Responder::new(model, record, windows));
        let run = |m: &Model| responder.compared(predict(data, m, initial).into_iter().map(|(_, _, reading)| reading));
        let now = run(model);
        let mut residual =
            responder.readings(|k| std::array::from_fn(|c| record.channels[c].as_ref().map_or(0.0, |v| v[k])));
        subtract(&mut residual, &now, 1.0);
        let mut common: Vec<Column> = BaseParameter::of(model.structure)
            .iter()
            .map(|p| responder.torques(&base_torques(*p, model, states)))
            .collect();
        let errors = common.len();
        for &(effect, variant) in found {
            let mut without = *model;
            without.effects.of_mut(effect).copy_from_slice(Settings::default().of(effect));
            let mut whole = now.clone();
            subtract(&mut whole, &run(&without), 1.0);
            common.push(whole);
            let mut alone = Settings::default();
            alone.of_mut(effect).copy_from_slice(model.effects.of(effect));
            let parts = linear_parts(effect, &effect.info().variants[variant], &alone);
            let size = parts.iter().map(|p| p.value.abs()).fold(0.0, f64::max);
            // Its parts may change by themselves, one side of a friction more than the other.
            for part in parts.iter().skip(1) {
                let column = features::column(effect, &part.unit, model, record, states, &responder);
                common.push(column.iter().map(|v| v * size).collect());
            }
        }
        let n = common.len();
        let mut gram = DMatrix::from_fn(n, n, |i, j| dot(&common[i], &common[j]));
        let right = DVector::from_fn(n, |i, _| dot(&common[i], &residual));
        for i in 0..n {
            gram[(i, i)] += if i < errors { PRIOR } else { FOUND }.powi(-2);
        }
        let scales = Scales::new(model, record, states);
        let (remainder, total) = (Column::new(), dot(&residual, &residual));
        let mut screen = Self {
            model,
            record,
            states,
            responder,
            residual,
            total,
            common,
            gram,
            right,
            remainder,
            errors,
            scales: Arc::new(scales),
            named: NAMED,
        };
        screen.remain();
        screen
    }

    /// Orders or frequencies at which an effect's sine would take most of the remainder away; empty if it has none.
    fn tones(&self, effect: Effect, form: &Variant) -> Vec<f64> {
        let info = effect.info();
        let Some((at, scale)) = tone(effect, form) else { return Vec::new() };
        let Some(lines) = self.scales.lines(effect, scale) else { return Vec::new() };
        let side = usize::from(info.place != Place::Motor);
        let angle: Vec<f64> = (0..self.record.len())
            .map(|k| match scale {
                Scale::Frequency => std::f64::consts::TAU * self.record.time(k),
                _ => self.states.motion[k][2 * side],
            })
            .collect();
        let length2 = |line: f64| {
            let mut settings = Settings::default();
            let p = settings.of_mut(effect);
            p[at] = line;
            for i in form.free {
                if info.parameters[*i].name == "amplitude" {
                    p[*i] = 1.0;
                }
            }
            let column = features::column(effect, &settings, self.model, self.record, self.states, &self.responder);
            dot(&column, &column)
        };
        if effect.is_sensor() {
            let adjoint = self.responder.adjoint_of_reading(&self.remainder, 2);
            return lines.strongest(&angle, &adjoint, &length2, self.named);
        }
        let adjoint: Vec<f64> = self.responder.adjoint(&self.remainder).iter().map(|t| t[side]).collect();
        let mut found = lines.strongest(&angle, &adjoint, &length2, self.named);
        let channel = if self.record.channels[2 * side].is_some() { 2 * side } else { 2 - 2 * side };
        for half in WIDTHS {
            let curved = self.responder.along(&self.remainder, channel, |part| tones::curvature(part, half));
            for line in lines.loudest(&angle, &curved, self.named) {
                if found.iter().all(|f| (f - line).abs() > SAME * lines.step) {
                    found.push(line);
                }
            }
        }
        found
    }

    /// Number of compared values.
    pub(super) fn values(&self) -> usize {
        self.residual.len()
    }

    /// The best starts of an effect's variant, best first, at most `most`.
    #[must_use]
    pub fn starts(&self, effect: Effect, variant: usize, most: usize) -> Vec<Candidate> {
        let form = &effect.info().variants[variant];
        let trials = self.scales.trials(effect, form, &self.tones(effect, form));
        let mut found: Vec<Candidate> =
            trials.par_iter().filter_map(|trial| self.regress(effect, variant, form, trial)).collect();
        found.sort_by(|a, b| a.chi2.total_cmp(&b.chi2));
        let mut best: Vec<Candidate> = Vec::new();
        for candidate in found {
            if best.len() == most {
                break;
            }
            if !best.iter().any(|chosen| self.scales.neighbours(effect, &candidate.trial, &chosen.trial)) {
                best.push(candidate);
            }
        }
        best.into_iter().map(|candidate| self.sharpened(candidate, form)).collect()
    }

    /// The candidate with its frequency or order moved off the grid to where the regression leaves least: golden
    /// section between the grid's neighbours. Over a long record half a step of the grid is a phase of a quarter turn.
    fn sharpened(&self, candidate: Candidate, form: &Variant) -> Candidate {
        let Candidate { effect, variant, .. } = candidate;
        let Some((i, line, step)) = self.scales.line(effect, &candidate.trial) else { return candidate };
        let at = |value: f64| {
            let mut moved = candidate.trial.clone();
            moved.settings.of_mut(effect)[i] = value;
            self.regress(effect, variant, form, &moved)
        };
        let left = |line: f64| at(line).map_or(f64::INFINITY, |c| c.chi2);
        let best = at(tones::golden((line - step).max(0.1 * step), line + step, left));
        best.filter(|b| b.chi2 < candidate.chi2).unwrap_or(candidate)
    }

    fn regress(&self, effect: Effect, variant: usize, form: &Variant, trial: &Trial) -> Option<Candidate> {
        let block = self.block(&self.columns(effect, form, trial));
        let (chi2, x) = self.solve(&block);
        let settings = self.resized(self.model.effects, effect, form, trial, &x[self.common.len()..]);
        self.candidate(effect, variant, trial, settings, chi2, &x)
    }

    /// A candidate, if it is on; `x`: the sizes of all columns.
    pub(super) fn candidate(
        &self,
        effect: Effect,
        variant: usize,
        trial: &Trial,
        settings: Settings,
        chi2: f64,
        x: &[f64],
    ) -> Option<Candidate> {
        let moves = x[..self.errors].to_vec();
        let parameters = self.model.parameters;
        let trial = trial.clone();
        settings.is_on(effect).then_some(Candidate { effect, variant, parameters, settings, chi2, moves, trial })
    }

    /// Columns of an effect at a trial: one for each of its linear parts, or of the whole.
    pub(super) fn columns(&self, effect: Effect, form: &Variant, trial: &Trial) -> Vec<Column> {
        let column = |settings: &Settings| {
            features::column(effect, settings, self.model, self.record, self.states, &self.responder)
        };
        let parts = linear_parts(effect, form, &trial.settings);
        let mut columns: Vec<Column> = parts.iter().map(|p| column(&p.unit)).collect();
        if columns.is_empty() {
            columns.push(column(&trial.settings));
            if effect == Effect::FlexibleMode {
                columns.extend(features::free_decay(&trial.settings, self.record, &self.responder));
            }
        }
        columns
    }

    /// The settings with an effect at a trial, its columns as large as the regression has them.
    pub(super) fn resized(
        &self,
        mut settings: Settings,
        effect: Effect,
        form: &Variant,
        trial: &Trial,
        sizes: &[f64],
    ) -> Settings {
        let info = effect.info();
        let parts = linear_parts(effect, form, &trial.settings);
        settings.of_mut(effect).copy_from_slice(trial.settings.of(effect));
        if parts.is_empty() {
            // A factor far off says that the regression cannot tell this size; the grid's own stands.
            let c = Some(sizes[0]).filter(|c| (0.05..=20.0).contains(c)).unwrap_or(1.0);
            trial.rescale(effect, &mut settings, c, &self.scales);
        }
        let p = settings.of_mut(effect);
        for (n, part) in parts.iter().enumerate() {
            let i = part.parameter;
            match info.parameters[i].start {
                Start::Phase => {
                    let amplitude = parts[n - 1].parameter;
                    let (s, c) = (sizes[n], sizes[n - 1]);
                    p[amplitude] = s.hypot(c);
                    p[i] = s.atan2(c);
                }
                Start::Share => {
                    // The size's torque is in both columns.
                    p[form.free[0]] += sizes[n];
                    p[i] = if p[form.free[0]] == 0.0 { 0.0 } else { sizes[n] / p[form.free[0]] };
                }
                _ => p[i] = info.parameters[i].off + sizes[n],
            }
        }
        for (value, info) in p.iter_mut().zip(info.parameters) {
            *value = value.clamp(info.min, info.max);
        }
        settings
    }

    /// The same regression with an effect at a start among what every hypothesis has.
    pub(super) fn given(&self, columns: &[Column]) -> Self {
        let block = self.block(columns);
        let mut screen = Self { named: NAMED_BESIDE, ..self.clone() };
        let (n, m) = (self.common.len(), columns.len());
        screen.common.extend_from_slice(columns);
        screen.gram = self.whole(&block);
        screen.right = DVector::from_fn(n + m, |i, _| if i < n { self.right[i] } else { block.right[i - n] });
        screen.remain();
        screen
    }

    /// Takes what the common columns explain out of the residual.
    fn remain(&mut self) {
        let (_, x) = self.solve(&self.block(&[]));
        self.remainder.clone_from(&self.residual);
        for (column, x) in self.common.iter().zip(&x) {
            subtract(&mut self.remainder, column, *x);
        }
    }

    pub(super) fn block(&self, columns: &[Column]) -> Block {
        Block {
            common: products(&self.common, columns),
            own: products(columns, columns),
            right: DVector::from_fn(columns.len(), |i, _| dot(&columns[i], &self.residual)),
        }
    }

    /// Products of the common columns and a block's with each other.
    fn whole(&self, block: &Block) -> DMatrix<f64> {
        let (n, m) = (self.common.len(), block.right.len());
        let mut gram = DMatrix::zeros(n + m, n + m);
        gram.view_mut((0, 0), (n, n)).copy_from(&self.gram);
        gram.view_mut((0, n), (n, m)).copy_from(&block.common);
        gram.view_mut((n, 0), (m, n)).copy_from(&block.common.transpose());
        gram.view_mut((n, n), (m, m)).copy_from(&block.own);
        gram
    }

    /// Regression on the common columns and these: what is left, and the sizes of all.
    ///
    /// Errors of the nominal parameters stay between [`ERRORS`]: along a measured motion I2, B and K of nothing at all
    /// leave no error of the table, whatever acts on it.
    pub(super) fn solve(&self, block: &Block) -> (f64, Vec<f64>) {
        let (n, m) = (self.common.len(), block.right.len());
        let gram = self.whole(block);
        let mut right = DVector::zeros(n + m);
        right.rows_mut(0, n).copy_from(&self.right);
        right.rows_mut(n, m).copy_from(&block.right);
        let mut held: Vec<(usize, f64)> = Vec::new();
        loop {
            let Some(x) = solve_with_held(&gram, &right, &held) else { return (self.total, vec![0.0; n + m]) };
            let outside = (0..self.errors)
                .map(|i| (i, x[i].clamp(ERRORS[0], ERRORS[1])))
                .filter(|(i, bound)| (x[*i] - bound).abs() > 0.0)
                .max_by(|a, b| (x[a.0] - a.1).abs().total_cmp(&(x[b.0] - b.1).abs()));
            match outside {
                Some(bound) => held.push(bound),
                None => {
                    let chi2 = self.total - 2.0 * right.dot(&x) + (&gram * &x).dot(&x);
                    return (chi2, x.as_slice().to_vec());
                }
            }
        }
    }
}

/// Least squares from its normal equations with some unknowns held at given values; `None` if it has no solution.
fn solve_with_held(gram: &DMatrix<f64>, right: &DVector<f64>, held: &[(usize, f64)]) -> Option<DVector<f64>> {
    let mut x = DVector::zeros(right.len());
    for (i, value) in held {
        x[*i] = *value;
    }
    let free: Vec<usize> = (0..right.len()).filter(|i| held.iter().all(|h| h.0 != *i)).collect();
    let rest = right - gram * &x;
    let scale: Vec<f64> = free.iter().map(|&i| gram[(i, i)].max(1e-300).sqrt()).collect();
    let scaled = DMatrix::from_fn(free.len(), free.len(), |a, b| {
        gram[(free[a], free[b])] / (scale[a] * scale[b]) + if a == b { 1e-12 } else { 0.0 }
    });
    let target = DVector::from_fn(free.len(), |a, _| rest[free[a]] / scale[a]);
    let solution = scaled.cholesky()?.solve(&target);
    for (a, i) in free.iter().enumerate() {
        x[*i] = solution[a] / scale[a];
    }
    Some(x)
}

/// Torques that stand for a relative error of a nominal parameter, along the motion.
fn base_torques(p: BaseParameter, model: &Model, states: &States) -> super::response::Torques {
    let at: Vec<[f64; 2]> = states
        .motion
        .iter()
        .zip(&states.acceleration)
        .map(|(s, a)| {
            let q = &model.parameters;
            match p {
                BaseParameter::I1 => [-q.i1 * a[0], 0.0],
                BaseParameter::I2 => [0.0, -q.i2 * a[1]],
                BaseParameter::B => {
                    let c = q.b * (s[1] - s[3]);
                    [-c, c]
                }
                BaseParameter::K => {
                    let c = q.k * (s[0] - s[2]);
                    [-c, c]
                }
            }
        })
        .collect();
    features::ramps(&at)
}
