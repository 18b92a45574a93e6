//! A hypothesis fitted, and its evidence: what the model lacks along the record, and how that changes with every free value.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use rayon::prelude::*;
use rustfft::FftPlanner;

use super::Hypothesis;
use super::descent::{Along, Descent, differ, looser};
use super::discrepancy::Discrepancy;
use super::inverse_dynamics::InverseDynamics;
use super::likelihood::{Band, C, MotionSpectra, TorqueResidual};
use super::model::{BaseParameter, Coordinate, Free, Model};
use super::scales::Scales;
use super::tracking::{Bandwidth, LARGEST, Resolution, Torques, Tracked, parts, track, track_step_by_step};
use super::trajectory::Trajectory;
use crate::axis::Structure;
use crate::conditioning::Record;
use crate::effects::{EFFECTS, Effect, Place, Scale, Start};

/// Prior standard deviation of the logarithm of a nominal parameter.
pub const PRIOR: f64 = 0.5;
/// Largest change of a nominal parameter, in its logarithm: a factor of ten.
const FARTHEST: f64 = 2.3;
/// The same near the data sheet: a tenth. What is further off may be what an effect does; what is held to it exactly makes an effect of its error.
const NEAR: f64 = 0.1;
/// What a form that adds to a nested one costs beside it: as much as an effect of its own, and a little more, so that of two accounts of
/// one thing (an unlike friction either way, a bias) the one by effects of their own is told.
const RICHER: f64 = 2.2;
/// Least degrees of freedom that are counted: with fewer any account follows the record.
const FEWEST: f64 = 0.1;
/// Turn of a motion in a sample, rad, up to which a model can be held to it.
pub const HELD: f64 = 0.5;
/// Cost of an effect in log evidence: one of some fifty.
pub const PRICE: f64 = 4.0;

thread_local! { static PLANNER: std::cell::RefCell<FftPlanner<f64>> = std::cell::RefCell::new(FftPlanner::new()); }

/// Steps of a fit at most.
pub const STEPS: usize = 40;
/// Steps of a fit that is looked at.
pub const PROBE: usize = 5;

/// An effect in one of its forms.
pub type Term = (Effect, usize);

/// A hypothesis fitted.
#[derive(Debug, Clone)]
pub struct Fit {
    /// Its effects and their forms, in the order they were found.
    pub terms: Vec<Term>,
    /// The model at its best.
    pub model: Model,
    /// What was free.
    pub coordinates: Vec<Coordinate>,
    /// Standard error of each free value, in its unit, every value of the record taken as independent.
    pub std: Vec<f64>,
    /// What it lacks.
    pub rows: TorqueResidual,
    /// Columns of the coordinates, not whitened.
    pub columns: Vec<[Vec<C>; 2]>,
    /// Variance of what each equation lacks beyond the noise, (N.m)^2 a sample of the band.
    pub discrepancy: Discrepancy,
    /// Bandwidth at which it followed the record, rad/s.
    pub bandwidth: Bandwidth,
    /// Log likelihood at that discrepancy.
    pub log_likelihood: f64,
    /// Log density of its nominal parameters.
    pub log_prior: f64,
    /// Steps that the fit took.
    pub iterations: usize,
    /// Whether it was made to its end.
    pub converged: bool,
    /// Whether an effect stands where physics would not let it go on to where the record wants it: at the limit where it is another.
    pub at_bound: bool,
}

impl Fit {
    /// What it is a fit of.
    #[must_use]
    pub fn hypothesis(&self) -> Hypothesis {
        match (self.terms.is_empty(), self.coordinates.is_empty()) {
            (true, true) => Hypothesis::NoGap,
            (true, false) => Hypothesis::Parameters,
            _ => Hypothesis::Effects(self.terms.iter().map(|(e, _)| *e).collect()),
        }
    }

    /// Its effects in the order of the list, in whatever forms and however they were found.
    #[must_use]
    pub fn effects(&self) -> Vec<Effect> {
        let mut effects: Vec<Effect> = self.terms.iter().map(|t| t.0).collect();
        effects.sort_unstable();
        effects
    }
}

/// A record in its band, to which hypotheses are fitted.
#[derive(Clone)]
pub struct Problem<'a> {
    pub record: &'a Record,
    pub band: &'a Band,
    pub nominal: Model,
    /// Range of theta1 and theta2 over the record, and its length: what a period is told by.
    pub range: [f64; 2],
    /// Largest torque of the log, N.m: in its band a torque that jumps overshoots.
    pub peak: f64,
    pub scales: Option<Scales>,
    /// Spectra of the measured motion; `None` where it is not measured whole.
    motion: Option<Arc<MotionSpectra>>,
    resolution: Resolution,
    /// The run along which models are compared without a simulation of each, where they are.
    dynamics: Option<Arc<InverseDynamics>>,
    /// Whether every column is simulated.
    exact: bool,
    /// Largest change of a nominal parameter, in its logarithm.
    pub farthest: f64,
    /// Steps simulated so far.
    steps: Arc<AtomicU64>,
}

impl<'a> Problem<'a> {
    /// A record compared in a band, its largest torque that of the log.
    #[must_use]
    pub fn of(record: &'a Record, band: &'a Band, nominal: Model, peak: f64) -> Self {
        Self { peak, ..Self::new(record, band, nominal) }
    }

    /// A record compared in a band.
    #[must_use]
    pub fn new(record: &'a Record, band: &'a Band, nominal: Model) -> Self {
        let range = [0, 1].map(|i: usize| {
            let y = record.channels[2 * i].as_ref().or(record.channels[2 - 2 * i].as_ref());
            y.map_or(1.0, |y| {
                let (low, high) = y.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(*v), h.max(*v)));
                (high - low).max(1e-12)
            })
        });
        Self {
            record,
            band,
            nominal,
            range,
            peak: largest(&record.torque),
            scales: None,
            motion: band.motion(record).map(Arc::new),
            resolution: Resolution::Full,
            dynamics: None,
            exact: false,
            farthest: FARTHEST,
            steps: Arc::default(),
        }
    }
}

impl Problem<'_> {
    /// The same for looks that only rank.
    #[must_use]
    pub fn coarse(&self) -> Self {
        Self { resolution: Resolution::Coarse, ..self.clone() }
    }

    /// The same for looks beside a fit of a rigid axis, along whose motion others are compared. Of two inertias what an effect does to the
    /// motion between them is as large as what is left.
    #[must_use]
    pub fn along_the_motion_of(&self, fit: &Fit) -> Self {
        let dynamics = || {
            if self.nominal.structure != Structure::Rigid {
                return None;
            }
            let (tracked, trajectory) = self.track_step_by_step(&fit.model, fit.bandwidth)?;
            InverseDynamics::new(&fit.model, fit.bandwidth, tracked, trajectory, self.record)
        };
        Self { dynamics: dynamics().map(Arc::new), ..self.clone() }
    }

    /// The same for fits that are made to their end.
    fn exact(&self) -> Self {
        Self { exact: true, ..self.clone() }
    }

    /// The same with the axis' own parameters near those of its data sheet.
    #[must_use]
    pub fn near_the_data_sheet(&self) -> Self {
        Self { farthest: NEAR, ..self.clone() }
    }

    /// Steps simulated so far: of all that runs side by side only once it has ended the same on any number of threads.
    pub fn steps(&self) -> u64 {
        self.steps.load(Ordering::Relaxed)
    }

    /// Counts the steps of one run of a model.
    fn count(&self, model: &Model) {
        let steps = self.record.len() * parts(model, self.record, self.resolution);
        self.steps.fetch_add(steps as u64, Ordering::Relaxed);
    }

    /// What a model lacks along the record, in time.
    pub fn track(&self, model: &Model, bandwidth: Bandwidth) -> Option<Tracked> {
        self.count(model);
        track(model, self.record, bandwidth, self.resolution)
    }

    fn track_step_by_step(&self, model: &Model, bandwidth: Bandwidth) -> Option<(Tracked, Trajectory)> {
        self.count(model);
        track_step_by_step(model, self.record, bandwidth, self.resolution)
    }

    /// Motion of a fit along the record, `[theta1, omega1, theta2, omega2]` a sample.
    pub fn motion_of(&self, fit: &Fit) -> Option<Vec<[f64; 4]>> {
        match &self.dynamics {
            Some(dynamics) => Some(dynamics.motion.clone()),
            None => self.track(&fit.model, fit.bandwidth).map(|t| t.motion),
        }
    }

    pub fn base(&self) -> Vec<Free> {
        BaseParameter::of(self.nominal.structure).iter().map(|p| Free::Base(*p)).collect()
    }

    pub fn free(&self, terms: &[Term]) -> Vec<Free> {
        let mut free = self.base();
        for (e, v) in terms {
            free.extend(e.info().variants[*v].free.iter().map(|i| Free::Effect(*e, *i)));
            free.extend(e.loops().then_some(Free::Loop(*e)));
        }
        free
    }

    /// Bandwidth of the feedback at a discrepancy.
    pub fn bandwidth(&self, s: Discrepancy) -> Bandwidth {
        let r = self.record;
        let p = &self.nominal.parameters;
        let high = self.band.omega.last().copied().unwrap_or(1.0).min(HELD / r.dt);
        let low = (4.0 / (r.len() as f64 * r.dt)).min(high);
        let inertia =
            if p.i2 > 0.0 && self.nominal.structure == Structure::TwoInertia { [p.i1, p.i2] } else { [p.i1 + p.i2; 2] };
        [0, 1].map(|i| {
            let noise = r.noise[2 * i].max(f64::MIN_POSITIVE);
            (s[i].sqrt() / (inertia[i] * noise)).sqrt().clamp(low, high)
        })
    }

    /// What a model lacks, beside what hidden inertias began with as it is at a discrepancy.
    pub fn rows(&self, model: &Model, bandwidth: Bandwidth, weighed_at: Option<Discrepancy>) -> Option<TorqueResidual> {
        self.without_simulation(model, weighed_at).map(|(rows, _)| rows).or_else(|| {
            let tracked = self.track(model, bandwidth)?;
            Some(self.residual(model, &tracked, weighed_at))
        })
    }

    /// The same with the motion that it lacks that along, where columns are told along that.
    pub fn rows_along_motion(
        &self,
        model: &Model,
        bandwidth: Bandwidth,
        weighed_at: Option<Discrepancy>,
    ) -> Option<(TorqueResidual, Option<Arc<Trajectory>>)> {
        if let Some((rows, dynamics)) = self.without_simulation(model, weighed_at) {
            return Some((rows, Some(dynamics.trajectory.clone())));
        }
        if !self.has_columns_along_motion(model) {
            return Some((self.rows(model, bandwidth, weighed_at)?, None));
        }
        let (tracked, trajectory) = self.track_step_by_step(model, bandwidth)?;
        Some((self.residual(model, &tracked, weighed_at), Some(Arc::new(trajectory))))
    }

    /// What a model lacks along the motion of another's run, and that, where models are compared so.
    fn without_simulation(
        &self,
        model: &Model,
        weighed_at: Option<Discrepancy>,
    ) -> Option<(TorqueResidual, &InverseDynamics)> {
        let dynamics = self.dynamics.as_deref().filter(|_| InverseDynamics::has_a_place_for(model))?;
        let torque = dynamics.torque(model, self.record);
        let is_bounded = torque.iter().flatten().all(|t| t.abs() < LARGEST);
        is_bounded.then(|| (self.residual_along(model, &torque, &dynamics.motion, weighed_at), dynamics))
    }

    /// Whether a model is compared along the motion of another's run, whatever bandwidth it would follow the record at.
    pub fn is_without_simulation(&self, model: &Model) -> bool {
        self.dynamics.is_some() && InverseDynamics::has_a_place_for(model)
    }

    fn residual(&self, model: &Model, tracked: &Tracked, weighed_at: Option<Discrepancy>) -> TorqueResidual {
        self.residual_along(model, &tracked.torque, &tracked.motion, weighed_at)
    }

    fn residual_along(
        &self,
        model: &Model,
        torque: &Torques,
        motion: &[[f64; 4]],
        weighed_at: Option<Discrepancy>,
    ) -> TorqueResidual {
        PLANNER.with_borrow_mut(|planner| self.band.torque_residual(model, torque, motion, weighed_at, planner))
    }

    /// Step of a coordinate for its column.
    fn step(&self, c: &Coordinate, model: &Model) -> f64 {
        match c.free {
            Free::Base(_) => 1e-3,
            Free::Loop(_) => 0.1,
            Free::Effect(e, i) => {
                let info = &e.info().parameters[i];
                let value = model.effects.of(e)[i];
                match info.start {
                    Start::Grid(Scale::Order, _) => {
                        0.02 / (value.abs() * self.range[usize::from(e.info().place == Place::Table)]).max(1e-3)
                    }
                    Start::Grid(Scale::Frequency, _) => {
                        0.02 / (std::f64::consts::TAU * value.abs() * self.record.dt * self.record.len() as f64)
                            .max(1e-3)
                    }
                    _ => 1e-2,
                }
            }
        }
    }

    /// What each coordinate changes of what a model lacks. The axis' own parameters act along the motion as measured, which is the model's
    /// own nearly, effects along the model's own where that is kept ([`Self::has_columns_along_motion`]); all else is simulated.
    pub fn columns(&self, at: &Along, coordinates: &[Coordinate]) -> Option<Vec<[Vec<C>; 2]>> {
        let motion = self.motion.as_ref().filter(|_| !has_mode(&at.model));
        (0..coordinates.len())
            .into_par_iter()
            .map(|i| {
                let c = &coordinates[i];
                let x = c.x(&at.model);
                let along = self.column_along_motion(c, at);
                if let (Free::Base(p), Some(motion)) = (c.free, motion)
                    && (along.is_some() || coupling_effects(&at.model).next().is_none() || is_inertia(p))
                {
                    let own = self.band.base_column(p, motion, c.slope(x));
                    return Some(match along {
                        Some(along) => sum(&own, &along),
                        None => own,
                    });
                }
                if along.is_some() {
                    return along;
                }
                let h = self.step_within(c, &at.model);
                let moved = self.rows(&moved(&at.model, c, h), at.bandwidth, Some(at.rows.weighed_at))?;
                Some([0, 1].map(|e| moved.rows[e].iter().zip(&at.rows.rows[e]).map(|(a, b)| (a - b) / h).collect()))
            })
            .collect()
    }

    /// What a coordinate changes of what the effects that it is one of resist the model's motion with, where that was kept.
    fn column_along_motion(&self, c: &Coordinate, at: &Along) -> Option<[Vec<C>; 2]> {
        let trajectory = at.trajectory.as_ref().filter(|_| !has_mode(&at.model))?;
        let effects: Vec<Effect> = match c.free {
            Free::Base(p) if is_inertia(p) => Vec::new(),
            Free::Base(_) => coupling_effects(&at.model).collect(),
            Free::Effect(e, _) | Free::Loop(e) => {
                Some(e).filter(|e| e.info().place != Place::Sensor).into_iter().collect()
            }
        };
        if effects.is_empty() {
            return None;
        }
        let h = self.step_within(c, &at.model);
        let mut change = trajectory.resisted(&moved(&at.model, c, h), effects.iter().copied());
        for (change, own) in change.iter_mut().zip(trajectory.resisted(&at.model, effects)) {
            change.iter_mut().zip(own).for_each(|(c, o)| *c -= o);
        }
        Some(PLANNER.with_borrow_mut(|planner| self.band.rows(&change, 1.0 / h, planner)))
    }

    /// The step of a coordinate for its column, inside its bounds.
    fn step_within(&self, c: &Coordinate, model: &Model) -> f64 {
        let h = self.step(c, model);
        if c.x(model) + h > c.bounds[1] { -h } else { h }
    }

    /// Whether what effects change is told along the motion of the model itself: in looks, which only rank, and on a rigid axis on the way to
    /// a fit's end. There, and near the noise where the axis has two inertias, what an effect does to the motion is as large as what is left.
    fn has_columns_along_motion(&self, model: &Model) -> bool {
        let is_far = self.nominal.structure == Structure::Rigid || self.resolution == Resolution::Coarse;
        self.motion.is_some() && is_far && !self.exact && !has_mode(model)
    }

    pub fn log_prior(&self, coordinates: &[Coordinate], x: &[f64]) -> f64 {
        coordinates
            .iter()
            .zip(x)
            .map(|(c, x)| match c.free {
                Free::Base(_) => -0.5 * ((x - c.x(&self.nominal)) / PRIOR).powi(2),
                _ => 0.0,
            })
            .sum()
    }

    /// A model that cannot be run along the record lacks all of its torque.
    #[must_use]
    pub fn nothing(&self) -> Fit {
        let mut tracked = Tracked::nothing(self.record.len());
        tracked.torque[0].copy_from_slice(&self.record.torque);
        let rows = self.residual(&self.nominal, &tracked, None);
        let s = self.band.discrepancy(&rows);
        self.unfitted(Along { model: self.nominal, rows, trajectory: None, s, bandwidth: self.bandwidth(s) })
    }

    /// The hypothesis without anything fitted.
    pub fn given(&self, model: &Model) -> Option<Fit> {
        let mut at = self.along(model, self.bandwidth([f64::MAX; 2]))?;
        for _ in 0..2 {
            at = self.along(model, self.bandwidth(at.s))?;
        }
        Some(self.unfitted(at))
    }

    /// A fit with what it lacks along the motion as measured, as far as its discrepancy asks: there effects are looked for, which the
    /// model's own motion may have passed by.
    pub fn along_the_record(&self, fit: &Fit) -> Fit {
        let bandwidth = self.bandwidth(fit.discrepancy);
        let followed = || {
            let at = self.along(&fit.model, bandwidth)?;
            let columns = self.columns(&at, &fit.coordinates)?;
            Some(Fit { discrepancy: at.s, rows: at.rows, columns, bandwidth: at.bandwidth, ..fit.clone() })
        };
        if self.resolution == Resolution::Coarse || differ(bandwidth, fit.bandwidth) {
            followed().unwrap_or_else(|| fit.clone())
        } else {
            fit.clone()
        }
    }

    /// The same model with its parameters free, which have not moved.
    pub fn freed(&self, held: &Fit) -> Option<Fit> {
        let descent = Descent::new(self, &held.model, &held.terms, held.discrepancy)?;
        let columns = descent.columns()?;
        Some(Fit { columns, ..descent.done() })
    }

    fn unfitted(&self, at: Along) -> Fit {
        Fit {
            terms: vec![],
            model: at.model,
            coordinates: vec![],
            std: vec![],
            columns: vec![],
            discrepancy: at.s,
            bandwidth: at.bandwidth,
            log_likelihood: self.band.log_likelihood(&at.rows, at.s),
            log_prior: 0.0,
            rows: at.rows,
            iterations: 0,
            converged: false,
            at_bound: false,
        }
    }

    /// Fits the hypothesis from a start and a discrepancy in at most so many steps.
    pub fn fit(&self, start: &Model, terms: &[Term], from: Discrepancy, effort: usize) -> Option<Fit> {
        let mut descent = Descent::new(self, start, terms, from)?;
        descent.run(effort)?;
        Some(descent.done())
    }

    /// Fits the hypothesis on from where a fit of it ended, to the end: as near to the model's own motion as the record allows.
    pub fn deepen(&self, fit: &Fit) -> Option<Fit> {
        let exact = self.exact();
        let mut descent = Descent::new(&exact, &fit.model, &fit.terms, fit.discrepancy)?;
        descent.run(STEPS)?;
        descent.sharpen(false)?;
        Some(Fit { converged: true, ..descent.done() })
    }

    /// The fit decided for, along the model's own motion as far as that is likelier, with its standard errors. Below the floor of the noise no
    /// verdict changes by it; the parameters do by many standard errors, where an effect is bent and its torque along the measured motion
    /// leans with the noise.
    pub fn finished(&self, fit: &Fit, independent: f64) -> Option<Fit> {
        let exact = self.exact();
        let mut descent = Descent::resumed(&exact, fit);
        descent.sharpen(true)?;
        let std = descent.standard_errors(independent)?;
        Some(Fit { std, converged: fit.converged, at_bound: fit.at_bound, ..descent.done() })
    }

    /// Whether physics lets the effects be what they are in a model.
    pub fn admits(&self, model: &Model, terms: &[Term]) -> bool {
        self.scales.as_ref().is_none_or(|s| s.admit(self.record, model, terms.iter().map(|t| t.0)))
    }

    /// A model along the record, and the discrepancy that it leaves. One that reads its position late swings up where it is held to the record
    /// tightly: it follows at the likeliest bandwidth up to that.
    pub fn along(&self, model: &Model, bandwidth: Bandwidth) -> Option<Along> {
        let mut best = self.along_at(model, bandwidth);
        if !reads_late(model) || self.is_without_simulation(model) {
            return best;
        }
        let least = self.bandwidth([0.0; 2]);
        let log_likelihood = |at: &Along| self.band.log_likelihood(&at.rows, at.s);
        let mut tight = bandwidth;
        while differ(looser(tight, least), tight) {
            tight = looser(tight, least);
            let other = self.along_at(model, tight);
            if let Some(at) = &best
                && other.as_ref().is_none_or(|other| log_likelihood(other) <= log_likelihood(at))
            {
                break;
            }
            best = other;
        }
        best
    }

    fn along_at(&self, model: &Model, bandwidth: Bandwidth) -> Option<Along> {
        let (mut rows, trajectory) = self.rows_along_motion(model, bandwidth, None)?;
        let s = self.band.discrepancy(&rows);
        self.band.weigh(&mut rows, s);
        let given = self.dynamics.as_ref().filter(|_| self.is_without_simulation(model));
        Some(Along { model: *model, rows, trajectory, s, bandwidth: given.map_or(bandwidth, |d| d.bandwidth) })
    }

    /// What an effect costs: one of some fifty, at one of so many lines.
    fn price(&self, (e, v): Term) -> f64 {
        let is_of_line =
            |i: &usize| matches!(e.info().parameters[*i].start, Start::Grid(Scale::Order | Scale::Frequency, _));
        let lines = e.is_mode() || e.info().variants[v].free.iter().any(is_of_line);
        let richer = (0..v).any(|plain| e.info().frees_more(v, plain));
        PRICE * if richer { RICHER } else { 1.0 } - e.info().odds.ln()
            + if lines { (self.band.omega.len() as f64).ln() } else { 0.0 }
    }

    /// Log evidence with `share` of the values independent: Schwarz's, with the term by which a small sample is followed by many parameters
    /// whatever it is of (Hurvich, Tsai, Biometrika 76, 1989).
    pub fn evidence(&self, f: &Fit, share: f64) -> f64 {
        let n = share * self.band.values();
        // How a third inertia swung at first is fitted, too: two values, which are taken out of what is left.
        let swung = 2 * f.terms.iter().filter(|(e, _)| e.is_mode()).count();
        let k = (f.coordinates.len() + swung) as f64;
        share * f.log_likelihood + f.log_prior
            - 0.5 * k * n.ln()
            - k * (k + 1.0) / (n - k - 1.0).max(FEWEST)
            - f.terms.iter().map(|t| self.price(*t)).sum::<f64>()
    }
}

/// Whether a position of a model is read late, or behind a filter.
fn reads_late(model: &Model) -> bool {
    let delay = |e: &Effect| -> Option<f64> {
        let parameter = e.delay_parameter().filter(|_| e.info().place == Place::Sensor)?;
        Some(model.effects.of(*e)[parameter])
    };
    let active = model.effects.active();
    model.effects.filter(&active) > 0.0 || EFFECTS.iter().filter_map(delay).any(|delay| delay > 0.0)
}

/// Whether a third inertia is on: what it began with is taken out of what any change lacks, too.
fn has_mode(model: &Model) -> bool {
    EFFECTS.iter().any(|e| e.is_mode() && model.effects.is_on(*e))
}

/// What makes the coupling pull by more than its twist.
fn coupling_effects(model: &Model) -> impl Iterator<Item = Effect> {
    EFFECTS.iter().copied().filter(|e| e.info().place == Place::Coupling && model.effects.is_on(*e))
}

const fn is_inertia(p: BaseParameter) -> bool {
    matches!(p, BaseParameter::I1 | BaseParameter::I2)
}

/// The model with a coordinate a step further.
fn moved(model: &Model, c: &Coordinate, h: f64) -> Model {
    model.at(std::slice::from_ref(c), &[c.x(model) + h])
}

fn sum(a: &[Vec<C>; 2], b: &[Vec<C>; 2]) -> [Vec<C>; 2] {
    [0, 1].map(|e| a[e].iter().zip(&b[e]).map(|(a, b)| a + b).collect())
}

/// Largest absolute value of a series; zero of an empty one.
pub fn largest(series: &[f64]) -> f64 {
    series.iter().fold(0.0, |most, v| v.abs().max(most))
}

#[cfg(test)]
impl Fit {
    /// A fit of effects that is as likely as told, of a model with its base parameters free.
    pub fn of_likelihood(model: Model, terms: &[Term], log_likelihood: f64) -> Self {
        let base = BaseParameter::of(model.structure);
        let coordinates: Vec<Coordinate> = base.iter().map(|p| Coordinate::new(Free::Base(*p), &model)).collect();
        Self {
            terms: terms.to_vec(),
            model,
            std: vec![0.0; coordinates.len()],
            coordinates,
            rows: TorqueResidual::nothing(),
            columns: Vec::new(),
            discrepancy: [1.0; 2],
            bandwidth: [1.0; 2],
            log_likelihood,
            log_prior: 0.0,
            iterations: 1,
            converged: true,
            at_bound: false,
        }
    }
}
