//! The parent's side: starts a child, reads its reply and what it prints, watches over time and disk, and ends it.

#![allow(unsafe_code)]
#![cfg(unix)]

use std::io::{self, Read};
use std::os::fd::{AsRawFd, FromRawFd, OwnedFd, RawFd};
use std::os::unix::net::UnixStream;
use std::process::Command;
use std::process::{Child, ExitStatus, Stdio};
use std::time::{Duration, Instant};

use super::job::{Job, Nonce, Order, Received, classify, rest};
use super::page::{Mapped, Page};
use super::sandbox::{Strength, wanted};
use super::{Ended, Outcome, Place, removal, temporary};

/// Most that is kept of what a child prints, in bytes.
const MOST_OUTPUT: usize = 4096;
/// Most that is read of a reply, in bytes: the largest record.
const MAX_REPLY: usize = 1 << 40;
/// Most room that is made ahead for a reply, in bytes.
const MAX_RESERVED: u64 = 1 << 30;
/// How often time is looked at, ms, and the disk.
const TICK: i32 = 20;
const DISK_EVERY: Duration = Duration::from_millis(60);

pub(super) fn run(place: &Place<'_>, job: Job) -> io::Result<Outcome> {
    let workplace = place.workplace();
    let private = place.scratch.join("tmp");
    std::fs::create_dir_all(&workplace)?;
    std::fs::create_dir_all(&private)?;
    let page_file = place.scratch.join("page");
    let _ = std::fs::remove_file(&page_file);
    let page = Mapped::create(&page_file)?;
    let fence = place.fence.clone().map(|mut fence| {
        fence.write.extend([workplace.clone(), private.clone()]);
        fence
    });
    let watched: Vec<_> = fence.iter().flat_map(|f| f.write.iter().cloned()).collect();
    let (ours, theirs) = UnixStream::pair()?;
    let mut command = Command::new(place.program);
    command.args(super::CHILD).current_dir(&workplace);
    command.stdin(Stdio::from(OwnedFd::from(theirs))).stdout(Stdio::piped()).stderr(Stdio::piped());
    if place.fence.is_some() {
        command.env("TMPDIR", &private);
    }
    if place.exact_heap {
        // Without its caches the C library counts exactly how much memory is in use.
        command.env("GLIBC_TUNABLES", "glibc.malloc.tcache_count=0");
    }
    let mut child = command.spawn()?;
    // The child's end of the socket is the child's alone from here on.
    drop(command);
    let already = watched.iter().map(|folder| temporary::size(folder)).sum::<u64>();
    let mut order = Order::new(job, page_file, place.bounds.memory, place.bounds.disk, fence);
    // A child that is gone is found out below.
    let sent = order.send(&mut &ours);
    let mut streams = Streams::new(ours, &mut child)?;
    let (ended, longest) = match sent {
        Ok(()) => streams.attend(&mut child, &page, place, &order.nonce, &|| {
            watched.iter().map(|folder| temporary::size(folder)).sum::<u64>().saturating_sub(already)
        }),
        Err(_) => (None, Duration::ZERO),
    };
    // SAFETY: the session is the child's own, whatever is left in it; its id is not reused before the child is waited
    // for by us, and afterwards only while a member of the session lives.
    unsafe {
        libc::kill(-(child.id() as i32), libc::SIGKILL);
    }
    let ended = match ended {
        Some(ended) => {
            let _ = child.kill();
            child.wait()?;
            ended
        }
        None => of(child.wait()?),
    };
    streams.drain();
    // What stays is swept with the rest, later.
    for folder in &watched {
        let _ = removal::make_removable(folder);
    }
    for folder in [workplace, private] {
        let _ = removal::remove(&folder);
    }
    Ok(outcome(streams, ended, longest, &page, &order.nonce))
}

fn outcome(streams: Streams, ended: Ended, longest: Duration, page: &Page, nonce: &Nonce) -> Outcome {
    let mut ended = ended;
    let mut reply = None;
    match classify(&streams.reply, nonce) {
        Received::Complete => reply = Some(streams.reply),
        Received::Forged if ended == Ended::Well => ended = Ended::Forges,
        Received::Partial | Received::Forged => {}
    }
    let left = page.take();
    if reply.is_none() && classify(&left, nonce) == Received::Complete {
        reply = Some(left);
    }
    let (call, last) = page.call();
    let chosen_values = page.chosen_values.load(std::sync::atomic::Ordering::Relaxed) != 0;
    let refused = page.refused.load(std::sync::atomic::Ordering::Relaxed).checked_sub(1).map(wanted);
    let strength = Strength::from_number(page.strength.load(std::sync::atomic::Ordering::Relaxed));
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    let (stdout, stderr) = (text(&streams.printed[0].kept), text(&streams.printed[1].kept));
    Outcome { ended, reply, call, last, chosen_values, longest, refused, strength, stdout, stderr }
}

/// What a child printed: the beginning is kept, the rest read and dropped.
struct Printed {
    from: Option<std::fs::File>,
    kept: Vec<u8>,
}

/// All that comes from a child.
struct Streams {
    socket: Option<UnixStream>,
    reply: Vec<u8>,
    printed: [Printed; 2],
    /// Readable once the child has ended, where the system has such a thing.
    end: Option<OwnedFd>,
    buffer: Vec<u8>,
}

fn unblocked(fd: RawFd) -> io::Result<()> {
    // SAFETY: the descriptor is open; the calls read and set its flags.
    let done = unsafe {
        let flags = libc::fcntl(fd, libc::F_GETFL);
        flags >= 0 && libc::fcntl(fd, libc::F_SETFL, flags | libc::O_NONBLOCK) >= 0
    };
    if done { Ok(()) } else { Err(io::Error::last_os_error()) }
}

impl Streams {
    fn new(socket: UnixStream, child: &mut Child) -> io::Result<Self> {
        socket.set_nonblocking(true)?;
        let out = child.stdout.take().map(OwnedFd::from);
        let err = child.stderr.take().map(OwnedFd::from);
        let printed = [out, err].map(|fd| Printed { from: fd.map(std::fs::File::from), kept: Vec::new() });
        for file in printed.iter().filter_map(|p| p.from.as_ref()) {
            unblocked(file.as_raw_fd())?;
        }
        Ok(Self { socket: Some(socket), reply: Vec::new(), printed, end: end_of(child), buffer: vec![0; 1 << 17] })
    }

    /// Reads all there is now, but not for ever.
    fn drain(&mut self) {
        let mut rounds = 0;
        if let Some(socket) = &mut self.socket {
            loop {
                rounds += 1;
                match socket.read(&mut self.buffer) {
                    Ok(0) => {
                        self.socket = None;
                        break;
                    }
                    Ok(n) if self.reply.len() + n <= MAX_REPLY => self.reply.extend_from_slice(&self.buffer[..n]),
                    Ok(_) => break,
                    Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                    Err(error) => {
                        if error.kind() != io::ErrorKind::WouldBlock {
                            self.socket = None;
                        }
                        break;
                    }
                }
                if rounds > 64 {
                    break;
                }
            }
        }
        for printed in &mut self.printed {
            let Some(file) = &mut printed.from else { continue };
            for _ in 0..16 {
                match file.read(&mut self.buffer) {
                    Ok(0) => {
                        printed.from = None;
                        break;
                    }
                    Ok(n) => {
                        let room = MOST_OUTPUT - printed.kept.len();
                        printed.kept.extend_from_slice(&self.buffer[..n.min(room)]);
                    }
                    Err(error) if error.kind() == io::ErrorKind::WouldBlock => break,
                    Err(_) => {
                        printed.from = None;
                        break;
                    }
                }
            }
        }
    }

    /// Waits until something comes or a tick has passed.
    fn wait(&self) {
        let fds = [
            self.socket.as_ref().map(AsRawFd::as_raw_fd),
            self.printed[0].from.as_ref().map(AsRawFd::as_raw_fd),
            self.printed[1].from.as_ref().map(AsRawFd::as_raw_fd),
            self.end.as_ref().map(AsRawFd::as_raw_fd),
        ];
        let mut polled: Vec<libc::pollfd> =
            fds.into_iter().flatten().map(|fd| libc::pollfd { fd, events: libc::POLLIN, revents: 0 }).collect();
        // Without a descriptor for the end, it is asked for more often.
        let tick = if self.end.is_some() { TICK } else { 2 };
        // SAFETY: the array is as long as the length passed.
        unsafe { libc::poll(polled.as_mut_ptr(), polled.len() as libc::nfds_t, tick) };
    }

    /// Reads until the child ends, or must be ended: then how. And the longest time that one call took.
    fn attend(
        &mut self,
        child: &mut Child,
        page: &Page,
        place: &Place<'_>,
        nonce: &Nonce,
        written: &dyn Fn() -> u64,
    ) -> (Option<Ended>, Duration) {
        use std::sync::atomic::Ordering::Relaxed;
        let begin = Instant::now();
        let (mut count, mut since, mut longest) = (0, begin, Duration::ZERO);
        let mut disk_at = begin;
        loop {
            self.wait();
            self.drain();
            if classify(&self.reply, nonce) == Received::Forged {
                return (Some(Ended::Forges), longest);
            }
            // Room for all of it at once, within reason: growing by and by copies it again and again.
            self.reply.reserve(rest(&self.reply, nonce).min(MAX_RESERVED) as usize);
            if !matches!(child.try_wait(), Ok(None)) {
                return (None, longest);
            }
            let now = Instant::now();
            let calls = page.count.load(Relaxed);
            if page.call.load(Relaxed) != 0 {
                longest = longest.max(now - since);
            }
            if calls != count || page.call.load(Relaxed) == 0 && classify(&self.reply, nonce) == Received::Partial {
                (count, since) = (calls, now);
            }
            // The reply is on its way, or there is none: then the process' end is late.
            if let Some(limit) = place.bounds.call
                && now - since > limit
            {
                return (Some(Ended::Hangs(limit)), longest);
            }
            if let Some(limit) = place.bounds.total
                && now - begin > limit
            {
                return (Some(Ended::Slow(limit)), longest);
            }
            if now - disk_at > DISK_EVERY && place.fence.is_some() {
                let bytes = written();
                if bytes > place.bounds.disk {
                    return (Some(Ended::Disk(bytes)), longest);
                }
                disk_at = Instant::now();
            }
        }
    }
}

#[cfg(target_os = "linux")]
fn end_of(child: &Child) -> Option<OwnedFd> {
    // SAFETY: the call takes a process id and flags; what it gives is a descriptor of ours.
    unsafe {
        let fd = libc::syscall(libc::SYS_pidfd_open, child.id() as libc::c_long, 0);
        (fd >= 0).then(|| OwnedFd::from_raw_fd(fd as RawFd))
    }
}

#[cfg(not(target_os = "linux"))]
fn end_of(_child: &Child) -> Option<OwnedFd> {
    None
}

fn of(status: ExitStatus) -> Ended {
    if let Some(signal) = std::os::unix::process::ExitStatusExt::signal(&status) {
        return Ended::Signal(signal);
    }
    match status.code() {
        Some(0) | None => Ended::Well,
        Some(code) => Ended::Exited(code),
    }
}
