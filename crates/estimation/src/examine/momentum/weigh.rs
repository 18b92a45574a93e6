//! Sign, delay and size of the torque by the momentum equation.

use super::equation::MomentumBalance;
use super::{MAIN, T, TABLE};
use crate::axis::Structure;
use crate::examine::encoders::motor_side;
use crate::examine::finding::{Finding, Severity};
use crate::examine::nominal::explains;
use crate::examine::rigid::{self, WORSE, other_unit};
use crate::examine::spectra::Spectra;
use crate::examine::{Input, NOMINAL_OFF};

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

/// Averages from which a delay is told from the phase of a slow motion.
const AVERAGED: f64 = 3.0;

/// Signs, delay and size of the torque; gives the inertia that moves, where it makes a part of the torque.
pub(super) fn weigh(input: &Input<'_>, s: &Spectra, lines: &[usize], collocated: bool) -> (Option<f64>, Vec<Finding>) {
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
