//! Torque against motion, at the lines where the motion follows it:
//!
//! ```text
//! T(t) = M1*a1 + M2*a2 + c*v1 + F*sign(v1) + k*x1      M1, M2, c, F >= 0; the motion may be late by tau
//! ```
//!
//! M2 belongs to the table's encoder where there is one; else to a resonance `a1/(1 - (w/wa)^2)` whose frequency is tried.
//! With the table's encoder alone the motor shows as `M2*a2''`. Least squares over the lines' averaged cross spectra, the
//! coefficients kept from below zero (C. L. Lawson, R. J. Hanson, Solving Least Squares Problems, 1974, ch. 23; here by
//! coordinates, the problem has six).

use rustfft::num_complex::Complex;

use super::encoders::{counted, encoders, motor_side, slowly};
use super::finding::{Finding, Severity, told};
use super::least::bounded;
use super::nominal::explains;
use super::rigid::{self, WORSE, Weight, other_unit};
use super::robust::{quantile, span};
use super::spectra::Spectra;
use super::{Input, NOMINAL_OFF, Nominal, Structure};

/// Coherence from which a line tells something of the motion, where the averages do not ask for more.
pub(super) const COHERENT: f64 = 0.4;
/// Share of the torque's power that the balance must explain for the record to be about this torque.
const EXPLAINED: f64 = 0.2;
/// From this share on the balance speaks of signs and delays.
const CLEAR: f64 = 0.5;
/// Share from which the balance tells a log that no drive makes: a ripple or a foreign torque takes more than the rest of it.
const SURE: f64 = 0.8;
/// Delays that are tried, samples.
const DELAYS: i32 = 64;
/// Delay that is worth a word, samples.
const LATE: i32 = 2;
/// Motion before its torque by more than this, or behind it by more than [`BEHIND`], is a misaligned log, samples.
const AHEAD: i32 = 3;
/// Largest delay that a drive has, samples.
const BEHIND: i32 = 48;

/// Columns of the spectra.
pub(super) const T: usize = 0;
pub(super) const MAIN: usize = 1;
const SIGN: usize = 2;
pub(super) const TABLE: usize = 3;

/// Looks at torque and motion; gives the band in which the motion follows, Hz, and puts down the inertia that moves where it
/// shows.
pub(super) fn examine(input: &Input<'_>, inertia: &mut Option<f64>, findings: &mut Vec<Finding>) -> Option<[f64; 2]> {
    let torque = input.torque?;
    let n = torque.len();
    let rate = |x: Option<&[f64]>, v: Option<&[f64]>| -> Option<Vec<f64>> {
        match (x, v) {
            (Some(x), _) => Some((0..n - 1).map(|k| (x[k + 1] - x[k]) / input.dt).collect()),
            (None, Some(v)) => Some((0..n - 1).map(|k| 0.5 * (v[k] + v[k + 1])).collect()),
            (None, None) => None,
        }
    };
    let one = rate(input.theta1, input.omega1);
    let two = rate(input.theta2, input.omega2);
    times(input, findings);
    let collocated = one.is_some();
    let (main, table) = match (&one, &two) {
        (Some(a), b) => (a, b.as_ref()),
        (None, Some(b)) => (b, None),
        (None, None) => return None,
    };
    directions(main, findings);
    let quiet = 0.02 * quantile(main.iter().copied(), 0.9);
    let sign: Vec<f64> = main.iter().map(|v| if v.abs() <= quiet { 0.0 } else { v.signum() }).collect();
    let mut columns: Vec<&[f64]> = vec![&torque[..n - 1], main, &sign];
    columns.extend(table.map(Vec::as_slice));
    let lengths = [power_of_two((n - 1) / 8).clamp(32, 8192), power_of_two((n - 1) / 3).clamp(32, 65_536)];
    let of_lines = || {
        lengths.into_iter().find_map(|length| {
            let spectra = Spectra::new(&columns, length, input.dt);
            let found = coherent(&spectra);
            (!found.is_empty()).then_some((spectra, found))
        })
    };
    let (nominal, lines) = rayon::join(|| rigid::weigh(input), of_lines);
    let Some((spectra, lines)) = lines else {
        whole_record(input, &columns, collocated, nominal, inertia, findings);
        return None;
    };
    // A line that stands alone passed by chance.
    let adjacent: Vec<usize> = lines.windows(3).filter(|w| w[2] - w[0] == 2).map(|w| w[1]).collect();
    let [first, last] = match (adjacent.first(), adjacent.last()) {
        (Some(first), Some(last)) => [*first, *last],
        _ => [lines[0], lines[lines.len() - 1]],
    };
    let band = [first, last].map(|f| spectra.omega(f) / std::f64::consts::TAU);
    if table.is_some() {
        encoders(input, &spectra, &lines, findings);
    }
    *inertia = believed(nominal, weigh(input, &spectra, &lines, collocated), findings);
    excitation(input.nominal, band, findings);
    Some(band)
}

/// A record without lines that averages could show: too short for its slow motion, or of a foreign torque. The balance is
/// asked of the record as a whole, at the lines that hold the motion; few lines say nothing.
fn whole_record(
    input: &Input<'_>,
    columns: &[&[f64]],
    collocated: bool,
    nominal: Option<Weight>,
    inertia: &mut Option<f64>,
    findings: &mut Vec<Finding>,
) {
    let spectra = Spectra::new(columns, transformable(columns[0].len()), input.dt);
    // Acceleration is noise above the motion's band: the lines that hold nearly all of the speed.
    let total: f64 = (0..spectra.lines).map(|f| spectra.power(MAIN, f)).sum();
    let mut sum = 0.0;
    let lines: Vec<usize> = (0..spectra.lines)
        .take_while(|f| {
            let take = sum < 0.98 * total;
            sum += spectra.power(MAIN, *f);
            take
        })
        .collect();
    if lines.len() < LEAST_LINES {
        findings.extend(slowly(input));
        let nothing = if nominal.is_some() { Vec::new() } else { vec![too_short(lines.len())] };
        believed(nominal, (None, nothing), findings);
        return;
    }
    if spectra.has(TABLE) {
        findings.extend(counted(input, &spectra, &lines).1);
    }
    *inertia = believed(nominal, weigh(input, &spectra, &lines, collocated), findings);
}

/// Even number of samples, all of `n` or, of a long record, a little fewer: a length with a large prime factor is transformed several
/// times as slowly.
fn transformable(n: usize) -> usize {
    if n < 1 << 16 {
        return n / 2 * 2;
    }
    let odd = (0..6).flat_map(|threes| (0..6).map(move |fives| 3_usize.pow(threes) * 5_usize.pow(fives)));
    odd.filter(|odd| 2 * odd <= n).map(|odd| odd << (n / odd).ilog2()).max().unwrap_or(n / 2 * 2)
}

/// What a balance of free coefficients found, but of sign and unit what the nominal axis says of them, where it says anything.
fn believed(
    nominal: Option<Weight>,
    (inertia, found): (Option<f64>, Vec<Finding>),
    findings: &mut Vec<Finding>,
) -> Option<f64> {
    let known = nominal.is_some();
    findings.extend(found.into_iter().filter(|f| !(known && ["sign", "units", "inertia"].contains(&f.id))));
    // An encoder that counts in another unit than the motor's makes both of one inertia: it is what is wrong.
    let of_the_table = findings.iter().any(|f| f.severity == Severity::Refuse && f.signal == "theta2");
    match nominal {
        Some(Weight::Wrong(finding)) if !of_the_table => {
            let kept = inertia.filter(|_| finding.id != "sign");
            findings.push(finding);
            kept
        }
        _ => inertia,
    }
}

/// A record whose motion so few lines hold that nothing is said of its torque.
fn too_short(lines: usize) -> Finding {
    Finding::new(
        "too_short",
        Severity::Note,
        "T",
        format!("The motion is so slow, or the record so short, that {} lines of its spectrum hold it.", lines),
        "Whether the torque is this axis' own cannot be told from so few.",
        "Record longer, with more reversals.",
    )
}

/// Lines below which the balance of a record as a whole says nothing: each of its six coefficients takes half a line.
const LEAST_LINES: usize = 12;

fn power_of_two(n: usize) -> usize {
    if n.is_power_of_two() { n } else { n.next_power_of_two() / 2 }
}

/// Lines at which the motion follows the torque; none where chance could make as many.
fn coherent(spectra: &Spectra) -> Vec<usize> {
    let least = spectra.by_chance().max(COHERENT);
    let of = |f: usize| {
        let table = if spectra.has(TABLE) { spectra.coherence(T, TABLE, f) } else { 0.0 };
        spectra.coherence(T, MAIN, f).max(table)
    };
    let floor = floor(spectra);
    let stands = |f: usize| position(spectra, f) > STANDS * floor;
    let lines: Vec<usize> = (0..spectra.lines).filter(|f| of(*f) > least && stands(*f)).collect();
    // By chance one line of three hundred (two channels: of a hundred and fifty) passes; neighbours under one window pass
    // together.
    let chance = 3.0 + 0.02 * spectra.lines as f64;
    // A band counts where it holds together: the best octave.
    let mut best = 0.0_f64;
    let mut low = 1;
    while low <= spectra.lines {
        let high = (2 * low).min(spectra.lines + 1);
        if high - low >= 4 {
            let inside = lines.iter().filter(|f| (low..high).contains(&(*f + 1))).count();
            best = best.max(inside as f64 / (high - low) as f64);
        }
        low *= 2;
    }
    // Lines beside the motion are those of its noise: a controller answers it.
    let moved = |of: &mut dyn Iterator<Item = usize>| of.map(|f| position(spectra, f)).sum::<f64>();
    let main = moved(&mut lines.iter().copied()) > MOVED * moved(&mut (0..spectra.lines));
    if main && ((lines.len() as f64) > chance || best >= 0.5) { lines } else { Vec::new() }
}

/// Power of the position at a line.
fn position(spectra: &Spectra, f: usize) -> f64 {
    spectra.power(MAIN, f) / spectra.omega(f).powi(2)
}

/// Share of the position's power that coherent lines must hold to be those of the axis' motion.
const MOVED: f64 = 1e-3;

/// Power of the position from which a line is one of motion, over the encoder's floor.
const STANDS: f64 = 4.0;

/// Power of the encoder's noise where the upper half of the spectrum is flat with it, else nothing. Under control the torque follows
/// that noise: coherent, and with the controller's sign instead of the axis'.
fn floor(spectra: &Spectra) -> f64 {
    let level = |from: f64, to: f64| {
        let of = |share: f64| (share * spectra.lines as f64) as usize;
        // A difference lowers the upper lines of white noise: 2*sin(w*dt/2)/dt stands for w.
        let half = std::f64::consts::FRAC_PI_2 / (spectra.lines + 1) as f64;
        quantile(
            (of(from)..of(to)).map(|f| {
                let x = half * (f + 1) as f64;
                position(spectra, f) * (x / x.sin()).powi(2)
            }),
            0.5,
        )
    };
    let (middle, top) = (level(0.4, 0.6), level(0.8, 1.0));
    if middle < STANDS * top { top } else { 0.0 }
}

/// Times that cannot belong to the nominal axis.
fn times(input: &Input<'_>, findings: &mut Vec<Finding>) {
    let Some(Nominal { structure: Structure::TwoInertia, parameters: p }) = input.nominal else { return };
    let natural = (p.k * (1.0 / p.i1 + 1.0 / p.i2)).sqrt();
    let duration = input.dt * input.len() as f64;
    let say = |seen: String| {
        Finding::new(
            "units",
            Severity::Refuse,
            "time",
            seen,
            "The unit of the time column, or the nominal stiffness or inertia, is another than the files say.",
            "Give the unit in the header, as in time [ms], or mend [parameters] of the axis file.",
        )
    };
    if natural * input.dt > std::f64::consts::PI {
        let hertz = natural / std::f64::consts::TAU;
        findings.push(say(format!(
            "The nominal axis swings at {} Hz, the record is sampled every {} s: it could not show it.",
            told(hertz),
            told(input.dt)
        )));
    } else if natural * duration < 1.0 {
        findings.push(say(format!(
            "The whole record lasts {duration:.3e} s, a small part of one swing of the nominal axis."
        )));
    }
}

/// One direction only.
fn directions(speed: &[f64], findings: &mut Vec<Finding>) {
    let size = quantile(speed.iter().copied(), 0.9);
    let smooth: Vec<f64> =
        speed.chunks((speed.len() / 2000).max(1)).map(|c| c.iter().sum::<f64>() / c.len() as f64).collect();
    let forward = smooth.iter().filter(|v| **v > 0.1 * size).count() as f64;
    let back = smooth.iter().filter(|v| **v < -0.1 * size).count() as f64;
    if forward.min(back) < 0.01 * forward.max(back) && span(speed) > 0.0 {
        findings.push(Finding::new(
            "one_direction",
            Severity::Warn,
            "theta1",
            "The axis moves in one direction only.",
            "Coulomb friction and a constant load cannot be told from each other on this record.",
            "Record a motion to and fro.",
        ));
    }
}

/// The balance of one record: regressors, lines and what they hold.
struct MomentumBalance<'a> {
    s: &'a Spectra,
    lines: &'a [usize],
    collocated: bool,
    /// Frequency of the table's resonance against the motor, rad/s, where there is no encoder on the table.
    table: Option<f64>,
    total: f64,
}

/// What a balance found.
struct Found {
    /// M1, M2, c, F, k, -k.
    x: Vec<f64>,
    /// Share of the torque's power that is explained.
    share: f64,
    /// Share that the inertias alone explain of it.
    inertial: f64,
}

impl MomentumBalance<'_> {
    /// The regressors at a line: column and factor.
    fn regressors(&self, f: usize) -> [(usize, Complex<f64>); 6] {
        let w = self.s.omega(f);
        let j = Complex::new(0.0, w);
        let one = Complex::new(1.0, 0.0);
        let second = if self.s.has(TABLE) {
            (TABLE, j)
        } else if self.collocated {
            let wa = self.table.unwrap_or(f64::INFINITY);
            let r = w / wa;
            // A hundredth of the critical damping keeps the line at the resonance finite.
            (MAIN, if wa.is_finite() { j / Complex::new(1.0 - r * r, 0.04 * r) } else { Complex::new(0.0, 0.0) })
        } else {
            (MAIN, j * j * j)
        };
        [(MAIN, j), second, (MAIN, one), (SIGN, one), (MAIN, one / j), (MAIN, -one / j)]
    }

    fn gram(&self) -> Vec<Vec<f64>> {
        let mut gram = vec![vec![0.0; 6]; 6];
        for &f in self.lines {
            let of = self.regressors(f);
            for i in 0..6 {
                for k in 0..6 {
                    gram[i][k] += (of[i].1.conj() * of[k].1 * self.s.of(of[i].0, of[k].0, f)).re;
                }
            }
        }
        gram
    }

    /// Right side for a motion that is late by `late` seconds, with the torque's sign as given.
    fn right(&self, late: f64) -> Vec<f64> {
        let mut right = vec![0.0; 6];
        for &f in self.lines {
            let turn = Complex::from_polar(1.0, -self.s.omega(f) * late);
            for (r, (column, factor)) in right.iter_mut().zip(self.regressors(f)) {
                *r += (factor.conj() * self.s.of(column, T, f) * turn).re;
            }
        }
        right
    }

    /// [`Self::right`] for a motion that is late by `-most` to `most` samples of `dt`, each: from one to the next the phase of a
    /// line turns by the same angle, so that a line's sines and cross spectra are asked for once; as far before as behind, the
    /// sine alone changes its sign.
    fn rights(&self, dt: f64, most: usize) -> Vec<[f64; 6]> {
        let mut rights = vec![[0.0; 6]; 2 * most + 1];
        // From the middle outwards, before and behind.
        let (before, rest) = rights.split_at_mut(most);
        let Some((middle, behind)) = rest.split_first_mut() else { return rights };
        for &f in self.lines {
            let terms = self.regressors(f).map(|(column, factor)| factor.conj() * self.s.of(column, T, f));
            let turn = Complex::from_polar(1.0, self.s.omega(f) * dt);
            let mut phase = turn;
            for (r, term) in middle.iter_mut().zip(&terms) {
                *r += term.re;
            }
            for (early, late) in before.iter_mut().rev().zip(behind.iter_mut()) {
                for ((e, l), term) in early.iter_mut().zip(late.iter_mut()).zip(&terms) {
                    let (even, odd) = (term.re * phase.re, term.im * phase.im);
                    *e += even - odd;
                    *l += even + odd;
                }
                phase *= turn;
            }
        }
        rights
    }

    fn solve(&self, gram: &[Vec<f64>], right: &[f64]) -> Found {
        self.within(gram, right, [[0.0, f64::INFINITY]; 2])
    }

    /// The balance with M1 and M2 within bounds.
    fn within(&self, gram: &[Vec<f64>], right: &[f64], inertias: [[f64; 2]; 2]) -> Found {
        // Columns of unit size, so that one bound serves all.
        let size: Vec<f64> = (0..6).map(|i| gram[i][i].sqrt().max(f64::MIN_POSITIVE)).collect();
        let scaled: Vec<Vec<f64>> = (0..6).map(|i| (0..6).map(|k| gram[i][k] / size[i] / size[k]).collect()).collect();
        let right: Vec<f64> = (0..6).map(|i| right[i] / size[i]).collect();
        let (mut low, mut high) = ([0.0; 6], [f64::INFINITY; 6]);
        for (i, [least, most]) in inertias.into_iter().enumerate() {
            (low[i], high[i]) = (least * size[i], most * size[i]);
        }
        let (x, explained) = bounded(&scaled, &right, &low, &high);
        let inertia: f64 = (0..2).map(|i| (0..2).map(|k| x[i] * scaled[i][k] * x[k]).sum::<f64>()).sum();
        Found {
            x: (0..6).map(|i| x[i] / size[i]).collect(),
            share: explained / self.total,
            inertial: inertia / self.total,
        }
    }
}

/// Averages from which a delay is told from the phase of a slow motion.
const AVERAGED: f64 = 3.0;

/// Signs, delay and size of the torque; gives the inertia that moves, where it makes a part of the torque.
fn weigh(input: &Input<'_>, s: &Spectra, lines: &[usize], collocated: bool) -> (Option<f64>, Vec<Finding>) {
    let mut findings = Vec::new();
    let inertia = balance(input, s, lines, collocated, &mut findings);
    // What the nominal axis explains has nothing wrong with it, whatever a balance of free coefficients makes of a resonance.
    if explains(input, s, lines) {
        findings.clear();
    }
    (inertia, findings)
}

/// The balance of free coefficients.
fn balance(
    input: &Input<'_>,
    s: &Spectra,
    lines: &[usize],
    collocated: bool,
    findings: &mut Vec<Finding>,
) -> Option<f64> {
    let total: f64 = lines.iter().map(|f| s.power(T, *f)).sum();
    let mut balance = MomentumBalance { s, lines, collocated, table: None, total };
    if total <= 0.0 {
        return None;
    }
    let rigid = input.nominal.is_some_and(|n| n.structure == Structure::Rigid);
    let negative = |right: &[f64]| right.iter().map(|r| -r).collect::<Vec<_>>();
    if collocated && !s.has(TABLE) && !rigid {
        // The frequency of the table against a held motor that explains most, with either sign.
        let (low, high) = (s.omega(lines[0]), s.omega(lines[lines.len() - 1]));
        let mut best = (0.0, None);
        for i in 0..=24 {
            let wa = low * (high / low).powf(f64::from(i) / 24.0);
            balance.table = Some(wa);
            let (gram, right) = (balance.gram(), balance.right(0.0));
            let share = balance.solve(&gram, &right).share.max(balance.solve(&gram, &negative(&right)).share);
            if share > best.0 {
                best = (share, Some(wa));
            }
        }
        balance.table = best.1;
    }
    let gram = balance.gram();
    let at = |late: i32| balance.right(f64::from(late) * input.dt);
    let mut shares: Vec<(i32, f64, f64)> = Vec::new();
    // Beyond a quarter of a window what it holds of the two is no more the same.
    let tried = DELAYS.min(s.lines as i32 / 2);
    for (late, right) in (-tried..=tried).zip(balance.rights(input.dt, tried.unsigned_abs() as usize)) {
        shares.push((late, balance.solve(&gram, &right).share, balance.solve(&gram, &negative(&right)).share));
    }
    let best = |of: &dyn Fn(&(i32, f64, f64)) -> f64, within: i32| {
        shares
            .iter()
            .filter(|s| s.0.abs() <= within)
            .max_by(|a, b| of(a).total_cmp(&of(b)))
            .map_or((0, 0.0), |s| (s.0, of(s)))
    };
    let plus = best(&|s| s.1, DELAYS);
    let here = best(&|s| s.1, 1);
    let turned = best(&|s| s.2, 1);
    let turned_anywhere = best(&|s| s.2, DELAYS);
    let backwards = turned.1 > CLEAR && 1.0 - turned.1 < 0.5 * (1.0 - plus.1);
    // On a hinge a weight above the axis pushes away from rest, as no spring does; its torque is told in time, over the angle.
    if backwards && !rigid::follows(input) {
        // A table that swings against its motor under control can pass for an axis turned round: where the torque as it is explains the
        // most of the motion, too, that is a doubt.
        let sure = plus.1 < CLEAR;
        findings.push(Finding::new(
            "sign",
            if sure { Severity::Refuse } else { Severity::Warn },
            "T",
            format!(
                "The motion follows the torque backwards: turned round, it explains {:.0} % of it, as it is {:.0} %.",
                100.0 * turned.1,
                100.0 * here.1.max(0.0)
            ),
            "Torque and position count in opposite directions: inertia and friction would come out negative.",
            "Give the torque, or all motion, scale = -1 in [signals] of the axis file.",
        ));
        if sure {
            return None;
        }
    }
    // Six coefficients explain some of any torque: each half a line of a single spectrum, less of an averaged one.
    let by_chance = 3.0 / (lines.len() as f64 * s.averages);
    let motor = || if s.has(TABLE) { 1.0 - motor_side(s, lines, MAIN, TABLE) } else { 0.0 };
    let explained = |share: f64| share >= EXPLAINED + by_chance;
    if !explained(plus.1.max(turned_anywhere.1)) && !explained(motor()) && !rigid::follows(input) {
        findings.push(Finding::new(
            "not_followed",
            Severity::Refuse,
            "T",
            format!(
                "No axis moves like this under this torque: inertia, friction and a spring explain {:.0} % of it.",
                100.0 * plus.1.max(0.0)
            ),
            "The torque comes from another axis, another time or another quantity; or something else moves the axis.",
            "Map the column of this axis' own torque or current in [signals], logged at the same times.",
        ));
        return None;
    }
    let wide = s.omega(lines[lines.len() - 1]) > 2.0 * s.omega(lines[0]);
    let clocked = wide && s.averages >= AVERAGED;
    // The best of those tried at their very end is no best.
    let between = plus.0.abs() < tried;
    if clocked && between && plus.0.abs() >= LATE && plus.1 > CLEAR && 1.0 - plus.1 < 0.6 * (1.0 - here.1) {
        let late = f64::from(plus.0.abs()) * input.dt;
        let (ahead, behind) = (plus.0 < -AHEAD, plus.0 > BEHIND);
        findings.push(Finding::new(
            "misaligned",
            // Under control the torque answers what else moves the axis, later than it did: a record that makes sense as it is is one.
            if (ahead || behind) && plus.1 > SURE && here.1 < CLEAR { Severity::Refuse } else { Severity::Warn },
            "T",
            if plus.0 < 0 {
                format!("The motion comes about {} samples ({late:.4e} s) before its torque.", -plus.0)
            } else {
                format!("The motion comes about {} samples ({late:.4e} s) behind its torque.", plus.0)
            },
            if plus.0 < 0 {
                "No axis does that: torque and positions were logged at different instants."
            } else {
                "A delay of the drive, or torque and positions were logged at different instants."
            },
            "Log torque and positions in one task; a known delay of the drive belongs into [effects.delay] of the axis file.",
        ));
    }
    let late = if clocked && between { plus.0 } else { here.0 };
    let found = balance.solve(&gram, &at(late));
    let mass = found.x[0] + if collocated { found.x[1] } else { 0.0 };
    // Shares of the torque from which the inertia shows at all, and from which it speaks of units.
    let shown = (found.inertial > 0.05 && mass > 0.0 && mass.is_finite()).then_some(mass);
    let (Some(nominal), true) = (input.nominal, found.inertial > 0.3) else { return shown };
    let p = nominal.parameters;
    let ratio = mass / (p.i1 + p.i2);
    if ratio <= 0.0 || !ratio.is_finite() || (1.0 / NOMINAL_OFF..NOMINAL_OFF).contains(&ratio) {
        return shown;
    }
    // Beside a resonance that is off, a ripple or a foreign torque the inertia is what the others leave of it.
    let near = |m: f64| [m / NOMINAL_OFF, m * NOMINAL_OFF];
    let both = collocated && !rigid;
    let bounds = if both { [near(p.i1), near(p.i2)] } else { [near(p.i1 + p.i2), [0.0, f64::INFINITY]] };
    let own = balance.within(&gram, &at(late), bounds).share;
    if 1.0 - own <= WORSE * (1.0 - found.share) {
        return shown;
    }
    findings.push(other_unit(input, mass, ratio, false));
    shown
}

/// Parameters that the band cannot tell.
fn excitation(nominal: Option<Nominal>, band: [f64; 2], findings: &mut Vec<Finding>) {
    let Some(Nominal { structure: Structure::TwoInertia, parameters: p }) = nominal else { return };
    let anti = (p.k / p.i2).sqrt() / std::f64::consts::TAU;
    if band[1] < 0.3 * anti {
        findings.push(Finding::new(
            "no_excitation",
            Severity::Warn,
            "T",
            format!(
                "The motion follows the torque up to {} Hz; the nominal coupling shows from some {} Hz on.",
                told(band[1]),
                told(0.3 * anti)
            ),
            "Stiffness and damping of the coupling are not determined by this record, nor how the inertia is shared.",
            format!("Excite up to {} Hz (`eixo excite`), or describe the axis as rigid.", told(1.5 * anti)),
        ));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_delay_of_many_is_that_of_one() {
        let n = 512;
        let torque: Vec<f64> = (0..n).map(|k| (0.3 * k as f64).sin() + (0.05 * (k * k % 97) as f64)).collect();
        let speed: Vec<f64> =
            (0..n).map(|k| torque[usize::saturating_sub(k, 3)] + 0.2 * (0.7 * k as f64).cos()).collect();
        let sign: Vec<f64> = speed.iter().copied().map(f64::signum).collect();
        let dt = 1e-3;
        let spectra = Spectra::new(&[&torque, &speed, &sign], 128, dt);
        let lines: Vec<usize> = (2..50).collect();
        let balance = MomentumBalance { s: &spectra, lines: &lines, collocated: true, table: Some(700.0), total: 1.0 };
        for (right, late) in balance.rights(dt, 5).into_iter().zip(-5..=5) {
            let one = balance.right(f64::from(late) * dt);
            let size = one.iter().fold(0.0_f64, |a, b| a.max(b.abs()));
            for (a, b) in right.iter().zip(&one) {
                assert!((a - b).abs() < 1e-12 * size, "{late}: {right:?} against {one:?}");
            }
        }
    }

    #[test]
    fn a_long_record_is_cut_to_a_length_of_small_factors() {
        for n in [100_003, 999_999, 3_000_017] {
            let length = transformable(n);
            assert!(length <= n && length > n - n / 50 && length.is_multiple_of(2), "{n}: {length}");
            let mut rest = length;
            for factor in [2, 3, 5] {
                while rest.is_multiple_of(factor) {
                    rest /= factor;
                }
            }
            assert_eq!(rest, 1, "{n}: {length}");
        }
        assert_eq!(transformable(4001), 4000);
    }
}
