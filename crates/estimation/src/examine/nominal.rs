//! The torque that the nominal axis needs for the logged motion, compared with the logged torque in the frequency domain.

use rustfft::num_complex::Complex;

use super::momentum::{MAIN, T, TABLE};
use super::spectra::Spectra;
use super::{Input, Nominal, Structure};

/// Unexplained share of the torque's power up to which torque and motion are of the nominal axis, in its units and at the same times. A factor
/// of six, another axis' torque or half a turn of phase leave more; friction, and parameters some tens of per cent off, leave less.
const MAX_UNEXPLAINED: f64 = 0.5;

/// Unexplained share with the table's encoder over that without it, up to which the encoder is this table's: if the table's inertia matters,
/// another axis' encoder leaves many times more.
const SIGNIFICANTLY_WORSE: f64 = 4.0;

/// Whether the nominal axis needs about the logged torque for the logged motion of the motor and, where it is measured, of the table.
pub(super) fn nominal_explains(input: &Input<'_>, s: &Spectra, lines: &[usize]) -> bool {
    unexplained(input, s, lines, s.has(TABLE)).is_some_and(|m| m < MAX_UNEXPLAINED)
}

/// Whether the nominal axis explains the torque with the table's encoder, and not much worse than with a table moved by the coupling alone.
pub(super) fn nominal_explains_with_table(input: &Input<'_>, s: &Spectra, lines: &[usize]) -> bool {
    let of = |measured: bool| unexplained(input, s, lines, measured);
    of(true)
        .zip(of(false))
        .is_some_and(|(with, without)| with < MAX_UNEXPLAINED && with < SIGNIFICANTLY_WORSE * without)
}

/// Share of the torque's power at the lines that the nominal axis leaves unexplained; `measured`: the table's motion is taken from its
/// encoder, else from the coupling. `None` without a nominal model or a motor column.
fn unexplained(input: &Input<'_>, s: &Spectra, lines: &[usize], measured: bool) -> Option<f64> {
    let Nominal { structure, parameters: p } = input.nominal?;
    if input.theta1.is_none() && input.omega1.is_none() {
        return None;
    }
    let (mut missed, mut total) = (0.0, 0.0);
    for &f in lines {
        let j = Complex::new(0.0, s.omega(f));
        let coupling = p.k / j + p.b;
        // Torque over the speeds of motor and table, N.m.s/rad; a table without encoder is moved by the coupling.
        let (motor, table) = match structure {
            Structure::Rigid => (j * (p.i1 + p.i2), None),
            Structure::TwoInertia if measured => (j * p.i1 + coupling, Some(-coupling)),
            Structure::TwoInertia => (j * p.i1 + coupling * j * p.i2 / (coupling + j * p.i2), None),
        };
        let torque = s.power(T, f);
        let mut needed = motor.norm_sqr() * s.power(MAIN, f);
        let mut cross = motor.conj() * s.of(MAIN, T, f);
        if let Some(table) = table {
            needed += table.norm_sqr() * s.power(TABLE, f) + 2.0 * (motor.conj() * table * s.of(MAIN, TABLE, f)).re;
            cross += table.conj() * s.of(TABLE, T, f);
        }
        missed += torque + needed - 2.0 * cross.re;
        total += torque;
    }
    (total > 0.0).then_some(missed / total)
}
