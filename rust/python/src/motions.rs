//! `tvident._core.Motions`: the equation of motion of every record of some arrays.

use numpy::PyUntypedArray;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use tvident::equation::{BuiltInTerm, Coefficient, Measured, Motion, Term};
use tvident::noise::{AngleNoise, Beside, PassedNoise as Passed};
use tvident::record::{Placed, Samples};

use crate::irregular::PassedNoise;
use crate::records::{StridedSamples, placed};

/// A coefficient of the equation of motion, or a term of it.
enum Held {
    Unknown,
    Number(f64),
    Records(Vec<Placed<StridedSamples>>),
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

/// The variance of the first channel that an angle was made of, how often that was integrated, and which derivatives were fused with it, each with
/// its noise.
type NoiseOfAngle = (f64, usize, Vec<(usize, f64)>);

/// The equation of motion of every record of some arrays, which have time along their last axis.
#[pyclass(frozen, module = "tvident._core")]
pub(crate) struct Motions {
    angles: Vec<Placed<StridedSamples>>,
    torques: Vec<Placed<StridedSamples>>,
    /// What was recorded of the motion, where the angle was made of it, and its noise.
    channels: [Option<Vec<Placed<StridedSamples>>>; 3],
    noises: Option<Vec<AngleNoise>>,
    /// What noise of variance one became where angle and torque were resampled.
    passed: [Option<Passed>; 2],
    coefficients: [Held; 3],
    terms: Vec<Held>,
    /// Keeps the memory of all of them.
    _arrays: Vec<Py<PyAny>>,
}

#[pymethods]
impl Motions {
    /// Coefficients are unknown (None), a number, or an array; terms are a name or an array. Where the angle was made of the recorded channels
    /// (angle, velocity, acceleration), `noise` holds for every record the variance of the first of them, how often that was integrated, and
    /// which derivatives were fused with it, with their noise. Where arrays hold parts of longer records, `parts` says which samples, one after the
    /// other, and `samples` how many a record has. `passed` is what noise became where angle and torque were resampled.
    #[new]
    #[pyo3(signature = (angle, torque, coefficients, terms, *, channels=[None, None, None], noise=None, parts=None, samples=0, passed=(None, None)))]
    fn new(
        angle: &Bound<'_, PyUntypedArray>,
        torque: &Bound<'_, PyUntypedArray>,
        coefficients: [Bound<'_, PyAny>; 3],
        terms: Vec<Bound<'_, PyAny>>,
        channels: [Option<Bound<'_, PyUntypedArray>>; 3],
        noise: Option<Vec<NoiseOfAngle>>,
        parts: Option<Vec<(usize, usize)>>,
        samples: usize,
        passed: (Option<Bound<'_, PassedNoise>>, Option<Bound<'_, PassedNoise>>),
    ) -> PyResult<Self> {
        let records = |array: &Bound<'_, PyUntypedArray>| placed(array, parts.as_deref(), samples);
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
        let measured = channels.iter().flatten().map(Bound::as_any);
        let arrays = [angle.as_any(), torque.as_any()].into_iter().chain(&coefficients).chain(&terms).chain(measured);
        let [recorded, velocity, acceleration] =
            channels.each_ref().map(|channel| channel.as_ref().map(records).transpose());
        let noises = noise.map(|noise| noise.into_iter().map(angle_noise).collect());
        Ok(Self {
            angles: records(angle)?,
            torques: records(torque)?,
            channels: [recorded?, velocity?, acceleration?],
            noises,
            passed: <[_; 2]>::from(passed).map(|passed| passed.map(|passed| passed.get().0.clone())),
            coefficients: [held(inertia)?, held(damping)?, held(stiffness)?],
            terms: terms.iter().map(held).collect::<PyResult<_>>()?,
            _arrays: arrays.map(|array| array.clone().unbind()).collect(),
        })
    }
}

impl Motions {
    /// The equation of motion of one record.
    fn motion<'a>(&'a self, record: usize) -> PyResult<Motion<'a>> {
        let [inertia, damping, stiffness] = &self.coefficients;
        let measured = |channel: &'a Option<Vec<Placed<StridedSamples>>>| {
            channel.as_ref().map(|channel| one(channel, record)).transpose()
        };
        let [angle, velocity, acceleration] = &self.channels;
        Ok(Motion {
            angle: one(&self.angles, record)?,
            measured: Measured {
                channels: [measured(angle)?, measured(velocity)?, measured(acceleration)?],
                noise: self.noises.as_ref().and_then(|noises| noises.get(record)),
                passed: self.passed.each_ref().map(Option::as_ref),
            },
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

/// What is known of the noise of an angle.
fn angle_noise((variance, integrations, beside): NoiseOfAngle) -> AngleNoise {
    let beside = beside.into_iter().map(|(derivative, noise)| Beside { derivative, noise }).collect();
    AngleNoise { variance, integrations, beside }
}

/// The samples that belong to one record.
fn one(records: &[Placed<StridedSamples>], record: usize) -> PyResult<&dyn Samples> {
    let found = records.get(record).map(|samples| samples as &dyn Samples);
    found.ok_or_else(|| {
        PyValueError::new_err("angle, torque, known parameters and terms need as many records as each other")
    })
}
