//! Lines of the averaged spectra at which the motion follows the torque.

use super::{COHERENT, MAIN, T, TABLE};
use crate::examine::robust::quantile;
use crate::examine::spectra::Spectra;

/// Lines at which the motion follows the torque; none where chance could make as many.
pub(super) fn coherent(spectra: &Spectra) -> Vec<usize> {
    let least = spectra.by_chance().max(COHERENT);
    let of = |f: usize| {
        let table = if spectra.has(TABLE) { spectra.coherence(T, TABLE, f) } else { 0.0 };
        spectra.coherence(T, MAIN, f).max(table)
    };
    let floor = floor(spectra);
    let stands = |f: usize| position(spectra, f) > STANDS * floor;
    let lines: Vec<usize> = (0..spectra.lines).filter(|f| of(*f) > least && stands(*f)).collect();
    // By chance one line of three hundred (two channels: of a hundred and fifty) passes; neighbours under one window pass
    // together.
    let chance = 3.0 + 0.02 * spectra.lines as f64;
    // A band counts where it holds together: the best octave.
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
    // Lines beside the motion are those of its noise: a controller answers it.
    let moved = |of: &mut dyn Iterator<Item = usize>| of.map(|f| position(spectra, f)).sum::<f64>();
    let main = moved(&mut lines.iter().copied()) > MOVED * moved(&mut (0..spectra.lines));
    if main && ((lines.len() as f64) > chance || best >= 0.5) { lines } else { Vec::new() }
}

/// Power of the position at a line.
fn position(spectra: &Spectra, f: usize) -> f64 {
    spectra.power(MAIN, f) / spectra.omega(f).powi(2)
}

/// Share of the position's power that coherent lines must hold to be those of the axis' motion.
const MOVED: f64 = 1e-3;

/// Power of the position from which a line is one of motion, over the encoder's floor.
const STANDS: f64 = 4.0;

/// Power of the encoder's noise where the upper half of the spectrum is flat with it, else nothing. Under control the torque follows
/// that noise: coherent, and with the controller's sign instead of the axis'.
fn floor(spectra: &Spectra) -> f64 {
    let level = |from: f64, to: f64| {
        let of = |share: f64| (share * spectra.lines as f64) as usize;
        // A difference lowers the upper lines of white noise: 2*sin(w*dt/2)/dt stands for w.
        let half = std::f64::consts::FRAC_PI_2 / (spectra.lines + 1) as f64;
        quantile(
            (of(from)..of(to)).map(|f| {
                let x = half * (f + 1) as f64;
                position(spectra, f) * (x / x.sin()).powi(2)
            }),
            0.5,
        )
    };
    let (middle, top) = (level(0.4, 0.6), level(0.8, 1.0));
    if middle < STANDS * top { top } else { 0.0 }
}
