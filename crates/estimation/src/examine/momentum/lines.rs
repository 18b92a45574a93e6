//! Lines of the averaged spectra at which the motion follows the torque.

use super::{COHERENT, MAIN, T, TABLE};
use crate::examine::robust::quantile;
use crate::examine::spectra::Spectra;

/// Lines at which torque and motion are coherent and the motion exceeds the encoder's noise; none where unrelated signals would have as
/// many.
pub(super) fn coherent_lines(spectra: &Spectra) -> Vec<usize> {
    let least = spectra.by_chance().max(COHERENT);
    let of = |f: usize| {
        let table = if spectra.has(TABLE) { spectra.coherence(T, TABLE, f) } else { 0.0 };
        spectra.coherence(T, MAIN, f).max(table)
    };
    let floor = encoder_noise_power(spectra);
    let stands = |f: usize| position_power(spectra, f) > MIN_SIGNAL_TO_NOISE * floor;
    let lines: Vec<usize> = (0..spectra.lines).filter(|f| of(*f) > least && stands(*f)).collect();
    // Of unrelated signals one line in three hundred passes (with two channels in a hundred and fifty); neighbours share a window and
    // pass together.
    let chance = 3.0 + 0.02 * spectra.lines as f64;
    // A narrow band also counts: the largest share of coherent lines in an octave.
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
    // Lines with next to none of the motion's power show the encoder's noise, to which a controller responds.
    let moved = |of: &mut dyn Iterator<Item = usize>| of.map(|f| position_power(spectra, f)).sum::<f64>();
    let main = moved(&mut lines.iter().copied()) > MIN_MOTION_SHARE * moved(&mut (0..spectra.lines));
    if main && ((lines.len() as f64) > chance || best >= 0.5) { lines } else { Vec::new() }
}

/// Power of the position at a line, rad^2 (m^2) in the spectra's normalisation.
fn position_power(spectra: &Spectra, f: usize) -> f64 {
    spectra.power(MAIN, f) / spectra.omega(f).powi(2)
}

/// Share of the position's power that the coherent lines must have together.
const MIN_MOTION_SHARE: f64 = 1e-3;

/// Power of the position over the encoder's noise power from which a line shows motion.
const MIN_SIGNAL_TO_NOISE: f64 = 4.0;

/// Noise power of the encoder at a line, as [`position_power`], where the upper half of the spectrum is flat; else 0. In closed loop the
/// controller feeds that noise into the torque: the two are then coherent, with the controller's sign and not the axis'.
fn encoder_noise_power(spectra: &Spectra) -> f64 {
    let level = |from: f64, to: f64| {
        let of = |share: f64| (share * spectra.lines as f64) as usize;
        // The speed is a first difference, whose gain is 2*sin(w*dt/2)/dt and not w.
        let half = std::f64::consts::FRAC_PI_2 / (spectra.lines + 1) as f64;
        quantile(
            (of(from)..of(to)).map(|f| {
                let x = half * (f + 1) as f64;
                position_power(spectra, f) * (x / x.sin()).powi(2)
            }),
            0.5,
        )
    };
    let (middle, top) = (level(0.4, 0.6), level(0.8, 1.0));
    if middle < MIN_SIGNAL_TO_NOISE * top { top } else { 0.0 }
}
