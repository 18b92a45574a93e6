//! The simulation behind an instance of the drive: samples of [`Drive`] at `start + n*sample_time`.
//!
//! A sample reads the inputs as they are at its time; what it computes is put out when the next one is due, as in a drive
//! that computes during a sample. So no input reaches an output directly, and masters need no order.

use super::step_error::{MOST_STEPS, StepError};
use crate::drive::{Drive, Gains};
use crate::variables::{DRIVE, DriveSlot, Starts};

const COUNT: usize = DRIVE.len();
const INPUTS: usize = DriveSlot::Torque as usize;
/// A sample that is due less than this share of an interval before the end of a step belongs to the next.
const SLACK: f64 = 1e-6;

/// The simulation; see the module's head. `Copy`, so that a rollback is exact.
#[derive(Debug, Clone, Copy)]
pub struct DriveKernel {
    values: [f64; COUNT],
    /// Derivatives of the inputs over the step to come.
    rates: [f64; INPUTS],
    start: f64,
    stop: f64,
    time: f64,
    /// Number of the next sample.
    next: f64,
    drive: Drive,
    /// Torque and error of the last sample, to be put out when the next is due.
    pending: [f64; 2],
}

impl DriveKernel {
    /// A drive at its start values.
    #[must_use]
    pub fn new(starts: &Starts) -> Self {
        let mut values = [0.0; COUNT];
        values.copy_from_slice(&starts.values[..COUNT]);
        let (rates, drive) = ([0.0; INPUTS], Drive::default());
        Self { values, rates, start: 0.0, stop: f64::INFINITY, time: 0.0, next: 0.0, drive, pending: [0.0; 2] }
    }

    fn of(&self, slot: DriveSlot) -> f64 {
        self.values[slot as usize]
    }

    /// Start and end of the experiment, s.
    pub fn set_experiment(&mut self, start: f64, stop: f64) {
        (self.start, self.stop, self.time) = (start, stop, start);
    }

    /// Communication point, s.
    #[must_use]
    pub fn time(&self) -> f64 {
        self.time
    }

    /// End of the experiment, s; infinite where none is set.
    #[must_use]
    pub fn stop(&self) -> f64 {
        self.stop
    }

    /// Sets an input or a parameter.
    pub fn set(&mut self, index: usize, value: f64) {
        self.values[index] = value;
    }

    /// Sets the derivative of an input over the step to come.
    pub fn set_rate(&mut self, index: usize, rate: f64) {
        self.rates[index] = rate;
    }

    /// A value: an output of the last sample, an input or parameter as set.
    #[must_use]
    pub fn get(&self, index: usize) -> f64 {
        self.values[index]
    }

    fn gains(&self) -> Gains {
        Gains {
            kp: self.of(DriveSlot::Kp),
            kv: self.of(DriveSlot::Kv),
            ki: self.of(DriveSlot::Ki),
            velocity_forward: self.of(DriveSlot::VelocityForward),
            acceleration_forward: self.of(DriveSlot::AccelerationForward),
            inertia: self.of(DriveSlot::Inertia),
            limit: self.of(DriveSlot::Limit),
        }
    }

    /// Advances from the communication point by `length` s.
    ///
    /// # Errors
    /// See [`StepError`].
    pub fn step(&mut self, from: f64, length: f64) -> Result<(), StepError> {
        let interval = self.of(DriveSlot::SampleTime);
        if length / interval > MOST_STEPS {
            return Err(StepError::TooLong { step: length, internal: interval });
        }
        let (gains, rho, end) = (self.gains(), self.of(DriveSlot::Rho), from + length - SLACK * interval);
        loop {
            let due = self.start + self.next * interval;
            if due >= end + 2.0 * SLACK * interval {
                break;
            }
            self.values[DriveSlot::Torque as usize..=DriveSlot::Error as usize].copy_from_slice(&self.pending);
            if due >= end {
                break;
            }
            let ahead = (due - from).max(0.0);
            let [reference, theta, omega] = std::array::from_fn(|i| self.values[i] + self.rates[i] * ahead);
            let torque = self.drive.sample(&gains, reference / rho, theta, omega, interval);
            if !(torque.is_finite() && self.drive.integral.is_finite()) {
                return Err(StepError::NotFinite { time: from });
            }
            self.pending = [torque, reference - rho * theta];
            self.next += 1.0;
        }
        for (value, rate) in self.values.iter_mut().zip(&mut self.rates) {
            *value += *rate * length;
            *rate = 0.0;
        }
        self.time = from + length;
        Ok(())
    }

    /// Calls `visit` on every number, which it may change: a stored state is written and read by this function alone.
    pub(super) fn visit_numbers(&mut self, visit: &mut impl FnMut(&mut f64)) {
        self.values.iter_mut().chain(&mut self.rates).for_each(&mut *visit);
        for number in [&mut self.start, &mut self.stop, &mut self.time, &mut self.next, &mut self.drive.integral] {
            visit(number);
        }
        self.pending.iter_mut().for_each(&mut *visit);
        let mut started = f64::from(u8::from(self.drive.references.is_some()));
        let mut references = self.drive.references.unwrap_or_default();
        visit(&mut started);
        references.iter_mut().for_each(visit);
        self.drive.references = (started != 0.0).then_some(references);
    }

    /// Whether the numbers that [`DriveKernel::visit_numbers`] has set are finite and within their bounds.
    pub(super) fn is_valid(&self) -> bool {
        let numbers = [self.start, self.time, self.next, self.drive.integral];
        self.values.iter().zip(DRIVE).all(|(value, v)| v.allows(*value))
            && numbers
                .iter()
                .chain(&self.rates)
                .chain(&self.pending)
                .chain(self.drive.references.iter().flatten())
                .all(|x| x.is_finite())
    }
}
