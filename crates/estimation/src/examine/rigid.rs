//! Torque against the nominal inertia, independent of the coupling: below its antiresonance every axis moves as one rigid body, and with
//! encoders on motor and table the momentum of both is known at every frequency:
//!
//! ```text
//! T = M*a + c*v + F*sign(v) + k*x      c, F >= 0; k of either sign (a spring, gravity)
//!          a = (I1*a1 + I2*a2)/(I1 + I2)
//! ```
//!
//! T in N.m, a, v, x in rad/s^2, rad/s, rad, M in kg.m2; for a linear axis N, m and kg. The spectra are of the whole record, so that slow
//! moves in closed loop, whose averaged spectra have few coherent lines or none, are examined as well as broadband noise. Derivatives are
//! taken before the window: the equation then holds at every line, also the lowest. The test is not how large `M` is, but whether an `M` near
//! the nominal one explains the torque about as well as any: friction, gravity, a ripple or another axis' torque affect both alike.

use std::ops::Range;

use rayon::prelude::*;

use super::finding::{Finding, Severity, rounded};
use super::least::{bounded, standard_error};
use super::motion::{Direction, acceleration, speed};
use super::motor_side::fits_better_as_logged;
use super::pairs::{FACTORS, factor};
use super::robust::{noise, quantile};
use super::smoothing::{SHORTEST, smoothed, widths};
use super::spectra::Spectra;
use super::standing::NOISE;
use super::{AxisKind, Input, NOMINAL_OFF, Nominal, Structure};
use crate::identify::lsq::triangularise;

/// Share of the antiresonance (table against a locked motor) up to which the axis moves as one body: the table moves there 4/3 times as far
/// as the motor.
const RIGID: f64 = 0.5;
/// Power of the position over its noise power from which a line shows motion: of noise one line in twenty thousand passes.
const MIN_SIGNAL_TO_NOISE: f64 = 10.0;
/// Least number of lines for a fit of four coefficients.
const LEAST: usize = 6;
/// Ratio to the nominal inertia, or its reciprocal, beyond which it is a wrong unit and no error of the nominal value.
const MAX_NOMINAL_ERROR: f64 = 10.0;
/// Unexplained share with the nominal axis, over that with another sign or unit, from which the latter is reported: on sound records with
/// friction that is not Coulomb's, a ripple or another axis' torque it was up to 1.5.
pub(super) const SIGNIFICANTLY_WORSE: f64 = 2.0;
/// Degrees of freedom beyond which that limit needs no addition: for fewer, the ratio of two residuals scatters with their inverse square.
const AMPLE_FREEDOM: f64 = 8.0;
/// Residual share of the torque's power up to which an inertia estimated from the record is given.
pub(super) const MAX_RESIDUAL: f64 = 0.25;
/// Most samples of one segment.
const LONGEST: usize = 65_536;

/// Columns of the spectra.
const T: usize = 0;
const A: usize = 1;
const X: usize = 4;

/// Result of the comparison of a record with the nominal inertia.
pub(super) enum NominalFit {
    /// The nominal axis explains the torque as well as another sign or unit.
    Consistent,
    /// The sign or the unit of a column is wrong.
    Inconsistent(Finding),
}

/// Compares the record with the nominal axis; `None` without a nominal model, or where too few lines show motion.
pub(super) fn compare_with_nominal(input: &Input<'_>) -> Option<NominalFit> {
    let nominal = input.nominal?;
    let balance = Balance::new(input, nominal)?;
    let inertia = nominal.parameters.i1 + nominal.parameters.i2;
    let near = [inertia / NOMINAL_OFF, inertia * NOMINAL_OFF];
    let own = balance.unexplained(1.0, near).0;
    let turned = balance.unexplained(-1.0, near).0;
    let (any, mass) = balance.unexplained(1.0, [0.0, f64::INFINITY]);
    let without = balance.unexplained(1.0, [0.0, 0.0]).0;
    // Overflow: no comparison.
    if ![own, turned, any, mass, without].iter().all(|v| v.is_finite()) {
        return None;
    }
    let worse = SIGNIFICANTLY_WORSE * (1.0 + (AMPLE_FREEDOM / balance.freedom).powi(2));
    if own <= worse * any.min(turned) {
        return Some(NominalFit::Consistent);
    }
    if turned <= any {
        // Another torque on the table enters the momentum of both, but not the motor's equation of motion; and a drive that holds an axis
        // against a foreign torque brakes where that pushes, as a friction turned round.
        let sound = fits_better_as_logged(input, 1.0, -1.0) || has_inertia(input, near);
        return Some(if sound { NominalFit::Consistent } else { NominalFit::Inconsistent(sign_finding(turned, own)) });
    }
    let ratio = mass / inertia;
    // Noise of the encoder, differentiated twice, hides an inertia: if no inertia explains the torque, none is compared.
    if own.min(without) <= worse * any || ratio <= 0.0 || !ratio.is_finite() {
        return None;
    }
    let estimated = EstimatedInertia { value: mass, error: balance.error(), left: any };
    inertia_finding(input, &estimated, inertia, true).map(NominalFit::Inconsistent)
}

/// What the balance of torque in the time domain tells of a record, whatever its nominal model:
///
/// ```text
/// T = M*a + c*v + F*sign(v) + k*x + g*sin(x) + h*cos(x) + b        rotary; without sine and cosine where it moves along a line
/// ```
///
/// Least squares: a weight's torque is a straight line over the angle in a narrow range alone. Torque and motion pass the same smoothing (a
/// mean over `2*w + 1` samples, twice), so that the equation holds between them.
#[derive(Default)]
pub(super) struct Guess {
    /// The inertia, kg.m2 (kg), that explains most of the torque: of some widths the narrowest from which the next no more raises it than by its
    /// error, or than by three of them where it knows it less: noise of the encoder, differentiated twice, takes from it, and a width beyond
    /// the motion's band leaves a weight's torque for it, or a constant one. None where less than three quarters are explained, or the inertia
    /// is not known to a third, or the nominal one is known.
    pub(super) inertia: Option<f64>,
    /// Whether at one of the narrow widths the torque leaves less than half of its power where it runs straight from sample to sample as where
    /// it is held from one to the next, whose mean acts half a sample late, and no more than held a sample earlier: of encoders that are
    /// late nothing runs straight. Beyond those widths half a sample is less than what a soft coupling turns the motion by.
    pub(super) runs_straight: bool,
}

/// Share of the power that the right one of two assumptions leaves of the torque, over that of the other, up to which it is taken: what
/// neither explains both leave.
const HALF: f64 = 0.5;
/// Widest smoothing, samples to either side, after which what the torque does between two samples is asked for.
const BETWEEN_SAMPLES: usize = 4;

impl Guess {
    pub(super) fn of(input: &Input<'_>) -> Self {
        let is_known = input.nominal.is_some();
        let fits = in_time(input, Samples::All, if is_known { BETWEEN_SAMPLES } else { usize::MAX });
        let runs_straight = fits.iter().any(TimeDomainFit::runs_straight);
        Self { inertia: determined(fits).filter(|_| !is_known).map(|found| found.mass), runs_straight }
    }
}

/// Of fits at rising widths that which [`Guess::inertia`] is taken from.
fn determined(fits: Vec<TimeDomainFit>) -> Option<TimeDomainFit> {
    let is_determined =
        |f: &TimeDomainFit| f.left < MAX_RESIDUAL && f.mass > SIGNIFICANT * f.error && f.mass.is_finite();
    standing(fits.into_iter().filter(is_determined), |f| [f.mass, f.error])
}

/// The first of some, by a value and its error, that the next does not raise: by more than its error, or than by three of them where that
/// knows it less.
fn standing<T>(mut all: impl Iterator<Item = T>, of: impl Fn(&T) -> [f64; 2]) -> Option<T> {
    let mut best = all.next()?;
    for next in all {
        let [[value, error], [raised, next_error]] = [of(&best), of(&next)];
        let knows_less = next_error / raised > error / value;
        if raised - value <= if knows_less { SIGNIFICANT } else { 1.0 } * next_error {
            break;
        }
        best = next;
    }
    Some(best)
}

/// Whether the same equation explains most of the torque with a friction or an inertia that is significantly positive and none that is so
/// negative. For slow moves, where friction or a weight is nearly all of the torque: their spectra have few lines above the
/// noise. It is asked where the axis moves beyond the noise of its encoder: at rest friction balances any torque below breakaway, and has
/// no sign.
pub(super) fn explained_in_time(input: &Input<'_>) -> bool {
    in_time(input, Samples::Moving, usize::MAX)
        .into_iter()
        .min_by(|a, b| a.unbiased().total_cmp(&b.unbiased()))
        .is_some_and(|found| {
            found.unbiased() < MAX_RESIDUAL
                && counts_as_logged(found.friction / found.friction_error, found.mass / found.error)
        })
}

/// Whether the same equation has an inertia as logged, within bounds, kg.m2 (kg): of a torque turned round it is negative.
fn has_inertia(input: &Input<'_>, [least, most]: [f64; 2]) -> bool {
    in_time(input, Samples::Moving, usize::MAX)
        .iter()
        .any(|f| f.mass > SIGNIFICANT * f.error && (least..most).contains(&f.mass))
}

/// Samples that a fit in the time domain takes.
#[derive(Clone, Copy, PartialEq)]
enum Samples {
    All,
    /// Those at which the axis moves beyond the noise of its encoder.
    Moving,
}

/// The fits in the time domain with the smoothings of all widths to the widest, the narrowest first; none without torque and position.
fn in_time(input: &Input<'_>, samples: Samples, widest: usize) -> Vec<TimeDomainFit> {
    let (Some(torque), Some(x)) = (input.torque, input.theta1.or(input.theta2)) else { return Vec::new() };
    let noise = (samples == Samples::Moving).then(|| noise(x));
    let widths: Vec<usize> = widths(x.len()).filter(|width| *width <= widest).collect();
    widths.into_par_iter().filter_map(|width| time_domain_fit(input, torque, x, width, noise)).collect()
}

/// Whether a friction and an inertia, in their standard errors, are of a torque that counts as the motion does. Both turn round with it: a
/// friction that a late torque makes negative is none beside an inertia that is determined several times as well.
fn counts_as_logged(friction: f64, mass: f64) -> bool {
    friction > 0.0 && mass > -SIGNIFICANT || mass > SIGNIFICANT && -friction < SIGNIFICANT.max(mass / SIGNIFICANT)
}

/// Range of an angle about its middle from which a weight's torque is not a straight line, rad; and beyond which the column is no angle of a
/// hinge, whose sine would be noise.
const HINGE: f64 = 0.3;
const TURNS: f64 = 1e4;
/// Most samples that enter one least-squares fit.
pub(super) const SAMPLES: usize = 20_000;

/// Standard errors from which a value is surely not zero.
pub(super) const SIGNIFICANT: f64 = 3.0;

/// Columns of viscous and of dry friction in the time domain.
const VISCOUS: usize = 1;
const DRY: usize = 2;

/// The fit in the time domain.
struct TimeDomainFit {
    /// Samples to either side that the smoothing takes.
    width: usize,
    /// Residual share of the torque's variance.
    left: f64,
    /// The same of what the second difference of a position is of, of a torque that does so between its samples.
    acting: Acting<f64>,
    /// Inertia and its standard error, kg.m2 (kg).
    mass: f64,
    error: f64,
    /// Friction at the ninth decile of the speeds and its standard error, N.m (N).
    friction: f64,
    friction_error: f64,
    /// Independent samples, and coefficients.
    samples: f64,
    coefficients: f64,
}

/// What a torque may do between two samples.
struct Acting<T> {
    straight: T,
    held: T,
    /// Held, and a sample earlier.
    early: T,
}

impl Acting<f64> {
    /// The mean of a torque, N.m (N), over the two samples that `k` is the middle of, weighted as the second difference of the position is by
    /// it: exact where the axis has nothing but an inertia.
    fn of(torque: &[f64], k: usize) -> Self {
        let [before, at, after] = [torque[k - 1], torque[k], torque[k + 1]];
        Self { straight: (before + 4.0 * at + after) / 6.0, held: 0.5 * (before + at), early: 0.5 * (at + after) }
    }

    fn all(self) -> [f64; 3] {
        [self.straight, self.held, self.early]
    }
}

impl TimeDomainFit {
    /// See [`Guess::runs_straight`].
    fn runs_straight(&self) -> bool {
        let Acting { straight, held, early } = self.acting;
        self.width <= BETWEEN_SAMPLES && straight < MAX_RESIDUAL && straight < HALF * held && straight < early
    }

    /// Residual share of the variance of the torque that unrelated columns leave at one on the average; infinite where they explain any torque.
    fn unbiased(&self) -> f64 {
        let freedom = self.samples - self.coefficients;
        if freedom > 0.0 { self.left * (self.samples - 1.0) / freedom } else { f64::INFINITY }
    }
}

/// Standard deviation of a speed over two samples, times their interval, after a mean over `2*width + 1` samples, twice, of a white noise of
/// one: that of a difference of two such means, whose `2*(2*width + 1)` weights are all about one size.
fn of_speed(width: usize) -> f64 {
    std::f64::consts::SQRT_2 * ((2 * width + 1) as f64).powf(-1.5)
}

/// Whether a weight's torque over the angle `x`, rad, is told from a spring's.
pub(super) fn turns_a_weight(input: &Input<'_>, x: &[f64]) -> bool {
    let middle = x[x.len() / 2];
    let size = x.iter().fold(0.0_f64, |m, v| m.max((v - middle).abs()));
    input.motion == AxisKind::Rotary && size > HINGE && size < TURNS
}

/// The fit with a smoothing of `width` samples to either side; with the encoder's `noise`, rad (m), of the samples at which the axis moves
/// beyond it.
fn time_domain_fit(
    input: &Input<'_>,
    torque: &[f64],
    x: &[f64],
    width: usize,
    noise: Option<f64>,
) -> Option<TimeDomainFit> {
    let (t, q) = (smoothed(torque, width), smoothed(x, width));
    let dt = input.dt;
    let direction = Direction::of_angle(&q, dt);
    let fast = direction.fast;
    let middle = x[x.len() / 2];
    let columns = if turns_a_weight(input, x) { 7 } else { 5 };
    let stride = (q.len() / SAMPLES).max(1);
    let least = noise.map(|noise| NOISE * noise * of_speed(width) / dt);
    let moves = |k: &usize| least.is_none_or(|least| speed(&q, *k, dt).abs() > least);
    let rows: Vec<usize> = (1..q.len() - 1).step_by(stride).filter(moves).collect();
    // Of an axis that never goes back dry friction is a constant torque.
    let course = |k: &usize| direction.at(speed(&q, *k, dt));
    let goes_back = rows.iter().any(|k| course(k) != course(&rows[0]));
    let which: Vec<usize> = (0..columns).filter(|column| goes_back || *column != DRY).collect();
    let torques = |k: usize| {
        let [straight, held, early] = Acting::of(&t, k).all();
        [t[k], straight, held, early]
    };
    let triangle = triangularise(rows.len(), which.len(), 4, |i, out| {
        let k = rows[i];
        let v = speed(&q, k, dt);
        let all = [acceleration(&q, k, dt), v, direction.at(v), q[k] - middle, 1.0, q[k].sin(), q[k].cos()];
        out.iter_mut().zip(&which).for_each(|(out, column)| *out = all[*column]);
        out[which.len()..].copy_from_slice(&torques(k));
    });
    let solution = triangle.solve().ok()?;
    let left = |i: usize| {
        let mean = rows.iter().map(|k| torques(*k)[i]).sum::<f64>() / rows.len() as f64;
        solution.residual[(i, i)] / rows.iter().map(|k| (torques(*k)[i] - mean).powi(2)).sum::<f64>()
    };
    // Smoothed samples are not independent: one in a width is.
    let variance = |i: usize, k: usize| solution.variance(0) * solution.inverse[(i, k)] * (2 * width + 1) as f64;
    let acting = Acting { straight: left(1), held: left(2), early: left(3) };
    let left = left(0);
    let of = |i: usize| solution.phi[(i, 0)];
    let frictions: &[(usize, f64)] = if goes_back { &[(VISCOUS, fast), (DRY, 1.0)] } else { &[(VISCOUS, fast)] };
    let pairs = || frictions.iter().flat_map(|a| frictions.iter().map(move |b| (a, b)));
    left.is_finite().then(|| TimeDomainFit {
        width,
        left,
        acting,
        mass: of(0),
        error: variance(0, 0).sqrt(),
        friction: frictions.iter().map(|(i, by)| by * of(*i)).sum(),
        friction_error: pairs().map(|((i, a), (k, b))| a * b * variance(*i, *k)).sum::<f64>().sqrt(),
        samples: (rows.len() * stride) as f64 / (2 * width + 1) as f64,
        coefficients: which.len() as f64,
    })
}

fn sign_finding(turned: f64, own: f64) -> Finding {
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

/// An inertia estimated from a record, and how well the record determines it.
pub(super) struct EstimatedInertia {
    /// The inertia that moves, kg.m2 (kg).
    pub value: f64,
    /// Its standard error with the residual's own colour, kg.m2 (kg).
    pub error: f64,
    /// Share of the torque's power that the fit leaves.
    pub left: f64,
}

/// Standard errors about an estimate within which its true value is: 95 % of a normal distribution.
const CONFIDENCE: f64 = 2.0;

/// The finding on an inertia that is off the nominal one, kg.m2 (kg): a wrong unit if the ratio is near a unit's factor and near no other one
/// or, where `sure`, beyond the error of any nominal value; else a warning. None where the record does not determine that it is off: its
/// confidence interval lets the nominal value in, or a fit that leaves less of the torque has another result. Noise of the encoder,
/// differentiated twice, takes from an inertia that is estimated without smoothing what no standard error tells.
pub(super) fn inertia_finding(
    input: &Input<'_>,
    found: &EstimatedInertia,
    nominal: f64,
    sure: bool,
) -> Option<Finding> {
    let ratio = found.value / nominal;
    let [low, high] = [-1.0, 1.0].map(|sense| (found.value + sense * CONFIDENCE * found.error) / nominal);
    let near = 1.0 / NOMINAL_OFF..NOMINAL_OFF;
    let is_off = low >= near.end || high <= near.start;
    let otherwise = |fit: &TimeDomainFit| fit.left < found.left && near.contains(&(fit.mass / nominal));
    if !is_off || determined(in_time(input, Samples::All, usize::MAX)).is_some_and(|fit| otherwise(&fit)) {
        return None;
    }
    let unit = AxisKind::unit(input.motion, "kg.m2");
    let seen =
        format!("The inertia that moves is {:.4e} {unit}, {} times the nominal one", found.value, rounded(ratio));
    // Sizes of the factors, in their logarithms, that the interval lets in; of an inertia that may be none, all.
    let [least, most] = if ratio > 1.0 { [low, high] } else { [1.0 / high, 1.0 / low.max(0.0)] }.map(f64::ln);
    let let_in = FACTORS.iter().filter(|(f, _)| (least..=most).contains(&f.ln())).count();
    let meaning = factor(ratio).filter(|_| let_in <= 1);
    let beyond = low >= MAX_NOMINAL_ERROR || low > 0.0 && high <= 1.0 / MAX_NOMINAL_ERROR;
    if meaning.is_none() && !(sure && beyond) {
        return Some(Finding::new(
            "inertia",
            Severity::Warn,
            "T",
            format!("{seen}."),
            "The nominal inertia, a gear ratio, the torque constant or a unit is off.",
            "Check [parameters] and the scale of T in [signals]; `eixo identify` reads the inertia from this record.",
        ));
    }
    let like = meaning.map_or_else(
        || "further off than a nominal value is".to_owned(),
        |meaning| format!("which looks like a factor of {meaning}"),
    );
    Some(Finding::new(
        "units",
        Severity::Refuse,
        "T",
        format!("{seen}, {like}."),
        "Torque, angle or time is in another unit than the file says: every parameter is off by it.",
        "Give the unit in the header or in [signals] (unit = \"mN.m\", \"deg\", \"ms\"), or mend [parameters].",
    ))
}

/// Frequency up to which the nominal axis moves as one rigid body, rad/s.
pub(super) fn rigid_band(nominal: Nominal) -> f64 {
    let p = nominal.parameters;
    match nominal.structure {
        Structure::Rigid => f64::INFINITY,
        Structure::TwoInertia => RIGID * (p.k / p.i2).sqrt(),
    }
}

/// Spectra of a whole record, and the lines that show motion.
pub(super) struct MotionLines {
    pub spectra: Spectra,
    pub lines: Vec<usize>,
}

impl MotionLines {
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
        let stands = |f: &usize| {
            noise.iter().all(|(x, n)| spectra.power(*x, *f) > MIN_SIGNAL_TO_NOISE * n * middle / (f + 1) as f64)
        };
        let lines = (0..spectra.lines).take_while(|f| spectra.omega(*f) < above).filter(stands).collect();
        Some(Self { spectra, lines })
    }
}

/// Accelerations at all samples but the first and the last.
fn accelerations(x: &[f64], dt: f64) -> impl Iterator<Item = f64> {
    (1..x.len().max(2) - 1).map(move |k| acceleration(x, k, dt))
}

/// The equation above, summed over the lines of motion: columns of unit size.
struct Balance {
    motion: MotionLines,
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
        let table = input.theta2.filter(|_| input.theta1.is_some() && nominal.structure == Structure::TwoInertia);
        let p = nominal.parameters;
        let mean = || -> Vec<f64> {
            match table {
                None => accelerations(x, dt).collect(),
                Some(x2) => {
                    let of = |(a1, a2)| (p.i1 * a1 + p.i2 * a2) / (p.i1 + p.i2);
                    accelerations(x, dt).zip(accelerations(x2, dt)).map(of).collect()
                }
            }
        };
        let speeds = || {
            let speed: Vec<f64> = (1..n - 1).map(|k| speed(x, k, dt)).collect();
            let direction = Direction::of(speed.iter().copied());
            let sign: Vec<f64> = speed.iter().map(|v| direction.at(*v)).collect();
            (speed, sign)
        };
        let (mean, (speed, sign)) = rayon::join(mean, speeds);
        let above = if table.is_some() { f64::INFINITY } else { rigid_band(nominal) };
        let mut columns = vec![&torque[1..n - 1], &mean, &speed, &sign, &x[1..n - 1]];
        columns.extend(table.map(|x2| &x2[1..n - 1]));
        let motion = MotionLines::new(&columns, X..columns.len(), dt, above)?;
        let MotionLines { spectra, lines } = &motion;
        let total: f64 = lines.iter().map(|f| spectra.power(T, *f)).sum();
        if lines.len() < LEAST || total.is_nan() || total <= 0.0 {
            return None;
        }
        let sum = |i: usize, k: usize| lines.iter().map(|f| spectra.of(i, k, *f).re).sum::<f64>();
        let size: Vec<f64> = (A..=X).map(|i| sum(i, i).sqrt().max(f64::MIN_POSITIVE)).collect();
        let gram = (A..=X).map(|i| (A..=X).map(|k| sum(i, k) / size[i - A] / size[k - A]).collect()).collect();
        let right = (A..=X).map(|i| sum(i, T) / size[i - A]).collect();
        let freedom = 2.0 * lines.len() as f64 * spectra.averages - 4.0;
        Some(Self { gram, right, size, total, freedom, motion })
    }

    /// Standard error of the inertia that is fitted without bounds but its sign, kg.m2 (kg).
    fn error(&self) -> f64 {
        let any = f64::INFINITY;
        let (x, _) = bounded(&self.gram, &self.right, &[0.0, 0.0, 0.0, -any], &[any; 4]);
        let MotionLines { spectra, lines } = &self.motion;
        // What is left of the torque: the column T less the columns of the equation.
        let of: Vec<f64> = std::iter::once(1.0).chain((0..4).map(|i| -x[i] / self.size[i])).collect();
        let mut omega = vec![vec![0.0; 4]; 4];
        for &f in lines {
            let left: f64 = (0..=X).map(|i| (0..=X).map(|k| of[i] * of[k] * spectra.of(i, k, f).re).sum::<f64>()).sum();
            for (i, row) in omega.iter_mut().enumerate() {
                for (k, o) in row.iter_mut().enumerate() {
                    let product = spectra.of(A + i, A + k, f).re / self.size[i] / self.size[k];
                    *o += left.max(0.0) * spectra.variance_of_sums() * product;
                }
            }
        }
        let free: Vec<usize> = (0..4).filter(|i| A + i == X || x[*i] > 0.0).collect();
        standard_error(&self.gram, &omega, &free, &[0]) / self.size[0]
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::axis::Parameters;
    use crate::numerics::level::noise;

    #[test]
    fn a_friction_that_a_late_torque_makes_negative_turns_no_inertia_round_that_is_known_several_times_as_well() {
        // Of a sound log whose torque is two samples late.
        assert!(counts_as_logged(-7.2, 445.0) && !counts_as_logged(7.2, -445.0));
        // Slow moves, as logged and turned round: friction is nearly all of the torque.
        assert!(counts_as_logged(90.0, 5.0) && counts_as_logged(90.0, -2.0) && !counts_as_logged(-90.0, 5.0));
        assert!(counts_as_logged(-2.0, 4.0) && !counts_as_logged(-4.0, 8.0) && !counts_as_logged(-1.0, 1.0));
    }

    #[test]
    fn the_standard_error_of_an_inertia_is_the_scatter_of_its_estimates_under_a_coloured_torque() {
        let (dt, n, inertia) = (1e-3, 4096, 0.2);
        let parts: Vec<(f64, f64)> = (1..40).map(f64::from).map(|i| (3.0 * i, 1.3 * i * i)).collect();
        let of = |k: usize, power: i32| -> f64 {
            parts.iter().map(|(w, p)| w.powi(power - 2) * (w * k as f64 * dt + p).sin()).sum()
        };
        let x: Vec<f64> = (0..n).map(|k| of(k, 0)).collect();
        let nominal = Nominal {
            structure: Structure::Rigid,
            parameters: Parameters { i1: inertia, i2: 0.0, ..Parameters::PAPER },
        };
        let estimates: Vec<[f64; 2]> = (0..40)
            .map(|seed| {
                let mut e = 0.0;
                let coloured = noise(n, seed).into_iter().map(|w| {
                    e = 0.95 * e + w;
                    e
                });
                let torque: Vec<f64> = coloured.enumerate().map(|(k, e)| -inertia * of(k, 2) + e).collect();
                let input = Input { dt, torque: Some(&torque), theta1: Some(&x), ..Input::default() };
                let balance = Balance::new(&input, nominal).expect("its lines show motion");
                [balance.unexplained(1.0, [0.0, f64::INFINITY]).1, balance.error()]
            })
            .collect();
        let mean = |i: usize| estimates.iter().map(|e| e[i]).sum::<f64>() / 40.0;
        let scatter = (estimates.iter().map(|e| (e[0] - mean(0)).powi(2)).sum::<f64>() / 39.0).sqrt();
        // The scatter of forty estimates is known to a ninth.
        assert!((0.6..1.6).contains(&(mean(1) / scatter)), "{} against {scatter} of {}", mean(1), mean(0));
    }

    #[test]
    fn the_value_is_taken_that_the_next_no_more_raises() {
        let of = |values: &[[f64; 2]]| standing(values.iter().enumerate(), |(_, of)| **of).map(|(i, _)| i);
        // Rises as noise goes, then stands.
        assert_eq!(of(&[[0.2, 0.02], [0.8, 0.05], [1.0, 0.04], [1.02, 0.03], [1.1, 0.02]]), Some(2));
        // Rises on, each time better known; and less known, by what it is not known to.
        assert_eq!(of(&[[0.8, 0.08], [0.9, 0.07], [1.0, 0.06]]), Some(2));
        assert_eq!(of(&[[0.1, 0.02], [0.9, 0.1], [1.2, 0.2], [2.4, 0.6]]), Some(1));
        // Less known than at first, but raised by many errors.
        assert_eq!(of(&[[0.01, 0.001], [0.9, 0.1], [0.95, 0.1]]), Some(1));
        assert_eq!([of(&[[1.0, 0.1], [0.9, 0.1]]), of(&[])], [Some(0), None]);
    }
}
