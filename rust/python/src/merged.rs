//! `tvident._core.identify_merged`: repeated trials and coupled masses.

use std::collections::HashMap;
use std::num::NonZeroUsize;

use numpy::{PyArray1, PyReadonlyArray1, PyUntypedArray};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use tvident::Status;
use tvident::exec::workers as threads;
use tvident::identify::{
    Element, Entry, FoundElement as Found, Merged, MergedFound, MergedOptions, Multiplied, SuspectedTerm, Trial,
    identify_merged as run,
};
use tvident::inference::Suspect;
use tvident::record::Samples;
use tvident::simd::Instructions;

use crate::identified::{ChannelDefect, ConstancyTest, Estimate, Scan, TriedLength, kind, name, tried};
use crate::records::{StridedSamples, flags, records};
use crate::watch::watched;

/// What was found of one element.
#[pyclass(frozen, get_all, module = "tvident._core")]
pub(crate) struct MergedElement {
    element: usize,
    kind: &'static str,
    values: Py<PyArray1<f64>>,
    stderr: Py<PyArray1<f64>>,
    test: Option<ConstancyTest>,
    spread: Vec<Estimate>,
}

/// What was found of everything.
#[pyclass(frozen, get_all, module = "tvident._core")]
pub(crate) struct MergedIdentification {
    window_length: usize,
    exponent: usize,
    regression_window: usize,
    lengths: Vec<TriedLength>,
    prediction_error: f64,
    misfit: f64,
    changes_in_common: bool,
    noise: (Vec<f64>, Vec<f64>),
    colours: Vec<f64>,
    elements: Vec<Py<MergedElement>>,
    constants: Vec<usize>,
    covariance: Vec<f64>,
    covariances: HashMap<(usize, usize), Py<PyArray1<f64>>>,
    condition: f64,
    weakest: Vec<f64>,
    residual: Py<PyArray1<f64>>,
    status: Py<PyArray1<u16>>,
    record_status: u16,
    jumps: Vec<usize>,
    scan: Py<Scan>,
    defects: Vec<ChannelDefect>,
    late: Vec<(usize, Estimate)>,
    lacking: Vec<(usize, Estimate)>,
    terms: Vec<(usize, Option<usize>, &'static str, Estimate)>,
}

/// One trial: angles, torques and terms, one of each a row, a mask, positions in the result, and weights.
type GivenTrial<'py> = (
    Bound<'py, PyUntypedArray>,
    Bound<'py, PyUntypedArray>,
    Option<Bound<'py, PyUntypedArray>>,
    Option<Bound<'py, PyUntypedArray>>,
    Option<PyReadonlyArray1<'py, f64>>,
    Option<PyReadonlyArray1<'py, f64>>,
);

/// One element: its entries (equation, coefficient of the motion or None for a term, channel or term, factor), its value and its kind.
type GivenElement = (Vec<(usize, Option<usize>, usize, f64)>, Option<f64>, String);

/// The channels of a trial, read where they are.
struct Channels {
    angles: Vec<StridedSamples>,
    torques: Vec<StridedSamples>,
    terms: Vec<StridedSamples>,
    mask: Option<Vec<bool>>,
    position: Option<Vec<f64>>,
    weights: Option<Vec<f64>>,
}

impl Channels {
    fn new(given: &GivenTrial<'_>) -> PyResult<Self> {
        let (angles, torques, terms, mask, position, weights) = given;
        let terms = terms.as_ref().map(records).transpose()?.unwrap_or_default();
        let mask = mask.as_ref().map(flags).transpose()?;
        let [position, weights] = [position, weights].map(|one| one.as_ref().map(|one| one.as_array().to_vec()));
        let one = Self { angles: records(angles)?, torques: records(torques)?, terms, mask, position, weights };
        let samples = one.angles.first().map_or(0, Samples::len);
        let each = one.angles.iter().chain(&one.torques).chain(&one.terms).map(Samples::len);
        let numbers = one.position.iter().chain(&one.weights).map(Vec::len);
        let lengths = each.chain(one.mask.as_ref().map(Vec::len)).chain(numbers);
        if one.angles.is_empty() || one.torques.is_empty() || lengths.into_iter().any(|length| length != samples) {
            return Err(PyValueError::new_err("a trial needs an angle and a torque, and all its channels one length"));
        }
        Ok(one)
    }

    fn trial(&self) -> Trial<'_> {
        fn all(channels: &[StridedSamples]) -> Vec<&dyn Samples> {
            channels.iter().map(|one| one as &dyn Samples).collect()
        }
        Trial {
            angles: all(&self.angles),
            torques: all(&self.torques),
            terms: all(&self.terms),
            mask: self.mask.as_deref(),
            position: self.position.as_deref(),
            weights: self.weights.as_deref(),
        }
    }
}

fn element((entries, known, kind_name): GivenElement, first: &Trial<'_>) -> PyResult<Element> {
    let entry = |(equation, coefficient, place, factor): (usize, Option<usize>, usize, f64)| {
        let of = match coefficient {
            Some(coefficient) => Multiplied::Motion { channel: place, coefficient },
            None => Multiplied::Term(place),
        };
        let inside = match of {
            Multiplied::Motion { channel, coefficient } => channel < first.angles.len() && coefficient < 3,
            Multiplied::Term(term) => term < first.terms.len(),
        };
        if inside && equation < first.torques.len() {
            Ok(Entry { equation, of, factor })
        } else {
            Err(PyValueError::new_err("an element must refer to channels that exist"))
        }
    };
    let kind = kind(&kind_name).ok_or_else(|| PyValueError::new_err(format!("no kind is called {kind_name:?}")))?;
    Ok(Element { entries: entries.into_iter().map(entry).collect::<PyResult<_>>()?, known, kind })
}

/// Identifies what trials and masses share. `samples` is the length of the result.
#[pyfunction]
#[pyo3(signature = (
    trials, elements, samples, *, delta, window_length=None, exponent=None, regression_window=None, noise=None, step=1, workers=None, progress=None
))]
pub(crate) fn identify_merged<'py>(
    py: Python<'py>,
    trials: Vec<GivenTrial<'py>>,
    elements: Vec<GivenElement>,
    samples: usize,
    delta: f64,
    window_length: Option<usize>,
    exponent: Option<usize>,
    regression_window: Option<usize>,
    noise: Option<(Vec<f64>, Vec<f64>)>,
    step: usize,
    workers: Option<NonZeroUsize>,
    progress: Option<&Bound<'py, PyAny>>,
) -> PyResult<MergedIdentification> {
    let channels = trials.iter().map(Channels::new).collect::<PyResult<Vec<_>>>()?;
    let trials: Vec<Trial<'_>> = channels.iter().map(Channels::trial).collect();
    let Some(first) = trials.first() else { return Err(PyValueError::new_err("there must be a trial; got none")) };
    let shape = |trial: &Trial<'_>| [trial.angles.len(), trial.torques.len(), trial.terms.len()];
    if trials.iter().any(|trial| shape(trial) != shape(first)) {
        return Err(PyValueError::new_err("all trials must have the same channels"));
    }
    let levels = noise.as_ref().map(|(angles, torques)| [angles.len(), torques.len()]);
    if levels.is_some_and(|levels| levels != shape(first)[..2]) || step == 0 {
        return Err(PyValueError::new_err("every channel needs the variance of its noise, and step must be 1 or more"));
    }
    let elements = elements.into_iter().map(|one| element(one, first)).collect::<PyResult<_>>()?;
    let merged = Merged { trials, elements, samples };
    let options = MergedOptions {
        delta,
        window_length,
        exponent,
        regression_window,
        noise,
        step,
        instructions: Instructions::current(),
    };
    let mut found: Option<MergedFound> = None;
    watched(py, progress, |watch| {
        found = Some(run(&merged, &options, threads(workers), watch)?);
        Ok(())
    })?;
    let found = found.ok_or_else(|| PyValueError::new_err("nothing was identified"))?;
    let array = |values: Vec<f64>| PyArray1::from_vec(py, values).unbind();
    let one = |one: Found| {
        Py::new(
            py,
            MergedElement {
                element: one.element,
                kind: name(one.kind),
                values: array(one.values),
                stderr: array(one.stderr),
                test: one.test.map(ConstancyTest::from),
                spread: one.spread.into_iter().map(|(value, stderr)| Estimate { value, stderr }).collect(),
            },
        )
    };
    Ok(MergedIdentification {
        window_length: found.window_length,
        exponent: found.exponent,
        regression_window: found.regression_window,
        lengths: tried(&found.lengths),
        prediction_error: found.prediction_error,
        misfit: found.misfit,
        changes_in_common: found.changes_in_common,
        noise: found.noise,
        colours: found.colours,
        elements: found.elements.into_iter().map(one).collect::<PyResult<_>>()?,
        constants: found.constants,
        covariance: found.covariance,
        covariances: found.pairs.into_iter().zip(found.covariances.into_iter().map(array)).collect(),
        condition: found.condition,
        weakest: found.weakest,
        residual: array(found.residual),
        status: PyArray1::from_vec(py, found.status.into_iter().map(Status::bits).collect()).unbind(),
        record_status: found.record_status.bits(),
        jumps: found.jumps,
        scan: Scan::new(py, &found.scan)?,
        defects: found.defects.iter().map(|(channel, defect)| ChannelDefect::new(*channel, defect)).collect(),
        late: suspects(&found.late),
        lacking: suspects(&found.lacking),
        terms: found.terms.iter().map(term).collect(),
    })
}

/// A suspected term: the mass, what it moves against, the term's name and its factor.
fn term(one: &SuspectedTerm) -> (usize, Option<usize>, &'static str, Estimate) {
    (one.motion.mass, one.motion.against, one.suspect.missing.name(), estimate(&one.suspect))
}

/// What channels are suspected of, with standard errors.
fn suspects(found: &[(usize, Suspect)]) -> Vec<(usize, Estimate)> {
    found.iter().map(|(channel, one)| (*channel, estimate(one))).collect()
}

fn estimate(one: &Suspect) -> Estimate {
    Estimate { value: one.value, stderr: one.error }
}
