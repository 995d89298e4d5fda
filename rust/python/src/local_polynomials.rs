//! `tvident._core.LocalPolynomials`: the plan of local polynomials in every window.

use std::num::NonZeroUsize;

use numpy::{IntoPyArray, PyArray1, PyArray2, PyArrayDyn, PyArrayMethods, PyUntypedArray, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use tvident::parallel::workers as threads;
use tvident::{Criterion, Elements, End, Estimates, Instructions, LocalPolynomials as Plan, Options, Order, Samples};

use crate::records::records;
use crate::watch::{exception, watched};

/// Derivatives, order, status and noise of every window.
type Outputs<'py> =
    (Bound<'py, PyArrayDyn<f64>>, Bound<'py, PyArrayDyn<u8>>, Bound<'py, PyArrayDyn<u16>>, Bound<'py, PyArrayDyn<f64>>);

/// Tables for windows of one length, made once and used for any number of records.
#[pyclass(frozen, module = "tvident._core")]
pub(crate) struct LocalPolynomials {
    plan: Plan,
}

impl LocalPolynomials {
    /// The plan itself.
    pub(crate) fn plan(&self) -> &Plan {
        &self.plan
    }
}

#[pymethods]
impl LocalPolynomials {
    #[new]
    #[pyo3(signature = (window_length, order, max_order, criterion, derivatives, delta, noise))]
    fn new(
        window_length: usize,
        order: Option<usize>,
        max_order: usize,
        criterion: &str,
        derivatives: Vec<usize>,
        delta: f64,
        noise: bool,
    ) -> PyResult<Self> {
        let criterion = match criterion {
            "aicc" => Criterion::Aicc,
            "aicc-textbook" => Criterion::AiccTextbook,
            "aic" => Criterion::Aic,
            "bic" => Criterion::Bic,
            _ => return Err(PyValueError::new_err(format!("no criterion is called {criterion:?}"))),
        };
        let order = order.map_or(Order::Chosen { criterion, highest: max_order }, Order::Fixed);
        let options =
            Options { window_length, order, derivatives, delta, noise, instructions: Instructions::current() };
        Ok(Self { plan: Plan::new(options).map_err(|error| exception(&error))? })
    }

    /// Number of orders in play.
    #[getter]
    fn orders(&self) -> usize {
        self.plan.orders()
    }

    /// Estimates along the last axis; without `ends` only where a full window lies around a sample.
    #[pyo3(signature = (samples, *, ends=true, step=1, workers=None, progress=None))]
    fn estimate<'py>(
        &self,
        samples: &Bound<'py, PyUntypedArray>,
        ends: bool,
        step: usize,
        workers: Option<NonZeroUsize>,
        progress: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Outputs<'py>> {
        let py = samples.py();
        let options = self.plan.options();
        let records = records(samples)?;
        let first = if ends { 0 } else { self.plan.before_centre() };
        let length = samples.shape().last().copied().unwrap_or(0);
        let covered = if ends { length } else { (length + 1).saturating_sub(options.window_length) };
        let count = covered.div_ceil(step);

        let mut shape = samples.shape().to_vec();
        if let Some(last) = shape.last_mut() {
            *last = count;
        }
        let noise = options.noise || matches!(options.order, Order::Chosen { .. });
        let diagnostics = if noise { shape.clone() } else { vec![0] };
        let order = PyArrayDyn::<u8>::zeros(py, diagnostics.clone(), false);
        let status = PyArrayDyn::<u16>::zeros(py, diagnostics.clone(), false);
        let sigma = PyArrayDyn::<f64>::zeros(py, diagnostics, false);
        shape.insert(0, options.derivatives.len());
        let derivatives = PyArrayDyn::<f64>::zeros(py, shape, false);
        {
            let (mut derivatives, mut order) = (derivatives.readwrite(), order.readwrite());
            let (mut status, mut sigma) = (status.readwrite(), sigma.readwrite());
            // Row d · records + r of the derivatives belongs to derivative d of record r.
            let mut rows: Vec<Option<&mut [f64]>> =
                derivatives.as_slice_mut()?.chunks_exact_mut(count.max(1)).map(Some).collect();
            let mut orders = order.as_slice_mut()?.chunks_exact_mut(count.max(1));
            let mut statuses = status.as_slice_mut()?.chunks_exact_mut(count.max(1));
            let mut sigmas = sigma.as_slice_mut()?.chunks_exact_mut(count.max(1));
            let mut work: Vec<(&dyn Samples, Estimates<'_>)> = Vec::with_capacity(records.len());
            for (index, record) in records.iter().enumerate() {
                let own = rows.iter_mut().skip(index).step_by(records.len());
                let estimates = Estimates {
                    elements: Elements { first, step },
                    derivatives: own.filter_map(Option::take).collect(),
                    order: orders.next().unwrap_or_default(),
                    status: statuses.next().unwrap_or_default(),
                    sigma: sigmas.next().unwrap_or_default(),
                };
                work.push((record, estimates));
            }
            let plan = &self.plan;
            watched(py, progress, |watch| plan.run(work, ends, threads(workers), watch))?;
        }
        Ok((derivatives, order, status, sigma))
    }

    /// The criterion of every order in the window around a sample of a record.
    fn scores<'py>(&self, samples: &Bound<'py, PyUntypedArray>, sample: usize) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let records = records(samples)?;
        let record = records.first().ok_or_else(|| PyValueError::new_err("there is no record"))?;
        let scores = self.plan.scores(record, sample).map_err(|error| exception(&error))?;
        Ok(scores.into_pyarray(samples.py()))
    }

    /// Standard error over noise at the centre of a window: one row a derivative, one column an order.
    fn gains<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let shape = [self.plan.options().derivatives.len(), self.plan.orders()];
        self.plan.gains().into_pyarray(py).reshape(shape)
    }

    /// Standard errors at the first or last samples of a record: one row a derivative.
    fn end_errors<'py>(&self, samples: &Bound<'py, PyUntypedArray>, last: bool) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let records = records(samples)?;
        let record = records.first().ok_or_else(|| PyValueError::new_err("there is no record"))?;
        let end = if last { End::Last } else { End::First };
        let errors = self.plan.end_errors(record, end).map_err(|error| exception(&error))?;
        PyArray2::from_vec2(samples.py(), &errors).map_err(Into::into)
    }
}
