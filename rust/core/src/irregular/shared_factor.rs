//! The factor of the normal matrix of windows that share a basis: a window in each lane.
//!
//! `G = L D L'` by columns. Rows below the matrix are what is solved for: of `b` there stays `L⁻¹ b`, whose place `k` belongs to the polynomial of order `k`
//! that is orthogonal to all lower ones in this window.

use crate::irregular::shared_sums::MOST;
use crate::simd::aligned::OnLines;
use crate::simd::vectors::Lanes;

/// Derivatives at most, the value among them.
pub(crate) const DERIVATIVES: usize = 6;

/// Rows at most: the matrix, the samples, one for the condition, and derivatives.
const ROWS: usize = MOST + 2 + DERIVATIVES;

/// A matrix and what is solved with it.
pub(crate) struct SharedFactor<S: Lanes> {
    /// `L D`, and below it `L⁻¹ b`.
    pub(crate) rows: OnLines<[S::f64s; MOST], ROWS>,
    /// One over each pivot.
    pub(crate) inverse: OnLines<S::f64s, MOST>,
    /// The largest ratio of a diagonal to its pivot.
    pub(crate) weakest: S::f64s,
    /// Halves of moments, and minus the row of a pivot over the pivots before.
    halves: OnLines<S::f64s, { 2 * MOST }>,
    factors: OnLines<S::f64s, MOST>,
}

impl<S: Lanes> SharedFactor<S> {
    #[inline(always)]
    pub(crate) fn zero(simd: S) -> Self {
        let zero = simd.splat_f64s(0.0);
        let (rows, inverse) = (OnLines([[zero; MOST]; ROWS]), OnLines([zero; MOST]));
        let (halves, factors) = (OnLines([zero; 2 * MOST]), OnLines([zero; MOST]));
        Self { rows, inverse, weakest: zero, halves, factors }
    }

    /// Sets a row below the matrix.
    #[inline(always)]
    pub(crate) fn set_below(&mut self, degrees: usize, row: usize, values: &[S::f64s; MOST]) {
        let degrees = degrees.min(MOST);
        for (own, value) in self.rows.0[degrees + row].iter_mut().zip(values).take(degrees) {
            *own = *value;
        }
    }

    /// Decomposes the matrix that moments make; so many rows below it hold what is to be solved for.
    #[inline(always)]
    pub(crate) fn decompose(&mut self, simd: S, degrees: usize, moments: &[S::f64s; 2 * MOST], below: usize) {
        let (degrees, half) = (degrees.min(MOST), simd.splat_f64s(0.5));
        if below > 1 {
            self.rows.0[degrees + 1][..degrees].fill(simd.splat_f64s(0.0));
        }
        for (value, moment) in self.halves.0.iter_mut().zip(moments).take(2 * degrees - 1) {
            *value = simd.mul_f64s(*moment, half);
        }
        self.weakest = simd.splat_f64s(1.0);
        for column in 0..degrees {
            let diagonal = simd.add_f64s(self.halves.0[2 * column], self.halves.0[0]);
            for (factor, (value, inverse)) in
                self.factors.0.iter_mut().zip(self.rows.0[column].iter().zip(&self.inverse.0)).take(column)
            {
                *factor = simd.neg_f64s(simd.mul_f64s(*value, *inverse));
            }
            let (halves, factors) = (&self.halves.0, &self.factors.0);
            let mut of = EliminatedColumn { simd, halves, factors, degrees, column, row: column };
            let (blocks, rest) = self.rows.0[column..degrees + below].as_chunks_mut::<8>();
            for block in blocks {
                of.eliminate(block);
            }
            let (blocks, rest) = rest.as_chunks_mut::<4>();
            for block in blocks {
                of.eliminate(block);
            }
            let (blocks, rest) = rest.as_chunks_mut::<2>();
            for block in blocks {
                of.eliminate(block);
            }
            for row in rest {
                of.eliminate(std::array::from_mut(row));
            }
            if below > 1 {
                let grown = &mut self.rows.0[degrees + 1][column];
                let is_negative = simd.less_than_f64s(*grown, simd.splat_f64s(0.0));
                let one = simd.splat_f64s(1.0);
                *grown = simd.add_f64s(*grown, simd.select_f64s(is_negative, simd.neg_f64s(one), one));
            }
            let inverse = simd.div_f64s(simd.splat_f64s(1.0), self.rows.0[column][column]);
            self.inverse.0[column] = inverse;
            let ratio = simd.mul_f64s(diagonal, inverse);
            // Where a pivot is negative or no number, so is the ratio: it counts as infinite.
            let counts = simd.greater_than_or_equal_f64s(ratio, simd.splat_f64s(0.5));
            let ratio = simd.select_f64s(counts, ratio, simd.splat_f64s(f64::INFINITY));
            self.weakest = simd.max_f64s(self.weakest, ratio);
        }
    }

    /// The solution `G⁻¹ b` of what stays of `b`, in its place.
    #[inline(always)]
    pub(crate) fn solve(&self, simd: S, degrees: usize, solution: &mut OnLines<S::f64s, MOST>) {
        for place in (0..degrees.min(MOST)).rev() {
            let scaled = simd.mul_f64s(solution.0[place], self.inverse.0[place]);
            // A row of `L D` is a column of `D L'`, and what is on the other side has not been divided by `D` yet.
            for (earlier, factor) in solution.0[..place].iter_mut().zip(&self.rows.0[place]) {
                *earlier = simd.negate_mul_add_f64s(*factor, scaled, *earlier);
            }
            solution.0[place] = scaled;
        }
    }
}

/// A column from which those before are taken off.
struct EliminatedColumn<'a, S: Lanes> {
    simd: S,
    /// Halves of moments, of which the matrix is made.
    halves: &'a [S::f64s; 2 * MOST],
    /// Minus the row of the pivot, over the pivots before.
    factors: &'a [S::f64s; MOST],
    /// Rows of the matrix.
    degrees: usize,
    column: usize,
    /// The row that is next.
    row: usize,
}

impl<S: Lanes> EliminatedColumn<'_, S> {
    /// Takes the columns before off this column of some rows.
    #[inline(always)]
    fn eliminate<const N: usize>(&mut self, rows: &mut [[S::f64s; MOST]; N]) {
        let (simd, column) = (self.simd, self.column % MOST);
        let mut sums = [self.factors[0]; N];
        for n in 0..N {
            let row = self.row + n;
            sums[n] = if row < self.degrees {
                simd.add_f64s(self.halves[(row + column) % (2 * MOST)], self.halves[(row - column) % (2 * MOST)])
            } else {
                rows[n][column]
            };
        }
        for (k, factor) in self.factors.iter().enumerate().take(column) {
            for n in 0..N {
                sums[n] = simd.mul_add_f64s(rows[n][k], *factor, sums[n]);
            }
        }
        for n in 0..N {
            rows[n][column] = sums[n];
        }
        self.row += N;
    }
}
