//! A page of memory that parent and child share: which FMI function is under way, and a reply where the pipe is gone.

#![allow(unsafe_code)]

use std::fs::File;
use std::io;
use std::path::Path;
use std::sync::atomic::{AtomicU32, AtomicU64, Ordering};

use super::super::host::CALL_SLOT;
use super::super::host::abi::CALLS;

/// Longest reply that fits, in bytes.
pub(super) const ROOM: usize = 1 << 18;

/// What is shared. Every field may hold anything: an FMU can write here too.
#[repr(C)]
pub(crate) struct Page {
    /// Number of the FMI function under way; 0 for none.
    pub call: AtomicU32,
    /// Number of the one called last.
    pub last: AtomicU32,
    /// How many were called.
    pub count: AtomicU64,
    /// The first system call that the sandbox refused, plus one.
    pub refused: AtomicU32,
    /// Whether values are in use that the validator chose: an FMU may fail with them.
    pub chosen_values: AtomicU32,
    /// How much of the sandbox is in force: see [`super::sandbox::Strength`].
    pub strength: AtomicU32,
    /// Length of the reply.
    length: AtomicU64,
    reply: [AtomicU64; ROOM / 8],
}

impl Page {
    /// Name of the function under way, or of the one called last.
    pub fn call(&self) -> (&'static str, &'static str) {
        let name = |number: u32| CALLS.get(number as usize).copied().unwrap_or(CALLS[0]);
        (name(self.call.load(Ordering::Relaxed)), name(self.last.load(Ordering::Relaxed)))
    }

    /// Leaves a reply here.
    pub fn put(&self, bytes: &[u8]) -> bool {
        if bytes.len() > ROOM {
            return false;
        }
        for (word, chunk) in self.reply.iter().zip(bytes.chunks(8)) {
            let mut eight = [0; 8];
            eight[..chunk.len()].copy_from_slice(chunk);
            word.store(u64::from_ne_bytes(eight), Ordering::Relaxed);
        }
        self.length.store(bytes.len() as u64, Ordering::Release);
        true
    }

    /// The reply left here.
    pub fn take(&self) -> Vec<u8> {
        let length = (self.length.load(Ordering::Acquire) as usize).min(ROOM);
        let words = self.reply.iter().take(length.div_ceil(8)).flat_map(|w| w.load(Ordering::Relaxed).to_ne_bytes());
        words.take(length).collect()
    }
}

/// The page, mapped from a file; the mapping is undone when the value goes.
pub(super) struct Mapped(*mut Page);

impl Mapped {
    /// Makes the file and maps it.
    pub fn create(path: &Path) -> io::Result<Self> {
        let file = File::options().read(true).write(true).create_new(true).open(path)?;
        file.set_len(size_of::<Page>() as u64)?;
        Self::map(&file)
    }

    /// Maps the page of the parent.
    pub fn open(path: &Path) -> io::Result<Self> {
        let file = File::options().read(true).write(true).open(path)?;
        if file.metadata()?.len() < size_of::<Page>() as u64 {
            return Err(io::Error::other("the shared page is cut"));
        }
        Self::map(&file)
    }

    fn map(file: &File) -> io::Result<Self> {
        use std::os::fd::AsRawFd;
        let (size, access) = (size_of::<Page>(), libc::PROT_READ | libc::PROT_WRITE);
        // SAFETY: the file is as long as the page.
        let page = unsafe { libc::mmap(std::ptr::null_mut(), size, access, libc::MAP_SHARED, file.as_raw_fd(), 0) };
        if page == libc::MAP_FAILED { Err(io::Error::last_os_error()) } else { Ok(Self(page.cast())) }
    }

    /// Keeps the mapping for good and notes the calls there.
    pub fn publish(self) -> &'static Page {
        let page = self.0;
        std::mem::forget(self);
        CALL_SLOT.store(page, Ordering::Relaxed);
        // SAFETY: mapped, of the right size, all fields valid for any bytes, and never unmapped any more.
        unsafe { &*page }
    }
}

impl std::ops::Deref for Mapped {
    type Target = Page;

    fn deref(&self) -> &Page {
        // SAFETY: mapped as long as the value lives; all fields are atomics, valid for any bytes.
        unsafe { &*self.0 }
    }
}

impl Drop for Mapped {
    fn drop(&mut self) {
        // SAFETY: mapped by us, with this size.
        unsafe { libc::munmap(self.0.cast(), size_of::<Page>()) };
    }
}
