//! Where a fit of an effect starts: the shapes on the record's scales, the sizes by linear regression on what the model lacks.

use std::sync::{Arc, Mutex, PoisonError};

use super::candidate::Candidate;
use super::descent::{Descent, First};
use super::discrepancy::Discrepancy;
use super::fit::{Fit, PROBE, Term};
use super::likelihood::{C, Spectra, Weight};
use super::model::Model;
use super::problem::Problem;
use super::scales::Scales;
use super::tracking::Torques;
use super::trajectory::Trajectory;

use crate::axis::Structure;
use crate::effects::{EFFECTS, Effect, Place, Role, Scale, Settings, Start};
use crate::trace::numerics::dot;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use rustfft::FftPlanner;

/// A start with the gain in log likelihood that the regression promises.
#[derive(Clone)]
pub struct StartPoint {
    pub term: Term,
    /// The shapes that it was looked at with.
    shapes: Settings,
    pub model: Model,
    pub gain: f64,
    /// What it changes, of any size.
    pub candidate: Arc<Candidate>,
}

/// A fit beside which effects are looked for: along the motion as measured, stepped coarsely.
pub struct Screening<'a> {
    problem: Problem<'a>,
    /// The fit's motion, along which shapes are ranked, of two inertias.
    trajectory: Option<Trajectory>,
    /// The fit, along the motion as measured.
    pub fit: Fit,
    regression: Regression,
    /// What each effect changed, where it was looked at: its forms begin alike.
    looked_at: Vec<Mutex<Looks>>,
}

/// Spectra of what a model lacks, by the effects that are on in it; `None` of one that could not be run.
type Looks = Vec<(Settings, Option<Arc<Spectra>>)>;

/// Shapes of one form of an effect that are run of those that rank first along the motion of the fit: the two that are gone on with, and
/// one for what the effect does to the motion.
const RUN: usize = 3;

impl<'a> Screening<'a> {
    /// `None` before the scales of the record are known.
    pub fn of(problem: &Problem<'a>, fit: &Fit) -> Option<Self> {
        let problem = problem.coarse();
        problem.scales.as_ref()?;
        let fit = problem.along_the_record(fit);
        let coupled = problem.nominal.structure == Structure::TwoInertia;
        let followed = || Some(problem.track_step_by_step(&fit.model, fit.bandwidth)?.1);
        let trajectory = coupled.then(followed).flatten();
        let problem = problem.along_the_motion_of(&fit);
        let regression = Regression::new(&problem, &fit);
        let looked_at = EFFECTS.iter().map(|_| Mutex::default()).collect();
        Some(Self { problem, trajectory, fit, regression, looked_at })
    }

    /// The record, stepped coarsely.
    pub fn problem(&self) -> &Problem<'_> {
        &self.problem
    }

    /// Starts of some forms of an effect beside the fit's, of each the best first.
    pub fn starts(&self, effect: Effect, forms: &[usize]) -> Vec<Vec<StartPoint>> {
        let scales = self.problem.scales.as_ref();
        let of = |scales: &Scales| forms.iter().map(|form| self.starts_of(scales, (effect, *form))).collect();
        scales.map_or_else(Vec::new, of)
    }

    /// The best start of one form of an effect.
    pub fn best_start(&self, (effect, form): Term) -> Option<StartPoint> {
        self.starts(effect, &[form]).into_iter().flatten().next()
    }

    /// What the fit's model lacks with other effects of one kind. Shapes that are looked at side by side are unlike, forms are looked at one
    /// after the other: no run is made twice, on any number of threads.
    fn rows(&self, effect: Effect, effects: &Settings) -> Option<Arc<Spectra>> {
        let looks = || self.looked_at[effect as usize].lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, known)) = looks().iter().find(|(known, _)| known == effects) {
            return known.clone();
        }
        let (p, fit) = (&self.problem, &self.fit);
        let model = Model { effects: *effects, ..fit.model };
        let rows = p.rows(&model, fit.bandwidth, Some(fit.rows.weighed_at)).map(|residual| Arc::new(residual.rows));
        looks().push((*effects, rows.clone()));
        rows
    }

    /// The same along the fit's motion, without a run, where the fit's model resists that with `own` torques of the effect.
    fn rows_along(&self, trajectory: &Trajectory, own: &Torques, effect: Effect, effects: &Settings) -> Spectra {
        let fit = &self.fit;
        let model = Model { effects: *effects, ..fit.model };
        let mut rows = self.problem.change_along(trajectory, own, &model, &[effect], 1.0);
        for (rows, own) in rows.iter_mut().zip(&fit.rows.rows) {
            rows.iter_mut().zip(own).for_each(|(r, o)| *r += o);
        }
        rows
    }

    /// A few steps of a fit from a start and a discrepancy, the effect told at place `keep`.
    pub fn fitted(&self, start: &StartPoint, keep: usize, from: Discrepancy) -> Option<Fit> {
        let mut terms = self.fit.terms.clone();
        terms.insert(keep, start.term);
        let coupled = self.problem.nominal.structure == Structure::TwoInertia;
        let first = if coupled && self.fit.coordinates.is_empty() { First::Effects } else { First::Sizes };
        let mut descent = Descent::new(&self.problem, &start.model, &terms, from)?.holding(first);
        descent.run(if self.problem.is_without_simulation(&start.model) { 3 * PROBE } else { PROBE })?;
        Some(descent.done())
    }
}

/// Share of a column's square that the present columns must leave of it for it to say anything of its own.
const COLLINEAR: f64 = 1e-9;

/// Projects the present columns out, and regresses.
struct Regression {
    q: Vec<Vec<f64>>,
    z: Vec<f64>,
    s: [f64; 2],
    weights: Vec<Weight>,
}

impl Regression {
    fn new(p: &Problem<'_>, fit: &Fit) -> Self {
        let s = fit.discrepancy;
        let mut q: Vec<Vec<f64>> = Vec::new();
        for c in &fit.columns {
            let mut v = p.band.whiten(c, &fit.rows.weights, s);
            orthogonalise(&q, &mut v);
            if normalise(&mut v) {
                q.push(v);
            }
        }
        let mut z = p.band.whiten(&fit.rows.rows, &fit.rows.weights, s);
        orthogonalise(&q, &mut z);
        Self { q, z, s, weights: fit.rows.weights.clone() }
    }

    /// Coefficients of columns for the residual torque to vanish, and the gain in log likelihood; negative coefficients where not allowed are dropped.
    fn solve(&self, p: &Problem<'_>, columns: &[[Vec<C>; 2]], signed: &[bool]) -> Option<(Vec<f64>, f64)> {
        let j: Vec<Vec<f64>> = columns
            .iter()
            .map(|c| {
                let mut v = p.band.whiten(c, &self.weights, self.s);
                orthogonalise(&self.q, &mut v);
                v
            })
            .collect();
        let k = j.len();
        let a = DMatrix::from_fn(k, k, |x, y| dot(&j[x], &j[y]));
        let full: Vec<f64> = columns
            .iter()
            .map(|c| {
                let v = p.band.whiten(c, &self.weights, self.s);
                dot(&v, &v)
            })
            .collect();
        for i in 0..k {
            if a[(i, i)].is_nan() || a[(i, i)] <= COLLINEAR * full[i] {
                return None;
            }
        }
        let g = DVector::from_fn(k, |x, _| -dot(&j[x], &self.z));
        let scale: Vec<f64> = (0..k).map(|i| a[(i, i)].sqrt()).collect();
        let m = DMatrix::from_fn(k, k, |x, y| a[(x, y)] / (scale[x] * scale[y]) + if x == y { 1e-9 } else { 0.0 });
        let r = DVector::from_fn(k, |x, _| g[x] / scale[x]);
        let sol = m.cholesky()?.solve(&r);
        let c: Vec<f64> = (0..k).map(|i| sol[i] / scale[i]).collect();
        for i in 0..k {
            if !signed[i] && c[i] <= 0.0 {
                return None;
            }
        }
        let gain = 0.5 * g.dot(&DVector::from_vec(c.clone()));
        Some((c, gain))
    }

    /// Size of one column for the residual torque to vanish, and the gain in log likelihood.
    fn single(&self, p: &Problem<'_>, column: &[Vec<C>; 2]) -> Option<(f64, f64)> {
        let v = p.band.whiten(column, &self.weights, self.s);
        let own = dot(&v, &v) - self.q.iter().map(|q| dot(q, &v).powi(2)).sum::<f64>();
        let along = -dot(&v, &self.z);
        (own > COLLINEAR * dot(&v, &v)).then(|| (along / own, 0.5 * along * along / own))
    }

    fn residual(&self) -> &[f64] {
        &self.z
    }
}

fn orthogonalise(q: &[Vec<f64>], v: &mut [f64]) {
    for _ in 0..2 {
        for u in q {
            let c = dot(u, v);
            for (x, y) in v.iter_mut().zip(u) {
                *x -= c * y;
            }
        }
    }
}
fn normalise(v: &mut [f64]) -> bool {
    let n = dot(v, v).sqrt();
    if n.is_nan() || n <= 1e-150 {
        return false;
    }
    for x in v.iter_mut() {
        *x /= n;
    }
    true
}

/// Frequencies (Hz) at which a side's residual stands out.
fn frequencies(p: &Problem<'_>, reg: &Regression, side: usize) -> Vec<f64> {
    let per = 2 * p.band.equations();
    let eq = if p.band.equations() == 2 { side } else { 0 };
    let power: Vec<f64> = reg.residual().chunks_exact(per).map(|c| c[2 * eq].powi(2) + c[2 * eq + 1].powi(2)).collect();
    peaks(&power, 4)
        .into_iter()
        .filter(|m| *m > 0)
        .map(|m| refine(&power, m) * p.band.omega[1] / std::f64::consts::TAU)
        .collect()
}

fn refine(power: &[f64], m: usize) -> f64 {
    // Two bins of a line share its amplitude.
    let (a, b) = (power[m - 1].sqrt(), power.get(m + 1).copied().unwrap_or(0.0).sqrt());
    let c = power[m].sqrt();
    m as f64 + if b > a { b / (b + c) } else { -a / (a + c) }
}

fn peaks(power: &[f64], most: usize) -> Vec<usize> {
    let mut all: Vec<usize> = (1..power.len())
        .filter(|&i| power[i] >= power[i - 1] && power.get(i + 1).is_none_or(|n| power[i] >= *n))
        .collect();
    all.sort_by(|a, b| power[*b].total_cmp(&power[*a]));
    all.truncate(most);
    all
}

/// Places of the angle that a torque is looked at by, where its periods need no more; and most of them.
const LEAST_PLACES: usize = 1 << 12;
const MOST_PLACES: usize = 1 << 17;

/// Orders (periods per radian over 2 pi: as the effect's own unit, 1/rad) at which the residual is periodic in the angle.
fn orders(p: &Problem<'_>, fit: &Fit, reg: &Regression, side: usize) -> Option<Vec<f64>> {
    let motion = p.motion_of(fit)?;
    let band = p.band;
    let per = 2 * band.equations();
    let eq = if band.equations() == 2 { side } else { 0 };
    let mut z = vec![C::default(); band.n];
    for (m, c) in reg.residual().chunks_exact(per).enumerate() {
        z[m] = C::new(c[2 * eq], c[2 * eq + 1]);
        if m > 0 {
            z[band.n - m] = z[m].conj();
        }
    }
    FftPlanner::new().plan_fft_inverse(band.n).process(&mut z);
    let torque: Vec<f64> = z.iter().zip(&band.taper).map(|(z, taper)| z.re * taper).collect();
    let angle: Vec<f64> = motion.iter().map(|m| m[2 * side]).collect();
    Some(orders_of(&torque, &angle, p.scales.as_ref()?.orders[side]))
}

/// Orders, 1/rad and none above the `largest`, at which a torque is most periodic in an angle, rad, the most periodic first.
fn orders_of(torque: &[f64], angle: &[f64], largest: f64) -> Vec<f64> {
    let low = angle.iter().copied().fold(f64::INFINITY, f64::min);
    let high = angle.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let range = (high - low).max(1e-12);
    // Not faster than the band where the axis is slow, at least half a period over the range.
    let step = std::f64::consts::TAU / (4.0 * range);
    let fastest = (largest / step) as usize;
    // Eight places of the angle to a period of the fastest, however few samples there are: those of a slow part lie close.
    let places = (2 * fastest).clamp(LEAST_PLACES, MOST_PLACES).next_power_of_two();
    let top = fastest.min(places / 2);
    let mut bins = vec![C::default(); 4 * places];
    for (torque, angle) in torque.iter().zip(angle) {
        let at = ((angle - low) / range * (places as f64 - 1.0)) as usize;
        bins[at.min(places - 1)] += torque;
    }
    FftPlanner::new().plan_fft_forward(4 * places).process(&mut bins);
    let power: Vec<f64> = (0..=top).map(|m| if m < 3 { 0.0 } else { bins[m].norm_sqr() }).collect();
    peaks(&power, 4).into_iter().filter(|m| *m > 2).map(|m| m as f64 * step).collect()
}

/// Damping ratios of the modes looked at, and about the best of these: what steel and belts have. The frequencies lie half the
/// half-power width of the first apart.
const COARSE: &[f64] = &[0.03];
const FINE: &[f64] = &[0.005, 0.02, 0.08];
/// Modes that are gone on from.
const MODES: usize = 3;

/// Third inertias on a spring at a side whose torque, along the motion, follows the residual best: inertia, stiffness, damping.
fn modes(p: &Problem<'_>, fit: &Fit, reg: &Regression, side: usize) -> Option<Vec<[f64; 3]>> {
    let motion = p.motion_of(fit)?;
    let side = if p.nominal.structure == Structure::Rigid { 0 } else { side };
    let acceleration = p.band.acceleration(&motion.iter().map(|m| m[2 * side]).collect::<Vec<f64>>());
    let looked_at = |w: f64, ratio: f64| -> Option<(f64, f64, [f64; 3])> {
        let column = p.band.mode_column(side, &acceleration, [1.0, w * w, 2.0 * ratio * w]);
        let (size, gain) = reg.single(p, &column)?;
        (size > 0.0).then_some((gain, w, [size, size * w * w, size * 2.0 * ratio * w]))
    };
    let best_of = |frequencies: Vec<f64>, ratios: &[f64]| -> Vec<(f64, f64, [f64; 3])> {
        frequencies
            .par_iter()
            .filter_map(|&w| ratios.iter().filter_map(|r| looked_at(w, *r)).max_by(|a, b| a.0.total_cmp(&b.0)))
            .collect()
    };
    let [step, fine] = [COARSE, FINE].map(|ratios| 1.0 + ratios[0]);
    let top = 2.0 * p.band.omega.last()?;
    let rungs = (top / p.band.omega[2]).ln() / step.ln();
    let coarse = best_of((0..=rungs as i32).map(|i| top / step.powi(i)).collect(), COARSE);
    let gains: Vec<f64> = coarse.iter().map(|c| c.0).collect();
    let about = (step.ln() / fine.ln()) as i32;
    let refined = peaks(&gains, MODES).into_iter().filter_map(|m| {
        let near = (-about..=about).map(|i| coarse[m].1 * fine.powi(i)).collect();
        best_of(near, FINE).into_iter().max_by(|a, b| a.0.total_cmp(&b.0))
    });
    Some(refined.map(|(.., mode)| mode).collect())
}

impl Screening<'_> {
    /// Starts of one form of an effect beside the fit's, the best first.
    fn starts_of(&self, scales: &Scales, term: Term) -> Vec<StartPoint> {
        let (p, fit, reg) = (&self.problem, &self.fit, &self.regression);
        let (effect, form) = term;
        let info = effect.info();
        let side = info.place.side();
        let free = info.variants[form].free;
        let mut off = fit.model.effects;
        off.of_mut(effect).copy_from_slice(Settings::default().of(effect));
        let mut grid: Vec<Settings> = if effect.is_mode() {
            let with = |mode: [f64; 3]| {
                let mut s = off;
                s.of_mut(effect)[..3].copy_from_slice(&mode);
                s
            };
            modes(p, fit, reg, side).unwrap_or_default().into_iter().map(with).collect()
        } else {
            vec![off]
        };
        let mut order: Vec<usize> = free.to_vec();
        order.sort_by_key(|&i| (info.parameters[i].role == Role::Shape, i));
        for &i in &order {
            let Start::Grid(scale, fractions) = info.parameters[i].start else { continue };
            let found;
            let fractions = match scale {
                Scale::Order => {
                    found = orders(p, fit, reg, side).unwrap_or_default();
                    &found[..]
                }
                Scale::Frequency => {
                    found = frequencies(p, reg, side);
                    &found[..]
                }
                _ => fractions,
            };
            let mut next = Vec::new();
            for s in &grid {
                for &f in fractions {
                    let mut t = *s;
                    let v = scales.value(effect, scale, f);
                    if !(v >= info.parameters[i].min && v <= info.parameters[i].max) {
                        continue;
                    }
                    t.of_mut(effect)[i] = v;
                    next.push(t);
                }
            }
            grid = next;
        }
        let by_run = |s: &Settings| self.rows(effect, s);
        self.starts_at(scales, term, &self.foremost(scales, term, grid), by_run)
    }

    /// The shapes that the fit's motion ranks first, which an effect bends little for the others to come before them; all where it cannot tell.
    fn foremost(&self, scales: &Scales, term: Term, grid: Vec<Settings>) -> Vec<Settings> {
        let is_seen_there = term.0.info().place != Place::Sensor;
        let Some(along) = self.trajectory.as_ref().filter(|_| is_seen_there && grid.len() > RUN) else { return grid };
        let own = along.resisted(&self.fit.model, self.problem.record, [term.0]);
        let rows_of = |s: &Settings| Some(Arc::new(self.rows_along(along, &own, term.0, s)));
        let first = self.starts_at(scales, term, &grid, rows_of);
        if first.len() < RUN { grid } else { first.into_iter().take(RUN).map(|s| s.shapes).collect() }
    }

    /// Starts of a form of an effect at some shapes, the best first.
    fn starts_at(
        &self,
        scales: &Scales,
        term: Term,
        grid: &[Settings],
        rows_of: impl Fn(&Settings) -> Option<Arc<Spectra>> + Sync,
    ) -> Vec<StartPoint> {
        let mut all: Vec<StartPoint> =
            grid.par_iter().filter_map(|s| self.start_at(scales, term, s, &rows_of)).collect();
        all.sort_by(|a, b| b.gain.total_cmp(&a.gain));
        all
    }

    /// The start of a form of an effect at some shapes, its sizes by regression.
    fn start_at(
        &self,
        scales: &Scales,
        term: Term,
        shapes: &Settings,
        rows_of: impl Fn(&Settings) -> Option<Arc<Spectra>>,
    ) -> Option<StartPoint> {
        let (p, fit) = (&self.problem, &self.fit);
        let (effect, _) = term;
        if effect.info().parameters.iter().all(|q| !matches!(q.start, Start::Linear))
            && !scales.admit(p.record, &Model { effects: *shapes, ..fit.model }, std::iter::once(effect))
        {
            return None;
        }
        let candidate = Candidate::new(p, &fit.rows.rows, scales, term, shapes, rows_of)?;
        let (c, gain) = self.regression.solve(p, &candidate.columns, &candidate.signed)?;
        let mut model = fit.model;
        candidate.put(&c, &mut model.effects);
        if !scales.admit(p.record, &model, std::iter::once(effect)) {
            return None;
        }
        Some(StartPoint { term, shapes: *shapes, model, gain, candidate: Arc::new(candidate) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_period_of_the_angle_is_found_that_a_slow_part_shows_however_far_the_axis_goes() {
        // From rest to 300 rad/s in 20 s: 3000 rad, of which an order of one is seen at 100 samples a second up to half of that speed.
        let angle: Vec<f64> = (0..2000).map(|k| 7.5 * (0.01 * f64::from(k)).powi(2)).collect();
        for order in [0.3, 1.0, 7.0] {
            let torque: Vec<f64> = angle.iter().map(|x| (order * x + 0.4).sin()).collect();
            let step = std::f64::consts::TAU / (4.0 * angle[1999]);
            let found = orders_of(&torque, &angle, 10.0);
            assert!((found[0] - order).abs() <= step, "{found:?} {order}");
        }
    }
}
