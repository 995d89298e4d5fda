//! Factors of more and more rows, several side by side, of which single ones are read.

use crate::least_squares::givens_factor::{Dimensions, store};
use crate::simd::vectors::{Lanes, MOST_LANES};

/// Factors of so many numbers are turned when they are made: each then lies in a few cache lines, and not each number in its own.
const TURNED_FROM: usize = 12;

/// Whether the numbers of a factor lie side by side. Otherwise those of all lanes do, and small factors are read number by number.
#[inline(always)]
fn is_turned(shape: impl Dimensions) -> bool {
    shape.size() >= TURNED_FROM
}

/// Where the factors of no rows, one, two … of every lane lie in memory.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FactorStorage {
    /// Numbers from the factors of one lane to those of the next, and from one of its factors to the next.
    apart: usize,
    step: usize,
    /// All of them.
    pub(crate) numbers: usize,
}

impl FactorStorage {
    /// For factors of up to so many rows.
    #[inline(always)]
    pub(crate) fn of<S: Lanes, H: Dimensions>(shape: H, length: usize) -> Self {
        if is_turned(shape) {
            let step = shape.size().next_multiple_of(S::F64_LANES);
            Self { apart: (length + 1) * step, step, numbers: S::F64_LANES * (length + 1) * step }
        } else {
            let step = shape.size() * S::F64_LANES;
            Self { apart: 1, step, numbers: (length + 1) * step }
        }
    }

    /// Writes the factors of so many rows.
    #[inline(always)]
    pub(crate) fn put<S: Lanes, H: Dimensions>(
        self,
        simd: S,
        shape: H,
        into: &mut [f64],
        rows: usize,
        factor: &H::Factor<S::f64s>,
    ) {
        if !is_turned(shape) {
            store(simd, shape, &mut into[rows * self.step..], factor);
            return;
        }
        let mut square = [simd.splat_f64s(0.0); MOST_LANES];
        for first in (0..shape.size()).step_by(S::F64_LANES) {
            for (place, number) in (first..shape.size()).take(S::F64_LANES).enumerate() {
                square[place] = factor[number];
            }
            simd.transpose(&mut square[..S::F64_LANES]);
            for (lane, &numbers) in square[..S::F64_LANES].iter().enumerate() {
                simd.store(into, lane * self.apart + rows * self.step + first, numbers);
            }
        }
    }

    /// Reads factors of one lane, of so many rows for every window.
    #[inline(always)]
    pub(crate) fn get<S: Lanes, H: Dimensions>(
        self,
        simd: S,
        shape: H,
        from: &[f64],
        (lane, rows): (usize, &[u32]),
        factor: &mut H::Factor<S::f64s>,
    ) {
        let from = &from[lane * self.apart..];
        if is_turned(shape) {
            let mut square = [simd.splat_f64s(0.0); MOST_LANES];
            for first in (0..shape.size()).step_by(S::F64_LANES) {
                for (numbers, &rows) in square[..S::F64_LANES].iter_mut().zip(rows) {
                    *numbers = simd.load(from, rows as usize * self.step + first);
                }
                simd.transpose(&mut square[..S::F64_LANES]);
                for (place, number) in (first..shape.size()).take(S::F64_LANES).enumerate() {
                    factor[number] = square[place];
                }
            }
            return;
        }
        // Up to the last number of each: none of the others needs a check then.
        let reach = (shape.size() - 1) * S::F64_LANES + 1;
        let mut own: [&[f64]; MOST_LANES] = [&[]; MOST_LANES];
        for (own, &rows) in own[..S::F64_LANES].iter_mut().zip(rows) {
            *own = &from[rows as usize * self.step..][..reach];
        }
        for number in 0..shape.size() {
            let mut lanes = [0.0; MOST_LANES];
            for (lane, own) in lanes[..S::F64_LANES].iter_mut().zip(own) {
                *lane = own[number * S::F64_LANES];
            }
            factor[number] = simd.load(&lanes, 0);
        }
    }
}
