//! Channels brought onto a uniform grid, and what that does to noise.

use std::num::NonZeroUsize;

use numpy::{PyArray2, PyArrayDyn, PyArrayMethods, PyUntypedArray, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use tvident::exec::workers as threads;
use tvident::irregular::{MOST_RECORDS, Resampling as Core, gain, passed_noise};
use tvident::noise::PassedNoise as Passed;
use tvident::record::Samples;
use tvident::simd::Instructions;

use crate::arrays::zeros;
use crate::records::{StridedSamples, records};
use crate::watch::watched;

/// Channels that share the factors of one spline.
const TOGETHER: usize = 8;

/// What white noise of variance one becomes where channels are resampled.
#[pyclass(frozen, module = "tvident._core")]
pub(crate) struct PassedNoise(pub(crate) Passed);

#[pymethods]
impl PassedNoise {
    /// Its density at low frequencies.
    #[getter]
    fn gain(&self) -> f64 {
        self.0.gain
    }
}

/// How channels are brought onto a uniform grid: times in its periods from its first sample on.
#[pyclass(frozen, module = "tvident._core")]
pub(crate) struct Resampling {
    core: Core,
}

#[pymethods]
impl Resampling {
    #[new]
    #[pyo3(signature = (times, grid, *, order, bridged, propagate=false))]
    fn new(
        times: &Bound<'_, PyUntypedArray>,
        grid: usize,
        order: usize,
        bridged: f64,
        propagate: bool,
    ) -> PyResult<Self> {
        let times = values(times)?;
        if !matches!(order, 1 | 3 | 5 | 7) {
            return Err(PyValueError::new_err(format!("order must be 1, 3, 5 or 7; got {order}")));
        }
        if times
            .iter()
            .zip(times.iter().skip(1))
            .any(|(one, next)| next.partial_cmp(one) != Some(std::cmp::Ordering::Greater))
        {
            return Err(PyValueError::new_err("times must increase"));
        }
        Ok(Self { core: Core { times, grid, order, bridged, propagate } })
    }

    /// Channels along the last axis, brought onto the grid.
    #[pyo3(signature = (samples, *, workers=None))]
    fn onto_grid<'py>(
        &self,
        samples: &Bound<'py, PyUntypedArray>,
        workers: Option<NonZeroUsize>,
    ) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let py = samples.py();
        let (records, grid) = (records(samples)?, self.core.grid);
        if records.iter().any(|record| record.len() != self.core.times.len()) {
            return Err(PyValueError::new_err("channels need one sample for each time"));
        }
        let shape: Vec<usize> = samples.shape().iter().rev().skip(1).rev().copied().chain([grid]).collect();
        let resampled = zeros::<f64>(py, &shape)?;
        let mut found = Vec::new();
        watched(py, None, |watch| {
            for some in records.chunks(TOGETHER) {
                let values: Vec<Vec<f64>> = some.iter().map(samples_of).collect();
                let slices: Vec<&[f64]> = values.iter().map(Vec::as_slice).collect();
                found.extend(self.core.onto_grid(&slices, threads(workers), watch)?);
            }
            Ok(())
        })?;
        {
            let mut rows = resampled.readwrite();
            for (row, found) in rows.as_slice_mut()?.chunks_exact_mut(grid.max(1)).zip(&found) {
                row.copy_from_slice(found);
            }
        }
        Ok(resampled)
    }

    /// Channels along the last axis at any times, which increase: one row for each.
    fn at<'py>(
        &self,
        samples: &Bound<'py, PyUntypedArray>,
        wanted: &Bound<'py, PyUntypedArray>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let py = samples.py();
        let records = records(samples)?;
        if records.iter().any(|record| record.len() != self.core.times.len()) {
            return Err(PyValueError::new_err("channels need one sample for each time"));
        }
        let (channels, wanted): (Vec<_>, _) = (records.iter().map(samples_of).collect(), values(wanted)?);
        let slices: Vec<&[f64]> = channels.iter().map(Vec::as_slice).collect();
        Ok(PyArray2::from_vec2(py, &py.detach(|| self.core.at(&slices, &wanted)))?)
    }

    /// The density at low frequencies of white noise of variance one: one on a uniform grid.
    #[pyo3(signature = (*, workers=None))]
    fn gain(&self, py: Python<'_>, workers: Option<NonZeroUsize>) -> PyResult<f64> {
        let mut found = 1.0;
        watched(py, None, |watch| {
            found = gain(&self.core, threads(workers), watch)?;
            Ok(())
        })?;
        Ok(found)
    }

    /// What white noise of variance one becomes: as few records of it tell that, and at most so many.
    #[pyo3(signature = (*, records=MOST_RECORDS, workers=None))]
    fn passed_noise(&self, py: Python<'_>, records: usize, workers: Option<NonZeroUsize>) -> PyResult<PassedNoise> {
        let mut found = None;
        watched(py, None, |watch| {
            found = Some(passed_noise(&self.core, records, Instructions::current(), threads(workers), watch)?);
            Ok(())
        })?;
        found.map(PassedNoise).ok_or_else(|| PyValueError::new_err("no noise was passed"))
    }
}

/// The samples of a record.
pub(crate) fn samples_of(record: &StridedSamples) -> Vec<f64> {
    let mut values = vec![0.0; record.len()];
    record.read(0, &mut values);
    values
}

/// The samples of an array that is one record.
pub(crate) fn values(array: &Bound<'_, PyUntypedArray>) -> PyResult<Vec<f64>> {
    let records = records(array)?;
    let [one] = &records[..] else { return Err(PyValueError::new_err("times are one record")) };
    Ok(samples_of(one))
}
