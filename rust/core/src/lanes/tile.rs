//! Results of a few windows of every lane, before they are written out.
//!
//! Kernels finish one window of each lane at a time, while outputs hold consecutive windows of one lane: tiles are transposed.

use crate::simd::aligned::Aligned;
use crate::simd::vectors::{Lanes, MOST_LANES};

/// The most windows of each lane that a tile holds.
pub(crate) const TILE: usize = 32;

/// Some fields of the last few windows of every lane. Window `i` is at place `i`, modulo the number of places.
#[derive(Debug)]
pub(crate) struct Tile {
    places: usize,
    /// `[field][place][lane]`.
    values: Aligned,
}

impl Tile {
    /// Room for some fields of some windows, whose number is a power of two.
    pub(crate) fn new(fields: usize, places: usize, lanes: usize) -> Self {
        debug_assert!(places.is_power_of_two() && places <= TILE, "{places} places");
        Self { places, values: Aligned::zeros(fields * places * lanes) }
    }

    /// Windows of each lane that fit in.
    pub(crate) fn places(&self) -> usize {
        self.places
    }

    /// The fields of one window, to put many of them.
    #[inline(always)]
    pub(crate) fn fields_of<S: Lanes>(&mut self, window: usize) -> WindowFields<'_> {
        let apart = self.places * S::F64_LANES;
        let at = self.at(0, window) * S::F64_LANES;
        WindowFields { values: &mut self.values[at..], apart }
    }

    /// Puts one field of one window of every lane into its place.
    #[inline(always)]
    pub(crate) fn put<S: Lanes>(&mut self, simd: S, field: usize, window: usize, value: S::f64s) {
        self.fields_of::<S>(window).put(simd, field, value);
    }

    /// Gives a square of one field: as many consecutive windows from one on as there are lanes, one vector for every lane.
    #[inline(always)]
    pub(crate) fn square<S: Lanes>(&self, simd: S, field: usize, window: usize) -> [S::f64s; MOST_LANES] {
        let mut square = [simd.splat_f64s(0.0); MOST_LANES];
        let at = self.at(field, window) * S::F64_LANES;
        if (window & (self.places - 1)) + S::F64_LANES <= self.places {
            // In one piece, whose bounds are checked once.
            let piece = &self.values[at..at + S::F64_LANES * S::F64_LANES];
            for (row, vector) in square[..S::F64_LANES].iter_mut().enumerate() {
                *vector = simd.load(piece, row * S::F64_LANES);
            }
        } else {
            for (row, vector) in square[..S::F64_LANES].iter_mut().enumerate() {
                *vector = simd.load(&self.values, self.at(field, window + row) * S::F64_LANES);
            }
        }
        simd.transpose(&mut square[..S::F64_LANES]);
        square
    }

    /// One field of one window of one of so many lanes.
    #[inline(always)]
    pub(crate) fn one(&self, field: usize, window: usize, lane: usize, lanes: usize) -> f64 {
        self.values[self.at(field, window) * lanes + lane]
    }

    /// One field of all windows of every lane, one after the other.
    pub(crate) fn all(&self, field: usize, lanes: usize) -> &[f64] {
        &self.values[field * self.places * lanes..][..self.places * lanes]
    }

    #[inline(always)]
    fn at(&self, field: usize, window: usize) -> usize {
        field * self.places + (window & (self.places - 1))
    }
}

/// The fields of one window of every lane.
pub(crate) struct WindowFields<'a> {
    values: &'a mut [f64],
    /// Numbers from one field to the next.
    apart: usize,
}

impl WindowFields<'_> {
    /// Puts one field.
    #[inline(always)]
    pub(crate) fn put<S: Lanes>(&mut self, simd: S, field: usize, value: S::f64s) {
        simd.store(self.values, field * self.apart, value);
    }

    /// Gives one field.
    #[inline(always)]
    pub(crate) fn get<S: Lanes>(&self, simd: S, field: usize) -> S::f64s {
        simd.load(self.values, field * self.apart)
    }
}
