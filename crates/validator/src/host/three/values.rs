//! Reading and setting values by handle, and their derivatives.
//!
//! An element of an array is set by setting its array, with the other elements as they are: before initialisation, when they
//! cannot be read, as they were set or stand in the XML.

use std::ffi::CString;
use std::sync::Arc;

use super::super::abi::{self, Call, Text};
use super::super::instance::Instance;
use super::super::texts::{self, Given, Room};
use super::super::{HostError, note};
use super::layout::{Run, runs};
use super::{check, status_of};
use crate::description::{Kind, Value};

/// Reads the values of a run by its type's function, each brought into another type.
macro_rules! get {
    ($instance:expr, $run:expr, $function:ident, $native:ty, $to:expr) => {{
        let mut values = vec![<$native>::default(); $run.total];
        let (references, count) = ($run.references.as_ptr(), $run.references.len());
        call!($instance, $function(references, count, values.as_mut_ptr(), values.len()))?;
        values.into_iter().map($to).collect()
    }};
}

macro_rules! set {
    ($instance:expr, $run:expr, $function:ident, $values:expr) => {{
        let (references, count) = ($run.references.as_ptr(), $run.references.len());
        let values = $values;
        call!($instance, $function(references, count, values.as_ptr(), values.len()))
    }};
}

/// Bytes of a text of hexadecimal digits.
fn from_hexadecimal(text: &str) -> Vec<u8> {
    let digits: Vec<u8> = text.chars().filter_map(|c| c.to_digit(16)).map(|d| d as u8).collect();
    digits.chunks(2).map(|pair| 16 * pair[0] + pair.get(1).copied().unwrap_or(0)).collect()
}

impl Instance {
    fn runs3(&mut self, handles: &[u32], kind: Kind) -> Arc<[Run]> {
        self.three
            .as_mut()
            .map_or_else(|| Arc::new([]) as Arc<[Run]>, |three| three.plan.runs(&three.layout, handles, kind))
    }

    fn reals(&self, run: &Run) -> Result<Vec<f64>, HostError> {
        Ok(match run.kind {
            Kind::Float32 => get!(self, run, get3_float32, f32, f64::from),
            _ => get!(self, run, get3_float64, f64, |x| x),
        })
    }

    fn wholes(&self, run: &Run) -> Result<Vec<i64>, HostError> {
        Ok(match run.kind {
            Kind::Int8 => get!(self, run, get3_int8, i8, i64::from),
            Kind::UInt8 => get!(self, run, get3_uint8, u8, i64::from),
            Kind::Int16 => get!(self, run, get3_int16, i16, i64::from),
            Kind::UInt16 => get!(self, run, get3_uint16, u16, i64::from),
            Kind::UInt32 => get!(self, run, get3_uint32, u32, i64::from),
            Kind::Int64 => get!(self, run, get3_int64, i64, |x| x),
            Kind::UInt64 => get!(self, run, get3_uint64, u64, |x| x as i64),
            _ => get!(self, run, get3_int32, i32, i64::from),
        })
    }

    fn flags(&self, run: &Run) -> Result<Vec<u8>, HostError> {
        Ok(get!(self, run, get3_boolean, u8, |x| x))
    }

    /// Strings and binaries; `checked`, whether they stay what they are while the FMU is not called.
    fn texts(&self, run: &Run, checked: bool) -> Result<Vec<Result<String, &'static str>>, HostError> {
        let (references, count) = (run.references.as_ptr(), run.references.len());
        let (mut sizes, mut bytes) = (vec![texts::NO_SIZE; run.total], vec![std::ptr::null(); run.total]);
        let mut strings = vec![std::ptr::null(); run.total];
        let [first, second] = Room::twice(run.total);
        let given = if run.kind == Kind::Binary {
            call!(self, get3_binary(references, count, sizes.as_mut_ptr(), bytes.as_mut_ptr(), bytes.len()))?;
            Given::Binaries(&sizes, &bytes)
        } else {
            call!(self, get3_string(references, count, strings.as_mut_ptr(), strings.len()))?;
            Given::Strings(&strings)
        };
        Ok(if checked { texts::steady(given, [first, second]) } else { texts::once(given, first) })
    }

    pub(in super::super) fn get_real3(&mut self, handles: &[u32], out: &mut [f64]) -> Result<(), HostError> {
        let mut at = 0;
        for run in self.runs3(handles, Kind::Float64).iter() {
            let here = &mut out[at..at + run.places.len()];
            at += here.len();
            if run.kind == Kind::Float64 && run.total == here.len() {
                // Scalars, or whole arrays in order: straight into place.
                let (references, count) = (run.references.as_ptr(), run.references.len());
                call!(self, get3_float64(references, count, here.as_mut_ptr(), here.len()))?;
                if run.places.windows(2).all(|w| w[0] < w[1]) {
                    continue;
                }
            }
            let values = self.reals(run)?;
            here.iter_mut().zip(&run.places).for_each(|(out, &place)| *out = values[place]);
        }
        Ok(())
    }

    pub(in super::super) fn get_whole3(&mut self, handles: &[u32]) -> Result<Vec<i64>, HostError> {
        let mut out = Vec::with_capacity(handles.len());
        for run in self.runs3(handles, Kind::Int32).iter() {
            let values = self.wholes(run)?;
            out.extend(run.places.iter().map(|&place| values[place]));
        }
        Ok(out)
    }

    pub(in super::super) fn get_flag3(&mut self, handles: &[u32]) -> Result<Vec<i32>, HostError> {
        let mut out = Vec::with_capacity(handles.len());
        for run in self.runs3(handles, Kind::Boolean).iter() {
            let values = self.flags(run)?;
            out.extend(run.places.iter().map(|&place| i32::from(values[place])));
        }
        Ok(out)
    }

    pub(in super::super) fn get_text3(
        &mut self,
        handles: &[u32],
        checked: bool,
    ) -> Result<Vec<Result<String, &'static str>>, HostError> {
        let mut out = Vec::with_capacity(handles.len());
        for run in self.runs3(handles, Kind::String).iter() {
            let values = self.texts(run, checked)?;
            out.extend(run.places.iter().map(|&place| values[place].clone()));
        }
        Ok(out)
    }

    /// The values of a run before the handles' own are put in: what arrays hold now.
    fn before<T: Clone + Default>(
        &self,
        run: &Run,
        read: impl Fn(&Self, &Run) -> Result<Vec<T>, HostError>,
        of: impl Fn(&Value) -> Option<T>,
    ) -> Result<Vec<T>, HostError> {
        let mut all = Vec::with_capacity(run.total);
        for (&reference, &count) in run.references.iter().zip(&run.counts) {
            let three = self.three.as_ref().filter(|three| three.fresh);
            match three {
                _ if count == 1 => all.push(T::default()),
                Some(three) => {
                    let draft = three.drafts.get(&reference);
                    let start = three.layout.starts.get(&reference);
                    all.extend((0..count).map(|at| {
                        let drafted = draft.and_then(|d| d.get(at));
                        let value = drafted.or_else(|| start.and_then(|s| s.get(at)).and_then(Option::as_ref));
                        value.and_then(&of).unwrap_or_default()
                    }));
                }
                None => {
                    let alone = Run {
                        kind: run.kind,
                        references: vec![reference],
                        counts: vec![count],
                        places: vec![],
                        total: count,
                    };
                    all.extend(read(self, &alone)?);
                }
            }
        }
        Ok(all)
    }

    /// Remembers what arrays were set to before initialisation.
    fn drafted<T>(&mut self, run: &Run, values: &[T], to: impl Fn(&T) -> Value) {
        let Some(three) = self.three.as_mut().filter(|three| three.fresh) else { return };
        let mut at = 0;
        for (&reference, &count) in run.references.iter().zip(&run.counts) {
            if count > 1 {
                three.drafts.insert(reference, values[at..at + count].iter().map(&to).collect());
            }
            at += count;
        }
    }

    pub(in super::super) fn set_real3(&mut self, handles: &[u32], values: &[f64]) -> Result<(), HostError> {
        let mut values = values.iter();
        let Some(layout) = self.three.as_ref().map(|three| Arc::clone(&three.layout)) else { return Ok(()) };
        for run in runs(&layout, handles, Kind::Float64) {
            let of = |v: &Value| if let Value::Real(x) = v { Some(*x) } else { None };
            let mut all = self.before(&run, Self::reals, of)?;
            run.places.iter().zip(&mut values).for_each(|(&place, value)| all[place] = *value);
            match run.kind {
                Kind::Float32 => set!(self, run, set3_float32, all.iter().map(|x| *x as f32).collect::<Vec<_>>()),
                _ => set!(self, run, set3_float64, &all),
            }?;
            self.drafted(&run, &all, |x| Value::Real(*x));
        }
        Ok(())
    }

    pub(in super::super) fn set_whole3(&mut self, handles: &[u32], values: &[i64]) -> Result<(), HostError> {
        let mut values = values.iter();
        let Some(layout) = self.three.as_ref().map(|three| Arc::clone(&three.layout)) else { return Ok(()) };
        for run in runs(&layout, handles, Kind::Int32) {
            let of = |v: &Value| if let Value::Integer(x) = v { Some(*x) } else { None };
            let mut all = self.before(&run, Self::wholes, of)?;
            for (&place, &value) in run.places.iter().zip(&mut values) {
                let fits = |(low, high): (i128, i128)| (low..=high).contains(&i128::from(value));
                if run.kind != Kind::UInt64 && !run.kind.range().is_none_or(fits) {
                    return Err(HostError::Range(value, run.kind.keyword()));
                }
                all[place] = value;
            }
            macro_rules! cast {
                ($function:ident, $native:ty) => {
                    set!(self, run, $function, all.iter().map(|x| *x as $native).collect::<Vec<_>>())
                };
            }
            match run.kind {
                Kind::Int8 => cast!(set3_int8, i8),
                Kind::UInt8 => cast!(set3_uint8, u8),
                Kind::Int16 => cast!(set3_int16, i16),
                Kind::UInt16 => cast!(set3_uint16, u16),
                Kind::UInt32 => cast!(set3_uint32, u32),
                Kind::Int64 => cast!(set3_int64, i64),
                Kind::UInt64 => cast!(set3_uint64, u64),
                _ => cast!(set3_int32, i32),
            }?;
            self.drafted(&run, &all, |x| Value::Integer(*x));
        }
        Ok(())
    }

    pub(in super::super) fn set_flag3(&mut self, handles: &[u32], values: &[bool]) -> Result<(), HostError> {
        let mut values = values.iter();
        let Some(layout) = self.three.as_ref().map(|three| Arc::clone(&three.layout)) else { return Ok(()) };
        for run in runs(&layout, handles, Kind::Boolean) {
            let of = |v: &Value| if let Value::Boolean(x) = v { Some(u8::from(*x)) } else { None };
            let mut all = self.before(&run, Self::flags, of)?;
            run.places.iter().zip(&mut values).for_each(|(&place, value)| all[place] = u8::from(*value));
            set!(self, run, set3_boolean, &all)?;
            self.drafted(&run, &all, |x| Value::Boolean(*x != 0));
        }
        Ok(())
    }

    pub(in super::super) fn set_text3(&mut self, handles: &[u32], values: &[&str]) -> Result<(), HostError> {
        let mut values = values.iter();
        let Some(layout) = self.three.as_ref().map(|three| Arc::clone(&three.layout)) else { return Ok(()) };
        for run in runs(&layout, handles, Kind::String) {
            let of = |v: &Value| if let Value::String(x) = v { Some(x.clone()) } else { None };
            let read = |instance: &Self, run: &Run| {
                Ok(instance.texts(run, false)?.into_iter().map(Result::unwrap_or_default).collect::<Vec<String>>())
            };
            let mut all = self.before(&run, read, of)?;
            run.places.iter().zip(&mut values).for_each(|(&place, value)| all[place] = (*value).to_owned());
            if run.kind == Kind::Binary {
                let bytes: Vec<Vec<u8>> = all.iter().map(|text| from_hexadecimal(text)).collect();
                let sizes: Vec<usize> = bytes.iter().map(Vec::len).collect();
                let pointers: Vec<*const u8> = bytes.iter().map(|b| b.as_ptr()).collect();
                let (references, count) = (run.references.as_ptr(), run.references.len());
                call!(self, set3_binary(references, count, sizes.as_ptr(), pointers.as_ptr(), pointers.len()))?;
            } else {
                let texts = all.iter().map(|t| CString::new(t.as_str()).map_err(|_| HostError::Nul(t.clone())));
                let texts = texts.collect::<Result<Vec<_>, _>>()?;
                let pointers: Vec<Text> = texts.iter().map(|t| t.as_ptr()).collect();
                set!(self, run, set3_string, &pointers)?;
            }
            self.drafted(&run, &all, |x| Value::String(x.clone()));
        }
        Ok(())
    }

    pub(in super::super) fn directional3(
        &mut self,
        unknowns: &[u32],
        knowns: &[u32],
        seed: &[f64],
    ) -> Result<Vec<f64>, HostError> {
        let Some(layout) = self.three.as_ref().map(|three| Arc::clone(&three.layout)) else { return Ok(vec![]) };
        // Of one type, so that there is one run.
        let whole = |handles: &[u32]| -> Run {
            let mut all = Run { kind: Kind::Float64, references: vec![], counts: vec![], places: vec![], total: 0 };
            for run in runs(&layout, handles, Kind::Float64) {
                all.places.extend(run.places.iter().map(|place| place + all.total));
                all.references.extend(run.references);
                all.counts.extend(run.counts);
                all.total += run.total;
            }
            all
        };
        let (unknown, known) = (whole(unknowns), whole(knowns));
        let mut seeds = vec![0.0; known.total];
        known.places.iter().zip(seed).for_each(|(&place, x)| seeds[place] = *x);
        let mut values = vec![f64::NAN; unknown.total];
        call!(
            self,
            directional_derivative3(
                unknown.references.as_ptr(),
                unknown.references.len(),
                known.references.as_ptr(),
                known.references.len(),
                seeds.as_ptr(),
                seeds.len(),
                values.as_mut_ptr(),
                values.len()
            )
        )?;
        Ok(unknown.places.iter().map(|&place| values[place]).collect())
    }

    pub(in super::super) fn output_derivatives3(
        &mut self,
        handles: &[u32],
        orders: &[i32],
    ) -> Result<Vec<f64>, HostError> {
        let Some(layout) = self.three.as_ref().map(|three| Arc::clone(&three.layout)) else { return Ok(vec![]) };
        let order = orders.first().copied().unwrap_or(1);
        let mut out = Vec::with_capacity(handles.len());
        for run in runs(&layout, handles, Kind::Float64) {
            let orders = vec![order; run.references.len()];
            let mut values = vec![f64::NAN; run.total];
            let (references, count) = (run.references.as_ptr(), run.references.len());
            call!(
                self,
                get_output_derivatives3(references, count, orders.as_ptr(), values.as_mut_ptr(), values.len())
            )?;
            out.extend(run.places.iter().map(|&place| values[place]));
        }
        Ok(out)
    }

    /// Reads an array into room for one value less than it has; whether the FMU refused. None where there is no array.
    pub(crate) fn short_read(&mut self, reference: u32, count: usize) -> Result<Option<bool>, HostError> {
        let Some(function) = self.binary.functions.get3_float64.filter(|_| count > 1) else { return Ok(None) };
        // Room for all, so that an FMU that does not look at the number does no harm.
        let mut values = vec![0.0; count + 8];
        note(Call::get3_float64);
        // SAFETY: the component is alive; there is room for more values than the length passed.
        let status = unsafe { function(self.component, &raw const reference, 1, values.as_mut_ptr(), count - 1) };
        note(Call::None);
        Ok(Some(!status_of(status).is_ok()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hexadecimal_digits_are_bytes() {
        assert_eq!(from_hexadecimal("00FF41"), b"\x00\xffA");
    }
}
