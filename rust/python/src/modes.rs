//! `tvident._core.modes`: free vibration of few masses.

use std::num::NonZeroUsize;

use numpy::{Complex64, PyArrayDyn, PyArrayMethods, PyUntypedArray, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use tvident::exec::workers as threads;
use tvident::record::Samples;
use tvident::response::modes as core_modes;

use crate::arrays::zeros;
use crate::records::records;
use crate::watch::watched;

/// Poles by time and mode, shapes and left vectors by time, mode and mass; NaN where a mode does not oscillate or is not known.
#[pyclass(frozen, get_all, module = "tvident._core")]
pub(crate) struct Modes {
    poles: Py<PyArrayDyn<Complex64>>,
    shapes: Py<PyArrayDyn<Complex64>>,
    lefts: Py<PyArrayDyn<Complex64>>,
}

/// Solves the eigenproblem of matrices of inertia, damping and stiffness at every time, each of shape (times, masses, masses).
#[pyfunction]
#[pyo3(signature = (inertia, damping, stiffness, workers=None))]
pub(crate) fn modes<'py>(
    py: Python<'py>,
    inertia: &Bound<'py, PyUntypedArray>,
    damping: &Bound<'py, PyUntypedArray>,
    stiffness: &Bound<'py, PyUntypedArray>,
    workers: Option<NonZeroUsize>,
) -> PyResult<Modes> {
    let &[times, masses, same] = inertia.shape() else {
        return Err(PyValueError::new_err("matrices need three axes: times, masses, masses"));
    };
    if same != masses || [damping, stiffness].iter().any(|one| one.shape() != inertia.shape()) {
        return Err(PyValueError::new_err("matrices of inertia, damping and stiffness need the same square shape"));
    }
    let numbers = |array| -> PyResult<Vec<f64>> {
        let rows = records(array)?;
        let mut values = vec![0.0; times * masses * masses];
        for (row, into) in rows.iter().zip(values.chunks_exact_mut(masses.max(1))) {
            row.read(0, into);
        }
        Ok(values)
    };
    let (inertia, damping, stiffness) = (numbers(inertia)?, numbers(damping)?, numbers(stiffness)?);
    let mut found = Vec::new();
    watched(py, None, |watch| {
        found = core_modes(masses, &inertia, &damping, &stiffness, threads(workers), watch)?;
        Ok(())
    })?;
    let unknown = Complex64::new(f64::NAN, f64::NAN);
    let poles = zeros::<Complex64>(py, &[times, masses])?;
    let shapes = zeros::<Complex64>(py, &[times, masses, masses])?;
    let lefts = zeros::<Complex64>(py, &[times, masses, masses])?;
    {
        let (mut poles, mut shapes, mut lefts) = (poles.readwrite(), shapes.readwrite(), lefts.readwrite());
        let (poles, shapes, lefts) = (poles.as_slice_mut()?, shapes.as_slice_mut()?, lefts.as_slice_mut()?);
        poles.fill(unknown);
        shapes.fill(unknown);
        lefts.fill(unknown);
        for (time, modes) in found.iter().enumerate() {
            for (place, mode) in (time * masses..).zip(modes) {
                poles[place] = mode.pole;
                shapes[place * masses..][..masses].copy_from_slice(&mode.shape);
                lefts[place * masses..][..masses].copy_from_slice(&mode.left);
            }
        }
    }
    Ok(Modes { poles: poles.unbind(), shapes: shapes.unbind(), lefts: lefts.unbind() })
}
