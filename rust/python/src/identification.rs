//! `tvident._core.identify_windowed` and `identify_constant`.

use std::num::NonZeroUsize;

use numpy::{PyArray1, PyArray2, PyArray3, PyArrayMethods, PyUntypedArray, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use tvident::equation::{Coefficient, Motion, Term};
use tvident::exec::workers as threads;
use tvident::identify::{
    Identified, Track, identify_constant as constant, identify_windowed as windowed, identify_with_scatter, scatter,
};
use tvident::lanes::Elements;
use tvident::least_squares::{Regressions, RollingLeastSquares};
use tvident::record::Samples;
use tvident::regression::HARDLY_TOLD_APART;
use tvident::simd::Instructions;

use crate::local_polynomials::LocalPolynomials;
use crate::records::{StridedSamples, records};
use crate::watch::{exception, watched};

/// A coefficient of the equation of motion, or a term of it.
enum Held {
    Unknown,
    Number(f64),
    Records(Vec<StridedSamples>),
    Offset,
    Coulomb,
    Cubic,
}

impl Held {
    fn coefficient(&self, record: usize) -> PyResult<Coefficient<'_>> {
        match self {
            Self::Number(number) => Ok(Coefficient::Number(*number)),
            Self::Records(records) => one(records, record).map(Coefficient::Record),
            _ => Ok(Coefficient::Unknown),
        }
    }

    fn term(&self, record: usize) -> PyResult<Term<'_>> {
        match self {
            Self::Records(records) => one(records, record).map(Term::Record),
            Self::Coulomb => Ok(Term::Coulomb),
            Self::Cubic => Ok(Term::Cubic),
            _ => Ok(Term::Offset),
        }
    }
}

/// The equation of motion of every record of some arrays, which have time along their last axis.
#[pyclass(frozen, module = "tvident._core")]
pub(crate) struct Motions {
    angles: Vec<StridedSamples>,
    torques: Vec<StridedSamples>,
    coefficients: [Held; 3],
    terms: Vec<Held>,
    samples: usize,
    /// Keeps the memory of all of them.
    _arrays: Vec<Py<PyAny>>,
}

#[pymethods]
impl Motions {
    /// Coefficients are unknown (None), a number, or an array; terms are a name or an array.
    #[new]
    fn new(
        angle: &Bound<'_, PyUntypedArray>,
        torque: &Bound<'_, PyUntypedArray>,
        coefficients: [Bound<'_, PyAny>; 3],
        terms: Vec<Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let held = |given: &Bound<'_, PyAny>| {
            if given.is_none() {
                return Ok(Held::Unknown);
            }
            if let Ok(array) = given.cast::<PyUntypedArray>() {
                return records(array).map(Held::Records);
            }
            if let Ok(number) = given.extract::<f64>() {
                return Ok(Held::Number(number));
            }
            match given.extract::<&str>()? {
                "offset" => Ok(Held::Offset),
                "coulomb" => Ok(Held::Coulomb),
                "cubic" => Ok(Held::Cubic),
                name => Err(PyValueError::new_err(format!("no term is called {name:?}"))),
            }
        };
        let [inertia, damping, stiffness] = &coefficients;
        let arrays = [angle.as_any(), torque.as_any()].into_iter().chain(&coefficients).chain(&terms);
        Ok(Self {
            angles: records(angle)?,
            torques: records(torque)?,
            coefficients: [held(inertia)?, held(damping)?, held(stiffness)?],
            terms: terms.iter().map(held).collect::<PyResult<_>>()?,
            samples: angle.shape().last().copied().unwrap_or(0),
            _arrays: arrays.map(|array| array.clone().unbind()).collect(),
        })
    }
}

impl Motions {
    /// The equation of motion of one record.
    pub(crate) fn motion(&self, record: usize) -> PyResult<Motion<'_>> {
        let [inertia, damping, stiffness] = &self.coefficients;
        Ok(Motion {
            angle: one(&self.angles, record)?,
            torque: one(&self.torques, record)?,
            coefficients: [inertia.coefficient(record)?, damping.coefficient(record)?, stiffness.coefficient(record)?],
            terms: self.terms.iter().map(|term| term.term(record)).collect::<PyResult<_>>()?,
        })
    }

    /// The equations of motion of all records.
    fn all(&self) -> PyResult<Vec<Motion<'_>>> {
        (0..self.angles.len()).map(|record| self.motion(record)).collect()
    }
}

/// The samples that belong to one record.
fn one(records: &[StridedSamples], record: usize) -> PyResult<&dyn Samples> {
    let found = records.get(record).map(|samples| samples as &dyn Samples);
    found.ok_or_else(|| {
        PyValueError::new_err("angle, torque, known parameters and terms need as many records as each other")
    })
}

/// Parameters, standard errors, covariances, residual standard deviations, condition numbers, statuses and orders of every window; what
/// the standard errors of every unknown are to be multiplied by.
type Windowed<'py> = (
    Bound<'py, PyArray3<f64>>,
    Bound<'py, PyArray3<f64>>,
    Bound<'py, PyArray3<f64>>,
    Bound<'py, PyArray2<f64>>,
    Bound<'py, PyArray2<f64>>,
    Bound<'py, PyArray2<u16>>,
    Bound<'py, PyArray2<u8>>,
    Bound<'py, PyArray2<f64>>,
);

/// Identifies what is unknown in a window of equations around every sample. Records lie along the last axis; all outputs have the
/// records first, then, where there are several, the unknowns.
#[pyfunction]
#[pyo3(signature = (plan, motions, equations, pairs, *, step=1, workers=None, progress=None))]
pub(crate) fn identify_windowed<'py>(
    py: Python<'py>,
    plan: &LocalPolynomials,
    motions: &Motions,
    equations: usize,
    pairs: Vec<(usize, usize)>,
    step: usize,
    workers: Option<NonZeroUsize>,
    progress: Option<&Bound<'py, PyAny>>,
) -> PyResult<Windowed<'py>> {
    let samples = motions.samples.div_ceil(step);
    let all = motions;
    let motions = all.all()?;
    let unknowns = motions.first().map_or(0, Motion::unknowns);
    let (count, pair_count) = (motions.len(), pairs.len());
    let least_squares =
        RollingLeastSquares::new(equations, unknowns, 1, pairs, HARDLY_TOLD_APART, Instructions::current());
    let least_squares = least_squares.map_err(|error| exception(&error))?;

    let parameters = PyArray3::zeros(py, [count, unknowns, samples], false);
    let errors = PyArray3::zeros(py, [count, unknowns, samples], false);
    let covariances = PyArray3::zeros(py, [count, pair_count, samples], false);
    let deviations = PyArray2::zeros(py, [count, samples], false);
    let condition = PyArray2::zeros(py, [count, samples], false);
    let status = PyArray2::zeros(py, [count, samples], false);
    let order = PyArray2::zeros(py, [count, samples], false);
    let mut found = Vec::new();
    {
        let (mut parameters, mut errors) = (parameters.readwrite(), errors.readwrite());
        let (mut covariances, mut deviations) = (covariances.readwrite(), deviations.readwrite());
        let (mut condition, mut status, mut order) = (condition.readwrite(), status.readwrite(), order.readwrite());
        let mut parameters = parameters.as_slice_mut()?.chunks_exact_mut(samples);
        let mut errors = errors.as_slice_mut()?.chunks_exact_mut(samples);
        let mut covariances = covariances.as_slice_mut()?.chunks_exact_mut(samples);
        let mut deviations = deviations.as_slice_mut()?.chunks_exact_mut(samples);
        let mut condition = condition.as_slice_mut()?.chunks_exact_mut(samples);
        let mut status = status.as_slice_mut()?.chunks_exact_mut(samples);
        let mut order = order.as_slice_mut()?.chunks_exact_mut(samples);
        let outputs = |motion| {
            let regressions = Regressions {
                elements: Elements { first: 0, step },
                parameters: parameters.by_ref().take(unknowns).collect(),
                errors: errors.by_ref().take(unknowns).collect(),
                covariances: covariances.by_ref().take(pair_count).collect(),
                residuals: Vec::new(),
                deviations: deviations.by_ref().take(1).collect(),
                condition: condition.next().unwrap_or_default(),
                status: status.next().unwrap_or_default(),
            };
            (motion, Identified { regressions, order: order.next().unwrap_or_default() })
        };
        let records = motions.into_iter().map(outputs).collect();
        watched(py, progress, |watch| {
            let (plan, workers) = (plan.plan(), threads(workers));
            if step == 1 {
                return windowed(plan, &least_squares, records, workers, watch);
            }
            found = identify_with_scatter(plan, &least_squares, records, workers, watch)?;
            Ok(())
        })?;
    }
    if step == 1 {
        let (parameters, errors) = (parameters.readonly(), errors.readonly());
        let parameters: Vec<&[f64]> = parameters.as_slice()?.chunks_exact(samples).collect();
        let errors: Vec<&[f64]> = errors.as_slice()?.chunks_exact(samples).collect();
        let tracks = parameters.chunks_exact(unknowns).zip(errors.chunks_exact(unknowns));
        let tracks = tracks.map(|(values, errors)| Track { values, errors });
        let records: Vec<_> = all.all()?.into_iter().zip(tracks).collect();
        watched(py, None, |_| {
            found = scatter(plan.plan(), &least_squares, &records)?;
            Ok(())
        })?;
    }
    let factors = PyArray2::zeros(py, [count, unknowns], false);
    for (row, found) in factors.readwrite().as_slice_mut()?.chunks_exact_mut(unknowns).zip(&found) {
        row.copy_from_slice(found);
    }
    Ok((parameters, errors, covariances, deviations, condition, status, order, factors))
}

/// Values, covariances, residual standard deviations and condition numbers of every record; statuses and orders of every sample.
type Constant<'py> = (
    Bound<'py, PyArray2<f64>>,
    Bound<'py, PyArray3<f64>>,
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray2<u16>>,
    Bound<'py, PyArray2<u8>>,
);

/// Identifies what is unknown as constant over each record: NaN and an infinite condition number where it is not determined.
#[pyfunction]
#[pyo3(signature = (plan, motions, *, step=1, workers=None, progress=None))]
pub(crate) fn identify_constant<'py>(
    py: Python<'py>,
    plan: &LocalPolynomials,
    motions: &Motions,
    step: usize,
    workers: Option<NonZeroUsize>,
    progress: Option<&Bound<'py, PyAny>>,
) -> PyResult<Constant<'py>> {
    let samples = motions.samples.div_ceil(step);
    let motions = motions.all()?;
    let unknowns = motions.first().map_or(0, Motion::unknowns);
    let count = motions.len();

    let status = PyArray2::zeros(py, [count, samples], false);
    let order = PyArray2::zeros(py, [count, samples], false);
    let mut solutions = Vec::new();
    {
        let (mut status, mut order) = (status.readwrite(), order.readwrite());
        let mut status = status.as_slice_mut()?.chunks_exact_mut(samples);
        let mut order = order.as_slice_mut()?.chunks_exact_mut(samples);
        let outputs = |motion| {
            let elements = Elements { first: 0, step };
            let regressions = Regressions { elements, status: status.next().unwrap_or_default(), ..Default::default() };
            (motion, Identified { regressions, order: order.next().unwrap_or_default() })
        };
        let records = motions.into_iter().map(outputs).collect();
        watched(py, progress, |watch| {
            solutions = constant(plan.plan(), records, threads(workers), watch)?;
            Ok(())
        })?;
    }
    let values = PyArray2::zeros(py, [count, unknowns], false);
    let covariance = PyArray3::zeros(py, [count, unknowns, unknowns], false);
    let residual = PyArray1::zeros(py, [count], false);
    let condition = PyArray1::zeros(py, [count], false);
    {
        let (mut values, mut covariance) = (values.readwrite(), covariance.readwrite());
        let (mut residual, mut condition) = (residual.readwrite(), condition.readwrite());
        values.as_slice_mut()?.fill(f64::NAN);
        covariance.as_slice_mut()?.fill(f64::NAN);
        residual.as_slice_mut()?.fill(f64::NAN);
        condition.as_slice_mut()?.fill(f64::INFINITY);
        for (record, solution) in solutions.iter().enumerate() {
            if let Some(solution) = solution {
                let square = unknowns * unknowns;
                values.as_slice_mut()?[record * unknowns..][..unknowns].copy_from_slice(&solution.values);
                covariance.as_slice_mut()?[record * square..][..square].copy_from_slice(&solution.covariance);
                residual.as_slice_mut()?[record] = solution.residual;
                condition.as_slice_mut()?[record] = solution.condition;
            }
        }
    }
    Ok((values, covariance, residual, condition, status, order))
}
