//! The GUID: a hash of the interface and of the start values, so that a description and a binary that do not belong
//! together cannot be used together.

use std::fmt::{self, Write};

use super::Type;
use super::values::Starts;

/// FNV-1a with 128 bits (Fowler, Noll, Vo; draft-eastlake-fnv, section 6): a fingerprint, no protection.
struct Fnv(u128);

impl Fnv {
    fn new() -> Self {
        Self(0x6c62_272e_07bb_0142_62b8_2175_6295_c58d)
    }
    fn bytes(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            self.0 = (self.0 ^ u128::from(byte)).wrapping_mul(0x0000_0000_0100_0000_0000_0000_0000_013b);
        }
    }
    fn number(&mut self, value: Option<f64>) {
        self.bytes(&[u8::from(value.is_some())]);
        self.bytes(&value.unwrap_or_default().to_le_bytes());
    }
}

impl Write for Fnv {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        self.bytes(text.as_bytes());
        Ok(())
    }
}

/// A GUID as FMI writes it: `{8-4-4-4-12}`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Guid(u128);

impl Guid {
    /// The number itself.
    #[must_use]
    pub const fn number(self) -> u128 {
        self.0
    }

    /// Whether a text is this GUID; the braces and the case do not count.
    #[must_use]
    pub fn is(self, text: &str) -> bool {
        let text = text.trim();
        let text = text.strip_prefix('{').and_then(|t| t.strip_suffix('}')).unwrap_or(text);
        let digits = text.bytes().filter(|b| *b != b'-');
        let hex = |k: u32| char::from_digit((self.0 >> (124 - 4 * k)) as u32 & 15, 16).unwrap_or('?') as u8;
        text.len() == 36 && digits.map(|b| b.to_ascii_lowercase()).eq((0..32).map(hex))
    }
}

impl fmt::Display for Guid {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let n = self.0;
        let part = |shift: u32, digits: u32| (n >> shift) & ((1 << (4 * digits)) - 1);
        write!(
            f,
            "{{{:08x}-{:04x}-{:04x}-{:04x}-{:012x}}}",
            part(96, 8),
            part(80, 4),
            part(64, 4),
            part(48, 4),
            part(0, 12)
        )
    }
}

/// The GUID of the interface with these start values.
#[must_use]
pub fn guid(starts: &Starts) -> Guid {
    let mut hash = Fnv::new();
    for v in starts.model.all() {
        // Writing into a hash cannot fail.
        let _ = write!(hash, "{v}\0{}\0{:?}\0{:?}\0{}\0", v.reference, v.causality, v.variability, v.unit);
        if let Type::Enumeration(kind) = v.kind {
            kind.items.iter().for_each(|(name, _)| hash.bytes(name.as_bytes()));
        }
        for number in [v.min, v.max, v.start] {
            hash.number(number);
        }
    }
    hash.bytes(&[starts.motion as u8]);
    starts.values[..starts.model.count()].iter().for_each(|v| hash.number(Some(*v)));
    Guid(hash.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::variables::Slot;

    #[test]
    fn the_hash_is_fnv_1a() {
        // Test vectors of draft-eastlake-fnv: "" and "a".
        assert_eq!(Fnv::new().0, 0x6c62272e07bb014262b821756295c58d);
        let mut hash = Fnv::new();
        hash.bytes(b"a");
        assert_eq!(hash.0, 0xd228cb696f1a8caf78912b704e4a8964);
    }

    #[test]
    fn a_guid_knows_its_own_text_and_no_other() {
        let guid = guid(&Starts::default());
        let text = guid.to_string();
        assert_eq!(text.len(), 38);
        assert!(guid.is(&text) && guid.is(&text[1..37]) && guid.is(&text.to_uppercase()));
        assert!(!guid.is("") && !guid.is("{}") && !guid.is(&text.replace('-', "")));
        assert!(!guid.is(&text.chars().rev().collect::<String>()));
    }

    #[test]
    fn other_start_values_have_another_guid() {
        let mut starts = Starts::default();
        starts.values[Slot::I1 as usize] *= 2.0;
        assert_ne!(guid(&starts), guid(&Starts::default()));
    }
}
