//! NumPy arrays seen as records: one for every index of all axes but the last.

use numpy::{PyArrayDescrMethods, PyUntypedArray, PyUntypedArrayMethods, dtype};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use tvident::Error;
use tvident::record::Samples;

use crate::watch::exception;

/// A number type that arrays may hold.
#[derive(Clone, Copy, Debug)]
enum Number {
    F64,
    F32,
    I64,
    I32,
    I16,
    I8,
    U64,
    U32,
    U16,
    U8,
}

/// One record in an array's memory.
///
/// Another thread of the interpreter may write to that memory at any time, so samples are copied out by pointer, one by one, and
/// never borrowed.
#[derive(Clone, Copy, Debug)]
pub(crate) struct StridedSamples {
    first: *const u8,
    /// Bytes from one sample to the next.
    stride: isize,
    len: usize,
    number: Number,
}

// SAFETY: the memory stays allocated while the array object is held by the caller of the function, and is only ever read. A write by
// another thread meanwhile can garble the samples being copied, as it would in NumPy, but nothing else.
unsafe impl Sync for StridedSamples {}
// SAFETY: as above.
unsafe impl Send for StridedSamples {}

impl Samples for StridedSamples {
    fn len(&self) -> usize {
        self.len
    }

    fn read(&self, first: usize, into: &mut [f64]) {
        match self.number {
            Number::F64 => self.copy::<f64>(first, into, |value| value),
            Number::F32 => self.copy::<f32>(first, into, f64::from),
            Number::I64 => self.copy::<i64>(first, into, |value| value as f64),
            Number::I32 => self.copy::<i32>(first, into, f64::from),
            Number::I16 => self.copy::<i16>(first, into, f64::from),
            Number::I8 => self.copy::<i8>(first, into, f64::from),
            Number::U64 => self.copy::<u64>(first, into, |value| value as f64),
            Number::U32 => self.copy::<u32>(first, into, f64::from),
            Number::U16 => self.copy::<u16>(first, into, f64::from),
            Number::U8 => self.copy::<u8>(first, into, f64::from),
        }
    }
}

impl StridedSamples {
    #[inline]
    fn copy<T: Copy>(&self, first: usize, into: &mut [f64], convert: impl Fn(T) -> f64) {
        assert!(first + into.len() <= self.len, "a record must hold what is read of it");
        let width = size_of::<T>().cast_signed();
        if self.stride == width {
            // The common case on its own, so that it becomes one copy.
            self.copy_by(first, width, into, convert);
        } else {
            self.copy_by(first, self.stride, into, convert);
        }
    }

    #[inline(always)]
    fn copy_by<T: Copy>(&self, first: usize, stride: isize, into: &mut [f64], convert: impl Fn(T) -> f64) {
        let mut place = self.first.wrapping_offset(first.cast_signed() * stride).cast::<T>();
        for value in into {
            // SAFETY: the sample lies in the array, of which shape and strides were asked; it need not be aligned.
            *value = convert(unsafe { place.read_unaligned() });
            place = place.wrapping_byte_offset(stride);
        }
    }
}

/// All records of an array, in the order of its leading axes.
pub(crate) fn records(array: &Bound<'_, PyUntypedArray>) -> PyResult<Vec<StridedSamples>> {
    let number = number(array)?;
    let (shape, strides) = (array.shape(), array.strides());
    let (Some((&len, leading)), Some((&stride, jumps))) = (shape.split_last(), strides.split_last()) else {
        return Err(PyTypeError::new_err("an array of samples has at least one axis"));
    };
    // SAFETY: the pointer belongs to a live array object.
    let data = unsafe { (*array.as_array_ptr()).fields.data }.cast::<u8>().cast_const();
    let count = leading.iter().product();
    let place = |mut index: usize| {
        leading.iter().zip(jumps).rev().fold(data, |place, (&extent, &jump)| {
            let here = index % extent;
            index /= extent;
            place.wrapping_offset(here.cast_signed() * jump)
        })
    };
    let mut records = Vec::new();
    let bytes = size_of::<StridedSamples>().saturating_mul(count);
    records.try_reserve_exact(count).map_err(|_| exception(&Error::Memory { bytes }))?;
    records.extend((0..count).map(|index| StridedSamples { first: place(index), stride, len, number }));
    Ok(records)
}

fn number(array: &Bound<'_, PyUntypedArray>) -> PyResult<Number> {
    let py = array.py();
    let held = array.dtype();
    let known = [
        (dtype::<f64>(py), Number::F64),
        (dtype::<f32>(py), Number::F32),
        (dtype::<i64>(py), Number::I64),
        (dtype::<i32>(py), Number::I32),
        (dtype::<i16>(py), Number::I16),
        (dtype::<i8>(py), Number::I8),
        (dtype::<u64>(py), Number::U64),
        (dtype::<u32>(py), Number::U32),
        (dtype::<u16>(py), Number::U16),
        (dtype::<u8>(py), Number::U8),
    ];
    let found = known.iter().find(|(one, _)| held.is_equiv_to(one));
    found.map(|&(_, number)| number).ok_or_else(|| PyTypeError::new_err(format!("cannot read numbers of type {held}")))
}
