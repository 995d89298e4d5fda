//! `tvident._core.identify_weak`.

use std::num::NonZeroUsize;

use numpy::{PyArray1, PyReadonlyArray1};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use tvident::exec::workers as threads;
use tvident::identify::{Constant, Kind, Outside, SampleResults, WeakIdentified, WeakOptions, identify_weak as weak};
use tvident::inference::Missing;
use tvident::simd::Instructions;

use crate::identification::Motions;
use crate::watch::watched;

/// Identifies one of several records in weak form. What is None is chosen from the record; `kinds` holds one word an unknown.
#[pyfunction]
#[pyo3(signature = (
    motions, record, kinds, *, delta, half_width=None, exponent=None, equations=None, average=true, linear=true, noise=(None, None),
    lag=None, quantisation=None, mask=None, step=1, not_missing=None, workers=None, progress=None
))]
pub(crate) fn identify_weak<'py>(
    py: Python<'py>,
    motions: &Motions,
    record: usize,
    kinds: Vec<String>,
    delta: f64,
    half_width: Option<usize>,
    exponent: Option<usize>,
    equations: Option<usize>,
    average: bool,
    linear: bool,
    noise: (Option<f64>, Option<f64>),
    lag: Option<f64>,
    quantisation: Option<f64>,
    mask: Option<PyReadonlyArray1<'py, bool>>,
    step: usize,
    not_missing: Option<Vec<String>>,
    workers: Option<NonZeroUsize>,
    progress: Option<&Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyDict>> {
    let missing = |name: &String| MISSING.iter().find(|(_, one)| one == name).map(|(missing, _)| *missing);
    let options = WeakOptions {
        delta,
        half_width,
        exponent,
        equations,
        average,
        linear,
        kinds: kinds.iter().map(|name| kind(name)).collect::<PyResult<_>>()?,
        noise: [noise.0, noise.1],
        lag,
        quantisation,
        step,
        diagnose: not_missing.is_some(),
        not_missing: not_missing.unwrap_or_default().iter().filter_map(missing).collect(),
        instructions: Instructions::current(),
    };
    let motion = motions.motion(record)?;
    let mask = mask.map(|mask| mask.as_array().to_vec());
    let mut found = None;
    watched(py, progress, |watch| {
        found = Some(weak(&motion, mask.as_deref(), &options, threads(workers), watch)?);
        Ok(())
    })?;
    let found = found.ok_or_else(|| PyValueError::new_err("nothing was found"))?;
    dictionary(py, found)
}

/// Names of what may have been left out.
const MISSING: [(Missing, &str); 4] =
    [(Missing::Offset, "offset"), (Missing::Coulomb, "coulomb"), (Missing::Cubic, "cubic"), (Missing::Lag, "lag")];

/// What was found, by name.
fn dictionary(py: Python<'_>, found: WeakIdentified) -> PyResult<Bound<'_, PyDict>> {
    let dict = PyDict::new(py);
    dict.set_item("half_width", found.function.half_width())?;
    dict.set_item("exponent", found.function.exponent())?;
    dict.set_item("noise", (found.noise[0], found.noise[1]))?;
    dict.set_item("equations", found.equations)?;
    dict.set_item("lengths", found.lengths)?;
    dict.set_item("prediction_error", found.prediction_error)?;
    dict.set_item("weighted", found.weighted)?;
    dict.set_item("pooling", found.pooling)?;
    dict.set_item("constants", constants(&found.constants))?;
    dict.set_item("covariance", found.covariance)?;
    dict.set_item("condition", found.condition)?;
    dict.set_item("weakest", found.weakest)?;
    dict.set_item("mostly_noise", found.mostly_noise)?;
    let name = |missing: Missing| MISSING.iter().find(|(one, _)| *one == missing).map_or("", |(_, name)| name);
    let suspects: Vec<_> = found
        .suspects
        .iter()
        .map(|suspect| (name(suspect.missing), suspect.value, suspect.error, suspect.is_conspicuous()))
        .collect();
    dict.set_item("suspects", suspects)?;
    dict.set_item("lag", found.lag.map(|lag| (lag.value, lag.error)))?;
    let outside = found.outside_mask.filter(Outside::fails);
    dict.set_item("outside_mask", outside.map(|outside| (outside.differing, outside.left)))?;
    dict.set_item("jumps", found.jumps)?;
    dict.set_item("constant_pairs", found.constant_pairs)?;
    add_results(&dict, found.changing, found.pairs, found.results)?;
    Ok(dict)
}

/// Adds what changes, sample by sample.
pub(crate) fn add_results(
    dict: &Bound<'_, PyDict>,
    changing: Vec<usize>,
    pairs: Vec<(usize, usize)>,
    results: SampleResults,
) -> PyResult<()> {
    let py = dict.py();
    let rows = |columns: Vec<Vec<f64>>| columns.into_iter().map(|one| PyArray1::from_vec(py, one)).collect::<Vec<_>>();
    dict.set_item("changing", changing)?;
    dict.set_item("pairs", pairs)?;
    dict.set_item("values", rows(results.values))?;
    dict.set_item("errors", rows(results.errors))?;
    dict.set_item("covariances", rows(results.covariances))?;
    dict.set_item("deviations", PyArray1::from_vec(py, results.deviation))?;
    dict.set_item("conditions", PyArray1::from_vec(py, results.condition))?;
    dict.set_item("status", PyArray1::from_vec(py, results.status))?;
    Ok(())
}

/// A kind by its name.
pub(crate) fn kind(name: &str) -> PyResult<Kind> {
    match name {
        "windowed" => Ok(Kind::Windowed),
        "constant" => Ok(Kind::Constant),
        "auto" => Ok(Kind::Tested),
        "varying" => Ok(Kind::Varying),
        _ => Err(PyValueError::new_err(format!("no kind is called {name:?}"))),
    }
}

/// What is known of a constant: which unknown, its value and standard error, and its test.
pub(crate) type Known = (usize, f64, f64, Option<(f64, f64)>);

/// Constants as tuples.
pub(crate) fn constants(found: &[Constant]) -> Vec<Known> {
    let test = |one: &Constant| one.test.as_ref().map(|test| (test.probability, test.spread));
    found.iter().map(|one| (one.unknown, one.value, one.error, test(one))).collect()
}
