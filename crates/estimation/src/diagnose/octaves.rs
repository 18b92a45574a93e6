//! Whether a cause stands out of a discrepancy that has a size of its own in every octave.
//!
//! The evidence takes what a model lacks as white in the band: then every bin counts for a cause that makes the residual smaller, though
//! it may have shortened but the few lowest ones. A torque that wanders, a warming, a jam is large at a few bins, and many a law of three
//! values follows it there. With a variance for each octave, the likeliest one, a cause gains
//!
//! ```text
//! sum over octaves of n ln(P without / P with)
//! ```
//!
//! `n` the octave's complex values and `P` their mean power in units of the noise: as much as there are values that it explains.

use std::ops::Range;

use rustfft::FftPlanner;

use super::search::Search;
use crate::hypothesis::evidence::PRICE;
use crate::hypothesis::fit::Fit;
use crate::hypothesis::likelihood::{Band, C, TorqueResidual};
use crate::numerics::distribution::of_log_odds;
use crate::trace::numerics::dot;

impl Search<'_> {
    /// Probability that an effect of a fit stands out of such a discrepancy, beside `plain`, the fit without it.
    pub fn stands_out(&self, fit: &Fit, plain: &Fit) -> f64 {
        let band = self.band();
        let spread = spread_of_a_mean(&band.taper, band.omega.len());
        let [with, without] = [fit, plain].map(|f| powers(band, &f.rows, &spread));
        let gained = gain(&band.weight, &with, &without);
        let free = fit.coordinates.len() as f64 - plain.coordinates.len() as f64;
        let gained = gained - 0.5 * free * band.values().ln() - PRICE;
        of_log_odds(gained)
    }
}

/// Gain in log likelihood of powers `with` a cause over those `without`; `weight`: complex values of each bin.
fn gain(weight: &[f64], with: &[f64], without: &[f64]) -> f64 {
    let sum = |powers: &[f64], bins: Range<usize>| -> f64 { bins.map(|m| powers[m] * weight[m]).sum() };
    // An octave of a bin or two hardly has a power of its own: the mean of all counts as one value more in each.
    let mean = sum(with, 0..weight.len()) / weight.iter().sum::<f64>();
    let of_octave = |bins: Range<usize>| {
        let n: f64 = weight[bins.clone()].iter().sum();
        n * ((mean + sum(without, bins.clone())) / (mean + sum(with, bins))).ln()
    };
    octaves(weight.len()).into_iter().map(of_octave).sum()
}

/// Power of what lacks at each bin, in units of the noise there: of the equations together, for what acts on one side shows in both; and without
/// what the window spreads of the mean, which is one value.
fn powers(band: &Band, residual: &TorqueResidual, spread: &[C]) -> Vec<f64> {
    let without = |row: &Vec<C>| -> Vec<C> {
        let mean = row.first().copied().unwrap_or_default();
        row.iter().zip(spread).map(|(r, of_mean)| r - mean * of_mean).collect()
    };
    let white = band.whiten(&residual.rows.each_ref().map(without), &residual.weights, [0.0; 2]);
    let bins = white.chunks_exact(2 * band.equations()).zip(&band.weight);
    bins.map(|(z, w)| dot(z, z) / (2.0 * w)).collect()
}

/// What a window spreads of a mean into each bin but its own, over what it leaves there.
fn spread_of_a_mean(taper: &[f64], bins: usize) -> Vec<C> {
    let mut z: Vec<C> = taper.iter().map(|w| C::new(*w, 0.0)).collect();
    FftPlanner::new().plan_fft_forward(z.len()).process(&mut z);
    (0..bins).map(|m| if m == 0 { C::default() } else { z[m] / z[0] }).collect()
}

/// The mean's bin, the first, and each further octave of so many bins.
fn octaves(bins: usize) -> Vec<Range<usize>> {
    let starts = std::iter::once(0).chain(std::iter::successors(Some(1), |s| Some(2 * s)));
    starts.clone().zip(starts.skip(1)).take_while(|(start, _)| *start < bins).map(|(a, b)| a..b.min(bins)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_bin_is_in_one_octave() {
        assert_eq!(octaves(11), [0..1, 1..2, 2..4, 4..8, 8..11]);
        assert_eq!(octaves(1).len(), 1);
        assert!(octaves(0).is_empty());
    }

    #[test]
    fn a_cause_gains_as_much_as_there_are_values_that_it_explains() {
        let weight = [1.0; 1024];
        let lower = |bins: usize| -> Vec<f64> { (0..1024).map(|m| if m < bins { 1e-2 } else { 1.0 }).collect() };
        let without = vec![1.0; 1024];
        // All of it a hundredth: ln 100 a value, less what the one more in each octave takes.
        let all = gain(&weight, &lower(1024), &without);
        assert!((all / (1024.0 * 100.0_f64.ln()) - 1.0).abs() < 0.01, "{all}");
        // The lowest eight bins: at most 8 ln 100 of the 1024 ln 100 that white discrepancies of a hundredth would differ by.
        let few = gain(&weight, &lower(8), &without);
        assert!(few > 0.2 * 8.0 * 100.0_f64.ln() && few < 8.0 * 100.0_f64.ln(), "{few}");
        assert_eq!(gain(&weight, &without, &without), 0.0);
    }

    #[test]
    fn a_mean_is_one_value_under_a_window_too() {
        // Half a sine: a constant under it has as much in the first bins as it spreads.
        let taper: Vec<f64> = (0..256).map(|k| (std::f64::consts::PI * (f64::from(k) + 0.5) / 256.0).sin()).collect();
        let spread = spread_of_a_mean(&taper, 8);
        let bin = |m: usize| -> C {
            let turned = |k: usize| C::from_polar(3.0 * taper[k], -std::f64::consts::TAU * (m * k) as f64 / 256.0);
            (0..256).map(turned).sum()
        };
        assert_eq!(spread[0], C::default());
        assert!((1..8).all(|m| (bin(m) - bin(0) * spread[m]).norm() < 1e-9), "{spread:?}");
        assert!(spread[1].norm() > 0.3);
    }
}
