//! Whose limits a torque stays at: a drive's, which counts as any torque, or the recorder's, which hid what was beyond.
//!
//! Rows tell: they are predicted badly, or widths disagree, with samples at the recorder's limits, and not without them. So a record is identified with them
//! and without. Of a long one a part is asked first, and all of it is identified without them at once where the part says so. What is constant may seem to
//! change with them, and then nothing is predicted badly: a torque whose highest values are missing is too small, and so are inertia and damping there.

use std::cell::LazyCell;
use std::ops::Range;

use crate::error::Error;
use crate::identify::weak::decide::{Predicted, better_of, is_better_within, is_odd};
use crate::identify::weak::found::WeakIdentified;
use crate::noise::defects::{Defect, defects};
use crate::record::samples::Samples;
use crate::status::Status;

/// Samples of the part of a long record that is asked, and how many parts are looked at for the one with the most samples at the limits.
const PART: usize = 1 << 15;
const PARTS: usize = 8;

/// Identifies a record with the samples of its torque that are at its limits, or without. `identify` does either, in a part of the record or all of it.
///
/// # Errors
/// If identification fails with these samples.
pub(crate) fn identify(
    torque: &dyn Samples,
    mut identify: impl FnMut(Option<&Range<usize>>, Option<[f64; 2]>) -> Result<WeakIdentified, Error>,
) -> Result<WeakIdentified, Error> {
    let limits = LazyCell::new(|| defects(torque).iter().find_map(Defect::limits));
    let is_long = torque.len() >= 2 * PART;
    let mut within = None;
    if let Some(limits) = if is_long { *limits } else { None } {
        let part = at_limits(torque, limits);
        if is_of_recorder(&mut identify, &part, limits)? {
            match identify(None, Some(limits)) {
                Err(Error::Cancelled) => return Err(Error::Cancelled),
                Ok(found) if !is_odd(predicted(&found)) => return Ok(found),
                found => within = found.ok(),
            }
        }
    }
    let whole = identify(None, None)?;
    if !is_odd(predicted(&whole)) && freed(&whole.changing) == 0 {
        return Ok(whole);
    }
    let Some(limits) = *limits else { return Ok(whole) };
    let is_late = |found: &WeakIdentified| found.record_status.contains(Status::LAG_SUSPECTED);
    let within = match within.map_or_else(|| identify(None, Some(limits)), Ok) {
        // A torque that is late with its limits and without is another matter.
        Ok(found) if is_late(&found) && is_late(&whole) => return Ok(whole),
        Ok(found) if freed(&found.changing) < freed(&whole.changing) && !is_odd(predicted(&found)) => return Ok(found),
        within => within,
    };
    better_of(whole, within, predicted).map(|(found, _)| found)
}

/// How many of inertia and damping are among the unknowns that change.
fn freed(changing: &[usize]) -> usize {
    changing.iter().filter(|unknown| **unknown < 2).count()
}

/// Whether a part of a record is predicted badly with samples at some limits, and better without.
fn is_of_recorder(
    identify: &mut impl FnMut(Option<&Range<usize>>, Option<[f64; 2]>) -> Result<WeakIdentified, Error>,
    part: &Range<usize>,
    limits: [f64; 2],
) -> Result<bool, Error> {
    let mut ask = |limits: Option<[f64; 2]>| match identify(Some(part), limits) {
        Err(Error::Cancelled) => Err(Error::Cancelled),
        found => Ok(found.ok().map(|found| predicted(&found))),
    };
    let Some(whole) = ask(None)?.filter(|whole| is_odd(*whole)) else { return Ok(false) };
    Ok(ask(Some(limits))?.is_some_and(|within| is_better_within(whole, within)))
}

/// The part of a long record in which the most samples are at some limits.
fn at_limits(torque: &dyn Samples, [lowest, highest]: [f64; 2]) -> Range<usize> {
    let room = torque.len() - PART;
    let mut samples = vec![0.0; PART];
    let parts = (0..PARTS).map(|place| room * place / (PARTS - 1)).map(|first| {
        torque.read(first, &mut samples);
        let count = samples.iter().filter(|value| **value <= lowest || **value >= highest).count();
        (count, first..first + PART)
    });
    parts.max_by_key(|(count, _)| *count).map_or(0..PART, |(_, part)| part)
}

/// How well rows are predicted, and what holds for the record.
fn predicted(found: &WeakIdentified) -> Predicted {
    (found.prediction_error, found.record_status)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_part_with_the_most_samples_at_the_limits_is_asked() {
        let mut torque = vec![0.0; 5 * PART];
        torque[3 * PART + PART / 2] = 1.0;
        assert!(at_limits(&torque.as_slice(), [-1.0, 1.0]).contains(&(3 * PART + PART / 2)));
        torque[100..110].fill(-1.0);
        assert_eq!(at_limits(&torque.as_slice(), [-1.0, 1.0]), 0..PART);
    }
}
