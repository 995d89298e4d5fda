//! `tvident._core.identify` and the two forms that it takes.

use std::num::NonZeroUsize;

use numpy::PyUntypedArray;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use tvident::exec::workers as threads;
use tvident::identify::{
    Identification as Found, InstrumentTest, Kind, Method, Options, StrongForm as Strong, Task, WeakForm as Weak,
    identify_all, identify_with_instruments,
};
use tvident::record::Samples;
use tvident::simd::Instructions;

use crate::identified::{Identification, kind};
use crate::local_polynomials::LocalPolynomials;
use crate::motions::Motions;
use crate::records::{flags, records};
use crate::watch::watched;

/// Settings of the weak form, one of each a record. What is None is chosen from the record.
#[pyclass(frozen, module = "tvident._core")]
pub(crate) struct WeakForm {
    settings: Vec<Weak>,
}

#[pymethods]
impl WeakForm {
    #[new]
    #[pyo3(signature = (window_length, exponent, regression_window, *, averaging=true, linear=true, noise=(None, None), shown_noise=None))]
    fn new(
        window_length: Vec<Option<usize>>,
        exponent: Vec<Option<usize>>,
        regression_window: Vec<Option<usize>>,
        averaging: bool,
        linear: bool,
        noise: (Option<f64>, Option<f64>),
        shown_noise: Option<Vec<f64>>,
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
            Self::Strong(form) => Ok(Method::Strong(Strong {
                derivatives: form.plan.get().plan(),
                regression_window: form.regression_window,
                filter_torque: form.filter_torque,
                linear: form.linear,
            })),
        }
    }
}

/// Identifies every record. `kinds` holds one word an unknown, `lag` the samples by which the torque of each record comes late (None: estimate
/// it), `angle_zero` the angle about which each spring is relaxed (None: zero, unless the record contradicts that), `masks` one mask a record, `instrument` a channel a record that noise does not reach.
#[pyfunction]
#[pyo3(signature = (
    motions, kinds, method, *, delta, lag, angle_zero=None, quantisation=None, masks=None, propagate=false, step=1, diagnose=true, instrument=None, workers=None, progress=None
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
    propagate: bool,
    step: usize,
    diagnose: bool,
    instrument: Option<&Bound<'py, PyUntypedArray>>,
    workers: Option<NonZeroUsize>,
    progress: Option<&Bound<'py, PyAny>>,
) -> PyResult<Vec<Identification>> {
    let kind = |name: &String| kind(name).ok_or_else(|| PyValueError::new_err(format!("no kind is called {name:?}")));
    let options = Options {
        delta,
        kinds: kinds.iter().map(kind).collect::<PyResult<Vec<Kind>>>()?,
        quantisation,
        propagate,
        step,
        diagnose,
        instructions: Instructions::current(),
    };
    // A mask may be written by other threads while the interpreter's lock is away.
    let masks = masks.map(|masks| masks.iter().map(flags).collect::<PyResult<Vec<_>>>()).transpose()?;
    let mut tasks = Vec::new();
    for (record, motion) in motions.all()?.into_iter().enumerate() {
        let lag = *lag.get(record).ok_or_else(|| PyValueError::new_err("every record needs a lag"))?;
        let mask = masks.as_ref().and_then(|masks| masks.get(record)).map(Vec::as_slice);
        let angle_zero = angle_zero.as_ref().and_then(|zeros| zeros.get(record).copied().flatten());
        tasks.push(Task { motion, mask, method: method.of(record)?, lag, angle_zero });
    }
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
