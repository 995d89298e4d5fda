//! Long calls: the interpreter's lock is released, and taken back at times for Ctrl-C and progress.

use pyo3::exceptions::{PyMemoryError, PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use tvident::Error;
use tvident::exec::Watch;

use crate::reserve;

/// Runs `work` with the interpreter's lock released. The watch that it must call takes the lock back for a moment, lets signals such
/// as Ctrl-C in, and calls `progress(done, total)`; whatever either of them raises cancels the work and is raised here.
pub(crate) fn watched(
    py: Python<'_>,
    progress: Option<&Bound<'_, PyAny>>,
    work: impl FnOnce(&mut Watch<'_>) -> Result<(), Error> + Send,
) -> PyResult<()> {
    reserve::fill().map_err(|bytes| exception(&Error::Memory { bytes }))?;
    let progress = progress.map(|progress| progress.clone().unbind());
    let (outcome, raised) = py.detach(|| {
        let mut raised = None;
        let mut watch = |done: usize, total: usize| {
            if raised.is_some() {
                // Threads are still at their last pieces; what was raised first is what counts.
                return false;
            }
            if let Some(bytes) = reserve::missed() {
                raised = Some(exception(&Error::Memory { bytes }));
                return false;
            }
            let looked = Python::attach(|py| {
                py.check_signals()?;
                progress.as_ref().map_or(Ok(()), |progress| progress.call1(py, (done, total)).map(|_| ()))
            });
            raised = looked.err();
            raised.is_none()
        };
        (work(&mut watch), raised)
    });
    match raised {
        Some(error) => Err(error),
        None => outcome.map_err(|error| exception(&error)),
    }
}

/// The exception that says what an error says.
pub(crate) fn exception(error: &Error) -> PyErr {
    match error {
        Error::Memory { .. } => PyMemoryError::new_err(error.to_string()),
        Error::Cancelled | Error::Threads { .. } => PyRuntimeError::new_err(error.to_string()),
        _ => PyValueError::new_err(error.to_string()),
    }
}
