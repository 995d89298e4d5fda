//! What windows leave of their equations for the slow coefficients: triangles, laid end to end.

use crate::simd::f64x8::{Packet, WIDTH};

/// The equations of windows times the roots of their weights, the right-hand side last.
pub(crate) struct Triangles {
    /// Columns of a triangle but the right-hand side, and its rows.
    pub(crate) unknowns: usize,
    /// Where each counts, and whether it does.
    pub(crate) places: Vec<(f64, bool)>,
    entries: Vec<f64>,
}

impl Triangles {
    pub(crate) fn new(unknowns: usize) -> Self {
        Self { unknowns, places: Vec::new(), entries: Vec::new() }
    }

    /// Adds one and gives its rows, which are zero so far.
    pub(crate) fn push(&mut self, row: f64, counts: bool) -> &mut [f64] {
        let first = self.entries.len();
        self.places.push((row, counts));
        self.entries.resize(first + self.unknowns * (self.unknowns + 1), 0.0);
        &mut self.entries[first..]
    }

    /// An entry of eight of them.
    #[inline(always)]
    pub(crate) fn gather(&self, some: &[usize; WIDTH], entry: usize) -> Packet {
        let size = self.unknowns * (self.unknowns + 1);
        let mut values = [0.0; WIDTH];
        for (value, one) in values.iter_mut().zip(some) {
            *value = self.entries[one * size + entry];
        }
        Packet(values)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn triangles_are_those_that_were_pushed() {
        for unknowns in 1..4 {
            let size = unknowns * (unknowns + 1);
            let mut all = Triangles::new(unknowns);
            let entry = |one: usize, place: usize| (1 + 100 * one + place) as f64;
            for one in 0..5 {
                let rows = all.push(1.5 * one as f64, one != 2);
                assert_eq!(rows, vec![0.0; size], "as many rows as unknowns, with a right-hand side each");
                rows.iter_mut().enumerate().for_each(|(place, value)| *value = entry(one, place));
            }
            assert_eq!(all.places, [(0.0, true), (1.5, true), (3.0, false), (4.5, true), (6.0, true)]);
            for some in [[0, 1, 2, 3, 4, 3, 2, 1], [4; WIDTH]] {
                for place in 0..size {
                    let expected = some.map(|one| entry(one, place));
                    assert_eq!(all.gather(&some, place).0, expected);
                }
            }
        }
    }
}
