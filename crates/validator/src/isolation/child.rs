//! The child's side: receives an order, does the job, replies, and ends without running exit handlers.

#![allow(unsafe_code)]

/// There are no children on this system.
#[cfg(not(unix))]
pub fn child() -> std::process::ExitCode {
    std::process::ExitCode::from(2)
}

#[cfg(unix)]
pub use unix::child;

#[cfg(unix)]
mod unix {
    use std::fs::File;
    use std::io::{self, Write};
    use std::os::fd::{AsRawFd, FromRawFd, OwnedFd};
    use std::os::unix::net::UnixStream;
    use std::process::ExitCode;
    use std::sync::atomic::Ordering;

    use super::super::super::behaviour::{self, Behaviour, Setup, Stop};
    use super::super::super::description::Description;
    use super::super::super::host::{Fmu, HostError};
    use super::super::super::rules::{self, Check, id};
    use super::super::super::simulate::{self, SimulationResult};
    use super::super::super::xml::Document;
    use super::super::job::{Head, Job, Nonce, Order, Reply, RunTask, Task, numbers, send_numbers};
    use super::super::page::{Mapped, Page};
    use super::super::sandbox;

    /// Exit code of a child whose own code fails: that of a panic.
    const FAULT: i32 = 101;

    /// What a child does that was started with `--child`.
    #[must_use]
    pub fn child() -> ExitCode {
        match attempt() {
            Ok(()) => ExitCode::SUCCESS,
            Err(error) => {
                eprintln!("{error}");
                ExitCode::from(2)
            }
        }
    }

    fn attempt() -> io::Result<()> {
        let mut channel = Channel::take()?;
        let order = Order::receive(&mut channel.socket)?;
        // A session of its own: no terminal, and a group that the parent can kill as a whole.
        // SAFETY: the call takes nothing.
        unsafe { libc::setsid() };
        limit(&order);
        let page = Mapped::open(&order.page)?.publish();
        report_panics(page, order.nonce);
        if let Some(fence) = &order.fence {
            let strength = sandbox::raise(fence, &page.refused);
            page.strength.store(strength as u32, Ordering::Relaxed);
        }
        let at_once = !matches!(&order.job, Job::Rule(task) if task.rule == id::UNLOAD.text());
        let (reply, record) = match order.job {
            Job::Rule(task) => (rule(task)?, None),
            Job::Simulate(task) => match simulation(&task) {
                Ok(record) => (Reply { record: Some(Head::of(&record)), ..Reply::default() }, Some(record)),
                Err(error) => (Reply { error: Some(error), ..Reply::default() }, None),
            },
        };
        channel.reply(&reply, record.as_ref(), &order.nonce, page)?;
        leave(at_once);
        Ok(())
    }

    /// Reports a panic of this program's own code, in any thread, to the parent: from the exit code alone the parent would
    /// take it for a fault of the FMU. An FMU in Rust has a standard library of its own, and panics past this.
    fn report_panics(page: &'static Page, nonce: Nonce) {
        std::panic::set_hook(Box::new(move |panic| {
            let reply = Reply { fault: Some(panic.to_string().replace('\n', " ")), ..Reply::default() };
            if let Ok(bytes) = reply.encode(&nonce, 0) {
                page.put(&bytes);
            }
            // SAFETY: ends the process. Unwinding would call into the FMU, whose fault a crash there would seem.
            unsafe { libc::_exit(FAULT) };
        }));
    }

    /// The socket to the parent, under a descriptor that an FMU does not use by mistake.
    struct Channel {
        socket: UnixStream,
        /// Inode of the socket, by which a descriptor that the FMU has replaced is noticed.
        inode: u64,
    }

    impl Channel {
        fn take() -> io::Result<Self> {
            // SAFETY: standard input is open and a socket of ours; the copy is a descriptor of ours.
            let copy = unsafe {
                let fd = libc::fcntl(0, libc::F_DUPFD_CLOEXEC, 60);
                if fd < 0 {
                    return Err(io::Error::last_os_error());
                }
                OwnedFd::from_raw_fd(fd)
            };
            let nothing = File::open("/dev/null")?;
            // SAFETY: both descriptors are open.
            unsafe { libc::dup2(nothing.as_raw_fd(), 0) };
            let mut channel = Self { socket: UnixStream::from(copy), inode: 0 };
            channel.inode = channel.now().unwrap_or(0);
            Ok(channel)
        }

        fn now(&self) -> Option<u64> {
            // SAFETY: all-zero bytes are a valid `stat`, which the call only fills in; a closed descriptor is refused.
            unsafe {
                let mut stat: libc::stat = std::mem::zeroed();
                (libc::fstat(self.socket.as_raw_fd(), &raw mut stat) == 0).then_some(stat.st_ino as u64)
            }
        }

        fn reply(
            &mut self,
            reply: &Reply,
            record: Option<&SimulationResult>,
            nonce: &Nonce,
            page: &Page,
        ) -> io::Result<()> {
            if self.now() == Some(self.inode) {
                let head = reply.encode(nonce, record.map_or(0, numbers))?;
                self.socket.write_all(&head)?;
                return record.map_or(Ok(()), |record| send_numbers(record, &mut self.socket));
            }
            // The FMU has closed what was not its own; the descriptor may be another's now.
            std::mem::forget(std::mem::replace(&mut self.socket, UnixStream::pair()?.0));
            let (_, last) = page.call();
            let error = format!("the FMU closed descriptors of its host's process; {last} was called last");
            let reply = Reply { error: record.map(|_| error), record: None, ..reply.clone() };
            if page.put(&reply.encode(nonce, 0)?) { Ok(()) } else { Err(io::Error::other("too long an answer")) }
        }
    }

    fn rule(task: Task) -> io::Result<Reply> {
        let xml = std::fs::read(task.folder.join("modelDescription.xml"))?;
        // Whether the version is spelt right is a rule of its own.
        let description = Description::from_document(&Document::parse(&xml).map_err(io::Error::other)?);
        let Some(Check::Behaviour(test)) = rules::rule(&task.rule).map(|rule| rule.check) else {
            return Err(io::Error::other("no such rule"));
        };
        let Task { folder, binary_path, workplace, learned, .. } = task;
        let setup = Setup { description, folder, binary_path, workplace, learned };
        let (tested, learned) = behaviour::run(test, &setup);
        let mut reply = Reply { learned, ..Reply::default() };
        match tested {
            Ok(findings) => reply.findings = findings.into_iter().map(|message| (message, None)).collect(),
            Err(Stop::NotApplicable(why)) => reply.not_applicable = Some(why),
            Err(Stop::NotTested(why)) => reply.not_tested = Some(why),
            Err(Stop::Host(error)) if matches!(test, Behaviour::Indirect(_)) => {
                reply.not_tested = Some(error.to_string())
            }
            Err(Stop::Host(error)) => {
                let call = match &error {
                    HostError::Status { function, .. } | HostError::Missing(function) => Some((*function).to_owned()),
                    HostError::Refused { function, .. } => Some((*function).to_owned()),
                    _ => None,
                };
                reply.findings = vec![(error.to_string(), call)];
            }
        }
        Ok(reply)
    }

    fn simulation(task: &RunTask) -> Result<SimulationResult, String> {
        let xml = std::fs::read(task.folder.join("modelDescription.xml")).map_err(|error| error.to_string())?;
        let description = Description::parse(&xml).map_err(|error| error.to_string())?;
        let fmu = Fmu::in_folder(&task.folder, description).map_err(|error| error.to_string())?;
        let record = simulate::simulate(&fmu, &task.inputs, &task.options).map_err(|error| error.to_string());
        // What the library does when it is unloaded is no part of the run.
        std::mem::forget(fmu);
        record
    }

    /// Flushes what the FMU printed and ends the process; `at_once` without the exit handlers, which are a rule of their
    /// own.
    fn leave(at_once: bool) {
        unsafe extern "C" {
            fn fflush(stream: *mut std::ffi::c_void) -> i32;
        }
        // SAFETY: null flushes all of the C library's streams.
        unsafe { fflush(std::ptr::null_mut()) };
        if at_once {
            // SAFETY: nothing is left to clean up: all files are written and closed.
            unsafe { libc::_exit(0) };
        }
    }

    /// Limits memory, core dumps and the size of files, and dies with the parent.
    fn limit(order: &Order) {
        let set = |resource, value| {
            let limit = libc::rlimit { rlim_cur: value, rlim_max: value };
            // SAFETY: the structure is valid; a refusal leaves the limit as it was.
            unsafe { libc::setrlimit(resource, &raw const limit) };
        };
        if let Some(memory) = order.memory {
            set(libc::RLIMIT_AS, memory);
        }
        set(libc::RLIMIT_CORE, 0);
        set(libc::RLIMIT_FSIZE, order.file);
        #[cfg(target_os = "linux")]
        // SAFETY: the option takes a signal number; the other call takes nothing.
        unsafe {
            libc::prctl(libc::PR_SET_PDEATHSIG, libc::SIGKILL);
            // The parent may have ended before the option was set.
            if libc::getppid() as u32 != order.parent {
                libc::_exit(2);
            }
        }
    }
}
