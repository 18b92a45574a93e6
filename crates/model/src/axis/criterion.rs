//! The paper's rule for the time step (section 3), and what Newmark's method does to the period.

use std::f64::consts::TAU;

/// `Dt = 2*pi*kappa/(N*wn)` (paper, section 3): `N` samples hold `kappa` natural periods of `wn` rad/s. Seconds.
#[must_use]
pub fn dt_criterion(kappa: f64, samples: usize, wn: f64) -> f64 {
    TAU * kappa / (samples as f64 * wn)
}

/// Relative period elongation of the trapezoidal rule (alpha 1/4, delta 1/2) on an undamped mode:
/// `(h/2)/atan(h/2) - 1` with `h = wn*dt`.
#[must_use]
pub fn period_elongation(wn: f64, dt: f64) -> f64 {
    let half = 0.5 * wn * dt;
    half / half.atan() - 1.0
}

#[cfg(test)]
mod tests {
    use super::{dt_criterion, period_elongation};

    #[test]
    fn table_1_of_the_paper_follows() {
        let dt = dt_criterion(10.0, 2048, 54.53);
        assert!((dt - 5.626e-4).abs() < 5e-8, "{dt}");
        // PAPER.md: 7.80e-5 at the paper's step; (h/2)/atan(h/2) - 1 = h^2/12 to leading order.
        assert!((period_elongation(54.53, dt) - 7.80e-5).abs() < 1e-6 * 7.8);
    }
}
