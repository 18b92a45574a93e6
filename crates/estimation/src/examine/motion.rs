//! Speed, acceleration and direction of a sampled angle.

use super::robust::quantile;

/// Share of the ninth decile of the speeds up to which a motion has no direction: about zero its sign is that of the noise.
const QUIET: f64 = 0.02;

/// Speed at an inner sample by central difference, rad/s (m/s) of an angle in rad (m); `dt` in s.
pub(super) fn speed(x: &[f64], k: usize, dt: f64) -> f64 {
    (x[k + 1] - x[k - 1]) / (2.0 * dt)
}

/// Acceleration at an inner sample by second difference, rad/s^2 (m/s^2).
pub(super) fn acceleration(x: &[f64], k: usize, dt: f64) -> f64 {
    (x[k + 1] - 2.0 * x[k] + x[k - 1]) / (dt * dt)
}

/// Tells the direction of a motion, which is that of its friction.
pub(super) struct Direction {
    /// Ninth decile of the speeds.
    pub fast: f64,
}

impl Direction {
    /// Of a motion with these speeds.
    pub fn of(speeds: impl ExactSizeIterator<Item = f64>) -> Self {
        Self { fast: quantile(speeds, 0.9) }
    }

    /// Of an angle, by its inner samples; `dt` in s.
    pub fn of_angle(x: &[f64], dt: f64) -> Self {
        Self::of((1..x.len().max(2) - 1).map(|k| speed(x, k, dt)))
    }

    /// Direction at a speed: 1 or -1, 0 where it is none.
    pub fn at(&self, speed: f64) -> f64 {
        if speed.abs() <= QUIET * self.fast { 0.0 } else { speed.signum() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_parabola_has_its_speeds_and_its_acceleration() {
        let dt = 0.1;
        let x: Vec<f64> = (0..50).map(|k| 3.0 * (f64::from(k) * dt).powi(2)).collect();
        for k in 1..49 {
            assert!((speed(&x, k, dt) - 6.0 * k as f64 * dt).abs() < 1e-9);
            assert!((acceleration(&x, k, dt) - 6.0).abs() < 1e-9);
        }
    }

    #[test]
    fn a_motion_has_no_direction_at_a_fiftieth_of_its_fast_speeds() {
        let direction = Direction::of((1..101).map(f64::from));
        assert_eq!([1.79, -1.79, 1.81, -1.81].map(|v| direction.at(v)), [0.0, 0.0, 1.0, -1.0]);
        assert_eq!(Direction::of_angle(&[1.0], 0.1).at(0.0), 0.0);
    }
}
