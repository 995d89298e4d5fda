//! `tvident._core.PolynomialStream` and `RollingStream`: records that go on.

use std::ops::Range;
use std::sync::Arc;

use numpy::{PyArray1, PyArrayDyn, PyArrayMethods, PyReadonlyArray1, PyUntypedArray};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use tvident::lanes::Elements;
use tvident::least_squares::Regressions;
use tvident::local_polynomials::{Estimates, LocalPolynomials as Plan};
use tvident::record::Samples;
use tvident::stream::{
    CorrelatedStream, IncompleteState, IncompleteStream, PolynomialState, RollingState, RollingStream as Rolling,
    StreamedGaps,
};

use crate::arrays::{rows, zeros};
use crate::local_polynomials::{LocalEstimates, LocalPolynomials};
use crate::records::{StridedSamples, one, records};
use crate::rolling::{RollingRegressions, RowWindows};
use crate::watch::exception;

/// Samples between two looks for Ctrl-C; shorter pieces keep the interpreter's lock, which costs less than giving it back.
const PIECE: usize = 1 << 14;
const SHORT: usize = 64;

/// Some samples of a record.
struct Part<'a> {
    record: &'a StridedSamples,
    samples: Range<usize>,
}

impl Samples for Part<'_> {
    fn len(&self) -> usize {
        self.samples.len()
    }

    fn read(&self, first: usize, into: &mut [f64]) {
        self.record.read(self.samples.start + first, into);
    }
}

/// Does work piece by piece, without the interpreter's lock where a piece is long, and hears Ctrl-C in between.
pub(crate) fn in_pieces(py: Python<'_>, count: usize, mut work: impl FnMut(Range<usize>) + Send) -> PyResult<()> {
    let mut first = 0;
    while first < count {
        let end = count.min(first + PIECE);
        if count <= SHORT {
            work(first..end);
        } else {
            py.detach(|| work(first..end));
            py.check_signals()?;
        }
        first = end;
    }
    Ok(())
}

/// The elements of some samples, every so many, and how many there are.
pub(crate) fn elements(samples: &Range<usize>, step: usize) -> (Elements, usize) {
    let grid = Elements { first: 0, step };
    let some = grid.of(samples.clone());
    (Elements { first: grid.sample(some.start), step }, some.len())
}

/// Number, samples or rows, what was given, whether it has ended.
type State<'py> = (usize, Bound<'py, PyArray1<f64>>, usize, bool);

/// A state as it was pickled.
type Stored<'py> = (usize, PyReadonlyArray1<'py, f64>, usize, bool);

/// Local polynomials of a signal that comes piece by piece.
#[pyclass(module = "tvident._core")]
pub(crate) struct PolynomialStream {
    plan: Arc<Plan>,
    step: usize,
    errors: bool,
    weighted: bool,
    stream: IncompleteStream,
}

/// What windows that lack samples reach across and must hold; whether samples are left out, and have weights.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct Gaps {
    leaves_out: bool,
    weighted: bool,
    longest_gap: usize,
    least: usize,
}

/// What a stream of polynomials goes on from: its samples, then the number of the first weight and the weights.
type PolynomialsAt<'py> = (State<'py>, usize, Bound<'py, PyArray1<f64>>);

/// The same as it was pickled.
type PolynomialsFrom<'py> = (Stored<'py>, usize, PyReadonlyArray1<'py, f64>);

#[pymethods]
impl PolynomialStream {
    #[new]
    #[pyo3(signature = (plan, *, step=1, errors=false, gaps=None, state=None))]
    fn new(
        plan: &LocalPolynomials,
        step: usize,
        errors: bool,
        gaps: Option<Gaps>,
        state: Option<PolynomialsFrom<'_>>,
    ) -> PyResult<Self> {
        let plan = plan.shared();
        let state = match state {
            None => IncompleteState::default(),
            Some(((first, samples, given, ended), first_weight, weights)) => IncompleteState {
                samples: PolynomialState { first, samples: samples.as_slice()?.to_vec(), given, ended },
                first_weight,
                weights: weights.as_slice()?.to_vec(),
            },
        };
        let gaps = gaps.map(|Gaps { leaves_out, weighted, longest_gap, least }| StreamedGaps {
            leaves_out,
            weighted,
            longest_gap,
            least,
        });
        let weighted = gaps.is_some_and(|gaps| gaps.weighted);
        let stream = IncompleteStream::resume(Arc::clone(&plan), step, errors, gaps, state);
        Ok(Self { plan, step, errors, weighted, stream: stream.map_err(|error| exception(&error))? })
    }

    /// Samples from one to its estimate.
    #[getter]
    fn delay(&self) -> usize {
        self.stream.delay()
    }

    /// Samples taken in so far.
    #[getter]
    fn samples(&self) -> usize {
        self.stream.samples()
    }

    /// What resuming needs.
    fn state<'py>(&self, py: Python<'py>) -> PolynomialsAt<'py> {
        let IncompleteState { samples, first_weight, weights } = self.stream.state();
        let state = (samples.first, PyArray1::from_vec(py, samples.samples), samples.given, samples.ended);
        (state, first_weight, PyArray1::from_vec(py, weights))
    }

    /// Takes in samples, with weights if the stream has them, and returns the estimates that they settle.
    #[pyo3(signature = (samples, weights=None))]
    fn push(
        &mut self,
        samples: &Bound<'_, PyUntypedArray>,
        weights: Option<&Bound<'_, PyUntypedArray>>,
    ) -> PyResult<StreamedEstimates> {
        let py = samples.py();
        let record = one(samples)?;
        if weights.is_some() != self.weighted {
            return Err(PyTypeError::new_err("samples of a stream all have weights, or none has"));
        }
        let weights = weights.map(one).transpose()?;
        let given = self.stream.upcoming(record.len());
        let stream = &mut self.stream;
        outputs(py, &self.plan, given, self.step, self.errors, |estimates, errors| {
            in_pieces(py, record.len(), |samples| {
                let weights = weights.as_ref().map(|record| Part { record, samples: samples.clone() });
                let weights = weights.as_ref().map(|weights| weights as &dyn Samples);
                stream.push(&Part { record: &record, samples }, weights, estimates, errors);
            })
        })
    }

    /// Ends the stream and returns the rest, as `push` does.
    fn finish(&mut self, py: Python<'_>) -> PyResult<StreamedEstimates> {
        let given = self.stream.at_end();
        let stream = &mut self.stream;
        outputs(py, &self.plan, given, self.step, self.errors, |estimates, errors| {
            stream.finish(estimates, errors);
            Ok(())
        })
    }
}

/// Estimates that are settled.
#[pyclass(frozen, get_all, module = "tvident._core")]
pub(crate) struct StreamedEstimates {
    /// The number of the first sample.
    first: usize,
    estimates: Py<LocalEstimates>,
    /// Standard errors by derivative; none where they are not wanted.
    stderr: Py<PyArrayDyn<f64>>,
}

/// Makes the arrays and has them filled.
fn outputs(
    py: Python<'_>,
    plan: &Plan,
    given: Range<usize>,
    step: usize,
    with_errors: bool,
    fill: impl FnOnce(&mut Estimates<'_>, &mut [&mut [f64]]) -> PyResult<()>,
) -> PyResult<StreamedEstimates> {
    let (elements, count) = elements(&given, step);
    let kinds = plan.options().derivatives.len();
    let derivatives = zeros::<f64>(py, &[kinds, count])?;
    let errors = zeros::<f64>(py, &[if with_errors { kinds } else { 0 }, count])?;
    let sigma = zeros::<f64>(py, &[count])?;
    let order = zeros::<u8>(py, &[count])?;
    let status = zeros::<u16>(py, &[count])?;
    {
        let (mut derivatives, mut errors, mut sigma) = (derivatives.readwrite(), errors.readwrite(), sigma.readwrite());
        let (mut order, mut status) = (order.readwrite(), status.readwrite());
        let mut estimates = Estimates {
            elements,
            derivatives: rows(derivatives.as_slice_mut()?, kinds, count),
            order: order.as_slice_mut()?,
            status: status.as_slice_mut()?,
            sigma: sigma.as_slice_mut()?,
        };
        let mut errors = rows(errors.as_slice_mut()?, if with_errors { kinds } else { 0 }, count);
        fill(&mut estimates, &mut errors)?;
    }
    let estimates = LocalEstimates {
        derivatives: derivatives.unbind(),
        order: order.unbind(),
        status: status.unbind(),
        sigma: sigma.unbind(),
    };
    Ok(StreamedEstimates { first: elements.first, estimates: Py::new(py, estimates)?, stderr: errors.unbind() })
}

/// Standard errors know of correlated residuals, or not.
enum Windows {
    Correlated(Box<CorrelatedStream>),
    Independent(Box<Rolling>),
}

/// Calls the same method of either.
macro_rules! either {
    ($stream:expr, $one:ident => $call:expr) => {
        match $stream {
            Windows::Correlated($one) => $call,
            Windows::Independent($one) => $call,
        }
    };
}

/// Least squares in windows of rows that come piece by piece.
#[pyclass(module = "tvident._core")]
pub(crate) struct RollingStream {
    regressors: usize,
    rhs_count: usize,
    weighted: bool,
    step: usize,
    stream: Windows,
}

#[pymethods]
impl RollingStream {
    #[new]
    #[pyo3(signature = (windows, regressors, rhs_count, *, weighted=false, lags=None, step=1, state=None))]
    fn new(
        windows: RowWindows,
        regressors: usize,
        rhs_count: usize,
        weighted: bool,
        lags: Option<usize>,
        step: usize,
        state: Option<Stored<'_>>,
    ) -> PyResult<Self> {
        let plan = windows.plan(regressors, rhs_count)?;
        let state = match state {
            None => RollingState::default(),
            Some((first, rows, given, ended)) => RollingState { first, rows: rows.as_slice()?.to_vec(), given, ended },
        };
        let stream = match lags {
            Some(lags) => CorrelatedStream::resume(plan, lags, weighted, state)
                .map(|stream| Windows::Correlated(Box::new(stream))),
            None if weighted => {
                Rolling::weighted(plan, step, state).map(|stream| Windows::Independent(Box::new(stream)))
            }
            None => Rolling::resume(plan, step, state).map(|stream| Windows::Independent(Box::new(stream))),
        };
        let stream = stream.map_err(|error| exception(&error))?;
        Ok(Self { regressors, rhs_count, weighted, step, stream })
    }

    /// Rows from one to its window.
    #[getter]
    fn delay(&self) -> usize {
        either!(&self.stream, stream => stream.delay())
    }

    /// Rows taken in so far.
    #[getter]
    fn rows(&self) -> usize {
        either!(&self.stream, stream => stream.rows())
    }

    /// What resuming needs.
    fn state<'py>(&self, py: Python<'py>) -> State<'py> {
        let state = either!(&self.stream, stream => stream.state());
        (state.first, PyArray1::from_vec(py, state.rows), state.given, state.ended)
    }

    /// Takes in rows, one row of each array a column, with weights if the stream has them, and returns the windows that they settle.
    #[pyo3(signature = (regressors, rhs, weights=None))]
    fn push(
        &mut self,
        regressors: &Bound<'_, PyUntypedArray>,
        rhs: &Bound<'_, PyUntypedArray>,
        weights: Option<&Bound<'_, PyUntypedArray>>,
    ) -> PyResult<StreamedRegressions> {
        let py = regressors.py();
        let (regressors, rhs) = (records(regressors)?, records(rhs)?);
        if (regressors.len(), rhs.len()) != (self.regressors, self.rhs_count) {
            return Err(PyValueError::new_err(format!(
                "rows must have {} regressors and {} right-hand sides as before; got {} and {}; begin another stream for others",
                self.regressors,
                self.rhs_count,
                regressors.len(),
                rhs.len()
            )));
        }
        if weights.is_some() != self.weighted {
            return Err(PyTypeError::new_err("rows of a stream all have weights, or none has"));
        }
        let weights = weights.map(one).transpose()?;
        let columns: Vec<StridedSamples> = regressors.into_iter().chain(rhs).chain(weights).collect();
        let count = columns.first().map_or(0, Samples::len);
        let given = either!(&self.stream, stream => stream.upcoming(count));
        let stream = &mut self.stream;
        windows(py, (self.regressors, self.rhs_count), given, self.step, |regressions| {
            in_pieces(py, count, |samples| {
                let parts: Vec<Part<'_>> =
                    columns.iter().map(|record| Part { record, samples: samples.clone() }).collect();
                let parts: Vec<&dyn Samples> = parts.iter().map(|part| part as &dyn Samples).collect();
                either!(&mut *stream, stream => stream.push(&parts, regressions));
            })
        })
    }

    /// Ends the stream and returns the rest, as `push` does.
    fn finish(&mut self, py: Python<'_>) -> PyResult<StreamedRegressions> {
        let given = either!(&self.stream, stream => stream.at_end());
        let stream = &mut self.stream;
        windows(py, (self.regressors, self.rhs_count), given, self.step, |regressions| {
            either!(stream, stream => stream.finish(regressions));
            Ok(())
        })
    }
}

/// Windows that are settled; these have no residuals of their own, nor the part explained.
#[pyclass(frozen, get_all, module = "tvident._core")]
pub(crate) struct StreamedRegressions {
    /// The number of the first row.
    first: usize,
    regressions: Py<RollingRegressions>,
}

/// Makes the arrays and has them filled.
fn windows(
    py: Python<'_>,
    shape: (usize, usize),
    given: Range<usize>,
    step: usize,
    fill: impl FnOnce(&mut Regressions<'_>) -> PyResult<()>,
) -> PyResult<StreamedRegressions> {
    let (elements, count) = elements(&given, step);
    let found = RollingRegressions::filled(py, shape, (elements, count), false, |mut regressions| {
        fill(&mut regressions)?;
        Ok(0)
    })?;
    Ok(StreamedRegressions { first: elements.first, regressions: Py::new(py, found)? })
}
