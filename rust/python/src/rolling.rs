//! `tvident._core.rolling_least_squares`.

use std::num::NonZeroUsize;

use numpy::{PyArrayDyn, PyArrayMethods, PyUntypedArray};
use pyo3::prelude::*;
use tvident::exec::workers as threads;
use tvident::lanes::Elements;
use tvident::least_squares::HALF_OF_THE_DIGITS;
use tvident::least_squares::{Equations, Regressions, RollingLeastSquares};
use tvident::record::Samples;
use tvident::simd::Instructions;

use crate::arrays::zeros;
use crate::records::records;
use crate::watch::{exception, watched};

/// What least squares give in every window.
#[pyclass(frozen, get_all, module = "tvident._core")]
pub(crate) struct RollingRegressions {
    /// By regressor, right-hand side and window.
    params: Py<PyArrayDyn<f64>>,
    stderr: Py<PyArrayDyn<f64>>,
    /// Residual sums of squares by right-hand side and window.
    rss: Py<PyArrayDyn<f64>>,
    condition: Py<PyArrayDyn<f64>>,
    status: Py<PyArrayDyn<u16>>,
}

/// Least squares in every window of rows; regressors and right-hand sides have the rows along their last axis.
#[pyfunction]
#[pyo3(signature = (regressors, rhs, window, *, step=1, workers=None, progress=None))]
pub(crate) fn rolling_least_squares<'py>(
    regressors: &Bound<'py, PyUntypedArray>,
    rhs: &Bound<'py, PyUntypedArray>,
    window: usize,
    step: usize,
    workers: Option<NonZeroUsize>,
    progress: Option<&Bound<'py, PyAny>>,
) -> PyResult<RollingRegressions> {
    let py = regressors.py();
    let (regressors, rhs) = (records(regressors)?, records(rhs)?);
    let (p, q) = (regressors.len(), rhs.len());
    let columns: Vec<&dyn Samples> = regressors.iter().chain(&rhs).map(|record| record as &dyn Samples).collect();
    let rows = columns.first().map_or(0, |column| column.len());
    let plan = RollingLeastSquares::new(window, p, q, Vec::new(), HALF_OF_THE_DIGITS, Instructions::current());
    let plan = plan.map_err(|error| exception(&error))?;
    let count = rows.div_ceil(step);

    let parameters = zeros::<f64>(py, &[p, q, count])?;
    let errors = zeros::<f64>(py, &[p, q, count])?;
    let residuals = zeros::<f64>(py, &[q, count])?;
    let condition = zeros::<f64>(py, &[count])?;
    let status = zeros::<u16>(py, &[count])?;
    {
        let (mut parameters, mut errors) = (parameters.readwrite(), errors.readwrite());
        let (mut residuals, mut condition, mut status) =
            (residuals.readwrite(), condition.readwrite(), status.readwrite());
        let regressions = Regressions {
            elements: Elements { first: 0, step },
            parameters: parameters.as_slice_mut()?.chunks_exact_mut(count).collect(),
            errors: errors.as_slice_mut()?.chunks_exact_mut(count).collect(),
            covariances: Vec::new(),
            residuals: residuals.as_slice_mut()?.chunks_exact_mut(count).collect(),
            deviations: Vec::new(),
            condition: condition.as_slice_mut()?,
            status: status.as_slice_mut()?,
        };
        let equations = Equations { columns, rows: 0..rows };
        watched(py, progress, |watch| plan.run(&equations, regressions, threads(workers), watch))?;
    }
    Ok(RollingRegressions {
        params: parameters.unbind(),
        stderr: errors.unbind(),
        rss: residuals.unbind(),
        condition: condition.unbind(),
        status: status.unbind(),
    })
}
