//! Torque against the nominal inertia, where no coupling comes between them: below its resonance every axis moves as one body, and with
//! an encoder on either side the momentum of both is known at every frequency:
//!
//! ```text
//! T = M*a + c*v + F*sign(v) + k*x      c, F >= 0; k of either sign (a spring, gravity)
//!          a = (I1*a1 + I2*a2)/(I1 + I2)
//! ```
//!
//! The record is taken whole, so that slow moves under control, whose averaged spectra show few lines or none, are examined as well as a
//! band of noise. Derivatives are taken before the window: the equation then holds at every line, the lowest, too. What is asked is not how
//! large `M` is but whether an `M` near the nominal one explains the torque about as well as any: friction, gravity, a ripple or a foreign
//! torque take from both alike.

use std::ops::Range;

use rayon::prelude::*;

use super::finding::{Finding, Severity, told};
use super::least::bounded;
use super::motor_side::rather_as_logged;
use super::pairs::factor;
use super::robust::quantile;
use super::smoothing::{SHORTEST, smoothed, widths};
use super::spectra::Spectra;
use super::{Input, Motion, NOMINAL_OFF, Nominal, Structure};
use crate::identify::lsq::triangularise;

/// Share of the antiresonance (table against a held motor) up to which the axis moves as one body: its motion is there 4/3 of a rigid one's.
const RIGID: f64 = 0.5;
/// Power of the position over that of its noise from which a line is one of motion: chance passes one of twenty thousand.
const STANDS: f64 = 10.0;
/// Lines from which four coefficients say something.
const LEAST: usize = 6;
/// A ratio beyond this is no nominal value's error, whatever it is near to.
const BEYOND: f64 = 10.0;
/// Times as much of the torque that the nominal axis must leave for another sign or unit to be believed: friction that is not Coulomb's, a
/// ripple or a foreign torque made it 1.5 on sound records.
pub(super) const WORSE: f64 = 2.0;
/// Equations left over from which chance adds nothing to that: of fewer the ratio of two remainders spreads as their square.
const ENOUGH: f64 = 8.0;
/// Share of the torque's power that may be left beside an inertia that is read from a record.
pub(super) const MOST_LEFT: f64 = 0.25;
/// Most samples of one segment.
const LONGEST: usize = 65_536;

/// Columns of the spectra.
const T: usize = 0;
const A: usize = 1;
const X: usize = 4;

/// What the nominal inertia makes of a record.
pub(super) enum Weight {
    /// The nominal axis explains the torque as well as another sign or unit.
    Nominal,
    /// Something is wrong with sign or unit.
    Wrong(Finding),
}

/// Weighs the record against the nominal axis; None where there is none or where the record shows too little of its motion.
pub(super) fn weigh(input: &Input<'_>) -> Option<Weight> {
    let nominal = input.nominal?;
    let balance = Balance::new(input, nominal)?;
    let inertia = nominal.parameters.i1 + nominal.parameters.i2;
    let near = [inertia / NOMINAL_OFF, inertia * NOMINAL_OFF];
    let own = balance.unexplained(1.0, near).0;
    let turned = balance.unexplained(-1.0, near).0;
    let (any, mass) = balance.unexplained(1.0, [0.0, f64::INFINITY]);
    let without = balance.unexplained(1.0, [0.0, 0.0]).0;
    // Numbers at the end of their range weigh nothing.
    if ![own, turned, any, mass, without].iter().all(|v| v.is_finite()) {
        return None;
    }
    let worse = WORSE * (1.0 + (ENOUGH / balance.freedom).powi(2));
    if own <= worse * any.min(turned) {
        return Some(Weight::Nominal);
    }
    if turned <= any {
        // What moves the table beside the coupling counts in the momentum of both, not on the motor's side.
        let sound = rather_as_logged(input, 1.0, -1.0);
        return Some(if sound { Weight::Nominal } else { Weight::Wrong(against(turned, own)) });
    }
    let ratio = mass / inertia;
    // Noise of the encoder, differentiated twice, hides an inertia: what it does not explain it does not tell.
    if own.min(without) <= worse * any || ratio <= 0.0 || !ratio.is_finite() {
        return None;
    }
    Some(Weight::Wrong(other_unit(input, mass, ratio, true)))
}

/// The inertia with which friction, a weight on a hinge and a spring explain most of the torque, of a record of which nothing is known:
///
/// ```text
/// T = M*a + c*v + F*sign(v) + k*x + g*sin(x) + h*cos(x) + b        rotary; without sine and cosine where it moves along a line
/// ```
///
/// Least squares in the time domain: a weight's torque is a straight line over the angle in a narrow range alone. Torque and motion pass
/// the same smoothing (a mean over `2*w + 1` samples, twice), so that the equation holds between them; of some widths that which leaves
/// the least of the torque's power is taken, as noise of the encoder, differentiated twice, takes from the inertia, and a width beyond the
/// motion's band from all. None where less than three quarters are explained, or the inertia is not known to a third.
pub(super) fn inertia(input: &Input<'_>) -> Option<f64> {
    let (torque, x) = (input.torque?, input.theta1.or(input.theta2)?);
    let mut best: Option<InTime> = None;
    for found in at_widths(input, torque, x) {
        if found.left < MOST_LEFT
            && found.mass > SURELY * found.error
            && found.mass.is_finite()
            && best.as_ref().is_none_or(|best| found.left < 0.98 * best.left)
        {
            best = Some(found);
        }
    }
    best.map(|found| found.mass)
}

/// Whether the same balance explains most of the torque with a friction that brakes or, where there is next to none, an inertia that is
/// one: of slow moves, where friction or a weight is nearly all of the torque, spectra show a few lines alone, and noise in those.
pub(super) fn follows(input: &Input<'_>) -> bool {
    let (Some(torque), Some(x)) = (input.torque, input.theta1.or(input.theta2)) else { return false };
    at_widths(input, torque, x).into_iter().min_by(|a, b| a.left.total_cmp(&b.left)).is_some_and(|found| {
        let (friction, mass) = (found.friction / found.friction_error, found.mass / found.error);
        found.left < MOST_LEFT && (friction > 0.0 && mass > -SURELY || friction > -SURELY && mass > SURELY)
    })
}

/// Range of an angle about its middle from which a weight's torque is not a straight line, rad; and beyond which the column is no angle of a
/// hinge, whose sine would be noise.
const HINGE: f64 = 0.3;
const TURNS: f64 = 1e4;
/// Most samples that one solution looks at.
pub(super) const SAMPLES: usize = 20_000;

/// Standard errors from which a value is surely not zero.
const SURELY: f64 = 3.0;

/// The balance in the time domain.
struct InTime {
    /// Share of the torque's power about its mean that is left.
    left: f64,
    /// Inertia and its standard error.
    mass: f64,
    error: f64,
    /// Friction at the ninth decile of the speeds and its standard error.
    friction: f64,
    friction_error: f64,
}

/// The balance by the smoothings of all widths, the narrowest first.
fn at_widths(input: &Input<'_>, torque: &[f64], x: &[f64]) -> Vec<InTime> {
    let widths: Vec<usize> = widths(x.len()).collect();
    widths.into_par_iter().filter_map(|width| in_time(input, torque, x, width)).collect()
}

/// The balance by a smoothing of a width.
fn in_time(input: &Input<'_>, torque: &[f64], x: &[f64], width: usize) -> Option<InTime> {
    let (t, q) = (smoothed(torque, width), smoothed(x, width));
    let dt = input.dt;
    let speed = |k: usize| (q[k + 1] - q[k - 1]) / (2.0 * dt);
    let fast = quantile((1..q.len() - 1).map(speed), 0.9);
    let quiet = 0.02 * fast;
    let middle = x[x.len() / 2];
    let size = x.iter().fold(0.0_f64, |m, v| m.max((v - middle).abs()));
    let hinge = input.motion == Motion::Rotary && size > HINGE && size < TURNS;
    let columns = if hinge { 7 } else { 5 };
    let stride = (q.len() / SAMPLES).max(1);
    let rows: Vec<usize> = (1..q.len() - 1).step_by(stride).collect();
    let rate = |k: usize| (q[k + 1] - 2.0 * q[k] + q[k - 1]) / (dt * dt);
    let triangle = triangularise(rows.len(), columns, 1, |i, out| {
        let k = rows[i];
        let v = speed(k);
        let sign = if v.abs() <= quiet { 0.0 } else { v.signum() };
        let all = [rate(k), v, sign, q[k] - middle, 1.0, q[k].sin(), q[k].cos()];
        out[..columns].copy_from_slice(&all[..columns]);
        out[columns] = t[k];
    });
    let solution = triangle.solve().ok()?;
    let mean = rows.iter().map(|k| t[*k]).sum::<f64>() / rows.len() as f64;
    let total: f64 = rows.iter().map(|k| (t[*k] - mean).powi(2)).sum();
    // Smoothed samples are not independent: one in a width is.
    let variance = |i: usize, k: usize| solution.variance(0) * solution.inverse[(i, k)] * (2 * width + 1) as f64;
    let left = solution.residual[(0, 0)] / total;
    let of = |i: usize| solution.phi[(i, 0)];
    left.is_finite().then(|| InTime {
        left,
        mass: of(0),
        error: variance(0, 0).sqrt(),
        friction: of(1) * fast + of(2),
        friction_error: (fast * fast * variance(1, 1) + 2.0 * fast * variance(1, 2) + variance(2, 2)).sqrt(),
    })
}

fn against(turned: f64, own: f64) -> Finding {
    let explained = |left: f64| 100.0 * (1.0 - left).max(0.0);
    Finding::new(
        "sign",
        Severity::Refuse,
        "T",
        format!(
            "The motion follows the torque backwards: turned round, the nominal axis with friction explains {:.0} % of it, as it is {:.0} %.",
            explained(turned),
            explained(own)
        ),
        "Torque and position count in opposite directions: inertia and friction would come out negative.",
        "Give the torque, or all motion, scale = -1 in [signals] of the axis file.",
    )
}

/// An inertia that is not the nominal one: by a unit's factor or, where it is `sure` what moves, by more than any nominal value is off.
pub(super) fn other_unit(input: &Input<'_>, mass: f64, ratio: f64, sure: bool) -> Finding {
    let unit = Motion::unit(input.motion, "kg.m2");
    let seen = format!("The inertia that moves is {mass:.4e} {unit}, {} times the nominal one", told(ratio));
    let words = factor(ratio);
    let of_a_nominal = !sure || (1.0 / BEYOND..BEYOND).contains(&ratio);
    if words.is_none() && of_a_nominal {
        return Finding::new(
            "inertia",
            Severity::Warn,
            "T",
            format!("{seen}."),
            "The nominal inertia, a gear ratio, the torque constant or a unit is off.",
            "Check [parameters] and the scale of T in [signals]; `eixo identify` reads the inertia from this record.",
        );
    }
    let like = words.map_or_else(
        || "further off than a nominal value is".to_owned(),
        |words| format!("which looks like a factor of {words}"),
    );
    Finding::new(
        "units",
        Severity::Refuse,
        "T",
        format!("{seen}, {like}."),
        "Torque, angle or time is in another unit than the file says: every parameter is off by it.",
        "Give the unit in the header or in [signals] (unit = \"mN.m\", \"deg\", \"ms\"), or mend [parameters].",
    )
}

/// Frequency up to which the nominal axis moves as one body, rad/s.
pub(super) fn rigid_up_to(nominal: Nominal) -> f64 {
    let p = nominal.parameters;
    match nominal.structure {
        Structure::Rigid => f64::INFINITY,
        Structure::TwoInertia => RIGID * (p.k / p.i2).sqrt(),
    }
}

/// Spectra of a record taken whole, and the lines of its motion.
pub(super) struct Slow {
    pub spectra: Spectra,
    pub lines: Vec<usize>,
}

impl Slow {
    /// Of columns of one length; the lines up to `above` rad/s at which each of the `positions` among them stands out of its noise. None
    /// where there are too few samples.
    pub fn new(columns: &[&[f64]], positions: Range<usize>, dt: f64, above: f64) -> Option<Self> {
        let n = columns[0].len();
        if n < SHORTEST {
            return None;
        }
        let spectra = Spectra::new(columns, n.min(LONGEST) / 2 * 2, dt);
        let upper = (0.8 * spectra.lines as f64) as usize..spectra.lines;
        let middle = 0.9 * spectra.lines as f64;
        // Noise falls with the frequency or is flat: at a line it is at most the upper lines' in proportion.
        let noise = |x: usize| quantile(upper.clone().map(|f| spectra.power(x, f)), 0.5) / std::f64::consts::LN_2;
        let noise: Vec<(usize, f64)> = positions.map(|x| (x, noise(x))).collect();
        let stands =
            |f: &usize| noise.iter().all(|(x, n)| spectra.power(*x, *f) > STANDS * n * middle / (f + 1) as f64);
        let lines = (0..spectra.lines).take_while(|f| spectra.omega(*f) < above).filter(stands).collect();
        Some(Self { spectra, lines })
    }
}

/// The equation above, summed over the lines of motion: columns of unit size.
struct Balance {
    gram: Vec<Vec<f64>>,
    right: Vec<f64>,
    size: Vec<f64>,
    total: f64,
    /// Equations beyond the coefficients.
    freedom: f64,
}

impl Balance {
    /// None where there are no positions, or too few lines at which they stand out of their noise.
    fn new(input: &Input<'_>, nominal: Nominal) -> Option<Self> {
        let (torque, x) = (input.torque?, input.theta1.or(input.theta2)?);
        let n = x.len();
        if n < SHORTEST {
            return None;
        }
        let dt = input.dt;
        let acceleration =
            |x: &[f64]| x.windows(3).map(|w| (w[2] - 2.0 * w[1] + w[0]) / (dt * dt)).collect::<Vec<f64>>();
        let speed: Vec<f64> = x.windows(3).map(|w| (w[2] - w[0]) / (2.0 * dt)).collect();
        let quiet = 0.02 * quantile(speed.iter().copied(), 0.9);
        let sign: Vec<f64> = speed.iter().map(|v| if v.abs() <= quiet { 0.0 } else { v.signum() }).collect();
        let table = input.theta2.filter(|_| input.theta1.is_some() && nominal.structure == Structure::TwoInertia);
        let p = nominal.parameters;
        let (mean, above) = match table {
            None => (acceleration(x), rigid_up_to(nominal)),
            Some(x2) => {
                let of = |(a1, a2): (&f64, &f64)| (p.i1 * a1 + p.i2 * a2) / (p.i1 + p.i2);
                (acceleration(x).iter().zip(&acceleration(x2)).map(of).collect(), f64::INFINITY)
            }
        };
        let mut columns = vec![&torque[1..n - 1], &mean, &speed, &sign, &x[1..n - 1]];
        columns.extend(table.map(|x2| &x2[1..n - 1]));
        let Slow { spectra, lines } = Slow::new(&columns, X..columns.len(), dt, above)?;
        let total: f64 = lines.iter().map(|f| spectra.power(T, *f)).sum();
        if lines.len() < LEAST || total.is_nan() || total <= 0.0 {
            return None;
        }
        let sum = |i: usize, k: usize| lines.iter().map(|f| spectra.of(i, k, *f).re).sum::<f64>();
        let size: Vec<f64> = (A..=X).map(|i| sum(i, i).sqrt().max(f64::MIN_POSITIVE)).collect();
        let gram = (A..=X).map(|i| (A..=X).map(|k| sum(i, k) / size[i - A] / size[k - A]).collect()).collect();
        let right = (A..=X).map(|i| sum(i, T) / size[i - A]).collect();
        let freedom = 2.0 * lines.len() as f64 * spectra.averages - 4.0;
        Some(Self { gram, right, size, total, freedom })
    }

    /// Share of the torque, times `sense`, that is left with an inertia within bounds; and that inertia.
    fn unexplained(&self, sense: f64, inertia: [f64; 2]) -> (f64, f64) {
        let [low, high] = inertia.map(|m| m * self.size[0]);
        let right: Vec<f64> = self.right.iter().map(|r| sense * r).collect();
        let any = f64::INFINITY;
        let (x, explained) = bounded(&self.gram, &right, &[low, 0.0, 0.0, -any], &[high, any, any, any]);
        (1.0 - explained / self.total, x[0] / self.size[0])
    }
}
