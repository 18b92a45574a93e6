//! What all shapes leave: stick-slip, where it is larger while an axis creeps.

use std::f64::consts::{FRAC_PI_2, PI};

use super::shapes::Axis;
use super::{Point, wrapped};
use crate::circle::roundness::SHOWN;

const DEG: f64 = PI / 180.0;
/// Half width of the mean that is taken off: what is slower is no stick-slip.
const SLOW: f64 = 3.0 * DEG;
/// Distance from its reversal within which an axis creeps: below 57 % of the feed.
const CREEP: f64 = 35.0 * DEG;
/// Half width of the stretch at 45 degrees where neither does.
const FAST: f64 = 10.0 * DEG;
/// Ratio of the rms values from which on the two are not alike: at 1 % of chance for 30 independent values in each, the
/// F distribution gives 2.4 in the squares.
const UNLIKE: f64 = 1.55;

/// The fast part of the residual in the order of the points.
fn fast(points: &[Point], residual: &[f64]) -> Vec<f64> {
    let mut out = vec![0.0; residual.len()];
    let turns = points.iter().map(|p| p.turn + 1).max().unwrap_or(0);
    for turn in 0..turns {
        let mut order: Vec<usize> = (0..points.len()).filter(|i| points[*i].turn == turn).collect();
        order.sort_by(|a, b| points[*a].travel.total_cmp(&points[*b].travel));
        let mut sums = vec![0.0; order.len() + 1];
        for (k, i) in order.iter().enumerate() {
            sums[k + 1] = sums[k] + residual[*i];
        }
        let (mut from, mut to) = (0, 0);
        for i in &order {
            let at = points[*i].travel;
            while points[order[from]].travel < at - SLOW {
                from += 1;
            }
            while to < order.len() && points[order[to]].travel <= at + SLOW {
                to += 1;
            }
            out[*i] = residual[*i] - (sums[to] - sums[from]) / (to - from) as f64;
        }
    }
    out
}

/// Distance of a point from the nearer reversal of an axis, rad.
fn from_reversal(axis: Axis, p: &Point) -> f64 {
    let at = if axis == Axis::X { 0.0 } else { FRAC_PI_2 };
    let d = wrapped(p.angle - at).abs();
    d.min(PI - d)
}

/// Stick-slip of X and of Y: its rms in m where the axis creeps, and what it is of each point. Zero where the residual is no
/// larger there than between the axes.
pub(super) fn stick_slip(points: &[Point], keep: &[bool], residual: &[f64]) -> [(f64, Vec<f64>); 2] {
    let fast = fast(points, residual);
    let rms = |wanted: &dyn Fn(&Point) -> bool| {
        let part: Vec<f64> =
            points.iter().zip(keep).zip(&fast).filter(|((p, k), _)| **k && wanted(p)).map(|(_, r)| *r).collect();
        (part.iter().map(|r| r * r).sum::<f64>() / part.len().max(1) as f64).sqrt()
    };
    let base = rms(&|p| from_reversal(Axis::X, p) > PI / 4.0 - FAST && from_reversal(Axis::Y, p) > PI / 4.0 - FAST);
    Axis::ALL.map(|axis| {
        let there = rms(&|p| from_reversal(axis, p) < CREEP);
        if there <= UNLIKE * base || there < SHOWN {
            return (0.0, vec![0.0; points.len()]);
        }
        let share = 1.0 - base / there;
        let of =
            |((p, k), r): ((&Point, &bool), &f64)| if *k && from_reversal(axis, p) < CREEP { share * r } else { 0.0 };
        ((there * there - base * base).sqrt(), points.iter().zip(keep).zip(&fast).map(of).collect())
    })
}
