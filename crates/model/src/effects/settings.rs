//! The parameters of every effect, and where each effect's parameters and internal states lie in flat arrays.

use std::ops::Range;

use super::active::ActiveEffects;
use super::info::Role;
use super::input::{Ramp, TorqueHistory};
use super::shapes::Internal;
use super::{EFFECTS, Effect};
use crate::scalar::Scalar;

const COUNT: usize = EFFECTS.len();

/// Where each effect's parameters start in the flat array; the last entry is their number.
const OFFSETS: [usize; COUNT + 1] = {
    let mut offsets = [0; COUNT + 1];
    let mut i = 0;
    while i < COUNT {
        offsets[i + 1] = offsets[i] + EFFECTS[i].info().parameters.len();
        i += 1;
    }
    offsets
};

/// Where each effect's internal states start; the last entry is their number.
const MEMORY_OFFSETS: [usize; COUNT + 1] = {
    let mut offsets = [0; COUNT + 1];
    let mut i = 0;
    while i < COUNT {
        offsets[i + 1] = offsets[i] + EFFECTS[i].info().memory;
        i += 1;
    }
    offsets
};

/// Where an effect's internal states lie.
#[inline]
#[must_use]
pub fn memory_of(effect: Effect) -> Range<usize> {
    MEMORY_OFFSETS[effect as usize]..MEMORY_OFFSETS[effect as usize + 1]
}

/// Number of effect parameters in all.
pub const PARAMETERS: usize = OFFSETS[COUNT];
/// Number of internal states of all effects.
pub const MEMORY: usize = MEMORY_OFFSETS[COUNT];
/// Most internal states of one effect.
pub(crate) const MEMORY_OF_ONE: usize = {
    let (mut most, mut i) = (0, 0);
    while i < COUNT {
        let states = EFFECTS[i].info().memory;
        most = if states > most { states } else { most };
        i += 1;
    }
    most
};

/// Internal states of all effects.
pub type Memory<S> = [S; MEMORY];
/// The same over a step.
pub(crate) type Internals<S> = [Internal<S>; MEMORY];

/// The parameters of every effect.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings<S = f64> {
    values: [S; PARAMETERS],
}

impl<S: Scalar> Default for Settings<S> {
    /// Every effect off.
    fn default() -> Self {
        let mut values = [S::default(); PARAMETERS];
        for &effect in EFFECTS {
            for (i, p) in effect.info().parameters.iter().enumerate() {
                values[OFFSETS[effect as usize] + i] = p.off.into();
            }
        }
        Self { values }
    }
}

impl<S: Scalar> Settings<S> {
    /// The same over another scalar, as constants.
    #[must_use]
    pub fn lift(other: &Settings<f64>) -> Self {
        Self { values: other.values.map(S::from) }
    }

    /// The same without derivatives.
    #[must_use]
    pub fn primal(&self) -> Settings<f64> {
        Settings { values: self.values.map(S::re) }
    }

    /// The settings from every effect's parameters in the order of the list.
    #[must_use]
    pub fn from_flat(values: [S; PARAMETERS]) -> Self {
        Self { values }
    }

    /// Every effect's parameters in the order of the list.
    #[must_use]
    pub fn flat(&self) -> &[S; PARAMETERS] {
        &self.values
    }

    /// The parameters of an effect, in the order of its info.
    #[must_use]
    pub fn of(&self, effect: Effect) -> &[S] {
        &self.values[OFFSETS[effect as usize]..OFFSETS[effect as usize + 1]]
    }

    /// The parameters of an effect, to be changed.
    pub fn of_mut(&mut self, effect: Effect) -> &mut [S] {
        &mut self.values[OFFSETS[effect as usize]..OFFSETS[effect as usize + 1]]
    }

    /// True if a size of the effect differs from its off value.
    #[must_use]
    pub fn is_on(&self, effect: Effect) -> bool {
        #[allow(clippy::float_cmp, reason = "off is an exact value, not a measurement")]
        effect.info().parameters.iter().zip(self.of(effect)).any(|(p, v)| p.role == Role::Size && v.re() != p.off)
    }

    /// The effects that are on, sorted by shape, ready for the step.
    #[must_use]
    pub fn active(&self) -> ActiveEffects {
        self.active_with(&[])
    }

    /// The same, with some taken as on whatever their size: a derivative at the off value needs them.
    #[must_use]
    pub fn active_with(&self, also: &[Effect]) -> ActiveEffects {
        ActiveEffects::select(|effect| self.is_on(effect) || also.contains(&effect))
    }

    /// The torque on the motor over a step, from the torque commanded over it.
    pub fn transform_input(&self, on: &ActiveEffects, ramp: Ramp<S>, h: S, history: &mut TorqueHistory<S>) -> Ramp<S> {
        on.inputs().iter().fold(ramp, |ramp, &e| e.transform_input(self.of(e), ramp, h, history))
    }

    /// The torque on the motor at this instant, from the torque commanded now and the steps up to now.
    pub fn input_now(&self, on: &ActiveEffects, torque: S, history: &TorqueHistory<f64>) -> S {
        on.inputs().iter().fold(torque, |torque, &e| e.input_now(self.of(e), torque, history))
    }
}
