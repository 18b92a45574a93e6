//! Processes that an FMU leaves behind.

#![allow(unsafe_code)]

#[cfg(target_os = "linux")]
use std::fs;

/// Lets processes that an FMU leaves behind become this process' children, even those that left their group, so that
/// [`end_orphans`] finds them. For a program that has no other children.
pub fn adopt_orphans() {
    #[cfg(target_os = "linux")]
    // SAFETY: the option takes a flag.
    unsafe {
        libc::prctl(libc::PR_SET_CHILD_SUBREAPER, 1);
    }
}

/// Kills all children of this process, and theirs.
pub fn end_orphans() {
    #[cfg(target_os = "linux")]
    // Killing one hands its children to us: again until there are none, or none that can be killed.
    for _ in 0..100 {
        if !has_children() {
            break;
        }
        let children = children();
        if children.is_empty() {
            break;
        }
        for child in children {
            // SAFETY: the id is a child's, which cannot be reused before it is waited for.
            unsafe {
                libc::kill(child, libc::SIGKILL);
                libc::waitpid(child, std::ptr::null_mut(), 0);
            }
        }
    }
}

/// Whether this process has a child, running or ended: one call, where reading all of `/proc` for none takes milliseconds.
#[cfg(target_os = "linux")]
fn has_children() -> bool {
    // SAFETY: the structure is plain data that the call fills; WNOWAIT leaves the child as it is.
    let found = unsafe {
        let mut child: libc::siginfo_t = std::mem::zeroed();
        libc::waitid(libc::P_ALL, 0, &raw mut child, libc::WEXITED | libc::WNOHANG | libc::WNOWAIT)
    };
    found == 0 || std::io::Error::last_os_error().raw_os_error() != Some(libc::ECHILD)
}

/// Ids of this process' children.
#[cfg(target_os = "linux")]
fn children() -> Vec<i32> {
    let own = std::process::id().to_string();
    let parent = |id: i32| {
        // The name, in brackets, may hold anything; state and parent follow it (proc(5)).
        let stat = fs::read_to_string(format!("/proc/{id}/stat")).ok()?;
        stat.rsplit_once(')')?.1.split_whitespace().nth(1).map(str::to_owned)
    };
    let entries = fs::read_dir("/proc").into_iter().flatten().flatten();
    let ids = entries.filter_map(|e| e.file_name().to_str()?.parse().ok());
    ids.filter(|&id| parent(id).as_deref() == Some(own.as_str())).collect()
}
