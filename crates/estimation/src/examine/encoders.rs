//! The table's encoder against the motor's: sign, scale and exchange of the two columns.
//!
//! Positions are in rad (m), frequencies in rad/s. `s` holds the cross spectra of torque, motor speed, sign of the motor speed and table
//! speed ([`T`], [`MAIN`], [`TABLE`]); `lines` are indices into them. A ratio is that of table motion to motor motion, without unit.

use rustfft::num_complex::Complex;

use super::as_logged::explains_as_well_as_exchanged;
use super::finding::{Finding, Severity};
use super::least::non_negative;
use super::momentum::{COHERENT, MAIN, T, TABLE};
use super::motor_side::{coupling_explains_torque, fits_better_as_logged, motor_holds_coupling};
use super::nominal::nominal_explains_with_table;
use super::pairs::{NEAR, factor_within};
use super::rigid::{MotionLines, rigid_band};
use super::spectra::Spectra;
use super::{Input, Structure};
use crate::numerics::level::deviation;

/// Standard deviation of the twist over that of the motor angle up to which the table is taken to track the motor. The spectra are not
/// used for this: those of the speed of a slow motion are mostly noise.
const MAX_RELATIVE_TWIST: f64 = 0.05;

/// Whether the twist is small beside the motor's motion.
pub(super) fn table_tracks_motor(input: &Input<'_>) -> bool {
    let (Some(x1), Some(x2)) = (input.theta1, input.theta2) else { return false };
    let twist: Vec<f64> = x1.iter().zip(x2).map(|(a, b)| a - b).collect();
    deviation(&twist) < MAX_RELATIVE_TWIST * deviation(x1)
}

/// Coherence of both encoders, over all lines of slow motion, from which motor and table move as one rigid body.
const RIGID_COHERENCE: f64 = 0.9;

/// Ratio of the motions below the nominal coupling's antiresonance, where motor and table move as one rigid body. `None` without a nominal
/// model, or where the two are not coherent there.
fn rigid_body_ratio(input: &Input<'_>) -> Option<f64> {
    let (Some(x1), Some(x2)) = (input.theta1, input.theta2) else { return None };
    let slow = MotionLines::new(&[x1, x2], 0..2, input.dt, rigid_band(input.nominal?))?;
    let sum = |i: usize, k: usize| slow.lines.iter().map(|f| slow.spectra.of(i, k, *f)).sum::<Complex<f64>>();
    let (one, two, both) = (sum(0, 0).re, sum(1, 1).re, sum(0, 1));
    (both.re * both.re > RIGID_COHERENCE * one * two).then(|| both.re / one)
}

/// The finding on sign or unit that follows from the slow motion alone, for a record too short for averaged spectra.
pub(super) fn slow_motion_finding(input: &Input<'_>) -> Option<Finding> {
    let ratio = rigid_body_ratio(input)?;
    ratio_finding(input, ratio, ratio < 0.0).filter(|_| !fits_better_as_logged(input, 1.0 / ratio, 1.0))
}

/// The finding on sign or unit for a ratio of the motions; `turned`: the phase between the two is half a turn.
fn ratio_finding(input: &Input<'_>, ratio: f64, turned: bool) -> Option<Finding> {
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
    unit_finding(input, ratio)
}

/// Ratio of the motions at the lines where both encoders are coherent, divided by the ratio that the nominal coupling gives; and the
/// finding on sign or unit that follows. Torques on the table can cause any ratio: where the motor's equation of motion is fulfilled best by
/// the column as logged, the ratio is reported as 1 and there is no finding.
pub(super) fn encoder_ratio(input: &Input<'_>, s: &Spectra, lines: &[usize]) -> (f64, Option<Finding>) {
    let (ratio, finding) = ratio_by_encoders(input, s, lines);
    let alike = (COMPATIBLE_RATIO.recip()..COMPATIBLE_RATIO).contains(&ratio.abs()) && finding.is_none();
    if !alike && fits_better_as_logged(input, 1.0 / ratio, 1.0) { (1.0, None) } else { (ratio, finding) }
}

/// [`encoder_ratio`] from the two encoders alone, without the motor's equation of motion.
fn ratio_by_encoders(input: &Input<'_>, s: &Spectra, lines: &[usize]) -> (f64, Option<Finding>) {
    if let Some(ratio) = rigid_body_ratio(input) {
        return (ratio, ratio_finding(input, ratio, ratio < 0.0));
    }
    // Well below the resonance both move alike: the lowest lines, with a tenth of the motor's power.
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
    // Near the antiresonance and above, the coupling determines amplitude and sign of the table's motion.
    let ratio = if (0.5..2.0).contains(&expected) { gain.re / expected } else { 1.0 };
    // The phase at the lowest lines is near half a turn.
    let turned = gain.re < 0.0 && gain.im.abs() < 0.5 * gain.re.abs();
    (ratio, ratio_finding(input, ratio, turned))
}

/// Tolerance, in the logarithm of the ratio, within which a ratio below 1 is taken for a unit's factor. It is narrower than [`NEAR`]: friction
/// that holds the table on a soft coupling can cause any ratio below 1.
const HELD_TOLERANCE: f64 = 0.02;
/// Ratio of the motions, or its reciprocal, up to which it is compatible with one unit for both.
const COMPATIBLE_RATIO: f64 = 1.67;
/// Ratio of the motions below half the nominal antiresonance from which a gear lies between the encoders: there the coupling causes a ratio
/// of 4/3, or of 2 if its stiffness is half the nominal one.
const GEAR_RATIO: f64 = 3.0;

/// The finding that one of the columns is in another unit, where the ratio of the motions is near a unit's factor.
fn unit_finding(input: &Input<'_>, ratio: f64) -> Option<Finding> {
    let rho = input.nominal.map(|n| n.parameters.rho).filter(|r| *r > 0.0 && (r - 1.0).abs() > 0.5);
    let lead = rho.filter(|r| (ratio.abs().ln().abs() - r.ln().abs()).abs() < NEAR);
    let meaning = lead
        .map(|r| format!("{r}, the lead of the screw (x2 for theta2)"))
        .or_else(|| factor_within(ratio, if ratio.abs() < 1.0 { HELD_TOLERANCE } else { NEAR }).map(str::to_owned))
        .filter(|_| ratio.abs() > 4.0 || ratio.abs() < 0.25)?;
    Some(Finding::new(
        "units",
        Severity::Refuse,
        "theta2",
        format!("theta2 moves {ratio:.4e} times as far as theta1, which looks like a factor of {meaning}."),
        "One of the two columns is in another unit than the file says.",
        "Give the unit in the header or in [signals] (unit = \"deg\"), or scale by the gear ratio.",
    ))
}

/// The two encoders against each other: sign, scale, and which one is the motor's.
pub(super) fn compare_encoders(input: &Input<'_>, s: &Spectra, lines: &[usize], findings: &mut Vec<Finding>) {
    let coherent: Vec<usize> =
        (0..s.lines).filter(|f| s.coherence(MAIN, TABLE, *f) > s.by_chance().max(COHERENT)).collect();
    // Is the table coherent with motor or torque at the lines that the torque excites? One that another force acts on as well (an end
    // stop, stick-slip) still is at some of them, or at those with most of the power.
    let chance = s.by_chance();
    let own = lines.iter().filter(|f| s.coherence(MAIN, TABLE, **f).max(s.coherence(T, TABLE, **f)) > chance).count();
    let driven = || 0..=lines[lines.len() - 1];
    let common: f64 = driven().map(|f| s.power(MAIN, f) * s.coherence(MAIN, TABLE, f)).sum();
    let motion: f64 = driven().map(|f| s.power(MAIN, f)).sum();
    let unlike = (own as f64) < 0.1 * lines.len() as f64 && common < chance.max(0.3) * motion;
    // For a table held by friction, or oscillating on a soft belt, the twist of the coupling still explains the torque.
    if unlike
        && !table_tracks_motor(input)
        && !nominal_explains_with_table(input, s, lines)
        && !coupling_explains_torque(input)
        && !motor_holds_coupling(input)
    {
        findings.push(Finding::new(
            "foreign",
            Severity::Refuse,
            "theta2",
            "theta2 does not follow theta1 where the torque moves it.",
            "It comes from another axis or another time, one of the encoders is broken, or a belt, chain or clutch between them hangs loose.",
            "Map the right columns in [signals], or leave theta2 out.",
        ));
        return;
    }
    if coherent.is_empty() {
        return;
    }
    let (ratio, finding) = encoder_ratio(input, s, &coherent);
    if let Some(finding) = finding {
        findings.push(finding);
        return;
    }
    if !(COMPATIBLE_RATIO.recip()..COMPATIBLE_RATIO).contains(&ratio.abs()) {
        // No force on a table makes it move so much further than the motor that drives it.
        let geared = rigid_body_ratio(input).is_some_and(|r| r.abs() > GEAR_RATIO) && ratio.abs() > GEAR_RATIO;
        findings.push(Finding::new(
            "scale",
            if geared { Severity::Refuse } else { Severity::Warn },
            "theta2",
            format!("theta2 moves {ratio:.4} times as far as theta1 at the lowest frequencies."),
            "A gear lies between the encoders, or the record holds no motion slow enough to tell.",
            "Give theta2 the gear's ratio as scale in [signals], so that both count the same angle.",
        ));
    }
    // The table is accelerated by the twist alone, I2*a2 = B*d' + K*d: which column fulfils that better?
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
    // An impact on the table (the end of its travel) or a weight on it drives it as a torque drives a motor: the exchange must also explain
    // the torque better, with friction and load on the motor too.
    let unexplained = |motor: usize, table: usize| motor_side_unexplained(s, lines, motor, table);
    let speaks = || unexplained(TABLE, MAIN) < 0.5 * unexplained(MAIN, TABLE);
    // Of exchanged columns the one named theta2 is the motor's, which at low frequencies does not move less than the table.
    let may_be = ratio.abs() > COMPATIBLE_RATIO.recip();
    let sound = || explains_as_well_as_exchanged(input);
    if may_be && exchanged < 0.3 && as_given > 3.0 * exchanged && speaks() && !sound() {
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

/// Share of the torque's power that the motor's equation of motion `T = I1*a + B*d' + K*d` leaves unexplained, I1, B, K >= 0 free. It holds
/// whatever acts on the table. `motor` and `table` are the columns of the spectra taken for the two.
pub(super) fn motor_side_unexplained(s: &Spectra, lines: &[usize], motor: usize, table: usize) -> f64 {
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
