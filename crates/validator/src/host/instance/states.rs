//! Getting, setting, freeing and serialising the FMU state (FMI 2.0.4, section 2.1.8).

#![allow(unsafe_code)]

use super::super::abi::{self, Call, State};
use super::super::{HostError, Status, note};
use super::Instance;

/// A captured FMU state; free it with [`Instance::free_state`], else it lives until the process ends.
#[derive(Debug)]
pub struct StateHandle(pub(crate) State);

impl Instance {
    /// `fmi2GetFMUstate`.
    ///
    /// # Errors
    /// See [`Instance::set_debug_logging`].
    pub fn get_state(&mut self) -> Result<StateHandle, HostError> {
        let mut state = std::ptr::null_mut();
        let got = match self.three {
            Some(_) => checked!(self, get_state3(&raw mut state)),
            None => checked!(self, get_state(&raw mut state)),
        };
        got.map(|()| StateHandle(state))
    }

    /// `fmi2SetFMUstate`.
    ///
    /// # Errors
    /// See [`Instance::set_debug_logging`].
    pub fn set_state(&mut self, state: &StateHandle) -> Result<(), HostError> {
        if self.three.is_some() { checked!(self, set_state3(state.0)) } else { checked!(self, set_state(state.0)) }
    }

    /// `fmi2FreeFMUstate`.
    ///
    /// # Errors
    /// See [`Instance::set_debug_logging`].
    pub fn free_state(&mut self, mut state: StateHandle) -> Result<(), HostError> {
        match self.three {
            Some(_) => checked!(self, free_state3(&raw mut state.0)),
            None => checked!(self, free_state(&raw mut state.0)),
        }
    }

    /// `fmi2SerializedFMUstateSize` and `fmi2SerializeFMUstate`.
    ///
    /// # Errors
    /// See [`Instance::set_debug_logging`].
    pub fn serialize_state(&mut self, state: &StateHandle) -> Result<Vec<u8>, HostError> {
        let mut size = 0;
        match self.three {
            Some(_) => checked!(self, serialized_size3(state.0, &raw mut size))?,
            None => checked!(self, serialized_size(state.0, &raw mut size))?,
        }
        // A strip behind the bytes shows whether the FMU keeps to its own size.
        const STRIP: usize = 64;
        let mut bytes = vec![0xA5; size + STRIP];
        match self.three {
            Some(_) => checked!(self, serialize3(state.0, bytes.as_mut_ptr(), size))?,
            None => checked!(self, serialize(state.0, bytes.as_mut_ptr(), size))?,
        }
        if bytes[size..].iter().any(|&byte| byte != 0xA5) {
            let three = self.three.is_some();
            return Err(HostError::Overrun(if three { "fmi3SerializeFMUState" } else { "fmi2SerializeFMUstate" }));
        }
        bytes.truncate(size);
        Ok(bytes)
    }

    /// `fmi2DeSerializeFMUstate`.
    ///
    /// # Errors
    /// See [`Instance::set_debug_logging`].
    pub fn deserialize_state(&mut self, bytes: &[u8]) -> Result<StateHandle, HostError> {
        let mut state = std::ptr::null_mut();
        let read = match self.three {
            Some(_) => checked!(self, deserialize3(bytes.as_ptr(), bytes.len(), &raw mut state)),
            None => checked!(self, deserialize(bytes.as_ptr(), bytes.len(), &raw mut state)),
        };
        read.map(|()| StateHandle(state))
    }
}
