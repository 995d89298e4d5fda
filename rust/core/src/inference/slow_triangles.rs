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
