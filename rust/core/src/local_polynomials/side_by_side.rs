//! Short records side by side, one in each lane: their samples as kernels read them.
//!
//! A run of the walk takes as many blocks of a record as there are lanes. A short record does not fill it, so where there are several of one length
//! each lane walks through a record of its own. Spans lie where they do in one record alone, and lanes keep apart, so the bits are the same.

use std::ops::Range;

use crate::lanes::interleaved::Strips;
use crate::local_polynomials::kernels::Fill;
use crate::record::buffer::Stretch;
use crate::record::samples::Samples;
use crate::simd::instructions::Instructions;
use crate::simd::vectors::dispatch;

/// Records of one length, as many as there are lanes at most.
#[derive(Debug)]
pub(crate) struct SideBySide {
    count: usize,
    samples: usize,
    /// The records end to end.
    stretch: Stretch,
    strips: Strips,
}

impl SideBySide {
    /// Room for so many records of so many samples.
    pub(crate) fn new(samples: usize, lanes: usize) -> Self {
        Self { count: 0, samples, stretch: Stretch::default(), strips: Strips::new(samples, 0, lanes) }
    }

    /// Copies and lays out the samples of some records. Lanes without one hold zeros.
    pub(crate) fn load(&mut self, records: &[&dyn Samples], instructions: Instructions) {
        self.count = records.len();
        self.stretch.load(&EndToEnd { records, samples: self.samples }, 0..self.strips.samples().cast_signed());
        let samples = self.stretch.from(0, self.strips.samples());
        dispatch(instructions, Fill { samples, strips: &mut self.strips });
    }

    /// Number of records.
    pub(crate) fn count(&self) -> usize {
        self.count
    }

    /// Samples of each.
    pub(crate) fn samples(&self) -> usize {
        self.samples
    }

    /// The records end to end.
    pub(crate) fn stretch(&self) -> &Stretch {
        &self.stretch
    }

    /// The samples of one record a lane.
    pub(crate) fn strips(&self) -> &Strips {
        &self.strips
    }

    /// Places in a record, among some, of samples that are unusable.
    pub(crate) fn unusable(&self, record: usize, places: Range<usize>) -> impl Iterator<Item = usize> {
        let begin = record * self.samples;
        let found = self.stretch.unusable((begin + places.start).cast_signed()..(begin + places.end).cast_signed());
        found.iter().map(move |number| number - begin)
    }
}

/// Records one after the other.
struct EndToEnd<'a> {
    records: &'a [&'a dyn Samples],
    samples: usize,
}

impl Samples for EndToEnd<'_> {
    fn len(&self) -> usize {
        self.records.len() * self.samples
    }

    fn read(&self, first: usize, into: &mut [f64]) {
        let (mut place, mut left) = (first, into);
        while !left.is_empty() {
            let (record, begin) = (place / self.samples, place % self.samples);
            let (here, rest) = left.split_at_mut(left.len().min(self.samples - begin));
            self.records[record].read(begin, here);
            place += here.len();
            left = rest;
        }
    }
}
