//! A stretch of a record in memory, with unusable samples set to zero and listed.

use std::ops::Range;

use crate::record::samples::{Samples, all_usable, is_usable};

/// Consecutive samples; missing and unusable ones are zero.
#[derive(Debug, Default)]
pub(crate) struct Stretch {
    /// Sample number of the first; negative before the record.
    first: isize,
    samples: Vec<f64>,
    /// Numbers of the unusable samples, in order.
    unusable: Vec<usize>,
}

impl Stretch {
    /// Whether all of some samples are held.
    pub(crate) fn holds(&self, samples: &Range<isize>) -> bool {
        self.first <= samples.start && samples.end <= self.first + self.samples.len().cast_signed()
    }

    /// Copies samples of a record.
    pub(crate) fn load(&mut self, record: &dyn Samples, samples: Range<isize>) {
        self.first = samples.start;
        self.samples.resize((samples.end - samples.start).max(0).unsigned_abs(), 0.0);
        let present = samples.start.max(0)..samples.end.min(record.len().cast_signed());
        self.unusable.clear();
        if present.is_empty() {
            self.samples.fill(0.0);
            return;
        }
        let place = (present.start - self.first).unsigned_abs();
        let (before, held) = self.samples.split_at_mut(place);
        let (held, after) = held.split_at_mut((present.end - present.start).unsigned_abs());
        before.fill(0.0);
        after.fill(0.0);
        record.read(present.start.unsigned_abs(), held);
        if !all_usable(held) {
            for (number, value) in (present.start.unsigned_abs()..).zip(held).filter(|(_, value)| !is_usable(**value)) {
                *value = 0.0;
                self.unusable.push(number);
            }
        }
    }

    /// Samples from one on.
    pub(crate) fn from(&self, first: isize, count: usize) -> &[f64] {
        let place = (first - self.first).unsigned_abs();
        &self.samples[place..place + count]
    }

    /// Numbers of the unusable samples among some, in order.
    pub(crate) fn unusable(&self, samples: Range<isize>) -> &[usize] {
        let place = |sample: isize| self.unusable.partition_point(|&bad| bad.cast_signed() < sample);
        &self.unusable[place(samples.start)..place(samples.end)]
    }

    /// The usable sample nearest to one, at most so far away, or zero where there is none.
    pub(crate) fn nearest_usable(&self, sample: isize, distance: usize) -> f64 {
        let end = self.first + self.samples.len().cast_signed();
        if self.unusable.is_empty() && (self.first..end).contains(&sample) {
            return self.samples[(sample - self.first).unsigned_abs()];
        }
        let candidates = (0..=distance.cast_signed()).flat_map(|k| [sample - k, sample + k]);
        let mut usable = candidates.filter(|number| {
            (self.first..end).contains(number) && self.unusable.binary_search(&number.unsigned_abs()).is_err()
        });
        usable.next().map_or(0.0, |number| self.samples[(number - self.first).unsigned_abs()])
    }
}
