//! Tables of summaries: one column for every entry of a summary, one row for every window.

use crate::simd::f64x8::{Packet, WIDTH};

/// Summaries of consecutive windows of one length.
#[derive(Clone, Debug, Default)]
pub(crate) struct Table {
    padded: usize,
    values: Vec<f64>,
}

impl Table {
    /// Makes room for `count` summaries. Entries beyond those stored are arbitrary.
    pub(crate) fn resize(&mut self, size: usize, count: usize) {
        // A packet may begin at any window, so the last may reach beyond.
        self.padded = count.next_multiple_of(WIDTH) + WIDTH;
        if self.values.len() < size * self.padded {
            self.values.resize(size * self.padded, 0.0);
        }
    }

    /// How many numbers its memory holds.
    pub(crate) fn len(&self) -> usize {
        self.values.len()
    }

    #[inline(always)]
    pub(crate) fn load(&self, place: usize, summary: &mut [Packet]) {
        for (entry, value) in summary.iter_mut().enumerate() {
            *value = Packet::load(&self.values[entry * self.padded + place..]);
        }
    }

    #[inline(always)]
    pub(crate) fn store(&mut self, place: usize, summary: &[Packet]) {
        for (entry, value) in summary.iter().enumerate() {
            value.store(&mut self.values[entry * self.padded + place..]);
        }
    }
}
