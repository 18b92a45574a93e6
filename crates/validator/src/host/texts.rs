//! Texts that an FMU gives: read before anything else touches memory, for they may lie where they should not.

#![allow(unsafe_code)]

use std::ffi::c_char;

/// Reads texts while stack and heap are in use, as a host may use them between two calls: what an FMU has freed, or left on the
/// stack, is gone then. Given back, a block may look as it did before.
#[inline(never)]
fn read_in_use(room: &mut Room, texts: &[*const c_char]) {
    /// Nothing that a text begins with, and an end every so often.
    const RUBBISH: [u8; 16] = *b"\x15\x15\x15\x15\x15\x15\x15\x15\x15\x15\x15\x15\x15\x15\x15\0";
    let stack = std::hint::black_box([RUBBISH; 1024]);
    let blocks: Vec<Vec<[u8; 16]>> = (1..=64).flat_map(|size| std::iter::repeat_n(vec![RUBBISH; size], 8)).collect();
    std::hint::black_box((&stack, &blocks));
    room.read(texts);
    std::hint::black_box((&stack, &blocks));
}

/// Room for texts, made before the FMU gives them: memory that is asked for behind its call may be what it has freed.
pub(super) struct Room {
    bytes: Vec<u8>,
    /// Where each text ends; none of a null pointer.
    ends: Vec<Option<usize>>,
}

/// Bytes of all texts together for which there is room.
const ROOM: usize = 1 << 16;

impl Room {
    /// Room to read as many texts once.
    pub(super) fn new(texts: usize) -> Self {
        Self { bytes: Vec::with_capacity(ROOM), ends: Vec::with_capacity(texts) }
    }

    /// Room to read as many texts twice.
    pub(super) fn twice(texts: usize) -> [Self; 2] {
        [Self::new(texts), Self::new(texts)]
    }

    /// Copies texts that the FMU gave.
    #[inline(never)]
    pub(super) fn read(&mut self, texts: &[*const c_char]) {
        for text in texts {
            let end = (!text.is_null()).then(|| {
                // SAFETY: not null, and a C string by the standard's contract, until the FMU is called again.
                self.bytes.extend_from_slice(unsafe { std::ffi::CStr::from_ptr(*text) }.to_bytes());
                self.bytes.len()
            });
            self.ends.push(end);
        }
    }

    /// Text `k`; none of a null pointer.
    pub(super) fn text(&self, k: usize) -> Option<&[u8]> {
        let start = self.ends[..k].iter().rev().find_map(|end| *end).unwrap_or_default();
        Some(&self.bytes[start..self.ends[k]?])
    }
}

/// A text, or what is wrong with it.
fn sound(text: Option<&[u8]>) -> Result<String, &'static str> {
    let text = text.ok_or("a null pointer")?;
    std::str::from_utf8(text).map(str::to_owned).map_err(|_| "no valid UTF-8")
}

/// Texts that the FMU gave, each with a check: `Err` says what is wrong with it.
pub(super) fn once(texts: &[*const c_char], mut room: Room) -> Vec<Result<String, &'static str>> {
    room.read(texts);
    (0..texts.len()).map(|k| sound(room.text(k))).collect()
}

/// As `once`, and whether they stay what they are while the FMU is not called. A part of its caller, so that the stack is used
/// from where the FMU used it.
#[inline(always)]
pub(super) fn steady(texts: &[*const c_char], [mut first, mut second]: [Room; 2]) -> Vec<Result<String, &'static str>> {
    first.read(texts);
    read_in_use(&mut second, texts);
    let check = |k: usize| match (first.text(k), second.text(k)) {
        (first, second) if first == second => sound(first),
        _ => Err("in memory that is not the FMU's any more: freed, or on the stack"),
    };
    (0..texts.len()).map(check).collect()
}
