//! The torque that a fit lacks along the record: where it shows, how large it is, and what it looks like.

use super::decision::Decision;
use super::diagnosis::{Remainder, Site};
use super::location::{Location, Residual, along};
use super::prepared::Prepared;
use crate::axis::Structure;
use crate::effects::Place;
use crate::hypothesis::model::Model;
use crate::hypothesis::tracking::Tracked;
use crate::trace::numerics::dot;

/// What a model lacks along the record.
fn lacked(p: &Prepared, model: &Model, bandwidth: [f64; 2]) -> Tracked {
    p.problem(*model).lacked(model, bandwidth).unwrap_or_else(|| Tracked::nothing(p.record.len()))
}

/// The same in the band, and where it shows.
fn shown(p: &Prepared, tracked: &Tracked, structure: Structure) -> ([Vec<f64>; 2], Site) {
    let series = [0, 1].map(|i| p.band.filtered(&tracked.torque[i]));
    let site = where_by_torque(&series, structure == Structure::Rigid);
    (series, site)
}

fn residual(series: &[f64], tracked: &Tracked) -> Residual {
    Residual { r1: series.to_vec(), states: tracked.motion.clone(), ..Residual::default() }
}

/// Where the torque that a model lacks shows along the record.
pub fn located(p: &Prepared, model: &Model, bandwidth: [f64; 2]) -> Location {
    let tracked = lacked(p, model, bandwidth);
    let (series, site) = shown(p, &tracked, model.structure);
    let mut residual = residual(&series[0], &tracked);
    if model.structure == Structure::TwoInertia {
        let [_, r2] = series;
        residual.r2 = r2;
    }
    along(&p.record, &residual, site)
}

/// What the hypothesis decided for leaves, in figures and by its looks.
pub fn remains(p: &Prepared, decision: &Decision) -> Remainder {
    let fit = &decision.chosen;
    let tracked = lacked(p, &fit.model, fit.bandwidth);
    let (series, site) = shown(p, &tracked, fit.model.structure);
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
