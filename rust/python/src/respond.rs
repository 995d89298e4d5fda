//! `tvident._core.respond`: the response of systems to a torque.

use std::num::NonZeroUsize;

use numpy::{PyArrayDyn, PyArrayMethods, PyUntypedArray};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use tvident::equation::BuiltInTerm;
use tvident::exec::workers as threads;
use tvident::record::Samples;
use tvident::response::{Begins, Factor, Span, System, SystemTerm, respond as core_respond};

use crate::arrays::zeros;
use crate::records::{StridedSamples, records};
use crate::watch::watched;

/// The response of every record: angles and velocities by record and sample, and where a response was lost.
#[pyclass(frozen, get_all, module = "tvident._core")]
pub(crate) struct Responses {
    angle: Py<PyArrayDyn<f64>>,
    velocity: Py<PyArrayDyn<f64>>,
    lost: Vec<Option<usize>>,
}

/// A factor of the equation of motion of every record.
enum Held {
    Number(f64),
    Records(Vec<StridedSamples>),
}

impl Held {
    fn new(given: &Bound<'_, PyAny>) -> PyResult<Self> {
        match given.cast::<PyUntypedArray>() {
            Ok(array) => records(array).map(Self::Records),
            Err(_) => given.extract().map(Self::Number),
        }
    }

    fn of(&self, record: usize) -> PyResult<Factor<'_>> {
        match self {
            Self::Number(number) => Ok(Factor::Number(*number)),
            Self::Records(records) => one(records, record).map(Factor::Record),
        }
    }
}

/// A term by its name; that with an inner parameter knows it of every record.
enum Named {
    BuiltIn(&'static BuiltInTerm),
    Stribeck(Vec<f64>),
}

impl Named {
    fn of(&self, record: usize) -> PyResult<SystemTerm> {
        match self {
            Self::BuiltIn(term) => Ok(SystemTerm::BuiltIn(term)),
            Self::Stribeck(velocities) => match velocities.get(record) {
                Some(&velocity) => Ok(SystemTerm::Stribeck { velocity }),
                None => Err(PyValueError::new_err("every record needs a Stribeck velocity")),
            },
        }
    }
}

/// Simulates every record of a torque. Coefficients and the factors of terms are numbers or arrays of the torque's shape. `stribeck` is the
/// Stribeck velocity of every record, for the term of that name. The state of each
/// record's beginning is given as angle and velocity in `initial`, or estimated from `angle`. `spans` are stretches that begin in a state of
/// their own: first sample, end of what tells the state, end.
#[pyfunction]
#[pyo3(signature = (coefficients, terms, torque, *, delta, lag, bridged, angle=None, initial=None, spans=None, stribeck=None, workers=None))]
pub(crate) fn respond<'py>(
    py: Python<'py>,
    coefficients: [Bound<'py, PyAny>; 3],
    terms: Vec<(String, Bound<'py, PyAny>)>,
    torque: &Bound<'py, PyUntypedArray>,
    delta: f64,
    lag: Vec<f64>,
    bridged: usize,
    angle: Option<&Bound<'py, PyUntypedArray>>,
    initial: Option<Vec<[f64; 2]>>,
    spans: Option<Vec<[usize; 3]>>,
    stribeck: Option<Vec<f64>>,
    workers: Option<NonZeroUsize>,
) -> PyResult<Responses> {
    let [inertia, damping, stiffness] = &coefficients;
    let held = [Held::new(inertia)?, Held::new(damping)?, Held::new(stiffness)?];
    let named = |(name, factor): &(String, Bound<'py, PyAny>)| {
        let term = match (BuiltInTerm::named(name), &stribeck) {
            (Some(term), _) => Named::BuiltIn(term),
            (None, Some(velocities)) if name == "stribeck" => Named::Stribeck(velocities.clone()),
            _ => return Err(PyValueError::new_err(format!("no term is called {name:?}"))),
        };
        Ok((term, Held::new(factor)?))
    };
    let terms = terms.iter().map(named).collect::<PyResult<Vec<_>>>()?;
    let torques = records(torque)?;
    let angles = angle.map(records).transpose()?;
    let mut tasks = Vec::new();
    for record in 0..torques.len() {
        let [inertia, damping, stiffness] = &held;
        let system = System {
            coefficients: [inertia.of(record)?, damping.of(record)?, stiffness.of(record)?],
            terms: terms
                .iter()
                .map(|(term, factor)| Ok((term.of(record)?, factor.of(record)?)))
                .collect::<PyResult<_>>()?,
            torque: one(&torques, record)?,
            lag: *lag.get(record).ok_or_else(|| PyValueError::new_err("every record needs a lag"))?,
            delta,
            bridged,
        };
        let begins = match (&angles, initial.as_ref().and_then(|initial| initial.get(record))) {
            (_, Some(state)) => Begins::In(*state),
            (Some(angles), None) => Begins::As(one(angles, record)?),
            _ => return Err(PyValueError::new_err("every record needs an angle or an initial state")),
        };
        tasks.push((system, begins));
    }
    let spans = spans.map(|spans| {
        let each = spans.into_iter();
        each.map(|[begin, known, end]| Span { samples: begin..end, known: known - begin }).collect::<Vec<_>>()
    });
    let mut found = Vec::new();
    watched(py, None, |watch| {
        found = core_respond(&tasks, spans.as_deref(), threads(workers), watch)?;
        Ok(())
    })?;
    let shape = [found.len(), torques.first().map_or(0, Samples::len)];
    let (angle, velocity) = (zeros::<f64>(py, &shape)?, zeros::<f64>(py, &shape)?);
    {
        let (mut angle, mut velocity) = (angle.readwrite(), velocity.readwrite());
        let rows = angle.as_slice_mut()?.chunks_exact_mut(shape[1].max(1));
        for ((angle, velocity), one) in rows.zip(velocity.as_slice_mut()?.chunks_exact_mut(shape[1].max(1))).zip(&found)
        {
            angle.copy_from_slice(&one.angle);
            velocity.copy_from_slice(&one.velocity);
        }
    }
    let lost = found.iter().map(|one| one.lost).collect();
    Ok(Responses { angle: angle.unbind(), velocity: velocity.unbind(), lost })
}

/// The samples that belong to one record.
fn one(records: &[StridedSamples], record: usize) -> PyResult<&dyn Samples> {
    let found = records.get(record).map(|samples| samples as &dyn Samples);
    found.ok_or_else(|| PyValueError::new_err("torque, angle and parameters need as many records as each other"))
}
