//! `tvident._core.identify_strong`.

use std::num::NonZeroUsize;

use numpy::{PyArray1, PyReadonlyArray1};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use tvident::exec::workers as threads;
use tvident::identify::{StrongOptions, identify_strong as strong};

use crate::identification::Motions;
use crate::local_polynomials::LocalPolynomials;
use crate::watch::watched;
use crate::weak_identification::{add_results, constants, kind};

/// Identifies one of several records in strong form; `kinds` holds one word an unknown.
#[pyfunction]
#[pyo3(signature = (
    plan, motions, record, kinds, *, equations, linear=false, filter_torque=false, lag=0.0, mask=None, step=1, workers=None,
    progress=None
))]
pub(crate) fn identify_strong<'py>(
    py: Python<'py>,
    plan: &LocalPolynomials,
    motions: &Motions,
    record: usize,
    kinds: Vec<String>,
    equations: usize,
    linear: bool,
    filter_torque: bool,
    lag: f64,
    mask: Option<PyReadonlyArray1<'py, bool>>,
    step: usize,
    workers: Option<NonZeroUsize>,
    progress: Option<&Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyDict>> {
    let kinds = kinds.iter().map(|name| kind(name)).collect::<PyResult<_>>()?;
    let options = StrongOptions { equations, linear, kinds, filter_torque, lag, step };
    let motion = motions.motion(record)?;
    let mask = mask.map(|mask| mask.as_array().to_vec());
    let mut found = None;
    watched(py, progress, |watch| {
        found = Some(strong(plan.plan(), &motion, mask.as_deref(), &options, threads(workers), watch)?);
        Ok(())
    })?;
    let found = found.ok_or_else(|| PyValueError::new_err("nothing was found"))?;
    let dict = PyDict::new(py);
    dict.set_item("constants", constants(&found.constants))?;
    dict.set_item("condition", found.condition)?;
    dict.set_item("order", PyArray1::from_vec(py, found.order))?;
    add_results(&dict, found.changing, found.pairs, found.results)?;
    Ok(dict)
}
