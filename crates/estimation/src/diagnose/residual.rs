//! The torque that a fit lacks along the record: where it shows, how large it is, and what it looks like.

use super::diagnosis::{Remainder, Site};
use super::location::{Location, Residual, along};
use super::prepared::Prepared;
use crate::axis::Structure;
use crate::effects::Place;
use crate::hypothesis::fit::Fit;
use crate::hypothesis::model::Model;
use crate::hypothesis::tracking::{Tracked, steps_per_sample, track};
use crate::trace::numerics::dot;

/// What a model lacks along the record, in the band, and where that shows.
fn residual_torque(p: &Prepared, model: &Model, bandwidth: [f64; 2]) -> (Tracked, [Vec<f64>; 2], Site) {
    let tracked = track(model, &p.record, bandwidth, steps_per_sample(model, &p.record))
        .unwrap_or_else(|| Tracked::nothing(p.record.len()));
    let series = [0, 1].map(|i| p.band.filtered(&tracked.torque[i]));
    let site = where_by_torque(&series, model.structure == Structure::Rigid);
    (tracked, series, site)
}

fn residual(series: &[f64], tracked: &Tracked) -> Residual {
    Residual { r1: series.to_vec(), states: tracked.motion.clone(), ..Residual::default() }
}

/// Where the torque that a model lacks shows along the record.
pub fn located(p: &Prepared, model: &Model, bandwidth: [f64; 2]) -> Location {
    let (tracked, series, site) = residual_torque(p, model, bandwidth);
    let mut residual = residual(&series[0], &tracked);
    if model.structure == Structure::TwoInertia {
        let [_, r2] = series;
        residual.r2 = r2;
    }
    along(&p.record, &residual, site)
}

/// What a fit leaves, in figures and by its looks.
pub fn remains(p: &Prepared, fit: &Fit) -> Remainder {
    let (tracked, series, site) = residual_torque(p, &fit.model, fit.bandwidth);
    let shown = &series[usize::from(site == Site::At(Place::Table))];
    Remainder {
        torque_rms: p.band.torque_rms(fit.discrepancy),
        share: p.left(fit),
        noise_multiple: p.band.noise_multiple(&fit.rows),
        site,
        looks: along(&p.record, &residual(shown, &tracked), site).looks,
    }
}

/// Correlation of the two residual torques below which they are one, equal and opposite: in the coupling.
const OPPOSITE: f64 = -0.8;

/// Where residual torques show, without knowing any cause.
fn where_by_torque(series: &[Vec<f64>; 2], rigid: bool) -> Site {
    let [motor, table] = [0, 1].map(|i: usize| dot(&series[i], &series[i]).sqrt());
    if rigid {
        Site::Axis
    } else if dot(&series[0], &series[1]) < OPPOSITE * motor * table {
        Site::At(Place::Coupling)
    } else if table > motor {
        Site::At(Place::Table)
    } else {
        Site::At(Place::Motor)
    }
}
