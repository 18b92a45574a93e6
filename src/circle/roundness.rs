//! Measures of a circle that was followed: circular and radial deviation (ISO 230-4), reversal peaks, ellipses.

use std::f64::consts::{PI, TAU};

use nalgebra::{Matrix3, Vector3};

use super::Path;

/// Smallest length that a circular test shows, m: a nanometre is far below what a ballbar resolves.
pub const SHOWN: f64 = 1e-9;

/// The figures of a circular test, in metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Roundness {
    /// Circular deviation G: the width of the ring about the least-squares centre that holds the path.
    pub deviation: f64,
    /// Least distance from that centre.
    pub low: f64,
    /// Greatest distance from that centre.
    pub high: f64,
    /// Largest radial deviation F about the programmed centre.
    pub largest: f64,
    /// Smallest radial deviation.
    pub smallest: f64,
    /// Mean radial deviation.
    pub mean: f64,
    /// Centre of the least-squares circle.
    pub centre: (f64, f64),
    /// Height of the peak at +X, +Y, -X, -Y, outward positive, over both of the straight lines before and behind it.
    pub reversals: [f64; 4],
    /// Step at +X, +Y, -X, -Y: the line behind, in the sense of the angle, less the line before.
    pub steps: [f64; 4],
    /// Amplitude of the ellipse along the axes: unequal scales.
    pub ellipse_axes: f64,
    /// Amplitude of the ellipse at 45 degrees: unequal loop gains (its sign turns with the direction) or axes that are not
    /// square (its sign does not).
    pub ellipse_diagonal: f64,
}

/// Half width of the stretch in which a reversal's peak is looked for, rad: seven degrees.
const NEAR: f64 = 7.0 * PI / 180.0;
/// Half width of the stretch it is compared with: fifteen degrees.
const AROUND: f64 = 15.0 * PI / 180.0;

/// Angle (rad, -pi..pi) and radial deviation (m) about the programmed centre, in the order of the path.
#[must_use]
pub fn deviations(path: &Path, radius: f64) -> (Vec<f64>, Vec<f64>) {
    path.x.iter().zip(&path.y).map(|(x, y)| (y.atan2(*x), x.hypot(*y) - radius)).unzip()
}

impl Roundness {
    /// The figures of a path about the programmed circle of this radius; none without a circle to be seen.
    #[must_use]
    pub fn of(path: &Path, radius: f64) -> Option<Self> {
        let (angle, deviation) = deviations(path, radius);
        let n = deviation.len() as f64;
        let centre = least_squares_centre(path)?;
        let from_centre = path.x.iter().zip(&path.y).map(|(x, y)| (x - centre.0).hypot(y - centre.1));
        let (low, high) = extremes(from_centre);
        let (smallest, largest) = extremes(deviation.iter().copied());
        let second =
            |f: fn(f64) -> f64| 2.0 / n * angle.iter().zip(&deviation).map(|(a, d)| d * f(2.0 * a)).sum::<f64>();
        let at = [0.0, 0.25, 0.5, 0.75].map(|turn| reversal(&angle, &deviation, TAU * turn));
        Some(Self {
            deviation: high - low,
            low,
            high,
            largest,
            smallest,
            mean: deviation.iter().sum::<f64>() / n,
            centre,
            reversals: at.map(|(peak, _)| peak),
            steps: at.map(|(_, step)| step),
            ellipse_axes: second(f64::cos),
            ellipse_diagonal: second(f64::sin),
        })
    }
}

/// Bi-directional circular deviation G(b): the width of the ring about the least-squares centre of both paths that holds
/// both; none without a circle to be seen.
#[must_use]
pub fn bidirectional(paths: &[Path; 2]) -> Option<f64> {
    let join = |f: fn(&Path) -> &Vec<f64>| paths.iter().flat_map(|p| f(p).iter().copied()).collect();
    let both = Path { x: join(|p| &p.x), y: join(|p| &p.y) };
    let centre = least_squares_centre(&both)?;
    let (low, high) = extremes(both.x.iter().zip(&both.y).map(|(x, y)| (x - centre.0).hypot(y - centre.1)));
    Some(high - low)
}

fn extremes(values: impl Iterator<Item = f64>) -> (f64, f64) {
    values.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)))
}

/// Centre of the circle `x^2 + y^2 = 2*a*x + 2*b*y + c` that fits best (Kasa, IEEE Trans. Instrum. Meas. 25, 1976).
pub(crate) fn least_squares_centre(path: &Path) -> Option<(f64, f64)> {
    let scale = path.x.iter().chain(&path.y).fold(0.0_f64, |m, v| m.max(v.abs()));
    if path.x.len() < 3 || scale <= 0.0 || !scale.is_finite() {
        return None;
    }
    let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
    for (x, y) in path.x.iter().zip(&path.y) {
        let (x, y) = (x / scale, y / scale);
        let row = Vector3::new(2.0 * x, 2.0 * y, 1.0);
        normal += row * row.transpose();
        right += row * (x * x + y * y);
    }
    let fit = normal.cholesky()?.solve(&right);
    Some((fit[0] * scale, fit[1] * scale))
}

/// Peak and step near `at`: what stands within [`NEAR`] outside of both lines through what stands around it, one on each
/// side. The way from one line to the other is no peak, wherever the step is taken.
fn reversal(angle: &[f64], deviation: &[f64], at: f64) -> (f64, f64) {
    let offset = |a: f64| (a - at + PI).rem_euclid(TAU) - PI;
    let line = |behind: bool| -> (f64, f64) {
        let side = angle
            .iter()
            .zip(deviation)
            .map(|(a, d)| (offset(*a), *d))
            .filter(|(a, _)| (NEAR..AROUND).contains(&a.abs()) && (*a > 0.0) == behind);
        let (mut n, mut sa, mut sd, mut saa, mut sad) = (0.0, 0.0, 0.0, 0.0, 0.0);
        for (a, d) in side {
            n += 1.0;
            sa += a;
            sd += d;
            saa += a * a;
            sad += a * d;
        }
        let spread = n * saa - sa * sa;
        if spread <= 0.0 {
            return (0.0, 0.0);
        }
        let slope = (n * sad - sa * sd) / spread;
        ((sd - slope * sa) / n, slope)
    };
    let (before, behind) = (line(false), line(true));
    let over = |a: f64, d: f64| {
        let [one, other] = [before, behind].map(|(base, slope)| d - base - slope * a);
        if one * other <= 0.0 { 0.0 } else { one.signum() * one.abs().min(other.abs()) }
    };
    let near = angle.iter().zip(deviation).map(|(a, d)| (offset(*a), *d)).filter(|(a, _)| a.abs() < NEAR);
    let peak = near.fold(0.0, |peak: f64, (a, d)| if over(a, d).abs() > peak.abs() { over(a, d) } else { peak });
    (peak, behind.0 - before.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn path(f: impl Fn(f64) -> (f64, f64)) -> Path {
        let (x, y) = (0..3600).map(|k| f(TAU * f64::from(k) / 3600.0)).unzip();
        Path { x, y }
    }

    #[test]
    fn a_shifted_circle_is_round_but_off_centre() {
        let r = Roundness::of(&path(|a| (0.05 * a.cos() + 2e-5, 0.05 * a.sin() - 1e-5)), 0.05).expect("a circle");
        assert!(r.deviation < 1e-14, "{r:?}");
        assert!((r.centre.0 - 2e-5).abs() < 1e-14 && (r.centre.1 + 1e-5).abs() < 1e-14);
        assert!((r.largest - 5f64.sqrt() * 1e-5).abs() < 1e-8, "{r:?}");
    }

    #[test]
    fn an_ellipse_is_told_by_its_direction() {
        let r = Roundness::of(&path(|a| ((0.05 + 1e-5) * a.cos(), (0.05 - 1e-5) * a.sin())), 0.05).expect("a circle");
        assert!((r.ellipse_axes - 1e-5).abs() < 1e-8 && r.ellipse_diagonal.abs() < 1e-12, "{r:?}");
        assert!((r.deviation - 2e-5).abs() < 1e-8);
        // Y ahead by an angle d: a diagonal ellipse of amplitude radius*d/2.
        let r = Roundness::of(&path(|a| (0.05 * a.cos(), 0.05 * (a + 4e-4).sin())), 0.05).expect("a circle");
        assert!((r.ellipse_diagonal - 1e-5).abs() < 2e-8 && r.ellipse_axes.abs() < 2e-8, "{r:?}");
    }

    #[test]
    fn a_peak_at_a_reversal_has_its_height() {
        let bump = |a: f64| 6e-6 * (-((a - TAU / 4.0) / 0.03).powi(2)).exp();
        let r =
            Roundness::of(&path(|a| ((0.05 + bump(a)) * a.cos(), (0.05 + bump(a)) * a.sin())), 0.05).expect("a circle");
        assert!((r.reversals[1] - 6e-6).abs() < 1e-8, "{r:?}");
        assert!(r.reversals[0].abs() < 1e-8 && r.reversals[2].abs() < 1e-8);
    }

    #[test]
    fn a_step_at_a_reversal_has_its_height_and_is_no_peak() {
        // Moving towards -X above, towards +X below: the table stays behind by 3 um on either side.
        let behind = |a: f64| if (0.0..TAU / 2.0).contains(&a) { 3e-6 } else { -3e-6 };
        let r = Roundness::of(&path(|a| (0.05 * a.cos() + behind(a), 0.05 * a.sin())), 0.05).expect("a circle");
        // The step's radial part falls with the cosine of the angle, which the lines follow to some per cent.
        assert!((r.steps[0] - 6e-6).abs() < 2e-7 && (r.steps[2] - 6e-6).abs() < 2e-7, "{r:?}");
        assert!(r.reversals[0].abs() < 2e-7 && r.steps[1].abs() < 1e-7, "{r:?}");
        // Taken late, it is still a step and no peak.
        let late = |a: f64| behind((a - 0.03).rem_euclid(TAU));
        let r = Roundness::of(&path(|a| (0.05 * a.cos() + late(a), 0.05 * a.sin())), 0.05).expect("a circle");
        assert!((r.steps[0] - 6e-6).abs() < 2e-7 && r.reversals[0].abs() < 2e-7, "{r:?}");
    }

    #[test]
    fn two_ellipses_across_each_other_widen_the_ring_of_both() {
        let ellipse = |e: f64| path(move |a| ((0.05 + e) * a.cos(), (0.05 - e) * a.sin()));
        let one = Roundness::of(&ellipse(1e-5), 0.05).expect("a circle").deviation;
        let g = bidirectional(&[ellipse(1e-5), ellipse(2e-5)]).expect("a circle");
        assert!((one - 2e-5).abs() < 1e-8 && (g - 4e-5).abs() < 1e-8, "{one} {g}");
        assert_eq!(bidirectional(&[Path::default(), Path::default()]), None);
    }

    #[test]
    fn no_path_has_no_circle() {
        assert_eq!(Roundness::of(&Path::default(), 0.05), None);
        assert_eq!(Roundness::of(&path(|_| (0.0, 0.0)), 0.05), None);
    }
}
