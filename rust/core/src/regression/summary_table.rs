//! Tables of summaries: one column for every entry of a summary, one row for every window.

use std::ops::Range;

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

    /// Copies summaries of so many entries to some places: others from one on, every so many of them.
    pub(crate) fn copy(&mut self, size: usize, (others, first, every): (&Self, usize, usize), places: Range<usize>) {
        for entry in 0..size {
            let from = &others.values[entry * others.padded..][..others.padded];
            let to = &mut self.values[entry * self.padded..][places.clone()];
            to.iter_mut().zip(from[first..].iter().step_by(every)).for_each(|(to, from)| *to = *from);
        }
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

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: usize = 3;

    /// Entry `e` of window `w` is `100 e + w`.
    fn summary(place: usize) -> [Packet; SIZE] {
        std::array::from_fn(|entry| Packet(std::array::from_fn(|lane| (100 * entry + place + lane) as f64)))
    }

    fn filled(count: usize) -> Table {
        let mut table = Table::default();
        table.resize(SIZE, count);
        for place in (0..count).step_by(WIDTH) {
            table.store(place, &summary(place));
        }
        table
    }

    #[test]
    fn windows_are_read_from_any_place_on() {
        for count in [1, 7, 8, 9, 16, 21] {
            let table = filled(count);
            for place in 0..count {
                let mut found = [Packet::ZERO; SIZE];
                table.load(place, &mut found);
                // A packet may reach beyond the last window: what is there says nothing.
                let there = WIDTH.min(count - place);
                for (found, expected) in found.iter().zip(summary(place)) {
                    assert_eq!(found.0[..there], expected.0[..there], "{count} windows from {place} on");
                }
            }
        }
    }

    #[test]
    fn only_the_windows_of_a_packet_are_written() {
        let mut table = filled(16);
        table.store(3, &[Packet::splat(-1.0); SIZE]);
        for place in [0, 8] {
            let mut found = [Packet::ZERO; SIZE];
            table.load(place, &mut found);
            for (found, before) in found.iter().zip(summary(place)) {
                for (lane, value) in found.0.into_iter().enumerate() {
                    let expected = if (3..11).contains(&(place + lane)) { -1.0 } else { before.0[lane] };
                    assert_eq!(value, expected, "window {}", place + lane);
                }
            }
        }
    }

    #[test]
    fn memory_grows_and_is_kept() {
        let mut table = Table::default();
        assert_eq!(table.len(), 0);
        // Room for whole packets and one that begins at the last window.
        for (size, count, length) in [(SIZE, 9, 3 * 24), (SIZE, 1, 3 * 24), (10, 8, 10 * 16), (SIZE, 17, 10 * 16)] {
            table.resize(size, count);
            assert_eq!(table.len(), length);
        }
    }
}
