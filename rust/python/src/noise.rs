//! The noise and the quantisation of channels.

use numpy::{PyArray1, PyUntypedArray};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use tvident::Error;
use tvident::exec::Watch;
use tvident::noise::{
    Beside, break_counts as core_break_counts, fuse as core_fuse, noise as core_noise, noise_after,
    noise_coherence as core_coherence, quantisation_step as core_step, searched, spike_counts as core_spike_counts,
    unread_counts as core_unread_counts,
};
use tvident::record::Samples;
use tvident::simd::Instructions;

use crate::irregular::PassedNoise;
use crate::records::{placed, records};
use crate::watch::watched;

/// Records between two looks at the watch: each takes well below a millisecond.
const RECORDS: usize = 100;

/// The noise of one record: its standard deviation, and the step that samples were rounded to.
#[pyclass(frozen, get_all, module = "tvident._core")]
pub(crate) struct Noise {
    sigma: f64,
    quantisation: f64,
}

/// The noise of every record along the last axis, in the order of the leading axes. The quantisation is looked for where it is not given. Where records
/// were resampled, as `passed` was, it is the noise that rows see: its density at low frequencies. With weights, those of every sample, it is that
/// of a sample of weight one.
#[pyfunction]
#[pyo3(signature = (samples, quantisation=None, passed=None, weights=None))]
pub(crate) fn noise(
    samples: &Bound<'_, PyUntypedArray>,
    quantisation: Option<f64>,
    passed: Option<&PassedNoise>,
    weights: Option<&Bound<'_, PyUntypedArray>>,
) -> PyResult<Vec<Noise>> {
    let records = records(samples)?;
    let weights = weights.map(values).transpose()?;
    let weights = weights.as_deref();
    if weights.is_some_and(|weights| records.iter().any(|record| record.len() != weights.len())) {
        return Err(PyValueError::new_err("there must be as many weights as samples"));
    }
    let instructions = Instructions::current();
    let mut noises = Vec::new();
    watched(samples.py(), None, |watch| {
        for (done, record) in records.iter().enumerate() {
            let found = match passed {
                Some(passed) => noise_after(&passed.0, record, weights, quantisation, instructions)?,
                None => core_noise(record, weights, quantisation, instructions)?,
            };
            noises.push(Noise { sigma: found.sigma, quantisation: found.quantisation });
            if !watch(done, records.len()) {
                return Err(Error::Cancelled);
            }
        }
        Ok::<(), Error>(())
    })?;
    Ok(noises)
}

/// The most likely motion from a record and its derivatives: which each is, and its noise over the record's in the unit of a sample.
#[pyfunction]
pub(crate) fn fuse(
    py: Python<'_>,
    record: &Bound<'_, PyUntypedArray>,
    others: Vec<(usize, f64, Bound<'_, PyUntypedArray>)>,
    delta: f64,
) -> PyResult<Py<PyArray1<f64>>> {
    let first = values(record)?;
    let derivatives: Vec<Beside> = others.iter().map(|&(derivative, noise, _)| Beside { derivative, noise }).collect();
    let values: Vec<Vec<f64>> = others.iter().map(|(_, _, other)| values(other)).collect::<PyResult<_>>()?;
    if values.iter().any(|other| other.len() != first.len()) {
        return Err(PyValueError::new_err("channels of a motion need as many samples as each other"));
    }
    let pairs: Vec<(Beside, &[f64])> = derivatives.into_iter().zip(values.iter().map(Vec::as_slice)).collect();
    let fused = py.detach(|| core_fuse(&first, &pairs, delta));
    Ok(PyArray1::from_vec(py, fused).unbind())
}

/// The samples of a single record.
fn values(record: &Bound<'_, PyUntypedArray>) -> PyResult<Vec<f64>> {
    let records = records(record)?;
    let [one] = &records[..] else { return Err(PyValueError::new_err("one record is fused at a time")) };
    let mut values = vec![0.0; one.len()];
    one.read(0, &mut values);
    Ok(values)
}

/// The smallest quantisation step of the records along the last axis, zero where one of them has none.
///
/// Where they hold parts of longer records, `parts` says which samples, and `of` how many there are.
#[pyfunction]
#[pyo3(signature = (samples, *, parts=None, of=0))]
pub(crate) fn quantisation_step(
    samples: &Bound<'_, PyUntypedArray>,
    parts: Option<Vec<(usize, usize)>>,
    of: usize,
) -> PyResult<f64> {
    let records = placed(samples, parts.as_deref(), of)?;
    let mut least = f64::INFINITY;
    watched(samples.py(), None, |watch| {
        for (done, record) in records.iter().enumerate() {
            least = least.min(core_step(record));
            if least == 0.0 {
                break;
            }
            if done % RECORDS == RECORDS - 1 && !watch(done, records.len()) {
                return Err(Error::Cancelled);
            }
        }
        Ok(())
    })?;
    Ok(if records.is_empty() { 0.0 } else { least })
}

/// The parts of a record of so many samples that its quantisation step is found in.
#[pyfunction]
pub(crate) fn parts_of_quantisation(samples: usize) -> Vec<(usize, usize)> {
    searched(samples).map(|part| (part.start, part.end)).collect()
}

/// The coherence of the noise of angle and torque of every record, above the motion; `variances` are those of the angles' noise, `inertias` over
/// the square of the sample period, or 0 where they are not known, `lags` those of the torques in samples.
#[pyfunction]
pub(crate) fn noise_coherence(
    angle: &Bound<'_, PyUntypedArray>,
    torque: &Bound<'_, PyUntypedArray>,
    variances: Vec<f64>,
    inertias: Vec<f64>,
    lags: Vec<f64>,
) -> PyResult<Vec<Option<f64>>> {
    let (angles, torques) = (records(angle)?, records(torque)?);
    let mut found = Vec::new();
    watched(angle.py(), None, |watch| {
        let motions = inertias.into_iter().zip(lags);
        for (((angle, torque), variance), motion) in angles.iter().zip(&torques).zip(variances).zip(motions) {
            found.push(core_coherence(angle, torque, variance, motion));
            if !watch(found.len(), angles.len()) {
                return Err(Error::Cancelled);
            }
        }
        Ok::<(), Error>(())
    })?;
    Ok(found)
}

/// At how many places the angle of every record jumps between two samples; none of the torque.
#[pyfunction]
pub(crate) fn break_counts(
    angle: &Bound<'_, PyUntypedArray>,
    torque: &Bound<'_, PyUntypedArray>,
) -> PyResult<Vec<[usize; 2]>> {
    counted(angle, torque, core_break_counts)
}

/// How many samples of the angle and of the torque of every record stand far out of calm neighbours.
#[pyfunction]
pub(crate) fn spike_counts(
    angle: &Bound<'_, PyUntypedArray>,
    torque: &Bound<'_, PyUntypedArray>,
) -> PyResult<Vec<[usize; 2]>> {
    counted(angle, torque, core_spike_counts)
}

/// How many samples of the angle and of the torque of every record hold one value in place of a reading that failed.
#[pyfunction]
pub(crate) fn unread_counts(
    angle: &Bound<'_, PyUntypedArray>,
    torque: &Bound<'_, PyUntypedArray>,
) -> PyResult<Vec<[usize; 2]>> {
    counted(angle, torque, core_unread_counts)
}

fn counted(
    angle: &Bound<'_, PyUntypedArray>,
    torque: &Bound<'_, PyUntypedArray>,
    count: impl Fn(&dyn Samples, &dyn Samples, &mut Watch<'_>) -> Result<[usize; 2], Error> + Sync,
) -> PyResult<Vec<[usize; 2]>> {
    let (angles, torques, mut counts) = (records(angle)?, records(torque)?, Vec::new());
    watched(angle.py(), None, |watch| {
        for (angle, torque) in angles.iter().zip(&torques) {
            counts.push(count(angle, torque, watch)?);
        }
        Ok::<(), Error>(())
    })?;
    Ok(counts)
}
