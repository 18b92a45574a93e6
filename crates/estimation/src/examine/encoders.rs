//! The encoder of the table beside that of the motor.

use rustfft::num_complex::Complex;

use super::finding::{Finding, Severity};
use super::least::non_negative;
use super::momentum::{COHERENT, MAIN, T, TABLE};
use super::motor_side::{feels_the_table, rather_as_logged};
use super::nominal::explains_the_table;
use super::pairs::{NEAR, factor_within};
use super::rigid::{Slow, rigid_up_to};
use super::spectra::Spectra;
use super::{Input, Structure};
use crate::numerics::level::deviation;

/// Twist over motion, both about their means, up to which the table goes along with the motor whatever their spectra say: of a slow
/// motion the spectra of the speed hold little but noise.
const ALONG: f64 = 0.05;

fn goes_along(input: &Input<'_>) -> bool {
    let (Some(x1), Some(x2)) = (input.theta1, input.theta2) else { return false };
    let twist: Vec<f64> = x1.iter().zip(x2).map(|(a, b)| a - b).collect();
    deviation(&twist) < ALONG * deviation(x1)
}

/// Coherence of both encoders over all lines of slow motion from which they are of one body.
const ONE_BODY: f64 = 0.9;

/// How many times as far as the motor the table moves below the nominal coupling's resonance, where both are one body; None where the
/// record does not show that.
fn of_one_body(input: &Input<'_>) -> Option<f64> {
    let (Some(x1), Some(x2)) = (input.theta1, input.theta2) else { return None };
    let slow = Slow::new(&[x1, x2], 0..2, input.dt, rigid_up_to(input.nominal?))?;
    let sum = |i: usize, k: usize| slow.lines.iter().map(|f| slow.spectra.of(i, k, *f)).sum::<Complex<f64>>();
    let (one, two, both) = (sum(0, 0).re, sum(1, 1).re, sum(0, 1));
    (both.re * both.re > ONE_BODY * one * two).then(|| both.re / one)
}

/// What the slow motion says of the two encoders alone, where the record is too short for more.
pub(super) fn slowly(input: &Input<'_>) -> Option<Finding> {
    let ratio = of_one_body(input)?;
    miscounted(input, ratio, ratio < 0.0).filter(|_| !rather_as_logged(input, 1.0 / ratio, 1.0))
}

/// What is wrong where the table moves so many times as far as the motor: it counts the other way round, or in another unit.
fn miscounted(input: &Input<'_>, ratio: f64, turned: bool) -> Option<Finding> {
    if turned && (-2.0..-0.5).contains(&ratio) {
        return Some(Finding::new(
            "sign",
            Severity::Refuse,
            "theta2",
            "theta2 runs against theta1.",
            "One of the two encoders counts the other way round.",
            "Give its column scale = -1 in [signals] of the axis file.",
        ));
    }
    unit(input, ratio)
}

/// How many times as far as the motor the table moves, beside what its coupling makes of it, by the lines that show both; and what is
/// wrong with that: it counts the other way round, or in another unit. What else acts on the table may move it any way; where the motor's
/// side has it as it is logged, nothing is wrong.
pub(super) fn counted(input: &Input<'_>, s: &Spectra, lines: &[usize]) -> (f64, Option<Finding>) {
    let (ratio, finding) = moves_along(input, s, lines);
    let alike = (LIKE.recip()..LIKE).contains(&ratio.abs()) && finding.is_none();
    if !alike && rather_as_logged(input, 1.0 / ratio, 1.0) { (1.0, None) } else { (ratio, finding) }
}

/// The same by the two encoders alone.
fn moves_along(input: &Input<'_>, s: &Spectra, lines: &[usize]) -> (f64, Option<Finding>) {
    if let Some(ratio) = of_one_body(input) {
        return (ratio, miscounted(input, ratio, ratio < 0.0));
    }
    // Where the coupling is stiff to the motion both turn alike: the lowest lines that hold a tenth of the motor's motion.
    let total: f64 = lines.iter().map(|f| s.power(MAIN, *f)).sum();
    let mut sum = 0.0;
    let low: Vec<usize> = lines
        .iter()
        .copied()
        .take_while(|f| {
            let take = sum < 0.1 * total;
            sum += s.power(MAIN, *f);
            take
        })
        .collect();
    let Some(&middle) = low.get(low.len() / 2) else { return (1.0, None) };
    let cross: Complex<f64> = low.iter().map(|f| s.of(MAIN, TABLE, *f)).sum();
    let power: f64 = low.iter().map(|f| s.power(MAIN, *f)).sum();
    let gain = cross / power;
    let expected = input.nominal.filter(|n| n.structure == Structure::TwoInertia).map_or(1.0, |n| {
        let p = n.parameters;
        let w = s.omega(middle);
        let spring = Complex::new(p.k, w * p.b);
        (spring / (spring - p.i2 * w * w)).re
    });
    // Near the table's resonance against the motor, and above it, the size and the sign of its motion are the coupling's.
    let ratio = if (0.5..2.0).contains(&expected) { gain.re / expected } else { 1.0 };
    // Phase near a half turn at the lowest lines, and a size that the antiresonance has not taken yet.
    let turned = gain.re < 0.0 && gain.im.abs() < 0.5 * gain.re.abs();
    (ratio, miscounted(input, ratio, turned))
}

/// The same for a table that moves less than the motor, in the logarithm of the ratio: friction that holds it on a soft coupling leaves it any
/// share of the motor's way, a unit just one.
const HELD: f64 = 0.02;
/// Ratio of two motions up to which they are alike.
const LIKE: f64 = 1.67;
/// Table over motor, both of one body below half the nominal antiresonance, from which the two count different angles: the coupling makes
/// 4/3 of it there, or 2 where its stiffness is half the nominal one.
const GEARED: f64 = 3.0;

/// That the table moves so many times as far as the motor because one of them is in another unit.
fn unit(input: &Input<'_>, ratio: f64) -> Option<Finding> {
    let rho = input.nominal.map(|n| n.parameters.rho).filter(|r| *r > 0.0 && (r - 1.0).abs() > 0.5);
    let lead = rho.filter(|r| (ratio.abs().ln().abs() - r.ln().abs()).abs() < NEAR);
    let words = lead
        .map(|r| format!("{r}, the lead of the screw (x2 for theta2)"))
        .or_else(|| factor_within(ratio, if ratio.abs() < 1.0 { HELD } else { NEAR }).map(str::to_owned))
        .filter(|_| ratio.abs() > 4.0 || ratio.abs() < 0.25)?;
    Some(Finding::new(
        "units",
        Severity::Refuse,
        "theta2",
        format!("theta2 moves {ratio:.4e} times as far as theta1, which looks like a factor of {words}."),
        "One of the two columns is in another unit than the file says.",
        "Give the unit in the header or in [signals] (unit = \"deg\"), or scale by the gear ratio.",
    ))
}

/// The two encoders against each other: sign, scale, and which one is the motor's.
pub(super) fn encoders(input: &Input<'_>, s: &Spectra, lines: &[usize], findings: &mut Vec<Finding>) {
    let coherent: Vec<usize> =
        (0..s.lines).filter(|f| s.coherence(MAIN, TABLE, *f) > s.by_chance().max(COHERENT)).collect();
    // At the lines where the torque moves anything: does the table move with the motor, or with the torque? A table that is
    // moved by something else as well (a stop, stick and slip) still does at some, or where most of the motion is.
    let chance = s.by_chance();
    let own = lines.iter().filter(|f| s.coherence(MAIN, TABLE, **f).max(s.coherence(T, TABLE, **f)) > chance).count();
    let driven = || 0..=lines[lines.len() - 1];
    let common: f64 = driven().map(|f| s.power(MAIN, f) * s.coherence(MAIN, TABLE, f)).sum();
    let motion: f64 = driven().map(|f| s.power(MAIN, f)).sum();
    let unlike = (own as f64) < 0.1 * lines.len() as f64 && common < chance.max(0.3) * motion;
    // A table that friction holds, or that swings on a soft belt, twists the coupling as the torque says.
    if unlike && !goes_along(input) && !explains_the_table(input, s, lines) && !feels_the_table(input) {
        findings.push(Finding::new(
            "foreign",
            Severity::Refuse,
            "theta2",
            "theta2 does not follow theta1 where the torque moves it.",
            "It comes from another axis or another time, or one of the encoders is broken.",
            "Map the right columns in [signals], or leave theta2 out.",
        ));
        return;
    }
    if coherent.is_empty() {
        return;
    }
    let (ratio, finding) = counted(input, s, &coherent);
    if let Some(finding) = finding {
        findings.push(finding);
        return;
    }
    if !(LIKE.recip()..LIKE).contains(&ratio.abs()) {
        // Nothing that acts on a table makes it go so much further than the motor that moves it.
        let geared = of_one_body(input).is_some_and(|r| r.abs() > GEARED) && ratio.abs() > GEARED;
        findings.push(Finding::new(
            "scale",
            if geared { Severity::Refuse } else { Severity::Warn },
            "theta2",
            format!("theta2 moves {ratio:.4} times as far as theta1 at the lowest frequencies."),
            "A gear lies between the encoders, or the record holds no motion slow enough to tell.",
            "Give theta2 the gear's ratio as scale in [signals], so that both count the same angle.",
        ));
    }
    // The table is moved by the twist alone: I2*a2 = B*d' + K*d. Which of the two is?
    let misfit = |of: usize, sense: f64| -> f64 {
        let (mut aa, mut ad, mut dd, mut av, mut dv, mut vv) = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
        for &f in lines.iter().filter(|f| s.coherence(MAIN, TABLE, **f) > COHERENT) {
            let w = s.omega(f);
            let j = Complex::new(0.0, w);
            // Spectra of a (of the channel), d = (v1 - v2)/(jw), d' = v1 - v2.
            let twist_twist = s.power(MAIN, f) + s.power(TABLE, f) - 2.0 * s.of(MAIN, TABLE, f).re;
            let own_twist = (s.of(of, MAIN, f) - s.of(of, TABLE, f)) * sense;
            aa += w * w * s.power(of, f);
            // conj(a)*d = conj(jw*v)*(v1 - v2)/(jw)
            ad += (j.conj() * own_twist / j).re;
            av += (j.conj() * own_twist).re;
            dd += twist_twist / (w * w);
            vv += twist_twist;
            dv += (twist_twist / j.conj()).re;
        }
        if aa <= 0.0 || dd <= 0.0 {
            return 1.0;
        }
        let gram = [vec![dd, dv], vec![dv, vv]];
        1.0 - non_negative(&gram, &[ad, av]).1 / aa
    };
    let (as_given, exchanged) = (misfit(TABLE, 1.0), misfit(MAIN, -1.0));
    // A blow on the table (the end of its travel) drives it as the torque drives a motor: the torque must speak for the
    // exchange, too.
    let unexplained = |motor: usize, table: usize| motor_side(s, lines, motor, table);
    let speaks = || unexplained(TABLE, MAIN) < 0.5 * unexplained(MAIN, TABLE);
    // A spring alone moves the table at most as far as the motor, slowly: one that moves further is not it.
    let may_be = ratio.abs() > LIKE.recip();
    if may_be && exchanged < 0.3 && as_given > 3.0 * exchanged && speaks() {
        findings.push(Finding::new(
            "swapped",
            Severity::Refuse,
            "theta1, theta2",
            "theta1 moves as a table does and theta2 as a motor: the twist drives theta1.",
            "The two encoders' columns are exchanged.",
            "Exchange them in [signals] of the axis file.",
        ));
    }
}

/// Share of the torque that the motor's side leaves unexplained: `T = I1*a + B*d' + K*d` holds whatever acts on the table.
pub(super) fn motor_side(s: &Spectra, lines: &[usize], motor: usize, table: usize) -> f64 {
    let (mut gram, mut right, mut size) = (vec![vec![0.0; 3]; 3], vec![0.0; 3], 0.0);
    for &f in lines {
        let j = Complex::new(0.0, s.omega(f));
        let one = Complex::new(1.0, 0.0);
        let of = [[(motor, j), (motor, j * 0.0)], [(motor, one), (table, -one)], [(motor, one / j), (table, -one / j)]];
        for (i, a) in of.iter().enumerate() {
            for (ca, fa) in a {
                right[i] += (fa.conj() * s.of(*ca, T, f)).re;
                for (k, b) in of.iter().enumerate() {
                    gram[i][k] += b.iter().map(|(cb, fb)| (fa.conj() * *fb * s.of(*ca, *cb, f)).re).sum::<f64>();
                }
            }
        }
        size += s.power(T, f);
    }
    // Columns of unit size.
    let unit: Vec<f64> = (0..3).map(|i| gram[i][i].max(f64::MIN_POSITIVE).sqrt()).collect();
    let gram: Vec<Vec<f64>> = (0..3).map(|i| (0..3).map(|k| gram[i][k] / unit[i] / unit[k]).collect()).collect();
    let right: Vec<f64> = (0..3).map(|i| right[i] / unit[i]).collect();
    1.0 - non_negative(&gram, &right).1 / size.max(f64::MIN_POSITIVE)
}
