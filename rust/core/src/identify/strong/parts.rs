//! Windows of a part of a long record: what of the record must be there, and the scatter that needs several parts of it.
//!
//! Rows and windows begin at places that depend on the number of a sample in its record alone, so a part gives the bits that the whole record gives.

use std::num::NonZeroUsize;
use std::ops::Range;

use crate::error::Error;
use crate::exec::pool::Watch;
use crate::identify::options::StrongForm;
use crate::identify::strong::scatter::{compared_windows, identify_with_scatter};
use crate::identify::strong::streaming::{Identified, StrongRecord, rows_of_variance_inflations};

/// Windows of polynomials that lie between a sample and the farthest one that has a part in its derivatives: half of its own, the neighbours that
/// orders are pooled over, and the span that reaches it, which is no longer than a window.
const WINDOWS: usize = 3;

/// The samples that must be there for the windows around some samples of a record of so many.
#[must_use]
pub fn around(form: &StrongForm<'_>, wanted: &Range<usize>, samples: usize) -> Range<usize> {
    let reach = WINDOWS.saturating_mul(form.derivatives.options().window_length).saturating_add(form.regression_window);
    wanted.start.saturating_sub(reach)..wanted.end.saturating_add(reach).min(samples)
}

/// The parts of a record of so many samples that [`scatter_of_windows`] looks at, in order and apart.
#[must_use]
pub fn parts_of_scatter(form: &StrongForm<'_>, samples: usize) -> Vec<Range<usize>> {
    let looked_at = compared_windows(form.derivatives, form.regression_window, samples)
        .into_iter()
        .chain(rows_of_variance_inflations(form.derivatives, samples));
    let mut parts: Vec<Range<usize>> = looked_at.map(|part| around(form, &part, samples)).collect();
    parts.sort_unstable_by_key(|part| part.start);
    let mut apart: Vec<Range<usize>> = Vec::new();
    for part in parts {
        match apart.last_mut() {
            Some(last) if part.start <= last.end => last.end = last.end.max(part.end),
            _ => apart.push(part),
        }
    }
    apart
}

/// By how much standard errors of windowed unknowns exceed those of ordinary least squares in a record of which [`parts_of_scatter`] are there:
/// one factor an unknown, those that the whole record gives.
///
/// # Errors
/// If the record is shorter than the window of the polynomials, windows are impossible, or the watch cancels.
pub fn scatter_of_windows(
    form: &StrongForm<'_>,
    record: &StrongRecord<'_>,
    workers: NonZeroUsize,
    watch: &mut Watch<'_>,
) -> Result<Vec<f64>, Error> {
    let least_squares = record.windows(form.derivatives, form.regression_window, Vec::new())?;
    let nowhere = vec![(record, 0..0, Identified::default())];
    let mut factors = identify_with_scatter(form.derivatives, &least_squares, nowhere, workers, watch)?;
    Ok(factors.pop().unwrap_or_default())
}
