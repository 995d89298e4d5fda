//! NumPy arrays for results.

use numpy::{Element, PyArray, PyArrayDyn, dtype};
use pyo3::exceptions::PyMemoryError;
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;

/// NumPy's own function, looked up once: a short call makes half a dozen arrays.
static ZEROS: PyOnceLock<Py<PyAny>> = PyOnceLock::new();

/// An array of zeros, or the `MemoryError` that NumPy raises; the numpy crate's own constructors would panic.
pub(crate) fn zeros<'py, T: Element>(py: Python<'py>, shape: &[usize]) -> PyResult<Bound<'py, PyArrayDyn<T>>> {
    let bytes = shape.iter().try_fold(size_of::<T>(), |bytes, &extent| bytes.checked_mul(extent));
    if bytes.is_none_or(|bytes| isize::try_from(bytes).is_err()) {
        return Err(PyMemoryError::new_err(format!(
            "results of shape {shape:?} need more memory than can be addressed"
        )));
    }
    let array = ZEROS.import(py, "numpy", "zeros")?.call1((shape.to_vec(), dtype::<T>(py)))?;
    Ok(array.cast_into::<PyArray<T, _>>()?)
}

/// So many rows of so many values.
pub(crate) fn rows(values: &mut [f64], rows: usize, count: usize) -> Vec<&mut [f64]> {
    if count == 0 {
        return std::iter::repeat_with(Default::default).take(rows).collect();
    }
    values.chunks_exact_mut(count).collect()
}
