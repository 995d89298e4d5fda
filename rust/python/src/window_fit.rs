//! `tvident._core.WindowFit`: local polynomials of samples that have times of their own.

use std::num::NonZeroUsize;

use numpy::{Element, IntoPyArray, PyArray1, PyArrayDyn, PyArrayMethods, PyUntypedArray, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use tvident::exec::workers as threads;
use tvident::irregular::{WindowFit as Core, WindowFits, WindowSpan};
use tvident::local_polynomials::Order;

use crate::arrays::zeros;
use crate::irregular::{samples_of, values};
use crate::local_polynomials::{LocalEstimates, criterion_of};
use crate::records::records;
use crate::watch::watched;

/// What was estimated in windows of samples that have times of their own.
#[pyclass(frozen, get_all, module = "tvident._core")]
pub(crate) struct WindowEstimates {
    estimates: Py<LocalEstimates>,
    /// Standard errors of the derivatives.
    stderr: Py<PyArrayDyn<f64>>,
}

/// Windows of so many samples, or of so many seconds, around samples at given times.
#[pyclass(frozen, module = "tvident._core")]
pub(crate) struct WindowFit {
    core: Core,
}

#[pymethods]
impl WindowFit {
    #[new]
    #[pyo3(signature = (times, window_length, *, order, max_order, criterion, derivatives, quantisation))]
    fn new(
        times: &Bound<'_, PyUntypedArray>,
        window_length: &Bound<'_, PyAny>,
        order: Option<usize>,
        max_order: usize,
        criterion: &str,
        derivatives: usize,
        quantisation: f64,
    ) -> PyResult<Self> {
        let span = match window_length.extract::<usize>() {
            Ok(samples) => WindowSpan::Samples(samples),
            Err(_) => WindowSpan::Seconds(window_length.extract()?),
        };
        let criterion = criterion_of(criterion)?;
        let order = order.map_or(Order::Chosen { criterion, highest: max_order }, Order::Fixed);
        let times = values(times)?;
        if times.is_empty() {
            return Err(PyValueError::new_err("there is no time"));
        }
        Ok(Self { core: Core { times, span, order, derivatives, quantisation } })
    }

    /// Estimates along the last axis, and the standard errors of the derivatives.
    #[pyo3(signature = (samples, *, step=1, workers=None, progress=None))]
    fn estimate(
        &self,
        samples: &Bound<'_, PyUntypedArray>,
        step: usize,
        workers: Option<NonZeroUsize>,
        progress: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<WindowEstimates> {
        let py = samples.py();
        let records = records(samples)?;
        if records.iter().any(|record| tvident::record::Samples::len(record) != self.core.times.len()) {
            return Err(PyValueError::new_err("samples and times must be as many as each other"));
        }
        let mut found: Vec<WindowFits> = Vec::new();
        watched(py, progress, |watch| {
            let (all, one) = (records.len(), self.core.times.len());
            for (done, record) in records.iter().enumerate() {
                let mut share = |now: usize, _: usize| watch(done * one + now * step, all * one);
                found.push(self.core.fit(&samples_of(record), step, threads(workers), &mut share)?);
            }
            Ok(())
        })?;
        let count = self.core.times.len().div_ceil(step);
        let shape: Vec<usize> = samples.shape().iter().rev().skip(1).rev().copied().chain([count]).collect();
        let by_derivative: Vec<usize> =
            std::iter::once(self.core.derivatives + 1).chain(shape.iter().copied()).collect();
        let derivatives = 0..=self.core.derivatives;
        let rows = |of: fn(&WindowFits) -> &Vec<Vec<f64>>| {
            let pairs = derivatives.clone().flat_map(|derivative| found.iter().map(move |one| (derivative, one)));
            filled(py, &by_derivative, pairs.map(|(derivative, one)| of(one)[derivative].as_slice()))
        };
        let estimates = LocalEstimates {
            derivatives: rows(|one| &one.derivatives)?.unbind(),
            order: filled(py, &shape, found.iter().map(|one| one.order.as_slice()))?.unbind(),
            status: filled(py, &shape, found.iter().map(|one| one.status.as_slice()))?.unbind(),
            sigma: filled(py, &shape, found.iter().map(|one| one.sigma.as_slice()))?.unbind(),
        };
        Ok(WindowEstimates { estimates: Py::new(py, estimates)?, stderr: rows(|one| &one.errors)?.unbind() })
    }

    /// The criterion of every order in the window around a sample of a record.
    fn scores<'py>(&self, samples: &Bound<'py, PyUntypedArray>, sample: usize) -> PyResult<Bound<'py, PyArray1<f64>>> {
        Ok(self.core.scores(&values(samples)?, sample).into_pyarray(samples.py()))
    }
}

/// An array of a shape, filled with one row after the other.
fn filled<'py, 'a, T: Element + Copy + 'a>(
    py: Python<'py>,
    shape: &[usize],
    rows: impl Iterator<Item = &'a [T]>,
) -> PyResult<Bound<'py, PyArrayDyn<T>>> {
    let array = zeros::<T>(py, shape)?;
    {
        let mut all = array.readwrite();
        let mut left = all.as_slice_mut()?;
        for row in rows {
            let (own, rest) = left.split_at_mut(row.len());
            own.copy_from_slice(row);
            left = rest;
        }
    }
    Ok(array)
}
