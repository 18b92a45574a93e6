//! Sign, delay and magnitude of the torque by the momentum equation.

use super::equation::MomentumEquation;
use super::{MAIN, T, TABLE};
use crate::axis::Structure;
use crate::examine::as_logged::explains_as_well_as_late;
use crate::examine::encoders::motor_side_unexplained;
use crate::examine::finding::{Finding, Severity};
use crate::examine::nominal::nominal_explains;
use crate::examine::rigid::{self, EstimatedInertia, SIGNIFICANT, SIGNIFICANTLY_WORSE, inertia_finding};
use crate::examine::spectra::Spectra;
use crate::examine::{Inertia, Input, NOMINAL_OFF, standing};

/// Share of the torque's power that the momentum equation must explain for the torque to be of this axis.
const MIN_EXPLAINED: f64 = 0.2;
/// Explained share from which sign and delay are significant.
const MAJORITY: f64 = 0.5;
/// Explained share from which a delay that no drive has is an error of the log: a torque ripple or another axis' torque leaves less explained.
const DOMINANT: f64 = 0.8;
/// Largest delay and lead that are tried, samples.
const DELAYS_TRIED: i32 = 64;
/// Least delay that is reported, samples.
const MIN_DELAY: i32 = 2;
/// Largest lead of the motion over the torque that may be chance, samples.
const MAX_LEAD: i32 = 3;
/// Largest delay of a drive, samples.
const MAX_DELAY: i32 = 48;

/// Independent averages from which a delay can be distinguished from the phase of a slow motion.
const AVERAGED: f64 = 3.0;

/// Findings on sign, delay and magnitude of the torque; and the inertia that moves, where it is positive.
pub(super) fn torque_findings(
    input: &Input<'_>,
    s: &Spectra,
    lines: &[usize],
    collocated: bool,
) -> (Option<Inertia>, Vec<Finding>) {
    let mut findings = Vec::new();
    let inertia = fit_torque(input, s, lines, collocated, &mut findings);
    // If the nominal axis explains the torque, free coefficients that fit a resonance otherwise are no finding.
    if nominal_explains(input, s, lines) {
        findings.clear();
    }
    (inertia, findings)
}

/// Fits the momentum equation with free coefficients.
fn fit_torque(
    input: &Input<'_>,
    s: &Spectra,
    lines: &[usize],
    collocated: bool,
    findings: &mut Vec<Finding>,
) -> Option<Inertia> {
    let total: f64 = lines.iter().map(|f| s.power(T, *f)).sum();
    let mut balance = MomentumEquation { s, lines, collocated, table: None, total };
    if total <= 0.0 {
        return None;
    }
    let rigid = input.nominal.is_some_and(|n| n.structure == Structure::Rigid);
    let negative = |right: &[f64]| right.iter().map(|r| -r).collect::<Vec<_>>();
    if collocated && !s.has(TABLE) && !rigid {
        // The antiresonance that explains most of the torque, with either sign.
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
    // Beyond a quarter of a window torque and motion in it overlap too little.
    let tried = DELAYS_TRIED.min(s.lines as i32 / 2);
    for (late, right) in (-tried..=tried).zip(balance.right_sides(input.dt, tried.unsigned_abs() as usize)) {
        shares.push((late, balance.solve(&gram, &right).share, balance.solve(&gram, &negative(&right)).share));
    }
    let best = |of: &dyn Fn(&(i32, f64, f64)) -> f64, within: i32| {
        shares
            .iter()
            .filter(|s| s.0.abs() <= within)
            .max_by(|a, b| of(a).total_cmp(&of(b)))
            .map_or((0, 0.0), |s| (s.0, of(s)))
    };
    let plus = best(&|s| s.1, DELAYS_TRIED);
    let here = best(&|s| s.1, 1);
    let turned = best(&|s| s.2, 1);
    let turned_anywhere = best(&|s| s.2, DELAYS_TRIED);
    let backwards = turned.1 > MAJORITY && 1.0 - turned.1 < 0.5 * (1.0 - plus.1);
    // A weight above its hinge acts as a spring of negative stiffness: this case is fitted in the time domain, over the angle.
    if backwards && !rigid::explained_in_time(input) {
        // In closed loop a table that oscillates against its motor can look like a wrong sign: if the torque as logged explains most of the
        // motion as well, this is a warning only.
        let sure = plus.1 < MAJORITY;
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
    // Six coefficients explain a part of any torque: half a line each of a single spectrum, less of an averaged one.
    let by_chance = 3.0 / (lines.len() as f64 * s.averages);
    let motor = || if s.has(TABLE) { 1.0 - motor_side_unexplained(s, lines, MAIN, TABLE) } else { 0.0 };
    let explained = |share: f64| share >= MIN_EXPLAINED + by_chance;
    if !explained(plus.1.max(turned_anywhere.1)) && !explained(motor()) && !rigid::explained_in_time(input) {
        // At rest friction explains any torque, which no coefficient of a motion does.
        let held = standing::held_share(input);
        if held > MAJORITY {
            findings.push(standing::finding(held));
            return None;
        }
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
    // A maximum at the end of the range is no maximum.
    let between = plus.0.abs() < tried;
    if clocked && between && plus.0.abs() >= MIN_DELAY && plus.1 > MAJORITY && 1.0 - plus.1 < 0.6 * (1.0 - here.1) {
        let late = f64::from(plus.0.abs()) * input.dt;
        let (ahead, behind) = (plus.0 < -MAX_LEAD, plus.0 > MAX_DELAY);
        findings.push(Finding::new(
            "misaligned",
            // In closed loop the torque responds to a disturbance after it has moved the axis: only a warning where the equation also holds
            // without a delay, or holds with the weight and the load that the spectra do not know of.
            if (ahead || behind)
                && plus.1 > DOMINANT
                && here.1 < MAJORITY
                && !explains_as_well_as_late(input, plus.0)
            {
                Severity::Refuse
            } else {
                Severity::Warn
            },
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
    let of: &[usize] = if collocated { &[0, 1] } else { &[0] };
    let error = balance.error(&gram, &found, of, f64::from(late) * input.dt);
    // Explained shares from which the inertia is significant, and from which it is compared with the nominal one. The spectra do not know of
    // a weight: beside one its standard error is large.
    let is_shown = found.inertial > 0.05 && mass > SIGNIFICANT * error;
    let shown = (mass > 0.0 && mass.is_finite()).then_some(Inertia { value: mass, is_shown });
    let (Some(nominal), true) = (input.nominal, found.inertial > 0.3) else { return shown };
    let p = nominal.parameters;
    let ratio = mass / (p.i1 + p.i2);
    if ratio <= 0.0 || !ratio.is_finite() || (1.0 / NOMINAL_OFF..NOMINAL_OFF).contains(&ratio) {
        return shown;
    }
    // Where a resonance is off or another torque acts, the free inertia absorbs it: is one near the nominal value much worse?
    let near = |m: f64| [m / NOMINAL_OFF, m * NOMINAL_OFF];
    let both = collocated && !rigid;
    let bounds = if both { [near(p.i1), near(p.i2)] } else { [near(p.i1 + p.i2), [0.0, f64::INFINITY]] };
    let own = balance.within(&gram, &at(late), bounds).share;
    if 1.0 - own <= SIGNIFICANTLY_WORSE * (1.0 - found.share) {
        return shown;
    }
    let estimated = EstimatedInertia { value: mass, error, left: 1.0 - found.share };
    findings.extend(inertia_finding(input, &estimated, p.i1 + p.i2, false));
    shown
}
