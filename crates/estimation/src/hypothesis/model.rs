//! A model under test: parameters, structure, effects; and which of its numbers a fit may move.

use crate::axis::{Parameters, Structure};
use crate::effects::{Effect, MEMORY, Memory, Place, Role, Settings, memory_of};

/// The axis with its effects.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Model {
    /// Nominal or fitted parameters.
    pub parameters: Parameters,
    /// One inertia or two.
    pub structure: Structure,
    /// The effects' parameters.
    pub effects: Settings,
    /// What the effects remember when the record begins.
    pub memory: Memory<f64>,
}

/// A parameter of the nominal axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BaseParameter {
    /// Inertia of the motor.
    I1,
    /// Inertia of the table.
    I2,
    /// Damping.
    B,
    /// Stiffness.
    K,
}

impl BaseParameter {
    /// Those that the structure has.
    #[must_use]
    pub const fn of(structure: Structure) -> &'static [Self] {
        match structure {
            Structure::TwoInertia => &[Self::I1, Self::I2, Self::B, Self::K],
            Structure::Rigid => &[Self::I1],
        }
    }

    /// Name as in axis.toml.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::I1 => "I1",
            Self::I2 => "I2",
            Self::B => "B",
            Self::K => "K",
        }
    }

    /// Unit of the rotary axis.
    #[must_use]
    pub const fn unit(self) -> &'static str {
        match self {
            Self::I1 | Self::I2 => "kg.m2",
            Self::B => "N.m.s/rad",
            Self::K => "N.m/rad",
        }
    }

    /// Its place in the parameters.
    pub fn slot(self, p: &mut Parameters) -> &mut f64 {
        match self {
            Self::I1 => &mut p.i1,
            Self::I2 => &mut p.i2,
            Self::B => &mut p.b,
            Self::K => &mut p.k,
        }
    }

    /// Its value.
    #[must_use]
    pub const fn value(self, p: &Parameters) -> f64 {
        match self {
            Self::I1 => p.i1,
            Self::I2 => p.i2,
            Self::B => p.b,
            Self::K => p.k,
        }
    }
}

/// A number that a fit may move.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Free {
    /// Of the nominal axis.
    Base(BaseParameter),
    /// Of an effect: which parameter.
    Effect(Effect, usize),
    /// Where an effect stands in its loop when the record begins.
    Loop(Effect),
}

/// Smallest share of its start that a size may shrink to.
const NOTHING: f64 = 1e-9;
/// Distance in x within which a value is its bound.
const ROUNDING: f64 = 1e-9;

/// How a free number is moved: `value = exp(x)*unit` or `value = x*unit`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Coordinate {
    /// Which number.
    pub free: Free,
    /// Whether x is the logarithm.
    pub log: bool,
    /// Value of x = 1 (or of exp(x) = 1).
    pub unit: f64,
    /// Bounds of x.
    pub bounds: [f64; 2],
}

impl Coordinate {
    /// The coordinate of a free number around its present value in the model.
    #[must_use]
    pub fn new(free: Free, model: &Model) -> Self {
        match free {
            Free::Base(p) => {
                let value = p.value(&model.parameters);
                // A damping of zero cannot be scaled: a small share of the critical one stands for it.
                let unit = if value > 0.0 { value } else { model.small_damping() };
                Self { free, log: true, unit, bounds: [-6.0, 6.0] }
            }
            Free::Effect(effect, i) => {
                let info = &effect.info().parameters[i];
                let value = model.effects.of(effect)[i];
                let log = info.role == Role::Shape && info.min > 0.0;
                let unit = if value.abs() > 0.0 && value.abs() < 1e6 { value.abs() } else { info.nominal };
                let bounds = if log {
                    [(info.min / unit).ln(), (info.max / unit).ln()]
                } else {
                    [info.min / unit, info.max / unit]
                };
                // An effect of no size is off, whatever its shapes do: what its fit has found would not be there again.
                #[allow(clippy::float_cmp, reason = "off and bounds are exact values of the table")]
                let off_at_an_end = info.role == Role::Size && info.min == info.off;
                let bounds = if off_at_an_end { [bounds[0] + NOTHING, bounds[1]] } else { bounds };
                Self { free, log, unit, bounds }
            }
            Free::Loop(_) => Self { free, log: false, unit: 1.0, bounds: [-1.0, 1.0] },
        }
    }

    /// Whether it shapes an effect, rather than sizes it.
    #[must_use]
    pub fn is_shape(&self) -> bool {
        matches!(self.free, Free::Effect(e, i) if e.info().parameters[i].role == Role::Shape)
    }

    /// Whether it is one of the axis' own parameters.
    #[must_use]
    pub fn is_base(&self) -> bool {
        matches!(self.free, Free::Base(_))
    }

    /// Whether a torque on the table is proportional to it.
    #[must_use]
    pub fn scales_with_the_table(&self) -> bool {
        match self.free {
            Free::Base(p) => p != BaseParameter::I1,
            Free::Effect(e, i) => {
                matches!(e.info().place, Place::Table | Place::Coupling) && e.info().parameters[i].is_torque()
            }
            Free::Loop(_) => false,
        }
    }

    /// x of the model's present value.
    #[must_use]
    pub fn x(&self, model: &Model) -> f64 {
        let value = self.value(model);
        if self.log {
            (value.max(1e-300) / self.unit).ln().clamp(self.bounds[0], self.bounds[1])
        } else {
            value / self.unit
        }
    }

    /// Whether the model's present value is as far off as it may be.
    #[must_use]
    pub fn is_at_bound(&self, model: &Model) -> bool {
        let x = self.x(model);
        self.is_least(x) || self.is_most(x)
    }

    /// Whether a place is the least that it may be.
    #[must_use]
    pub fn is_least(&self, x: f64) -> bool {
        x < self.bounds[0] + ROUNDING
    }

    /// Whether a place is the most that it may be.
    #[must_use]
    pub fn is_most(&self, x: f64) -> bool {
        x > self.bounds[1] - ROUNDING
    }

    /// The model's present value.
    #[must_use]
    pub fn value(&self, model: &Model) -> f64 {
        match self.free {
            Free::Base(p) => p.value(&model.parameters),
            Free::Effect(e, i) => model.effects.of(e)[i],
            Free::Loop(e) => model.memory[memory_of(e).start],
        }
    }

    /// The value at x.
    #[must_use]
    pub fn at(&self, x: f64) -> f64 {
        if self.log { x.exp() * self.unit } else { x * self.unit }
    }

    /// The change from one x to another in which what a model lacks is next to linear: of the axis' own parameters that of the value.
    #[must_use]
    pub fn change(&self, from: f64, to: f64) -> f64 {
        if self.is_base() && self.log { (to - from).exp_m1() } else { to - from }
    }

    /// The x at such a change from another, within its bounds.
    #[must_use]
    pub fn changed(&self, from: f64, by: f64) -> f64 {
        let to = if self.is_base() && self.log { from + by.max(-1.0).ln_1p() } else { from + by };
        to.clamp(self.bounds[0], self.bounds[1])
    }

    /// d value / d x, for standard errors.
    #[must_use]
    pub fn slope(&self, x: f64) -> f64 {
        if self.log { x.exp() * self.unit } else { self.unit }
    }
}

impl Model {
    /// A model of an axis as its file describes it.
    #[must_use]
    pub const fn new(parameters: Parameters, structure: Structure, effects: Settings) -> Self {
        Self { parameters, structure, effects, memory: [0.0; MEMORY] }
    }

    /// The model with encoders read no earlier than their stamps, and how long after its stamp each of its samples was read, s.
    #[must_use]
    pub fn on_time(&self) -> (Self, f64) {
        let (effects, ahead) = self.effects.on_time();
        (Self { effects, ..*self }, ahead)
    }

    /// Natural frequency at which its effects hold each side to one place, rad/s.
    pub fn pull(&self) -> [f64; 2] {
        let inertia = self.parameters.inertias(self.structure);
        let mut pull = [0.0_f64; 2];
        for &effect in self.effects.active().forces() {
            let side = if self.structure == Structure::Rigid { 0 } else { effect.info().place.side() };
            pull[side] = pull[side].max(effect.pull(self.effects.of(effect), inertia[side]));
        }
        pull
    }

    /// One hundredth of the critical damping.
    fn small_damping(&self) -> f64 {
        let p = &self.parameters;
        0.02 * (p.k / p.twist_mobility()).sqrt()
    }

    /// The model at coordinates `x`.
    #[must_use]
    pub fn at(&self, coordinates: &[Coordinate], x: &[f64]) -> Self {
        let mut model = *self;
        for (c, &x) in coordinates.iter().zip(x) {
            match c.free {
                Free::Base(p) => *p.slot(&mut model.parameters) = c.at(x),
                Free::Effect(e, i) => model.effects.of_mut(e)[i] = c.at(x),
                Free::Loop(e) => model.memory[memory_of(e).start] = c.at(x),
            }
        }
        model
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::axis::{Parameters, Structure};
    use crate::effects::Settings;

    #[test]
    fn a_value_within_rounding_of_its_bound_is_at_it() {
        let mut model = Model::new(Parameters::PAPER, Structure::TwoInertia, Settings::default());
        let own = Coordinate::new(Free::Base(BaseParameter::I1), &model);
        let coordinate = Coordinate { bounds: [0.2_f64.ln(), 5.0_f64.ln()], ..own };
        for (times, is_at) in [(1.0, false), (4.999, false), (5.0, true), (7.0, true), (0.2, true), (0.201, false)] {
            model.parameters.i1 = times * Parameters::PAPER.i1;
            assert_eq!(coordinate.is_at_bound(&model), is_at, "{times}");
        }
    }
}
