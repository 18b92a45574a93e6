//! What the trace of a circular test shows, as ballbar software reports it: every known deviation in its size, and what it
//! takes of the circularity.
//!
//! All deviations are fitted at once, over both directions, and each one's share is what the circularity loses when that
//! one alone is taken out of the trace: shapes that overlap are neither counted twice nor hidden behind one another.
//!
//! Assumptions: one turn a direction at a constant feed; X and Y are the two axes of the circle; deviations are small
//! against the radius, so that they add up in the radial direction.

mod deviation;
mod fit;
mod ranking;
mod remainder;
mod remedy;
mod reversals;
mod shapes;
mod tones;

pub use deviation::{Effect, Kind, Measure};
pub use ranking::{Analysis, analyse};
pub use remedy::{Remedy, remedy};
pub use shapes::Axis;

use std::f64::consts::{PI, TAU};

use super::Path;
use super::roundness::least_squares_centre;

/// One turn of a trace, about the common centre of all turns.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Turn {
    /// Whether it turns clockwise.
    pub clockwise: bool,
    /// Angle from the X axis, rad, in the order of the measurement; -pi to pi.
    pub angle: Vec<f64>,
    /// Distance from the centre less the nominal radius, m.
    pub deviation: Vec<f64>,
}

impl Turn {
    /// `1` counter-clockwise, `-1` clockwise.
    #[must_use]
    pub const fn sense(&self) -> f64 {
        if self.clockwise { -1.0 } else { 1.0 }
    }

    /// The turn as positions about the centre, m.
    #[must_use]
    pub fn path(&self, radius: f64) -> Path {
        let (x, y) = self
            .angle
            .iter()
            .zip(&self.deviation)
            .map(|(a, d)| ((radius + d) * a.cos(), (radius + d) * a.sin()))
            .unzip();
        Path { x, y }
    }
}

/// Turns from positions, about their common least-squares centre; none without a circle to be seen. `clockwise` says how
/// each turns.
#[must_use]
pub fn turns(paths: &[(bool, Path)], radius: f64) -> Option<(Vec<Turn>, (f64, f64))> {
    let join = |f: fn(&Path) -> &Vec<f64>| paths.iter().flat_map(|(_, p)| f(p).iter().copied()).collect();
    let centre = least_squares_centre(&Path { x: join(|p| &p.x), y: join(|p| &p.y) })?;
    let turn = |(clockwise, path): &(bool, Path)| {
        let (angle, deviation) = path
            .x
            .iter()
            .zip(&path.y)
            .map(|(x, y)| (x - centre.0, y - centre.1))
            .map(|(x, y)| (y.atan2(x), x.hypot(y) - radius))
            .unzip();
        Turn { clockwise: *clockwise, angle, deviation }
    };
    Some((paths.iter().map(turn).collect(), centre))
}

/// Circular hysteresis H: the largest radial difference between two turns of unlike directions at one angle, m; none without
/// points (ISO 230-4:1996, 3.3).
#[must_use]
pub fn hysteresis(one: &Turn, other: &Turn) -> Option<f64> {
    let mut sorted: Vec<(f64, f64)> =
        other.angle.iter().map(|a| wrapped(*a)).zip(other.deviation.iter().copied()).collect();
    sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (first, last) = (*sorted.first()?, *sorted.last()?);
    sorted.insert(0, (last.0 - TAU, last.1));
    sorted.push((first.0 + TAU, first.1));
    let at = |angle: f64| {
        let k = sorted.partition_point(|p| p.0 <= angle).clamp(1, sorted.len() - 1);
        let ((a, da), (b, db)) = (sorted[k - 1], sorted[k]);
        if b > a { da + (db - da) * (angle - a) / (b - a) } else { da }
    };
    one.angle.iter().zip(&one.deviation).map(|(a, d)| (d - at(wrapped(*a))).abs()).reduce(f64::max)
}

/// An angle in -pi..pi.
fn wrapped(angle: f64) -> f64 {
    (angle + PI).rem_euclid(TAU) - PI
}

/// One point of the trace with what the shapes need of it.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Point {
    /// Which turn.
    turn: usize,
    /// `1` counter-clockwise, `-1` clockwise.
    sense: f64,
    /// Angle, rad, -pi to pi.
    angle: f64,
    /// Way along the turn in the sense of the angle, rad, without a jump.
    travel: f64,
    sin: f64,
    cos: f64,
    /// Radial deviation, m.
    deviation: f64,
}

fn points(turns: &[Turn]) -> Vec<Point> {
    let mut all = Vec::new();
    for (turn, t) in turns.iter().enumerate() {
        let mut travel = t.angle.first().copied().unwrap_or(0.0);
        for (a, d) in t.angle.iter().zip(&t.deviation) {
            travel += wrapped(a - travel);
            let (sin, cos) = a.sin_cos();
            all.push(Point { turn, sense: t.sense(), angle: wrapped(*a), travel, sin, cos, deviation: *d });
        }
    }
    all
}

#[cfg(test)]
mod tests;
