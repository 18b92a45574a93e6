//! Where an axis reverses: the way across its play, and the spike of its friction.
//!
//! Behind a reversal the deviation goes from the level before to the level after it: what lies between the two is the
//! play being crossed, at once or late; what stands out beyond both is a spike.

use std::f64::consts::{FRAC_PI_2, PI};

use super::fit::Fit;
use super::shapes::{Axis, Shape};
use super::{Point, wrapped};

const DEG: f64 = PI / 180.0;
/// The stretch before a reversal that is left out of the fit: an encoder's or a filter's lag.
const BEFORE: f64 = 1.0 * DEG;
/// The stretch behind it, at the least and at the most.
const LEAST: f64 = 12.0 * DEG;
const MOST: f64 = 25.0 * DEG;
/// Half width of the parabola that smooths a spike.
const SMOOTH: f64 = 0.6 * DEG;
/// Fewest points of it.
const FEWEST: usize = 5;

/// The reversal at +X, +Y, -X or -Y of one turn.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Reversal {
    pub turn: usize,
    /// 0 at +X, 1 at +Y, 2 at -X, 3 at -Y.
    pub quarter: usize,
    /// Width of the stretch behind it, rad.
    pub width: f64,
    /// (point, angle behind the reversal in the sense of the turn), in that order.
    pub members: Vec<(usize, f64)>,
}

impl Reversal {
    pub const fn axis(&self) -> Axis {
        if self.quarter.is_multiple_of(2) { Axis::X } else { Axis::Y }
    }

    const fn positive(&self) -> bool {
        self.quarter < 2
    }

    fn gather(&mut self, points: &[Point]) {
        let behind = |p: &Point| p.sense * wrapped(p.angle - FRAC_PI_2 * self.quarter as f64);
        let mine = points.iter().enumerate().filter(|(_, p)| p.turn == self.turn);
        self.members = mine.map(|(i, p)| (i, behind(p))).filter(|(_, u)| (-BEFORE..self.width).contains(u)).collect();
        self.members.sort_by(|a, b| a.1.total_cmp(&b.1));
    }
}

/// The reversals of all turns, each with the shortest stretch.
pub(super) fn find(points: &[Point], turns: usize) -> Vec<Reversal> {
    let mut all: Vec<Reversal> = (0..turns)
        .flat_map(|turn| (0..4).map(move |quarter| Reversal { turn, quarter, width: LEAST, members: Vec::new() }))
        .collect();
    all.iter_mut().for_each(|r| r.gather(points));
    all
}

/// The points outside of all stretches.
pub(super) fn outside(points: &[Point], reversals: &[Reversal]) -> Vec<bool> {
    let mut keep = vec![true; points.len()];
    for (i, _) in reversals.iter().flat_map(|r| &r.members) {
        keep[*i] = false;
    }
    keep
}

/// Makes each stretch as long as the residual behind it lasts. True where one has grown.
pub(super) fn extend(points: &[Point], residual: &[f64], reversals: &mut [Reversal]) -> bool {
    let keep = outside(points, reversals);
    let mut quiet: Vec<f64> = residual.iter().zip(&keep).filter(|(_, k)| **k).map(|(r, _)| r.abs()).collect();
    quiet.sort_by(f64::total_cmp);
    // The median of the absolute normal deviate is 0.6745 standard deviations.
    let sigma = quiet.get(quiet.len() / 2).map_or(0.0, |m| m / 0.6745);
    let mut grown = false;
    for r in reversals.iter_mut() {
        let before = r.width;
        let mut wide = Reversal { width: MOST, ..r.clone() };
        wide.gather(points);
        // Means over two degrees, from the end of the stretch on, as long as they stand out on one side.
        let mut sign = 0.0;
        while r.width < MOST {
            let part: Vec<f64> = wide
                .members
                .iter()
                .filter(|(_, u)| (r.width - 2.0 * DEG..r.width).contains(u))
                .map(|(i, _)| residual[*i])
                .collect();
            let mean = part.iter().sum::<f64>() / part.len().max(1) as f64;
            if part.len() < 3 || mean.abs() < 3.0 * sigma || mean * sign < 0.0 {
                break;
            }
            sign = mean.signum();
            r.width += 2.0 * DEG;
        }
        grown |= r.width > before;
        r.gather(points);
    }
    grown
}

/// A reversal taken apart.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Parts {
    /// The play's part at each member.
    pub play: Vec<f64>,
    /// The spike at each member, smoothed.
    pub spike: Vec<f64>,
    /// Its height, outward positive.
    pub height: f64,
}

/// Takes the reversal apart, given what all but the play of its axis make of the trace.
pub(super) fn parts(points: &[Point], fit: &Fit, r: &Reversal) -> Parts {
    let shape = Shape::Backlash(r.axis(), r.positive());
    let level = |p: &Point| fit.at(p, |s| s == shape).abs();
    let mut play = Vec::with_capacity(r.members.len());
    let mut beyond = Vec::with_capacity(r.members.len());
    for (i, _) in &r.members {
        let p = &points[*i];
        let local = p.deviation - fit.at(p, |s| s != shape);
        let level = level(p);
        play.push(local.clamp(-level, level));
        beyond.push(local - local.clamp(-level, level));
    }
    let at: Vec<f64> = r.members.iter().map(|(_, u)| *u).collect();
    let spike = smoothed(&at, &beyond);
    let height = spike
        .iter()
        .zip(&at)
        .filter(|(_, u)| **u > 0.0)
        .fold(0.0_f64, |h, (s, _)| if s.abs() > h.abs() { *s } else { h });
    Parts { play, spike, height }
}

/// A parabola through the neighbours of each point (Savitzky and Golay, Analytical Chemistry 36, 1964, at any spacing).
fn smoothed(at: &[f64], values: &[f64]) -> Vec<f64> {
    let n = at.len();
    if n < FEWEST {
        return values.to_vec();
    }
    (0..n)
        .map(|k| {
            let from = at.partition_point(|u| *u < at[k] - SMOOTH).min(k.saturating_sub(FEWEST / 2));
            let to = at.partition_point(|u| *u <= at[k] + SMOOTH).max((k + FEWEST / 2 + 1).min(n));
            let mut m = nalgebra::Matrix3::<f64>::zeros();
            let mut right = nalgebra::Vector3::<f64>::zeros();
            for (u, v) in at[from..to].iter().zip(&values[from..to]) {
                let z = (u - at[k]) / SMOOTH;
                let row = nalgebra::Vector3::new(1.0, z, z * z);
                m += row * row.transpose();
                right += row * *v;
            }
            m.cholesky().map_or(values[k], |c| c.solve(&right)[0])
        })
        .collect()
}
