//! `tvident._core.LocalPolynomials`: the plan of local polynomials in every window.

use std::num::NonZeroUsize;
use std::ops::Range;
use std::sync::Arc;

use numpy::{IntoPyArray, PyArray1, PyArray2, PyArrayDyn, PyArrayMethods, PyUntypedArray, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use tvident::Error;
use tvident::exec::{Watch, workers as threads};
use tvident::lanes::Elements;
use tvident::local_polynomials::{
    Criterion, Estimates, Incomplete, LocalPolynomials as Plan, Order, PolynomialOptions, Selection, parts_of,
};
use tvident::record::Samples;
use tvident::simd::Instructions;

use crate::arrays::empty;
use crate::records::{one, placed, records};
use crate::watch::watched;

/// A part of longer records: the samples that are wanted, those that are held, and all that there are.
#[derive(Clone, Copy, FromPyObject)]
pub(crate) struct Part {
    #[pyo3(item(0))]
    wanted: (usize, usize),
    #[pyo3(item(1))]
    held: (usize, usize),
    #[pyo3(item(2))]
    of: usize,
}

impl Part {
    fn wanted(self) -> Range<usize> {
        self.wanted.0..self.wanted.1
    }
}

/// What was estimated in every window.
#[pyclass(frozen, get_all, module = "tvident._core")]
pub(crate) struct LocalEstimates {
    /// One row a derivative, then the shape of the samples.
    pub(crate) derivatives: Py<PyArrayDyn<f64>>,
    pub(crate) order: Py<PyArrayDyn<u8>>,
    pub(crate) status: Py<PyArrayDyn<u16>>,
    /// Standard deviation of the noise.
    pub(crate) sigma: Py<PyArrayDyn<f64>>,
}

/// What was estimated at some samples from what their windows hold.
#[pyclass(frozen, get_all, module = "tvident._core")]
pub(crate) struct IncompleteEstimates {
    /// One row a derivative.
    derivatives: Py<PyArray2<f64>>,
    stderr: Py<PyArray2<f64>>,
    order: Py<PyArray1<usize>>,
    status: Py<PyArray1<u16>>,
    /// Standard deviation of the noise.
    sigma: Py<PyArray1<f64>>,
}

/// Tables for windows of one length, made once and used for any number of records.
#[pyclass(frozen, module = "tvident._core")]
pub(crate) struct LocalPolynomials {
    plan: Arc<Plan>,
}

impl LocalPolynomials {
    /// The plan itself.
    pub(crate) fn plan(&self) -> &Plan {
        &self.plan
    }

    /// The plan for as long as a stream needs it.
    pub(crate) fn shared(&self) -> Arc<Plan> {
        Arc::clone(&self.plan)
    }
}

#[pymethods]
impl LocalPolynomials {
    #[new]
    #[pyo3(signature = (window_length, order, max_order, criterion, selection, derivatives, delta, noise, quantisation))]
    fn new(
        py: Python<'_>,
        window_length: usize,
        order: Option<usize>,
        max_order: usize,
        criterion: &str,
        selection: &str,
        derivatives: Vec<usize>,
        delta: f64,
        noise: bool,
        quantisation: f64,
    ) -> PyResult<Self> {
        let criterion = criterion_of(criterion)?;
        let selection = match selection {
            "window" => Selection::Window,
            "pooled" => Selection::Pooled,
            "average" => Selection::Average,
            _ => return Err(PyValueError::new_err(format!("no selection is called {selection:?}"))),
        };
        let order = order.map_or(Order::Chosen { criterion, highest: max_order }, Order::Fixed);
        let instructions = Instructions::current();
        let options = PolynomialOptions {
            window_length,
            order,
            selection,
            derivatives,
            delta,
            noise,
            quantisation,
            instructions,
        };
        let mut plan = None;
        watched(py, None, |watch| {
            plan = Some(Plan::watched(options, watch)?);
            Ok(())
        })?;
        plan.map(|plan| Self { plan: Arc::new(plan) }).ok_or_else(|| PyValueError::new_err("no plan was made"))
    }

    /// Number of orders in play.
    #[getter]
    fn orders(&self) -> usize {
        self.plan.orders()
    }

    /// Estimates along the last axis; without `ends` only where a full window lies around a sample.
    /// Where `samples` hold a part of longer records, `part` says which samples are wanted, which are held, and how many there are.
    #[pyo3(signature = (samples, *, ends=true, step=1, part=None, workers=None, progress=None))]
    fn estimate(
        &self,
        samples: &Bound<'_, PyUntypedArray>,
        ends: bool,
        step: usize,
        part: Option<Part>,
        workers: Option<NonZeroUsize>,
        progress: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<LocalEstimates> {
        let plan = &self.plan;
        let wanted = part.map(Part::wanted);
        let fill = |records: &[&dyn Samples], estimates: Estimates<'_>, watch: &mut Watch<'_>| {
            plan.run_part(records, estimates, ends, wanted.as_ref(), threads(workers), watch)
        };
        self.outputs(samples, (ends, step, part), progress, fill)
    }

    /// Standard errors of the derivatives, one row each, along the last axis.
    #[pyo3(signature = (samples, *, step=1, part=None, workers=None))]
    fn errors<'py>(
        &self,
        samples: &Bound<'py, PyUntypedArray>,
        step: usize,
        part: Option<Part>,
        workers: Option<NonZeroUsize>,
    ) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let plan = &self.plan;
        let wanted = part.map(Part::wanted);
        let fill = |records: &[&dyn Samples], estimates: Estimates<'_>, watch: &mut Watch<'_>| {
            plan.errors_of_part(records, estimates, wanted.as_ref(), threads(workers), watch)
        };
        let outputs = self.outputs(samples, (true, step, part), None, fill)?;
        Ok(outputs.derivatives.into_bound(samples.py()))
    }

    /// Estimates at some samples of one record from what their windows hold, which reach across gaps of at most so many samples.
    #[pyo3(signature = (samples, places, longest_gap, least, *, weights=None, workers=None, progress=None))]
    fn estimate_incomplete(
        &self,
        samples: &Bound<'_, PyUntypedArray>,
        places: Vec<usize>,
        longest_gap: usize,
        least: usize,
        weights: Option<&Bound<'_, PyUntypedArray>>,
        workers: Option<NonZeroUsize>,
        progress: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<IncompleteEstimates> {
        let py = samples.py();
        let records = records(samples)?;
        let record = records.first().ok_or_else(|| PyValueError::new_err("there is no record"))?;
        let weights = weights.map(one).transpose()?;
        let mut found = Vec::new();
        watched(py, progress, |watch| {
            let copy = |record: &dyn Samples| {
                let mut values = vec![0.0; record.len()];
                record.read(0, &mut values);
                values
            };
            let (values, weights) = (copy(record), weights.as_ref().map(|weights| copy(weights)));
            let parts = parts_of(&values, weights.as_deref(), longest_gap);
            let record = Incomplete { samples: &values, weights: weights.as_deref(), parts: &parts, least };
            found = self.plan.run_incomplete(&record, &places, threads(workers), watch)?;
            Ok(())
        })?;
        let count = self.plan.options().derivatives.len();
        let rows = |of: fn(&(f64, f64)) -> f64| -> Vec<Vec<f64>> {
            (0..count).map(|row| found.iter().map(|one| of(&one.derivatives[row])).collect()).collect()
        };
        let order: Vec<usize> = found.iter().map(|one| one.order).collect();
        let status: Vec<u16> = found.iter().map(|one| one.status.bits()).collect();
        let sigma: Vec<f64> = found.iter().map(|one| one.sigma).collect();
        Ok(IncompleteEstimates {
            derivatives: PyArray2::from_vec2(py, &rows(|one| one.0))?.unbind(),
            stderr: PyArray2::from_vec2(py, &rows(|one| one.1))?.unbind(),
            order: order.into_pyarray(py).unbind(),
            status: status.into_pyarray(py).unbind(),
            sigma: sigma.into_pyarray(py).unbind(),
        })
    }

    /// The criterion of every order in the window around a sample of a record.
    fn scores<'py>(&self, samples: &Bound<'py, PyUntypedArray>, sample: usize) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let records = records(samples)?;
        let record = records.first().ok_or_else(|| PyValueError::new_err("there is no record"))?;
        let mut scores = Vec::new();
        watched(samples.py(), None, |_| {
            scores = self.plan.scores(record, sample)?;
            Ok(())
        })?;
        Ok(scores.into_pyarray(samples.py()))
    }
}

impl LocalPolynomials {
    /// Makes the arrays and has them filled.
    fn outputs(
        &self,
        samples: &Bound<'_, PyUntypedArray>,
        (ends, step, part): (bool, usize, Option<Part>),
        progress: Option<&Bound<'_, PyAny>>,
        fill: impl FnOnce(&[&dyn Samples], Estimates<'_>, &mut Watch<'_>) -> Result<(), Error> + Send,
    ) -> PyResult<LocalEstimates> {
        let py = samples.py();
        let options = self.plan.options();
        let held = part.map(|part| [part.held]);
        let records = placed(samples, held.as_ref().map(<[_; 1]>::as_slice), part.map_or(0, |part| part.of))?;
        let before = if ends { 0 } else { self.plan.before_centre() };
        let length = part.map_or(samples.shape().last().copied().unwrap_or(0), |part| part.of);
        let covered = if ends { length } else { (length + 1).saturating_sub(options.window_length) };
        let all = Elements { first: before, step };
        let elements = match part {
            Some(part) => all.of(part.wanted()),
            None => 0..covered.div_ceil(step),
        };
        let (first, count) = (all.sample(elements.start), elements.len());

        let mut shape = samples.shape().to_vec();
        if let Some(last) = shape.last_mut() {
            *last = count;
        }
        let noise = options.noise || matches!(options.order, Order::Chosen { .. });
        let diagnostics = if noise { shape.clone() } else { vec![0] };
        let order = empty::<u8>(py, &diagnostics)?;
        let status = empty::<u16>(py, &diagnostics)?;
        let sigma = empty::<f64>(py, &diagnostics)?;
        shape.insert(0, options.derivatives.len());
        let derivatives = empty::<f64>(py, &shape)?;
        {
            let (mut derivatives, mut order) = (derivatives.readwrite(), order.readwrite());
            let (mut status, mut sigma) = (status.readwrite(), sigma.readwrite());
            // The records lie end to end, in every derivative anew.
            let all = (records.len() * count).max(1);
            let estimates = Estimates {
                elements: Elements { first, step },
                derivatives: derivatives.as_slice_mut()?.chunks_exact_mut(all).collect(),
                order: order.as_slice_mut()?,
                status: status.as_slice_mut()?,
                sigma: sigma.as_slice_mut()?,
            };
            let records: Vec<&dyn Samples> = records.iter().map(|record| record as &dyn Samples).collect();
            watched(py, progress, |watch| fill(&records, estimates, watch))?;
        }
        Ok(LocalEstimates {
            derivatives: derivatives.unbind(),
            order: order.unbind(),
            status: status.unbind(),
            sigma: sigma.unbind(),
        })
    }
}

/// A criterion by its name.
pub(crate) fn criterion_of(name: &str) -> PyResult<Criterion> {
    match name {
        "aicc" => Ok(Criterion::Aicc),
        "aicc-textbook" => Ok(Criterion::AiccTextbook),
        "aic" => Ok(Criterion::Aic),
        "bic" => Ok(Criterion::Bic),
        _ => Err(PyValueError::new_err(format!("no criterion is called {name:?}"))),
    }
}
