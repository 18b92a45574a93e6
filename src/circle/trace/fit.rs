//! All shapes at once by least squares, outside of the stretches where an axis has just reversed.
//!
//! `d = A*c + e`, with standard errors that allow for an `e` whose neighbours are alike: the residual is taken as independent
//! between stretches of ten degrees only (cluster-robust covariance, Liang and Zeger, Biometrika 73, 1986).

use std::f64::consts::{PI, TAU};

use nalgebra::{DMatrix, DVector};

use super::Point;
use super::shapes::Shape;

/// Stretches to the turn within which the residual may be of one piece.
const CLUSTERS: usize = 36;

/// The coefficients of the shapes.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Fit {
    pub shapes: Vec<Shape>,
    pub coefficients: Vec<f64>,
    pub errors: Vec<f64>,
}

impl Fit {
    /// Fits the points that `keep` marks; none where they do not determine the shapes.
    pub fn of(points: &[Point], keep: &[bool], shapes: Vec<Shape>) -> Option<Self> {
        let n = shapes.len();
        let turns = points.iter().map(|p| p.turn + 1).max().unwrap_or(0);
        let mut normal = DMatrix::<f64>::zeros(n, n);
        let mut right = DVector::<f64>::zeros(n);
        let mut row = DVector::<f64>::zeros(n);
        let used = || points.iter().zip(keep).filter(|(_, keep)| **keep).map(|(p, _)| p);
        for p in used() {
            for (slot, shape) in row.iter_mut().zip(&shapes) {
                *slot = shape.at(p);
            }
            normal.ger(1.0, &row, &row, 1.0);
            right.axpy(p.deviation, &row, 1.0);
        }
        let inverse = normal.cholesky()?.inverse();
        let coefficients = &inverse * right;
        let mut scores = DMatrix::<f64>::zeros(n, CLUSTERS * turns);
        for p in used() {
            for (slot, shape) in row.iter_mut().zip(&shapes) {
                *slot = shape.at(p);
            }
            let left = p.deviation - row.dot(&coefficients);
            let place = (((p.angle + PI) / TAU * CLUSTERS as f64) as usize).min(CLUSTERS - 1);
            scores.column_mut(p.turn * CLUSTERS + place).axpy(left, &row, 1.0);
        }
        let spread = &inverse * (&scores * scores.transpose()) * &inverse;
        let errors: Vec<f64> = spread.diagonal().iter().map(|v| v.max(0.0).sqrt()).collect();
        let coefficients: Vec<f64> = coefficients.iter().copied().collect();
        coefficients.iter().chain(&errors).all(|v| v.is_finite()).then_some(Self { shapes, coefficients, errors })
    }

    /// The deviation at a point by the shapes that `wanted` selects, m.
    pub fn at(&self, p: &Point, wanted: impl Fn(Shape) -> bool) -> f64 {
        let all = self.shapes.iter().zip(&self.coefficients);
        all.filter(|(s, _)| wanted(**s)).map(|(s, c)| c * s.at(p)).sum()
    }

    /// What all shapes leave of each point.
    pub fn residual(&self, points: &[Point]) -> Vec<f64> {
        points.iter().map(|p| p.deviation - self.at(p, |_| true)).collect()
    }

    /// Coefficient and standard error of a shape; zero without it.
    pub fn of_shape(&self, shape: Shape) -> (f64, f64) {
        let at = self.shapes.iter().position(|s| *s == shape);
        at.map_or((0.0, 0.0), |k| (self.coefficients[k], self.errors[k]))
    }
}
