//! Texts and bytes that an FMU gives: read before anything else touches memory, for they may lie where they should not.

#![allow(unsafe_code)]

use std::ffi::{CStr, c_char};

/// What a call of the FMU gave: one pointer a value, null where it gave none.
#[derive(Clone, Copy)]
pub(super) enum Given<'a> {
    /// Of `fmi2GetString` and `fmi3GetString`: each ends with a byte of 0.
    Strings(&'a [*const c_char]),
    /// Of `fmi3GetBinary`: how many bytes each has, and where they are. Both slices have the same length.
    Binaries(&'a [usize], &'a [*const u8]),
}

/// A size that `fmi3GetBinary` has not written.
pub(super) const NO_SIZE: usize = usize::MAX;

impl Given<'_> {
    fn len(&self) -> usize {
        match self {
            Self::Strings(texts) => texts.len(),
            Self::Binaries(sizes, _) => sizes.len(),
        }
    }

    /// Value `k` where the FMU left it; none of a null pointer or of a size that was not written.
    fn bytes(&self, k: usize) -> Option<&[u8]> {
        match self {
            Self::Strings(texts) if texts[k].is_null() => None,
            // SAFETY: not null, and a C string by the standard's contract, until the FMU is called again.
            Self::Strings(texts) => Some(unsafe { CStr::from_ptr(texts[k]) }.to_bytes()),
            Self::Binaries(sizes, _) if sizes[k] == 0 => Some(&[]),
            Self::Binaries(sizes, at) if sizes[k] == NO_SIZE || at[k].is_null() => None,
            // SAFETY: not null, and as many bytes by the standard's contract, until the FMU is called again.
            Self::Binaries(sizes, at) => Some(unsafe { std::slice::from_raw_parts(at[k], sizes[k]) }),
        }
    }
}

/// Reads texts while stack and heap are in use, as a host may use them between two calls: what an FMU has freed, or left on the
/// stack, is overwritten then. The blocks stay in use: a freed one might get its former contents.
#[inline(never)]
fn read_in_use(room: &mut Room, given: Given<'_>) {
    /// A byte that no text begins with, and a terminating zero in each block.
    const POISON: [u8; 16] = *b"\x15\x15\x15\x15\x15\x15\x15\x15\x15\x15\x15\x15\x15\x15\x15\0";
    let stack = std::hint::black_box([POISON; 1024]);
    let blocks: Vec<Vec<[u8; 16]>> = (1..=64).flat_map(|size| std::iter::repeat_n(vec![POISON; size], 8)).collect();
    std::hint::black_box((&stack, &blocks));
    room.read(given);
    std::hint::black_box((&stack, &blocks));
}

/// Room for texts, made before the FMU gives them: memory that is allocated after its call may be what it has freed.
///
/// For texts longer than the room more is asked for all the same, and a checksum taken before that shows whether they were still
/// there afterwards.
pub(super) struct Room {
    bytes: Vec<u8>,
    /// Where each text ends, and its checksum where the FMU left it; none of a null pointer.
    ends: Vec<Option<(usize, u64)>>,
}

/// Bytes of all texts together for which there is room.
const ROOM: usize = 1 << 16;

/// Of bytes in their order (FNV-1a).
fn checksum(bytes: &[u8]) -> u64 {
    bytes.iter().fold(0xcbf2_9ce4_8422_2325, |sum, &byte| (sum ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3))
}

impl Room {
    /// Room to read as many texts once.
    pub(super) fn new(texts: usize) -> Self {
        Self { bytes: Vec::with_capacity(ROOM), ends: Vec::with_capacity(texts) }
    }

    /// Room to read as many texts twice.
    pub(super) fn twice(texts: usize) -> [Self; 2] {
        [Self::new(texts), Self::new(texts)]
    }

    /// Copies what the FMU gave, once.
    #[inline(never)]
    pub(super) fn read(&mut self, given: Given<'_>) {
        let mut end = 0_usize;
        for k in 0..given.len() {
            self.ends.push(given.bytes(k).map(|bytes| {
                end = end.saturating_add(bytes.len());
                (end, checksum(bytes))
            }));
        }
        self.bytes.reserve(end);
        for k in 0..given.len() {
            let (Some((end, _)), from) = (
                self.ends[k],
                match given {
                    Given::Strings(texts) => texts[k].cast(),
                    Given::Binaries(_, at) => at[k],
                },
            ) else {
                continue;
            };
            let start = self.bytes.len();
            if end > start {
                // SAFETY: so many bytes were read from there above, and there is room for them. The room may be the very memory
                // they are in, if the FMU has freed it: then they are copied onto themselves, or gone, which the checksum shows.
                unsafe {
                    std::ptr::copy(from, self.bytes.as_mut_ptr().add(start), end - start);
                    self.bytes.set_len(end);
                }
            }
        }
    }

    /// Value `k` as it was copied, and whether it was so where the FMU left it; none of a null pointer.
    fn copied(&self, k: usize) -> Option<(&[u8], bool)> {
        let (end, sum) = self.ends[k]?;
        let start = self.ends[..k].iter().rev().find_map(|end| *end).map_or(0, |(end, _)| end);
        let bytes = &self.bytes[start..end];
        Some((bytes, checksum(bytes) == sum))
    }

    /// Value `k`; none of a null pointer.
    pub(super) fn text(&self, k: usize) -> Option<&[u8]> {
        self.copied(k).map(|(bytes, _)| bytes)
    }
}

/// Bytes as the XML spells them.
fn hexadecimal(bytes: &[u8]) -> String {
    use std::fmt::Write;
    bytes.iter().fold(String::with_capacity(2 * bytes.len()), |mut text, byte| {
        // Writing into a string cannot fail.
        let _ = write!(text, "{byte:02x}");
        text
    })
}

const GONE: &str = "in memory that is not the FMU's any more: freed, or on the stack";

/// A value as text, or what is wrong with it.
fn intact(given: Given<'_>, k: usize, copied: Option<(&[u8], bool)>) -> Result<String, &'static str> {
    match (given, copied) {
        (Given::Strings(_), None) => Err("a null pointer"),
        (Given::Binaries(sizes, _), None) if sizes[k] == NO_SIZE => Err("without a size"),
        (Given::Binaries(..), None) => Err("a null pointer with a size"),
        (_, Some((_, false))) => Err(GONE),
        (Given::Strings(_), Some((text, true))) => {
            std::str::from_utf8(text).map(str::to_owned).map_err(|_| "no valid UTF-8")
        }
        (Given::Binaries(..), Some((bytes, true))) => Ok(hexadecimal(bytes)),
    }
}

/// What the FMU gave, as texts, each with a check: `Err` is what is wrong with it.
pub(super) fn once(given: Given<'_>, mut room: Room) -> Vec<Result<String, &'static str>> {
    room.read(given);
    (0..given.len()).map(|k| intact(given, k, room.copied(k))).collect()
}

/// As `once`, and whether they stay what they are while the FMU is not called. A part of its caller, so that the stack is used
/// from where the FMU used it.
#[inline(always)]
pub(super) fn steady(given: Given<'_>, [mut first, mut second]: [Room; 2]) -> Vec<Result<String, &'static str>> {
    first.read(given);
    read_in_use(&mut second, given);
    let check = |k: usize| match (first.copied(k), second.copied(k)) {
        (first, second) if first == second => intact(given, k, first),
        _ => Err(GONE),
    };
    (0..given.len()).map(check).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_are_hexadecimal_digits() {
        assert_eq!(hexadecimal(b"\x00\xffA"), "00ff41");
    }

    #[test]
    fn texts_longer_than_the_room_are_read_whole() {
        let long = std::ffi::CString::new(vec![b'a'; 3 * ROOM]).unwrap();
        let texts = [long.as_ptr(), std::ptr::null(), c"b".as_ptr(), c"".as_ptr()];
        let read = steady(Given::Strings(&texts), Room::twice(texts.len()));
        let expected = [Ok("a".repeat(3 * ROOM)), Err("a null pointer"), Ok("b".to_owned()), Ok(String::new())];
        assert_eq!(read, expected);
    }

    #[test]
    fn binaries_have_a_size_and_a_place_or_no_bytes_at_all() {
        let bytes = vec![0xab; ROOM + 1];
        let sizes = [2, 0, 1, NO_SIZE, bytes.len()];
        let at = [bytes.as_ptr(), std::ptr::null(), std::ptr::null(), bytes.as_ptr(), bytes.as_ptr()];
        let read = once(Given::Binaries(&sizes, &at), Room::new(sizes.len()));
        let expected = [
            Ok("abab".to_owned()),
            Ok(String::new()),
            Err("a null pointer with a size"),
            Err("without a size"),
            Ok("ab".repeat(ROOM + 1)),
        ];
        assert_eq!(read, expected);
    }

    #[test]
    fn a_text_that_is_overwritten_where_room_is_made_for_it_is_gone() {
        let mut room = Room::new(1);
        let text = b"freed\0".to_vec();
        room.read(Given::Strings(&[text.as_ptr().cast()]));
        assert_eq!(room.copied(0), Some((&b"freed"[..], true)));
        // As if the copy had been made of what came there since.
        room.bytes[0] = b'F';
        assert_eq!(intact(Given::Strings(&[text.as_ptr().cast()]), 0, room.copied(0)), Err(GONE));
    }
}
