//! `tvident._core.sliding_velocity`: the velocity of records as friction needs it.

use std::num::NonZeroUsize;

use numpy::{PyArrayDyn, PyArrayMethods, PyUntypedArray};
use pyo3::prelude::*;
use tvident::exec::workers as threads;
use tvident::identify::Sliding;
use tvident::record::Samples;
use tvident::simd::Instructions;

use crate::arrays::zeros;
use crate::records::records;
use crate::watch::watched;

/// Velocities of all records, NaN at rest, then their standard errors: an array of shape (2, records, samples).
#[pyfunction]
#[pyo3(signature = (angle, delta, *, workers=None))]
pub(crate) fn sliding_velocity<'py>(
    py: Python<'py>,
    angle: &Bound<'py, PyUntypedArray>,
    delta: f64,
    workers: Option<NonZeroUsize>,
) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
    let angles = records(angle)?;
    let (count, samples) = (angles.len(), angles.first().map_or(0, Samples::len));
    let both = zeros::<f64>(py, &[2, count, samples])?;
    let mut found = Vec::new();
    watched(py, None, |watch| {
        for angle in &angles {
            found.push(Sliding::of(angle, (delta, Instructions::current()), threads(workers), watch)?);
        }
        Ok(())
    })?;
    {
        let mut both = both.readwrite();
        let (velocities, errors) = both.as_slice_mut()?.split_at_mut(count * samples);
        let rows = velocities.chunks_exact_mut(samples.max(1)).zip(errors.chunks_exact_mut(samples.max(1)));
        for ((velocity, errors), one) in rows.zip(&found) {
            velocity.copy_from_slice(&one.velocity);
            errors.copy_from_slice(&one.errors);
        }
    }
    Ok(both)
}
