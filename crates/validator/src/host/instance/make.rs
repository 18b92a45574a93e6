//! Making an instance, in either version of FMI, and the memory callbacks handed to it.

#![allow(unsafe_code)]

use std::ffi::c_void;
use std::sync::atomic::{AtomicBool, Ordering};

use super::super::abi::{self, Call, Callbacks, Component};
use super::super::{Binary, HostError, logger, note, three};
use super::InstanceOptions;

/// Makes every allocation callback fail, to see how an FMU takes it.
pub(in super::super) static ALLOCATION_FAILS: AtomicBool = AtomicBool::new(false);

pub(super) unsafe extern "C" fn allocate(count: usize, size: usize) -> *mut c_void {
    if ALLOCATION_FAILS.load(Ordering::Relaxed) {
        return std::ptr::null_mut();
    }
    // SAFETY: `calloc` takes any numbers.
    unsafe { abi::calloc(count.max(1), size.max(1)) }
}

pub(super) unsafe extern "C" fn release(memory: *mut c_void) {
    // SAFETY: the FMU hands back what `allocate` gave, or null.
    unsafe { abi::free(memory) }
}

/// `fmi2Instantiate`; the texts are name, GUID and resources.
pub(super) fn make(
    binary: &Binary,
    options: &InstanceOptions,
    texts: &[Vec<u8>; 3],
    callbacks: &Callbacks,
) -> Result<Component, HostError> {
    let function = binary.functions.instantiate.ok_or(HostError::Missing("fmi2Instantiate"))?;
    note(Call::instantiate);
    // SAFETY: all pointers stay valid as long as the instance; co-simulation is 1 in `fmi2Type`.
    let component = unsafe {
        let [name, guid, resources] = texts;
        let flags = (i32::from(options.visible), i32::from(options.logging));
        function(
            name.as_ptr().cast(),
            1,
            guid.as_ptr().cast(),
            resources.as_ptr().cast(),
            &raw const *callbacks,
            flags.0,
            flags.1,
        )
    };
    note(Call::None);
    Ok(component)
}

/// `fmi3InstantiateCoSimulation`, likewise.
pub(super) fn make3(
    binary: &Binary,
    options: &InstanceOptions,
    texts: &[Vec<u8>; 3],
    environment: *mut c_void,
) -> Result<Component, HostError> {
    let function = binary.functions.instantiate3.ok_or(HostError::Missing("fmi3InstantiateCoSimulation"))?;
    note(Call::instantiate3);
    // SAFETY: all pointers stay valid as long as the instance; no intermediate variables are asked for.
    let component = unsafe {
        let [name, token, resources] = texts;
        function(
            name.as_ptr().cast(),
            token.as_ptr().cast(),
            resources.as_ptr().cast(),
            u8::from(options.visible),
            u8::from(options.logging),
            u8::from(options.event_mode),
            u8::from(options.early_return),
            std::ptr::null(),
            0,
            environment,
            Some(logger::log_message3),
            Some(three::intermediate_update),
        )
    };
    note(Call::None);
    Ok(component)
}
