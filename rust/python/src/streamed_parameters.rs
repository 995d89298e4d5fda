//! `tvident._core.ParameterStream`: parameters of the equation of motion of a recording that goes on.

use std::ops::Range;
use std::sync::Arc;

use numpy::{PyArray1, PyArrayDyn, PyArrayMethods, PyReadonlyArray1, PyUntypedArray};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use tvident::equation::BuiltInTerm;
use tvident::least_squares::Regressions;
use tvident::local_polynomials::LocalPolynomials as Plan;
use tvident::record::Samples;
use tvident::stream::{
    ConstantState, ConstantStream, NextSamples, Parameters, PolynomialState, RollingState, RowsState, StreamedMotion,
    StreamedSamples, WindowedState, WindowedStream,
};

use crate::arrays::{rows, zeros};
use crate::local_polynomials::LocalPolynomials;
use crate::records::one;
use crate::streams::{elements, in_pieces};
use crate::watch::exception;

/// Parameters of some samples.
#[pyclass(frozen, get_all, module = "tvident._core")]
pub(crate) struct StreamedParameters {
    /// Number of the first sample.
    first: usize,
    /// By sample: values of all unknowns, their standard errors, the deviation of residuals and the condition. One array, which costs what each of
    /// them would alone.
    numbers: Py<PyArrayDyn<f64>>,
    status: Py<PyArrayDyn<u16>>,
    order: Py<PyArrayDyn<u8>>,
}

/// Whole numbers, then columns of numbers.
type State<'py> = (Vec<usize>, Vec<Bound<'py, PyArray1<f64>>>);

/// A state as it was pickled.
type Stored<'py> = (Vec<usize>, Vec<PyReadonlyArray1<'py, f64>>);

/// How parameters come about.
enum Stream {
    /// In a window around every sample.
    Windowed(Box<WindowedStream>),
    /// From all rows so far.
    Constant(Box<ConstantStream>),
}

/// Calls the same method of either.
macro_rules! either {
    ($stream:expr, $one:ident => $call:expr) => {
        match $stream {
            Stream::Windowed($one) => $call,
            Stream::Constant($one) => $call,
        }
    };
}

/// Parameters of a recording as its samples come.
#[pyclass(module = "tvident._core")]
pub(crate) struct ParameterStream {
    plan: Arc<Plan>,
    unknowns: usize,
    weighted: bool,
    stream: Stream,
}

#[pymethods]
impl ParameterStream {
    /// Constants where there is no regression window, which are forgotten by a factor at every row. Missing samples are left out, or spoil
    /// their windows.
    #[new]
    #[pyo3(signature = (
        plan, regression_window, known, terms, *, step=1, factors=None, forgetting=1.0, leaves_out=false, weighted=false, state=None
    ))]
    fn new(
        plan: &LocalPolynomials,
        regression_window: Option<usize>,
        known: [Option<f64>; 3],
        terms: Vec<String>,
        step: usize,
        factors: Option<Vec<f64>>,
        forgetting: f64,
        leaves_out: bool,
        weighted: bool,
        state: Option<Stored<'_>>,
    ) -> PyResult<Self> {
        let named = |name: &String| {
            BuiltInTerm::named(name).ok_or_else(|| PyValueError::new_err(format!("no term is called {name:?}")))
        };
        let motion = StreamedMotion { known, terms: terms.iter().map(named).collect::<PyResult<_>>()? };
        let (unknowns, plan) = (motion.unknowns(), plan.shared());
        let motion = (motion, StreamedSamples { leaves_out, weighted });
        let shared = Arc::clone(&plan);
        let stream = if let Some(rows) = regression_window {
            let state = state.as_ref().map_or(Ok(WindowedState::default()), windowed)?;
            let stream = WindowedStream::resume(shared, rows, motion, step, factors, state);
            stream.map(|stream| Stream::Windowed(Box::new(stream)))
        } else {
            let state = state.as_ref().map_or(Ok(ConstantState::default()), constant)?;
            let stream = ConstantStream::resume(shared, motion, step, forgetting, state);
            stream.map(|stream| Stream::Constant(Box::new(stream)))
        };
        Ok(Self { plan, unknowns, weighted, stream: stream.map_err(|error| exception(&error))? })
    }

    /// Samples from one to its parameters.
    #[getter]
    fn delay(&self) -> usize {
        either!(&self.stream, stream => stream.delay())
    }

    /// Samples taken in so far.
    #[getter]
    fn samples(&self) -> usize {
        either!(&self.stream, stream => stream.samples())
    }

    /// What resuming needs.
    fn state<'py>(&self, py: Python<'py>) -> State<'py> {
        let (rows, whole, columns) = match &self.stream {
            Stream::Windowed(stream) => {
                let WindowedState { rows, windows, scatter } = stream.state();
                let (next, patience, seen) = scatter.unwrap_or_default();
                let whole = vec![windows.first, windows.given, usize::from(windows.ended), next, patience];
                (rows, whole, vec![windows.rows, seen])
            }
            Stream::Constant(stream) => {
                let ConstantState { rows, places, sums, recent, factors } = stream.state();
                (rows, places.to_vec(), vec![sums, recent, factors])
            }
        };
        let RowsState { angle, first, torque, first_weight, weights, marks } = rows;
        let places = [angle.first, angle.given, usize::from(angle.ended), first, first_weight];
        let all = [angle.samples, torque, weights, marks].into_iter().chain(columns);
        (places.into_iter().chain(whole).collect(), all.map(|column| PyArray1::from_vec(py, column)).collect())
    }

    /// Whether constants stay as they are.
    fn hold(&mut self, hold: bool) {
        if let Stream::Constant(stream) = &mut self.stream {
            stream.hold(hold);
        }
    }

    /// Forgets all rows that constants came from.
    fn reset(&mut self) {
        if let Stream::Constant(stream) = &mut self.stream {
            stream.reset();
        }
    }

    /// Takes in samples, with weights if the stream has them, and returns the parameters that they settle.
    #[pyo3(signature = (angle, torque, weights=None))]
    fn push<'py>(
        &mut self,
        angle: &Bound<'py, PyUntypedArray>,
        torque: &Bound<'py, PyUntypedArray>,
        weights: Option<&Bound<'py, PyUntypedArray>>,
    ) -> PyResult<StreamedParameters> {
        let py = angle.py();
        if weights.is_some() != self.weighted {
            return Err(PyTypeError::new_err("samples of a stream all have weights, or none has"));
        }
        let channels = [Some(angle), Some(torque), weights].into_iter().flatten().map(one);
        let channels = channels.collect::<PyResult<Vec<_>>>()?;
        let count = channels[0].len();
        if channels.iter().any(|channel| channel.len() != count) {
            return Err(PyValueError::new_err("angle and torque must have as many samples as each other"));
        }
        let given = either!(&self.stream, stream => stream.upcoming(count));
        let step = either!(&self.stream, stream => stream.step());
        let stream = &mut self.stream;
        outputs(py, self.unknowns, given, step, |parameters| {
            let mut held = [Vec::new(), Vec::new(), Vec::new()];
            in_pieces(py, count, |samples| {
                for (held, channel) in held.iter_mut().zip(&channels) {
                    held.resize(samples.len(), 0.0);
                    channel.read(samples.start, held);
                }
                let [angle, torque, weights] = &held;
                let weights = (channels.len() > 2).then_some(&weights[..]);
                either!(stream, stream => stream.push(NextSamples { angle, torque, weights }, parameters));
            })
        })
    }

    /// Ends the stream and returns the rest.
    fn finish(&mut self, py: Python<'_>) -> PyResult<StreamedParameters> {
        let given = either!(&self.stream, stream => stream.at_end());
        let step = either!(&self.stream, stream => stream.step());
        let (stream, plan) = (&mut self.stream, &self.plan);
        outputs(py, self.unknowns, given, step, |parameters| {
            either!(stream, stream => stream.finish(plan, parameters));
            Ok(())
        })
    }
}

/// A column that was pickled.
fn numbers(column: Option<&PyReadonlyArray1<'_, f64>>) -> PyResult<Vec<f64>> {
    let column = column.ok_or_else(|| PyTypeError::new_err("a stream resumes from what its state() returned"))?;
    Ok(column.as_slice()?.to_vec())
}

/// The part of a state that both kinds have, and the whole numbers of the rest.
fn rows_of<'a>((whole, columns): &'a Stored<'_>) -> PyResult<(RowsState, &'a [usize])> {
    let [first, given, ended, torque_first, first_weight, rest @ ..] = &whole[..] else {
        return Err(PyTypeError::new_err("a stream resumes from what its state() returned"));
    };
    let state = RowsState {
        angle: PolynomialState { first: *first, samples: numbers(columns.first())?, given: *given, ended: *ended != 0 },
        first: *torque_first,
        torque: numbers(columns.get(1))?,
        first_weight: *first_weight,
        weights: numbers(columns.get(2))?,
        marks: numbers(columns.get(3))?,
    };
    Ok((state, rest))
}

/// The state of windowed parameters.
fn windowed(stored: &Stored<'_>) -> PyResult<WindowedState> {
    let (rows, &[first, given, ended, next, patience]) = rows_of(stored)? else {
        return Err(PyTypeError::new_err("windowed parameters resume from what their state() returned"));
    };
    let windows = RollingState { first, rows: numbers(stored.1.get(4))?, given, ended: ended != 0 };
    Ok(WindowedState { rows, windows, scatter: Some((next, patience, numbers(stored.1.get(5))?)) })
}

/// The state of constants.
fn constant(stored: &Stored<'_>) -> PyResult<ConstantState> {
    let (rows, &[given, count, next, first]) = rows_of(stored)? else {
        return Err(PyTypeError::new_err("constants resume from what their state() returned"));
    };
    Ok(ConstantState {
        rows,
        places: [given, count, next, first],
        sums: numbers(stored.1.get(4))?,
        recent: numbers(stored.1.get(5))?,
        factors: numbers(stored.1.get(6))?,
    })
}

/// Makes the arrays and has them filled.
fn outputs(
    py: Python<'_>,
    unknowns: usize,
    given: Range<usize>,
    step: usize,
    fill: impl FnOnce(&mut Parameters<'_>) -> PyResult<()>,
) -> PyResult<StreamedParameters> {
    let (elements, count) = elements(&given, step);
    let kinds = 2 * unknowns + 2;
    let numbers = zeros::<f64>(py, &[kinds, count])?;
    let (status, order) = (zeros::<u16>(py, &[count])?, zeros::<u8>(py, &[count])?);
    {
        let (mut numbers, mut status, mut order) = (numbers.readwrite(), status.readwrite(), order.readwrite());
        let mut parameters = rows(numbers.as_slice_mut()?, kinds, count);
        let mut deviations = parameters.split_off(2 * unknowns);
        let condition = deviations.pop().unwrap_or_default();
        let errors = parameters.split_off(unknowns);
        let regressions = Regressions {
            elements,
            parameters,
            errors,
            deviations,
            condition,
            status: status.as_slice_mut()?,
            ..Regressions::default()
        };
        fill(&mut Parameters { regressions, order: order.as_slice_mut()? })?;
    }
    Ok(StreamedParameters {
        first: elements.first,
        numbers: numbers.unbind(),
        status: status.unbind(),
        order: order.unbind(),
    })
}
