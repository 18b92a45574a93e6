//! The fence around an FMU: Landlock for files, seccomp for system calls. Raised by the child around itself before the
//! FMU's library is loaded; it cannot be taken down again, and holds for every thread and process that follows.
//!
//! Read and run: the system's libraries, the extracted FMU, what the user names. Write: the FMU's own folder, the
//! working directory and a temporary folder of its own. Refused: sockets, new processes and programs, signals to and
//! looks into others, new rights on files, what administers the machine. The home folder, `/etc` but for the loader's
//! cache and the time zone, and everything else is not there for the FMU.
//!
//! Sources: landlock(7), seccomp(2), signal numbers and registers of signal frames: `asm/ucontext.h`.

#![allow(unsafe_code)]

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

/// What an FMU may access in addition to the system's libraries.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct Fence {
    /// Files and folders it may read.
    pub read: Vec<PathBuf>,
    /// Folders it may also write to.
    pub write: Vec<PathBuf>,
}

/// How much of the fence is in force.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Strength {
    /// None was asked for.
    None = 0,
    /// System calls are refused, but the kernel has no Landlock for files.
    CallsAlone = 1,
    /// Files are fenced, but system calls are not.
    FilesAlone = 2,
    /// All of it.
    Full = 3,
    /// Asked for, but the kernel has nothing.
    Missing = 4,
}

impl Strength {
    pub(super) fn from_number(number: u32) -> Self {
        [Self::None, Self::CallsAlone, Self::FilesAlone, Self::Full, Self::Missing]
            .into_iter()
            .find(|s| *s as u32 == number)
            .unwrap_or(Self::None)
    }

    /// What a user must know, where the fence is not complete.
    #[must_use]
    pub fn gap(self) -> Option<&'static str> {
        match self {
            Self::None | Self::Full => None,
            Self::CallsAlone => Some(
                "This kernel has no Landlock: the FMU ran without a fence around files; network, new processes and \
                 signals to others were refused.",
            ),
            Self::FilesAlone => Some(
                "This kernel has no seccomp: the FMU ran with a fence around files, but with network and processes.",
            ),
            Self::Missing => Some(
                "This system has neither Landlock nor seccomp: the FMU ran without a sandbox, with the rights of the user.",
            ),
        }
    }
}

/// Paths that the user's settings point libraries to: a Python, a tool's runtime.
pub(crate) fn configured() -> Vec<PathBuf> {
    let mut found = Vec::new();
    for name in ["LD_LIBRARY_PATH", "PYTHONHOME", "PYTHONPATH", "VIRTUAL_ENV", "JAVA_HOME", "OPENMODELICAHOME"] {
        if let Some(value) = std::env::var_os(name) {
            found.extend(std::env::split_paths(&value));
        }
    }
    if let Some(value) = std::env::var_os("LD_PRELOAD") {
        let text = value.to_string_lossy().into_owned();
        let files = text.split([':', ' ']).filter(|f| !f.is_empty()).map(PathBuf::from);
        // A library's companions lie in its folder.
        found.extend(files.filter_map(|f| Some(f.canonicalize().ok()?.parent()?.to_owned())));
    }
    let home = std::env::var_os("HOME").map(PathBuf::from);
    found.retain(|path| path.is_absolute() && path.components().count() > 1 && Some(path) != home.as_ref());
    found
}

/// A description of a system call, for the one that was refused.
pub(crate) fn wanted(call: u32) -> &'static str {
    #[cfg(target_os = "linux")]
    {
        let call = i64::from(call & !0x4000_0000);
        if [libc::SYS_socket, libc::SYS_socketpair, libc::SYS_io_uring_setup].contains(&call) {
            return "the network (a socket)";
        }
        #[cfg(target_arch = "x86_64")]
        if [libc::SYS_fork, libc::SYS_vfork].contains(&call) {
            return "another process";
        }
        if [libc::SYS_clone, libc::SYS_execve, libc::SYS_execveat].contains(&call) {
            return "another process";
        }
        if [libc::SYS_kill, libc::SYS_tkill, libc::SYS_tgkill, libc::SYS_pidfd_open, libc::SYS_fcntl].contains(&call) {
            return "to signal another process";
        }
    }
    let _ = call;
    "what the system keeps for administrators and debuggers"
}

#[cfg(target_os = "linux")]
pub(super) use linux::raise;

#[cfg(not(target_os = "linux"))]
pub(super) fn raise(_fence: &Fence, _refused: &'static std::sync::atomic::AtomicU32) -> Strength {
    Strength::Missing
}

#[cfg(target_os = "linux")]
mod linux {
    use std::collections::BTreeMap;
    use std::sync::atomic::{AtomicPtr, AtomicU32, Ordering};

    use landlock::{
        ABI, Access, AccessFs, CompatLevel, Compatible, Ruleset, RulesetAttr, RulesetCreatedAttr, RulesetStatus, Scope,
        path_beneath_rules,
    };
    use seccompiler::{
        BpfProgram, SeccompAction, SeccompCmpArgLen as Len, SeccompCmpOp as Op, SeccompCondition, SeccompFilter,
        SeccompRule, sock_filter,
    };

    use super::{Fence, Strength};

    /// What every program needs to run, and nothing that identifies the user of the machine.
    const SYSTEM: [&str; 27] = [
        "/usr",
        "/lib",
        "/lib32",
        "/lib64",
        "/libx32",
        "/bin",
        "/opt",
        "/nix/store",
        "/gnu/store",
        // This process alone: others' environments and arguments hold secrets.
        "/proc/self",
        "/proc/cpuinfo",
        "/proc/meminfo",
        "/proc/stat",
        "/proc/sys",
        "/proc/version",
        "/proc/filesystems",
        "/proc/uptime",
        "/sys/devices/system",
        "/sys/fs/cgroup",
        "/etc/ld.so.cache",
        "/etc/ld.so.conf",
        "/etc/ld.so.conf.d",
        "/etc/ld.so.preload",
        "/etc/localtime",
        "/etc/locale.alias",
        "/dev/random",
        "/dev/urandom",
    ];
    /// Devices that take and give nothing.
    const DEVICES: [&str; 3] = ["/dev/null", "/dev/zero", "/dev/full"];

    /// Raises the fence around this process; `refused` receives the first call that it stops.
    pub(crate) fn raise(fence: &Fence, refused: &'static AtomicU32) -> Strength {
        match (files(fence).is_ok_and(|whole| whole), calls(refused)) {
            (true, true) => Strength::Full,
            (true, false) => Strength::FilesAlone,
            (false, true) => Strength::CallsAlone,
            (false, false) => Strength::Missing,
        }
    }

    /// Whether files are fenced.
    fn files(fence: &Fence) -> Result<bool, landlock::RulesetError> {
        let abi = ABI::V5;
        let (read, all) = (AccessFs::from_read(abi), AccessFs::from_all(abi));
        let device = AccessFs::ReadFile | AccessFs::WriteFile;
        let status = Ruleset::default()
            .set_compatibility(CompatLevel::BestEffort)
            .handle_access(all)?
            .scope(Scope::from_all(ABI::V6))?
            .create()?
            .add_rules(path_beneath_rules(SYSTEM, read))?
            .add_rules(path_beneath_rules(DEVICES, device))?
            .add_rules(path_beneath_rules(&fence.read, read))?
            .add_rules(path_beneath_rules(&fence.write, all))?
            .restrict_self()?;
        Ok(status.ruleset != RulesetStatus::NotEnforced)
    }

    /// Whether system calls are filtered.
    fn calls(refused: &'static AtomicU32) -> bool {
        let Ok(arch) = std::env::consts::ARCH.try_into() else { return false };
        let (Ok(trapped), Ok(quiet)) = (trapped(), quiet()) else { return false };
        // The refused call is reported, where the registers of a signal frame are known.
        let action = if watch(refused) { SeccompAction::Trap } else { SeccompAction::Errno(libc::EPERM as u32) };
        let filter = |rules, action| {
            let filter = SeccompFilter::new(rules, SeccompAction::Allow, action, arch).ok()?;
            BpfProgram::try_from(filter).ok()
        };
        let programs = [
            filter(absent(), SeccompAction::Errno(libc::ENOSYS as u32)),
            filter(quiet, SeccompAction::Errno(libc::EPERM as u32)),
            filter(trapped, action.clone()).map(|program| [x32(action), program].concat()),
        ];
        programs.iter().all(|p| p.as_ref().is_some_and(|p| seccompiler::apply_filter(p).is_ok()))
    }

    type Rules = BTreeMap<i64, Vec<SeccompRule>>;

    // Linux, include/uapi/asm-generic/fcntl.h, sockios.h and ioctls.h; not in the C library's bindings everywhere.
    const F_SETOWN_EX: u64 = 15;
    const FIOSETOWN: u64 = 0x8901;
    const SIOCSPGRP: u64 = 0x8902;
    /// Types into the terminal.
    const TIOCSTI: u64 = 0x5412;

    /// Calls that return ENOSYS, as on a kernel without them; the C library falls back to others.
    fn absent() -> Rules {
        always(&[libc::SYS_clone3, libc::SYS_memfd_create, libc::SYS_io_uring_setup])
    }

    /// Calls whatever their arguments.
    fn always(calls: &[i64]) -> Rules {
        calls.iter().map(|call| (*call, vec![])).collect()
    }

    /// When all of these hold of the arguments.
    fn when(conditions: &[(u8, Op, u64)]) -> seccompiler::Result<SeccompRule> {
        let conditions = conditions
            .iter()
            .map(|(argument, op, value)| SeccompCondition::new(*argument, Len::Dword, op.clone(), *value))
            .collect::<Result<Vec<_>, _>>()?;
        Ok(SeccompRule::new(conditions)?)
    }

    /// That an argument is the number of another process.
    fn others(argument: u8) -> [(u8, Op, u64); 2] {
        [(argument, Op::Ne, u64::from(std::process::id())), (argument, Op::Ne, 0)]
    }

    /// The head of a filter that refuses every call with 32-bit pointers (x32): on x86-64 those have numbers with this bit, some
    /// of their own, and no library for x86-64 makes one. By one test, as the kernel tries a new filter on every number.
    fn x32(action: SeccompAction) -> BpfProgram {
        /// `__X32_SYSCALL_BIT`, asm/unistd.h.
        const BIT: u32 = 0x4000_0000;
        if !cfg!(target_arch = "x86_64") {
            return vec![];
        }
        let step = |code: u32, jf: u8, k: u32| sock_filter { code: code as u16, jt: 0, jf, k };
        // The number is the first field of `seccomp_data`.
        vec![
            step(libc::BPF_LD | libc::BPF_W | libc::BPF_ABS, 0, 0),
            step(libc::BPF_JMP | libc::BPF_JSET | libc::BPF_K, 1, BIT),
            step(libc::BPF_RET | libc::BPF_K, 0, action.into()),
        ]
    }

    /// That an argument is the number of an older process, or of the parent: two ways. A thread of this one has a number above
    /// the process' own, but where the system has begun to count anew.
    fn older_processes(argument: u8) -> Vec<Vec<(u8, Op, u64)>> {
        let own = u64::from(std::process::id());
        let older = vec![(argument, Op::Ne, 0), (argument, Op::Lt, own)];
        // In a container of its own a process sees no parent.
        let parent = Some(u64::from(std::os::unix::process::parent_id())).filter(|parent| *parent != 0);
        std::iter::once(older).chain(parent.map(|parent| vec![(argument, Op::Eq, parent)])).collect()
    }

    /// Calls that change rights, look at or leave things behind in the kernel, or slow others down; libraries make them in
    /// passing and work without. Which processors a younger process runs on stays open: a thread of this one is bound by the
    /// same call, under a number that cannot be distinguished from those of others.
    fn quiet() -> seccompiler::Result<Rules> {
        let mut all = vec![
            libc::SYS_fchmod,
            libc::SYS_fchmodat,
            libc::SYS_fchown,
            libc::SYS_fchownat,
            libc::SYS_utimensat,
            libc::SYS_setxattr,
            libc::SYS_lsetxattr,
            libc::SYS_fsetxattr,
            libc::SYS_removexattr,
            libc::SYS_lremovexattr,
            libc::SYS_fremovexattr,
            libc::SYS_shmget,
            libc::SYS_shmat,
            libc::SYS_shmctl,
            libc::SYS_semget,
            libc::SYS_semctl,
            libc::SYS_semop,
            libc::SYS_semtimedop,
            libc::SYS_msgget,
            libc::SYS_msgctl,
            libc::SYS_msgsnd,
            libc::SYS_msgrcv,
            libc::SYS_mq_open,
            libc::SYS_mq_unlink,
            // Changes in a folder are reported without a right to read it.
            libc::SYS_inotify_add_watch,
            libc::SYS_fanotify_init,
            // fchmodat2, which the C library's bindings do not name everywhere.
            452,
        ];
        #[cfg(target_arch = "x86_64")]
        all.extend([libc::SYS_chmod, libc::SYS_chown, libc::SYS_lchown, libc::SYS_utime, libc::SYS_utimes]);
        #[cfg(target_arch = "x86_64")]
        all.extend([libc::SYS_futimesat]);
        let mut rules = always(&all);
        for (call, of_the_user) in [(libc::SYS_setpriority, 2), (libc::SYS_ioprio_set, 3)] {
            rules.insert(call, vec![when(&others(1))?, when(&[(0, Op::Eq, of_the_user)])?]);
        }
        for call in [libc::SYS_migrate_pages, libc::SYS_move_pages] {
            rules.insert(call, vec![when(&others(0))?]);
        }
        let scheduling = [
            libc::SYS_sched_setaffinity,
            libc::SYS_sched_setscheduler,
            libc::SYS_sched_setparam,
            libc::SYS_sched_setattr,
        ];
        for call in scheduling {
            rules.insert(call, older_processes(0).iter().map(|way| when(way)).collect::<seccompiler::Result<_>>()?);
        }
        Ok(rules)
    }

    /// Calls that are refused and reported.
    fn trapped() -> seccompiler::Result<Rules> {
        let mut rules = always(&[
            libc::SYS_socket,
            libc::SYS_execve,
            libc::SYS_execveat,
            libc::SYS_tkill,
            libc::SYS_pidfd_open,
            libc::SYS_pidfd_send_signal,
            libc::SYS_pidfd_getfd,
            libc::SYS_ptrace,
            libc::SYS_process_vm_readv,
            libc::SYS_process_vm_writev,
            libc::SYS_kcmp,
            libc::SYS_setrlimit,
            libc::SYS_mount,
            libc::SYS_umount2,
            libc::SYS_open_tree,
            libc::SYS_move_mount,
            libc::SYS_fsopen,
            libc::SYS_fsconfig,
            libc::SYS_fsmount,
            libc::SYS_fspick,
            libc::SYS_mount_setattr,
            libc::SYS_pivot_root,
            libc::SYS_chroot,
            libc::SYS_unshare,
            libc::SYS_setns,
            libc::SYS_open_by_handle_at,
            libc::SYS_bpf,
            libc::SYS_perf_event_open,
            libc::SYS_userfaultfd,
            libc::SYS_reboot,
            libc::SYS_kexec_load,
            libc::SYS_kexec_file_load,
            libc::SYS_init_module,
            libc::SYS_finit_module,
            libc::SYS_delete_module,
            libc::SYS_swapon,
            libc::SYS_swapoff,
            libc::SYS_acct,
            libc::SYS_quotactl,
            libc::SYS_settimeofday,
            libc::SYS_clock_settime,
            libc::SYS_clock_adjtime,
            libc::SYS_adjtimex,
            libc::SYS_sethostname,
            libc::SYS_setdomainname,
            libc::SYS_add_key,
            libc::SYS_request_key,
            libc::SYS_keyctl,
            libc::SYS_syslog,
        ]);
        #[cfg(target_arch = "x86_64")]
        for call in [libc::SYS_fork, libc::SYS_vfork, libc::SYS_ioperm, libc::SYS_iopl] {
            rules.insert(call, vec![]);
        }
        // Threads are clones that share the thread group; all else is a process.
        rules.insert(libc::SYS_clone, vec![when(&[(0, Op::MaskedEq(libc::CLONE_THREAD as u64), 0)])?]);
        for call in [libc::SYS_kill, libc::SYS_tgkill, libc::SYS_rt_sigqueueinfo, libc::SYS_rt_tgsigqueueinfo] {
            rules.insert(call, vec![when(&others(0))?]);
        }
        // The order to die with the parent stays, and so do the limits.
        rules.insert(libc::SYS_prctl, vec![when(&[(0, Op::Eq, libc::PR_SET_PDEATHSIG as u64)])?]);
        rules.insert(libc::SYS_prlimit64, vec![when(&[(2, Op::Ne, 0)])?]);
        // A pair of sockets is a pipe, but where an end can send to others: only of local ones, streams and packets in order
        // cannot.
        let pair = [
            when(&[(0, Op::Ne, libc::AF_UNIX as u64)])?,
            when(&[(1, Op::MaskedEq(0xf), libc::SOCK_DGRAM as u64)])?,
            // Which the kernel makes a datagram socket of.
            when(&[(1, Op::MaskedEq(0xf), libc::SOCK_RAW as u64)])?,
        ];
        rules.insert(libc::SYS_socketpair, pair.into());
        // The owner of a file is sent its signals, any that is chosen: no other process is to be one.
        let owner = [(1, Op::Eq, libc::F_SETOWN as u64)].into_iter().chain(others(2)).collect::<Vec<_>>();
        rules.insert(libc::SYS_fcntl, vec![when(&owner)?, when(&[(1, Op::Eq, F_SETOWN_EX)])?]);
        let control = [FIOSETOWN, SIOCSPGRP, TIOCSTI].map(|what| when(&[(1, Op::Eq, what)]));
        rules.insert(libc::SYS_ioctl, control.into_iter().collect::<seccompiler::Result<_>>()?);
        Ok(rules)
    }

    static REFUSED: AtomicPtr<AtomicU32> = AtomicPtr::new(std::ptr::null_mut());

    /// Lets a refused call return EPERM, and its number be noted. Whether that can be done on this processor.
    fn watch(refused: &'static AtomicU32) -> bool {
        if !cfg!(any(target_arch = "x86_64", target_arch = "aarch64")) {
            return false;
        }
        REFUSED.store(std::ptr::from_ref(refused).cast_mut(), Ordering::Relaxed);
        // SAFETY: all-zero bytes are a valid `sigaction`; the handler keeps to what signal-safety(7) allows.
        unsafe {
            let mut action: libc::sigaction = std::mem::zeroed();
            action.sa_sigaction = on_refusal as *const () as usize;
            action.sa_flags = libc::SA_SIGINFO | libc::SA_NODEFER;
            libc::sigaction(libc::SIGSYS, &raw const action, std::ptr::null_mut()) == 0
        }
    }

    unsafe extern "C" fn on_refusal(_signal: i32, _info: *mut libc::siginfo_t, context: *mut libc::c_void) {
        // SAFETY: the kernel hands over the interrupted thread's context; the registers are those of a call that was not
        // made, so that writing its result is what the caller waits for.
        unsafe {
            let context = &mut *context.cast::<libc::ucontext_t>();
            let refusal = -i64::from(libc::EPERM);
            #[cfg(target_arch = "x86_64")]
            let number = {
                let registers = &mut context.uc_mcontext.gregs;
                let number = registers[libc::REG_RAX as usize];
                registers[libc::REG_RAX as usize] = refusal;
                number
            };
            #[cfg(target_arch = "aarch64")]
            let number = {
                let registers = &mut context.uc_mcontext.regs;
                registers[0] = refusal as u64;
                registers[8] as i64
            };
            #[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
            let number = refusal;
            let cell = REFUSED.load(Ordering::Relaxed);
            if !cell.is_null() {
                let _ = (*cell).compare_exchange(0, number as u32 + 1, Ordering::Relaxed, Ordering::Relaxed);
            }
        }
    }
}
