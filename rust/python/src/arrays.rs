//! NumPy arrays for results.

use numpy::{Element, PyArray, PyArray1, PyArrayDyn, PyArrayMethods, dtype};
use pyo3::exceptions::{PyImportError, PyMemoryError};
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;

/// NumPy's own functions, looked up once: a short call makes half a dozen arrays.
static ZEROS: PyOnceLock<Py<PyAny>> = PyOnceLock::new();
static EMPTY: PyOnceLock<Py<PyAny>> = PyOnceLock::new();

/// A number that results are made of.
pub(crate) trait Number: Element + Copy {
    /// What no result is.
    const UNWRITTEN: Self;
}

impl Number for f64 {
    const UNWRITTEN: Self = -1.234_567e-123;
}

impl Number for u8 {
    const UNWRITTEN: Self = 0xA5;
}

impl Number for u16 {
    const UNWRITTEN: Self = 0xA5A5;
}

/// An array of zeros, or the `MemoryError` that NumPy raises; the numpy crate's own constructors would panic.
pub(crate) fn zeros<'py, T: Element>(py: Python<'py>, shape: &[usize]) -> PyResult<Bound<'py, PyArrayDyn<T>>> {
    made_by(&ZEROS, "zeros", py, shape)
}

/// The same, of whatever memory held before, for results of which every element is written: zeros of memory that was used before cost as
/// much as writing the results. Checked builds fill it with what no result is, so that an element that was forgotten fails the tests.
pub(crate) fn empty<'py, T: Number>(py: Python<'py>, shape: &[usize]) -> PyResult<Bound<'py, PyArrayDyn<T>>> {
    let array = made_by(&EMPTY, "empty", py, shape)?;
    if cfg!(debug_assertions) {
        array.readwrite().as_slice_mut()?.fill(T::UNWRITTEN);
    }
    Ok(array)
}

/// What one of NumPy's functions makes of a shape.
fn made_by<'py, T: Element>(
    function: &PyOnceLock<Py<PyAny>>,
    name: &str,
    py: Python<'py>,
    shape: &[usize],
) -> PyResult<Bound<'py, PyArrayDyn<T>>> {
    let bytes = shape.iter().try_fold(size_of::<T>(), |bytes, &extent| bytes.checked_mul(extent));
    if bytes.is_none_or(|bytes| isize::try_from(bytes).is_err()) {
        return Err(PyMemoryError::new_err(format!(
            "results of shape {shape:?} need more memory than can be addressed"
        )));
    }
    let array = function.import(py, "numpy", name)?.call1((shape.to_vec(), dtype::<T>(py)))?;
    Ok(array.cast_into::<PyArray<T, _>>()?)
}

/// So many rows of so many values.
pub(crate) fn rows(values: &mut [f64], rows: usize, count: usize) -> Vec<&mut [f64]> {
    if count == 0 {
        return std::iter::repeat_with(Default::default).take(rows).collect();
    }
    values.chunks_exact_mut(count).collect()
}

/// Looks up NumPy's functions for the numpy crate, which panics where that fails: an interrupt of the first array would end in a panic.
/// In a thread of its own, since Python raises interrupts in the main thread alone.
pub(crate) fn look_up_numpy(py: Python<'_>) -> PyResult<()> {
    py.import("numpy")?;
    let looked_up = py.detach(|| {
        let first_array = || Python::attach(|py| drop(PyArray1::<f64>::zeros(py, 1, false).readonly()));
        std::thread::Builder::new().spawn(first_array).ok()?.join().ok()
    });
    looked_up.ok_or_else(|| {
        PyImportError::new_err(
            "NumPy's functions were not found; tvident needs NumPy 2 or later, and memory for one thread",
        )
    })
}
