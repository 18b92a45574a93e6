//! The radial deviation that each error of the machine draws on a circle.
//!
//! A displacement (dx, dy) of the table at the angle a shows as `d = dx*cos a + dy*sin a`. With s = 1 counter-clockwise and
//! -1 clockwise, X moves with the sign of `-s*sin a` and Y with that of `s*cos a`. Every shape is of size one when its
//! coefficient is one, in the unit that its variant names. Knapp, "Circular Test for Three-Coordinate Measuring Machines and
//! Machine Tools", Precision Engineering 5 (1983), and ISO 230-4, annex B, draw the same shapes.

use super::Point;

/// X or Y.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Axis {
    /// X.
    X,
    /// Y.
    Y,
}

impl Axis {
    /// Both.
    pub const ALL: [Self; 2] = [Self::X, Self::Y];

    /// Its capital letter.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::X => "X",
            Self::Y => "Y",
        }
    }

    /// Position along the axis over the radius.
    pub(super) const fn along(self, p: &Point) -> f64 {
        match self {
            Self::X => p.cos,
            Self::Y => p.sin,
        }
    }

    /// Position along the other axis over the radius.
    pub(super) const fn across(self, p: &Point) -> f64 {
        match self {
            Self::X => p.sin,
            Self::Y => p.cos,
        }
    }

    /// Sign of the axis' speed.
    pub(super) fn direction(self, p: &Point) -> f64 {
        match self {
            Self::X => -p.sense * p.sin.signum(),
            Self::Y => p.sense * p.cos.signum(),
        }
    }
}

/// A known shape.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Shape {
    /// The radius.
    Mean,
    /// The centre along an axis.
    Centre(Axis),
    /// Y leans towards X: `dx = phi*y`; the coefficient is phi*R/2.
    Squareness,
    /// X is longer by a share e and Y shorter by it; the coefficient is e*R.
    Scaling,
    /// X is late by tau behind Y: `dx = v*tau*s*sin a`; the coefficient is v*tau/2.
    Servo,
    /// The table stays behind by half the play; the coefficient is the play at the positive or the negative end.
    Backlash(Axis, bool),
    /// The axis lies to one side of its guide, by the sense of its motion; the coefficient is the play across it.
    Lateral(Axis),
    /// The guide of the axis is a bow; the coefficient is its height over the diameter.
    Straightness(Axis),
    /// A sine of the position along an axis, of so many cycles over the radius and its phase (cosine first).
    Cyclic(Axis, f64, bool),
    /// A sine of the angle, so many to the turn, in one of the turns, and its phase (cosine first).
    Line(usize, f64, bool),
}

impl Shape {
    /// Its deviation at a point where its coefficient is one.
    pub fn at(self, p: &Point) -> f64 {
        match self {
            Self::Mean => 1.0,
            Self::Centre(axis) => axis.along(p),
            Self::Squareness => 2.0 * p.sin * p.cos,
            Self::Scaling => p.cos * p.cos - p.sin * p.sin,
            Self::Servo => 2.0 * p.sense * p.sin * p.cos,
            Self::Backlash(axis, positive) => {
                let along = axis.along(p);
                if (along > 0.0) == positive { -0.5 * axis.direction(p) * along } else { 0.0 }
            }
            Self::Lateral(axis) => 0.5 * axis.direction(p) * axis.across(p),
            Self::Straightness(axis) => axis.along(p) * axis.along(p) * axis.across(p),
            Self::Cyclic(axis, cycles, cosine) => {
                phase(std::f64::consts::TAU * cycles * axis.along(p), cosine) * axis.along(p)
            }
            Self::Line(turn, per_turn, cosine) => {
                if p.turn == turn {
                    phase(per_turn * p.travel, cosine)
                } else {
                    0.0
                }
            }
        }
    }
}

fn phase(angle: f64, cosine: bool) -> f64 {
    if cosine { angle.cos() } else { angle.sin() }
}

/// The shapes that every trace is fitted with. A single direction cannot tell what keeps its sign from what turns with the
/// direction: there the diagonal ellipse is one shape, and play across a guide is not looked for.
pub(super) fn known(both: bool) -> Vec<Shape> {
    let mut all = vec![Shape::Mean, Shape::Centre(Axis::X), Shape::Centre(Axis::Y), Shape::Squareness, Shape::Scaling];
    for axis in Axis::ALL {
        all.extend([Shape::Backlash(axis, true), Shape::Backlash(axis, false), Shape::Straightness(axis)]);
    }
    if both {
        all.extend([Shape::Servo, Shape::Lateral(Axis::X), Shape::Lateral(Axis::Y)]);
    }
    all
}
