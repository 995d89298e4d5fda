//! A walk over a channel, part by part, that can be cancelled.

use crate::error::Error;
use crate::exec::pool::Watch;
use crate::record::samples::{Samples, read_around};

/// Samples that are walked over together, and how many such parts between two looks at the watch.
const TOGETHER: usize = 1 << 12;
const PARTS: usize = 64;

/// Does something with each part of a channel, in order: with the number of its first sample, and with its samples between so many around them; those that
/// do not exist are missing.
///
/// # Errors
/// If the watch cancels.
pub(crate) fn each_part(
    channel: &dyn Samples,
    around: usize,
    watch: &mut Watch<'_>,
    mut work: impl FnMut(usize, &[f64]),
) -> Result<(), Error> {
    let samples = channel.len();
    let mut values = vec![0.0; TOGETHER.min(samples) + 2 * around];
    for (part, first) in (0..samples).step_by(TOGETHER).enumerate() {
        if part > 0 && part % PARTS == 0 && !watch(0, samples) {
            return Err(Error::Cancelled);
        }
        let values = &mut values[..TOGETHER.min(samples - first) + 2 * around];
        read_around(channel, first.cast_signed() - around.cast_signed(), values);
        work(first, values);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_sample_is_passed_once_between_its_neighbours() {
        let values: Vec<f64> = (0..2 * TOGETHER + 7).map(|place| place as f64).collect();
        let (mut next, mut parts) = (0, 0);
        let walked = each_part(&values.as_slice(), 2, &mut |_, _| true, |first, some| {
            assert_eq!(first, next);
            let is_there = |place: usize| (2..values.len() + 2).contains(&(first + place));
            for (place, &value) in some.iter().enumerate() {
                let is_right = if is_there(place) { value == (first + place - 2) as f64 } else { value.is_nan() };
                assert!(is_right, "{first} {place} {value}");
            }
            (next, parts) = (first + some.len() - 4, parts + 1);
        });
        assert!(walked.is_ok() && next == values.len() && parts == 3);
    }

    #[test]
    fn a_walk_ends_where_it_is_cancelled() {
        let values = vec![0.0; (PARTS + 1) * TOGETHER];
        let mut parts = 0;
        let walked = each_part(&values.as_slice(), 0, &mut |_, _| false, |_, _| parts += 1);
        assert!(walked.is_err() && parts == PARTS);
    }
}
