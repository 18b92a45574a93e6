//! The two inertias as types: a law that may act on either is written once, over its side.

use super::info::Place;

/// The inertia that a law acts on.
pub trait Side {
    /// Its place in the chain.
    const PLACE: Place;
    /// Its index in a pair of values for the two sides, the motor's first.
    const INDEX: usize;
}

/// The motor's inertia.
pub struct Motor;

impl Side for Motor {
    const PLACE: Place = Place::Motor;
    const INDEX: usize = 0;
}

/// The table's inertia.
pub struct Table;

impl Side for Table {
    const PLACE: Place = Place::Table;
    const INDEX: usize = 1;
}
