//! What of this process an FMU may have changed or used up, as far as the system reports it.

#![allow(unsafe_code)]

/// Bytes that the C library has allocated and that are not freed yet.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
pub(super) fn heap() -> Option<i64> {
    type Counters = unsafe extern "C" fn() -> libc::mallinfo2;
    // `mallinfo2` came with glibc 2.33. It is looked up, not linked: the program runs with older ones, too.
    // SAFETY: what has this name in the C library is a function of this type; the calls only read the allocator's counters.
    unsafe {
        let found = libc::dlsym(libc::RTLD_DEFAULT, c"mallinfo2".as_ptr());
        if found.is_null() {
            // Its counters begin again at 4 GiB, which looks like a fall: it may hide a leak, but never simulates one.
            let info = libc::mallinfo();
            return Some(i64::from(info.uordblks.cast_unsigned()) + i64::from(info.hblkhd.cast_unsigned()));
        }
        let info = std::mem::transmute::<*mut libc::c_void, Counters>(found)();
        Some(info.uordblks as i64 + info.hblkhd as i64)
    }
}

/// Bytes that the C library has allocated and that are not freed yet.
#[cfg(not(all(target_os = "linux", target_env = "gnu")))]
pub(super) fn heap() -> Option<i64> {
    None
}

/// Fills freed memory, and what `malloc` allocates, with a byte; 0 ends that.
pub(super) fn perturb_memory(byte: u8) {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    // SAFETY: the option takes any byte; each block is written within its size and freed once.
    unsafe {
        libc::mallopt(libc::M_PERTURB, i32::from(byte));
        if byte == 0 {
            return;
        }
        // Free blocks come back as they were left.
        for size in (16..=4096).step_by(16) {
            let blocks = [(); 8].map(|()| libc::malloc(size));
            for block in blocks.into_iter().filter(|block| !block.is_null()) {
                libc::memset(block, i32::from(byte), size);
                // The compiler must not drop writes to memory about to be freed.
                libc::free(std::hint::black_box(block));
            }
        }
    }
    #[cfg(not(all(target_os = "linux", target_env = "gnu")))]
    let _ = byte;
}

fn count(folder: &str) -> usize {
    std::fs::read_dir(folder).map_or(0, Iterator::count)
}

/// Bytes of address space that this process has mapped; 0 where the system does not report it.
pub(super) fn mapped() -> usize {
    let text = std::fs::read_to_string("/proc/self/statm").unwrap_or_default();
    text.split(' ').next().and_then(|pages| pages.parse::<usize>().ok()).unwrap_or(0) * 4096
}

/// What an FMU may change of the process other than files, numbers and signal handlers, each with its name.
#[cfg(unix)]
pub(super) fn process() -> Vec<(&'static str, String)> {
    // SAFETY: all-zero bytes are valid for the structures, which the calls fill in; the mask is set back at once.
    unsafe {
        let mask = libc::umask(0o077);
        libc::umask(mask);
        let mut blocked: libc::sigset_t = std::mem::zeroed();
        libc::pthread_sigmask(libc::SIG_BLOCK, std::ptr::null(), &raw mut blocked);
        let blocked: Vec<i32> = (1..32).filter(|&signal| libc::sigismember(&raw const blocked, signal) == 1).collect();
        let mut timer: libc::itimerval = std::mem::zeroed();
        #[cfg(target_os = "linux")]
        libc::getitimer(libc::ITIMER_REAL, &raw mut timer);
        let open = |fd: i32| libc::fcntl(fd, libc::F_GETFD) != -1;
        let mut files: libc::rlimit = std::mem::zeroed();
        libc::getrlimit(libc::RLIMIT_NOFILE, &raw mut files);
        vec![
            ("the mask of permissions of new files (umask)", format!("{mask:03o}")),
            ("the blocked signals", format!("{blocked:?}")),
            (
                "the alarm timer",
                if timer.it_value.tv_sec + timer.it_value.tv_usec > 0 { "running" } else { "off" }.into(),
            ),
            ("the open standard descriptors", format!("{:?}", (0..3).filter(|&fd| open(fd)).collect::<Vec<_>>())),
            ("the most open files", files.rlim_cur.to_string()),
        ]
    }
}

/// What an FMU may change of the process other than files, numbers and signal handlers, each with its name.
#[cfg(not(unix))]
pub(super) fn process() -> Vec<(&'static str, String)> {
    Vec::new()
}

/// Open files of this process.
pub(super) fn open_files() -> usize {
    count("/proc/self/fd")
}

/// Threads of this process.
pub(super) fn threads() -> usize {
    count("/proc/self/task")
}

unsafe extern "C" {
    fn fegetround() -> i32;
}

/// Rounding direction, exception masks and treatment of denormals.
pub(super) fn floating_point() -> (i32, u32) {
    // SAFETY: the call only reads the floating-point environment.
    let rounding = unsafe { fegetround() };
    #[cfg(target_arch = "x86_64")]
    let control = {
        let mut mxcsr = 0_u32;
        // SAFETY: the instruction stores the control register into the variable.
        unsafe { std::arch::asm!("stmxcsr [{}]", in(reg) &raw mut mxcsr, options(nostack, preserves_flags)) };
        // Without the sticky exception flags, bits 0 to 5 (Intel SDM, volume 1, section 10.2.3).
        mxcsr & 0xFFC0
    };
    #[cfg(not(target_arch = "x86_64"))]
    let control = 0;
    (rounding, control)
}

/// Handlers of the signals 1 to 31.
#[cfg(unix)]
pub(super) fn signal_handlers() -> Vec<(i32, usize)> {
    (1..32)
        .map(|signal| {
            // SAFETY: all-zero bytes are a valid `sigaction`, which the call only fills in.
            let action = unsafe {
                let mut action: libc::sigaction = std::mem::zeroed();
                libc::sigaction(signal, std::ptr::null(), &raw mut action);
                action
            };
            (signal, action.sa_sigaction)
        })
        .collect()
}

/// Handlers of the signals 1 to 31.
#[cfg(not(unix))]
pub(super) fn signal_handlers() -> Vec<(i32, usize)> {
    Vec::new()
}

/// The locale of numbers.
pub(super) fn numeric_locale() -> String {
    #[cfg(unix)]
    // SAFETY: asking with a null pointer changes nothing; the text is valid until the locale changes, and read at once.
    unsafe {
        super::super::host::logger::lossy(libc::setlocale(libc::LC_NUMERIC, std::ptr::null()))
    }
    #[cfg(not(unix))]
    String::new()
}
