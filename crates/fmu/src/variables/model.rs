//! The models of the library: one C ABI, one binary, a table each.

use std::fmt;

use super::{COUNT, Causality, DRIVE, DriveSlot, Slot, Variable};

/// A model of the library; the start values that an export writes into the binary contain which one it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[repr(u64)]
pub enum Model {
    /// The drive axis.
    #[default]
    Axis = 0,
    /// The drive that moves an axis along a path.
    Drive = 1,
}

// Start values have room for the larger table.
const _: () = assert!(DRIVE.len() <= COUNT);

impl Model {
    /// Number of variables.
    #[must_use]
    pub const fn count(self) -> usize {
        match self {
            Self::Axis => COUNT,
            Self::Drive => DRIVE.len(),
        }
    }

    /// The variable at an index.
    ///
    /// # Panics
    /// If `index >= self.count()`.
    #[must_use]
    pub fn at(self, index: usize) -> Variable {
        match self {
            Self::Axis => super::at(index),
            Self::Drive => DRIVE[index],
        }
    }

    /// All variables, in order.
    pub fn all(self) -> impl Iterator<Item = Variable> {
        (0..self.count()).map(move |index| self.at(index))
    }

    /// How many variables at the head of the table are Reals with their index as value reference.
    #[must_use]
    pub const fn leading_reals(self) -> usize {
        match self {
            Self::Axis => Slot::Structure as usize,
            Self::Drive => DRIVE.len(),
        }
    }

    /// Index behind a value reference.
    #[must_use]
    pub fn index_of(self, reference: u32) -> Option<usize> {
        match self {
            Self::Axis => super::index_of(reference),
            Self::Drive => Some(reference as usize).filter(|&index| index < DRIVE.len()),
        }
    }

    /// Whether an output depends on a variable at a communication point. A drive puts out what it
    /// computed from the inputs of an earlier sample: nothing reaches it directly.
    #[must_use]
    pub fn depends_on_input(self, output: usize, known: usize) -> bool {
        self == Self::Axis && known == Slot::Torque as usize && super::depends_on_input(output)
    }

    /// Whether an output at the start depends on a variable (an input, or a parameter with its start value).
    #[must_use]
    pub fn depends_at_start(self, output: usize, known: usize) -> bool {
        self == Self::Axis && super::depends_at_start(output, known)
    }

    /// Whether a directional derivative may be taken to a variable: an input always, during initialisation the
    /// parameters.
    #[must_use]
    pub fn may_be_known(self, index: usize, initialising: bool) -> bool {
        let causality = self.at(index).causality;
        causality == Causality::Input || (initialising && causality == Causality::Parameter)
    }

    /// Index of the variable that holds the longest step inside the model, s.
    #[must_use]
    pub const fn internal_step(self) -> usize {
        match self {
            Self::Axis => Slot::DtInternal as usize,
            Self::Drive => DriveSlot::SampleTime as usize,
        }
    }
}

/// A variable of a model, by its name.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Named(pub Model, pub usize);

impl Named {
    /// The variable itself.
    #[must_use]
    pub fn variable(self) -> Variable {
        self.0.at(self.1)
    }
}

impl fmt::Display for Named {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.variable().fmt(f)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_model_leads_from_a_reference_to_its_variable_and_starts_within_bounds() {
        for model in [Model::Axis, Model::Drive] {
            for (index, v) in model.all().enumerate() {
                assert_eq!(model.index_of(v.reference), Some(index), "{v}");
                assert_eq!(v.start.is_none(), v.causality == Causality::Output, "{v}");
                if let Some(start) = v.start {
                    assert!(v.allows(start), "{v}");
                }
                assert!(v.nominal > 0.0 && !v.doc.is_empty(), "{v}");
            }
            for index in 0..model.leading_reals() {
                assert_eq!(model.at(index).reference, index as u32);
                assert_eq!(model.at(index).kind, super::super::Type::Real);
            }
        }
    }
}
