//! Where the host puts things and how it writes numbers: folders with blanks and umlauts, a decimal comma (FMI 2.0.4,
//! section 2.1.5).

#![allow(unsafe_code)]

use std::path::Path;
use std::sync::Arc;

use super::super::description::Fmi;
use super::super::host::{HostError, Instance, InstanceOptions, resource_location};
use super::Setup;
use super::probe::{Probe, Snapshot, Tested, not_tested};

/// A short run with the resources at a place.
fn run(p: &Probe, resources: String) -> Result<Vec<Snapshot>, HostError> {
    let options = InstanceOptions { resources, ..p.options() };
    let mut instance = Instance::new(Arc::clone(&p.binary), None, &options)?;
    p.enter(&mut instance)?;
    instance.exit_initialization()?;
    let mut record = vec![p.observe(&mut instance)?];
    record.extend(p.run(&mut instance, 0, p.steps().min(5))?);
    Ok(record)
}

/// The resources in a folder whose name has a blank and an umlaut, which a URI spells `%20` and `%C3%A4`.
pub(in super::super) fn resources(setup: &Setup) -> Tested {
    let p = setup.probe()?;
    if p.interface().only_once {
        return super::probe::not_applicable("canBeInstantiatedOnlyOncePerProcess is true");
    }
    let expected = run(&p, resource_location(&p.folder, p.d.fmi))?;
    let odd = setup.workplace.join("ein Ordner \u{e4}");
    #[cfg(unix)]
    let made = std::os::unix::fs::symlink(&setup.folder, &odd);
    #[cfg(not(unix))]
    let made: std::io::Result<()> = Err(std::io::ErrorKind::Unsupported.into());
    if made.is_err() {
        return not_tested("no second path to the resources can be made");
    }
    let (uri, fmi) = (resource_location(&odd, p.d.fmi), p.d.fmi);
    let found = run(&p, uri.clone());
    let what = match found {
        Ok(found) => p.difference_beyond_tolerance(&expected, &found, 0),
        Err(error) => Some(error.to_string()),
    };
    std::mem::forget(p);
    let place = uri.rsplit_once("/ein").map_or("", |(_, rest)| rest);
    let scheme = if fmi == Fmi::Three { "" } else { "file://" };
    Ok(what
        .map(|what| format!("with resources at {scheme}/.../ein{place} (a blank and an umlaut), {what}"))
        .into_iter()
        .collect())
}

/// "Mandatory: file with absolute path (either including or omitting the authority component)" (section 2.1.5): the
/// resources as file:/path, which is how Java writes the URI that others write as file:///path.
pub(in super::super) fn short_uri(setup: &Setup) -> Tested {
    let p = setup.probe()?;
    if p.interface().only_once {
        return super::probe::not_applicable("canBeInstantiatedOnlyOncePerProcess is true");
    }
    let uri = resource_location(&p.folder, p.d.fmi);
    let expected = run(&p, uri.clone())?;
    let what = match run(&p, uri.replacen("file:///", "file:/", 1)) {
        Ok(found) => p.difference_beyond_tolerance(&expected, &found, 0),
        Err(error) => Some(error.to_string()),
    };
    std::mem::forget(p);
    Ok(what.map(|what| format!("with resources at file:/... instead of file:///..., {what}")).into_iter().collect())
}

/// A locale of numbers as the GNU C library stores one: a decimal comma, no grouping. (glibc, locale/loadlocale.c and
/// locale/categories.def: magic 0x20031115 XOR the category, number of fields, offsets, fields.)
fn comma() -> Vec<u8> {
    let fields: [&[u8]; 6] = [b",\0", b"\0", b"\0", &u32::to_ne_bytes(0x2c), &u32::to_ne_bytes(0), b"UTF-8\0"];
    let mut offset = 8 + 4 * fields.len();
    let (mut head, mut body) = (Vec::new(), Vec::new());
    head.extend((0x2003_1115_u32 ^ libc_numeric()).to_ne_bytes());
    head.extend((fields.len() as u32).to_ne_bytes());
    for (at, field) in fields.iter().enumerate() {
        // Wide characters are read as words.
        while matches!(at, 3 | 4) && !offset.is_multiple_of(4) {
            body.push(0);
            offset += 1;
        }
        head.extend((offset as u32).to_ne_bytes());
        body.extend_from_slice(field);
        offset += field.len();
    }
    head.extend(body);
    head
}

fn libc_numeric() -> u32 {
    // LC_NUMERIC of the GNU C library.
    1
}

/// Makes the process write numbers with a comma, as a host does for its user; whether it worked.
fn set_comma(workplace: &Path) -> bool {
    let folder = workplace.join("locale").join("eixo");
    let written = std::fs::create_dir_all(&folder).and_then(|()| std::fs::write(folder.join("LC_NUMERIC"), comma()));
    if written.is_err() || !cfg!(all(target_os = "linux", target_env = "gnu")) {
        return false;
    }
    #[cfg(unix)]
    // SAFETY: nothing else runs in this process yet that reads the environment; the texts are C strings.
    unsafe {
        std::env::set_var("LOCPATH", workplace.join("locale"));
        unsafe extern "C" {
            fn strtod(text: *const std::ffi::c_char, end: *mut *mut std::ffi::c_char) -> f64;
        }
        let set = !libc::setlocale(libc::LC_NUMERIC, c"eixo".as_ptr()).is_null();
        set && strtod(c"0,5".as_ptr(), std::ptr::null_mut()) == 0.5
    }
    #[cfg(not(unix))]
    false
}

/// The FMU where the host has set a locale with a decimal comma, as applications with a user interface do.
pub(in super::super) fn locale(setup: &Setup) -> Tested {
    let p = setup.probe()?;
    if p.interface().only_once {
        return super::probe::not_applicable("canBeInstantiatedOnlyOncePerProcess is true");
    }
    let expected = run(&p, resource_location(&p.folder, p.d.fmi))?;
    if !set_comma(&setup.workplace) {
        return not_tested("this C library takes no locale with a decimal comma");
    }
    let found = run(&p, resource_location(&p.folder, p.d.fmi));
    let what = match found {
        Ok(found) => p.difference_beyond_tolerance(&expected, &found, 0),
        Err(error) => Some(error.to_string()),
    };
    std::mem::forget(p);
    Ok(what.map(|what| format!("where the host writes numbers with a comma, {what}")).into_iter().collect())
}
