//! What the encoders read of a motion, under all effects on its way out.

use super::Effect;
use super::active::ActiveEffects;
use super::sensor::{Reading, Seen, SensorHistory};
use super::settings::Settings;
use crate::scalar::Scalar;

impl<S: Scalar> Settings<S> {
    /// A history of the encoders in which the axis has coasted up to `motion`, sampled every `dt` seconds.
    #[must_use]
    pub fn initial_readings(&self, on: &ActiveEffects, motion: Reading<S>, dt: f64) -> SensorHistory<S> {
        SensorHistory::coasting(motion, dt, self.filter(on))
    }

    /// Appends the motion of the next sample, as long after the last one as that after its own.
    pub fn push_sensors(&self, on: &ActiveEffects, history: &mut SensorHistory<S>, motion: Reading<S>) {
        self.push_sensors_after(on, history, motion, history.gap());
    }

    /// Appends the motion `gap` seconds after the last sample.
    pub fn push_sensors_after(&self, on: &ActiveEffects, history: &mut SensorHistory<S>, motion: Reading<S>, gap: f64) {
        history.push(motion, gap, self.filter(on));
    }

    /// What the encoders read, from the motion up to now, sampled `dt` seconds apart.
    pub fn transform_sensor(&self, on: &ActiveEffects, history: &SensorHistory<S>, dt: f64) -> Reading<S> {
        let seen = Seen { history, dt, late: self.late(on) };
        on.sensors().iter().fold(seen.reading(), |reading, &e| e.transform_sensor(self.of(e), reading, &seen))
    }

    /// How long before the log's stamp both encoders are read, s; negative after it.
    #[must_use]
    pub fn late(&self, on: &ActiveEffects) -> S {
        on.sensors().iter().fold(S::default(), |sum, &e| sum + e.late(self.of(e)))
    }

    /// How long after the motor's the table's encoder is read, s.
    #[must_use]
    pub fn late_of_table(&self, on: &ActiveEffects) -> S {
        let of = |e: &Effect| (!e.reads_motor()).then(|| e.delay_parameter().map(|i| self.of(*e)[i])).flatten();
        on.sensors().iter().filter_map(of).fold(S::default(), |sum, late| sum + late)
    }

    /// The same encoders read no earlier than their stamps, and how long after its stamp each sample was read, s: a simulation that knows the
    /// torque to come runs that far ahead instead of coasting.
    #[must_use]
    pub fn on_time(&self) -> (Self, f64) {
        let mut settings = *self;
        let mut ahead = 0.0;
        for &effect in self.active().sensors() {
            let late = effect.late(self.of(effect)).re();
            if late < 0.0
                && let Some(delay) = effect.delay_parameter()
            {
                settings.of_mut(effect)[delay] = S::default();
                ahead -= late;
            }
        }
        (settings, ahead)
    }

    /// Time constant of the filter before both encoders are read, s.
    #[must_use]
    pub fn filter(&self, on: &ActiveEffects) -> S {
        on.sensors().iter().fold(S::default(), |sum, &e| sum + e.filter(self.of(e)))
    }
}
