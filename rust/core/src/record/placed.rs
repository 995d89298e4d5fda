//! Parts of a long record in the place of the whole: what is worked on is there, and the rest is not read.

use std::ops::Range;

use crate::record::samples::Samples;

/// A record of which some parts are held, one after the other. Its samples have the numbers that they have in the whole record, so what is
/// found of them has the bits that it has there. Elsewhere it reads as zero.
#[derive(Clone, Debug)]
pub struct Placed<S> {
    held: S,
    /// Where every part lies in the record, and where its first sample is held.
    parts: Vec<(Range<usize>, usize)>,
    samples: usize,
}

impl<S: Samples> Placed<S> {
    /// A record that is held as a whole.
    #[must_use]
    pub fn whole(held: S) -> Self {
        let samples = held.len();
        Self { held, parts: std::iter::once((0..samples, 0)).collect(), samples }
    }

    /// A record of so many samples of which some parts are held, or `None` if they overlap, are out of order, reach beyond the record or
    /// are not what is held.
    #[must_use]
    pub fn new(held: S, parts: &[Range<usize>], samples: usize) -> Option<Self> {
        let (mut placed, mut place, mut end) = (Vec::with_capacity(parts.len()), 0_usize, 0);
        for part in parts {
            if part.start < end || part.end < part.start {
                return None;
            }
            placed.push((part.clone(), place));
            place = place.checked_add(part.len())?;
            end = part.end;
        }
        (end <= samples && place == held.len()).then_some(Self { held, parts: placed, samples })
    }
}

impl<S: Samples> Samples for Placed<S> {
    fn len(&self) -> usize {
        self.samples
    }

    fn read(&self, first: usize, into: &mut [f64]) {
        let end = first + into.len();
        let begun = self.parts.partition_point(|(part, _)| part.end <= first);
        if let Some((part, place)) = self.parts.get(begun)
            && part.start <= first
            && end <= part.end
        {
            self.held.read(place + (first - part.start), into);
            return;
        }
        into.fill(0.0);
        for (part, place) in self.parts[begun..].iter().take_while(|(part, _)| part.start < end) {
            let (from, to) = (part.start.max(first), part.end.min(end));
            self.held.read(place + (from - part.start), &mut into[from - first..to - first]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_are_read_where_they_lie_and_zero_between() {
        let held: Vec<f64> = (0..5).map(f64::from).collect();
        let placed = Placed::new(held.as_slice(), &[2..4, 6..9], 12).expect("parts in order");
        assert_eq!(placed.len(), 12);
        let mut all = [f64::NAN; 12];
        placed.read(0, &mut all);
        assert_eq!(all, [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 2.0, 3.0, 4.0, 0.0, 0.0, 0.0]);
        for first in 0..12 {
            for end in first..=12 {
                let mut some = vec![f64::NAN; end - first];
                placed.read(first, &mut some);
                assert_eq!(some, all[first..end]);
            }
        }
    }

    #[test]
    fn what_is_no_part_of_a_record_is_refused() {
        let held = [0.0; 4];
        let held = held.as_slice();
        for (parts, samples) in [
            (vec![0..2, 1..3], 9),
            (vec![3..5, 0..2], 9),
            (std::iter::once(0..2).collect(), 9),
            (vec![0..2, 7..9], 8),
            (vec![0..4, 4..5], 9),
        ] {
            assert!(Placed::new(held, &parts, samples).is_none(), "{parts:?}");
        }
        assert_eq!(Placed::whole(held).len(), 4);
    }
}
