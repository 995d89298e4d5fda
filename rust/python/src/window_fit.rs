//! `tvident._core.WindowFit`: local polynomials of samples that have times of their own.

use std::num::NonZeroUsize;

use numpy::{IntoPyArray, PyArray1, PyArrayDyn, PyArrayMethods, PyUntypedArray, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use tvident::exec::workers as threads;
use tvident::irregular::{FEWEST, WindowFit as Core, WindowFits, WindowSpan};
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
    /// Standard errors of the derivatives, where they were asked for.
    stderr: Option<Py<PyArrayDyn<f64>>>,
}

/// Windows of so many samples, or of so many seconds, around samples at given times.
#[pyclass(frozen, module = "tvident._core")]
pub(crate) struct WindowFit {
    core: Core,
}

#[pymethods]
impl WindowFit {
    #[new]
    #[pyo3(signature = (times, window_length, *, order, max_order, criterion, derivatives, quantisation, weights=None, least=FEWEST))]
    fn new(
        times: &Bound<'_, PyUntypedArray>,
        window_length: &Bound<'_, PyAny>,
        order: Option<usize>,
        max_order: usize,
        criterion: &str,
        derivatives: usize,
        quantisation: f64,
        weights: Option<&Bound<'_, PyUntypedArray>>,
        least: usize,
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
        let weights = weights.map(values).transpose()?;
        if weights.as_ref().is_some_and(|weights| weights.len() != times.len()) {
            return Err(PyValueError::new_err("weights and times must be as many as each other"));
        }
        Ok(Self { core: Core { times, span, order, derivatives, quantisation, weights, least } })
    }

    /// Estimates along the last axis, and the standard errors of the derivatives where they are asked for.
    #[pyo3(signature = (samples, *, errors=false, step=1, workers=None, progress=None))]
    fn estimate(
        &self,
        samples: &Bound<'_, PyUntypedArray>,
        errors: bool,
        step: usize,
        workers: Option<NonZeroUsize>,
        progress: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<WindowEstimates> {
        let py = samples.py();
        let records = records(samples)?;
        if records.iter().any(|record| tvident::record::Samples::len(record) != self.core.times.len()) {
            return Err(PyValueError::new_err("samples and times must be as many as each other"));
        }
        let (all, one) = (records.len(), self.core.times.len());
        let count = one.div_ceil(step);
        let shape: Vec<usize> = samples.shape().iter().rev().skip(1).rev().copied().chain([count]).collect();
        let of_each: Vec<usize> = std::iter::once(self.core.derivatives + 1).chain(shape.iter().copied()).collect();
        let derivatives = zeros::<f64>(py, &of_each)?;
        let stderr = if errors { Some(zeros::<f64>(py, &of_each)?) } else { None };
        let (order, status) = (zeros::<u8>(py, &shape)?, zeros::<u16>(py, &shape)?);
        let sigma = zeros::<f64>(py, &shape)?;
        {
            let (mut derivatives, mut stderr) =
                (derivatives.readwrite(), stderr.as_ref().map(PyArrayMethods::readwrite));
            let (mut order, mut status, mut sigma) = (order.readwrite(), status.readwrite(), sigma.readwrite());
            let mut estimates = by_record(derivatives.as_slice_mut()?, all, count);
            let mut errors = match &mut stderr {
                Some(stderr) => by_record(stderr.as_slice_mut()?, all, count),
                None => (0..all).map(|_| Vec::new()).collect(),
            };
            let mut others = order
                .as_slice_mut()?
                .chunks_mut(count.max(1))
                .zip(status.as_slice_mut()?.chunks_mut(count.max(1)))
                .zip(sigma.as_slice_mut()?.chunks_mut(count.max(1)));
            watched(py, progress, |watch| {
                for (done, record) in records.iter().enumerate() {
                    let mut share = |now: usize, _: usize| watch(done * one + now * step, all * one);
                    let Some(((order, status), sigma)) = others.next() else { break };
                    let fits = WindowFits {
                        derivatives: std::mem::take(&mut estimates[done]),
                        errors: std::mem::take(&mut errors[done]),
                        order,
                        status,
                        sigma,
                    };
                    self.core.fit(&samples_of(record), step, fits, threads(workers), &mut share)?;
                }
                Ok(())
            })?;
        }
        let estimates = LocalEstimates {
            derivatives: derivatives.unbind(),
            order: order.unbind(),
            status: status.unbind(),
            sigma: sigma.unbind(),
        };
        Ok(WindowEstimates { estimates: Py::new(py, estimates)?, stderr: stderr.map(Bound::unbind) })
    }

    /// The criterion of every order in the window around a sample of a record.
    fn scores<'py>(&self, samples: &Bound<'py, PyUntypedArray>, sample: usize) -> PyResult<Bound<'py, PyArray1<f64>>> {
        Ok(self.core.scores(&values(samples)?, sample).into_pyarray(samples.py()))
    }
}

/// Rows of so many numbers, by derivative and then by record, as those of each record.
fn by_record(values: &mut [f64], records: usize, count: usize) -> Vec<Vec<&mut [f64]>> {
    let mut rows: Vec<Vec<&mut [f64]>> = (0..records).map(|_| Vec::new()).collect();
    for (place, row) in values.chunks_mut(count.max(1)).enumerate() {
        rows[place % records].push(row);
    }
    rows
}
