//! The model: the equations of the drive axis, the effects beside them, the drive that moves it, and their exact step in time.
//! It knows no file, no FMI and no statistics, and depends on nothing.
//!
//! Imports run downward only: `axis -> effects -> scalar`; `drive` stands alone.

pub mod axis;
pub mod drive;
pub mod effects;
pub mod scalar;
