//! The torque that arrives at the motor of a model along a record.

use std::borrow::Cow;

use super::model::Model;
use crate::conditioning::Record;
use crate::effects::{ActiveEffects, Ramp, TorqueHistory};

/// The torque that arrives at the motor, part by part of the samples.
pub struct Arriving<'a> {
    model: &'a Model,
    /// The effects that are on.
    on: ActiveEffects,
    record: Cow<'a, Record>,
    /// Whether the record's torque has passed those on its way in, or there are none.
    has_passed: bool,
    history: TorqueHistory<f64>,
    /// Parts of a sample.
    per: usize,
    /// How long after its stamp a sample was read, s.
    ahead: f64,
}

impl<'a> Arriving<'a> {
    /// Along a record from a sample on, in so many parts a sample, of a model that reads its encoders on time, `ahead` seconds after their
    /// stamps.
    pub fn new(model: &'a Model, record: &'a Record, per: usize, ahead: f64, from: usize) -> Self {
        let on = model.effects.active();
        let through = record.through(&model.effects);
        let has_passed = through.is_some() || on.inputs().is_empty();
        let history = TorqueHistory::constant(record.torque[from]);
        Self { model, on, record: through.map_or(Cow::Borrowed(record), Cow::Owned), has_passed, history, per, ahead }
    }

    /// Over part `j` of sample `k`, N.m. Parts are asked for one after the other.
    pub fn over(&mut self, k: usize, j: usize) -> Ramp<f64> {
        let ramp = self.record.ramp(k, j, self.per, self.ahead);
        if self.has_passed {
            return ramp;
        }
        let h = self.record.dt / self.per as f64;
        self.model.effects.transform_input(&self.on, ramp, h, &mut self.history)
    }
}
