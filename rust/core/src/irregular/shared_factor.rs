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
}

impl<S: Lanes> SharedFactor<S> {
    #[inline(always)]
    pub(crate) fn zero(simd: S) -> Self {
        let zero = simd.splat_f64s(0.0);
        Self { rows: OnLines([[zero; MOST]; ROWS]), inverse: OnLines([zero; MOST]), weakest: zero }
    }

    /// Decomposes the matrix that moments make; so many rows below it hold what is to be solved for.
    #[inline(always)]
    pub(crate) fn decompose(&mut self, simd: S, degrees: usize, moments: &[S::f64s; 2 * MOST], below: usize) {
        if below > 1 {
            self.rows.0[degrees.min(MOST) + 1] = [simd.splat_f64s(0.0); MOST];
        }
        let (degrees, half) = (degrees.min(MOST), simd.splat_f64s(0.5));
        let mut halves = OnLines(*moments);
        for value in &mut halves.0[..2 * degrees - 1] {
            *value = simd.mul_f64s(*value, half);
        }
        for row in 0..degrees {
            for column in 0..=row {
                self.rows.0[row][column] = simd.add_f64s(halves.0[row + column], halves.0[row - column]);
            }
        }
        self.weakest = simd.splat_f64s(1.0);
        for column in 0..degrees {
            let diagonal = self.rows.0[column][column];
            let mut factors = [simd.splat_f64s(0.0); MOST];
            for (factor, (value, inverse)) in
                factors.iter_mut().zip(self.rows.0[column].iter().zip(&self.inverse.0)).take(column)
            {
                *factor = simd.neg_f64s(simd.mul_f64s(*value, *inverse));
            }
            let (blocks, rest) = self.rows.0[column..degrees + below].as_chunks_mut::<8>();
            for block in blocks {
                eliminate(simd, block, &factors, column);
            }
            let (blocks, rest) = rest.as_chunks_mut::<4>();
            for block in blocks {
                eliminate(simd, block, &factors, column);
            }
            let (blocks, rest) = rest.as_chunks_mut::<2>();
            for block in blocks {
                eliminate(simd, block, &factors, column);
            }
            for row in rest {
                eliminate(simd, std::array::from_mut(row), &factors, column);
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

    /// The solution `G⁻¹ b` of a row.
    #[inline(always)]
    pub(crate) fn solution(&self, simd: S, degrees: usize, row: usize) -> OnLines<S::f64s, MOST> {
        let degrees = degrees.min(MOST);
        let mut solution = OnLines(self.rows.0[row]);
        for place in (0..degrees).rev() {
            for later in place + 1..degrees {
                let off = simd.mul_f64s(self.rows.0[later][place], solution.0[later]);
                solution.0[place] = simd.sub_f64s(solution.0[place], off);
            }
            solution.0[place] = simd.mul_f64s(solution.0[place], self.inverse.0[place]);
        }
        solution
    }
}

/// Takes the columns before off a column of some rows.
#[inline(always)]
fn eliminate<S: Lanes, const N: usize>(
    simd: S,
    rows: &mut [[S::f64s; MOST]; N],
    factors: &[S::f64s; MOST],
    column: usize,
) {
    let column = column % MOST;
    let mut sums = [factors[0]; N];
    for n in 0..N {
        sums[n] = rows[n][column];
    }
    for k in 0..column {
        for n in 0..N {
            sums[n] = simd.mul_add_f64s(rows[n][k], factors[k], sums[n]);
        }
    }
    for n in 0..N {
        rows[n][column] = sums[n];
    }
}
