//! Reading and setting values, and their derivatives.

use super::super::abi::{self, Call, Text};
use super::super::texts::{Given, Room};
use super::super::{HostError, Status, note};
use super::{Instance, c_string};

impl Instance {
    /// `fmi2GetReal` into a slice of the same length as `references`.
    ///
    /// # Errors
    /// See [`Instance::set_debug_logging`].
    ///
    /// # Panics
    /// When the lengths differ; so for all that follow.
    pub fn get_real_into(&mut self, references: &[u32], values: &mut [f64]) -> Result<(), HostError> {
        assert_eq!(references.len(), values.len());
        if self.three.is_some() {
            return self.get_real3(references, values);
        }
        checked!(self, get_real(references.as_ptr(), references.len(), values.as_mut_ptr()))
    }

    /// `fmi2GetReal`.
    ///
    /// # Errors
    /// See [`Instance::set_debug_logging`].
    pub fn get_real(&mut self, references: &[u32]) -> Result<Vec<f64>, HostError> {
        let mut values = vec![f64::NAN; references.len()];
        self.get_real_into(references, &mut values).map(|()| values)
    }

    /// `fmi2GetInteger`, for Integer and Enumeration variables.
    ///
    /// # Errors
    /// See [`Instance::set_debug_logging`].
    pub fn get_integer(&mut self, references: &[u32]) -> Result<Vec<i64>, HostError> {
        if self.three.is_some() {
            return self.get_whole3(references);
        }
        let mut values = vec![0_i32; references.len()];
        checked!(self, get_integer(references.as_ptr(), references.len(), values.as_mut_ptr()))?;
        Ok(values.into_iter().map(i64::from).collect())
    }

    /// `fmi2GetBoolean`.
    ///
    /// # Errors
    /// See [`Instance::set_debug_logging`].
    pub fn get_boolean(&mut self, references: &[u32]) -> Result<Vec<bool>, HostError> {
        if self.three.is_some() {
            return Ok(self.get_flag3(references)?.into_iter().map(|flag| flag != 0).collect());
        }
        let mut values = vec![0; references.len()];
        checked!(self, get_boolean(references.as_ptr(), references.len(), values.as_mut_ptr()))
            .map(|()| values.iter().map(|&v| v != 0).collect())
    }

    /// `fmi2GetString`; a null pointer reads as an empty text.
    ///
    /// # Errors
    /// See [`Instance::set_debug_logging`].
    pub fn get_string(&mut self, references: &[u32]) -> Result<Vec<String>, HostError> {
        if self.three.is_some() {
            return Ok(self.get_text3(references, false)?.into_iter().map(Result::unwrap_or_default).collect());
        }
        let mut values = vec![std::ptr::null(); references.len()];
        let mut room = Room::new(references.len());
        checked!(self, get_string(references.as_ptr(), references.len(), values.as_mut_ptr()))?;
        room.read(Given::Strings(&values));
        let text = |k| String::from_utf8_lossy(room.text(k).unwrap_or_default()).into_owned();
        Ok((0..values.len()).map(text).collect())
    }

    /// `fmi2SetReal`.
    ///
    /// # Errors
    /// See [`Instance::set_debug_logging`].
    pub fn set_real(&mut self, references: &[u32], values: &[f64]) -> Result<(), HostError> {
        assert_eq!(references.len(), values.len());
        if self.three.is_some() {
            return self.set_real3(references, values);
        }
        checked!(self, set_real(references.as_ptr(), references.len(), values.as_ptr()))
    }

    /// `fmi2SetInteger`, for Integer and Enumeration variables.
    ///
    /// # Errors
    /// See [`Instance::set_debug_logging`].
    pub fn set_integer(&mut self, references: &[u32], values: &[i64]) -> Result<(), HostError> {
        assert_eq!(references.len(), values.len());
        if self.three.is_some() {
            return self.set_whole3(references, values);
        }
        let narrow = |&value: &i64| i32::try_from(value).map_err(|_| HostError::Range(value, "fmi2Integer"));
        let values = values.iter().map(narrow).collect::<Result<Vec<_>, _>>()?;
        checked!(self, set_integer(references.as_ptr(), references.len(), values.as_ptr()))
    }

    /// `fmi2SetBoolean`.
    ///
    /// # Errors
    /// See [`Instance::set_debug_logging`].
    pub fn set_boolean(&mut self, references: &[u32], values: &[bool]) -> Result<(), HostError> {
        assert_eq!(references.len(), values.len());
        if self.three.is_some() {
            return self.set_flag3(references, values);
        }
        let raw: Vec<i32> = values.iter().map(|&v| i32::from(v)).collect();
        checked!(self, set_boolean(references.as_ptr(), references.len(), raw.as_ptr()))
    }

    /// `fmi2SetString`.
    ///
    /// # Errors
    /// See [`Instance::set_debug_logging`].
    pub fn set_string(&mut self, references: &[u32], values: &[&str]) -> Result<(), HostError> {
        assert_eq!(references.len(), values.len());
        if self.three.is_some() {
            return self.set_text3(references, values);
        }
        let texts = values.iter().map(|c| c_string(c)).collect::<Result<Vec<_>, _>>()?;
        let pointers: Vec<Text> = texts.iter().map(|t| t.as_ptr()).collect();
        checked!(self, set_string(references.as_ptr(), references.len(), pointers.as_ptr()))?;
        self.kept.extend(references.iter().copied().zip(texts));
        Ok(())
    }

    /// `fmi2SetRealInputDerivatives`: one order (1 or more) a reference.
    ///
    /// # Errors
    /// See [`Instance::set_debug_logging`].
    pub fn set_input_derivatives(
        &mut self,
        references: &[u32],
        orders: &[i32],
        values: &[f64],
    ) -> Result<(), HostError> {
        assert!(references.len() == orders.len() && references.len() == values.len());
        self.only_two("fmi2SetRealInputDerivatives")?;
        let length = references.len();
        checked!(self, set_input_derivatives(references.as_ptr(), length, orders.as_ptr(), values.as_ptr()))
    }

    /// `fmi2GetRealOutputDerivatives`: one order (1 or more) a reference.
    ///
    /// # Errors
    /// See [`Instance::set_debug_logging`].
    pub fn get_output_derivatives(&mut self, references: &[u32], orders: &[i32]) -> Result<Vec<f64>, HostError> {
        assert_eq!(references.len(), orders.len());
        if self.three.is_some() {
            return self.output_derivatives3(references, orders);
        }
        let mut values = vec![f64::NAN; references.len()];
        let length = references.len();
        checked!(self, get_output_derivatives(references.as_ptr(), length, orders.as_ptr(), values.as_mut_ptr()))
            .map(|()| values)
    }

    /// `fmi2GetDirectionalDerivative`: the change of the unknowns for a seed on the knowns, `dz = (dz/dv) dv`.
    ///
    /// # Errors
    /// See [`Instance::set_debug_logging`].
    pub fn directional_derivative(
        &mut self,
        unknowns: &[u32],
        knowns: &[u32],
        seed: &[f64],
    ) -> Result<Vec<f64>, HostError> {
        assert_eq!(knowns.len(), seed.len());
        if self.three.is_some() {
            return self.directional3(unknowns, knowns, seed);
        }
        let mut values = vec![f64::NAN; unknowns.len()];
        let (known, known_len) = (knowns.as_ptr(), knowns.len());
        checked!(
            self,
            directional_derivative(
                unknowns.as_ptr(),
                unknowns.len(),
                known,
                known_len,
                seed.as_ptr(),
                values.as_mut_ptr()
            )
        )
        .map(|()| values)
    }
}
