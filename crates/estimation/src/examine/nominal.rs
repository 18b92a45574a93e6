//! The torque that the nominal axis would need for the motion, beside the one that was logged.

use rustfft::num_complex::Complex;

use super::momentum::{MAIN, T, TABLE};
use super::spectra::Spectra;
use super::{Input, Nominal, Structure};

/// Share of the torque's power up to which the nominal axis may miss it for it to be this axis' own torque and motion: in its unit and at
/// its time. A factor of six, a foreign torque and half a turn of phase miss more; friction and parameters some tens of per cent off do not.
const MISSED: f64 = 0.5;

/// Times that with the table's encoder the axis may miss more than without it for that encoder to be the table's: on a table that is heavy
/// enough to tell, a foreign one misses many times more.
const WORSE: f64 = 4.0;

/// Whether the nominal axis needs about this torque for this motion at the lines: of the motor, and of the table where it is measured.
pub(super) fn explains(input: &Input<'_>, s: &Spectra, lines: &[usize]) -> bool {
    missed(input, s, lines, s.has(TABLE)).is_some_and(|m| m < MISSED)
}

/// Whether the table's encoder explains the torque at the lines, and as well as a table that only hangs on the motor.
pub(super) fn explains_the_table(input: &Input<'_>, s: &Spectra, lines: &[usize]) -> bool {
    let of = |measured: bool| missed(input, s, lines, measured);
    of(true).zip(of(false)).is_some_and(|(with, without)| with < MISSED && with < WORSE * without)
}

/// Share of the torque's power that the nominal axis misses at the lines, the table's motion as measured or as the coupling makes it.
fn missed(input: &Input<'_>, s: &Spectra, lines: &[usize], measured: bool) -> Option<f64> {
    let Nominal { structure, parameters: p } = input.nominal?;
    if input.theta1.is_none() && input.omega1.is_none() {
        return None;
    }
    let (mut missed, mut total) = (0.0, 0.0);
    for &f in lines {
        let j = Complex::new(0.0, s.omega(f));
        let coupling = p.k / j + p.b;
        // Torque over the speeds of motor and table; a table that is not measured hangs on the coupling.
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
