//! Sines that are not known beforehand: cyclic errors along X and Y by their pitch, and vibration by its frequency.
//!
//! Each is the one that takes most out of the residual, found by a scan of `R(f) = max over a, b of |r|^2 - |r - a*u - b*v|^2`
//! over the frequency (a periodogram with unlike weights, Scargle, Astrophysical Journal 263, 1982), and counts when it
//! stands out of the R of its neighbours by more than chance allows.

use std::f64::consts::TAU;

use super::Point;
use super::shapes::{Axis, Shape};

/// Chance of a tone where there is none.
const FALSE_ALARM: f64 = 1e-5;
/// Fewest cycles over the diameter: what is longer is scale and straightness.
const FEWEST_CYCLES: f64 = 3.0;
/// Most cycles over the diameter that are looked for.
const MOST_CYCLES: f64 = 400.0;
/// Fewest cycles of a vibration to the turn, above the shapes of the machine.
const FEWEST_LINES: f64 = 12.0;
/// Most of them.
const MOST_LINES: f64 = 2000.0;
/// Step of both scans, a quarter of the width of a line.
const STEP: f64 = 0.25;
/// Lines to either side whose median is what chance gives.
const AROUND: usize = 60;
/// Lines about the peak that belong to it.
const OWN: usize = 8;

/// A tone that was found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Tone {
    /// A sine of the position along an axis: cycles over the radius.
    Cyclic(Axis, f64),
    /// A sine of the angle, in all turns with a phase of its own: cycles to the turn.
    Line(f64),
}

impl Tone {
    /// Its shapes.
    pub fn shapes(self, turns: usize) -> Vec<Shape> {
        match self {
            Self::Cyclic(axis, f) => vec![Shape::Cyclic(axis, f, true), Shape::Cyclic(axis, f, false)],
            Self::Line(f) => (0..turns).flat_map(|t| [Shape::Line(t, f, true), Shape::Line(t, f, false)]).collect(),
        }
    }
}

/// The residual at the points in use.
pub(super) struct Scan<'a> {
    used: Vec<(&'a Point, f64)>,
    turns: usize,
    /// Fewest points of a turn.
    per_turn: f64,
}

impl<'a> Scan<'a> {
    pub fn new(points: &'a [Point], keep: &[bool], residual: &[f64]) -> Self {
        let used = points.iter().zip(keep).zip(residual).filter(|((_, k), _)| **k).map(|((p, _), r)| (p, *r)).collect();
        let turns = points.iter().map(|p| p.turn + 1).max().unwrap_or(0);
        let count = |t: usize| points.iter().filter(|p| p.turn == t).count();
        let per_turn = (0..turns).map(count).min().unwrap_or(0) as f64;
        Self { used, turns, per_turn }
    }

    /// The tone that takes most out of the residual, where it is more than chance; `known` are not found again.
    pub fn strongest(&self, known: &[Tone]) -> Option<Tone> {
        // Along an axis the angle passes at most 2*pi*f*R, f in cycles over the radius: four points to the cycle there.
        let cycles = (0.5 * FEWEST_CYCLES, (0.5 * MOST_CYCLES).min(self.per_turn / (4.0 * TAU)));
        let lines = (FEWEST_LINES, MOST_LINES.min(self.per_turn / 4.0));
        let apart = |tone: Tone| {
            known.iter().all(|k| match (tone, *k) {
                (Tone::Cyclic(a, f), Tone::Cyclic(b, g)) => a != b || (f - g).abs() > 0.5,
                (Tone::Line(f), Tone::Line(g)) => (f - g).abs() > 1.0,
                _ => true,
            })
        };
        let x = self.family(cycles, 0.5 * STEP, &|f| Tone::Cyclic(Axis::X, f), &apart);
        let y = self.family(cycles, 0.5 * STEP, &|f| Tone::Cyclic(Axis::Y, f), &apart);
        let line = self.family(lines, STEP, &Tone::Line, &apart);
        [x, y, line].into_iter().flatten().max_by(|a, b| a.1.total_cmp(&b.1)).map(|(tone, _)| tone)
    }

    /// The tone moved to the top of R nearby.
    pub fn at_maximum(&self, tone: Tone) -> Tone {
        match tone {
            Tone::Cyclic(axis, f) => Tone::Cyclic(axis, self.refined(f, 0.5 * STEP, &|f| Tone::Cyclic(axis, f))),
            Tone::Line(f) => Tone::Line(self.refined(f, STEP, &Tone::Line)),
        }
    }

    /// The strongest of one family, with what it takes out.
    fn family(
        &self,
        (low, high): (f64, f64),
        step: f64,
        tone: &dyn Fn(f64) -> Tone,
        apart: &dyn Fn(Tone) -> bool,
    ) -> Option<(Tone, f64)> {
        if high <= low {
            return None;
        }
        let count = ((high - low) / step) as usize + 1;
        let power = self.powers(tone(low), step, count);
        let at = |k: usize| low + step * k as f64;
        let best = (0..count).filter(|k| apart(tone(at(*k)))).max_by(|a, b| power[*a].total_cmp(&power[*b]))?;
        let around = best.saturating_sub(AROUND)..(best + AROUND + 1).min(count);
        let mut others: Vec<f64> = around.filter(|k| k.abs_diff(best) > OWN).map(|k| power[k]).collect();
        others.sort_by(f64::total_cmp);
        let median = *others.get(others.len() / 2)?;
        // R is distributed as chi-square of two degrees for each turn with a phase of its own; its tail is that of an
        // exponential of the same scale, whose median is ln 2.
        let phases = if matches!(tone(low), Tone::Line(_)) { self.turns as f64 } else { 1.0 };
        let scale = median / (phases - 1.0 + std::f64::consts::LN_2);
        let wanted = scale * (phases + (count as f64 / FALSE_ALARM).ln());
        let f = self.refined(at(best), step, tone);
        let taken = self.power(tone(f));
        (taken > wanted).then(|| (tone(f), taken))
    }

    /// R at the frequency of a tone and so many steps above it.
    fn powers(&self, first: Tone, step: f64, count: usize) -> Vec<f64> {
        // A phasor a point, turned by one step after the other.
        let turned = |f: f64| -> Vec<(f64, f64)> {
            self.used.iter().map(|(p, _)| self.argument(first, f, p).sin_cos()).map(|(s, c)| (c, s)).collect()
        };
        let frequency = match first {
            Tone::Cyclic(_, f) | Tone::Line(f) => f,
        };
        let (mut now, by) = (turned(frequency), turned(step));
        let mut out = Vec::with_capacity(count);
        for _ in 0..count {
            out.push(self.taken(first, &now));
            for (z, w) in now.iter_mut().zip(&by) {
                *z = (z.0 * w.0 - z.1 * w.1, z.0 * w.1 + z.1 * w.0);
            }
        }
        out
    }

    fn power(&self, tone: Tone) -> f64 {
        self.powers(tone, 0.0, 1).first().copied().unwrap_or(0.0)
    }

    fn argument(&self, family: Tone, f: f64, p: &Point) -> f64 {
        match family {
            Tone::Cyclic(axis, _) => TAU * f * axis.along(p),
            Tone::Line(_) => f * p.travel,
        }
    }

    /// R of one frequency, from its phasors.
    fn taken(&self, family: Tone, phasors: &[(f64, f64)]) -> f64 {
        let one = |wanted: Option<usize>| {
            let (mut uu, mut uv, mut vv, mut ur, mut vr) = (0.0, 0.0, 0.0, 0.0, 0.0);
            for ((p, r), (c, s)) in
                self.used.iter().zip(phasors).filter(|((p, _), _)| wanted.is_none_or(|t| p.turn == t))
            {
                let weight = if let Tone::Cyclic(axis, _) = family { axis.along(p) } else { 1.0 };
                let (u, v) = (c * weight, s * weight);
                uu += u * u;
                uv += u * v;
                vv += v * v;
                ur += u * r;
                vr += v * r;
            }
            let det = uu * vv - uv * uv;
            if det <= 1e-9 * uu * vv { 0.0 } else { (vv * ur * ur - 2.0 * uv * ur * vr + uu * vr * vr) / det }
        };
        match family {
            Tone::Cyclic(..) => one(None),
            Tone::Line(_) => (0..self.turns).map(|t| one(Some(t))).sum(),
        }
    }

    /// The frequency of the top near `f`, by golden section.
    fn refined(&self, f: f64, step: f64, tone: &dyn Fn(f64) -> Tone) -> f64 {
        const GOLDEN: f64 = 0.618_033_988_749_894_8;
        let (mut a, mut b) = (f - step, f + step);
        let (mut c, mut d) = (b - GOLDEN * (b - a), a + GOLDEN * (b - a));
        let (mut at_c, mut at_d) = (self.power(tone(c)), self.power(tone(d)));
        for _ in 0..40 {
            if at_c > at_d {
                (b, d, at_d) = (d, c, at_c);
                c = b - GOLDEN * (b - a);
                at_c = self.power(tone(c));
            } else {
                (a, c, at_c) = (c, d, at_d);
                d = a + GOLDEN * (b - a);
                at_d = self.power(tone(d));
            }
        }
        0.5 * (a + b)
    }
}
