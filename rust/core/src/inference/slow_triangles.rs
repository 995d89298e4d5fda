//! What windows leave of their equations for the slow coefficients: triangles, laid end to end.

use std::ops::Range;

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

    /// Some of them.
    #[inline(always)]
    pub(crate) fn triangles(&self, some: Range<usize>) -> impl Iterator<Item = &[f64]> {
        let size = self.unknowns * (self.unknowns + 1);
        self.entries[some.start * size..some.end * size].chunks_exact(size)
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
            for some in [0..5, 1..3, 4..5, 2..2, 5..5] {
                let expected: Vec<Vec<f64>> =
                    some.clone().map(|one| (0..size).map(|place| entry(one, place)).collect()).collect();
                assert_eq!(all.triangles(some).collect::<Vec<_>>(), expected);
            }
        }
    }
}
