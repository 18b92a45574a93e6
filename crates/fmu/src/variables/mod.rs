//! THE variable tables of the FMUs: value references, causality, units, bounds, start values, dependencies. [`Model`] is
//! the way to the table of either model; the functions of this module are those of the axis.
//!
//! Nothing lists the variables twice. The C ABI finds them here by their value reference, `modelDescription.xml` and the
//! documentation are written from here, and the parameters of the effects come from [`EFFECTS`] themselves.
//!
//! An *index* is a variable's place in the table (the model structure of the XML counts from one). A *value reference*
//! is what importers hold: the fixed variables carry their index, parameter `j` of effect `i` carries `256*(i + 1) + j`,
//! so that neither a new effect nor a new parameter of one moves the others.

/// A list of variables whose index is their value reference, and the enum of their names.
macro_rules! slots {
    ($slots:ident in $table:ident: $($slot:ident = $variable:expr;)*) => {
        /// The variables of the list by name; the number is the index.
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        #[repr(usize)]
        #[allow(missing_docs)]
        pub enum $slots { $($slot),* }

        impl $slots {
            /// All, in order.
            pub const ALL: &[Self] = &[$(Self::$slot),*];
        }

        /// The list, in order; each carries its index as value reference.
        pub const $table: &[Variable] = &[$(Variable { reference: $slots::$slot as u32, ..$variable }),*];
    };
}

mod drive;
mod fingerprint;
mod fixed;
mod model;
mod values;

use std::fmt;

use crate::effects::{EFFECTS, Effect, PARAMETERS, Place};

pub use drive::{DRIVE, DriveSlot, NO_LIMIT};
pub use fingerprint::{Guid, guid};
pub use fixed::{FIXED, Slot};
pub use model::{Model, Named};
pub use values::{Starts, Values};

/// Number of variables.
pub const COUNT: usize = FIXED.len() + PARAMETERS;

/// What a variable is to its environment (FMI 2.0.4, section 2.2.7).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Causality {
    /// Set by the environment.
    Input,
    /// Read by the environment.
    Output,
    /// Set before the run, or between steps where tunable.
    Parameter,
}

/// When a variable may change.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Variability {
    /// Not after initialisation.
    Fixed,
    /// Between communication points.
    Tunable,
    /// At any time.
    Continuous,
}

/// Named values, counted from one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Enumeration {
    /// Name of the type.
    pub name: &'static str,
    /// What it chooses.
    pub doc: &'static str,
    /// Name and sentence of each value.
    pub items: &'static [(&'static str, &'static str)],
}

/// Type of a variable.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Type {
    /// `fmi2Real`.
    Real,
    /// `fmi2Integer` with named values.
    Enumeration(&'static Enumeration),
}

/// A variable of the table.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Variable {
    /// Value reference.
    pub reference: u32,
    /// Group before the dot; empty for none.
    pub group: &'static str,
    /// Name after the dot.
    pub name: &'static str,
    /// Type.
    pub kind: Type,
    /// Causality.
    pub causality: Causality,
    /// Variability.
    pub variability: Variability,
    /// Unit of the rotary axis; empty for an enumeration.
    pub unit: &'static str,
    /// Smallest value allowed.
    pub min: Option<f64>,
    /// Largest value allowed.
    pub max: Option<f64>,
    /// Typical magnitude, where it is not one.
    pub nominal: f64,
    /// Start value; none for an output, which is computed.
    pub start: Option<f64>,
    /// One sentence.
    pub doc: &'static str,
}

impl Variable {
    /// Whether a value, in the variable's unit, is finite and within its bounds.
    #[must_use]
    pub fn allows(&self, value: f64) -> bool {
        value.is_finite() && self.min.is_none_or(|min| min <= value) && self.max.is_none_or(|max| value <= max)
    }
}

impl fmt::Display for Variable {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if !self.group.is_empty() {
            write!(f, "{}.", self.group)?;
        }
        f.write_str(self.name)
    }
}

/// The effect and the parameter's number in it behind an index, for the part of the table that the effects fill.
#[must_use]
pub fn effect_of(index: usize) -> Option<(Effect, usize)> {
    let mut left = index.checked_sub(FIXED.len())?;
    for &effect in EFFECTS {
        let count = effect.info().parameters.len();
        if left < count {
            return Some((effect, left));
        }
        left -= count;
    }
    None
}

/// Index of the first parameter of an effect.
#[must_use]
pub fn first_of(effect: Effect) -> usize {
    FIXED.len() + EFFECTS[..effect as usize].iter().map(|e| e.info().parameters.len()).sum::<usize>()
}

/// The variable at an index.
///
/// # Panics
/// If `index >= COUNT`.
#[must_use]
pub fn at(index: usize) -> Variable {
    if let Some(fixed) = FIXED.get(index) {
        return *fixed;
    }
    let Some((effect, parameter)) = effect_of(index) else {
        panic!("the table has {COUNT} variables, not {index}");
    };
    let info = effect.info();
    let p = &info.parameters[parameter];
    Variable {
        reference: 256 * (effect as u32 + 1) + parameter as u32,
        group: info.id,
        name: p.name,
        kind: Type::Real,
        causality: Causality::Parameter,
        variability: Variability::Tunable,
        unit: p.unit,
        min: Some(p.min),
        max: Some(p.max),
        nominal: p.nominal,
        start: Some(p.off),
        doc: p.doc,
    }
}

/// All variables, in order.
pub fn all() -> impl Iterator<Item = Variable> {
    (0..COUNT).map(at)
}

/// Index behind a value reference.
#[must_use]
pub fn index_of(reference: u32) -> Option<usize> {
    let (block, offset) = ((reference / 256) as usize, (reference % 256) as usize);
    match block.checked_sub(1) {
        None => (offset < FIXED.len()).then_some(offset),
        Some(effect) => {
            let &effect = EFFECTS.get(effect)?;
            (offset < effect.info().parameters.len()).then(|| first_of(effect) + offset)
        }
    }
}

/// Index of the variable of that name.
#[must_use]
pub fn find(name: &str) -> Option<usize> {
    let (group, short) = name.split_once('.').unwrap_or(("", name));
    all().position(|v| v.group == group && v.name == short)
}

/// Whether an output depends on a variable at a communication point: the input's direct way through.
///
/// The table's acceleration sees the torque directly on a rigid axis only.
#[must_use]
pub fn depends_on_input(output: usize) -> bool {
    output == Slot::Alpha1 as usize || output == Slot::Alpha2 as usize
}

/// Whether an output at the start depends on a variable (an input, or a parameter with its start value).
#[must_use]
pub fn depends_at_start(output: usize, known: usize) -> bool {
    const THETA1: usize = Slot::Theta1 as usize;
    const OMEGA1: usize = Slot::Omega1 as usize;
    const THETA2: usize = Slot::Theta2 as usize;
    const OMEGA2: usize = Slot::Omega2 as usize;
    const X2: usize = Slot::X2 as usize;
    let is = |slots: &[Slot]| slots.iter().any(|&s| s as usize == known);
    // The table's motion: its own start values, the motor's on a rigid axis, and what the encoder makes of both.
    let table = is(&[Slot::Structure, Slot::Theta1Start, Slot::Omega1Start, Slot::Theta2Start, Slot::Omega2Start]);
    match (output, effect_of(known)) {
        (THETA1, Some((effect, _))) => effect.reads_motor(),
        // The speed, where the encoders are read late or early.
        (THETA1, None) => is(&[Slot::Theta1Start, Slot::Omega1Start]),
        (OMEGA1, effect) => effect.is_none() && is(&[Slot::Omega1Start]),
        (THETA2 | OMEGA2 | X2, Some((effect, _))) => effect.info().place == Place::Sensor,
        (THETA2 | OMEGA2, None) => table,
        (X2, None) => table || is(&[Slot::Rho]),
        // Accelerations: every torque at the start, but neither the steps nor the encoders.
        (_, Some((effect, _))) => effect.info().place != Place::Sensor,
        (_, None) => table || is(&[Slot::Torque, Slot::I1, Slot::I2, Slot::B, Slot::K]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_value_reference_leads_back_to_its_variable() {
        let mut seen = std::collections::BTreeSet::new();
        for (index, v) in all().enumerate() {
            assert_eq!(index_of(v.reference), Some(index), "{v}");
            assert!(seen.insert(v.reference), "{v}");
            assert_eq!(find(&v.to_string()), Some(index), "{v}");
        }
        let known = |r: &u32| seen.contains(r);
        assert!((0..20_000_u32).filter(|r| !known(r)).all(|r| index_of(r).is_none()));
        assert_eq!(index_of(u32::MAX), None);
    }

    #[test]
    fn every_start_value_lies_within_its_bounds() {
        for v in all() {
            if let Some(start) = v.start {
                assert!(v.allows(start), "{v}");
            }
            assert_eq!(v.start.is_none(), v.causality == Causality::Output, "{v}");
            assert!(v.nominal > 0.0 && !v.doc.is_empty(), "{v}");
        }
    }

    #[test]
    fn the_slots_are_the_fixed_part_of_the_table() {
        for (slot, v) in Slot::ALL.iter().zip(FIXED) {
            assert_eq!(FIXED[*slot as usize].name, v.name);
        }
        assert_eq!(Slot::ALL.len(), FIXED.len());
        assert_eq!(FIXED[Slot::DtInternal as usize].name, "dt_internal");
        assert_eq!(FIXED[Slot::X2 as usize].name, "x2");
    }
}
