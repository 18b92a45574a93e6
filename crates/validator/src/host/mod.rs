//! Loading an FMU's binary and calling it: every co-simulation function of FMI 2.0 and 3.0 behind a safe method.
//!
//! "Safe" as far as the FMU keeps the standard: its code runs in this process and can do anything. Code that must
//! survive any FMU runs it in a child process ([`super::isolation`]).

#![allow(unsafe_code)]

pub(crate) mod abi;
pub(crate) mod abuse;
mod bounds;
mod instance;
pub(crate) mod logger;
mod texts;
mod three;

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicPtr, Ordering};

use libloading::Library;
use tempfile::TempDir;

use super::archive::{Archive, ArchiveError};
use super::description::{Description, DescriptionError, Fmi, Interface};
use super::isolation::Page;
use abi::{Call, Functions};
pub(crate) use instance::static_text;
pub use instance::{Instance, InstanceOptions, StateHandle};
pub use logger::LogMessage;
pub use three::Layout;

/// What a call returned.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Status {
    /// All well.
    Ok,
    /// Went on, with a warning.
    Warning,
    /// Refused; the instance goes on.
    Discard,
    /// Failed; the instance can only be reset or freed.
    Error,
    /// Failed; no instance of this FMU can be used any more.
    Fatal,
    /// Still running.
    Pending,
    /// A number that FMI does not define.
    Other(i32),
}

impl From<i32> for Status {
    fn from(raw: i32) -> Self {
        match raw {
            0 => Self::Ok,
            1 => Self::Warning,
            2 => Self::Discard,
            3 => Self::Error,
            4 => Self::Fatal,
            5 => Self::Pending,
            other => Self::Other(other),
        }
    }
}

impl Status {
    /// Whether the call did what was asked: `fmi2OK` or `fmi2Warning`.
    #[must_use]
    pub fn is_ok(self) -> bool {
        matches!(self, Self::Ok | Self::Warning)
    }
}

impl std::fmt::Display for Status {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Ok => f.write_str("fmi2OK"),
            Self::Warning => f.write_str("fmi2Warning"),
            Self::Discard => f.write_str("fmi2Discard"),
            Self::Error => f.write_str("fmi2Error"),
            Self::Fatal => f.write_str("fmi2Fatal"),
            Self::Pending => f.write_str("fmi2Pending"),
            Self::Other(raw) => write!(f, "{raw} (no fmi2Status)"),
        }
    }
}

/// Why an FMU cannot be used, or a call failed.
#[derive(Debug, thiserror::Error)]
pub enum HostError {
    /// The archive.
    #[error(transparent)]
    Archive(#[from] ArchiveError),
    /// The description.
    #[error(transparent)]
    Description(#[from] DescriptionError),
    /// Only model exchange.
    #[error("{0}: the FMU offers no co-simulation")]
    NoCoSimulation(PathBuf),
    /// No binary for this platform.
    #[error("the FMU has no binary {expected} for this platform; it has: {found}")]
    NoBinary {
        /// Path inside the archive.
        expected: String,
        /// Platform folders that are there.
        found: String,
    },
    /// The system cannot load the binary.
    #[error("{file}: cannot be loaded: {message}")]
    Load {
        /// Path inside the archive.
        file: String,
        /// What the system says.
        message: String,
    },
    /// The binary lacks a function.
    #[error("the binary does not export {0}")]
    Missing(&'static str),
    /// `fmi2Instantiate` or `fmi3InstantiateCoSimulation` returned null.
    #[error("{function} refused to make an instance{}", match log.is_empty() { true => String::new(), false => format!(": {log}") })]
    Refused {
        /// Which function.
        function: &'static str,
        /// What the FMU logged.
        log: String,
    },
    /// A call returned neither `fmi2OK` nor `fmi2Warning`.
    #[error("{function} returned {}", spelt(function, *status))]
    Status {
        /// Which function.
        function: &'static str,
        /// What it returned.
        status: Status,
    },
    /// A second instance of an FMU that allows one.
    #[error("canBeInstantiatedOnlyOncePerProcess is true")]
    OnlyOnce,
    /// A call wrote past the memory it was given.
    #[error("{0} wrote past the end of the memory it was given")]
    Overrun(&'static str),
    /// A number that its type cannot hold.
    #[error("{0} is no {1}")]
    Range(i64, &'static str),
    /// An event iteration without end.
    #[error("the events of one instant do not come to an end: {0} calls of fmi3UpdateDiscreteStates")]
    Events(usize),
    /// A text with a NUL byte.
    #[error("the text {0:?} holds a NUL byte, which C strings cannot")]
    Nul(String),
}

/// A status as the version of FMI spells it that a function is of.
fn spelt(function: &str, status: Status) -> String {
    let text = status.to_string();
    if function.starts_with("fmi3") { text.replace("fmi2", "fmi3") } else { text }
}

/// Folder of this platform's binaries, and the file name extension (FMI 2.0.4, section 2.3; FMI 3.0, section 2.5.1).
#[must_use]
pub fn platform(fmi: Fmi) -> (&'static str, &'static str) {
    let wide = cfg!(target_pointer_width = "64");
    if fmi == Fmi::Three {
        let arm = cfg!(target_arch = "aarch64");
        return match (cfg!(windows), cfg!(target_vendor = "apple")) {
            (true, _) => (if wide { "x86_64-windows" } else { "x86-windows" }, "dll"),
            (_, true) => (if arm { "aarch64-darwin" } else { "x86_64-darwin" }, "dylib"),
            _ if arm => ("aarch64-linux", "so"),
            _ => (if wide { "x86_64-linux" } else { "x86-linux" }, "so"),
        };
    }
    if cfg!(windows) {
        (if wide { "win64" } else { "win32" }, "dll")
    } else if cfg!(target_vendor = "apple") {
        (if wide { "darwin64" } else { "darwin32" }, "dylib")
    } else {
        (if wide { "linux64" } else { "linux32" }, "so")
    }
}

/// Where the number of the call under way is written, so that another process can read it; null when nowhere.
pub(crate) static CALL_SLOT: AtomicPtr<Page> = AtomicPtr::new(std::ptr::null_mut());

/// Notes which call is made next.
pub(crate) fn note(call: Call) {
    let slot = CALL_SLOT.load(Ordering::Relaxed);
    if !slot.is_null() {
        // SAFETY: the slot is set once to memory that lives as long as the process.
        let page = unsafe { &*slot };
        page.call.store(call as u32, Ordering::Relaxed);
        if call != Call::None {
            page.last.store(call as u32, Ordering::Relaxed);
            // Calls from several threads may be counted as one: that there are any is what counts.
            page.count.store(page.count.load(Ordering::Relaxed).wrapping_add(1), Ordering::Relaxed);
        }
    }
}

/// Marks, until the guard is dropped, that the FMU has values that the validator chose.
pub(crate) fn chosen_values() -> ChosenValues {
    mark_chosen_values(1);
    ChosenValues
}

/// See [`chosen_values`].
pub(crate) struct ChosenValues;

impl Drop for ChosenValues {
    fn drop(&mut self) {
        mark_chosen_values(0);
    }
}

fn mark_chosen_values(on: u32) {
    let slot = CALL_SLOT.load(Ordering::Relaxed);
    if !slot.is_null() {
        // SAFETY: the slot is set once to memory that lives as long as the process.
        unsafe { &*slot }.chosen_values.store(on, Ordering::Relaxed);
    }
}

/// A loaded binary.
pub struct Binary {
    pub(crate) functions: Functions,
    loaded: Option<Library>,
}

impl std::fmt::Debug for Binary {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Binary")
    }
}

impl Binary {
    /// Loads a library; `now` resolves every symbol at once instead of on first use.
    ///
    /// # Errors
    /// When the system cannot load it.
    pub fn load(file: &Path, now: bool) -> Result<Self, HostError> {
        note(Call::Load);
        let fail = |error: libloading::Error| {
            let mut message = error.to_string();
            let mut cause = std::error::Error::source(&error);
            while let Some(error) = cause {
                message = format!("{message}: {error}");
                cause = error.source();
            }
            HostError::Load { file: file.display().to_string(), message }
        };
        // SAFETY: running the library's initialisers is what loading an FMU means; see the module's head.
        let library = unsafe { open_library(file, now) }.map_err(fail)?;
        // SAFETY: an FMU's symbols have the signatures of FMI 2.0.
        let functions = unsafe { Functions::load(&library) };
        note(Call::None);
        Ok(Self { functions, loaded: Some(library) })
    }

    /// Whether a symbol is exported.
    #[must_use]
    pub fn exports(&self, symbol: &str) -> bool {
        // SAFETY: the symbol's address is only looked up, never called.
        self.loaded.as_ref().is_some_and(|l| unsafe { l.get::<*const ()>(symbol.as_bytes()) }.is_ok())
    }
}

impl Drop for Binary {
    fn drop(&mut self) {
        note(Call::Unload);
        drop(self.loaded.take());
        note(Call::None);
    }
}

#[cfg(unix)]
unsafe fn open_library(file: &Path, now: bool) -> Result<Library, libloading::Error> {
    use libloading::os::unix;
    let flags = if now { unix::RTLD_NOW } else { unix::RTLD_LAZY };
    // SAFETY: the caller's.
    unsafe { unix::Library::open(Some(file), flags | unix::RTLD_LOCAL) }.map(Library::from)
}

#[cfg(windows)]
unsafe fn open_library(file: &Path, _now: bool) -> Result<Library, libloading::Error> {
    use libloading::os::windows;
    // Dependencies are looked for in the library's folder first.
    // SAFETY: the caller's.
    unsafe { windows::Library::load_with_flags(file, windows::LOAD_WITH_ALTERED_SEARCH_PATH) }.map(Library::from)
}

/// An FMU, extracted and loaded. The folder is deleted when the value and its instances are gone.
#[derive(Debug)]
pub struct Fmu {
    /// The model description.
    pub description: Description,
    binary: Arc<Binary>,
    // After the library: it is closed before its file goes.
    folder: Folder,
}

/// Where an FMU was extracted to.
#[derive(Debug, Clone)]
enum Folder {
    /// Deleted when the FMU and its instances are gone.
    Own(Arc<TempDir>),
    /// Another's.
    Lent(PathBuf),
}

impl Folder {
    fn path(&self) -> &Path {
        match self {
            Self::Own(folder) => folder.path(),
            Self::Lent(folder) => folder,
        }
    }
}

impl Fmu {
    /// Opens an archive, extracts it, and loads the co-simulation binary of this platform.
    ///
    /// # Errors
    /// When the archive, the description or the binary cannot be used.
    pub fn open(path: &Path) -> Result<Self, HostError> {
        let mut archive = Archive::open(path)?;
        let description = Description::parse(&archive.read("modelDescription.xml")?)?;
        let folder = archive.extract()?;
        let Some(interface) = &description.co_simulation else {
            return Err(HostError::NoCoSimulation(path.to_owned()));
        };
        let file = binary_file(folder.path(), description.fmi, interface)?;
        let binary = Arc::new(Binary::load(&file, false)?);
        Ok(Self { description, binary, folder: Folder::Own(Arc::new(folder)) })
    }

    /// Loads the co-simulation binary of this platform from a folder to which an FMU was extracted.
    ///
    /// # Errors
    /// When the binary cannot be used.
    pub(crate) fn in_folder(folder: &Path, description: Description) -> Result<Self, HostError> {
        let Some(interface) = &description.co_simulation else {
            return Err(HostError::NoCoSimulation(folder.to_owned()));
        };
        let binary = Arc::new(Binary::load(&binary_file(folder, description.fmi, interface)?, false)?);
        Ok(Self { description, binary, folder: Folder::Lent(folder.to_owned()) })
    }

    /// The co-simulation interface.
    #[must_use]
    pub fn interface(&self) -> &Interface {
        // Checked in `open`.
        self.description.co_simulation.as_ref().expect("an opened FMU offers co-simulation")
    }

    /// Where the resources are, as passed to the FMU when an instance is made.
    #[must_use]
    pub fn resources(&self) -> String {
        resource_location(self.folder.path(), self.description.fmi)
    }

    /// Makes an instance with the FMU's own GUID and resources.
    ///
    /// # Errors
    /// When the FMU refuses, or lacks a function.
    pub fn instantiate(&self, name: &str) -> Result<Instance, HostError> {
        let options = InstanceOptions {
            name: name.to_owned(),
            guid: self.description.guid.clone(),
            resources: self.resources(),
            layout: Layout::of(&self.description),
            event_mode: needs_event_mode(&self.description),
            ..InstanceOptions::default()
        };
        self.instantiate_with(&options)
    }

    /// Makes an instance.
    ///
    /// # Errors
    /// As [`Fmu::instantiate`].
    pub fn instantiate_with(&self, options: &InstanceOptions) -> Result<Instance, HostError> {
        let folder = match &self.folder {
            Folder::Own(folder) => Some(Arc::clone(folder)),
            Folder::Lent(_) => None,
        };
        Instance::new(Arc::clone(&self.binary), folder, options)
    }
}

/// Whether an FMU of FMI 3.0 can be run with event mode only: one with clocks (section 2.3.1).
#[must_use]
pub fn needs_event_mode(d: &Description) -> bool {
    !d.clocks.is_empty() && d.co_simulation.as_ref().is_some_and(|i| i.has_event_mode)
}

/// The resources folder of an extracted FMU: a URI in FMI 2.0 (section 2.1.5), in 3.0 an absolute path with a separator at
/// its end (section 2.3.1).
#[must_use]
pub fn resource_location(folder: &Path, fmi: Fmi) -> String {
    if fmi == Fmi::Three {
        let path = folder.join("resources");
        let path = std::path::absolute(&path).unwrap_or(path);
        return format!("{}{}", path.to_string_lossy(), std::path::MAIN_SEPARATOR);
    }
    let path = folder.join("resources").to_string_lossy().replace('\\', "/");
    let mut uri = String::from("file://");
    if !path.starts_with('/') {
        uri.push('/');
    }
    for byte in path.bytes() {
        if byte.is_ascii_alphanumeric() || b"/-._~:".contains(&byte) {
            uri.push(char::from(byte));
        } else {
            uri.push_str(&format!("%{byte:02X}"));
        }
    }
    uri
}

/// The binary of this platform in an extracted FMU.
///
/// # Errors
/// When there is none.
pub fn binary_file(folder: &Path, fmi: Fmi, interface: &Interface) -> Result<PathBuf, HostError> {
    let (platform, extension) = platform(fmi);
    let relative = format!("binaries/{platform}/{}.{extension}", interface.model_identifier);
    let file = folder.join(&relative);
    if file.is_file() {
        return Ok(file);
    }
    let mut found: Vec<String> = std::fs::read_dir(folder.join("binaries"))
        .map(|dir| dir.filter_map(|e| Some(e.ok()?.file_name().to_string_lossy().into_owned())).collect())
        .unwrap_or_default();
    found.sort();
    let found = if found.is_empty() { "none at all".into() } else { found.join(", ") };
    Err(HostError::NoBinary { expected: relative, found })
}
