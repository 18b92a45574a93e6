//! Rough values of the axis, estimated from the log itself.

use crate::axis::Structure;
use crate::examine::Examination;
use crate::identify::run::{Request, identify};
use crate::trace::{Machine, Signal, Trace};

/// Inertias, damping and stiffness as the log has them, roughly; None where they cannot be estimated.
pub(super) fn rough(trace: &Trace, machine: &Machine, examination: &Examination) -> Option<[f64; 4]> {
    let piece = examination.longest().map(|p| trace.slice(p));
    let found = identify(piece.as_ref().unwrap_or(trace), machine, &Request::default(), "", &mut |_| ()).ok();
    // Estimates that are not earned are those of what the model lacks: a weight, friction.
    let earned = found.as_ref().filter(|f| f.identifiability.identified);
    let best = earned.and_then(|f| Some(&f.methods[f.recommended.as_ref()?.method]));
    let value = |name: &str| {
        let e = best?.parameters.iter().find(|e| e.name == name)?;
        (e.value > 0.0 && e.value.is_finite() && e.std.is_none_or(|s| s < 0.5 * e.value)).then_some(e.value)
    };
    if machine.structure == Structure::Rigid {
        return value("I").or(examination.inertia).map(|i| [i, 0.0, 0.0, 0.0]);
    }
    if let (Some(i1), Some(i2), Some(k)) = (value("I1"), value("I2"), value("K")) {
        return Some([i1, i2, value("B").unwrap_or(0.02 * (k * i2).sqrt()), k]);
    }
    // Where noise rules the coupling, the inertia is still known: half to each side, a coupling that swings at a fiftieth of
    // the sampling rate, 2 % of the critical damping.
    let half = 0.5 * examination.inertia?;
    let w = std::f64::consts::TAU / (50.0 * trace.dt);
    let k = 0.5 * half * w * w;
    Some([half, half, 0.02 * (k * half).sqrt(), k])
}

/// The lead of the screw over 2*pi, m/rad, where the table's position follows the motor's angle: the ratio of their ways.
pub(super) fn lead(trace: &Trace) -> Option<f64> {
    let (theta, x) = (trace.get(Signal::Theta1)?, trace.get(Signal::X2)?);
    let apart = (theta.len() / 64).max(1);
    let (mut tt, mut tx, mut xx) = (0.0, 0.0, 0.0);
    for k in apart..theta.len() {
        let (a, b) = (theta[k] - theta[k - apart], x[k] - x[k - apart]);
        tt += a * a;
        tx += a * b;
        xx += b * b;
    }
    // Of two that are not proportional nothing is read.
    let rho = tx / tt;
    (rho > 0.0 && rho.is_finite() && tx * tx > 0.5 * tt * xx).then_some(rho)
}
