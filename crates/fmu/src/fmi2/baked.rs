//! The start values that this binary carries.
//!
//! `modelDescription.xml` states start values that importers need not set, so the binary must start from the same. An
//! export for another machine therefore writes that machine's values over the block below, in the bytes of the library
//! it packs: no resource file to find at run time, no global to fill.

#![allow(unsafe_code)]

use crate::axis::AxisKind;
use crate::variables::Causality;
use crate::variables::{COUNT, Model, Starts};

/// What the block begins with, once in a library.
const MARK: [u8; 16] = *b"eixo start value";

#[repr(C)]
struct Block {
    mark: [u8; 16],
    motion: u64,
    model: u64,
    values: [f64; COUNT],
}

/// The table's own start values, unless an export has written others here.
#[used]
static BLOCK: Block = Block {
    mark: MARK,
    motion: 0,
    model: Model::Axis as u64,
    values: {
        let mut values = [0.0; COUNT];
        let mut i = 0;
        let mut effect = 0;
        while i < crate::variables::FIXED.len() {
            if let Some(start) = crate::variables::FIXED[i].start {
                values[i] = start;
            }
            i += 1;
        }
        while effect < crate::effects::EFFECTS.len() {
            let parameters = crate::effects::EFFECTS[effect].info().parameters;
            let mut j = 0;
            while j < parameters.len() {
                values[i] = parameters[j].off;
                i += 1;
                j += 1;
            }
            effect += 1;
        }
        values
    },
};

/// The start values of this binary.
pub(crate) fn starts() -> Starts {
    // SAFETY: the pointer is to a static, valid and aligned. Volatile, because an export has perhaps changed the bytes
    // after the compiler saw them; every pattern of bits is a valid `u64` and `f64`.
    let block = unsafe { (&raw const BLOCK).read_volatile() };
    let motion = if block.motion == 1 { AxisKind::Linear } else { AxisKind::Rotary };
    let model = if block.model == Model::Drive as u64 { Model::Drive } else { Model::Axis };
    Starts { model, values: block.values, motion }
}

/// Writes start values into the bytes of a library, little-endian as all platforms of FMI 2.0 are.
///
/// # Errors
/// Says why, when the library is not one of this interface.
pub fn bake(library: &mut [u8], starts: &Starts) -> Result<(), &'static str> {
    let mut places = library.windows(MARK.len()).enumerate().filter(|(_, w)| *w == MARK).map(|(at, _)| at);
    let at_ = places.next().ok_or("it holds no block of start values")?;
    if places.next().is_some() {
        return Err("it holds more than one block of start values");
    }
    let block =
        library.get_mut(at_ + MARK.len()..at_ + size_of::<Block>()).ok_or("its block of start values is cut off")?;
    let (head, values) = block.split_at_mut(16);
    head[..8].copy_from_slice(&(starts.motion as u64).to_le_bytes());
    head[8..].copy_from_slice(&(starts.model as u64).to_le_bytes());
    for (i, (slot, value)) in values.chunks_exact_mut(8).zip(starts.values).enumerate() {
        debug_assert!(value == 0.0 || starts.model.at(i).causality != Causality::Output);
        slot.copy_from_slice(&value.to_le_bytes());
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_block_holds_the_start_values_of_the_table() {
        assert_eq!(starts(), Starts::default());
    }

    #[test]
    fn a_library_without_the_block_or_with_two_is_refused() {
        let starts = Starts::default();
        assert!(bake(&mut [0; 64], &starts).is_err());
        assert!(bake(&mut MARK.clone(), &starts).is_err());
        let mut two = vec![0; 2 * size_of::<Block>()];
        two[..16].copy_from_slice(&MARK);
        assert!(bake(&mut two.clone(), &starts).is_ok());
        two[size_of::<Block>()..][..16].copy_from_slice(&MARK);
        assert!(bake(&mut two, &starts).is_err());
    }
}
