//! `tvident._core.rolling_least_squares`.

use std::num::NonZeroUsize;
use std::sync::Arc;

use numpy::{PyArray1, PyArrayDyn, PyArrayMethods, PyUntypedArray};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use tvident::exec::workers as threads;
use tvident::lanes::Elements;
use tvident::least_squares::HALF_OF_THE_DIGITS;
use tvident::least_squares::{
    Alignment, Equations, Regressions, RollingLeastSquares, RowTimes as CoreTimes, Spans as CoreSpans,
};
use tvident::record::Samples;
use tvident::simd::Instructions;

use crate::arrays::{empty, rows};
use crate::records::records;
use crate::watch::{exception, watched};

/// What windows are like.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct RowWindows {
    rows: usize,
    alignment: String,
    at_least: Option<usize>,
    half_life: Option<f64>,
}

impl RowWindows {
    pub(crate) fn plan(&self, regressors: usize, rhs_count: usize) -> PyResult<RollingLeastSquares> {
        let instructions = Instructions::current();
        let plan =
            RollingLeastSquares::new(self.rows, regressors, rhs_count, Vec::new(), HALF_OF_THE_DIGITS, instructions);
        let plan = plan.map_err(|error| exception(&error))?.aligned(match self.alignment.as_str() {
            "centre" => Alignment::Centre,
            "trailing" => Alignment::Trailing,
            "leading" => Alignment::Leading,
            other => return Err(PyValueError::new_err(format!("no such alignment: {other}"))),
        });
        let plan = if let Some(rows) = self.at_least { plan.of_at_least(rows) } else { plan };
        Ok(if let Some(rows) = self.half_life { plan.with_half_life(rows) } else { plan })
    }
}

/// What least squares give in every window.
#[pyclass(frozen, get_all, module = "tvident._core")]
pub(crate) struct RollingRegressions {
    /// By regressor, right-hand side and window.
    params: Py<PyArrayDyn<f64>>,
    stderr: Py<PyArrayDyn<f64>>,
    /// Residual sums of squares by right-hand side and window.
    rss: Py<PyArrayDyn<f64>>,
    /// What each window leaves at its own row, likewise.
    residuals: Py<PyArrayDyn<f64>>,
    rsquared: Py<PyArrayDyn<f64>>,
    condition: Py<PyArrayDyn<f64>>,
    status: Py<PyArrayDyn<u16>>,
    /// Rows over which residuals are taken to be correlated.
    lags: usize,
}

impl RollingRegressions {
    /// Makes the arrays for some windows and has them filled; `fill` returns over how many rows residuals are taken to be correlated. Residuals
    /// and the part that is explained have no rows unless they are wanted `with_fit`.
    pub(crate) fn filled(
        py: Python<'_>,
        (p, q): (usize, usize),
        (elements, count): (Elements, usize),
        with_fit: bool,
        fill: impl FnOnce(Regressions<'_>) -> PyResult<usize>,
    ) -> PyResult<Self> {
        let fits = if with_fit { q } else { 0 };
        let (params, stderr) = (empty::<f64>(py, &[p, q, count])?, empty::<f64>(py, &[p, q, count])?);
        let (rss, condition) = (empty::<f64>(py, &[q, count])?, empty::<f64>(py, &[count])?);
        let (residuals, rsquared) = (empty::<f64>(py, &[fits, count])?, empty::<f64>(py, &[fits, count])?);
        let status = empty::<u16>(py, &[count])?;
        let lags = {
            let (mut params, mut stderr, mut rss) = (params.readwrite(), stderr.readwrite(), rss.readwrite());
            let (mut residuals, mut rsquared) = (residuals.readwrite(), rsquared.readwrite());
            let (mut condition, mut status) = (condition.readwrite(), status.readwrite());
            fill(Regressions {
                elements,
                parameters: rows(params.as_slice_mut()?, p * q, count),
                errors: rows(stderr.as_slice_mut()?, p * q, count),
                residuals: rows(rss.as_slice_mut()?, q, count),
                own_residuals: rows(residuals.as_slice_mut()?, fits, count),
                rsquared: rows(rsquared.as_slice_mut()?, fits, count),
                condition: condition.as_slice_mut()?,
                status: status.as_slice_mut()?,
                ..Regressions::default()
            })?
        };
        Ok(Self {
            params: params.unbind(),
            stderr: stderr.unbind(),
            rss: rss.unbind(),
            residuals: residuals.unbind(),
            rsquared: rsquared.unbind(),
            condition: condition.unbind(),
            status: status.unbind(),
            lags,
        })
    }
}

/// Times of rows, seconds from the first on, and what all of them show.
#[pyclass(frozen, module = "tvident._core")]
pub(crate) struct RowTimes(Arc<CoreTimes>);

#[pymethods]
impl RowTimes {
    #[new]
    fn new(times: &Bound<'_, PyUntypedArray>) -> PyResult<Self> {
        let py = times.py();
        let times = records(times)?;
        let [times] = &times[..] else { return Err(PyValueError::new_err("times of one record")) };
        let read = py.detach(|| CoreTimes::new(times, Instructions::current()));
        Ok(Self(Arc::new(read.map_err(|error| exception(&error))?)))
    }

    /// Whether every time is a number, and later than the one before.
    fn increase(&self) -> bool {
        self.0.increase()
    }

    /// The shortest step and the longest.
    fn steps(&self) -> (f64, f64) {
        self.0.steps()
    }

    /// The median of steps all over the record.
    fn usual_step(&self) -> f64 {
        self.0.usual_step()
    }

    /// How far times are from those of a uniform grid between the first and the last, at most.
    fn farthest(&self) -> f64 {
        self.0.farthest()
    }

    /// The largest magnitude of what was given.
    fn largest(&self) -> f64 {
        self.0.largest()
    }

    /// From the first time to the last.
    fn length(&self) -> f64 {
        self.0.length()
    }
}

/// Windows that the core found, and a number for each.
type Numbered<'py> = (Bound<'py, PyArray1<usize>>, Bound<'py, PyArray1<f64>>);

/// Windows of a duration, one for every row, which holds the rows from `begin` after its own time on, up to before `duration` later.
#[pyclass(frozen, module = "tvident._core")]
pub(crate) struct RowSpans(CoreSpans);

#[pymethods]
impl RowSpans {
    #[new]
    fn new(py: Python<'_>, times: &Bound<'_, RowTimes>, begin: f64, duration: f64) -> PyResult<Self> {
        let times = Arc::clone(&times.get().0);
        if !times.increase() || !begin.is_finite() || !(0.0..f64::INFINITY).contains(&duration) {
            return Err(PyValueError::new_err("times must increase, and spans must be numbers"));
        }
        let spans = py.detach(|| CoreSpans::new(times, begin, duration, Instructions::current()));
        Ok(Self(spans.map_err(|error| exception(&error))?))
    }

    /// Rows in the window that holds most of them, and in the one that holds fewest.
    fn most_and_fewest(&self) -> (usize, usize) {
        self.0.most_and_fewest()
    }

    /// Windows that hold fewer rows than that.
    fn fewer_than<'py>(&self, py: Python<'py>, least: usize) -> Bound<'py, PyArray1<usize>> {
        PyArray1::from_vec(py, self.0.fewer_than(least))
    }

    /// Windows that reach farther than `reach` beyond the first or the last row, and how much of their duration is no farther than that.
    fn near_ends<'py>(&self, py: Python<'py>, reach: f64) -> Numbered<'py> {
        let (windows, within) = self.0.near_ends(reach);
        (PyArray1::from_vec(py, windows), PyArray1::from_vec(py, within))
    }
}

/// Least squares in every window of rows; regressors, right-hand sides and weights have the rows along their last axis. `constant` is the
/// regressor that is a constant. With `correlated`, which needs a step of 1, standard errors know of residuals that are correlated over so
/// many `lags`, or over as many as they ask for. `spans` are windows that hold different numbers of rows; they need a step of 1 too.
#[pyfunction]
#[pyo3(signature = (
    regressors, rhs, windows, *, weights=None, constant=None, correlated=false, lags=None, spans=None, step=1, workers=None, progress=None
))]
#[allow(clippy::too_many_arguments, reason = "named by Python")]
pub(crate) fn rolling_least_squares<'py>(
    regressors: &Bound<'py, PyUntypedArray>,
    rhs: &Bound<'py, PyUntypedArray>,
    windows: RowWindows,
    weights: Option<&Bound<'py, PyUntypedArray>>,
    constant: Option<usize>,
    correlated: bool,
    lags: Option<usize>,
    spans: Option<&Bound<'py, RowSpans>>,
    step: usize,
    workers: Option<NonZeroUsize>,
    progress: Option<&Bound<'py, PyAny>>,
) -> PyResult<RollingRegressions> {
    let py = regressors.py();
    let (regressors, rhs) = (records(regressors)?, records(rhs)?);
    let weights = weights.map(records).transpose()?;
    let (p, q) = (regressors.len(), rhs.len());
    let mut columns: Vec<&dyn Samples> = regressors.iter().chain(&rhs).map(|record| record as &dyn Samples).collect();
    let total = columns.first().map_or(0, |column| column.len());
    let plan = windows.plan(p, q)?.with_fit(constant.is_some());
    // What comes first is taken off everything that follows.
    let constant = constant.unwrap_or(0);
    columns.swap(0, constant);
    let weights = weights.as_ref().and_then(|records| records.first()).map(|record| record as &dyn Samples);
    let equations = Equations { columns, weights, rows: 0..total };
    let (elements, workers) = (Elements { first: 0, step }, threads(workers));
    let spans = spans.map(|spans| &spans.get().0);
    if spans.is_some_and(|spans| spans.count() != total) {
        return Err(PyValueError::new_err("there must be one window for every row"));
    }
    RollingRegressions::filled(py, (p, q), (elements, total.div_ceil(step)), true, |mut regressions| {
        for rhs_index in 0..q {
            regressions.parameters.swap(rhs_index, constant * q + rhs_index);
            regressions.errors.swap(rhs_index, constant * q + rhs_index);
        }
        let mut over = 0;
        watched(py, progress, |watch| {
            if let Some(spans) = spans {
                plan.run_spans(&equations, spans, regressions, workers, watch)
            } else if correlated {
                over = plan.run_correlated(&equations, regressions, lags, workers, watch)?;
                Ok(())
            } else {
                plan.run(&equations, regressions, workers, watch)
            }
        })?;
        Ok(over)
    })
}
