//! Conditions of the experiment that limit what it identifies: time scale, directions of motion, excited band.

use crate::axis::Structure;
use crate::examine::finding::{Finding, Severity, rounded};
use crate::examine::robust::{quantile, span};
use crate::examine::{Input, Nominal};

/// Checks sampling interval and duration against the natural frequency of the nominal axis.
pub(super) fn check_time_scale(input: &Input<'_>, findings: &mut Vec<Finding>) {
    let Some(Nominal { structure: Structure::TwoInertia, parameters: p }) = input.nominal else { return };
    let natural = (p.k * (1.0 / p.i1 + 1.0 / p.i2)).sqrt();
    let duration = input.dt * input.len() as f64;
    let report = |seen: String| {
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
        findings.push(report(format!(
            "The nominal axis swings at {} Hz, the record is sampled every {} s: it could not show it.",
            rounded(hertz),
            rounded(input.dt)
        )));
    } else if natural * duration < 1.0 {
        findings.push(report(format!(
            "The whole record lasts {duration:.3e} s, a small part of one swing of the nominal axis."
        )));
    }
}

/// Checks that the axis moves in both directions; `speed` in rad/s (m/s).
pub(super) fn check_directions(speed: &[f64], findings: &mut Vec<Finding>) {
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

/// Checks that the excited band, Hz, reaches the frequencies at which the nominal coupling shows.
pub(super) fn check_band(nominal: Option<Nominal>, band: [f64; 2], findings: &mut Vec<Finding>) {
    let Some(Nominal { structure: Structure::TwoInertia, parameters: p }) = nominal else { return };
    let anti = (p.k / p.i2).sqrt() / std::f64::consts::TAU;
    if band[1] < 0.3 * anti {
        findings.push(Finding::new(
            "no_excitation",
            Severity::Warn,
            "T",
            format!(
                "The motion follows the torque up to {} Hz; the nominal coupling shows from some {} Hz on.",
                rounded(band[1]),
                rounded(0.3 * anti)
            ),
            "Stiffness and damping of the coupling are not determined by this record, nor how the inertia is shared.",
            format!("Excite up to {} Hz (`eixo excite`), or describe the axis as rigid.", rounded(1.5 * anti)),
        ));
    }
}
