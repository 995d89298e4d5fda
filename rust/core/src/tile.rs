//! Results of a few windows of every lane, before they are written out.
//!
//! Kernels finish one window of each lane at a time, while outputs hold consecutive windows of one lane: tiles are transposed.

use std::ops::Range;

use crate::aligned::Aligned;
use crate::simd::{Lanes, MOST_LANES};

/// Windows of each lane that a tile holds.
pub(crate) const TILE: usize = 32;

/// Some fields of [`TILE`] windows of every lane.
#[derive(Debug)]
pub(crate) struct Tile {
    /// `[field][window][lane]`.
    values: Aligned,
    /// `[field][window]` of one lane.
    column: Vec<f64>,
}

impl Tile {
    pub(crate) fn new(fields: usize, lanes: usize) -> Self {
        Self { values: Aligned::zeros(fields * TILE * lanes), column: vec![0.0; fields * TILE] }
    }

    /// Puts one field of one window of every lane into its place.
    #[inline(always)]
    pub(crate) fn put<S: Lanes>(&mut self, simd: S, field: usize, place: usize, value: S::f64s) {
        simd.store(&mut self.values, (field * TILE + place) * S::F64_LANES, value);
    }

    /// Gives a square of one field: as many consecutive windows from a place on as there are lanes, one vector for every lane.
    #[inline(always)]
    pub(crate) fn square<S: Lanes>(&self, simd: S, field: usize, place: usize) -> [S::f64s; MOST_LANES] {
        let lanes = S::F64_LANES;
        let values = &self.values[(field * TILE + place) * lanes..(field * TILE + place + lanes) * lanes];
        let mut square = [simd.splat_f64s(0.0); MOST_LANES];
        for (row, vector) in square[..lanes].iter_mut().enumerate() {
            *vector = simd.load(values, row * lanes);
        }
        simd.transpose(&mut square[..lanes]);
        square
    }

    /// One lane's fields, [`TILE`] windows each, of which the given places are good.
    #[inline(always)]
    pub(crate) fn lane<S: Lanes>(&mut self, lane: usize, places: &Range<usize>) -> &mut [f64] {
        let lanes = S::F64_LANES;
        for (from, to) in self.values.chunks_exact(TILE * lanes).zip(self.column.chunks_exact_mut(TILE)) {
            for place in places.clone() {
                to[place] = from[place * lanes + lane];
            }
        }
        &mut self.column
    }
}
