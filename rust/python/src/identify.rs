//! `tvident._core.identify` and the two forms that it takes.

use std::num::NonZeroUsize;

use numpy::PyUntypedArray;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use tvident::equation::Motion;
use tvident::exec::workers as threads;
use tvident::identify::{
    Identification as Found, InstrumentTest, Kind, Method, Options, Repeated, StrongForm as Strong, StrongRecord, Task,
    WeakForm as Weak, around, constants_of_rows, identify_all, identify_with_instruments, parts_of_scatter,
    rows_of_part, scan_windows, scatter_of_windows,
};
use tvident::least_squares::Summary;
use tvident::record::Samples;
use tvident::simd::Instructions;

use crate::identified::{Identification, Scan, kind, width_from_named};
use crate::local_polynomials::LocalPolynomials;
use crate::motions::Motions;
use crate::records::{copied, flags, records};
use crate::watch::watched;

/// Settings of the weak form, one of each a record. What is None is chosen from the record.
#[pyclass(frozen, module = "tvident._core")]
pub(crate) struct WeakForm {
    settings: Vec<Weak>,
}

#[pymethods]
impl WeakForm {
    #[new]
    #[pyo3(signature = (window_length, exponent, regression_window, *, averaging=true, linear=true, noise=(None, None), shown_noise=None, tested=None, near=None, width_from=None, found_lag=None))]
    fn new(
        window_length: Vec<Option<usize>>,
        exponent: Vec<Option<usize>>,
        regression_window: Vec<Option<usize>>,
        averaging: bool,
        linear: bool,
        noise: (Option<f64>, Option<f64>),
        shown_noise: Option<Vec<f64>>,
        tested: Option<Vec<usize>>,
        near: Option<Vec<Option<usize>>>,
        width_from: Option<Vec<Option<String>>>,
        found_lag: Option<Vec<f64>>,
    ) -> Self {
        let each = window_length.into_iter().zip(exponent).zip(regression_window).enumerate();
        let settings = each.map(|(record, ((window_length, exponent), regression_window))| Weak {
            window_length,
            exponent,
            regression_window,
            averaging,
            linear,
            noise: noise.into(),
            shown_noise: shown_noise.as_ref().and_then(|each| each.get(record).copied()),
            repeated: Repeated {
                tested: tested.clone().unwrap_or_default(),
                near: near.as_ref().and_then(|each| each.get(record).copied().flatten()),
                width_from: width_from.as_ref().and_then(|each| width_from_named(each.get(record)?.as_deref()?)),
                found_lag: found_lag.as_ref().map(|each| each.get(record).copied().unwrap_or(0.0)),
            },
        });
        Self { settings: settings.collect() }
    }
}

/// Settings of the strong form; the plan is one for the angle and its first two derivatives.
#[pyclass(frozen, module = "tvident._core")]
pub(crate) struct StrongForm {
    plan: Py<LocalPolynomials>,
    regression_window: usize,
    filter_torque: bool,
    linear: bool,
}

#[pymethods]
impl StrongForm {
    #[new]
    #[pyo3(signature = (plan, regression_window, *, filter_torque=false, linear=false))]
    fn new(plan: Py<LocalPolynomials>, regression_window: usize, filter_torque: bool, linear: bool) -> Self {
        Self { plan, regression_window, filter_torque, linear }
    }

    /// The samples that must be there for windows around those from one to before another, in a record of so many.
    fn around(&self, first: usize, end: usize, samples: usize) -> (usize, usize) {
        let needed = around(&self.settings(), &(first..end), samples);
        (needed.start, needed.end)
    }

    /// The parts of a record of so many samples that `scatter` looks at.
    fn parts_of_scatter(&self, samples: usize) -> Vec<(usize, usize)> {
        parts_of_scatter(&self.settings(), samples).into_iter().map(|part| (part.start, part.end)).collect()
    }

    /// By how much standard errors of windowed unknowns exceed those of ordinary least squares, for every record and unknown.
    #[pyo3(signature = (motions, *, propagate=true, workers=None))]
    fn scatter(
        &self,
        py: Python<'_>,
        motions: &Motions,
        propagate: bool,
        workers: Option<NonZeroUsize>,
    ) -> PyResult<Vec<Vec<f64>>> {
        let (form, records) = (self.settings(), strong_records(motions, propagate)?);
        let mut factors = Vec::new();
        watched(py, None, |watch| {
            let each = records.iter().map(|record| scatter_of_windows(&form, record, threads(workers), watch));
            factors = each.collect::<Result<_, _>>()?;
            Ok(())
        })?;
        Ok(factors)
    }

    /// Estimates of every record by the length of the polynomials' windows.
    #[pyo3(signature = (motions, kinds, *, lag, masks=None, weights=None, workers=None))]
    fn scan(
        &self,
        py: Python<'_>,
        motions: &Motions,
        kinds: Vec<String>,
        lag: Vec<f64>,
        masks: Option<Vec<Bound<'_, PyUntypedArray>>>,
        weights: Option<&Bound<'_, PyUntypedArray>>,
        workers: Option<NonZeroUsize>,
    ) -> PyResult<Vec<Py<Scan>>> {
        let kinds = kinds_of(&kinds)?;
        let beside = Beside::new(masks, weights)?;
        let method = |_| Ok(Method::Strong(self.settings()));
        let tasks = tasks(motions, lag.into_iter().map(Some), None, &beside, method)?;
        let mut found = Vec::new();
        watched(py, None, |watch| {
            let form = self.settings();
            let each = tasks.iter().map(|task| scan_windows(task, &form, &kinds, threads(workers), watch));
            found = each.collect::<Result<_, _>>()?;
            Ok(())
        })?;
        found.iter().map(|found| Scan::new(py, found)).collect()
    }

    /// The equations around some samples of one record.
    #[pyo3(signature = (motions, wanted, *, propagate=true, workers=None))]
    fn rows(
        &self,
        py: Python<'_>,
        motions: &Motions,
        wanted: (usize, usize),
        propagate: bool,
        workers: Option<NonZeroUsize>,
    ) -> PyResult<FactoredRows> {
        let (form, records) = (self.settings(), strong_records(motions, propagate)?);
        let record = records.first().ok_or_else(|| PyValueError::new_err("there is no record"))?;
        let mut found = None;
        watched(py, None, |watch| {
            found = Some(rows_of_part(&form, record, wanted.0..wanted.1, threads(workers), watch)?);
            Ok(())
        })?;
        found.as_ref().map(FactoredRows::of).ok_or_else(|| PyValueError::new_err("there are no rows"))
    }

    /// The constants that rows tell; None where they do not.
    #[pyo3(signature = (motions, rows, *, propagate=true, workers=None))]
    fn constants(
        &self,
        py: Python<'_>,
        motions: &Motions,
        rows: &FactoredRows,
        propagate: bool,
        workers: Option<NonZeroUsize>,
    ) -> PyResult<Option<ConstantsOfRows>> {
        let (form, records, rows) = (self.settings(), strong_records(motions, propagate)?, rows.summary()?);
        let record = records.first().ok_or_else(|| PyValueError::new_err("there is no record"))?;
        let mut found = None;
        watched(py, None, |watch| {
            found = constants_of_rows(&form, record, &rows, threads(workers), watch)?;
            Ok(())
        })?;
        Ok(found.map(|found| ConstantsOfRows {
            values: found.values,
            covariance: found.covariance,
            residual: found.residual,
            condition: found.condition,
        }))
    }
}

/// The records of which parts are looked at: missing samples are left out of them, or spoil their windows.
fn strong_records(motions: &Motions, propagate: bool) -> PyResult<Vec<StrongRecord<'_>>> {
    let record = |motion| StrongRecord { motion, weights: None, leaves_out: !propagate };
    Ok(motions.all()?.into_iter().map(record).collect())
}

/// The constants that rows tell, the covariance of these row by row, and what is left.
#[pyclass(frozen, get_all, module = "tvident._core")]
pub(crate) struct ConstantsOfRows {
    values: Vec<f64>,
    covariance: Vec<f64>,
    /// Standard deviation of the residuals.
    residual: f64,
    condition: f64,
}

/// Rows as they are kept and sent elsewhere: by their triangular factor.
#[pyclass(frozen, get_all, module = "tvident._core")]
pub(crate) struct FactoredRows {
    /// The numbers of the factor, row by row.
    factor: Vec<f64>,
    columns: usize,
    /// How many rows it stands for.
    rows: usize,
}

#[pymethods]
impl FactoredRows {
    #[new]
    fn new(factor: Vec<f64>, columns: usize, rows: usize) -> Self {
        Self { factor, columns, rows }
    }

    /// What pickling needs.
    fn __getnewargs__(&self) -> (Vec<f64>, usize, usize) {
        (self.factor.clone(), self.columns, self.rows)
    }
}

impl FactoredRows {
    fn of(summary: &Summary) -> Self {
        let (factor, columns, rows) = summary.numbers();
        Self { factor, columns, rows }
    }

    fn summary(&self) -> PyResult<Summary> {
        Summary::of_numbers(&self.factor, self.columns, self.rows)
            .ok_or_else(|| PyValueError::new_err("this is no triangular factor"))
    }
}

/// The factor of the rows of two together.
#[pyfunction]
pub(crate) fn merged_rows(one: &FactoredRows, other: &FactoredRows) -> PyResult<FactoredRows> {
    if one.columns != other.columns {
        return Err(PyValueError::new_err("rows to be merged have the same columns"));
    }
    let mut all = one.summary()?;
    all.add(&other.summary()?);
    Ok(FactoredRows::of(&all))
}

impl StrongForm {
    /// The settings as the core has them.
    fn settings(&self) -> Strong<'_> {
        Strong {
            derivatives: self.plan.get().plan(),
            regression_window: self.regression_window,
            filter_torque: self.filter_torque,
            linear: self.linear,
        }
    }
}

/// One of the two forms.
#[derive(FromPyObject)]
pub(crate) enum Form<'py> {
    Weak(PyRef<'py, WeakForm>),
    Strong(PyRef<'py, StrongForm>),
}

impl Form<'_> {
    /// The settings of one record.
    fn of(&self, record: usize) -> PyResult<Method<'_>> {
        match self {
            Self::Weak(form) => {
                let settings = form.settings.get(record).cloned();
                settings
                    .map(Method::Weak)
                    .ok_or_else(|| PyValueError::new_err("weak form needs settings of every record"))
            }
            Self::Strong(form) => Ok(Method::Strong(form.settings())),
        }
    }
}

/// Identifies every record. `kinds` holds one word an unknown, `lag` the samples by which the torque of each record comes late (None: estimate
/// it), `angle_zero` the angle about which each spring is relaxed (None: zero, unless the record contradicts that), `masks` one mask a record, `weights` a weight
/// for every sample of every record (those of weight zero must be missing), `instrument` a channel a record that noise does not reach, `wanted` the
/// first sample that numbers are wanted at and the one after the last.
#[pyfunction]
#[pyo3(signature = (
    motions, kinds, method, *, delta, lag, angle_zero=None, quantisation=None, masks=None, weights=None, propagate=false, step=1, wanted=None, diagnose=true, instrument=None, workers=None, progress=None
))]
pub(crate) fn identify<'py>(
    py: Python<'py>,
    motions: &Motions,
    kinds: Vec<String>,
    method: Form<'py>,
    delta: f64,
    lag: Vec<Option<f64>>,
    angle_zero: Option<Vec<Option<f64>>>,
    quantisation: Option<f64>,
    masks: Option<Vec<Bound<'py, PyUntypedArray>>>,
    weights: Option<&Bound<'py, PyUntypedArray>>,
    propagate: bool,
    step: usize,
    wanted: Option<(usize, usize)>,
    diagnose: bool,
    instrument: Option<&Bound<'py, PyUntypedArray>>,
    workers: Option<NonZeroUsize>,
    progress: Option<&Bound<'py, PyAny>>,
) -> PyResult<Vec<Identification>> {
    let options = Options {
        delta,
        kinds: kinds_of(&kinds)?,
        quantisation,
        propagate,
        step,
        wanted: wanted.map(|(first, end)| first..end),
        diagnose,
        instructions: Instructions::current(),
    };
    let beside = Beside::new(masks, weights)?;
    let tasks = tasks(motions, lag.into_iter(), angle_zero, &beside, |record| method.of(record))?;
    let instruments = instrument.map(records).transpose()?;
    let mut found: Vec<(Found, Option<InstrumentTest>)> = Vec::new();
    watched(py, progress, |watch| {
        let workers = threads(workers);
        found = match &instruments {
            Some(instruments) => {
                let pairs: Vec<_> = tasks.into_iter().zip(instruments.iter().map(|one| one as &dyn Samples)).collect();
                let found = identify_with_instruments(&pairs, &options, workers, watch)?;
                found.into_iter().map(|(found, test)| (found, Some(test))).collect()
            }
            None => identify_all(&tasks, &options, workers, watch)?.into_iter().map(|found| (found, None)).collect(),
        };
        Ok(())
    })?;
    found.into_iter().map(|(found, test)| Identification::new(py, found, test)).collect()
}

/// Kinds by their names.
fn kinds_of(names: &[String]) -> PyResult<Vec<Kind>> {
    let of = |name: &String| kind(name).ok_or_else(|| PyValueError::new_err(format!("no kind is called {name:?}")));
    names.iter().map(of).collect()
}

/// Masks and weights of records. They may be written by other threads while the interpreter's lock is away, so they are copied.
struct Beside {
    masks: Option<Vec<Vec<bool>>>,
    weights: Option<Vec<Vec<f64>>>,
}

impl Beside {
    fn new(
        masks: Option<Vec<Bound<'_, PyUntypedArray>>>,
        weights: Option<&Bound<'_, PyUntypedArray>>,
    ) -> PyResult<Self> {
        let masks = masks.map(|masks| masks.iter().map(flags).collect()).transpose()?;
        Ok(Self { masks, weights: weights.map(copied).transpose()? })
    }
}

/// One task a record.
fn tasks<'a>(
    motions: &'a Motions,
    mut lag: impl Iterator<Item = Option<f64>>,
    angle_zero: Option<Vec<Option<f64>>>,
    beside: &'a Beside,
    method: impl Fn(usize) -> PyResult<Method<'a>>,
) -> PyResult<Vec<Task<'a>>> {
    let task = |(record, motion): (usize, Motion<'a>)| {
        let lag = lag.next().ok_or_else(|| PyValueError::new_err("every record needs a lag"))?;
        let mask = beside.masks.as_ref().and_then(|masks| masks.get(record)).map(Vec::as_slice);
        let angle_zero = angle_zero.as_ref().and_then(|zeros| zeros.get(record).copied().flatten());
        let weights = match beside.weights.as_ref().map(|weights| weights.get(record)) {
            Some(Some(one)) if one.len() == motion.angle.len() => Some(one.as_slice()),
            Some(_) => return Err(PyValueError::new_err("every sample of every record needs a weight")),
            None => None,
        };
        Ok(Task { motion, mask, weights, method: method(record)?, lag, angle_zero })
    };
    motions.all()?.into_iter().enumerate().map(task).collect()
}
