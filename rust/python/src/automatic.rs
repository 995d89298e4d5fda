//! Derivatives with window and order chosen.

use std::num::NonZeroUsize;

use numpy::{PyArrayDyn, PyArrayMethods, PyUntypedArray, PyUntypedArrayMethods};
use pyo3::prelude::*;
use tvident::Error;
use tvident::auto_derivatives::{
    AutomaticEstimates as Slices, AutomaticOptions, AutomaticRecord, estimate_automatically as core_estimate,
};
use tvident::exec::{part_of, workers as threads};
use tvident::noise::{coloured_or_low_passed_noise, noise};
use tvident::simd::Instructions;

use crate::arrays::zeros;
use crate::records::records;
use crate::watch::watched;

/// What was estimated with window and order chosen.
#[pyclass(frozen, get_all, module = "tvident._core")]
pub(crate) struct AutomaticEstimates {
    /// One row a derivative, then the shape of the samples.
    derivatives: Py<PyArrayDyn<f64>>,
    stderr: Py<PyArrayDyn<f64>>,
    /// Orders of the last derivative.
    order: Py<PyArrayDyn<u8>>,
    status: Py<PyArrayDyn<u16>>,
    /// By derivative and record: samples of the window and the order; zeros where none was chosen.
    chosen: Vec<Vec<(usize, usize)>>,
    /// By record: standard deviation of the noise, and the quantisation.
    noise: Vec<(f64, f64)>,
}

/// Estimates derivatives along the last axis. The quantisation is looked for where it is not given.
#[pyfunction]
#[pyo3(signature = (samples, derivatives, highest, fixed, delta, quantisation, *, workers=None, progress=None))]
pub(crate) fn estimate_automatically<'py>(
    samples: &Bound<'py, PyUntypedArray>,
    derivatives: Vec<usize>,
    highest: usize,
    fixed: bool,
    delta: f64,
    quantisation: Option<f64>,
    workers: Option<NonZeroUsize>,
    progress: Option<&Bound<'py, PyAny>>,
) -> PyResult<AutomaticEstimates> {
    let py = samples.py();
    let records = records(samples)?;
    let count = samples.shape().last().copied().unwrap_or(0);
    let mut shape = samples.shape().to_vec();
    let order = zeros::<u8>(py, &shape)?;
    let status = zeros::<u16>(py, &shape)?;
    shape.insert(0, derivatives.len());
    let values = zeros::<f64>(py, &shape)?;
    let errors = zeros::<f64>(py, &shape)?;
    let (mut chosen, mut noises) = (vec![Vec::new(); derivatives.len()], Vec::new());
    {
        let (mut values, mut errors) = (values.readwrite(), errors.readwrite());
        let (mut order, mut status) = (order.readwrite(), status.readwrite());
        let (values, errors) = (values.as_slice_mut()?, errors.as_slice_mut()?);
        let (order, status) = (order.as_slice_mut()?, status.as_slice_mut()?);
        let instructions = Instructions::current();
        let units = derivatives.len() * records.len();
        watched(py, progress, |watch| {
            let mut flags = vec![0; count];
            for (index, record) in records.iter().enumerate() {
                let found = noise(record, None, quantisation, instructions)?;
                let coloured = coloured_or_low_passed_noise(record, found.sigma * found.sigma, instructions);
                noises.push((coloured.variance().sqrt(), found.quantisation));
                let prepared = AutomaticRecord::new(record, &coloured, highest, instructions)?;
                for (row, &derivative) in derivatives.iter().enumerate() {
                    let options = AutomaticOptions { derivative, highest, fixed, delta };
                    let place = (row * records.len() + index) * count;
                    let own = index * count..(index + 1) * count;
                    let mut estimates = Slices {
                        values: &mut values[place..place + count],
                        errors: &mut errors[place..place + count],
                        // Those of the last derivative are what is returned.
                        order: if row + 1 == derivatives.len() { &mut order[own.clone()] } else { &mut [] },
                        status: &mut flags,
                    };
                    let done = index * derivatives.len() + row;
                    let mut watch = part_of(watch, done * count..(done + 1) * count, units * count);
                    let pair = core_estimate(&prepared, &options, &mut estimates, threads(workers), &mut watch)?;
                    chosen[row].push(pair.map_or((0, 0), |pair| (pair.window_length, pair.order)));
                    for (status, flags) in status[own].iter_mut().zip(&flags) {
                        *status |= flags;
                    }
                }
            }
            Ok::<(), Error>(())
        })?;
    }
    let (derivatives, stderr) = (values.unbind(), errors.unbind());
    Ok(AutomaticEstimates {
        derivatives,
        stderr,
        order: order.unbind(),
        status: status.unbind(),
        chosen,
        noise: noises,
    })
}
