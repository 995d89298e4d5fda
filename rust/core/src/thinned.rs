//! Parts of a long record that stand for all of it, where something is only to be chosen.
//!
//! A choice is as good after minutes as after hours: its cost must not grow with the record.

use std::ops::Range;

use crate::equations::{Regressor, Rows};
use crate::samples::Samples;
use crate::scale::Scale;

/// All places, or so many of them in a number of stretches evenly spread.
pub(crate) fn stretches(places: usize, most: usize, count: usize) -> impl Iterator<Item = Range<usize>> {
    let (count, length) = if places <= most { (1, places) } else { (count, most / count) };
    let room = places - length;
    (0..count).map(move |index| {
        let first = room * index / (count - 1).max(1);
        first..first + length
    })
}

/// Stretches of a record, one after another with a missing sample between them.
pub(crate) struct Thinned<'a> {
    channel: &'a dyn Samples,
    stretches: &'a [Range<usize>],
}

impl<'a> Thinned<'a> {
    /// Stretches of the same length.
    pub(crate) fn new(channel: &'a dyn Samples, stretches: &'a [Range<usize>]) -> Self {
        Self { channel, stretches }
    }

    /// Samples of a stretch and what separates it from the next.
    fn pitch(&self) -> usize {
        self.stretches.first().map_or(0, Range::len) + 1
    }
}

impl Samples for Thinned<'_> {
    fn len(&self) -> usize {
        (self.stretches.len() * self.pitch()).saturating_sub(1)
    }

    fn read(&self, first: usize, into: &mut [f64]) {
        let pitch = self.pitch();
        let mut done = 0;
        while done < into.len() {
            let (stretch, offset) = ((first + done) / pitch, (first + done) % pitch);
            let from = &self.stretches[stretch];
            if offset == from.len() {
                into[done] = f64::NAN;
                done += 1;
            } else {
                let count = (from.len() - offset).min(into.len() - done);
                self.channel.read(from.start + offset, &mut into[done..done + count]);
                done += count;
            }
        }
    }
}

/// Flags in stretches, one after another with one that is not set between them.
pub(crate) fn thinned_flags(flags: &[bool], stretches: &[Range<usize>]) -> Vec<bool> {
    let mut thinned = Vec::new();
    for stretch in stretches {
        thinned.extend_from_slice(&flags[stretch.clone()]);
        thinned.push(false);
    }
    thinned.pop();
    thinned
}

/// A column in stretches, one after another.
pub(crate) fn thinned_column<T: Copy>(column: &[T], stretches: &[Range<usize>]) -> Vec<T> {
    stretches.iter().flat_map(|stretch| column.get(stretch.clone()).unwrap_or_default().iter().copied()).collect()
}

/// Rows in stretches, one after another; windows do not reach from one to the next.
pub(crate) fn thinned_rows(rows: &Rows, stretches: &[Range<usize>]) -> Rows {
    let column = |values: &Vec<f64>| thinned_column(values, stretches);
    let regressor = |one: &Regressor| Regressor {
        value: column(&one.value),
        companion: column(&one.companion),
        noise: one.noise.clone(),
    };
    let mut jumps = Vec::new();
    let mut before = 0;
    for stretch in stretches {
        if before > 0 {
            jumps.push(before);
        }
        let inside = rows.jumps.iter().filter(|jump| (stretch.start + 1..stretch.end).contains(jump));
        jumps.extend(inside.map(|jump| before + jump - stretch.start));
        before += stretch.len();
    }
    Rows {
        regressors: rows.regressors.iter().map(regressor).collect(),
        side: column(&rows.side),
        side_noise: rows.side_noise.clone(),
        usable: thinned_column(&rows.usable, stretches),
        jumps,
        period: rows.period,
    }
}

/// Rows of a record with more are thinned where something is only to be chosen: to so many, in so many stretches.
const LONG: usize = 1 << 15;
const MOST_ROWS: usize = 1 << 14;
const STRETCHES: usize = 8;

/// The stretches that stand for so many rows, where those are many.
pub(crate) fn stretches_of_rows(rows: usize) -> Option<Vec<Range<usize>>> {
    (rows > LONG).then(|| stretches(rows, MOST_ROWS, STRETCHES).collect())
}

/// Whether stretches of rows hold enough windows of a length.
pub(crate) fn holds(scale: Scale) -> bool {
    2 * scale.span() <= MOST_ROWS / STRETCHES
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

    #[test]
    fn a_thinned_record_reads_the_same_in_any_pieces() {
        let samples: Vec<f64> = (0..100).map(f64::from).collect();
        let (samples, parts) = (samples.as_slice(), [3..8, 40..45, 90..95]);
        let thinned = Thinned::new(&samples, &parts);
        let mut whole = vec![0.0; thinned.len()];
        thinned.read(0, &mut whole);
        assert_eq!(whole.len(), 17);
        assert_eq!((whole[4], whole[6], whole[16]), (7.0, 40.0, 94.0));
        assert!(whole[5].is_nan() && whole[11].is_nan());
        for (first, sample) in whole.iter().enumerate() {
            let mut one = [0.0];
            thinned.read(first, &mut one);
            assert_eq!(one[0].to_bits(), sample.to_bits());
        }
    }
}
