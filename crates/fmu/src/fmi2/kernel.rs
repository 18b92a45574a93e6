//! The simulation behind an FMU instance: the values of the table, the axis made from them, and its state.
//!
//! It is `Copy`: getting and setting the FMU state is one copy, and a rollback is exact to the last bit. Time is the
//! communication point plus `j*h`, never accumulated. A communication step of any length is cut into equal internal
//! steps no longer than `dt_internal`, so that the order of the result never changes.

use super::outputs::Outputs;
use super::step_error::{MOST_STEPS, StepError};
use crate::axis::{Axis, ParameterError, State, Structure};
use crate::effects::{Effect, Ramp, SensorHistory, TorqueHistory, effect_scope};
use crate::scalar::Dual;
use crate::variables::{Slot, Starts, Values, all, effect_of};

/// A communication step that is longer than whole internal steps by less than this share is cut into that many.
const SLACK: f64 = 1e-6;
/// Share of the internal step over which the output derivatives of an axis with effects look ahead.
const AHEAD: f64 = 1.0 / 16.0;

/// The simulation; see the module's head.
#[derive(Debug, Clone, Copy)]
pub struct Kernel {
    values: Values,
    /// Derivative of the torque over the step to come, N.m/s.
    rate: f64,
    /// The same over the last step.
    last_rate: f64,
    /// Start of the experiment, s.
    start: f64,
    /// End of the experiment, s; infinite where none is set.
    stop: f64,
    /// Communication point, s.
    time: f64,
    /// After initialisation: the state is what counts, no longer the start values.
    live: bool,
    /// Values have changed since the axis was made.
    stale: bool,
    axis: Axis,
    state: State,
    torques: TorqueHistory<f64>,
    readings: SensorHistory<f64>,
}

impl Kernel {
    /// A simulation at its start values.
    #[must_use]
    pub fn new(starts: &Starts) -> Self {
        let values = Values(starts.values);
        let h = values.of(Slot::DtInternal);
        let axis = Axis::new(values.parameters(), values.structure(), values.effects(), values.scheme(), h);
        let [x1, v1, x2, v2] = values.initial();
        let state = axis.state(x1, v1, x2, v2, 0.0);
        Self {
            values,
            rate: 0.0,
            last_rate: 0.0,
            start: 0.0,
            stop: f64::INFINITY,
            time: 0.0,
            live: false,
            stale: true,
            axis,
            state,
            torques: TorqueHistory::default(),
            readings: axis.effects().initial_readings(axis.on(), state.reading(), h),
        }
    }

    /// Start and end of the experiment, s.
    pub fn set_experiment(&mut self, start: f64, stop: f64) {
        self.start = start;
        self.stop = stop;
        self.time = start;
        self.stale = true;
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

    /// Sets an input or a parameter; the caller checks that it may be set now.
    pub fn set(&mut self, index: usize, value: f64) {
        self.values.0[index] = value;
        // The torque is no part of the axis, so that setting it each step costs nothing; before the first step it
        // counts all the same, in the accelerations that are computed from it.
        self.stale |= index != Slot::Torque as usize;
    }

    /// Sets the derivative of the torque over the step to come, N.m/s.
    pub fn set_rate(&mut self, rate: f64) {
        self.rate = rate;
    }

    /// Makes the axis from the values, and before the end of initialisation its state from the start values.
    ///
    /// # Errors
    /// When the parameters make no axis.
    #[inline]
    pub fn prepare(&mut self) -> Result<(), ParameterError> {
        if self.stale { self.rebuild() } else { Ok(()) }
    }

    #[cold]
    fn rebuild(&mut self) -> Result<(), ParameterError> {
        let values = &self.values;
        values.parameters().check(values.structure())?;
        let h = if self.live { self.axis.h() } else { values.of(Slot::DtInternal) };
        let axis = Axis::new(values.parameters(), values.structure(), values.effects(), values.scheme(), h);
        if self.live {
            self.state = axis.take_over(&self.state, self.time);
            if axis.on().inputs() != self.axis.on().inputs() {
                self.torques = TorqueHistory::constant(values.of(Slot::Torque));
            }
            if axis.on().sensors() != self.axis.on().sensors() {
                self.readings = axis.effects().initial_readings(axis.on(), self.state.reading(), h);
            }
        } else {
            let [x1, v1, x2, v2] = values.initial();
            self.state = axis.state(x1, v1, x2, v2, self.time);
            self.torques = TorqueHistory::default();
            self.readings = axis.effects().initial_readings(axis.on(), self.state.reading(), h);
        }
        self.axis = axis;
        self.stale = false;
        Ok(())
    }

    /// Ends the initialisation.
    ///
    /// # Errors
    /// When the parameters make no axis.
    pub fn initialise(&mut self) -> Result<(), ParameterError> {
        self.prepare()?;
        self.live = true;
        Ok(())
    }

    /// Advances from the communication point by `length` s.
    ///
    /// # Errors
    /// See [`StepError`].
    #[inline]
    #[allow(clippy::float_cmp, reason = "another step length is another number, not a measurement")]
    pub fn step(&mut self, from: f64, length: f64) -> Result<(), StepError> {
        self.prepare()?;
        let internal = self.values.of(Slot::DtInternal);
        let ratio = length / internal;
        let (count, h) = if ratio <= 1.0 + SLACK {
            (1, length)
        } else if ratio <= MOST_STEPS {
            let count = (ratio - SLACK).ceil();
            (count as u32, length / count)
        } else {
            return Err(StepError::TooLong { step: length, internal });
        };
        if h != self.axis.h() {
            self.axis.set_step(h);
        }
        let torque = self.values.of(Slot::Torque);
        let on = self.axis.on();
        if on.inputs().is_empty() && on.sensors().is_empty() {
            self.run(from, torque, count, h);
        } else {
            self.run_with_histories(from, torque, count, h)?;
        }
        if !self.state.is_finite() {
            return Err(StepError::NotFinite { time: from });
        }
        self.time = from + length;
        self.values.0[Slot::Torque as usize] = torque + self.rate * length;
        self.last_rate = self.rate;
        self.rate = 0.0;
        Ok(())
    }

    #[inline]
    fn run(&mut self, from: f64, torque: f64, count: u32, h: f64) {
        let mut state = self.state;
        for j in 0..count {
            let at = f64::from(j) * h;
            let ramp = Ramp { start: torque + self.rate * at, end: torque + self.rate * (at + h) };
            state = self.axis.advance(&state, ramp, from + at);
        }
        self.state = state;
    }

    /// The same with effects that transform the torque (an input) or the readings (a sensor).
    fn run_with_histories(&mut self, from: f64, torque: f64, count: u32, h: f64) -> Result<(), StepError> {
        let (axis, effects) = (&self.axis, self.axis.effects());
        let delay = |effect: Effect| effect.delay_parameter().map_or(0.0, |i| effects.of(effect)[i]);
        let too_long = |effect, delay| StepError::Delay { effect, delay, internal: h };
        for &effect in axis.on().inputs().iter().filter(|e| e.delay_parameter().is_some()) {
            if !self.torques.covers(delay(effect), h) {
                return Err(too_long(effect, delay(effect)));
            }
        }
        // The sum of the readings' delays must be covered; the error names the longest of them.
        let sensors = axis.on().sensors();
        let all: f64 = sensors.iter().map(|&e| delay(e)).sum();
        let longest = sensors.iter().copied().reduce(|a, b| if delay(b) > delay(a) { b } else { a });
        if let Some(longest) = longest.filter(|_| all > 0.0 && !self.readings.covers(all)) {
            return Err(too_long(longest, all));
        }
        for j in 0..count {
            let at = f64::from(j) * h;
            let ramp = Ramp { start: torque + self.rate * at, end: torque + self.rate * (at + h) };
            let ramp = effects.transform_input(axis.on(), ramp, h, &mut self.torques);
            self.state = axis.advance(&self.state, ramp, from + at);
            effects.push_sensors_after(axis.on(), &mut self.readings, self.state.reading(), h);
        }
        Ok(())
    }

    /// A value: an output as it is now, an input or parameter as set.
    ///
    /// # Errors
    /// When the parameters make no axis.
    #[inline]
    pub fn get(&mut self, index: usize) -> Result<f64, ParameterError> {
        const LAST: usize = Slot::X2 as usize;
        if index > LAST || index == Slot::Torque as usize {
            return Ok(self.values.0[index]);
        }
        self.prepare()?;
        Ok(self.output(index))
    }

    fn output(&self, index: usize) -> f64 {
        let outputs = Outputs {
            axis: &self.axis,
            state: &self.state,
            readings: &self.readings,
            rho: self.values.of(Slot::Rho),
            torque: self.values.of(Slot::Torque),
            time: self.time,
        };
        outputs.value(index, &self.torques)
    }

    /// First derivative to time of an output, at the end of the last step.
    ///
    /// Exact for positions and speeds, and for the accelerations of an axis without effects. With effects the
    /// acceleration (and a speed that an encoder effect changes) is differentiated along the model itself: a second
    /// order difference of its next instants.
    ///
    /// # Errors
    /// When the parameters make no axis.
    pub fn output_derivative(&mut self, index: usize) -> Result<f64, ParameterError> {
        const THETA1: usize = Slot::Theta1 as usize;
        const OMEGA1: usize = Slot::Omega1 as usize;
        const ALPHA1: usize = Slot::Alpha1 as usize;
        const THETA2: usize = Slot::Theta2 as usize;
        const OMEGA2: usize = Slot::Omega2 as usize;
        const ALPHA2: usize = Slot::Alpha2 as usize;
        const X2: usize = Slot::X2 as usize;
        self.prepare()?;
        let on = self.axis.on();
        let same = |slot: Slot| self.output(slot as usize);
        let (late, filter) = (self.axis.effects().late(on), self.axis.effects().filter(on));
        Ok(match index {
            // Angles read early are not the integral of the speeds.
            THETA1 | THETA2 | X2 if late < 0.0 => self.difference(index),
            THETA1 => same(Slot::Omega1),
            OMEGA1 if late == 0.0 && filter == 0.0 => same(Slot::Alpha1),
            THETA2 => same(Slot::Omega2),
            X2 => same(Slot::Omega2) * self.values.of(Slot::Rho),
            OMEGA2 if on.sensors().is_empty() => same(Slot::Alpha2),
            ALPHA1 | ALPHA2 if on.motion_is_linear() && on.inputs().is_empty() => {
                let p = self.values.parameters();
                let w = self.state.omega1() - self.state.omega2();
                let a = same(Slot::Alpha1) - same(Slot::Alpha2);
                match self.values.structure() {
                    Structure::Rigid => self.last_rate / (p.i1 + p.i2),
                    // Eq. 2 of the paper, differentiated.
                    Structure::TwoInertia if index == ALPHA1 => (self.last_rate - p.b * a - p.k * w) / p.i1,
                    Structure::TwoInertia => (p.b * a + p.k * w) / p.i2,
                }
            }
            _ => self.difference(index),
        })
    }

    /// Derivative of an output to time by a look ahead along the model.
    fn difference(&self, index: usize) -> f64 {
        let h = self.axis.h() * AHEAD;
        let now = self.output(index);
        let mut ahead = *self;
        ahead.rate = self.last_rate;
        let mut next = || {
            let time = ahead.time;
            // The look ahead must not fail where the state itself is fine: then the derivative is not known.
            let done = ahead.step(time, h);
            ahead.rate = self.last_rate;
            done.map_or(f64::NAN, |()| ahead.output(index))
        };
        let (one, two) = (next(), next());
        (4.0 * one - 3.0 * now - two) / (2.0 * h)
    }

    /// Directional derivative of the outputs `unknowns` for the `seed` on the variables `knowns`, exact to rounding.
    ///
    /// During initialisation the knowns are the input and the parameters, of which the outputs at the start are a
    /// function; afterwards the input, which reaches the accelerations directly.
    ///
    /// # Errors
    /// When the parameters make no axis.
    pub fn directional(
        &mut self,
        knowns: impl Iterator<Item = (usize, f64)>,
        mut unknown: impl FnMut(&mut dyn FnMut(usize) -> f64),
    ) -> Result<(), ParameterError> {
        type D = Dual<1>;
        self.prepare()?;
        let mut values = Values::<D>(self.values.0.map(D::from));
        // An effect that is off but asked for takes part: its derivative at the off value need not be zero.
        let mut also = [false; crate::effects::EFFECTS.len()];
        for (index, seed) in knowns {
            values.0[index].eps[0] += seed;
            if let Some((effect, _)) = effect_of(index) {
                also[effect as usize] = true;
            }
        }
        let (rho, torque) = (values.of(Slot::Rho), values.of(Slot::Torque));
        let h = self.axis.h();
        let axis = effect_scope(&also, |also| {
            Axis::with_on(values.parameters(), values.structure(), values.effects(), also, values.scheme(), h)
        });
        let (state, readings);
        if self.live {
            state = State::lift(&self.state);
            readings = axis.effects().initial_readings(axis.on(), state.reading(), h);
        } else {
            let [x1, v1, x2, v2] = values.initial();
            state = axis.state(x1, v1, x2, v2, self.time);
            readings = axis.effects().initial_readings(axis.on(), state.reading(), h);
        }
        let outputs = Outputs { axis: &axis, state: &state, readings: &readings, rho, torque, time: self.time };
        unknown(&mut |index| outputs.value(index, &self.torques).eps[0]);
        Ok(())
    }

    /// Calls `visit` on every number of the simulation, which it may change: a stored state is written and read by this function alone,
    /// but for the axis: see [`Kernel::restore`].
    pub(super) fn visit_numbers(&mut self, visit: &mut impl FnMut(&mut f64)) {
        self.values.0.iter_mut().for_each(&mut *visit);
        for number in [&mut self.rate, &mut self.last_rate, &mut self.start, &mut self.stop, &mut self.time] {
            visit(number);
        }
        for flag in [&mut self.live, &mut self.stale] {
            let mut value = f64::from(u8::from(*flag));
            visit(&mut value);
            *flag = value != 0.0;
        }
        self.state.visit_numbers(visit);
        self.torques.visit_numbers(visit);
        self.readings.visit_numbers(visit);
    }

    /// Length of the internal step last used, s.
    pub(super) fn internal_step(&self) -> f64 {
        self.axis.h()
    }

    /// Makes the axis anew from the numbers that [`Kernel::visit_numbers`] has set, with internal steps of `h` s; false when a
    /// number is out of its bounds.
    pub(super) fn restore(&mut self, h: f64) -> bool {
        let valid = self.values.0.iter().zip(all()).all(|(value, v)| v.allows(*value))
            && [self.rate, self.last_rate, self.start, self.time].iter().all(|x| x.is_finite())
            && h > 0.0
            && h.is_finite();
        if valid {
            let v = &self.values;
            self.axis = Axis::new(v.parameters(), v.structure(), v.effects(), v.scheme(), h);
        }
        valid
    }
}
