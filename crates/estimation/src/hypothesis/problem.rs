//! A record in its band, and what a model lacks along it.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, OnceLock};

use rustfft::FftPlanner;

use super::descent::{Along, differ, looser};
use super::discrepancy::Discrepancy;
use super::fit::{Fit, Term};
use super::inverse_dynamics::InverseDynamics;
use super::likelihood::{Band, MotionSpectra, TorqueResidual};
use super::model::{BaseParameter, Free, Model};
use super::scales::Scales;
use super::tracking::{Bandwidth, Resolution, Tracked, steps_per_sample_at, track, track_step_by_step};
use super::trajectory::Trajectory;
use crate::axis::Structure;
use crate::conditioning::Record;

/// Turn of a motion in a sample, rad, up to which a model can be held to it.
pub const HELD: f64 = 0.5;

thread_local! { pub(super) static PLANNER: std::cell::RefCell<FftPlanner<f64>> = std::cell::RefCell::new(FftPlanner::new()); }

/// A record in its band, to which hypotheses are fitted.
#[derive(Clone)]
pub struct Problem<'a> {
    pub record: &'a Record,
    pub band: &'a Band,
    pub nominal: Model,
    /// Range of theta1 and theta2 over the record, and its length: what a period is told by.
    pub range: [f64; 2],
    /// Speeds of motor and table, rad/s, by which effects are stepped.
    pub(super) speeds: [f64; 2],
    /// Largest torque of the log, N.m: in its band a torque that jumps overshoots.
    pub peak: f64,
    pub scales: Option<Scales>,
    /// Spectra of the measured motion; `None` where it is not measured whole.
    pub(super) motion: Option<Arc<MotionSpectra>>,
    pub(super) resolution: Resolution,
    /// The run along which models are compared without a simulation of each, where they are.
    pub(super) dynamics: Option<Arc<InverseDynamics>>,
    /// The motion as measured, once it was asked for.
    pub(super) measured: Arc<OnceLock<Option<Arc<InverseDynamics>>>>,
    /// Whether every column is simulated.
    pub(super) exact: bool,
    pub(super) steps: Work,
}

/// How what the free values of a model change is told.
#[derive(Debug, Clone)]
pub enum Columns {
    /// Along the motion of its run.
    Along(Arc<Trajectory>),
    /// Along the motion as measured.
    AsMeasured,
    /// By runs of their own.
    Simulated,
}

/// Steps simulated so far, in one look at a record or in several.
pub type Work = Arc<AtomicU64>;

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
            speeds: record.speeds(),
            peak: largest(&record.torque),
            scales: None,
            motion: band.motion(record).map(Arc::new),
            resolution: Resolution::Full,
            dynamics: None,
            measured: Arc::default(),
            exact: false,
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

    /// The same for looks beside a fit of a rigid axis, along whose motion others are compared, unless that is given or another one than the
    /// axis took. Of two inertias what an effect does to the motion between them is as large as what is left.
    #[must_use]
    pub fn along_the_motion_of(&self, fit: &Fit) -> Self {
        if self.band.motion_is_given() {
            return self.clone();
        }
        let dynamics = || {
            if self.nominal.structure != Structure::Rigid {
                return None;
            }
            let (tracked, trajectory) = self.track_step_by_step(&fit.model, fit.bandwidth)?;
            let measured = self.other_motion(&fit.model, &tracked).map(|(measured, _)| measured);
            let own =
                || InverseDynamics::new(&fit.model, fit.bandwidth, tracked, trajectory, self.record).map(Arc::new);
            measured.or_else(own)
        };
        Self { dynamics: dynamics(), ..self.clone() }
    }

    /// The same, its steps counted with those of other looks.
    #[must_use]
    pub fn counted_in(self, steps: &Work) -> Self {
        Self { steps: steps.clone(), ..self }
    }

    /// The same for fits that are made to their end.
    pub(super) fn exact(&self) -> Self {
        Self { exact: true, ..self.clone() }
    }

    /// The same compared in another band.
    pub(super) fn compared_in<'b>(&'b self, band: &'b Band) -> Problem<'b> {
        Problem { band, ..self.clone() }
    }

    /// Steps simulated so far: of all that runs side by side only once it has ended the same on any number of threads.
    pub fn steps(&self) -> u64 {
        self.steps.load(Ordering::Relaxed)
    }

    /// Steps a sample of one run of a model, which are counted.
    pub(super) fn counted(&self, model: &Model) -> usize {
        let per = steps_per_sample_at(model, self.record, self.speeds, self.resolution);
        let steps = self.record.len() * per;
        self.steps.fetch_add(steps as u64, Ordering::Relaxed);
        per
    }

    /// What a model lacks along the record, in time.
    pub fn track(&self, model: &Model, bandwidth: Bandwidth) -> Option<Tracked> {
        track(model, self.record, bandwidth, self.counted(model))
    }

    pub(super) fn track_step_by_step(&self, model: &Model, bandwidth: Bandwidth) -> Option<(Tracked, Trajectory)> {
        track_step_by_step(model, self.record, bandwidth, self.counted(model))
    }

    /// Motion of a fit along the record, `[theta1, omega1, theta2, omega2]` a sample.
    pub fn motion_of(&self, fit: &Fit) -> Option<Vec<[f64; 4]>> {
        self.lacked(&fit.model, fit.bandwidth).map(|t| t.motion)
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

    /// Largest bandwidth of the feedback, rad/s.
    fn tightest(&self) -> f64 {
        self.band.omega.last().copied().unwrap_or(1.0).min(HELD / self.record.dt)
    }

    /// Bandwidth of the feedback at a discrepancy.
    pub fn bandwidth(&self, s: Discrepancy) -> Bandwidth {
        let r = self.record;
        let high = self.tightest();
        let low = (4.0 / (r.len() as f64 * r.dt)).min(high);
        let inertia = self.nominal.parameters.inertias(self.nominal.structure);
        [0, 1].map(|i| {
            let noise = r.noise[2 * i].max(f64::MIN_POSITIVE);
            (s[i].sqrt() / (inertia[i] * noise)).sqrt().clamp(low, high)
        })
    }

    /// The loosest at which a model that lacks so much follows the record. Far from the noise it is no looser than a weight and a spring hold
    /// the model to a place of their own: else it stands where these ask for the torque that it got, and lacks next to none.
    pub fn loosest(&self, model: &Model, rows: &TorqueResidual) -> Bandwidth {
        let of_noise = self.bandwidth([0.0; 2]);
        if self.band.is_near_the_noise(rows) {
            return of_noise;
        }
        let pull = model.pull();
        [0, 1].map(|i| of_noise[i].max(pull[i].min(self.tightest())))
    }

    /// Whether physics lets the effects be what they are in a model.
    pub fn admits(&self, model: &Model, terms: &[Term]) -> bool {
        self.scales.as_ref().is_none_or(|s| s.admit(self.record, model, terms.iter().map(|t| t.0)))
    }

    /// What a model lacks, beside what hidden inertias began with as it is at a discrepancy.
    pub fn rows(&self, model: &Model, bandwidth: Bandwidth, weighed_at: Option<Discrepancy>) -> Option<TorqueResidual> {
        self.without_simulation(model, weighed_at).map(|(rows, _)| rows).or_else(|| {
            let lacked = self.lacked_by_simulation(model, bandwidth)?;
            Some(self.residual(model, &lacked, weighed_at))
        })
    }

    /// The same, with how what free values change is told.
    pub fn rows_with_columns(
        &self,
        model: &Model,
        bandwidth: Bandwidth,
        weighed_at: Option<Discrepancy>,
    ) -> Option<(TorqueResidual, Columns)> {
        if let Some((rows, dynamics)) = self.without_simulation(model, weighed_at) {
            return Some((rows, Columns::Along(dynamics.trajectory.clone())));
        }
        let is_kept = self.has_columns_along_motion(model);
        let (tracked, own) = if is_kept {
            let (tracked, trajectory) = self.track_step_by_step(model, bandwidth)?;
            (tracked, Columns::Along(Arc::new(trajectory)))
        } else {
            (self.track(model, bandwidth)?, Columns::Simulated)
        };
        let Some((measured, lacked)) = self.other_motion(model, &tracked) else {
            return Some((self.residual(model, &tracked, weighed_at), own));
        };
        let columns = if is_kept { Columns::Along(measured.trajectory.clone()) } else { Columns::AsMeasured };
        Some((self.residual(model, &lacked, weighed_at), columns))
    }

    /// What a model lacks along the motion of another's run, and that, where models are compared so.
    fn without_simulation(
        &self,
        model: &Model,
        weighed_at: Option<Discrepancy>,
    ) -> Option<(TorqueResidual, &InverseDynamics)> {
        let dynamics = self.dynamics.as_deref().filter(|_| InverseDynamics::has_a_place_for(model))?;
        let lacked = dynamics.lacked(model, self.record);
        lacked.is_bounded().then(|| {
            let mut residual = self.residual(model, &lacked, weighed_at);
            if self.band.motion_is_given()
                && let Some(kept) = dynamics.kept(model, self.record)
            {
                let density = |planner: &mut _| self.band.density_of_torques(self.record, &kept, planner);
                residual.acts = PLANNER.with_borrow_mut(density);
            }
            (residual, dynamics)
        })
    }

    /// What a model lacks along the record, in time: along the motion of another's run where models are compared so.
    pub fn lacked(&self, model: &Model, bandwidth: Bandwidth) -> Option<Tracked> {
        match self.dynamics.as_deref().filter(|_| InverseDynamics::has_a_place_for(model)) {
            Some(dynamics) => Some(dynamics.lacked(model, self.record)),
            None => self.lacked_by_simulation(model, bandwidth),
        }
    }

    /// Whether a model is compared along the motion of another's run, whatever bandwidth it would follow the record at.
    pub fn is_without_simulation(&self, model: &Model) -> bool {
        self.dynamics.is_some() && InverseDynamics::has_a_place_for(model)
    }

    pub(super) fn residual(&self, model: &Model, tracked: &Tracked, weighed_at: Option<Discrepancy>) -> TorqueResidual {
        let of =
            |planner: &mut _| self.band.torque_residual(model, &tracked.torque, &tracked.motion, weighed_at, planner);
        PLANNER.with_borrow_mut(of)
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
        let (mut rows, columns) = self.rows_with_columns(model, bandwidth, None)?;
        let s = self.band.discrepancy(&rows);
        self.band.weigh(&mut rows, s);
        let given = self.dynamics.as_ref().filter(|_| self.is_without_simulation(model));
        Some(Along { model: *model, rows, columns, s, bandwidth: given.map_or(bandwidth, |d| d.bandwidth) })
    }
}

/// Whether a position of a model is read late, or behind a filter.
fn reads_late(model: &Model) -> bool {
    let (effects, on) = (&model.effects, model.effects.active());
    [effects.filter(&on), effects.late(&on), effects.late_of_table(&on)].iter().any(|time| *time > 0.0)
}

/// Largest absolute value of a series; zero of an empty one.
pub fn largest(series: &[f64]) -> f64 {
    series.iter().fold(0.0, |most, v| v.abs().max(most))
}
