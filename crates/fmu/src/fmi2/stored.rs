//! An FMU state as bytes, little-endian: magic, GUID, mode, the kernel's numbers, and a checksum over all before it.
//!
//! Bytes read may come from anywhere and are not trusted: length, magic, GUID and checksum must fit, and a count or a flag,
//! stored as `f64`, is clamped to its range.

use super::sequence::Mode;
use super::simulation::Simulation;
use crate::variables::{Starts, guid};

const MAGIC: [u8; 8] = *b"eixoFMU1";
/// Magic, GUID, mode, and length of the internal step.
const HEAD: usize = 8 + 16 + 8 + 8;
const CHECKSUM: usize = 8;

/// The part of an instance that an FMU state restores.
#[derive(Debug, Clone, Copy)]
pub struct Snapshot {
    /// The simulation.
    pub kernel: Simulation,
    /// Where in the call sequence.
    pub mode: Mode,
    /// Whether the experiment has been set up.
    pub set_up: bool,
}

/// FNV-1a with 64 bits: finds accidents, protects against nothing.
fn checksum(bytes: &[u8]) -> u64 {
    bytes.iter().fold(0xcbf2_9ce4_8422_2325, |hash, b| (hash ^ u64::from(*b)).wrapping_mul(0x0000_0100_0000_01b3))
}

/// Number of bytes of a stored state.
#[must_use]
pub fn size(kernel: &Simulation) -> usize {
    let mut count = 0;
    let mut copy = *kernel;
    copy.visit_numbers(&mut |_| count += 1);
    HEAD + 8 * count + CHECKSUM
}

/// Writes a state; `bytes` must be [`size`] long or longer.
///
/// Gives false when it is not.
pub fn write(snapshot: &Snapshot, starts: &Starts, bytes: &mut [u8]) -> bool {
    let size = size(&snapshot.kernel);
    let Some(bytes) = bytes.get_mut(..size) else { return false };
    bytes[..8].copy_from_slice(&MAGIC);
    bytes[8..24].copy_from_slice(&guid(starts).number().to_le_bytes());
    let flags = u64::from(snapshot.mode as u8) | (u64::from(snapshot.set_up) << 8);
    bytes[24..32].copy_from_slice(&flags.to_le_bytes());
    bytes[32..HEAD].copy_from_slice(&snapshot.kernel.internal_step().to_le_bytes());
    let mut at = HEAD;
    let mut copy = snapshot.kernel;
    copy.visit_numbers(&mut |number| {
        bytes[at..at + 8].copy_from_slice(&number.to_le_bytes());
        at += 8;
    });
    let sum = checksum(&bytes[..size - CHECKSUM]);
    bytes[size - CHECKSUM..].copy_from_slice(&sum.to_le_bytes());
    true
}

/// Reads a state back.
///
/// # Errors
/// With the reason, when length, magic, GUID, checksum, mode or a value does not fit.
pub fn read(starts: &Starts, bytes: &[u8]) -> Result<Snapshot, &'static str> {
    let mut kernel = Simulation::new(starts);
    let size = size(&kernel);
    if bytes.len() != size {
        return Err("it has another length");
    }
    if bytes[..8] != MAGIC {
        return Err("it is no state of this kind of FMU");
    }
    if bytes[8..24] != guid(starts).number().to_le_bytes() {
        return Err("it is the state of an FMU with another GUID");
    }
    let raw = |at: usize| {
        let mut raw = [0; 8];
        raw.copy_from_slice(&bytes[at..at + 8]);
        raw
    };
    if checksum(&bytes[..size - CHECKSUM]) != u64::from_le_bytes(raw(size - CHECKSUM)) {
        return Err("its checksum is wrong");
    }
    let flags = u64::from_le_bytes(raw(24));
    let mode = Mode::from_bits(flags as u8).ok_or("its mode is unknown")?;
    let mut at = HEAD;
    kernel.visit_numbers(&mut |value| {
        *value = f64::from_le_bytes(raw(at));
        at += 8;
    });
    if !kernel.restore(f64::from_le_bytes(raw(32))) {
        return Err("it holds values out of their bounds");
    }
    Ok(Snapshot { kernel, mode, set_up: flags & 0x100 != 0 })
}
