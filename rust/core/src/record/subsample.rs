//! Subsamples of a long record: hyperparameters are chosen from them, estimates use all data.
//!
//! A choice from minutes of data is as good as one from hours, so its cost must not grow with the record.

use std::ops::Range;

/// The golden section: no pattern of samples falls in with its multiples.
pub(crate) const GOLDEN: f64 = 0.618_033_988_749_894_9;

/// All places, or so many of them in evenly spread stretches.
pub(crate) fn stretches(places: usize, most: usize, count: usize) -> impl Iterator<Item = Range<usize>> {
    let (count, length) = if places <= most { (1, places) } else { (count, most / count) };
    let room = places - length;
    (0..count).map(move |index| {
        let first = room * index / (count - 1).max(1);
        first..first + length
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stretches_cover_a_short_record_and_span_a_long_one() {
        assert!(stretches(10, 100, 64).eq(std::iter::once(0..10)));
        let parts: Vec<Range<usize>> = stretches(1000, 128, 64).collect();
        assert_eq!((parts.len(), parts[0].start, parts[63].end), (64, 0, 1000));
    }
}
