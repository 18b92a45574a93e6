//! Getters and setters with arrays that end where memory ends: what is written behind an array is seen, what is read behind
//! one ends the process (FMI 2.0.4, section 2.1.7: `nvr` is the length of both arrays).

#![allow(unsafe_code)]

use super::abi::{CALLS, Call};
use super::{HostError, Instance, Status, note};

/// Values behind an array that must stay as they are.
const STRIP: usize = 16;

/// Memory that ends before a page that cannot be touched.
struct Guarded {
    #[cfg(unix)]
    mapping: (*mut libc::c_void, usize),
    #[cfg(not(unix))]
    mapping: Vec<u64>,
}

#[cfg(unix)]
impl Guarded {
    /// Room for `size` bytes, of one page at most; `None` where the system gives none.
    fn new(size: usize) -> Option<Self> {
        // SAFETY: asks for a number.
        let page = usize::try_from(unsafe { libc::sysconf(libc::_SC_PAGESIZE) }).ok()?;
        if size > page {
            return None;
        }
        // SAFETY: new memory, of which the second page is made untouchable.
        unsafe {
            let flags = libc::MAP_PRIVATE | libc::MAP_ANONYMOUS;
            let at = libc::mmap(std::ptr::null_mut(), 2 * page, libc::PROT_READ | libc::PROT_WRITE, flags, -1, 0);
            if at == libc::MAP_FAILED || libc::mprotect(at.byte_add(page), page, libc::PROT_NONE) != 0 {
                return None;
            }
            Some(Self { mapping: (at, page) })
        }
    }

    /// A copy of the values whose end is that of the memory.
    fn place<T: Copy>(&self, values: &[T]) -> *mut T {
        // SAFETY: the values fit into the first page, whose end is a multiple of their alignment.
        unsafe {
            let at = self.mapping.0.byte_add(self.mapping.1 - size_of_val(values)).cast::<T>();
            std::ptr::copy_nonoverlapping(values.as_ptr(), at, values.len());
            at
        }
    }
}

#[cfg(unix)]
impl Drop for Guarded {
    fn drop(&mut self) {
        // SAFETY: memory of this value's own.
        unsafe { libc::munmap(self.mapping.0, 2 * self.mapping.1) };
    }
}

#[cfg(not(unix))]
impl Guarded {
    fn new(size: usize) -> Option<Self> {
        Some(Self { mapping: vec![0; size.div_ceil(8) + 1] })
    }

    fn place<T: Copy>(&self, values: &[T]) -> *mut T {
        let at = self.mapping.as_ptr().cast_mut().cast::<T>();
        // SAFETY: there is room for as many bytes.
        unsafe { std::ptr::copy_nonoverlapping(values.as_ptr(), at, values.len()) };
        at
    }
}

type Get<T> = unsafe extern "C" fn(*mut std::ffi::c_void, *const u32, usize, *mut T) -> i32;
type Set<T> = unsafe extern "C" fn(*mut std::ffi::c_void, *const u32, usize, *const T) -> i32;

impl Instance {
    /// A getter of some references: what it wrote where it must not, as a sentence. What it returns is tested by another rule.
    fn get_within<T: Copy + PartialEq>(
        &mut self,
        (function, call): (Option<Get<T>>, Call),
        references: &[u32],
        mark: T,
    ) -> Option<String> {
        let function = function.filter(|_| !references.is_empty())?;
        let (name, n) = (CALLS[call as usize], references.len());
        let mut values = vec![mark; n + STRIP];
        let own = references.to_vec();
        note(call);
        // SAFETY: the arrays are as long as the lengths passed, and longer.
        let status = Status::from(unsafe { function(self.component, own.as_ptr(), n, values.as_mut_ptr()) });
        note(Call::None);
        if values[n..].iter().any(|value| *value != mark) {
            return Some(format!("{name} of {n} variables wrote behind the end of its array of values"));
        }
        if own != references {
            return Some(format!("{name} changed the array of value references, which is const"));
        }
        let room = [Guarded::new(size_of_val(references))?, Guarded::new(n * size_of::<T>())?];
        let pointers = (room[0].place(references), room[1].place(&values[..n]));
        if status.is_ok() {
            note(call);
            // SAFETY: the arrays are as long as the lengths passed.
            unsafe { function(self.component, pointers.0, n, pointers.1) };
            note(Call::None);
        }
        None
    }

    fn set_within<T: Copy>(&mut self, (function, call): (Option<Set<T>>, Call), references: &[u32], values: &[T]) {
        let Some(function) = function.filter(|_| !references.is_empty()) else { return };
        let room = (Guarded::new(size_of_val(references)), Guarded::new(size_of_val(values)));
        let (Some(first), Some(second)) = room else { return };
        let pointers = (first.place(references), second.place(values));
        note(call);
        // SAFETY: the arrays are as long as the lengths passed.
        unsafe { function(self.component, pointers.0, references.len(), pointers.1) };
        note(Call::None);
    }

    /// Reads variables, by type: Real, Integer, Boolean, String. What was written where it must not, as sentences.
    pub(crate) fn get_all_within(&mut self, references: [&[u32]; 4]) -> Vec<String> {
        let f = &self.binary.functions;
        let (real, integer) = ((f.get_real, Call::get_real), (f.get_integer, Call::get_integer));
        let (boolean, string) = ((f.get_boolean, Call::get_boolean), (f.get_string, Call::get_string));
        let found = [
            // A number that no model gives.
            self.get_within(real, references[0], -4.940_656e-318),
            self.get_within(integer, references[1], i32::MIN + 7),
            self.get_within(boolean, references[2], i32::MIN + 7),
            self.get_within(string, references[3], c"untouched".as_ptr()),
        ];
        found.into_iter().flatten().collect()
    }

    /// Sets variables from arrays that end where memory ends.
    pub(crate) fn set_all_within(
        &mut self,
        reals: (&[u32], &[f64]),
        integers: (&[u32], &[i32]),
        flags: (&[u32], &[i32]),
    ) {
        let f = &self.binary.functions;
        let (real, integer) = ((f.set_real, Call::set_real), (f.set_integer, Call::set_integer));
        let boolean = (f.set_boolean, Call::set_boolean);
        self.set_within(real, reals.0, reals.1);
        self.set_within(integer, integers.0, integers.1);
        self.set_within(boolean, flags.0, flags.1);
    }

    /// `fmi2SetString` with a text that the host overwrites when the call has come back.
    ///
    /// # Errors
    /// See [`Instance::set_debug_logging`].
    pub(crate) fn set_string_overwritten(&mut self, reference: u32, text: &str) -> Result<(), HostError> {
        let function = self.binary.functions.set_string.ok_or(HostError::Missing("fmi2SetString"))?;
        let mut bytes = super::instance::c_string(text)?.into_bytes_with_nul();
        let pointer = bytes.as_ptr().cast();
        note(Call::set_string);
        // SAFETY: one reference and one C string.
        let status = Status::from(unsafe { function(self.component, &raw const reference, 1, &raw const pointer) });
        note(Call::None);
        let end = bytes.len() - 1;
        bytes[..end].fill(b'#');
        // Kept, as an importer's memory may be: an FMU that goes on reading it reads the new text.
        std::mem::forget(bytes);
        if status.is_ok() { Ok(()) } else { Err(HostError::Status { function: "fmi2SetString", status }) }
    }
}
