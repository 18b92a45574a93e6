//! The extent of a record: by it the physical bounds of an effect's parameters are checked.

/// The extent of a record's motion and torque on the side where an effect acts, SI units.
#[derive(Debug, Clone, Copy)]
pub struct Extent<'a> {
    /// Largest torque, N.m.
    pub torque: f64,
    /// Standard deviation of the torque over the record, N.m.
    pub torque_deviation: f64,
    /// Positions of the effect's side, rad, sorted.
    pub positions: &'a [f64],
    /// Rms speed of that side, rad/s.
    pub speed: f64,
    /// Largest speed of that side, rad/s.
    pub fastest: f64,
    /// Largest order of a torque periodic in that side's angle that the record shows, 1/rad.
    pub order: f64,
    /// Rms twist, rad.
    pub twist: f64,
    /// Twist as measured, rad, sorted; empty where not both sides are.
    pub twists: &'a [f64],
    /// Sampling interval at which it is looked at, s.
    pub dt: f64,
    /// Sampling interval of the log, s.
    pub logged_at: f64,
    /// Length of the record, s.
    pub length: f64,
    /// Upper end of the band that the motion excites, rad/s.
    pub band: f64,
    /// Inertia of the side, and of the whole axis, kg.m2.
    pub inertia: [f64; 2],
    /// Stiffness of the coupling, N.m/rad; zero for a rigid axis.
    pub stiffness: f64,
    /// Most that friction can have taken out of the axis over the record, J: the work of the torque, and what was stored before.
    pub energy: f64,
    /// Length of that side's path to and fro, rad, and its number of reversals; none where it is not known.
    pub path: (f64, f64),
}

/// Factor by which the energy that friction took may seem to exceed what there was: torque and path are measured.
const MEASURED: f64 = 1.5;
/// Least share of the record over which a coupling with play is in contact: one that never closes couples nothing.
const CONTACT: f64 = 0.1;
/// Least number of periods that make a frequency: a torque with fewer changes slowly, as a transient does.
pub const PERIODS: f64 = 3.0;
/// Least amplitude of a periodic torque, over the largest torque: the accuracy of a drive's torque.
const KNOWN: f64 = 1e-3;

/// Most samples that a drive answers late by.
const SOME_SAMPLES: f64 = 12.0;
/// Largest end of the band, in corner frequencies of the drive's lag.
const PASSED: f64 = 5.0;

/// Share of sorted values that lie beyond two of them.
fn share_beyond(sorted: &[f64], lower: f64, upper: f64) -> f64 {
    let inside = sorted.partition_point(|x| *x <= upper).saturating_sub(sorted.partition_point(|x| *x < lower));
    1.0 - inside as f64 / sorted.len().max(1) as f64
}

impl Extent<'_> {
    /// Whether an amplitude, N.m, is one that a drive's torque can have: no more than the largest, and not below the accuracy of that.
    #[must_use]
    pub fn has_amplitude(&self, torque: f64) -> bool {
        (KNOWN * self.torque..=self.torque).contains(&torque.abs())
    }

    /// Whether a drive that gives no more than a torque, N.m, is limited, and no mere switch: the command passes that torque, and does not
    /// deviate by twice as much. How far its peaks pass it says nothing, of a command that a step or the encoder's noise makes.
    #[must_use]
    pub fn limits(&self, torque: f64) -> bool {
        (0.5 * self.torque_deviation..self.torque).contains(&torque)
    }

    /// Whether something can pull the axis back by a torque, N.m, with a stiffness of up to so much, N.m/rad: the drive holds it, or the axis
    /// swings on it and turns back. An inertia `I` that passes the middle of a spring `k` at the speed `w` is turned by `w*sqrt(I*k)`.
    #[must_use]
    pub fn is_pulled_back(&self, torque: f64, stiffness: f64) -> bool {
        torque <= self.torque + self.fastest * (self.inertia[0] * stiffness).sqrt()
    }

    /// Travel of the effect's side, rad.
    #[must_use]
    pub fn travel(&self) -> f64 {
        self.positions.last().unwrap_or(&0.0) - self.positions.first().unwrap_or(&0.0)
    }

    /// Whether a dry friction of a level, N.m, can have dissipated no more energy than there was. It slides over the whole path but for the
    /// presliding at every reversal, of the displacement `presliding`, rad; a level above every torque would not slide.
    #[must_use]
    pub fn can_dissipate_dry(&self, level: f64, presliding: f64) -> bool {
        let (path, reversals) = self.path;
        level.abs() * (path - 4.0 * presliding * (1.0 + reversals)).max(0.0) <= MEASURED * self.energy
    }

    /// The same of a friction that grows with a power of the speed, of `coefficient*speed^power`: at the least that of a steady motion over
    /// the same path.
    #[must_use]
    pub fn can_dissipate(&self, coefficient: f64, power: i32) -> bool {
        let (path, _) = self.path;
        coefficient * (path / self.length).powi(power) * path <= MEASURED * self.energy
    }

    /// Share of the samples beyond two positions.
    #[must_use]
    pub fn beyond(&self, lower: f64, upper: f64) -> f64 {
        share_beyond(self.positions, lower, upper)
    }

    /// Whether a play of twice `half_gap` closes over the record; not known where the twist is not measured.
    #[must_use]
    pub fn closes(&self, half_gap: f64) -> bool {
        self.twists.is_empty() || share_beyond(self.twists, -half_gap, half_gap) >= CONTACT
    }

    /// Whether a delay is one of some samples of the log: the drive's loops run at its rate or faster. Far beyond that it is a shift of the
    /// record.
    #[must_use]
    pub fn is_some_samples(&self, delay: f64) -> bool {
        delay <= SOME_SAMPLES * self.logged_at
    }

    /// Whether a first-order lag lets a fifth of the torque pass at the band's end. One with a corner far below the band is no lag but an
    /// integrator, which no drive is.
    #[must_use]
    pub fn passes_the_band(&self, lag: f64) -> bool {
        lag * self.band <= PASSED
    }

    /// Whether a time is a twentieth of a sample and turns the phase at the band's end by a fiftieth of a radian: less of it, a fiftieth of
    /// the torque at most, is within the error of time stamps and of a measured torque.
    #[must_use]
    pub fn turns_phase(&self, time: f64) -> bool {
        time.abs() * self.band >= 0.02 && time.abs() >= 0.05 * self.dt
    }

    /// Whether the record has as many periods of an angular frequency as make it one.
    #[must_use]
    pub fn has_periods(&self, omega: f64) -> bool {
        omega * self.length >= PERIODS * std::f64::consts::TAU
    }

    /// Whether an angular frequency lies in the band, with as many periods in the record.
    #[must_use]
    pub fn holds(&self, omega: f64) -> bool {
        omega <= self.band && self.has_periods(omega)
    }

    /// Whether a torque that is periodic in the angle, of an order in 1/rad, can be observed: nearly one period lies within the travel, and
    /// its frequency is in the band where the axis is slow.
    #[must_use]
    pub fn turns(&self, order: f64) -> bool {
        order * self.travel() >= 0.75 * std::f64::consts::TAU && order <= self.order
    }

    /// Whether such an order is once per turn as far as the travel tells it, within a quarter of a period, on a rigid axis: there a torque
    /// periodic in the motor's angle is the law of a mass off the table's axis, which has an order less to be fitted.
    #[must_use]
    pub fn is_of_a_turn(&self, order: f64) -> bool {
        self.stiffness == 0.0 && (order - 1.0).abs() * self.travel() < 0.25 * std::f64::consts::TAU
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::Effect;

    fn resting() -> Extent<'static> {
        Extent {
            torque: 1.0,
            torque_deviation: 0.5,
            positions: &[0.0, 1.0],
            speed: 1.0,
            fastest: 1.0,
            order: 1000.0,
            twist: 0.0,
            twists: &[],
            dt: 4e-4,
            logged_at: 4e-4,
            length: 1.0,
            band: 1000.0,
            inertia: [1.0; 2],
            stiffness: 0.0,
            energy: 1.0,
            path: (1.0, 0.0),
        }
    }

    #[test]
    fn a_delay_is_one_of_some_samples_of_the_log_however_coarsely_that_is_looked_at() {
        let coarse = Extent { dt: 0.1, logged_at: 0.01, band: 10.0, ..resting() };
        let admits = |e: Effect, values: &[f64]| (e.info().bounds)(values, &coarse);
        assert!(admits(Effect::Delay, &[0.11]) && !admits(Effect::Delay, &[0.13]));
        assert!(admits(Effect::SensorDelay, &[0.11]) && !admits(Effect::SensorDelay, &[0.13]));
        assert!(admits(Effect::Latch, &[-0.11, 0.0]) && !admits(Effect::Latch, &[-0.13, 0.0]));
    }

    #[test]
    fn a_weight_is_held_by_the_largest_torque_or_swings() {
        // At a quarter of the travel from its middle, 0.5 rad, the spring pulls by half of its stiffness; past the middle at 2 rad/s an inertia
        // of 1 kg.m2 on it is turned by twice the root of that.
        let extent = |fastest: f64| Extent { positions: &[-1.0, 1.0], fastest, ..resting() };
        let spring =
            |stiffness: f64, fastest: f64| (Effect::ExternalSpring.info().bounds)(&[stiffness, 0.0], &extent(fastest));
        assert!(spring(1.9, 0.0) && !spring(2.1, 0.0));
        assert!(spring(19.0, 2.0) && !spring(20.5, 2.0));
        let weight =
            |size: f64, fastest: f64| (Effect::Gravity.info().bounds)(&[0.6 * size, 0.8 * size, 1.0], &extent(fastest));
        assert!(weight(1.9, 0.0) && !weight(2.1, 0.0));
        assert!(weight(19.0, 2.0) && !weight(20.5, 2.0));
    }

    #[test]
    fn a_friction_changes_by_no_more_than_the_largest_torque() {
        let extent = Extent { length: 20.0, ..resting() };
        let admits = |values: &[f64]| (Effect::FrictionDrift.info().bounds)(values, &extent);
        // In twenty seconds by 0.8 of the torque or by 1.2; of what fades with a time constant of ten by 0.69 or 1.04.
        for of in [|v| [v, 0.0, 0.0], |v: f64| [0.0, -v, 0.0]] {
            assert!(admits(&of(0.04)) && !admits(&of(0.06)));
        }
        assert!(admits(&[0.08, 0.0, 0.1]) && !admits(&[0.12, 0.0, 0.1]));
    }

    #[test]
    fn friction_takes_no_more_energy_than_the_torque_brings() {
        let extent = Extent {
            positions: &[-1.0, 1.0],
            fastest: 2.0,
            dt: 1e-3,
            length: 10.0,
            band: 100.0,
            energy: 2.0,
            path: (20.0, 9.0),
            ..resting()
        };
        let admits = |e: Effect, values: &[f64]| (e.info().bounds)(values, &extent);
        // Over 20 rad a level of 0.1 N.m takes 2 J; at 2 rad/s so do 0.05 N.m.s/rad and half of that of the square.
        assert!(
            admits(Effect::CoulombMotor, &[0.1, 0.0, 1.0, 0.0, 0.0])
                && !admits(Effect::CoulombMotor, &[0.2, 0.0, 1.0, 0.0, 0.0])
        );
        assert!(admits(Effect::ViscousMotor, &[0.05, 0.0]) && !admits(Effect::ViscousMotor, &[0.1, 0.0]));
        assert!(admits(Effect::QuadraticDrag, &[0.025]) && !admits(Effect::QuadraticDrag, &[0.05]));
        // What only winds a spring at every reversal slides less.
        assert!(
            admits(Effect::PreslidingMotor, &[0.2, 0.3, 0.0]) && !admits(Effect::PreslidingMotor, &[0.2, 0.01, 0.0])
        );
    }

    #[test]
    fn a_friction_more_than_four_times_as_large_one_way_is_a_torque_of_its_own() {
        let admits = |asymmetry: f64| {
            (Effect::CoulombMotor.info().bounds)(
                &[0.1, 0.0, 1.0, asymmetry, 0.0],
                &Extent { path: (1.0, 1.0), ..resting() },
            )
        };
        assert!(admits(0.59) && admits(-0.59) && !admits(0.61) && !admits(-0.61));
    }

    #[test]
    fn a_torque_limit_is_passed_by_the_command_and_is_no_switch() {
        let admits = |limit: f64| (Effect::Saturation.info().bounds)(&[limit], &resting());
        assert!(admits(0.26) && !admits(0.24) && admits(0.99) && !admits(1.0));
    }

    #[test]
    fn a_play_that_is_never_closed_is_none() {
        let twists: Vec<f64> = (-50..=50).map(|i| f64::from(i) * 0.01).collect();
        let extent = |twists| Extent { twist: 0.3, twists, ..resting() };
        let admits = |twists, half_gap: f64| (Effect::Backlash.info().bounds)(&[half_gap], &extent(twists));
        assert!(admits(&twists, 0.4) && !admits(&twists, 0.48) && !admits(&twists, 0.51));
        // Of a twist that is not measured its size alone is known.
        assert!(admits(&[], 0.51) && !admits(&[], 1.3));
    }

    #[test]
    fn a_spring_that_is_all_cube_or_softer_than_none_is_none() {
        let extent = Extent { twist: 0.1, ..resting() };
        let admits = |k3: f64| (Effect::CubicStiffness.info().bounds)(&[k3], &extent);
        assert!(admits(50.0) && admits(-30.0) && !admits(120.0) && !admits(-40.0));
    }

    #[test]
    fn a_lead_error_is_small_and_its_period_is_there_to_be_seen() {
        // Along a radian, at a radian a second.
        let admits = |scale: f64, amplitude: f64, order: f64| {
            (Effect::LeadError.info().bounds)(&[scale, amplitude, order, 0.0], &resting())
        };
        assert!(admits(0.05, 0.0, 1.0) && !admits(0.2, 0.0, 1.0));
        assert!(admits(0.0, 0.01, 6.0) && !admits(0.0, 0.01, 3.0) && !admits(0.0, 0.2, 6.0) && !admits(0.0, 0.01, 2e3));
    }

    #[test]
    fn a_mode_that_swings_twice_as_far_as_its_place_within_the_band_is_one() {
        // Against an inertia of 1 kg.m2; the band ends at 1000 rad/s. Undamped it swings by 1/(1 - (w/omega)^2) of its place.
        let admits = |omega: f64, ratio: f64| {
            let (inertia, damping) = (0.5, 2.0 * ratio * 0.5 * omega);
            (Effect::FlexibleMode.info().bounds)(&[inertia, inertia * omega * omega, damping], &resting())
        };
        let twice = 1000.0 * 2.0_f64.sqrt();
        assert!(admits(990.0, 0.01) && admits(twice, 0.01) && !admits(1.02 * twice, 0.01));
        // As far as the half-power width of its peak reaches.
        assert!(admits(1.05 * twice, 0.06) && !admits(1.1 * twice, 0.06));
        // Three periods of it are in a record of a second, however wide its peak is.
        let three = 3.0 * std::f64::consts::TAU;
        assert!(admits(1.01 * three, 0.2) && !admits(0.99 * three, 0.01));
    }

    #[test]
    fn a_ripple_of_less_than_a_thousandth_of_the_torque_or_out_of_the_orders_that_are_seen_is_none() {
        let admits = |amplitude: f64| (Effect::TorqueRipple.info().bounds)(&[amplitude, 10.0, 0.0], &resting());
        assert!(admits(0.5) && admits(-0.01) && !admits(5e-4) && !admits(1.1));
        let seen = |order: f64| (Effect::TorqueRipple.info().bounds)(&[0.5, order, 0.0], &resting());
        assert!(seen(999.0) && !seen(1001.0) && seen(4.8) && !seen(4.7));
    }

    #[test]
    fn a_ripple_once_per_turn_of_a_rigid_axis_is_an_unbalance() {
        let travel = [0.0, 6.0];
        let admits = |stiffness: f64, effect: Effect, values: &[f64]| {
            (effect.info().bounds)(values, &Extent { stiffness, positions: &travel, ..resting() })
        };
        let ripple = |stiffness: f64, order: f64| admits(stiffness, Effect::TorqueRipple, &[0.5, order, 0.0]);
        assert!(!ripple(0.0, 1.0) && !ripple(0.0, 1.2) && ripple(0.0, 1.3) && ripple(1e3, 1.0));
        assert!(admits(0.0, Effect::Unbalance, &[0.5, 0.0]));
    }

    #[test]
    fn a_ripple_of_any_order_repeats_where_the_travel_shows_two_periods_and_one_of_a_turn_does_anyway() {
        let mut settings = crate::effects::Settings::default();
        settings.of_mut(Effect::TorqueRipple)[1] = 10.0;
        let repeats = |effect: Effect, travel: f64| effect.repeats(settings.of(effect), travel, 0.0);
        assert!(repeats(Effect::TorqueRipple, 1.3) && !repeats(Effect::TorqueRipple, 1.2));
        assert!(repeats(Effect::Unbalance, 1.2) && repeats(Effect::CoulombMotor, 0.0));
    }

    #[test]
    fn a_friction_that_changes_shows_its_sign_again_where_the_axis_goes_to_and_fro_twice() {
        let repeats = |effect: Effect, reversals: f64| effect.repeats(&[0.1, 0.0, 0.0], 1.0, reversals);
        assert!(repeats(Effect::FrictionDrift, 3.0) && !repeats(Effect::FrictionDrift, 2.0));
        assert!(repeats(Effect::StiffnessDrift, 0.0) && repeats(Effect::ViscousMotor, 0.0));
    }

    #[test]
    fn a_delay_that_the_band_does_not_turn_by_a_fiftieth_of_a_radian_is_none() {
        let extent = resting();
        let admits = |e: Effect, values: &[f64]| (e.info().bounds)(values, &extent);
        assert!(!admits(Effect::Latch, &[-9e-6, 0.0]) && admits(Effect::Latch, &[-9e-5, 0.0]));
        assert!(!admits(Effect::Latch, &[0.0, 9e-6]) && admits(Effect::Latch, &[0.0, 9e-4]));
        assert!(!admits(Effect::Delay, &[9e-6]) && admits(Effect::Delay, &[2e-4]));
    }
}
