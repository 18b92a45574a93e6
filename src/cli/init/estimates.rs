//! Rough values of the axis, estimated from the log itself.

use crate::axis::Structure;
use crate::examine::{Examination, Inertia};
use crate::identify::run::{Request, identify};
use crate::trace::{Machine, Signal, Trace};

/// Values to begin with.
#[derive(Clone, Copy)]
pub(super) struct Rough {
    /// Inertias, damping and stiffness.
    pub values: [f64; 4],
    /// Whether the log shows the inertia.
    pub is_shown: bool,
}

/// Inertias, damping and stiffness as the log has them, roughly; None where they cannot be estimated.
pub(super) fn rough(trace: &Trace, machine: &Machine, examination: &Examination) -> Option<Rough> {
    let identified = identified(trace, machine, examination).map(|values| Rough { values, is_shown: true });
    // Where noise rules the coupling, the inertia is still known.
    identified.or_else(|| {
        let Inertia { value, is_shown } = examination.inertia?;
        let rigid = machine.structure == Structure::Rigid;
        Some(Rough { values: if rigid { [value, 0.0, 0.0, 0.0] } else { halved(value, trace.dt) }, is_shown })
    })
}

/// The same where `identify` earns them.
fn identified(trace: &Trace, machine: &Machine, examination: &Examination) -> Option<[f64; 4]> {
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
        return value("I").map(|i| [i, 0.0, 0.0, 0.0]);
    }
    let (i1, i2, k) = (value("I1")?, value("I2")?, value("K")?);
    Some([i1, i2, value("B").unwrap_or(0.02 * (k * i2).sqrt()), k])
}

/// Half of an inertia to each side, a coupling that swings at a fiftieth of the sampling rate, 2 % of the critical damping.
fn halved(total: f64, dt: f64) -> [f64; 4] {
    let half = 0.5 * total;
    let w = std::f64::consts::TAU / (50.0 * dt);
    let k = 0.5 * half * w * w;
    [half, half, 0.02 * (k * half).sqrt(), k]
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
