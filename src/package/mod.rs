//! Packaging: the `.fmu` archive of the axis.
//!
//! The shared library comes embedded in the program (see `build.rs`), the description and the documentation from the
//! variable table. The archive is deterministic: the same axis gives the same bytes.

mod common;
mod documentation;
mod table;
mod units;
mod xml;
mod xml3;

use std::io::{self, Cursor, Write};
use std::path::Path;

use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, DateTime, ZipWriter};

use crate::drive::Gains;
use crate::fmi2::bake;
use crate::fmu::description::Fmi;
use crate::trace::{AxisKind, Machine, TraceError, write_text};
use crate::variables::{Model, Starts};

pub use table::XyTable;

/// A lean shared library.
struct Library {
    /// Its folder under `binaries/`.
    platform: &'static str,
    /// Of its file's name.
    extension: &'static str,
    bytes: &'static [u8],
}

/// One a platform, from `build.rs`; the program's own first.
static LIBRARIES: &[Library] = &include!(concat!(env!("OUT_DIR"), "/libraries.rs"));
/// The picture of the axis, from `scripts/draw_model.py`.
static PICTURE: &[u8] = include_bytes!("../../modelDescription/model.png");
static LICENSE: &str = include_str!("../../LICENSE");
/// Name of the model where no machine gives one.
const NAME: &str = "eixo";

/// Why no FMU could be written.
#[derive(Debug, thiserror::Error)]
pub enum PackageError {
    /// The embedded library.
    #[error("the embedded library cannot carry the start values: {0}")]
    Library(&'static str),
    /// A start value out of its bounds.
    #[error("{variable} = {value}: it must be from {min} to {max}")]
    Bounds {
        /// Name of the variable.
        variable: String,
        /// Its start value.
        value: f64,
        /// Smallest value allowed.
        min: f64,
        /// Largest value allowed.
        max: f64,
    },
    /// Compressing.
    #[error("cannot make the archive: {0}")]
    Archive(#[from] zip::result::ZipError),
    /// Writing into memory.
    #[error("cannot make the archive: {0}")]
    Io(#[from] io::Error),
    /// Writing the file.
    #[error(transparent)]
    Write(#[from] TraceError),
}

/// What an FMU is made from.
#[derive(Debug, Clone, PartialEq)]
pub struct Package {
    /// Name of the model.
    pub name: String,
    /// Start values.
    pub starts: Starts,
    /// The version of FMI: the same library, another description and another ABI.
    pub fmi: Fmi,
}

impl Default for Package {
    /// The paper's axis with every effect off.
    fn default() -> Self {
        Self { name: NAME.to_owned(), starts: Starts::default(), fmi: Fmi::Two }
    }
}

impl Package {
    /// The FMU of a machine.
    ///
    /// # Errors
    /// [`PackageError::Bounds`] when one of its values is out of the bounds of the FMU's variable.
    pub fn of(machine: &Machine) -> Result<Self, PackageError> {
        let starts = Starts::of(&machine.parameters, machine.structure, &machine.effects, machine.signals.motion);
        Self::checked(if machine.name.trim().is_empty() { NAME } else { &machine.name }, starts)
    }

    /// The FMU with these start values, if all lie within their bounds.
    fn checked(name: &str, starts: Starts) -> Result<Self, PackageError> {
        for (index, &value) in starts.values.iter().enumerate().take(starts.model.count()) {
            let v = starts.model.at(index);
            let (min, max) = (v.min.unwrap_or(f64::NEG_INFINITY), v.max.unwrap_or(f64::INFINITY));
            if !(min <= value && value <= max) {
                return Err(PackageError::Bounds { variable: v.to_string(), value, min, max });
            }
        }
        Ok(Self { name: name.to_owned(), starts, fmi: Fmi::Two })
    }

    /// The FMU of a drive with a sampling interval of `dt` s, for an axis with a lead of `rho`.
    ///
    /// # Errors
    /// [`PackageError::Bounds`] when a gain is out of the bounds of the FMU's variable.
    pub fn drive(name: &str, gains: &Gains, rho: f64, dt: f64, motion: AxisKind) -> Result<Self, PackageError> {
        Self::checked(name, Starts::drive(gains, rho, dt, motion))
    }

    /// `modelDescription.xml`.
    ///
    /// # Errors
    /// [`PackageError::Io`].
    pub fn model_description(&self) -> Result<Vec<u8>, PackageError> {
        Ok(match self.fmi {
            Fmi::Two => xml::document(&self.name, &self.starts)?,
            Fmi::Three => xml3::document(&self.name, &self.starts)?,
        })
    }

    /// Platforms whose library goes into the archive, by their folders; the program's own first.
    pub fn platforms() -> impl Iterator<Item = &'static str> {
        LIBRARIES.iter().map(|l| l.platform)
    }

    /// The shared library of the program's own platform, with the start values in it.
    ///
    /// # Errors
    /// [`PackageError::Library`].
    pub fn binary(&self) -> Result<Vec<u8>, PackageError> {
        self.baked(&LIBRARIES[0])
    }

    fn baked(&self, library: &Library) -> Result<Vec<u8>, PackageError> {
        let mut bytes = library.bytes.to_vec();
        bake(&mut bytes, &self.starts).map_err(PackageError::Library)?;
        Ok(bytes)
    }

    /// The archive.
    ///
    /// # Errors
    /// See [`PackageError`].
    pub fn archive(&self) -> Result<Vec<u8>, PackageError> {
        let model = self.starts.model;
        let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
        add(&mut zip, "modelDescription.xml", &self.model_description()?, 0o644)?;
        if model == Model::Axis {
            add(&mut zip, "model.png", PICTURE, 0o644)?;
        }
        for library in LIBRARIES {
            let folder = if self.fmi == Fmi::Three { tuple(library.platform) } else { library.platform };
            let name = format!("binaries/{folder}/{}.{}", common::identifier(model), library.extension);
            add(&mut zip, &name, &self.baked(library)?, 0o755)?;
        }
        let page = documentation::page(&self.name, &self.starts, self.fmi);
        add(&mut zip, "documentation/index.html", page.as_bytes(), 0o644)?;
        if model == Model::Axis {
            add(&mut zip, "documentation/model.png", PICTURE, 0o644)?;
        }
        add(&mut zip, "documentation/licenses/license.txt", LICENSE.as_bytes(), 0o644)?;
        Ok(zip.finish()?.into_inner())
    }

    /// Writes the archive: beside the target first, then renamed.
    ///
    /// # Errors
    /// See [`PackageError`].
    pub fn write(&self, path: &Path) -> Result<(), PackageError> {
        Ok(write_text(path, &self.archive()?)?)
    }
}

/// The platform tuple of FMI 3.0 (section 2.5.1) for a platform folder of FMI 2.0.
fn tuple(folder: &'static str) -> &'static str {
    match folder {
        "linux64" if cfg!(target_arch = "aarch64") => "aarch64-linux",
        "linux64" => "x86_64-linux",
        "linux32" => "x86-linux",
        "win64" => "x86_64-windows",
        "win32" => "x86-windows",
        "darwin64" if cfg!(target_arch = "aarch64") => "aarch64-darwin",
        "darwin64" => "x86_64-darwin",
        other => other,
    }
}

/// Adds a file to an archive.
fn add(zip: &mut ZipWriter<Cursor<Vec<u8>>>, name: &str, bytes: &[u8], permissions: u32) -> Result<(), PackageError> {
    let options = SimpleFileOptions::default()
        .compression_method(CompressionMethod::Deflated)
        .last_modified_time(DateTime::default())
        .unix_permissions(permissions);
    zip.start_file(name, options)?;
    zip.write_all(bytes)?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fmu::archive::{Archive, Limits};
    use crate::fmu::description::Description;

    #[test]
    fn the_checked_in_model_description_is_the_one_of_the_table() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("modelDescription/modelDescription.xml");
        let made = Package::default().model_description().unwrap();
        if std::env::var_os("EIXO_BLESS").is_some() {
            std::fs::write(&path, &made).unwrap();
        }
        let kept = std::fs::read(&path).unwrap();
        assert!(made == kept, "the table has changed: EIXO_BLESS=1 cargo test --lib checked_in writes the file anew");
    }

    #[test]
    fn the_same_axis_gives_the_same_archive_and_all_its_parts() {
        let package = Package::default();
        let bytes = package.archive().unwrap();
        assert!(bytes == package.archive().unwrap());
        let mut archive = Archive::from_bytes(bytes, Limits::default()).unwrap();
        archive.test().unwrap();
        let names: Vec<String> = archive.entries().iter().map(|e| e.name.clone()).collect();
        assert_eq!(names[0], "modelDescription.xml");
        assert!(names.iter().any(|n| n.starts_with("binaries/")), "{names:?}");
        let description = Description::parse(&archive.read("modelDescription.xml").unwrap()).unwrap();
        assert_eq!(description.variables.len(), crate::variables::COUNT);
    }

    #[test]
    fn the_description_of_fmi_3_names_the_same_variables_and_the_time() {
        let two = Description::parse(&Package::default().model_description().unwrap()).unwrap();
        let three = Package { fmi: Fmi::Three, ..Package::default() };
        let three = Description::parse(&three.model_description().unwrap()).unwrap();
        assert_eq!(three.fmi, Fmi::Three);
        assert_eq!(three.guid, two.guid);
        assert_eq!(three.variables[0].value_reference, crate::fmi3::TIME_REFERENCE);
        assert_eq!(crate::variables::index_of(crate::fmi3::TIME_REFERENCE), None);
        for (a, b) in two.variables.iter().zip(&three.variables[1..]) {
            assert_eq!(
                (&a.name, a.value_reference, a.base(), &a.start),
                (&b.name, b.value_reference, b.base(), &b.start)
            );
        }
        for (a, b) in two.structure.initial_unknowns.iter().zip(&three.structure.initial_unknowns) {
            // One variable more, at the head.
            let moved = a.dependencies.as_ref().unwrap().iter().map(|i| i + 1).collect::<Vec<_>>();
            assert_eq!(Some(moved), b.dependencies, "{}", a.index);
        }
    }

    #[test]
    fn the_programs_own_platform_comes_first() {
        assert_eq!(Package::platforms().next(), Some(crate::fmu::host::platform(crate::fmu::description::Fmi::Two).0));
    }

    #[test]
    fn a_machine_out_of_the_bounds_is_refused_by_name() {
        let mut machine = Machine::default();
        machine.parameters.i1 = 0.0;
        assert!(Package::of(&machine).unwrap_err().to_string().contains("I1"));
    }
}
