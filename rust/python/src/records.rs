//! NumPy arrays seen as records: one for every index of all axes but the last.

use std::sync::atomic::{AtomicU8, AtomicU16, AtomicU32, AtomicU64, Ordering};

use numpy::{PyArrayDescr, PyArrayDescrMethods, PyUntypedArray, PyUntypedArrayMethods, dtype};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use tvident::Error;
use tvident::record::{Placed, Samples};

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
    Bool,
}

/// One record in an array's memory.
///
/// Another thread of the interpreter may write to that memory at any time, so samples are never borrowed but copied out once: what is
/// being written may be read as it was, as it will be or, where it is not aligned, as a mixture of both. Samples are loaded one by one, by
/// relaxed atomic loads, but for 64-bit floats side by side, which are copied as NumPy copies them (DESIGN.md, "unsafe").
#[derive(Clone, Copy, Debug)]
pub(crate) struct StridedSamples {
    first: *const u8,
    /// Bytes from one sample to the next.
    stride: isize,
    len: usize,
    number: Number,
}

// SAFETY: the memory stays allocated while the array object is held by the caller of the function, and is only ever read. A write by
// another thread meanwhile can change the samples being copied, as it would in NumPy, but nothing else.
unsafe impl Sync for StridedSamples {}
// SAFETY: as above.
unsafe impl Send for StridedSamples {}

impl Samples for StridedSamples {
    fn len(&self) -> usize {
        self.len
    }

    fn read(&self, first: usize, into: &mut [f64]) {
        match self.number {
            Number::F64 if self.stride == size_of::<f64>().cast_signed() => self.copy_contiguous(first, into),
            Number::F64 => self.copy::<u64>(first, into, f64::from_bits),
            Number::F32 => self.copy::<u32>(first, into, |bits| f32::from_bits(bits).into()),
            Number::I64 => self.copy::<u64>(first, into, |bits| bits.cast_signed() as f64),
            Number::I32 => self.copy::<u32>(first, into, |bits| bits.cast_signed().into()),
            Number::I16 => self.copy::<u16>(first, into, |bits| bits.cast_signed().into()),
            Number::I8 => self.copy::<u8>(first, into, |bits| bits.cast_signed().into()),
            Number::U64 => self.copy::<u64>(first, into, |bits| bits as f64),
            Number::U32 => self.copy::<u32>(first, into, f64::from),
            Number::U16 => self.copy::<u16>(first, into, f64::from),
            Number::U8 => self.copy::<u8>(first, into, f64::from),
            Number::Bool => self.copy::<u8>(first, into, |byte| f64::from(u8::from(byte != 0))),
        }
    }
}

impl StridedSamples {
    #[inline]
    fn copy_contiguous(&self, first: usize, into: &mut [f64]) {
        assert!(first + into.len() <= self.len, "a record must hold what is read of it");
        let from = self.first.wrapping_add(first * size_of::<f64>());
        // SAFETY: samples before the end lie in the array, of which shape and strides were asked, and `into` is memory of its own; bytes need
        // no alignment. Whoever writes to the array meanwhile breaks the promise of DESIGN.md.
        unsafe { std::ptr::copy_nonoverlapping(from, into.as_mut_ptr().cast(), size_of_val(into)) };
        // From here on the copy counts: the compiler may not read the array again in its place.
        std::hint::black_box(into);
    }

    #[inline]
    fn copy<T: Shared>(&self, first: usize, into: &mut [f64], convert: impl Fn(T) -> f64) {
        assert!(first + into.len() <= self.len, "a record must hold what is read of it");
        let width = size_of::<T>().cast_signed();
        if !self.first.cast::<T>().is_aligned() || self.stride % width != 0 {
            // SAFETY: samples before the end lie in the array, of which shape and strides were asked.
            self.copy_by(first, self.stride, into, |place| convert(unsafe { T::load_bytes(place) }));
        } else if self.stride == width {
            // The common case on its own: it has no multiplications.
            // SAFETY: as above, and all of them are aligned.
            self.copy_by(first, width, into, |place| convert(unsafe { T::load(place) }));
        } else {
            // SAFETY: as above, and all of them are aligned.
            self.copy_by(first, self.stride, into, |place| convert(unsafe { T::load(place) }));
        }
    }

    #[inline(always)]
    fn copy_by(&self, first: usize, stride: isize, into: &mut [f64], load: impl Fn(*const u8) -> f64) {
        let mut place = self.first.wrapping_offset(first.cast_signed() * stride);
        for value in into {
            *value = load(place);
            place = place.wrapping_offset(stride);
        }
    }
}

/// Bits of a number in memory that another thread may be writing.
trait Shared: Copy {
    /// Loads the bits at a place that is aligned.
    ///
    /// # Safety
    /// They must lie in memory that stays allocated meanwhile.
    unsafe fn load(place: *const u8) -> Self;

    /// Loads them byte by byte, from any place.
    ///
    /// # Safety
    /// As for [`Shared::load`].
    unsafe fn load_bytes(place: *const u8) -> Self;
}

macro_rules! shared {
    ($($bits:ty, $atomic:ty;)*) => {$(
        impl Shared for $bits {
            #[inline(always)]
            unsafe fn load(place: *const u8) -> Self {
                // SAFETY: an aligned place in allocated memory. It is only loaded from, so it may be read-only: relaxed loads of up to a
                // pointer's size are plain loads.
                unsafe { <$atomic>::from_ptr(place.cast_mut().cast()) }.load(Ordering::Relaxed)
            }

            #[inline(always)]
            unsafe fn load_bytes(place: *const u8) -> Self {
                // SAFETY: as above, byte by byte.
                let byte = |index| unsafe { AtomicU8::from_ptr(place.wrapping_add(index).cast_mut()) }.load(Ordering::Relaxed);
                Self::from_ne_bytes(std::array::from_fn(byte))
            }
        }
    )*};
}

shared! { u8, AtomicU8; u16, AtomicU16; u32, AtomicU32; u64, AtomicU64; }

/// Copies an array of truth values with one axis.
pub(crate) fn flags(array: &Bound<'_, PyUntypedArray>) -> PyResult<Vec<bool>> {
    let (Number::Bool, [record]) = (number(array)?, &strided(array, Number::Bool)?[..]) else {
        return Err(PyTypeError::new_err("a mask holds truth values along one axis"));
    };
    let mut flags = Vec::new();
    flags.try_reserve_exact(record.len).map_err(|_| exception(&Error::Memory { bytes: record.len }))?;
    let mut values = [0.0; 1024];
    for first in (0..record.len).step_by(values.len()) {
        let values = &mut values[..(record.len - first).min(1024)];
        record.read(first, values);
        flags.extend(values.iter().map(|&value| value != 0.0));
    }
    Ok(flags)
}

/// All records of an array, in the order of its leading axes.
pub(crate) fn records(array: &Bound<'_, PyUntypedArray>) -> PyResult<Vec<StridedSamples>> {
    match number(array)? {
        Number::Bool => Err(unknown(&array.dtype())),
        number => strided(array, number),
    }
}

/// Copies all records of an array.
pub(crate) fn copied(array: &Bound<'_, PyUntypedArray>) -> PyResult<Vec<Vec<f64>>> {
    let copy = |record: &StridedSamples| {
        let mut numbers = Vec::new();
        let bytes = record.len.saturating_mul(size_of::<f64>());
        numbers.try_reserve_exact(record.len).map_err(|_| exception(&Error::Memory { bytes }))?;
        numbers.resize(record.len, 0.0);
        record.read(0, &mut numbers);
        Ok(numbers)
    };
    records(array)?.iter().map(copy).collect()
}

/// All records of an array, which holds them as a whole or some parts of each: the first sample of every part and the one after its last.
pub(crate) fn placed(
    array: &Bound<'_, PyUntypedArray>,
    parts: Option<&[(usize, usize)]>,
    samples: usize,
) -> PyResult<Vec<Placed<StridedSamples>>> {
    let held = records(array)?.into_iter();
    let Some(parts) = parts else { return Ok(held.map(Placed::whole).collect()) };
    let parts: Vec<_> = parts.iter().map(|&(first, end)| first..end).collect();
    let places = held.map(|held| Placed::new(held, &parts, samples));
    places
        .collect::<Option<_>>()
        .ok_or_else(|| PyValueError::new_err("parts of a record are apart, in order, and what the array holds"))
}

fn strided(array: &Bound<'_, PyUntypedArray>, number: Number) -> PyResult<Vec<StridedSamples>> {
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
        (dtype::<bool>(py), Number::Bool),
    ];
    let found = known.iter().find(|(one, _)| held.is_equiv_to(one));
    found.map(|&(_, number)| number).ok_or_else(|| unknown(&held))
}

fn unknown(held: &Bound<'_, PyArrayDescr>) -> PyErr {
    PyTypeError::new_err(format!("cannot read numbers of type {held}"))
}

/// The only record of an array.
pub(crate) fn one(samples: &Bound<'_, PyUntypedArray>) -> PyResult<StridedSamples> {
    match &records(samples)?[..] {
        [record] => Ok(*record),
        _ => Err(PyTypeError::new_err("one record must be an array with one axis")),
    }
}
