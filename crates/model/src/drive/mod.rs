//! The control law of a drive: position loop, velocity loop, feed-forward, torque limit.
//!
//! ```text
//! w* = kp*(r - th) + fv*r'                       command of the velocity loop, rad/s
//! T  = kv*(w* - w) + ki*int(w* - w) + fa*J*r''   |T| <= limit
//! ```
//!
//! `r` is the reference as an angle, th and w come from the encoders. The drive computes once a sample. It gets positions
//! only, as over a field bus: r' and r'' are backward differences of the reference over its samples. The integral does
//! not grow while it would drive the limited torque further into its limit (conditional integration: Astrom and
//! Hagglund, Advanced PID Control, 2006, section 3.5).

/// Settings of a drive, in the units of an axis: rad and N.m, or m and N.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gains {
    /// Position gain, 1/s.
    pub kp: f64,
    /// Velocity gain, N.m.s/rad.
    pub kv: f64,
    /// Integral gain of the velocity loop, N.m/rad.
    pub ki: f64,
    /// Share of the velocity fed forward.
    pub velocity_forward: f64,
    /// Share of the acceleration fed forward.
    pub acceleration_forward: f64,
    /// Inertia that the acceleration is fed forward with, kg.m2.
    pub inertia: f64,
    /// Torque limit, N.m.
    pub limit: f64,
}

impl Gains {
    /// Gains for an inertia: velocity bandwidth `bandwidth` rad/s, position gain a quarter of it unless given, integral
    /// time four over the bandwidth, full feed-forward, no torque limit.
    #[must_use]
    pub fn tuned(inertia: f64, bandwidth: f64, kp: Option<f64>) -> Self {
        let kv = inertia * bandwidth;
        Self {
            kp: kp.unwrap_or(bandwidth / 4.0),
            kv,
            ki: kv * bandwidth / 4.0,
            velocity_forward: 1.0,
            acceleration_forward: 1.0,
            inertia,
            limit: f64::INFINITY,
        }
    }
}

/// What a drive remembers from sample to sample.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Drive {
    /// Integral of the velocity error times `ki`, N.m.
    pub integral: f64,
    /// The last two references, the newest first, rad; none before the first sample.
    pub references: Option<[f64; 2]>,
}

impl Drive {
    /// One sample: the torque for a reference (rad), a position (rad) and a speed (rad/s), with `dt` s to the next.
    #[must_use]
    pub fn sample(&mut self, gains: &Gains, reference: f64, position: f64, speed: f64, dt: f64) -> f64 {
        let [last, before] = self.references.unwrap_or([reference; 2]);
        self.references = Some([reference, last]);
        let (velocity, acceleration) = ((reference - last) / dt, (reference - 2.0 * last + before) / (dt * dt));
        let error = gains.kp * (reference - position) + gains.velocity_forward * velocity - speed;
        let wanted = gains.kv * error + self.integral + gains.acceleration_forward * gains.inertia * acceleration;
        let torque = wanted.clamp(-gains.limit, gains.limit);
        if (wanted - torque) * error <= 0.0 {
            self.integral += gains.ki * error * dt;
        }
        torque
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GAINS: Gains = Gains {
        kp: 20.0,
        kv: 0.02,
        ki: 0.4,
        velocity_forward: 1.0,
        acceleration_forward: 1.0,
        inertia: 2.5e-4,
        limit: 0.5,
    };

    #[test]
    fn a_parabola_is_fed_forward_with_its_speed_half_a_sample_late_and_its_acceleration() {
        let (mut drive, dt, a) = (Drive::default(), 1e-3, 30.0);
        let gains = Gains { ki: 0.0, ..GAINS };
        let mut torque = 0.0;
        for k in 0..5 {
            let t = f64::from(k) * dt;
            torque = drive.sample(&gains, 0.5 * a * t * t, 0.5 * a * t * t, a * t, dt);
        }
        assert!((torque - (gains.inertia * a - gains.kv * 0.5 * a * dt)).abs() < 1e-12, "{torque}");
    }

    #[test]
    fn the_integral_stands_still_in_the_limit_and_leaves_it_at_once() {
        let (mut drive, dt) = (Drive::default(), 1e-3);
        let _ = drive.sample(&GAINS, 0.0, 0.0, 0.0, dt);
        for _ in 0..1000 {
            assert_eq!(drive.sample(&GAINS, 10.0, 0.0, 0.0, dt).abs(), GAINS.limit);
        }
        let wound = drive.integral;
        assert!(wound.abs() <= GAINS.limit, "{wound}");
        // Past the reference, the torque turns round within a sample.
        assert!(drive.sample(&GAINS, 10.0, 20.0, 0.0, dt) < 0.0);
    }

    #[test]
    fn the_integral_takes_over_a_constant_load() {
        // A rigid axis under a load, by semi-implicit Euler: the error goes to zero, the integral to the load.
        let (mut drive, dt, load) = (Drive::default(), 1e-4, 0.1);
        let gains = Gains::tuned(GAINS.inertia, 100.0, None);
        let (mut theta, mut omega) = (0.0, 0.0);
        for _ in 0..200_000 {
            let torque = drive.sample(&gains, 1.0, theta, omega, dt);
            omega += dt * (torque - load) / gains.inertia;
            theta += dt * omega;
        }
        assert!((theta - 1.0).abs() < 1e-9 && (drive.integral - load).abs() < 1e-9, "{theta} {}", drive.integral);
    }
}
