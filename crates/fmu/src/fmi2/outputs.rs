//! The outputs of the axis as functions of its state, over any scalar.

use crate::axis::{Axis, State};
use crate::effects::{Reading, SensorHistory, TorqueHistory};
use crate::scalar::Scalar;
use crate::variables::Slot;

/// Everything an output is computed from, over any scalar.
pub(super) struct Outputs<'a, S> {
    pub axis: &'a Axis<S>,
    pub state: &'a State<S>,
    pub readings: &'a SensorHistory<S>,
    /// Lead of the axis, m/rad.
    pub rho: S,
    /// Torque commanded now, N.m.
    pub torque: S,
    /// Communication point, s.
    pub time: f64,
}

impl<S: Scalar> Outputs<'_, S> {
    fn reading(&self) -> Reading<S> {
        if self.axis.on().sensors().is_empty() {
            self.state.reading()
        } else {
            self.axis.effects().transform_sensor(self.axis.on(), self.readings, self.axis.h())
        }
    }

    fn acceleration(&self, inertia: usize, torques: &TorqueHistory<f64>) -> S {
        let torque = self.axis.effects().input_now(self.axis.on(), self.torque, torques);
        self.axis.accelerations(self.state, torque, self.time)[inertia]
    }

    /// The output at an index of the table, in the unit of the table; `torques` are those of the steps up to now.
    pub fn value(&self, index: usize, torques: &TorqueHistory<f64>) -> S {
        const THETA1: usize = Slot::Theta1 as usize;
        const OMEGA1: usize = Slot::Omega1 as usize;
        const ALPHA1: usize = Slot::Alpha1 as usize;
        const THETA2: usize = Slot::Theta2 as usize;
        const OMEGA2: usize = Slot::Omega2 as usize;
        const ALPHA2: usize = Slot::Alpha2 as usize;
        match index {
            THETA1 => self.reading().theta1,
            OMEGA1 => self.reading().omega1,
            ALPHA1 => self.acceleration(0, torques),
            THETA2 => self.reading().theta2,
            OMEGA2 => self.reading().omega2,
            ALPHA2 => self.acceleration(1, torques),
            _ => self.rho * self.reading().theta2,
        }
    }
}
