//! `tvident._core.Motions`: the equation of motion of every record of some arrays.

use numpy::PyUntypedArray;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use tvident::equation::{BuiltInTerm, Coefficient, Motion, Term};
use tvident::record::Samples;

use crate::records::{StridedSamples, records};

/// A coefficient of the equation of motion, or a term of it.
enum Held {
    Unknown,
    Number(f64),
    Records(Vec<StridedSamples>),
    BuiltIn(&'static BuiltInTerm),
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
            Self::BuiltIn(term) => Ok(Term::BuiltIn(term)),
            _ => Err(PyValueError::new_err("a term is a name or an array")),
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
            let name = given.extract::<&str>()?;
            let term = BuiltInTerm::named(name).map(Held::BuiltIn);
            term.ok_or_else(|| PyValueError::new_err(format!("no term is called {name:?}")))
        };
        let [inertia, damping, stiffness] = &coefficients;
        let arrays = [angle.as_any(), torque.as_any()].into_iter().chain(&coefficients).chain(&terms);
        Ok(Self {
            angles: records(angle)?,
            torques: records(torque)?,
            coefficients: [held(inertia)?, held(damping)?, held(stiffness)?],
            terms: terms.iter().map(held).collect::<PyResult<_>>()?,
            _arrays: arrays.map(|array| array.clone().unbind()).collect(),
        })
    }
}

impl Motions {
    /// The equation of motion of one record.
    fn motion(&self, record: usize) -> PyResult<Motion<'_>> {
        let [inertia, damping, stiffness] = &self.coefficients;
        Ok(Motion {
            angle: one(&self.angles, record)?,
            torque: one(&self.torques, record)?,
            coefficients: [inertia.coefficient(record)?, damping.coefficient(record)?, stiffness.coefficient(record)?],
            terms: self.terms.iter().map(|term| term.term(record)).collect::<PyResult<_>>()?,
        })
    }

    /// The equations of motion of all records.
    pub(crate) fn all(&self) -> PyResult<Vec<Motion<'_>>> {
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
