//! A grid of blocks over a record that is the same from both of its ends.

use std::ops::Range;

/// Blocks of an odd number of samples: a boundary lies in the middle of a record of even length, a block's centre in that of an odd one.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Blocks {
    samples: usize,
    pub(crate) length: usize,
    /// Samples before the first boundary inside the record: a shorter block, if there are any.
    before: usize,
}

impl Blocks {
    /// Blocks of at least some length.
    pub(crate) fn new(samples: usize, least: usize) -> Self {
        let length = least + 1 - least % 2;
        let middle = samples / 2;
        let boundary = if samples % 2 == 0 { middle } else { middle + length - length / 2 };
        Self { samples, length, before: boundary % length }
    }

    /// The first sample of the first block that is not cut.
    pub(crate) fn first_whole(self) -> usize {
        self.before
    }

    /// How many there are.
    pub(crate) fn count(self) -> usize {
        (self.samples + self.missing()).div_ceil(self.length)
    }

    /// What the first block lacks of its length.
    fn missing(self) -> usize {
        (self.length - self.before) % self.length
    }

    /// The block of a sample.
    pub(crate) fn of(self, sample: usize) -> usize {
        (sample + self.missing()) / self.length
    }

    /// The samples of a block.
    pub(crate) fn samples(self, block: usize) -> Range<usize> {
        let start = (block * self.length).saturating_sub(self.missing());
        start..((block + 1) * self.length - self.missing()).min(self.samples)
    }

    /// The first centre of a block beyond a sample, or the next end of what would be one.
    pub(crate) fn next_centre(self, sample: usize) -> usize {
        let place = sample + self.missing() + self.length - self.length / 2;
        sample + self.length - place % self.length
    }

    /// The two blocks between whose centres a sample lies, and its distance from the first of these in blocks.
    pub(crate) fn between(self, sample: usize) -> (usize, usize, f64) {
        let half = self.length / 2;
        let place = sample + self.missing();
        let last = self.count() - 1;
        if place < half {
            return (0, 0, 0.0);
        }
        let low = ((place - half) / self.length).min(last);
        let distance = ((place - half) % self.length) as f64 / self.length as f64;
        (low, (low + 1).min(last), distance)
    }
}

/// The intersection of two ranges.
pub(crate) fn within(one: &Range<usize>, other: &Range<usize>) -> Range<usize> {
    let start = one.start.max(other.start);
    start..one.end.min(other.end).max(start)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_partition_a_record_and_are_the_same_from_both_ends() {
        for (samples, least) in [(1, 1), (10, 3), (11, 3), (100, 8), (101, 8), (7, 20), (400, 11)] {
            let blocks = Blocks::new(samples, least);
            let parts: Vec<Range<usize>> = (0..blocks.count()).map(|block| blocks.samples(block)).collect();
            assert_eq!((parts[0].start, parts[parts.len() - 1].end), (0, samples));
            for (block, part) in parts.iter().enumerate() {
                assert!(!part.is_empty() && part.len() <= blocks.length);
                assert!(part.clone().all(|sample| blocks.of(sample) == block));
                let mirrored = &parts[parts.len() - 1 - block];
                assert_eq!((samples - part.end, samples - part.start), (mirrored.start, mirrored.end));
            }
            for sample in 0..samples {
                let ((low, high, distance), (below, above, rest)) =
                    (blocks.between(sample), blocks.between(samples - 1 - sample));
                let weights = |low: usize, high: usize, distance: f64, mirrored: bool| {
                    let mut weights = vec![0.0; parts.len()];
                    let place = |block: usize| if mirrored { parts.len() - 1 - block } else { block };
                    weights[place(low)] += 1.0 - distance;
                    weights[place(high)] += distance;
                    weights
                };
                let mirrored = weights(below, above, rest, true);
                let close =
                    weights(low, high, distance, false).iter().zip(&mirrored).all(|(a, b)| (a - b).abs() < 1e-12);
                assert!(close, "sample {sample} of {samples}");
            }
        }
    }
}
