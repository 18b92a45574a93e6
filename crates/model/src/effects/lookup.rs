//! Effects and their parameters by name, and which effects can stand for each other.

use std::fmt;

use super::info::Role;
use super::{EFFECTS, Effect};

/// A name that is no effect, or no parameter of it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct UnknownEffect {
    /// The name given, `effect` or `effect.parameter`.
    pub name: String,
}

impl fmt::Display for UnknownEffect {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "no effect or effect parameter is named `{}`", self.name)
    }
}

impl std::error::Error for UnknownEffect {}

impl Effect {
    /// The effect of that id.
    ///
    /// # Errors
    /// If there is none.
    pub fn from_id(id: &str) -> Result<Self, UnknownEffect> {
        EFFECTS.iter().copied().find(|e| e.info().id == id).ok_or_else(|| UnknownEffect { name: id.to_owned() })
    }

    /// Whether the other can stand for this one: of the same family, with a size of the same name and unit. It is the same effect
    /// on the other side of the coupling, or another law of the same phenomenon.
    #[must_use]
    pub fn is_alternative_to(self, other: Self) -> bool {
        let size = |(i, _): &(usize, usize)| self.info().parameters[*i].role == Role::Size;
        self != other && self.info().family == other.info().family && self.shared(other).any(|pair| size(&pair))
    }

    /// Parameters that two effects share by name and unit: their indices in each.
    pub fn shared(self, other: Self) -> impl Iterator<Item = (usize, usize)> {
        let its = other.info().parameters;
        self.info()
            .parameters
            .iter()
            .enumerate()
            .filter_map(move |(i, p)| its.iter().position(|q| q.name == p.name && q.unit == p.unit).map(|j| (i, j)))
    }

    /// Index of a parameter of that name.
    ///
    /// # Errors
    /// If the effect has none of that name.
    pub fn parameter(self, name: &str) -> Result<usize, UnknownEffect> {
        let info = self.info();
        info.parameters
            .iter()
            .position(|p| p.name == name)
            .ok_or_else(|| UnknownEffect { name: format!("{}.{name}", info.id) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn alternatives_are_the_laws_of_one_thing_on_both_sides_of_the_coupling() {
        let mut found: Vec<[&str; 2]> = EFFECTS
            .iter()
            .flat_map(|a| EFFECTS.iter().map(move |b| (a, b)))
            .filter(|(a, b)| a.is_alternative_to(**b) && a.info().id < b.info().id)
            .map(|(a, b)| [a.info().id, b.info().id])
            .collect();
        // Of DESIGN's table: dry friction by its level, viscous friction, loads and third inertias in their two places; a
        // drag's coefficient has another unit than a viscous one.
        let dry = ["coulomb_motor", "coulomb_table", "presliding_motor", "presliding_table"];
        let mut expected =
            vec![["viscous_motor", "viscous_table"], ["load_motor", "load_table"], ["flexible_mode", "motor_mode"]];
        expected.extend((0..4).flat_map(|i| (i + 1..4).map(move |j| [dry[i], dry[j]])));
        found.sort_unstable();
        expected.sort_unstable();
        assert_eq!(found, expected);
    }
}
