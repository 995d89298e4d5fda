//! The treatment of results around missing samples, where they shall be NaN.

use crate::equation::motion::Motion;
use crate::error::Error;
use crate::exec::pool::Watch;
use crate::identify::identification::{Identification, Unknown};
use crate::status::Status;

/// Samples that are read at a time: what both channels need stays in the nearest cache.
const PIECE: usize = 1 << 11;

/// Samples between two looks at the watch: some milliseconds.
const WATCHED: usize = 1 << 20;

/// Numbers of the samples at which angle or torque is not there, in order: holds no finite number, say.
///
/// # Errors
/// If the watch cancels.
pub(crate) fn holes(
    motion: &Motion<'_>,
    is_there: impl Fn(f64) -> bool,
    watch: &mut Watch<'_>,
) -> Result<Vec<usize>, Error> {
    let samples = motion.angle.len();
    let most = PIECE.min(samples);
    let (mut angle, mut torque) = (vec![0.0; most], vec![0.0; most]);
    let mut holes = Vec::new();
    for first in (0..samples).step_by(PIECE) {
        if first % WATCHED == WATCHED - PIECE && !watch(0, samples) {
            return Err(Error::Cancelled);
        }
        let count = PIECE.min(samples - first);
        let (angle, torque) = (&mut angle[..count], &mut torque[..count]);
        motion.angle.read(first, angle);
        motion.torque.read(first, torque);
        // No early return, so that the loop becomes vector instructions.
        let whole = angle.iter().chain(&*torque).fold(true, |all, value| all & is_there(*value));
        if !whole {
            let lost = |&place: &usize| !is_there(angle[place]) || !is_there(torque[place]);
            holes.extend((0..count).filter(lost).map(|place| first + place));
        }
    }
    Ok(holes)
}

/// Takes the numbers away whose windows hold a hole, but for constants, whose window is the record.
pub(crate) fn propagate(found: &mut Identification, holes: &[usize], step: usize) {
    if found.unknowns.iter().all(Unknown::is_constant) {
        return;
    }
    let (half, rows) = (found.window_length / 2, found.regression_window);
    let (before, after) = (half + rows / 2, half + rows - rows / 2 - 1);
    let elements = found.status.len();
    for column in [&mut found.residual_std, &mut found.condition] {
        if column.len() == 1 {
            column.resize(elements, column[0]);
        }
    }
    let mut first = 0;
    for element in 0..elements {
        let sample = element * step;
        while holes.get(first).is_some_and(|hole| hole + before < sample) {
            first += 1;
        }
        if holes.get(first).is_none_or(|&hole| hole > sample + after) {
            continue;
        }
        for unknown in found.unknowns.iter_mut().filter(|unknown| !unknown.is_constant()) {
            unknown.values[element] = f64::NAN;
            unknown.unscaled_stderr[element] = f64::NAN;
        }
        found.residual_std[element] = f64::NAN;
        found.condition[element] = f64::NAN;
        found.status[element] |= Status::INVALID | Status::GAP;
    }
}
